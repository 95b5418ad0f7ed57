//! What disturbs a measurement: a push of a stated kind that follows a stated course over the rows.
//!
//! A *kind* says what is pushed (the cable's zero, the frame of the sensor, the touched point, the scale, the cable's sag,
//! the load on the arm), a *course* in which rows and how far. Their product is every fault of a measurement that a
//! calibration can fit: a zero that jumped between two rows, a tripod that was kicked, a hook that slipped, a base that
//! drifts while the hall warms up.
//!
//! Source of the sag: the parabola of a taut cable under its own weight, which is longer than its chord by (w/T)² h² d / 24
//! with w/T weight per length over tension, h the horizontal span and d the distance (any text on statics).

use nalgebra::Vector3;

use super::form::Form;
use crate::measurement::dataset::Row;

/// What is pushed.
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
    /// The touched point on the flange: shift (mm).
    Tool,
    /// Relative error of the sensor's scale.
    Scale,
    /// Square of the cable's weight per length over its tension [1/m²].
    Sag,
    /// A mass at the flange that the log does not tell of.
    Load {
        /// Joints (0-based) that yield under it.
        joints: Vec<usize>,
        /// Compliance of each (rad/(N m)); with it the mass (kg) is the one parameter, without it there is a product of
        /// compliance and mass for each joint.
        compliance: Option<Vec<f64>>,
    },
    /// What depends on the whole pose, on the reading, or on the row before.
    Form(Form),
}

impl Kind {
    /// Whether it turns joints, as effects of the arm do.
    #[inline]
    pub fn turns_joints(&self) -> bool {
        match self {
            Kind::Load { .. } => true,
            Kind::Form(form) => form.turns(),
            _ => false,
        }
    }
}

/// In which rows, and how far.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Course {
    /// Everywhere alike.
    Always,
    /// From one row to another, by their numbers, both included.
    Rows {
        /// First data row.
        from: usize,
        /// Last data row.
        to: usize,
    },
    /// 1 − e^(−t/T) with the row's time.
    Clock {
        /// T (h).
        time_constant_h: f64,
    },
    /// Per kelvin above a reference, with the row's temperature.
    Thermometer {
        /// Reference [°C].
        reference_c: f64,
    },
}

impl Course {
    /// How far the push goes in a row.
    pub fn at(&self, row: &Row) -> f64 {
        match *self {
            Course::Always => 1.0,
            Course::Rows { from, to } => f64::from(u8::from((from..=to).contains(&row.number))),
            Course::Clock { time_constant_h } => {
                row.condition.time_h.map_or(0.0, |t| 1.0 - (-t / time_constant_h).exp())
            }
            Course::Thermometer { reference_c } => {
                row.condition.temperature_c.map_or(0.0, |t| t - reference_c)
            }
        }
    }
}

/// A kind, its course, and how strong it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Disturbance {
    /// What is pushed.
    pub kind: Kind,
    /// In which rows.
    pub course: Course,
    /// One value for each of [`Disturbance::names`].
    pub values: Vec<f64>,
}

impl Disturbance {
    /// A disturbance of size 0.
    pub fn new(kind: Kind, course: Course) -> Self {
        let count = names(&kind).len();
        Self { kind, course, values: vec![0.0; count] }
    }

    /// Name and unit of each parameter.
    pub fn names(&self) -> Vec<(String, &'static str)> {
        names(&self.kind)
    }

    /// What it adds to one row.
    pub fn push(&self, row: &Row) -> Push {
        let how_far = self.course.at(row);
        let value = |k: usize| how_far * self.values.get(k).copied().unwrap_or(0.0);
        let vector = |from: usize| Vector3::new(value(from), value(from + 1), value(from + 2));
        let mut out = Push::default();
        match &self.kind {
            Kind::Zero => out.zero_mm = value(0),
            Kind::Frame { turning } => {
                out.frame_mm = vector(0);
                if *turning {
                    out.turn_rad = vector(3);
                }
            }
            Kind::Tool => out.tool_mm = vector(0),
            Kind::Scale => out.scale = value(0),
            Kind::Sag => out.sag_per_m2 = value(0),
            // They act on the joints, or differ from row to row.
            Kind::Load { .. } | Kind::Form(_) => {}
        }
        out
    }
}

/// What disturbances add to one row; loads on the arm are apart.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Push {
    /// To the cable's reading (mm).
    pub zero_mm: f64,
    /// To the sensor's place in the base (mm).
    pub frame_mm: Vector3<f64>,
    /// Rotation vector of the sensor's frame in the base (rad).
    pub turn_rad: Vector3<f64>,
    /// To the touched point on the flange (mm).
    pub tool_mm: Vector3<f64>,
    /// To the scale.
    pub scale: f64,
    /// To the square of weight over tension [1/m²].
    pub sag_per_m2: f64,
}

impl std::ops::AddAssign for Push {
    fn add_assign(&mut self, other: Self) {
        self.zero_mm += other.zero_mm;
        self.frame_mm += other.frame_mm;
        self.turn_rad += other.turn_rad;
        self.tool_mm += other.tool_mm;
        self.scale += other.scale;
        self.sag_per_m2 += other.sag_per_m2;
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
        Kind::Frame { turning: false } | Kind::Tool => shift.to_vec(),
        Kind::Frame { turning: true } => {
            let turn = ["rx", "ry", "rz"].map(|n| (n.to_owned(), "rad"));
            shift.into_iter().chain(turn).collect()
        }
        Kind::Scale => vec![("scale error".to_owned(), "1")],
        Kind::Sag => vec![("weight over tension squared".to_owned(), "1/m²")],
        Kind::Form(form) => form.names(),
        Kind::Load { compliance: Some(_), .. } => vec![("mass".to_owned(), "kg")],
        Kind::Load { joints, .. } => {
            joints.iter().map(|j| (format!("compliance x mass, joint {}", j + 1), "rad kg/(N m)")).collect()
        }
    }
}
