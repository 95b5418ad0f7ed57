//! Newton's method on the full estimated model: effects, couplings and perturbed links included.
//!
//! Method: with e the twist that is missing (translation of the flange over a characteristic length, rotation
//! vector), J the 6 × 6 Jacobian with respect to the controller's angles including the slopes of the effects,
//! q ← q + J⁻¹ e. Where a full step does not make |e| smaller, as happens near singularities, the step is
//! (JᵀJ + λI)⁻¹ Jᵀ e with λ tenfold until it does (Levenberg), and λ falls back to 0 afterwards.
//! Shapes: six joints, six equations.
//! Termination: below [`TOLERANCE_MM`] and [`TOLERANCE_RAD`]; after 80 evaluations; where λ no longer helps.
//! Checked against: the forward map on thousands of poses of perturbed arms.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::budget;

use crate::chain::Chain;
use crate::jacobian::{joint_jacobian, link_twist};
use crate::joints::Joints;
use crate::model::PreparedModel;
use crate::parameter::LinkCoordinate;
use truegrind_math::se3::{Pose, rotation_from_matrix};

/// A solution misses its target by less (mm).
pub const TOLERANCE_MM: f64 = 5e-10;
/// A solution misses its target by less (rad).
pub const TOLERANCE_RAD: f64 = 5e-13;

/// Longest step of a joint (rad).
const MAX_STEP_RAD: f64 = 0.6;
const MAX_EVALUATIONS: usize = 80;

/// A target: pose of the last DH frame, and the flange.
#[derive(Debug, Clone)]
pub(super) struct Goal {
    pub(super) last: Pose,
    pub(super) rotation: Matrix3<f64>,
    pub(super) flange_mm: Vector3<f64>,
    pub(super) flange_in_last_mm: Vector3<f64>,
}

impl Goal {
    pub(super) fn of(target: &Pose, flange: &Pose) -> Self {
        let mut last = target * flange.inverse();
        last.rotation.renormalize();
        Self {
            last,
            rotation: last.rotation.to_rotation_matrix().into_inner(),
            flange_mm: target.translation.vector,
            flange_in_last_mm: flange.translation.vector,
        }
    }
}

/// Result of the iteration.
#[derive(Debug, Clone, Copy)]
pub(super) struct NewtonResult {
    pub(super) joints: Joints,
    pub(super) residual_mm: f64,
    pub(super) residual_rad: f64,
    pub(super) iterations: usize,
}

impl NewtonResult {
    pub(super) fn converged(&self) -> bool {
        self.residual_mm <= TOLERANCE_MM && self.residual_rad <= TOLERANCE_RAD
    }
}

struct State {
    joints: Joints,
    missing: Vector6<f64>,
    residual_mm: f64,
    residual_rad: f64,
    jacobian: Matrix6<f64>,
}

/// Jacobian of the flange with respect to the rotations of the joints, translation rows divided by `length_mm`.
pub(super) fn scaled_jacobian(arm: &PreparedModel<'_>, joints: &Joints, length_mm: f64) -> Matrix6<f64> {
    let frames = arm.frames(joints);
    let point = Vector3::from(frames.origin[6]) + frame_matrix(&frames) * arm.model.flange.translation.vector;
    let mut jacobian = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|joint| {
        link_twist(&frames, joint, LinkCoordinate::Theta, &point.into())
    }));
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / length_mm);
    jacobian
}

fn frame_matrix(frames: &Chain<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[frames.x.into(), frames.y[5].into(), frames.z[6].into()])
}

fn state(arm: &PreparedModel<'_>, goal: &Goal, joints: Joints, length_mm: f64) -> State {
    let frames = arm.frames(&joints);
    let axes = frame_matrix(&frames);
    let point = Vector3::from(frames.origin[6]) + axes * goal.flange_in_last_mm;
    let shift = goal.flange_mm - point;
    let turn = rotation_vector(&(goal.rotation * axes.transpose()));
    let mut jacobian = joint_jacobian(arm, &joints, &frames, &point.into());
    jacobian.fixed_rows_mut::<3>(0).scale_mut(1.0 / length_mm);
    let s = shift / length_mm;
    State {
        joints,
        missing: Vector6::new(s.x, s.y, s.z, turn.x, turn.y, turn.z),
        residual_mm: shift.norm(),
        residual_rad: turn.norm(),
        jacobian,
    }
}

/// Rotation vector of a matrix; from the antisymmetric part while that is accurate.
fn rotation_vector(m: &Matrix3<f64>) -> Vector3<f64> {
    let half = Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)]) * 0.5;
    let sine = half.norm();
    let cosine = 0.5 * (m.trace() - 1.0);
    if cosine > 0.0 {
        return if sine > 1e-8 { half * (sine.atan2(cosine) / sine) } else { half };
    }
    // By a quaternion: of half a turn the antisymmetric part vanishes, and with it the axis.
    rotation_from_matrix(m).scaled_axis()
}

/// Iterates from `start`. NaN ends it at once without convergence, and so does an exhausted budget.
pub(super) fn solve(arm: &PreparedModel<'_>, goal: &Goal, start: &Joints, length_mm: f64) -> NewtonResult {
    if budget::refuses() {
        let far = f64::INFINITY;
        return NewtonResult { joints: *start, residual_mm: far, residual_rad: far, iterations: 0 };
    }
    let mut here = state(arm, goal, *start, length_mm);
    let mut damping = 0.0_f64;
    let mut iterations = 0;
    while iterations < MAX_EVALUATIONS
        && !(here.residual_mm <= TOLERANCE_MM && here.residual_rad <= TOLERANCE_RAD)
        && here.missing.iter().all(|e| e.is_finite())
    {
        iterations += 1;
        let next = step(&here, damping)
            .map(|step| state(arm, goal, here.joints + step, length_mm))
            .filter(|next| next.missing.norm_squared() < here.missing.norm_squared());
        match next {
            Some(next) => {
                here = next;
                damping = if damping > 1e-7 { damping * 0.1 } else { 0.0 };
            }
            None if damping > 1e6 => break,
            None => damping = (damping * 10.0).max(1e-6),
        }
    }
    budget::spend(iterations as u64 + 1);
    NewtonResult {
        joints: here.joints,
        residual_mm: here.residual_mm,
        residual_rad: here.residual_rad,
        iterations,
    }
}

fn step(here: &State, damping: f64) -> Option<Vector6<f64>> {
    let step = if damping == 0.0 {
        here.jacobian.lu().solve(&here.missing)?
    } else {
        let transposed = here.jacobian.transpose();
        let normal = transposed * here.jacobian + Matrix6::identity() * damping;
        normal.cholesky()?.solve(&(transposed * here.missing))
    };
    let longest = step.amax();
    longest.is_finite().then(|| if longest > MAX_STEP_RAD { step * (MAX_STEP_RAD / longest) } else { step })
}
