//! Joint compliance where masses or the direction of gravity are not known: a joint yields in proportion to the torques
//! that lumped masses at frame origins would have.
//!
//! δθⱼ = Σ κₜ τⱼ(oₜ, dₜ), with τⱼ(o, d) = zⱼ · ((o − oⱼ) × g d) the torque about axis j of 1 kg at the origin o of a frame
//! beyond the joint, under gravity along d (the arm's own direction, or an axis of the base), and κₜ the product of
//! compliance and mass. The static torque of any arm is linear in its masses and first moments, so lumps at elbow, wrist
//! and flange, and first moments in the frames between them, span it whatever the masses are.
//! Source: the elastostatic joint model of Nubiola and Bonev 2013 (doi 10.1016/j.rcim.2012.06.004) with the masses freed.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross, dot, minus, scaled};
use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::gravity::STANDARD_GRAVITY;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{Real, SinCos, splats};

/// One lump.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lump {
    /// Frame at whose origin it sits: 1 to 6, the end of link 1 to 6.
    pub frame: usize,
    /// Base axis (0, 1, 2) along which gravity pulls; absent for the arm's own direction of gravity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<usize>,
    /// Axis (0, 1, 2) of the frame along which the lump stands off its origin by a metre; then only the stand-off counts: a
    /// first moment of 1 kg m that moves with the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moment: Option<usize>,
    /// Compliance times mass [rad kg/(N m)].
    pub factor: f64,
}

/// Compliance of one joint under lumped masses.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::lumped_compliance::{LumpedCompliance, Lump};
/// use truegrind_arm::effect::{Effect, compliance::Compliance};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // Where masses are not known, a lump of compliance × 3 kg at the flange does what 3 kg do to a compliance.
/// let bare = Model { bodies: None, ..robots::load("abb-irb-120")?.model };
/// let with = |effect| Model { effects: vec![effect], ..bare.clone() };
/// let lump = Lump { frame: 6, axis: None, moment: None, factor: 3.0 * 1e-5 };
/// let lumped = with(Effect::LumpedCompliance(LumpedCompliance { joint: 1, lump: vec![lump] }));
/// let known = with(Effect::JointCompliance(Compliance { joint: 1, compliance_rad_per_nm: 1e-5 }));
///
/// let (q, load) = (Joints::repeat(0.3), Condition { payload_kg: Some(3.0), ..Condition::default() });
/// let flange = |arm: &Model, condition: &Condition| arm.forward(&q, condition).translation.vector;
/// assert!((flange(&lumped, &Condition::default()) - flange(&known, &load)).norm() < 1e-9);
/// assert!((flange(&lumped, &load) - flange(&bare, &load)).norm() > 0.01);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LumpedCompliance {
    /// Joint, 0-based.
    pub joint: usize,
    /// The lumps.
    pub lump: Vec<Lump>,
}

/// Names of compliance times first moment, by frame and axis.
const FIRST_MOMENTS: [[&str; 3]; 7] = [
    ["compliance x base moment x", "compliance x base moment y", "compliance x base moment z"],
    ["compliance x link 1 moment x", "compliance x link 1 moment y", "compliance x link 1 moment z"],
    ["compliance x link 2 moment x", "compliance x link 2 moment y", "compliance x link 2 moment z"],
    ["compliance x link 3 moment x", "compliance x link 3 moment y", "compliance x link 3 moment z"],
    ["compliance x link 4 moment x", "compliance x link 4 moment y", "compliance x link 4 moment z"],
    ["compliance x link 5 moment x", "compliance x link 5 moment y", "compliance x link 5 moment z"],
    ["compliance x link 6 moment x", "compliance x link 6 moment y", "compliance x link 6 moment z"],
];

impl LumpedCompliance {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        self.lump
            .iter()
            .map(|l| EffectParameter {
                name: match l.frame {
                    frame if let Some(axis) = l.moment => FIRST_MOMENTS[frame.min(6)][axis.min(2)],
                    0..=2 => "compliance x elbow mass",
                    3 => "compliance x forearm mass",
                    4 | 5 => "compliance x wrist mass",
                    _ => "compliance x flange mass",
                },
                unit: "rad kg/(N m)",
                value: l.factor,
            })
            .collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        if let Some(lump) = self.lump.get_mut(index) {
            lump.factor = value;
        }
    }

    /// Torque of 1 kg at a lump's place.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn torque<R: Real>(&self, statics: &Statics, frames: &Chain<R>, lump: &Lump) -> R {
        let g = splats(frames.x[0], &pull(statics, lump));
        let lever = lever(frames, lump, self.joint);
        dot(&frames.z[self.joint], &cross(&lever, &g))
    }

    pub(super) fn regressors(&self, statics: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let frames = statics.frames::<f64>(&(*u).into());
        self.lump
            .iter()
            .map(|lump| {
                let mut out = Vector6::zeros();
                out[self.joint] = self.torque(statics, &frames, lump);
                out
            })
            .collect()
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, _: &Condition) -> Vector6<f64> {
        let mut out = [0.0; 6];
        self.add_offset(statics, &(*u).into(), &mut out);
        out.into()
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(&self, statics: &Statics, u: &[R; 6], out: &mut [R; 6]) {
        let frames = statics.frames(u);
        for lump in &self.lump {
            out[self.joint] += u[0].splat(lump.factor) * self.torque(statics, &frames, lump);
        }
    }

    pub(super) fn jacobian(&self, statics: &Statics, u: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let frames = statics.frames::<f64>(&(*u).into());
        let mut out = Matrix6::zeros();
        for lump in &self.lump {
            let g = pull(statics, lump);
            for i in 0..lump.frame.min(6) {
                // The torque is the gradient of a potential: ∂²/∂uₐ∂u_b = g · (zₐ × (z_b × (p − o_b))), a ≤ b.
                let (a, b) = (i.min(self.joint), i.max(self.joint));
                let lever = lever(&frames, lump, b);
                let bent = cross(&frames.z[a], &cross(&frames.z[b], &lever));
                out[(self.joint, i)] += lump.factor * dot(&g, &bent);
            }
        }
        out
    }
}

/// From the axis of a joint to the lump, or the stand-off of a first moment (mm).
#[cfg_attr(not(debug_assertions), inline(always))]
fn lever<R: Real>(frames: &Chain<R>, lump: &Lump, joint: usize) -> [R; 3] {
    let axis = match lump.moment {
        None => return minus(&frames.origin[lump.frame], &frames.origin[joint]),
        Some(0) => cross(&frames.y[lump.frame - 1], &frames.z[lump.frame]),
        Some(1) => frames.y[lump.frame - 1],
        Some(_) => frames.z[lump.frame],
    };
    scaled(axis[0].splat(1e3), &axis)
}

/// Weight of 1 kg (N), with metres for the millimetres of the levers.
#[inline(always)]
fn pull(statics: &Statics, lump: &Lump) -> [f64; 3] {
    match lump.axis {
        None => statics.gravity_newton(),
        Some(axis) => {
            let mut along = [0.0; 3];
            along[axis] = STANDARD_GRAVITY * 1e-3;
            along
        }
    }
}
