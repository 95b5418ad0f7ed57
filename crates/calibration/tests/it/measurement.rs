//! Tests of `measurement`.

mod import;
mod plausibility;
mod profile;
mod registration;
mod simulation;
mod split;
mod workbook;
