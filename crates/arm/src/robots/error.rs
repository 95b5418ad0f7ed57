//! Why there is no robot, or not the one that was meant.

use thiserror::Error;

/// Why there is no robot.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RobotError {
    /// The name is not in the catalogue.
    #[error(
        "unknown robot \"{name}\", expected one of {known}; or give the path of a robot file of your own (TOML file, URDF, table of link parameters, UR calibration)"
    )]
    Unknown {
        /// What was asked for.
        name: String,
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
    /// Something in another's description of an arm that cannot be used.
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
    /// A value that cannot be right.
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

/// Why a nominal arm is not the one that its name says.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum NominalMismatch {
    /// It goes by a name of the catalogue and has other links.
    #[error(
        "its nominal arm goes by the name {name} and is not the one of the catalogue: {place}; correct the name, or give an arm \
         of your own a name of its own"
    )]
    Name {
        /// The name.
        name: String,
        /// Where the two differ first, with both values.
        place: String,
    },
    /// Two arms of one name differ.
    #[error(
        "the two have one name and are not one arm: {place}; give the robot that the model was identified for"
    )]
    Arms {
        /// Where the two differ first, with both values.
        place: String,
    },
}
