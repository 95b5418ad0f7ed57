//! Units that a header states behind the name: `q1 [deg]`, `measured_x (mm)`, `q1_deg`.

use super::column_names::{PAYLOAD_CENTRE, POSITION, READOUT, joint};

/// A header with a unit.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct WithUnit<'a> {
    /// The name.
    pub(super) name: &'a str,
    /// The unit, as written.
    pub(super) unit: &'a str,
    /// Whether the column is expected in that unit.
    pub(super) is_expected: bool,
    /// The unit that is expected.
    pub(super) expected: &'static str,
    /// Whether no fit is possible without the column.
    pub(super) is_required: bool,
}

/// Units of angles, lengths, times, temperatures and masses that measurement tables state.
const UNITS: [&str; 26] = [
    "deg",
    "degree",
    "degrees",
    "°",
    "rad",
    "mrad",
    "mm",
    "millimetre",
    "millimeter",
    "m",
    "cm",
    "um",
    "µm",
    "in",
    "inch",
    "h",
    "hour",
    "hours",
    "min",
    "s",
    "c",
    "°c",
    "k",
    "f",
    "kg",
    "g",
];

/// The name and unit of a header; `None` without a unit, or where no unit is expected of that column.
pub(super) fn with_unit(header: &str) -> Option<WithUnit<'_>> {
    let in_brackets = ['[', '('].into_iter().zip([']', ')']).find_map(|(open, close)| {
        let (name, unit) = header.trim_end().strip_suffix(close)?.split_once(open)?;
        Some((name.trim_end(), unit.trim()))
    });
    // `x_mm` is the name of many other things.
    let behind_a_line = || {
        let (name, unit) = header.trim_end().rsplit_once('_')?;
        let is_unit = UNITS.contains(&unit.to_lowercase().as_str());
        (is_unit && !READOUT.contains(&name)).then_some((name, unit))
    };
    let (name, unit) = in_brackets.or_else(behind_a_line)?;
    let (is_required, accepted): (_, &[&str]) = match name {
        "t" => (false, &["h", "hour", "hours"]),
        "temperature" => (false, &["°C", "C", "degC"]),
        "payload" => (false, &["kg"]),
        _ if READOUT.contains(&name) || PAYLOAD_CENTRE.contains(&name) => (false, &MILLIMETRES),
        _ if name == "L" || POSITION.contains(&name) => (true, &MILLIMETRES),
        _ if joint(name).is_some() => (true, &["deg", "degree", "degrees", "°"]),
        _ => return None,
    };
    let is_expected = accepted.iter().any(|one| one.to_lowercase() == unit.to_lowercase());
    Some(WithUnit { name, unit, is_expected, expected: accepted[0], is_required })
}

const MILLIMETRES: [&str; 5] = ["mm", "millimetre", "millimetres", "millimeter", "millimeters"];
