//! A smooth correction without a physical name: what a network learned of errors that no other effect explains.
//!
//! δθⱼ = Σₖ wₖⱼ φ(|v − cₖ| / ρ) for the first three joints, v their angles. These three place the wrist, so this is a
//! smooth displacement of the arm as a function of where its wrist stands; put on the joints it goes through forward
//! map, inverse and Jacobians like every other effect. φ is a bump of compact support
//! ([`truegrind_math::radial`]): outside the region of its centres the correction is exactly nothing.
//!
//! Source: M5 of ukf-vslm-2023 corrects target positions by a radial basis function network; there the network's output
//! is a displacement in mm. Departure: here it is the turn of three joints that makes such a displacement, since a
//! cable or a position does not tell how the hand would turn with it.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::Real;
use truegrind_math::radial;

/// Joints that the correction looks at and turns.
pub const JOINTS: usize = 3;

/// A network over the first three joints.
///
/// ```
/// use truegrind_arm::effect::smooth_correction::SmoothCorrection;
/// use truegrind_arm::effect::Effect;
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// let plain = robots::load("abb-irb-120")?.model;
/// let mut learned = SmoothCorrection::still(vec![[0.2, -0.3, 0.1]], 0.5);
/// learned.weights_rad[0] = [1e-4, 0.0, -2e-4];
/// let (near, far) = (Joints::new(0.2, -0.3, 0.1, 0.0, 0.4, 0.0), Joints::new(1.2, 0.4, 0.1, 0.0, 0.4, 0.0));
/// assert!(learned.reaches(&plain.mapped(&near)) && !learned.reaches(&plain.mapped(&far)));
/// let arm = Model { effects: vec![Effect::SmoothCorrection(learned)], ..plain };
/// let still = Default::default();
/// let added = |q: &Joints| arm.at_condition(&still).joint_rotations(q) - q;
/// assert!((added(&near) - Joints::new(1e-4, 0.0, -2e-4, 0.0, 0.0, 0.0)).norm() < 1e-12);
/// assert_eq!(added(&far), Joints::zeros());
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SmoothCorrection {
    /// Centres in the angles of the first three joints, after the joint map (rad).
    pub centres_rad: Vec<[f64; JOINTS]>,
    /// ρ: how far a centre reaches (rad).
    pub reach_rad: f64,
    /// For each centre, the turn that its bump adds to each of the three joints (rad).
    pub weights_rad: Vec<[f64; JOINTS]>,
}

impl SmoothCorrection {
    /// A correction that does nothing yet.
    pub fn still(centres_rad: Vec<[f64; JOINTS]>, reach_rad: f64) -> Self {
        let weights_rad = vec![[0.0; JOINTS]; centres_rad.len()];
        Self { centres_rad, reach_rad, weights_rad }
    }

    /// Whether mapped joint angles lie within the reach of a centre; elsewhere the correction is zero.
    pub fn reaches(&self, u: &MappedJoints) -> bool {
        let v = [u[0], u[1], u[2]];
        self.centres_rad.iter().any(|c| radial::distance(&v, c) < self.reach_rad)
    }

    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let values = self.weights_rad.iter().flatten();
        values.map(|value| EffectParameter { name: "weight", unit: "rad", value: *value }).collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        if let Some(weights) = self.weights_rad.get_mut(index / JOINTS) {
            weights[index % JOINTS] = value;
        }
    }

    pub(super) fn regressors(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vec<Vector6<f64>> {
        let v = [u[0], u[1], u[2]];
        let mut out = Vec::with_capacity(JOINTS * self.centres_rad.len());
        for centre in &self.centres_rad {
            let bump: f64 = radial::wendland(&v, centre, self.reach_rad);
            for joint in 0..JOINTS {
                let mut turn = Vector6::zeros();
                turn[joint] = bump;
                out.push(turn);
            }
        }
        out
    }

    pub(super) fn offset(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Vector6<f64> {
        let mut out = [0.0; 6];
        self.add_offset(&(*u).into(), &mut out);
        out.into()
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: Real>(&self, u: &[R; 6], out: &mut [R; 6]) {
        let v = [u[0], u[1], u[2]];
        for (centre, weights) in self.centres_rad.iter().zip(&self.weights_rad) {
            let bump = radial::wendland(&v, centre, self.reach_rad);
            for joint in 0..JOINTS {
                out[joint] += bump.splat(weights[joint]) * bump;
            }
        }
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_jacobian_product<R: Real>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        let (v, along) = ([u[0], u[1], u[2]], [step[0], step[1], step[2]]);
        for (centre, weights) in self.centres_rad.iter().zip(&self.weights_rad) {
            let slope = radial::wendland_slope(&v, centre, self.reach_rad, &along);
            for joint in 0..JOINTS {
                out[joint] += slope.splat(weights[joint]) * slope;
            }
        }
    }

    pub(super) fn jacobian(&self, _: &Statics, u: &MappedJoints, _: &Condition) -> Matrix6<f64> {
        let mut out = Matrix6::zeros();
        for column in 0..JOINTS {
            let (mut step, mut moved) = ([0.0; 6], [0.0; 6]);
            step[column] = 1.0;
            self.add_jacobian_product(&(*u).into(), &step, &mut moved);
            (0..JOINTS).for_each(|row| out[(row, column)] = moved[row]);
        }
        out
    }
}
