//! A gear ratio that is not the nominal one: δθⱼ = ρ uⱼ.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;

/// Ratio error of one joint.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, gear_ratio::GearRatio};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // A joint that turns by 0.05 % too much errs the more the farther it turns.
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::GearRatio(GearRatio { joint: 3, error: 5e-4 }));
/// let turned = arm.at_condition(&Condition::default()).joint_rotations(&Joints::new(0.0, 0.0, 0.0, 2.0, 0.0, 0.0));
/// assert!((turned[3] - 2.001).abs() < 1e-12);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GearRatio {
    /// Joint, 0-based.
    pub joint: usize,
    /// Relative error of the ratio.
    pub error: f64,
}

impl GearRatio {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "ratio error", unit: "1", value: self.error }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.error = value;
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let mut out = Vector6::zeros();
        out[self.joint] = u[self.joint];
        vec![out]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.error
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, u: &[R; 6], out: &mut [R; 6]) {
        out[self.joint] += u[self.joint].splat(self.error) * u[self.joint];
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: Real>(&self, step: &[R; 6], out: &mut [R; 6]) {
        self.add_offset(step, out);
    }

    pub(super) fn jacobian(&self, _: &Statics, _: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        out[(self.joint, self.joint)] = self.error;
        out
    }
}
