//! Why a model file cannot be read or written.

use thiserror::Error;

use crate::bounds::InvalidValue;

/// The name and version of the file format.
pub const SCHEMA: &str = "truegrind.model/1";

/// Why a model file cannot be read or written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelFileError {
    /// A number cannot be written.
    #[error("the model cannot be written: {0}")]
    Unwritable(String),
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("not a truegrind model: {0}")]
    Syntax(String),
    /// A file of another kind or version.
    #[error("`schema` is \"{found}\", expected \"{SCHEMA}\"")]
    Schema {
        /// What it says of itself.
        found: String,
    },
    /// The covariance is of a parameter that no arm has.
    #[error("`covariance.order`: unknown {name}")]
    UnknownParameter {
        /// The name as the file has it.
        name: String,
    },
    /// The rows of the covariance are not those of a triangle.
    #[error("`covariance.lower`: expected {expected} rows of 1 to {expected} numbers")]
    Triangle {
        /// Parameters in the order.
        expected: usize,
    },
    /// One of the two arms is none.
    #[error("`{part}`: {fault}")]
    Arm {
        /// `nominal` or `estimated`.
        part: &'static str,
        /// What is wrong with it.
        fault: InvalidValue,
    },
    /// A number that no estimated arm has, or parts that do not go together.
    #[error(transparent)]
    InvalidValue(#[from] InvalidValue),
}
