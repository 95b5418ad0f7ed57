//! Estimated arms and model files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use truegrind::arm::estimated::FlangePoint;
use truegrind::calibration::exported::exported;
use truegrind::file_kind::FileKind;
use truegrind::{Estimated, Judgement, Pose, Robot, robots};

use crate::arm::{Acting, Stated, forward, inverse};
use crate::arrays::{joints, numbers, rows, shaped};
use crate::dataset::PyDataset;
use crate::errors::{Kind, Refusal};
use crate::export::{PyExport, format_of};
use crate::files;
use crate::interruptible::run;
use crate::robot::PyArm;
use crate::types::{
    Anything, ArrayLike, Bools, Dictionaries, Floats, Judgements, NamedRobot, Object, Poses, Solutions, Typed,
};

/// An estimated arm: the nominal arm, everything identified, and its covariance.
#[pyclass(name = "Model", module = "truegrind", frozen)]
pub(crate) struct PyModel {
    pub(crate) arm: Arc<Estimated>,
    /// Name for reports.
    pub(crate) name: String,
    /// Short hash of the model file, written into corrected programs.
    pub(crate) hash: String,
    /// The model file.
    text: String,
}

/// Verdict as written in files.
pub(crate) fn word(status: Judgement) -> &'static str {
    match status {
        Judgement::Pass => "pass",
        Judgement::Fail => "fail",
        Judgement::Doubtful => "doubtful",
        Judgement::NotEvaluated => "not-evaluated",
    }
}

impl PyModel {
    /// The text of the model file.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// A newly fitted model.
    pub(crate) fn found(arm: &Estimated) -> Result<Self, Refusal> {
        let text = arm.to_toml()?;
        Ok(Self {
            arm: Arc::new(arm.clone()),
            name: "model.toml".to_owned(),
            hash: Estimated::file_hash(&text),
            text,
        })
    }

    /// Parses a model file.
    fn read(text: &str, name: &str) -> Result<Self, Refusal> {
        let arm = Estimated::from_toml(text).map_err(|error| {
            let message = error.to_string();
            let other = FileKind::of(name, text.as_bytes()).filter(|kind| *kind != FileKind::Model);
            let message = match other {
                Some(kind) => {
                    format!("{name}: {}; expected a model file, which Model.save writes", kind.text())
                }
                None => format!("{name}: {}; a model file is what Model.save writes", message.trim_end()),
            };
            Refusal::from(error).saying(message).of_file(name)
        })?;
        robots::check_catalogue_name(&arm.robot, &arm.nominal)
            .map_err(|error| Refusal::new(Kind::Model, format!("{name}: {error}")).of_file(name))?;
        if arm.verdict.status == Judgement::Fail {
            let why = arm.verdict.sentences().join("; ");
            let message = format!("{name}: this model cannot be used, since its fit failed: {why}");
            return Err(Refusal::new(Kind::Model, message).of_file(name));
        }
        Ok(Self {
            hash: Estimated::file_hash(text),
            name: name.to_owned(),
            arm: Arc::new(arm),
            text: text.to_owned(),
        })
    }

    pub(crate) fn acting(&self) -> Acting<'_> {
        Acting { arm: &self.arm.model, nominal: &self.arm.nominal, condition: self.arm.condition }
    }

    /// Refuses a doubtful model unless allowed.
    pub(crate) fn allowed(&self, allow_doubtful: bool) -> Result<(), Refusal> {
        let verdict = &self.arm.verdict;
        let why = || verdict.sentences().join("; ");
        match verdict.status {
            Judgement::Fail => {
                let message =
                    format!("{}: this model cannot be used, since its fit failed: {}", self.name, why());
                Err(Refusal::new(Kind::Model, message))
            }
            Judgement::Doubtful if !allow_doubtful => Err(Refusal::new(
                Kind::Model,
                format!(
                    "{}: this model is doubtful, programs are corrected with it only with allow_doubtful=True: {}",
                    self.name,
                    why()
                ),
            )),
            _ => Ok(()),
        }
    }
}

/// The robot whose measurements are read for a model: the stated one, or that of the catalogue which the model names.
///
/// # Errors
/// Another robot, or an arm that is not in the catalogue: only its robot file says how its logged angles count.
pub(crate) fn measured_robot(model: &PyModel, robot: Option<&Bound<'_, PyAny>>) -> PyResult<Robot> {
    let arm = &model.arm;
    let Some(given) = robot else {
        return Ok(robots::load(&arm.robot).map_err(|_| {
            let expected = format!("the robot file of {}, which is not in the catalogue", arm.robot);
            Refusal::argument("robot", "nothing", &expected)
        })?);
    };
    let robot = crate::robot::named(given)?;
    if !robot.sheet.name.eq_ignore_ascii_case(&arm.robot) {
        let expected = format!("{}, for which {} was identified", arm.robot, model.name);
        return Err(Refusal::argument("robot", &robot.sheet.name, &expected).into());
    }
    robots::check_same_links(&arm.nominal, &robot.model).map_err(Refusal::from)?;
    Ok(robot)
}

/// A model or the path of a model file.
pub(crate) fn named<'a>(model: &'a Bound<'_, PyAny>, kept: &'a mut Option<PyModel>) -> PyResult<&'a PyModel> {
    if let Ok(model) = model.cast::<PyModel>() {
        return Ok(model.get());
    }
    let path: PathBuf =
        model.extract().map_err(|_| Refusal::argument("model", model, "a Model, or a model file"))?;
    Ok(kept.insert(load(&path)?))
}

fn load(path: &Path) -> PyResult<PyModel> {
    let text = files::read_text(path, Kind::Model)?;
    Ok(PyModel::read(&text, &files::name(path))?)
}

#[pymethods]
impl PyModel {
    /// Reads a model file.
    #[new]
    fn new(path: PathBuf) -> PyResult<Self> {
        load(&path)
    }

    /// Reads a model file.
    #[staticmethod]
    #[pyo3(name = "load")]
    fn load_(path: PathBuf) -> PyResult<Self> {
        load(&path)
    }

    /// Parses the text of a model file; ``file``: its name in messages and reports.
    #[staticmethod]
    #[pyo3(signature = (text, file = "model.toml"))]
    fn from_toml(text: &str, file: &str) -> PyResult<Self> {
        Ok(Self::read(text, file)?)
    }

    /// The text of the model file.
    fn to_toml(&self) -> PyResult<String> {
        Ok(self.arm.to_toml().map_err(Refusal::from)?)
    }

    /// Writes the model file; a doubtful model only if allowed, a failed one never.
    #[pyo3(signature = (path, *, allow_doubtful = false))]
    fn save(&self, path: PathBuf, allow_doubtful: bool) -> PyResult<()> {
        self.allowed(allow_doubtful)?;
        files::write(&path, self.to_toml()?.as_bytes())
    }

    /// The links in another format: ``"urdf"``, ``"dh-csv"``, ``"mdh-csv"`` (Craig) or ``"ur-yaml"`` (kinematics for the ROS drivers of
    /// Universal Robots). Effects beyond links are left out, as the notes of the result say. ``dataset``: measurements on which the error of
    /// the exported links is evaluated, with only the sensor's frame fitted. ``robot``: the robot file, if the robot of the model is not in
    /// the catalogue.
    #[pyo3(signature = (format: "Literal['urdf', 'dh-csv', 'mdh-csv', 'ur-yaml']", *, dataset = None, robot = None))]
    fn export(
        &self,
        py: Python<'_>,
        format: &str,
        dataset: Option<PyRef<'_, PyDataset>>,
        robot: Option<Object<'_, NamedRobot>>,
    ) -> PyResult<PyExport> {
        let format = format_of(format)?;
        let robot = match (&robot, &dataset) {
            (None, None) => robots::load(&self.arm.robot).ok(),
            _ => Some(measured_robot(self, robot.as_deref())?),
        };
        let dataset = dataset.as_deref();
        run(py, None, None, || {
            let rows = dataset.zip(robot.as_ref()).map(|(rows, robot)| rows.of(robot, None)).transpose()?;
            Ok(PyExport { made: exported(&self.arm, format, robot.as_ref(), rows.as_ref())? })
        })
    }

    /// Name of the robot.
    #[getter]
    fn robot(&self) -> &str {
        &self.arm.robot
    }

    /// ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
    #[getter]
    fn verdict(&self) -> Typed<Judgements, &'static str> {
        word(self.arm.verdict.status).into()
    }

    /// Reasons for the verdict, one sentence each.
    #[getter]
    fn reasons(&self) -> Vec<String> {
        self.arm.verdict.sentences().into_iter().map(str::to_owned).collect()
    }

    /// First twelve hex digits of the SHA-256 of the model file; written into corrected programs.
    #[getter]
    fn hash(&self) -> &str {
        &self.hash
    }

    /// RMS error on held-out rows (mm).
    #[getter]
    fn held_out_rmse_mm(&self) -> f64 {
        self.arm.calibrated.held_out.rmse
    }

    /// RMS error on held-out rows of the nominal arm with a fitted sensor frame (mm).
    #[getter]
    fn held_out_rmse_before_mm(&self) -> f64 {
        self.arm.registered.held_out.rmse
    }

    /// The nominal arm, used by the controller.
    #[getter]
    fn nominal(&self) -> PyArm {
        let name = format!("nominal {}", self.arm.robot);
        PyArm { name, model: self.arm.nominal.clone(), nominal: self.arm.nominal.clone() }
    }

    /// Identified parameters: dictionaries with name, unit, nominal, value, sigma, determined.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Typed<Dictionaries, Vec<Bound<'py, PyDict>>>> {
        parameters(py, &self.arm.parameters)
    }

    /// Names of the parameters of the arm in the order of the covariance.
    #[getter]
    fn order(&self) -> Vec<String> {
        self.arm.order.iter().map(ToString::to_string).collect()
    }

    /// Covariance of the arm's parameters (mm, rad), shape (p, p).
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Typed<Floats, Bound<'py, PyArray2<f64>>>> {
        let matrix = &self.arm.covariance;
        let rows: Vec<Vec<f64>> = matrix.row_iter().map(|row| row.iter().copied().collect()).collect();
        Ok(PyArray2::from_vec2(py, &rows)?.into())
    }

    /// Poses of the flange in the base for controller angles (°) of shape (N, 6) or (6,): ``Poses(position_mm, rotation)``.
    /// Payload mass (kg) and its centre on the flange (mm), temperature (°C) and hours since power-on replace those of the
    /// measurement.
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

    /// Controller angles (°) at which this arm reaches poses of its flange: ``Solutions(q_deg, reached, why)``.
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

    /// Predicted standard deviation of a point on the flange (mm), for controller angles (°) of shape (N, 6) or (6,). The point,
    /// such as a TCP, is stated in the flange (mm).
    #[pyo3(signature = (q_deg, tool_mm = [0.0; 3]))]
    fn sigma_mm<'py>(
        &self,
        py: Python<'py>,
        q_deg: Object<'py, ArrayLike>,
        tool_mm: [f64; 3],
    ) -> PyResult<Object<'py, Floats>> {
        let q_deg = numbers("q_deg", &q_deg)?;
        let (q_deg, one) = rows("q_deg", q_deg.as_array(), 6)?;
        let [x, y, z] = tool_mm;
        let sigmas = py.detach(|| {
            let flange_from_tool = Pose::translation(x, y, z);
            let points: Vec<FlangePoint<'_>> = (0..q_deg.nrows())
                .map(|row| FlangePoint { joints: joints(q_deg, row), flange_from_tool, carried: None })
                .collect();
            self.arm.position_sigmas_mm(&self.arm.model.at_condition(&self.arm.condition), &points)
        });
        Ok(shaped(PyArray1::from_vec(py, sigmas).into_any(), one)?.into())
    }

    /// Whether controller angles (°) of shape (N, 6) or (6,) are in the measured region.
    fn measured_at<'py>(
        &self,
        py: Python<'py>,
        q_deg: Object<'py, ArrayLike>,
    ) -> PyResult<Object<'py, Bools>> {
        let q_deg = numbers("q_deg", &q_deg)?;
        let (q_deg, one) = rows("q_deg", q_deg.as_array(), 6)?;
        let inside: Vec<bool> = py.detach(|| {
            (0..q_deg.nrows()).map(|row| self.arm.region.outside(&joints(q_deg, row)).is_none()).collect()
        });
        Ok(shaped(PyArray1::from_vec(py, inside).into_any(), one)?.into())
    }

    /// A pickle holds the model file; like the file, that of a failed fit is refused when it is read.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Typed<Anything, Bound<'py, PyTuple>>> {
        let read = py.get_type::<Self>().getattr("from_toml")?;
        Ok((read, (&self.text, &self.name)).into_pyobject(py)?.into())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Model of {}: held-out RMSE {:.4} mm, verdict {}>",
            self.arm.robot,
            self.arm.calibrated.held_out.rmse,
            word(self.arm.verdict.status)
        )
    }
}

/// Identified numbers as dictionaries.
pub(crate) fn parameters<'py>(
    py: Python<'py>,
    found: &[truegrind::EstimatedParameter],
) -> PyResult<Typed<Dictionaries, Vec<Bound<'py, PyDict>>>> {
    Ok(found.iter().map(|found| parameter(py, found)).collect::<PyResult<Vec<_>>>()?.into())
}

fn parameter<'py>(py: Python<'py>, found: &truegrind::EstimatedParameter) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    out.set_item("name", &found.name)?;
    out.set_item("unit", &found.unit)?;
    out.set_item("nominal", found.nominal)?;
    out.set_item("value", found.value)?;
    out.set_item("sigma", found.sigma)?;
    out.set_item("prior_sigma", found.prior_sigma)?;
    out.set_item("determined", found.determined)?;
    Ok(out)
}
