//! Deviations of a ground surface before compensation and after it with each method's model: ltlm-2024 Table 8, Fig. 9.
//!
//! The surface equation becomes an NC program, as in the paper. The actual arm runs it uncorrected, and rewritten with
//! each method's model. The tool is measured; the work object was taught at three points with the uncalibrated arm, as in
//! most cells. The frame of the base relative to link 1, which no measurement in the cell determines, then has no effect.
//! Deviations are signed along the outward normal. Every case draws its measured rows again; part and program are the
//! same.
//!
//! The actual arm is known only for simulated measurements. For a real arm the sound estimate from all rows replaces it,
//! and the result is labelled as a prediction.

use rayon::prelude::*;

use crate::experiment::{ExperimentError, Grinding, GrindingMethod, PaperPoints};
use crate::named_causes::{NamedCauses, Record};
use crate::protocol::{Options as CaseOptions, drawn};
use crate::verdict::{Test, paired};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_calibration::identification::identify::{
    Identification, Options, identify, prepare_observations,
};
use truegrind_calibration::identification::register::register;
use truegrind_calibration::identification::solver::{self, SOLVERS, Solver};
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_calibration::measurement::split;
use truegrind_compensation::cell::{Cell, CellFrame, FrameOrigin};
use truegrind_compensation::compensate::compensate;
use truegrind_compensation::cut::Cuts;
use truegrind_compensation::deviation::{After, Block, MotionStatus, PathPoint, PathReport};
use truegrind_compensation::options::Options as RewriteBounds;
use truegrind_compensation::risk::placement::Placement;
use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind_estimation::estimate::Termination;
use truegrind_math::statistics::ErrorSummary;
use truegrind_planning::taught_cell::taught_cell;
use truegrind_planning::toolpath::toolpath;
use truegrind_programs::motion::Mark;
use truegrind_programs::nc::dialect::Dialect;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::nc::writer;
use truegrind_programs::reading::Program;
use truegrind_surfaces::SurfaceFile;
use truegrind_surfaces::sample::{self, Sample};

/// The result.
#[derive(Debug, Clone)]
pub struct GrindingResult {
    /// Settings of the experiment.
    pub settings: Grinding,
    /// Name of the job.
    pub surface: String,
    /// Name of its program.
    pub program: String,
    /// Whether the actual arm is simulated; otherwise the sound estimate replaces it.
    pub simulated: bool,
    /// Rows of one case.
    pub measured: usize,
    /// Whether these are all rows of the file, so that only the split differs between cases.
    pub all_rows: bool,
    /// Whether these are fewer rows than the experiment states.
    pub reduced: bool,
    /// Points of the cut.
    pub points: usize,
    /// Before compensation.
    pub before: Option<Block>,
    /// One row for each method.
    pub rows: Vec<GrindingRow>,
    /// Every method against the reference, by the mean absolute deviation; absent for the reference itself and for a
    /// method without a complete result in every case.
    pub against: Vec<Option<Test>>,
    /// The diagnosis of the measured rows of each case, `None` for one that it refused; absent for simulated rows. It has no deviations on
    /// the part: the estimate that replaces the actual arm knows geometry alone.
    pub named_causes: Option<Vec<Option<NamedCauses>>>,
    /// The paths of the first case, one for each method, with deviations before and after.
    pub reports: Vec<PathReport>,
}

/// A method of the experiment.
#[derive(Debug, Clone)]
pub struct GrindingRow {
    /// Id.
    pub id: String,
    /// The solver.
    pub solver: &'static Solver,
    /// Deviations printed in the paper.
    pub paper: Option<PaperPoints>,
    /// One entry for each case.
    pub cases: Vec<GrindingCase>,
}

/// A method in one case.
#[derive(Debug, Clone)]
pub struct GrindingCase {
    /// Deviations after compensation; absent when the program could not be rewritten.
    pub after: Option<Block>,
    /// Number of targets whose correction was refused.
    pub refused: usize,
    /// Errors of the model on held-out measurements.
    pub held_out: ErrorSummary,
    /// Termination of the fit.
    pub termination: Termination,
    /// Reason for a missing result.
    pub failure: Option<String>,
}

impl GrindingRow {
    /// A figure of the deviations for every case; empty if a case failed.
    pub fn over_cases(&self, figure: fn(&Block) -> f64) -> Option<Vec<f64>> {
        self.cases.iter().map(|case| case.after.as_ref().map(figure)).collect()
    }

    /// Number of refused targets over all cases.
    pub fn refused(&self) -> usize {
        self.cases.iter().map(|case| case.refused).sum()
    }

    /// Mean absolute deviation of every case, if every target was rewritten in each.
    pub fn sizes_mm(&self) -> Option<Vec<f64>> {
        let sizes = self.over_cases(|b| b.all.mean_absolute)?;
        (self.refused() == 0 && sizes.iter().all(|v| v.is_finite())).then_some(sizes)
    }
}

/// Bounds of a correction (mm, rad), far above those of `compensate` (10 mm, 2°).
const MAX_CORRECTION_MM: f64 = 100.0;
const MAX_TURN_RAD: f64 = 0.35;

/// The arm that grinds.
#[derive(Debug, Clone, Copy)]
pub enum Actual<'a> {
    /// A simulated arm, unknown to the methods.
    Simulated(&'a Model),
    /// The sound estimate from all rows.
    Estimated,
}

/// Cell and program that all methods and cases share.
struct Shop<'a> {
    name: &'a str,
    program: &'a [u8],
    setup: &'a Setup,
    task: &'a Program<'a>,
    cell: &'a Cell,
    surface: &'a SurfaceFile,
    nominal: &'a Model,
    robot: &'a str,
    held_out: f64,
    condition: Condition,
    /// The arm that grinds.
    model: &'a Model,
    after: After,
}

/// Runs the experiment. `options.rows` replaces the rows of the settings; case k has seed + k.
///
/// # Errors
/// [`ExperimentError`] if the surface gives no program, or the rows are too few or do not determine the sensor's location.
/// A failed method is no error but a row with the reason.
pub fn run(
    settings: &Grinding,
    experiment: &str,
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    actual: Actual<'_>,
    options: &CaseOptions,
) -> Result<GrindingResult, ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.to_owned(), message };
    let sample = shipped(&settings.surface).map_err(fail)?;
    let (all, seed) = (dataset.rows.len(), options.seed);
    let measured = rows_of_a_case(settings, experiment, dataset, options)?;
    let surface = sample.read().map_err(|e| fail(e.to_string()))?;
    let path = toolpath(&surface, nominal, robot).map_err(|e| fail(e.to_string()))?;
    // A tool vector and the rotation about it need no convention for A, B and C.
    let program =
        writer::write(&path.draft, Dialect::Siemens, Angles::Wpr).map_err(|e| fail(e.to_string()))?;
    let name = format!("{}.mpf", settings.surface);
    let setup = Setup::default(); // The program's comments state the tool and the work offset.
    let task = Program::read(&[(name.as_str(), program.as_slice())], &setup);
    let taught = taught_cell(&surface, &path, nominal, ["T1", "G54"]).map_err(|e| fail(e.to_string()))?;
    // The tool was measured, as in the paper.
    let cell = Cell { tool: vec![CellFrame::of("T1", FrameOrigin::Metrology)], ..taught };
    let estimated = || found(dataset, robot, nominal, &SOLVERS[0], settings.held_out, seed).map_err(fail);
    let (model, after) = match actual {
        Actual::Simulated(model) => (model.clone(), After::Achieved),
        Actual::Estimated => (estimated()?.estimated.model, After::PredictedRemainder),
    };
    let shop = Shop {
        name: &name,
        program: &program,
        setup: &setup,
        task: &task,
        cell: &cell,
        surface: &surface,
        nominal,
        robot,
        held_out: settings.held_out,
        condition: Condition { payload_kg: Some(path.draft.tool.1.mass_kg), ..Condition::default() },
        model: &model,
        after,
    };
    let named = settings.method.iter().map(|m| solver::by_name(&m.solver).map_err(|e| fail(e.to_string())));
    let solvers = named.collect::<Result<Vec<&'static Solver>, _>>()?;
    let cases: Vec<Vec<Ground>> = (0..settings.cases as u64)
        .into_par_iter()
        .map(|k| {
            let drawn = dataset.subset(&drawn(all, measured, seed + k));
            let methods = settings.method.iter().zip(&solvers);
            methods.map(|(method, solver)| ground(&shop, &method.id, solver, &drawn, seed + k)).collect()
        })
        .collect();
    let (rows, reports) = by_method(settings, &solvers, cases);
    let split_of = |k| {
        let rows = drawn(all, measured, seed + k);
        split::random(&dataset.subset(&rows), settings.held_out, seed + k).of_whole(&rows)
    };
    let named_causes = matches!(actual, Actual::Estimated).then(|| {
        let record = Record::of(dataset, nominal, false);
        let diagnosed = |k| record.diagnosed(&split_of(k), robot, nominal);
        (0..settings.cases as u64).into_par_iter().map(diagnosed).collect()
    });
    let against = against_reference(settings, &rows);
    Ok(GrindingResult {
        settings: settings.clone(),
        surface: surface.name.clone(),
        program: name,
        simulated: matches!(actual, Actual::Simulated(_)),
        measured,
        all_rows: measured == all,
        reduced: settings.rows.is_some_and(|asked| measured < asked),
        points: reports.first().map_or(0, |r| r.signed_mm(|p| p.before).len()),
        before: reports.first().and_then(|r| r.block(|p| p.before)),
        rows,
        against,
        named_causes,
        reports,
    })
}

/// Number of rows of one case.
fn rows_of_a_case(
    settings: &Grinding,
    experiment: &str,
    dataset: &Dataset,
    options: &CaseOptions,
) -> Result<usize, ExperimentError> {
    let all = dataset.rows.len();
    let asked = options.rows.or(settings.rows).unwrap_or(all);
    if all < asked {
        return Err(ExperimentError::TooFewRows {
            file: dataset.file.clone(),
            experiment: experiment.to_owned(),
            found: all,
            asked,
            // With all rows every case would be the same.
            possible: all * 4 / 5,
        });
    }
    Ok(asked)
}

/// A shipped surface, by the name of its file.
fn shipped(name: &str) -> Result<&'static Sample, String> {
    let stem = |sample: &Sample| sample.file.trim_end_matches(".toml");
    sample::ALL.iter().find(|sample| stem(sample) == name).ok_or_else(|| {
        let names: Vec<&str> = sample::ALL.iter().map(stem).collect();
        format!("no shipped surface is named {name}; available: {}", names.join(", "))
    })
}

/// Result of a method in one case, with its path if there is one.
type Ground = (GrindingCase, Option<PathReport>);

/// Transposes cases with an entry for each method to methods with an entry for each case; also returns the paths of the first case.
fn by_method(
    settings: &Grinding,
    solvers: &[&'static Solver],
    cases: Vec<Vec<Ground>>,
) -> (Vec<GrindingRow>, Vec<PathReport>) {
    let row = |(method, &solver): (&GrindingMethod, &&'static Solver)| GrindingRow {
        id: method.id.clone(),
        solver,
        paper: method.paper,
        cases: Vec::new(),
    };
    let mut rows: Vec<GrindingRow> = settings.method.iter().zip(solvers).map(row).collect();
    let mut reports = Vec::new();
    for (k, case) in cases.into_iter().enumerate() {
        for (row, (case, report)) in rows.iter_mut().zip(case) {
            row.cases.push(case);
            reports.extend(report.filter(|_| k == 0));
        }
    }
    (rows, reports)
}

/// Compares every method with the reference by the mean absolute deviation of each case.
fn against_reference(settings: &Grinding, rows: &[GrindingRow]) -> Vec<Option<Test>> {
    let reference = rows.iter().find(|r| r.id == settings.reference).and_then(GrindingRow::sizes_mm);
    let sizes: Vec<Option<Vec<f64>>> = rows
        .iter()
        .map(|r| reference.as_ref().and_then(|_| r.sizes_mm()).filter(|_| r.id != settings.reference))
        .collect();
    let ratio = settings.held_out / (1.0 - settings.held_out);
    paired(&reference.unwrap_or_default(), &sizes, ratio)
}

/// Model that a method identifies from measurements.
fn found(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    solver: &'static Solver,
    held_out: f64,
    seed: u64,
) -> Result<Identification, String> {
    let (observed, _) = prepare_observations(dataset, nominal, false);
    let frames = register(&observed, nominal, &Tolerance::default()).map_err(|e| e.to_string())?.start;
    let options = Options {
        tolerance: Tolerance::default(),
        solver,
        held_out,
        seed,
        fuse_readout: false,
        limit_rmse_mm: None,
        limit_max_mm: None,
        stated_frames: None,
    };
    let division = |d: &Dataset| split::random(d, held_out, seed);
    identify(dataset, robot, nominal, &frames, &division, &options).map_err(|e| e.to_string())
}

/// Identifies, rewrites the program and runs it.
fn ground(shop: &Shop<'_>, id: &str, solver: &'static Solver, dataset: &Dataset, seed: u64) -> Ground {
    let mut case = GrindingCase {
        after: None,
        refused: 0,
        held_out: ErrorSummary::UNKNOWN,
        termination: Termination::NotFinite,
        failure: None,
    };
    let one = match found(dataset, shop.robot, shop.nominal, solver, shop.held_out, seed) {
        Ok(one) => one,
        Err(reason) => {
            case.failure = Some(reason);
            return (case, None);
        }
    };
    case.held_out = one.estimated.calibrated.held_out;
    case.termination = one.training.termination();
    // The papers have no bounds and judge single points. Methods without priors move unobservable parameters by
    // centimetres; the wide bounds let such corrections pass, so that their consequence is measured.
    let bounds = RewriteBounds {
        condition: shop.condition,
        max_correction_mm: MAX_CORRECTION_MM,
        max_rotation_rad: MAX_TURN_RAD,
        cuts: Cuts::Single,
        joint_gain: f64::INFINITY,
        placement: Placement::Absolute,
        ..RewriteBounds::default()
    };
    let mark = Mark { version: env!("CARGO_PKG_VERSION").to_owned(), model: String::new(), partial: false };
    let done = compensate(shop.task, &one.estimated, shop.cell, &bounds, Some(mark));
    let written = done.map_err(|e| e.to_string()).and_then(|done| {
        let bytes = done.rewritten.files[0].edits.apply(shop.program).map_err(|e| e.to_string())?;
        Ok((done.plan, bytes))
    });
    let (planned, bytes) = match written {
        Ok(written) => written,
        Err(reason) => {
            case.failure = Some(reason);
            return (case, None);
        }
    };
    let refused = |p: &&PathPoint| p.status == MotionStatus::Refused;
    case.refused = planned.points.iter().filter(refused).count();
    let changed = Program::read(&[(shop.name, bytes.as_slice())], shop.setup);
    let judged = VerificationTask {
        original: shop.task.listing(),
        rewritten: Some(changed.listing()),
        cell: shop.cell,
        surface: Some(&shop.surface.surface),
        program: shop.name,
        name: &format!("{id} {}", solver.name),
        after: shop.after,
        tolerance_mm: RewriteBounds::default().tolerance_mm,
        loads: [None, None],
    };
    let acting =
        ActingArm { nominal: shop.nominal, model: shop.model, knowledge: None, condition: shop.condition };
    let mut report = verify(&judged, &acting);
    report.held_out_mm = Some(case.held_out.rmse);
    for (point, planned) in report.points.iter_mut().zip(&planned.points) {
        (point.status, point.reason) = (planned.status, planned.reason.clone());
    }
    case.after = report.block(|p| p.after);
    (case, Some(report))
}
