//! Simulation, measurement plans and tracking.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use truegrind::calibration::tracking::first_poses as first_of;
use truegrind::math::work::report_step;
use truegrind::planning::poses::candidate::Bounds;
use truegrind::planning::poses::keep_out::KeepOut;
use truegrind::planning::poses::program::{ProgramSettings, draft};
use truegrind::planning::poses::rows::Noise;
use truegrind::planning::poses::schedule::Visits;
use truegrind::report::{format, planning, tracking};
use truegrind::robots::foreign::ImportOptions;
use truegrind::{
    Alarm, Frames, MeasurementSetup, Pose, PosesOptions, PosesPlan, Recipe, Robot, Sensor, Simulation,
    TrackOptions, TrackState, Tracker, plan_poses, read_measurements, robots, write_rapid,
};

use crate::dataset::PyDataset;
use crate::errors::{Kind, Refusal};
use crate::fits::{positive, whole};
use crate::model::{self, PyModel};
use crate::programs::text;
use crate::robot::{PyArm, from_name, named};
use crate::running::run;
use crate::types::{
    Columns, Dictionaries, NamedModel, NamedRobot, Object, OneOrMoreDatasets, PathOrText, Progress,
};

/// Simulated measurements.
#[pyclass(name = "Simulation", module = "truegrind", frozen)]
pub(crate) struct PySimulation {
    made: Simulation,
    rows: Arc<truegrind::Dataset>,
    robot: String,
}

#[pymethods]
impl PySimulation {
    /// The measured rows.
    #[getter]
    fn dataset(&self) -> PyDataset {
        PyDataset { rows: self.rows.clone(), odd_units: false }
    }

    /// The measurement file (CSV).
    #[getter]
    fn csv(&self) -> &str {
        &self.made.csv
    }

    /// The arm that was measured.
    #[getter]
    fn actual(&self) -> PyArm {
        PyArm {
            name: format!("actual {}", self.robot),
            model: self.made.actual.clone(),
            nominal: self.made.nominal.clone(),
        }
    }

    fn __repr__(&self) -> String {
        format!("<Simulation of {}: {} rows>", self.robot, self.made.rows.len())
    }
}

/// Simulates measurements of a given "actual" arm, with effects, noise and rounding. ``recipe``: a recipe file (TOML) or its text.
/// ``seed``: seed of poses and noise, instead of that of the recipe.
#[pyfunction]
#[pyo3(signature = (recipe, *, seed = None, name = "simulated.csv"))]
pub(crate) fn simulate(
    py: Python<'_>,
    recipe: Object<'_, PathOrText>,
    seed: Option<i64>,
    name: &str,
) -> PyResult<PySimulation> {
    let (text, path) = text(&recipe, Kind::Recipe)?;
    let file = path.map_or("recipe.toml".to_owned(), |path| path.display().to_string());
    run(py, None, None, || {
        let mut recipe = Recipe::parse(&text, &file)?;
        recipe.seed = seed.map_or(Ok(recipe.seed), |seed| whole("seed", seed))?;
        let resolve = |name: &str| {
            let found = from_name(Path::new(name), &ImportOptions::default());
            let said = |error: PyErr| Python::attach(|py| error.value(py).to_string());
            found.map(|(robot, _)| robot.model).map_err(said)
        };
        let made = recipe.simulate(resolve)?;
        let rows = read_measurements(name, made.csv.as_bytes(), &Default::default())?;
        Ok(PySimulation { made, rows: Arc::new(rows), robot: recipe.robot.clone() })
    })
}

/// A measurement plan.
#[pyclass(name = "Plan", module = "truegrind", frozen)]
pub(crate) struct PyPlan {
    plan: PosesPlan,
    robot: Robot,
    sensor: Sensor,
    frames: Frames,
    speed_mm_s: f64,
    settle_s: f64,
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
        let drive = ProgramSettings {
            robot: self.robot.sheet.name.clone(),
            travel_mm_s: self.speed_mm_s,
            settle_s: self.settle_s,
            ..ProgramSettings::default()
        };
        let bytes = write_rapid(&draft(&self.plan, &self.setup(), &drive))
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

/// Pose of the sensor: x, y, z (mm), or x, y, z, qw, qx, qy, qz.
fn place(name: &str, numbers: &[f64]) -> Result<Pose, Refusal> {
    let expected = "x, y, z (mm), or x, y, z, qw, qx, qy, qz of a unit quaternion";
    let wrong = || Refusal::argument(name, format!("{numbers:?}"), expected);
    match *numbers {
        [x, y, z] => Ok(Pose::translation(x, y, z)),
        [x, y, z, w, i, j, k] => {
            let turn = Quaternion::new(w, i, j, k);
            if !((turn.norm() - 1.0).abs() <= 0.01) {
                return Err(wrong());
            }
            Ok(Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::from_quaternion(turn)))
        }
        _ => Err(wrong()),
    }
}

/// Chooses the poses to measure and makes a program that moves to them. ``sensor``: ``"cable"``, ``"position"`` or ``"pose"``. A cable
/// needs its ``outlets_mm`` in the base; a tracker may stand anywhere. ``touched_point``: the hook or reflector on the flange.
#[pyfunction]
#[pyo3(
    name = "plan",
    signature = (
        robot, sensor: "Literal['cable', 'position', 'pose']", *, poses = 60, outlets_mm = None, sensor_frame = None, touched_point = None, sigma_mm = None,
        sigma_angle_deg = 0.006, margin_deg = 6.0, floor_mm = 0.0, speed_mm_s = 200.0, settle_s = 2.0, candidates = 2000,
        seed = 0, threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn plan_(
    py: Python<'_>,
    robot: Object<'_, NamedRobot>,
    sensor: &str,
    poses: i64,
    outlets_mm: Option<Vec<[f64; 3]>>,
    sensor_frame: Option<Vec<f64>>,
    touched_point: Option<Vec<f64>>,
    sigma_mm: Option<f64>,
    sigma_angle_deg: f64,
    margin_deg: f64,
    floor_mm: f64,
    speed_mm_s: f64,
    settle_s: f64,
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
    if !(4..=2000).contains(&poses) {
        return Err(Refusal::argument("poses", poses, "4 to 2000; some 50 to 100 are usual").into());
    }
    if candidates > 100_000 {
        return Err(Refusal::argument("candidates", candidates, "at most 100000; 2000 are usual").into());
    }
    let (poses, candidates): (usize, usize) = (whole("poses", poses)?, whole("candidates", candidates)?);
    let outlets = outlets_mm.unwrap_or_default();
    if sensor == Sensor::Cable && outlets.is_empty() {
        let expected = "where in the robot's base the cable comes out, x, y, z (mm), once for each cable";
        return Err(Refusal::argument("outlets_mm", "nothing", expected).into());
    }
    let mut frames = Frames::at_origin(outlets.len().max(1));
    for (to, outlet) in frames.outlets_mm.iter_mut().zip(&outlets) {
        *to = Vector3::from(*outlet);
    }
    if let Some(point) = &touched_point {
        frames.flange_from_target = place("touched_point", point)?;
    }
    if let Some(frame) = &sensor_frame {
        frames.base_from_sensor = place("sensor_frame", frame)?;
    }
    let reach_mm: f64 = robot.model.links[1..].iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum();
    let approach_rad = 3.0_f64.to_radians();
    let defaults = PosesOptions::default();
    let reading_mm = sigma_mm.unwrap_or(if sensor == Sensor::Cable { 0.05 } else { 0.03 });
    let options = PosesOptions {
        poses,
        noise: Noise {
            reading_mm: positive("sigma_mm", reading_mm)?,
            reading_rad: positive("sigma_angle_deg", sigma_angle_deg)?.to_radians(),
        },
        candidates: candidates.max(poses),
        bounds: Bounds {
            margin_rad: margin_deg.to_radians().max(approach_rad),
            min_singularity: 0.05,
            box_mm: None,
            distance_mm: None,
            clearance_mm: (sensor == Sensor::Cable).then_some(reach_mm / 12.0),
            space: KeepOut {
                floor_mm: Some(floor_mm),
                boxes_mm: Vec::new(),
                radius_mm: reach_mm / 12.0,
                approach_rad,
            },
        },
        visits: Visits { repeats: 4, both_sides: 12, warm_up: 8, approach_rad, seconds_per_row: 12.0 },
        decisive: 25.0,
        seed: whole("seed", seed)?,
        ..defaults
    };
    let speed_mm_s = positive("speed_mm_s", speed_mm_s)?;
    run(py, threads, progress.as_deref(), || {
        report_step(&format!("choosing {poses} of {candidates} poses"));
        let setup = MeasurementSetup { nominal: &robot.model, sensor, frames: &frames };
        let plan = plan_poses(&setup, &options).map_err(|error| {
            let message = format!("{}: {error}", robot.sheet.name);
            Refusal::from(error).saying(message)
        })?;
        Ok(PyPlan { plan, robot, sensor, frames, speed_mm_s, settle_s })
    })
}

/// Result of tracking.
#[pyclass(name = "Track", module = "truegrind", frozen)]
pub(crate) struct PyTrack {
    tracker: Tracker,
    fresh: usize,
    alarms: Vec<Alarm>,
}

#[pymethods]
impl PyTrack {
    /// The current model.
    #[getter]
    fn model(&self) -> PyResult<PyModel> {
        Ok(PyModel::found(&self.tracker.model())?)
    }

    /// Number of processed poses.
    #[getter]
    fn poses(&self) -> usize {
        self.tracker.state().poses
    }

    /// Alarms raised by these measurements: dictionaries as in the JSON.
    #[getter]
    fn alarms<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, Dictionaries>> {
        let whole = py.import("json")?.call_method1("loads", (self.to_json()?,))?;
        Ok(whole.get_item("alarms")?.into())
    }

    /// The state, for ``track(..., state=...)``.
    #[getter]
    fn state(&self) -> PyResult<String> {
        Ok(self.tracker.state().to_toml().map_err(Refusal::from)?)
    }

    /// The full result as JSON text, schema ``truegrind.track/1``.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&tracking::json(&self.tracker, self.fresh, &self.alarms))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&tracking::document(&self.tracker, self.fresh, &self.alarms, "the model"))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Track of {}: {} poses, {} of them new, {} alarms>",
            self.tracker.robot(),
            self.tracker.state().poses,
            self.fresh,
            self.alarms.len()
        )
    }
}

/// Updates a model with new measurements: one dataset, or several in order. ``state``: state of an earlier track. ``first_poses``: number
/// of poses that locate the sensor before tracking begins.
#[pyfunction]
#[pyo3(
    name = "track",
    signature = (
        model, datasets, *, state = None, first_poses = None, sigma_mm = None, allow_odd_units = false, threads = None,
        progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn track_(
    py: Python<'_>,
    model: Object<'_, NamedModel>,
    datasets: Object<'_, OneOrMoreDatasets>,
    state: Option<&str>,
    first_poses: Option<i64>,
    sigma_mm: Option<f64>,
    allow_odd_units: bool,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyTrack> {
    let mut kept = None;
    let estimated = model::named(&model, &mut kept)?;
    let given: Vec<PyRef<'_, PyDataset>> = match datasets.extract::<PyRef<'_, PyDataset>>() {
        Ok(one) => vec![one],
        Err(_) => datasets.extract()?,
    };
    let given: Vec<&PyDataset> = given.iter().map(|dataset| &**dataset).collect();
    let mut options = TrackOptions {
        sigma_mm: sigma_mm.map(|sigma| positive("sigma_mm", sigma)).transpose()?,
        ..TrackOptions::default()
    };
    if let Some(poses) = first_poses {
        options.first_poses = whole("first_poses", poses.max(4))?;
    }
    run(py, threads, progress.as_deref(), || {
        let arm = &estimated.arm;
        let robot = robots::load(&arm.robot).ok();
        let convention = robot.map(|robot| robot.sheet.joints.angles.into()).unwrap_or_default();
        let rows = given.iter().map(|dataset| {
            let odd = allow_odd_units || dataset.odd_units;
            let rows = (*dataset.rows).clone();
            truegrind::calibration::measurement::matching::match_to_arm(
                rows,
                &arm.robot,
                &arm.nominal,
                convention,
                odd,
            )
        });
        let rows = rows.collect::<Result<Vec<_>, _>>()?;
        let mut tracker = match state {
            Some(state) => {
                let state = TrackState::from_toml(state)?;
                if state.model_hash != estimated.hash {
                    let message = "state: is the track of another model: give the model that it began with";
                    return Err(Refusal::new(Kind::Track, message));
                }
                Tracker::resume(arm, state, "state")?
            }
            None => {
                let first = first_of(&rows, options.first_poses)
                    .ok_or_else(|| Refusal::new(Kind::Track, "no measurements to begin with"))?;
                report_step("placing the sensor");
                Tracker::begin(arm, &estimated.hash, &first, &options)?
            }
        };
        let before = tracker.state().poses;
        let mut alarms = Vec::new();
        for dataset in &rows {
            report_step(&format!("taking in {}", dataset.file));
            alarms.extend(tracker.process_file(dataset)?);
        }
        let fresh = tracker.state().poses - before;
        Ok(PyTrack { tracker, fresh, alarms })
    })
}
