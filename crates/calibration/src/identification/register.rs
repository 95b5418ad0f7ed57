//! Sensor registration: fits the sensor's frame, cable outlet and target with the nominal arm.
//!
//! Cable readings from one side are consistent with two outlets. Both are fitted, and the one with the smaller residual is
//! returned.

use super::calibration::Frames;
use super::fit::{Fitted, Observations, Start, fit, frame_parameters, summary_on};
use super::identify::prepare_observations;
use super::solver::SOLVERS;
use super::start::{StartError, candidate_frames};
use super::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;

/// A registered sensor.
#[derive(Debug, Clone)]
pub struct Registered {
    /// Closed-form frames, the initial guess for a fit of the arm.
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
    for frames in candidate_frames(&observed.dataset, nominal)? {
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

/// Initial frames for a fit of the arm to `dataset`; `fuse_readout` as in [`prepare_observations`]. Nothing is fitted if the
/// closed form is unique.
///
/// # Errors
/// [`StartError`] when the rows do not determine the frames.
pub fn starting_frames(
    dataset: &Dataset,
    nominal: &Model,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> Result<Frames, StartError> {
    let mut candidates = candidate_frames(dataset, nominal)?;
    if candidates.len() == 1 {
        return Ok(candidates.remove(0));
    }
    let (observed, _) = prepare_observations(dataset, nominal, fuse_readout);
    Ok(register(&observed, nominal, tolerance)?.start)
}
