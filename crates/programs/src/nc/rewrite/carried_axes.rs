//! Axes in which an uncorrected air move stays where the tool is, since the canned cycle behind it states them itself.
//!
//! The usual one is the lift between a corrected cut and a cycle, which stays uncorrected where later blocks take its level. Put back in the
//! axes that it omits, it would leave the part sideways, by the whole correction.

use std::collections::BTreeMap;

use super::word_slots::states_increment;
use crate::motion::{MotionKind, Reason};
use crate::nc::task::{StateEvent, Task};

impl Task<'_> {
    /// For each such motion the axes, as bits, as far as it remains unmodified.
    pub(super) fn carried_axes(&self) -> BTreeMap<u32, u8> {
        let pairs = self.events.windows(2).filter_map(|pair| match *pair {
            [StateEvent::Motion(lift), StateEvent::Motion(cycle)] => Some((lift, cycle)),
            _ => None,
        });
        pairs
            .map(|(lift, cycle)| (lift, self.axes_from_lift(lift, cycle)))
            .filter(|(_, axes)| *axes != 0)
            .collect()
    }

    fn axes_from_lift(&self, lift: u32, cycle: u32) -> u8 {
        let [is_lift, is_cycle] = [lift, cycle].map(|index| {
            let (motion, context) = (&self.listing.motions[index as usize], &self.contexts[index as usize]);
            move |reason: Option<Reason>| {
                motion.own_reason == reason && !motion.conditional && !context.may_omit_words
            }
        });
        let [from, to] = [lift, cycle].map(|index| &self.listing.motions[index as usize]);
        let is_one_file = from.place.file == to.place.file;
        if from.kind != MotionKind::Joint
            || !is_one_file
            || !is_lift(None)
            || !is_cycle(Some(Reason::Cycle))
            || self.axes_differ(lift, cycle)
        {
            return 0;
        }
        let (.., omitted) = self.block_words(from, &self.contexts[lift as usize]);
        let context = &self.contexts[cycle as usize];
        let (tree, dialect, stated) = self.block_words(to, context);
        let is_absolute = |axis: &usize| {
            stated.axes[*axis].as_ref().is_some_and(|word| {
                let increment = states_increment(tree, dialect, word);
                !increment.unwrap_or(!context.absolute || context.distance_mode_unknown)
            })
        };
        let carried = |axis: &usize| omitted.axes[*axis].is_none() && is_absolute(axis);
        (0..3).filter(carried).fold(0, |all, axis| all | 1 << axis)
    }
}
