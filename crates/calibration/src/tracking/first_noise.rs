//! What the first poses of a track say of the sensor: where it stands, and how much its readings scatter.
//!
//! They were measured after the model was made, so that an arm that has changed since shows in them as scatter. If another geometry
//! explains them, the scatter is the model's held-out error, and the filter finds the change. Readings that are grossly wrong take no part.

use super::error::TrackError;
use super::options::Options;
use crate::identification::calibration::Frames;
use crate::identification::fit::{
    Fitted, Observations, Start, errors_on, fit, frame_parameters, sigma_per_median,
};
use crate::identification::register::register;
use crate::identification::solver::SOLVERS;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Sensor;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_math::statistics::median;

/// Readings beyond the parameters from which another geometry is judged.
const FREE: usize = 20;

/// Where the sensor stands and what it scatters.
pub(super) struct FirstPoses {
    pub(super) frames: Frames,
    pub(super) sigma_mm: f64,
    pub(super) sigma_rad: f64,
}

/// A row is grossly wrong beyond this many robust standard deviations of the registration.
const GROSS: f64 = 6.0;

/// Largest share of such rows.
const GROSS_SHARE: f64 = 0.2;

/// Residuals of the first poses above this multiple of the held-out error, and above this size, mean another arm.
const FOREIGN: f64 = 5.0;
const FOREIGN_MM: f64 = 0.05;

/// Residuals of the first poses that are no larger than this multiple of the held-out error are its chance.
const CHANCE: f64 = 1.25;

/// The arm has changed if another geometry lowers the residuals of the first poses by this factor: lengths that one cable reads are
/// fitted closely by any geometry, and need more poses than the default.
const CHANGED: f64 = 1.5;
const CHANGED_CABLE: f64 = 2.5;

impl FirstPoses {
    /// Registers the sensor with `observed` under a model.
    pub(super) fn of(
        model: &Estimated,
        observed: &Observations,
        options: &Options,
    ) -> Result<Self, TrackError> {
        let dataset = &observed.dataset;
        let axes = dataset.sensor.axes() as f64;
        let unexplained_mm = model.calibrated.held_out.rmse / axes.sqrt();
        let (kept, fitted) = robust_registration(model, observed, unexplained_mm)?;
        // Residuals of the few poses that registered the sensor underestimate the noise; the held-out error of the
        // identification is its lower bound.
        let left_mm = fitted.sigma_mm;
        let mut sigma_mm = options.sigma_mm.unwrap_or(left_mm.max(unexplained_mm));
        let mut sigma_rad = fitted.sigma_rad;
        if options.sigma_mm.is_none() && unexplained_mm > 0.0 && left_mm > CHANCE * unexplained_mm {
            let parameters: Vec<Parameter> =
                arm_parameters(&model.model).into_iter().chain(frame_parameters(dataset)).collect();
            let start = Start { model: &model.model, frames: &fitted.frames };
            let another = fit(&kept, start, &parameters, &Tolerance::default(), &SOLVERS[0], 0);
            let readings = kept.dataset.rows.len() * kept.dataset.sensor.scalars();
            let changed = if dataset.sensor == Sensor::Cable { CHANGED_CABLE } else { CHANGED };
            let is_changed = readings >= parameters.len() + FREE && changed * another.sigma_mm < left_mm;
            if left_mm > FOREIGN * unexplained_mm && left_mm > FOREIGN_MM {
                return Err(TrackError::Foreign {
                    file: dataset.file.clone(),
                    sensor: dataset.sensor,
                    poses: options.first_poses,
                    left_mm,
                    held_out_mm: unexplained_mm,
                    changed_mm: is_changed.then_some(another.sigma_mm),
                });
            }
            if is_changed {
                (sigma_mm, sigma_rad) = (another.sigma_mm.max(unexplained_mm), another.sigma_rad);
            }
        }
        Ok(Self { frames: fitted.frames, sigma_mm, sigma_rad })
    }
}

/// The rows without those that are grossly wrong, and their registration.
fn robust_registration(
    model: &Estimated,
    observed: &Observations,
    unexplained_mm: f64,
) -> Result<(Observations, Fitted), TrackError> {
    let count = observed.dataset.rows.len();
    let mut kept: Vec<usize> = (0..count).collect();
    loop {
        let here = observed.subset(&kept);
        let fitted = register(&here, &model.model, &Tolerance::default())?.fitted;
        let errors: Vec<f64> =
            errors_on(&here, &fitted.model, &fitted.frames).into_iter().map(f64::abs).collect();
        let scale = sigma_per_median(here.dataset.sensor) * median(&errors).unwrap_or(0.0);
        let worst = (0..errors.len()).max_by(|a, b| errors[*a].total_cmp(&errors[*b]));
        match worst {
            Some(worst)
                if errors[worst] > GROSS * scale.max(unexplained_mm)
                    && (count - kept.len() + 1) as f64 <= GROSS_SHARE * count as f64 =>
            {
                kept.remove(worst);
            }
            _ => return Ok((here, fitted)),
        }
    }
}
