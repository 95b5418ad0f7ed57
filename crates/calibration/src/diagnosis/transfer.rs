//! Transfer test: the models of one series on another of the same arm, with only the frames refitted.
//!
//! Real effects of the arm persist on another day and in another mounting; overfitted ones do not.

use super::cause::Cause;
use super::diagnose::Diagnosed;
use super::extension::{Freedom, Subject, fit};
use super::finding::Transfer;
use super::preparation::prepare;
use crate::identification::calibration::Frames;
use crate::identification::fit::errors_on;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use crate::measurement::sensor::disturbance::Disturbance;
use truegrind_arm::estimated::Judgement;
use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

/// Models of one series.
#[derive(Debug, Clone, Copy)]
pub struct Models<'a> {
    /// Data sheet.
    pub nominal: &'a Model,
    /// Geometry.
    pub geometric: &'a Model,
    /// With all causes.
    pub extended: &'a Model,
    /// Faults of the arm that no model file can represent, part of the extended model.
    pub faults: &'a [Disturbance],
    /// For compensation.
    pub written: &'a Model,
}

/// Root mean square errors (mm) of models on `other`, with the frames refitted, links and effects unchanged. `fuse_readout` as for the
/// models.
pub fn transfer(
    other: &Dataset,
    frames: &Frames,
    models: &Models<'_>,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> Transfer {
    let errors = errors_of(other, frames, models, tolerance, fuse_readout);
    of_errors(other, &errors)
}

fn errors_of(
    other: &Dataset,
    frames: &Frames,
    models: &Models<'_>,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> [Vec<f64>; 4] {
    let prepared = prepare(other, models.nominal, fuse_readout);
    let mut with_faults = frames.clone();
    with_faults.disturbances.extend_from_slice(models.faults);
    let all = [
        (models.nominal, frames),
        (models.geometric, frames),
        (models.extended, &with_faults),
        (models.written, frames),
    ];
    all.map(|(model, frames)| {
        let subject = Subject { observed: &prepared.observed, nominal: model, frames, tolerance };
        let registered = fit(&subject, &[], Freedom::Frames, None);
        errors_on(&prepared.observed, &registered.model, &registered.frames)
    })
}

fn of_errors(other: &Dataset, errors: &[Vec<f64>; 4]) -> Transfer {
    let rmse = |errors: &Vec<f64>| ErrorSummary::of(errors.clone()).rmse;
    let [nominal, geometric, extended, written] = errors;
    Transfer {
        file: other.file.clone(),
        rows: other.rows.len(),
        nominal_rmse_mm: rmse(nominal),
        geometric_rmse_mm: rmse(geometric),
        extended_rmse_mm: rmse(extended),
        written_rmse_mm: Some(rmse(written)),
    }
}

/// Ratio of the written arm's error on another series to that of geometry from which it counts as worse.
const WORSE: f64 = 1.05;

/// The same in standard errors of the mean difference of the squared errors.
const SURELY: f64 = 2.0;

impl Diagnosed {
    /// Tests the models on another series of the same arm. The verdict fails where the written arm is surely worse than geometry alone
    /// there, and doubts it where it is perhaps.
    pub fn test_on(&mut self, other: &Dataset, frames: &Frames, tolerance: &Tolerance, fuse_readout: bool) {
        let faults: Vec<Disturbance> = self
            .extended
            .causes
            .iter()
            .filter_map(|cause| match cause {
                Cause::Measurement(disturbance) if cause.is_in_arm() => Some(disturbance.clone()),
                _ => None,
            })
            .collect();
        let models = Models {
            nominal: &self.estimated.nominal,
            geometric: &self.geometric.model,
            extended: &self.extended.model,
            faults: &faults,
            written: &self.estimated.model,
        };
        let errors = errors_of(other, frames, &models, tolerance, fuse_readout);
        let tested = of_errors(other, &errors);
        let verdict = &mut self.estimated.verdict;
        let (geometry, written) =
            (tested.geometric_rmse_mm, tested.written_rmse_mm.unwrap_or(tested.geometric_rmse_mm));
        let compared = format!(
            "on {}, with only the sensor frames fitted, the written arm has an error of {written:.3} mm, geometry alone {geometry:.3} mm",
            tested.file
        );
        // Without causes it is the geometry of `identify`, whose weights are others: no cause is to blame.
        let has_causes = self.estimated.model.effects.len() > self.estimated.nominal.effects.len();
        if has_causes && written > WORSE * geometry {
            let surely = differ_by(&errors[3], &errors[1]) > SURELY;
            if verdict.status != Judgement::Fail {
                verdict.status = if surely { Judgement::Fail } else { Judgement::Doubtful };
            }
            verdict.reasons.insert(0, format!("{compared}: `identify` writes geometry alone"));
        } else {
            verdict.reasons.push(compared);
        }
        self.diagnosis.verdict = Some(verdict.clone());
        self.diagnosis.transfers.push(tested);
    }
}

/// Mean difference of squares, in its standard errors.
fn differ_by(one: &[f64], other: &[f64]) -> f64 {
    let differences: Vec<f64> = one.iter().zip(other).map(|(a, b)| a * a - b * b).collect();
    let n = differences.len().max(2) as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    mean / (variance / n).sqrt().max(f64::MIN_POSITIVE)
}
