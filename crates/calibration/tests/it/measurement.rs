//! Tests of `measurement`.

mod import;
mod plausibility;
mod registration;
mod simulation;
mod split;
mod workbook;
