//! A joint whose deflection is not in proportion to its torque, by an unknown law: square and cube of the torque, alike to both sides,
//!
//! δθⱼ = a t |t| + b t³, t the torque τ of gravity about its axis, limited to ±T, the largest torque of the measurement.
//!
//! Beyond T it stays as it is there, since powers go anywhere. A compliance of the same joint has the part in proportion to the torque.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::joint_load::{PointMass, torque, torque_and_slopes, torque_of_arm};
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{Real, SinCos};

/// Square and cube of the torque about one joint.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, joint_load::PointMass, torque_powers::TorquePowers};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // A kilogram at the elbow, 0.27 m before the shoulder: 2.65 N m.
/// let mass = vec![PointMass { frame: 2, mass_kg: 1.0 }];
/// let powers = TorquePowers { joint: 1, mass, largest_nm: 10.0, square_rad_per_nm2: 1e-5, cube_rad_per_nm3: 2e-6 };
/// let turned = |largest_nm: f64| {
///     let effects = vec![Effect::TorquePowers(TorquePowers { largest_nm, ..powers.clone() })];
///     let arm = Model { effects, ..robots::load("abb-irb-120").unwrap().model };
///     let level = Joints::new(0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0);
///     arm.at_condition(&Condition::default()).joint_rotations(&level)[1] - level[1]
/// };
/// let at = |t: f64| 1e-5 * t * t.abs() + 2e-6 * t * t * t;
/// assert!((turned(10.0) - at(0.27 * 9.80665)).abs() < 1e-12);
/// assert!((turned(1.5) - at(1.5)).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorquePowers {
    /// Joint, 0-based.
    pub joint: usize,
    /// What loads it, where the arm's masses are not known; none for the masses of the arm and the payload.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mass: Vec<PointMass>,
    /// T (N m), under that load.
    pub largest_nm: f64,
    /// a (rad/(N m)²), of the square with the sign of the torque.
    pub square_rad_per_nm2: f64,
    /// b (rad/(N m)³).
    pub cube_rad_per_nm3: f64,
}

impl TorquePowers {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![
            EffectParameter {
                name: "square of the torque",
                unit: "rad/(N m)²",
                value: self.square_rad_per_nm2,
            },
            EffectParameter { name: "cube of the torque", unit: "rad/(N m)³", value: self.cube_rad_per_nm3 },
        ]
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        *(if index == 0 { &mut self.square_rad_per_nm2 } else { &mut self.cube_rad_per_nm3 }) = value;
    }

    /// t, the limited torque, and |t|.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn limited<R: Real>(&self, torque: R) -> (R, R) {
        let (largest, one) = (torque.splat(self.largest_nm), torque.splat(1.0));
        let above = torque.positive();
        let (side, within) = (above + above - one, torque.within(self.largest_nm));
        let size = within * torque * side + (one - within) * largest;
        (side * size, size)
    }

    pub(super) fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let u: [f64; 6] = (*u).into();
        let of_arm = torque_of_arm(&self.mass, statics, &u, condition);
        let (t, size) = self.limited(torque((self.joint, &self.mass), statics, &u, &of_arm));
        [size * t, size * size * t].map(|power| Vector6::ith(self.joint, power)).to_vec()
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        let u: [f64; 6] = (*u).into();
        let mut out = [0.0; 6];
        self.add_offset(statics, &u, &torque_of_arm(&self.mass, statics, &u, condition), &mut out);
        out.into()
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        of_arm: &[R; 6],
        out: &mut [R; 6],
    ) {
        let (t, size) = self.limited(torque((self.joint, &self.mass), statics, u, of_arm));
        let (square, cube) = (u[0].splat(self.square_rad_per_nm2), u[0].splat(self.cube_rad_per_nm3));
        out[self.joint] += size * t * (square + cube * size);
    }

    pub(super) fn jacobian(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Matrix6<f64> {
        let (t, slopes) = torque_and_slopes((self.joint, &self.mass), statics, u, condition);
        let (inside, size) = (t.within(self.largest_nm), t.abs());
        let slope = inside * size * (2.0 * self.square_rad_per_nm2 + 3.0 * self.cube_rad_per_nm3 * size);
        let mut out = Matrix6::zeros();
        out.set_row(self.joint, &(slopes * slope).transpose());
        out
    }
}
