//! Acceptance tests.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use truegrind::calibration::acceptance::{Acceptance, Decision, Options, accept};
use truegrind::math::digest::sha256;
use truegrind::math::work::report_step;
use truegrind::report::acceptance::{self as view, Statement};
use truegrind::report::format;
use truegrind::{Dataset, Estimated};

use crate::dataset::PyDataset;
use crate::errors::Refusal;
use crate::fits::whole;
use crate::interruptible::run;
use crate::model::{measured_robot, named};
use crate::placement::Placement;
use crate::types::{Arrays, Columns, Decisions, NamedModel, NamedRobot, Object, Progress, Typed};

/// Result of an acceptance test.
#[pyclass(name = "Acceptance", module = "truegrind", frozen)]
pub(crate) struct PyAcceptance {
    found: Acceptance,
    rows: Dataset,
    arm: Arc<Estimated>,
    statement: Statement,
}

#[pymethods]
impl PyAcceptance {
    /// Whether the arm is accepted: the decision is ``"accepted"``, and nothing of the report speaks against it.
    #[getter]
    fn accepted(&self) -> bool {
        view::is_accepted(&self.found)
    }

    /// ``accepted``, ``refused``, ``undecided`` (the uncertainty does not allow either, or the poses show too little of the arm) or
    /// ``not-evaluated`` (too few poses, or nothing measured).
    #[getter]
    fn decision(&self) -> Typed<Decisions, &'static str> {
        match self.found.overall() {
            Decision::Accepted => "accepted",
            Decision::Refused => "refused",
            Decision::Open => "undecided",
            Decision::NotEvaluated => "not-evaluated",
        }
        .into()
    }

    /// Number of different poses that count.
    #[getter]
    fn poses(&self) -> usize {
        self.found.poses
    }

    /// Largest error of the model (mm): a distance, or the error of a length.
    #[getter]
    fn max_mm(&self) -> f64 {
        self.found.model.max
    }

    /// RMS error of the model (mm).
    #[getter]
    fn rmse_mm(&self) -> f64 {
        self.found.model.rmse
    }

    /// RMS error of the data sheet, with the sensor registered to it in the same way (mm).
    #[getter]
    fn nominal_rmse_mm(&self) -> f64 {
        self.found.nominal.rmse
    }

    /// Expanded uncertainty of 95.45 % that was used (mm); ``None`` if it is unknown.
    #[getter]
    fn uncertainty_mm(&self) -> Option<f64> {
        Some(self.found.uncertainty_mm).filter(|mm| *mm > 0.0)
    }

    /// Errors of the model: row numbers ``row`` and errors ``error_mm``, each of shape (n,); distances, or signed lengths for a cable.
    #[getter]
    fn errors<'py>(&self, py: Python<'py>) -> PyResult<Typed<Arrays, Bound<'py, PyDict>>> {
        let errors = &self.found.errors_mm;
        let out = PyDict::new(py);
        out.set_item("row", PyArray1::from_iter(py, errors.iter().map(|(row, _)| *row as i64)))?;
        out.set_item("error_mm", PyArray1::from_iter(py, errors.iter().map(|(_, error)| *error)))?;
        Ok(out.into())
    }

    /// The table of rows, one list per column.
    #[getter]
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Object<'py, Columns>> {
        let csv = format::csv::table(&view::row_table(&self.found));
        Ok(py.import("truegrind._results")?.call_method1("table", (csv,))?.into())
    }

    /// The full result as JSON text, schema ``truegrind.acceptance/1``: the bytes that ``truegrind accept --json`` writes.
    fn to_json(&self) -> PyResult<String> {
        crate::json(&view::json(&self.found, &self.rows, &self.arm, &self.statement))
    }

    /// The report as HTML.
    fn to_html(&self) -> String {
        format::html::document(&view::document(&self.found, &self.rows, &self.arm, &self.statement))
    }

    fn _repr_html_(&self) -> String {
        crate::framed(&self.to_html())
    }

    fn __repr__(&self) -> String {
        format!(
            "<Acceptance of {} at {} poses: {}, largest error {:.4} mm, tolerance {} mm>",
            self.arm.robot,
            self.found.poses,
            *self.decision(),
            self.found.model.max,
            self.found.tolerance_mm
        )
    }
}

/// Tests whether an estimated arm meets a tolerance at poses to which it was not fitted; at least 100 of them. ``tolerance_mm``: the largest
/// accepted position error. ``sensor_uncertainty_mm``: expanded uncertainty of the sensor, k = 2; by default, and where it is smaller, that of
/// repeated poses. ``tolerance_angle_deg`` and ``sensor_uncertainty_angle_deg``: the same for the orientation, for sensors that measure it.
/// ``serials``: serial numbers and remarks for the report, such as ``{"arm": "120-503211"}``. ``robot``: the robot file of the model, if its
/// robot is not in the catalogue. With ``sensor_frame`` (or ``outlets_mm`` and ``cable_zeros_mm``) and ``touched_point`` the placement of base
/// and flange is tested too; without them the sensor is registered with these poses. Raises ``FitError`` for rows of the fit.
#[pyfunction]
#[pyo3(
    name = "accept",
    signature = (
        model, dataset, *, tolerance_mm, sensor_uncertainty_mm = None, tolerance_angle_deg = None, sensor_uncertainty_angle_deg = None,
        serials = None, robot = None, sensor_frame = None, outlets_mm = None, cable_zeros_mm = None, touched_point = None, seed = 0,
        threads = None, progress = None
    )
)]
#[expect(clippy::too_many_arguments, reason = "keywords, as the options of the command line")]
pub(crate) fn accept_(
    py: Python<'_>,
    model: Object<'_, NamedModel>,
    dataset: &PyDataset,
    tolerance_mm: f64,
    sensor_uncertainty_mm: Option<f64>,
    tolerance_angle_deg: Option<f64>,
    sensor_uncertainty_angle_deg: Option<f64>,
    serials: Option<Bound<'_, PyDict>>,
    robot: Option<Object<'_, NamedRobot>>,
    sensor_frame: Option<Vec<f64>>,
    outlets_mm: Option<Vec<[f64; 3]>>,
    cable_zeros_mm: Option<Vec<f64>>,
    touched_point: Option<Vec<f64>>,
    seed: i64,
    threads: Option<i64>,
    progress: Option<Object<'_, Progress>>,
) -> PyResult<PyAcceptance> {
    let mut kept = None;
    let estimated = named(&model, &mut kept)?;
    let robot = measured_robot(estimated, robot.as_deref())?;
    let serials: Vec<(String, String)> = match serials {
        None => Vec::new(),
        Some(serials) => serials
            .iter()
            .map(|(what, text)| Ok((what.extract()?, text.str()?.extract()?)))
            .collect::<PyResult<_>>()?,
    };
    let placement =
        Placement { sensor_frame, outlets_mm, cable_zeros_mm, touched_point, ..Placement::default() }
            .stated()?;
    let seed = whole("seed", seed)?;
    let statement = Statement {
        serials,
        model: Some((estimated.name.clone(), sha256(estimated.text().as_bytes()))),
        frames_stated: false,
        seed,
    };
    let arm = estimated.arm.clone();
    run(py, threads, progress.as_deref(), || {
        report_step("checking units");
        let rows = dataset.of(&robot, None)?;
        let options = Options {
            tolerance_mm,
            uncertainty_mm: sensor_uncertainty_mm,
            tolerance_rad: tolerance_angle_deg.map(f64::to_radians),
            uncertainty_rad: sensor_uncertainty_angle_deg.map(f64::to_radians),
            frames: placement.frames_of_both(&rows).map_err(Refusal::from)?,
            seed,
        };
        let statement = Statement { frames_stated: options.frames.is_some(), ..statement };
        let found = accept(&rows, &arm, &options)?;
        Ok(PyAcceptance { found, rows, arm, statement })
    })
}
