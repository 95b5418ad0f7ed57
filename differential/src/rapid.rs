//! RAPID: random programs, an interpreter written from the manuals, and what their correction does to the arm.

pub mod builtin;
pub mod check;
pub mod course;
pub mod lexer;
pub mod make;
pub mod parser;
pub mod run;
#[cfg(test)]
mod tests;
pub mod value;

pub use check::{Features, Shown, run, shown};
