//! The inner loop of a calibration: residual and Jacobian of eight rows at a time.

use nalgebra::{Matrix3, Vector3};

use super::columns::Columns;
use super::task::Calibration;
use crate::measurement::dataset::Sensor;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::chain::{self, Chain, LinkTable, cross, dot, minus, scaled_chain};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_math::lanes::{Lanes, Real, WIDTH, sin_cos, vectorised};
use truegrind_math::se3::{Pose, left_jacobian};

type V = [Lanes; 3];

/// Everything of x that is the same for all rows.
pub(super) struct State {
    tables: [LinkTable; 6],
    links_mm: [(f64, f64); 6],
    /// Target in the last DH frame.
    target: Pose,
    base_from_sensor: Pose,
    outlets: Vec<Vector3<f64>>,
    zeros: Vec<f64>,
    /// Axes in which the sensor's rotation vector turns it, in the base.
    sensor_axes: Matrix3<f64>,
    /// Axes in which the target's rotation vector turns it, in the last DH frame.
    target_axes: Matrix3<f64>,
    /// From flange to the last DH frame.
    flange: Matrix3<f64>,
    effects: Vec<f64>,
    /// What disturbs each row; absent for an undisturbed measurement.
    pushed: Option<Pushed>,
}

/// Disturbances row by row, as columns.
#[derive(Default)]
struct Pushed {
    zero: Vec<f64>,
    frame: [Vec<f64>; 3],
    turn: [Vec<f64>; 3],
    tool: [Vec<f64>; 3],
    /// 1 + relative error.
    scale: Vec<f64>,
    sag: Vec<f64>,
}

impl Pushed {
    fn of(disturbances: &[Disturbance], columns: &Columns) -> Option<Self> {
        let courses = &columns.courses;
        let n = courses.first().map(Vec::len)?;
        let zeros = || vec![0.0; n];
        let mut out = Self {
            zero: zeros(),
            frame: std::array::from_fn(|_| zeros()),
            turn: std::array::from_fn(|_| zeros()),
            tool: std::array::from_fn(|_| zeros()),
            scale: vec![1.0; n],
            sag: zeros(),
        };
        let add = |to: &mut [f64], value: f64, course: &[f64]| {
            to.iter_mut().zip(course).for_each(|(t, c)| *t += value * c);
        };
        for ((disturbance, course), shifts) in disturbances.iter().zip(courses).zip(&columns.shifts) {
            let v = &disturbance.values;
            for (shift, value) in shifts.iter().zip(v) {
                for (to, along) in out.frame.iter_mut().zip(shift) {
                    to.iter_mut().zip(along).zip(course).for_each(|((t, s), c)| *t += value * s * c);
                }
            }
            match &disturbance.kind {
                Kind::Zero => add(&mut out.zero, v[0], course),
                Kind::Frame { turning } => {
                    for k in 0..3 {
                        add(&mut out.frame[k], v[k], course);
                        if *turning {
                            add(&mut out.turn[k], v[k + 3], course);
                        }
                    }
                }
                Kind::Tool => (0..3).for_each(|k| add(&mut out.tool[k], v[k], course)),
                Kind::Scale => add(&mut out.scale, v[0], course),
                Kind::Sag => add(&mut out.sag, v[0], course),
                Kind::Load { .. } | Kind::Form(_) => {}
            }
        }
        Some(out)
    }
}

#[inline(always)]
fn load(columns: &[Vec<f64>; 3], at: usize) -> V {
    std::array::from_fn(|k| Lanes::load(&columns[k], at))
}

impl State {
    pub(super) fn of(task: &Calibration, x: &[f64]) -> Self {
        let (model, frames) = task.apply(x);
        let turned = |is: fn(&Parameter) -> Option<usize>| {
            let mut phi = Vector3::zeros();
            for (parameter, value) in task.parameters.iter().zip(x) {
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
            effects: task.columns.effects.iter().map(|e| x[e.place]).collect(),
            pushed: Pushed::of(&frames.disturbances, &task.columns),
        }
    }
}

/// See [`Calibration::fill`].
pub(super) fn fill(
    task: &Calibration,
    state: &State,
    from: usize,
    lanes: usize,
    jacobian: bool,
    out: &mut [f64],
) {
    vectorised(
        #[inline(always)]
        || {
            for group in 0..lanes {
                let at = (from + group) * WIDTH;
                let place = group * WIDTH;
                match task.sensor {
                    Sensor::Cable => cable(task, state, at, jacobian, lanes * WIDTH, place, out),
                    Sensor::Position => space(task, state, at, jacobian, lanes * WIDTH, place, false, out),
                    Sensor::Pose => space(task, state, at, jacobian, lanes * WIDTH, place, true, out),
                }
            }
        },
    );
}

#[inline(always)]
fn splat(v: &Vector3<f64>) -> V {
    [Lanes::splat(v.x), Lanes::splat(v.y), Lanes::splat(v.z)]
}

#[inline(always)]
fn store(out: &mut [f64], at: usize, value: Lanes) {
    out[at..at + WIDTH].copy_from_slice(&value.0);
}

/// Frames of eight rows, and the factor by which their lengths have grown.
#[cfg_attr(not(debug_assertions), inline(always))]
fn frames(task: &Calibration, state: &State, at: usize) -> (Chain<Lanes>, Lanes) {
    let columns = &task.columns;
    let mut sin: [Lanes; 6] = std::array::from_fn(|j| Lanes::load(&columns.sin[j], at));
    let mut cos: [Lanes; 6] = std::array::from_fn(|j| Lanes::load(&columns.cos[j], at));
    let mut scale = Lanes::splat(1.0);
    if let Some(extra) = &columns.extra {
        let mut turn: [Lanes; 6] = std::array::from_fn(|j| Lanes::load(&extra[j], at));
        scale += Lanes::load(&columns.growth, at);
        for (effect, value) in columns.effects.iter().zip(&state.effects) {
            for (j, rotation) in effect.rotation.iter().enumerate() {
                if let Some(rotation) = rotation {
                    turn[j] += Lanes::splat(*value) * Lanes::load(rotation, at);
                }
            }
            if let Some(growth) = &effect.growth {
                scale += Lanes::splat(*value) * Lanes::load(growth, at);
            }
        }
        for j in 0..6 {
            let (s, c) = sin_cos(turn[j]);
            (sin[j], cos[j]) = (sin[j] * c + cos[j] * s, cos[j] * c - sin[j] * s);
        }
    }
    (scaled_chain(&state.tables, &sin, &cos, scale), scale)
}

/// A vector of the last DH frame, in the base.
#[inline(always)]
fn in_base(frames: &Chain<Lanes>, v: &Vector3<f64>) -> V {
    let (x, y, z) = (&frames.x, &frames.y[5], &frames.z[6]);
    let w = splat(v);
    std::array::from_fn(|k| w[0] * x[k] + w[1] * y[k] + w[2] * z[k])
}

#[cfg_attr(not(debug_assertions), inline(always))]
fn point(frames: &Chain<Lanes>, state: &State, at: usize) -> V {
    let shift = in_base(frames, &state.target.translation.vector);
    let mut out: V = std::array::from_fn(|k| frames.origin[6][k] + shift[k]);
    if let Some(pushed) = &state.pushed {
        let tool = load(&pushed.tool, at);
        for (axis, along) in tool.iter().enumerate() {
            let direction = in_base(frames, &state.flange.column(axis).into());
            for k in 0..3 {
                out[k] += *along * direction[k];
            }
        }
    }
    out
}

/// How far disturbance `index` goes in the rows.
#[inline(always)]
fn course(task: &Calibration, index: usize, at: usize) -> Lanes {
    Lanes::load(&task.columns.courses[index], at)
}

/// What a unit of a cable's sag adds to its length (mm m²): see the page of disturbances.
#[inline(always)]
fn sagging(away: &V, length: Lanes) -> Lanes {
    Lanes::splat(1e-6 / 24.0) * (away[0] * away[0] + away[1] * away[1]) * length
}

/// One value of the row's cable, for each lane.
#[inline(always)]
fn of_anchor(task: &Calibration, at: usize, value: impl Fn(usize) -> f64) -> Lanes {
    Lanes(std::array::from_fn(|k| value(task.columns.anchor[at + k])))
}

#[cfg_attr(not(debug_assertions), inline(always))]
fn cable(
    task: &Calibration,
    state: &State,
    at: usize,
    jacobian: bool,
    rows: usize,
    place: usize,
    out: &mut [f64],
) {
    let weight = Lanes::load(&task.columns.per_mm, at);
    let (frames, scale) = frames(task, state, at);
    let p = point(&frames, state, at);
    let single = state.outlets.len() == 1;
    let (outlet, zero): (V, Lanes) = if single {
        (splat(&state.outlets[0]), Lanes::splat(state.zeros[0]))
    } else {
        let outlet = std::array::from_fn(|k| of_anchor(task, at, |a| state.outlets[a][k]));
        (outlet, of_anchor(task, at, |a| state.zeros[a]))
    };
    let mut v = minus(&p, &outlet);
    if let Some(pushed) = &state.pushed {
        v = minus(&v, &load(&pushed.frame, at));
    }
    let length = dot(&v, &v).sqrt();
    let mut free = length + zero;
    let mut predicted = free;
    if let Some(pushed) = &state.pushed {
        free += Lanes::load(&pushed.zero, at);
        predicted =
            free * Lanes::load(&pushed.scale, at) + Lanes::load(&pushed.sag, at) * sagging(&v, length);
    }
    let residual = weight * (predicted - Lanes::load(&task.columns.reading[0], at));
    let columns = task.parameters.len();
    if !jacobian {
        store(out, place, residual);
        return;
    }
    store(out, columns * rows + place, residual);
    // u carries the weight, so that every column comes out whitened.
    let scaled = state.pushed.as_ref().map_or(Lanes::splat(1.0), |pushed| Lanes::load(&pushed.scale, at));
    let pull = weight * scaled / length;
    let u: V = std::array::from_fn(|k| v[k] * pull);
    let moment: [V; 7] = std::array::from_fn(|i| cross(&minus(&p, &frames.origin[i]), &u));
    let link = |joint, coordinate| link_pull(&frames, &u, &moment, joint, coordinate);
    let none = Lanes::splat(0.0);
    for (k, parameter) in task.parameters.iter().enumerate() {
        let value = match *parameter {
            Parameter::Link { joint, coordinate } if coordinate.is_length() => {
                scale * link(joint, coordinate)
            }
            Parameter::Link { joint, coordinate } => link(joint, coordinate),
            Parameter::Target(axis) if axis < 3 => {
                dot(&in_base(&frames, &state.flange.column(axis).into()), &u)
            }
            Parameter::Outlet { axis, .. } if single => -u[axis],
            Parameter::Zero { .. } if single => weight * scaled,
            Parameter::Outlet { anchor, axis } => {
                -u[axis] * of_anchor(task, at, |a| f64::from(u8::from(a == anchor)))
            }
            Parameter::Zero { anchor } => {
                weight * scaled * of_anchor(task, at, |a| f64::from(u8::from(a == anchor)))
            }
            Parameter::Disturbance { index, parameter } if !turns_joints(task, index) => {
                let how_far = course(task, index, at);
                how_far
                    * match task.frames.disturbances[index].kind {
                        Kind::Zero => weight * scaled,
                        Kind::Frame { .. } => -u[parameter.min(2)],
                        Kind::Tool => dot(&in_base(&frames, &state.flange.column(parameter).into()), &u),
                        Kind::Scale => weight * free,
                        Kind::Sag => weight * sagging(&v, length),
                        Kind::Form(_) => -dot(&load(&task.columns.shifts[index][parameter], at), &u),
                        Kind::Load { .. } => none,
                    }
            }
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => {
                let mut sum = none;
                if let Some(effect) = task.columns.effect_of(k) {
                    for (joint, rotation) in effect.rotation.iter().enumerate() {
                        if let Some(rotation) = rotation {
                            sum += Lanes::load(rotation, at) * link(joint, LinkCoordinate::Theta);
                        }
                    }
                    if let Some(growth) = &effect.growth {
                        let mut grown = none;
                        for (joint, (a, d)) in state.links_mm.iter().enumerate() {
                            grown += Lanes::splat(*a) * link(joint, LinkCoordinate::A);
                            grown += Lanes::splat(*d) * link(joint, LinkCoordinate::D);
                        }
                        sum += Lanes::load(growth, at) * grown;
                    }
                }
                sum
            }
            Parameter::SensorFrame(_) | Parameter::Target(_) => none,
        };
        store(out, k * rows + place, value);
    }
}

/// Whether a disturbance bends the joints, as effects do.
#[inline(always)]
fn turns_joints(task: &Calibration, index: usize) -> bool {
    task.frames.disturbances[index].kind.turns_joints()
}

/// v turned by a small rotation vector, to second order: some 1e-7 of v is left out at 0.5°.
#[cfg_attr(not(debug_assertions), inline(always))]
fn turned_by(turn: &V, v: &V) -> V {
    let first = cross(turn, v);
    let second = cross(turn, &first);
    std::array::from_fn(|k| v[k] + first[k] + Lanes::splat(0.5) * second[k])
}

/// u · ∂p for a coordinate of a link; `moment[i]` is (p − oᵢ) × u, since u·(z × r) = z·(r × u).
#[cfg_attr(not(debug_assertions), inline(always))]
fn link_pull(
    frames: &Chain<Lanes>,
    u: &V,
    moment: &[V; 7],
    joint: usize,
    coordinate: LinkCoordinate,
) -> Lanes {
    match coordinate {
        LinkCoordinate::Theta => dot(&frames.z[joint], &moment[joint]),
        LinkCoordinate::D => dot(&frames.z[joint], u),
        LinkCoordinate::A => dot(&frames.lateral[joint], u),
        LinkCoordinate::Alpha => dot(&frames.lateral[joint], &moment[joint + 1]),
        LinkCoordinate::Beta => dot(&frames.y[joint], &moment[joint + 1]),
    }
}

/// Velocity of the point and angular velocity, in the base.
type Twist = (V, V);

#[cfg_attr(not(debug_assertions), inline(always))]
fn link_twist(frames: &Chain<Lanes>, p: &V, joint: usize, coordinate: LinkCoordinate) -> Twist {
    let none = [Lanes::splat(0.0); 3];
    let turning = |axis: &V, through: &V| (cross(axis, &minus(p, through)), *axis);
    match coordinate {
        LinkCoordinate::Theta => turning(&frames.z[joint], &frames.origin[joint]),
        LinkCoordinate::D => (frames.z[joint], none),
        LinkCoordinate::A => (frames.lateral[joint], none),
        LinkCoordinate::Alpha => turning(&frames.lateral[joint], &frames.origin[joint + 1]),
        LinkCoordinate::Beta => turning(&frames.y[joint], &frames.origin[joint + 1]),
    }
}

#[inline(always)]
fn add(to: &mut Twist, scale: Lanes, twist: &Twist) {
    for k in 0..3 {
        to.0[k] += scale * twist.0[k];
        to.1[k] += scale * twist.1[k];
    }
}

/// Matrix of columns times vector.
#[inline(always)]
fn times(columns: &[V; 3], v: &V) -> V {
    std::array::from_fn(|i| columns[0][i] * v[0] + columns[1][i] * v[1] + columns[2][i] * v[2])
}

#[allow(clippy::too_many_arguments)]
#[cfg_attr(not(debug_assertions), inline(always))]
fn space(
    task: &Calibration,
    state: &State,
    at: usize,
    jacobian: bool,
    rows: usize,
    place: usize,
    oriented: bool,
    out: &mut [f64],
) {
    let columns = &task.columns;
    let (weight, turn_weight) = (Lanes::load(&columns.per_mm, at), Lanes::load(&columns.per_rad, at));
    let none = [Lanes::splat(0.0); 3];
    let (frames, scale) = frames(task, state, at);
    let p = point(&frames, state, at);
    let components = if oriented { 6 } else { 3 };
    let rotation = state.base_from_sensor.rotation.to_rotation_matrix();
    let sensor: [V; 3] = std::array::from_fn(|k| splat(&rotation.matrix().column(k).into()));
    let reading: V = std::array::from_fn(|k| Lanes::load(&columns.reading[k], at));
    let mut turned = times(&sensor, &reading);
    let mut origin = splat(&state.base_from_sensor.translation.vector);
    // The scale multiplies what the model sees, not the reading: its noise must not look like evidence of a scale.
    let mut scaled = Lanes::splat(1.0);
    if let Some(pushed) = &state.pushed {
        scaled = Lanes::load(&pushed.scale, at);
        turned = turned_by(&load(&pushed.turn, at), &turned);
        let shift = load(&pushed.frame, at);
        (0..3).for_each(|k| origin[k] += shift[k]);
    }
    let seen = minus(&p, &origin);
    let last = if jacobian { task.parameters.len() } else { 0 };
    for k in 0..3 {
        let residual = weight * (turned[k] - scaled * seen[k]);
        store(out, (last * components + k) * rows + place, residual);
    }
    // E = R_C R_m (R R_t)ᵀ as columns, its trace, and ½ vee(E − Eᵀ).
    let mut error = [none; 3];
    let mut trace = Lanes::splat(0.0);
    if oriented {
        let measured: [V; 3] = std::array::from_fn(|column| {
            let axis = times(
                &sensor,
                &std::array::from_fn(|k| Lanes::load(&columns.reading[3 + 3 * column + k], at)),
            );
            match &state.pushed {
                Some(pushed) => turned_by(&load(&pushed.turn, at), &axis),
                None => axis,
            }
        });
        let target = state.target.rotation.to_rotation_matrix();
        let modelled: [V; 3] = std::array::from_fn(|k| in_base(&frames, &target.matrix().column(k).into()));
        for j in 0..3 {
            for i in 0..3 {
                error[j][i] = measured[0][i] * modelled[0][j]
                    + measured[1][i] * modelled[1][j]
                    + measured[2][i] * modelled[2][j];
            }
        }
        trace = error[0][0] + error[1][1] + error[2][2];
        let half = Lanes::splat(0.5) * turn_weight;
        let vee = [
            half * (error[1][2] - error[2][1]),
            half * (error[2][0] - error[0][2]),
            half * (error[0][1] - error[1][0]),
        ];
        for (k, value) in vee.into_iter().enumerate() {
            store(out, (last * components + 3 + k) * rows + place, value);
        }
    }
    if !jacobian {
        return;
    }
    for (k, parameter) in task.parameters.iter().enumerate() {
        // The reading's side moves with a sensor frame, the arm's side with everything else.
        let mut of_sensor = false;
        let twist: Twist = match *parameter {
            Parameter::Link { joint, coordinate } if coordinate.is_length() => {
                let (v, w) = link_twist(&frames, &p, joint, coordinate);
                (v.map(|v| scale * v), w)
            }
            Parameter::Link { joint, coordinate } => link_twist(&frames, &p, joint, coordinate),
            Parameter::Target(axis) if axis < 3 => {
                (in_base(&frames, &state.flange.column(axis).into()), none)
            }
            Parameter::Target(axis) => (none, in_base(&frames, &state.target_axes.column(axis - 3).into())),
            Parameter::SensorFrame(axis) if axis < 3 => {
                of_sensor = true;
                (splat(&Vector3::ith(axis, 1.0)), none)
            }
            Parameter::SensorFrame(axis) => {
                of_sensor = true;
                let w = splat(&state.sensor_axes.column(axis - 3).into());
                (cross(&w, &turned), w)
            }
            Parameter::Disturbance { index, parameter } if !turns_joints(task, index) => {
                let how_far = course(task, index, at);
                let kind = &task.frames.disturbances[index].kind;
                of_sensor = !matches!(kind, Kind::Tool);
                let (v, w) = match kind {
                    Kind::Frame { .. } if parameter < 3 => (splat(&Vector3::ith(parameter, 1.0)), none),
                    Kind::Frame { .. } => {
                        let w = splat(&Vector3::ith(parameter - 3, 1.0));
                        (cross(&w, &turned), w)
                    }
                    Kind::Tool => (in_base(&frames, &state.flange.column(parameter).into()), none),
                    Kind::Scale => (seen.map(|v| -v / scaled), none),
                    Kind::Form(_) => (load(&columns.shifts[index][parameter], at), none),
                    Kind::Zero | Kind::Sag | Kind::Load { .. } => (none, none),
                };
                (v.map(|v| how_far * v), w.map(|w| how_far * w))
            }
            Parameter::Effect { .. } | Parameter::Disturbance { .. } => {
                let mut sum = (none, none);
                if let Some(effect) = columns.effect_of(k) {
                    for (joint, rotation) in effect.rotation.iter().enumerate() {
                        if let Some(rotation) = rotation {
                            let twist = link_twist(&frames, &p, joint, LinkCoordinate::Theta);
                            add(&mut sum, Lanes::load(rotation, at), &twist);
                        }
                    }
                    if let Some(growth) = &effect.growth {
                        let grown = Lanes::load(growth, at);
                        for (joint, (a, d)) in state.links_mm.iter().enumerate() {
                            let along = link_twist(&frames, &p, joint, LinkCoordinate::A);
                            add(&mut sum, grown * Lanes::splat(*a), &along);
                            let up = link_twist(&frames, &p, joint, LinkCoordinate::D);
                            add(&mut sum, grown * Lanes::splat(*d), &up);
                        }
                    }
                }
                sum
            }
            Parameter::Outlet { .. } | Parameter::Zero { .. } => (none, none),
        };
        // A shift of the sensor and everything of the arm are seen through the scale; a turn of the sensor is not.
        let through_scale = !matches!(
            *parameter,
            Parameter::SensorFrame(3..) | Parameter::Disturbance { parameter: 3.., .. }
        ) || !of_sensor;
        let size = if through_scale { weight * scaled } else { weight };
        let sign = if of_sensor { size } else { -size };
        for (i, v) in twist.0.into_iter().enumerate() {
            store(out, (k * components + i) * rows + place, sign * v);
        }
        if oriented {
            // δ ½vee = ½ (tr E − E) w for the sensor's side, −½ (tr E − Eᵀ) w for the arm's.
            let w = twist.1;
            let half = Lanes::splat(0.5) * turn_weight;
            let product: V = if of_sensor {
                times(&error, &w)
            } else {
                [dot(&error[0], &w), dot(&error[1], &w), dot(&error[2], &w)]
            };
            for i in 0..3 {
                let value = half * (trace * w[i] - product[i]);
                let value = if of_sensor { value } else { -value };
                store(out, (k * components + 3 + i) * rows + place, value);
            }
        }
    }
}
