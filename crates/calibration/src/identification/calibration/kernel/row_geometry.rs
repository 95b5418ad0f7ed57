//! Link frames and target of as many rows as a register holds.

use nalgebra::Vector3;

use super::state::State;
use crate::identification::calibration::columns::{Angles, MotionColumns};
use crate::identification::calibration::problem::CalibrationProblem;
use truegrind_arm::chain::{Chain, scaled_chain};
use truegrind_arm::link_motion::LinkMotion;
use truegrind_math::lanes::{Real, SinCos, sin_cos, splats};

/// A vector in each row.
pub(super) type V<R> = [R; 3];

#[inline(always)]
pub(super) fn load<R: Real>(like: R, columns: &[Vec<f64>; 3], at: usize) -> V<R> {
    [like.load(&columns[0], at), like.load(&columns[1], at), like.load(&columns[2], at)]
}

/// Three consecutive columns.
#[inline(always)]
pub(super) fn three<R: Real>(like: R, columns: &[Vec<f64>], first: usize, at: usize) -> V<R> {
    let mut out = [like; 3];
    for (k, lanes) in out.iter_mut().enumerate() {
        *lanes = like.load(&columns[first + k], at);
    }
    out
}

#[inline(always)]
pub(super) fn splat<R: Real>(like: R, v: &Vector3<f64>) -> V<R> {
    splats(like, &[v.x, v.y, v.z])
}

/// Link frames of some rows.
pub(super) struct RowFrames<R> {
    pub(super) frames: Chain<R>,
    /// The thermal scale factor of the links.
    pub(super) scale: R,
    /// How effects move the target's link; the frames have moved so.
    pub(super) moved: LinkMotion<R>,
}

/// Link frames of the rows.
#[cfg_attr(not(debug_assertions), inline(always))]
pub(super) fn frames<R: SinCos, const MOVES: bool>(
    like: R,
    problem: &CalibrationProblem,
    state: &State,
    at: usize,
) -> RowFrames<R> {
    let columns = &problem.columns;
    let (mut sin, mut cos) = match &*columns.angles {
        Angles::SinCos { sin, cos } => (six(like, sin, at), six(like, cos, at)),
        Angles::Raw(angles) => {
            let (mut sin, mut cos) = ([like; 6], [like; 6]);
            for (j, angle) in six(like, angles, at).into_iter().enumerate() {
                (sin[j], cos[j]) = sin_cos(angle);
            }
            (sin, cos)
        }
    };
    let mut scale = like.splat(1.0);
    if let Some(extra) = &columns.extra {
        let mut turn = six(like, extra, at);
        scale += like.load(&columns.growth, at);
        for (effect, value) in columns.effects.iter().zip(&state.effects) {
            for (j, rotation) in effect.rotation.iter().enumerate() {
                if let Some(rotation) = rotation {
                    turn[j] += like.splat(*value) * like.load(rotation, at);
                }
            }
            if let Some(growth) = &effect.growth {
                scale += like.splat(*value) * like.load(growth, at);
            }
        }
        for j in 0..6 {
            let (s, c) = sin_cos(turn[j]);
            (sin[j], cos[j]) = (sin[j] * c + cos[j] * s, cos[j] * c - sin[j] * s);
        }
    }
    let mut frames = scaled_chain(&state.tables, &sin, &cos, scale);
    let mut moved = LinkMotion::none(like);
    if MOVES && let Some(of_start) = &columns.moved {
        moved = motion(like, of_start, at);
        for (effect, value) in columns.effects.iter().zip(&state.effects) {
            if let Some(of_effect) = &effect.moved {
                moved.add(like.splat(*value), &motion(like, of_effect, at));
            }
        }
        frames.carry(0, &moved);
    }
    RowFrames { frames, scale, moved }
}

/// A motion of links.
#[inline(always)]
pub(super) fn motion<R: Real>(like: R, columns: &MotionColumns, at: usize) -> LinkMotion<R> {
    let (shift, turn) = (three(like, columns, 0, at), three(like, columns, 3, at));
    LinkMotion { shift, turn, ..LinkMotion::none(like) }
}

#[inline(always)]
fn six<R: Real>(like: R, columns: &[Vec<f64>; 6], at: usize) -> [R; 6] {
    let mut out = [like; 6];
    for (lanes, column) in out.iter_mut().zip(columns) {
        *lanes = like.load(column, at);
    }
    out
}

/// Rotates a vector from the last DH frame to the base.
#[inline(always)]
pub(super) fn in_base<R: Real>(frames: &Chain<R>, v: &Vector3<f64>) -> V<R> {
    let (x, y, z) = (&frames.x, &frames.y[5], &frames.z[6]);
    let w = splat(x[0], v);
    let mut out = w;
    for k in 0..3 {
        out[k] = w[0] * x[k] + w[1] * y[k] + w[2] * z[k];
    }
    out
}

#[inline(always)]
pub(super) fn plus<R: Real>(a: &V<R>, b: &V<R>) -> V<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg_attr(not(debug_assertions), inline(always))]
pub(super) fn target_point<R: Real>(frames: &Chain<R>, state: &State, at: usize) -> V<R> {
    let mut out = plus(&frames.origin[6], &in_base(frames, &state.target.translation.vector));
    if let Some(disturbed) = &state.disturbed {
        let tool = load(out[0], &disturbed.tool, at);
        for (axis, along) in tool.iter().enumerate() {
            let direction = in_base(frames, &state.flange.column(axis).into());
            for k in 0..3 {
                out[k] += *along * direction[k];
            }
        }
    }
    out
}

/// Profile of disturbance `index` in the rows.
#[inline(always)]
pub(super) fn profile<R: Real>(like: R, problem: &CalibrationProblem, index: usize, at: usize) -> R {
    like.load(&problem.columns.profiles[index], at)
}

/// Whether a disturbance rotates the joints, as effects do.
#[inline(always)]
pub(super) fn rotates_joints(problem: &CalibrationProblem, index: usize) -> bool {
    problem.frames.disturbances[index].kind.rotates_joints()
}
