//! Priors: manufacturing tolerances of the arm, and wide priors for the sensor's frames.
//!
//! The tolerances keep combinations of parameters that the data do not determine at their nominal values.

use crate::identification::calibration::Frames;
use crate::measurement::registration::TARGET_SIGMA_MM;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::{
    TWO_JOINT_SIGMA_RAD, base_tilt_sigma, torque_power_sigma, wobble_sigma,
};
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
    /// The target on the flange about its starting value (mm): a hook or reflector has a stand-off.
    pub target_mm: f64,
    /// Orientation of a full-pose target about its starting value (rad).
    pub target_rad: f64,
    /// Sensor frame, outlet and cable zero about their starting values (mm); wide.
    pub frame_mm: f64,
    /// Orientation of the sensor frame about its starting value (rad); wide.
    pub frame_rad: f64,
    /// Relative error of the sensor's scale, where it is stated. Otherwise a fault of the scale is assumed possible (`benefit`).
    pub scale: Option<f64>,
    /// Whether to estimate the prior widths of links from the rows, with the ones stated here as hyperprior (`prior_width`).
    pub learn_widths: bool,
}

impl Default for Tolerance {
    /// 1 mm and 0.3° for the arm, what the largest errors of industrial arms reach (Nubiola and Bonev 2013 find up to 0.9 mm and 0.5°
    /// on an IRB 1600): where widths are estimated, the root mean square is half of it. 50 mm for the target.
    fn default() -> Self {
        Self {
            length_mm: 1.0,
            angle_rad: 0.3_f64.to_radians(),
            zero_rad: 0.3_f64.to_radians(),
            target_mm: TARGET_SIGMA_MM,
            target_rad: 1.0,
            frame_mm: 2000.0,
            frame_rad: 3.0,
            scale: None,
            learn_widths: false,
        }
    }
}

impl Tolerance {
    /// These tolerances of links, beside what `stated` knows of the sensor's frame and of the target.
    #[must_use]
    pub fn with_frames_of(self, stated: &Self) -> Self {
        let Self { target_mm, target_rad, frame_mm, frame_rad, .. } = *stated;
        Self { target_mm, target_rad, frame_mm, frame_rad, ..self }
    }

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

    /// Standard deviation of a parameter of a disturbance, in its unit: a wide prior from sizes met in practice.
    pub fn of_disturbance(disturbance: &Disturbance, parameter: usize) -> f64 {
        match &disturbance.kind {
            // A station may stand anywhere.
            _ if matches!(disturbance.profile, Profile::Station { .. }) => {
                let anywhere = Self::default();
                if parameter >= 3 { anywhere.frame_rad } else { anywhere.frame_mm }
            }
            Kind::Zero | Kind::Target => 5.0,
            Kind::Frame { .. } if parameter >= 3 => 5e-3,
            Kind::Frame { .. } => 5.0,
            Kind::JointZero { .. } => 0.2_f64.to_radians(),
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

/// Wide priors from sizes of effects on real arms.
pub fn effect_sigma(effect: &Effect, parameter: usize) -> f64 {
    // The smaller gears of a wrist are ten times as compliant.
    let soft = |joint: usize| if joint < 3 { 1.0 } else { 10.0 };
    match effect {
        Effect::JointCompliance(compliance) => 1e-4 * soft(compliance.joint),
        // A compliance of 1e-5 rad/(N m) times 30 kg, and for a link's first moment times some 0.3 kg m.
        Effect::LumpedCompliance(load) => match load.lump.get(parameter) {
            Some(lump) if lump.moment.is_some() => 3e-6 * soft(load.joint),
            _ => 3e-4 * soft(load.joint),
        },
        // A link of a metre of which 100 N m bend the end by a few tenths of a millimetre, with a load of 30 kg where masses are not known.
        Effect::LinkBending(bending) if bending.frame.is_some() => 3e-4 * soft(bending.joint),
        Effect::LinkBending(bending) => 1e-5 * soft(bending.joint),
        Effect::GearEccentricity(_) | Effect::GearTransmission(_) => 0.2_f64.to_radians(),
        // The same curve over more knots, each of them smaller.
        Effect::GearMap(map) => 0.05_f64.to_radians() * (24.0 / map.knots_rad.len().max(1) as f64).sqrt(),
        Effect::GearRatio(_) | Effect::JointCoupling(_) => 3e-3,
        Effect::TorquePowers(powers) => torque_power_sigma(powers.mass.is_empty(), parameter),
        Effect::GearTwoJoints(_) => TWO_JOINT_SIGMA_RAD,
        Effect::Backlash(_) | Effect::LoadedBacklash(_) | Effect::JointStiffness(_) => 0.2_f64.to_radians(),
        Effect::ThermalDrift(_) => GROWTH_SIGMA,
        Effect::AxisWobble(_) => wobble_sigma(parameter),
        Effect::LinkTwist(_) => TWIST_SIGMA_RAD,
        Effect::BaseTilt(tilt) => {
            let count = tilt.term.len().max(1);
            base_tilt_sigma(tilt.term.iter().any(|term| term.frame.is_some()), parameter >= count)
        }
        Effect::SmoothCorrection(_) => SMOOTH_SIGMA_RAD,
    }
}

/// Prior of relative thermal growth: aluminium by some 40 K.
pub const GROWTH_SIGMA: f64 = 1e-3;

/// Prior of the twist of a link: some 20 N m beside the arm, on a link or a bearing of which 100 N m bend the end by a milliradian.
pub const TWIST_SIGMA_RAD: f64 = 2e-4;

/// Prior of a smooth correction: tenths of a millimetre at half a metre.
pub const SMOOTH_SIGMA_RAD: f64 = 6e-4;
