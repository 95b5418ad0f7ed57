//! A plan as its user states it, in millimetres and degrees: checked, and completed by what is usual for arm and sensor.
//!
//! Messages name the options of the command line.

use thiserror::Error;

use super::candidate::Bounds;
use super::candidate::MARGIN_DEG;
use super::design::Index;
use super::keep_out::KeepOut;
use super::options::{FIELD_POSES, Options, READING_DEG, reach_mm};
use super::program::ProgramSettings;
use super::questions::Open;
use super::rows::Noise;
use super::schedule::{APPROACH_DEG, Visits};
use super::setup::MeasurementSetup;
use truegrind_arm::robots::Robot;

/// Largest number of poses.
const MAX_POSES: usize = 2000;

/// Largest number of candidates; more do not improve the design.
const MAX_CANDIDATES: usize = 100_000;

/// Noisier sensors identify no arm; micrometres are meant (mm).
const MAX_SIGMA_MM: f64 = 10.0;

/// A day: no row takes longer (s).
const MAX_SECONDS: f64 = 86_400.0;

/// Why a plan cannot be meant as stated.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct SettingsError(pub String);

fn refused<T>(message: String) -> Result<T, SettingsError> {
    Err(SettingsError(message))
}

/// A plan as stated.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of different poses; by default the usual one, or ten for an unexplained error.
    pub poses: Option<usize>,
    /// Design criterion.
    pub index: Index,
    /// Standard deviation of a length or coordinate (mm); by default that of the sensor.
    pub sigma_mm: Option<f64>,
    /// Standard deviation of an orientation (°).
    pub sigma_angle_deg: f64,
    /// Box that must contain the measured point, in the base: lower and upper corner (mm).
    pub box_mm: Option<[[f64; 3]; 2]>,
    /// Shortest and longest distance to the sensor (mm).
    pub distance_mm: Option<[f64; 2]>,
    /// Smallest distance of cable or line of sight from the links (mm); 0 disables the check.
    pub clearance_mm: Option<f64>,
    /// Boxes that links and target must not enter: two corners each, in the base (mm).
    pub keep_out_mm: Vec<[[f64; 3]; 2]>,
    /// Lowest allowed height in the base (mm).
    pub floor_mm: f64,
    /// Assumed radius of the links (mm).
    pub link_radius_mm: Option<f64>,
    /// Distance from the joint limits (°), at least the approach.
    pub margin_deg: f64,
    /// Smallest distance to a singularity.
    pub singularity: f64,
    /// Poses measured two more times.
    pub repeats: usize,
    /// Poses measured again from the other side.
    pub both_sides: usize,
    /// Visits of one pose, spread over the run.
    pub warm_up: usize,
    /// Length of each approach move, in every joint (°).
    pub approach_deg: f64,
    /// Waiting time before a reading (s).
    pub settle_s: f64,
    /// Expected time per row (s).
    pub seconds_per_row: f64,
    /// Speed between poses (mm/s).
    pub speed_mm_s: f64,
    /// Non-centrality from which an effect counts as detectable.
    pub decisive: f64,
    /// Number of random candidates.
    pub candidates: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// What a diagnosis left open.
    pub open: Open,
    /// Whether the plan is for one finding of the diagnosis alone.
    pub one_finding: bool,
}

impl Default for Settings {
    fn default() -> Self {
        let (options, visits) = (Options::default(), Visits::default());
        Self {
            poses: None,
            index: options.index,
            sigma_mm: None,
            sigma_angle_deg: READING_DEG,
            box_mm: None,
            distance_mm: None,
            clearance_mm: None,
            keep_out_mm: Vec::new(),
            floor_mm: 0.0,
            link_radius_mm: None,
            margin_deg: MARGIN_DEG,
            singularity: Bounds::default().min_singularity,
            repeats: visits.repeats,
            both_sides: visits.both_sides,
            warm_up: visits.warm_up,
            approach_deg: APPROACH_DEG,
            settle_s: 2.0,
            seconds_per_row: visits.seconds_per_row,
            speed_mm_s: 200.0,
            decisive: options.decisive,
            candidates: options.candidates,
            seed: options.seed,
            open: Open::default(),
            one_finding: false,
        }
    }
}

impl Settings {
    /// Options of the plan for `robot`. `sight_is_known`: the place of a tracker or camera is stated.
    ///
    /// # Errors
    /// Names the option that cannot be meant.
    pub fn options(
        &self,
        robot: &Robot,
        setup: &MeasurementSetup<'_>,
        sight_is_known: bool,
    ) -> Result<Options, SettingsError> {
        let usual = Options::usual(setup.nominal, setup.sensor, sight_is_known);
        let sigma_mm = self.sigma_mm.unwrap_or(usual.noise.reading_mm);
        self.check_numbers(sigma_mm, usual.poses)?;
        let reach_mm = reach_mm(setup.nominal);
        refuse_far_target(setup, reach_mm)?;
        if let Some([low, high]) = self.box_mm
            && !(0..3).all(|axis| low[axis] < high[axis])
        {
            let numbers = numbers(&[low, high].concat());
            return refused(format!(
                "--box {numbers}: expected x,y,z of the lower and x,y,z of the upper corner (mm)"
            ));
        }
        if let Some([low, high]) = self.distance_mm
            && !(0.0 <= low && low < high)
        {
            return refused(format!(
                "--range {low},{high}: expected the shortest and the longest distance, min,max (mm)"
            ));
        }
        let clearance_mm = match self.clearance_mm {
            None => usual.bounds.clearance_mm,
            Some(_) if usual.bounds.clearance_mm.is_none() => {
                return refused(
                    "--clearance: the line of sight is known with --sensor-frame alone: state it too"
                        .to_owned(),
                );
            }
            Some(0.0) => None,
            Some(mm) if mm > 0.0 && mm.is_finite() => Some(mm),
            Some(mm) => return refused(format!("--clearance {mm}: expected 0 or more (mm)")),
        };
        let space = self.space(usual.bounds.space, reach_mm)?;
        let Open { questions, something_else, joint_scatters } = self.open.clone();
        let approach_rad = self.approach_deg.to_radians();
        let poses = self.poses.unwrap_or(if joint_scatters { FIELD_POSES } else { usual.poses });
        // Whether it differs by the side or from time to time is asked at every pose.
        let [repeats, both_sides, warm_up] = match joint_scatters {
            true => [poses, poses, 0],
            false => [self.repeats, self.both_sides, self.warm_up],
        };
        let options = Options {
            poses,
            index: self.index,
            noise: Noise { reading_mm: sigma_mm, reading_rad: self.sigma_angle_deg.to_radians() },
            candidates: self.candidates.max(poses + FIELD_POSES),
            bounds: Bounds {
                margin_rad: self.margin_deg.to_radians().max(approach_rad),
                min_singularity: self.singularity,
                box_mm: self.box_mm,
                distance_mm: self.distance_mm,
                clearance_mm,
                space,
            },
            visits: Visits {
                repeats,
                both_sides,
                warm_up,
                approach_rad,
                seconds_per_row: self.seconds_per_row,
            },
            questions,
            something_else: something_else.clone(),
            decisive: self.decisive,
            rated_load_kg: robot.sheet.payload_kg,
            seed: self.seed,
            ..Options::default()
        };
        Ok(match something_else.filter(|_| self.one_finding) {
            Some(alone) => options.for_something_else(alone, self.poses.unwrap_or(FIELD_POSES)),
            None => options,
        })
    }

    /// How the arm moves to the poses of a plan with these options.
    pub fn program(&self, robot: &Robot, options: &Options) -> ProgramSettings {
        ProgramSettings {
            robot: robot.sheet.name.clone(),
            travel_mm_s: self.speed_mm_s,
            // Visits of one pose over a long time are waited for.
            settle_s: self.settle_s + (options.visits.seconds_per_row - self.seconds_per_row).max(0.0),
            ..ProgramSettings::default()
        }
    }

    /// The space that the arm must keep out of.
    fn space(&self, usual: KeepOut, reach_mm: f64) -> Result<KeepOut, SettingsError> {
        let mut boxes_mm = Vec::new();
        for [one, other] in &self.keep_out_mm {
            if (0..3).any(|axis| one[axis] == other[axis]) {
                let numbers = numbers(&[*one, *other].concat());
                return refused(format!(
                    "--keep-out {numbers}: expected two corners of a box, x,y,z,x,y,z (mm)"
                ));
            }
            let corner = |pick: fn(f64, f64) -> f64| std::array::from_fn(|axis| pick(one[axis], other[axis]));
            boxes_mm.push([corner(f64::min), corner(f64::max)]);
        }
        if !self.floor_mm.is_finite() {
            return refused(format!("--floor {}: expected a height in mm", self.floor_mm));
        }
        let radius_mm = self.link_radius_mm.unwrap_or(usual.radius_mm);
        if !(0.0..=reach_mm).contains(&radius_mm) {
            return refused(format!(
                "--link-radius {radius_mm}: expected 0 up to the reach of {reach_mm:.0} mm"
            ));
        }
        let approach_rad = self.approach_deg.to_radians();
        Ok(KeepOut { floor_mm: Some(self.floor_mm), boxes_mm, radius_mm, approach_rad })
    }

    /// Refuses numbers and counts out of range.
    fn check_numbers(&self, sigma_mm: f64, usual_poses: usize) -> Result<(), SettingsError> {
        for (name, value, most, unit) in [
            ("--sigma", sigma_mm, MAX_SIGMA_MM, "mm, up to 10 (30 µm are 0.03)"),
            ("--sigma-angle", self.sigma_angle_deg, 10.0, "degrees, up to 10"),
            ("--approach", self.approach_deg, 90.0, "degrees, up to 90"),
            ("--seconds-per-row", self.seconds_per_row, MAX_SECONDS, "seconds, up to 86400"),
            ("--speed", self.speed_mm_s, 10_000.0, "mm/s, up to 10000"),
            ("--decisive", self.decisive, f64::MAX, "a finite number"),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return refused(format!("{name} {value}: expected a number above 0"));
            }
            if value > most {
                return refused(format!("{name} {value}: expected {unit}"));
            }
        }
        for (name, value, most, unit) in [
            ("--settle", self.settle_s, MAX_SECONDS, "seconds, up to 86400"),
            ("--margin", self.margin_deg, 180.0, "degrees, up to 180"),
            ("--singularity", self.singularity, f64::MAX, "a finite number"),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return refused(format!("{name} {value}: expected 0 or more"));
            }
            if value > most {
                return refused(format!("{name} {value}: expected {unit}"));
            }
        }
        let poses = self.poses.unwrap_or(usual_poses);
        if poses < 4 {
            return refused(format!("--poses {poses}: expected at least 4; about 50 to 100 are usual"));
        }
        if poses > MAX_POSES {
            return refused(format!(
                "--poses {poses}: expected at most {MAX_POSES}; about 50 to 100 are usual"
            ));
        }
        for (name, count) in
            [("--repeats", self.repeats), ("--both-sides", self.both_sides), ("--warm-up", self.warm_up)]
        {
            if count > MAX_POSES {
                return refused(format!("{name} {count}: expected at most {MAX_POSES}"));
            }
        }
        if !(1..=MAX_CANDIDATES).contains(&self.candidates) {
            return refused(format!(
                "--candidates {}: expected 1 to {MAX_CANDIDATES}; 2000 are usual",
                self.candidates
            ));
        }
        Ok(())
    }
}

/// Refuses a target farther from the flange than the arm reaches: its place is in other units, or in another frame.
fn refuse_far_target(setup: &MeasurementSetup<'_>, reach_mm: f64) -> Result<(), SettingsError> {
    let at_mm = setup.frames.flange_from_target.translation.vector;
    if at_mm.norm() <= reach_mm {
        return Ok(());
    }
    refused(format!(
        "--touched-point {}: {:.0} mm from the flange, and the arm itself reaches {reach_mm:.0} mm; expected the measured point in the flange \
         frame (mm)",
        numbers(at_mm.as_slice()),
        at_mm.norm()
    ))
}

/// Numbers as the command line takes them.
fn numbers(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}
