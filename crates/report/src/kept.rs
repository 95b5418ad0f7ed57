//! Numbers that are kept in JSON and come back with every bit, whatever reads them: as text, the shortest that reads back as the same
//! number. JSON's own numbers do not promise that, and know no infinity.

use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Number, Value};

use super::number::exact;

/// A number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kept(pub f64);

impl Serialize for Kept {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&exact(self.0))
    }
}

impl<'de> Deserialize<'de> for Kept {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        f64::from_str(&text).map(Self).map_err(serde::de::Error::custom)
    }
}

/// Fields of a structure: `#[serde(with = "kept::optional")]`.
pub mod optional {
    use super::{Deserialize, Deserializer, Kept, Serialize, Serializer};

    /// Writes a number that may be absent.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        value.map(Kept).serialize(serializer)
    }

    /// Reads it back.
    ///
    /// # Errors
    /// What is no number.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
        Ok(Option::<Kept>::deserialize(deserializer)?.map(|kept| kept.0))
    }
}

/// Stands before a number that was made text; [`TEXT`] before a text that begins with either.
const NUMBER: char = '#';
/// See [`NUMBER`].
const TEXT: char = '\'';

/// A value that is written with each number that is no whole one as text.
pub struct Packed<'a>(pub &'a Value);

impl Serialize for Packed<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Value::Number(number) if number.is_f64() => {
                let value = number.as_f64().unwrap_or(f64::NAN);
                serializer.collect_str(&format_args!("{NUMBER}{}", exact(value)))
            }
            Value::String(text) if text.starts_with([NUMBER, TEXT]) => {
                serializer.collect_str(&format_args!("{TEXT}{text}"))
            }
            Value::Array(list) => serializer.collect_seq(list.iter().map(Packed)),
            Value::Object(all) => serializer.collect_map(all.iter().map(|(key, value)| (key, Packed(value)))),
            other => other.serialize(serializer),
        }
    }
}

/// The value that was packed.
pub fn unpacked(value: Value) -> Value {
    match value {
        Value::String(text) => match (text.strip_prefix(NUMBER), text.strip_prefix(TEXT)) {
            (Some(number), _) => {
                let number = number.parse().ok().and_then(Number::from_f64);
                number.map_or(Value::Null, Value::Number)
            }
            (_, Some(plain)) => Value::String(plain.to_owned()),
            _ => Value::String(text),
        },
        Value::Array(list) => Value::Array(list.into_iter().map(unpacked).collect()),
        Value::Object(all) => {
            Value::Object(all.into_iter().map(|(key, value)| (key, unpacked(value))).collect())
        }
        other => other,
    }
}
