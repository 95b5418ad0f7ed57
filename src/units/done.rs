//! What is kept of a unit that is done: `done/KEY.json`, schema `truegrind.done/1`.
//!
//! It is written after all outputs of the unit are in their places, and says what is in them; so whoever finds it, and finds the
//! outputs as it says, has nothing to do. A record that a crash of the machine tore does not read, and counts for nothing.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name and version of the form.
pub const SCHEMA: &str = "truegrind.done/1";

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Where.
    pub file: String,
    /// Whether that is below the folder of what is done, which may have moved since; else it is as it was named.
    pub below: bool,
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

/// The record of a unit, with what the reports of the run need of it as JSON.
pub type Done = Recorded<Value>;

/// The record of a unit; `R`: what the reports of the run need of it. A reader that needs less of it takes a type that passes over the
/// rest, and builds nothing for that.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recorded<R> {
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
    pub record: R,
}

impl<R> Recorded<R> {
    /// As a file; `record`: JSON, in place of that of `self`, which a job of many need not build first.
    ///
    /// # Errors
    /// None that a record could bring about; what the writer says.
    pub fn to_text(&self, record: &str) -> Result<String, serde_json::Error> {
        let Self { schema, key, unit, ended, outputs, record: _ } = self;
        let [schema, key, unit] = [schema, key, unit].map(serde_json::to_string);
        let (ended, outputs) = (serde_json::to_string(ended)?, serde_json::to_string(outputs)?);
        let head = format!("\"schema\":{},\"key\":{},\"unit\":{}", schema?, key?, unit?);
        Ok(format!("{{{head},\"ended\":{ended},\"outputs\":{outputs},\"record\":{record}}}\n"))
    }

    /// The same unit with something else of it; `None` where there is nothing.
    pub fn and_then<T>(self, of: impl FnOnce(R) -> Option<T>) -> Option<Recorded<T>> {
        let Self { schema, key, unit, ended, outputs, record } = self;
        Some(Recorded { schema, key, unit, ended, outputs, record: of(record)? })
    }
}

impl<R: DeserializeOwned> Recorded<R> {
    /// From the bytes of a file; `None` where it is not the whole record of the unit with this key.
    pub fn from_bytes(bytes: &[u8], key: &str) -> Option<Self> {
        let done: Self = serde_json::from_slice(bytes).ok()?;
        (done.schema == SCHEMA && done.key == key).then_some(done)
    }
}
