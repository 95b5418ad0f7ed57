//! The list of all units of a run, in the order of the one run that would do them all: `run.json`, schema `truegrind.run/1`.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Name and version of the form.
pub const SCHEMA: &str = "truegrind.run/1";

/// One unit: the files that were named, before any of them names further ones.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unit {
    /// The folder that was given, where it was one: outputs keep their place below it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub under: Option<String>,
    /// Its files, as they were given or found.
    pub paths: Vec<String>,
}

/// A run: what its jobs have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// [`SCHEMA`].
    pub schema: String,
    /// The version of truegrind.
    pub version: String,
    /// The verb.
    pub verb: String,
    /// Its key; see [`super::key::of_run`].
    pub run: String,
    /// How many shares the job that wrote this was told of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<u32>,
    /// What the reports need beside the units.
    #[serde(default)]
    pub context: Value,
    /// All units.
    pub units: Vec<Unit>,
}

impl Run {
    /// As a file, one unit a line.
    ///
    /// # Errors
    /// None that a run could bring about; what the writer says.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        let mut head = serde_json::to_value(Run { units: Vec::new(), ..self.clone() })?;
        if let Value::Object(all) = &mut head {
            all.remove("units");
        }
        let head = serde_json::to_string(&head)?;
        let units = self.units.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>()?;
        Ok(format!("{},\"units\":[\n{}\n]}}\n", head.strip_suffix('}').unwrap_or(&head), units.join(",\n")))
    }

    /// From the bytes of a file.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let run: Self = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
        if run.schema != SCHEMA {
            return Err(format!("schema {}, expected {SCHEMA}", run.schema));
        }
        Ok(run)
    }
}
