//! Cuts: motions that run into each other at process speed, corrected as a whole or not at all.
//!
//! A cut goes from one air move (MoveJ, MoveAbsJ, G0), stop (zone `fine`) or change of tool, work object or frame to the
//! next. Where one of its motions stays as it is and its neighbours were moved, the tool would step by the whole
//! correction in the middle of the part.
//!
//! Which motion runs into which: the one that the text tells to run before ([`Motion::previous`]); and, since loops,
//! branches and labels leave that open, the one that stands before it in the same routine. So branches that exclude each
//! other are one cut, which refuses too much rather than too little. A call of a routine that several others call too
//! parts a cut; so do instructions whose path is not in the text (calls with targets, cycles), since the motions behind
//! them are cuts of their own.

use crate::deviation::Status;
use crate::plan::reason::OutcomeReason;
use truegrind_programs::motion::{Listing, Motion, MotionKind, Reason};

/// What becomes of a cut of which not every motion can be corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Cuts {
    /// It stays as it is, as a whole.
    #[default]
    Whole,
    /// What can be corrected is, but for steps between neighbours that are larger than the tolerance.
    Partial,
    /// Each motion is judged by itself: for experiments, never for a program that shall run.
    Single,
}

/// The cut that each motion belongs to, as the index of one of its motions, and which motions run into each other.
pub(crate) struct CutsOf {
    /// By motion; `None` outside cuts.
    of: Vec<Option<u32>>,
    /// Pairs of motions of one cut, the second starting where the first ends.
    runs_into: Vec<(u32, u32)>,
}

impl CutsOf {
    /// The cut of a motion, as the index of one of its motions; `None` outside cuts.
    pub(crate) fn root(&self, motion: u32) -> Option<u32> {
        self.of[motion as usize]
    }
}

/// The cuts of a listing.
pub(crate) fn of(listing: &Listing) -> CutsOf {
    let motions = &listing.motions;
    let mut root: Vec<u32> = (0..motions.len() as u32).collect();
    let mut runs_into = Vec::new();
    for (index, motion) in (0_u32..).zip(motions) {
        let stands_before = index.checked_sub(1).filter(|before| {
            let before = &motions[*before as usize];
            before.place.file == motion.place.file && before.routine == motion.routine
        });
        let mut starts: Vec<u32> = motion.previous.into_iter().collect();
        if motion.previous.is_none() {
            starts.extend(stands_before);
        }
        for start in starts {
            if one_cut(&motions[start as usize], motion, listing) {
                runs_into.push((start, index));
                let (a, b) = (find(&mut root, start), find(&mut root, index));
                root[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let of =
        (0_u32..).zip(motions).map(|(index, motion)| cuts(motion).then(|| find(&mut root, index))).collect();
    CutsOf { of, runs_into }
}

/// The representative of a motion's cut; the way to it is halved as it is walked.
fn find(root: &mut [u32], mut index: u32) -> u32 {
    while root[index as usize] != index {
        root[index as usize] = root[root[index as usize] as usize];
        index = root[index as usize];
    }
    index
}

/// Whether the tool may cut on the way to the end of a motion.
fn cuts(motion: &Motion) -> bool {
    let path = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular)
        // A path that is in the text though it is not made of lines and arcs, or an instruction that nobody knows.
        || matches!(motion.left, Some(Reason::UnsupportedPath | Reason::UnknownInstruction | Reason::NoMotionCode));
    // A search ends, and stands, where its signal comes.
    path && motion.left != Some(Reason::Probe) && !motion.instruction.contains("Search")
}

/// Whether a motion goes on, without a stop, in the cut of the one before it.
fn one_cut(before: &Motion, motion: &Motion, listing: &Listing) -> bool {
    let stops = listing.zone(before).is_some_and(|zone| zone.value.as_ref().is_ok_and(|zone| zone.fine));
    cuts(before)
        && cuts(motion)
        && !stops
        && before.tool == motion.tool
        && before.work_object == motion.work_object
}

/// Why a motion stays as it is, with the status it has for that.
type Obstacle<'a> = &'a dyn Fn(u32) -> Option<(Status, OutcomeReason)>;

/// The motions that could be corrected but stay with the rest of their cut.
pub(crate) fn rest_of_cuts(
    listing: &Listing,
    cuts: &CutsOf,
    blocking_reason: Obstacle<'_>,
) -> Vec<(u32, OutcomeReason)> {
    // The first motion of each cut that stays for a reason of its own.
    let mut cause: Vec<Option<OutcomeReason>> = vec![None; cuts.of.len()];
    for (index, cut) in (0_u32..).zip(&cuts.of) {
        let Some(cut) = cut.map(|cut| cut as usize) else { continue };
        if cause[cut].is_none()
            && let Some((_, why)) = blocking_reason(index)
        {
            let line = listing.motions[index as usize].place.line;
            cause[cut] = Some(OutcomeReason::PartOfCut { line, because: why.kind() });
        }
    }
    (0_u32..)
        .zip(&cuts.of)
        .filter_map(|(index, cut)| Some((index, cause[(*cut)? as usize]?)))
        .filter(|(index, _)| blocking_reason(*index).is_none())
        .collect()
}

/// The motions that must not be corrected since the one that they run into, or that runs into them, is not: the step
/// between them, which is the whole correction (`shift_mm`), would exceed `tolerance_mm`. What stays for this makes its
/// own neighbours stay in turn.
pub(crate) fn steps(
    listing: &Listing,
    cuts: &CutsOf,
    blocking_reason: Obstacle<'_>,
    tolerance_mm: f64,
    shift_mm: &dyn Fn(u32) -> f64,
) -> Vec<(u32, OutcomeReason)> {
    let count = listing.motions.len();
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (a, b) in &cuts.runs_into {
        neighbours[*a as usize].push(*b);
        neighbours[*b as usize].push(*a);
    }
    let mut stays: Vec<bool> = (0..count as u32).map(|index| blocking_reason(index).is_some()).collect();
    let mut open: Vec<u32> = (0..count as u32).filter(|index| stays[*index as usize]).collect();
    let mut out = Vec::new();
    while let Some(index) = open.pop() {
        for beside in std::mem::take(&mut neighbours[index as usize]) {
            let mm = shift_mm(beside);
            if !stays[beside as usize] && !(mm <= tolerance_mm) {
                let line = listing.motions[index as usize].place.line;
                out.push((beside, OutcomeReason::Step { line, mm }));
                stays[beside as usize] = true;
                open.push(beside);
            }
        }
    }
    out
}
