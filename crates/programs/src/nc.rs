//! NC programs (G-code) of five-axis machines and of robots that run them: lossless reading, block-by-block
//! interpretation, rewriting word by word.
//!
//! Data flow: bytes → [`dialect`] (which control) → [`lexer`] → [`parser`] (a [`crate::tree::Tree`] of blocks and
//! words; never fails) → [`Task::read`], an abstract interpreter of the control's modal state, [`expression`]s and
//! [`arc`]s → [`Task::listing`], the same [`crate::motion::Listing`] as of RAPID → [`Task::rewrite`]. [`writer`]
//! makes new programs.
//!
//! A pose is X Y Z with A B C in the convention of the robot file ([`orientation::Angles`]), or with a tool vector.
//! Work offsets and tools that the text does not hold come from the [`setup`].
//!
//! Source: ISO 6983-1 (words, G00 to G03, G17 to G19, G90, G91); Fanuc series 30i operator's manual (G43.4, G43.5,
//! G92, custom macros); Siemens SINUMERIK 840D sl programming manuals "Fundamentals" and "Job planning" (AC, IC,
//! frames, TRAORI, A3 B3 C3); LinuxCNC G-code reference; Heidenhain iTNC 530 user's manual (conversational).
//! Departures: paths other than lines and arcs (splines, cycles, threads, contours) are listed and not modified;
//! blocks are interpreted in the order of the text, with joins at every possible jump target.

pub mod token;
pub mod dialect;
pub mod syntax;
pub mod lexer;
pub mod expression;
pub mod parser;
pub mod orientation;
pub mod arc;
pub mod setup;
pub mod mark;
pub mod called;
mod modal_group;
mod modal_state;
mod preceding;
mod task;
mod rewrite;
pub mod remainder;
pub mod writer;

pub use task::Task;
