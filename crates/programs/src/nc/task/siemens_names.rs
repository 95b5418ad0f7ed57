//! Names in Siemens programs that are not subprograms of the user.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::motion::Reason;

/// The uses in which a name of `siemens.txt` has no effect on motions.
#[derive(Debug, Clone, Copy, Default)]
struct HarmlessUses {
    alone: bool,
    call: bool,
    value: bool,
}

static NAMES: LazyLock<HashMap<&'static [u8], HarmlessUses>> = LazyLock::new(|| {
    let lines = include_str!("../siemens.txt").lines().filter(|line| !line.starts_with('#'));
    let new_motion = lines.filter_map(|line| line.split_once(' '));
    new_motion
        .map(|(name, places)| {
            let is = |place: &str| places.split(',').any(|one| one.trim() == place);
            (name.as_bytes(), HarmlessUses { alone: is("alone"), call: is("call"), value: is("value") })
        })
        .collect()
});

fn harmless_uses(name: &[u8]) -> HarmlessUses {
    NAMES.get(name).copied().unwrap_or_default()
}

/// Whether a name (in capitals) that stands alone is a keyword without effect on motions.
pub(super) fn is_keyword(name: &[u8]) -> bool {
    harmless_uses(name).alone
}

/// Whether a call of a name (in capitals) has no effect on motions.
pub(super) fn is_harmless_call(name: &[u8]) -> bool {
    harmless_uses(name).call
}

/// The effect of a named address with a value, where known.
pub(super) fn address_effect(name: &[u8]) -> Option<AddressEffect> {
    if harmless_uses(name).value {
        return Some(AddressEffect::None);
    }
    let numbered = name.len() > 1 && name[1..].iter().all(u8::is_ascii_digit);
    Some(match name {
        // S2=, M3=, H1=, F1=: spindles and auxiliary functions.
        [b'S' | b'M' | b'H' | b'F' | b'R' | b'L' | b'Q', ..] if numbered => AddressEffect::None,
        b"MEAS" | b"MEAW" | b"MEASA" | b"MEAWA" | b"MEAC" | b"FXS" => {
            AddressEffect::Unmodelled(Reason::Probe)
        }
        b"ANG" | b"ANG1" | b"ANG2" | b"PO" | b"OSCILL" => AddressEffect::Unmodelled(Reason::UnsupportedPath),
        b"POS" | b"POSA" | b"POSP" | b"POSM" => AddressEffect::Unmodelled(Reason::UnsupportedPath),
        b"AP" | b"RP" => AddressEffect::Unmodelled(Reason::Transformed),
        // Orientation by surface normal or cone, angle profiles.
        [b'A' | b'B' | b'C', b'4'..=b'7']
        | b"LEAD"
        | b"TILT"
        | b"NUT"
        | b"PHI"
        | b"PSI"
        | b"XH"
        | b"YH"
        | b"ZH"
        | b"ORIS" => AddressEffect::Unmodelled(Reason::OrientationUnknown),
        b"SPOS" | b"SPOSA" => AddressEffect::OtherAxes,
        b"TOFF" | b"TOFFL" | b"TOFFR" | b"TOFFLR" | b"TCARR" | b"CUTMOD" | b"CUTMODK" | b"DL" => {
            AddressEffect::Tool
        }
        _ => return None,
    })
}

/// The effect of a named address with a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AddressEffect {
    /// None on motions.
    None,
    /// The motion does not follow from the axis words alone.
    Unmodelled(Reason),
    /// It moves other axes.
    OtherAxes,
    /// It changes the tool.
    Tool,
}

/// Whether a name is a cycle of the control.
pub(super) fn is_cycle(name: &[u8]) -> bool {
    ["CYCLE", "POCKET", "HOLES", "SLOT", "LONGHOLE"].iter().any(|kind| name.starts_with(kind.as_bytes()))
}

/// Whether a name is a measuring cycle (CYCLE961 to CYCLE998, CYCLE9960): each can write work offsets, tools or kinematic data, by parameters
/// of which some are coded digit by digit.
pub(super) fn is_measuring_cycle(name: &[u8]) -> bool {
    match name.strip_prefix(b"CYCLE") {
        Some([b'9', b'6'..=b'9', b'0'..=b'9', rest @ ..]) => rest.iter().all(u8::is_ascii_digit),
        _ => false,
    }
}

/// A code as a program writes it: G54, G43.4.
pub(super) fn code_name(code: u32) -> String {
    match (code / 10, code % 10) {
        (whole, 0) => format!("G{whole}"),
        (whole, tenth) => format!("G{whole}.{tenth}"),
    }
}
