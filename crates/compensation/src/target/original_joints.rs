//! Joints of the original program at every target.
//!
//! A target whose configuration the controller checks determines its joints on its own; one with an unchecked configuration
//! is reached from the previous motion. Consecutive targets are solved together, so that the kinematics runs in lanes; runs
//! are split by count alone, so the result does not depend on the number of threads.

use std::ops::Range;

use rayon::prelude::*;

use crate::arms::Arms;
use crate::configuration::{configured, monitored};
use crate::frames::frame_table::FrameTable;
use crate::plan::reason::OutcomeReason;
use crate::risk::placement::AssessedTarget;
use crate::search_budget;
use crate::target::intended_pose::IntendedPose;
use crate::target::target_ranges::TargetRanges;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionKind, MotionTarget, RobTarget, Switch, TargetValue};

/// Targets that are followed in one run: the first one has no seed and costs as much as hundreds of others.
const STRETCH: usize = 4096;

/// A target and its motion.
#[derive(Clone, Copy)]
pub(crate) struct TargetRef<'a> {
    pub(crate) index: u32,
    pub(crate) motion: &'a Motion,
    pub(crate) target: &'a MotionTarget,
}

/// Intended pose of a target, and the joints of the original program.
#[derive(Clone)]
pub(crate) struct OriginalTarget<'a> {
    pub(crate) frames_index: usize,
    pub(crate) intended: IntendedPose<'a>,
    pub(crate) joints: Joints,
    /// Branch of the arm.
    pub(crate) cfx: i32,
    /// [`SolvedTarget::margins`](crate::target::solved_target::SolvedTarget::margins) of the original joints.
    pub(crate) margins: [f64; 3],
    pub(crate) guess: BranchGuess,
}

/// Whether the branch of joints is guessed: where no configuration is checked, the controller selects the solution nearest to
/// the current joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BranchGuess {
    /// The program determines them.
    Known,
    /// The current joints are unknown, and there are several solutions.
    Guessed,
    /// Reached, unchecked, from joints that were guessed.
    Inherited,
}

/// Joints from which the next target is reached.
#[derive(Clone, Copy, PartialEq)]
struct ReferenceJoints {
    joints: Joints,
    /// Whether they are guessed.
    guessed: bool,
}

impl ReferenceJoints {
    fn of(start: &OriginalTarget<'_>) -> Self {
        ReferenceJoints { joints: start.joints, guessed: start.guess != BranchGuess::Known }
    }

    /// The guess that the next target inherits.
    fn guess(&self, monitored: Switch) -> BranchGuess {
        if self.guessed && monitored == Switch::Off { BranchGuess::Inherited } else { BranchGuess::Known }
    }
}

/// The original program: the joints at each target.
pub(crate) struct OriginalProgram<'a> {
    pub(crate) ranges: TargetRanges,
    pub(crate) target_refs: Vec<TargetRef<'a>>,
    pub(crate) originals: Originals<'a>,
}

impl<'a> OriginalProgram<'a> {
    pub(crate) fn of(listing: &'a Listing, arms: &Arms<'_>, frame_table: &FrameTable) -> Self {
        let mut first: Vec<u32> = Vec::with_capacity(listing.motions.len() + 1);
        let mut target_refs: Vec<TargetRef<'_>> = Vec::with_capacity(listing.motions.len());
        for (index, motion) in (0..).zip(&listing.motions) {
            first.push(target_refs.len() as u32);
            if motion.own_reason.is_none() {
                target_refs.extend(motion.targets.iter().map(|target| TargetRef { index, motion, target }));
            }
        }
        first.push(target_refs.len() as u32);
        let ranges = TargetRanges::of(first);
        let originals = originals(listing, &ranges, &target_refs, arms, frame_table);
        Self { ranges, target_refs, originals }
    }

    /// Whether the end of a motion is known.
    pub(crate) fn knows(&self, motion: usize) -> bool {
        self.end(motion).is_some()
    }

    /// The end of a motion under a condition.
    pub(crate) fn commanded(&self, motion: u32, condition_index: usize) -> Option<AssessedTarget> {
        let OriginalTarget { frames_index, intended, joints, .. } = self.end(motion as usize)?;
        let (frames_index, intended, joints) = (*frames_index, intended.pose(), *joints);
        Some(AssessedTarget { frames_index, intended, joints, condition_index })
    }

    fn end(&self, motion: usize) -> Option<&OriginalTarget<'a>> {
        self.originals[self.ranges.of_motion(motion)].last()?.as_ref().ok()
    }
}

pub(crate) type Originals<'a> = Vec<Result<OriginalTarget<'a>, OutcomeReason>>;

/// The joints of the original program: first the targets with a checked configuration, then those that are reached from the
/// previous motion.
fn originals<'a>(
    listing: &Listing,
    ranges: &TargetRanges,
    target_refs: &[TargetRef<'a>],
    arms: &Arms<'_>,
    frame_table: &FrameTable,
) -> Originals<'a> {
    let depends = |target_refs: &TargetRef<'_>| monitored(target_refs.motion) == Switch::Off;
    // Placeholder for targets that depend on the previous motion.
    let mut out: Originals<'a> = target_refs.par_iter().map(|_| Err(OutcomeReason::JointTarget)).collect();
    let stretches = target_refs.len().div_ceil(STRETCH);
    let each = out.par_chunks_mut(STRETCH).zip(target_refs.par_chunks(STRETCH)).enumerate();
    each.for_each(|(stretch, (mut out, target_refs))| {
        let mut near = None;
        let mut budget = SearchBudget::of(search_budget::STARTS).share(stretch, stretches);
        for run in target_refs.chunk_by(|a, b| depends(a) == depends(b)) {
            let (here, rest) = out.split_at_mut(run.len());
            out = rest;
            if !depends(&run[0]) {
                solve_run(run, &mut near, arms, frame_table, &mut budget, here);
            }
        }
    });
    // Now the targets that depend on the previous motion, in order; a run consists of consecutive motions
    // of the listing.
    let mut budget = SearchBudget::of(search_budget::STARTS);
    let monitors: Vec<Switch> =
        listing.motions.par_iter().with_min_len(search_budget::MANY_MOTIONS).map(monitored).collect();
    let chains = chains(listing, &monitors);
    let mut waiting = Vec::new();
    for (at, chain) in chains.iter().enumerate() {
        let start = Start::of(listing, chain.start, ranges, &out);
        if start == Start::Waits {
            waiting.push(at);
        }
        let run = ranges.of_motions(chain.clone());
        let mut near = start.joints();
        solve_run(&target_refs[run.clone()], &mut near, arms, frame_table, &mut budget, &mut out[run]);
    }
    // Chains that begin where the program branches or calls, once the joints at one of the motions before are known: whether those at
    // the others lead to the same is seen below. The chains behind them follow.
    for _ in 0..MAX_ROUNDS {
        let (mut changed, mut still_waiting) = (false, Vec::new());
        for at in std::mem::take(&mut waiting) {
            let chain = &chains[at];
            let start = Start::of(listing, chain.start, ranges, &out);
            let Start::At(near) = start else {
                still_waiting.push(at);
                continue;
            };
            changed = true;
            let mut near = Some(near);
            for chain in std::iter::once(chain).chain(following(listing, &chains, at)) {
                let run = ranges.of_motions(chain.clone());
                if chain.start != chains[at].start {
                    near = Start::of(listing, chain.start, ranges, &out).joints();
                }
                solve_run(
                    &target_refs[run.clone()],
                    &mut near,
                    arms,
                    frame_table,
                    &mut budget,
                    &mut out[run],
                );
            }
        }
        waiting = still_waiting;
        if !changed {
            break;
        }
    }
    while guess_if_possibly_unmonitored(listing, &monitors, target_refs, ranges, arms, frame_table, &mut out)
    {
    }
    out
}

/// Most times that chains wait for the joints before them.
const MAX_ROUNDS: usize = 16;

/// Consecutive motions whose configuration is not monitored, each reached from the one before it.
fn chains(listing: &Listing, monitors: &[Switch]) -> Vec<Range<usize>> {
    let chained = |m: usize| monitors[m] == Switch::Off && listing.motions[m].own_reason.is_none();
    let mut out = Vec::new();
    let mut motion = 0;
    while motion < listing.motions.len() {
        if !chained(motion) {
            motion += 1;
            continue;
        }
        let mut end = motion + 1;
        while end < listing.motions.len()
            && chained(end)
            && listing.motions[end].previous == Some(end as u32 - 1)
            && end - motion < STRETCH
        {
            end += 1;
        }
        out.push(motion..end);
        motion = end;
    }
    out
}

/// The chains that go on from one without a branch: longer ones are cut into stretches.
fn following<'c>(
    listing: &'c Listing,
    chains: &'c [Range<usize>],
    at: usize,
) -> impl Iterator<Item = &'c Range<usize>> {
    let pairs = chains[at..].windows(2);
    pairs
        .take_while(|pair| listing.motions[pair[1].start].previous == Some(pair[0].end as u32 - 1))
        .map(|pair| &pair[1])
}

/// Where a chain begins.
#[derive(Clone, Copy, PartialEq)]
enum Start {
    At(ReferenceJoints),
    /// Where one of the motions before it ends, none of which is known yet.
    Waits,
    Unknown,
}

impl Start {
    fn of(listing: &Listing, motion: usize, ranges: &TargetRanges, out: &Originals<'_>) -> Self {
        let end = |motion: u32| {
            let reached = &out[ranges.of_motion(motion as usize)];
            reached.last().and_then(|start| start.as_ref().ok().map(ReferenceJoints::of))
        };
        if let Some(previous) = listing.motions[motion].previous {
            return end(previous).map_or(Self::Unknown, Self::At);
        }
        match listing.predecessors.get(&(motion as u32)) {
            Some(before) => {
                let known = before.iter().filter_map(|before| end(*before)).find(|end| !end.guessed);
                known.map_or(Self::Waits, Self::At)
            }
            None => Self::Unknown,
        }
    }

    fn joints(self) -> Option<ReferenceJoints> {
        match self {
            Self::At(near) => Some(near),
            Self::Waits | Self::Unknown => None,
        }
    }
}

/// Where the configuration may or may not be checked, depending on the execution path, the branch counts as guessed as if
/// unchecked: from an unknown start, from one that is guessed itself, where an unchecked motion ends at other joints, or where its way
/// passes a singularity; and where a joint motion that is not checked keeps its branch though another one is nearer. So it does where the
/// program branches and the motions before lead to different joints. What follows unchecked inherits the guess. Whether anything became
/// a guess.
fn guess_if_possibly_unmonitored(
    listing: &Listing,
    monitors: &[Switch],
    target_refs: &[TargetRef<'_>],
    ranges: &TargetRanges,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
    out: &mut Originals<'_>,
) -> bool {
    let mut changed = false;
    for (index, monitored) in monitors.iter().enumerate() {
        let motion = &listing.motions[index];
        if *monitored == Switch::On || motion.own_reason.is_some() {
            continue;
        }
        let from = |previous: Option<u32>| {
            let before = previous.map(|previous| out[ranges.of_motion(previous as usize)].last());
            match (before, monitored) {
                (Some(Some(Ok(start))), _) if start.guess != BranchGuess::Known => {
                    Some(BranchGuess::Inherited)
                }
                (Some(Some(Ok(start))), _)
                    if passes_singularity(motion, start, &out[ranges.of_motion(index)]) =>
                {
                    Some(BranchGuess::Guessed)
                }
                (Some(Some(Ok(start))), Switch::Off)
                    if motion.kind == MotionKind::Joint
                        && ranges.of_motion(index).any(|at| {
                            let target = &target_refs[at];
                            out[at].as_ref().is_ok_and(|here| {
                                is_other_branch_nearer(start, here, target, arms, frame_table)
                            })
                        }) =>
                {
                    Some(BranchGuess::Guessed)
                }
                // Unchecked in any case: its own search has looked at its start, which was not yet known to be a guess.
                (_, Switch::Off) if !listing.predecessors.contains_key(&(index as u32)) => None,
                (Some(Some(Ok(start))), _) => {
                    let here = ranges.of_motion(index);
                    let same = same_unchecked(
                        &start.joints,
                        &target_refs[here.clone()],
                        &out[here],
                        arms,
                        frame_table,
                    );
                    (!same).then_some(BranchGuess::Guessed)
                }
                _ => Some(BranchGuess::Guessed),
            }
        };
        // Where it is open whether the configuration is checked, a later cycle may arrive in another arm: without a single motion before it
        // the branch is a guess.
        let is_unchecked = *monitored == Switch::Off && motion.previous.is_none();
        let before = listing.predecessors.get(&(index as u32)).filter(|_| is_unchecked);
        let guess = match before {
            Some(before) => before.iter().find_map(|before| from(Some(*before))),
            None => from(motion.previous),
        };
        let Some(guess) = guess else { continue };
        for at in ranges.of_motion(index) {
            let several = || {
                CommandedFlange::of(&target_refs[at], frame_table)
                    .is_some_and(|commanded| arms.nominal.all(&commanded.flange).len() > 1)
            };
            if let Ok(here) = &mut out[at]
                && (*monitored == Switch::Either || here.guess == BranchGuess::Known)
                && here.guess != guess
                && several()
            {
                changed |= here.guess == BranchGuess::Known;
                here.guess = guess;
            }
        }
    }
    changed
}

/// Shortest joint motion for which another branch can be nearer (rad): the wrist that is turned over stands half a turn away.
const OTHER_BRANCH_RAD: f64 = 1.2;

/// Whether another solution is nearer to the start of a joint motion (by its largest joint difference) than the one in the branch of the
/// start, with which the original joints go on. Makers say that the nearest one is taken, and not how near is measured.
fn is_other_branch_nearer(
    start: &OriginalTarget<'_>,
    here: &OriginalTarget<'_>,
    target: &TargetRef<'_>,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
) -> bool {
    let farthest = (here.joints - start.joints).amax();
    let nearer = |joints: &Joints| (joints - start.joints).amax() < farthest - SAME_JOINTS_RAD;
    farthest > OTHER_BRANCH_RAD
        && CommandedFlange::of(target, frame_table).is_some_and(|commanded| {
            arms.nominal.all(&commanded.flange).iter().any(|solution| nearer(&solution.joints))
        })
}

/// Whether a line or arc ends in another branch than it starts in: joints that follow the path pass a singularity there, and where no
/// configuration is checked, on which side they leave it is open, whatever solution is nearest to the start.
fn passes_singularity(
    motion: &Motion,
    start: &OriginalTarget<'_>,
    here: &[Result<OriginalTarget<'_>, OutcomeReason>],
) -> bool {
    matches!(motion.kind, MotionKind::Linear | MotionKind::Circular)
        && here.iter().flatten().any(|target| target.cfx != start.cfx)
}

/// Whether a controller that does not check configurations takes the same joints at all targets of a motion that starts at these.
fn same_unchecked(
    start: &Joints,
    target_refs: &[TargetRef<'_>],
    checked: &[Result<OriginalTarget<'_>, OutcomeReason>],
    arms: &Arms<'_>,
    frame_table: &FrameTable,
) -> bool {
    let mut near = *start;
    target_refs.iter().zip(checked).all(|(target, checked)| {
        let (Some(commanded), Ok(checked)) = (CommandedFlange::of(target, frame_table), checked) else {
            return true;
        };
        let unchecked =
            configured(&arms.nominal, &commanded.flange, commanded.target, Switch::Off, Some(&near));
        near = checked.joints;
        unchecked.is_ok_and(|joints| (joints - checked.joints).amax() < SAME_JOINTS_RAD)
    })
}

/// Solutions of one target closer than this are the same (rad).
const SAME_JOINTS_RAD: f64 = 1e-6;

/// Shortest and longest run of targets solved together.
const RUNS: [usize; 2] = [8, 64];

/// Original joints of consecutive targets. `near`: the joints from which the first one is reached, if known; updated to those
/// of the last. `budget`: for targets that need a search.
fn solve_run<'a>(
    target_refs: &[TargetRef<'a>],
    near: &mut Option<ReferenceJoints>,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
    budget: &mut SearchBudget,
    out: &mut [Result<OriginalTarget<'a>, OutcomeReason>],
) {
    let mut at = 0;
    let mut run = RUNS[0];
    while at < target_refs.len() {
        let here = &target_refs[at..(at + run).min(target_refs.len())];
        let whole = match near {
            Some(last) => {
                let cartesian: Vec<CommandedFlange<'a>> = here
                    .iter()
                    .map_while(|target_refs| CommandedFlange::of(target_refs, frame_table))
                    .collect();
                let taken = follow_seed(&cartesian, last, arms, &mut out[at..]);
                at += taken;
                taken == here.len()
            }
            None => false,
        };
        if whole {
            run = (2 * run).min(RUNS[1]);
            continue;
        }
        run = RUNS[0];
        if at < target_refs.len() {
            let start = with_budget(budget, || start(&target_refs[at], near.as_ref(), arms, frame_table));
            match &start {
                Ok(start) => *near = Some(ReferenceJoints::of(start)),
                // The target after an unreachable one has no known start.
                Err(_) if monitored(target_refs[at].motion) == Switch::Off => *near = None,
                Err(_) => {}
            }
            out[at] = start;
            at += 1;
        }
    }
}

/// A Cartesian target with the flange pose that the controller computes.
struct CommandedFlange<'a> {
    target: &'a RobTarget,
    monitored: Switch,
    frames_index: usize,
    flange: Pose,
}

impl<'a> CommandedFlange<'a> {
    fn of(target_refs: &TargetRef<'a>, frame_table: &FrameTable) -> Option<Self> {
        let Ok(TargetValue::Cartesian(target)) = &target_refs.target.value else { return None };
        let frames_index = frame_table.of_motion(target_refs.motion).ok()?;
        if frame_table.moving_base(target).is_some() {
            return None;
        }
        let flange = frame_table.list[frames_index].commanded.flange_for(&target.pose());
        Some(Self { target, monitored: monitored(target_refs.motion), frames_index, flange })
    }
}

fn wanted(target: &RobTarget) -> Configuration {
    let [cf1, cf4, cf6, cfx] = target.conf;
    Configuration { cf1, cf4, cf6, cfx }
}

/// Follows targets from `last` as far as each is reached in its stated configuration; returns their number and leaves `last`
/// at the last of them.
fn follow_seed<'a>(
    commanded: &[CommandedFlange<'a>],
    last: &mut ReferenceJoints,
    arms: &Arms<'_>,
    out: &mut [Result<OriginalTarget<'a>, OutcomeReason>],
) -> usize {
    if commanded.is_empty() {
        return 0;
    }
    let flanges: Vec<Pose> = commanded.iter().map(|t| t.flange).collect();
    let mut taken = 0;
    // A target that needs a search is solved on its own.
    for (commanded, reached) in commanded.iter().zip(arms.nominal.solve_path_prefix(&flanges, &last.joints)) {
        if commanded.monitored != Switch::Off && !reached.matches_exactly(&wanted(commanded.target)) {
            break;
        }
        let (joints, cfx, margins) = (reached.joints, reached.configuration.cfx, reached.margins());
        let guess = last.guess(commanded.monitored);
        let start = OriginalTarget {
            frames_index: commanded.frames_index,
            intended: IntendedPose::Stated(commanded.target),
            joints,
            cfx,
            margins,
            guess,
        };
        *last = ReferenceJoints::of(&start);
        out[taken] = Ok(start);
        taken += 1;
    }
    taken
}

/// Solves one target on its own.
fn start<'a>(
    target_refs: &TargetRef<'a>,
    near: Option<&ReferenceJoints>,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
) -> Result<OriginalTarget<'a>, OutcomeReason> {
    let value = target_refs.target.value.as_ref().map_err(|reason| OutcomeReason::Program(*reason))?;
    let frames_index = frame_table.of_motion(target_refs.motion)?;
    let commanded = &frame_table.list[frames_index].commanded;
    match value {
        TargetValue::Cartesian(t) => {
            if let Some(why) = frame_table.moving_base(t) {
                return Err(why);
            }
            let flange = commanded.flange_for(&t.pose());
            let monitored = monitored(target_refs.motion);
            let from = near.map(|near| &near.joints);
            let joints = frame_table.joints(target_refs.motion, t, &flange, &arms.nominal, from)?;
            let cfx = arms.nominal.configuration(&joints).cfx;
            let guess = match near {
                Some(near) => near.guess(monitored),
                None if frame_table.knows_start(target_refs.motion) => BranchGuess::Known,
                None if monitored == Switch::Off && arms.nominal.all(&flange).len() > 1 => {
                    BranchGuess::Guessed
                }
                None => BranchGuess::Known,
            };
            let margins = arms.nominal.branch_margins(&joints);
            let intended = IntendedPose::Stated(t);
            Ok(OriginalTarget { frames_index, intended, joints, cfx, margins, guess })
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            let nominal = arms.nominal.arm();
            if let Some(what) = nominal.model.limits.violated(&joints) {
                return Err(OutcomeReason::OutsideLimits { what });
            }
            let intended = IntendedPose::Computed(Box::new(commanded.target_of(&nominal.forward(&joints))));
            let cfx = arms.nominal.configuration(&joints).cfx;
            let margins = arms.nominal.branch_margins(&joints);
            Ok(OriginalTarget { frames_index, intended, joints, cfx, margins, guess: BranchGuess::Known })
        }
    }
}
