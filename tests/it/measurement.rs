//! Tests of `measurement`.

mod import;
mod plausibility;
mod real;
mod registration;
mod simulation;
mod split;
mod workbook;
