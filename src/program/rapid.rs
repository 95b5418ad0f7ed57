//! RAPID.

pub mod token;
pub mod lexer;
pub mod syntax;
pub mod parser;
pub mod number;
pub mod literal;
pub mod instruction;
pub mod value;
pub mod symbol;
pub mod evaluate;
pub mod modal;
mod flow;
pub mod mark;
mod task;
pub mod task_list;

pub use task::Task;
mod print;
mod rewrite;
