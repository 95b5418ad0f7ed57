//! Modal switches: instructions that act in execution order (configuration monitoring, displacement, offsets).
//!
//! Method: [`SwitchSet`] is the lattice element, for each switch the set of its possible states; [`SwitchSet::join`] is the
//! union, so a switch is never called off when it may be on. Within a routine "as at the entry" is one of the states, so each
//! routine is interpreted once and its exit is a function of its entry ([`SwitchSet::substitute_entry`]). The entry states are
//! then propagated along the call graph from main, which starts with the controller's defaults, to a fixpoint.
//!
//! A routine is also entered by calls with a computed name that matches it, and by routines that no file declares; main also in
//! the state in which it or ExitCycle ends a cycle (the next cycle resets no switch); a trap routine in any state, and the
//! switches that it leaves set may hold at every statement. Where an error handler resumes, a callee may have ended anywhere.
//!
//! Departure: routines that no file declares are taken to leave the switches unchanged, and so are event routines, which
//! only the system parameters name.

use super::syntax::{RapidTree, arguments};
use super::token::same_name;
use crate::dataflow::Lattice;
use crate::motion::{Modal, Switch as SwitchState};
use crate::tree::Child;

/// The possible states of all switches: three bits each, for off, on, and as at the entry of the routine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SwitchSet(u32);

/// The switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Switch {
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

impl SwitchSet {
    /// As at the entry of the routine.
    pub const ENTRY: SwitchSet = SwitchSet(all(ENTRY));
    /// No state: unreachable, or no effect.
    pub const EMPTY: SwitchSet = SwitchSet(0);
    /// After a start from main: configurations monitored, everything else off.
    pub const START: SwitchSet = SwitchSet(all(OFF) & !(0o77) | ON | ON << 3);

    /// How many times a set can grow.
    pub(crate) const HEIGHT: usize = 3 * COUNT as usize;

    /// Join: the union of the states.
    pub fn join(self, other: SwitchSet) -> SwitchSet {
        SwitchSet(self.0 | other.0)
    }

    /// One switch assigned.
    pub fn set(self, switch: Switch, on: bool) -> SwitchSet {
        let shift = 3 * switch as u32;
        SwitchSet(self.0 & !(7 << shift) | if on { ON } else { OFF } << shift)
    }

    /// Strong update: the switches that `other` sets take its states.
    pub fn overwrite(self, other: SwitchSet) -> SwitchSet {
        let assigned = (0..COUNT).map(|index| 7 << (3 * index)).filter(|bits| other.0 & bits != 0);
        SwitchSet(assigned.fold(self.0, |all, bits| all & !bits) | other.0)
    }

    /// Replaces "as at the entry" by the states at the entry.
    pub fn substitute_entry(self, entry: SwitchSet) -> SwitchSet {
        let mut out = 0;
        for shift in (0..COUNT).map(|index| 3 * index) {
            let mut bits = self.0 >> shift & 7;
            if bits & ENTRY != 0 {
                bits = bits & !ENTRY | entry.0 >> shift & 7;
            }
            out |= bits << shift;
        }
        SwitchSet(out)
    }

    /// Whether a switch is certainly as at the entry of the routine.
    pub(super) fn is_entry(self, switch: Switch) -> bool {
        self.0 >> (3 * switch as u32) & 7 == ENTRY
    }

    /// Whether a switch is certainly off.
    pub(super) fn is_off(self, switch: Switch) -> bool {
        self.0 >> (3 * switch as u32) & 7 == OFF
    }

    /// Whether a switch has no state: it is not set.
    pub(super) fn is_unset(self, switch: Switch) -> bool {
        self.0 >> (3 * switch as u32) & 7 == 0
    }

    pub(super) fn state(self, switch: Switch) -> SwitchState {
        match self.0 >> (3 * switch as u32) & 3 {
            OFF => SwitchState::Off,
            ON => SwitchState::On,
            _ => SwitchState::Either,
        }
    }

    /// The modal state as the listing states it.
    pub fn modal(self) -> Modal {
        let both = |a: SwitchState, b: SwitchState| match (a, b) {
            (SwitchState::Off, SwitchState::Off) => SwitchState::Off,
            (SwitchState::On, _) | (_, SwitchState::On) => SwitchState::On,
            _ => SwitchState::Either,
        };
        Modal {
            conf_linear: self.state(Switch::ConfLinear),
            conf_joint: self.state(Switch::ConfJoint),
            displacement: both(self.state(Switch::Displacement), self.state(Switch::ExternalOffset)),
            wrist_interpolation: self.state(Switch::Wrist),
            circle_point_orientation: self.state(Switch::CirclePoint),
            synchronised: self.state(Switch::Synchronised),
            // Corrections (CorrCon) reach the motions with \Corr alone.
            sensor_guided: self.state(Switch::Soft),
            independent_axis: both(self.state(Switch::Locked), self.state(Switch::Independent)),
        }
    }
}

impl Lattice for SwitchSet {
    fn join(&mut self, other: &Self) {
        self.0 |= other.0;
    }
}

/// Transfer function of an instruction: the switches that it sets; the others are empty.
pub fn switches_set_by(tree: &RapidTree<'_>, call: u32, name: &[u8]) -> Option<SwitchSet> {
    if !matches!(name.first().map(|byte| byte | 32), Some(b'c' | b'p' | b'e' | b's' | b'i')) {
        return None;
    }
    let is = |text: &str| same_name(text.as_bytes(), name);
    let option = |wanted: &[&str]| {
        arguments(tree, call)
            .filter_map(|argument| argument.name)
            .any(|token| wanted.iter().any(|wanted| same_name(wanted.as_bytes(), tree.text(token))))
    };
    let (switch, on) = if is("ConfL") {
        (Switch::ConfLinear, !option(&["Off"]))
    } else if is("ConfJ") {
        (Switch::ConfJoint, !option(&["Off"]))
    } else if is("PDispOn") || is("PDispSet") || is("PDispAdd") {
        (Switch::Displacement, true)
    } else if is("PDispOff") {
        (Switch::Displacement, false)
    } else if is("EOffsOn") || is("EOffsSet") {
        (Switch::ExternalOffset, true)
    } else if is("EOffsOff") {
        (Switch::ExternalOffset, false)
    } else if is("SingArea") {
        let locked = option(&["LockAxis4"]);
        let wrist = SwitchSet::EMPTY.set(Switch::Wrist, locked || option(&["Wrist"]));
        return Some(wrist.set(Switch::Locked, locked));
    } else if is("CirPathMode") {
        (Switch::CirclePoint, option(&["CirPointOri"]))
    } else if is("SyncMoveOn") {
        (Switch::Synchronised, true)
    } else if is("SyncMoveOff") {
        (Switch::Synchronised, false)
    } else if is("SoftAct") || is("CSSAct") {
        (Switch::Soft, true)
    } else if is("SoftDeact") || is("CSSDeact") || is("CSSDeactMoveL") || is("SCSSDeactMoveL") {
        (Switch::Soft, false)
    } else if ["IndAMove", "IndCMove", "IndDMove", "IndRMove"].into_iter().any(is) {
        (Switch::Independent, names_robot(tree, call).then_some(true)?)
    } else if is("IndReset") {
        (Switch::Independent, names_robot(tree, call).then_some(false)?)
    } else {
        return None;
    };
    Some(SwitchSet::EMPTY.set(switch, on))
}

/// Whether the first argument of a call is the name of a robot among mechanical units: ROB_1, IRB and so on.
fn names_robot(tree: &RapidTree<'_>, call: u32) -> bool {
    let unit = arguments(tree, call).next().and_then(|argument| argument.value);
    let Some(Child::Token(token)) = unit else { return false };
    tree.text(token).get(..3).is_some_and(|name| same_name(name, b"ROB") || same_name(name, b"IRB"))
}
