//! Steps of the path between corrected motions and their uncorrected neighbours.

use std::collections::BTreeSet;

use super::reason::OutcomeReason;
use crate::cut::{follows_position, starts};
use crate::deviation::MotionStatus;
use crate::line_list::lines_of;
use truegrind_programs::motion::{Listing, Motion, MotionKind, Reason, TargetValue};
use truegrind_programs::rewrite::{Change, NewTarget};

/// Corrected lines and arcs next to uncorrected ones with the same tool and work object, in the order of the file, and those that start at
/// an uncorrected joint motion, whatever its tool and work object.
#[derive(Debug, Clone, PartialEq)]
pub struct StepsToLeft {
    /// The corrected motions.
    pub motions: Vec<u32>,
    /// Those of them that start at an uncorrected joint target.
    pub from_joint_targets: Vec<u32>,
    /// The largest of the steps (mm): how far the correction moves the end. `None` where that is known of none.
    pub largest_mm: Option<f64>,
    /// Those of the motions of whose step it is not known.
    pub of_unknown_size: Vec<u32>,
}

impl StepsToLeft {
    /// The steps above a tolerance; `None` without any. `outcome` is the status of a motion, its reason, and its deviation before (mm).
    pub fn of(
        listing: &Listing,
        changes: &[Change],
        outcome: &dyn Fn(usize) -> (MotionStatus, Option<OutcomeReason>, Option<f64>),
        tolerance_mm: f64,
    ) -> Option<Self> {
        let left = |index: usize| {
            let (status, reason, _) = outcome(index);
            let motion = &listing.motions[index];
            status == MotionStatus::Left
                && reason != Some(OutcomeReason::NoChange)
                && (is_path(motion) || is_call(motion))
                && !follows_position(motion)
        };
        let beside_left = |index: usize| {
            let this = &listing.motions[index];
            let before = index.checked_sub(1);
            let behind = Some(index + 1).filter(|behind| *behind < listing.motions.len());
            let mut neighbours = before.into_iter().chain(behind);
            neighbours.any(|other| is_continued(listing, this, &listing.motions[other]) && left(other))
        };
        let across = listing.across_calls.iter().flat_map(|&[a, b]| [[a, b], [b, a]]);
        let beside_left_across: BTreeSet<u32> = across
            .filter(|&[this, other]| {
                let [this, other] = [this, other].map(|index| &listing.motions[index as usize]);
                is_path(this) && listing.may_share_frames(this, other)
            })
            .filter(|[_, other]| left(*other as usize))
            .map(|[this, _]| this)
            .collect();
        // A joint motion leads to the start of the next one whatever its own tool and work object. Behind a line it is an air move, on which
        // nothing is cut.
        let starts_left = |index: u32, of: &dyn Fn(&Motion, Option<OutcomeReason>) -> bool| {
            starts(listing, index).into_iter().any(|start| {
                let (status, reason, _) = outcome(start as usize);
                let is_left = status == MotionStatus::Left && reason != Some(OutcomeReason::NoChange);
                is_left && of(&listing.motions[start as usize], reason)
            })
        };
        let by_joints =
            |start: &Motion, _| matches!(start.kind, MotionKind::AbsoluteJoint | MotionKind::Joint);
        let is_joint_target = |_: &Motion, reason| reason == Some(OutcomeReason::JointTarget);
        let mut found = Self {
            motions: Vec::new(),
            from_joint_targets: Vec::new(),
            largest_mm: None,
            of_unknown_size: Vec::new(),
        };
        for change in changes {
            let motion = &listing.motions[change.motion as usize];
            let (status, _, before_mm) = outcome(change.motion as usize);
            if !is_path(motion) || !status.is_written() {
                continue;
            }
            // A step of unknown size may be one above the tolerance.
            let moved_mm = moved_mm(motion, change).or(before_mm);
            if moved_mm.is_none_or(|mm| mm > tolerance_mm)
                && (beside_left_across.contains(&change.motion)
                    || beside_left(change.motion as usize)
                    || starts_left(change.motion, &by_joints))
            {
                found.motions.push(change.motion);
                if starts_left(change.motion, &is_joint_target) {
                    found.from_joint_targets.push(change.motion);
                }
                match moved_mm {
                    Some(mm) => {
                        found.largest_mm = Some(found.largest_mm.map_or(mm, |largest| largest.max(mm)))
                    }
                    None => found.of_unknown_size.push(change.motion),
                }
            }
        }
        (!found.motions.is_empty()).then_some(found)
    }

    /// What a report says of them.
    pub fn sentence(&self, listing: &Listing) -> String {
        let size = match self.largest_mm {
            Some(mm) => format!("by up to {mm:.2} mm, the size of the correction,"),
            None => "by an unknown amount".to_owned(),
        };
        let lines = lines_of(listing, &self.motions).unwrap_or_default();
        let unknown = lines_of(listing, &self.of_unknown_size).filter(|_| self.largest_mm.is_some());
        let unknown = unknown.map(|lines| format!("; by how much at {lines} is unknown")).unwrap_or_default();
        format!(
            "the path steps {size} between corrected motions and uncorrected neighbours ({lines}{unknown})"
        ) + &self.joint_targets(listing).unwrap_or_default()
    }

    /// What is said of those that start at a joint target.
    fn joint_targets(&self, listing: &Listing) -> Option<String> {
        let lines = lines_of(listing, &self.from_joint_targets)?;
        let (start, they) =
            if self.from_joint_targets.len() == 1 { ("starts", "it") } else { ("start", "they") };
        Some(format!(
            "; {lines} {start} at an uncorrected joint target, so {they} would leave the intended line (--joint-targets corrects joint \
             targets too)"
        ))
    }
}

/// Whether the tool may work on the way of a motion.
pub fn is_path(motion: &Motion) -> bool {
    matches!(motion.kind, MotionKind::Linear | MotionKind::Circular) && !motion.rapid
}

/// Whether it calls something that takes the target and may move there: a routine whose motions are left, or an unknown one.
fn is_call(motion: &Motion) -> bool {
    let calls = [Reason::OwnRoutine, Reason::UnknownInstruction, Reason::LateBinding];
    motion.own_reason.is_some_and(|reason| calls.contains(&reason))
}

/// Whether a motion stands in one routine with another, which may have the same tool and work object or is a call.
fn is_continued(listing: &Listing, this: &Motion, other: &Motion) -> bool {
    let near = this.place.file == other.place.file && this.routine == other.routine;
    near && (is_call(other) || listing.may_share_frames(this, other))
}

/// How far a change moves the end of its motion (mm); `None` where it is written in another form.
fn moved_mm(motion: &Motion, change: &Change) -> Option<f64> {
    let old = motion.to().and_then(|target| target.value.as_ref().ok()).and_then(TargetValue::cartesian);
    match (old, change.targets.last()) {
        (Some(old), Some(NewTarget::Cartesian { position_mm, .. })) => {
            let moved = |axis: usize| (position_mm[axis] - old.position_mm[axis]).powi(2);
            Some((0..3).map(moved).sum::<f64>().sqrt())
        }
        _ => None,
    }
}
