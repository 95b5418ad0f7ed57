//! SHA-256 over fields whose borders count: the key of a run and of a unit.

use sha2::{Digest, Sha256};

/// A hash over fields. Each goes in with its length before it, so that no two lists of fields run together to the same bytes.
#[derive(Debug, Clone)]
pub struct Fields(Sha256);

impl Fields {
    /// None yet, of a purpose that keeps hashes for different things apart.
    pub fn new(purpose: &str) -> Self {
        Self(Sha256::new()).text(purpose)
    }

    /// One more field.
    pub fn bytes(mut self, field: &[u8]) -> Self {
        self.0.update((field.len() as u64).to_le_bytes());
        self.0.update(field);
        self
    }

    /// One more field of words.
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

/// SHA-256 of bytes, in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let digit = |half: u8| char::from(DIGITS[usize::from(half)]);
    bytes.iter().flat_map(|byte| [digit(byte >> 4), digit(byte & 15)]).collect()
}

/// The key of what all units of a run share: the verb, its options, and the files that are read for all of them (model, robot,
/// cell, surface and its mesh), each by its content. The version is in it: another one may come to other results.
///
/// `options` is whatever spells out every option that has a part in the outputs.
pub fn of_run<'a>(verb: &str, options: &str, shared: impl IntoIterator<Item = &'a str>) -> String {
    let start = Fields::new("truegrind.run/1").text(env!("CARGO_PKG_VERSION")).text(verb).text(options);
    shared.into_iter().fold(start, Fields::text).hex()
}

/// The key of a unit of a run: its files, each by its name as it was given and by the SHA-256 of its content, or by the word that
/// says why there is none.
pub fn of_unit<'a>(run: &str, files: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let start = Fields::new("truegrind.unit/1").text(run);
    files.into_iter().fold(start, |fields, (name, content)| fields.text(name).text(content)).hex()
}
