//! The rigid motion that best explains displacements of the points of a path; the residual is its shape error.
//!
//! Linearised about the centroid c: a point p displaced by d moves by v + ω × (p − c). Least squares gives v, the mean of d,
//! and ω = (Σ (|r|² I − r rᵀ) + n ℓ² I)⁻¹ Σ r × d with r = p − c (Horn 1987 for small motions). ℓ keeps rotations that the
//! points do not determine, about a line or a single point, at zero.

use nalgebra::{DMatrix, Matrix3, Matrix6, Matrix6xX, Point3, Vector3, Vector6};

use truegrind_math::se3::Pose;

/// Paths narrower than this determine no rotation about themselves (mm).
const MIN_LEVER_MM: f64 = 1.0;

/// Points relative to their centroid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Registration {
    /// Centroid (mm).
    pub(crate) centre: Point3<f64>,
    levers: Vec<Vector3<f64>>,
    /// Σ (|r|² I − r rᵀ) (mm²).
    inertia: Matrix3<f64>,
    /// Maps Σ r × d to the rotation.
    turning: Matrix3<f64>,
}

impl Registration {
    /// From points in any frame (mm). `None` without points, or where one is not finite.
    pub(crate) fn of(points: &[Point3<f64>]) -> Option<Self> {
        let count = points.len() as f64;
        if points.is_empty() {
            return None;
        }
        let centre = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / count);
        let levers: Vec<Vector3<f64>> = points.iter().map(|p| p - centre).collect();
        let inertia: Matrix3<f64> =
            levers.iter().map(|r| Matrix3::identity() * r.norm_squared() - r * r.transpose()).sum();
        let held = inertia + Matrix3::identity() * (count * MIN_LEVER_MM * MIN_LEVER_MM);
        let turning = held.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
        Some(Self { centre, levers, inertia, turning })
    }

    /// Twist (mm, rad) about the centroid that best explains the displacements `shifts` of the points.
    pub(crate) fn twist(&self, shifts: impl Iterator<Item = Vector3<f64>>) -> Vector6<f64> {
        let (mut sum, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for (shift, lever) in shifts.zip(&self.levers) {
            sum += shift;
            moment += lever.cross(&shift);
        }
        let (v, w) = (sum / self.levers.len() as f64, self.turning * moment);
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }

    /// The same where point `k` alone is displaced.
    pub(crate) fn twist_of(&self, k: usize, shift: &Vector3<f64>) -> Vector6<f64> {
        let (v, w) = (shift / self.levers.len() as f64, self.turning * self.levers[k].cross(shift));
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }

    /// Σ Wᵀ d over any points that are displaced by d, where W maps a twist to a point's displacement (mm², mm³).
    pub(crate) fn turned(&self, points: &[Point3<f64>], shifts: &[Vector3<f64>]) -> Vector6<f64> {
        let (mut v, mut w) = (Vector3::zeros(), Vector3::zeros());
        for (point, shift) in points.iter().zip(shifts) {
            v += shift;
            w += (point - self.centre).cross(shift);
        }
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }

    /// Displacement of point `k` by a twist about the centroid (mm).
    pub(crate) fn shift(&self, twist: &Vector6<f64>, k: usize) -> Vector3<f64> {
        twist.fixed_rows::<3>(0) + twist.fixed_rows::<3>(3).cross(&self.levers[k])
    }

    /// Displacement of any point by a twist about the centroid (mm).
    pub(crate) fn shift_at(&self, twist: &Vector6<f64>, point: &Point3<f64>) -> Vector3<f64> {
        twist.fixed_rows::<3>(0) + twist.fixed_rows::<3>(3).cross(&(point - self.centre))
    }

    /// The twists that best explain the points' velocities, one column per column of `jacobian` (3 n × p).
    pub(crate) fn twists(&self, jacobian: &DMatrix<f64>) -> Matrix6xX<f64> {
        let mut out = Matrix6xX::zeros(jacobian.ncols());
        for (mut twist, column) in out.column_iter_mut().zip(jacobian.column_iter()) {
            let velocities = column.as_slice().as_chunks().0;
            twist.copy_from(&self.twist(velocities.iter().map(|velocity| Vector3::from(*velocity))));
        }
        out
    }

    /// Mean square displacement of the points by twists of the given covariance (mm²).
    pub(crate) fn mean_square(&self, covariance: &Matrix6<f64>) -> f64 {
        let turns = covariance.fixed_view::<3, 3>(3, 3);
        let shifts = covariance.fixed_view::<3, 3>(0, 0).trace();
        shifts + (self.inertia * turns).trace() / self.levers.len() as f64
    }

    /// Σ Wᵀ W g over the points, where W maps a twist to a point's displacement (mm², mm³).
    pub(crate) fn weighed(&self, twist: &Vector6<f64>) -> Vector6<f64> {
        let (v, w) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
        let (v, w) = (v * self.levers.len() as f64, self.inertia * w);
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }

    /// The rigid motion of a twist about the centroid.
    pub(crate) fn motion(&self, twist: &Vector6<f64>) -> Pose {
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(3).into_owned());
        let centre = self.centre.coords;
        Pose::from_parts((centre + twist.fixed_rows::<3>(0) - turn * centre).into(), turn)
    }
}
