//! Corrections that are not written, whatever they are worth: too far, out of reach, in another configuration.

use crate::arms::Arms;
use crate::options::Options;
use crate::plan::reason::Why;
use crate::target::solved_target::Solved;

/// Why a corrected target must not be written. `singularity`: how far its joints are from one.
pub(crate) fn forbidden(
    solved: &Solved,
    singularity: f64,
    arms: &Arms<'_>,
    options: &Options,
) -> Option<Why> {
    let shift = solved.shift_mm();
    if !(shift <= options.max_correction_mm) {
        return Some(Why::TooFar { mm: shift });
    }
    let turn = solved.told.rotation.angle_to(&solved.meant.rotation);
    if !(turn <= options.max_turn_rad) {
        return Some(Why::TooMuchTurn { deg: turn.to_degrees() });
    }
    if let Some(joint) = arms.nominal.arm().model.limits.violated(&solved.after) {
        return Some(Why::OutsideLimits { joint });
    }
    if singularity < options.min_singularity {
        return Some(Why::NearSingularity);
    }
    // Without branches cfx is 0 everywhere.
    if solved.cfx_before != solved.conf.cfx {
        return Some(Why::OtherBranch);
    }
    None
}
