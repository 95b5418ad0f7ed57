//! Solved targets, and their lookup by motion.

use std::collections::BTreeMap;

use crate::deviation::Deviation;
use crate::options::Emit;
use crate::plan::reason::OutcomeReason;
use crate::segment::condition_schedule::ConditionSchedule;
use crate::target::intended_pose::IntendedPose;
use crate::target::original_joints::{BranchGuess, OriginalTarget};
use crate::target::target_ranges::TargetRanges;
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_arm::region::Outside;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, MotionTarget, Role, TargetValue};

/// One solved target. A program may have a million: what is rare has memory of its own.
#[derive(Debug, Clone)]
pub(crate) struct SolvedTarget<'a> {
    pub(crate) frames_index: usize,
    pub(crate) intended: IntendedPose<'a>,
    pub(crate) before: Joints,
    pub(crate) after: Joints,
    pub(crate) commanded: Pose,
    /// Branch of the original joints.
    pub(crate) cfx_before: i32,
    pub(crate) conf: Configuration,
    /// Deviation of the tool before and after (mm).
    pub(crate) deviation_mm: [f64; 2],
    /// The same with direction and rotation; only where points are required.
    pub(crate) deviations: Option<Box<[Deviation; 2]>>,
    pub(crate) sigma_mm: f64,
    /// Predicted standard deviation of the shape of its cut, after the best rigid registration of all on the part; absent outside cuts.
    pub(crate) shape_sigma_mm: OptionF64,
    /// Contribution to either from joints of unknown backlash side (mm).
    pub(crate) play_uncertainty_mm: f64,
    pub(crate) outside: Option<Box<Outside>>,
    /// [`Inverse::branch_margins`](truegrind_arm::inverse::Inverse::branch_margins) of the nominal arm, before and after.
    pub(crate) margins: [[f64; 3]; 2],
    /// Why it must not be written.
    pub(crate) forbidden: Option<Box<OutcomeReason>>,
    /// Condition under which the arm arrives.
    pub(crate) condition_index: usize,
    /// Whether the original joints are guessed.
    pub(crate) guess: BranchGuess,
}

impl<'a> SolvedTarget<'a> {
    /// Distance of the commanded from the intended position (mm): the change of the program's numbers.
    pub(crate) fn shift_mm(&self) -> f64 {
        (self.commanded.translation.vector - self.intended.position_mm()).norm()
    }

    /// The target of the original program.
    fn original_targets(&self) -> OriginalTarget<'a> {
        OriginalTarget {
            frames_index: self.frames_index,
            intended: self.intended.clone(),
            joints: self.before,
            cfx: self.cfx_before,
            margins: self.margins[0],
            guess: self.guess,
        }
    }
}

/// The targets of all motions.
pub(crate) struct SolvedTargets<'a> {
    /// Undo log of [`SolvedTargets::forbid`]: target, and its previous reason.
    pub(crate) forbade: Vec<(usize, Option<Box<OutcomeReason>>)>,
    pub(crate) ranges: TargetRanges,
    /// All targets in one list, so that its memory is returned to the system as a whole.
    pub(crate) targets: Vec<Result<SolvedTarget<'a>, OutcomeReason>>,
    /// Conditions along the segment to each motion's end; empty without backlash.
    pub(crate) schedules: Vec<ConditionSchedule>,
    /// Original targets of motions of which the estimated arm does not reach a target.
    pub(crate) unreached: BTreeMap<u32, Vec<OriginalTarget<'a>>>,
    /// Motions with unchecked configuration and unknown start, without those that continue from them.
    pub(crate) guessed: Vec<u32>,
}

impl<'a> SolvedTargets<'a> {
    /// Forbids a change of a motion; without effect where its last target was not solved.
    pub(crate) fn forbid(&mut self, motion: usize, reason: OutcomeReason) {
        let mut targets = self.ranges.of_motion(motion);
        if let Some(last) = targets.next_back()
            && let Ok(solved) = &mut self.targets[last]
        {
            self.forbade.push((last, solved.forbidden.replace(Box::new(reason))));
        }
    }

    /// Reverts all calls of [`SolvedTargets::forbid`], so that the solved targets serve another round.
    pub(crate) fn allow_again(&mut self) {
        for (target, before) in self.forbade.drain(..).rev() {
            if let Ok(solved) = &mut self.targets[target] {
                solved.forbidden = before;
            }
        }
    }

    /// The targets of one motion; empty where the motion must be left.
    pub(crate) fn of(&self, motion: usize) -> &[Result<SolvedTarget<'a>, OutcomeReason>] {
        &self.targets[self.ranges.of_motion(motion)]
    }

    /// The targets of a motion in the original program; empty where unknown.
    pub(crate) fn original_targets(&self, motion: usize) -> Vec<OriginalTarget<'a>> {
        let known = |targets: &[Result<SolvedTarget<'a>, OutcomeReason>]| {
            targets.iter().map(|target| Some(target.as_ref().ok()?.original_targets())).collect::<Option<_>>()
        };
        known(self.of(motion)).or_else(|| self.unreached.get(&(motion as u32)).cloned()).unwrap_or_default()
    }

    /// The end of a motion in the original program, if known.
    pub(crate) fn original_end(&self, motion: usize) -> Option<OriginalTarget<'a>> {
        match self.of(motion).last()? {
            Ok(solved) => Some(solved.original_targets()),
            Err(_) => self.unreached.get(&(motion as u32))?.last().cloned(),
        }
    }

    /// The conditions along the segment to the end of a motion; constant `condition_index` without backlash.
    pub(crate) fn condition_schedule(&self, motion: usize, condition_index: usize) -> ConditionSchedule {
        self.schedules
            .get(motion)
            .cloned()
            .unwrap_or(ConditionSchedule { first: condition_index, later: Vec::new() })
    }

    /// Whether the program has a target that is solved.
    pub(crate) fn has_any(&self) -> bool {
        self.targets.iter().any(Result::is_ok)
    }

    /// Number of targets with a joint of unknown side, and the largest resulting deviation (mm).
    pub(crate) fn in_play(&self) -> (usize, f64) {
        let open = self.targets.iter().flatten().map(|s| s.play_uncertainty_mm).filter(|mm| *mm > 0.0);
        open.fold((0, 0.0), |(count, most), mm| (count + 1, f64::max(most, mm)))
    }
}

/// Whether a target is written as joints.
pub(crate) fn as_joints(motion: &Motion, target: &MotionTarget, emit: Emit) -> bool {
    let may = target.role == Role::To && motion.kind != MotionKind::Circular;
    matches!(target.value, Ok(TargetValue::Joint(_))) || (emit == Emit::Joints && may)
}
