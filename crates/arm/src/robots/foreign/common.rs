//! Shared parts of the importers.

use crate::robots::error::RobotError;
use crate::robots::sheet::Dialect;

/// Choices that a file leaves open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportOptions {
    /// The base link; the root of the tree if omitted.
    pub base: Option<String>,
    /// The flange link; `tool0` or `flange` if omitted and present.
    pub tip: Option<String>,
    /// Joint 3 is measured relative to the ground, independent of joint 2, as FANUC controllers do.
    pub ground_joint_3: bool,
}

/// The error of an unusable part of a foreign file.
pub(super) fn foreign_error(
    file: &str,
    key: impl Into<String>,
    found: impl Into<String>,
    expected: &'static str,
    remedy: &'static str,
) -> RobotError {
    RobotError::Foreign {
        file: file.into(),
        key: key.into().into(),
        found: found.into().into(),
        expected,
        remedy,
    }
}

/// Rounds numerical noise to zero.
pub(super) fn zero_if_tiny(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

/// Program language and maker, by a maker's name in the text.
pub(super) fn maker_of(text: &str) -> (Option<Dialect>, &'static str) {
    let text = text.to_lowercase();
    for (word, maker, dialect) in [
        ("abb", "ABB", Dialect::Rapid),
        ("irb", "ABB", Dialect::Rapid),
        ("kuka", "KUKA", Dialect::Krl),
        ("fanuc", "FANUC", Dialect::Fanuc),
        ("ur3", "Universal Robots", Dialect::Urscript),
        ("ur5", "Universal Robots", Dialect::Urscript),
        ("ur10", "Universal Robots", Dialect::Urscript),
        ("ur16", "Universal Robots", Dialect::Urscript),
        ("ur20", "Universal Robots", Dialect::Urscript),
        ("ur30", "Universal Robots", Dialect::Urscript),
        ("staubli", "Stäubli", Dialect::Val3),
        ("motoman", "Yaskawa", Dialect::Inform),
        ("yaskawa", "Yaskawa", Dialect::Inform),
    ] {
        if text.contains(word) {
            return (Some(dialect), maker);
        }
    }
    (None, "")
}
