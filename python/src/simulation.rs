//! Simulated measurements.

use std::path::Path;
use std::sync::Arc;

use pyo3::prelude::*;
use truegrind::robots::foreign::{ImportOptions, Kind as Format};
use truegrind::{Recipe, Simulation, read_measurements};

use crate::dataset::PyDataset;
use crate::errors::Kind;
use crate::fits::whole;
use crate::interruptible::run;
use crate::programs::text;
use crate::robot::{PyArm, from_name};
use crate::types::{Object, PathOrText};

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
            let beside = Path::new(&file).with_file_name(name);
            let is_beside = Format::of(name).is_some() && beside.is_file();
            let named = if is_beside { beside.as_path() } else { Path::new(name) };
            let found = from_name(named, &ImportOptions::default());
            let said = |error: PyErr| Python::attach(|py| error.value(py).to_string());
            found.map(|(robot, _)| robot.model).map_err(said)
        };
        let made = recipe.simulate(resolve)?;
        let rows = read_measurements(name, made.csv.as_bytes(), &Default::default())?;
        Ok(PySimulation { made, rows: Arc::new(rows), robot: recipe.robot.clone() })
    })
}
