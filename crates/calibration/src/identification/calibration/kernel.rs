//! SIMD kernel of a calibration: residuals and Jacobian of as many rows at a time as a register holds.

use nalgebra::{Matrix3, Vector3};

use super::columns::{Angles, Columns};
use super::problem::CalibrationProblem;
use crate::measurement::dataset::Sensor;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::chain::{self, Chain, LinkTable, cross, dot, minus, scaled, scaled_chain};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_math::lanes::{AnyWidth, Real, SinCos, WIDTH, sin_cos, splats, vectorised};
use truegrind_math::se3::{Pose, left_jacobian};

type V<R> = [R; 3];

/// Row-independent quantities at x.
pub(super) struct State {
    tables: [LinkTable; 6],
    links_mm: [(f64, f64); 6],
    /// Target in the last DH frame.
    target: Pose,
    base_from_sensor: Pose,
    outlets: Vec<Vector3<f64>>,
    zeros: Vec<f64>,
    /// Rotation axes of the sensor frame's rotation vector, in the base.
    sensor_axes: Matrix3<f64>,
    /// Rotation axes of the target's rotation vector, in the last DH frame.
    target_axes: Matrix3<f64>,
    /// Rotation from the flange to the last DH frame.
    flange: Matrix3<f64>,
    effects: Vec<f64>,
    /// Disturbance of each row; absent for an undisturbed measurement.
    disturbed: Option<DisturbanceColumns>,
}

/// Disturbances row by row, as columns.
#[derive(Default)]
struct DisturbanceColumns {
    zero: Vec<f64>,
    frame: [Vec<f64>; 3],
    turn: [Vec<f64>; 3],
    tool: [Vec<f64>; 3],
    /// 1 + relative error.
    scale: Vec<f64>,
    sag: Vec<f64>,
}

impl DisturbanceColumns {
    fn of(disturbances: &[Disturbance], columns: &Columns) -> Option<Self> {
        let profiles = &columns.profiles;
        let n = profiles.first().map(Vec::len)?;
        let zeros = || vec![0.0; n];
        let mut out = Self {
            zero: zeros(),
            frame: std::array::from_fn(|_| zeros()),
            turn: std::array::from_fn(|_| zeros()),
            tool: std::array::from_fn(|_| zeros()),
            scale: vec![1.0; n],
            sag: zeros(),
        };
        let add = |to: &mut [f64], value: f64, profile: &[f64]| {
            to.iter_mut().zip(profile).for_each(|(t, c)| *t += value * c);
        };
        let add_motions = |to: &mut [Vec<f64>; 3], motions: &[[Vec<f64>; 3]], v: &[f64], profile: &[f64]| {
            for (motion, value) in motions.iter().zip(v) {
                for (to, along) in to.iter_mut().zip(motion) {
                    to.iter_mut().zip(along).zip(profile).for_each(|((t, s), c)| *t += value * s * c);
                }
            }
        };
        for (index, (disturbance, profile)) in disturbances.iter().zip(profiles).enumerate() {
            let v = &disturbance.values;
            add_motions(&mut out.frame, &columns.shifts[index], v, profile);
            add_motions(&mut out.turn, &columns.turns[index], v, profile);
            match &disturbance.kind {
                Kind::Zero => add(&mut out.zero, v[0], profile),
                Kind::Frame { turning } => {
                    for k in 0..3 {
                        add(&mut out.frame[k], v[k], profile);
                        if *turning {
                            add(&mut out.turn[k], v[k + 3], profile);
                        }
                    }
                }
                Kind::Target => (0..3).for_each(|k| add(&mut out.tool[k], v[k], profile)),
                Kind::Scale => add(&mut out.scale, v[0], profile),
                Kind::Sag => add(&mut out.sag, v[0], profile),
                Kind::Load { .. } | Kind::JointZero { .. } | Kind::Empirical(_) => {}
            }
        }
        Some(out)
    }
}

#[inline(always)]
fn load<R: Real>(like: R, columns: &[Vec<f64>; 3], at: usize) -> V<R> {
    [like.load(&columns[0], at), like.load(&columns[1], at), like.load(&columns[2], at)]
}

/// Three consecutive columns.
#[inline(always)]
fn three<R: Real>(like: R, columns: &[Vec<f64>], first: usize, at: usize) -> V<R> {
    let mut out = [like; 3];
    for (k, lanes) in out.iter_mut().enumerate() {
        *lanes = like.load(&columns[first + k], at);
    }
    out
}

impl State {
    pub(super) fn of(problem: &CalibrationProblem, x: &[f64]) -> Self {
        let (model, frames) = problem.apply(x);
        let turned = |is: fn(&Parameter) -> Option<usize>| {
            let mut phi = Vector3::zeros();
            for (parameter, value) in problem.parameters.iter().zip(x) {
                if let Some(k) = is(parameter).filter(|&k| k >= 3) {
                    phi[k - 3] += value;
                }
            }
            phi
        };
        let sensor = turned(|p| if let Parameter::SensorFrame(k) = p { Some(*k) } else { None });
        let target = turned(|p| if let Parameter::Target(k) = p { Some(*k) } else { None });
        let flange = *model.flange.rotation.to_rotation_matrix().matrix();
        Self {
            tables: chain::tables(&model.links),
            links_mm: std::array::from_fn(|i| (model.links[i].a_mm, model.links[i].d_mm)),
            target: model.flange * frames.flange_from_target,
            base_from_sensor: frames.base_from_sensor,
            outlets: frames.outlets_mm,
            zeros: frames.zeros_mm,
            sensor_axes: left_jacobian(&sensor),
            target_axes: flange * left_jacobian(&target),
            flange,
            effects: problem.columns.effects.iter().map(|e| x[e.index]).collect(),
            disturbed: DisturbanceColumns::of(&frames.disturbances, &problem.columns),
        }
    }
}

/// The axes along which a residual is differentiated. Its length, and with it the cost and the gradient, are the same along all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axes {
    /// Of the base, as residuals are written.
    Base,
    /// Of the sensor's frame. Only then do the derivatives vanish where base and sensor turn together about the first joint, which no
    /// row sees: along the base's axes the residual itself turns, and JᵀJ shows curvature where the cost has none.
    Sensor,
}

/// See [`CalibrationProblem::fill`].
pub(super) fn fill(
    problem: &CalibrationProblem,
    state: &State,
    from: usize,
    lanes: usize,
    jacobian: Option<Axes>,
    out: &mut [f64],
) {
    vectorised(Fill { problem, state, from, lanes, jacobian, out });
}

/// See [`CalibrationProblem::fill`].
struct Fill<'a> {
    problem: &'a CalibrationProblem,
    state: &'a State,
    from: usize,
    lanes: usize,
    jacobian: Option<Axes>,
    out: &'a mut [f64],
}

impl AnyWidth for Fill<'_> {
    type Output = ();

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn run<R: SinCos>(self, like: R) {
        let Self { problem, state, from, lanes, jacobian, out } = self;
        let rows = lanes * WIDTH;
        match problem.sensor {
            Sensor::Cable => {
                for row_index in (0..rows).step_by(R::ROWS) {
                    cable_rows(
                        like,
                        problem,
                        state,
                        from * WIDTH + row_index,
                        jacobian.is_some(),
                        rows,
                        row_index,
                        out,
                    );
                }
            }
            Sensor::Position | Sensor::Pose => {
                let oriented = problem.sensor == Sensor::Pose;
                for row_index in (0..rows).step_by(R::ROWS) {
                    spatial_rows(
                        like,
                        problem,
                        state,
                        from * WIDTH + row_index,
                        jacobian,
                        rows,
                        row_index,
                        oriented,
                        out,
                    );
                }
            }
        }
    }
}

#[inline(always)]
fn splat<R: Real>(like: R, v: &Vector3<f64>) -> V<R> {
    splats(like, &[v.x, v.y, v.z])
}

/// Link frames of the rows, and the thermal scale factor of the links.
#[cfg_attr(not(debug_assertions), inline(always))]
fn frames<R: SinCos>(like: R, problem: &CalibrationProblem, state: &State, at: usize) -> (Chain<R>, R) {
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
    (scaled_chain(&state.tables, &sin, &cos, scale), scale)
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
fn in_base<R: Real>(frames: &Chain<R>, v: &Vector3<f64>) -> V<R> {
    let (x, y, z) = (&frames.x, &frames.y[5], &frames.z[6]);
    let w = splat(x[0], v);
    let mut out = w;
    for k in 0..3 {
        out[k] = w[0] * x[k] + w[1] * y[k] + w[2] * z[k];
    }
    out
}

#[inline(always)]
fn plus<R: Real>(a: &V<R>, b: &V<R>) -> V<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[cfg_attr(not(debug_assertions), inline(always))]
fn target_point<R: Real>(frames: &Chain<R>, state: &State, at: usize) -> V<R> {
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
fn profile<R: Real>(like: R, problem: &CalibrationProblem, index: usize, at: usize) -> R {
    like.load(&problem.columns.profiles[index], at)
}

/// Length added by unit sag of a cable (mm m²): see [`Disturbance`].
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

#[allow(clippy::too_many_arguments)]
#[cfg_attr(not(debug_assertions), inline(always))]
fn cable_rows<R: SinCos>(
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
    let (frames, scale) = frames(like, problem, state, at);
    let p = target_point(&frames, state, at);
    let single = state.outlets.len() == 1;
    let (outlet, zero): (V<R>, R) = if single {
        (splat(like, &state.outlets[0]), like.splat(state.zeros[0]))
    } else {
        let mut outlet = [like; 3];
        for (k, coordinate) in outlet.iter_mut().enumerate() {
            *coordinate = per_anchor(like, problem, at, |a| state.outlets[a][k]);
        }
        (outlet, per_anchor(like, problem, at, |a| state.zeros[a]))
    };
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
            Parameter::Outlet { axis, .. } if single => -u[axis],
            Parameter::Zero { .. } if single => weight * gain,
            Parameter::Outlet { anchor, axis } => {
                -u[axis] * per_anchor(like, problem, at, |a| f64::from(u8::from(a == anchor)))
            }
            Parameter::Zero { anchor } => {
                weight * gain * per_anchor(like, problem, at, |a| f64::from(u8::from(a == anchor)))
            }
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
                let mut sum = none;
                if let Some(effect) = problem.columns.effect_of(k) {
                    for (joint, rotation) in effect.rotation.iter().enumerate() {
                        if let Some(rotation) = rotation {
                            sum += like.load(rotation, at)
                                * link_projection(&frames, &u, &moment, joint, LinkCoordinate::Theta);
                        }
                    }
                    if let Some(growth) = &effect.growth {
                        let mut grown = none;
                        for (joint, (a, d)) in state.links_mm.iter().enumerate() {
                            grown += like.splat(*a)
                                * link_projection(&frames, &u, &moment, joint, LinkCoordinate::A);
                            grown += like.splat(*d)
                                * link_projection(&frames, &u, &moment, joint, LinkCoordinate::D);
                        }
                        sum += like.load(growth, at) * grown;
                    }
                }
                sum
            }
            Parameter::SensorFrame(_) | Parameter::Target(_) => none,
        };
        value.store(out, k * rows + row_index);
    }
}

/// Whether a disturbance rotates the joints, as effects do.
#[inline(always)]
fn rotates_joints(problem: &CalibrationProblem, index: usize) -> bool {
    problem.frames.disturbances[index].kind.rotates_joints()
}
/// sin θ / θ, (1 − cos θ) / θ² and (θ − sin θ) / θ³ of a small rotation vector θ, to relative 10⁻¹⁰ at 0.1 rad.
#[inline(always)]
fn rotation_series<R: Real>(turn: &V<R>) -> [R; 3] {
    let square = dot(turn, turn);
    let term = |c: [f64; 3]| {
        let of = |v: f64| square.splat(v);
        of(c[0]) - square * (of(c[1]) - square * of(c[2]))
    };
    [
        term([1.0, 1.0 / 6.0, 1.0 / 120.0]),
        term([0.5, 1.0 / 24.0, 1.0 / 720.0]),
        term([1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0]),
    ]
}

/// `v` turned by a small rotation vector (Rodrigues).
#[cfg_attr(not(debug_assertions), inline(always))]
fn rotate_by<R: Real>(turn: &V<R>, v: &V<R>) -> V<R> {
    let [first, second, _] = rotation_series(turn);
    let once = cross(turn, v);
    let twice = cross(turn, &once);
    plus(&plus(v, &scaled(first, &once)), &scaled(second, &twice))
}

/// The angular velocity of a small rotation vector that changes by `change`: its left Jacobian times that.
#[cfg_attr(not(debug_assertions), inline(always))]
fn angular_velocity<R: Real>(turn: &V<R>, change: &V<R>) -> V<R> {
    let [_, first, second] = rotation_series(turn);
    let once = cross(turn, change);
    let twice = cross(turn, &once);
    plus(&plus(change, &scaled(first, &once)), &scaled(second, &twice))
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

/// Velocity of the point and angular velocity, in the base.
type Twist<R> = (V<R>, V<R>);

#[cfg_attr(not(debug_assertions), inline(always))]
fn link_twist<R: Real>(frames: &Chain<R>, p: &V<R>, joint: usize, coordinate: LinkCoordinate) -> Twist<R> {
    let none = [p[0].splat(0.0); 3];
    match coordinate {
        LinkCoordinate::Theta => rotation_about(&frames.z[joint], p, &frames.origin[joint]),
        LinkCoordinate::D => (frames.z[joint], none),
        LinkCoordinate::A => (frames.lateral[joint], none),
        LinkCoordinate::Alpha => rotation_about(&frames.lateral[joint], p, &frames.origin[joint + 1]),
        LinkCoordinate::Beta => rotation_about(&frames.y[joint], p, &frames.origin[joint + 1]),
    }
}

#[inline(always)]
fn rotation_about<R: Real>(axis: &V<R>, p: &V<R>, through: &V<R>) -> Twist<R> {
    (cross(axis, &minus(p, through)), *axis)
}

#[inline(always)]
fn add<R: Real>(to: &mut Twist<R>, scale: R, twist: &Twist<R>) {
    for k in 0..3 {
        to.0[k] += scale * twist.0[k];
        to.1[k] += scale * twist.1[k];
    }
}

/// Matrix of columns times vector.
#[inline(always)]
fn times<R: Real>(columns: &[V<R>; 3], v: &V<R>) -> V<R> {
    let mut out = *v;
    for i in 0..3 {
        out[i] = columns[0][i] * v[0] + columns[1][i] * v[1] + columns[2][i] * v[2];
    }
    out
}

#[allow(clippy::too_many_arguments)]
#[cfg_attr(not(debug_assertions), inline(always))]
fn spatial_rows<R: SinCos>(
    like: R,
    problem: &CalibrationProblem,
    state: &State,
    at: usize,
    jacobian: Option<Axes>,
    rows: usize,
    row_index: usize,
    oriented: bool,
    out: &mut [f64],
) {
    let columns = &problem.columns;
    let weight = like.load(&problem.weights.per_mm, at);
    let rotation_weight = if oriented { like.load(&problem.weights.per_rad, at) } else { weight };
    let none = [like.splat(0.0); 3];
    let (frames, scale) = frames(like, problem, state, at);
    let p = target_point(&frames, state, at);
    let components = if oriented { 6 } else { 3 };
    let rotation = state.base_from_sensor.rotation.to_rotation_matrix();
    let mut sensor = [none; 3];
    for (k, axis) in sensor.iter_mut().enumerate() {
        *axis = splat(like, &rotation.matrix().column(k).into());
    }
    let reading = three(like, &columns.reading, 0, at);
    let mut turned = times(&sensor, &reading);
    let mut origin = splat(like, &state.base_from_sensor.translation.vector);
    // The scale multiplies the predicted reading, not the measured one: noise must not look like evidence of a scale error.
    let mut gain = like.splat(1.0);
    let turn = state.disturbed.as_ref().map(|disturbed| load(like, &disturbed.turn, at));
    if let (Some(disturbed), Some(turn)) = (&state.disturbed, &turn) {
        gain = like.load(&disturbed.scale, at);
        turned = rotate_by(turn, &turned);
        origin = plus(&origin, &load(like, &disturbed.frame, at));
    }
    let from_sensor = minus(&p, &origin);
    let last = if jacobian.is_some() { problem.parameters.len() } else { 0 };
    for k in 0..3 {
        let residual = weight * (turned[k] - gain * from_sensor[k]);
        residual.store(out, (last * components + k) * rows + row_index);
    }
    // E = R_C R_m (R R_t)ᵀ as columns, its trace, and ½ vee(E − Eᵀ).
    let mut error = [none; 3];
    let mut trace = like.splat(0.0);
    if oriented {
        let (mut measured, mut modelled) = (error, error);
        let target = state.target.rotation.to_rotation_matrix();
        for column in 0..3 {
            let axis = times(&sensor, &three(like, &columns.reading, 3 + 3 * column, at));
            measured[column] = turn.map_or(axis, |turn| rotate_by(&turn, &axis));
            modelled[column] = in_base(&frames, &target.matrix().column(column).into());
        }
        for j in 0..3 {
            for i in 0..3 {
                error[j][i] = measured[0][i] * modelled[0][j]
                    + measured[1][i] * modelled[1][j]
                    + measured[2][i] * modelled[2][j];
            }
        }
        trace = error[0][0] + error[1][1] + error[2][2];
        let half = like.splat(0.5) * rotation_weight;
        let vee = [
            half * (error[1][2] - error[2][1]),
            half * (error[2][0] - error[0][2]),
            half * (error[0][1] - error[1][0]),
        ];
        for (k, value) in vee.into_iter().enumerate() {
            value.store(out, (last * components + 3 + k) * rows + row_index);
        }
    }
    let Some(axes) = jacobian else { return };
    for (k, parameter) in problem.parameters.iter().enumerate() {
        // Sensor frame parameters move the reading; all others move the arm's prediction.
        let mut sensor_side = false;
        // Rotation of the axes, which the residual of an orientation does not follow.
        let mut turns_axes = false;
        // Motion of the sensor to which the scale factor is applied here.
        let mut turns_sensor = false;
        let twist: Twist<R> = match *parameter {
            Parameter::Link { joint, coordinate } if coordinate.is_length() => {
                let (v, w) = link_twist(&frames, &p, joint, coordinate);
                (scaled(scale, &v), w)
            }
            Parameter::Link { joint, coordinate } => link_twist(&frames, &p, joint, coordinate),
            Parameter::Target(axis) if axis < 3 => {
                (in_base(&frames, &state.flange.column(axis).into()), none)
            }
            Parameter::Target(axis) => (none, in_base(&frames, &state.target_axes.column(axis - 3).into())),
            Parameter::SensorFrame(axis) if axis < 3 => {
                sensor_side = true;
                (splat(like, &Vector3::ith(axis, 1.0)), none)
            }
            Parameter::SensorFrame(axis) => {
                sensor_side = true;
                let w = splat(like, &state.sensor_axes.column(axis - 3).into());
                let w = turn.map_or(w, |turn| rotate_by(&turn, &w));
                match axes {
                    Axes::Base => (cross(&w, &turned), w),
                    // With r = measured − modelled, ω × measured − ω × r.
                    Axes::Sensor => {
                        turns_axes = true;
                        (cross(&w, &scaled(gain, &from_sensor)), w)
                    }
                }
            }
            Parameter::Disturbance { index, parameter } if !rotates_joints(problem, index) => {
                let amplitude = profile(like, problem, index, at);
                let kind = &problem.frames.disturbances[index].kind;
                sensor_side = !matches!(kind, Kind::Target);
                let (v, w) = match kind {
                    Kind::Frame { .. } if parameter < 3 => (splat(like, &Vector3::ith(parameter, 1.0)), none),
                    Kind::Frame { .. } => {
                        let w = splat(like, &Vector3::ith(parameter - 3, 1.0));
                        let w = turn.map_or(w, |turn| angular_velocity(&turn, &w));
                        (cross(&w, &turned), w)
                    }
                    Kind::Target => (in_base(&frames, &state.flange.column(parameter).into()), none),
                    Kind::Scale => {
                        ([-from_sensor[0] / gain, -from_sensor[1] / gain, -from_sensor[2] / gain], none)
                    }
                    Kind::Empirical(_) => {
                        let v = load(like, &columns.shifts[index][parameter], at);
                        match columns.turns[index].get(parameter) {
                            Some(along) => {
                                let w = load(like, along, at);
                                let w = turn.map_or(w, |turn| angular_velocity(&turn, &w));
                                turns_sensor = true;
                                (plus(&scaled(gain, &v), &cross(&w, &turned)), w)
                            }
                            None => (v, none),
                        }
                    }
                    Kind::Zero | Kind::Sag | Kind::Load { .. } | Kind::JointZero { .. } => (none, none),
                };
                (scaled(amplitude, &v), scaled(amplitude, &w))
            }
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => {
                let mut sum = (none, none);
                if let Some(effect) = columns.effect_of(k) {
                    for (joint, rotation) in effect.rotation.iter().enumerate() {
                        if let Some(rotation) = rotation {
                            let twist = link_twist(&frames, &p, joint, LinkCoordinate::Theta);
                            add(&mut sum, like.load(rotation, at), &twist);
                        }
                    }
                    if let Some(growth) = &effect.growth {
                        let grown = like.load(growth, at);
                        for (joint, (a, d)) in state.links_mm.iter().enumerate() {
                            let along = link_twist(&frames, &p, joint, LinkCoordinate::A);
                            add(&mut sum, grown * like.splat(*a), &along);
                            let up = link_twist(&frames, &p, joint, LinkCoordinate::D);
                            add(&mut sum, grown * like.splat(*d), &up);
                        }
                    }
                }
                sum
            }
            Parameter::Outlet { .. } | Parameter::Zero { .. } => (none, none),
        };
        // The scale factor applies to the arm's prediction and to shifts of the sensor, not to its rotation.
        let scaled_by_gain = !turns_sensor
            && !matches!(
                *parameter,
                Parameter::SensorFrame(3..) | Parameter::Disturbance { parameter: 3.., .. }
            )
            || !sensor_side;
        let size = if scaled_by_gain { weight * gain } else { weight };
        let sign = if sensor_side { size } else { -size };
        for (i, v) in twist.0.into_iter().enumerate() {
            (sign * v).store(out, (k * components + i) * rows + row_index);
        }
        if oriented {
            // δ ½vee = ½ (tr E − E) w for the sensor side, −½ (tr E − Eᵀ) w for the arm side. Along axes that turn with the sensor
            // w × ½vee = −½ (E − Eᵀ) w is subtracted, which leaves the arm's with the other sign.
            let w = twist.1;
            let half = like.splat(0.5) * rotation_weight;
            let product: V<R> = if sensor_side && !turns_axes {
                times(&error, &w)
            } else {
                [dot(&error[0], &w), dot(&error[1], &w), dot(&error[2], &w)]
            };
            for i in 0..3 {
                let value = half * (trace * w[i] - product[i]);
                let value = if sensor_side { value } else { -value };
                value.store(out, (k * components + 3 + i) * rows + row_index);
            }
        }
    }
}
