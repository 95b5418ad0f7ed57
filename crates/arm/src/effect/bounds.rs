//! Which parameters an effect may have that comes from a file.

use super::Effect;
use super::base_tilt::BaseTilt;
use super::bending::Bending;
use super::error_map::ErrorMap;
use super::joint_load::PointMass;
use super::lumped_compliance::LumpedCompliance;
use super::smooth_correction::SmoothCorrection;
use super::thermal::Thermal;
use crate::bounds::{Bound, InvalidValue};

/// Turns that an effect adds (rad).
const OFFSET_RAD: Bound = Bound::new(-0.5, 0.5, "an angle in rad, within ±0.5");
/// Turns for a turn.
const SHARE: Bound = Bound::new(-0.5, 0.5, "a share within ±0.5");
/// Torsional compliance, lumped masses in it or not.
const COMPLIANCE: Bound =
    Bound::new(-1.0, 1.0, "a compliance in rad/(N m), times kg where masses are lumped, within ±1");
const MASS_KG: Bound = Bound::new(0.0, 1e5, "a mass in kg, not negative");
const TORQUE_NM: Bound = Bound::new(1e-6, 1e6, "a torque in N m, above 0");
const FRICTION_NM: Bound = Bound::new(0.0, 1e6, "a torque in N m, not negative");
/// Run-out of a bearing.
const RUN_OUT_MM: Bound = Bound::new(-10.0, 10.0, "a length in mm, within ±10");
/// Sway of a base, lumped masses in it or not.
const SWAY: Bound =
    Bound::new(-1e3, 1e3, "a compliance in mm/(N m), times kg where masses are lumped, within ±1000");
const ORDER: Bound = Bound::new(1e-3, 1e5, "periods per turn of the joint, above 0");
const GROWTH: Bound = Bound::new(-0.1, 0.1, "a relative growth within ±0.1");
const TIME_H: Bound = Bound::new(1e-6, 1e6, "a time in hours, above 0");
const TEMPERATURE_C: Bound = Bound::new(-273.15, 2000.0, "a temperature in °C");
const ANGLE_RAD: Bound = Bound::new(-100.0, 100.0, "joint angles in rad, within ±100");
const REACH_RAD: Bound = Bound::new(1e-6, 1e3, "an angle in rad, above 0");

/// Most knots, lumps or centres of one effect.
const MAX_PARTS: usize = 10_000;

impl Effect {
    /// Refuses joints that an arm has not, and numbers that no effect of that kind has.
    ///
    /// # Errors
    /// [`InvalidValue`], with the key within the effect.
    pub fn check(&self) -> Result<(), InvalidValue> {
        joint("joint", self.joint().unwrap_or(0))?;
        match self {
            Effect::JointCompliance(e) => COMPLIANCE.check("compliance_rad_per_nm", e.compliance_rad_per_nm),
            Effect::LumpedCompliance(e) => lumps(e),
            Effect::LinkBending(e) => bending(e),
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => {
                ORDER.check("order", e.order)?;
                OFFSET_RAD.check("sine_rad", e.sine_rad)?;
                OFFSET_RAD.check("cosine_rad", e.cosine_rad)
            }
            Effect::GearMap(e) => knots(e),
            Effect::GearRatio(e) => SHARE.check("error", e.error),
            Effect::JointStiffness(e) => {
                masses(e.joint, &e.mass)?;
                TORQUE_NM.check("half_nm", e.half_nm)?;
                OFFSET_RAD.check("deflection_rad", e.deflection_rad)
            }
            Effect::TorquePowers(e) => {
                masses(e.joint, &e.mass)?;
                TORQUE_NM.check("largest_nm", e.largest_nm)?;
                COMPLIANCE.check("square_rad_per_nm2", e.square_rad_per_nm2)?;
                COMPLIANCE.check("cube_rad_per_nm3", e.cube_rad_per_nm3)
            }
            Effect::GearTwoJoints(e) => {
                joint("other", e.other)?;
                OFFSET_RAD.check_all("sum_rad", &e.sum_rad)?;
                OFFSET_RAD.check_all("difference_rad", &e.difference_rad)
            }
            Effect::JointCoupling(e) => {
                joint("driver", e.driver)?;
                SHARE.check("factor", e.factor)
            }
            Effect::LoadedBacklash(e) => {
                masses(e.joint, &e.mass)?;
                FRICTION_NM.check("friction_nm", e.friction_nm)?;
                TORQUE_NM.check("closing_nm", e.closing_nm)?;
                OFFSET_RAD.check("play_rad", e.play_rad)
            }
            Effect::Backlash(e) => OFFSET_RAD.check("play_rad", e.play_rad),
            Effect::ThermalDrift(e) => thermal(e),
            Effect::AxisWobble(e) => {
                OFFSET_RAD.check_all("tilt_rad", &e.tilt_rad)?;
                RUN_OUT_MM.check_all("radial_mm", e.radial_mm.as_slice().as_flattened())
            }
            Effect::BaseTilt(e) => tilt_terms(e),
            Effect::LinkTwist(e) => {
                followed_joint(e.joint)?;
                OFFSET_RAD.check("twist_rad", e.twist_rad)?;
                OFFSET_RAD.check_all("lean_rad", e.lean_rad.as_slice())
            }
            Effect::SmoothCorrection(e) => smooth(e),
        }
    }
}

/// Checks a list of effects; they count from 1, as parameters name them.
///
/// # Errors
/// [`InvalidValue`].
pub fn effects(list: &[Effect]) -> Result<(), InvalidValue> {
    for (i, effect) in list.iter().enumerate() {
        effect.check().map_err(|invalid| invalid.within(&format!("effect {} ({})", i + 1, effect.name())))?;
    }
    Ok(())
}

fn joint(key: &str, joint: usize) -> Result<(), InvalidValue> {
    if joint < 6 {
        return Ok(());
    }
    Err(InvalidValue::new(key, joint.to_string(), "a joint from 0 to 5"))
}

fn count(key: &str, found: usize, least: usize, expected: &'static str) -> Result<(), InvalidValue> {
    if (least..=MAX_PARTS).contains(&found) {
        return Ok(());
    }
    Err(InvalidValue::new(key, format!("{found} entries"), expected))
}

fn lumps(load: &LumpedCompliance) -> Result<(), InvalidValue> {
    count("lump", load.lump.len(), 1, "1 to 10,000 lumps")?;
    for lump in &load.lump {
        if !(1..=6).contains(&lump.frame) {
            return Err(InvalidValue::new("lump.frame", lump.frame.to_string(), "a frame from 1 to 6"));
        }
        for (key, axis) in [("lump.axis", lump.axis), ("lump.moment", lump.moment)] {
            if let Some(axis) = axis.filter(|axis| *axis > 2) {
                return Err(InvalidValue::new(key, axis.to_string(), "an axis from 0 to 2"));
            }
        }
        COMPLIANCE.check("lump.factor", lump.factor)?;
    }
    Ok(())
}

fn tilt_terms(tilt: &BaseTilt) -> Result<(), InvalidValue> {
    count("term", tilt.term.len(), 1, "1 to 10,000 terms")?;
    for term in &tilt.term {
        if let Some(frame) = term.frame.filter(|frame| !(1..=6).contains(frame)) {
            return Err(InvalidValue::new("term.frame", frame.to_string(), "a frame from 1 to 6"));
        }
        if let Some(axis) = term.about.iter().flatten().find(|axis| **axis > 2) {
            return Err(InvalidValue::new("term.about", axis.to_string(), "axes from 0 to 2"));
        }
        if !tilt.deep && term.sway_mm_per_nm != 0.0 {
            let found = format!("{} of a base that is not deep", term.sway_mm_per_nm);
            return Err(InvalidValue::new("term.sway_mm_per_nm", found, "0, or deep = true"));
        }
        COMPLIANCE.check("term.tilt_rad_per_nm", term.tilt_rad_per_nm)?;
        SWAY.check("term.sway_mm_per_nm", term.sway_mm_per_nm)?;
    }
    Ok(())
}

fn masses(joint: usize, masses: &[PointMass]) -> Result<(), InvalidValue> {
    count("mass", masses.len(), 0, "up to 10,000 masses")?;
    for mass in masses {
        if !(joint + 1..=6).contains(&mass.frame) {
            let expected = "a frame beyond the joint, to 6";
            return Err(InvalidValue::new("mass.frame", mass.frame.to_string(), expected));
        }
        MASS_KG.check("mass.mass_kg", mass.mass_kg)?;
    }
    Ok(())
}

fn followed_joint(joint: usize) -> Result<(), InvalidValue> {
    if joint < 5 {
        return Ok(());
    }
    Err(InvalidValue::new("joint", joint.to_string(), "a joint from 0 to 4, which another follows"))
}

fn bending(bending: &Bending) -> Result<(), InvalidValue> {
    followed_joint(bending.joint)?;
    if let Some(frame) = bending.frame.filter(|frame| !(bending.joint + 1..=6).contains(frame)) {
        return Err(InvalidValue::new("frame", frame.to_string(), "a frame from the end of the link to 6"));
    }
    COMPLIANCE.check("compliance_rad_per_nm", bending.compliance_rad_per_nm)
}

fn knots(map: &ErrorMap) -> Result<(), InvalidValue> {
    count("knots_rad", map.knots_rad.len(), 4, "4 to 10,000 knots")?;
    OFFSET_RAD.check_all("knots_rad", &map.knots_rad)
}

fn thermal(thermal: &Thermal) -> Result<(), InvalidValue> {
    GROWTH.check("growth", thermal.growth)?;
    GROWTH.check("growth_per_k", thermal.growth_per_k)?;
    TIME_H.check("time_constant_h", thermal.time_constant_h)?;
    TEMPERATURE_C.check("reference_c", thermal.reference_c)
}

fn smooth(smooth: &SmoothCorrection) -> Result<(), InvalidValue> {
    count("centres_rad", smooth.centres_rad.len(), 0, "up to 10,000 centres")?;
    if smooth.weights_rad.len() != smooth.centres_rad.len() {
        let found = format!("{} weights for {} centres", smooth.weights_rad.len(), smooth.centres_rad.len());
        return Err(InvalidValue::new("weights_rad", found, "one for each centre"));
    }
    ANGLE_RAD.check_all("centres_rad", smooth.centres_rad.as_flattened())?;
    REACH_RAD.check("reach_rad", smooth.reach_rad)?;
    OFFSET_RAD.check_all("weights_rad", smooth.weights_rad.as_flattened())
}
