//! What a RAPID program grips and carries at each motion.
//!
//! `GripLoad` adds the gripped load until the next `GripLoad`, with its centre in the tool frame (in the work object where the robot
//! holds that); `\TLoad` of a motion replaces tool load and gripped load, unless it is `load0`. The gripped load is a part of the
//! abstract state ([`super::flow`]); where the states of a join differ it is unknown.
//!
//! Source: ABB RAPID instruction reference (RobotWare 6), GripLoad, MoveL, loaddata, tooldata.

use super::evaluate::{Context, Evaluator};
use super::syntax::{RapidTree, arguments};
use super::token::same_name;
use super::value::Value;
use crate::dataflow::Lattice;
use crate::motion::load::{Grip, Load};
use crate::tree::Child;

/// Mass of `load0`, which means no load (kg).
const NOTHING_KG: f64 = 0.001;

/// Two loads that differ are unknown.
impl Lattice for Grip {
    fn join(&mut self, other: &Self) {
        if self != other {
            *self = Grip::Unknown;
        }
    }
}

/// Gripped load at a statement of a routine. `None`: as at its entry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Gripped(pub(super) Option<Grip>);

impl Gripped {
    pub(super) const UNKNOWN: Gripped = Gripped(Some(Grip::Unknown));

    /// The load after a call that was made with another.
    pub(super) fn after(self, before: Gripped) -> Gripped {
        Gripped(self.0.or(before.0))
    }
}

impl Lattice for Gripped {
    fn join(&mut self, other: &Self) {
        if self != other {
            *self = Gripped::UNKNOWN;
        }
    }
}

/// The load after `GripLoad`.
pub(super) fn gripped_by(
    evaluator: &Evaluator<'_, '_>,
    context: Context<'_>,
    tree: &RapidTree<'_>,
    call: u32,
) -> Gripped {
    let value = arguments(tree, call).find(|argument| !argument.optional).and_then(|argument| argument.value);
    Gripped(Some(match value.and_then(|value| load(evaluator, context, value)) {
        Some(load) if load.mass_kg > NOTHING_KG => Grip::Holds(load),
        Some(_) => Grip::Empty,
        None => Grip::Unknown,
    }))
}

/// The load that a motion states for tool and grip together; `load0` leaves the tool's own load in force.
pub(super) fn total_load(
    evaluator: &Evaluator<'_, '_>,
    context: Context<'_>,
    tree: &RapidTree<'_>,
    motion: u32,
) -> Option<Load> {
    let option = arguments(tree, motion)
        .find(|a| a.optional && a.name.is_some_and(|name| same_name(tree.text(name), b"TLoad")));
    total(evaluator, context, option?.value?)
}

/// The load that the value of `\TLoad` states, as [`total_load`] gives it.
pub(super) fn total(evaluator: &Evaluator<'_, '_>, context: Context<'_>, value: Child) -> Option<Load> {
    load(evaluator, context, value).filter(|total| total.mass_kg > NOTHING_KG)
}

/// A loaddata.
fn load(evaluator: &Evaluator<'_, '_>, context: Context<'_>, value: Child) -> Option<Load> {
    let Value::List(parts) = evaluator.value(context, value) else { return None };
    let [mass, centre, ..] = parts.as_slice() else { return None };
    Some(Load { mass_kg: mass.number().ok()?, centre_mm: centre.numbers().ok()? })
}
