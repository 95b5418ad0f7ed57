//! Geometry of teaching joints under one arm: the tip of a tool, the frame through three points, and the effect of rounding.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

use truegrind_arm::model::{Joints, PreparedModel};
use truegrind_math::se3::{Pose, rotation_from_matrix};

/// Rounding of written frames, and differences between constructions of the same frame (mm, rad).
pub(crate) const WRITTEN_TOLERANCE: FrameDistance =
    FrameDistance { mm: 0.1, rad: 0.02 * std::f64::consts::PI / 180.0 };
/// A programmed frame farther away than this does not belong to the teaching joints, however coarsely they are rounded (mm,
/// rad).
const MAX_FRAME_DISTANCE: FrameDistance = FrameDistance { mm: 5.0, rad: std::f64::consts::PI / 180.0 };
/// Controllers show joint angles with at least two decimals (°): coarser ones are not taken as rounded.
const MAX_JOINT_STEP_DEG: f64 = 0.01;
/// Poses are too much alike if their orientations determine the TCP less well than this (smallest singular value).
const ALIKE: f64 = 1e-3;

/// Distance of two frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameDistance {
    pub(crate) mm: f64,
    pub(crate) rad: f64,
}

impl FrameDistance {
    pub(crate) fn of(one: &Pose, other: &Pose) -> Self {
        Self {
            mm: (one.translation.vector - other.translation.vector).norm(),
            rad: one.rotation.angle_to(&other.rotation),
        }
    }

    pub(crate) fn within(self, bound: FrameDistance) -> bool {
        self.mm <= bound.mm && self.rad <= bound.rad
    }
}

/// The fixed point of several poses, on the flange and in the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FixedPoint {
    pub(crate) on_flange: Vector3<f64>,
    pub(crate) in_base: Vector3<f64>,
    /// Standard deviations of the two from the scatter of the poses (mm).
    pub(crate) sigma_mm: [f64; 2],
}

/// The fixed point by linear least squares (the n-point method). `None` where the poses do not determine it: too few,
/// orientations too much alike, or non-finite numbers.
pub(crate) fn fixed_point(arm: &PreparedModel<'_>, teaching: &[Joints]) -> Option<FixedPoint> {
    // R_i t + p_i = c for all i: unknown t and c.
    let n = teaching.len();
    if n < 3 {
        return None;
    }
    let mut a = DMatrix::zeros(3 * n, 6);
    let mut b = DVector::zeros(3 * n);
    for (i, q) in teaching.iter().enumerate() {
        let flange = arm.forward(q);
        a.view_mut((3 * i, 0), (3, 3)).copy_from(flange.rotation.to_rotation_matrix().matrix());
        a.view_mut((3 * i, 3), (3, 3)).copy_from(&-Matrix3::<f64>::identity());
        b.rows_mut(3 * i, 3).copy_from(&-flange.translation.vector);
    }
    if !a.iter().chain(b.iter()).all(|v| v.is_finite()) {
        return None;
    }
    // A = Q R: x = R⁻¹ Qᵀ b, and (Aᵀ A)⁻¹ = R⁻¹ R⁻ᵀ. Not by the singular value decomposition, whose
    // singular vectors are wrong by 1e-5 where singular values coincide, as they do here.
    let qr = a.clone().qr();
    let r = qr.r();
    if !(r.singular_values().min() >= ALIKE) {
        return None;
    }
    let x = r.solve_upper_triangular(&qr.q().tr_mul(&b))?;
    let freedom = (3 * n).saturating_sub(6).max(1) as f64;
    let variance = (&a * &x - &b).norm_squared() / freedom;
    let inverse = r.solve_upper_triangular(&DMatrix::identity(6, 6))?;
    let spread = |first: usize| (variance * inverse.rows(first, 3).norm_squared()).sqrt();
    Some(FixedPoint {
        on_flange: x.fixed_rows::<3>(0).into_owned(),
        in_base: x.fixed_rows::<3>(3).into_owned(),
        sigma_mm: [spread(0), spread(3)],
    })
}

/// The TCP from poses that all touch one point (mm, on the flange), by linear least squares (the n-point method). `None`
/// where the poses do not determine it: fewer than three, or orientations too much alike.
///
/// ```
/// use nalgebra::Vector3;
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::inverse::Inverse;
/// use truegrind_arm::model::Joints;
/// use truegrind_arm::robots;
/// use truegrind_compensation::frames::taught::taught_tcp;
/// use truegrind_math::se3::Pose;
///
/// // A tip of 95 mm that touches one point with the flange turned four ways.
/// let arm = robots::load("abb-irb-120")?.model;
/// let still = Condition::default();
/// let inverse = Inverse::new(&arm, &still, &arm);
/// let (tip, fixed) = (Vector3::new(3.0, -4.0, 95.0), Vector3::new(380.0, 40.0, 200.0));
/// let start = Joints::new(0.0, 0.3, 0.0, 0.1, 0.9, 0.0);
/// let teaching = [[0.0, 3.1, 0.1], [0.3, 2.8, 0.0], [-0.3, 2.9, 0.3], [0.1, 2.6, -0.4]]
///     .iter()
///     .map(|turn| {
///         let rotation = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::from(*turn));
///         let flange = Pose::from_parts((fixed - rotation * tip).into(), rotation);
///         inverse.solve_near(&flange, &start).map(|solution| solution.joints)
///     })
///     .collect::<Result<Vec<_>, _>>()?;
/// let found = taught_tcp(&arm.at_condition(&still), &teaching).ok_or("not fixed")?;
/// assert!((found - tip).norm() < 1e-6, "{found}");
/// // Always turned alike, the poses fix nothing.
/// assert_eq!(taught_tcp(&arm.at_condition(&still), &[teaching[0]; 4]), None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn taught_tcp(arm: &PreparedModel<'_>, teaching: &[Joints]) -> Option<Vector3<f64>> {
    fixed_point(arm, teaching).map(|found| found.on_flange)
}

/// The frame through three taught points: the first two on x, the third on y (the origin is its foot on x). `None` where the
/// points are collinear.
///
/// ```
/// use nalgebra::Point3;
/// use truegrind_compensation::frames::taught::taught_frame;
///
/// // Two points on x, one on y: the origin is where the third one's foot lies.
/// let points = [Point3::new(400.0, 0.0, 100.0), Point3::new(500.0, 0.0, 100.0), Point3::new(420.0, 70.0, 100.0)];
/// let frame = taught_frame(&points).ok_or("in line")?;
/// assert!((frame * Point3::new(80.0, 0.0, 0.0) - points[1]).norm() < 1e-9);
/// assert!((frame * Point3::new(0.0, 70.0, 0.0) - points[2]).norm() < 1e-9);
/// assert!(taught_frame(&[points[0], points[1], Point3::new(450.0, 0.0, 100.0)]).is_none());
/// # Ok::<(), &str>(())
/// ```
pub fn taught_frame(points: &[Point3<f64>; 3]) -> Option<Pose> {
    let x = (points[1] - points[0]).try_normalize(1e-9)?;
    let along = x.dot(&(points[2] - points[0]));
    let origin = points[0] + x * along;
    let y = (points[2] - origin).try_normalize(1e-9)?;
    let rotation = rotation_from_matrix(&Matrix3::from_columns(&[x, y, x.cross(&y)]));
    Some(Pose::from_parts(origin.coords.into(), rotation))
}

/// Joints in rad.
pub(crate) fn radians(deg: &[[f64; 6]]) -> Vec<Joints> {
    deg.iter().map(|q| Joints::from_fn(|i, _| q[i].to_radians())).collect()
}

/// Half of the last decimal of these angles (rad).
pub(crate) fn half_step_rad(deg: &[[f64; 6]]) -> f64 {
    let decimals = |angle: &f64| {
        let text = angle.to_string();
        text.split_once('.').map_or(0, |(_, decimals)| decimals.len())
    };
    let most = deg.iter().flatten().map(decimals).max().unwrap_or(0);
    0.5 * 10f64.powi(-(most as i32)).min(MAX_JOINT_STEP_DEG).to_radians()
}

/// Largest displacement of a frame computed from rounded joints: each of them off by half its last decimal, all in the worst
/// direction.
pub(crate) fn rounded(
    joints: &[Joints],
    half_rad: f64,
    frame: impl Fn(&[Joints]) -> Option<Pose>,
) -> FrameDistance {
    let mut all = FrameDistance { mm: 0.0, rad: 0.0 };
    let Some(base) = frame(joints) else { return all };
    let mut off = joints.to_vec();
    for point in 0..joints.len() {
        for joint in 0..6 {
            off[point][joint] += half_rad;
            if let Some(moved) = frame(&off) {
                let apart = FrameDistance::of(&base, &moved);
                all = FrameDistance { mm: all.mm + apart.mm, rad: all.rad + apart.rad };
            }
            off[point][joint] = joints[point][joint];
        }
    }
    all
}

/// Difference that is explained by written decimals, rounded joints and `scatter_mm`.
pub(crate) fn explained(rounded: FrameDistance, scatter_mm: f64) -> FrameDistance {
    FrameDistance {
        mm: (WRITTEN_TOLERANCE.mm + rounded.mm + scatter_mm).min(MAX_FRAME_DISTANCE.mm),
        rad: (WRITTEN_TOLERANCE.rad + rounded.rad).min(MAX_FRAME_DISTANCE.rad),
    }
}

pub(crate) fn list(position: &Vector3<f64>) -> String {
    format!("[{:.3}, {:.3}, {:.3}]", position.x, position.y, position.z)
}

/// Taught points: touched with a tool that the robot holds, or on a held part with a stationary tool.
pub(crate) fn touched(
    arm: &PreparedModel<'_>,
    joints: &[Joints; 3],
    tip: &Vector3<f64>,
    part: bool,
) -> [Point3<f64>; 3] {
    std::array::from_fn(|i| {
        let flange = arm.forward(&joints[i]);
        if part { flange.inverse() * Point3::from(*tip) } else { flange * Point3::from(*tip) }
    })
}

pub(crate) fn frame_of(
    arm: &PreparedModel<'_>,
    joints: &[Joints],
    tip: &Vector3<f64>,
    part: bool,
) -> Option<Pose> {
    taught_frame(&touched(arm, joints.try_into().ok()?, tip, part))
}
