//! What the readers of others' descriptions share.

use crate::robots::error::RobotError;
use crate::robots::sheet::Dialect;

/// What a file leaves open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ImportOptions {
    /// The link that stands: the root of the tree where left out.
    pub base: Option<String>,
    /// The link that is the flange: `tool0` or `flange` where left out and there is one.
    pub tip: Option<String>,
    /// The log's third angle is that of the forearm against the ground, whatever joint 2 does, as FANUC controllers count it.
    pub ground_joint_3: bool,
}

/// Something that cannot be used, in a file of somebody else.
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

/// What stands where a zero was meant.
pub(super) fn zero_if_tiny(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

/// The language of a maker's programs, where a name tells the maker.
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
