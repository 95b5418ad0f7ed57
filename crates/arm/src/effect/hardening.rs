//! A joint that stiffens under its load: it yields with the first newton metres, and hardly more with the next ones,
//!
//! δθⱼ = p τ/(|τ| + β),
//!
//! τ the torque of gravity about its axis and β the torque at which it has yielded by half of p. Where β is small this is play that gravity
//! closes: the link lies p to the side of the flank that bears. A compliance of the same joint adds the part in proportion to the torque.
//!
//! Source: torsion of harmonic drives, of which data sheets state stiffness by sections, soft ones first.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::joint_load::{PointMass, torque, torque_and_slopes, torque_of_arm};
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{Real, SinCos};

/// A joint that stiffens under its load.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, hardening::Hardening, joint_load::PointMass};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // A kilogram at the elbow, 0.27 m before the shoulder: 2.65 N m, half of the deflection and a little more.
/// let lump = vec![PointMass { frame: 2, mass_kg: 1.0 }];
/// let spring = Hardening { joint: 1, mass: lump, half_nm: 2.0, deflection_rad: 2e-4 };
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::JointStiffness(spring));
/// let level = Joints::new(0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0);
/// let turned = arm.at_condition(&Condition::default()).joint_rotations(&level) - level;
/// let torque = 0.27 * 9.80665;
/// assert!((turned[1] - 2e-4 * torque / (torque + 2.0)).abs() < 1e-12);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hardening {
    /// Joint, 0-based.
    pub joint: usize,
    /// What loads it, where the arm's masses are not known; none for the masses of the arm and the payload.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mass: Vec<PointMass>,
    /// β (N m), under that load.
    pub half_nm: f64,
    /// p (rad).
    pub deflection_rad: f64,
}

impl Hardening {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "deflection", unit: "rad", value: self.deflection_rad }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.deflection_rad = value;
    }

    /// What share of the deflection a torque makes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn share<R: Real>(&self, torque: R) -> R {
        let above = torque.positive();
        let size = torque * (above + above - torque.splat(1.0));
        torque / (size + torque.splat(self.half_nm))
    }

    pub(super) fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let u: [f64; 6] = (*u).into();
        let torque =
            torque((self.joint, &self.mass), statics, &u, &torque_of_arm(&self.mass, statics, &u, condition));
        vec![Vector6::ith(self.joint, self.share(torque))]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.deflection_rad
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        of_arm: &[R; 6],
        out: &mut [R; 6],
    ) {
        let share = self.share(torque((self.joint, &self.mass), statics, u, of_arm));
        out[self.joint] += u[0].splat(self.deflection_rad) * share;
    }

    /// ∂δθ/∂τ = p β/(|τ| + β)².
    pub(super) fn jacobian(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Matrix6<f64> {
        let (torque, slopes) = torque_and_slopes((self.joint, &self.mass), statics, u, condition);
        let yielded = torque.abs() + self.half_nm;
        let slope = self.deflection_rad * self.half_nm / (yielded * yielded);
        let mut out = Matrix6::zeros();
        out.set_row(self.joint, &(slopes * slope).transpose());
        out
    }
}
