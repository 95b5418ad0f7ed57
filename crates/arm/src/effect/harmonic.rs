//! A periodic error of one joint: eccentric gears (orders 1 and 2) and reducer lines (higher orders).
//!
//! δθⱼ = S sin(n uⱼ) + C cos(n uⱼ), n per turn of the joint.
//! Source: Ma et al. 2018 (doi 10.1016/j.rcim.2017.09.006) for joint-dependent periodic errors of gears and encoders.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{SinCos, sin_cos};

/// One harmonic of one joint.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, harmonic::Harmonic};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // A gear that runs out of centre: once per turn of joint 1.
/// let runout = Harmonic { joint: 0, order: 1.0, sine_rad: 3e-4, cosine_rad: 4e-4 };
/// assert!((runout.amplitude_rad() - 5e-4).abs() < 1e-18);
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::GearEccentricity(runout));
/// let still = Condition::default();
/// let error = |angle: f64| {
///     arm.at_condition(&still).joint_rotations(&Joints::new(angle, 0.0, 0.0, 0.0, 0.0, 0.0))[0] - angle
/// };
/// assert!((error(0.0) - 4e-4).abs() < 1e-12 && (error(FRAC_PI_2) - 3e-4).abs() < 1e-12);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Harmonic {
    /// Joint, 0-based.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// Factor of the sine (rad).
    pub sine_rad: f64,
    /// Factor of the cosine (rad).
    pub cosine_rad: f64,
}

impl Harmonic {
    /// Amplitude (rad).
    pub fn amplitude_rad(&self) -> f64 {
        self.sine_rad.hypot(self.cosine_rad)
    }

    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![
            EffectParameter { name: "sine", unit: "rad", value: self.sine_rad },
            EffectParameter { name: "cosine", unit: "rad", value: self.cosine_rad },
        ]
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        *(if index == 0 { &mut self.sine_rad } else { &mut self.cosine_rad }) = value;
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let (sin, cos) = (self.order * u[self.joint]).sin_cos();
        let (mut first, mut second) = (Vector6::zeros(), Vector6::zeros());
        first[self.joint] = sin;
        second[self.joint] = cos;
        vec![first, second]
    }

    pub(super) fn offset(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vector6<f64> {
        let (sin, cos) = (self.order * u[self.joint]).sin_cos();
        let mut out = Vector6::zeros();
        out[self.joint] = self.sine_rad * sin + self.cosine_rad * cos;
        out
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(&self, u: &[R; 6], out: &mut [R; 6]) {
        let (sin, cos) = sin_cos(u[self.joint].splat(self.order) * u[self.joint]);
        out[self.joint] += sin.splat(self.sine_rad) * sin + cos.splat(self.cosine_rad) * cos;
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: SinCos>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        let (sin, cos) = sin_cos(u[self.joint].splat(self.order) * u[self.joint]);
        let slope =
            cos.splat(self.order * self.sine_rad) * cos - sin.splat(self.order * self.cosine_rad) * sin;
        out[self.joint] += slope * step[self.joint];
    }

    pub(super) fn jacobian(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let (sin, cos) = (self.order * u[self.joint]).sin_cos();
        let mut out = Matrix6::zeros();
        out[(self.joint, self.joint)] = self.order * (self.sine_rad * cos - self.cosine_rad * sin);
        out
    }
}
