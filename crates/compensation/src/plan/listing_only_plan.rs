//! The plan of a program without an estimated arm: nothing changes, and each motion has the reason that its text alone gives.

use crate::options::{Options, is_rewritable};
use crate::plan::reason::OutcomeReason;
use crate::plan::{MotionOutcome, Plan};
use truegrind_programs::motion::{Listing, Motion, Reason};

/// The plan that changes nothing. A motion that a model could correct has [`OutcomeReason::NoChange`]; every other motion has
/// the reason that it would also have with a model.
pub fn listing_only_plan(listing: &Listing, options: &Options) -> Plan {
    let outcomes = (0..).zip(&listing.motions).map(|(index, motion)| MotionOutcome {
        reason: Some(Box::new(unmodified_reason(listing, motion, options))),
        ..MotionOutcome::left(index)
    });
    Plan { outcomes: outcomes.collect(), ..Plan::default() }
}

fn unmodified_reason(listing: &Listing, motion: &Motion, options: &Options) -> OutcomeReason {
    let unknown = || motion.targets.iter().find_map(|target| target.value.as_ref().err().copied());
    let external = || motion.targets.is_empty().then_some(Reason::ExternalOnly);
    let frames = || listing.frame_reason(motion);
    if let Some(reason) = motion.own_reason.or_else(unknown).or_else(external).or_else(frames) {
        return OutcomeReason::Program(reason);
    }
    if is_rewritable(motion, options) { OutcomeReason::NoChange } else { OutcomeReason::JointTarget }
}
