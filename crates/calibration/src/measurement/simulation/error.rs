//! Errors of simulation recipes.

use thiserror::Error;

/// A recipe that cannot be simulated.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RecipeError {
    /// Not TOML, or a key that is missing, misspelt or of the wrong type.
    #[error("{file}: not a recipe: line {line}: {message}; docs/simulate.md has a complete one")]
    Syntax {
        /// File.
        file: String,
        /// Line, from 1.
        line: usize,
        /// What the TOML reader found and expected.
        message: String,
    },
    /// An invalid value.
    #[error("{key}: found {found}, expected {expected}")]
    Invalid {
        /// Key, as a path.
        key: String,
        /// Value.
        found: String,
        /// Expected value.
        expected: &'static str,
    },
    /// The robot is not known.
    #[error("robot: {message}")]
    Robot {
        /// Message of the catalogue.
        message: String,
    },
    /// Too few poses satisfy the recipe.
    #[error(
        "poses: found {found} of {wanted} poses after {tries} tries; expected poses inside the joint ranges that the \
         sensor sees; widen the joint box, `view.box_mm`, `view.distance_mm` or `view.tilt_deg`"
    )]
    NoPose {
        /// Poses found.
        found: usize,
        /// Poses required.
        wanted: usize,
        /// Number of draws.
        tries: usize,
    },
}
