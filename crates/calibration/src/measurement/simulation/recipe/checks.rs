//! Range checks of a recipe: non-finite numbers, implausible arms, too many rows.

use super::{Fault, Frame, Poses, Recipe, RunConditions, SensorSetup, View};
use crate::measurement::simulation::error::RecipeError;
use truegrind_arm::bounds::{
    self, Bound, InvalidValue, JOINT_DEG, LENGTH_MM, MASS_KG, POSITION_MM, display_number,
};
use truegrind_arm::effect::bounds::effects;

/// Most rows of a simulated file.
const MAX_ROWS: usize = 1_000_000;
/// Most faults, and most rows that lists of faults name.
const MAX_FAULTS: usize = 10_000;

const LENGTH_SIGMA_MM: Bound = Bound::new(0.0, 200.0, "a standard deviation in mm, 0 to 200");
const ANGLE_SIGMA_DEG: Bound = Bound::new(0.0, 45.0, "a standard deviation in degrees, 0 to 45");
const LENGTH_OFF_MM: Bound = Bound::new(-200.0, 200.0, "a deviation in mm, within ±200");
const ANGLE_OFF_DEG: Bound = Bound::new(-45.0, 45.0, "a deviation in degrees, within ±45");
const TILT_DEG: Bound = Bound::new(0.0, 180.0, "an angle from 0 to 180 degrees");
const TURN_DEG: Bound = Bound::new(-720.0, 720.0, "an angle in degrees, within ±720");
const HOURS: Bound = Bound::new(0.0, 1e6, "hours, 0 to 1,000,000");
const TIME_H: Bound = Bound::new(1e-6, 1e6, "a time in hours, above 0");
const TEMPERATURE_C: Bound = Bound::new(-273.15, 2000.0, "a temperature in °C");
const SIGMA: Bound = Bound::new(0.0, 1e4, "a standard deviation, 0 or more");
const FREEDOM: Bound = Bound::new(2.000_001, 1e9, "more than 2 degrees of freedom");
const STEP: Bound = Bound::new(1e-9, 1e4, "a step above 0");
const SCALE: Bound = Bound::new(-0.5, 0.5, "a share within ±0.5");
const SAG_PER_M: Bound = Bound::new(-10.0, 10.0, "weight over tension in 1/m, within ±10");

impl From<InvalidValue> for RecipeError {
    fn from(invalid: InvalidValue) -> Self {
        RecipeError::Invalid { key: invalid.key, found: invalid.found, expected: invalid.expected }
    }
}

impl Recipe {
    /// Checks all values that the types do not restrict.
    pub fn check(&self) -> Result<(), RecipeError> {
        self.check_arm().map_err(|invalid| invalid.within("arm"))?;
        self.check_poses().map_err(|invalid| invalid.within("poses"))?;
        view(&self.view).map_err(|invalid| invalid.within("view"))?;
        conditions(&self.conditions).map_err(|invalid| invalid.within("circumstances"))?;
        sensor(&self.sensor).map_err(|invalid| invalid.within("sensor"))?;
        for (number, place) in self.station.iter().enumerate() {
            frame("frame", place).map_err(|invalid| invalid.within(&format!("station {}", number + 1)))?;
        }
        for (key, sigma) in [
            ("noise.sigma_mm", self.noise.sigma_mm),
            ("noise.per_metre_mm", self.noise.per_metre_mm),
            ("noise.sigma_deg", self.noise.sigma_deg),
            ("noise.joints_deg", self.noise.joints_deg),
        ] {
            SIGMA.check(key, sigma)?;
        }
        FREEDOM.check_all("noise.student_t", &self.noise.student_t)?;
        for (key, step) in [
            ("rounding.angles_deg", self.rounding.angles_deg),
            ("rounding.readout_mm", self.rounding.readout_mm),
            ("rounding.reading_mm", self.rounding.reading_mm),
        ] {
            STEP.check_all(key, &step)?;
        }
        faults(&self.fault)?;
        self.check_consistency()
    }

    fn check_arm(&self) -> Result<(), InvalidValue> {
        if let Some(random) = &self.arm.random {
            for (key, bound, value) in [
                ("a_mm", LENGTH_SIGMA_MM, random.a_mm),
                ("d_mm", LENGTH_SIGMA_MM, random.d_mm),
                ("alpha_deg", ANGLE_SIGMA_DEG, random.alpha_deg),
                ("beta_deg", ANGLE_SIGMA_DEG, random.beta_deg),
                ("theta_deg", ANGLE_SIGMA_DEG, random.theta_deg),
            ] {
                bound.check(format_args!("random.{key}"), value)?;
            }
        }
        for link in &self.arm.link {
            if link.joint > 5 {
                return Err(InvalidValue::new("link.joint", link.joint.to_string(), "a joint from 0 to 5"));
            }
            for (key, bound, value) in [
                ("a_mm", LENGTH_OFF_MM, link.a_mm),
                ("d_mm", LENGTH_OFF_MM, link.d_mm),
                ("alpha_deg", ANGLE_OFF_DEG, link.alpha_deg),
                ("beta_deg", ANGLE_OFF_DEG, link.beta_deg),
                ("theta_deg", ANGLE_OFF_DEG, link.theta_deg),
            ] {
                bound.check(format_args!("link.{key} of joint {}", link.joint), value)?;
            }
        }
        effects(&self.arm.effect)?;
        let Some(bodies) = &self.arm.body else { return Ok(()) };
        if bodies.len() != 6 {
            return Err(InvalidValue::new("body", format!("{} bodies", bodies.len()), "six"));
        }
        bounds::bodies(bodies)
    }

    fn check_poses(&self) -> Result<(), InvalidValue> {
        let repeats = match &self.poses {
            Poses::Random { margin_deg, min_deg, max_deg, repeats, .. } => {
                JOINT_DEG.check("margin_deg", *margin_deg)?;
                JOINT_DEG.check_all("min_deg", min_deg.iter().flatten())?;
                JOINT_DEG.check_all("max_deg", max_deg.iter().flatten())?;
                *repeats
            }
            Poses::Grid { min_deg, max_deg, repeats, .. } => {
                JOINT_DEG.check_all("min_deg", min_deg)?;
                JOINT_DEG.check_all("max_deg", max_deg)?;
                *repeats
            }
            Poses::List { joints_deg, repeats } => {
                JOINT_DEG.check_all("joints_deg", joints_deg.as_flattened())?;
                *repeats
            }
        };
        let poses = match &self.poses {
            Poses::Random { count, .. } => Some(*count),
            Poses::Grid { steps, .. } => steps.iter().try_fold(1_usize, |all, step| all.checked_mul(*step)),
            Poses::List { joints_deg, .. } => Some(joints_deg.len()),
        };
        let sides = if self.conditions.approach == super::Approach::Both { 2 } else { 1 };
        let rows = [repeats.max(1), sides, self.sensor.anchors()];
        let rows = rows.iter().try_fold(poses.unwrap_or(usize::MAX), |all, times| all.checked_mul(*times));
        if rows.is_some_and(|rows| rows <= MAX_ROWS) && poses.is_some_and(|poses| poses <= MAX_ROWS) {
            return Ok(());
        }
        let found = rows.map_or_else(|| "more rows than can be counted".to_owned(), |n| format!("{n} rows"));
        Err(InvalidValue::new("count, steps and repeats", found, "at most 1,000,000 rows in all"))
    }
}

fn view(view: &View) -> Result<(), InvalidValue> {
    POSITION_MM.check_all("box_mm", view.box_mm.iter().flatten().flatten())?;
    POSITION_MM.check_all("distance_mm", view.distance_mm.iter().flatten())?;
    TILT_DEG.check_all("tilt_deg", &view.tilt_deg)
}

fn conditions(conditions: &RunConditions) -> Result<(), InvalidValue> {
    HOURS.check_all("hours", &conditions.hours)?;
    if let Some(warm) = &conditions.temperature {
        if conditions.hours.is_none() {
            return Err(InvalidValue::new("temperature", "no hours", "`hours` beside a temperature"));
        }
        TEMPERATURE_C.check("temperature.start_c", warm.start_c)?;
        TEMPERATURE_C.check("temperature.end_c", warm.end_c)?;
        TIME_H.check("temperature.time_constant_h", warm.time_constant_h)?;
    }
    MASS_KG.check_all("payload_kg", &conditions.payload_kg)?;
    LENGTH_MM.check_all("payload_centre_mm", &conditions.payload_centre_mm)
}

fn frame(key: &str, frame: &Frame) -> Result<(), InvalidValue> {
    POSITION_MM.check_all(format_args!("{key}.position_mm"), &frame.position_mm)?;
    let length = frame.wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (1e-3..=1e3).contains(&length) {
        return Ok(());
    }
    let expected = "a quaternion whose length is not 0";
    Err(InvalidValue::new(format!("{key}.wxyz"), format!("a length of {}", display_number(length)), expected))
}

fn sensor(sensor: &SensorSetup) -> Result<(), InvalidValue> {
    match sensor {
        SensorSetup::Cable { outlets_mm, zeros_mm, hook_mm } => {
            if outlets_mm.is_empty() || zeros_mm.len() > outlets_mm.len() {
                let found = format!("{} outlets, {} zeros", outlets_mm.len(), zeros_mm.len());
                let expected = "one outlet at least, and no more zeros than outlets";
                return Err(InvalidValue::new("outlets_mm", found, expected));
            }
            POSITION_MM.check_all("outlets_mm", outlets_mm.as_flattened())?;
            POSITION_MM.check_all("zeros_mm", zeros_mm)?;
            LENGTH_MM.check_all("hook_mm", hook_mm)
        }
        SensorSetup::Position { frame: sensor_frame, reflector_mm } => {
            frame("frame", sensor_frame)?;
            LENGTH_MM.check_all("reflector_mm", reflector_mm)
        }
        SensorSetup::Pose { frame: sensor_frame, target } => {
            frame("frame", sensor_frame)?;
            frame("target", target)
        }
    }
}

fn faults(list: &[Fault]) -> Result<(), InvalidValue> {
    let mut named = list.len();
    for (i, fault) in list.iter().enumerate() {
        numbers(fault).map_err(|invalid| invalid.within(&format!("fault {}", i + 1)))?;
        if let Fault::Outliers { row_list, .. } | Fault::ReadoutMismatch { row_list, .. } = fault {
            named = named.saturating_add(row_list.len());
        }
    }
    if named <= MAX_FAULTS {
        return Ok(());
    }
    Err(InvalidValue::new("fault", format!("{named} faults and rows in lists"), "at most 10,000"))
}

fn numbers(fault: &Fault) -> Result<(), InvalidValue> {
    match fault {
        Fault::SensorZeroShift { offset_mm, .. } => POSITION_MM.check("offset_mm", *offset_mm),
        Fault::SensorFrameShift { shift_mm, turn_deg, .. } => {
            POSITION_MM.check_all("shift_mm", shift_mm)?;
            TURN_DEG.check_all("turn_deg", turn_deg)
        }
        Fault::ToolShift { shift_mm, .. } => LENGTH_MM.check_all("shift_mm", shift_mm),
        Fault::SensorScale { error } => SCALE.check("error", *error),
        Fault::CableSag { weight_over_tension_per_m } => {
            SAG_PER_M.check("weight_over_tension_per_m", *weight_over_tension_per_m)
        }
        Fault::Outliers { size_mm, .. } => POSITION_MM.check("size_mm", *size_mm),
        Fault::ReadoutMismatch { shift_mm, .. } => POSITION_MM.check_all("shift_mm", shift_mm),
        Fault::PayloadChange { payload_kg, .. } => MASS_KG.check("payload_kg", *payload_kg),
    }
}
