//! An error map fixed to one joint: a smooth periodic curve over its turn, for what a few harmonics cannot hold (a worn
//! stretch of teeth, an encoder's ring).
//!
//! δθⱼ = Σ vₘ B(uⱼ M / 2π − m), with B the cubic B-spline and M knots over a turn. Each knot reaches over four
//! spacings only, so a range that was never measured stays where its prior holds it.
//! Source: de Boor, A Practical Guide to Splines, uniform cubic B-spline; Ma et al. 2018 (doi
//! 10.1016/j.rcim.2017.09.006) for joint-dependent error maps.

use std::f64::consts::TAU;

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;

/// Map of one joint.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, error_map::ErrorMap};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // A worn stretch of teeth about angle 0: one knot of twelve, 30° apart.
/// let mut knots_rad = vec![0.0; 12];
/// knots_rad[0] = 6e-4;
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::GearMap(ErrorMap { joint: 0, knots_rad }));
/// let still = Condition::default();
/// let error = |angle_deg: f64| {
///     let q = Joints::new(angle_deg.to_radians(), 0.0, 0.0, 0.0, 0.0, 0.0);
///     arm.at_condition(&still).joint_rotations(&q)[0] - q[0]
/// };
/// // A cubic spline: two thirds of the knot above it, a sixth at its neighbours, nothing two spacings away.
/// assert!((error(0.0) - 4e-4).abs() < 1e-12 && (error(-30.0) - 1e-4).abs() < 1e-12);
/// assert!(error(60.0).abs() < 1e-12 && error(180.0) == 0.0);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorMap {
    /// Joint, 0-based.
    pub joint: usize,
    /// Values at the knots (rad), evenly spaced over a turn from angle 0; at least four.
    pub knots_rad: Vec<f64>,
}

impl ErrorMap {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        self.knots_rad.iter().map(|&value| EffectParameter { name: "knot", unit: "rad", value }).collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        if let Some(knot) = self.knots_rad.get_mut(index) {
            *knot = value;
        }
    }

    /// First of the four knots that reach to `u`, and their weights with the weights' slopes (1/rad).
    fn near(&self, u: f64) -> (usize, [f64; 4], [f64; 4]) {
        let count = self.knots_rad.len().max(1);
        let place = (u / TAU).rem_euclid(1.0) * count as f64;
        let t = place - place.floor();
        let s = 1.0 - t;
        let weights = [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ];
        let scale = count as f64 / TAU;
        let slopes = [
            -0.5 * s * s * scale,
            (1.5 * t * t - 2.0 * t) * scale,
            (2.0 * s - 1.5 * s * s) * scale,
            0.5 * t * t * scale,
        ];
        // An angle that is not finite has no knot; its weight goes to the first.
        let first = if place.is_finite() { (place as usize + count - 1) % count } else { 0 };
        (first, weights, slopes)
    }

    /// The knots that reach to the angle `u` (rad).
    pub fn reached(&self, u: f64) -> [usize; 4] {
        let count = self.knots_rad.len().max(1);
        let (first, ..) = self.near(u);
        std::array::from_fn(|k| (first + k) % count)
    }

    fn sum(&self, first: usize, weights: &[f64; 4]) -> f64 {
        let count = self.knots_rad.len();
        if count == 0 {
            return 0.0;
        }
        weights.iter().enumerate().map(|(k, w)| w * self.knots_rad[(first + k) % count]).sum()
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let count = self.knots_rad.len();
        let mut out = vec![Vector6::zeros(); count];
        let (first, weights, _) = self.near(u[self.joint]);
        for (k, w) in weights.iter().enumerate() {
            if let Some(place) = out.get_mut((first + k) % count.max(1)) {
                place[self.joint] += w;
            }
        }
        out
    }

    pub(super) fn offset(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vector6<f64> {
        let mut out = Vector6::zeros();
        let (first, weights, _) = self.near(u[self.joint]);
        out[self.joint] = self.sum(first, &weights);
        out
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, u: &[R; 6], out: &mut [R; 6]) {
        out[self.joint] += u[self.joint].each(|u| {
            let (first, weights, _) = self.near(u);
            self.sum(first, &weights)
        });
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: Real>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        let slope = u[self.joint].each(|u| {
            let (first, _, slopes) = self.near(u);
            self.sum(first, &slopes)
        });
        out[self.joint] += slope * step[self.joint];
    }

    pub(super) fn jacobian(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        let (first, _, slopes) = self.near(u[self.joint]);
        out[(self.joint, self.joint)] = self.sum(first, &slopes);
        out
    }
}
