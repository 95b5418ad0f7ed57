//! Formats: each turns a table, and where it makes sense a whole document, into text or bytes.
//!
//! For people: [`terminal`], [`markdown`], [`html`], with the digits each column asks for. For programs: [`csv`],
//! [`json`] and `parquet`, with every digit. Words that came from files pass [`visible`] in all of them but Parquet.

pub mod visible;
pub mod terminal;
pub mod markdown;
pub mod csv;
pub mod json;
pub mod html;
#[cfg(feature = "parquet")]
pub mod parquet;
