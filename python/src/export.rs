//! Links of an estimated arm in other formats.

use std::path::PathBuf;

use pyo3::prelude::*;
use truegrind::calibration::exported::Exported;
use truegrind::robots::export::Format;

use crate::errors::Refusal;
use crate::files;

/// The links of an estimated arm as a file of another format.
#[pyclass(name = "Export", module = "truegrind", frozen)]
pub(crate) struct PyExport {
    pub(crate) made: Exported,
}

#[pymethods]
impl PyExport {
    /// The file.
    #[getter]
    fn text(&self) -> &str {
        &self.made.text
    }

    /// What the file leaves out, how its angles count, and the error of its links: sentences, which it contains too.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.made.notes.clone()
    }

    /// Whether the links are the whole model. Otherwise it has effects that no format holds, and the links alone are less accurate.
    #[getter]
    fn is_whole(&self) -> bool {
        self.made.is_whole
    }

    /// Writes the file.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        files::write(&path, self.made.text.as_bytes())
    }

    fn __repr__(&self) -> String {
        let of = if self.made.is_whole { "the whole model" } else { "the links alone, without the effects" };
        format!("<Export: {of}>")
    }
}

/// A format by its name.
///
/// # Errors
/// Another name.
pub(crate) fn format_of(name: &str) -> Result<Format, Refusal> {
    match name {
        "urdf" => Ok(Format::Urdf),
        "dh-csv" => Ok(Format::Standard),
        "mdh-csv" => Ok(Format::Modified),
        "ur-yaml" => Ok(Format::UrYaml),
        other => Err(Refusal::argument("format", other, "\"urdf\", \"dh-csv\", \"mdh-csv\" or \"ur-yaml\"")),
    }
}
