//! JSON: keys in declaration order, numbers with all digits, non-finite numbers as `null`. Invisible characters are escaped as `\u…`.

use serde::Serialize;
use serde::ser::{SerializeMap, SerializeSeq, Serializer};

use super::visible;
use crate::table::{Cell, Field, Table};

/// A result as indented JSON with a final newline. Non-finite numbers become `null`.
///
/// # Errors
/// A map whose keys are not strings, or a `Serialize` of the type's own that fails.
pub fn text<T: Serialize + ?Sized>(value: &T) -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    if !text.contains(visible::is_invisible) {
        return Ok(text);
    }
    // JSON requires escapes only below 32. The others can occur only inside strings, where escapes are allowed.
    let mut escaped = String::with_capacity(text.len() + 64);
    for character in text.chars() {
        if visible::is_invisible(character) {
            let units = character
                .encode_utf16(&mut [0; 2])
                .iter()
                .map(|unit| format!("\\u{unit:04x}"))
                .collect::<String>();
            escaped.push_str(&units);
        } else {
            escaped.push(character);
        }
    }
    Ok(escaped)
}

/// The table as an object: `title`, `units` by column key, `rows` as objects by column key, `notes`.
pub fn table(table: &Table) -> String {
    // Writing to memory cannot fail; an error would be shown in the text.
    text(&Whole(table)).unwrap_or_else(|error| format!("{{\"error\": \"{error}\"}}\n"))
}

/// The rows of a table as a JSON array of objects by column key, to stand inside a larger result. A column whose
/// cells carry a σ gives two keys, as in CSV.
pub struct Rows<'a>(pub &'a Table);

impl Serialize for Rows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fields = self.0.fields();
        let mut rows = serializer.serialize_seq(Some(self.0.rows.len()))?;
        for row in 0..self.0.rows.len() {
            rows.serialize_element(&Row { table: self.0, fields: &fields, row })?;
        }
        rows.end()
    }
}

struct Whole<'a>(&'a Table);

impl Serialize for Whole<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(Some(4))?;
        object.serialize_entry("title", &self.0.title)?;
        object.serialize_entry("units", &Units(self.0))?;
        object.serialize_entry("rows", &Rows(self.0))?;
        object.serialize_entry("notes", &self.0.notes)?;
        object.end()
    }
}

struct Units<'a>(&'a Table);

impl Serialize for Units<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        for (column, field) in self.0.columns.iter().zip(self.0.fields()) {
            for key in std::iter::once(&field.key).chain(&field.sigma_key) {
                if let Some(unit) = &column.unit {
                    object.serialize_entry(key, unit)?;
                }
            }
        }
        object.end()
    }
}

struct Row<'a> {
    table: &'a Table,
    fields: &'a [Field],
    row: usize,
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut object = serializer.serialize_map(None)?;
        for (column, field) in self.fields.iter().enumerate() {
            let cell = self.table.cell(self.row, column);
            match cell {
                Cell::Text(text) => object.serialize_entry(&field.key, text)?,
                Cell::Number(value) | Cell::Worded { value, .. } | Cell::WithSigma { value, .. } => {
                    object.serialize_entry(&field.key, &finite(*value))?;
                }
                Cell::Count(count) => object.serialize_entry(&field.key, count)?,
                Cell::Judged(status, text) if text.is_empty() => {
                    object.serialize_entry(&field.key, status.word())?;
                }
                Cell::Judged(_, text) => object.serialize_entry(&field.key, text)?,
                Cell::Missing => object.serialize_entry(&field.key, &None::<f64>)?,
            }
            if let Some(key) = &field.sigma_key {
                let sigma = match cell {
                    Cell::WithSigma { sigma, .. } => finite(*sigma),
                    _ => None,
                };
                object.serialize_entry(key, &sigma)?;
            }
        }
        object.end()
    }
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}
