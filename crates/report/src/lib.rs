//! Reports of results for people and for programs: tables, plots and documents.
//!
//! A *view* turns one result (a deviation table, an identification) into a [`document::Document`] of [`table::Table`]s, plots from
//! [`plot`] and verdicts. A *format* turns a table or a document into text: [`format::terminal`], [`format::markdown`],
//! [`format::csv`], [`format::json`], [`format::html`]. Views do not depend on formats, nor formats on results, so a new result needs
//! one view and a new format one file.
//!
//! All functions are pure: they return strings and give the same bytes for the same input. A missing value is printed as `–`,
//! never as 0.

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
