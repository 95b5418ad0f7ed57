//! RAPID.

pub mod token;
pub mod lexer;
pub mod syntax;
pub mod parser;
