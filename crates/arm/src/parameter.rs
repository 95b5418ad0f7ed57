//! Names, units and manufacturing tolerances of everything that identification may move.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::link::{Link, LinkModel};
use super::model::Model;

/// One coordinate of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LinkCoordinate {
    /// Length a (mm).
    A,
    /// Offset d (mm); a DH link's.
    D,
    /// Twist alpha (rad).
    Alpha,
    /// Joint offset theta (rad).
    Theta,
    /// Second twist beta (rad); a Hayati link's.
    Beta,
}

impl LinkCoordinate {
    /// Whether the coordinate is a length, which grows with a warm arm.
    pub fn is_length(self) -> bool {
        matches!(self, LinkCoordinate::A | LinkCoordinate::D)
    }
}

/// Link parameters that are made with one kind of tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ToleranceGroup {
    /// Lengths and offsets (mm).
    Length,
    /// Twists (rad).
    Twist,
    /// Joint zeros (rad).
    JointZero,
}

impl ToleranceGroup {
    /// How many groups there are.
    pub const COUNT: usize = 3;
}

/// A coordinate of a frame: x, y, z (mm), then the rotation vector (rad).
pub const FRAME_COORDINATES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// One number that identification may move. Joints, effects and anchors count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// Pose of the arm's base in the world, or of the sensor's frame in the base: coordinate 0 to 5.
    SensorFrame(usize),
    /// A link.
    Link {
        /// Link, 0-based.
        joint: usize,
        /// Which of its numbers.
        coordinate: LinkCoordinate,
    },
    /// A parameter of an effect.
    Effect {
        /// Effect in the model's list.
        index: usize,
        /// Parameter of the effect.
        parameter: usize,
    },
    /// The frame (or point) on the flange that the sensor touches: coordinate 0 to 5. It is not the TCP.
    Target(usize),
    /// Outlet of a cable in the base: which cable, coordinate 0 to 2.
    Outlet {
        /// Cable.
        anchor: usize,
        /// x, y or z.
        axis: usize,
    },
    /// Zero of a cable's length (mm).
    Zero {
        /// Cable.
        anchor: usize,
    },
    /// A parameter of something that disturbed the measurement.
    Disturbance {
        /// Disturbance in the list of the frames.
        index: usize,
        /// Parameter of the disturbance.
        parameter: usize,
    },
}

impl Parameter {
    /// The kind of manufacturing tolerance that a link parameter is made with; `None` for all other parameters.
    pub fn tolerance_group(&self) -> Option<ToleranceGroup> {
        let Parameter::Link { coordinate, .. } = self else { return None };
        Some(match coordinate {
            LinkCoordinate::A | LinkCoordinate::D => ToleranceGroup::Length,
            LinkCoordinate::Alpha | LinkCoordinate::Beta => ToleranceGroup::Twist,
            LinkCoordinate::Theta => ToleranceGroup::JointZero,
        })
    }

    /// The unit in which the number is held; empty where an effect or a disturbance has its own.
    pub fn unit(&self) -> &'static str {
        if self.is_length() {
            "mm"
        } else if self.is_angle() {
            "rad"
        } else {
            ""
        }
    }

    /// Whether it is a length (mm) of a link or a frame. The others of links and frames are angles (rad).
    pub fn is_length(&self) -> bool {
        match self {
            Parameter::SensorFrame(k) | Parameter::Target(k) => *k < 3,
            Parameter::Link { coordinate, .. } => {
                matches!(coordinate, LinkCoordinate::A | LinkCoordinate::D)
            }
            Parameter::Outlet { .. } | Parameter::Zero { .. } => true,
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => false,
        }
    }

    /// Whether it is an angle (rad) of a link or a frame.
    pub fn is_angle(&self) -> bool {
        !self.is_length() && !self.is_of_cause()
    }

    /// Whether the number belongs to the arm (link or effect), not to how it was measured.
    pub fn is_of_arm(&self) -> bool {
        matches!(self, Parameter::Link { .. } | Parameter::Effect { .. })
    }

    /// Whether the number belongs to an effect or a disturbance.
    pub fn is_of_cause(&self) -> bool {
        matches!(self, Parameter::Effect { .. } | Parameter::Disturbance { .. })
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Parameter::SensorFrame(k) => write!(f, "sensor.{}", FRAME_COORDINATES[*k]),
            Parameter::Target(k) => write!(f, "target.{}", FRAME_COORDINATES[*k]),
            Parameter::Link { joint, coordinate } => {
                let name = match coordinate {
                    LinkCoordinate::A => "a",
                    LinkCoordinate::D => "d",
                    LinkCoordinate::Alpha => "alpha",
                    LinkCoordinate::Theta => "theta",
                    LinkCoordinate::Beta => "beta",
                };
                write!(f, "link{}.{name}", joint + 1)
            }
            Parameter::Effect { index, parameter } => write!(f, "effect{}.{}", index + 1, parameter + 1),
            Parameter::Outlet { anchor: 0, axis } => write!(f, "outlet.{}", FRAME_COORDINATES[*axis]),
            Parameter::Outlet { anchor, axis } => {
                write!(f, "outlet{}.{}", anchor + 1, FRAME_COORDINATES[*axis])
            }
            Parameter::Zero { anchor: 0 } => write!(f, "zero"),
            Parameter::Zero { anchor } => write!(f, "zero{}", anchor + 1),
            Parameter::Disturbance { index, parameter } => {
                write!(f, "disturbance{}.{}", index + 1, parameter + 1)
            }
        }
    }
}

/// The four coordinates of a link that are free: a, d or beta, alpha, theta.
pub fn link_coordinates(model: LinkModel) -> [LinkCoordinate; 4] {
    let second = match model {
        LinkModel::Dh => LinkCoordinate::D,
        LinkModel::Hayati => LinkCoordinate::Beta,
    };
    [LinkCoordinate::A, second, LinkCoordinate::Alpha, LinkCoordinate::Theta]
}

/// The 24 link parameters of an arm, link by link.
pub fn link_parameters(model: &Model) -> Vec<Parameter> {
    (0..6)
        .flat_map(|joint| {
            link_coordinates(model.links[joint].model).map(|coordinate| Parameter::Link { joint, coordinate })
        })
        .collect()
}

impl Link {
    /// The value of a coordinate (mm or rad).
    pub fn get(&self, coordinate: LinkCoordinate) -> f64 {
        match coordinate {
            LinkCoordinate::A => self.a_mm,
            LinkCoordinate::D => self.d_mm,
            LinkCoordinate::Alpha => self.alpha_rad,
            LinkCoordinate::Theta => self.theta_rad,
            LinkCoordinate::Beta => self.beta_rad,
        }
    }

    /// Sets a coordinate (mm or rad).
    pub fn set(&mut self, coordinate: LinkCoordinate, value: f64) {
        let place = match coordinate {
            LinkCoordinate::A => &mut self.a_mm,
            LinkCoordinate::D => &mut self.d_mm,
            LinkCoordinate::Alpha => &mut self.alpha_rad,
            LinkCoordinate::Theta => &mut self.theta_rad,
            LinkCoordinate::Beta => &mut self.beta_rad,
        };
        *place = value;
    }
}

/// Parameters of the arm: links, then effects.
///
/// ```
/// use truegrind_arm::effect::{Effect, backlash::Backlash};
/// use truegrind_arm::parameter::arm_parameters;
/// use truegrind_arm::robots;
///
/// // Four numbers a link, then those of the effects; where axes are parallel, beta in place of d.
/// let mut arm = robots::load("abb-irb-120")?.model;
/// arm.effects.push(Effect::Backlash(Backlash { joint: 0, play_rad: 0.0 }));
/// let names: Vec<String> = arm_parameters(&arm).iter().map(ToString::to_string).collect();
/// assert_eq!(names.len(), 25);
/// assert_eq!(names[4..8], ["link2.a", "link2.beta", "link2.alpha", "link2.theta"]);
/// assert_eq!(names[24], "effect1.1");
/// # Ok::<(), robots::RobotError>(())
/// ```
pub fn arm_parameters(model: &Model) -> Vec<Parameter> {
    let mut out = link_parameters(model);
    for (index, effect) in model.effects.iter().enumerate() {
        let count = effect.parameters().len();
        out.extend((0..count).map(|parameter| Parameter::Effect { index, parameter }));
    }
    out
}

/// Factor to the unit in which a number of `unit` is shown, and that unit: degrees for radians, unchanged otherwise.
///
/// ```
/// use truegrind_arm::parameter::display_unit;
///
/// assert_eq!(display_unit("mm"), (1.0, "mm"));
/// assert_eq!(display_unit("rad"), (1f64.to_degrees(), "°"));
/// ```
pub fn display_unit(unit: &str) -> (f64, &str) {
    match unit {
        "rad" => (1f64.to_degrees(), "°"),
        other => (1.0, other),
    }
}
