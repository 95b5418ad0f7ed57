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
}

impl Line {
    /// A visit and its reading.
    pub fn new(visit: &Visit, reading: Reading) -> Self {
        Self { q: visit.q, reading, hours: visit.hours }
    }
}

/// The file, every number to its last digit or to so many decimals.
pub fn text(kind: Kind, lines: &[Line], decimals: Option<usize>) -> String {
    let mut out = String::from("q1,q2,q3,q4,q5,q6,t");
    out.push_str(match kind {
        Kind::Cable => ",L",
        Kind::Position => ",measured_x,measured_y,measured_z",
        Kind::Pose => ",measured_x,measured_y,measured_z,measured_qw,measured_qx,measured_qy,measured_qz",
    });
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
            let _ = match decimals {
                Some(decimals) => write!(out, "{comma}{number:.decimals$}"),
                None => write!(out, "{comma}{number}"),
            };
        }
    }
    out.push('\n');
    out
}
