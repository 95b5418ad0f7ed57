//! Ends that stay because what comes after them stays and hangs on where it begins.

use std::collections::{BTreeSet, HashMap};

use super::keeps_endpoint;
use super::word_slots::{slots, states_increment};
use crate::motion::{MotionKind, Reason, WorkObjectValue};
use crate::nc::task::{StartDependency, Task};
use crate::rewrite::{Change, Outcome};

/// Axes X, Y and Z as bits.
const ALL: u8 = 0b111;

impl Task<'_> {
    /// An arc or another path that stays as it is needs its start: the straight motion that ends there stays too, and where it
    /// goes on in the direction of that, so does the start of that. Where an arc ends there it is the rewrite that sees to it,
    /// because that arc may become straight.
    pub(in crate::nc) fn leave_pinned_ends(&mut self) {
        let mut held = vec![0; self.listing.motions.len()];
        for index in (0..self.listing.motions.len()).rev() {
            let motion = &self.listing.motions[index];
            let stays = motion.reason().is_some();
            let dependency = self.start_dependency(index, stays);
            let axes = self.start_axes(index, stays, held[index]);
            if axes == 0 {
                continue;
            }
            let (file, circular) = (motion.place.file, motion.kind == MotionKind::Circular);
            let Some(at) = motion.previous.or((index as u32).checked_sub(1)) else { continue };
            let turns = self.turns_between(at, index as u32);
            let before = &mut self.listing.motions[at as usize];
            if before.place.file != file {
                continue;
            }
            held[at as usize] |= if turns { ALL } else { axes };
            if before.kind != MotionKind::Circular && before.reason().is_none() {
                before.left = Some(if circular { Reason::BeforeLeftArc } else { Reason::BeforeLeftPath });
            }
            // Where the block before may be skipped, the one before that ends here too.
            let context = &mut self.contexts[at as usize];
            if dependency == StartDependency::Tangent || before.conditional || context.may_omit_words {
                context.start_dependency = context.start_dependency.max(StartDependency::Position);
            }
        }
    }

    /// An arc or other path that stays starts where the one before it ends: that one stays too, or, where it becomes straight pieces, the
    /// last of them ends where it always did. Hands back the latter.
    pub(super) fn find_pinned_ends(
        &self,
        changes: &[Change],
        wanted: &mut HashMap<u32, usize>,
        outcomes: &mut [Outcome],
    ) -> BTreeSet<u32> {
        let mut pinned = BTreeSet::new();
        let mut refused = BTreeSet::new();
        // Motions whose start stays because what comes after them goes on in their direction.
        let mut directed = BTreeSet::new();
        let mut held = vec![0; self.listing.motions.len()];
        for index in (1..self.listing.motions.len() as u32).rev() {
            let motion = &self.listing.motions[index as usize];
            let arc_stays = motion.kind == MotionKind::Circular && !wanted.contains_key(&index);
            let stays = motion.reason().is_some() || refused.contains(&index) || arc_stays;
            let dependency = self.start_dependency(index as usize, stays);
            let axes = self.start_axes(index as usize, stays, held[index as usize]);
            if axes == 0 && !directed.contains(&index) {
                continue;
            }
            let before = motion.previous.unwrap_or(index - 1);
            if self.listing.motions[before as usize].place.file != motion.place.file {
                continue;
            }
            let mixed = axes != 0 && self.turns_between(before, index);
            held[before as usize] |= if mixed { ALL } else { axes };
            let perhaps = self.listing.motions[before as usize].conditional
                || self.contexts[before as usize].may_omit_words;
            if dependency == StartDependency::Tangent || perhaps {
                directed.insert(before);
            }
            match wanted.get(&before).copied() {
                Some(change) if changes[change].straightens() && dependency != StartDependency::Tangent => {
                    pinned.insert(before);
                }
                Some(change) => {
                    wanted.remove(&before);
                    let arc = motion.kind == MotionKind::Circular;
                    outcomes[change] = Outcome::Refused(match arc {
                        true => Reason::BeforeLeftArc,
                        false => Reason::BeforeLeftPath,
                    });
                    refused.insert(before);
                }
                None => {}
            }
        }
        pinned
    }

    /// Whether the axes of one motion point elsewhere than those of another (ROT, another work offset), or that is not known: then
    /// each axis of the one hangs on all of the other.
    fn turns_between(&self, one: u32, other: u32) -> bool {
        let listing = &self.listing;
        let [Some(a), Some(b)] = [one, other].map(|index| listing.motions[index as usize].work_object) else {
            return false;
        };
        match [a, b].map(|frame| listing.work_objects[frame as usize].value.as_ref()) {
            [Ok(a), Ok(b)] => {
                let turn = |frame: &WorkObjectValue| {
                    frame.user_frame.pose().rotation * frame.object_frame.pose().rotation
                };
                turn(a).angle_to(&turn(b)) > 1e-9
            }
            _ => true,
        }
    }

    /// The axes in which a motion must begin where it always did: those that its own way hangs on, and those of `held`,
    /// in which it must end there, that it takes from the motion before.
    pub(super) fn start_axes(&self, index: usize, stays: bool, held: u8) -> u8 {
        let (motion, context) = (&self.listing.motions[index], &self.contexts[index]);
        let own = match self.start_dependency(index, stays) {
            StartDependency::Independent => 0,
            StartDependency::Position if context.start_dependency == StartDependency::Independent => {
                self.arc_axes(index)
            }
            _ => ALL,
        };
        // Behind a call the tool stands where that has left it; a cycle begins where the tool stands.
        let moves = motion.kind != MotionKind::Unknown || motion.reason() == Some(Reason::Cycle);
        own | if stays && moves && held != 0 { held & !self.own_ends(index) } else { 0 }
    }

    /// The axes of an arc as far as its words tell them; all where they do not.
    fn arc_axes(&self, index: usize) -> u8 {
        let file = self.listing.motions[index].place.file as usize;
        let slots = slots(&self.trees[file], self.dialects[file], &self.contexts[index]);
        let named = |axis: &usize| slots.axes[*axis].is_some() || slots.centre[*axis].is_some();
        let axes = (0..3).filter(named).fold(0, |all, axis| all | 1 << axis);
        if u8::count_ones(axes) < 2 { ALL } else { axes }
    }

    /// The axes in which a motion that stays ends where it says, whatever is before it: it states them, or what it leaves out
    /// is said again.
    fn own_ends(&self, index: usize) -> u8 {
        let (motion, context) = (&self.listing.motions[index], &self.contexts[index]);
        let file = motion.place.file as usize;
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        let slots = slots(tree, dialect, context);
        if context.may_omit_words {
            return 0;
        }
        let again = context.can_restate || motion.reason().is_none_or(keeps_endpoint);
        let own = |axis: &usize| {
            again && context.start[*axis].is_some()
                || slots.axes[*axis].is_some_and(|word| {
                    let increment = states_increment(tree, dialect, &word);
                    !increment.unwrap_or(!context.absolute || context.distance_mode_unknown)
                })
        };
        (0..3).filter(own).fold(0, |all, axis| all | 1 << axis)
    }
}
