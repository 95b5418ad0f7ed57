//! Switches and loads with which bodies are entered: fixpoints along the calls; the motions that the switches exclude from changes.

use super::ListingBuilder;
use crate::dataflow::{Edge, propagate};
use crate::motion::load::{Grip, Loads};
use crate::motion::{Motion, MotionKind, Place, Reason, Switch as SwitchState};
use crate::rapid::flow::CallSite;
use crate::rapid::modal::{Switch, SwitchSet};
use crate::rapid::payload::Gripped;

impl ListingBuilder<'_, '_> {
    /// Refuses all motions where a displacement may be counted from the end of any of them.
    pub(super) fn refuse_motions_before_displacement(&mut self) {
        let used_at_entry = self.position_used_at_entry.iter().any(|body| self.begins_anywhere(*body));
        if self.position_used || used_at_entry {
            for motion in &mut self.listing.motions {
                motion.own_reason.get_or_insert(Reason::BeforeDisplacement);
            }
        }
    }

    /// Lists decisions by the robot's position that some motion may reach which keeps no endpoint for them: refusing every motion of a
    /// program that looks where it stands at its start would leave most programs, whose tolerances there are centimetres.
    pub(super) fn list_position_decisions(&mut self) {
        let decisions = std::mem::take(&mut self.position_decisions);
        let open =
            decisions.into_iter().filter(|(body, at_entry, _)| !at_entry || self.begins_anywhere(*body));
        let mut places: Vec<Place> = open.map(|(.., place)| place).collect();
        places.sort_unstable_by_key(|place| (place.file, place.line, place.column));
        places.dedup();
        self.listing.position_decisions = places;
    }

    /// Whether a body may begin where the robot stands after any motion.
    fn begins_anywhere(&self, body: u32) -> bool {
        let Some(routine) = self.symbols.bodies[body as usize].routine else { return true };
        let called = |(from, site): &(u32, CallSite)| site.routine == routine && *from != body;
        self.mains.contains(&routine)
            || self.symbols.interrupts[routine as usize]
            || !self.sites.iter().any(called)
    }

    /// Replaces "as at the entry" by the entry switches.
    pub(super) fn resolve_entry_switches(&mut self) {
        let entries = self.solve_entry_switches();
        let motions = self.listing.motions.iter_mut().zip(&self.modal).zip(&self.bodies);
        for (((motion, modal), body), displaced) in motions.zip(&self.displaced) {
            let states = modal.substitute_entry(entries[*body as usize]);
            motion.modal = states.modal();
            if motion.own_reason.is_none() {
                // A known displacement is part of the work object.
                let unknown = !displaced && states.state(Switch::Displacement) != SwitchState::Off;
                let offset = states.state(Switch::ExternalOffset) != SwitchState::Off;
                motion.own_reason = modal_refusal(motion, unknown || offset);
            }
        }
    }

    /// Fixpoint: the switches with which each body may be entered.
    fn solve_entry_switches(&self) -> Vec<SwitchSet> {
        let (bodies, symbols) = (&self.symbols.bodies, self.symbols);
        let body_of = |routine: u32| symbols.body_of(routine);
        let mut called = vec![false; bodies.len()];
        for (body, site) in &self.sites {
            // A recursive call is no entry.
            called[body_of(site.routine) as usize] |= *body != body_of(site.routine);
        }
        // Before a routine that no file calls, another routine has run, or none.
        let before = self.exits.iter().flatten().fold(SwitchSet::EMPTY, |all, exit| all.join(exit.modal));
        let alone = SwitchSet::START.join(before.substitute_entry(SwitchSet::EMPTY));
        let mut entries: Vec<SwitchSet> = Vec::with_capacity(bodies.len());
        for (body, &called) in bodies.iter().zip(&called) {
            let routine = body.routine.map(|routine| (routine, &symbols.routines[routine as usize]));
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
        // After the bodies a node for each list of routines that a computed name may call, and one for unknown code.
        let lists = bodies.len() as u32;
        let unknown = lists + symbols.late_lists.len() as u32;
        entries.resize(unknown as usize + 1, SwitchSet::EMPTY);
        let called = self.sites.iter().map(|(body, site)| (*body, body_of(site.routine), site.modal));
        let mut edges: Vec<Edge<SwitchSet>> = called.collect();
        for (body, list) in (0..lists).zip(&symbols.late_list) {
            edges.push((body, lists + list, self.late[body as usize]));
            edges.push((body, unknown, self.outside[body as usize]));
        }
        for (list, callees) in (lists..).zip(&symbols.late_lists) {
            edges.extend(callees.iter().map(|&routine| (list, body_of(routine), SwitchSet::ENTRY)));
        }
        let global = symbols.routines.iter().filter(|routine| !routine.head.local);
        edges.extend(global.map(|routine| (unknown, routine.body, SwitchSet::ENTRY)));
        loop {
            propagate(&mut entries, SwitchSet::HEIGHT, &mut edges, |modal, entry| {
                modal.substitute_entry(*entry)
            });
            let of_bodies = &mut entries[..bodies.len()];
            // A cycle of routines that only call each other has no entry yet.
            if !of_bodies.contains(&SwitchSet::EMPTY) {
                entries.truncate(bodies.len());
                return entries;
            }
            of_bodies.iter_mut().filter(|entry| **entry == SwitchSet::EMPTY).for_each(|entry| *entry = alone);
        }
    }

    /// The load at each motion.
    pub(super) fn loads(&mut self) -> Loads {
        let (symbols, totals) = (self.symbols, std::mem::take(&mut self.totals));
        if symbols.interrupt_routines.iter().any(|routine| symbols.effects_of(*routine).grips) {
            return Loads { grips: vec![Grip::Unknown; self.grips.len()], totals };
        }
        let entries = self.solve_entry_loads();
        let at = |(gripped, body): (&Gripped, &u32)| gripped.0.unwrap_or(entries[*body as usize]);
        Loads { grips: self.grips.iter().zip(&self.bodies).map(at).collect(), totals }
    }

    /// Fixpoint: none at the start of main; elsewhere the join over all calls.
    fn solve_entry_loads(&self) -> Vec<Grip> {
        let symbols = self.symbols;
        let start = |routine: Option<u32>| routine.is_none_or(|routine| self.mains.contains(&routine));
        let begins = symbols.bodies.iter().map(|body| start(body.routine).then_some(Grip::Empty));
        let mut entries: Vec<Option<Grip>> = begins.collect();
        // Computed calls and interrupts can occur with any load.
        let late = symbols.late_list.iter().flat_map(|list| &symbols.late_lists[*list as usize]);
        for routine in late.chain(&symbols.interrupt_routines) {
            entries[symbols.body_of(*routine) as usize] = Some(Grip::Unknown);
        }
        let calls =
            self.sites.iter().map(|(body, site)| (*body, symbols.body_of(site.routine), site.gripped));
        let mut calls: Vec<Edge<Gripped>> = calls.collect();
        propagate(&mut entries, 2, &mut calls, |gripped, entry| gripped.0.or(*entry));
        // Never called in these files.
        entries.into_iter().map(|entry| entry.unwrap_or(Grip::Unknown)).collect()
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
