//! Physical effects beyond rigid links, one file each: offsets of joint angles, growth of links, motions of links against each other.
//!
//! Every joint effect is linear in its parameters: it adds Σ pₖ φₖ(u, condition) to the mapped joint angles u, so one
//! set of regressors φ serves simulation, identification and compensation. Model selection is not
//! part of this module.

pub mod bending;
pub mod compliance;
pub mod lumped_compliance;
pub mod hardening;
pub mod torque_powers;
pub mod joint_load;
pub mod harmonic;
pub mod error_map;
pub mod gear_ratio;
pub mod coupling;
pub mod two_joint_gear;
pub mod backlash;
pub mod loaded_backlash;
pub mod thermal;
pub mod axis_wobble;
pub mod base_tilt;
pub mod link_twist;
pub mod smooth_correction;
pub mod bounds;
mod parameter;
mod statics;

use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

use self::axis_wobble::AxisWobble;
use self::backlash::Backlash;
use self::base_tilt::BaseTilt;
use self::bending::Bending;
use self::compliance::Compliance;
use self::coupling::Coupling;
use self::error_map::ErrorMap;
use self::gear_ratio::GearRatio;
use self::hardening::Hardening;
use self::harmonic::Harmonic;
use self::link_twist::LinkTwist;
use self::loaded_backlash::LoadedBacklash;
use self::lumped_compliance::LumpedCompliance;
use self::smooth_correction::SmoothCorrection;
use self::thermal::Thermal;
use self::torque_powers::TorquePowers;
use self::two_joint_gear::TwoJointGear;
use crate::chain::Chain;
use crate::condition::Condition;
use crate::joints::MappedJoints;
use crate::link_motion::LinkMotion;
use truegrind_math::lanes::SinCos;

pub use self::parameter::EffectParameter;
pub use self::statics::Statics;

/// One effect with its parameters. The serialised names are those of the diagnosis contract.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "effect", rename_all = "kebab-case")]
pub enum Effect {
    /// A joint that yields under the static torque of gravity.
    JointCompliance(Compliance),
    /// The same where masses or gravity's direction are unknown.
    #[serde(rename = "joint-compliance-lumped")]
    LumpedCompliance(LumpedCompliance),
    /// A joint that stiffens under its load.
    JointStiffness(Hardening),
    /// A joint whose deflection is not in proportion to its torque, by an unknown law.
    #[serde(rename = "joint-stiffness-powers")]
    TorquePowers(TorquePowers),
    /// A link that bends between two parallel axes.
    LinkBending(Bending),
    /// A link that twists under a load beside it, between two parallel axes.
    LinkTwist(LinkTwist),
    /// An eccentric gear: once or twice per joint turn.
    GearEccentricity(Harmonic),
    /// A line of the reducer at a higher order.
    GearTransmission(Harmonic),
    /// An error map fixed to a joint.
    #[serde(rename = "gear-transmission-map")]
    GearMap(ErrorMap),
    /// A gear whose ratio is not the nominal one.
    GearRatio(GearRatio),
    /// An error of a joint that depends on its own angle and on another's.
    GearTwoJoints(TwoJointGear),
    /// A joint that moves along with another.
    JointCoupling(Coupling),
    /// Play that depends on the side from which the joint came.
    Backlash(Backlash),
    /// The same where gravity closes the play.
    #[serde(rename = "backlash-loaded")]
    LoadedBacklash(LoadedBacklash),
    /// Links that grow with time or temperature.
    ThermalDrift(Thermal),
    /// An axis that wobbles in its bearing.
    AxisWobble(AxisWobble),
    /// A base that tilts under the arm.
    BaseTilt(BaseTilt),
    /// A learned smooth correction without a physical cause.
    SmoothCorrection(SmoothCorrection),
}

/// What each effect does that turns joints; `$still` of those that grow or move links instead.
macro_rules! turning {
    ($self:expr, $e:ident => $body:expr, $still:expr) => {
        match $self {
            Effect::JointCompliance($e) => $body,
            Effect::LumpedCompliance($e) => $body,
            Effect::JointStiffness($e) => $body,
            Effect::TorquePowers($e) => $body,
            Effect::LinkBending($e) => $body,
            Effect::GearMap($e) => $body,
            Effect::GearEccentricity($e) | Effect::GearTransmission($e) => $body,
            Effect::GearRatio($e) => $body,
            Effect::GearTwoJoints($e) => $body,
            Effect::JointCoupling($e) => $body,
            Effect::Backlash($e) => $body,
            Effect::LoadedBacklash($e) => $body,
            Effect::SmoothCorrection($e) => $body,
            Effect::ThermalDrift(_) | Effect::AxisWobble(_) | Effect::BaseTilt(_) | Effect::LinkTwist(_) => {
                $still
            }
        }
    };
}

/// The same of all.
macro_rules! each {
    ($self:expr, $e:ident => $body:expr) => {
        match $self {
            Effect::ThermalDrift($e) => $body,
            Effect::AxisWobble($e) => $body,
            Effect::BaseTilt($e) => $body,
            Effect::LinkTwist($e) => $body,
            // Of these no other is left.
            turning => turning!(turning, $e => $body, Default::default()),
        }
    };
}

impl Effect {
    /// The contract name of the effect.
    pub fn name(&self) -> &'static str {
        match self {
            Effect::JointCompliance(_) | Effect::LumpedCompliance(_) => "joint-compliance",
            Effect::JointStiffness(_) | Effect::TorquePowers(_) => "joint-stiffness",
            Effect::LinkBending(_) => "link-bending",
            Effect::LinkTwist(_) => "link-twist",
            Effect::GearEccentricity(_) => "gear-eccentricity",
            Effect::GearTransmission(_) | Effect::GearMap(_) => "gear-transmission",
            Effect::GearRatio(_) => "gear-ratio",
            Effect::GearTwoJoints(_) => "gear-two-joints",
            Effect::JointCoupling(_) => "joint-coupling",
            Effect::Backlash(_) | Effect::LoadedBacklash(_) => "backlash",
            Effect::ThermalDrift(_) => "thermal-drift",
            Effect::AxisWobble(_) => "axis-wobble",
            Effect::BaseTilt(_) => "base-tilt",
            Effect::SmoothCorrection(_) => "smooth-correction",
        }
    }

    /// The joint (0-based) that the effect acts on; `None` where it acts on the links or on several joints.
    pub fn joint(&self) -> Option<usize> {
        match self {
            Effect::JointCompliance(e) => Some(e.joint),
            Effect::LumpedCompliance(e) => Some(e.joint),
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => Some(e.joint),
            Effect::GearMap(e) => Some(e.joint),
            Effect::GearRatio(e) => Some(e.joint),
            Effect::JointStiffness(e) => Some(e.joint),
            Effect::TorquePowers(e) => Some(e.joint),
            Effect::GearTwoJoints(e) => Some(e.joint),
            Effect::JointCoupling(e) => Some(e.joint),
            Effect::Backlash(e) => Some(e.joint),
            Effect::LoadedBacklash(e) => Some(e.joint),
            Effect::AxisWobble(e) => Some(e.joint),
            Effect::LinkBending(_)
            | Effect::LinkTwist(_)
            | Effect::ThermalDrift(_)
            | Effect::BaseTilt(_)
            | Effect::SmoothCorrection(_) => None,
        }
    }

    /// Parameters with their present values.
    pub fn parameters(&self) -> Vec<EffectParameter> {
        each!(self, e => e.parameters())
    }

    /// Whether it is a deflection that was identified without the masses of the arm: it holds for the load of the measurement alone.
    pub fn holds_for_one_load(&self) -> bool {
        matches!(self, Effect::LumpedCompliance(_) | Effect::LinkTwist(_))
            || matches!(self, Effect::LinkBending(bending) if bending.frame.is_some())
            || matches!(self, Effect::JointStiffness(spring) if !spring.mass.is_empty())
            || matches!(self, Effect::TorquePowers(powers) if !powers.mass.is_empty())
            || matches!(self, Effect::LoadedBacklash(play) if !play.mass.is_empty())
            || matches!(self, Effect::BaseTilt(tilt) if tilt.term.iter().any(|term| term.frame.is_some()))
    }

    /// Whether all its parameters are 0: it changes nothing and is listed for the covariance alone.
    pub fn is_zero(&self) -> bool {
        self.parameters().iter().all(|parameter| parameter.value == 0.0)
    }

    /// Sets parameter `index` of [`Effect::parameters`].
    pub fn set(&mut self, index: usize, value: f64) {
        each!(self, e => e.set(index, value))
    }

    /// Derivatives of the joint rotations with respect to each parameter, at mapped joint angles `u` (rad).
    pub fn regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<Vector6<f64>> {
        let still = || vec![Vector6::zeros(); self.parameters().len()];
        turning!(self, e => e.regressors(statics, u, condition), still())
    }

    /// Offset that the effect adds to the joint rotations (rad).
    pub fn offset(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Vector6<f64> {
        turning!(self, e => e.offset(statics, u, condition), Vector6::zeros())
    }

    /// Adds [`Effect::offset`] for one row or several in lanes; `torque` from [`Statics::torques`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn add_offset<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        torque: &[R; 6],
        condition: &Condition,
        out: &mut [R; 6],
    ) {
        match self {
            Effect::LumpedCompliance(e) => e.add_offset(statics, u, out),
            Effect::JointStiffness(e) => e.add_offset(statics, u, torque, out),
            Effect::TorquePowers(e) => e.add_offset(statics, u, torque, out),
            Effect::LinkBending(e) => e.add_offset(statics, u, torque, out),
            Effect::GearMap(e) => e.add_offset(u, out),
            Effect::JointCompliance(e) => e.add_offset(torque, out),
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => e.add_offset(u, out),
            Effect::GearRatio(e) => e.add_offset(u, out),
            Effect::GearTwoJoints(e) => e.add_offset(u, out),
            Effect::JointCoupling(e) => e.add_offset(u, out),
            Effect::Backlash(e) => e.add_offset(condition, out),
            Effect::LoadedBacklash(e) => e.add_offset(statics, u, torque, condition, out),
            Effect::SmoothCorrection(e) => e.add_offset(u, out),
            Effect::ThermalDrift(_) | Effect::AxisWobble(_) | Effect::BaseTilt(_) | Effect::LinkTwist(_) => {}
        }
    }

    /// Adds the Jacobian times a step of u, for one row or several in lanes. The Jacobian of what yields, some 1e-3, is neglected,
    /// which Newton's method tolerates.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn add_jacobian_product<R: SinCos>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        match self {
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => e.add_jacobian_product(u, step, out),
            Effect::GearRatio(e) => e.add_jacobian_product(step, out),
            Effect::GearTwoJoints(e) => e.add_jacobian_product(u, step, out),
            Effect::JointCoupling(e) => e.add_jacobian_product(step, out),
            Effect::SmoothCorrection(e) => e.add_jacobian_product(u, step, out),
            Effect::GearMap(e) => e.add_jacobian_product(u, step, out),
            Effect::JointCompliance(_)
            | Effect::LumpedCompliance(_)
            | Effect::JointStiffness(_)
            | Effect::TorquePowers(_)
            | Effect::LinkBending(_)
            | Effect::Backlash(_)
            | Effect::LoadedBacklash(_)
            | Effect::ThermalDrift(_)
            | Effect::AxisWobble(_)
            | Effect::BaseTilt(_)
            | Effect::LinkTwist(_) => {}
        }
    }

    /// Whether the effect depends on the torques of gravity.
    pub fn needs_torque(&self) -> bool {
        match self {
            Effect::JointCompliance(_) => true,
            Effect::JointStiffness(spring) => spring.mass.is_empty(),
            Effect::TorquePowers(powers) => powers.mass.is_empty(),
            Effect::LoadedBacklash(play) => play.mass.is_empty(),
            Effect::LinkBending(bending) => bending.frame.is_none(),
            _ => false,
        }
    }

    /// Derivative of [`Effect::offset`] with respect to u.
    pub fn jacobian(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> Matrix6<f64> {
        turning!(self, e => e.jacobian(statics, u, condition), Matrix6::zeros())
    }

    /// The first frame of the chain that it moves against the rest, with the link that ends there; 0 is the base. `None` where it moves none.
    pub fn first_moved_frame(&self) -> Option<usize> {
        match self {
            Effect::AxisWobble(wobble) => Some(wobble.joint + 1),
            Effect::BaseTilt(_) => Some(0),
            Effect::LinkTwist(twist) => Some(twist.joint + 1),
            _ => None,
        }
    }

    /// That motion, for one row or several in lanes: at mapped angles `u`, with the frames at the joints' `rotations`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn link_motion<R: SinCos>(
        &self,
        statics: &Statics,
        (u, rotations): (&[R; 6], &[R; 6]),
        condition: &Condition,
        frames: &Chain<R>,
    ) -> LinkMotion<R> {
        match self {
            Effect::AxisWobble(wobble) => wobble.motion(frames, rotations),
            Effect::BaseTilt(tilt) => tilt.motion(statics, u, condition),
            Effect::LinkTwist(twist) => twist.motion(statics, frames),
            _ => LinkMotion::none(u[0]),
        }
    }

    /// Derivatives of [`Effect::link_motion`] with respect to the parameters; empty for an effect that moves no link.
    pub fn link_motion_regressors(
        &self,
        statics: &Statics,
        (u, rotations): (&MappedJoints, &Vector6<f64>),
        condition: &Condition,
        frames: &Chain<f64>,
    ) -> Vec<LinkMotion<f64>> {
        match self {
            Effect::AxisWobble(wobble) => wobble.motion_regressors(frames, &(*rotations).into()),
            Effect::BaseTilt(tilt) => tilt.motion_regressors(statics, u, condition),
            Effect::LinkTwist(twist) => twist.motion_regressors(statics, frames),
            _ => Vec::new(),
        }
    }

    /// Derivatives of [`Effect::link_motion`] with respect to the rotations of the joints, with the axes of the moved joint held, and with
    /// respect to the mapped angles.
    pub fn link_motion_slopes(
        &self,
        statics: &Statics,
        (u, rotations): (&MappedJoints, &Vector6<f64>),
        condition: &Condition,
        frames: &Chain<f64>,
    ) -> [[LinkMotion<f64>; 6]; 2] {
        let none = [LinkMotion::none(0.0); 6];
        match self {
            Effect::AxisWobble(wobble) => {
                let mut out = none;
                out[wobble.joint] = wobble.motion_slope(frames, &(*rotations).into());
                [out, none]
            }
            Effect::BaseTilt(tilt) => [none, tilt.motion_slopes(statics, u, condition)],
            _ => [none; 2],
        }
    }

    /// Derivatives of [`Effect::link_motion`] as the part turns about the axes of the base, beyond being carried along; `None` where it only is.
    pub fn link_motion_slopes_of_gravity(
        &self,
        statics: &Statics,
        frames: &Chain<f64>,
    ) -> Option<[LinkMotion<f64>; 3]> {
        match self {
            Effect::LinkTwist(twist) => Some(twist.motion_slopes(statics, frames)),
            _ => None,
        }
    }

    /// The joint that has turned what an effect moves before it moves it, so that its axis moves along.
    pub fn joint_turned_before(&self) -> Option<usize> {
        match self {
            Effect::AxisWobble(wobble) => Some(wobble.joint),
            _ => None,
        }
    }

    /// Its joint and play between the flanks (rad); `None` of an effect that is no backlash.
    pub fn play_rad(&self) -> Option<(usize, f64)> {
        match self {
            Effect::Backlash(e) => Some((e.joint, e.play_rad)),
            Effect::LoadedBacklash(e) => Some((e.joint, e.play_rad)),
            _ => None,
        }
    }

    /// What of that play the load leaves open (rad), so that the side of approach decides; 0 of an effect that is no backlash.
    pub fn open_play_rad(&self, statics: &Statics, u: &MappedJoints, condition: &Condition) -> f64 {
        match self {
            Effect::LoadedBacklash(e) => e.open_play_rad(statics, u, condition),
            _ => self.play_rad().map_or(0.0, |(_, play)| play),
        }
    }

    /// Whether it depends on the payload.
    pub fn depends_on_load(&self) -> bool {
        let by_masses = |tilt: &BaseTilt| tilt.term.iter().any(|term| term.frame.is_none());
        self.needs_torque() || matches!(self, Effect::BaseTilt(tilt) if by_masses(tilt))
    }

    /// How far that motion can be at most (mm), of a point within `extent_mm` of the base and under masses of `mass_kg`.
    pub fn largest_link_motion_mm(&self, extent_mm: f64, mass_kg: f64) -> f64 {
        match self {
            Effect::AxisWobble(wobble) => wobble.largest_mm(2.0 * extent_mm),
            Effect::BaseTilt(tilt) => tilt.largest_mm(extent_mm, mass_kg),
            Effect::LinkTwist(twist) => twist.largest_mm(2.0 * extent_mm),
            _ => 0.0,
        }
    }

    /// Relative growth of all lengths.
    pub fn growth(&self, condition: &Condition) -> f64 {
        match self {
            Effect::ThermalDrift(thermal) => thermal.growth(condition),
            _ => 0.0,
        }
    }

    /// Derivatives of [`Effect::growth`] with respect to the parameters; empty for an effect without growth.
    pub fn growth_regressors(&self, condition: &Condition) -> Vec<f64> {
        match self {
            Effect::ThermalDrift(thermal) => thermal.growth_regressors(condition),
            _ => Vec::new(),
        }
    }
}
