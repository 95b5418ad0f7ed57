//! A ground surface before compensation and after it with what each method identified: ltlm-2024 Table 8 and Fig. 9.
//!
//! The surface equation becomes an NC program, as in the paper; the actual arm runs it as it is, and rewritten with each
//! method's model. The tool is measured; the work object was taught with the uncalibrated arm by three points, as in most cells: what no measurement
//! in the cell can tell, the frame of the base against link 1, then does not count. Deviations are signed along the
//! outward normal.
//!
//! The actual arm is known only where the measurements were simulated. With measurements of a real arm the sound
//! estimate from all rows stands in for it, and the result is a prediction, labelled so.

use nalgebra::Vector3;

use crate::comparison::experiment::{ExperimentError, Grinding, PaperPoints};
use crate::comparison::protocol::register;
use crate::compensation::cell::{Cell, CellFrame, FrameOrigin};
use crate::compensation::deviation::{After, Block, PathReport};
use crate::compensation::rewrite::{Options as RewriteBounds, plan};
use crate::compensation::verify::{Acting, Judged, judge};
use crate::estimation::estimate::Termination;
use crate::identification::identify::{Identification, Options, identify, observe};
use crate::identification::solver::{self, SOLVERS, Solver};
use crate::identification::tolerance::Tolerance;
use crate::kinematics::condition::Condition;
use crate::kinematics::inverse::{Inverse, InverseError};
use crate::kinematics::model::Model;
use crate::math::se3::Pose;
use crate::math::statistics::ErrorSummary;
use crate::measurement::dataset::Dataset;
use crate::measurement::split;
use crate::planning::toolpath::{Toolpath, toolpath};
use crate::program::motion::Mark;
use crate::program::nc::dialect::Dialect;
use crate::program::nc::orientation::Angles;
use crate::program::nc::setup::Setup;
use crate::program::nc::writer;
use crate::program::reading::Program;
use crate::program::rewrite::RewriteOptions;
use crate::surface::{SurfaceFile, sample};

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
    /// Points of the cut.
    pub points: usize,
    /// Before compensation.
    pub before: Option<Block>,
    /// One row for each method.
    pub rows: Vec<GrindingRow>,
    /// The paths, one for each method, with deviations before and after.
    pub reports: Vec<PathReport>,
}

/// A method of the experiment.
#[derive(Debug, Clone)]
pub struct GrindingRow {
    /// Id.
    pub id: String,
    /// The solver.
    pub solver: &'static Solver,
    /// Deviations after compensation; absent where nothing could be rewritten.
    pub after: Option<Block>,
    /// Targets that were not rewritten, because that was refused.
    pub refused: usize,
    /// Errors of the model on held-out measurements.
    pub held_out: ErrorSummary,
    /// How the fit ended.
    pub termination: Termination,
    /// What the paper prints.
    pub paper: Option<PaperPoints>,
    /// Why there is no result, where there is none.
    pub failure: Option<String>,
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

/// Runs the experiment.
///
/// # Errors
/// [`ExperimentError`] where the surface gives no program or the rows do not place the sensor. A method that fails is a
/// row that says so.
pub fn run(
    settings: &Grinding,
    experiment: &str,
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    actual: Actual<'_>,
    seed: u64,
) -> Result<GrindingResult, ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.to_owned(), message };
    let stem = |file: &'static str| file.trim_end_matches(".toml");
    let sample = sample::ALL.iter().find(|s| stem(s.file) == settings.surface).ok_or_else(|| {
        let names: Vec<&str> = sample::ALL.iter().map(|s| stem(s.file)).collect();
        fail(format!("no surface named {} ships; there are {}", settings.surface, names.join(", ")))
    })?;
    let surface = sample.read().map_err(|e| fail(e.to_string()))?;
    let path = toolpath(&surface, nominal, robot).map_err(|e| fail(e.to_string()))?;
    // A tool vector and the turn about it: no convention of A, B and C is needed.
    let program =
        writer::write(&path.draft, Dialect::Siemens, Angles::Wpr).map_err(|e| fail(e.to_string()))?;
    let name = format!("{}.mpf", settings.surface);
    // Where tool and work offset lie stands in the program's comments.
    let setup = Setup::default();
    let task = Program::read(&[(name.as_str(), program.as_slice())], &setup);
    let cell = taught_cell(&surface, &path, nominal, ["T1", "G54"]).map_err(|e| fail(e.to_string()))?;
    let condition = Condition { payload_kg: Some(path.draft.tool.1.mass_kg), ..Condition::default() };

    let (observed, _) = observe(dataset, nominal, false);
    let (frames, _) = register(&observed, nominal)?;
    let found = |solver: &'static Solver| -> Result<Identification, String> {
        let options = Options {
            tolerance: Tolerance::default(),
            solver,
            held_out: settings.held_out,
            seed,
            sharpen: false,
            limit_rmse_mm: None,
            limit_max_mm: None,
            stated_frames: None,
        };
        let division = |d: &Dataset| split::random(d, settings.held_out, seed);
        identify(dataset, robot, nominal, &frames, &division, &options).map_err(|e| e.to_string())
    };
    let stand_in = match actual {
        Actual::Simulated(_) => None,
        Actual::Estimated => Some(found(&SOLVERS[0]).map_err(fail)?.estimated.model),
    };
    let (model, after) = match (actual, &stand_in) {
        (Actual::Simulated(model), _) => (model, After::Achieved),
        (_, Some(model)) => (model, After::PredictedRemainder),
        (Actual::Estimated, None) => (nominal, After::PredictedRemainder),
    };
    let acting = Acting { nominal, model, knowledge: None, condition };
    let mut reports = Vec::new();
    let mut rows = Vec::new();
    for method in &settings.method {
        let solver = solver::by_name(&method.solver).map_err(fail)?;
        let mut row = GrindingRow {
            id: method.id.clone(),
            solver,
            after: None,
            refused: 0,
            held_out: ErrorSummary::default(),
            termination: Termination::NotFinite,
            paper: method.paper,
            failure: None,
        };
        let one = match found(solver) {
            Ok(one) => one,
            Err(why) => {
                row.failure = Some(why);
                rows.push(row);
                continue;
            }
        };
        row.held_out = one.estimated.geometry.held_out;
        row.termination = one.training.termination();
        // The papers know no bounds. Methods without priors move what the measurements cannot see by centimetres: here
        // that is let through, so that its consequence is seen and not only its refusal.
        let bounds = RewriteBounds {
            condition,
            max_correction_mm: LARGEST_CORRECTION_MM,
            max_turn_rad: LARGEST_TURN_RAD,
            ..RewriteBounds::default()
        };
        let planned = plan(task.listing(), &one.estimated, &cell, &bounds);
        row.refused = planned
            .points
            .iter()
            .filter(|p| p.status == crate::compensation::deviation::Status::Refused)
            .count();
        let mark = Mark { version: env!("CARGO_PKG_VERSION").to_owned(), model: String::new() };
        let rewrite = RewriteOptions { mark: Some(mark), ..RewriteOptions::default() };
        let rewritten = task
            .rewrite(&planned.changes, &rewrite)
            .map_err(|e| e.to_string())
            .and_then(|edits| edits.files[0].edits.apply(&program).map_err(|e| e.to_string()));
        let bytes = match rewritten {
            Ok(bytes) => bytes,
            Err(why) => {
                row.failure = Some(why);
                rows.push(row);
                continue;
            }
        };
        let changed = Program::read(&[(name.as_str(), bytes.as_slice())], &setup);
        let judged = Judged {
            original: task.listing(),
            rewritten: Some(changed.listing()),
            cell: &cell,
            surface: Some(&surface.surface),
            program: &name,
            name: &format!("{} {}", method.id, solver.name),
            after,
            loads: [None, None],
        };
        let mut report = judge(&judged, &acting);
        report.held_out_mm = Some(one.estimated.geometry.held_out.rmse);
        for (point, planned) in report.points.iter_mut().zip(&planned.points) {
            (point.status, point.reason) = (planned.status, planned.reason.clone());
        }
        row.after = report.block(|p| p.after);
        reports.push(report);
        rows.push(row);
    }
    Ok(GrindingResult {
        settings: settings.clone(),
        surface: surface.name.clone(),
        program: name,
        simulated: matches!(actual, Actual::Simulated(_)),
        points: reports.first().map_or(0, |r| r.signed_mm(|p| p.before).len()),
        before: reports.first().and_then(|r| r.block(|p| p.before)),
        rows,
        reports,
    })
}

/// The cell as it is set up in most shops: the tool measured, the work object taught with the uncalibrated arm by three
/// points. `names` are those of tool and work object in the program.
///
/// # Errors
/// [`InverseError`] where the arm does not reach the three points.
pub fn taught_cell(
    surface: &SurfaceFile,
    path: &Toolpath,
    nominal: &Model,
    names: [&str; 2],
) -> Result<Cell, InverseError> {
    let [tool, work_object] = names;
    let inverse = Inverse::new(nominal, &Condition::default(), nominal);
    let object = surface.work_object.base_from_work_object;
    let middle = path.points.len() / 2;
    let (orientation, near) = (path.points[middle].orientation, path.joints[middle]);
    let taught = [Vector3::new(-40.0, 0.0, 0.0), Vector3::new(40.0, 0.0, 0.0), Vector3::new(0.0, 60.0, 0.0)];
    let teaching_deg = taught
        .iter()
        .map(|point| {
            let tip = Pose::from_parts((*point).into(), orientation);
            let flange = object * tip * surface.tool.flange_from_tool.inverse();
            let joints = inverse.solve_near(&flange, &near)?.joints;
            Ok(std::array::from_fn(|i| joints[i].to_degrees()))
        })
        .collect::<Result<Vec<[f64; 6]>, InverseError>>()?;
    Ok(Cell {
        tool: vec![CellFrame {
            name: tool.to_owned(),
            origin: FrameOrigin::Metrology,
            teaching_deg: Vec::new(),
            taught_with: None,
            position_mm: None,
            quaternion_wxyz: None,
        }],
        wobj: vec![CellFrame {
            name: work_object.to_owned(),
            origin: FrameOrigin::Taught,
            teaching_deg,
            taught_with: Some(tool.to_owned()),
            position_mm: None,
            quaternion_wxyz: None,
        }],
        external: Vec::new(),
    })
}
