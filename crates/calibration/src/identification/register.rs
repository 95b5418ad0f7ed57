//! Registering a sensor: its frame, the outlet of its cable and the touched point are fitted, the arm stays nominal.
//!
//! A cable that was read from one side leaves two places for its outlet. Each is fitted, and the one whose readings are
//! met best is taken.

use super::calibration::Frames;
use super::fit::{Fitted, Observations, Start, fit, frame_parameters, summary_on};
use super::identify::prepare_observations;
use super::solver::SOLVERS;
use super::start::{StartError, starts};
use super::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;

/// A sensor in its place.
#[derive(Debug, Clone)]
pub struct Registered {
    /// Frames from closed forms, where a fit of the arm starts.
    pub start: Frames,
    /// The fit of the frames alone.
    pub fitted: Fitted,
}

/// Registers the sensor of `observed` under the arm `nominal`.
///
/// # Errors
/// [`StartError`] when the rows do not determine the frames.
pub fn register(
    observed: &Observations,
    nominal: &Model,
    tolerance: &Tolerance,
) -> Result<Registered, StartError> {
    let sensing = frame_parameters(&observed.dataset);
    let (mut best, mut least_mm) = (None, f64::INFINITY);
    for frames in starts(&observed.dataset, nominal)? {
        let start = Start { model: nominal, frames: &frames };
        let fitted = fit(observed, start, &sensing, tolerance, &SOLVERS[0], 0);
        let rmse_mm = summary_on(observed, &fitted.model, &fitted.frames).rmse;
        if best.is_none() || rmse_mm < least_mm {
            least_mm = rmse_mm;
            best = Some(Registered { start: frames, fitted });
        }
    }
    best.ok_or_else(|| StartError::of(&observed.dataset, "sensor", 4))
}

/// The frames where a fit of the arm to `dataset` starts; `fuse_readout` as [`prepare_observations`] has it. Nothing is fitted where
/// closed forms leave no choice.
///
/// # Errors
/// [`StartError`] when the rows do not determine the frames.
pub fn starting_frames(
    dataset: &Dataset,
    nominal: &Model,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> Result<Frames, StartError> {
    let mut candidates = starts(dataset, nominal)?;
    if candidates.len() == 1 {
        return Ok(candidates.remove(0));
    }
    let (observed, _) = prepare_observations(dataset, nominal, fuse_readout);
    Ok(register(&observed, nominal, tolerance)?.start)
}
