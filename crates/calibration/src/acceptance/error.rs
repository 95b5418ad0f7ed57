//! Errors of an acceptance test.

use thiserror::Error;

use super::decision::MIN_POSES;
use crate::identification::start::StartError;
use crate::measurement::dataset::PathPoint;

/// Largest tolerance, or uncertainty of a sensor, that can be meant (mm).
pub(super) const MAX_MM: f64 = 100.0;

/// Why an acceptance test is impossible.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AcceptError {
    /// The tolerance or the uncertainty is no positive length.
    #[error("{name} {found}: expected a length above 0 in mm, up to {MAX_MM} (50 µm are 0.05)")]
    Length {
        /// Which.
        name: &'static str,
        /// Stated value.
        found: f64,
    },
    /// The tolerance or the uncertainty of the orientation is no valid angle.
    #[error("{name} {found}: expected an angle above 0° and up to 180°")]
    Angle {
        /// Which.
        name: &'static str,
        /// Stated value (°).
        found: f64,
    },
    /// The rows of the fit.
    #[error(
        "{file}: the model was fitted to these rows: an acceptance needs poses that were not used in the fit, at least \
         {MIN_POSES}"
    )]
    RowsOfTheFit {
        /// The file.
        file: String,
    },
    /// All rows were read on paths.
    #[error(
        "{file}: all rows were measured on paths (columns path, cycle, sample): an acceptance needs at least {MIN_POSES} poses \
         measured at rest, with these cells empty"
    )]
    PathsAlone {
        /// The file.
        file: String,
    },
    /// Two rows have the same path, cycle and sample.
    #[error(
        "{file}, rows {} and {}: both are sampling point {} of cycle {} of path {}; expected one row for each: number the cycles", rows[0],
        rows[1], point.sample, point.cycle, point.path
    )]
    PointTwice {
        /// The file.
        file: String,
        /// Row numbers.
        rows: [usize; 2],
        /// Path, cycle and sample of both.
        point: PathPoint,
    },
    /// The frames cannot be found.
    #[error(transparent)]
    StartError(#[from] StartError),
}
