//! Acceptance test: whether an estimated arm meets a stated tolerance at poses not used in its fit.
//!
//! Method. The sensor's frame is fitted to four fifths of the poses, and each pose is judged with a frame fitted without it
//! (five folds); or the frame is stated and nothing is fitted. The decision follows ISO 14253-1 for an expanded uncertainty
//! U of 95.45 %, the larger of what is stated and what repeated poses scatter: accepted if largest error plus U is within the
//! tolerance, refused if the largest error exceeds it by more than U, undecided otherwise. Where U is unknown, nothing is accepted; nor by
//! poses that show too little of the arm ([`Tested`]), nor by cables, which see one of three coordinates of an error. Pose accuracy and
//! repeatability (ISO 9283: thirty cycles at five poses) are computed only if enough cycles were measured; path accuracy and repeatability
//! (ten cycles) only from rows with a position on a path. Those rows are used for nothing else, because the arm was moving.

pub mod decision;
mod error;
pub mod orientation;
pub mod path;
mod stations;
mod tested;

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Model;
use truegrind_math::statistics::{ErrorSummary, extent};
use truegrind_math::work::report_step;

use self::error::MAX_MM;
use self::orientation::Orientation;
use self::path::{PathFound, seen};
use self::stations::{StationErrors, uncounted};
use crate::identification::calibration::Frames;
use crate::identification::fit::{Observations, errors_on, orientation_errors};
use crate::identification::identify::prepare_observations;
use crate::identification::register::register;
use crate::identification::start::StartError;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::noise_floor::{noise_floor, noise_floor_rad};
use crate::measurement::repeated_poses::poses;
use crate::measurement::split::{Split, folds};

pub use self::decision::{Decision, MIN_POSES, Scatter, Uncertainty};
pub use self::error::AcceptError;
pub use self::stations::Uncounted;
pub use self::tested::{MIN_SHARE, Tested};

/// Poses and cycles at each for pose accuracy and repeatability (ISO 9283).
pub const ISO_POSES: usize = 5;
/// See [`ISO_POSES`].
pub const ISO_CYCLES: usize = 30;

const FOLDS: usize = 5;
/// Joint differences below this count as the same pose as one of the fit (°): also where one file has two decimals only.
const SAME_DEG: f64 = 0.006;
/// Ratio of the model's error to that of the data sheet above which the model is not of this arm.
const WORSE: f64 = 1.05;
/// Range of a joint in the fit from which its coverage counts (°).
const MOVED_DEG: f64 = 10.0;

/// Tolerances and uncertainties of an acceptance test.
#[derive(Debug, Clone)]
pub struct Options {
    /// The largest error that is accepted (mm).
    pub tolerance_mm: f64,
    /// Expanded uncertainty of the sensor, k = 2 (mm); the scatter of repeated poses, if there are any, where that is larger or nothing is
    /// stated.
    pub uncertainty_mm: Option<f64>,
    /// The largest accepted orientation error (rad); without it the orientation is reported and not judged.
    pub tolerance_rad: Option<f64>,
    /// Expanded uncertainty of the sensor's orientation, k = 2 (rad); if not stated, determined as for the position.
    pub uncertainty_rad: Option<f64>,
    /// Frames measured by other means; then nothing is fitted.
    pub frames: Option<Frames>,
    /// Seed of the folds.
    pub seed: u64,
}

/// Pose accuracy and repeatability, the largest over the poses (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycles {
    /// Poses with enough cycles.
    pub poses: usize,
    /// Fewest cycles at one of them.
    pub cycles: usize,
    /// Pose accuracy: distance from the position under the model to the barycentre of the attained positions.
    pub accuracy_mm: f64,
    /// Repeatability: mean distance from the barycentre and three standard deviations of it.
    pub repeatability_mm: f64,
}

/// The joint through whose range in the fit the poses turn least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// The joint (0-based).
    pub joint: usize,
    /// Its range over the poses of the test (°).
    pub tested_deg: f64,
    /// Its range in the fit (°).
    pub fitted_deg: f64,
}

impl Coverage {
    fn of(dataset: &Dataset, estimated: &Estimated) -> Option<Self> {
        let range = |joint: usize| {
            let angles = dataset.rows.iter().map(|row| row.joints[joint].to_degrees());
            let [low, high] = extent(angles);
            let region = &estimated.region;
            let fitted_deg = region.max_deg[joint] - region.min_deg[joint];
            Self { joint, tested_deg: high - low, fitted_deg }
        };
        let all = (0..6).map(range).filter(|range| range.fitted_deg > MOVED_DEG);
        all.min_by(|a, b| a.share().total_cmp(&b.share()))
    }

    /// Tested share of the range in the fit.
    pub fn share(&self) -> f64 {
        self.tested_deg / self.fitted_deg
    }
}

/// Result of an acceptance test.
#[derive(Debug, Clone)]
pub struct Acceptance {
    /// Number of different poses that count.
    pub poses: usize,
    /// Number of rows.
    pub rows: usize,
    /// Errors of the nominal arm, with the sensor registered to it in the same way (mm).
    pub nominal: ErrorSummary,
    /// Errors of the estimated arm (mm): distances, or signed lengths for a cable.
    pub model: ErrorSummary,
    /// The same for each row, with the row's number in its file.
    pub errors_mm: Vec<(usize, f64)>,
    /// Rows from small stations that show nothing of the arm.
    pub uncounted: Option<Uncounted>,
    /// Expanded uncertainty of 95.45 % (mm); 0 if unknown.
    pub uncertainty_mm: f64,
    /// Source of the uncertainty.
    pub uncertainty: Uncertainty,
    /// Scatter of repeated poses (mm), where any were repeated.
    pub scatter: Option<Scatter>,
    /// The expanded uncertainty that was stated (mm).
    pub stated_mm: Option<f64>,
    /// Whether the sensor was registered with these poses, so that the placement of base and flange is not tested.
    pub is_registered: bool,
    /// How much of the arm the poses show.
    pub tested: Tested,
    /// The largest error that is accepted (mm).
    pub tolerance_mm: f64,
    /// The decision from the position alone.
    pub decision: Decision,
    /// Result for the orientation, if the sensor measured it.
    pub orientation: Option<Orientation>,
    /// Whether a tolerance of the orientation was stated.
    pub orientation_asked: bool,
    /// Pose accuracy and repeatability, where cycles were measured.
    pub cycles: Option<Cycles>,
    /// Largest number of readings at one pose.
    pub most_cycles: usize,
    /// Whether the sensor saw only the share of each error along a cable: that can be too large for a tolerance, but not small enough.
    pub is_along_cables: bool,
    /// The measured paths; none for a cable, which measures no position.
    pub paths: Vec<PathFound>,
    /// How much of the measured region the poses cover.
    pub coverage: Option<Coverage>,
    /// Smallest and largest of time (h), temperature (°C) and payload (kg), where logged.
    pub conditions: [Option<[f64; 2]>; 3],
}

impl Acceptance {
    /// Whether the data sheet fits the readings better than the model, by more than the sensor's uncertainty: then the model is of another
    /// arm, or the arm has changed.
    pub fn is_worse_than_data_sheet(&self) -> bool {
        let further_mm = (self.model.rmse.powi(2) - self.nominal.rmse.powi(2)).max(0.0).sqrt();
        self.model.rmse > WORSE * self.nominal.rmse && further_mm > self.uncertainty_mm
    }

    /// Whether the nominal arm would be accepted by the position as well: then the poses do not show what the calibration gains.
    pub fn is_nominal_within(&self) -> bool {
        self.nominal.max + self.uncertainty_mm <= self.tolerance_mm
    }

    /// The decision over all stated tolerances. A model that is worse than the data sheet is not accepted, nor one by poses that show too
    /// little of the arm, nor by cables, since the error across a cable may be of any size; not evaluated if an orientation tolerance is
    /// stated but no orientation was measured.
    pub fn overall(&self) -> Decision {
        let orientation = self.orientation.as_ref().map_or(Decision::NotEvaluated, |found| found.decision);
        let decision = if self.orientation_asked { self.decision.and(orientation) } else { self.decision };
        match decision {
            Decision::Accepted
                if self.is_worse_than_data_sheet() || !self.tested.is_enough() || self.is_along_cables =>
            {
                Decision::Open
            }
            decision => decision,
        }
    }
}

/// Judges `estimated` with the rows of `dataset`.
///
/// # Errors
/// [`AcceptError`] if the rows are those of the fit, or do not determine the sensor's location.
pub fn accept(
    dataset: &Dataset,
    estimated: &Estimated,
    options: &Options,
) -> Result<Acceptance, AcceptError> {
    length("the tolerance", options.tolerance_mm)?;
    options.uncertainty_mm.map_or(Ok(()), |mm| length("the uncertainty of the sensor", mm))?;
    options.tolerance_rad.map_or(Ok(()), |rad| angle("the tolerance of the orientation", rad))?;
    options
        .uncertainty_rad
        .map_or(Ok(()), |rad| angle("the uncertainty of the sensor's orientation", rad))?;
    if is_of_the_fit(dataset, estimated) {
        return Err(AcceptError::RowsOfTheFit { file: dataset.file.clone() });
    }
    let logged = dataset;
    let dataset = &logged.at_unless_logged(&estimated.condition);
    let (all, _) = prepare_observations(dataset, &estimated.nominal, true);
    let observed = at_rest(&all)?;
    let paths = paths(&all, &observed, &estimated.model, options)?;
    let dataset = &observed.dataset;
    report_step("judging the nominal arm");
    let nominal = errors(&observed, &estimated.nominal, options)?;
    report_step("judging the estimated arm");
    let found = errors(&observed, &estimated.model, options)?;
    let counted = counted(&nominal, &found);
    let ([nominal, nominal_rad], [found, found_rad]) = (nominal.at(&counted), found.at(&counted));
    let model = ErrorSummary::of(found.iter().copied());
    let groups = poses(dataset);
    let tested_poses = poses(&dataset.subset(&counted)).len();
    let axes = dataset.sensor.axes();
    let scatter =
        noise_floor(dataset).map(|floor| Scatter { sigma: floor.sigma_mm, freedom: axes * floor.freedom });
    let (uncertainty_mm, uncertainty) = Uncertainty::of(options.uncertainty_mm, scatter);
    let numbers = || counted.iter().map(|&row| dataset.rows[row].number);
    let numbered = |errors: Vec<f64>| numbers().zip(errors).collect();
    let orientation = (dataset.sensor == Sensor::Pose).then(|| {
        let model = ErrorSummary::of(found_rad.iter().copied());
        let scatter =
            noise_floor_rad(dataset).map(|(sigma, freedom)| Scatter { sigma, freedom: 3 * freedom });
        let (uncertainty_rad, uncertainty) = Uncertainty::of(options.uncertainty_rad, scatter);
        let decided =
            |tolerance| Decision::of(tested_poses, model.max, (uncertainty_rad, uncertainty), tolerance);
        Orientation {
            nominal: ErrorSummary::of(nominal_rad),
            errors_rad: numbered(found_rad),
            uncertainty_rad,
            uncertainty,
            scatter,
            tolerance_rad: options.tolerance_rad,
            decision: options.tolerance_rad.map_or(Decision::NotEvaluated, decided),
            model,
        }
    });
    Ok(Acceptance {
        poses: tested_poses,
        rows: dataset.rows.len(),
        nominal: ErrorSummary::of(nominal),
        errors_mm: numbered(found),
        uncertainty_mm,
        uncertainty,
        scatter,
        stated_mm: options.uncertainty_mm,
        is_registered: options.frames.is_none(),
        tested: Tested::of(dataset, estimated, &frames(&observed, &estimated.model, options)?),
        tolerance_mm: options.tolerance_mm,
        uncounted: uncounted(&observed, &counted),
        decision: Decision::of(tested_poses, model.max, (uncertainty_mm, uncertainty), options.tolerance_mm),
        orientation,
        orientation_asked: options.tolerance_rad.is_some(),
        cycles: cycles(&observed, &groups, &estimated.model, options)?,
        most_cycles: groups.iter().map(Vec::len).max().unwrap_or(0),
        is_along_cables: dataset.sensor == Sensor::Cable,
        paths,
        coverage: Coverage::of(dataset, estimated),
        conditions: [
            range(logged, |condition| condition.time_h),
            range(logged, |condition| condition.temperature_c),
            range(logged, |condition| condition.payload_kg),
        ],
        model,
    })
}

fn length(name: &'static str, found: f64) -> Result<(), AcceptError> {
    if found > 0.0 && found <= MAX_MM { Ok(()) } else { Err(AcceptError::Length { name, found }) }
}

fn angle(name: &'static str, found_rad: f64) -> Result<(), AcceptError> {
    let found = found_rad.to_degrees();
    if found > 0.0 && found <= 180.0 { Ok(()) } else { Err(AcceptError::Angle { name, found }) }
}

/// Whether the rows are those of the fit: the same file, or more than half of the poses stored with the model.
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

/// The errors of each row, of position (mm) and orientation (rad; none if none was measured), with frames fitted without
/// the row.
fn errors(observed: &Observations, model: &Model, options: &Options) -> Result<RowErrors, StartError> {
    if options.frames.is_none() && observed.dataset.stations() > 1 {
        let StationErrors { mm, rad } = StationErrors::of(observed, model)?;
        return Ok(RowErrors { mm, rad });
    }
    let [mm, rad] = errors_of_one_station(observed, model, options)?;
    Ok(RowErrors { mm: mm.into_iter().map(Some).collect(), rad })
}

/// Errors of each row: of position (mm), `None` where it does not count, and of orientation (rad; none if none was measured).
struct RowErrors {
    mm: Vec<Option<f64>>,
    rad: Vec<f64>,
}

impl RowErrors {
    /// Those of the rows that count.
    fn at(&self, counted: &[usize]) -> [Vec<f64>; 2] {
        let rad = counted.iter().filter_map(|&row| self.rad.get(row).copied()).collect();
        [counted.iter().filter_map(|&row| self.mm[row]).collect(), rad]
    }
}

/// The rows that count for both arms.
fn counted(nominal: &RowErrors, found: &RowErrors) -> Vec<usize> {
    (0..found.mm.len()).filter(|&row| nominal.mm[row].is_some() && found.mm[row].is_some()).collect()
}

/// The same with one frame for all, or with stated ones.
fn errors_of_one_station(
    observed: &Observations,
    model: &Model,
    options: &Options,
) -> Result<[Vec<f64>; 2], StartError> {
    let count = observed.dataset.rows.len();
    if let Some(frames) = &options.frames {
        let rows: Vec<usize> = (0..count).collect();
        let turns = orientation_errors(observed, &rows, model, frames).unwrap_or_default();
        return Ok([errors_on(observed, model, frames), turns]);
    }
    let (mut position_errors, mut turns) = (vec![f64::NAN; count], vec![f64::NAN; count]);
    let mut oriented = true;
    for Split { train, test } in folds(&observed.dataset, FOLDS, options.seed) {
        let frames = register(&observed.subset(&train), model, &Tolerance::default())?.fitted.frames;
        match orientation_errors(observed, &test, model, &frames) {
            Some(errors) => test.iter().zip(errors).for_each(|(row, error)| turns[*row] = error),
            None => oriented = false,
        }
        let errors = errors_on(&observed.subset(&test), model, &frames);
        test.into_iter().zip(errors).for_each(|(row, error)| position_errors[row] = error);
    }
    Ok([position_errors, if oriented { turns } else { Vec::new() }])
}

fn range(dataset: &Dataset, value: fn(&Condition) -> Option<f64>) -> Option<[f64; 2]> {
    let known = dataset.rows.iter().filter_map(|row| value(&row.condition));
    known.fold(None, |range, value| {
        let [low, high] = range.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })
}

/// The rows measured at rest.
fn at_rest(observed: &Observations) -> Result<Observations, AcceptError> {
    let rows = &observed.dataset.rows;
    let at_rest: Vec<usize> = (0..rows.len()).filter(|&row| rows[row].path().is_none()).collect();
    match at_rest.len() {
        0 => Err(AcceptError::PathsAlone { file: observed.dataset.file.clone() }),
        count if count == rows.len() => Ok(observed.clone()),
        _ => Ok(observed.subset(&at_rest)),
    }
}

/// Path accuracy and repeatability, if paths were measured by a sensor of positions.
fn paths(
    all: &Observations,
    at_rest: &Observations,
    model: &Model,
    options: &Options,
) -> Result<Vec<PathFound>, AcceptError> {
    if all.dataset.sensor == Sensor::Cable || all.dataset.rows.len() == at_rest.dataset.rows.len() {
        return Ok(Vec::new());
    }
    path::found(all, model, &frames(at_rest, model, options)?)
}

/// The stated frames, or those that fit the rows best.
fn frames(observed: &Observations, model: &Model, options: &Options) -> Result<Frames, StartError> {
    match &options.frames {
        Some(frames) => Ok(frames.clone()),
        None => Ok(register(observed, model, &Tolerance::default())?.fitted.frames),
    }
}

/// ISO 9283 at the poses with enough cycles, if there are enough of them and the sensor measures positions.
fn cycles(
    observed: &Observations,
    groups: &[Vec<usize>],
    model: &Model,
    options: &Options,
) -> Result<Option<Cycles>, StartError> {
    let enough: Vec<&Vec<usize>> = groups.iter().filter(|rows| rows.len() >= ISO_CYCLES).collect();
    if enough.len() < ISO_POSES || observed.dataset.sensor == Sensor::Cable {
        return Ok(None);
    }
    let frames = frames(observed, model, options)?;
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
        let distances = ErrorSummary::of(attained.iter().map(|position| (position - barycentre).norm()));
        let row = &observed.dataset.rows[rows[0]];
        let target = model.at_condition(&row.condition).forward(&row.joints) * frames.flange_from_target;
        out.accuracy_mm = out.accuracy_mm.max((target.translation.vector - barycentre).norm());
        let repeatability = distances.mean + 3.0 * distances.standard_deviation;
        out.repeatability_mm = out.repeatability_mm.max(repeatability);
    }
    Ok(Some(out))
}
