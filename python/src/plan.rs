//! Measurement plans.

use std::path::PathBuf;

use pyo3::prelude::*;
use truegrind::math::work::report_step;
use truegrind::planning::poses::design::Index;
use truegrind::planning::poses::program::{ProgramSettings, draft};
use truegrind::planning::poses::questions;
use truegrind::planning::poses::settings::Settings;
use truegrind::report::{format, planning};
use truegrind::{Frames, MeasurementSetup, PosesPlan, Robot, Sensor, plan_poses, write_rapid};

use crate::errors::{Kind, Refusal};
use crate::files;
use crate::fits::{PyDiagnosis, whole};
use crate::interruptible::run;
use crate::placement::Placement;
use crate::robot::named;
use crate::types::{Columns, NamedDiagnosis, NamedRobot, Object, Progress};

/// A measurement plan.
#[pyclass(name = "Plan", module = "truegrind", frozen)]
pub(crate) struct PyPlan {
    plan: PosesPlan,
    robot: Robot,
    sensor: Sensor,
    frames: Frames,
    drive: ProgramSettings,
}

impl PyPlan {
    fn setup(&self) -> MeasurementSetup<'_> {
        MeasurementSetup { nominal: &self.robot.model, sensor: self.sensor, frames: &self.frames }
    }
}

#[pymethods]
impl PyPlan {
    /// The rows in measuring order, one list per column of the table.
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, Columns>> {
        let csv = format::csv::table(&planning::table(&self.plan, &self.setup()));
        Ok(py.import("truegrind._results")?.call_method1("table", (csv,))?.into())
    }

    /// The RAPID program that moves to the poses.
    fn program(&self) -> PyResult<String> {
        let bytes = write_rapid(&draft(&self.plan, &self.setup(), &self.drive))
            .map_err(|error| Refusal::new(Kind::Plan, error))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// The full result as JSON text, schema ``truegrind.plan/1``: the bytes that ``truegrind plan --json`` writes.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&planning::json(&self.plan, &self.setup(), &self.robot.sheet.name))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&planning::document(&self.plan, &self.setup(), &self.robot.sheet.name))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __len__(&self) -> usize {
        self.plan.rows.len()
    }

    fn __repr__(&self) -> String {
        format!("<Plan for {}: {} rows>", self.robot.sheet.name, self.plan.rows.len())
    }
}

/// What a diagnosis left open.
///
/// # Errors
/// It is none, or of another robot, or has no such finding.
fn left_open(
    diagnosis: Option<&Bound<'_, PyAny>>,
    finding: Option<usize>,
    robot: &str,
) -> PyResult<questions::Open> {
    let Some(given) = diagnosis else {
        if finding.is_some() {
            return Err(Refusal::argument("diagnosis", "nothing", "the diagnosis of that finding").into());
        }
        return Ok(questions::Open::default());
    };
    let (text, file) = match given.cast::<PyDiagnosis>() {
        Ok(diagnosis) => (diagnosis.get().to_json()?, "diagnosis".to_owned()),
        Err(_) => {
            let path: PathBuf = given.extract().map_err(|_| {
                Refusal::argument("diagnosis", given, "a Diagnosis, or the file that its to_json gives")
            })?;
            (files::read_text(&path, Kind::Plan)?, files::name(&path))
        }
    };
    let open = questions::open(&text, finding)
        .map_err(|error| Refusal::new(Kind::Plan, format!("{file}: {error}")).of_file(&file))?;
    match questions::robot_of(&text) {
        Some(found) if found != robot => {
            let message = format!(
                "{file}: the diagnosis is of robot {found}, but the plan is for {robot}: give that robot"
            );
            Err(Refusal::new(Kind::Plan, message).of_file(&file).with(found, robot).into())
        }
        _ => Ok(open),
    }
}

/// Chooses the poses to measure and makes a program that moves to them. ``sensor``: ``"cable"``, ``"position"`` or ``"pose"``. A cable
/// needs its ``outlets_mm`` in the base; a tracker may stand anywhere (``sensor_frame``: where it stands). ``touched_point``: the hook or
/// reflector on the flange. ``poses``: number of different poses, 60 by default. ``diagnosis``: a ``Diagnosis``, or its JSON file, whose ambiguous
/// and untested causes the poses shall tell apart; ``finding``: for the finding with this number alone. ``index``: ``"d"`` (D-optimality) or
/// ``"o1"``. ``box_mm``: lower and upper corner of a box for the measured point; ``range_mm``: shortest and longest distance to the sensor;
/// ``keep_out_mm``: boxes that the arm must not enter, two corners each; all in the base. ``repeats``, ``both_sides``, ``warm_up``: poses measured two
/// more times, poses measured again from the other side, visits of one pose over the run. The other keywords are the options of ``truegrind plan``.
#[pyfunction]
#[pyo3(
    name = "plan",
    signature = (
        robot, sensor: "Literal['cable', 'position', 'pose']", *, poses = None, outlets_mm = None, cable_zeros_mm = None,
        sensor_frame = None, touched_point = None, diagnosis = None, finding = None, index: "Literal['d', 'o1']" = "d",
        sigma_mm = None, sigma_angle_deg = 0.006, box_mm = None, range_mm = None, clearance_mm = None, keep_out_mm = None,
        floor_mm = 0.0, link_radius_mm = None, margin_deg = 6.0, singularity = 0.05, repeats = 4, both_sides = 12, warm_up = 8,
        approach_deg = 3.0, settle_s = 2.0, seconds_per_row = 12.0, speed_mm_s = 200.0, decisive = 25.0, candidates = 2000,
        seed = 0, threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn plan_(
    py: Python<'_>,
    robot: Object<'_, NamedRobot>,
    sensor: &str,
    poses: Option<i64>,
    outlets_mm: Option<Vec<[f64; 3]>>,
    cable_zeros_mm: Option<Vec<f64>>,
    sensor_frame: Option<Vec<f64>>,
    touched_point: Option<Vec<f64>>,
    diagnosis: Option<Object<'_, NamedDiagnosis>>,
    finding: Option<i64>,
    index: &str,
    sigma_mm: Option<f64>,
    sigma_angle_deg: f64,
    box_mm: Option<[[f64; 3]; 2]>,
    range_mm: Option<[f64; 2]>,
    clearance_mm: Option<f64>,
    keep_out_mm: Option<Vec<[[f64; 3]; 2]>>,
    floor_mm: f64,
    link_radius_mm: Option<f64>,
    margin_deg: f64,
    singularity: f64,
    repeats: i64,
    both_sides: i64,
    warm_up: i64,
    approach_deg: f64,
    settle_s: f64,
    seconds_per_row: f64,
    speed_mm_s: f64,
    decisive: f64,
    candidates: i64,
    seed: i64,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyPlan> {
    let robot = named(&robot)?;
    let sensor = match sensor {
        "cable" => Sensor::Cable,
        "position" => Sensor::Position,
        "pose" => Sensor::Pose,
        other => {
            return Err(Refusal::argument("sensor", other, "\"cable\", \"position\" or \"pose\"").into());
        }
    };
    let index = match index {
        "d" => Index::D,
        "o1" => Index::O1,
        other => return Err(Refusal::argument("index", other, "\"d\" or \"o1\"").into()),
    };
    let sight_is_known = sensor_frame.is_some();
    let placement =
        Placement { sensor_frame, outlets_mm, cable_zeros_mm, touched_point, ..Placement::default() };
    let frames = placement.stated()?.planned(sensor).map_err(Refusal::from)?;
    let finding = finding.map(|number| whole("finding", number)).transpose()?;
    let settings = Settings {
        poses: poses.map(|poses| whole("poses", poses)).transpose()?,
        index,
        sigma_mm,
        sigma_angle_deg,
        box_mm,
        distance_mm: range_mm,
        clearance_mm,
        keep_out_mm: keep_out_mm.unwrap_or_default(),
        floor_mm,
        link_radius_mm,
        margin_deg,
        singularity,
        repeats: whole("repeats", repeats)?,
        both_sides: whole("both_sides", both_sides)?,
        warm_up: whole("warm_up", warm_up)?,
        approach_deg,
        settle_s,
        seconds_per_row,
        speed_mm_s,
        decisive,
        candidates: whole("candidates", candidates)?,
        seed: whole("seed", seed)?,
        open: left_open(diagnosis.as_deref(), finding, &robot.sheet.name)?,
        one_finding: finding.is_some(),
    };
    let setup = MeasurementSetup { nominal: &robot.model, sensor, frames: &frames };
    let options = settings.options(&robot, &setup, sight_is_known).map_err(Refusal::from)?;
    let drive = settings.program(&robot, &options);
    run(py, threads, progress.as_deref(), || {
        report_step(&format!("choosing among {} poses", options.candidates));
        let setup = MeasurementSetup { nominal: &robot.model, sensor, frames: &frames };
        let plan = plan_poses(&setup, &options).map_err(|error| {
            let message = format!("{}: {error}", robot.sheet.name);
            Refusal::from(error).saying(message)
        })?;
        Ok(PyPlan { plan, robot, sensor, frames, drive })
    })
}
