//! From an estimated arm and a program to a program that the real arm runs right.
//!
//! - [`cell`]: where tools and work objects come from; [`mounting`]: the two of a motion, as told and as they are.
//! - [`rewrite`]: plans the rewrite of a program; [`why`]: the closed list of reasons.
//! - [`course`]: the way from target to target as the controller interpolates it; [`corner`]: how it rounds a point.
//! - [`verify`]: runs a program on an arm; [`precision`]: what single precision makes of its numbers.
//! - [`deviation`]: the points of a path and how far an arm is off at each, before and after.

pub mod deviation;
pub mod cell;
pub mod mounting;
pub mod why;
pub mod rewrite;
mod solve;
mod mountings;
pub mod verify;
pub mod precision;
pub mod course;
pub mod corner;
mod segment;
mod circle;
mod passage;
mod speed;
