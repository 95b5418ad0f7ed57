//! Solves every target: the joints that reach the intended pose, and the pose that the controller must be commanded.
//!
//! The original joints are known ([`OriginalProgram`]). From them each target is solved under the condition in which the arm
//! arrives there ([`ArmConditions`](crate::condition::arm_conditions::ArmConditions)), in blocks, so that the kinematics runs
//! in lanes. Blocks are split by count alone, so the result does not depend on the number of threads.
//!
//! With backlash, the sides from which joints arrive follow from the motion, and the corrected motion depends on the sides:
//! both are computed alternately, starting from the sides of the original program, until the sides no longer change. A side
//! that does not converge counts as unknown, and later targets are solved with that.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::arms::Arms;
use crate::backlash::sides::{BacklashSides, JointSides, MotionEnd, ReachedEnd, backlash_sides};
use crate::condition::arm_conditions::select;
use crate::configuration::monitored;
use crate::deviation::Deviation;
use crate::feasibility::correction_bounds::forbidden;
use crate::feasibility::joint_jump::{WrittenTarget, target_fault};
use crate::feasibility::measured_turns::outside_along;
use crate::frames::frame_table::FrameTable;
use crate::options::{Circles, Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::risk::assessment::Assessment;
use crate::search_budget;
use crate::segment::condition_schedule::ConditionSchedule;
use crate::target::at_pole::joints_in_orientation;
use crate::target::original_joints::{BranchGuess, OriginalProgram, OriginalTarget, TargetRef};
use crate::target::solved_target::{SolvedTarget, SolvedTargets, as_joints};
use crate::target::target_ranges::TargetRanges;
use truegrind_arm::estimated::{CarriedFrame, FlangePoint, RegisteredFrame};
use truegrind_arm::inverse::InverseError;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_arm::region::NearestSample;
use truegrind_math::rounding::round;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::Load;
use truegrind_programs::motion::{Listing, MotionKind, RobTarget, Role, Switch, TargetValue};

/// Approximate memory that a chunk keeps (bytes).
const KEPT: usize = 100 << 10;

/// Makes the allocator obtain the memory of a chunk from the system at once. Otherwise it requests each few thousand bytes
/// separately, and every thread waits meanwhile.
pub(crate) fn reserve_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(KEPT)));
}

/// Solves all targets. `stays`: motions that remain unmodified although their targets could be corrected.
pub(crate) fn solve_targets<'a>(
    listing: &Listing,
    program: &OriginalProgram<'a>,
    arms: &mut Arms<'_>,
    frame_table: &FrameTable,
    assessment: &Assessment,
    options: &Options,
    stays: &BTreeMap<u32, OutcomeReason>,
) -> SolvedTargets<'a> {
    let OriginalProgram { ranges, target_refs, originals } = program;
    TargetSolver { listing, ranges, target_refs, originals, frame_table, assessment, options, stays }
        .solve(arms)
}

/// Inputs of the solver. `'t`: the listing's targets.
struct TargetSolver<'a, 't> {
    listing: &'a Listing,
    ranges: &'a TargetRanges,
    target_refs: &'a [TargetRef<'t>],
    originals: &'a [Result<OriginalTarget<'t>, OutcomeReason>],
    frame_table: &'a FrameTable,
    assessment: &'a Assessment,
    options: &'a Options,
    stays: &'a BTreeMap<u32, OutcomeReason>,
}

/// Iterations before a side that still changes counts as unknown.
const ROUNDS: usize = 4;

/// Largest number of iterations.
const MAX_ROUNDS: usize = 24;

impl<'t> TargetSolver<'_, 't> {
    fn solve(self, arms: &mut Arms<'_>) -> SolvedTargets<'t> {
        let count = self.listing.motions.len();
        let loads = arms.loads(self.listing, self.options.loads.as_ref());
        let load = |motion: usize| loads.get(motion).and_then(Option::as_ref);
        if !arms.conditions.has_play() {
            let condition_indices: Vec<usize> = if loads.iter().all(Option::is_none) {
                let only = arms.conditions.condition_index([0; 6], None);
                vec![only; self.target_refs.len()]
            } else {
                let motions = (0..count).flat_map(|m| self.ranges.of_motion(m).map(move |_| m));
                motions.map(|m| arms.conditions.condition_index([0; 6], load(m))).collect()
            };
            let mut targets = self.unsolved();
            self.fill(&mut targets, arms, &condition_indices, &condition_indices, None);
            return self.solved(targets, Vec::new());
        }
        let mut unknown_sides: Vec<[bool; 6]> = vec![[false; 6]; count];
        let as_is = self.sides(arms, None, &unknown_sides);
        let before = self.condition_indices(arms, &as_is, &load);
        let mut sides = as_is;
        let mut condition_indices = before.clone();
        let mut targets = self.unsolved();
        self.fill(&mut targets, arms, &before, &condition_indices, None);
        for round in 1..=MAX_ROUNDS {
            let next = self.sides(arms, Some(&targets), &unknown_sides);
            if round > ROUNDS {
                // A side that still alternates counts as unknown.
                for (unknown_sides, (next, last)) in unknown_sides.iter_mut().zip(next.iter().zip(&sides)) {
                    (0..6).for_each(|j| unknown_sides[j] |= next.end[j] != last.end[j]);
                }
            }
            sides = if round > ROUNDS { self.sides(arms, Some(&targets), &unknown_sides) } else { next };
            let new = self.condition_indices(arms, &sides, &load);
            if new == condition_indices {
                break;
            }
            let stale: Vec<bool> = (0..count)
                .step_by(search_budget::CHUNK)
                .map(|begin| {
                    let targets = self.targets(begin);
                    new[targets.clone()] != condition_indices[targets]
                })
                .collect();
            condition_indices = new;
            self.fill(&mut targets, arms, &before, &condition_indices, Some(&stale));
        }
        let schedules = sides.iter().enumerate().map(|(m, own_sides)| {
            ConditionSchedule::of(own_sides, |sides| arms.conditions.condition_index(sides, load(m)))
        });
        let schedules = schedules.collect();
        self.solved(targets, schedules)
    }

    fn solved(
        &self,
        targets: Vec<Result<SolvedTarget<'t>, OutcomeReason>>,
        schedules: Vec<ConditionSchedule>,
    ) -> SolvedTargets<'t> {
        let unreached = self.unreached(&targets);
        let guessed = self.guessed();
        SolvedTargets {
            forbade: Vec::new(),
            ranges: self.ranges.clone(),
            targets,
            schedules,
            unreached,
            guessed,
        }
    }

    /// Original targets of the motions of which a target failed although all original joints are known.
    fn unreached(
        &self,
        solved: &[Result<SolvedTarget<'t>, OutcomeReason>],
    ) -> BTreeMap<u32, Vec<OriginalTarget<'t>>> {
        let originals = |motion: usize| {
            let targets = self.ranges.of_motion(motion);
            let failed = solved[targets.clone()].iter().any(Result::is_err);
            let originals = || self.originals[targets].iter().cloned().collect::<Result<_, _>>().ok();
            Some((motion as u32, failed.then(originals)??))
        };
        (0..self.listing.motions.len())
            .into_par_iter()
            .with_min_len(search_budget::MANY_MOTIONS)
            .filter_map(originals)
            .collect()
    }

    /// Motions of which a target has a guessed branch.
    fn guessed(&self) -> Vec<u32> {
        let guessed = |m: &usize| {
            self.originals[self.ranges.of_motion(*m)]
                .iter()
                .flatten()
                .any(|original| original.guess == BranchGuess::Guessed)
        };
        let motions =
            (0..self.listing.motions.len()).into_par_iter().with_min_len(search_budget::MANY_MOTIONS);
        motions.filter(guessed).map(|m| m as u32).collect()
    }

    /// The targets of the chunk that begins with a motion.
    fn targets(&self, begin: usize) -> std::ops::Range<usize> {
        self.ranges.of_motions(begin..(begin + search_budget::CHUNK).min(self.listing.motions.len()))
    }

    /// One slot per target.
    fn unsolved(&self) -> Vec<Result<SolvedTarget<'t>, OutcomeReason>> {
        self.target_refs.par_iter().map(|_| Err(UNSOLVED)).collect()
    }

    /// Solves all targets, or only the `stale` chunks; `before`: the conditions of the original program.
    fn fill(
        &self,
        solved: &mut [Result<SolvedTarget<'t>, OutcomeReason>],
        arms: &Arms<'_>,
        before: &[usize],
        condition_indices: &[usize],
        stale: Option<&[bool]>,
    ) {
        let mut rest = solved;
        let mut chunks: Vec<&mut [Result<SolvedTarget<'t>, OutcomeReason>]> = Vec::new();
        for begin in (0..self.listing.motions.len()).step_by(search_budget::CHUNK) {
            let (here, after) = rest.split_at_mut(self.targets(begin).len());
            chunks.push(here);
            rest = after;
        }
        let whole = SearchBudget::of(search_budget::TARGETS);
        search_budget::shared_out_into(whole, &mut chunks, |chunk, solved, budget| {
            if stale.is_some_and(|stale| !stale[chunk]) {
                return;
            }
            reserve_memory();
            let targets = self.targets(chunk * search_budget::CHUNK);
            let condition_indices = [&before[targets.clone()], &condition_indices[targets.clone()]];
            let (target_refs, originals) = (&self.target_refs[targets.clone()], &self.originals[targets]);
            with_budget(budget, || {
                solve_chunk(target_refs, originals, condition_indices, arms, self, solved)
            });
        });
    }

    /// Backlash sides along the program: original, or as corrected so far.
    fn sides(
        &self,
        arms: &Arms<'_>,
        solved: Option<&[Result<SolvedTarget<'t>, OutcomeReason>]>,
        unknown_sides: &[[bool; 6]],
    ) -> Vec<BacklashSides> {
        let motions = &self.listing.motions;
        let stop = |m: usize| {
            let motion = &motions[m];
            if motion.kind == MotionKind::External {
                return MotionEnd::Unmoved;
            }
            let stays = self.stays.contains_key(&(m as u32));
            let rewritten = solved.filter(|_| is_rewritable(motion, self.options) && !stays);
            let targets = self.ranges.of_motion(m);
            let solved = |target: usize| match &rewritten?[target] {
                Ok(solved) if solved.forbidden.is_none() => Some(solved),
                _ => None,
            };
            // A motion with a refused target remains unmodified.
            let changes = targets.clone().all(|target| solved(target).is_some());
            // Commanded pose, and the joints there.
            let at = |target: usize| match solved(target).filter(|_| changes) {
                Some(solved) => {
                    let links = arms.conditions.links(solved.condition_index, &solved.after);
                    Some((solved.frames_index, solved.commanded, solved.after, Some(links)))
                }
                None => self.originals[target]
                    .as_ref()
                    .ok()
                    .map(|s| (s.frames_index, s.intended.pose(), s.joints, None)),
            };
            let role = |target: &usize| self.target_refs[*target].target.role;
            let Some((frames_index, commanded, joints, links)) =
                targets.clone().rev().find(|t| role(t) == Role::To).and_then(at)
            else {
                return MotionEnd::Unknown;
            };
            let via = targets.clone().find(|t| role(t) == Role::Via).and_then(at).map(|via| via.1);
            let straightens = motion.can_straighten && self.options.circles == Circles::Segments;
            let as_joints = changes && motion.to().is_some_and(|to| as_joints(motion, to, self.options.emit));
            let may_insert = motion.insertable || straightens;
            MotionEnd::At(ReachedEnd {
                motion,
                frames_index,
                commanded,
                joints,
                via,
                links,
                as_joints,
                may_insert,
            })
        };
        let stops: Vec<MotionEnd<'_>> = (0..motions.len()).map(stop).collect();
        // Guessed joints may be whole turns off, so the direction from which a joint arrives from them is
        // unknown.
        let guessed = |m: usize| {
            let targets = self.ranges.of_motion(m);
            targets
                .rev()
                .find_map(|t| self.originals[t].as_ref().ok())
                .is_some_and(|s| s.guess != BranchGuess::Known)
        };
        let follows = |m: usize| motions[m].previous.filter(|from| guessed(m) || !guessed(*from as usize));
        let before: Vec<Option<u32>> = (0..motions.len()).map(follows).collect();
        let commanded = |frames_index: usize| self.frame_table.list[frames_index].commanded;
        backlash_sides(&stops, &before, &arms.nominal, &arms.conditions.play_rad, &commanded, unknown_sides)
    }

    /// Condition of each target.
    fn condition_indices<'l>(
        &self,
        arms: &mut Arms<'_>,
        sides: &[BacklashSides],
        load: &dyn Fn(usize) -> Option<&'l Load>,
    ) -> Vec<usize> {
        let mut out = Vec::with_capacity(self.target_refs.len());
        for (m, own_sides) in sides.iter().enumerate() {
            for target in self.ranges.of_motion(m) {
                let sides: JointSides = match self.target_refs[target].target.role {
                    Role::Via => own_sides.via,
                    Role::To => own_sides.end,
                };
                out.push(arms.conditions.condition_index(sides, load(m)));
            }
        }
        out
    }
}

/// What stands for a target that is not solved yet; no target keeps it.
const UNSOLVED: OutcomeReason = OutcomeReason::JointTarget;

/// Solves one chunk of targets into `out`.
fn solve_chunk<'t>(
    target_refs: &[TargetRef<'t>],
    originals: &[Result<OriginalTarget<'t>, OutcomeReason>],
    condition_indices: [&[usize]; 2],
    arms: &Arms<'_>,
    work: &TargetSolver<'_, 't>,
    out: &mut [Result<SolvedTarget<'t>, OutcomeReason>],
) {
    let TargetSolver { frame_table, assessment, options, .. } = *work;
    let conditions = &arms.conditions;
    let waiting = |original: &Result<OriginalTarget<'_>, OutcomeReason>| {
        Err(original.as_ref().err().copied().unwrap_or(UNSOLVED))
    };
    out.iter_mut().zip(originals).for_each(|(out, original)| *out = waiting(original));
    let mut reachable = reachable_targets(originals, condition_indices, arms, frame_table, out);
    if !work.listing.nc.at_poles.is_empty() {
        reachable.retain_mut(|target| match target.keep_words_near(target_refs, arms, work) {
            Ok(()) => true,
            Err(error) => {
                out[target.index] = Err(OutcomeReason::of_inverse(error));
                false
            }
        });
    }
    let joint_form = |w: &ReachableTarget<'_, '_>| {
        as_joints(target_refs[w.index].motion, target_refs[w.index].target, options.emit)
    };
    let ControllerReplay { nominal_flanges, commanded, read_back, branches, last, failed } =
        replay_controller(&reachable, &joint_form, arms, frame_table, options);
    let real = |original: &OriginalTarget<'_>| &frame_table.list[original.frames_index].real;
    let condition_indices: Vec<usize> = reachable.iter().map(|w| w.condition_index).collect();
    let reached_after = conditions.forward(&condition_indices, &last);
    let tools: Vec<Pose> = reachable.iter().map(|w| real(w.original).flange_from_tool(&w.flange)).collect();
    let cut_of = |w: &ReachableTarget<'_, '_>| target_refs[w.index].index;
    let against = |w: &ReachableTarget<'_, '_>| {
        (
            frame_table.list[w.original.frames_index].carried.as_ref().map(RegisteredFrame::carried),
            assessment.registered(cut_of(w), target_refs[w.index].motion.work_object),
        )
    };
    let predicted = sigmas(&reachable, &tools, &against, arms);
    let mut near = NearestSample::default();
    for (k, w) in reachable.iter().enumerate() {
        if let Some(why) = failed[k] {
            out[w.index] = Err(why);
            continue;
        }
        let real = real(w.original);
        let intended = w.intended;
        let reached = [w.reached_before, real.target_of(&reached_after[k])];
        let deviation = |reached: Pose| Deviation::between(&intended, &reached, &Pose::identity(), None);
        let play_uncertainty_mm = conditions.play_uncertainty_mm(w.condition_index, &w.after, &tools[k]);
        let (conf, margins) = branches[k];
        let mut solved = SolvedTarget {
            frames_index: w.original.frames_index,
            intended: w.original.intended.clone(),
            before: w.original.joints,
            after: w.after,
            commanded: commanded[k],
            cfx_before: w.original.cfx,
            conf,
            margins: [w.original.margins, margins],
            deviation_mm: reached.map(|pose| (pose.translation.vector - intended.translation.vector).norm()),
            deviations: options.points.then(|| Box::new(reached.map(deviation))),
            sigma_mm: predicted[k].0.hypot(play_uncertainty_mm),
            shape_sigma_mm: predicted[k]
                .1
                .or_else(|| assessment.sigma_of_cut_mm(cut_of(w)))
                .map(|sigma| sigma.hypot(play_uncertainty_mm))
                .into(),
            play_uncertainty_mm,
            condition_index: w.condition_index,
            guess: w.original.guess,
            outside: arms.knowledge.and_then(|k| outside_along(k, &w.after, &mut near)).map(Box::new),
            forbidden: None,
        };
        let forbidden = forbidden(&solved, w.singularity, arms, options).or_else(|| {
            let frames = &frame_table.list[solved.frames_index].commanded;
            let stated = if joint_form(w) { None } else { stated(&target_refs[w.index]) };
            let (flange, read_back, joints) = (&nominal_flanges[k], &read_back[k], &last[k]);
            let replay = WrittenTarget { frames, flange, read_back, joints, stated };
            target_fault(&solved, w.singularity, &replay, arms, options)
        });
        solved.forbidden = forbidden.map(Box::new);
        out[w.index] = Ok(solved);
    }
}

/// Solves the joints that reach the intended poses; the reason of each failure goes to `out`.
fn reachable_targets<'o, 't>(
    originals: &'o [Result<OriginalTarget<'t>, OutcomeReason>],
    condition_indices: [&[usize]; 2],
    arms: &Arms<'_>,
    frame_table: &FrameTable,
    out: &mut [Result<SolvedTarget<'t>, OutcomeReason>],
) -> Vec<ReachableTarget<'o, 't>> {
    let conditions = &arms.conditions;
    let open: Vec<(usize, &OriginalTarget<'t>)> = originals
        .iter()
        .enumerate()
        .filter_map(|(index, original)| Some((index, original.as_ref().ok()?)))
        .collect();
    let before: Vec<Joints> = open.iter().map(|(_, s)| s.joints).collect();
    let real = |original: &OriginalTarget<'_>| &frame_table.list[original.frames_index].real;
    let intended: Vec<Pose> = open.iter().map(|(_, s)| s.intended.pose()).collect();
    let flanges: Vec<Pose> =
        open.iter().zip(&intended).map(|((_, s), intended)| real(s).flange_for(intended)).collect();
    let [places_before, condition_indices] =
        condition_indices.map(|all| open.iter().map(|(k, _)| all[*k]).collect::<Vec<usize>>());
    let reached_before = conditions.forward(&places_before, &before);
    let solutions = conditions.each(&condition_indices, |condition_index, items| match items {
        None => conditions.inverse(condition_index).solve_offset_seeded(&flanges, &before),
        Some(items) => conditions
            .inverse(condition_index)
            .solve_offset_seeded(&select(&flanges, items), &select(&before, items)),
    });
    let mut reachable: Vec<ReachableTarget<'o, 't>> = Vec::with_capacity(open.len());
    for (k, ((index, original), solution)) in open.iter().zip(solutions).enumerate() {
        match solution {
            Ok(solution) => reachable.push(ReachableTarget {
                index: *index,
                original,
                intended: intended[k],
                condition_index: condition_indices[k],
                flange: flanges[k],
                after: solution.joints,
                singularity: solution.singularity,
                reached_before: real(original).target_of(&reached_before[k]),
            }),
            Err(error) => out[*index] = Err(OutcomeReason::of_inverse(error)),
        }
    }
    reachable
}

/// Commanded poses, and what the controller computes from the rounded numbers.
struct ControllerReplay {
    nominal_flanges: Vec<Pose>,
    commanded: Vec<Pose>,
    /// Flange poses of the rounded numbers.
    read_back: Vec<Pose>,
    /// Configuration and branch margins that the controller computes for them.
    branches: Vec<(Configuration, [f64; 3])>,
    /// Joints that the controller computes for them.
    last: Vec<Joints>,
    failed: Vec<Option<OutcomeReason>>,
}

fn replay_controller(
    reachable: &[ReachableTarget<'_, '_>],
    joint_form: &dyn Fn(&ReachableTarget<'_, '_>) -> bool,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
    options: &Options,
) -> ControllerReplay {
    let after: Vec<Joints> = reachable.iter().map(|w| w.after).collect();
    let nominal_flanges = arms.nominal.arm().forward_many(&after);
    let mounting = |w: &ReachableTarget<'_, '_>| &frame_table.list[w.original.frames_index].commanded;
    let commanded: Vec<Pose> =
        reachable.iter().zip(&nominal_flanges).map(|(w, flange)| mounting(w).target_of(flange)).collect();
    let scale = 10f64.powi(i32::from(options.position_decimals));
    let as_written = |(w, commanded): (&ReachableTarget<'_, '_>, &Pose)| {
        mounting(w).flange_for(&rounded(commanded, scale))
    };
    let read_back: Vec<Pose> = reachable.iter().zip(&commanded).map(as_written).collect();
    let reached = if reachable.iter().all(joint_form) {
        Vec::new()
    } else {
        arms.nominal.solve_seeded_joints(&read_back, &after)
    };
    let mut last: Vec<Joints> = Vec::with_capacity(reachable.len());
    let mut branches = Vec::with_capacity(reachable.len());
    let mut failed: Vec<Option<OutcomeReason>> = vec![None; reachable.len()];
    let of_joints =
        |joints: &Joints| (arms.nominal.configuration(joints), arms.nominal.branch_margins(joints));
    for (k, w) in reachable.iter().enumerate() {
        let (joints, branch) = match reached.get(k).filter(|_| !joint_form(w)) {
            Some(Ok(reached)) => (reached.joints, (reached.configuration, reached.margins())),
            Some(Err(error)) => {
                failed[k] = Some(OutcomeReason::of_inverse(*error));
                (w.after, of_joints(&w.after))
            }
            None => (w.after, of_joints(&w.after)),
        };
        last.push(joints);
        branches.push(branch);
    }
    ControllerReplay { nominal_flanges, commanded, read_back, branches, last, failed }
}

/// Predicted standard deviation of each point (mm) relative to its reference frame, and to the registration of its cut where there is
/// one; zero without a covariance. `against`: both frames.
fn sigmas<'f>(
    reachable: &[ReachableTarget<'_, '_>],
    tools: &[Pose],
    against: &dyn Fn(&ReachableTarget<'_, '_>) -> TargetFrames<'f>,
    arms: &Arms<'_>,
) -> Vec<(f64, Option<f64>)> {
    let Some(knowledge) = arms.knowledge else { return vec![(0.0, None); reachable.len()] };
    let condition_indices: Vec<usize> = reachable.iter().map(|w| w.condition_index).collect();
    let mut points = Vec::with_capacity(reachable.len());
    let mut registered = Vec::with_capacity(reachable.len());
    for (w, tool) in reachable.iter().zip(tools) {
        let (carried, cut) = against(w);
        points.push(FlangePoint { joints: w.after, flange_from_tool: *tool, carried });
        registered.push(cut.map(Some));
    }
    arms.conditions.each(&condition_indices, |condition_index, items| {
        let arm = arms.conditions.arm(condition_index);
        match items {
            None => knowledge.position_sigmas_mm_in_two(arm, &points, &registered),
            Some(items) => {
                let (points, registered) = (select(&points, items), select(&registered, items));
                knowledge.position_sigmas_mm_in_two(arm, &points, &registered)
            }
        }
    })
}

/// The frame that carries a target, and the registration of its cut.
type TargetFrames<'f> = (Option<CarriedFrame<'f>>, Option<CarriedFrame<'f>>);

/// The target, where the controller may use its stated configuration.
fn stated<'a>(target_refs: &TargetRef<'a>) -> Option<&'a RobTarget> {
    let Ok(TargetValue::Cartesian(target)) = &target_refs.target.value else { return None };
    (monitored(target_refs.motion) != Switch::Off).then_some(target)
}

/// A target whose corrected joints are known.
struct ReachableTarget<'o, 't> {
    index: usize,
    original: &'o OriginalTarget<'t>,
    intended: Pose,
    condition_index: usize,
    flange: Pose,
    after: Joints,
    singularity: f64,
    reached_before: Pose,
}

impl ReachableTarget<'_, '_> {
    /// Near a pole of the words of orientation: the orientation, of those with words near the programmed ones, nearest to the intended one.
    fn keep_words_near(
        &mut self,
        target_refs: &[TargetRef<'_>],
        arms: &Arms<'_>,
        work: &TargetSolver<'_, '_>,
    ) -> Result<(), InverseError> {
        let TargetRef { index, target, .. } = &target_refs[self.index];
        let Some(words) = work.listing.nc.at_poles.get(index).filter(|_| target.role == Role::To) else {
            return Ok(());
        };
        let frames = &work.frame_table.list[self.original.frames_index];
        let exact = frames.commanded.target_of(&arms.nominal.arm().forward(&self.after)).rotation;
        let turned = words.nearest(&exact);
        self.after =
            joints_in_orientation(turned, &self.intended, &self.after, frames, self.condition_index, arms)?;
        Ok(())
    }
}

/// A pose as it will be read back: positions in units of 1 / `scale` mm, quaternions with seven decimals.
fn rounded(pose: &Pose, scale: f64) -> Pose {
    let position = pose.translation.vector.map(|v| round(v * scale) / scale);
    let q = pose.rotation.quaternion().coords.map(|v| round(v * 1e7) / 1e7);
    Pose::from_parts(
        position.into(),
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(q)),
    )
}
