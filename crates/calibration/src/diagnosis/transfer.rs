//! Transfer test: the models of one series on another of the same arm, with only the frames refitted.
//!
//! Real effects of the arm persist on another day and in another mounting; overfitted ones do not. An arm that was another one there, or
//! that has changed in between, leaves far more than the held-out error, as `track` judges it too.

use std::borrow::Cow;
use std::collections::HashSet;

use super::cause::Cause;
use super::diagnose::Diagnosed;
use super::extension::{FreeParameters, Subject, fit};
use super::finding::Transfer;
use super::preparation::prepare;
use crate::identification::calibration::Frames;
use crate::identification::fit::{OTHER_ARM_MM, Observations, errors_on};
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Row, Sensor};
use crate::measurement::sensor::disturbance::Disturbance;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Judgement;
use truegrind_arm::model::Model;
use truegrind_math::statistics::{ErrorSummary, rms};

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
    /// The condition in which they count where rows of the other series do not say theirs.
    pub condition: &'a Condition,
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
    let (errors, _) = errors_of(other, frames, models, tolerance, fuse_readout);
    of_errors(other, &errors)
}

fn errors_of(
    other: &Dataset,
    frames: &Frames,
    models: &Models<'_>,
    tolerance: &Tolerance,
    fuse_readout: bool,
) -> ([Vec<f64>; 4], Observations) {
    let prepared = prepare(&other.at_unless_logged(models.condition), models.nominal, fuse_readout);
    let mut with_faults = frames.clone();
    with_faults.disturbances.extend_from_slice(models.faults);
    let observed = &prepared.observed;
    let registered = |(nominal, frames, evaluated_at): (&Model, &Frames, &Frames)| {
        let subject = Subject { observed, nominal, frames, evaluated_at, tolerance };
        fit(&subject, &[], FreeParameters::Frames, None)
    };
    let of_sheet = registered((models.nominal, frames, frames));
    let at = &of_sheet.frames;
    let others = [(models.geometric, frames), (models.extended, &with_faults), (models.written, frames)];
    let [geometric, extended, written] = others.map(|(model, frames)| registered((model, frames, at)));
    let errors =
        [&of_sheet, &geometric, &extended, &written].map(|fit| errors_on(observed, &fit.model, &fit.frames));
    (errors, prepared.observed)
}

/// The rows of `other` that are no copies of rows of `own`: what was fitted is no other measurement. `None` where all are others.
fn without_copies(own: &Dataset, other: &Dataset) -> Option<Dataset> {
    let key = |row: &Row| (row.joints.map(f64::to_bits), row.reading.place_mm().map(f64::to_bits));
    let fitted: HashSet<_> = own.rows.iter().map(key).collect();
    let fresh: Vec<usize> =
        (0..other.rows.len()).filter(|&i| !fitted.contains(&key(&other.rows[i]))).collect();
    (fresh.len() < other.rows.len()).then(|| other.subset(&fresh))
}

/// Fewest rows on which a model is tested.
const TESTED: usize = 10;

/// The rows of another measurement that are not those of the fit, with a note where some are; `None` where too few are left.
pub fn new_rows<'a>(own: &Dataset, other: &'a Dataset, notes: &mut Vec<String>) -> Option<Cow<'a, Dataset>> {
    let Some(others) = without_copies(own, other) else { return Some(Cow::Borrowed(other)) };
    let (copies, left) = (other.rows.len() - others.rows.len(), others.rows.len());
    let tested = left >= TESTED;
    notes.push(format!(
        "--also {}: {copies} of its {} rows are rows of {}, which the models were fitted to and which therefore test nothing: {}",
        other.file,
        other.rows.len(),
        own.file,
        if tested { format!("they are tested on the other {left}") } else { "it is left out".to_owned() }
    ));
    tested.then_some(Cow::Owned(others))
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

/// Error of the written arm over its held-out error, and its size (mm), from which the arm was another one there.
const FOREIGN: f64 = 5.0;
const FOREIGN_MM: f64 = 0.05;

/// The first of these where another geometry explains the readings, which then lowers the error by the second factor: lengths of one cable
/// are fitted closely by any geometry.
const FOREIGN_IF_CHANGED: f64 = 3.0;
const CHANGED: f64 = 1.5;
const CHANGED_CABLE: f64 = 2.5;

/// Readings beyond the parameters from which another geometry is judged.
const FREE: usize = 20;

/// What another measurement shows of an arm that is not as it was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Foreign {
    /// No arm of this type, or other units or columns.
    NotThisArm,
    /// The data sheet fits those rows better: another arm of the type, or one that has changed much.
    BelowDataSheet,
    /// Another geometry explains the readings: that leaves so much (mm RMS).
    Changed(f64),
    /// No other geometry does.
    Scatters,
}

impl Foreign {
    /// Whether the model must not be written, and not only on request.
    fn fails(self) -> bool {
        matches!(self, Foreign::NotThisArm | Foreign::BelowDataSheet)
    }

    fn says(self) -> String {
        let otherwise = "measure and diagnose the arm as it is now, or leave this file out of --also if it is of another arm";
        match self {
            Foreign::NotThisArm => {
                "these are not measurements of this arm, or a joint has the opposite sign, or units or columns are wrong: correct the file or \
                 leave it out of --also"
                    .to_owned()
            }
            Foreign::BelowDataSheet => format!(
                "the data sheet fits that measurement better, so it is of another arm of this type, or the arm has changed: {otherwise}"
            ),
            Foreign::Changed(left_mm) => format!(
                "the arm has changed, or it is another one (another geometry, fitted to those rows, leaves {left_mm:.3} mm): \
                 {otherwise}"
            ),
            Foreign::Scatters => {
                "no other geometry explains it, so the readings scatter more there, or the load was another, or it is another arm: check sensor, \
                 target and load of that measurement"
                    .to_owned()
            }
        }
    }
}

/// The error over that along each axis.
fn per_axis(sensor: Sensor) -> f64 {
    (sensor.axes() as f64).sqrt()
}

impl Diagnosed {
    /// What the readings `observed`, on which the models have `errors`, show of an arm that is not as it was fitted.
    fn foreign(
        &self,
        errors: &[Vec<f64>; 4],
        observed: &Observations,
        frames: &Frames,
        tolerance: &Tolerance,
    ) -> Option<Foreign> {
        let sensor = observed.dataset.sensor;
        let [nominal, _, _, written] = errors;
        let written_mm = rms(written)?;
        let left_mm = written_mm / per_axis(sensor);
        if left_mm > OTHER_ARM_MM {
            return Some(Foreign::NotThisArm);
        }
        let estimated = &self.estimated;
        let held_out_mm = estimated.calibrated.held_out.rmse / per_axis(estimated.provenance.sensor);
        if !(left_mm > FOREIGN_MM && left_mm > FOREIGN_IF_CHANGED * held_out_mm) {
            return None;
        }
        if differ_by(written, nominal) > SURELY {
            return Some(Foreign::BelowDataSheet);
        }
        let nominal = &estimated.model;
        let subject = Subject { observed, nominal, frames, evaluated_at: frames, tolerance };
        let another = fit(&subject, &[], FreeParameters::All, None);
        let readings = observed.dataset.rows.len() * sensor.scalars();
        let factor = if sensor == Sensor::Cable { CHANGED_CABLE } else { CHANGED };
        let another_mm = rms(&errors_on(observed, &another.model, &another.frames))?;
        let is_changed = readings >= another.parameters.len() + FREE && factor * another_mm < written_mm;
        match (is_changed, left_mm > FOREIGN * held_out_mm) {
            (true, _) => Some(Foreign::Changed(another_mm)),
            (false, true) => Some(Foreign::Scatters),
            (false, false) => None,
        }
    }

    /// Tests the models on another series of the same arm. The verdict fails where the written arm is surely worse than geometry alone
    /// there, and doubts it where it is perhaps, or where the arm was not the same there.
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
            condition: &self.estimated.condition,
        };
        let (errors, observed) = errors_of(other, frames, &models, tolerance, fuse_readout);
        let foreign = self.foreign(&errors, &observed, frames, tolerance);
        let tested = of_errors(other, &errors);
        let verdict = &mut self.estimated.verdict;
        let (geometry, written) =
            (tested.geometric_rmse_mm, tested.written_rmse_mm.unwrap_or(tested.geometric_rmse_mm));
        let compared = format!(
            "on {}, with only the sensor frames fitted, the written arm has an error of {written:.3} mm, geometry alone {geometry:.3} mm",
            tested.file
        );
        // Without causes it is the geometry of `identify`, whose weights are others: no cause is to blame.
        let sheet_mm = tested.nominal_rmse_mm;
        let has_causes = self.estimated.model.effects.len() > self.estimated.nominal.effects.len();
        if has_causes && written > WORSE * geometry {
            let surely = differ_by(&errors[3], &errors[1]) > SURELY;
            if verdict.status != Judgement::Fail {
                verdict.status = if surely { Judgement::Fail } else { Judgement::Doubtful };
            }
            verdict.reasons.insert(0, format!("{compared}: `identify` writes geometry alone").into());
        } else if let Some(foreign) = foreign {
            let status = if foreign.fails() { Judgement::Fail } else { Judgement::Doubtful };
            if verdict.status != Judgement::Fail {
                verdict.status = status;
            }
            let held_out_mm = self.estimated.calibrated.held_out.rmse;
            verdict.reasons.insert(
                0,
                format!(
                    "on {}, with only the sensor frames fitted, the written arm has an error of {written:.3} mm, the data sheet {sheet_mm:.3} mm, \
                     while the held-out error here is {held_out_mm:.3} mm: {}",
                    tested.file,
                    foreign.says()
                )
                .into(),
            );
        } else {
            verdict.reasons.push(compared.into());
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
