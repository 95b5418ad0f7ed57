//! From intentions to motions: surfaces to programs.

pub mod toolpath;
