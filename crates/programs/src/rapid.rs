//! RAPID, the language of ABB controllers: read without loss, evaluated as far as the text goes, rewritten by edits.
//!
//! The way of the data: bytes → [`lexer`] → [`parser`] (a [`crate::tree::Tree`] of [`token`]s and [`syntax`]
//! nodes; never fails) → [`symbol`] (names and scopes of all files of a task) → [`evaluate`] ([`literal`]s, [`value`]s,
//! constants, Offs and RelTool) along the flow of statements ([`modal`] switches, straight-line assignments) →
//! [`Task::listing`], the [`crate::motion::Listing`] of every motion of the [`instruction`] table →
//! [`Task::rewrite`], edits for new values, with a [`mark`] → and the other way round, [`writer`]: a fresh module from
//! a draft.
//!
//! The lexer and the readers of literals and task lists stand on `nom`; the grammar above them is a tolerant
//! recursive descent over the tokens, because it must go on after an error and combinators that back-track cannot
//! say where a broken statement ends.
//!
//! Source: ABB RAPID kernel reference (RobotWare 6, chapters 2 to 10) and instruction reference. Departures: names may be
//! longer than 32 characters and hold any byte from 0x80; data may stand anywhere in a routine or module; a file may
//! hold several modules or none; arithmetic is in double precision where a controller has single.

pub mod token;
pub mod lexer;
pub mod syntax;
pub mod parser;
pub mod number;
pub mod literal;
pub mod instruction;
pub mod predefined;
pub mod value;
pub mod symbol;
pub mod evaluate;
pub mod modal;
mod reaching_motions;
mod flow;
pub mod mark;
mod task;
pub mod task_list;
mod print;
mod rewrite;
pub mod writer;

pub use task::Task;
