//! The six joint axes of an arm as lines in space, and the two subproblems to which every closed form comes down.
//!
//! Method: with all joint rotations at zero, joint i turns about the line (point pᵢ, direction hᵢ), and the motion of
//! the last frame is e₁ e₂ … e₆ with eᵢ the turn about line i (product of exponentials). Because the lines are read off
//! the DH table, every sign of alpha and every offset of theta is covered by one solution.
//! Shapes: six lines; angles are DH joint rotations (rad), not the controller's.
//! Source: Elias and Wen 2022, "IK-Geo" (arXiv 2211.05737), subproblems 1 and 4. Departure: where no exact solution
//! exists the nearest one is returned and counted as inexact, for it is only a seed.
//! Checked against: the forward map, in `tests/it/kinematics/inverse.rs`.

use nalgebra::{Matrix3, Vector3};

use crate::chain;
use crate::model::Model;
use truegrind_math::se3::Pose;

/// Axes of an arm with all joint rotations at zero, in the base.
#[derive(Debug, Clone)]
pub(super) struct Axes {
    /// A point on each axis (mm).
    pub(super) point: [Vector3<f64>; 6],
    /// Unit direction of each axis.
    pub(super) direction: [Vector3<f64>; 6],
    /// Inverse of the last frame's pose.
    pub(super) home_inverse: Pose,
    /// Sum of the link lengths (mm).
    pub(super) extent_mm: f64,
    /// +1 or −1 for each joint: whether the controller counts its angle along or against the axis.
    pub(super) sense: [f64; 6],
}

impl Axes {
    pub(super) fn of(model: &Model) -> Self {
        let frames = chain::chain(&chain::tables(&model.links), &[0.0; 6], &[1.0; 6]);
        Self {
            point: std::array::from_fn(|i| frames.origin[i].into()),
            direction: std::array::from_fn(|i| frames.z[i].into()),
            home_inverse: frames.last().inverse(),
            extent_mm: model.links.iter().map(|l| l.a_mm.abs() + l.d_mm.abs()).sum(),
            sense: std::array::from_fn(|i| if model.joint_map[(i, i)] < 0.0 { -1.0 } else { 1.0 }),
        }
    }

    /// Where axis `j` carries `x` when it turns by `angle`.
    pub(super) fn turn(&self, j: usize, angle: f64, x: &Vector3<f64>) -> Vector3<f64> {
        self.point[j] + rotated(&self.direction[j], angle, &(x - self.point[j]))
    }

    /// Rotation matrix of axis `j`.
    pub(super) fn rotation(&self, j: usize, angle: f64) -> Matrix3<f64> {
        let k = self.direction[j];
        let column = |i: usize| rotated(&k, angle, &Vector3::ith(i, 1.0));
        Matrix3::from_columns(&[column(0), column(1), column(2)])
    }

    /// Whether axes `i` and `j` are parallel, up to what Newton's method repairs.
    pub(super) fn parallel(&self, i: usize, j: usize) -> bool {
        self.direction[i].cross(&self.direction[j]).norm() < PARALLEL
    }

    /// The point nearest to both axes, and how far they pass each other (mm); `None` for parallel ones.
    pub(super) fn meeting(&self, i: usize, j: usize) -> Option<(Vector3<f64>, f64)> {
        let (u, v) = (self.direction[i], self.direction[j]);
        let (a, b) = (self.point[i], self.point[j]);
        let normal = u.cross(&v);
        let square = normal.norm_squared();
        if square < 1e-2 {
            return None;
        }
        let between = b - a;
        let on_i = a + u * (between.cross(&v).dot(&normal) / square);
        let on_j = b + v * (between.cross(&u).dot(&normal) / square);
        Some(((on_i + on_j) * 0.5, (on_j - on_i).norm()))
    }

    /// Distance of a point from axis `j` (mm).
    pub(super) fn distance(&self, j: usize, x: &Vector3<f64>) -> f64 {
        (x - self.point[j]).cross(&self.direction[j]).norm()
    }

    /// Length below which two lines count as meeting (mm).
    pub(super) fn meeting_tolerance_mm(&self) -> f64 {
        1e-3 * self.extent_mm
    }
}

/// Sine of the angle below which two axes count as parallel.
const PARALLEL: f64 = 1e-2;

/// `x` turned by `angle` about the unit vector `k` (Rodrigues).
pub(super) fn rotated(k: &Vector3<f64>, angle: f64, x: &Vector3<f64>) -> Vector3<f64> {
    let (s, c) = angle.sin_cos();
    x * c + k.cross(x) * s + k * (k.dot(x) * (1.0 - c))
}

/// Subproblem 1: the angle about `k` that turns `x` to `y`; `None` where either lies on the axis.
pub(super) fn angle_between(k: &Vector3<f64>, x: &Vector3<f64>, y: &Vector3<f64>) -> Option<f64> {
    let sine = k.dot(&x.cross(y));
    let cosine = x.dot(y) - k.dot(x) * k.dot(y);
    (sine.hypot(cosine) > 1e-9 * (x.norm() * y.norm())).then(|| sine.atan2(cosine))
}

/// Both solutions of a subproblem.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) angles: [f64; 2],
    /// How far the right side lies beyond what can be reached, in its unit; 0 for an exact solution.
    pub(super) beyond: f64,
}

/// Subproblem 4: the two angles with h · Rot(k, angle) v = d.
///
/// `free` is returned where the angle does not matter (h or v on the axis).
pub(super) fn projections(h: &Vector3<f64>, k: &Vector3<f64>, v: &Vector3<f64>, d: f64, free: f64) -> Pair {
    let c = h.dot(k) * k.dot(v);
    let along = h.dot(v) - c;
    let across = h.dot(&k.cross(v));
    let size = along.hypot(across);
    let wanted = d - c;
    if size <= 1e-9 * h.norm() * v.norm() {
        return Pair { angles: [free; 2], beyond: wanted.abs() };
    }
    let middle = across.atan2(along);
    let half = (wanted / size).clamp(-1.0, 1.0).acos();
    Pair { angles: [middle + half, middle - half], beyond: (wanted.abs() - size).max(0.0) }
}
