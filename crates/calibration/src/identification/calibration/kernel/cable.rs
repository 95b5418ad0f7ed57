//! Rows of a cable's length.

use super::row_geometry::{
    RowFrames, V, frames, in_base, load, motion, profile, rotates_joints, splat, target_point,
};
use super::state::State;
use crate::identification::calibration::columns::EffectColumns;
use crate::identification::calibration::problem::CalibrationProblem;
use crate::measurement::sensor::disturbance::Kind;
use truegrind_arm::chain::{Chain, cross, dot, minus, scaled};
use truegrind_arm::link_motion::LinkMotion;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_math::lanes::{Real, SinCos, WIDTH};

/// Length added by unit sag of a cable (mm m²): see [`Disturbance`](crate::measurement::sensor::disturbance::Disturbance).
#[inline(always)]
fn sag_length<R: Real>(away: &V<R>, length: R) -> R {
    length.splat(1e-6 / 24.0) * (away[0] * away[0] + away[1] * away[1]) * length
}

/// Per-cable value of each lane's row.
#[inline(always)]
fn per_anchor<R: Real>(like: R, problem: &CalibrationProblem, at: usize, value: impl Fn(usize) -> f64) -> R {
    if problem.columns.anchor.is_empty() {
        return like.splat(value(0));
    }
    let mut lanes = [0.0; WIDTH];
    for (lane, anchor) in lanes.iter_mut().zip(&problem.columns.anchor[at..at + R::ROWS]) {
        *lane = value(*anchor as usize);
    }
    like.load(&lanes, 0)
}

/// Outlet and zero of each row's cable.
#[inline(always)]
fn outlet_and_zero<R: Real>(like: R, problem: &CalibrationProblem, state: &State, at: usize) -> (V<R>, R) {
    if state.outlets.len() == 1 {
        return (splat(like, &state.outlets[0]), like.splat(state.zeros[0]));
    }
    let outlet = [0, 1, 2].map(|k| per_anchor(like, problem, at, |a| state.outlets[a][k]));
    (outlet, per_anchor(like, problem, at, |a| state.zeros[a]))
}

/// 1 in the rows of a cable, 0 in the others.
#[inline(always)]
fn is_anchor<R: Real>(like: R, problem: &CalibrationProblem, at: usize, anchor: usize) -> R {
    per_anchor(like, problem, at, |a| if a == anchor { 1.0 } else { 0.0 })
}

/// Column of an effect: the joint rotations, the growth and the motion of the links per unit, along the cable; `p` is the target.
#[inline(always)]
fn effect_projection<R: Real, const MOVES: bool>(
    (frames, moved, p): (&Chain<R>, &LinkMotion<R>, &V<R>),
    u: &V<R>,
    moment: &[V<R>; 7],
    effect: &EffectColumns,
    links_mm: &[(f64, f64); 6],
    at: usize,
) -> R {
    let like = u[0];
    let mut sum = like.splat(0.0);
    for (joint, rotation) in effect.rotation.iter().enumerate() {
        if let Some(rotation) = rotation {
            let turned = link_projection(frames, u, moment, joint, LinkCoordinate::Theta);
            sum += like.load(rotation, at) * turned;
        }
    }
    if let Some(growth) = &effect.growth {
        let mut grown = like.splat(0.0);
        for (joint, (a, d)) in links_mm.iter().enumerate() {
            grown += like.splat(*a) * link_projection(frames, u, moment, joint, LinkCoordinate::A);
            grown += like.splat(*d) * link_projection(frames, u, moment, joint, LinkCoordinate::D);
        }
        sum += like.load(growth, at) * grown;
    }
    if MOVES && let Some(columns) = &effect.moved {
        let [v, _] = moved.twist(&motion(like, columns, at), p);
        sum += dot(&v, u);
    }
    sum
}

#[allow(clippy::too_many_arguments)]
#[cfg_attr(not(debug_assertions), inline(always))]
pub(super) fn cable_rows<R: SinCos, const MOVES: bool>(
    like: R,
    problem: &CalibrationProblem,
    state: &State,
    at: usize,
    jacobian: bool,
    rows: usize,
    row_index: usize,
    out: &mut [f64],
) {
    let weight = like.load(&problem.weights.per_mm, at);
    let RowFrames { frames, scale, moved } = frames::<R, MOVES>(like, problem, state, at);
    let p = target_point(&frames, state, at);
    let (outlet, zero) = outlet_and_zero(like, problem, state, at);
    let mut v = minus(&p, &outlet);
    if let Some(disturbed) = &state.disturbed {
        v = minus(&v, &load(like, &disturbed.frame, at));
    }
    let length = dot(&v, &v).sqrt();
    let mut free = length + zero;
    let mut predicted = free;
    if let Some(disturbed) = &state.disturbed {
        free += like.load(&disturbed.zero, at);
        predicted =
            free * like.load(&disturbed.scale, at) + like.load(&disturbed.sag, at) * sag_length(&v, length);
    }
    let residual = weight * (predicted - like.load(&problem.columns.reading[0], at));
    let columns = problem.parameters.len();
    if !jacobian {
        residual.store(out, row_index);
        return;
    }
    residual.store(out, columns * rows + row_index);
    // u includes the weight, so that every column is whitened.
    let gain = state.disturbed.as_ref().map_or(like.splat(1.0), |disturbed| like.load(&disturbed.scale, at));
    let gradient_scale = weight * gain / length;
    let u = scaled(gradient_scale, &v);
    let mut moment = [u; 7];
    for (moment, origin) in moment.iter_mut().zip(&frames.origin) {
        *moment = cross(&minus(&p, origin), &u);
    }
    let none = like.splat(0.0);
    for (k, parameter) in problem.parameters.iter().enumerate() {
        let value = match *parameter {
            Parameter::Link { joint, coordinate } if coordinate.is_length() => {
                scale * link_projection(&frames, &u, &moment, joint, coordinate)
            }
            Parameter::Link { joint, coordinate } => link_projection(&frames, &u, &moment, joint, coordinate),
            Parameter::Target(axis) if axis < 3 => {
                dot(&in_base(&frames, &state.flange.column(axis).into()), &u)
            }
            Parameter::Outlet { anchor, axis } => -u[axis] * is_anchor(like, problem, at, anchor),
            Parameter::Zero { anchor } => weight * gain * is_anchor(like, problem, at, anchor),
            Parameter::Disturbance { index, parameter } if !rotates_joints(problem, index) => {
                let amplitude = profile(like, problem, index, at);
                amplitude
                    * match problem.frames.disturbances[index].kind {
                        Kind::Zero => weight * gain,
                        Kind::Frame { .. } => -u[parameter.min(2)],
                        Kind::Target => dot(&in_base(&frames, &state.flange.column(parameter).into()), &u),
                        Kind::Scale => weight * free,
                        Kind::Sag => weight * sag_length(&v, length),
                        Kind::Empirical(_) => {
                            -dot(&load(like, &problem.columns.shifts[index][parameter], at), &u)
                        }
                        Kind::Load { .. } | Kind::JointZero { .. } => none,
                    }
            }
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => {
                problem.columns.effect_of(k).map_or(none, |effect| {
                    let arm = (&frames, &moved, &p);
                    effect_projection::<R, MOVES>(arm, &u, &moment, effect, &state.links_mm, at)
                })
            }
            Parameter::SensorFrame(_) | Parameter::Target(_) => none,
        };
        value.store(out, k * rows + row_index);
    }
}

/// u · ∂p for a coordinate of a link; `moment[i]` is (p − oᵢ) × u, since u·(z × r) = z·(r × u).
#[cfg_attr(not(debug_assertions), inline(always))]
fn link_projection<R: Real>(
    frames: &Chain<R>,
    u: &V<R>,
    moment: &[V<R>; 7],
    joint: usize,
    coordinate: LinkCoordinate,
) -> R {
    match coordinate {
        LinkCoordinate::Theta => dot(&frames.z[joint], &moment[joint]),
        LinkCoordinate::D => dot(&frames.z[joint], u),
        LinkCoordinate::A => dot(&frames.lateral[joint], u),
        LinkCoordinate::Alpha => dot(&frames.lateral[joint], &moment[joint + 1]),
        LinkCoordinate::Beta => dot(&frames.y[joint], &moment[joint + 1]),
    }
}
