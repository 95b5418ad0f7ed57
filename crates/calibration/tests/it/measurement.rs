//! Tests of `measurement`.

mod import;
mod moments;
mod plausibility;
mod profile;
mod registration;
mod simulation;
mod split;
mod workbook;
