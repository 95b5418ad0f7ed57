//! The TOML schema of a robot file, and the model that a sheet describes. Lengths are mm, angles degrees, masses kg.
//!
//! ```toml
//! [[robot]]
//! name = "my-arm"              # name in the catalogue; maker and model: free text
//! maker = "Maker"
//! model = "Arm 10/1.5"
//! dialect = "rapid"            # language of its programs: rapid, krl, fanuc, urscript, val3, inform, hsr
//! compensates = false          # true where the controller already computes with identified parameters
//!
//! [[robot.link]]               # six times, T = Rz(theta) Tz(d) Tx(a) Rx(alpha), ltlm-2024 eq. 2
//! model = "dh"                 # or "hayati", T = Rz(theta) Tx(a) Rx(alpha) Ry(beta), where the next axis is parallel
//! a_mm = 0.0
//! d_mm = 290.0                 # 0 on a hayati link, whose d is added to a neighbour's
//! alpha_deg = -90.0
//! theta_deg = 0.0              # added to the mapped joint angle
//!
//! [robot.joints]
//! map = [[1, 0, 0, 0, 0, 0], …] # DH angle = map · controller angle + theta; left out where it is the identity
//! min_deg = [-165.0, …]         # range and speed in the controller's angles; left out where not published
//! max_deg = [165.0, …]
//! speed_deg_s = [250.0, …]
//! sum = [{ of = [0, 1, 1, 0, 0, 0], min_deg = -70.0, max_deg = 205.0 }] # range of J2 + J3, where there is one
//!
//! [robot.mounting]
//! gravity = [0.0, 0.0, -1.0]   # in the base frame; (0, 0, 1) for an arm that hangs
//!
//! [robot.sources]
//! links = "data sheet …"
//! ```

use nalgebra::{Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::limits::{Limits, SumLimit};
use crate::link::{Link, LinkModel};
use crate::model::Model;
use truegrind_math::se3::Pose;

/// Where no range is published, one turn either way (rad): how far a search may go, not a limit of the arm.
pub const ONE_TURN_RAD: f64 = std::f64::consts::TAU;

/// A robot file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// The arms.
    pub robot: Vec<DataSheet>,
}

/// One arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataSheet {
    /// Name by which the arm is asked for.
    pub name: String,
    /// Maker.
    #[serde(default)]
    pub maker: String,
    /// The maker's designation.
    #[serde(default)]
    pub model: String,
    /// Rated load (kg).
    pub payload_kg: Option<f64>,
    /// Reach (mm); its source says of what.
    pub reach_mm: Option<f64>,
    /// Pose repeatability RP (mm).
    pub repeatability_mm: Option<f64>,
    /// Language of its programs.
    pub dialect: Option<Dialect>,
    /// How the links are to be read.
    #[serde(default)]
    pub convention: Convention,
    /// How its NC programs write an orientation, where that is not the habit of the dialect.
    pub orientation: Option<Orientation>,
    /// Whether the controller already computes with identified parameters ("absolute accuracy" options).
    #[serde(default)]
    pub compensates: bool,
    /// The links from base to flange; six.
    pub link: Vec<LinkSheet>,
    /// Joints of the controller.
    #[serde(default)]
    pub joints: JointSheet,
    /// The flange in the last link frame; the same where left out.
    pub flange: Option<FlangeSheet>,
    /// How the arm stands.
    #[serde(default)]
    pub mounting: Mounting,
    /// Masses of the links.
    pub masses: Option<Masses>,
    /// Where the numbers come from.
    #[serde(default)]
    pub sources: Sources,
    /// Poses that somebody else computed or measured, against which the links are checked on loading.
    #[serde(default)]
    pub published: Vec<Published>,
}

/// Program language of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Dialect {
    /// ABB.
    Rapid,
    /// KUKA.
    Krl,
    /// FANUC TP.
    Fanuc,
    /// Universal Robots.
    Urscript,
    /// Stäubli VAL 3.
    Val3,
    /// Yaskawa.
    Inform,
    /// HuaShu.
    Hsr,
}

/// Convention of the link table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Convention {
    /// Distal ("standard") Denavit–Hartenberg, ltlm-2024 eq. 2. The modified table after Craig is not the same.
    #[default]
    StandardDh,
}

/// How three or four numbers of a program mean a rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Orientation {
    /// w, x, y, z (RAPID).
    Quaternion,
    /// A about z, B about the new y, C about the new x (KUKA).
    Abc,
    /// W, P, R about the fixed x, y, z (FANUC, Yaskawa).
    Wpr,
    /// Rotation vector (Universal Robots).
    RotationVector,
    /// Rx, Ry, Rz about x, the new y, the new z (Stäubli).
    Rxyz,
}

/// One link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkSheet {
    /// Which parameters are free.
    pub model: LinkModel,
    /// Link length a (mm).
    pub a_mm: f64,
    /// Link offset d (mm).
    pub d_mm: f64,
    /// Twist alpha (°).
    pub alpha_deg: f64,
    /// Offset theta (°), added to the mapped joint angle.
    pub theta_deg: f64,
    /// Second twist beta (°), of a Hayati link only.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub beta_deg: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Joints of the controller.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSheet {
    /// What the controller shows and logs.
    #[serde(default)]
    pub angles: Angles,
    /// DH angle = map · controller angle + theta; the identity where left out.
    pub map: Option<[[f64; 6]; 6]>,
    /// Lowest angles (°).
    pub min_deg: Option<[f64; 6]>,
    /// Highest angles (°).
    pub max_deg: Option<[f64; 6]>,
    /// Highest speeds (°/s).
    pub speed_deg_s: Option<[f64; 6]>,
    /// Ranges of sums of joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sum: Vec<SumLimit>,
}

/// What the angles of a log are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Angles {
    /// The controller's own, without the offsets theta of the links.
    #[default]
    Logged,
    /// DH angles: the offsets theta are in them already.
    Dh,
}

/// Flange in the last link frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlangeSheet {
    /// Origin (mm).
    #[serde(default)]
    pub position_mm: [f64; 3],
    /// Orientation w, x, y, z.
    #[serde(default = "no_turn")]
    pub quaternion_wxyz: [f64; 4],
}

fn no_turn() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

/// How the arm stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mounting {
    /// Direction of gravity in the base frame; need not have length 1.
    #[serde(default = "downwards")]
    pub gravity: [f64; 3],
    /// Centre of the mounting face in the base frame (mm): some controllers have their origin higher up.
    #[serde(default)]
    pub plate_mm: [f64; 3],
}

impl Default for Mounting {
    fn default() -> Self {
        Self { gravity: downwards(), plate_mm: [0.0; 3] }
    }
}

fn downwards() -> [f64; 3] {
    [0.0, 0.0, -1.0]
}

/// Masses of the links.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Masses {
    /// Mass of each link (kg).
    pub mass_kg: [f64; 6],
    /// Centre of mass of each link in the frame at its end (mm).
    pub centre_mm: [[f64; 3]; 6],
}

/// Where the numbers come from, in words that let a reader find them.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sources {
    /// Link table and joint map.
    #[serde(default)]
    pub links: String,
    /// Ranges and speeds of the joints.
    #[serde(default)]
    pub limits: String,
    /// Masses and their centres.
    #[serde(default)]
    pub masses: String,
    /// Load, reach and repeatability.
    #[serde(default)]
    pub payload: String,
}

/// A pose that the links must meet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// In words.
    pub what: String,
    /// The point that is meant.
    #[serde(default)]
    pub point: Point,
    /// Joints as the map takes them, without the offsets theta (°).
    pub joints_deg: [f64; 6],
    /// The point in the base frame (mm).
    pub position_mm: Option<[f64; 3]>,
    /// Or how far it lies from axis 1 (mm).
    pub radius_mm: Option<f64>,
    /// Orientation of the flange in the base, w, x, y, z.
    pub quaternion_wxyz: Option<[f64; 4]>,
    /// How well it must be met (mm): the rounding of what was published.
    pub tolerance_mm: f64,
    /// Where it was published.
    pub source: String,
}

/// A point of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Point {
    /// Centre of the flange.
    #[default]
    Flange,
    /// End of link 5, where axes 5 and 6 cross.
    WristCentre,
}

impl DataSheet {
    /// How programs of this arm write an orientation; `None` where neither the file nor the dialect says.
    pub fn orientation(&self) -> Option<Orientation> {
        self.orientation.or(match self.dialect? {
            Dialect::Rapid => Some(Orientation::Quaternion),
            Dialect::Krl => Some(Orientation::Abc),
            Dialect::Fanuc | Dialect::Inform => Some(Orientation::Wpr),
            Dialect::Urscript => Some(Orientation::RotationVector),
            Dialect::Val3 => Some(Orientation::Rxyz),
            Dialect::Hsr => None,
        })
    }

    /// The nominal model of these links; the rest is taken from the sheet, which has been checked.
    pub(super) fn model(&self, links: &[LinkSheet; 6]) -> Model {
        let [gx, gy, gz] = self.mounting.gravity;
        Model {
            links: links.map(|link| link.link()),
            joint_map: self
                .joints
                .map
                .map_or_else(Matrix6::identity, |rows| Matrix6::from_fn(|row, column| rows[row][column])),
            limits: self.joints.limits(),
            flange: self.flange.map_or_else(Pose::identity, |flange| {
                let [x, y, z] = flange.position_mm;
                Pose::from_parts(Translation3::new(x, y, z), unit_quaternion(&flange.quaternion_wxyz))
            }),
            bodies: self.masses.as_ref().map(|masses| {
                std::array::from_fn(|i| Body { mass_kg: masses.mass_kg[i], centre_mm: masses.centre_mm[i] })
            }),
            gravity: Vector3::new(gx, gy, gz).normalize(),
            effects: Vec::new(),
        }
    }
}

impl LinkSheet {
    fn link(&self) -> Link {
        Link {
            model: self.model,
            a_mm: self.a_mm,
            d_mm: self.d_mm,
            alpha_rad: self.alpha_deg.to_radians(),
            theta_rad: self.theta_deg.to_radians(),
            beta_rad: self.beta_deg.to_radians(),
        }
    }
}

impl JointSheet {
    fn limits(&self) -> Limits {
        let radians = |degrees: [f64; 6]| degrees.map(f64::to_radians);
        Limits {
            min_rad: self.min_deg.map_or([-ONE_TURN_RAD; 6], radians),
            max_rad: self.max_deg.map_or([ONE_TURN_RAD; 6], radians),
            speed_rad_s: self.speed_deg_s.map(radians),
            sums: self.sum.clone(),
        }
    }
}

/// A rotation from w, x, y, z, made exactly one.
pub(super) fn unit_quaternion(wxyz: &[f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]))
}
