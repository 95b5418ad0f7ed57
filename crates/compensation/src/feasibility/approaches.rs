//! The starts of cuts: a line or arc is corrected together with the place where it begins or not at all, since between a corrected and an
//! uncorrected end it becomes a wedge as high as the correction.
//!
//! A line on which nothing is cut may become one: one that goes along with the robot's own position, one that draws the tool straight back
//! along its own axis, and one by itself behind which only air moves follow (after a longer cut). Without these exceptions one refused line
//! would leave a whole program that moves by lines alone.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::cut::{CutsOf, Obstacle, StartsOf, follows_position, may_cut};
use crate::deviation::MotionStatus;
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY_MOTIONS;
use truegrind_programs::motion::{Listing, Motion, MotionKind};

/// The starts of the lines and arcs of a program.
pub(crate) struct Starts<'a> {
    listing: &'a Listing,
    cuts: &'a CutsOf,
    starts: StartsOf<'a>,
    /// Representatives of cuts with their motions, sorted.
    of_cuts: Vec<(u32, u32)>,
    /// After which motions another begins that may cut.
    goes_on: Vec<bool>,
    /// Whether a cut remains unmodified as a whole.
    whole: bool,
}

/// How far a start moves by its correction, and what is allowed.
pub(crate) struct Shift<'s> {
    /// (mm); `None` where that is unknown.
    pub(crate) mm: &'s dyn Fn(u32) -> Option<f64>,
    pub(crate) tolerance_mm: f64,
}

impl Shift<'_> {
    fn exceeds(&self, start: u32, unknown: bool) -> bool {
        (self.mm)(start).map_or(unknown, |mm| !(mm <= self.tolerance_mm))
    }
}

impl<'a> Starts<'a> {
    /// `whole`: a cut is corrected as a whole or not at all.
    pub(crate) fn of(listing: &'a Listing, cuts: &'a CutsOf, whole: bool) -> Self {
        let starts = StartsOf::of(listing);
        let mut goes_on = vec![false; listing.motions.len()];
        for (index, _) in (0_u32..).zip(&listing.motions).filter(|(_, motion)| may_cut(motion)) {
            starts.each(index, |start| goes_on[start as usize] = true);
        }
        let motions = 0..listing.motions.len() as u32;
        let mut of_cuts: Vec<(u32, u32)> =
            motions.filter_map(|index| Some((cuts.root(index)?, index))).collect();
        of_cuts.sort_unstable();
        Self { listing, cuts, starts, of_cuts, goes_on, whole }
    }

    /// The motions that must not be corrected because a line or an arc that remains unmodified begins where they end, with what therefore
    /// remains unmodified before them.
    pub(crate) fn of_cuts_left(
        &self,
        blocking_reason: Obstacle<'_>,
        shift: &Shift<'_>,
    ) -> Vec<(u32, OutcomeReason)> {
        let is_left = |index: u32| blocking_reason(index).is_some();
        let motions = (0..self.listing.motions.len() as u32).into_par_iter().with_min_len(MANY_MOTIONS);
        let mut open: Vec<u32> = motions.filter(|index| self.is_path(*index) && is_left(*index)).collect();
        let mut found: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
        let mut cuts_found = BTreeSet::new();
        while let Some(index) = open.pop() {
            let line = self.listing.motions[index as usize].place.line;
            self.starts.each(index, |start| {
                if is_left(start)
                    || found.contains_key(&start)
                    || !shift.exceeds(start, false)
                    || !self.would_tilt(start, index)
                {
                    return;
                }
                found.insert(start, OutcomeReason::StartOfUnchangedCut { line });
                match self.cuts.root(start).filter(|_| self.whole) {
                    Some(root) if cuts_found.insert(root) => open.extend(self.lines_of(root)),
                    _ if self.is_path(start) => open.push(start),
                    _ => {}
                }
            });
        }
        found.into_iter().collect()
    }

    /// The lines and arcs that must not be corrected because where they begin is refused, with what therefore remains unmodified behind them.
    pub(crate) fn of_starts_refused(
        &self,
        blocking_reason: Obstacle<'_>,
        shift: &Shift<'_>,
    ) -> Vec<(u32, OutcomeReason)> {
        let mut found: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
        let mut cuts_found: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
        // In the order of the text, in which nearly every motion stands behind its start.
        for _ in 0..PASSES {
            let before = found.len();
            for index in (0..self.listing.motions.len() as u32).filter(|index| self.is_path(*index)) {
                if found.contains_key(&index) || blocking_reason(index).is_some() {
                    continue;
                }
                let mut wedge = None;
                self.starts.each(index, |start| {
                    let of_cut = || cuts_found.get(&self.cuts.root(start)?).copied();
                    let refused = match blocking_reason(start) {
                        None => found.get(&start).copied().or_else(of_cut),
                        Some((status, reason)) => {
                            let is_risk = matches!(reason, OutcomeReason::Risk { .. });
                            Some(reason).filter(|_| status == MotionStatus::Refused || is_risk)
                        }
                    };
                    let Some(reason) = refused.filter(|_| self.would_tilt(start, index)) else { return };
                    let line = self.listing.motions[start as usize].place.line;
                    if wedge.is_none() && shift.exceeds(start, true) {
                        wedge = Some(OutcomeReason::PartOfCut { line, because: reason.kind() });
                    }
                });
                let Some(reason) = wedge else { continue };
                found.insert(index, reason);
                if let Some(root) = self.cuts.root(index).filter(|_| self.whole) {
                    cuts_found.insert(root, reason);
                }
            }
            if found.len() == before {
                break;
            }
        }
        found.into_iter().collect()
    }

    fn is_path(&self, index: u32) -> bool {
        let motion = &self.listing.motions[index as usize];
        let is_line = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular);
        // A tilted search meets the part elsewhere.
        is_line && (may_cut(motion) || motion.is_search() && !follows_position(motion))
    }

    /// The motions of a cut.
    fn motions_of(&self, root: u32) -> &[(u32, u32)] {
        let first = self.of_cuts.partition_point(|(other, _)| *other < root);
        let count = self.of_cuts[first..].partition_point(|(other, _)| *other == root);
        &self.of_cuts[first..first + count]
    }

    fn lines_of(&self, root: u32) -> impl Iterator<Item = u32> {
        self.motions_of(root).iter().map(|(_, index)| *index).filter(|index| self.is_path(*index))
    }

    /// Whether the tool may cut on the way from a start, so that a wedge would show in the part.
    fn would_tilt(&self, start: u32, index: u32) -> bool {
        // Within a cut the steps between neighbours are judged.
        let is_one_cut = self.cuts.root(start).is_some() && self.cuts.root(start) == self.cuts.root(index);
        if is_one_cut || self.draws_back(start, index) {
            return false;
        }
        let is_alone =
            |index: u32| self.cuts.root(index).is_some_and(|root| self.motions_of(root).len() == 1);
        let is_approach = self.cuts.root(start).is_none() || is_alone(start) && self.comes_by_air(start);
        is_approach || !is_alone(index) || self.goes_on[index as usize]
    }

    /// Whether only air moves lead to where a motion begins.
    fn comes_by_air(&self, index: u32) -> bool {
        let (mut any, mut all) = (false, true);
        self.starts.each(index, |start| {
            any = true;
            all &= !may_cut(&self.listing.motions[start as usize]);
        });
        any && all
    }

    /// Whether a line draws the tool straight back along its own axis.
    fn draws_back(&self, start: u32, index: u32) -> bool {
        let [from, to] = [start, index].map(|index| &self.listing.motions[index as usize]);
        let ends =
            |motion: &Motion| Some((motion.cartesian_end()?.pose(), motion.work_object?, motion.tool?));
        let (Some((from, object, tool)), Some((end, same_object, same_tool))) = (ends(from), ends(to)) else {
            return false;
        };
        let way = end.translation.vector - from.translation.vector;
        let back = -(from.rotation * nalgebra::Vector3::z());
        to.kind == MotionKind::Linear
            && (object, tool) == (same_object, same_tool)
            && way.norm() >= DRAWN_BACK_MM
            && way.dot(&back) >= STRAIGHT_BACK * way.norm()
    }
}

/// Passes over a program in search of starts that are refused; what is left over, the next round of the planner finds.
const PASSES: usize = 4;

/// A tool that is drawn back by this much no longer cuts (mm).
const DRAWN_BACK_MM: f64 = 5.0;

/// Cosine of the largest angle between the way of a tool that is drawn back and its axis.
const STRAIGHT_BACK: f64 = 0.95;
