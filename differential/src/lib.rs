//! A differential test of `truegrind compensate`.
//!
//! Random RAPID and NC programs are corrected by truegrind. The original and the corrected program then run under
//! interpreters that share no code with truegrind's own analysis: their own lexers, parsers, evaluators and kinematics,
//! written from the manuals' semantics. What the *actual* arm does in both runs is compared:
//!
//! - a motion whose numbers changed reaches, on the actual arm, what the program meant;
//! - a motion that was left goes exactly where it always went;
//! - everything else that the program does (texts, outputs, waits) is the same, in the same order.
//!
//! `cargo run --release -p truegrind-differential --example differential -- 100000` runs it.
//!
//! Only [`under_test`] names truegrind. Lengths are in mm, angles in rad.

pub mod arm;
pub mod joint_map;
pub mod model;
pub mod nc;
pub mod outcome;
pub mod play;
pub mod rapid;
pub mod report;
pub mod stated;
pub mod under_test;
