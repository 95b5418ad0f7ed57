//! Measurement plans.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use truegrind::math::work::report_step;
use truegrind::planning::poses::program::{ProgramSettings, draft};
use truegrind::planning::poses::rows::Noise;
use truegrind::report::{format, planning};
use truegrind::{
    Frames, MeasurementSetup, Pose, PosesOptions, PosesPlan, Robot, Sensor, plan_poses, write_rapid,
};

use crate::errors::{Kind, Refusal};
use crate::fits::{not_negative, positive, whole};
use crate::interruptible::run;
use crate::robot::named;
use crate::types::{Columns, NamedRobot, Object, Progress};

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
        return Err(Refusal::argument("poses", poses, "4 to 2000; about 50 to 100 are usual").into());
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
    let mut options = PosesOptions::usual(&robot.model, sensor, sensor_frame.is_some());
    let reading_mm = sigma_mm.unwrap_or(options.noise.reading_mm);
    options.poses = poses;
    options.noise = Noise {
        reading_mm: positive("sigma_mm", reading_mm)?,
        reading_rad: positive("sigma_angle_deg", sigma_angle_deg)?.to_radians(),
    };
    options.candidates = candidates.max(poses);
    let margin_rad = not_negative("margin_deg", margin_deg)?.to_radians();
    options.bounds.margin_rad = margin_rad.max(options.visits.approach_rad);
    if !floor_mm.is_finite() {
        return Err(Refusal::argument("floor_mm", floor_mm, "a height in mm").into());
    }
    options.bounds.space.floor_mm = Some(floor_mm);
    options.seed = whole("seed", seed)?;
    let settle_s = not_negative("settle_s", settle_s)?;
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
