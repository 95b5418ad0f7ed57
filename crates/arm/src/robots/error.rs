//! Why there is no robot.

use thiserror::Error;

/// Why there is no robot.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RobotError {
    /// The name is not in the catalogue.
    #[error("unknown robot \"{name}\", expected one of {known}; or give the path of a TOML file of your own")]
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
