//! Bounds of the numbers of an arm that comes from a file.
//!
//! The bounds are wide; they exclude NaN and infinity, units mistaken by a thousand, and a singular joint map. All code after
//! loading relies on them.

use std::fmt;
use std::ops::RangeInclusive;

use nalgebra::Matrix6;

use crate::body::Body;
use truegrind_math::spectral;

/// A value outside its bounds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{key}: found {found}, expected {expected}")]
pub struct InvalidValue {
    /// Key, as a path; links, bodies and lists count from 1.
    pub key: String,
    /// The value found.
    pub found: String,
    /// What was expected.
    pub expected: &'static str,
}

impl InvalidValue {
    /// A fault other than a number out of range.
    pub fn new(key: impl Into<String>, found: impl Into<String>, expected: &'static str) -> Self {
        Self { key: key.into(), found: found.into(), expected }
    }

    /// The same fault with the key of the enclosing part in front.
    pub fn within(self, part: &str) -> Self {
        Self { key: format!("{part}.{}", self.key), ..self }
    }
}

/// A range of numbers, with its description.
#[derive(Debug, Clone)]
pub struct Bound {
    range: RangeInclusive<f64>,
    expected: &'static str,
}

impl Bound {
    /// A range and its description.
    pub const fn new(least: f64, most: f64, expected: &'static str) -> Self {
        Self { range: least..=most, expected }
    }

    /// Whether a number lies in the range; NaN lies in none.
    pub fn contains(&self, value: f64) -> bool {
        self.range.contains(&value)
    }

    /// Refuses a number outside the range under its key.
    ///
    /// # Errors
    /// [`InvalidValue`].
    pub fn check(&self, key: impl fmt::Display, value: f64) -> Result<(), InvalidValue> {
        if self.contains(value) {
            return Ok(());
        }
        Err(InvalidValue { key: key.to_string(), found: display_number(value), expected: self.expected })
    }

    /// Refuses the first of several numbers under one key that is outside the range.
    ///
    /// # Errors
    /// [`InvalidValue`].
    pub fn check_all<'v>(
        &self,
        key: impl fmt::Display,
        values: impl IntoIterator<Item = &'v f64>,
    ) -> Result<(), InvalidValue> {
        values.into_iter().try_for_each(|value| self.check(&key, *value))
    }
}

/// A number for messages; very large and small ones with an exponent.
pub fn display_number(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-6..1e16).contains(&size) { format!("{value:e}") } else { value.to_string() }
}

/// Lengths of links, frames and levers (mm).
pub const LENGTH_MM: Bound = Bound::new(-1e4, 1e4, "a finite length in mm, within ±10,000");
/// Positions in a cell (mm).
pub const POSITION_MM: Bound = Bound::new(-1e6, 1e6, "a finite position in mm, within ±1,000,000");
/// Twists and offsets of links (°).
pub const TWIST_DEG: Bound = Bound::new(-720.0, 720.0, "a finite angle in degrees, within ±720");
/// Joint angles (°).
pub const JOINT_DEG: Bound = Bound::new(-3600.0, 3600.0, "a finite joint angle in degrees, within ±3600");
/// Speeds of joints [°/s].
pub const SPEED_DEG_S: Bound = Bound::new(1e-3, 1e5, "a speed above 0 in degrees per second");
/// Masses (kg).
pub const MASS_KG: Bound = Bound::new(0.0, 1e4, "a mass in kg, 0 to 10,000");
/// Components of a direction.
pub const DIRECTION: Bound = Bound::new(-1e6, 1e6, "a finite component of a direction");
/// Entries of a joint map, factors of a sum of joints.
pub const COUPLING: Bound = Bound::new(-10.0, 10.0, "turns of a link for a turn of a joint, within ±10");

/// Six joint ranges (°).
///
/// # Errors
/// A number out of range, or an empty range.
pub fn joint_ranges(min_deg: &[f64; 6], max_deg: &[f64; 6]) -> Result<(), InvalidValue> {
    JOINT_DEG.check_all("min_deg", min_deg)?;
    JOINT_DEG.check_all("max_deg", max_deg)?;
    match (0..6).find(|&i| min_deg[i] >= max_deg[i]) {
        Some(i) => Err(InvalidValue::new(
            format!("min_deg and max_deg of joint {}", i + 1),
            format!("{} and {}", min_deg[i], max_deg[i]),
            "min below max",
        )),
        None => Ok(()),
    }
}

/// A joint map: signs and couplings, which preserve the volume of the joint space.
///
/// # Errors
/// Numbers out of range, or a map whose determinant is not near ±1 or whose condition is above 100.
pub fn joint_map(rows: &[[f64; 6]; 6]) -> Result<(), InvalidValue> {
    const VOLUME: RangeInclusive<f64> = 0.5..=2.0;
    const CONDITION: f64 = 100.0;
    COUPLING.check_all("joint_map", rows.as_flattened())?;
    let map = Matrix6::from_fn(|row, column| rows[row][column]);
    let volume = map.determinant().abs();
    let values = spectral::singular_values(&map);
    let condition = values.map_or(f64::INFINITY, |v| v.max() / v.min());
    if VOLUME.contains(&volume) && condition <= CONDITION {
        return Ok(());
    }
    Err(InvalidValue::new(
        "joint_map",
        format!(
            "a matrix of determinant ±{} and condition {}",
            display_number(volume),
            display_number(condition)
        ),
        "signs and couplings of the joints: a determinant near ±1 and a condition up to 100",
    ))
}

/// Lengths a and d (mm) and angles alpha, theta and beta (°) of link `index`, counted from 0.
///
/// # Errors
/// [`InvalidValue`].
pub(crate) fn link(
    index: usize,
    [a, d]: [f64; 2],
    [alpha, theta, beta]: [f64; 3],
) -> Result<(), InvalidValue> {
    let key = |name: &str| format!("link {} {name}", index + 1);
    for (name, value) in [("a_mm", a), ("d_mm", d)] {
        LENGTH_MM.check(key(name), value)?;
    }
    for (name, value) in [("alpha_deg", alpha), ("theta_deg", theta), ("beta_deg", beta)] {
        TWIST_DEG.check(key(name), value)?;
    }
    Ok(())
}

/// Mass and centre of a link.
///
/// # Errors
/// [`InvalidValue`].
pub fn bodies(bodies: &[Body]) -> Result<(), InvalidValue> {
    for (i, body) in bodies.iter().enumerate() {
        MASS_KG.check(format_args!("body {} mass_kg", i + 1), body.mass_kg)?;
        LENGTH_MM.check_all(format_args!("body {} centre_mm", i + 1), &body.centre_mm)?;
    }
    Ok(())
}
