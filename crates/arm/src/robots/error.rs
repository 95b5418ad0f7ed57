//! Errors of robot files, and mismatches of nominal arms.

use thiserror::Error;

/// Why a robot cannot be loaded.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RobotError {
    /// The name is not in the catalogue.
    #[error(
        "unknown robot \"{name}\"{near}, expected one of {known}; or give the path of a robot file of your own (TOML file, URDF, table of link parameters, UR calibration)"
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// " (similar: abb-irb-120)", where there are some.
        near: String,
        /// The catalogue.
        known: String,
    },
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error(
        "{file}:{line}:{column}: found \"{found}\": {message}; a file of the catalogue is a complete example"
    )]
    Syntax {
        /// File.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// The line itself.
        found: String,
        /// What the TOML reader expected.
        message: String,
    },
    /// Not exactly one arm in a user's file.
    #[error("{file}: found {found} robots, expected one [[robot]]; put each arm into a file of its own")]
    Several {
        /// File.
        file: String,
        /// How many.
        found: usize,
    },
    /// A foreign description of an arm that cannot be used.
    #[error("{file}: {key}: found {found}, expected {expected}; {remedy}")]
    Foreign {
        /// File.
        file: Box<str>,
        /// Where in it.
        key: Box<str>,
        /// What is there.
        found: Box<str>,
        /// What should be.
        expected: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// An invalid value.
    #[error("{file}: robot \"{robot}\": {key}: found {found}, expected {expected}; {remedy}")]
    Invalid {
        /// File.
        file: Box<str>,
        /// Robot.
        robot: Box<str>,
        /// Key.
        key: Box<str>,
        /// The value.
        found: Box<str>,
        /// What it should be.
        expected: &'static str,
        /// What to do.
        remedy: &'static str,
    },
}

/// Why a nominal arm is not the one of its name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NominalMismatch {
    /// It has a name of the catalogue and other links.
    #[error(
        "its nominal arm has the name {name} but differs from the arm of the catalogue: {place}; correct the name, or give your own arm \
         another name"
    )]
    Name {
        /// The name.
        name: String,
        /// Where the two differ first, with both values.
        place: String,
    },
    /// Two arms of one name differ.
    #[error(
        "the two arms have the same name but differ: {place}; give the robot for which the model was identified"
    )]
    Arms {
        /// Where the two differ first, with both values.
        place: String,
    },
}
