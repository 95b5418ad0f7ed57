//! Link bending: the link between two parallel axes yields like a beam that is clamped at its first axis.
//!
//! F is the weight that its end carries, across the link, M the moment of that weight about the end, W the link's own weight, spread
//! evenly over its length L. The end of an Euler–Bernoulli beam sinks by (F L³/3 + M L²/2 + W L³/8)/EI and turns by
//! (F L²/2 + M L + W L²/6)/EI. Gravity's torques about the two axes are τⱼ = F L + M + W L/2 and τⱼ₊₁ = M, that of the link's own
//! weight about its first axis is τ_w = W L/2. With c = L/EI the link therefore turns about its first axis, and what it carries about
//! the second one, by
//!
//! δθⱼ = c (τⱼ/3 + τⱼ₊₁/6 − τ_w/12), δθⱼ₊₁ = c (τⱼ/6 + τⱼ₊₁/3 − τ_w/12).
//!
//! Two compliant joints give the diagonal terms alone: the mixed ones tell a link from its joints. Where the axes point in opposite
//! directions the torques at the second one change their sign.
//!
//! Source: deflections and slopes of cantilevers under an end load, an end moment and a uniform load, as any text on the mechanics of
//! materials tabulates them (Gere and Goodno, Mechanics of Materials, the appendix on beams).

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross, dot, minus};
use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{SinCos, splats};

/// Bending of one link.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, bending::Bending};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // 3 kg at the elbow of an arm whose upper link lies level: its end sinks by F L³/3EI = c F L²/3, and so does the load.
/// let mut arm = robots::load("abb-irb-120")?.model;
/// let bending = Bending { joint: 1, frame: Some(2), compliance_rad_per_nm: 3.0 * 1e-5 };
/// let level = Joints::new(0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0);
/// let elbow = |arm: &Model| arm.at_condition(&Condition::default()).frames(&level).origin[2];
/// let straight = elbow(&arm);
/// arm.effects.push(Effect::LinkBending(bending));
/// let (force_n, length_m) = (3.0 * 9.80665, 0.27);
/// assert!((straight[2] - elbow(&arm)[2] - 1e3 * 1e-5 * force_n * length_m * length_m / 3.0).abs() < 1e-6);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bending {
    /// Joint at which the link begins, 0-based; it ends at the next one.
    pub joint: usize,
    /// Frame (1 to 6) at whose origin the load counts as concentrated, where masses are not known; absent for those of the arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
    /// c = L/EI (rad/(N m)), with a concentrated load times its mass (kg).
    pub compliance_rad_per_nm: f64,
}

/// Gravity's torques on a link: about its first axis, about its second one, and of its own weight; and the cosine between the axes.
struct Load<R> {
    first: R,
    second: R,
    own: R,
    sense: R,
}

impl Bending {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let (name, unit) = match self.frame {
            None => ("compliance of the link", "rad/(N m)"),
            Some(_) => ("compliance of the link x mass", "rad kg/(N m)"),
        };
        vec![EffectParameter { name, unit, value: self.compliance_rad_per_nm }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.compliance_rad_per_nm = value;
    }

    /// Turns of the two joints for c = 1.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn turns<R: SinCos>(&self, statics: &Statics, frames: &Chain<R>, torque: &[R; 6]) -> [R; 2] {
        let j = self.joint.min(4);
        let number = |value: f64| frames.x[0].splat(value);
        let zero = number(0.0);
        let g = splats(zero, &statics.gravity_newton());
        let about = |axis: usize, lever: &[R; 3]| dot(&frames.z[axis], &cross(lever, &g));
        let sense = dot(&frames.z[j], &frames.z[j + 1]);
        let load = match self.frame {
            None => Load {
                first: torque[j],
                second: torque[j + 1],
                own: about(j, &statics.own_lever(frames, j)),
                sense,
            },
            Some(frame) => {
                let to = |axis: usize| minus(&frames.origin[frame], &frames.origin[axis]);
                Load { first: about(j, &to(j)), second: about(j + 1, &to(j + 1)), own: zero, sense }
            }
        };
        let (third, sixth, twelfth) = (number(1.0 / 3.0), number(1.0 / 6.0), number(1.0 / 12.0));
        let end = load.sense * load.second;
        let own = twelfth * load.own;
        [third * load.first + sixth * end - own, load.sense * (sixth * load.first + third * end - own)]
    }

    pub(super) fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let u: [f64; 6] = (*u).into();
        let j = self.joint.min(4);
        let turns = self.turns(statics, &statics.frames(&u), &statics.torques(&u, condition));
        let mut out = Vector6::zeros();
        (out[j], out[j + 1]) = (turns[0], turns[1]);
        vec![out]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.compliance_rad_per_nm
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        torque: &[R; 6],
        out: &mut [R; 6],
    ) {
        let j = self.joint.min(4);
        let turns = self.turns(statics, &statics.frames(u), torque);
        let c = u[0].splat(self.compliance_rad_per_nm);
        out[j] += c * turns[0];
        out[j + 1] += c * turns[1];
    }

    /// Torque is the gradient of a potential: ∂τₐ/∂u_b = g · (z_min × (z_max × lever of max)).
    pub(super) fn jacobian(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Matrix6<f64> {
        let j = self.joint.min(4);
        let frames = statics.frames::<f64>(&(*u).into());
        let g = statics.gravity_newton();
        let sense = dot(&frames.z[j], &frames.z[j + 1]);
        let all = self.frame.is_none().then(|| statics.torques_and_jacobian(u, condition).1);
        let own = statics.own_lever(&frames, j);
        let slope = |axis: usize, i: usize| match (&all, self.frame) {
            (None, Some(frame)) if i < frame => {
                let (a, b) = (axis.min(i), axis.max(i));
                let lever = minus(&frames.origin[frame], &frames.origin[b]);
                dot(&g, &cross(&frames.z[a], &cross(&frames.z[b], &lever)))
            }
            (Some(all), _) => all[(axis, i)],
            _ => 0.0,
        };
        let mut out = Matrix6::zeros();
        for i in 0..6 {
            let (first, end) = (slope(j, i), sense * slope(j + 1, i));
            let own = match all.is_some() && i <= j {
                true => dot(&g, &cross(&frames.z[i], &cross(&frames.z[j], &own))),
                false => 0.0,
            };
            let c = self.compliance_rad_per_nm;
            out[(j, i)] = c * (first / 3.0 + end / 6.0 - own / 12.0);
            out[(j + 1, i)] = c * sense * (first / 6.0 + end / 3.0 - own / 12.0);
        }
        out
    }
}
