//! 3D recordings over time for the Rerun viewer.
//!
//! The only crate that uses Rerun's SDK, which does not appear in its API. It turns results into a [`Recording`], which is written as an
//! `.rrd` file or sent to a running viewer.
//!
//! - [`path`]: an arm that runs a program, before and after correction;
//! - [`measured`]: measurements, with the residuals of fitted models.
//!
//! **Units.** Lengths are mm, angles degrees; view names state them, since Rerun has no units. The frame is the robot base, z up.
//!
//! **Time.** One time axis counts points of the path ([`path::AXIS`]) or rows of the file ([`measured::AXIS`]); clock time is not
//! recorded.
//!
//! **Reproducibility.** The recording stream of Rerun derives its ids from the clock. [`recording`] uses a counter instead and names the
//! recording by its content, so that the same result gives the same bytes.
//!
//! Modules: [`colour`], [`recording`], `page` (initial layout), `legend`, `curve`, `markdown`, `arm`, `shape`, [`path`], [`measured`].

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
