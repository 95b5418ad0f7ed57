//! Rigid motions of space: poses, rotation vectors, and the difference of two poses.
//!
//! A pose is `nalgebra::Isometry3<f64>` with the translation in mm. `base_from_flange * flange_from_tool` is
//! `base_from_tool`: neighbouring names cancel.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6};

/// A rigid motion: rotation, then translation in mm.
pub type Pose = Isometry3<f64>;

/// The skew-symmetric matrix with `skew(v) * w == v.cross(&w)`.
pub fn skew(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The twist from `from` to `to`, in the common reference frame of both: translation of the origin
/// (mm) first, then the rotation vector (rad) of `to.rotation * from.rotation⁻¹`.
///
/// ```
/// use truegrind_math::se3::{apply_twist, difference, pose_from_vector};
///
/// let from = pose_from_vector(&[300.0, 0.0, 500.0, 0.0, 0.4, 0.0]);
/// let to = pose_from_vector(&[300.5, -0.2, 500.0, 0.0, 0.4, 0.01]);
/// let twist = difference(&from, &to);
/// assert!((twist.fixed_rows::<3>(0) - nalgebra::Vector3::new(0.5, -0.2, 0.0)).norm() < 1e-9);
/// // Applying the difference to one pose gives the other.
/// assert!(difference(&apply_twist(&from, &twist), &to).norm() < 1e-12);
/// ```
pub fn difference(from: &Pose, to: &Pose) -> Vector6<f64> {
    let translation = to.translation.vector - from.translation.vector;
    let rotation = (to.rotation * from.rotation.inverse()).scaled_axis();
    Vector6::new(translation.x, translation.y, translation.z, rotation.x, rotation.y, rotation.z)
}

/// The inverse of [`difference`]: moves a pose by a twist given in the frame of its parent.
pub fn apply_twist(pose: &Pose, twist: &Vector6<f64>) -> Pose {
    let rotation = UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(3).into_owned());
    Pose::from_parts((pose.translation.vector + twist.fixed_rows::<3>(0)).into(), rotation * pose.rotation)
}

/// A pose from x, y, z (mm) and a rotation vector (rad).
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
/// use nalgebra::Point3;
/// use truegrind_math::se3::{pose_from_vector, vector_from_pose};
///
/// // A flange at 400 mm, rotated by 90° about z, and a tool with an offset of 100 mm along x.
/// let base_from_flange = pose_from_vector(&[400.0, 0.0, 600.0, 0.0, 0.0, FRAC_PI_2]);
/// let flange_from_tool = pose_from_vector(&[100.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
/// let base_from_tool = base_from_flange * flange_from_tool;
/// assert!((base_from_tool * Point3::origin() - Point3::new(400.0, 100.0, 600.0)).norm() < 1e-12);
/// assert!((vector_from_pose(&base_from_tool)[5] - FRAC_PI_2).abs() < 1e-12);
/// ```
pub fn pose_from_vector(v: &[f64; 6]) -> Pose {
    Pose::new(Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]))
}

/// The six numbers of [`pose_from_vector`].
pub fn vector_from_pose(pose: &Pose) -> [f64; 6] {
    let (t, r) = (pose.translation.vector, pose.rotation.scaled_axis());
    [t.x, t.y, t.z, r.x, r.y, r.z]
}

/// A rotation from its matrix, made exactly orthonormal.
pub fn rotation_from_matrix(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix))
}

/// An upper bound of the angle between two rotations (rad), at most 12 % above it and 1e-6 rad more, without an arc tangent: for
/// comparisons that it decides.
///
/// With the chord c = |a ∓ b| = 2 sin(θ/4) of the unit quaternions, θ = 4 asin(c/2) ≤ π c/√2 up to half a turn.
///
/// ```
/// use nalgebra::{UnitQuaternion, Vector3};
/// use truegrind_math::se3::angle_bound_rad;
///
/// let turned = |angle: f64| UnitQuaternion::from_scaled_axis(Vector3::new(0.6, 0.0, 0.8) * angle);
/// for angle in [0.0, 1e-9, 1e-4, 0.2, 1.0, 3.0, 3.141_592_6] {
///     let bound = angle_bound_rad(&turned(0.3), &turned(0.3 + angle));
///     assert!(angle <= bound && bound <= 1.12 * angle + 1e-6);
/// }
/// ```
pub fn angle_bound_rad(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    // Of the scalar product, and of quaternions whose length is not quite 1.
    const ROUNDING: f64 = 1e-13;
    let square = 2.0 - 2.0 * a.coords.dot(&b.coords).abs();
    PI * FRAC_1_SQRT_2 * (square.max(0.0) + ROUNDING).sqrt()
}

/// Left Jacobian of the rotation group: a change `dφ` of the rotation vector `φ` turns the rotation by
/// `left_jacobian(φ) · dφ`, seen from the outer frame (Solà et al. 2018, eq. 145).
///
/// ```
/// use nalgebra::{UnitQuaternion, Vector3};
/// use truegrind_math::se3::left_jacobian;
///
/// let (phi, step) = (Vector3::new(0.3, -0.5, 0.2), Vector3::new(2e-6, 1e-6, -1e-6));
/// let turned = UnitQuaternion::new(phi + step) * UnitQuaternion::new(phi).inverse();
/// assert!((turned.scaled_axis() - left_jacobian(&phi) * step).norm() < 1e-11);
/// ```
pub fn left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let square = phi.norm_squared();
    let k = skew(phi);
    let (first, second) = if square < 1e-6 {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let angle = square.sqrt();
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    Matrix3::identity() + k * first + k * k * second
}
