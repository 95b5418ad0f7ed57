//! What is kept of a unit that is done: `done/KEY.json`, schema `truegrind.done/1`.
//!
//! It is written after all outputs of the unit are in their places, and says what is in them; so whoever finds it, and finds the
//! outputs as it says, has nothing to do. A record that a crash of the machine tore does not read, and counts for nothing.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name and version of the form.
pub const SCHEMA: &str = "truegrind.done/1";

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Where: below the folder of what is done where it lies there, else as it was named.
    pub file: String,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

/// How a unit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ended {
    /// It was done, whatever came of it.
    Done,
    /// It could not be done. A job that resumes tries it again.
    Failed,
    /// Whoever did it died, several times. A job that resumes lets it be.
    Killed,
}

/// The record of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// [`SCHEMA`].
    pub schema: String,
    /// Its key; see [`super::key::of_unit`].
    pub key: String,
    /// Its name, for people.
    pub unit: String,
    /// How it ended.
    pub ended: Ended,
    /// What was written.
    pub outputs: Vec<Output>,
    /// What the reports of the run need of it, every bit.
    pub record: Value,
}

impl Done {
    /// As a file.
    ///
    /// # Errors
    /// None that a record could bring about; what the writer says.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string(self)? + "\n")
    }

    /// From the bytes of a file; `None` where it is not the whole record of the unit with this key.
    pub fn from_bytes(bytes: &[u8], key: &str) -> Option<Self> {
        let done: Self = serde_json::from_slice(bytes).ok()?;
        (done.schema == SCHEMA && done.key == key).then_some(done)
    }
}
