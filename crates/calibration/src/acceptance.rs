//! Acceptance: whether an estimated arm holds a stated tolerance at poses that it was not fitted to.
//!
//! Method. The sensor's frame is fitted to four fifths of the poses and each pose is judged with a frame that has not seen it
//! (five folds), or the frame is stated and nothing is fitted. The decision is the one for a measured value with an expanded
//! uncertainty U (ISO 14253-1: k = 2): accepted where the largest error and U lie within the tolerance together, refused
//! where the largest error exceeds it by more than U, open between them. Pose accuracy and repeatability (ISO 9283: thirty
//! cycles at five poses) are worked out only where so many cycles were measured.

use nalgebra::Vector3;
use thiserror::Error;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;
use truegrind_math::work::tell;

use crate::identification::calibration::Frames;
use crate::identification::fit::{Observed, errors_on};
use crate::identification::identify::observe;
use crate::identification::register::register;
use crate::identification::start::NoStart;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::split::{Split, folds, noise_floor, poses};

/// Fewer poses decide nothing.
pub const FEWEST_POSES: usize = 100;
/// Poses and cycles at each for pose accuracy and repeatability (ISO 9283).
pub const ISO_POSES: usize = 5;
/// See [`ISO_POSES`].
pub const ISO_CYCLES: usize = 30;

const FOLDS: usize = 5;
/// Joints that differ by less are the pose of the fit (°).
const SAME_DEG: f64 = 0.003;

/// What is asked.
#[derive(Debug, Clone)]
pub struct Options {
    /// The largest error that is accepted (mm).
    pub tolerance_mm: f64,
    /// Expanded uncertainty of the sensor, k = 2 (mm); else twice the scatter of repeated poses, where any was repeated.
    pub uncertainty_mm: Option<f64>,
    /// Frames that were measured by other means: then nothing is fitted.
    pub frames: Option<Frames>,
    /// Seed of the folds.
    pub seed: u64,
}

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
    /// The rows of the fit.
    #[error(
        "{file}: these are the rows that the model was fitted to: an acceptance needs poses that were measured for it, at least \
         {FEWEST_POSES}"
    )]
    RowsOfTheFit {
        /// The file.
        file: String,
    },
    /// The frames cannot be found.
    #[error(transparent)]
    NoStart(#[from] NoStart),
}

/// The decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// The largest error and the uncertainty lie within the tolerance.
    Accepted,
    /// The largest error exceeds it by more than the uncertainty.
    Refused,
    /// The uncertainty does not let it be decided.
    Open,
    /// Too few poses.
    NotEvaluated,
}

/// Where the uncertainty of the sensor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertainty {
    /// It was stated.
    Stated,
    /// Twice the scatter of repeated poses.
    Repeats,
    /// Nothing tells it, and it is left out.
    Unknown,
}

/// Pose accuracy and repeatability, the largest over the poses (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycles {
    /// Poses with enough cycles.
    pub poses: usize,
    /// Fewest cycles at one of them.
    pub cycles: usize,
    /// Pose accuracy: from where the model says the arm stands to the barycentre of where it stood.
    pub accuracy_mm: f64,
    /// Repeatability: mean distance from the barycentre and three standard deviations of it.
    pub repeatability_mm: f64,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Acceptance {
    /// Different poses.
    pub poses: usize,
    /// Rows.
    pub rows: usize,
    /// Errors of the arm of the data sheet, the sensor registered to it in the same way (mm).
    pub nominal: ErrorSummary,
    /// Errors of the estimated arm (mm): distances, or of a cable signed lengths.
    pub model: ErrorSummary,
    /// The same row by row, by the number of the row in its file.
    pub errors_mm: Vec<(usize, f64)>,
    /// Expanded uncertainty, k = 2 (mm); 0 where it is not known.
    pub uncertainty_mm: f64,
    /// Where it comes from.
    pub uncertainty: Uncertainty,
    /// The largest error that is accepted (mm).
    pub tolerance_mm: f64,
    /// The decision.
    pub decision: Decision,
    /// Pose accuracy and repeatability, where cycles were measured.
    pub cycles: Option<Cycles>,
    /// Most readings of one pose.
    pub most_cycles: usize,
    /// Smallest and largest of time (h), temperature (°C) and payload (kg), where logged.
    pub conditions: [Option<[f64; 2]>; 3],
}

/// Judges `estimated` by the rows of `dataset`.
///
/// # Errors
/// [`AcceptError`], where the rows are those of the fit, or do not tell where the sensor stands.
pub fn accept(
    dataset: &Dataset,
    estimated: &Estimated,
    options: &Options,
) -> Result<Acceptance, AcceptError> {
    length("the tolerance", options.tolerance_mm)?;
    options.uncertainty_mm.map_or(Ok(()), |mm| length("the uncertainty of the sensor", mm))?;
    if is_of_the_fit(dataset, estimated) {
        return Err(AcceptError::RowsOfTheFit { file: dataset.file.clone() });
    }
    let (observed, _) = observe(dataset, &estimated.nominal, true);
    tell("judging the arm of the data sheet");
    let nominal = errors(&observed, &estimated.nominal, options)?;
    tell("judging the estimated arm");
    let found = errors(&observed, &estimated.model, options)?;
    let model = ErrorSummary::of(found.iter().copied());
    let groups = poses(dataset);
    let (uncertainty_mm, uncertainty) = match (options.uncertainty_mm, noise_floor(dataset)) {
        (Some(mm), _) => (mm, Uncertainty::Stated),
        (None, Some(floor)) => (2.0 * floor.sigma_mm, Uncertainty::Repeats),
        (None, None) => (0.0, Uncertainty::Unknown),
    };
    Ok(Acceptance {
        poses: groups.len(),
        rows: dataset.rows.len(),
        nominal: ErrorSummary::of(nominal),
        errors_mm: dataset.rows.iter().map(|row| row.number).zip(found).collect(),
        uncertainty_mm,
        uncertainty,
        tolerance_mm: options.tolerance_mm,
        decision: decision(groups.len(), model.max, uncertainty_mm, options.tolerance_mm),
        cycles: cycles(&observed, &groups, &estimated.model, options)?,
        most_cycles: groups.iter().map(Vec::len).max().unwrap_or(0),
        conditions: [
            range(dataset, |condition| condition.time_h),
            range(dataset, |condition| condition.temperature_c),
            range(dataset, |condition| condition.payload_kg),
        ],
        model,
    })
}

fn length(name: &'static str, found: f64) -> Result<(), AcceptError> {
    if found > 0.0 && found.is_finite() { Ok(()) } else { Err(AcceptError::Length { name, found }) }
}

/// The same file, or more than half of the poses that the model keeps of its fit.
fn is_of_the_fit(dataset: &Dataset, estimated: &Estimated) -> bool {
    if !dataset.sha256.is_empty() && dataset.sha256 == estimated.provenance.sha256 {
        return true;
    }
    let samples = &estimated.region.samples_deg;
    let near = |sample: &&[f64; 6]| {
        dataset
            .rows
            .iter()
            .any(|row| sample.iter().zip(&row.joints).all(|(deg, q)| (deg - q.to_degrees()).abs() < SAME_DEG))
    };
    2 * samples.iter().filter(near).count() > samples.len()
}

/// The error of each row (mm), with frames that have not seen it.
fn errors(observed: &Observed, model: &Model, options: &Options) -> Result<Vec<f64>, NoStart> {
    if let Some(frames) = &options.frames {
        return Ok(errors_on(observed, model, frames));
    }
    let mut out = vec![f64::NAN; observed.dataset.rows.len()];
    for Split { train, test } in folds(&observed.dataset, FOLDS, options.seed) {
        let registered = register(&observed.subset(&train), model, &Tolerance::default())?;
        let errors = errors_on(&observed.subset(&test), model, &registered.fitted.frames);
        test.into_iter().zip(errors).for_each(|(row, error)| out[row] = error);
    }
    Ok(out)
}

fn decision(poses: usize, largest_mm: f64, uncertainty_mm: f64, tolerance_mm: f64) -> Decision {
    if poses < FEWEST_POSES || !largest_mm.is_finite() {
        Decision::NotEvaluated
    } else if largest_mm + uncertainty_mm <= tolerance_mm {
        Decision::Accepted
    } else if largest_mm - uncertainty_mm > tolerance_mm {
        Decision::Refused
    } else {
        Decision::Open
    }
}

fn range(dataset: &Dataset, value: fn(&Condition) -> Option<f64>) -> Option<[f64; 2]> {
    let known = dataset.rows.iter().filter_map(|row| value(&row.condition));
    known.fold(None, |range, value| {
        let [low, high] = range.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })
}

/// ISO 9283 at the poses with enough cycles, where there are enough of them and the sensor sees positions.
fn cycles(
    observed: &Observed,
    groups: &[Vec<usize>],
    model: &Model,
    options: &Options,
) -> Result<Option<Cycles>, NoStart> {
    let enough: Vec<&Vec<usize>> = groups.iter().filter(|rows| rows.len() >= ISO_CYCLES).collect();
    if enough.len() < ISO_POSES || observed.dataset.sensor == Sensor::Cable {
        return Ok(None);
    }
    let frames = match &options.frames {
        Some(frames) => frames.clone(),
        None => register(observed, model, &Tolerance::default())?.fitted.frames,
    };
    let mut out = Cycles {
        poses: enough.len(),
        cycles: enough.iter().map(|rows| rows.len()).min().unwrap_or(0),
        accuracy_mm: 0.0,
        repeatability_mm: 0.0,
    };
    for rows in enough {
        let attained: Vec<Vector3<f64>> =
            rows.iter().filter_map(|&row| seen(observed, row, &frames.base_from_sensor)).collect();
        let count = attained.len() as f64;
        let barycentre = attained.iter().sum::<Vector3<f64>>() / count;
        let distances = ErrorSummary::of(attained.iter().map(|place| (place - barycentre).norm()));
        let row = &observed.dataset.rows[rows[0]];
        let target = model.at_condition(&row.condition).forward(&row.joints) * frames.flange_from_target;
        out.accuracy_mm = out.accuracy_mm.max((target.translation.vector - barycentre).norm());
        let repeatability = distances.mean + 3.0 * distances.standard_deviation;
        out.repeatability_mm = out.repeatability_mm.max(repeatability);
    }
    Ok(Some(out))
}

/// Where a row saw the target, in the base (mm).
fn seen(observed: &Observed, row: usize, base_from_sensor: &Pose) -> Option<Vector3<f64>> {
    let place = match &observed.dataset.rows[row].reading {
        Reading::Cable(_) => return None,
        Reading::Position(place) => *place,
        Reading::Pose(pose) => pose.translation.vector,
    };
    Some((base_from_sensor * nalgebra::Point3::from(place)).coords)
}
