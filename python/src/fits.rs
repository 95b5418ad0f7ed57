//! Fits: identify and diagnose.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truegrind::calibration::diagnosis::measured::diagnose_rows;
use truegrind::calibration::identification::verdict::Limits;
use truegrind::math::work::report_step;
use truegrind::report::{diagnosis, format, identification};
use truegrind::{
    Dataset, DiagnoseOptions, Diagnosed, Identification, IdentifyOptions, Tolerance, identify,
    solver_by_name, split, starting_frames,
};

use crate::dataset::PyDataset;
use crate::errors::Refusal;
use crate::interruptible::run;
use crate::model::{PyModel, parameters};
use crate::placement::Placement;
use crate::robot::named;
use crate::types::{Arrays, Dictionaries, Judgements, NamedRobot, Object, Progress, Typed};

/// Result of an identification.
#[pyclass(name = "Identification", module = "truegrind", frozen)]
pub(crate) struct PyIdentification {
    found: Arc<Identification>,
    rows: Arc<Dataset>,
}

#[pymethods]
impl PyIdentification {
    /// The estimated arm.
    #[getter]
    fn model(&self) -> PyResult<PyModel> {
        Ok(PyModel::found(&self.found.estimated)?)
    }

    /// ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
    #[getter]
    fn verdict(&self) -> Typed<Judgements, &'static str> {
        crate::model::word(self.found.estimated.verdict.status).into()
    }

    /// Reasons for the verdict, one sentence each.
    #[getter]
    fn reasons(&self) -> Vec<String> {
        self.found.estimated.verdict.sentences().into_iter().map(str::to_owned).collect()
    }

    /// RMS error on held-out rows (mm).
    #[getter]
    fn held_out_rmse_mm(&self) -> f64 {
        self.found.estimated.calibrated.held_out.rmse
    }

    /// Largest error on held-out rows (mm).
    #[getter]
    fn held_out_max_mm(&self) -> f64 {
        self.found.estimated.calibrated.held_out.max
    }

    /// RMS error on held-out rows of the nominal arm with a fitted sensor frame (mm).
    #[getter]
    fn held_out_rmse_before_mm(&self) -> f64 {
        self.found.estimated.registered.held_out.rmse
    }

    /// Noise of sensor and rounding (mm); ``None`` if unknown.
    #[getter]
    fn noise_floor_mm(&self) -> Option<f64> {
        self.found.estimated.noise_floor_mm
    }

    /// All fitted parameters, including those of the sensor: dictionaries with name, unit, nominal, value, sigma, determined.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Typed<Dictionaries, Vec<Bound<'py, PyDict>>>> {
        parameters(py, &self.found.parameters)
    }

    /// Errors of the held-out rows (mm): row numbers, before and after, each of shape (n,).
    #[getter]
    fn held_out<'py>(&self, py: Python<'py>) -> PyResult<Typed<Arrays, Bound<'py, PyDict>>> {
        let rows = &self.found.held_out;
        let out = PyDict::new(py);
        out.set_item("row", PyArray1::from_iter(py, rows.iter().map(|(row, _, _)| *row as i64)))?;
        out.set_item("before_mm", PyArray1::from_iter(py, rows.iter().map(|(_, before, _)| *before)))?;
        out.set_item("after_mm", PyArray1::from_iter(py, rows.iter().map(|(_, _, after)| *after)))?;
        Ok(out.into())
    }

    /// The full result as JSON text, schema ``truegrind.identification/1``: the bytes that ``truegrind identify --json`` writes.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&identification::json(&self.found, &self.rows))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&identification::document(&self.found, &self.rows))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Identification of {} from {} rows: held-out RMSE {:.4} mm, before {:.4} mm, verdict {}>",
            self.found.estimated.robot,
            self.rows.rows.len(),
            self.held_out_rmse_mm(),
            self.held_out_rmse_before_mm(),
            *self.verdict()
        )
    }
}

/// Fits an arm to measured poses. ``robot``: a Robot, a name from ``truegrind.robots()`` or a robot file. ``held_out``: share of rows
/// held out to estimate the error. Tolerances (mm, °): prior σ of the links. ``sensor_scale_sigma_percent``: standard uncertainty of the
/// sensor's scale (%); by default a fault of the scale is considered possible. ``angles``: ``"logged"`` or ``"dh"``, by default that of
/// the robot file. ``sensor_frame``: frame of a tracker or camera in the robot base, x, y, z (mm) or x, y, z, qw, qx, qy, qz;
/// ``outlets_mm`` and ``cable_zeros_mm``: outlets of cables in the base, and reading minus free length of each; ``touched_point``: hook or
/// reflector on the flange. With ``frame_sigma_mm`` (and ``frame_sigma_deg``; by default 1 mm at 1 m) and ``touched_sigma_mm`` (and
/// ``touched_sigma_deg`` for the rotation of a target whose pose is measured), their standard deviations, the fit takes them as a prior, so that the placement of a path can be corrected; a placement that the readings contradict raises
/// ``ArgumentError``. ``progress`` is called with each step. The result does not depend on the number of threads.
#[pyfunction]
#[pyo3(
    name = "identify",
    signature = (
        dataset, robot, *, method = "lm", held_out = 0.2, seed = 0, fuse_readout = true, limit_rmse_mm = None,
        limit_max_mm = None, tolerance_length_mm = None, tolerance_angle_deg = None, sensor_scale_sigma_percent = None,
        angles: "Literal['logged', 'dh'] | None" = None, sensor_frame = None, outlets_mm = None, cable_zeros_mm = None,
        touched_point = None, frame_sigma_mm = None, frame_sigma_deg = None, touched_sigma_mm = None, touched_sigma_deg = None, threads = None,
        progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn identify_(
    py: Python<'_>,
    dataset: &PyDataset,
    robot: Object<'_, NamedRobot>,
    method: &str,
    held_out: f64,
    seed: i64,
    fuse_readout: bool,
    limit_rmse_mm: Option<f64>,
    limit_max_mm: Option<f64>,
    tolerance_length_mm: Option<f64>,
    tolerance_angle_deg: Option<f64>,
    sensor_scale_sigma_percent: Option<f64>,
    angles: Option<&str>,
    sensor_frame: Option<Vec<f64>>,
    outlets_mm: Option<Vec<[f64; 3]>>,
    cable_zeros_mm: Option<Vec<f64>>,
    touched_point: Option<Vec<f64>>,
    frame_sigma_mm: Option<f64>,
    frame_sigma_deg: Option<f64>,
    touched_sigma_mm: Option<f64>,
    touched_sigma_deg: Option<f64>,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyIdentification> {
    let placement = Placement {
        sensor_frame,
        outlets_mm,
        cable_zeros_mm,
        touched_point,
        frame_sigma_mm,
        frame_sigma_deg,
        touched_sigma_mm,
        touched_sigma_deg,
    }
    .stated()?;
    let robot = named(&robot)?;
    if !(held_out > 0.0 && held_out <= 0.9) {
        return Err(Refusal::argument("held_out", held_out, "a share above 0, up to 0.9").into());
    }
    let tolerance = tolerance(tolerance_length_mm, tolerance_angle_deg, sensor_scale_sigma_percent)?;
    for (name, limit) in [("limit_rmse_mm", limit_rmse_mm), ("limit_max_mm", limit_max_mm)] {
        limit.map(|limit| at_most(name, limit, 100.0)).transpose()?;
    }
    let options = IdentifyOptions {
        tolerance,
        solver: solver_by_name(method).map_err(Refusal::from)?,
        held_out,
        seed: whole("seed", seed)?,
        fuse_readout,
        limit_rmse_mm,
        limit_max_mm,
        stated_frames: None,
    };
    run(py, threads, progress.as_deref(), || {
        report_step("checking units");
        let rows = dataset.of(&robot, angles)?;
        let (name, nominal) = (&robot.sheet.name, &robot.model);
        report_step("placing the sensor");
        let options = IdentifyOptions { stated_frames: placement.frames(&rows)?, ..options };
        let frames = starting_frames(&rows, nominal, &options.tolerance, options.fuse_readout)?;
        let (tolerance, frames) = placement.prior([&options.tolerance; 2], frames, (&rows, nominal))?;
        let options = IdentifyOptions { tolerance, ..options };
        let share = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
        let found = identify(&rows, name, nominal, &frames, &share, &options)?;
        Ok(PyIdentification { found: Arc::new(found), rows: Arc::new(rows) })
    })
}

/// The tolerances of the arm and the sensor's scale. As in the command line, stated tolerances are not estimated from the data.
///
/// # Errors
/// Names the argument.
fn tolerance(
    length_mm: Option<f64>,
    angle_deg: Option<f64>,
    scale_percent: Option<f64>,
) -> Result<Tolerance, Refusal> {
    let mut tolerance =
        Tolerance { learn_widths: length_mm.is_none() && angle_deg.is_none(), ..Tolerance::default() };
    if let Some(length) = length_mm {
        tolerance.length_mm = positive("tolerance_length_mm", length)?;
    }
    if let Some(angle) = angle_deg {
        tolerance.angle_rad = positive("tolerance_angle_deg", angle)?.to_radians();
    }
    tolerance.zero_rad = tolerance.angle_rad;
    if let Some(percent) = scale_percent {
        if !(0.0..=10.0).contains(&percent) {
            let expected = "a percentage from 0 to 10";
            return Err(Refusal::argument("sensor_scale_sigma_percent", percent, expected));
        }
        tolerance.scale = Some(percent / 100.0);
    }
    Ok(tolerance)
}

/// A number above 0.
///
/// # Errors
/// Names the argument.
pub(crate) fn positive(name: &str, value: f64) -> Result<f64, Refusal> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Refusal::argument(name, value, "a number above 0"))
}

/// A length above 0 that can be meant in mm.
///
/// # Errors
/// Names the argument.
pub(crate) fn at_most(name: &str, mm: f64, most_mm: f64) -> Result<f64, Refusal> {
    if mm > 0.0 && mm <= most_mm {
        return Ok(mm);
    }
    Err(Refusal::argument(name, mm, &format!("a length above 0 in mm, up to {most_mm}")))
}

/// A count that is not negative, as the library counts.
///
/// # Errors
/// Names the argument.
pub(crate) fn whole<T: TryFrom<i64>>(name: &str, value: i64) -> Result<T, Refusal> {
    T::try_from(value).map_err(|_| Refusal::argument(name, value, "a whole number, 0 or above"))
}

/// Result of a diagnosis.
#[pyclass(name = "Diagnosis", module = "truegrind", frozen)]
pub(crate) struct PyDiagnosis {
    found: Arc<Diagnosed>,
    rows: Arc<Dataset>,
}

#[pymethods]
impl PyDiagnosis {
    /// The arm with the certain causes, for compensation.
    #[getter]
    fn model(&self) -> PyResult<PyModel> {
        Ok(PyModel::found(&self.found.estimated)?)
    }

    /// ``pass``, ``doubtful``, ``fail`` or ``not-evaluated``.
    #[getter]
    fn verdict(&self) -> Typed<Judgements, &'static str> {
        crate::model::word(self.found.estimated.verdict.status).into()
    }

    /// Reasons for the verdict, one sentence each.
    #[getter]
    fn reasons(&self) -> Vec<String> {
        self.found.estimated.verdict.sentences().into_iter().map(str::to_owned).collect()
    }

    /// The causes, largest first: dictionaries as in the JSON.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, Dictionaries>> {
        let whole = py.import("json")?.call_method1("loads", (self.to_json()?,))?;
        Ok(whole.get_item("findings")?.into())
    }

    /// Cross-validated RMS error with geometry alone (mm).
    #[getter]
    fn geometry_rmse_mm(&self) -> f64 {
        self.found.diagnosis.fits.geometric.cv_rmse_mm
    }

    /// Cross-validated RMS error with all causes (mm).
    #[getter]
    fn held_out_rmse_mm(&self) -> f64 {
        self.found.diagnosis.fits.extended.cv_rmse_mm
    }

    /// The unexplained structure as a sentence; ``None`` if there is none.
    #[getter]
    fn remaining(&self) -> Option<String> {
        self.found.diagnosis.remaining.clone()
    }

    /// Remarks.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.found.diagnosis.notes.iter().chain(&self.rows.notes).cloned().collect()
    }

    /// The full result as JSON text, schema ``truegrind.diagnosis/1``: the bytes that ``truegrind diagnose --json`` writes.
    pub(crate) fn to_json(&self) -> PyResult<String> {
        let counted = self.found.diagnosis.clone().with_rows_from_0(&self.rows);
        let value = serde_json::to_value(counted)
            .map_err(|error| Refusal::new(crate::errors::Kind::Defect, error))?;
        crate::json(&value)
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&diagnosis::document(&self.found, &self.rows))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Diagnosis of {}: {} findings, held-out RMSE {:.4} mm, geometry alone {:.4} mm, verdict {}>",
            self.found.diagnosis.dataset.robot,
            self.found.diagnosis.findings.len(),
            self.held_out_rmse_mm(),
            self.geometry_rmse_mm(),
            *self.verdict()
        )
    }
}

/// Finds the causes of errors that geometry does not explain. ``alpha``: probability of any false finding. ``most``: largest number of
/// causes. ``blocks``: number of contiguous blocks held out in turn. Tolerances (mm, °): prior σ of the links.
/// ``sensor_scale_sigma_percent``: standard uncertainty of the sensor's scale (%), such as 0.001 for a tracker that agreed with a scale
/// bar; by default a fault of the scale is considered possible. ``also``: further datasets of the same arm, on which the models are tested
/// with only the frames refitted. ``sensor_frame`` to ``touched_sigma_deg``: as for ``identify``.
#[pyfunction]
#[pyo3(
    name = "diagnose",
    signature = (
        dataset, robot, *, alpha = 0.01, most = 20, blocks = 10, smooth = false, fuse_readout = true, limit_rmse_mm = None,
        limit_max_mm = None, tolerance_length_mm = None, tolerance_angle_deg = None, sensor_scale_sigma_percent = None, seed = 0,
        also = Vec::new(), angles: "Literal['logged', 'dh'] | None" = None, sensor_frame = None, outlets_mm = None,
        cable_zeros_mm = None, touched_point = None, frame_sigma_mm = None, frame_sigma_deg = None, touched_sigma_mm = None, touched_sigma_deg = None, threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn diagnose_(
    py: Python<'_>,
    dataset: &PyDataset,
    robot: Object<'_, NamedRobot>,
    alpha: f64,
    most: i64,
    blocks: i64,
    smooth: bool,
    fuse_readout: bool,
    limit_rmse_mm: Option<f64>,
    limit_max_mm: Option<f64>,
    tolerance_length_mm: Option<f64>,
    tolerance_angle_deg: Option<f64>,
    sensor_scale_sigma_percent: Option<f64>,
    seed: i64,
    also: Vec<PyRef<'_, PyDataset>>,
    angles: Option<&str>,
    sensor_frame: Option<Vec<f64>>,
    outlets_mm: Option<Vec<[f64; 3]>>,
    cable_zeros_mm: Option<Vec<f64>>,
    touched_point: Option<Vec<f64>>,
    frame_sigma_mm: Option<f64>,
    frame_sigma_deg: Option<f64>,
    touched_sigma_mm: Option<f64>,
    touched_sigma_deg: Option<f64>,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyDiagnosis> {
    let placement = Placement {
        sensor_frame,
        outlets_mm,
        cable_zeros_mm,
        touched_point,
        frame_sigma_mm,
        frame_sigma_deg,
        touched_sigma_mm,
        touched_sigma_deg,
    }
    .stated()?;
    let robot = named(&robot)?;
    if !(alpha > 0.0 && alpha <= 0.5) {
        return Err(Refusal::argument("alpha", alpha, "a probability above 0, up to 0.5").into());
    }
    if blocks < 2 {
        return Err(Refusal::argument("blocks", blocks, "at least 2").into());
    }
    if !(1..=200).contains(&most) {
        return Err(
            Refusal::argument("most", most, "1 to 200 causes; identify fits geometry without any").into()
        );
    }
    let blocks = whole("blocks", blocks)?;
    for (name, limit) in [("limit_rmse_mm", limit_rmse_mm), ("limit_max_mm", limit_max_mm)] {
        limit.map(|limit| at_most(name, limit, 100.0)).transpose()?;
    }
    let limits = Limits { rmse_mm: limit_rmse_mm, max_mm: limit_max_mm };
    let arm_tolerance = tolerance(tolerance_length_mm, tolerance_angle_deg, sensor_scale_sigma_percent)?;
    let mut options =
        DiagnoseOptions { blocks, smooth, fuse_readout, limits, arm_tolerance, ..DiagnoseOptions::default() };
    options.selection.alpha = alpha;
    options.selection.most = whole("most", most)?;
    options.selection.seed = whole("seed", seed)?;
    let others: Vec<&PyDataset> = also.iter().map(|other| &**other).collect();
    run(py, threads, progress.as_deref(), || {
        report_step("checking units");
        let rows = dataset.of(&robot, angles)?;
        let others =
            others.into_iter().map(|other| other.of(&robot, angles)).collect::<Result<Vec<_>, _>>()?;
        let arm = (robot.sheet.name.as_str(), &robot.model);
        let found = diagnose_rows((&rows, &others), arm, &placement, &options)?;
        Ok(PyDiagnosis { found: Arc::new(found), rows: Arc::new(rows) })
    })
}
