//! Tests of `measurement`.

mod import;
mod join_by_time;
mod matching;
mod plausibility;
mod foreign;
mod registration;
mod simulation;
mod split;
mod workbook;
