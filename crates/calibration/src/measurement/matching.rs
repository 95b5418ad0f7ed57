//! A measurement file and the arm that was measured: do their units fit each other, and what are the file's angles?

use thiserror::Error;

use super::convention::AngleConvention;
use super::dataset::Dataset;
use super::plausibility::{Evidence, UnitSuspicion, plausibility};
use truegrind_arm::model::Model;

/// Why rows cannot be those of an arm.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// Another meaning of the file fits the arm far better than the stated one.
    #[error("{0}")]
    Units(Box<UnitSuspicion>),
    /// DH angles of an arm that has no way back from them.
    #[error("{robot}: its joint map cannot be inverted, so DH angles cannot be read")]
    JointMap {
        /// The arm.
        robot: String,
    },
}

/// The rows with the controller's angles, as the rest of truegrind takes them. `convention` is what the file's angles are,
/// `allow_odd_units` takes the file at its word. What is odd about the controller's own read-out is noted, since no fit needs it.
///
/// # Errors
/// [`Mismatch`].
pub fn matched(
    mut dataset: Dataset,
    robot: &str,
    nominal: &Model,
    convention: AngleConvention,
    allow_odd_units: bool,
) -> Result<Dataset, Mismatch> {
    if !allow_odd_units {
        for suspicion in plausibility(&dataset, nominal, convention) {
            match suspicion.evidence {
                Evidence::Sensor => return Err(Mismatch::Units(Box::new(suspicion))),
                Evidence::Readout => dataset.notes.push(suspicion.to_string()),
            }
        }
    }
    convention.apply(dataset, nominal).ok_or_else(|| Mismatch::JointMap { robot: robot.to_owned() })
}
