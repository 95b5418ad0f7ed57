//! Rows as a user's file has them.

use std::fmt::Write as _;

use crate::arms::Angles;
use crate::designs::Visit;
use crate::sensors::{Kind, Reading};

/// A line of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Logged angles (rad).
    pub q: Angles,
    /// What was read.
    pub reading: Reading,
    /// When (h).
    pub hours: f64,
    /// The angles before the last step.
    pub before: Angles,
}

impl Line {
    /// A visit and its reading.
    pub fn new(visit: &Visit, reading: Reading) -> Self {
        Self { q: visit.q, reading, hours: visit.hours, before: visit.before }
    }
}

/// What is written beside angles, times and readings, and how finely.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Format {
    /// Every number to eight decimals instead of to its last digit.
    pub eight_decimals: bool,
    /// From which side each joint came.
    pub sides: bool,
}

/// The file.
pub fn text(kind: Kind, lines: &[Line], format: Format) -> String {
    let mut out = String::from("q1,q2,q3,q4,q5,q6,t");
    out.push_str(match kind {
        Kind::Cable => ",L",
        Kind::Position => ",measured_x,measured_y,measured_z",
        Kind::Pose => ",measured_x,measured_y,measured_z,measured_qw,measured_qx,measured_qy,measured_qz",
    });
    if format.sides {
        out.push_str(",approach1,approach2,approach3,approach4,approach5,approach6");
    }
    for line in lines {
        out.push('\n');
        let mut numbers: Vec<f64> = line.q.iter().map(|q| q.to_degrees()).collect();
        numbers.push(line.hours);
        numbers.extend(line.reading.lengths());
        if let Reading::Pose(pose) = line.reading {
            let r = pose.rotation;
            numbers.extend([r.w, r.i, r.j, r.k]);
        }
        for (k, number) in numbers.iter().enumerate() {
            let comma = if k == 0 { "" } else { "," };
            // Writing to a string never fails.
            let _ = if format.eight_decimals {
                write!(out, "{comma}{number:.8}")
            } else {
                write!(out, "{comma}{number}")
            };
        }
        if format.sides {
            for j in 0..6 {
                let step = line.q[j] - line.before[j];
                let side = if step.abs() < 1e-6 { 0 } else { -step.signum() as i8 };
                let _ = write!(out, ",{side}");
            }
        }
    }
    out.push('\n');
    out
}
