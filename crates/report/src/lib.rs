//! What truegrind found, for people and for other programs: tables, pictures and whole documents.
//!
//! Two steps, kept apart. A *view* turns one result (a deviation table, an identification) into a
//! [`document::Document`] made of [`table::Table`]s, pictures from [`plot`] and verdicts. A *format* turns a table or
//! a document into text: [`format::terminal`], [`format::markdown`], [`format::csv`], [`format::json`],
//! [`format::html`]. A view knows no format and a format knows no result, so a new result needs one view, and a new
//! format one file.
//!
//! Everything here returns strings, prints nothing, opens nothing, and gives the same bytes for the same input.
//! What is absent is printed as `–`, never as 0.

pub mod number;
pub mod kept;
pub mod status;
pub mod table;
pub mod plot;
pub mod document;
pub mod repeated;
pub mod format;
pub mod identification;
pub mod diagnosis;
pub mod fleet;
pub mod study;
pub mod tracking;
pub mod deviation;
pub mod placement;
pub mod compensation;
pub mod batch;
pub mod robots;
pub mod planning;
pub mod acceptance;
