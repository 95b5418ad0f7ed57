//! Endpoints pinned because a later unmodified move starts there.

use std::collections::{BTreeSet, HashMap};

use super::keeps_endpoint;
use super::word_slots::states_increment;
use crate::motion::{MotionKind, Reason, WorkObjectValue};
use crate::nc::task::{StartDependency, Task};
use crate::rewrite::{Change, RewriteOutcome};

/// Axes X, Y and Z as bits.
const ALL: u8 = 0b111;

impl Task<'_> {
    /// Leaves straight motions unmodified whose end point an unmodified arc or unsupported path needs as its start;
    /// for a tangential path also the start of that motion. Arcs that end there are pinned by the rewrite, because
    /// they may become straight.
    pub(in crate::nc) fn leave_pinned_ends(&mut self) {
        let mut pinned_axes = vec![0; self.listing.motions.len()];
        for index in (0..self.listing.motions.len()).rev() {
            let motion = &self.listing.motions[index];
            let stays = motion.reason().is_some();
            let dependency = self.start_dependency(index, stays);
            let axes = self.pinned_start_axes(index, stays, pinned_axes[index]);
            if axes == 0 {
                continue;
            }
            let (file, circular) = (motion.place.file, motion.kind == MotionKind::Circular);
            let Some(at) = motion.previous.or((index as u32).checked_sub(1)) else { continue };
            let differ = self.axes_differ(at, index as u32);
            let before = &mut self.listing.motions[at as usize];
            if before.place.file != file {
                continue;
            }
            pinned_axes[at as usize] |= if differ { ALL } else { axes };
            if before.kind != MotionKind::Circular && before.reason().is_none() {
                before.own_reason =
                    Some(if circular { Reason::BeforeUnmodifiedArc } else { Reason::BeforeUnmodifiedPath });
            }
            // If the motion before may be skipped, the one before that also ends here.
            let context = &mut self.contexts[at as usize];
            if dependency == StartDependency::Tangent || before.conditional || context.may_omit_words {
                context.start_dependency = context.start_dependency.max(StartDependency::Position);
            }
        }
    }

    /// Refuses motions whose end point an unmodified motion needs as its start. Returns those that become straight
    /// pieces instead, the last of which must end at the original point.
    pub(super) fn find_pinned_ends(
        &self,
        changes: &[Change],
        wanted: &mut HashMap<u32, usize>,
        outcomes: &mut [RewriteOutcome],
    ) -> BTreeSet<u32> {
        let mut pinned = BTreeSet::new();
        let mut refused = BTreeSet::new();
        // Motions whose start is pinned because a tangential path follows.
        let mut directed = BTreeSet::new();
        let mut pinned_axes = vec![0; self.listing.motions.len()];
        for index in (1..self.listing.motions.len() as u32).rev() {
            let motion = &self.listing.motions[index as usize];
            let arc_stays = motion.kind == MotionKind::Circular && !wanted.contains_key(&index);
            let stays = motion.reason().is_some() || refused.contains(&index) || arc_stays;
            let dependency = self.start_dependency(index as usize, stays);
            let axes = self.pinned_start_axes(index as usize, stays, pinned_axes[index as usize]);
            if axes == 0 && !directed.contains(&index) {
                continue;
            }
            let before = motion.previous.unwrap_or(index - 1);
            if self.listing.motions[before as usize].place.file != motion.place.file {
                continue;
            }
            let mixed = axes != 0 && self.axes_differ(before, index);
            pinned_axes[before as usize] |= if mixed { ALL } else { axes };
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
                    outcomes[change] = RewriteOutcome::Refused(match arc {
                        true => Reason::BeforeUnmodifiedArc,
                        false => Reason::BeforeUnmodifiedPath,
                    });
                    refused.insert(before);
                }
                None => {}
            }
        }
        pinned
    }

    /// Whether the axes of two motions have different or unknown directions (ROT, another work offset): then each
    /// axis of one depends on all axes of the other.
    pub(super) fn axes_differ(&self, one: u32, other: u32) -> bool {
        let listing = &self.listing;
        let [Some(a), Some(b)] = [one, other].map(|index| listing.motions[index as usize].work_object) else {
            return false;
        };
        match [a, b].map(|frame| listing.work_objects[frame as usize].value.as_ref()) {
            [Ok(a), Ok(b)] => {
                let rotation = |frame: &WorkObjectValue| {
                    frame.user_frame.pose().rotation * frame.object_frame.pose().rotation
                };
                rotation(a).angle_to(&rotation(b)) > 1e-9
            }
            _ => true,
        }
    }

    /// The axes in which a motion must start at the original point: those that its path depends on, and those of
    /// `held`, in which it must end there, that it does not state itself.
    pub(super) fn pinned_start_axes(&self, index: usize, stays: bool, pinned_axes: u8) -> u8 {
        let (motion, context) = (&self.listing.motions[index], &self.contexts[index]);
        let own = match self.start_dependency(index, stays) {
            StartDependency::Independent => 0,
            StartDependency::Position if context.start_dependency == StartDependency::Independent => {
                self.arc_axes(index)
            }
            _ => ALL,
        };
        // After a call the position is that of the subprogram; a cycle starts at the tool position.
        let moves = motion.kind != MotionKind::Unknown
            || matches!(motion.reason(), Some(Reason::Cycle | Reason::TiltsTool));
        own | if stays && moves && pinned_axes != 0 {
            pinned_axes & !self.axes_with_own_end(index)
        } else {
            0
        }
    }

    /// The axes that the words of an arc name; all if fewer than two.
    fn arc_axes(&self, index: usize) -> u8 {
        let (.., slots) = self.block_words(&self.listing.motions[index], &self.contexts[index]);
        let named = |axis: &usize| slots.axes[*axis].is_some() || slots.centre[*axis].is_some();
        let axes = (0..3).filter(named).fold(0, |all, axis| all | 1 << axis);
        if u8::count_ones(axes) < 2 { ALL } else { axes }
    }

    /// The axes in which an unmodified motion ends at its programmed position whatever the start: it states them, or
    /// omitted ones are restated.
    fn axes_with_own_end(&self, index: usize) -> u8 {
        let (motion, context) = (&self.listing.motions[index], &self.contexts[index]);
        let (tree, dialect, slots) = self.block_words(motion, context);
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
