//! RAPID, the language of ABB controllers: lossless parsing, abstract interpretation, rewriting by edits.
//!
//! Data flow: bytes → [`lexer`] → [`parser`] (a [`crate::tree::Tree`] of [`token`]s and [`syntax`] nodes; never fails) →
//! [`symbol`] (scopes, call graph and side effects over all files of a task) → abstract interpretation of each routine with
//! constant evaluation ([`evaluate`], [`value`]s, [`literal`]s) and [`modal`] switches → [`Task::listing`], the
//! [`crate::motion::Listing`] of every motion of the [`instruction`] table → [`Task::rewrite`], edits for new values, with a
//! [`mark`]. In the other direction, [`writer`] makes a module from a draft.
//!
//! The lexer and the readers of literals and task lists use `nom`; the grammar is a tolerant recursive descent over the tokens,
//! because it must continue after an error and back-tracking combinators cannot tell where a broken statement ends.
//!
//! Source: ABB RAPID kernel reference (RobotWare 6, chapters 2 to 10) and instruction reference. Departures: names may be
//! longer than 32 characters and contain any byte from 0x80; data may be declared anywhere in a routine or module; a file may
//! contain several modules or none; arithmetic is in double precision where a controller uses single.

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
mod payload;
pub mod task_list;
mod print;
mod rewrite;
pub mod remainder;
pub mod writer;

pub use task::Task;
