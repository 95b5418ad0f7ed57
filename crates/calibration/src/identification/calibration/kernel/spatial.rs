//! Rows of a position, or of a pose.

use nalgebra::Vector3;

use super::axes::Axes;
use super::row_geometry::{
    RowFrames, V, frames, in_base, load, motion, plus, profile, rotates_joints, splat, target_point, three,
};
use super::state::State;
use crate::identification::calibration::columns::EffectColumns;
use crate::identification::calibration::problem::CalibrationProblem;
use crate::measurement::sensor::disturbance::Kind;
use truegrind_arm::chain::{Chain, cross, dot, minus, scaled};
use truegrind_arm::link_motion::LinkMotion;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_math::lanes::{Real, SinCos};

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

/// Twist of the target per unit of an effect: the joint rotations, the growth and the motion of the links.
#[inline(always)]
fn effect_twist<R: Real, const MOVES: bool>(
    (frames, moved): (&Chain<R>, &LinkMotion<R>),
    p: &V<R>,
    effect: &EffectColumns,
    links_mm: &[(f64, f64); 6],
    at: usize,
) -> Twist<R> {
    let like = p[0];
    let none = [like.splat(0.0); 3];
    let mut sum = (none, none);
    for (joint, rotation) in effect.rotation.iter().enumerate() {
        if let Some(rotation) = rotation {
            let twist = link_twist(frames, p, joint, LinkCoordinate::Theta);
            add(&mut sum, like.load(rotation, at), &twist);
        }
    }
    if let Some(growth) = &effect.growth {
        let grown = like.load(growth, at);
        for (joint, (a, d)) in links_mm.iter().enumerate() {
            let along = link_twist(frames, p, joint, LinkCoordinate::A);
            add(&mut sum, grown * like.splat(*a), &along);
            let up = link_twist(frames, p, joint, LinkCoordinate::D);
            add(&mut sum, grown * like.splat(*d), &up);
        }
    }
    if MOVES && let Some(columns) = &effect.moved {
        let [v, w] = moved.twist(&motion(like, columns, at), p);
        add(&mut sum, like.splat(1.0), &(v, w));
    }
    sum
}

/// E = R_C R_m (R R_t)ᵀ as columns, and its trace.
struct OrientationError<R> {
    columns: [V<R>; 3],
    trace: R,
}

impl<R: Real> OrientationError<R> {
    /// `sensor`: the axes of the sensor in the base, and how it is turned where that is disturbed.
    #[inline(always)]
    fn of(
        problem: &CalibrationProblem,
        state: &State,
        frames: &Chain<R>,
        (sensor, turn): (&[V<R>; 3], Option<&V<R>>),
        at: usize,
    ) -> Self {
        let like = sensor[0][0];
        let mut columns = [[like.splat(0.0); 3]; 3];
        let (mut measured, mut modelled) = (columns, columns);
        let target = state.target.rotation.to_rotation_matrix();
        for column in 0..3 {
            let axis = times(sensor, &three(like, &problem.columns.reading, 3 + 3 * column, at));
            measured[column] = turn.map_or(axis, |turn| rotate_by(turn, &axis));
            modelled[column] = in_base(frames, &target.matrix().column(column).into());
        }
        for j in 0..3 {
            for i in 0..3 {
                columns[j][i] = measured[0][i] * modelled[0][j]
                    + measured[1][i] * modelled[1][j]
                    + measured[2][i] * modelled[2][j];
            }
        }
        Self { columns, trace: columns[0][0] + columns[1][1] + columns[2][2] }
    }

    /// ½ vee(E − Eᵀ), where `half` is ½ and the weight.
    #[inline(always)]
    fn half_vee(&self, half: R) -> V<R> {
        let e = &self.columns;
        [half * (e[1][2] - e[2][1]), half * (e[2][0] - e[0][2]), half * (e[0][1] - e[1][0])]
    }

    /// δ ½vee = ½ (tr E − E) w for the sensor side (`along_axes`), −½ (tr E − Eᵀ) w for the arm side, here without its sign.
    /// Along axes that turn with the sensor w × ½vee = −½ (E − Eᵀ) w is subtracted, which leaves the arm's with the other sign.
    #[inline(always)]
    fn half_vee_change(&self, half: R, w: &V<R>, along_axes: bool) -> V<R> {
        let e = &self.columns;
        let product: V<R> =
            if along_axes { times(e, w) } else { [dot(&e[0], w), dot(&e[1], w), dot(&e[2], w)] };
        [0, 1, 2].map(|i| half * (self.trace * w[i] - product[i]))
    }
}

/// Target and reading of the rows, in the base.
struct Compared<R> {
    frames: Chain<R>,
    /// Thermal scale factor of the links.
    scale: R,
    /// How effects move the target's link; the frames have moved so.
    moved: LinkMotion<R>,
    target: V<R>,
    /// Axes of the sensor, undisturbed.
    sensor: [V<R>; 3],
    /// How the sensor is turned, where it is disturbed.
    turn: Option<V<R>>,
    /// The reading, from the sensor.
    measured: V<R>,
    /// The target, from the sensor.
    from_sensor: V<R>,
    /// The sensor's scale. It multiplies the predicted reading, not the measured one: noise must not look like evidence of a
    /// scale error.
    gain: R,
}

/// What a unit of a parameter moves.
struct Change<R> {
    twist: Twist<R>,
    /// Sensor frame parameters move the reading; all others move the arm's prediction.
    sensor_side: bool,
    /// Rotation of the axes, which the residual of an orientation does not follow.
    turns_axes: bool,
    /// Whether the scale factor applies: to the arm's prediction and to shifts of the sensor, not to its rotation.
    is_scaled: bool,
}

impl<R: SinCos> Compared<R> {
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn of<const MOVES: bool>(like: R, problem: &CalibrationProblem, state: &State, at: usize) -> Self {
        let RowFrames { frames, scale, moved } = frames::<R, MOVES>(like, problem, state, at);
        let target = target_point(&frames, state, at);
        let rotation = state.base_from_sensor.rotation.to_rotation_matrix();
        let sensor = [0, 1, 2].map(|k| splat(like, &rotation.matrix().column(k).into()));
        let mut measured = times(&sensor, &three(like, &problem.columns.reading, 0, at));
        let mut origin = splat(like, &state.base_from_sensor.translation.vector);
        let mut gain = like.splat(1.0);
        let turn = state.disturbed.as_ref().map(|disturbed| load(like, &disturbed.turn, at));
        if let (Some(disturbed), Some(turn)) = (&state.disturbed, &turn) {
            gain = like.load(&disturbed.scale, at);
            measured = rotate_by(turn, &measured);
            origin = plus(&origin, &load(like, &disturbed.frame, at));
        }
        let from_sensor = minus(&target, &origin);
        Self { frames, scale, moved, target, sensor, turn, measured, from_sensor, gain }
    }

    /// Motion per unit of parameter `k`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn change<const MOVES: bool>(
        &self,
        problem: &CalibrationProblem,
        state: &State,
        k: usize,
        axes: Axes,
        at: usize,
    ) -> Change<R> {
        let (like, frames) = (self.gain, &self.frames);
        let none = [like.splat(0.0); 3];
        let of_arm = |twist| Change { twist, sensor_side: false, turns_axes: false, is_scaled: true };
        match problem.parameters[k] {
            Parameter::Link { joint, coordinate } if coordinate.is_length() => {
                let (v, w) = link_twist(frames, &self.target, joint, coordinate);
                of_arm((scaled(self.scale, &v), w))
            }
            Parameter::Link { joint, coordinate } => {
                of_arm(link_twist(frames, &self.target, joint, coordinate))
            }
            Parameter::Target(axis) if axis < 3 => {
                of_arm((in_base(frames, &state.flange.column(axis).into()), none))
            }
            Parameter::Target(axis) => {
                of_arm((none, in_base(frames, &state.target_axes.column(axis - 3).into())))
            }
            Parameter::SensorFrame(axis) if axis < 3 => {
                let twist = (splat(like, &Vector3::ith(axis, 1.0)), none);
                Change { twist, sensor_side: true, turns_axes: false, is_scaled: true }
            }
            Parameter::SensorFrame(axis) => {
                let w = splat(like, &state.sensor_axes.column(axis - 3).into());
                let w = self.turn.map_or(w, |turn| rotate_by(&turn, &w));
                let (v, turns_axes) = match axes {
                    Axes::Base => (cross(&w, &self.measured), false),
                    // With r = measured − modelled, ω × measured − ω × r.
                    Axes::Sensor => (cross(&w, &scaled(self.gain, &self.from_sensor)), true),
                };
                Change { twist: (v, w), sensor_side: true, turns_axes, is_scaled: false }
            }
            Parameter::Disturbance { index, parameter } if !rotates_joints(problem, index) => {
                self.disturbed(problem, state, (index, parameter), at)
            }
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => {
                let of = |effect| {
                    effect_twist::<R, MOVES>((frames, &self.moved), &self.target, effect, &state.links_mm, at)
                };
                of_arm(problem.columns.effect_of(k).map_or((none, none), of))
            }
            Parameter::Outlet { .. } | Parameter::Zero { .. } => of_arm((none, none)),
        }
    }

    /// Motion per unit of a parameter of a disturbance.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn disturbed(
        &self,
        problem: &CalibrationProblem,
        state: &State,
        (index, parameter): (usize, usize),
        at: usize,
    ) -> Change<R> {
        let (like, columns) = (self.gain, &problem.columns);
        let none = [like.splat(0.0); 3];
        let amplitude = profile(like, problem, index, at);
        let kind = &problem.frames.disturbances[index].kind;
        let sensor_side = !matches!(kind, Kind::Target);
        let mut is_scaled = parameter < 3 || !sensor_side;
        let (v, w) = match kind {
            Kind::Frame { .. } if parameter < 3 => (splat(like, &Vector3::ith(parameter, 1.0)), none),
            Kind::Frame { .. } => {
                let w = splat(like, &Vector3::ith(parameter - 3, 1.0));
                let w = self.turn.map_or(w, |turn| angular_velocity(&turn, &w));
                (cross(&w, &self.measured), w)
            }
            Kind::Target => (in_base(&self.frames, &state.flange.column(parameter).into()), none),
            Kind::Scale => (self.from_sensor.map(|along| -along / self.gain), none),
            Kind::Empirical(_) => {
                let v = load(like, &columns.shifts[index][parameter], at);
                match columns.turns[index].get(parameter) {
                    Some(along) => {
                        let w = load(like, along, at);
                        let w = self.turn.map_or(w, |turn| angular_velocity(&turn, &w));
                        // The shift is scaled here.
                        is_scaled = false;
                        (plus(&scaled(self.gain, &v), &cross(&w, &self.measured)), w)
                    }
                    None => (v, none),
                }
            }
            Kind::Zero | Kind::Sag | Kind::Load { .. } | Kind::JointZero { .. } => (none, none),
        };
        let twist = (scaled(amplitude, &v), scaled(amplitude, &w));
        Change { twist, sensor_side, turns_axes: false, is_scaled }
    }
}

#[allow(clippy::too_many_arguments)]
#[cfg_attr(not(debug_assertions), inline(always))]
pub(super) fn spatial_rows<R: SinCos, const MOVES: bool>(
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
    let weight = like.load(&problem.weights.per_mm, at);
    let rotation_weight = if oriented { like.load(&problem.weights.per_rad, at) } else { weight };
    let components = if oriented { 6 } else { 3 };
    let compared = Compared::of::<MOVES>(like, problem, state, at);
    let last = if jacobian.is_some() { problem.parameters.len() } else { 0 };
    for k in 0..3 {
        let residual = weight * (compared.measured[k] - compared.gain * compared.from_sensor[k]);
        residual.store(out, (last * components + k) * rows + row_index);
    }
    let error = if oriented {
        OrientationError::of(problem, state, &compared.frames, (&compared.sensor, compared.turn.as_ref()), at)
    } else {
        OrientationError { columns: [[like.splat(0.0); 3]; 3], trace: like.splat(0.0) }
    };
    let half = like.splat(0.5) * rotation_weight;
    if oriented {
        for (k, value) in error.half_vee(half).into_iter().enumerate() {
            value.store(out, (last * components + 3 + k) * rows + row_index);
        }
    }
    let Some(axes) = jacobian else { return };
    for k in 0..problem.parameters.len() {
        let Change { twist, sensor_side, turns_axes, is_scaled } =
            compared.change::<MOVES>(problem, state, k, axes, at);
        let size = if is_scaled { weight * compared.gain } else { weight };
        let sign = if sensor_side { size } else { -size };
        for (i, v) in twist.0.into_iter().enumerate() {
            (sign * v).store(out, (k * components + i) * rows + row_index);
        }
        if oriented {
            let along_axes = sensor_side && !turns_axes;
            for (i, value) in error.half_vee_change(half, &twist.1, along_axes).into_iter().enumerate() {
                let value = if sensor_side { value } else { -value };
                value.store(out, (k * components + 3 + i) * rows + row_index);
            }
        }
    }
}
