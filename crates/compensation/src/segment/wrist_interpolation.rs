//! Joints along a path with separate wrist interpolation (ABB, RAPID, `SingArea \Wrist`): joints 4 to 6 move in proportion
//! from start to end, joints 1 to 3 keep the tool point on the path.
//!
//! Method. Newton's method for joints 1 to 3, seeded by the previous sample, with a finite-difference Jacobian.
//! Shapes: joints (rad) at the shares 1/n … (n − 1)/n of a curve in the work object (mm).
//! Stops: within [`REACHED_MM`] of the path, or after [`STEPS`] steps: the arm then cannot follow.

use nalgebra::{Matrix3, Vector3};

use crate::frames::frame_pair::FramePair;
use crate::segment::curve::Curve;
use truegrind_arm::model::{Joints, PreparedModel};

/// Newton steps for one sample.
const STEPS: usize = 12;

/// Accuracy of the tool point on the path (mm).
const REACHED_MM: f64 = 1e-7;

/// Finite difference of the Jacobian (rad).
const DIFFERENCE_RAD: f64 = 1e-6;

/// Joints between the ends of a motion in so many pieces; `None` where the arm cannot follow, or a joint moves by more than
/// `most_step_rad` between neighbouring samples.
pub(crate) fn joint_samples(
    arm: &PreparedModel<'_>,
    within: &FramePair,
    curve: &Curve,
    [start, end]: [&Joints; 2],
    pieces: usize,
    most_step_rad: f64,
) -> Option<Vec<(f64, Joints)>> {
    let mut out = Vec::with_capacity(pieces);
    let mut last = *start;
    for k in 1..=pieces {
        let share = k as f64 / pieces as f64;
        let mut near = last;
        (3..6).for_each(|j| near[j] = start[j] + (end[j] - start[j]) * share);
        let joints = solve_arm_joints(arm, within, &curve.at(share).translation.vector, near)?;
        if (joints - last).amax() >= most_step_rad {
            return None;
        }
        last = joints;
        out.push((share, joints));
    }
    out.pop();
    // On another branch the arm reaches another end.
    ((end - last).amax() < most_step_rad).then_some(out)
}

/// Solves joints 1 to 3 for given wrist joints such that the tool point is at a place in the work object.
fn solve_arm_joints(
    arm: &PreparedModel<'_>,
    within: &FramePair,
    place: &Vector3<f64>,
    mut joints: Joints,
) -> Option<Joints> {
    let at = |joints: &Joints| within.target_of(&arm.forward(joints)).translation.vector;
    for _ in 0..STEPS {
        let here = at(&joints);
        let off = place - here;
        if off.norm() < REACHED_MM {
            return Some(joints);
        }
        let slope = Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|j| {
            let mut moved = joints;
            moved[j] += DIFFERENCE_RAD;
            (at(&moved) - here) / DIFFERENCE_RAD
        }));
        let step = slope.try_inverse()? * off;
        (0..3).for_each(|j| joints[j] += step[j]);
    }
    None
}
