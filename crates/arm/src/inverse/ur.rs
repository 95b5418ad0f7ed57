//! Closed form for arms whose axes 2, 3 and 4 are parallel and whose axes 5 and 6 meet: Universal Robots.
//!
//! Method: let w be the point where axes 5 and 6 meet. Its part along the parallel axes is kept by their turns, which
//! gives q1 (two solutions); the angle between axis 6 and the parallel axes gives q5 (two), then q6 follows; what
//! is left is a turn in the plane, q2 + q3 + q4, and the two-link problem of axis 4 (two).
//! Shapes: eight seeds, in DH joint rotations (rad).
//! Source: the derivation of Hawkins 2013 ("Analytic inverse kinematics for the UR-5/UR-10 arms"), written with the
//! subproblems of [`super::axes`].
//! Checked against: the forward map for the UR arms of the catalogue.

use nalgebra::{Point3, Vector3};

use super::axes::{Axes, angle_between, projections};
use super::seed::Seed;
use super::spherical::{about, two_links};
use truegrind_math::se3::Pose;

/// The meeting point of axes 5 and 6 with all rotations at zero, if the arm is of this family.
pub(super) fn wrist_point(axes: &Axes) -> Option<Vector3<f64>> {
    let (point, gap) = axes.meeting(4, 5)?;
    (axes.parallel(1, 2)
        && axes.parallel(2, 3)
        && !axes.parallel(0, 1)
        && !axes.parallel(3, 4)
        && gap < axes.meeting_tolerance_mm())
    .then_some(point)
}

/// All branches for a pose of the last frame.
pub(super) fn solve(axes: &Axes, point: &Vector3<f64>, target: &Pose, free: &[f64; 6]) -> Vec<Seed> {
    let motion = target * axes.home_inverse;
    let turn = motion.rotation.to_rotation_matrix().into_inner();
    let there = motion * Point3::from(*point);
    let h = &axes.direction;
    let sense = |j: usize| h[1].dot(&h[j]).signum();
    let mut out = Vec::with_capacity(8);
    let first = projections(
        &h[1],
        &(-h[0]),
        &(there.coords - axes.point[0]),
        h[1].dot(&(point - axes.point[0])),
        free[0],
    );
    for q1 in first.angles {
        let shoulder = axes.rotation(0, q1).transpose();
        let after_1 = axes.turn(0, -q1, &there.coords);
        let rest = shoulder * turn;
        let fifth = projections(&h[1], &h[4], &h[5], h[1].dot(&(rest * h[5])), 0.0);
        for q5 in fifth.angles {
            let turned = axes.rotation(4, q5);
            let parallel = turned.transpose() * h[1];
            let q6 = angle_between(&h[5], &parallel, &(rest.transpose() * h[1]))
                .filter(|_| parallel.cross(&h[5]).norm() > 1e-6)
                .map_or(free[5], |angle| -angle);
            let plane = rest * axes.rotation(5, q6).transpose() * turned.transpose();
            let sum = about(&h[1], &plane);
            let to = after_1 - plane * (point - axes.point[3]);
            for (q2, q3, beyond) in two_links(axes, &axes.point[3], &to, free) {
                let q4 = sense(3) * (sum - q2 - sense(2) * q3);
                out.push(Seed { rotations: [q1, q2, q3, q4, q5, q6], beyond_mm: first.beyond.max(beyond) });
            }
        }
    }
    out
}
