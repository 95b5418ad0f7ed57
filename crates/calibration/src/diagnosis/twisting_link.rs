//! Axes that wobble as a link twists: under a load beside the plane in which the arm moves, a drive at one side of the forearm or a wrist beside it.
//!
//! Such a load pulls with a moment of constant size along h = z × g, z the axis of the joint and g the direction of gravity, of which the part along
//! the link twists it. With α the angle of h and θ that of the link, ω = t cos(θ − α) (cos θ, sin θ), which but for a constant is
//!
//! ½ t (cos(2θ − α), sin(2θ − α)):
//!
//! twice a turn, as an axis that wobbles, but in the phase that gravity gives. Only where the joints before turn about gravity does it stay so.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};

/// Cosine from which two directions count as parallel, and sine from which as across each other.
const PARALLEL: f64 = 0.99;

/// Share of a wobble that may have another phase: one that has any phase is taken for a twist in a fifth of all cases.
const OTHER_PHASE: f64 = 0.3;

/// Whether a cause is the wobble of an axis in the phase of a link that twists.
pub(super) fn may_be_twist(cause: &Cause, nominal: &Model) -> bool {
    let (CauseKind::AxisWobble, Some(&joint), &[a, b, c, d, ..]) =
        (cause.kind(), cause.joints().first(), cause.values().as_slice())
    else {
        return false;
    };
    let Some([cos, sin]) = moment_direction(nominal, joint) else { return false };
    // a cos 2θ + b sin 2θ about x, c cos 2θ + d sin 2θ about y.
    let along = (a * cos + b * sin - c * sin + d * cos).powi(2) / 2.0;
    let whole = a * a + b * b + c * c + d * d;
    whole > 0.0 && whole - along < OTHER_PHASE * OTHER_PHASE * whole
}

/// Cosine and sine of α, from the x axis of the frame before the joint about its own; `None` where gravity does not stand still in that frame, or along
/// that axis.
fn moment_direction(nominal: &Model, joint: usize) -> Option<[f64; 2]> {
    let at_zero = nominal.at_condition(&Condition::default()).frames(&Joints::zeros());
    let axis = |k: usize| Vector3::from(at_zero.z[k]);
    let stands_still = (0..joint).all(|before| axis(before).dot(&nominal.gravity).abs() > PARALLEL);
    let z = axis(joint);
    if !stands_still || z.dot(&nominal.gravity).powi(2) > 1.0 - PARALLEL * PARALLEL {
        return None;
    }
    let moment = z.cross(&nominal.gravity).normalize();
    let x = Vector3::from(at_zero.lateral[joint]);
    Some([moment.dot(&x), moment.dot(&z.cross(&x))])
}
