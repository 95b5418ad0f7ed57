//! What is known of an arm before it is measured: manufacturing tolerances as priors.
//!
//! They hold a combination of parameters that the data cannot see at its nominal value, and give way where the data
//! speaks. A frame of the sensor is not manufactured: its priors are wide.

use crate::identification::calibration::Frames;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_estimation::problem::Prior;

/// Standard deviations of the priors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Link lengths and offsets (mm).
    pub length_mm: f64,
    /// Twists (rad).
    pub angle_rad: f64,
    /// Joint zeros (rad).
    pub zero_rad: f64,
    /// The touched point on the flange about its starting value (mm): a hook or reflector stands off.
    pub target_mm: f64,
    /// Orientation of a full-pose target about its starting value (rad).
    pub target_rad: f64,
    /// Sensor frame, outlet and cable zero about their starting values (mm); wide.
    pub frame_mm: f64,
    /// Orientation of the sensor frame about its starting value (rad); wide.
    pub frame_rad: f64,
    /// Whether the rows tell how wide the tolerances of links are, weighed by the ones stated here (`prior_width`).
    pub learn_widths: bool,
}

impl Default for Tolerance {
    /// 1 mm and 0.3° on the arm, which is what industrial arms leave the factory with (Nubiola and Bonev 2013 find up to
    /// 0.9 mm and 0.5° on an IRB 1600); 50 mm for the touched point.
    fn default() -> Self {
        Self {
            length_mm: 1.0,
            angle_rad: 0.3_f64.to_radians(),
            zero_rad: 0.3_f64.to_radians(),
            target_mm: 50.0,
            target_rad: 1.0,
            frame_mm: 2000.0,
            frame_rad: 3.0,
            learn_widths: false,
        }
    }
}

impl Tolerance {
    /// The prior of a parameter as a deviation from its starting value: mean 0.
    ///
    /// That of a disturbance depends on its kind: see [`Tolerance::of_disturbance`].
    pub fn prior(&self, parameter: &Parameter, model: &Model) -> Prior {
        let sigma = match *parameter {
            Parameter::Link { coordinate, .. } if coordinate.is_length() => self.length_mm,
            Parameter::Link { coordinate: LinkCoordinate::Theta, .. } => self.zero_rad,
            Parameter::Link { .. } => self.angle_rad,
            Parameter::Target(k) if k < 3 => self.target_mm,
            Parameter::Target(_) => self.target_rad,
            Parameter::SensorFrame(k) if k >= 3 => self.frame_rad,
            Parameter::SensorFrame(_)
            | Parameter::Outlet { .. }
            | Parameter::Zero { .. }
            | Parameter::Disturbance { .. } => self.frame_mm,
            Parameter::Effect { index, parameter } => effect_sigma(&model.effects[index], parameter),
        };
        Prior { mean: 0.0, sigma }
    }

    /// Standard deviation of a parameter of a disturbance, in its unit: sizes met in practice, wide.
    pub fn of_disturbance(disturbance: &Disturbance, parameter: usize) -> f64 {
        match &disturbance.kind {
            Kind::Zero | Kind::Target => 5.0,
            Kind::Frame { .. } if parameter >= 3 => 5e-3,
            Kind::Frame { .. } => 5.0,
            Kind::Scale => 3e-3,
            Kind::Sag => 3e-3,
            Kind::Load { compliance: Some(_), .. } => 10.0,
            Kind::Load { .. } => 1e-4,
            Kind::Empirical(form) => form.prior_sigma(parameter),
        }
    }

    /// Priors of a list of parameters of an undisturbed measurement.
    pub fn priors(&self, parameters: &[Parameter], model: &Model) -> Vec<Prior> {
        parameters.iter().map(|p| self.prior(p, model)).collect()
    }

    /// Priors of a list of parameters; `frames` holds the disturbances.
    pub fn priors_within(&self, parameters: &[Parameter], model: &Model, frames: &Frames) -> Vec<Prior> {
        parameters
            .iter()
            .map(|p| match *p {
                Parameter::Disturbance { index, parameter } => {
                    let sigma = Self::of_disturbance(&frames.disturbances[index], parameter);
                    Prior { mean: 0.0, sigma }
                }
                _ => self.prior(p, model),
            })
            .collect()
    }
}

/// Sizes that effects have on real arms, as wide priors.
pub fn effect_sigma(effect: &Effect, parameter: usize) -> f64 {
    // The gears of a wrist are smaller and yield ten times as much.
    let soft = |joint: usize| if joint < 3 { 1.0 } else { 10.0 };
    match effect {
        Effect::JointCompliance(compliance) => 1e-4 * soft(compliance.joint),
        // A compliance of 1e-5 rad/(N m) times 30 kg, and for a link's first moment times some 0.3 kg m.
        Effect::LumpedCompliance(load) => match load.lump.get(parameter) {
            Some(lump) if lump.moment.is_some() => 3e-6 * soft(load.joint),
            _ => 3e-4 * soft(load.joint),
        },
        Effect::GearEccentricity(_) | Effect::GearTransmission(_) => 0.2_f64.to_radians(),
        // The same curve over more knots, each of them smaller.
        Effect::GearMap(map) => 0.05_f64.to_radians() * (24.0 / map.knots_rad.len().max(1) as f64).sqrt(),
        Effect::GearRatio(_) | Effect::JointCoupling(_) => 3e-3,
        Effect::Backlash(_) => 0.2_f64.to_radians(),
        Effect::ThermalDrift(_) => 1e-3,
        Effect::SmoothCorrection(_) => SMOOTH_SIGMA_RAD,
    }
}

/// A smooth correction moves the wrist by tenths of a millimetre at half a metre.
pub const SMOOTH_SIGMA_RAD: f64 = 6e-4;
