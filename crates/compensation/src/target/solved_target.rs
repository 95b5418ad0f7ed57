//! What is worked out of each target, and where it is found.

use std::collections::BTreeMap;

use crate::deviation::Deviation;
use crate::options::Emit;
use crate::plan::reason::OutcomeReason;
use crate::segment::condition_schedule::ConditionSchedule;
use crate::target::original_joints::{BranchGuess, OriginalTarget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_arm::region::Outside;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, MotionTarget, Role, TargetValue};

/// Motions that one thread takes at a time.
pub(crate) const PORTION: usize = 64;

/// One target worked out.
#[derive(Debug, Clone)]
pub(crate) struct SolvedTarget {
    pub(crate) frames_index: usize,
    pub(crate) intended: Pose,
    pub(crate) before: Joints,
    pub(crate) after: Joints,
    pub(crate) commanded: Pose,
    /// The branch before.
    pub(crate) cfx_before: i32,
    pub(crate) conf: Configuration,
    /// How far the tool is off before and after (mm).
    pub(crate) deviation_mm: [f64; 2],
    /// The same with its direction and the turn; only where points are asked for.
    pub(crate) deviations: Option<Box<[Deviation; 2]>>,
    pub(crate) sigma_mm: f64,
    /// The same of the shape of its cut, after the best rigid registration; absent outside cuts.
    pub(crate) shape_sigma_mm: Option<f64>,
    /// What of either comes from joints whose side is not known (mm).
    pub(crate) play_uncertainty_mm: f64,
    pub(crate) outside: Option<Outside>,
    /// [`Inverse::branch_margins`](truegrind_arm::inverse::Inverse::branch_margins) of the nominal arm, before and after.
    pub(crate) margins: [[f64; 3]; 2],
    /// Why it must not be written.
    pub(crate) forbidden: Option<OutcomeReason>,
    /// The condition under which the arm comes there.
    pub(crate) condition_index: usize,
    /// Whether `before` rests on a guess.
    pub(crate) guess: BranchGuess,
}

impl SolvedTarget {
    /// How far the commanded position lies from the intended one (mm): what the program's numbers move by.
    pub(crate) fn shift_mm(&self) -> f64 {
        (self.commanded.translation.vector - self.intended.translation.vector).norm()
    }

    /// Where the target leads as the program is.
    fn original_targets(&self) -> OriginalTarget {
        OriginalTarget {
            frames_index: self.frames_index,
            intended: self.intended,
            joints: self.before,
            cfx: self.cfx_before,
            margins: self.margins[0],
            guess: self.guess,
        }
    }
}

/// The targets of all motions.
pub(crate) struct SolvedTargets {
    /// What [`SolvedTargets::forbid`] did: at which target, and what was forbidden there before.
    pub(crate) forbade: Vec<(usize, Option<OutcomeReason>)>,
    /// Where the targets of each motion begin, and the end of the last.
    pub(crate) first: Vec<usize>,
    /// All of them, in one list: it goes back to the system as a whole.
    pub(crate) targets: Vec<Result<SolvedTarget, OutcomeReason>>,
    /// The conditions on the way to the end of each motion; empty where no joint has play.
    pub(crate) schedules: Vec<ConditionSchedule>,
    /// Where the targets of motions lead of which one is not reached on the actual arm: as the program is.
    pub(crate) unreached: BTreeMap<u32, Vec<OriginalTarget>>,
    /// Motions of which the configuration is not checked and the start not known; not those that go on from there.
    pub(crate) guessed: Vec<u32>,
}

impl SolvedTargets {
    /// Forbids that a motion is changed; of no effect where its last target was not worked out.
    pub(crate) fn forbid(&mut self, motion: usize, why: OutcomeReason) {
        let targets = self.first[motion]..self.first[motion + 1];
        if let Some(last) = targets.last()
            && let Ok(solved) = &mut self.targets[last]
        {
            self.forbade.push((last, solved.forbidden));
            solved.forbidden = Some(why);
        }
    }

    /// Takes back all that [`SolvedTargets::forbid`] did: what was worked out serves another round.
    pub(crate) fn allow_again(&mut self) {
        for (target, before) in self.forbade.drain(..).rev() {
            if let Ok(solved) = &mut self.targets[target] {
                solved.forbidden = before;
            }
        }
    }

    /// The targets of one motion; none where the motion must be left.
    pub(crate) fn of(&self, motion: usize) -> &[Result<SolvedTarget, OutcomeReason>] {
        &self.targets[self.first[motion]..self.first[motion + 1]]
    }

    /// Where the targets of a motion lead as the program is; none where that is not known.
    pub(crate) fn original_targets(&self, motion: usize) -> Vec<OriginalTarget> {
        let known = |targets: &[Result<SolvedTarget, OutcomeReason>]| {
            targets.iter().map(|target| Some(target.as_ref().ok()?.original_targets())).collect::<Option<_>>()
        };
        known(self.of(motion)).or_else(|| self.unreached.get(&(motion as u32)).cloned()).unwrap_or_default()
    }

    /// Where a motion ends as the program is, if that is known.
    pub(crate) fn original_end(&self, motion: usize) -> Option<OriginalTarget> {
        match self.of(motion).last()? {
            Ok(solved) => Some(solved.original_targets()),
            Err(_) => self.unreached.get(&(motion as u32))?.last().copied(),
        }
    }

    /// The conditions on the way to the end of a motion, at which the arm comes under `condition_index`.
    pub(crate) fn condition_schedule(&self, motion: usize, condition_index: usize) -> ConditionSchedule {
        self.schedules
            .get(motion)
            .cloned()
            .unwrap_or(ConditionSchedule { first: condition_index, later: Vec::new() })
    }

    /// At how many targets a side is not known, and how far the tool may be off for it at most (mm).
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
