//! Checks of stated values, whose errors name the file and the key.

use crate::error::SurfaceError;

/// Largest speed [mm/s], mass (kg), radius (mm) or unit (mm).
const MAX_QUANTITY: f64 = 1e6;

/// What is wrong with the values of a file.
pub(super) struct Faults<'a> {
    /// Name of the file.
    pub(super) file: &'a str,
}

impl Faults<'_> {
    pub(super) fn value(
        &self,
        key: &str,
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: &str,
    ) -> SurfaceError {
        SurfaceError::Value {
            file: self.file.to_owned(),
            key: key.to_owned(),
            found: found.into(),
            expected: expected.into(),
            remedy: remedy.to_owned(),
        }
    }

    pub(super) fn stated(&self, key: &str, source: SurfaceError) -> SurfaceError {
        SurfaceError::Stated { file: self.file.to_owned(), key: key.to_owned(), source: Box::new(source) }
    }

    pub(super) fn toml(&self, text: &str, at: usize, message: &str) -> SurfaceError {
        let before = &text[..text.floor_char_boundary(at)];
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        let message = message.trim_end().replace('\n', ", ");
        SurfaceError::Toml { file: self.file.to_owned(), line, column, message }
    }

    pub(super) fn positive(&self, key: &str, value: f64, expected: &str) -> Result<f64, SurfaceError> {
        if (f64::MIN_POSITIVE..=MAX_QUANTITY).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value.to_string(), expected, "correct the number"))
        }
    }

    /// Refuses a name that no controller accepts.
    pub(super) fn name(&self, key: &str, name: &str) -> Result<(), SurfaceError> {
        let fits = name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && name.len() <= 32;
        if fits {
            return Ok(());
        }
        let expected = "a letter, then letters, digits or _, 32 characters at most";
        Err(self.value(key, format!("`{name}`"), expected, "choose a name that the controller accepts"))
    }
}
