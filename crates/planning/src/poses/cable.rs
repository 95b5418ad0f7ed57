//! Clearance of a cable from the arm's links.
//!
//! Links are capsules with one radius: the segments between the origins of neighbouring joint frames, and the arm's own bodies as
//! `own_bodies` assumes them. The wrist and the tool are excluded, since the cable is attached there.

use nalgebra::{Point3, Vector3};

use super::own_bodies::OwnBodies;
use truegrind_arm::chain::Chain;

/// Joint frames between which segments are checked: from the base to the wrist.
const FRAMES: usize = 5;

/// Length of the cable before the hook that can pass the wrist (mm).
const FREE_MM: f64 = 120.0;

/// Smallest distance from the segment between `from` and `to` (mm, base) to the links of an arm (mm).
///
/// The last `free_mm` before `to` are excluded, since the hook is next to the wrist.
pub fn clearance_mm(frames: &Chain<f64>, from: &Vector3<f64>, to: &Vector3<f64>, free_mm: f64) -> f64 {
    let Some(end) = end_before(from, to, free_mm) else { return f64::INFINITY };
    let mut smallest = f64::INFINITY;
    for pair in frames.origin[..FRAMES].windows(2) {
        let (a, b) = (Vector3::from(pair[0]), Vector3::from(pair[1]));
        smallest = smallest.min(segment_distance(from, &end, &a, &b));
    }
    smallest
}

/// The same, to the links and to the arm's own bodies.
pub(super) fn clearance_of_arm_mm(
    frames: &Chain<f64>,
    own: &OwnBodies,
    from: &Vector3<f64>,
    to: &Vector3<f64>,
) -> f64 {
    let Some(end) = end_before(from, to, FREE_MM) else { return f64::INFINITY };
    let own = own.lines(frames).into_iter().flatten();
    own.map(|[a, b]| segment_distance(from, &end, &a, &b))
        .fold(clearance_mm(frames, from, to, FREE_MM), f64::min)
}

/// Where the checked part of a cable ends; `None` if all of it is next to the hook.
fn end_before(from: &Vector3<f64>, to: &Vector3<f64>, free_mm: f64) -> Option<Vector3<f64>> {
    let length = (to - from).norm();
    (length > free_mm).then(|| from + (to - from) * ((length - free_mm) / length))
}

/// Distance between two segments p1–q1 and p2–q2: the closest points of the two lines, clamped to the segments
/// (Ericson 2005, Real-Time Collision Detection, section 5.1.9).
pub fn segment_distance(p1: &Vector3<f64>, q1: &Vector3<f64>, p2: &Vector3<f64>, q2: &Vector3<f64>) -> f64 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f) = (d1.norm_squared(), d2.norm_squared(), d2.dot(&r));
    const POINT: f64 = 1e-12;
    let (s, t) = if a <= POINT && e <= POINT {
        (0.0, 0.0)
    } else if a <= POINT {
        (0.0, (f / e).clamp(0.0, 1.0))
    } else {
        let c = d1.dot(&r);
        if e <= POINT {
            ((-c / a).clamp(0.0, 1.0), 0.0)
        } else {
            let b = d1.dot(&d2);
            let determinant = a * e - b * b;
            // Parallel lines have a constant distance, so any s is valid.
            let s = if determinant > POINT * a * e {
                ((b * f - c * e) / determinant).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let t = (b * s + f) / e;
            if t < 0.0 {
                ((-c / a).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((b - c) / a).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    let (x, y) = (Point3::from(p1 + d1 * s), Point3::from(p2 + d2 * t));
    (x - y).norm()
}
