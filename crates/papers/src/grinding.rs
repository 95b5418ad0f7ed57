//! A ground surface before compensation and after it with what each method identified: ltlm-2024 Table 8 and Fig. 9.
//!
//! The surface equation becomes an NC program, as in the paper; the actual arm runs it as it is, and rewritten with each
//! method's model. The tool is measured; the work object was taught with the uncalibrated arm by three points, as in most cells: what no measurement
//! in the cell can tell, the frame of the base against link 1, then does not count. Deviations are signed along the
//! outward normal. Several cases draw the measured rows anew: the part and its program stay, what a method makes of the
//! measurements does not.
//!
//! The actual arm is known only where the measurements were simulated. With measurements of a real arm the sound
//! estimate from all rows stands in for it, and the result is a prediction, labelled so.

use rayon::prelude::*;

use crate::experiment::{ExperimentError, Grinding, GrindingMethod, PaperPoints};
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
use truegrind_compensation::deviation::{After, Block, PathPoint, PathReport, Status};
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
    /// What was asked for.
    pub settings: Grinding,
    /// Name of the job.
    pub surface: String,
    /// Name of its program.
    pub program: String,
    /// Whether the actual arm is a simulated one, else the sound estimate stands in for it.
    pub simulated: bool,
    /// Rows of one case.
    pub measured: usize,
    /// Whether that is all there is, so that only the split differs from case to case.
    pub all_rows: bool,
    /// Whether that is fewer than the experiment asks for.
    pub reduced: bool,
    /// Points of the cut.
    pub points: usize,
    /// Before compensation.
    pub before: Option<Block>,
    /// One row for each method.
    pub rows: Vec<GrindingRow>,
    /// Every method against the reference, by the mean size of the deviation; absent for the reference itself and where a
    /// method has no whole result in every case.
    pub against: Vec<Option<Test>>,
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
    /// What the paper prints.
    pub paper: Option<PaperPoints>,
    /// One entry for each case.
    pub cases: Vec<GrindingCase>,
}

/// A method in one case.
#[derive(Debug, Clone)]
pub struct GrindingCase {
    /// Deviations after compensation; absent where nothing could be rewritten.
    pub after: Option<Block>,
    /// Targets that were not rewritten, because that was refused.
    pub refused: usize,
    /// Errors of the model on held-out measurements.
    pub held_out: ErrorSummary,
    /// How the fit ended.
    pub termination: Termination,
    /// Why there is no result, where there is none.
    pub failure: Option<String>,
}

impl GrindingRow {
    /// A figure of the deviations in every case; nothing where a case failed.
    pub fn over_cases(&self, figure: fn(&Block) -> f64) -> Option<Vec<f64>> {
        self.cases.iter().map(|case| case.after.as_ref().map(figure)).collect()
    }

    /// Targets that were refused in all cases together.
    pub fn refused(&self) -> usize {
        self.cases.iter().map(|case| case.refused).sum()
    }

    /// Mean size of the deviation in every case, where every target was rewritten in each.
    pub fn sizes_mm(&self) -> Option<Vec<f64>> {
        let sizes = self.over_cases(|b| b.all.mean_absolute)?;
        (self.refused() == 0 && sizes.iter().all(|v| v.is_finite())).then_some(sizes)
    }
}

/// Bounds of a correction here (mm, rad), far beyond those of `compensate` (10 mm, 2°).
const LARGEST_CORRECTION_MM: f64 = 100.0;
const LARGEST_TURN_RAD: f64 = 0.35;

/// The arm that grinds.
#[derive(Debug, Clone, Copy)]
pub enum Actual<'a> {
    /// A simulated one, which no method has seen.
    Simulated(&'a Model),
    /// The sound estimate from all rows.
    Estimated,
}

/// The shop in which all methods and cases are tried.
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

/// Runs the experiment. Of the options, rows of one case stand in place of those of the settings, and case k has seed + k.
///
/// # Errors
/// [`ExperimentError`] where the surface gives no program, or the rows are too few or do not place the sensor. A method
/// that fails is a row that says so.
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
    let all = dataset.rows.len();
    let seed = options.seed;
    let measured = rows_of_a_case(settings, experiment, dataset, options)?;
    let surface = sample.read().map_err(|e| fail(e.to_string()))?;
    let path = toolpath(&surface, nominal, robot).map_err(|e| fail(e.to_string()))?;
    // A tool vector and the turn about it: no convention of A, B and C is needed.
    let program =
        writer::write(&path.draft, Dialect::Siemens, Angles::Wpr).map_err(|e| fail(e.to_string()))?;
    let name = format!("{}.mpf", settings.surface);
    // Where tool and work offset lie stands in the program's comments.
    let setup = Setup::default();
    let task = Program::read(&[(name.as_str(), program.as_slice())], &setup);
    let taught = taught_cell(&surface, &path, nominal, ["T1", "G54"]).map_err(|e| fail(e.to_string()))?;
    // The paper's tool was measured.
    let cell = Cell { tool: vec![CellFrame::of("T1", FrameOrigin::Metrology)], ..taught };
    let stand_in = match actual {
        Actual::Simulated(_) => None,
        Actual::Estimated => {
            let found = found(dataset, robot, nominal, &SOLVERS[0], settings.held_out, seed);
            Some(found.map_err(fail)?.estimated.model)
        }
    };
    let (model, after) = match (actual, &stand_in) {
        (Actual::Simulated(model), _) => (model, After::Achieved),
        (_, Some(model)) => (model, After::PredictedRemainder),
        (Actual::Estimated, None) => (nominal, After::PredictedRemainder),
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
        model,
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
        reports,
    })
}

/// How many rows one case has.
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
            // With all of them every case would have the same rows.
            possible: all * 4 / 5,
        });
    }
    Ok(asked)
}

/// A surface that ships, by the name of its file.
fn shipped(name: &str) -> Result<&'static Sample, String> {
    let stem = |sample: &Sample| sample.file.trim_end_matches(".toml");
    sample::ALL.iter().find(|sample| stem(sample) == name).ok_or_else(|| {
        let names: Vec<&str> = sample::ALL.iter().map(stem).collect();
        format!("no surface named {name} ships; there are {}", names.join(", "))
    })
}

/// What a method comes to in one case, with its path where it has one.
type Ground = (GrindingCase, Option<PathReport>);

/// The cases, each with an entry for each method, as methods with an entry for each case; and the paths of the first case.
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

/// Every method against the reference, by the mean size of the deviation in each case.
fn against_reference(settings: &Grinding, rows: &[GrindingRow]) -> Vec<Option<Test>> {
    let reference = rows.iter().find(|r| r.id == settings.reference).and_then(GrindingRow::sizes_mm);
    let sizes: Vec<Option<Vec<f64>>> = rows
        .iter()
        .map(|r| reference.as_ref().and_then(|_| r.sizes_mm()).filter(|_| r.id != settings.reference))
        .collect();
    let ratio = settings.held_out / (1.0 - settings.held_out);
    paired(&reference.unwrap_or_default(), &sizes, ratio)
}

/// What a method makes of measurements.
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
        held_out: ErrorSummary::default(),
        termination: Termination::NotFinite,
        failure: None,
    };
    let one = match found(dataset, shop.robot, shop.nominal, solver, shop.held_out, seed) {
        Ok(one) => one,
        Err(why) => {
            case.failure = Some(why);
            return (case, None);
        }
    };
    case.held_out = one.estimated.geometry.held_out;
    case.termination = one.training.termination();
    // The papers know no bounds, and judge point by point. Methods without priors move what the measurements cannot see by centimetres: here
    // that is let through, so that its consequence is seen and not only its refusal.
    let bounds = RewriteBounds {
        condition: shop.condition,
        max_correction_mm: LARGEST_CORRECTION_MM,
        max_rotation_rad: LARGEST_TURN_RAD,
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
        Err(why) => {
            case.failure = Some(why);
            return (case, None);
        }
    };
    let refused = |p: &&PathPoint| p.status == Status::Refused;
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
