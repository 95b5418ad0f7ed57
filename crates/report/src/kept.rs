//! Bit-exact numbers in JSON records, stored as the shortest text that parses to the same number. JSON numbers guarantee neither
//! exactness nor infinities.

use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Number, Value};

use super::number::exact;

/// A number stored as text.
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

/// For optional fields: `#[serde(with = "kept::optional")]`.
pub mod optional {
    use super::{Deserialize, Deserializer, Kept, Serialize, Serializer};

    /// Serialises an optional number.
    ///
    /// # Errors
    /// Those of the serialiser.
    pub fn serialize<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
        value.map(Kept).serialize(serializer)
    }

    /// Deserialises an optional number.
    ///
    /// # Errors
    /// The text is not a number.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
        Ok(Option::<Kept>::deserialize(deserializer)?.map(|kept| kept.0))
    }
}

/// Prefix of a number stored as text. [`TEXT`] is the prefix of a string that starts with either character.
const NUMBER: char = '#';
/// See [`NUMBER`].
const TEXT: char = '\'';

/// A JSON value in which floating-point numbers are stored as text.
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

/// Reverses [`Packed`].
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
