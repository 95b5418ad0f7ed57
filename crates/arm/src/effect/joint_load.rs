//! The torque of gravity about a joint whose spring is not linear: of the arm's masses and the payload, or of masses that are assumed.

use nalgebra::Vector6;
use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross, dot, minus};
use crate::condition::Condition;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{Real, SinCos, splats};

/// A mass at the origin of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointMass {
    /// The frame: 1 to 6, the end of link 1 to 6, beyond the joint.
    pub frame: usize,
    /// Its mass (kg).
    pub mass_kg: f64,
}

/// Torque about the axis of a joint: of the masses, or where there are none that of the arm, which is `of_arm`.
#[cfg_attr(not(debug_assertions), inline(always))]
pub(super) fn torque<R: SinCos>(
    (joint, masses): (usize, &[PointMass]),
    statics: &Statics,
    u: &[R; 6],
    of_arm: &[R; 6],
) -> R {
    if masses.is_empty() {
        return of_arm[joint];
    }
    let frames = statics.frames(u);
    let g = splats(u[0], &statics.gravity_newton());
    let mut out = u[0].splat(0.0);
    for mass in masses {
        let weight = cross(&lever(&frames, mass, joint), &g);
        out += u[0].splat(mass.mass_kg) * dot(&frames.z[joint], &weight);
    }
    out
}

/// The torques of the arm's own masses and payload where [`torque`] needs them, otherwise zeros.
pub(super) fn torque_of_arm(
    masses: &[PointMass],
    statics: &Statics,
    u: &[f64; 6],
    condition: &Condition,
) -> [f64; 6] {
    if masses.is_empty() { statics.torques(u, condition) } else { [0.0; 6] }
}

/// The same torque, and its derivatives with respect to the joints. A torque is the gradient of a potential: of a mass they are
/// g · (zₐ × (z_b × lever of b)), a before b.
pub(super) fn torque_and_slopes(
    (joint, masses): (usize, &[PointMass]),
    statics: &Statics,
    u: &MappedJoints,
    condition: &Condition,
) -> (f64, Vector6<f64>) {
    let (of_arm, slopes) = statics.torques_and_jacobian(u, condition);
    if masses.is_empty() {
        return (of_arm[joint], slopes.row(joint).transpose());
    }
    let u: [f64; 6] = (*u).into();
    let (frames, g) = (statics.frames::<f64>(&u), statics.gravity_newton());
    let mut out = Vector6::zeros();
    for mass in masses {
        for i in 0..mass.frame.min(6) {
            let (a, b) = (i.min(joint), i.max(joint));
            let bent = cross(&frames.z[a], &cross(&frames.z[b], &lever(&frames, mass, b)));
            out[i] += mass.mass_kg * dot(&g, &bent);
        }
    }
    (torque((joint, masses), statics, &u, &of_arm.into()), out)
}

/// From the axis of a joint to the mass (mm).
#[cfg_attr(not(debug_assertions), inline(always))]
fn lever<R: Real>(frames: &Chain<R>, mass: &PointMass, joint: usize) -> [R; 3] {
    minus(&frames.origin[mass.frame.min(6)], &frames.origin[joint])
}
