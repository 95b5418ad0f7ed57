//! Tracking of a model over its measurements.

use pyo3::prelude::*;
use truegrind::calibration::tracking::first_poses as first_of;
use truegrind::math::work::report_step;
use truegrind::report::{format, tracking};
use truegrind::{Alarm, TrackOptions, TrackState, Tracker, robots};

use crate::dataset::PyDataset;
use crate::errors::{Kind, Refusal};
use crate::fits::{at_most, whole};
use crate::interruptible::run;
use crate::model::{self, PyModel};
use crate::types::{Dictionaries, NamedModel, Object, OneOrMoreDatasets, Progress};

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
        sigma_mm: sigma_mm.map(|sigma| at_most("sigma_mm", sigma, 10.0)).transpose()?,
        ..TrackOptions::default()
    };
    if let Some(poses) = first_poses {
        if poses < 4 {
            return Err(Refusal::argument("first_poses", poses, "at least 4").into());
        }
        options.first_poses = whole("first_poses", poses)?;
    }
    run(py, threads, progress.as_deref(), || {
        let arm = &estimated.arm;
        let robot = robots::load(&arm.robot).ok();
        let convention = robot.map(|robot| robot.sheet.joints.angles.into()).unwrap_or_default();
        let rows = given.iter().map(|dataset| {
            let odd = allow_odd_units || dataset.odd_units;
            let rows = (*dataset.rows).clone();
            truegrind::calibration::measurement::matching::prepare_rows(
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
