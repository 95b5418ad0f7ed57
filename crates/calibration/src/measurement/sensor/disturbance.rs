//! Disturbances of a measurement: a *kind* of error times a *profile* over the rows.
//!
//! The kind states what is displaced (the cable's zero, the sensor's frame, the target, the scale, the cable's sag, the
//! load on the arm, a joint's zero), the profile in which rows and by what factor. Their product covers every measurement fault that a
//! calibration can fit: a zero that jumped between two rows, a tripod that was kicked, a hook that slipped, a base that
//! drifts while the hall warms up.
//!
//! Source of the sag: the parabola of a taut cable under its own weight, which is longer than its chord by (w/T)² h² d / 24
//! with w/T weight per length over tension, h the horizontal span and d the distance (any text on statics).

use nalgebra::Vector3;

use super::empirical::EmpiricalFault;
use crate::measurement::dataset::Row;

/// What is displaced.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Kind {
    /// Length added to a cable's reading (mm).
    Zero,
    /// The sensor's frame, or a cable's outlet, in the base: shift (mm), and where `turning` a rotation vector (rad) about
    /// the sensor.
    Frame {
        /// Whether it may turn too; not for a cable.
        turning: bool,
    },
    /// The target on the flange: shift (mm).
    Target,
    /// Relative error of the sensor's scale.
    Scale,
    /// Square of the cable's weight per length over its tension [1/m²].
    Sag,
    /// An unlogged mass at the flange.
    Load {
        /// Joints (0-based) that yield under it.
        joints: Vec<usize>,
        /// Compliance of each (rad/(N m)); with it the mass (kg) is the one parameter, without it there is a product of
        /// compliance and mass for each joint.
        compliance: Option<Vec<f64>>,
    },
    /// The zero of a joint (0-based): the angle (rad) by which it stood elsewhere than its encoder says.
    JointZero {
        /// The joint.
        joint: usize,
    },
    /// A fault that depends on the whole pose, on the reading, or on the previous row.
    Empirical(EmpiricalFault),
}

impl Kind {
    /// Whether it rotates joints, as effects of the arm do.
    #[inline]
    pub fn rotates_joints(&self) -> bool {
        match self {
            Kind::Load { .. } | Kind::JointZero { .. } => true,
            Kind::Empirical(fault) => fault.rotates_joints(),
            _ => false,
        }
    }
}

/// Factor of a disturbance in each row.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Profile {
    /// 1 in every row.
    Constant,
    /// 1 from one row number to another, both included, else 0.
    Rows {
        /// First data row.
        from: usize,
        /// Last data row.
        to: usize,
    },
    /// 1 − e^(−(t − t₀)/T) with the row's time t.
    Exponential {
        /// t₀, the time of the first row (h).
        start_h: f64,
        /// T (h).
        time_constant_h: f64,
    },
    /// 1 in the rows of one station, else 0.
    Station {
        /// The station, from 0.
        station: usize,
    },
    /// Per kelvin above a reference, with the row's temperature.
    Temperature {
        /// Reference [°C].
        reference_c: f64,
    },
}

impl Profile {
    /// The factor in a row; 0 where the row lacks the time or temperature.
    pub fn at(&self, row: &Row) -> f64 {
        match *self {
            Profile::Constant => 1.0,
            Profile::Rows { from, to } => f64::from(u8::from((from..=to).contains(&row.number))),
            Profile::Station { station } => f64::from(u8::from(row.anchor == station)),
            Profile::Exponential { start_h, time_constant_h } => {
                row.condition.time_h.map_or(0.0, |t| 1.0 - (-(t - start_h).max(0.0) / time_constant_h).exp())
            }
            Profile::Temperature { reference_c } => {
                row.condition.temperature_c.map_or(0.0, |t| t - reference_c)
            }
        }
    }
}

/// A kind of disturbance with its profile and size.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// What is displaced.
    pub kind: Kind,
    /// Factor in each row.
    pub profile: Profile,
    /// One value for each of [`Disturbance::names`].
    pub values: Vec<f64>,
}

impl Disturbance {
    /// A disturbance of size 0.
    pub fn new(kind: Kind, profile: Profile) -> Self {
        let count = names(&kind).len();
        Self { kind, profile, values: vec![0.0; count] }
    }

    /// Name and unit of each parameter.
    pub fn names(&self) -> Vec<(String, &'static str)> {
        names(&self.kind)
    }
}

/// Length (mm) that a sag of `square` [1/m²] adds to a cable along `away` (mm), outlet to hook.
pub fn sag_mm(square: f64, away: &Vector3<f64>) -> f64 {
    let away = away * 1e-3;
    1e3 * square * (away.x * away.x + away.y * away.y) * away.norm() / 24.0
}

fn names(kind: &Kind) -> Vec<(String, &'static str)> {
    let shift = ["x", "y", "z"].map(|n| (n.to_owned(), "mm"));
    match kind {
        Kind::Zero => vec![("offset".to_owned(), "mm")],
        Kind::Frame { turning: false } | Kind::Target => shift.to_vec(),
        Kind::Frame { turning: true } => {
            let turn = ["rx", "ry", "rz"].map(|n| (n.to_owned(), "rad"));
            shift.into_iter().chain(turn).collect()
        }
        Kind::Scale => vec![("scale error".to_owned(), "1")],
        Kind::Sag => vec![("weight over tension squared".to_owned(), "1/m²")],
        Kind::Empirical(fault) => fault.names(),
        Kind::JointZero { .. } => vec![("offset".to_owned(), "rad")],
        Kind::Load { compliance: Some(_), .. } => vec![("mass".to_owned(), "kg")],
        Kind::Load { joints, .. } => {
            joints.iter().map(|j| (format!("compliance x mass, joint {}", j + 1), "rad kg/(N m)")).collect()
        }
    }
}
