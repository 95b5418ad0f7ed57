//! Names in Siemens programs that are no subprograms of the user.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::motion::Reason;

/// Where a name of `siemens.txt` says nothing that a reader must follow.
#[derive(Debug, Clone, Copy, Default)]
struct Nothing {
    alone: bool,
    call: bool,
    value: bool,
}

static NAMES: LazyLock<HashMap<&'static [u8], Nothing>> = LazyLock::new(|| {
    let lines = include_str!("../siemens.txt").lines().filter(|line| !line.starts_with('#'));
    let new_motion = lines.filter_map(|line| line.split_once(' '));
    new_motion
        .map(|(name, places)| {
            let is = |place: &str| places.split(',').any(|one| one.trim() == place);
            (name.as_bytes(), Nothing { alone: is("alone"), call: is("call"), value: is("value") })
        })
        .collect()
});

fn nothing(name: &[u8]) -> Nothing {
    NAMES.get(name).copied().unwrap_or_default()
}

/// Whether a name (in capitals) that is one word in its block is no subprogram of the user, and moves nothing.
pub(super) fn is_keyword(name: &[u8]) -> bool {
    nothing(name).alone
}

/// Whether a name (in capitals) with arguments moves nothing.
pub(super) fn is_harmless_call(name: &[u8]) -> bool {
    nothing(name).call
}

/// What an address of Siemens with a value does, where that is known.
pub(super) fn address(name: &[u8]) -> Option<Address> {
    if nothing(name).value {
        return Some(Address::Setting);
    }
    let numbered = name.len() > 1 && name[1..].iter().all(u8::is_ascii_digit);
    Some(match name {
        // S2=, M3=, H1=, F1=: spindles and helping functions.
        [b'S' | b'M' | b'H' | b'F' | b'R' | b'L' | b'Q', ..] if numbered => Address::Setting,
        b"MEAS" | b"MEAW" | b"MEASA" | b"MEAWA" | b"MEAC" | b"FXS" => Address::Aside(Reason::Probe),
        b"ANG" | b"ANG1" | b"ANG2" | b"PO" | b"OSCILL" => Address::Aside(Reason::NotFollowed),
        b"POS" | b"POSA" | b"POSP" | b"POSM" => Address::Aside(Reason::NotFollowed),
        b"AP" | b"RP" => Address::Aside(Reason::Transformed),
        // Orientation by the normal of the surface, cones, courses of angles.
        [b'A' | b'B' | b'C', b'4'..=b'7']
        | b"LEAD"
        | b"TILT"
        | b"NUT"
        | b"PHI"
        | b"PSI"
        | b"XH"
        | b"YH"
        | b"ZH"
        | b"ORIS" => Address::Aside(Reason::OrientationUnknown),
        b"SPOS" | b"SPOSA" => Address::External,
        b"TOFF" | b"TOFFL" | b"TOFFR" | b"TOFFLR" | b"TCARR" | b"CUTMOD" | b"CUTMODK" | b"DL" => {
            Address::Tool
        }
        _ => return None,
    })
}

/// What an address of Siemens with a value does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Address {
    /// Nothing that these readers must follow.
    Setting,
    /// The block goes elsewhere than its words say.
    Aside(Reason),
    /// Other axes.
    External,
    /// The tool.
    Tool,
}

/// Cycles of the control.
pub(super) fn is_cycle(name: &[u8]) -> bool {
    ["CYCLE", "POCKET", "HOLES", "SLOT", "LONGHOLE"].iter().any(|kind| name.starts_with(kind.as_bytes()))
}

/// A code as a program writes it: G54, G43.4.
pub(super) fn code_name(code: u32) -> String {
    match (code / 10, code % 10) {
        (whole, 0) => format!("G{whole}"),
        (whole, tenth) => format!("G{whole}.{tenth}"),
    }
}
