//! Entry switches: a fixpoint over the call graph, and the motions that the switches exclude from changes.

use std::collections::BTreeMap;

use super::ListingBuilder;
use crate::motion::{Motion, MotionKind, Reason, Switch as SwitchState};
use crate::rapid::flow::CallSite;
use crate::rapid::modal::{Switch, SwitchSet};

impl ListingBuilder<'_, '_> {
    /// Refuses all motions where a displacement may be counted from the end of any of them.
    pub(super) fn refuse_motions_before_displacement(&mut self) {
        let units = &self.symbols.units;
        let begins_anywhere = |unit: &u32| {
            let Some(routine) = units[*unit as usize].routine else { return true };
            let called = |(from, site): &(u32, CallSite)| site.routine == routine && from != unit;
            self.mains.contains(&routine)
                || self.symbols.interrupts[routine as usize]
                || !self.sites.iter().any(called)
        };
        if self.position_used || self.position_used_at_entry.iter().any(begins_anywhere) {
            for motion in &mut self.listing.motions {
                motion.left.get_or_insert(Reason::BeforeDisplacement);
            }
        }
    }

    /// Replaces "as at the entry" by the entry switches.
    pub(super) fn resolve_entry_switches(&mut self) {
        let entries = self.solve_entry_switches();
        let motions = self.listing.motions.iter_mut().zip(&self.modal).zip(&self.units);
        for (((motion, modal), unit), displaced) in motions.zip(&self.displaced) {
            let states = modal.substitute_entry(entries[*unit as usize]);
            motion.modal = states.modal();
            if motion.left.is_none() {
                // A known displacement is part of the work object.
                let unknown = !displaced && states.state(Switch::Displacement) != SwitchState::Off;
                let offset = states.state(Switch::ExternalOffset) != SwitchState::Off;
                motion.left = modal_refusal(motion, unknown || offset);
            }
        }
    }

    /// Fixpoint over the call graph: the switches with which each unit may be entered.
    fn solve_entry_switches(&self) -> Vec<SwitchSet> {
        let (units, symbols) = (&self.symbols.units, self.symbols);
        let unit_of = |routine: u32| symbols.routines[routine as usize].unit;
        let mut called = vec![false; units.len()];
        for (unit, site) in &self.sites {
            // A recursive call is no entry.
            called[unit_of(site.routine) as usize] |= *unit != unit_of(site.routine);
        }
        // Before a routine that no file calls, another routine has run, or none.
        let before = self.exits.iter().flatten().fold(SwitchSet::EMPTY, |all, exit| all.join(*exit));
        let alone = SwitchSet::START.join(before.substitute_entry(SwitchSet::EMPTY));
        let mut entries: Vec<SwitchSet> = Vec::with_capacity(units.len());
        for (unit, &called) in units.iter().zip(&called) {
            let routine = unit.routine.map(|routine| (routine, &symbols.routines[routine as usize]));
            entries.push(match routine {
                None => SwitchSet::START,
                Some((routine, _)) if symbols.interrupts[routine as usize] => {
                    SwitchSet::START.join(symbols.all_switches)
                }
                Some((routine, _)) if self.mains.contains(&routine) => SwitchSet::START,
                // A part of a program may be called from the missing rest.
                Some((_, scope)) if called && (!self.mains.is_empty() || scope.head.local) => {
                    SwitchSet::EMPTY
                }
                Some(_) => alone,
            });
        }
        // Callers first: one pass suffices without recursion.
        let mut rank = vec![0_u32; units.len()];
        for (at, &unit) in (0..).zip(&symbols.callees_first) {
            rank[unit as usize] = at;
        }
        let mut sites: Vec<&(u32, CallSite)> = self.sites.iter().collect();
        sites.sort_by_key(|(unit, _)| std::cmp::Reverse(rank[*unit as usize]));
        loop {
            let before = entries.clone();
            for (unit, site) in &sites {
                let arriving = site.modal.substitute_entry(entries[*unit as usize]);
                let callee = &mut entries[unit_of(site.routine) as usize];
                *callee = callee.join(arriving);
            }
            let mut outside = SwitchSet::EMPTY;
            // Many units share one list of routines.
            let mut late: BTreeMap<*const u32, (SwitchSet, &[u32])> = BTreeMap::new();
            for (unit, &entry) in entries.iter().enumerate().take(units.len()) {
                outside = outside.join(self.outside[unit].substitute_entry(entry));
                let called = &symbols.late_callees[unit];
                let arriving = &mut late.entry(called.as_ptr()).or_insert((SwitchSet::EMPTY, called)).0;
                *arriving = arriving.join(self.late[unit].substitute_entry(entry));
            }
            for (arriving, called) in late.into_values().filter(|(arriving, _)| *arriving != SwitchSet::EMPTY)
            {
                for &routine in called {
                    let callee = &mut entries[unit_of(routine) as usize];
                    *callee = callee.join(arriving);
                }
            }
            for routine in symbols.routines.iter().filter(|routine| !routine.head.local) {
                let callee = &mut entries[routine.unit as usize];
                *callee = callee.join(outside);
            }
            if before != entries {
                continue;
            }
            // A cycle of routines that only call each other has no entry yet.
            if !entries.contains(&SwitchSet::EMPTY) {
                return entries;
            }
            entries.iter_mut().filter(|entry| **entry == SwitchSet::EMPTY).for_each(|entry| *entry = alone);
        }
    }
}

/// Why the switches exclude a motion from changes.
fn modal_refusal(motion: &Motion, displaced: bool) -> Option<Reason> {
    if motion.modal.synchronised != SwitchState::Off {
        Some(Reason::Synchronised)
    } else if motion.modal.sensor_guided != SwitchState::Off {
        Some(Reason::SensorGuided)
    } else if motion.modal.independent_axis != SwitchState::Off {
        Some(Reason::IndependentAxis)
    } else if displaced && motion.kind != MotionKind::AbsoluteJoint {
        Some(Reason::Displacement)
    } else {
        None
    }
}
