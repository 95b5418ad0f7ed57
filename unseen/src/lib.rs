//! A judge of `truegrind diagnose` on what its catalogue does not hold.
//!
//! A simulated arm is measured while something is wrong with it, with the sensor, with the set-up or with the log, in a form
//! that the diagnosis has not: links that warm up unequally, springs that harden, gears whose error depends on a second joint, a
//! wire over a pulley, a clock that lags. The rows go through the public import as a user's file would, the diagnosis is
//! read from its JSON and from its model file, and what it says is held against what was hidden ([`truth`]).
//!
//! `cargo run --release -p truegrind-unseen --example unseen -- [runs] [kinds…]` prints the marks.
//!
//! Kinematics, statics, sensors and effects are written for this crate alone; only [`under_test`] names truegrind. The rows of
//! the simulator's table: [`arms`] and [`designs`] say what is measured, [`sensors`] by what, [`hidden`] what is wrong,
//! [`worth`] how much of it geometry could never explain, [`case`] puts them together. [`score`] judges one run, [`report`] all;
//! [`file`](mod@file) asks of a file that somebody measured whether its findings stand.
//! Lengths are in mm, angles in rad, times in h.

pub mod arms;
pub mod case;
pub mod designs;
pub mod draw;
pub mod file;
pub mod hidden;
pub mod report;
pub mod score;
pub mod sensors;
pub mod shape;
pub mod stability;
pub mod statistics;
pub mod table;
pub mod truth;
pub mod under_test;
pub mod worth;
