//! From an estimated arm and a program to a program that the real arm runs right.
//!
//! - [`cell`]: where tools and work objects come from; [`taught`]: those that were taught, under a better arm;
//!   [`mounting`]: the two of a motion, as told and as they are; [`placed`]: where a surface file puts them; [`reach`]: whether the
//!   arm is the program's at all; [`skeleton`]: the cell file that programs ask for.
//! - [`setup`]: what cell and robot say that NC programs do not; [`belonging`]: whether all of them are of one robot.
//! - [`payload`]: what the arm carries at each motion, as the program says.
//! - [`compensate`]: the main job, from a program that was read to its new bytes.
//! - [`rewrite`]: plans the rewrite of a program; [`cut`]: which motions are corrected together or not at all; [`why`]: the closed list of reasons.
//! - [`placement`]: whether the place of a path is corrected or its shape alone; [`risk`]: the chance that a cut gets worse.
//! - [`remedy`]: the cheapest measurement that would make a place known.
//! - [`undeclared`]: tools and work objects that no file declares, and what to give.
//! - [`untouched`]: the plan that changes nothing, for the nominal arm.
//! - [`curve`]: the way from target to target as the controller interpolates it; [`corner`]: how it rounds a point.
//! - [`verify`]: runs a program on an arm; [`precision`]: what single precision makes of its numbers.
//! - [`deviation`]: the points of a path and how far an arm is off at each, before and after.

pub mod deviation;
pub mod cell;
pub mod mounting;
pub mod taught;
pub mod placed;
pub mod reach;
pub mod skeleton;
pub mod payload;
pub mod why;
mod options;
mod outcome;
mod arms;
mod configured;
pub mod rewrite;
pub mod cut;
pub mod compensate;
pub mod untouched;
pub mod setup;
pub mod belonging;
mod normals;
pub mod undeclared;
pub mod placement;
pub mod risk;
mod registration;
pub mod remedy;
mod information;
mod foreseen;
mod assessment;
mod probability;
mod effort;
mod circumstance;
mod wrist;
mod course;
mod as_it_is;
mod way;
mod solved;
mod forbidden;
mod solve;
mod mountings;
pub mod verify;
pub mod precision;
pub mod curve;
pub mod corner;
mod slack;
mod segment;
mod circle;
mod strayed;
mod staying;
mod range;
mod singular;
mod notes;
mod passage;
mod speed;
