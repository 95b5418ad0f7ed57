//! Closed form for arms whose last three axes meet in a point and whose axes 2 and 3 are parallel: ABB IRB, FANUC,
//! KUKA, Stäubli, Yaskawa. Offsets of shoulder (a1), elbow (a3) and to the side (d2, d3) are allowed.
//!
//! Method: let w be the wrist centre and w′ where the target puts it. Turns about the parallel axes 2 and 3 keep the
//! part of w along them, which gives q1 (two solutions); the distance of w′ from axis 2 gives q3 (two), then q2
//! follows; the angle between axes 4 and 6 gives q5 (two), then q4 and q6 follow.
//! Shapes: eight seeds, in DH joint rotations (rad).
//! Source: Pieper 1968 for the decoupling; the subproblems of [`super::axes`].
//! Checked against: the forward map for every arm of the catalogue.

use nalgebra::Vector3;

use super::axes::{Axes, angle_between, projections};
use super::seed::Seed;
use truegrind_math::se3::Pose;

/// The wrist centre with all rotations at zero, if the arm is of this family.
pub(super) fn wrist_centre(axes: &Axes) -> Option<Vector3<f64>> {
    let (centre, gap) = axes.meeting(3, 4)?;
    let near = axes.meeting_tolerance_mm();
    (axes.parallel(1, 2) && !axes.parallel(0, 1) && gap < near && axes.distance(5, &centre) < near)
        .then_some(centre)
}

/// All branches for a pose of the last frame.
pub(super) fn solve(axes: &Axes, centre: &Vector3<f64>, target: &Pose, free: &[f64; 6]) -> Vec<Seed> {
    let motion = target * axes.home_inverse;
    let turn = motion.rotation.to_rotation_matrix().into_inner();
    let there = motion * nalgebra::Point3::from(*centre);
    let h = &axes.direction;
    let mut out = Vec::with_capacity(8);
    let first = projections(
        &(h[1]),
        &(-h[0]),
        &(there.coords - axes.point[0]),
        h[1].dot(&(centre - axes.point[0])),
        free[0],
    );
    for q1 in first.angles {
        let after_1 = axes.turn(0, -q1, &there.coords);
        for (q2, q3, beyond) in two_links(axes, centre, &after_1, free) {
            let arm = axes.rotation(0, q1) * axes.rotation(1, q2) * axes.rotation(2, q3);
            let wrist = arm.transpose() * turn;
            let fifth = projections(&h[3], &h[4], &h[5], h[3].dot(&(wrist * h[5])), 0.0);
            for q5 in fifth.angles {
                let turned = axes.rotation(4, q5);
                let q4 = angle_between(&h[3], &(turned * h[5]), &(wrist * h[5]))
                    .filter(|_| (turned * h[5]).cross(&h[3]).norm() > 1e-6)
                    .unwrap_or(free[3]);
                let last = turned.transpose() * axes.rotation(3, q4).transpose() * wrist;
                let q6 = about(&h[5], &last);
                out.push(Seed { rotations: [q1, q2, q3, q4, q5, q6], beyond_mm: first.beyond.max(beyond) });
            }
        }
    }
    out
}

/// Angle of a rotation matrix about a known axis.
pub(super) fn about(axis: &Vector3<f64>, matrix: &nalgebra::Matrix3<f64>) -> f64 {
    let sine = 0.5
        * axis.dot(&Vector3::new(
            matrix[(2, 1)] - matrix[(1, 2)],
            matrix[(0, 2)] - matrix[(2, 0)],
            matrix[(1, 0)] - matrix[(0, 1)],
        ));
    sine.atan2(0.5 * (matrix.trace() - 1.0))
}

/// Turns about the parallel axes 2 and 3 that carry `from` to `to`: q2, q3 and how far `to` lies out of reach (mm).
pub(super) fn two_links(
    axes: &Axes,
    from: &Vector3<f64>,
    to: &Vector3<f64>,
    free: &[f64; 6],
) -> [(f64, f64, f64); 2] {
    let upper = axes.point[2] - axes.point[1];
    let fore = from - axes.point[2];
    let flat = |x: Vector3<f64>| x - axes.direction[1] * axes.direction[1].dot(&x);
    let (upper, fore, reach) = (flat(upper), flat(fore), flat(to - axes.point[1]));
    let wanted = 0.5 * (reach.norm_squared() - upper.norm_squared() - fore.norm_squared());
    let third = projections(&upper, &axes.direction[2], &fore, wanted, free[2]);
    third.angles.map(|q3| {
        let bent = flat(axes.turn(2, q3, from) - axes.point[1]);
        let q2 = angle_between(&axes.direction[1], &bent, &reach).unwrap_or(free[1]);
        (q2, q3, (bent.norm() - reach.norm()).abs() * f64::from(u8::from(third.beyond > 0.0)))
    })
}
