//! Corners that the robot rounds: the path within the zone of a fly-by point.
//!
//! Method. Within its zone of radius r a fly-by point is not reached: the path leaves the incoming segment at distance r
//! before the point and joins the outgoing one at distance r after it, on a parabola tangent to both, that is, the quadratic
//! Bézier curve with the point as its middle control point; orientations by repeated slerp likewise. r is at most half of
//! each segment. The commanded corner, followed by the estimated arm, is compared with the intended one; this also reveals
//! when inserted targets shorten a zone and so change the shape of the corner.
//! Shapes: poses of the tool in the work object (mm).
//! Stops: sampled to the chord error of lines (0.002 mm); corners that cut off less than `CUT_MM` are treated as the lines
//! they join.
//! Source: ABB, RAPID reference manual, zonedata and motion principles (corner path a parabola, zones cut to half the
//! distance). Departure: the larger zones of reorientation and external axes are taken as that of the position.
//! Checked against: a right angle in closed form, dense samples of the corner in the tests.

use nalgebra::Vector3;

use crate::arms::Arms;
use crate::backlash::play_operator::PlayOperator;
use crate::segment::curve::{Curve, between, lateral_offset};
use crate::segment::line::{STEPS, SegmentEnd, largest_from};
use crate::segment::rounded_end::CUT_MM;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;

/// A rounded corner: exit from the incoming segment, rounded point, entry into the outgoing segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    control: [Pose; 3],
}

impl Corner {
    /// The corner that a zone of this radius makes between two segments.
    pub fn of(segment_in: &Curve, segment_out: &Curve, zone_mm: f64) -> Self {
        let (long_in, long_out) = (segment_in.length_mm(), segment_out.length_mm());
        let radius = zone_mm.min(0.5 * long_in).min(0.5 * long_out);
        let share = |long: f64| if long > 1e-9 { radius / long } else { 0.0 };
        Self {
            control: [segment_in.at(1.0 - share(long_in)), segment_in.to, segment_out.at(share(long_out))],
        }
    }

    /// The pose at a share of the corner.
    pub fn at(&self, t: f64) -> Pose {
        let [a, b, c] = &self.control;
        between(&between(a, b, t), &between(b, c, t), t)
    }

    /// Smallest distance of the path from the rounded point (mm).
    pub fn cut_mm(&self) -> f64 {
        let [a, b, c] = self.control.map(|pose| pose.translation.vector);
        (0.25 * (a + c) - 0.5 * b).norm()
    }

    /// Distance of a pose from the corner and the segments that it joins (mm), near the share `t`.
    pub fn distance(&self, pose: &Pose, t: f64) -> f64 {
        let [a, b, c] = self.control.map(|pose| pose.translation.vector);
        let point = pose.translation.vector;
        let curve = a - 2.0 * b + c;
        let along = |t: f64| 2.0 * ((b - a) + curve * t);
        let at = |t: f64| a + 2.0 * (b - a) * t + curve * (t * t);
        // The nearest share by Gauss-Newton steps: the point is close, so they hardly ever go the wrong way. Where the path turns back a point a
        // little beyond its tip has no share at which they end: no point of the corner is farther than the nearest.
        let mut t = t;
        let mut least = f64::INFINITY;
        for _ in 0..12 {
            let (off, first) = (at(t) - point, along(t));
            least = least.min(off.norm());
            let square = first.norm_squared();
            if square < 1e-12 {
                break;
            }
            let next = (t - off.dot(&first) / square).clamp(0.0, 1.0);
            let step = (next - t).abs();
            t = next;
            if step < 1e-12 {
                break;
            }
        }
        let off: Vector3<f64> = point - at(t);
        // Before and after the corner the path continues along its tangents.
        let last = if t <= 0.0 || t >= 1.0 { lateral_offset(&off, &along(t)) } else { off.norm() };
        last.min(least)
    }
}

/// [`Corner::cut_mm`] of two lines through three points.
pub(crate) fn cut_of_lines(points: &[Vector3<f64>; 3], zone_mm: f64) -> f64 {
    let (segment_in, segment_out) = (points[1] - points[0], points[2] - points[1]);
    let (long_in, long_out) = (segment_in.norm(), segment_out.norm());
    let radius = zone_mm.min(0.5 * long_in).min(0.5 * long_out);
    if radius > 1e-9 { 0.25 * radius * (segment_out / long_out - segment_in / long_in).norm() } else { 0.0 }
}

/// The segments into and out of a corner, as intended and as commanded.
pub(crate) struct CornerSegments<'a> {
    pub(crate) intended: [&'a Curve; 2],
    pub(crate) commanded: [&'a Curve; 2],
}

/// Largest deviation of the tool from the intended corner at `point` (mm), under one condition before and another after it;
/// `None` where the corner cuts off almost nothing, infinite where the arm cannot follow.
pub(crate) fn corner_deviation(
    point: &SegmentEnd<'_>,
    segments: &CornerSegments<'_>,
    zone_mm: f64,
    condition_indices: [usize; 2],
    arms: &Arms<'_>,
) -> Option<f64> {
    let intended = Corner::of(segments.intended[0], segments.intended[1], zone_mm);
    if !(intended.cut_mm() > CUT_MM) {
        return None;
    }
    let commanded = Corner::of(segments.commanded[0], segments.commanded[1], zone_mm);
    let flange = |t: f64| point.frames.commanded.flange_for(&commanded.at(t));
    let motor = |t: f64| {
        let solution = arms.nominal.solve_near(&flange(t), &point.joints);
        solution.ok().map(|solution| solution.joints)
    };
    let off = |t: f64, flange: &Pose| intended.distance(&point.frames.real.target_of(flange), t);
    if condition_indices[0] != condition_indices[1] {
        let Some(start) = motor(0.0) else { return Some(f64::INFINITY) };
        let links = PlayOperator::at(&start, condition_indices[0], condition_indices[1], &arms.conditions);
        return Some(links.largest_deviation(2 * STEPS, &motor, &off));
    }
    let arm = arms.conditions.arm(condition_indices[0]);
    // The samples that every corner needs, computed in lanes.
    let solved = arms.nominal.solve_seeded_joints(&FIRST.map(flange), &[point.joints; FIRST.len()]);
    let joints: Vec<Joints> =
        solved.iter().map(|found| found.as_ref().map_or(point.joints, |found| found.joints)).collect();
    let flanges = arm.forward_many(&joints);
    let first: [f64; FIRST.len()] =
        std::array::from_fn(|k| if solved[k].is_ok() { off(FIRST[k], &flanges[k]) } else { f64::INFINITY });
    let even = |t: f64| match FIRST.iter().position(|first| (*first - t).abs() < 1e-9) {
        Some(k) => first[k],
        None => motor(t).map_or(f64::INFINITY, |joints| off(t, &arm.forward(&joints))),
    };
    Some(largest_from([even(0.0), even(1.0)], PIECES, &even))
}

/// Number of equal pieces of a corner that are bisected adaptively, chosen so that the first samples fill the lanes exactly
/// once.
const PIECES: usize = 3;

/// Ends of the pieces and their midpoints: the first samples that [`largest_from`] takes.
const FIRST: [f64; 2 * PIECES + 1] = [0.0, 1.0 / 6.0, 2.0 / 6.0, 0.5, 4.0 / 6.0, 5.0 / 6.0, 1.0];
