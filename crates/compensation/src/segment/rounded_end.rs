//! The rounded corners at the ends of a line, and what inserted targets make of them.
//!
//! A zone reaches at most half-way to the next target. An inserted target nearer to a corner than twice the radius of its zone makes the corner
//! sharper: the path then passes it at another distance, by far more than the insertion straightens the line.
//! Source: ABB, RAPID reference manual, zonedata (zones cut to half the distance), as in [`super::corner`].

use nalgebra::Vector3;

/// A corner that cuts off less than this is treated as the lines that it joins (mm): over so short a distance the arm's error
/// changes by less than the sampling accuracy of lines.
pub(crate) const CUT_MM: f64 = 0.2;

/// How the path is rounded at an end of a line.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RoundedEnd {
    /// Radius of the corner (mm); 0 without one.
    radius_mm: f64,
    /// Distance of the unit vectors of its two directions: 0 straight on, √2 at a right angle.
    turn: f64,
}

impl RoundedEnd {
    /// The corner at the second of three points of the path, with a zone of this radius.
    pub(crate) fn of([start, corner, end]: &[Vector3<f64>; 3], zone_mm: f64) -> Self {
        let (segment_in, segment_out) = (corner - start, end - corner);
        let (long_in, long_out) = (segment_in.norm(), segment_out.norm());
        let radius_mm = zone_mm.min(0.5 * long_in).min(0.5 * long_out);
        if !(radius_mm > 1e-9) {
            return Self::default();
        }
        Self { radius_mm, turn: (segment_out / long_out - segment_in / long_in).norm() }
    }

    /// How far from it an inserted target leaves the corner as it is (mm).
    pub(crate) fn free_mm(&self) -> f64 {
        if self.cut_mm(self.radius_mm) > CUT_MM { 2.0 * self.radius_mm } else { 0.0 }
    }

    /// By how much a target that is inserted at this distance moves the path in the corner (mm).
    pub(crate) fn moved_mm(&self, distance_mm: f64) -> f64 {
        self.cut_mm(self.radius_mm) - self.cut_mm(self.radius_mm.min(0.5 * distance_mm))
    }

    /// Smallest distance of the path from the corner (mm).
    fn cut_mm(&self, radius_mm: f64) -> f64 {
        0.25 * self.turn * radius_mm
    }
}
