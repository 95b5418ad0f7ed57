//! Record of a finished unit: `done/KEY.json`, schema `truegrind.done/1`.
//!
//! It is written after all outputs of the unit and contains their hashes: if the record exists and the outputs match, the unit need not
//! be processed again. A record torn by a machine crash does not parse and is ignored.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Schema name and version.
pub const SCHEMA: &str = "truegrind.done/1";

/// An output file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Path.
    pub file: String,
    /// Whether the path is relative to the folder of the run, which may have moved since.
    pub below: bool,
    /// SHA-256 of its bytes.
    pub sha256: String,
}

/// How a unit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ended {
    /// Processed, whatever the result.
    Done,
    /// Failed; a resumed job tries it again.
    Failed,
    /// Crashed its process several times; a resumed job skips it.
    Killed,
}

/// The record of a unit with its report data as JSON.
pub type Done = Recorded<Value>;

/// The record of a unit; `R`: its report data. A reader that needs only a part uses a type that skips the rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recorded<R> {
    /// [`SCHEMA`].
    pub schema: String,
    /// Key; see [`super::key::of_unit`].
    pub key: String,
    /// Name for display.
    pub unit: String,
    /// How the unit ended.
    pub ended: Ended,
    /// Output files.
    pub outputs: Vec<Output>,
    /// Report data, bit-exact.
    pub record: R,
}

impl<R> Recorded<R> {
    /// The text of the file. `record`: its report data as JSON text, which saves building a JSON value.
    ///
    /// # Errors
    /// Those of the serialiser; no record is known to cause one.
    pub fn to_text(&self, record: &str) -> Result<String, serde_json::Error> {
        let Self { schema, key, unit, ended, outputs, record: _ } = self;
        let [schema, key, unit] = [schema, key, unit].map(serde_json::to_string);
        let (ended, outputs) = (serde_json::to_string(ended)?, serde_json::to_string(outputs)?);
        let head = format!("\"schema\":{},\"key\":{},\"unit\":{}", schema?, key?, unit?);
        Ok(format!("{{{head},\"ended\":{ended},\"outputs\":{outputs},\"record\":{record}}}\n"))
    }

    /// Converts the report data.
    pub fn and_then<T>(self, of: impl FnOnce(R) -> Option<T>) -> Option<Recorded<T>> {
        let Self { schema, key, unit, ended, outputs, record } = self;
        Some(Recorded { schema, key, unit, ended, outputs, record: of(record)? })
    }
}

impl<R: DeserializeOwned> Recorded<R> {
    /// Parses a file; `None` if it is not the complete record of the unit with this key.
    pub fn from_bytes(bytes: &[u8], key: &str) -> Option<Self> {
        let done: Self = serde_json::from_slice(bytes).ok()?;
        (done.schema == SCHEMA && done.key == key).then_some(done)
    }
}
