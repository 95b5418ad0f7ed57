//! Output formats for tables and documents.
//!
//! For people: [`terminal`], [`markdown`] and [`html`], with the digits of each column. For programs: [`csv`], [`json`] and `parquet`,
//! with all digits. Text from files passes [`visible`] in all formats except Parquet.

pub mod visible;
pub mod words;
pub mod terminal;
pub mod markdown;
pub mod csv;
pub mod json;
pub mod html;
#[cfg(feature = "parquet")]
pub mod parquet;
