//! Robots of the catalogue and from files, and arms without a data sheet.

use std::path::PathBuf;

use nalgebra::Vector6;
use numpy::PyArray1;
use pyo3::prelude::*;
use truegrind::report::{format, robots as view};
use truegrind::robots::foreign::{ImportOptions, Kind as FileKind, import};
use truegrind::{ArmFile, Condition, Model, Robot, robots};

use crate::arm::{Acting, Stated, acting, forward, inverse};
use crate::errors::{Kind, Refusal};
use crate::files;
use crate::types::{ArrayLike, Floats, NamedArm, Object, Poses, Solutions, Typed};

/// A robot with its nominal arm from the data sheet.
#[pyclass(name = "Robot", module = "truegrind", frozen)]
pub(crate) struct PyRobot {
    pub(crate) robot: Robot,
    understood: Vec<String>,
}

impl PyRobot {
    pub(crate) fn acting(&self) -> Acting<'_> {
        Acting { arm: &self.robot.model, nominal: &self.robot.model, condition: Condition::default() }
    }
}

/// A robot from a catalogue name, a file, or a `Robot`.
///
/// # Errors
/// `RobotError`, or `OSError` if a file cannot be opened.
pub(crate) fn named(robot: &Bound<'_, PyAny>) -> PyResult<Robot> {
    if let Ok(robot) = robot.cast::<PyRobot>() {
        return Ok(robot.get().robot.clone());
    }
    let path: PathBuf = robot.extract().map_err(|_| {
        Refusal::argument("robot", robot, "a Robot, a name of truegrind.robots(), or a robot file")
    })?;
    Ok(from_name(&path, &ImportOptions::default())?.0)
}

/// A robot from a catalogue name or a file, with the interpretation of the file.
pub(crate) fn from_name(path: &std::path::Path, choice: &ImportOptions) -> PyResult<(Robot, Vec<String>)> {
    let text = path.display().to_string();
    if FileKind::of(&text).is_some() || text.contains('/') || path.is_file() {
        let content = files::read_text(path, Kind::Robot)?;
        let found = import(&content, &text, choice).map_err(Refusal::from)?;
        return Ok((found.robot, found.summary));
    }
    if *choice != ImportOptions::default() {
        let expected = "the name alone: base, tip and ground_joint_3 are for files";
        return Err(Refusal::argument("name", text, expected).into());
    }
    Ok((robots::load(&text).map_err(Refusal::from)?, Vec::new()))
}

#[pymethods]
impl PyRobot {
    /// A robot by name (``truegrind.robots()``) or from a robot file: TOML, URDF, a table of link parameters (CSV), or the
    /// calibration of a Universal Robots arm (.conf, .yaml). ``base`` and ``tip``: base and flange link of a URDF.
    /// ``ground_joint_3``: the log states joint 3 relative to the ground, as FANUC controllers do.
    #[new]
    #[pyo3(signature = (name, *, base = None, tip = None, ground_joint_3 = false))]
    fn new(name: PathBuf, base: Option<String>, tip: Option<String>, ground_joint_3: bool) -> PyResult<Self> {
        let (robot, understood) = from_name(&name, &ImportOptions { base, tip, ground_joint_3 })?;
        Ok(Self { robot, understood })
    }

    /// Parses the text of a robot file; ``file``: its name in messages.
    #[staticmethod]
    #[pyo3(signature = (text, file = "robot.toml"))]
    fn from_toml(text: &str, file: &str) -> PyResult<Self> {
        let robot = robots::parse(text, file).map_err(Refusal::from)?;
        Ok(Self { robot, understood: Vec::new() })
    }

    /// Name of the robot.
    #[getter]
    fn name(&self) -> &str {
        &self.robot.sheet.name
    }

    /// Its maker.
    #[getter]
    fn maker(&self) -> &str {
        &self.robot.sheet.maker
    }

    /// The maker's designation.
    #[getter]
    fn designation(&self) -> &str {
        &self.robot.sheet.model
    }

    /// Lowest controller angles (°), shape (6,).
    #[getter]
    fn min_deg<'py>(&self, py: Python<'py>) -> Typed<Floats, Bound<'py, PyArray1<f64>>> {
        degrees(py, &self.robot.model.limits.min_rad)
    }

    /// Highest controller angles (°), shape (6,).
    #[getter]
    fn max_deg<'py>(&self, py: Python<'py>) -> Typed<Floats, Bound<'py, PyArray1<f64>>> {
        degrees(py, &self.robot.model.limits.max_rad)
    }

    /// Interpretation of the robot file, to compare with the manual: zero pose, axes, flange; empty for the catalogue.
    #[getter]
    fn understood(&self) -> Vec<String> {
        self.understood.clone()
    }

    /// The robot file (TOML) of this robot.
    fn to_toml(&self) -> PyResult<String> {
        Ok(robots::to_toml(&self.robot).map_err(|error| Refusal::new(Kind::Robot, error))?)
    }

    /// Reservations about its data sheet, one sentence each.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.robot.warnings.clone()
    }

    /// Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
    fn forward<'py>(&self, py: Python<'py>, q_deg: Object<'py, ArrayLike>) -> PyResult<Object<'py, Poses>> {
        forward(py, &self.acting(), &q_deg, &Stated::default())
    }

    /// Controller angles (°) that reach poses of the flange: ``Solutions(q_deg, reached, why)``.
    #[pyo3(signature = (position_mm, rotation, near_deg = None))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        position_mm: Object<'py, ArrayLike>,
        rotation: Object<'py, ArrayLike>,
        near_deg: Option<Object<'py, ArrayLike>>,
    ) -> PyResult<Object<'py, Solutions>> {
        inverse(py, &self.acting(), &position_mm, &rotation, near_deg.as_deref(), &Stated::default())
    }

    /// The data sheet as JSON text.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&view::json(&self.robot))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&view::document(&self.robot))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!("Robot('{}')", self.robot.sheet.name)
    }
}

fn degrees<'py>(py: Python<'py>, angles: &[f64; 6]) -> Typed<Floats, Bound<'py, PyArray1<f64>>> {
    PyArray1::from_iter(py, Vector6::from(*angles).iter().map(|angle| angle.to_degrees())).into()
}

/// An arm without a data sheet: the actual arm of a simulation, or the nominal arm of a model.
#[pyclass(name = "Arm", module = "truegrind", frozen)]
pub(crate) struct PyArm {
    pub(crate) name: String,
    pub(crate) model: Model,
    pub(crate) nominal: Model,
}

impl PyArm {
    pub(crate) fn acting(&self) -> Acting<'_> {
        Acting { arm: &self.model, nominal: &self.nominal, condition: Condition::default() }
    }
}

#[pymethods]
impl PyArm {
    /// Name of the arm.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
    /// Payload mass (kg) and its centre on the flange (mm), temperature (°C) and hours since power-on matter only for arms with
    /// such effects.
    #[pyo3(signature = (q_deg, *, payload_kg = None, payload_centre_mm = None, temperature_c = None, time_h = None))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        q_deg: Object<'py, ArrayLike>,
        payload_kg: Option<f64>,
        payload_centre_mm: Option<[f64; 3]>,
        temperature_c: Option<f64>,
        time_h: Option<f64>,
    ) -> PyResult<Object<'py, Poses>> {
        let stated = Stated { payload_kg, payload_centre_mm, temperature_c, time_h };
        forward(py, &self.acting(), &q_deg, &stated)
    }

    /// Controller angles (°) that reach poses of the flange: ``Solutions(q_deg, reached, why)``.
    #[pyo3(signature = (position_mm, rotation, near_deg = None))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        position_mm: Object<'py, ArrayLike>,
        rotation: Object<'py, ArrayLike>,
        near_deg: Option<Object<'py, ArrayLike>>,
    ) -> PyResult<Object<'py, Solutions>> {
        inverse(py, &self.acting(), &position_mm, &rotation, near_deg.as_deref(), &Stated::default())
    }

    /// The file of the arm (TOML), as ``truegrind simulate --arm`` writes it.
    fn to_toml(&self) -> PyResult<String> {
        let text = toml::to_string(&ArmFile::from(&self.model)).map_err(|e| Refusal::new(Kind::Model, e))?;
        Ok(format!("# A simulated actual arm.\n{text}"))
    }

    fn __repr__(&self) -> String {
        format!("<Arm {}>", self.name)
    }
}

/// Names of the robots in the catalogue.
#[pyfunction]
#[pyo3(name = "robots")]
pub(crate) fn catalogue() -> Vec<String> {
    robots::catalogue()
}

/// Poses of the flange of an arm (``Robot``, ``Model`` or ``Arm``), as its method ``forward``.
#[pyfunction]
#[pyo3(
    name = "forward",
    signature = (arm, q_deg, *, payload_kg = None, payload_centre_mm = None, temperature_c = None, time_h = None)
)]
pub(crate) fn forward_of<'py>(
    py: Python<'py>,
    arm: Object<'py, NamedArm>,
    q_deg: Object<'py, ArrayLike>,
    payload_kg: Option<f64>,
    payload_centre_mm: Option<[f64; 3]>,
    temperature_c: Option<f64>,
    time_h: Option<f64>,
) -> PyResult<Object<'py, Poses>> {
    let stated = Stated { payload_kg, payload_centre_mm, temperature_c, time_h };
    forward(py, &acting(&arm)?, &q_deg, &stated)
}

/// Controller angles (°) at which an arm reaches poses of its flange, as its method ``inverse``.
#[pyfunction]
#[pyo3(name = "inverse", signature = (arm, position_mm, rotation, near_deg = None))]
pub(crate) fn inverse_of<'py>(
    py: Python<'py>,
    arm: Object<'py, NamedArm>,
    position_mm: Object<'py, ArrayLike>,
    rotation: Object<'py, ArrayLike>,
    near_deg: Option<Object<'py, ArrayLike>>,
) -> PyResult<Object<'py, Solutions>> {
    inverse(py, &acting(&arm)?, &position_mm, &rotation, near_deg.as_deref(), &Stated::default())
}
