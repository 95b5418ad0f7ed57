//! Tests of `planning`.

mod poses;
mod toolpath;
