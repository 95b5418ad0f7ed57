//! Whether an arm is that of a program at all.

use super::outcome::Plan;
use super::why::Why;
use truegrind_arm::inverse::InverseError;

/// Fewer motions than these say nothing of the arm: a single one may be a slip.
const FEWEST: usize = 5;

/// How many motions there are where hardly one has joints on the arm that was asked: the program is another arm's. A program
/// that a few targets of which are out of reach is its own.
pub fn none_in_reach(plan: &Plan) -> Option<usize> {
    let untold = |why: &Why| {
        matches!(why, Why::Program(_) | Why::MovingBase { .. } | Why::Contradicted | Why::JointTarget)
            || *why == Why::Inverse(InverseError::Abandoned)
    };
    let unreached = |why: &Why| matches!(why, Why::Inverse(_) | Why::OutsideLimits { .. });
    let judged = || plan.outcomes.iter().filter(|outcome| !outcome.reason.as_ref().is_some_and(untold));
    let all = judged().count();
    let without = judged().filter(|outcome| outcome.reason.as_ref().is_some_and(unreached)).count();
    // One target in fifty may be reached by chance.
    (all >= FEWEST && 50 * without >= 49 * all).then_some(without)
}
