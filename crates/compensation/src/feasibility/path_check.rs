//! Whether a corrected segment comes too near a singularity, or beyond the limits of a joint, between its ends.
//!
//! Method. Branch margins are 0 at the singularities and change by at most about [`MARGIN_RATE`] per flange travel (half arm lengths and
//! rad); a piece of a segment with larger margins at its ends cannot come near one and is not sampled further. On the same samples the
//! bounds of targets hold ([`joint_jump`](super::joint_jump)), and joints must stay within their limits ([`joint_limits`]): between targets
//! within the limits a corrected segment can exceed one that the original segment just kept.

use std::cell::Cell;

use super::joint_jump::{flange_travel, joint_jump};
use crate::feasibility::joint_limits;
use crate::frames::frame_pair::FramePair;
use crate::options::Options;
use crate::plan::reason::OutcomeReason;
use crate::segment::curve::Curve;
use truegrind_arm::inverse::{Inverse, InverseError};
use truegrind_arm::model::Joints;

/// Largest rate of change of a margin with flange travel: the sine of the wrist angle changes with the rotation of the tool
/// and with the rotation of the forearm by joints 2 and 3.
const MARGIN_RATE: f64 = 3.0;

/// Margins of shoulder, elbow and wrist beyond which joints move at most a few times as far as elsewhere.
const CLEAR_MARGIN: [f64; 3] = [0.05, 0.12, 0.15];

/// Shortest piece of a segment (half arm lengths and rad), together with [`MIN_PIECE_SHARE`] of its smallest margin.
const MIN_PIECE: f64 = 3e-4;
/// See [`MIN_PIECE`]: the joints sweep within about the margin itself.
const MIN_PIECE_SHARE: f64 = 0.2;

/// Ratio of a branch margin to the singularity distance.
const WITHOUT_BRANCHES: f64 = 5.0;

/// Branch margins at joints of the nominal arm; for an arm without branches, from its singularity distance.
pub(super) fn margins(branches: [f64; 3], joints: &Joints, nominal: &Inverse<'_>) -> [f64; 3] {
    if branches == [1.0; 3] { [nominal.singularity(joints) * WITHOUT_BRANCHES; 3] } else { branches }
}

/// Whether a piece of a segment with these margins at its ends is clear of singularities.
pub(super) fn clear(from: &[f64; 3], to: &[f64; 3], flange_travel: f64) -> bool {
    (0..3).all(|k| {
        (from[k] < 0.0) == (to[k] < 0.0)
            && from[k].abs() + to[k].abs() - MARGIN_RATE * flange_travel > 2.0 * CLEAR_MARGIN[k]
    })
}

/// Flange travel along a curve (see [`flange_travel`]), from eight pieces.
pub(super) fn curve_travel(curve: &Curve, commanded: &FramePair, nominal: &Inverse<'_>) -> f64 {
    const PIECES: usize = 8;
    let at = |k: usize| commanded.flange_for(&curve.at(k as f64 / PIECES as f64));
    (0..PIECES).map(|k| flange_travel(&at(k), &at(k + 1), nominal)).sum()
}

/// A corrected segment beside the original one.
pub(super) struct PathCheck<'a> {
    pub(super) nominal: &'a Inverse<'a>,
    pub(super) commanded: FramePair,
    /// Original and commanded.
    pub(super) curves: [Curve; 2],
    /// See [`curve_travel`].
    pub(super) curve_travel: f64,
    /// Remaining samples.
    pub(super) samples: &'a Cell<usize>,
    pub(super) options: &'a Options,
}

/// Reason where a segment has no solution.
fn unreachable_reason(error: InverseError) -> OutcomeReason {
    match error {
        InverseError::OutsideLimits { what, .. } => OutcomeReason::PathOutsideLimits { what },
        _ => OutcomeReason::SingularPath,
    }
}

/// A sample of the corrected segment.
pub(super) struct PathSample {
    share: f64,
    joints: Joints,
    margins: [f64; 3],
}

impl PathCheck<'_> {
    pub(super) fn reached(&self, share: f64, joints: Joints) -> PathSample {
        let margins = match self.nominal.has_branches() {
            true => self.nominal.branch_margins(&joints),
            false => [self.nominal.singularity(&joints) * WITHOUT_BRANCHES; 3],
        };
        PathSample { share, joints, margins }
    }

    /// Why a piece of the segment must not be executed.
    pub(super) fn check_piece(&self, a: &PathSample, b: &PathSample) -> Option<OutcomeReason> {
        let flange_travel = (b.share - a.share) * self.curve_travel;
        let least = a.margins.iter().chain(&b.margins).fold(f64::INFINITY, |least, m| least.min(m.abs()));
        let crosses = (0..3).any(|k| (a.margins[k] < 0.0) != (b.margins[k] < 0.0));
        let regular = clear(&a.margins, &b.margins, flange_travel)
            || (!crosses && flange_travel < MIN_PIECE_SHARE * least);
        let limits = &self.nominal.arm().model.limits;
        let keeps = || {
            joint_limits::within_limits(
                limits,
                [&a.joints, &b.joints],
                [&a.margins, &b.margins],
                flange_travel,
            )
        };
        if flange_travel < MIN_PIECE || (regular && keeps()) || self.samples.get() == 0 {
            return crosses.then_some(OutcomeReason::SingularPath);
        }
        self.samples.set(self.samples.get() - 1);
        let middle = match self.sample_at(0.5 * (a.share + b.share), a) {
            Ok(middle) => middle,
            Err(why) => return why,
        };
        if regular && joint_limits::within_limits_curved(limits, [&a.joints, &middle.joints, &b.joints]) {
            return None;
        }
        self.check_piece(a, &middle).or_else(|| self.check_piece(&middle, b))
    }

    /// A sample solved from a nearby one; otherwise the reason, if any.
    fn sample_at(&self, share: f64, near: &PathSample) -> Result<PathSample, Option<OutcomeReason>> {
        let [intended, flange] = [0, 1].map(|k| self.commanded.flange_for(&self.curves[k].at(share)));
        let before = || self.nominal.solve_near(&intended, &near.joints).ok();
        let solution = match self.nominal.solve_near(&flange, &near.joints) {
            Ok(solution) => solution,
            // Where the original segment has no solution either, the path deviation reports it.
            Err(error) => return Err(before().map(|_| unreachable_reason(error))),
        };
        let place = self.reached(share, solution.joints);
        if (0..3).all(|k| place.margins[k].abs() > CLEAR_MARGIN[k]) {
            return Ok(place);
        }
        if self.nominal.singularity(&place.joints) < self.options.min_singularity {
            return Err(Some(OutcomeReason::SingularPath));
        }
        let jumped = before().and_then(|s| {
            joint_jump(|| [intended, flange], [&s.joints, &place.joints], self.nominal, self.options)
        });
        match jumped {
            Some(OutcomeReason::JointJump { joint, deg, most_deg, .. }) => {
                Err(Some(OutcomeReason::JointJump { joint, deg, most_deg, on_the_way: true }))
            }
            _ => Ok(place),
        }
    }
}
