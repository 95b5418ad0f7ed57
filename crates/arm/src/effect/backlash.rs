//! Backlash: the joint rests on one or the other flank, depending on the side it came from: δθⱼ = b/2 · approachⱼ.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;

/// Play of one joint.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, backlash::Backlash};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::Backlash(Backlash { joint: 1, play_rad: 4e-4 }));
/// let from = |side| Condition { approach: [0, side, 0, 0, 0, 0], ..Condition::default() };
/// let turned = |condition: &Condition| arm.at_condition(condition).joint_rotations(&Joints::zeros())[1];
/// // From above and from below the joint rests on flanks that are one play apart; where the side is not known, between them.
/// assert!((turned(&from(1)) - turned(&from(-1)) - 4e-4).abs() < 1e-15);
/// assert_eq!(turned(&from(0)), 0.0);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// Joint, 0-based.
    pub joint: usize,
    /// Play between the flanks b (rad).
    pub play_rad: f64,
}

impl Backlash {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "play", unit: "rad", value: self.play_rad }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.play_rad = value;
    }

    pub(super) fn regressors(
        &self,
        _: &Statics,
        _: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let mut out = Vector6::zeros();
        out[self.joint] = 0.5 * f64::from(condition.approach[self.joint]);
        vec![out]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.play_rad
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, condition: &Condition, out: &mut [R; 6]) {
        let side = f64::from(condition.approach[self.joint]);
        out[self.joint] += out[self.joint].splat(self.play_rad * 0.5 * side);
    }

    pub(super) fn jacobian(&self, _: &Statics, _: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        Matrix6::zeros()
    }
}
