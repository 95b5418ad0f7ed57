//! Cuts: sequences of motions at process speed without a stop, corrected as a whole or not at all.
//!
//! A cut extends from one air move (MoveJ, MoveAbsJ, G0), stop (zone `fine`) or change of tool to the next; through another work object if
//! that is placed as one with it. If one of its motions remained unmodified beside corrected neighbours, the tool would step by the whole correction
//! in the middle of the part.
//!
//! Predecessor of a motion: the one that the text executes before it ([`Motion::previous`]) and, where loops, branches and
//! labels leave that open, the preceding one in the same routine. Mutually exclusive branches therefore form one cut, which
//! refuses too much rather than too little. A cut extends into a called routine or subprogram and out of it ([`Listing::across_calls`]),
//! so that the cuts of all callers may be one. Instructions whose path is not in the text (calls with targets, cycles) separate cuts, since the
//! motions after them belong to other cuts.

use rayon::prelude::*;

use crate::deviation::MotionStatus;
use crate::plan::reason::OutcomeReason;
use crate::search_budget::MANY_MOTIONS;
use truegrind_programs::motion::{Listing, Motion, MotionKind, Reason};

/// Treatment of a cut in which some motion cannot be corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Cuts {
    /// The whole cut remains unmodified.
    #[default]
    Whole,
    /// Every motion that can be corrected is, unless the step to an unmodified neighbour exceeds the tolerance.
    Partial,
    /// Each motion is judged on its own: for experiments, never for a program that will run.
    Single,
}

/// The cut of each motion, as the index of a representative motion, and which motions follow each other.
pub(crate) struct CutsOf {
    /// By motion; `None` outside cuts.
    of: Vec<Option<u32>>,
    /// The same without regard to stops.
    path_of: Vec<Option<u32>>,
    /// Consecutive motions of one cut: the second starts where the first ends. Only for [`Cuts::Partial`].
    runs_into: Vec<(u32, u32)>,
}

impl CutsOf {
    /// Representative motion of a motion's cut; `None` outside cuts.
    pub(crate) fn root(&self, motion: u32) -> Option<u32> {
        self.of[motion as usize]
    }

    /// Representative motion of the path on which a motion's cut lies: from one air move to the next, through stops, at which the tool
    /// stays on the part. A line between two stops begins where the one before it ends, so that they are worth correcting together.
    pub(crate) fn path(&self, motion: u32) -> Option<u32> {
        self.path_of[motion as usize]
    }
}

/// The cuts of a listing. `part_of`: for each work object the first of those that are placed as one with it.
pub(crate) fn of(listing: &Listing, treatment: Cuts, part_of: &[u32]) -> CutsOf {
    let motions = &listing.motions;
    let may_cut: Vec<bool> = motions.par_iter().with_min_len(MANY_MOTIONS).map(may_cut).collect();
    let is_one_path = |start: u32, index: u32| {
        let [before, motion] = [start, index].map(|index| &motions[index as usize]);
        may_cut[start as usize]
            && may_cut[index as usize]
            && (listing.may_share_frames(before, motion) || is_one_part(before, motion, part_of))
    };
    // The motion that each one goes on from, if they belong to one path.
    let starts: Vec<Option<u32>> = motions
        .par_iter()
        .with_min_len(MANY_MOTIONS)
        .enumerate()
        .map(|(index, motion)| {
            let stands_before = || {
                let before = index.checked_sub(1)?;
                is_in_text(&motions[before], motion).then_some(before as u32)
            };
            let start = motion.previous.or_else(stands_before)?;
            is_one_path(start, index as u32).then_some(start)
        })
        .collect();
    let mut root: Vec<u32> = (0..motions.len() as u32).collect();
    let mut path_root = root.clone();
    let mut runs_into = Vec::new();
    let across_calls = listing.across_calls.iter().filter(|[start, index]| is_one_path(*start, *index));
    let in_text = (0_u32..).zip(starts).filter_map(|(index, start)| Some([start?, index]));
    for [start, index] in in_text.chain(across_calls.copied()) {
        unite(&mut path_root, start, index);
        if stops(&motions[start as usize], listing) {
            continue;
        }
        if treatment == Cuts::Partial {
            runs_into.push((start, index));
        }
        unite(&mut root, start, index);
    }
    let of_all = |mut root: Vec<u32>| {
        let all = (0_u32..).zip(&may_cut);
        all.map(|(index, may_cut)| may_cut.then(|| find(&mut root, index))).collect()
    };
    CutsOf { of: of_all(root), path_of: of_all(path_root), runs_into }
}

/// Whether two motions have one tool and work objects that are placed as one.
pub(crate) fn is_one_part(a: &Motion, b: &Motion, part_of: &[u32]) -> bool {
    let part = |motion: &Motion| motion.work_object.map(|object| part_of[object as usize]);
    a.tool == b.tool && part(a).is_some() && part(a) == part(b)
}

/// Lines and arcs, each with a motion where it may begin: within a path, and where an air move leads to it.
pub(crate) fn joins(listing: &Listing) -> impl Iterator<Item = [u32; 2]> {
    let is_path = |index: u32| {
        let motion = &listing.motions[index as usize];
        matches!(motion.kind, MotionKind::Linear | MotionKind::Circular) && !motion.rapid
    };
    let all = (0..listing.motions.len() as u32).filter(move |index| is_path(*index));
    let in_text = all.flat_map(|index| starts(listing, index).into_iter().map(move |start| [start, index]));
    in_text.chain(listing.across_calls.iter().copied().filter(move |[_, index]| is_path(*index)))
}

/// Joins two sets; the smaller representative represents both.
pub(crate) fn unite(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
}

/// Union-find representative, with path halving.
pub(crate) fn find(root: &mut [u32], mut index: u32) -> u32 {
    while root[index as usize] != index {
        root[index as usize] = root[root[index as usize] as usize];
        index = root[index as usize];
    }
    index
}

/// The motions where one may begin, as far as they are known.
pub(crate) fn starts(listing: &Listing, index: u32) -> Vec<u32> {
    match listing.motions[index as usize].previous {
        Some(previous) => vec![previous],
        None => listing.predecessors.get(&index).cloned().unwrap_or_default(),
    }
}

/// The motion that ends where another begins, in whichever routine; `None` unless it is one.
pub(crate) fn only_start(listing: &Listing, index: usize) -> Option<usize> {
    let only = || match listing.predecessors.get(&(index as u32))?.as_slice() {
        [start] => Some(*start),
        _ => None,
    };
    Some(listing.motions[index].previous.or_else(only)? as usize)
}

/// Where the motions of a program may begin: as [`starts`], across calls and jumps, and where nothing of it is known at the end of the
/// motion before it in the text of its routine.
pub(crate) struct StartsOf<'a> {
    listing: &'a Listing,
    /// The later and the earlier motion, sorted.
    across_calls: Vec<[u32; 2]>,
}

impl<'a> StartsOf<'a> {
    pub(crate) fn of(listing: &'a Listing) -> Self {
        let mut across_calls: Vec<[u32; 2]> = listing.across_calls.iter().map(|[a, b]| [*b, *a]).collect();
        across_calls.sort_unstable();
        Self { listing, across_calls }
    }

    pub(crate) fn each(&self, index: u32, mut of: impl FnMut(u32)) {
        let motion = &self.listing.motions[index as usize];
        let first = self.across_calls.partition_point(|[later, _]| *later < index);
        let across = self.across_calls[first..].iter().take_while(|[later, _]| *later == index);
        let known = self.listing.predecessors.get(&index).filter(|_| motion.previous.is_none());
        let mut any = false;
        let earlier = across.map(|[_, earlier]| *earlier).chain(known.into_iter().flatten().copied());
        for start in earlier.chain(motion.previous) {
            any = true;
            of(start);
        }
        if let Some(before) = index.checked_sub(1).filter(|_| !any)
            && is_in_text(&self.listing.motions[before as usize], motion)
        {
            of(before);
        }
    }
}

/// Whether two neighbours of a listing stand in one routine.
fn is_in_text(before: &Motion, motion: &Motion) -> bool {
    before.place.file == motion.place.file && before.routine == motion.routine
}

/// Whether the tool may cut during a motion.
pub(crate) fn may_cut(motion: &Motion) -> bool {
    let path = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular)
        // A path that is given in the text but consists of neither lines nor arcs, or an unknown
        // instruction.
        || matches!(motion.own_reason, Some(Reason::UnsupportedPath | Reason::RoundedCorner | Reason::UnknownInstruction | Reason::NoMotionCode))
        // After a jump, a call or a label a block without its own G0 or G1 may be either.
        || motion.kind == MotionKind::Unknown && motion.own_reason == Some(Reason::UnknownFlow);
    // A search motion ends, and stops, at its signal.
    path && motion.own_reason != Some(Reason::Probe) && !motion.is_search() && !follows_position(motion)
}

/// Whether a motion is counted from where the robot stands: behind a corrected motion it starts at the corrected place and keeps its shape.
pub(crate) fn follows_position(motion: &Motion) -> bool {
    motion.to().is_some_and(|to| to.value == Err(Reason::CurrentPosition))
}

/// Whether the arm stops at the end of a motion, so that what is cut there may end. The exact stop of an NC program is a property of its corners:
/// there air moves alone end a cut, with or without one.
fn stops(motion: &Motion, listing: &Listing) -> bool {
    !listing.numbered
        && listing.zone(motion).is_some_and(|zone| zone.value.as_ref().is_ok_and(|zone| zone.fine))
}

/// Why a motion remains unmodified, with its status.
pub(crate) type Obstacle<'a> = &'a (dyn Fn(u32) -> Option<(MotionStatus, OutcomeReason)> + Sync);

/// The motions that could be corrected but remain unmodified with the rest of their cut.
pub(crate) fn rest_of_cuts(
    listing: &Listing,
    cuts: &CutsOf,
    blocking_reason: Obstacle<'_>,
) -> Vec<(u32, OutcomeReason)> {
    let motions = (0..cuts.of.len() as u32).into_par_iter().with_min_len(MANY_MOTIONS);
    let blocked: Vec<(u32, u32, OutcomeReason)> =
        motions.filter_map(|index| Some((index, cuts.root(index)?, blocking_reason(index)?.1))).collect();
    if blocked.is_empty() {
        return Vec::new();
    }
    // The first motion of each cut that remains unmodified for its own reason.
    let mut cause: Vec<Option<OutcomeReason>> = vec![None; cuts.of.len()];
    for (index, cut, reason) in &blocked {
        let line = listing.motions[*index as usize].place.line;
        cause[*cut as usize].get_or_insert(OutcomeReason::PartOfCut { line, because: reason.kind() });
    }
    (0_u32..)
        .zip(&cuts.of)
        .filter_map(|(index, cut)| Some((index, cause[(*cut)? as usize]?)))
        .filter(|(index, _)| blocked.binary_search_by_key(index, |(blocked, ..)| *blocked).is_err())
        .collect()
}

/// The motions that must not be corrected because an adjacent one is not: the step between them, the whole correction
/// (`shift_mm`), would exceed `tolerance_mm`. Each such motion pins its own neighbours in turn.
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
    let mut unchanged: Vec<bool> = (0..count as u32).map(|index| blocking_reason(index).is_some()).collect();
    let mut open: Vec<u32> = (0..count as u32).filter(|index| unchanged[*index as usize]).collect();
    let mut out = Vec::new();
    while let Some(index) = open.pop() {
        for neighbour in std::mem::take(&mut neighbours[index as usize]) {
            let mm = shift_mm(neighbour);
            if !unchanged[neighbour as usize] && !(mm <= tolerance_mm) {
                let line = listing.motions[index as usize].place.line;
                out.push((neighbour, OutcomeReason::Step { line, mm }));
                unchanged[neighbour as usize] = true;
                open.push(neighbour);
            }
        }
    }
    out
}
