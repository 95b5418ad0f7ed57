//! TOML of which nothing is dropped: an array with more elements than its field holds is an error.
//!
//! The TOML reader takes as many elements as there is room for and drops the others, so that `[12,5, 0, 120]`, written with a decimal comma,
//! would be the position 12, 5, 0.

use std::fmt;
use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// Why a text could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TomlError {
    span: Option<Range<usize>>,
    message: String,
    /// With the place, for people.
    whole: String,
}

impl TomlError {
    /// Where in the text, in bytes.
    pub fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// What is wrong, without the place.
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for TomlError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.whole)
    }
}

impl std::error::Error for TomlError {}

impl From<toml::de::Error> for TomlError {
    fn from(error: toml::de::Error) -> Self {
        Self { span: error.span(), message: error.message().to_owned(), whole: error.to_string() }
    }
}

/// Reads a text.
///
/// ```
/// use truegrind_math::toml_text::read;
///
/// #[derive(Debug, serde::Deserialize)]
/// struct Tool {
///     position_mm: [f64; 3],
/// }
///
/// assert_eq!(read::<Tool>("position_mm = [12.5, 0, 120]").unwrap().position_mm, [12.5, 0.0, 120.0]);
/// let error = read::<Tool>("\nposition_mm = [12,5, 0, 120]").unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "line 2, position_mm: found 4 numbers, expected 3 (a number has a decimal point, not a comma: 12.5)"
/// );
/// ```
///
/// # Errors
/// The reader's error with the line, or the array that has too many elements.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, TomlError> {
    let read = toml::from_str(text)?;
    let table: Table = text.parse()?;
    match too_long::<T>(&table) {
        None => Ok(read),
        Some(TooLong { path, message }) => {
            let span = DeTable::parse(text).ok().and_then(|whole| span_of(whole.get_ref(), &path));
            let start = span.as_ref().map_or(0, |span| span.start).min(text.len());
            let line = 1 + text.get(..start).unwrap_or_default().matches('\n').count();
            Err(TomlError { span, whole: format!("line {line}, {message}"), message })
        }
    }
}

/// Reads a table; its errors have no line.
///
/// # Errors
/// As [`read`].
pub fn read_table<T: DeserializeOwned>(table: Table) -> Result<T, TomlError> {
    match too_long::<T>(&table) {
        None => Ok(table.try_into()?),
        Some(TooLong { message, .. }) => Err(TomlError { span: None, whole: message.clone(), message }),
    }
}

/// An array that is longer than its field.
struct TooLong {
    path: Vec<Step>,
    message: String,
}

/// From a table or an array to what stands in it.
enum Step {
    Key(String),
    Index(usize),
}

fn too_long<T: DeserializeOwned>(table: &Table) -> Option<TooLong> {
    // Unlike that of a text, the reader of a value refuses elements that are left over.
    let path = failing_path::<T>(table.clone())?;
    let mut shorter = table.clone();
    let array = array_at(&mut shorter, &path)?;
    let (found, numbers) = (array.len(), array.iter().all(|one| one.is_integer() || one.is_float()));
    let name = path.iter().rev().find_map(|step| match step {
        Step::Key(key) => Some(key.clone()),
        Step::Index(_) => None,
    })?;
    for expected in (0..found).rev() {
        array_at(&mut shorter, &path)?.truncate(expected);
        if !failing_path::<T>(shorter.clone()).is_some_and(|other| is_same(&other, &path)) {
            let message = if numbers {
                format!(
                    "{name}: found {found} numbers, expected {expected} (a number has a decimal point, not a comma: 12.5)"
                )
            } else {
                format!("{name}: found {found} entries, expected {expected}")
            };
            return Some(TooLong { path, message });
        }
    }
    None
}

/// Where reading a table fails.
fn failing_path<T: DeserializeOwned>(table: Table) -> Option<Vec<Step>> {
    let error = serde_path_to_error::deserialize::<_, T>(Value::Table(table)).err()?;
    steps(error.path())
}

fn steps(path: &Path) -> Option<Vec<Step>> {
    path.iter()
        .map(|segment| match segment {
            Segment::Map { key } => Some(Step::Key(key.clone())),
            Segment::Seq { index } => Some(Step::Index(*index)),
            Segment::Enum { .. } | Segment::Unknown => None,
        })
        .collect()
}

fn is_same(a: &[Step], b: &[Step]) -> bool {
    a.len() == b.len()
        && a.iter().zip(b).all(|steps| match steps {
            (Step::Key(a), Step::Key(b)) => a == b,
            (Step::Index(a), Step::Index(b)) => a == b,
            _ => false,
        })
}

fn array_at<'v>(table: &'v mut Table, path: &[Step]) -> Option<&'v mut Vec<Value>> {
    let (first, rest) = path.split_first()?;
    let Step::Key(key) = first else { return None };
    let value = rest.iter().try_fold(table.get_mut(key)?, |value, step| match step {
        Step::Key(key) => value.get_mut(key.as_str()),
        Step::Index(index) => value.get_mut(*index),
    })?;
    value.as_array_mut()
}

fn span_of(table: &DeTable<'_>, path: &[Step]) -> Option<Range<usize>> {
    let (first, rest) = path.split_first()?;
    let Step::Key(key) = first else { return None };
    let found = rest.iter().try_fold(entry(table, key)?, |value, step| match (value.get_ref(), step) {
        (DeValue::Table(table), Step::Key(key)) => entry(table, key),
        (DeValue::Array(array), Step::Index(index)) => array.get(*index),
        _ => None,
    })?;
    Some(found.span())
}

fn entry<'v, 's>(table: &'v DeTable<'s>, key: &str) -> Option<&'v Spanned<DeValue<'s>>> {
    table.iter().find(|(name, _)| name.get_ref() == key).map(|(_, value)| value)
}
