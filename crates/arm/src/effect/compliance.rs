//! Joint compliance: a joint and its reducer yield under the torque of gravity.
//!
//! δθⱼ = cⱼ τⱼ(u), with cⱼ the torsional compliance (rad/(N m)) and τⱼ the static torque about the axis.
//! Source: the elastostatic joint model of Nubiola and Bonev 2013 (doi 10.1016/j.rcim.2012.06.004), section 3.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;

/// Compliance of one joint.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, compliance::Compliance};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::JointCompliance(Compliance { joint: 1, compliance_rad_per_nm: 1e-5 }));
/// let loaded = |kg| Condition { payload_kg: Some(kg), ..Condition::default() };
/// let height = |kg| arm.forward(&Joints::zeros(), &loaded(kg)).translation.z;
/// // 3 kg, 374 mm in front of axis 2: 11.0 N m turn it by 1.1e-4 rad, and the flange sinks by 0.041 mm.
/// let torque_nm = 3.0 * 9.80665 * 0.374;
/// assert!((height(0.0) - height(3.0) - 374.0 * 1e-5 * torque_nm).abs() < 1e-4);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compliance {
    /// Joint, 0-based.
    pub joint: usize,
    /// Torsional compliance (rad/(N m)).
    pub compliance_rad_per_nm: f64,
}

impl Compliance {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "compliance", unit: "rad/(N m)", value: self.compliance_rad_per_nm }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.compliance_rad_per_nm = value;
    }

    pub(super) fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let mut out = Vector6::zeros();
        out[self.joint] = statics.torques_and_jacobian(u, condition).0[self.joint];
        vec![out]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.compliance_rad_per_nm
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, torque: &[R; 6], out: &mut [R; 6]) {
        out[self.joint] += torque[self.joint].splat(self.compliance_rad_per_nm) * torque[self.joint];
    }

    pub(super) fn jacobian(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        self.add_jacobian(&statics.torques_and_jacobian(u, condition).1, &mut out);
        out
    }

    /// Adds the slope, given that of the torques.
    pub(crate) fn add_jacobian(&self, torque: &Matrix6<f64>, out: &mut Matrix6<f64>) {
        for i in 0..6 {
            out[(self.joint, i)] += self.compliance_rad_per_nm * torque[(self.joint, i)];
        }
    }
}
