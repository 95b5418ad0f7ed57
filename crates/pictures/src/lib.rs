//! Pictures in three dimensions and over time, for the Rerun viewer.
//!
//! The only module that names `rerun`. It turns results into a [`Recording`], whose content is the
//! bytes of an `.rrd` file, or goes to a viewer that is running. Nothing of Rerun shows in what this module takes and
//! returns.
//!
//! - [`path`]: an arm that runs a program, before and after it was rewritten;
//! - [`measured`]: a measurement file, and the residuals of whatever was fitted to it.
//!
//! **Units.** Lengths are mm, in space too: Rerun knows no unit, and programs and parts are drawn in mm. Angles are
//! degrees. Every view says so in its name. The frame is the base of the arm, z up.
//!
//! **Time.** There is one time axis, counted in points of the path ([`path::AXIS`]) or rows of the file
//! ([`measured::AXIS`]); clock time is not recorded.
//!
//! **Same input, same bytes.** Rerun's own recording stream numbers everything by the clock. [`recording`] numbers it
//! by a counter instead and names the recording by its content, so the file of the same result is the same file.
//!
//! In reading order: [`colour`], [`recording`], `page` (the layout with which a recording opens), `legend`, `curve`,
//! `markdown`, `arm` and `shape` (what pages are made of), [`path`], [`measured`].

pub mod colour;
pub mod recording;
mod page;
mod legend;
mod curve;
mod markdown;
mod arm;
mod shape;
pub mod path;
pub mod measured;

pub use arm::LinkMesh;
pub use measured::{MeasuredScene, dataset_recording, diagnosis_recording, measured_recording};
pub use path::{PathScene, Workpiece, path_recording};
pub use recording::{Recording, VisualError};
