//! Corrects a robot program so that the estimated arm follows the intended path.
//!
//! [`compensate::compensate`] is the main job. The data flow, in order:
//!
//! - [`options`]: bounds and choices of a correction.
//! - [`cell`]: the cell file: robot, angle convention, origins of tools and work objects, external axes.
//! - [`frames`]: each pair of tool and work object, as programmed and as the estimated arm makes it.
//! - `arms`, `configuration`, `search_budget`: nominal and estimated arm, which solution a configuration selects, and how
//!   many evaluations a program may cost.
//! - [`condition`]: payload and backlash sides under which the estimated arm reaches each target.
//! - `target`: original joints, intended pose, corrected joints and commanded pose of every target.
//! - `backlash`: from which side each joint arrives, and the links within their play along a segment.
//! - [`segment`]: the path between two targets: interpolation, corners, deviation, inserted targets, joint speed.
//! - [`cut`]: motions that are corrected together or not at all.
//! - `feasibility`: which motions must stay unchanged: bounds, joint limits, singularities, arcs, the rest of a cut.
//! - [`risk`]: whether place or only shape of a path is corrected, the probability of harm, and the cheapest remedy.
//! - [`plan`]: the planned changes, with outcome and reason of every motion.
//! - [`compensate`]: plan and writer, repeated until both agree.
//! - [`verify`]: runs a program on an arm; [`deviation`]: the resulting path deviations.

mod arms;
mod backlash;
pub mod cell;
pub mod compensate;
pub mod condition;
mod configuration;
pub mod cut;
pub mod line_list;
pub mod deviation;
pub mod feasibility;
pub mod frames;
pub mod options;
pub mod plan;
pub mod risk;
mod search_budget;
pub mod segment;
mod target;
pub mod verify;
