//! Why an arm cannot be tracked.

use thiserror::Error;

use crate::identification::fit::OTHER_ARM_MM;
use crate::identification::start::StartError;
use crate::measurement::dataset::Sensor;

/// Why an arm cannot be tracked.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TrackError {
    /// Not enough poses yet.
    #[error(
        "{file}: {found} poses so far, {asked} are needed to locate the sensor; run it again with more poses \
         (or lower --first-poses)"
    )]
    TooFew {
        /// File.
        file: String,
        /// Poses available.
        found: usize,
        /// Poses needed.
        asked: usize,
    },
    /// The rows do not determine the sensor's frame.
    #[error(transparent)]
    Placing(#[from] StartError),
    /// The first poses do not fit the model.
    #[error(
        "{file}: under this model the first {poses} poses leave {left_mm:.3} mm RMS along each axis, where its held-out error was \
         {held_out_mm:.3} mm along each: {}",
        what_to_do(*left_mm, *changed_mm, *sensor)
    )]
    Foreign {
        /// File.
        file: String,
        /// Sensor.
        sensor: Sensor,
        /// Poses that placed the sensor.
        poses: usize,
        /// RMS residual of one coordinate or length (mm).
        left_mm: f64,
        /// The model's held-out error, likewise (mm).
        held_out_mm: f64,
        /// RMS residual that another geometry leaves, if it explains the poses (mm).
        changed_mm: Option<f64>,
    },
    /// A set-up of the sensor with too few readings.
    #[error(
        "{file}: the {rows} rows from station {station} (column station) do not place the sensor: measure at least 4 poses that are not on one line \
         from each, and spell its name the same way in all of its rows"
    )]
    Station {
        /// File.
        file: String,
        /// The station, as the file names it.
        station: String,
        /// Its rows in a row.
        rows: usize,
    },
    /// Another sensor than before.
    #[error(
        "{file}: has {found} readings, the track so far has {expected}: start a new track with another --state"
    )]
    Sensor {
        /// File.
        file: String,
        /// Sensor of the file.
        found: &'static str,
        /// Sensor of the track.
        expected: &'static str,
    },
    /// The state file cannot be used.
    #[error("{file}: {reason}")]
    State {
        /// File.
        file: String,
        /// Why.
        reason: String,
    },
}

/// Why the state of a track cannot be read or written.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StateError {
    /// A number cannot be written.
    #[error("the state cannot be written: {0}")]
    Unwritable(String),
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("not a track of truegrind: {0}")]
    Syntax(String),
    /// An invalid number.
    #[error(
        "{key}: found {found}, expected {expected}: the file was damaged; keep it and begin a new track with another --state"
    )]
    Value {
        /// Its key.
        key: String,
        /// Value found.
        found: String,
        /// Expected values.
        expected: &'static str,
    },
}

fn what_to_do(left_mm: f64, changed_mm: Option<f64>, sensor: Sensor) -> String {
    if left_mm > OTHER_ARM_MM {
        return "these are not measurements of this arm, or their units or columns are wrong".to_owned();
    }
    if let Some(changed_mm) = changed_mm {
        return format!(
            "the arm has changed since, as another geometry leaves {changed_mm:.3} mm: identify it again and correct the original programs with \
             the new model"
        );
    }
    // One zero is fitted to all of them.
    let set_anew = match sensor {
        Sensor::Cable => {
            ". If the zero of the cable was set anew between visits, a track follows it from some 30 poses a visit on, with an alarm at each \
             (--first-poses: no more than the first visit has)"
        }
        Sensor::Position | Sensor::Pose => "",
    };
    format!(
        "no other geometry explains them, so the readings scatter more, or they are not of this arm: check sensor, target and load; --sigma \
         {left_mm:.3} starts anyway, and finds larger changes only{set_anew}"
    )
}
