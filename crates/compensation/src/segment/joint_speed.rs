//! Whether the joints can follow at the programmed speed.
//!
//! Method: the controller takes for the motion the longer of the times for position and reorientation at their programmed
//! speeds, or the stated duration; mean joint speeds over equal parts of the commanded path are compared with their limits.
//! Acceleration ramps are ignored: the controller slows down or stops a motion that is flagged here.
//! Checked against: the analytic joint speed of a circle about axis 1.

use crate::arms::Arms;
use crate::segment::curve::Curve;
use crate::segment::line::SegmentEnd;
use truegrind_math::se3::angle_bound_rad;
use truegrind_programs::motion::SpeedValue;

/// Programmed speed of a motion.
pub(crate) enum Pace<'a> {
    /// Speeds of position and reorientation.
    Speed(&'a SpeedValue),
    /// Duration (s).
    Duration(f64),
}

/// The joint with the highest ratio of speed to limit on a commanded path, and that ratio; `None` where path or limits do not
/// determine it.
pub(crate) fn fastest(
    from: &SegmentEnd<'_>,
    to: &SegmentEnd<'_>,
    course: &Curve,
    pace: &Pace<'_>,
    arms: &Arms<'_>,
) -> Option<(usize, f64)> {
    let limits = arms.nominal.arm().model.limits.speed_rad_s?;
    let length_mm = course.length_mm();
    let needed_s = |turn_deg: f64| match pace {
        Pace::Speed(speed) => (length_mm / speed.tcp_mm_s).max(turn_deg / speed.orientation_deg_s),
        Pace::Duration(duration_s) => *duration_s,
    };
    // Most lines turn so little that it changes neither the duration nor the number of parts.
    let bound_deg = angle_bound_rad(&course.from.rotation, &course.to.rotation).to_degrees();
    let negligible = course.arc().is_none() && bound_deg < PART_DEG && needed_s(bound_deg) == needed_s(0.0);
    let turn_deg = if negligible { 0.0 } else { course.turn_rad().to_degrees() };
    let duration_s = needed_s(turn_deg);
    if !(duration_s > 1e-6 && duration_s.is_finite()) {
        return None;
    }
    // The end joints suffice for a short line; a long or turning path is solved in parts.
    let least = if course.arc().is_some() { 4 } else { 1 };
    let parts = ((length_mm / PART_MM).ceil() as usize).max((turn_deg / PART_DEG).ceil() as usize);
    let parts = parts.clamp(least, 40);
    let mut worst: Option<(usize, f64)> = None;
    let mut before = from.joints;
    for part in 1..=parts {
        let s = part as f64 / parts as f64;
        let joints = if part == parts {
            to.joints
        } else {
            arms.nominal.solve_near(&to.frames.commanded.flange_for(&course.at(s)), &before).ok()?.joints
        };
        for joint in 0..6 {
            let ratio = (joints[joint] - before[joint]).abs() * parts as f64 / duration_s / limits[joint];
            if worst.is_none_or(|(_, most)| ratio > most) {
                worst = Some((joint, ratio));
            }
        }
        before = joints;
    }
    worst
}

/// Longest part of a path (mm).
const PART_MM: f64 = 50.0;

/// Largest rotation of a part (°).
const PART_DEG: f64 = 10.0;
