//! Checks a measurement file against the arm that was measured, converts its angles to the controller's, leaves out copied rows and brings
//! the others into the order of measuring.

use std::borrow::Cow;

use thiserror::Error;

use super::axis_range::note_joints_out_of_range;
use super::convention::AngleConvention;
use super::copies::without_copies;
use super::dataset::Dataset;
use super::measuring_order::in_order_of_measuring;
use super::plausibility::{
    ComparedReading, PayloadSuspicion, UnitSuspicion, implausible_temperature, implausible_time, plausibility,
};
use super::reach::without_impossible_readings;
use super::reversed_sides::note_reversed_sides;
use super::stations::{StationError, in_frame_of_first, rows_of_stations};
use truegrind_arm::model::Model;

/// Why a measurement file does not match an arm.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// Another interpretation of the file's units fits the arm far better than the stated one.
    #[error("{0}")]
    Units(Box<UnitSuspicion>),
    /// The clock or the thermometer is in another unit.
    #[error("{0}")]
    Condition(String),
    /// A logged payload is far above the rated one.
    #[error("{0}")]
    Payload(PayloadSuspicion),
    /// DH angles of an arm whose joint map is singular.
    #[error("{robot}: its joint map cannot be inverted, so DH angles cannot be read")]
    JointMap {
        /// The arm.
        robot: String,
    },
    /// A station of the tracker cannot be placed.
    #[error(transparent)]
    Station(#[from] StationError),
}

/// The rows with the controller's angles, in the order of measuring, without copies and with the readings of all stations in the frame of the
/// first. `convention` states what the file's angles are;
/// `allow_odd_units` skips the check of units. An implausible read-out of the controller is only noted, since no fit needs it.
///
/// # Errors
/// [`Mismatch`].
pub fn prepare_rows(
    mut dataset: Dataset,
    robot: &str,
    nominal: &Model,
    convention: AngleConvention,
    allow_odd_units: bool,
) -> Result<Dataset, Mismatch> {
    if !allow_odd_units {
        if let Some(why) = implausible_time(&dataset).or_else(|| implausible_temperature(&dataset)) {
            return Err(Mismatch::Condition(why));
        }
        without_impossible_readings(&mut dataset, nominal);
        for suspicion in plausibility(&of_largest_station(&dataset), nominal, convention) {
            match suspicion.compared {
                ComparedReading::Sensor => return Err(Mismatch::Units(Box::new(suspicion))),
                ComparedReading::Readout => dataset.notes.push(suspicion.to_string()),
            }
        }
    }
    let dataset = in_order_of_measuring(without_copies(dataset));
    let mut dataset =
        convention.apply(dataset, nominal).ok_or_else(|| Mismatch::JointMap { robot: robot.to_owned() })?;
    note_joints_out_of_range(&mut dataset, &nominal.limits);
    note_reversed_sides(&mut dataset);
    in_frame_of_first(&mut dataset, nominal)?;
    Ok(dataset)
}

/// The rows of the station with the most rows, all of which are in one frame.
fn of_largest_station(dataset: &Dataset) -> Cow<'_, Dataset> {
    if dataset.stations() < 2 {
        return Cow::Borrowed(dataset);
    }
    let rows = rows_of_stations(dataset).into_iter().max_by_key(Vec::len).unwrap_or_default();
    Cow::Owned(dataset.subset(&rows))
}
