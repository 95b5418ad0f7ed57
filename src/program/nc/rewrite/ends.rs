//! Ends that stay because what comes after them stays and hangs on where it begins.

use std::collections::{BTreeSet, HashMap};

use super::slots::{said, slots};
use super::stays_in_place;
use crate::program::motion::{MotionKind, Reason};
use crate::program::nc::task::{Needs, Task};
use crate::program::rewrite::{Change, Outcome};

impl Task<'_> {
    /// An arc or other path that stays starts where the one before it ends: that one stays too, or, where it becomes straight pieces, the
    /// last of them ends where it always did. Hands back the latter.
    pub(super) fn fixed_ends(
        &self,
        changes: &[Change],
        wanted: &mut HashMap<u32, usize>,
        outcomes: &mut [Outcome],
    ) -> BTreeSet<u32> {
        let mut fixed = BTreeSet::new();
        let mut refused = BTreeSet::new();
        // Motions whose start stays because what comes after them goes on in their direction.
        let mut directed = BTreeSet::new();
        for index in (1..self.listing.motions.len() as u32).rev() {
            let motion = &self.listing.motions[index as usize];
            let arc_stays = motion.kind == MotionKind::Circular && !wanted.contains_key(&index);
            let stays = motion.reason().is_some() || refused.contains(&index) || arc_stays;
            let needs = match self.needs(index as usize, stays) {
                Needs::Nothing if !directed.contains(&index) => continue,
                needs => needs,
            };
            let before = motion.previous.unwrap_or(index - 1);
            if self.passes_on(before as usize, index as usize) {
                directed.insert(before);
            }
            if self.listing.motions[before as usize].place.file != motion.place.file {
                continue;
            }
            if needs == Needs::Tangent || self.listing.motions[before as usize].conditional {
                directed.insert(before);
            }
            match wanted.get(&before).copied() {
                Some(change) if changes[change].straightens() && needs != Needs::Tangent => {
                    fixed.insert(before);
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
        fixed
    }

    /// Whether a motion that stays ends, in an axis that the one after it starts from, where the motion before it does.
    pub(in crate::program::nc) fn passes_on(&self, motion: usize, after: usize) -> bool {
        let found = &self.listing.motions[motion];
        let (file, written) = (found.place.file as usize, &self.written[motion]);
        let Some(reason) = found.reason() else { return false };
        // Behind a call or a cycle the tool stands where that has left it.
        if found.kind == MotionKind::Unknown {
            return false;
        }
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        let of = |motion: usize| slots(tree, dialect, &self.written[motion]);
        let (here, then) = (of(motion), of(after));
        let from: Vec<usize> =
            (0..3).filter(|&axis| then.axes[axis].is_some() || then.centre[axis].is_some()).collect();
        let from = if from.len() < 2 { vec![0, 1, 2] } else { from };
        // What it leaves out can be said again only where it is known.
        let again = written.restates || stays_in_place(reason);
        let states = |axis: usize| {
            again && written.start[axis].is_some()
                || here.axes[axis]
                    .is_some_and(|word| !said(tree, dialect, &word).unwrap_or(!written.absolute))
        };
        !from.into_iter().all(states)
    }
}
