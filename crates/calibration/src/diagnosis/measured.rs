//! Diagnosis of an arm from its rows, with what is stated of sensor and target, and the test of its models on other measurements.

use thiserror::Error;

use super::diagnose::{Diagnosed, Options, diagnose};
use super::finding::DiagnoseError;
use super::transfer::new_rows;
use crate::identification::calibration::Frames;
use crate::identification::fit::summary_on;
use crate::identification::identify::prepare_observations;
use crate::identification::register::starting_frames;
use crate::identification::start::StartError;
use crate::identification::stated_placement::{PlacementError, StatedPlacement};
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;
use truegrind_math::work::report_step;

/// Why rows give no diagnosis.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeasuredError {
    /// The rows do not place the sensor.
    #[error(transparent)]
    Start(#[from] StartError),
    /// What is stated of sensor and target cannot be used.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// The diagnosis itself.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
}

/// Diagnoses the arm `(robot, nominal)` from its rows, and tests the models on its other measurements, in which only the frames are
/// refitted.
///
/// # Errors
/// [`MeasuredError`].
pub fn diagnose_rows(
    (dataset, others): (&Dataset, &[Dataset]),
    (robot, nominal): (&str, &Model),
    placement: &StatedPlacement,
    options: &Options,
) -> Result<Diagnosed, MeasuredError> {
    let frames = starting_frames(dataset, nominal, &options.tolerance, options.fuse_readout)?;
    let stated = placement.frames(dataset)?;
    let (tolerance, frames) =
        placement.prior([&options.tolerance, &options.arm_tolerance], frames, (dataset, nominal))?;
    let options = Options { tolerance, ..options.clone() };
    let mut found = diagnose(dataset, robot, nominal, &frames, &options, &|step| report_step(step))?;
    if let Some(stated) = &stated {
        let raw = raw_error(dataset, nominal, stated, options.fuse_readout);
        found.diagnosis.notes.push(format!(
            "with the stated frames the nominal arm has an error of {:.3} mm RMS (raw error, nothing fitted)",
            raw.rmse
        ));
    }
    for other in others {
        let Some(other) = new_rows(dataset, other, &mut found.diagnosis.notes) else { continue };
        report_step(&format!("testing on {}", other.file));
        let frames = starting_frames(&other, nominal, &options.tolerance, options.fuse_readout)?;
        found.test_on(&other, &frames, &options.tolerance, options.fuse_readout);
    }
    Ok(found)
}

/// Error of the nominal arm with the stated sensor frames, nothing fitted.
fn raw_error(dataset: &Dataset, nominal: &Model, stated: &Frames, fuse: bool) -> ErrorSummary {
    summary_on(&prepare_observations(dataset, nominal, fuse).0, nominal, stated)
}
