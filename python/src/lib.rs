//! truegrind as a Python module. It converts arguments, opens files and raises exceptions; all computation is in the library.

mod acceptance;
mod arm;
mod arrays;
mod dataset;
mod errors;
mod export;
mod files;
mod fits;
mod interruptible;
mod model;
mod placement;
mod plan;
mod programs;
mod robot;
mod simulation;
mod toolpath;
mod track;
mod types;

use pyo3::prelude::*;
use truegrind::report::format;

use crate::errors::{Kind, Refusal};

/// A result as JSON text, as the command line writes it.
pub(crate) fn json(value: &serde_json::Value) -> PyResult<String> {
    Ok(format::json::text(value).map_err(|error| Refusal::new(Kind::Defect, error))?)
}

/// A page in an iframe, so that its style and that of the notebook stay separate.
pub(crate) fn framed(page: &str) -> String {
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    format!("<iframe srcdoc=\"{page}\" style=\"width:100%;height:36em;border:0\"></iframe>")
}

/// The extension module.
#[pymodule(gil_used = false)]
mod _truegrind {
    #[pymodule_export]
    use crate::acceptance::{PyAcceptance, accept_};
    #[pymodule_export]
    use crate::dataset::PyDataset;
    #[pymodule_export]
    use crate::export::PyExport;
    #[pymodule_export]
    use crate::fits::{PyDiagnosis, PyIdentification, diagnose_, identify_};
    #[pymodule_export]
    use crate::model::PyModel;
    #[pymodule_export]
    use crate::plan::{PyPlan, plan_};
    #[pymodule_export]
    use crate::programs::{PyCompensation, PyDeviation, compensate_, deviation_};
    #[pymodule_export]
    use crate::robot::{PyArm, PyRobot, catalogue, forward_of, inverse_of};
    #[pymodule_export]
    use crate::simulation::{PySimulation, simulate};
    #[pymodule_export]
    use crate::toolpath::{PyToolpath, cell_file, path_};
    #[pymodule_export]
    use crate::track::{PyTrack, track_};

    #[pymodule_export]
    #[expect(non_upper_case_globals, reason = "as Python names it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
