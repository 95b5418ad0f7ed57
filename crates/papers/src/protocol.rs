//! Runs methods over seeded cases of one measurement file.
//!
//! A case draws its rows from the file and splits them into rows of the fit and held-out rows, both with its own seed;
//! every method gets the same rows. Repeated poses are never split. Then:
//!
//! 1. The frames are registered by a fit of the frames alone: outlet and cable zero, or the sensor's frame, and the
//!    touched point. ltlm-2024 and ukf-vslm-2023 take the outlet as known; their files do not give it.
//! 2. *As printed*: from there the 24 link parameters, every row with the same weight of 1/mm, without priors where
//!    possible. The first covariance of a filter and the box of a swarm are set to manufacturing tolerances, since the
//!    papers do not state them. R of a filter is 1 mm², not stated either.
//! 3. *Sound*: links and frames together, rows weighted by sensor noise and rounding, tolerances as priors. All sound
//!    methods solve the same problem.
//! 4. Errors are computed on the held-out rows, signed for a cable, as the norm for a position.
//! 5. Every least-squares method is then continued to convergence: the converged result depends on the problem only, the
//!    limited one also on the method's budget.
//! 6. Measured rows are also diagnosed (`named_causes`).
//!
//! "STD" of the papers is the mean absolute error (ltlm-2024 eq. 20, ukf-vslm-2023 eq. 28), and is called so here.
//! Results do not depend on the number of threads; measured times do and are stored separately.

pub(crate) mod outcome;

use std::time::Instant;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use serde::Serialize;

use crate::experiment::{Experiment, ExperimentError, Method, Methods, ReadingUsed, Treatment, Units};
use crate::named_causes::{NamedCauses, Record};
use crate::parameters::{ParameterTable, parameter_table};
use crate::rescaled::Rescaled;
use crate::verdict::{Judgement, judge};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, link_parameters};
use truegrind_calibration::identification::calibration::{CalibrationProblem, Weight};
use truegrind_calibration::identification::fit::{
    Fitted, Observations, Start, errors_on, fit, frame_parameters, summary_on,
};
use truegrind_calibration::identification::identify::prepare_observations;
use truegrind_calibration::identification::register::{Registered, register};
use truegrind_calibration::identification::rounding;
use truegrind_calibration::identification::solver::{Family, Run, SOLVERS, Scope, Solver, SolverError};
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::noise_floor;
use truegrind_calibration::measurement::split::{self, Split};
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::least_squares::{Factorisation, lm};
use truegrind_estimation::problem::Problem;
use truegrind_math::statistics::ErrorSummary;

pub use self::outcome::{CurvePoint, MethodResult, Outcome};

/// Options of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// Rows of one case instead of the protocol's number.
    pub rows: Option<usize>,
    /// Seed of the cases: case k uses seed + k.
    pub seed: u64,
    /// Whether the rows are simulated; the paper's figures then belong to another arm.
    pub simulated: bool,
    /// Standard deviation of a length or a coordinate (mm), known only for simulated rows.
    pub sensor_sigma_mm: f64,
}

/// The result of an experiment.
#[derive(Debug, Clone)]
pub struct Study {
    /// The experiment.
    pub experiment: Experiment,
    /// Its section `methods`.
    pub methods: Methods,
    /// Measurement file.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
    /// Sensor, after the protocol selected the part of the reading.
    pub sensor: Sensor,
    /// Robot.
    pub robot: String,
    /// Rows of one case.
    pub rows: usize,
    /// Whether these are fewer rows than the protocol states.
    pub reduced: bool,
    /// Whether the rows are simulated.
    pub simulated: bool,
    /// Seed of the first case.
    pub seed: u64,
    /// Scatter of repeated poses; without any, the effect of rounded angles on a row, plus the sensor's noise where it is
    /// simulated (mm).
    pub noise_floor_mm: Option<f64>,
    /// The cases.
    pub cases: Vec<Case>,
    /// One result for each method.
    pub results: Vec<MethodResult>,
    /// The diagnosis of each case, `None` where it refused the rows; absent for simulated rows.
    pub named_causes: Option<Vec<Option<NamedCauses>>>,
    /// Parameters identified in the first case; empty unless requested.
    pub parameters: Vec<ParameterTable>,
    /// Comparison of the methods.
    pub judgement: Judgement,
}

/// One case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Case {
    /// Seed of its rows and split.
    pub seed: u64,
    /// Rows of the fit.
    pub train: usize,
    /// Held-out rows.
    pub test: usize,
    /// Errors on held-out rows with frames registered and links nominal: the baseline before compensation.
    pub registered: ErrorSummary,
    /// These errors, row by row, signed for a cable (mm).
    pub registered_errors_mm: Vec<f64>,
}

/// A case with the data that all methods start from.
pub(super) struct Prepared {
    division: Split,
    train: Observations,
    test: Observations,
    registered: Fitted,
    nominal: Model,
    sound: Option<Sound>,
}

/// The problem of the sound treatment.
struct Sound {
    weights: Vec<Weight>,
}

/// A method whose held-out error exceeds that of the registered frames by this factor has diverged.
const DIVERGED: f64 = 10.0;

/// Runs a methods experiment on `dataset`, measured on `nominal`.
///
/// # Errors
/// [`ExperimentError`] if the rows do not suffice for the protocol. A method that fails is no error but a row.
pub fn run(
    experiment: &Experiment,
    methods: &Methods,
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    options: &Options,
) -> Result<Study, ExperimentError> {
    let protocol = &methods.protocol;
    let dataset = reading_used(experiment, methods, dataset)?;
    let rows = options.rows.unwrap_or(protocol.rows);
    if dataset.rows.len() < rows {
        return Err(ExperimentError::TooFewRows {
            file: dataset.file.clone(),
            experiment: experiment.name.clone(),
            found: dataset.rows.len(),
            asked: rows,
            possible: dataset.rows.len(),
        });
    }
    enough(experiment, methods, &dataset, rows, nominal)?;
    let (observed, _) = prepare_observations(&dataset, nominal, protocol.fuse_readout);
    let any_sound = methods.method.iter().any(|m| treatment_of(m, methods) == Treatment::Sound);
    let seeds: Vec<u64> = (0..protocol.cases as u64).map(|k| options.seed + k).collect();
    let prepared = seeds
        .par_iter()
        .map(|&seed| prepare(&observed, nominal, rows, protocol.held_out, seed, any_sound))
        .collect::<Result<Vec<_>, ExperimentError>>()?;
    let cases = prepared.iter().zip(&seeds).map(|(case, &seed)| case.described(seed)).collect();
    let results = methods
        .method
        .iter()
        .map(|method| result_of(method, experiment, methods, &prepared, &seeds))
        .collect::<Result<Vec<_>, _>>()?;
    let named_causes = (!options.simulated).then(|| {
        let record = Record::of(&dataset, nominal, protocol.fuse_readout);
        prepared.par_iter().map(|case| record.diagnosed(&case.division, robot, nominal)).collect()
    });
    let parameters = if methods.parameters {
        results.iter().filter_map(|r| parameters_of(&prepared[0], r)).collect()
    } else {
        Vec::new()
    };
    let judgement = judge(&results, &methods.reference, protocol.held_out / (1.0 - protocol.held_out));
    Ok(Study {
        experiment: experiment.clone(),
        methods: methods.clone(),
        file: dataset.file.clone(),
        sha256: dataset.sha256.clone(),
        sensor: dataset.sensor,
        robot: robot.to_owned(),
        rows,
        reduced: rows < protocol.rows,
        simulated: options.simulated,
        seed: options.seed,
        noise_floor_mm: noise_floor(&observed, &prepared[0], options.sensor_sigma_mm),
        cases,
        results,
        named_causes,
        parameters,
        judgement,
    })
}

impl Prepared {
    /// The case as reported in the study.
    fn described(&self, seed: u64) -> Case {
        let errors = errors_on(&self.test, &self.registered.model, &self.registered.frames);
        Case {
            seed,
            train: self.train.dataset.rows.len(),
            test: self.test.dataset.rows.len(),
            registered: ErrorSummary::of(errors.iter().copied()),
            registered_errors_mm: errors,
        }
    }
}

/// Runs one method on all cases.
fn result_of(
    method: &Method,
    experiment: &Experiment,
    methods: &Methods,
    prepared: &[Prepared],
    seeds: &[u64],
) -> Result<MethodResult, ExperimentError> {
    let solver = method.solver();
    let treatment = treatment_of(method, methods);
    let fail = |found: SolverError| ExperimentError::Invalid {
        file: experiment.name.clone(),
        key: method.id.clone(),
        found: found.to_string(),
        expected: "settings of that method".to_owned(),
    };
    let configured = solver.configured(&method.settings).map_err(fail)?;
    let (outcomes, converged): (Vec<Outcome>, Vec<Option<Outcome>>) = prepared
        .par_iter()
        .zip(seeds)
        .map(|(case, seed)| outcome(case, method, solver, treatment, &configured.run, *seed))
        .unzip();
    let converged: Option<Vec<Outcome>> = converged.into_iter().collect();
    Ok(MethodResult {
        method: method.clone(),
        solver,
        treatment,
        settings: configured.settings,
        outcomes,
        converged,
    })
}

fn treatment_of(method: &Method, methods: &Methods) -> Treatment {
    method.treatment.unwrap_or(methods.protocol.treatment)
}

/// Continues the result of a least-squares method to convergence, on the same rows and cost, without fixed damping or a
/// decaying step size. Neither changes the stationary points, so the method itself would end here after thousands more
/// iterations.
fn continued(problem: &CalibrationProblem, solver: &Solver, x: &[f64]) -> Estimate {
    let options = lm::Options {
        factorisation: Factorisation::Qr,
        priors: !solver.as_printed,
        max_iterations: 5_000,
        cost_tolerance: 1e-13,
        ..lm::Options::default()
    };
    lm::solve(problem, x, &options)
}

/// The rows, reduced to the part of the reading that the protocol uses.
fn reading_used(
    experiment: &Experiment,
    methods: &Methods,
    dataset: &Dataset,
) -> Result<Dataset, ExperimentError> {
    let protocol = &methods.protocol;
    if protocol.reading == ReadingUsed::AsMeasured {
        return Ok(dataset.clone());
    }
    if dataset.sensor == Sensor::Cable {
        return Err(ExperimentError::WrongSensor {
            file: dataset.file.clone(),
            experiment: experiment.name.clone(),
            found: "cable lengths",
            expected: "positions or poses",
        });
    }
    let point = nalgebra::Vector3::from(protocol.fixed_point_mm);
    let position = |row: &Row| match &row.reading {
        Reading::Position(p) => *p,
        Reading::Pose(pose) => pose.translation.vector,
        Reading::Cable(_) => nalgebra::Vector3::zeros(),
    };
    let mut out = dataset.clone();
    for row in &mut out.rows {
        let p = position(row);
        row.reading = match protocol.reading {
            ReadingUsed::Distance => Reading::Cable((p - point).norm()),
            _ => Reading::Position(p),
        };
    }
    out.sensor = if protocol.reading == ReadingUsed::Distance { Sensor::Cable } else { Sensor::Position };
    if protocol.reading == ReadingUsed::Distance {
        out.reading_step_mm = None;
    }
    Ok(out)
}

fn enough(
    experiment: &Experiment,
    methods: &Methods,
    dataset: &Dataset,
    rows: usize,
    nominal: &Model,
) -> Result<(), ExperimentError> {
    let per = dataset.sensor.scalars();
    let share = methods.protocol.held_out;
    let parameters = link_parameters(nominal).len() + frame_parameters(dataset).len();
    let held_out = (rows as f64 * share).round() as usize;
    let readings = rows.saturating_sub(held_out) * per;
    if readings > parameters && held_out > 1 {
        return Ok(());
    }
    let needed = (((parameters + 1).div_ceil(per)) as f64 / (1.0 - share)).ceil();
    Err(ExperimentError::TooFewReadings {
        file: dataset.file.clone(),
        experiment: experiment.name.clone(),
        rows,
        held_out,
        readings,
        parameters,
        needed: (needed as usize).max((2.0 / share).ceil() as usize),
    })
}

/// `count` of the rows, drawn without replacement, in their order in the file.
pub(super) fn drawn(rows: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..rows).collect();
    for i in 0..count.min(rows) {
        order.swap(i, rng.random_range(i..rows));
    }
    order.truncate(count);
    order.sort_unstable();
    order
}

fn prepare(
    observed: &Observations,
    nominal: &Model,
    rows: usize,
    held_out: f64,
    seed: u64,
    sound: bool,
) -> Result<Prepared, ExperimentError> {
    let drawn = drawn(observed.dataset.rows.len(), rows, seed);
    let chosen = observed.subset(&drawn);
    let split = split::random(&chosen.dataset, held_out, seed);
    let (train, test) = (chosen.subset(&split.train), chosen.subset(&split.test));
    let division = split.of_whole(&drawn);
    let Registered { start: frames, fitted: registered } = register(&train, nominal, &Tolerance::default())?;
    let sound = sound.then(|| {
        // Residual spread of a fit of links and frames; the same for every method.
        let start = Start { model: nominal, frames: &frames };
        let parameters: Vec<Parameter> =
            link_parameters(nominal).into_iter().chain(frame_parameters(&train.dataset)).collect();
        let fitted = fit(&train, start, &parameters, &Tolerance::default(), &SOLVERS[0], 0);
        let weights = rounding::weights(
            &train.dataset,
            &fitted.model,
            &fitted.frames,
            &train.angles,
            fitted.sigma_mm,
            fitted.sigma_rad,
        );
        Sound { weights }
    });
    Ok(Prepared { division, train, test, registered, nominal: nominal.clone(), sound })
}

/// The problem of a method, its free parameters, and the root mean square of its rows' weights (1/mm).
fn problem_of(
    case: &Prepared,
    solver: &Solver,
    treatment: Treatment,
) -> (CalibrationProblem, Vec<Parameter>, f64) {
    let train = &case.train.dataset;
    let model = solver.prepare_model(&case.nominal, train);
    let frames = &case.registered.frames;
    let sensing = frame_parameters(train);
    let tolerance = match solver.network {
        Some(Scope::Alone) => Tolerance::default(),
        // One problem for all methods, with the registered frames.
        _ => Tolerance {
            target_mm: 10.0,
            target_rad: 0.02,
            frame_mm: 10.0,
            frame_rad: 0.02,
            ..Tolerance::default()
        },
    };
    let (parameters, weights) = match (treatment, &case.sound, solver.network) {
        (_, _, Some(Scope::Alone)) => {
            let f = &case.registered;
            let weights =
                rounding::weights(train, &f.model, frames, &case.train.angles, f.sigma_mm, f.sigma_rad);
            (solver.parameters(&model, &sensing), weights)
        }
        (Treatment::Sound, Some(sound), _) => (solver.parameters(&model, &sensing), sound.weights.clone()),
        _ => {
            let unit = Weight { per_mm: 1.0, per_rad: 1.0 };
            (link_parameters(&model), vec![unit; train.rows.len()])
        }
    };
    let priors = tolerance.priors(&parameters, &model);
    let squares = weights.iter().map(|w| w.per_mm * w.per_mm).sum::<f64>() / weights.len().max(1) as f64;
    let problem = CalibrationProblem::new(train, &model, frames, &parameters, &priors, &weights);
    (problem, parameters, squares.sqrt().max(f64::MIN_POSITIVE))
}

fn outcome(
    case: &Prepared,
    method: &Method,
    solver: &Solver,
    treatment: Treatment,
    run: &Run,
    seed: u64,
) -> (Outcome, Option<Outcome>) {
    let (problem, parameters, per_mm) = problem_of(case, solver, treatment);
    let start = vec![0.0; parameters.len()];
    let begun = Instant::now();
    let estimate = match method.units {
        Units::Rad => run(&problem, &start, seed),
        Units::Deg => {
            let scale = parameters.iter().map(|p| if p.is_length() { 1.0 } else { 1.0_f64.to_radians() });
            let rescaled = Rescaled::new(&problem, scale.collect());
            let estimate = run(&rescaled, &start, seed);
            rescaled.back(estimate)
        }
    };
    let seconds = begun.elapsed().as_secs_f64();
    let converged = (solver.family == Family::LeastSquares).then(|| {
        let from = if estimate.x.iter().all(|x| x.is_finite()) { &estimate.x } else { &start };
        judged(case, &problem, per_mm, continued(&problem, solver, from), 0.0)
    });
    (judged(case, &problem, per_mm, estimate, seconds), converged)
}

/// `per_mm` is the root mean square of the rows' weights.
fn judged(
    case: &Prepared,
    problem: &CalibrationProblem,
    per_mm: f64,
    estimate: Estimate,
    seconds: f64,
) -> Outcome {
    let (model, frames) = problem.apply(&estimate.x);
    let errors_mm = errors_on(&case.test, &model, &frames);
    let held_out = ErrorSummary::of(errors_mm.iter().copied());
    let fitted = summary_on(&case.train, &model, &frames);
    let before = summary_on(&case.test, &case.registered.model, &case.registered.frames).rmse;
    let finite = held_out.rmse.is_finite() && estimate.x.iter().all(|x| x.is_finite());
    let diverged = !finite || estimate.termination.is_failure() || held_out.rmse > DIVERGED * before;
    let rows = problem.rows().max(1) as f64;
    // The three coordinates of a position make one distance. Orientation rows have no unit of mm: for a pose all rows
    // count equally.
    let per = problem.rows_per_observation();
    let lengths = if per == 3 { 3.0 } else { 1.0 };
    let curve = estimate
        .trace
        .iter()
        .enumerate()
        .map(|(iteration, i)| CurvePoint {
            iteration,
            passes: (i.evaluations.residuals + i.evaluations.jacobians) as f64 / rows,
            rmse: (lengths * 2.0 * i.row_cost.unwrap_or(i.cost).max(0.0) / rows).sqrt() / per_mm,
        })
        .collect();
    let tolerances = Tolerance::default().priors(problem.free_parameters(), problem.start());
    let farthest = problem
        .free_parameters()
        .iter()
        .zip(&estimate.x)
        .zip(&tolerances)
        .filter(|((p, _), _)| matches!(p, Parameter::Link { .. }))
        .map(|((_, x), tolerance)| (x / tolerance.sigma).abs())
        .fold(0.0, |most: f64, far| if far.is_nan() { f64::INFINITY } else { most.max(far) });
    Outcome {
        farthest,
        held_out,
        fitted,
        termination: estimate.termination,
        diverged,
        evaluations: estimate.evaluations,
        iterations: estimate.trace.len().saturating_sub(1),
        curve,
        errors_mm,
        x: estimate.x,
        seconds,
    }
}

fn parameters_of(case: &Prepared, result: &MethodResult) -> Option<ParameterTable> {
    if result.solver.network == Some(Scope::Alone) {
        return None;
    }
    let outcome = result.outcomes.first()?;
    let (problem, parameters, _) = problem_of(case, result.solver, result.treatment);
    let readings = problem.rows().saturating_sub(parameters.len()).max(1) as f64;
    let variance = match result.treatment {
        // Rows as printed are unweighted: their spread is that of the fit's residuals.
        Treatment::Printed => 2.0 * problem.row_cost(&outcome.x) / readings,
        Treatment::Sound => 1.0,
    };
    Some(parameter_table(&result.method, &problem, &parameters, &outcome.x, variance))
}

fn noise_floor(observed: &Observations, case: &Prepared, sensor_sigma_mm: f64) -> Option<f64> {
    if let Some(floor) = noise_floor::noise_floor(&observed.dataset) {
        return Some(floor.sigma_mm);
    }
    let registered = &case.registered;
    let shares =
        rounding::angle_shares(&observed.dataset, &registered.model, &registered.frames, &observed.angles);
    let mean = shares.iter().map(|s| s.0).sum::<f64>() / shares.len().max(1) as f64;
    // The error of a position is the norm of its three coordinates.
    let axes = observed.dataset.sensor.axes() as f64;
    let variance = axes * (mean + sensor_sigma_mm * sensor_sigma_mm);
    (variance > 0.0).then(|| variance.sqrt())
}
