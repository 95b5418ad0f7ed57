//! Tests of `measurement`.

mod import;
mod real;
mod simulation;
