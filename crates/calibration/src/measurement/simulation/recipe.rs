//! The TOML schema of a simulated measurement. Lengths are mm, angles degrees, joints, rows and outlets count from 0.
//!
//! ```toml
//! robot = "abb-irb-120"
//! seed = 1
//!
//! [arm.random]                  # link deviations drawn from normal distributions of these standard deviations
//! seed = 7
//! a_mm = 0.3
//! d_mm = 0.3
//! alpha_deg = 0.03
//! beta_deg = 0.03
//! theta_deg = 0.1
//!
//! [[arm.link]]                  # and stated ones on top
//! joint = 1
//! theta_deg = 0.2
//!
//! [[arm.effect]]                # physics beyond rigid links, named as in a diagnosis
//! effect = "gear-eccentricity"
//! joint = 0
//! order = 1.0
//! sine_rad = 0.0003
//! cosine_rad = 0.0
//!
//! [poses]
//! kind = "random"               # or "grid" (min_deg, max_deg, steps) or "list" (joints_deg)
//! count = 100
//!
//! [sensor]
//! kind = "cable"                # or "position" (frame, reflector_mm) or "pose" (frame, target)
//! outlets_mm = [[700.0, 0.0, 100.0]]
//! zeros_mm = [12.5]
//! hook_mm = [0.0, 0.0, 30.0]
//!
//! [noise]
//! sigma_mm = 0.02
//! ```

mod checks;

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::error::RecipeError;

use crate::measurement::sensor::{Rig, SightLimits};
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Body;
use truegrind_math::se3::Pose;

pub use super::fault::Fault;

/// A simulated measurement: arm, poses, sensor, noise and faults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Purpose of the simulation, in words.
    #[serde(default)]
    pub about: String,
    /// Name of the nominal arm.
    pub robot: String,
    /// Seed of poses, conditions and noise.
    pub seed: u64,
    /// Deviations of the actual arm from its data sheet.
    #[serde(default)]
    pub arm: Deviations,
    /// Measured poses.
    pub poses: Poses,
    /// The sensor's field of view.
    #[serde(default)]
    pub view: View,
    /// Time, temperature, payload, approach.
    #[serde(default, rename = "circumstances")]
    pub conditions: RunConditions,
    /// The sensor.
    pub sensor: SensorSetup,
    /// Further places of a tracker or camera, behind that of `sensor`: consecutive shares of the poses, equal in number, are measured from
    /// each in turn.
    #[serde(default)]
    pub station: Vec<Frame>,
    /// Noise of sensor and arm.
    #[serde(default)]
    pub noise: Noise,
    /// Rounding of the written numbers.
    #[serde(default)]
    pub rounding: Rounding,
    /// Whether the controller's own x, y, z are written.
    #[serde(default)]
    pub readout: bool,
    /// Faults of the measurement.
    #[serde(default)]
    pub fault: Vec<Fault>,
}

/// Deviations of an actual arm from its data sheet.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviations {
    /// Deviations drawn at random.
    pub random: Option<RandomDeviations>,
    /// Stated deviations, added.
    #[serde(default)]
    pub link: Vec<LinkDeviation>,
    /// Effects; they replace those of the nominal arm.
    #[serde(default)]
    pub effect: Vec<Effect>,
    /// Masses; they replace those of the data sheet.
    pub body: Option<Vec<Body>>,
}

/// Standard deviations of the link parameters; beta applies to Hayati links, d to the others.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomDeviations {
    /// Seed of the arm.
    pub seed: u64,
    /// Of a (mm).
    #[serde(default)]
    pub a_mm: f64,
    /// Of d (mm).
    #[serde(default)]
    pub d_mm: f64,
    /// Of alpha [°].
    #[serde(default)]
    pub alpha_deg: f64,
    /// Of beta [°].
    #[serde(default)]
    pub beta_deg: f64,
    /// Of theta [°].
    #[serde(default)]
    pub theta_deg: f64,
}

/// Deviations of one link.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkDeviation {
    /// Link, from 0.
    pub joint: usize,
    /// Of a (mm).
    #[serde(default)]
    pub a_mm: f64,
    /// Of d (mm).
    #[serde(default)]
    pub d_mm: f64,
    /// Of alpha [°].
    #[serde(default)]
    pub alpha_deg: f64,
    /// Of beta [°].
    #[serde(default)]
    pub beta_deg: f64,
    /// Of theta [°].
    #[serde(default)]
    pub theta_deg: f64,
}

/// Measured poses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Poses {
    /// Joint angles drawn uniformly from a box.
    Random {
        /// Number of distinct poses.
        count: usize,
        /// Margin from the joint limits [°].
        #[serde(default = "five")]
        margin_deg: f64,
        /// Lower corner of the box [°]; the limits otherwise.
        min_deg: Option<[f64; 6]>,
        /// Upper corner of the box [°]; the limits otherwise.
        max_deg: Option<[f64; 6]>,
        /// Measurements of each pose, spread over the whole run.
        #[serde(default = "one")]
        repeats: usize,
    },
    /// All combinations of evenly spaced angles; joint 1 turns slowest.
    Grid {
        /// Lowest angles [°].
        min_deg: [f64; 6],
        /// Highest angles [°].
        max_deg: [f64; 6],
        /// Number of angles of each joint.
        steps: [usize; 6],
        /// Measurements of each pose, spread over the whole run.
        #[serde(default = "one")]
        repeats: usize,
    },
    /// Stated poses.
    List {
        /// Joint angles [°].
        joints_deg: Vec<[f64; 6]>,
        /// Measurements of each pose, spread over the whole run.
        #[serde(default = "one")]
        repeats: usize,
    },
}

fn five() -> f64 {
    5.0
}

fn one() -> usize {
    1
}

/// The sensor's field of view; poses outside are skipped.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Box for the target, in the arm's base: lower and upper corner (mm).
    pub box_mm: Option<[[f64; 3]; 2]>,
    /// Shortest and longest distance from the sensor (mm).
    pub distance_mm: Option<[f64; 2]>,
    /// Largest angle between the flange's z axis and the line to the sensor [°].
    pub tilt_deg: Option<f64>,
}

impl View {
    /// The limits that depend on the sensor.
    pub fn limits(&self) -> SightLimits {
        SightLimits { distance_mm: self.distance_mm, tilt_rad: self.tilt_deg.map(f64::to_radians) }
    }
}

/// Approach side of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Approach {
    /// Unknown; backlash is simulated as centred.
    #[default]
    Unknown,
    /// From the previous row.
    Sequence,
    /// Random for each joint.
    Random,
    /// Each pose twice, from below and from above.
    Both,
}

/// Time, temperature, payload, approach.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunConditions {
    /// Length of the whole run (h); rows follow evenly from 0.
    pub hours: Option<f64>,
    /// Temperature over the run; needs `hours`.
    pub temperature: Option<WarmUp>,
    /// Payloads (kg), cycled row by row.
    #[serde(default)]
    pub payload_kg: Vec<f64>,
    /// Centre of the payload in the flange frame (mm).
    #[serde(default)]
    pub payload_centre_mm: [f64; 3],
    /// Approach side of the joints.
    #[serde(default)]
    pub approach: Approach,
    /// Omits the columns of these conditions: they affect the arm but are not logged.
    #[serde(default)]
    pub unlogged: bool,
}

/// A first-order temperature rise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
    /// At the beginning [°C].
    pub start_c: f64,
    /// In the end [°C].
    pub end_c: f64,
    /// Time constant (h).
    pub time_constant_h: f64,
}

/// A frame: position and orientation (scalar first).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frame {
    /// Position (mm).
    pub position_mm: [f64; 3],
    /// Orientation; made a unit quaternion.
    #[serde(default = "upright")]
    pub wxyz: [f64; 4],
}

fn upright() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

impl Frame {
    /// As a pose.
    pub fn pose(&self) -> Pose {
        let [w, i, j, k] = self.wxyz;
        let [x, y, z] = self.position_mm;
        Pose::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)),
        )
    }
}

/// The sensor and its target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum SensorSetup {
    /// Draw-wires. With several outlets, each pose is measured with each of them in turn.
    Cable {
        /// Outlets in the base (mm).
        outlets_mm: Vec<[f64; 3]>,
        /// Readings at distance zero (mm); 0 by default.
        #[serde(default)]
        zeros_mm: Vec<f64>,
        /// The hook on the flange (mm).
        #[serde(default)]
        hook_mm: [f64; 3],
    },
    /// A tracker with a reflector.
    Position {
        /// The tracker's frame in the base.
        frame: Frame,
        /// The reflector on the flange (mm).
        #[serde(default)]
        reflector_mm: [f64; 3],
    },
    /// A tracker with a six-dimensional target.
    Pose {
        /// The tracker's frame in the base.
        frame: Frame,
        /// The target on the flange.
        target: Frame,
    },
}

impl SensorSetup {
    /// The sensor in the units of the library.
    pub fn rig(&self) -> Rig {
        match self {
            SensorSetup::Cable { outlets_mm, zeros_mm, hook_mm } => Rig::Cable {
                outlets_mm: outlets_mm.iter().map(|o| Vector3::from(*o)).collect(),
                zeros_mm: (0..outlets_mm.len()).map(|i| zeros_mm.get(i).copied().unwrap_or(0.0)).collect(),
                hook_mm: Vector3::from(*hook_mm),
            },
            SensorSetup::Position { frame, reflector_mm } => {
                Rig::Position { base_from_sensor: frame.pose(), reflector_mm: Vector3::from(*reflector_mm) }
            }
            SensorSetup::Pose { frame, target } => {
                Rig::Pose { base_from_sensor: frame.pose(), flange_from_target: target.pose() }
            }
        }
    }

    /// Outlets of a cable, 1 for other sensors.
    pub fn anchors(&self) -> usize {
        match self {
            SensorSetup::Cable { outlets_mm, .. } => outlets_mm.len(),
            _ => 1,
        }
    }
}

/// Noise of sensor and arm: standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Of a length or coordinate (mm).
    #[serde(default)]
    pub sigma_mm: f64,
    /// Additional noise for each metre from the sensor [mm/m].
    #[serde(default)]
    pub per_metre_mm: f64,
    /// Of a measured orientation, about each axis [°].
    #[serde(default)]
    pub sigma_deg: f64,
    /// Degrees of freedom of Student's t, above 2, for a heavy tail; normal otherwise.
    pub student_t: Option<f64>,
    /// Repeatability of the joints at rest [°].
    #[serde(default)]
    pub joints_deg: f64,
}

/// Steps to which numbers are rounded before they are written.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rounding {
    /// Of the logged angles [°].
    pub angles_deg: Option<f64>,
    /// Of the controller's read-out (mm).
    pub readout_mm: Option<f64>,
    /// Of the sensor's lengths (mm).
    pub reading_mm: Option<f64>,
}

impl Recipe {
    /// The sensor at each of its stations.
    pub fn rigs(&self) -> Vec<Rig> {
        let first = self.sensor.rig();
        let further = self.station.iter().map(|frame| first.at_station(frame.pose()));
        std::iter::once(first.clone()).chain(further).collect()
    }

    /// Reads a recipe; `file` is named in errors.
    pub fn parse(text: &str, file: &str) -> Result<Self, RecipeError> {
        truegrind_math::toml_text::read(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start).min(text.len());
            let line = text.get(..start).unwrap_or_default().matches('\n').count() + 1;
            RecipeError::Syntax { file: file.into(), line, message: error.message().replace('\n', " ") }
        })
    }

    /// Checks that each key is consistent with the others.
    fn check_consistency(&self) -> Result<(), RecipeError> {
        let wrong = |key: &str, found: &str, expected| {
            Err(RecipeError::Invalid { key: key.into(), found: found.into(), expected })
        };
        let cable = matches!(self.sensor, SensorSetup::Cable { .. });
        if cable && !self.station.is_empty() {
            return wrong(
                "station",
                "a cable",
                "sensor.kind = \"position\" or \"pose\": the outlets of a cable are those of outlets_mm",
            );
        }
        if self.noise.sigma_deg != 0.0 && !matches!(self.sensor, SensorSetup::Pose { .. }) {
            return wrong(
                "noise.sigma_deg",
                "a sensor without orientation",
                "sensor.kind = \"pose\", or no sigma_deg",
            );
        }
        if self.rounding.readout_mm.is_some() && !self.readout {
            return wrong("rounding.readout_mm", "no read-out", "readout = true beside it");
        }
        for fault in &self.fault {
            match fault {
                Fault::SensorZeroShift { .. } | Fault::CableSag { .. } if !cable => {
                    return wrong("fault", "a fault of cables", "sensor.kind = \"cable\" beside it");
                }
                Fault::SensorFrameShift { turn_deg, .. } if cable && *turn_deg != [0.0; 3] => {
                    return wrong(
                        "fault.turn_deg",
                        "a cable",
                        "shift_mm alone: an outlet has no orientation",
                    );
                }
                Fault::ReadoutMismatch { .. } if !self.readout => {
                    return wrong("fault", "readout-mismatch without a read-out", "readout = true beside it");
                }
                _ => {}
            }
        }
        Ok(())
    }
}
