//! Backlash of a joint that gravity loads: where the load exceeds the friction it closes the play, and the joint rests on the flank that
//! bears; elsewhere on the flank of the side from which it came, as without a load:
//!
//! δθⱼ = b/2 · (σ(τ) − σ(−τ) + (1 − σ(τ) − σ(−τ)) · approachⱼ),  σ(τ) = ½ + ½ x/√(1 + x²),  x = (τ − f)/c,
//!
//! τ the torque of gravity about its axis, f that of the friction, and c that over which the one state passes into the other: a smooth step,
//! which a solver can follow.
//!
//! Source: the usual model of play with Coulomb friction at rest, in which what exceeds the friction moves the link to its flank.

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::effect::joint_load::{PointMass, torque, torque_and_slopes, torque_of_arm};
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::joints::MappedJoints;
use truegrind_math::lanes::{Real, SinCos};

/// Play of one joint that its load closes.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, joint_load::PointMass, loaded_backlash::LoadedBacklash};
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
///
/// // A kilogram at the elbow, 0.27 m before the shoulder: 2.65 N m.
/// let lump = vec![PointMass { frame: 2, mass_kg: 1.0 }];
/// let play = LoadedBacklash { joint: 1, mass: lump, friction_nm: 1.0, closing_nm: 0.01, play_rad: 4e-4 };
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::LoadedBacklash(play));
/// let turned = |q: &Joints, side| {
///     let from = Condition { approach: [0, side, 0, 0, 0, 0], ..Condition::default() };
///     (arm.at_condition(&from).joint_rotations(q) - q)[1]
/// };
/// // Stretched out, gravity closes the play from wherever the joint came; upright, the side decides.
/// let level = Joints::new(0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0);
/// assert!([-1, 0, 1].iter().all(|&side| (turned(&level, side) - 2e-4).abs() < 1e-8));
/// assert!((turned(&Joints::zeros(), -1) + 2e-4).abs() < 1e-8);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadedBacklash {
    /// Joint, 0-based.
    pub joint: usize,
    /// What loads it, where the arm's masses are not known; none for the masses of the arm and the payload.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mass: Vec<PointMass>,
    /// f (N m), under that load.
    pub friction_nm: f64,
    /// c (N m), under that load.
    pub closing_nm: f64,
    /// Play between the flanks b (rad).
    pub play_rad: f64,
}

impl LoadedBacklash {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter { name: "play", unit: "rad", value: self.play_rad }]
    }

    pub(super) fn set(&mut self, _index: usize, value: f64) {
        self.play_rad = value;
    }

    /// x.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn excess<R: Real>(&self, torque: R) -> R {
        (torque - torque.splat(self.friction_nm)) * torque.splat(1.0 / self.closing_nm)
    }

    /// σ: how far a torque has closed the play towards its side.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn closed<R: Real>(&self, torque: R) -> R {
        let (x, half) = (self.excess(torque), torque.splat(0.5));
        half + half * x / (x * x + torque.splat(1.0)).sqrt()
    }

    /// The flank, −1 to 1, under a torque, for a joint that came from `side`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn flank<R: Real>(&self, torque: R, side: f64) -> R {
        let (above, below) = (self.closed(torque), self.closed(-torque));
        let one = torque.splat(1.0);
        above - below + (one - above - below) * torque.splat(side)
    }

    fn torque(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> f64 {
        let u: [f64; 6] = (*u).into();
        torque((self.joint, &self.mass), statics, &u, &torque_of_arm(&self.mass, statics, &u, condition))
    }

    /// What of the play the load leaves open (rad).
    pub(super) fn open_play_rad(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> f64 {
        let torque = self.torque(statics, u, condition);
        self.play_rad * (1.0 - self.closed(torque) - self.closed(-torque))
    }

    pub(super) fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let side = f64::from(condition.approach[self.joint]);
        vec![Vector6::ith(self.joint, 0.5 * self.flank(self.torque(statics, u, condition), side))]
    }

    pub(super) fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        self.regressors(statics, u, condition)[0] * self.play_rad
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn add_offset<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        of_arm: &[R; 6],
        condition: &Condition,
        out: &mut [R; 6],
    ) {
        let side = f64::from(condition.approach[self.joint]);
        let flank = self.flank(torque((self.joint, &self.mass), statics, u, of_arm), side);
        out[self.joint] += u[0].splat(0.5 * self.play_rad) * flank;
    }

    /// ∂δθ/∂τ = b/2 · (σ′(τ) (1 − approach) + σ′(−τ) (1 + approach)), σ′ = (1 + x²)^(−3/2)/2c.
    pub(super) fn jacobian(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Matrix6<f64> {
        let (torque, slopes) = torque_and_slopes((self.joint, &self.mass), statics, u, condition);
        let side = f64::from(condition.approach[self.joint]);
        let steepness = |torque: f64| 0.5 / self.closing_nm * (1.0 + self.excess(torque).powi(2)).powf(-1.5);
        let flank = steepness(torque) * (1.0 - side) + steepness(-torque) * (1.0 + side);
        let slope = 0.5 * self.play_rad * flank;
        let mut out = Matrix6::zeros();
        out.set_row(self.joint, &(slopes * slope).transpose());
        out
    }
}
