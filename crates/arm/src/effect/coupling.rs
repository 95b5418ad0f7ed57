//! Coupling: one joint moves along with another, as in the gear trains of wrists: δθⱼ = κ uᵢ.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;

/// Coupling of joint `driver` into joint `joint`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coupling {
    /// The joint that is moved along, 0-based.
    pub joint: usize,
    /// The joint that moves it, 0-based.
    pub driver: usize,
    /// Turns of `joint` for one turn of `driver`.
    pub factor: f64,
}

impl Coupling {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "factor", unit: "1", value: self.factor }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.factor = value;
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let mut out = Vector6::zeros();
        out[self.joint] = u[self.driver];
        vec![out]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.factor
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, u: &[R; 6], out: &mut [R; 6]) {
        out[self.joint] += u[self.driver].splat(self.factor) * u[self.driver];
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: Real>(&self, step: &[R; 6], out: &mut [R; 6]) {
        self.add_offset(step, out);
    }

    pub(super) fn jacobian(&self, _: &Statics, _: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        out[(self.joint, self.driver)] = self.factor;
        out
    }
}
