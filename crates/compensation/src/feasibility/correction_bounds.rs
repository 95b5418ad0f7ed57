//! Bounds that forbid writing a correction: too large, outside joint limits, singular, or in another configuration.

use crate::arms::Arms;
use crate::options::Options;
use crate::plan::reason::OutcomeReason;
use crate::target::solved_target::SolvedTarget;

/// Why a corrected target must not be written. `singularity`: distance of its joints from a singularity.
pub(crate) fn forbidden(
    solved: &SolvedTarget<'_>,
    singularity: f64,
    arms: &Arms<'_>,
    options: &Options,
) -> Option<OutcomeReason> {
    let shift = solved.shift_mm();
    if !(shift <= options.max_correction_mm) {
        return Some(OutcomeReason::CorrectionTooLarge { mm: shift });
    }
    let turn = solved.commanded.rotation.angle_to(&solved.intended.pose().rotation);
    if !(turn <= options.max_rotation_rad) {
        return Some(OutcomeReason::RotationTooLarge { deg: turn.to_degrees() });
    }
    if let Some(what) = arms.nominal.arm().model.limits.violated(&solved.after) {
        return Some(OutcomeReason::OutsideLimits { what });
    }
    if singularity < options.min_singularity {
        return Some(OutcomeReason::NearSingularity);
    }
    // For arms without branches, cfx is always 0.
    if solved.cfx_before != solved.conf.cfx {
        return Some(OutcomeReason::OtherBranch);
    }
    None
}
