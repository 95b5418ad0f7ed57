//! Why an acceptance says nothing at all.

use thiserror::Error;

use super::decision::FEWEST_POSES;
use crate::identification::start::StartError;
use crate::measurement::dataset::PathPoint;

/// Why nothing can be said at all.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AcceptError {
    /// The tolerance or the uncertainty is no length.
    #[error("{name} {found}: expected a length above 0 in mm")]
    Length {
        /// Which.
        name: &'static str,
        /// What was found.
        found: f64,
    },
    /// The tolerance or the uncertainty of the orientation is no angle.
    #[error("{name} {found}: expected an angle above 0° and up to 180°")]
    Angle {
        /// Which.
        name: &'static str,
        /// What was found (°).
        found: f64,
    },
    /// The rows of the fit.
    #[error(
        "{file}: these are the rows that the model was fitted to: an acceptance needs poses that were measured for it, at least \
         {FEWEST_POSES}"
    )]
    RowsOfTheFit {
        /// The file.
        file: String,
    },
    /// All rows were read on paths.
    #[error(
        "{file}: all rows were read on paths (columns path, cycle, sample): an acceptance needs poses at which the arm stood, at least \
         {FEWEST_POSES}, whose cells there are empty"
    )]
    PathsAlone {
        /// The file.
        file: String,
    },
    /// Two rows of a path say that they are the same.
    #[error(
        "{file}, rows {} and {}: both are sampling point {} of cycle {} of path {}; expected one row for each: count the cycles", rows[0],
        rows[1], point.sample, point.cycle, point.path
    )]
    PointTwice {
        /// The file.
        file: String,
        /// What the rows are called.
        rows: [usize; 2],
        /// What both say.
        point: PathPoint,
    },
    /// The frames cannot be found.
    #[error(transparent)]
    StartError(#[from] StartError),
}
