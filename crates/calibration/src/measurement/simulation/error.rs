//! Why a recipe gives no measurements.

use thiserror::Error;

/// Why a recipe gives no measurements.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RecipeError {
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("{file}: line {line}: {message}")]
    Syntax {
        /// File.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the TOML reader found and expected.
        message: String,
    },
    /// A value that cannot be used.
    #[error("{key}: found {found}, expected {expected}")]
    Invalid {
        /// Key, as a path.
        key: String,
        /// Value.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The robot is not known.
    #[error("robot: {message}")]
    Robot {
        /// What the catalogue says.
        message: String,
    },
    /// No pose satisfies the recipe.
    #[error(
        "poses: found {found} of {wanted} poses after {tries} tries; expected poses inside the joint ranges that the \
         sensor sees; widen the joint box, `view.box_mm`, `view.distance_mm` or `view.tilt_deg`"
    )]
    NoPose {
        /// Poses found.
        found: usize,
        /// Poses asked for.
        wanted: usize,
        /// Draws.
        tries: usize,
    },
}
