//! Switches that act in execution order: configuration monitoring, displacement, offsets and the like.
//!
//! Method: for each switch the set of states it may have. Within a routine the set is followed statement by statement,
//! with "as at the entry of the routine" as one of its members, so that each routine is walked once; calls insert the
//! set with which the called routine ends. What the entries really are is then propagated along the calls from main
//! (which starts with the controller's defaults) until nothing changes. Sets only grow where ways join, so a switch
//! is never called off when it may be on.
//!
//! A routine also begins in the state at a call by a computed name that may mean it, and at a call of a routine that
//! is in none of the files, which may call it in turn; main begins in the state in which it or ExitCycle ends a cycle (the
//! next cycle resets no switch); a trap routine begins in any state, and whatever it leaves set may hold at every statement. Where an error
//! handler goes back to the statements, a called routine may have ended anywhere.
//!
//! Departure: a routine that is in none of the files is taken to leave the switches as they are, and so are event
//! routines, which only the system parameters name.

use super::syntax::{RapidTree, arguments};
use super::token::same_name;
use crate::motion::{Modal, Switch};
use crate::tree::Child;

/// The sets of states of all switches: three bits each, off, on, as at the entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct States(u32);

/// The switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Which {
    /// ConfL.
    ConfLinear,
    /// ConfJ.
    ConfJoint,
    /// PDispOn, PDispSet, PDispAdd, PDispOff.
    Displacement,
    /// EOffsOn, EOffsSet, EOffsOff.
    ExternalOffset,
    /// SingArea.
    Wrist,
    /// CirPathMode.
    CirclePoint,
    /// SyncMoveOn, SyncMoveOff.
    Synchronised,
    /// SoftAct, SoftDeact; CSSAct, CSSDeact, CSSDeactMoveL.
    Soft,
    /// SingArea \LockAxis4.
    Locked,
    /// IndAMove, IndCMove, IndDMove, IndRMove, IndReset of a robot: a mechanical unit that is named as ABB names them.
    Independent,
}

const COUNT: u32 = 10;
const OFF: u32 = 1;
const ON: u32 = 2;
const ENTRY: u32 = 4;

const fn all(bits: u32) -> u32 {
    let (mut out, mut index) = (0, 0);
    while index < COUNT {
        out |= bits << (3 * index);
        index += 1;
    }
    out
}

impl States {
    /// As at the entry of the routine.
    pub const ENTRY: States = States(all(ENTRY));
    /// Nothing: no way leads here.
    pub const NONE: States = States(0);
    /// After a start from main: configurations monitored, everything else off.
    pub const START: States = States(all(OFF) & !(0o77) | ON | ON << 3);

    /// On or off.
    pub const ANY: States = States(all(OFF | ON));

    /// Either.
    pub fn or(self, other: States) -> States {
        States(self.0 | other.0)
    }

    /// One switch set.
    pub fn set(self, which: Which, on: bool) -> States {
        let shift = 3 * which as u32;
        States(self.0 & !(7 << shift) | if on { ON } else { OFF } << shift)
    }

    /// With what `other` says of a switch in place of what was said of it.
    pub fn then(self, other: States) -> States {
        let said = (0..COUNT).map(|index| 7 << (3 * index)).filter(|bits| other.0 & bits != 0);
        States(said.fold(self.0, |all, bits| all & !bits) | other.0)
    }

    /// With "as at the entry" replaced by what the entry is.
    pub fn entered(self, entry: States) -> States {
        let mut out = 0;
        for shift in (0..COUNT).map(|index| 3 * index) {
            let mut bits = self.0 >> shift & 7;
            if bits & ENTRY != 0 {
                bits = bits & !ENTRY | entry.0 >> shift & 7;
            }
            out |= bits << shift;
        }
        States(out)
    }

    /// Whether a switch is certainly as at the entry of the routine.
    pub(super) fn keeps(self, which: Which) -> bool {
        self.0 >> (3 * which as u32) & 7 == ENTRY
    }

    /// Whether a switch is certainly off.
    pub(super) fn is_off(self, which: Which) -> bool {
        self.0 >> (3 * which as u32) & 7 == OFF
    }

    /// Whether nothing is said about a switch.
    pub(super) fn leaves(self, which: Which) -> bool {
        self.0 >> (3 * which as u32) & 7 == 0
    }

    pub(super) fn switch(self, which: Which) -> Switch {
        match self.0 >> (3 * which as u32) & 3 {
            OFF => Switch::Off,
            ON => Switch::On,
            _ => Switch::Either,
        }
    }

    /// As the listing tells it.
    pub fn modal(self) -> Modal {
        let both = |a: Switch, b: Switch| match (a, b) {
            (Switch::Off, Switch::Off) => Switch::Off,
            (Switch::On, _) | (_, Switch::On) => Switch::On,
            _ => Switch::Either,
        };
        Modal {
            conf_linear: self.switch(Which::ConfLinear),
            conf_joint: self.switch(Which::ConfJoint),
            displacement: both(self.switch(Which::Displacement), self.switch(Which::ExternalOffset)),
            wrist_interpolation: self.switch(Which::Wrist),
            circle_point_orientation: self.switch(Which::CirclePoint),
            synchronised: self.switch(Which::Synchronised),
            // Corrections (CorrCon) reach the motions with \Corr alone.
            sensor_guided: self.switch(Which::Soft),
            axis_apart: both(self.switch(Which::Locked), self.switch(Which::Independent)),
        }
    }
}

/// What an instruction sets; nothing is said of the other switches.
pub fn setting(tree: &RapidTree<'_>, call: u32, name: &[u8]) -> Option<States> {
    if !matches!(name.first().map(|byte| byte | 32), Some(b'c' | b'p' | b'e' | b's' | b'i')) {
        return None;
    }
    let is = |text: &str| same_name(text.as_bytes(), name);
    let option = |wanted: &[&str]| {
        arguments(tree, call)
            .filter_map(|argument| argument.name)
            .any(|token| wanted.iter().any(|wanted| same_name(wanted.as_bytes(), tree.text(token))))
    };
    let (which, on) = if is("ConfL") {
        (Which::ConfLinear, !option(&["Off"]))
    } else if is("ConfJ") {
        (Which::ConfJoint, !option(&["Off"]))
    } else if is("PDispOn") || is("PDispSet") || is("PDispAdd") {
        (Which::Displacement, true)
    } else if is("PDispOff") {
        (Which::Displacement, false)
    } else if is("EOffsOn") || is("EOffsSet") {
        (Which::ExternalOffset, true)
    } else if is("EOffsOff") {
        (Which::ExternalOffset, false)
    } else if is("SingArea") {
        let locked = option(&["LockAxis4"]);
        let wrist = States::NONE.set(Which::Wrist, locked || option(&["Wrist"]));
        return Some(wrist.set(Which::Locked, locked));
    } else if is("CirPathMode") {
        (Which::CirclePoint, option(&["CirPointOri"]))
    } else if is("SyncMoveOn") {
        (Which::Synchronised, true)
    } else if is("SyncMoveOff") {
        (Which::Synchronised, false)
    } else if is("SoftAct") || is("CSSAct") {
        (Which::Soft, true)
    } else if is("SoftDeact") || is("CSSDeact") || is("CSSDeactMoveL") || is("SCSSDeactMoveL") {
        (Which::Soft, false)
    } else if ["IndAMove", "IndCMove", "IndDMove", "IndRMove"].into_iter().any(is) {
        (Which::Independent, robot(tree, call).then_some(true)?)
    } else if is("IndReset") {
        (Which::Independent, robot(tree, call).then_some(false)?)
    } else {
        return None;
    };
    Some(States::NONE.set(which, on))
}

/// Whether the first argument of a call is the name of a robot among mechanical units: ROB_1, IRB and so on.
fn robot(tree: &RapidTree<'_>, call: u32) -> bool {
    let unit = arguments(tree, call).next().and_then(|argument| argument.value);
    let Some(Child::Token(token)) = unit else { return false };
    tree.text(token).get(..3).is_some_and(|name| same_name(name, b"ROB") || same_name(name, b"IRB"))
}
