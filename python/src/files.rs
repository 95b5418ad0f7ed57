//! File access; a file that cannot be opened is an `OSError` with its name.

use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;

use crate::errors::{Kind, Refusal};

/// The bytes of a file.
pub(crate) fn read(path: &Path) -> PyResult<Vec<u8>> {
    fs::read(path).map_err(|error| failed(&error, path))
}

/// The text of a file.
pub(crate) fn read_text(path: &Path, kind: Kind) -> PyResult<String> {
    String::from_utf8(read(path)?).map_err(|_| {
        Refusal::new(kind, format!("{}: this is no text (UTF-8)", path.display())).of_file(&name(path)).into()
    })
}

/// File name in messages and reports: the last part of its path.
pub(crate) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Writes a file atomically: to a temporary file, then renamed.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> PyResult<()> {
    let beside = part_of(path);
    let written = || -> io::Result<()> {
        let mut file = OpenOptions::new().write(true).create_new(true).open(&beside)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&beside, path)
    };
    written().map_err(|error| {
        drop(fs::remove_file(&beside));
        failed(&error, path)
    })
}

/// Refuses to write over an input.
pub(crate) fn spare(path: &Path, inputs: &[&Path]) -> PyResult<()> {
    let there = path.canonicalize().ok();
    let same = |input: &&&Path| there.is_some() && input.canonicalize().ok() == there;
    match inputs.iter().find(same) {
        Some(input) => {
            let message = format!("{}: is an input: give another place", input.display());
            Err(Refusal::new(Kind::Program, message).of_file(&name(input)).into())
        }
        None => Ok(()),
    }
}

fn part_of(path: &Path) -> PathBuf {
    path.with_file_name(format!(".{}.{}.part", name(path), std::process::id()))
}

fn failed(error: &io::Error, path: &Path) -> PyErr {
    let path = path.display().to_string();
    match error.raw_os_error() {
        // Python selects the subclass by errno: FileNotFoundError, PermissionError and so on.
        Some(number) => {
            let text = error.to_string();
            let text = text.split(" (os error").next().unwrap_or_default().to_owned();
            PyOSError::new_err((number, text, path))
        }
        None => PyOSError::new_err(format!("{path}: {error}")),
    }
}
