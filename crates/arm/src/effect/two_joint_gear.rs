//! An error of a joint that depends on its own angle and on that of another, as where the cables or gears of one cross the other:
//!
//! δθⱼ = a sin σ + b cos σ + c sin δ + d cos δ, σ = m uⱼ + n uₖ, δ = m uⱼ − n uₖ,
//!
//! the products of the m-th harmonics of the one and the n-th of the other. Beyond the measured angles it stays as small as within.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{SinCos, sin_cos};

/// Error of joint `joint` with its angle and that of joint `other`.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, two_joint_gear::TwoJointGear};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // sin(a + b) / 2 + sin(a − b) / 2 = sin a cos b: an eccentric gear whose run-out another joint turns.
/// let gear = TwoJointGear { joint: 4, other: 5, orders: [1, 1], sum_rad: [1e-4, 0.0], difference_rad: [1e-4, 0.0] };
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::GearTwoJoints(gear));
/// let q = Joints::new(0.1, 0.2, 0.3, 0.4, 0.5, 0.6);
/// let turned = arm.at_condition(&Condition::default()).joint_rotations(&q) - q;
/// assert!((turned[4] - 2e-4 * 0.5_f64.sin() * 0.6_f64.cos()).abs() < 1e-12);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TwoJointGear {
    /// The joint that is off, 0-based.
    pub joint: usize,
    /// The other, 0-based.
    pub other: usize,
    /// m and n: periods per turn of the joint and of the other.
    pub orders: [u8; 2],
    /// a and b: factors of sine and cosine of the sum (rad).
    pub sum_rad: [f64; 2],
    /// c and d: factors of sine and cosine of the difference (rad).
    pub difference_rad: [f64; 2],
}

impl TwoJointGear {
    /// The error between two joints with these orders, at size 0.
    pub fn still(joint: usize, other: usize, orders: [u8; 2]) -> Self {
        Self { joint, other, orders, sum_rad: [0.0; 2], difference_rad: [0.0; 2] }
    }

    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let ([a, b], [c, d]) = (self.sum_rad, self.difference_rad);
        [
            ("sine of the sum", a),
            ("cosine of the sum", b),
            ("sine of the difference", c),
            ("cosine of the difference", d),
        ]
        .map(|(name, value)| EffectParameter { name, unit: "rad", value })
        .to_vec()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        match index {
            0 | 1 => self.sum_rad[index] = value,
            _ => self.difference_rad[(index - 2).min(1)] = value,
        }
    }

    /// The sum and the difference of the multiples.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn angles<R: SinCos>(&self, u: &[R; 6]) -> [R; 2] {
        let [m, n] = self.orders.map(|order| u[0].splat(f64::from(order)));
        let (own, other) = (m * u[self.joint], n * u[self.other]);
        [own + other, own - other]
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let waves = self.angles::<f64>(&(*u).into()).map(f64::sin_cos);
        let along = |value: f64| Vector6::ith(self.joint, value);
        waves.iter().flat_map(|&(sin, cos)| [along(sin), along(cos)]).collect()
    }

    pub(super) fn offset(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vector6<f64> {
        let mut out = [0.0; 6];
        self.add_offset::<f64>(&(*u).into(), &mut out);
        out.into()
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(&self, u: &[R; 6], out: &mut [R; 6]) {
        for (angle, [sine, cosine]) in self.angles(u).into_iter().zip([self.sum_rad, self.difference_rad]) {
            let (sin, cos) = sin_cos(angle);
            out[self.joint] += sin.splat(sine) * sin + cos.splat(cosine) * cos;
        }
    }

    /// Slopes against the sum and the difference.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn slopes<R: SinCos>(&self, u: &[R; 6]) -> [R; 2] {
        let [sum, difference] = self.angles(u).map(sin_cos);
        let slope =
            |(sin, cos): (R, R), [sine, cosine]: [f64; 2]| cos.splat(sine) * cos - sin.splat(cosine) * sin;
        [slope(sum, self.sum_rad), slope(difference, self.difference_rad)]
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: SinCos>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        let ([sum, difference], [along_sum, along_difference]) = (self.slopes(u), self.angles(step));
        out[self.joint] += sum * along_sum + difference * along_difference;
    }

    pub(super) fn jacobian(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let [sum, difference] = self.slopes::<f64>(&(*u).into());
        let [m, n] = self.orders.map(f64::from);
        let mut out = Matrix6::zeros();
        out[(self.joint, self.joint)] = m * (sum + difference);
        out[(self.joint, self.other)] += n * (sum - difference);
        out
    }
}
