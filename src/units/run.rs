//! List of all units of a run, in the order of an unshared run: `run.json`, schema `truegrind.run/1`.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Schema name and version.
pub const SCHEMA: &str = "truegrind.run/1";

/// One unit: its named files; a task list is not expanded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unit {
    /// The folder in which they were found, if any: outputs keep their relative path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub under: Option<String>,
    /// Paths of its files, as given or found.
    pub paths: Vec<String>,
}

/// Data common to all jobs of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// [`SCHEMA`].
    pub schema: String,
    /// The version of truegrind.
    pub version: String,
    /// The verb.
    pub verb: String,
    /// Key; see [`super::key::of_run`].
    pub run: String,
    /// Number of shares, if the run is sharded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<u32>,
    /// Further data for the reports.
    #[serde(default)]
    pub context: Value,
    /// All units.
    pub units: Vec<Unit>,
}

impl Run {
    /// The text of the file, one unit per line.
    ///
    /// # Errors
    /// Those of the serialiser; no run is known to cause one.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        let mut head = serde_json::to_value(Run { units: Vec::new(), ..self.clone() })?;
        if let Value::Object(all) = &mut head {
            all.remove("units");
        }
        let head = serde_json::to_string(&head)?;
        let units = self.units.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
        Ok(format!("{},\"units\":[\n{}\n]}}\n", head.strip_suffix('}').unwrap_or(&head), units.join(",\n")))
    }

    /// Parses a file.
    ///
    /// # Errors
    /// Invalid JSON or another schema.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let run: Self = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        if run.schema != SCHEMA {
            return Err(format!("schema {}, expected {SCHEMA}", run.schema));
        }
        Ok(run)
    }
}
