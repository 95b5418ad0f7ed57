//! Keys of runs and units: SHA-256 over length-prefixed fields.

use sha2::{Digest, Sha256};
use truegrind_math::digest::hex;
pub use truegrind_math::digest::sha256;

/// A hash over fields, each prefixed with its length, so that different lists of fields never hash the same bytes.
#[derive(Debug, Clone)]
pub struct Fields(Sha256);

impl Fields {
    /// An empty hash; `purpose` separates the hashes of different uses.
    pub fn new(purpose: &str) -> Self {
        Self(Sha256::new()).text(purpose)
    }

    /// Adds a field.
    pub fn bytes(mut self, field: &[u8]) -> Self {
        self.0.update((field.len() as u64).to_le_bytes());
        self.0.update(field);
        self
    }

    /// Adds a text field.
    pub fn text(self, field: &str) -> Self {
        self.bytes(field.as_bytes())
    }

    /// The hash.
    pub fn digest(self) -> Vec<u8> {
        self.0.finalize().to_vec()
    }

    /// The hash in hexadecimal.
    pub fn hex(self) -> String {
        hex(&self.digest())
    }
}

/// The key of a run: version, verb, options, and the content of the files that all units use (model, robot, cell, surface and its mesh).
///
/// `options`: any text that represents every option that influences the outputs. `shared`: SHA-256 of the common files.
pub fn of_run<'a>(verb: &str, options: &str, shared: impl IntoIterator<Item = &'a str>) -> String {
    let start = Fields::new("truegrind.run/1").text(env!("CARGO_PKG_VERSION")).text(verb).text(options);
    shared.into_iter().fold(start, Fields::text).hex()
}

/// The key of a unit of a run: each file by its given name and the SHA-256 of its content, or a word that states why it has none.
pub fn of_unit<'a>(run: &str, files: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let start = Fields::new("truegrind.unit/1").text(run);
    files.into_iter().fold(start, |fields, (name, content)| fields.text(name).text(content)).hex()
}
