//! Identification of one data set: read-out fusion, outlier rejection, split, fit, verdict.

use thiserror::Error;

use rayon::prelude::*;

use crate::identification::benefit::{Benefit, NoBenefit, benefit};
use crate::identification::beyond_noise::{BeyondNoise, joint_errors_rad, longer_tool, mean_square_of};
use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::identification::fit::{
    Fitted, OTHER_ARM_MM, OUTLIER_CUT, Observations, Outliers, Start, WRONG_ORIENTATION_RAD, errors_on, fit,
    frame_parameters, median_orientation_error, orientation_errors, outliers, summary_on,
};
use crate::identification::identifiability::Identifiability;
use crate::identification::inflation::inflation_from_rows;
use crate::identification::linearised_readings::widen_by_scale;
use crate::identification::misreading;
use crate::identification::mixed_rows::{MixedRows, mixed_rows};
use crate::identification::parameter_table::parameter_table;
use crate::identification::prior_width::width_uncertainty;
use crate::identification::repeats::Repeats;
use crate::identification::rounded_log::{Asked, Rounding, spent};
use crate::identification::rounding::{NotFused, ReadoutFusion, rounding_floor_mm};
use crate::identification::sessions::set_up_anew;
use crate::identification::shifted_rows;
use crate::identification::solver::{Family, SOLVERS, Scope, Solver};
use crate::identification::start::count_distinct_poses;
use crate::identification::tolerance::Tolerance;
use crate::identification::unseen_target::unseen_target;
use crate::identification::verdict::{Limits, VerdictBuilder};
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::noise_floor::{self, NoiseFloor};
use crate::measurement::split::Split;
use crate::measurement::stations::without_frames;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{
    Estimated, EstimatedParameter, Judgement, Provenance, Reason, ReasonKind, StageErrors, Verdict,
    WidthUncertainty,
};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, arm_parameters, link_parameters};
use truegrind_arm::region::Region;
use truegrind_estimation::estimate::Termination;
use truegrind_estimation::problem::Problem;
use truegrind_math::sentence::listed;
use truegrind_math::statistics::{ErrorSummary, largest, median};
use truegrind_math::work::{checkpoint, report_step};

/// Settings of an identification.
#[derive(Debug, Clone)]
pub struct Options {
    /// Priors.
    pub tolerance: Tolerance,
    /// Method.
    pub solver: &'static Solver,
    /// Share of held-out rows.
    pub held_out: f64,
    /// Seed of the split.
    pub seed: u64,
    /// Whether to fuse the controller's Cartesian read-out into rounded angles.
    pub fuse_readout: bool,
    /// Largest held-out RMSE with which the fit passes (mm).
    pub limit_rmse_mm: Option<f64>,
    /// Largest held-out error with which the fit passes (mm).
    pub limit_max_mm: Option<f64>,
    /// Frames measured by other means; raw errors exist only with them.
    pub stated_frames: Option<Frames>,
}

impl Default for Options {
    /// Levenberg–Marquardt with ordinary tolerances; a fifth of the rows is held out.
    fn default() -> Self {
        Self {
            tolerance: Tolerance { learn_widths: true, ..Tolerance::default() },
            solver: &SOLVERS[0],
            held_out: 0.2,
            seed: 0,
            fuse_readout: true,
            limit_rmse_mm: None,
            limit_max_mm: None,
            stated_frames: None,
        }
    }
}

/// Why identification is impossible.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Fewer scalar readings than parameters.
    #[error(
        "{file}: {rows} rows at {poses} different poses of the arm leave {scalars} independent readings after {held_out} are \
         held out, for {parameters} parameters: measure at least {needed} poses (`truegrind plan` chooses 60)"
    )]
    TooFewRows {
        /// File.
        file: String,
        /// Rows there are.
        rows: usize,
        /// Distinct poses among them: a repeated reading adds no information on the arm.
        poses: usize,
        /// Scalar readings left for the fit.
        scalars: usize,
        /// Rows held out.
        held_out: usize,
        /// Parameters.
        parameters: usize,
        /// Rows needed.
        needed: usize,
    },
    /// The error with fitted frames exceeds any arm's tolerance.
    #[error(
        "{file}: with fitted frames, robot {robot} still differs from the readings by {rmse_mm:.1} mm RMS, more than any arm \
         differs from its data sheet{}", misreading::advice(explanation.as_deref())
    )]
    WrongArm {
        /// File.
        file: String,
        /// Robot.
        robot: String,
        /// RMS (mm).
        rmse_mm: f64,
        /// What the readings may be instead, where something explains them.
        explanation: Option<String>,
    },
    /// The orientations with fitted frames are not those of the arm.
    #[error(
        "{file}: with fitted frames, the orientations differ from those of robot {robot} by {deg:.0}° in half of the rows, more than any arm \
         differs from its data sheet: check the order of measured_qw to measured_qz and that they belong to these rows, or delete these \
         columns to use the positions alone"
    )]
    WrongOrientation {
        /// File.
        file: String,
        /// Robot.
        robot: String,
        /// Median angle (°).
        deg: f64,
    },
}

/// Result of an identification.
#[derive(Debug, Clone)]
pub struct Identification {
    /// The estimated arm, fitted to all rows except outliers.
    pub estimated: Estimated,
    /// Its expected benefit; absent for methods as printed, which give no model.
    pub benefit: Option<Benefit>,
    /// The fit of geometry to all rows.
    pub geometry: Fitted,
    /// The fit of the frames alone to all rows.
    pub registered: Fitted,
    /// The fit of geometry to the training rows, which the held-out errors belong to.
    pub training: Fitted,
    /// Errors with stated frames; absent without.
    pub raw: Option<ErrorSummary>,
    /// Identifiability of the parameters.
    pub identifiability: Option<Identifiability>,
    /// Result of the read-out fusion, or why there was none.
    pub readout_fusion: Result<ReadoutFusion, NotFused>,
    /// Rejected rows.
    pub outliers: Outliers,
    /// Held-out rows by their number in the file, with the error before (registered) and after (geometry) (mm).
    pub held_out: Vec<(usize, f64, f64)>,
    /// Orientation errors of the held-out rows with geometry (rad), where the sensor measures orientations.
    pub held_out_orientation: Option<ErrorSummary>,
    /// Names and values ± σ of all free parameters, those of the measurement included.
    pub parameters: Vec<EstimatedParameter>,
}

/// Identifies `nominal` (catalogue name `robot`) from `dataset`, starting from `frames`; `split` divides the rows that are not
/// outliers.
///
/// # Errors
/// [`IdentifyError`] if no fit is possible. A poor fit is no error: see its verdict.
pub fn identify(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    frames: &Frames,
    split: &dyn Fn(&Dataset) -> Split,
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let (observed, readout_fusion, outliers) =
        observations_without_outliers(dataset, nominal, frames, options)?;
    let prepared = options.solver.prepare_model(nominal, dataset);
    let nominal = &prepared;
    // Before the fits, to limit peak memory.
    let scatter = noise_floor::noise_floor_beside_shift(&observed.dataset).filter(NoiseFloor::is_known);
    let region = Region::of(observed.dataset.rows.iter().map(|row| &row.joints), 0.0);
    let (fitted_rows, held_rows) = {
        let Split { train, test } = split(&observed.dataset);
        (observed.subset(&train), observed.subset(&test))
    };
    let sensing = frame_parameters(&observed.dataset);
    let everything = options.solver.parameters(nominal, &sensing);
    let stages = Stages { nominal, frames, sensing: &sensing, everything: &everything, options };
    let trained = fit_training_rows(&stages, &fitted_rows, &held_rows)
        .map_err(|found| found.error(dataset, robot, nominal))?;
    // A method as printed has no priors, of which a benefit is made.
    let variance_inflation =
        (!options.solver.as_printed).then(|| inflation_from_rows(&trained.training, &held_rows));
    drop((fitted_rows, held_rows));
    // The final model, from all rows.
    report_step("fitting all rows");
    let registered = stages.registered(&observed);
    let geometry = stages.widened_geometry(&observed, &registered);
    let raw = options.stated_frames.as_ref().map(|f| summary_on(&observed, nominal, f));
    let square_mm2 = mean_square_of(&trained.geometry, geometry.parameters.len(), observed.dataset.sensor);
    let repeats = scatter.map(|floor| Repeats::of(floor, &observed.dataset, &geometry, square_mm2));
    let identifiability = geometry.identifiability();
    let parameters = parameter_table(&geometry, nominal);
    let sharpened = readout_fusion.is_ok();
    let estimated = Estimated {
        robot: robot.to_owned(),
        nominal: nominal.clone(),
        model: geometry.model.clone(),
        order: arm_parameters_of(&geometry),
        covariance: arm_covariance(&geometry),
        width_uncertainty: learned_width_uncertainty(&options.tolerance, &geometry),
        provenance: Provenance { sharpened, ..provenance(dataset, &observed, &outliers, options) },
        parameters: select_arm_parameters(&parameters),
        registered: trained.registered,
        calibrated: trained.geometry,
        noise_floor_mm: noise_floor(repeats.as_ref(), &observed, &geometry),
        beyond_noise_mm: None,
        beyond_noise_rad: None,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region,
        condition: median_condition(dataset),
    };
    report_step("estimating the benefit for programs");
    let mut estimated = with_sigma_in_region(estimated, &geometry);
    let sensor = observed.dataset.sensor;
    let mut beyond_noise =
        BeyondNoise::beside(&trained.geometry, geometry.parameters.len(), sensor, repeats.as_ref())
            .less_rounding(estimated.noise_floor_mm, sensor);
    // Where repeated poses show more than white noise, they say nothing of what else there is beside the rounding.
    let white = scatter.zip(repeats.as_ref().and_then(Repeats::white_mm));
    let white = white.map(|(floor, sigma_mm)| NoiseFloor { sigma_mm, ..floor });
    let asked = Asked {
        observed: &observed,
        model: &geometry.model,
        frames: &geometry.frames,
        spent: spent(geometry.estimate.covariance.as_ref(), &geometry.priors),
        set_aside: &[],
        repeats: white.as_ref(),
    };
    let rounding = asked.rounding();
    if let Rounding::Rounded(rounded) = &rounding {
        beyond_noise = beyond_noise.beside_rounded_log(rounded, white.as_ref(), sensor);
    }
    estimated.beyond_noise_mm = beyond_noise.known_mm();
    estimated.beyond_noise_rad = estimated
        .beyond_noise_mm
        .and_then(|mm| joint_errors_rad(&estimated, &geometry.frames.flange_from_target, mm));
    let benefit = variance_inflation.map(|variance_inflation| {
        benefit(&geometry, &observed.dataset, &estimated, &options.tolerance, variance_inflation)
            .map(|benefit| benefit.with_unmodelled(beyond_noise))
    });
    let left_mm = summary_on(&observed, &geometry.model, &geometry.frames).rmse;
    let shifted = (!outliers.rows.is_empty())
        .then(|| shifted_rows::note(dataset, &geometry.model, &geometry.frames))
        .flatten();
    let mixed = (!options.solver.as_printed)
        .then(|| mixed_rows(&observed, nominal, frames, &options.tolerance, left_mm))
        .flatten();
    let case = VerdictInputs {
        trained: &trained,
        geometry: &geometry,
        parameters: &parameters,
        outliers: &outliers,
        benefit: benefit.as_ref().map(Result::as_ref),
        sensor: dataset.sensor,
        still: still_joints(&estimated.region),
        set_up_anew: set_up_anew(&observed.dataset, &geometry),
        unseen_target: unseen_target(&geometry, &observed.dataset, &estimated),
        repeats: repeats.as_ref().and_then(Repeats::pattern),
        longer_tool: longer_tool_of(&estimated, benefit.as_ref()),
        rounded_log: rounding.note(dataset.angle_step_rad, trained.geometry.held_out.rmse),
        mixed: mixed.as_ref().map(MixedRows::sentence),
        shifted,
    };
    estimated.verdict = judge(&case, options);
    Ok(Identification {
        estimated,
        benefit: benefit.and_then(Result::ok),
        geometry,
        registered,
        training: trained.training,
        raw,
        identifiability,
        readout_fusion,
        outliers,
        held_out: trained.held_out,
        held_out_orientation: trained.orientation,
        parameters,
    })
}

/// A fit of geometry with the rows that it was fitted to. Those that it rejects as outliers are not among them, so that its weights belong
/// to these rows and to no others.
#[derive(Debug, Clone)]
pub struct FittedGeometry {
    /// The fit.
    pub fitted: Fitted,
    /// Its rows.
    pub rows: Dataset,
}

/// The fit of geometry to all rows that [`identify`] writes, without what states its error: no row is held out, and its covariance holds nothing of
/// the sensor's scale.
///
/// `split` are the rows on which [`identify`] judges whether the readings are of this arm.
///
/// # Errors
/// Those of [`identify`].
pub(crate) fn fit_geometry(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    frames: &Frames,
    split: &dyn Fn(&Dataset) -> Split,
    options: &Options,
) -> Result<FittedGeometry, IdentifyError> {
    let (observed, ..) = observations_without_outliers(dataset, nominal, frames, options)?;
    let prepared = options.solver.prepare_model(nominal, dataset);
    let nominal = &prepared;
    let sensing = frame_parameters(&observed.dataset);
    let everything = options.solver.parameters(nominal, &sensing);
    let stages = Stages { nominal, frames, sensing: &sensing, everything: &everything, options };
    let training = observed.subset(&split(&observed.dataset).train);
    stages.registered_own(&training).map_err(|found| found.error(dataset, robot, nominal))?;
    report_step("fitting all rows");
    let registered = stages.registered(&observed);
    let fitted = stages.geometry(&observed, &registered);
    Ok(FittedGeometry { fitted, rows: observed.dataset })
}

/// The rows as they are fitted, without outliers, which are the same for every method.
fn observations_without_outliers(
    dataset: &Dataset,
    nominal: &Model,
    frames: &Frames,
    options: &Options,
) -> Result<(Observations, Result<ReadoutFusion, NotFused>, Outliers), IdentifyError> {
    report_step("looking for outliers");
    let (observed, readout_fusion) = prepare_observations(dataset, nominal, options.fuse_readout);
    check_row_count(&observed.dataset, nominal, options.held_out)?;
    let start = Start { model: nominal, frames };
    let outliers = outliers(&observed, start, &options.tolerance, options.solver_for_frames());
    let observed = without(observed, &outliers);
    Ok((observed, readout_fusion, outliers))
}

/// The uncertainty of the widths of the tolerances, where they were learned.
pub(crate) fn learned_width_uncertainty(
    tolerance: &Tolerance,
    geometry: &Fitted,
) -> Option<WidthUncertainty> {
    let Fitted { parameters, priors, estimate, .. } = geometry;
    tolerance.learn_widths.then(|| width_uncertainty(tolerance, parameters, priors, estimate)).flatten()
}

/// The fit to the training rows.
struct Trained {
    training: Fitted,
    /// Errors with frames alone.
    registered: StageErrors,
    /// Errors with geometry.
    geometry: StageErrors,
    /// Held-out rows by their number in the file, with their errors before and after (mm).
    held_out: Vec<(usize, f64, f64)>,
    /// Their orientation errors (rad), where the sensor measures them.
    orientation: Option<ErrorSummary>,
}

/// Readings that are not of the arm.
enum WrongArm {
    /// RMS error with frames alone, above [`OTHER_ARM_MM`].
    Position { rmse_mm: f64 },
    /// Median orientation error with frames alone, above [`WRONG_ORIENTATION_RAD`].
    Orientation { rad: f64 },
}

impl WrongArm {
    /// The error, with what else the readings may be.
    fn error(self, dataset: &Dataset, robot: &str, nominal: &Model) -> IdentifyError {
        let (file, robot) = (dataset.file.clone(), robot.to_owned());
        match self {
            WrongArm::Position { rmse_mm } => {
                let explanation = misreading::explanation(dataset, nominal);
                IdentifyError::WrongArm { file, robot, rmse_mm, explanation }
            }
            WrongArm::Orientation { rad } => {
                IdentifyError::WrongOrientation { file, robot, deg: rad.to_degrees() }
            }
        }
    }
}

/// Fits the training rows and evaluates the held-out ones.
fn fit_training_rows(
    stages: &Stages<'_>,
    rows: &Observations,
    held: &Observations,
) -> Result<Trained, WrongArm> {
    report_step("fitting the training rows");
    let registered = stages.registered_own(rows)?;
    let on = |fitted: &Fitted| {
        let errors = errors_on(held, &fitted.model, &fitted.frames);
        let counted = without_frames(&rows.dataset, &held.dataset, errors.clone());
        // Where no station is placed well enough, large errors are better than none.
        let is_counted = counted.iter().any(Option::is_some);
        let held_out = if is_counted {
            ErrorSummary::of(counted.into_iter().flatten())
        } else {
            ErrorSummary::of(errors.iter().copied())
        };
        (StageErrors { fitted: summary_on(rows, &fitted.model, &fitted.frames), held_out }, errors)
    };
    let mut training = stages.geometry(rows, &registered);
    training.problem.drop_rows();
    let all: Vec<usize> = (0..held.dataset.rows.len()).collect();
    let orientation = orientation_errors(held, &all, &training.model, &training.frames).map(ErrorSummary::of);
    let ((registered, before), (geometry, after)) = (on(&registered), on(&training));
    let numbers = held.dataset.rows.iter().map(|row| row.number);
    let held_out =
        numbers.zip(before).zip(after).map(|((number, before), after)| (number, before, after)).collect();
    Ok(Trained { training, registered, geometry, held_out, orientation })
}

/// Provenance of a model: file, rows, method.
fn provenance(
    dataset: &Dataset,
    observed: &Observations,
    outliers: &Outliers,
    options: &Options,
) -> Provenance {
    Provenance {
        file: dataset.file.clone(),
        sha256: dataset.sha256.clone(),
        rows: observed.dataset.rows.len(),
        set_aside: outliers.rows.iter().map(|row| dataset.rows[row.index].number).collect(),
        sensor: dataset.sensor,
        method: options.solver.name.to_owned(),
        seed: options.seed,
        held_out: options.held_out,
        sharpened: false,
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

/// The rows without the outliers.
fn without(observed: Observations, outliers: &Outliers) -> Observations {
    if outliers.rows.is_empty() {
        return observed;
    }
    let rows = observed.dataset.rows.len();
    let mut set_aside = vec![false; rows];
    outliers.rows.iter().for_each(|row| set_aside[row.index] = true);
    let kept: Vec<usize> = (0..rows).filter(|&i| !set_aside[i]).collect();
    observed.subset(&kept)
}

/// The stages of an identification, for any rows.
struct Stages<'a> {
    nominal: &'a Model,
    frames: &'a Frames,
    /// Parameters of the measurement.
    sensing: &'a [Parameter],
    /// Parameters of the measurement and the arm.
    everything: &'a [Parameter],
    options: &'a Options,
}

impl Stages<'_> {
    /// Fits the frames with the nominal arm. The rows of the problem are dropped.
    fn registered(&self, rows: &Observations) -> Fitted {
        let Options { tolerance, seed, .. } = self.options;
        let start = Start { model: self.nominal, frames: self.frames };
        let mut fitted = fit(rows, start, self.sensing, tolerance, self.options.solver_for_frames(), *seed);
        fitted.problem.drop_rows();
        fitted
    }

    /// The same, if the readings are of this arm.
    fn registered_own(&self, rows: &Observations) -> Result<Fitted, WrongArm> {
        let registered = self.registered(rows);
        let rmse_mm = summary_on(rows, &registered.model, &registered.frames).rmse;
        if !(rmse_mm < OTHER_ARM_MM) {
            return Err(WrongArm::Position { rmse_mm });
        }
        let turned = median_orientation_error(rows, &registered.model, &registered.frames);
        match turned.filter(|rad| *rad > WRONG_ORIENTATION_RAD) {
            Some(rad) => Err(WrongArm::Orientation { rad }),
            None => Ok(registered),
        }
    }

    /// Fits the links too, with the stated uncertainty of the sensor's scale.
    fn widened_geometry(&self, rows: &Observations, registered: &Fitted) -> Fitted {
        let mut geometry = self.geometry(rows, registered);
        if let Some(sigma) = self.options.tolerance.scale {
            widen_by_scale(&mut geometry, &rows.dataset, sigma);
        }
        geometry
    }

    /// Fits the links too. Methods as printed fit frames first, then links without priors.
    fn geometry(&self, rows: &Observations, registered: &Fitted) -> Fitted {
        let Options { solver, tolerance, seed, .. } = self.options;
        if solver.as_printed {
            return fit_as_printed(rows, self.nominal, &registered.frames, solver, *seed);
        }
        let frames = if solver.needs_registered_frames() { &registered.frames } else { self.frames };
        let start = Start { model: self.nominal, frames };
        fit(rows, start, self.everything, &solver.tolerance(tolerance), solver, *seed)
    }
}

/// The arm's parameters among those of a fit.
fn select_arm_parameters(parameters: &[EstimatedParameter]) -> Vec<EstimatedParameter> {
    parameters.iter().filter(|p| p.is_of_arm()).cloned().collect()
}

impl Options {
    /// Frames are always registered with the default solver, so that methods differ in geometry alone.
    fn solver_for_frames(&self) -> &'static Solver {
        &SOLVERS[0]
    }
}

/// Fuses the read-out into the angles where possible, if `fuse`.
pub fn prepare_observations(
    dataset: &Dataset,
    nominal: &Model,
    fuse: bool,
) -> (Observations, Result<ReadoutFusion, NotFused>) {
    if fuse {
        Observations::fused(dataset.clone(), nominal, &[])
    } else {
        (Observations::logged(dataset.clone()), Err(NotFused::Nothing))
    }
}

fn check_row_count(dataset: &Dataset, nominal: &Model, held_out: f64) -> Result<(), IdentifyError> {
    let parameters = arm_parameters(nominal).len() + frame_parameters(dataset).len();
    let per = dataset.sensor.scalars();
    let rows = dataset.rows.len();
    let needed = (((parameters + 1).div_ceil(per)) as f64 / (1.0 - held_out)).ceil() as usize;
    let poses = count_distinct_poses(dataset, 2 * needed);
    let held = (poses as f64 * held_out).round() as usize;
    let scalars = (poses - held.min(poses)) * per;
    if scalars > parameters {
        return Ok(());
    }
    Err(IdentifyError::TooFewRows {
        file: dataset.file.clone(),
        rows,
        poses,
        scalars,
        held_out: held,
        parameters,
        needed,
    })
}

/// The papers' protocol: frames from the frame-only fit, then 24 link parameters without priors or weights
/// (ltlm-2024, with the outlet that it takes as known).
fn fit_as_printed(
    rows: &Observations,
    nominal: &Model,
    frames: &Frames,
    solver: &Solver,
    seed: u64,
) -> Fitted {
    let parameters = link_parameters(nominal);
    let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; rows.dataset.rows.len()];
    // Priors for methods that need them: initial covariances of filters, boxes of swarms. The others ignore them.
    let priors = Tolerance::default().priors(&parameters, nominal);
    let problem = CalibrationProblem::new(&rows.dataset, nominal, frames, &parameters, &priors, &weights);
    let estimate = solver.solve(&problem, &vec![0.0; parameters.len()], seed);
    let (model, frames) = problem.apply(&estimate.x);
    let evaluations = estimate.evaluations;
    let freedom = (problem.rows() as f64 - parameters.len() as f64).max(1.0);
    let sigma_mm = (2.0 * problem.row_cost(&estimate.x) / freedom).sqrt();
    let rounds = vec![estimate.trace.clone()];
    Fitted {
        parameters,
        priors,
        estimate,
        model,
        frames,
        sigma_mm,
        sigma_rad: 1e-3,
        problem,
        evaluations,
        rounds,
    }
}

pub(crate) fn arm_parameters_of(fitted: &Fitted) -> Vec<Parameter> {
    fitted.parameters.iter().copied().filter(Parameter::is_of_arm).collect()
}

/// Covariance block of the arm's parameters: marginal over the frames.
pub(crate) fn arm_covariance(fitted: &Fitted) -> nalgebra::DMatrix<f64> {
    let indices: Vec<usize> =
        fitted.parameters.iter().enumerate().filter(|(_, p)| p.is_of_arm()).map(|(k, _)| k).collect();
    let n = indices.len();
    match &fitted.estimate.covariance {
        Some(c) => nalgebra::DMatrix::from_fn(n, n, |i, j| c[(indices[i], indices[j])]),
        None => nalgebra::DMatrix::from_fn(n, n, |i, j| {
            if i == j { fitted.priors[indices[i]].sigma.powi(2) } else { 0.0 }
        }),
    }
}

/// Scatter of repeated poses (mm), as far as it is white noise, otherwise the RMS effect of rounded angles; `None` if neither is known.
fn noise_floor(repeats: Option<&Repeats>, observed: &Observations, fitted: &Fitted) -> Option<f64> {
    if let Some(repeats) = repeats {
        return repeats.white_mm();
    }
    rounding_floor_mm(&observed.dataset, &fitted.model, &fitted.frames, &observed.angles)
}

/// The condition that a model is stated for: the medians of the logged values.
pub(crate) fn median_condition(dataset: &Dataset) -> Condition {
    let median_of = |value: fn(&Condition) -> Option<f64>| {
        let known: Vec<f64> = dataset.rows.iter().filter_map(|r| value(&r.condition)).collect();
        median(&known)
    };
    Condition {
        time_h: median_of(|c| c.time_h),
        temperature_c: median_of(|c| c.temperature_c),
        payload_kg: median_of(|c| c.payload_kg),
        payload_centre_mm: std::array::from_fn(|axis| {
            let loaded =
                dataset.rows.iter().filter(|row| row.condition.payload_kg.is_some_and(|kg| kg > 0.0));
            let centres: Vec<f64> = loaded.map(|row| row.condition.payload_centre_mm[axis]).collect();
            median(&centres).unwrap_or(0.0)
        }),
        ..Condition::default()
    }
}

/// Sets the region's largest position standard deviation due to the arm's parameters.
pub(crate) fn with_sigma_in_region(mut estimated: Estimated, fitted: &Fitted) -> Estimated {
    let condition = estimated.condition;
    let posed = estimated.model.at_condition(&condition);
    let target = fitted.frames.flange_from_target;
    let sigmas: Vec<f64> = estimated
        .region
        .samples_deg
        .par_iter()
        .map(|q| {
            checkpoint();
            let q = Joints::from_fn(|i, _| q[i].to_radians());
            let variance = estimated.position_covariance(&posed, &q, &target).trace();
            if variance <= 0.0 { 0.0 } else { variance.sqrt() }
        })
        .collect();
    estimated.region.sigma_mm = largest(sigmas);
    estimated
}

struct VerdictInputs<'a> {
    trained: &'a Trained,
    geometry: &'a Fitted,
    parameters: &'a [EstimatedParameter],
    outliers: &'a Outliers,
    /// Absent for a method as printed.
    benefit: Option<Result<&'a Benefit, &'a NoBenefit>>,
    sensor: Sensor,
    /// Joints that hardly moved (from 1).
    still: Vec<usize>,
    /// What speaks against one frame for all sessions.
    set_up_anew: Option<String>,
    /// That the poses do not show the target's place on the flange.
    unseen_target: Option<Reason>,
    /// What repeated poses show beside the noise of a reading.
    repeats: Option<&'a str>,
    /// What errors beyond the noise make of a tool that is longer than the target is far from the flange.
    longer_tool: Option<String>,
    /// That the log rounds the angles.
    rounded_log: Option<String>,
    /// That the rows are those of two arms.
    mixed: Option<String>,
    /// That rows which were set aside are shifted.
    shifted: Option<String>,
}

/// Share of the expected error from which what is beyond the noise is stated for longer tools.
const MOSTLY: f64 = 0.5;

/// The sentence, where the expected error is mostly what the model does not contain.
fn longer_tool_of(estimated: &Estimated, benefit: Option<&Result<Benefit, NoBenefit>>) -> Option<String> {
    let beyond_mm = estimated.beyond_noise_mm?;
    let expected_mm = benefit?.as_ref().ok()?.estimated_mm;
    if beyond_mm > MOSTLY * expected_mm { longer_tool(estimated, beyond_mm) } else { None }
}

/// Range below which a joint hardly moved (°).
const STILL_DEG: f64 = 5.0;

/// Joints that hardly moved (from 1).
fn still_joints(region: &Region) -> Vec<usize> {
    (1..=6).filter(|joint| region.max_deg[joint - 1] - region.min_deg[joint - 1] < STILL_DEG).collect()
}

fn judge(case: &VerdictInputs<'_>, options: &Options) -> Verdict {
    let mut verdict = VerdictBuilder::default();
    for (fitted, rows) in [(&case.trained.training, "the rows of the split"), (case.geometry, "all rows")] {
        let filtered =
            options.solver.family == Family::Filter && fitted.termination() == Termination::DataProcessed;
        if fitted.termination().is_converged() {
            verdict.note(Reason::new(ReasonKind::Converged, format!("on {rows} the fit converged")));
        } else if filtered {
            verdict.note(format!(
                "on {rows} the filter processed every reading; it does not test for a minimum"
            ));
        } else {
            verdict.fail(format!("on {rows} the fit did not converge: {}", fitted.termination()));
        }
    }
    if options.solver.as_printed {
        verdict.fail(format!(
            "{} has no priors: undetermined parameters moved freely, so the result is a comparison and not a model",
            options.solver.name
        ));
    }
    if options.solver.network == Some(Scope::Alone) {
        verdict.fail(format!(
            "{} fits no geometry: between the measured poses, and with another tool, nothing bounds its error, so the result is a comparison and \
             not a model",
            options.solver.name
        ));
    }
    if let Some(mixed) = &case.mixed {
        verdict.fail(mixed.as_str());
    }
    verdict.check_links(case.parameters, &options.tolerance, 0.0);
    if !case.still.is_empty() {
        verdict.note(format!(
            "{} of less than {:.0}°: {} parameters that these rows do not determine stay as in the data sheet",
            if case.still.len() == 1 {
                format!("joint {} moved through a range", case.still[0])
            } else {
                format!("joints {} moved through ranges", listed(&case.still))
            },
            STILL_DEG,
            if case.still.len() == 1 { "its" } else { "their" }
        ));
    }
    if let Some(unseen_target) = &case.unseen_target {
        verdict.note(unseen_target.clone());
    }
    if let Some(pattern) = case.repeats {
        let text = format!(
            "repeated poses differ by more than the noise of a reading: {pattern}. The expected error does not treat this as sensor noise; `diagnose` looks for the cause and fits a model \
             without it"
        );
        verdict.note(Reason::new(ReasonKind::MoreThanNoise, text));
    }
    if let Some(longer_tool) = &case.longer_tool {
        verdict.note(longer_tool.as_str());
    }
    if let Some(rounded_log) = &case.rounded_log {
        verdict.note(rounded_log.as_str());
    }
    if let Some(shifted) = &case.shifted {
        verdict.note(shifted.as_str());
    }
    if case.outliers.too_many > 0 {
        verdict.note(format!(
            "{} rows lie beyond {OUTLIER_CUT} robust standard deviations, too many to be outliers: none was rejected",
            case.outliers.too_many
        ));
    }
    if let Some(set_up_anew) = &case.set_up_anew {
        verdict.doubt(set_up_anew.as_str());
    }
    let (before, held) = (case.trained.registered.held_out.rmse, case.trained.geometry.held_out.rmse);
    verdict.check_held_out(before, held);
    if let Some(benefit) = case.benefit {
        verdict.check_benefit(benefit, case.sensor);
    }
    let limits = Limits { rmse_mm: options.limit_rmse_mm, max_mm: options.limit_max_mm };
    verdict.check_mastering(case.parameters, &options.tolerance);
    verdict.check_limits(&limits, &case.trained.geometry.held_out);
    verdict.build()
}
