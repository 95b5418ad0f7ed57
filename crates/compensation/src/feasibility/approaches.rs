//! The starts of cuts: a line or arc is corrected together with the place where it begins or not at all, since between a corrected and an
//! uncorrected end it becomes a wedge as high as the correction.
//!
//! A contour with a stop at each corner is thus corrected as a whole or not at all. Lines on which nothing is cut may become wedges: those that
//! go along with the robot's own position, those that draw the tool straight back along its own axis, and, where one remains unmodified after
//! a longer cut, a line by itself behind which only air moves follow. A line from an unmodified approach through the air may too, unless the
//! approach was refused: without these exceptions one line would leave a whole program that moves by lines alone.

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use crate::cut::{CutsOf, Obstacle, StartsOf, follows_position, may_cut};
use crate::deviation::MotionStatus;
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY_MOTIONS;
use truegrind_programs::motion::{Listing, Motion, MotionKind, Reason};

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
                    || !self.holds_its_start(start, index)
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

    /// The lines and arcs that must not be corrected because where they begin is refused, or is an uncorrected place on the part, with what
    /// therefore remains unmodified behind them.
    pub(crate) fn of_starts_uncorrected(
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
                    // A start whose correction is not known is off by about as much as the end.
                    let mut unknown = true;
                    let uncorrected = match blocking_reason(start) {
                        None => found.get(&start).copied().or_else(of_cut),
                        Some((status, reason)) => {
                            let is_refused = status == MotionStatus::Refused
                                || matches!(reason, OutcomeReason::Risk { .. });
                            unknown = is_refused || shift.exceeds(index, true);
                            Some(reason).filter(|_| is_refused || self.is_on_part(start))
                        }
                    };
                    let may_be_wedge = || self.may_be_wedge(start, index) && !self.is_drawn_back(start);
                    let Some(reason) = uncorrected.filter(|_| may_be_wedge()) else { return };
                    let line = self.listing.motions[start as usize].place.line;
                    if wedge.is_none() && shift.exceeds(start, unknown) {
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

    /// The motions that lead from an uncorrected place on the part away from it, to where no corrected line or arc begins: corrected, they
    /// would draw the tool out of the part sideways.
    pub(crate) fn of_departures(
        &self,
        blocking_reason: Obstacle<'_>,
        shift: &Shift<'_>,
    ) -> Vec<(u32, OutcomeReason)> {
        let mut found: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
        for index in 0..self.listing.motions.len() as u32 {
            if self.is_path(index) && !self.is_drawn_back(index) || blocking_reason(index).is_some() {
                continue;
            }
            self.starts.each(index, |start| {
                let is_uncorrected = blocking_reason(start).is_some() && self.is_on_part(start);
                if is_uncorrected && shift.exceeds(start, shift.exceeds(index, true)) {
                    let line = self.listing.motions[start as usize].place.line;
                    found.entry(index).or_insert(OutcomeReason::DepartureFromUnchangedCut { line });
                }
            });
        }
        if found.is_empty() {
            return Vec::new();
        }
        for index in (0..self.listing.motions.len() as u32).filter(|index| self.is_path(*index)) {
            if blocking_reason(index).is_none() {
                self.starts.each(index, |start| {
                    if !self.is_drawn_back(start) || self.draws_near(start, index) {
                        found.remove(&start);
                    }
                });
            }
        }
        found.into_iter().collect()
    }

    /// Whether a motion remains unmodified to which or from whose end another leads: in most programs none does, and no start need be asked.
    pub(crate) fn any_left(&self, blocking_reason: Obstacle<'_>) -> bool {
        let motions = (0..self.listing.motions.len() as u32).into_par_iter().with_min_len(MANY_MOTIONS);
        motions.any(|index| {
            blocking_reason(index).is_some_and(|(status, reason)| {
                status == MotionStatus::Refused
                    || matches!(reason, OutcomeReason::Risk { .. })
                    || self.meets_part(index)
            })
        })
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
    fn may_be_wedge(&self, start: u32, index: u32) -> bool {
        // Within a cut the steps between neighbours are judged.
        let is_one_cut = self.cuts.root(start).is_some() && self.cuts.root(start) == self.cuts.root(index);
        !is_one_cut && !self.draws_back(start, index)
    }

    /// Whether a line that remains unmodified must keep its start unmodified: all but a line by itself behind which only air moves follow.
    fn holds_its_start(&self, start: u32, index: u32) -> bool {
        let is_approach =
            self.cuts.root(start).is_none() || self.is_alone(start) && self.comes_by_air(start) == Some(true);
        self.may_be_wedge(start, index)
            && (is_approach || !self.is_alone(index) || self.goes_on[index as usize])
    }

    /// Whether a motion ends where the tool may have been cutting: not at the end of an approach through the air, nor where it was drawn back.
    /// What is done at a stop there is not known: it may switch the process off, or on.
    fn is_on_part(&self, index: u32) -> bool {
        let is_approach = || self.is_alone(index) && self.comes_by_air(index) != Some(false);
        self.meets_part(index) && !is_approach() && !self.is_drawn_back(index)
    }

    /// Whether the tool may meet the part during a motion. What an unknown instruction does is judged by the steps beside it.
    fn meets_part(&self, index: u32) -> bool {
        let motion = &self.listing.motions[index as usize];
        self.is_path(index) || motion.own_reason == Some(Reason::Probe)
    }

    /// Whether a motion is a cut by itself.
    fn is_alone(&self, index: u32) -> bool {
        self.cuts.root(index).is_some_and(|root| self.motions_of(root).len() == 1)
    }

    /// Whether only air moves, and lines that draw the tool back, lead to where a motion begins; `None` where nothing is known to.
    fn comes_by_air(&self, index: u32) -> Option<bool> {
        let mut by_air = None;
        self.starts.each(index, |start| {
            let is_air = !self.meets_part(start) || self.is_drawn_back(start);
            by_air = Some(by_air.unwrap_or(true) && is_air);
        });
        by_air
    }

    /// Whether a line draws the tool back from wherever it may begin.
    fn is_drawn_back(&self, index: u32) -> bool {
        let mut all = None;
        self.starts.each(index, |start| all = Some(all.unwrap_or(true) && self.draws_back(start, index)));
        all == Some(true)
    }

    /// Whether a line leads the tool straight forwards along its own axis.
    fn draws_near(&self, start: u32, index: u32) -> bool {
        self.along_tool_mm(start, index).is_some_and(|mm| mm >= DRAWN_BACK_MM)
    }

    /// Whether a line draws the tool straight back along its own axis.
    fn draws_back(&self, start: u32, index: u32) -> bool {
        self.along_tool_mm(start, index).is_some_and(|mm| mm <= -DRAWN_BACK_MM)
    }

    /// How far a line leads along the axis of the tool (mm); `None` where it does not, or that is unknown.
    fn along_tool_mm(&self, start: u32, index: u32) -> Option<f64> {
        let [from, to] = [start, index].map(|index| &self.listing.motions[index as usize]);
        let end = |motion: &Motion| Some((motion.cartesian_end()?.pose(), motion.work_object?, motion.tool?));
        let ((from, object, tool), (end, same_object, same_tool)) = (end(from)?, end(to)?);
        let way = end.translation.vector - from.translation.vector;
        let along = way.dot(&(from.rotation * nalgebra::Vector3::z()));
        let is_straight = to.kind == MotionKind::Linear
            && (object, tool) == (same_object, same_tool)
            && along.abs() >= ALONG_TOOL * way.norm();
        is_straight.then_some(along)
    }
}

/// Passes over a program in search of starts that are refused; what is left over, the next round of the planner finds.
const PASSES: usize = 4;

/// A tool that is drawn back by this much no longer cuts (mm).
const DRAWN_BACK_MM: f64 = 5.0;

/// Cosine of the largest angle between the axis of the tool and a way along it.
const ALONG_TOOL: f64 = 0.95;
