//! The catalogue of candidate causes, with regressors that do not depend on the fit.
//!
//! A new effect is one more entry of [`arm_candidates`] or [`measurement_candidates`]. The rows of shifts and the orders of
//! reducer harmonics are searched, not listed: see `intervals` and `order_spectrum`.

use std::sync::Arc;

use nalgebra::{DMatrix, Point3, Vector3};
use rayon::prelude::*;

use super::cause::{Cause, MAP_KNOTS, parallel_neighbours};
use super::design::{Design, Slopes};
use super::extension::Subject;
use super::latency;
use super::nonlinear_springs;
use crate::identification::calibration::{
    Frames, LoadedRows, joint_rotations, motions_by_links, sensor_shifts, sensor_turns,
};
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::repeated_poses::poses;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::{EmpiricalFault, Overturning, Pole};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::bending::Bending;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::coupling::Coupling;
use truegrind_arm::effect::error_map::ErrorMap;
use truegrind_arm::effect::gear_ratio::GearRatio;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::effect::link_twist::LinkTwist;
use truegrind_arm::effect::lumped_compliance::{Lump, LumpedCompliance};
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::model::{Joints, Model};
use truegrind_math::work::checkpoint;

/// A cause with its regressors.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The cause, with all parameters 0.
    pub cause: Cause,
    /// One for each parameter.
    pub regressors: Vec<Regressor>,
    /// Number of variants of the cause that were tried (rows, orders, time constants), itself included.
    pub tried: f64,
}

/// Effect of one parameter on each row, per unit.
#[derive(Debug, Clone)]
pub enum Regressor {
    /// Rotates joints (0-based) and scales all lengths.
    Arm {
        /// Rotations of joints (rad).
        rotation: Vec<(usize, Vec<f64>)>,
        /// Relative growth; empty where there is none.
        growth: Vec<f64>,
    },
    /// Displaces one coordinate of a disturbance, in proportion to the profile.
    Disturbance {
        /// The coordinate.
        coordinate: Coordinate,
        /// Factor in each row.
        profile: Vec<f64>,
    },
    /// Shifts the sensor in the base: three coordinates, and where it turns too three of a rotation vector about the sensor.
    Shift(Vec<Vec<f64>>),
}

/// A coordinate in which a measurement can be displaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coordinate {
    /// The cable's zero.
    Zero,
    /// Coordinate of the sensor's frame.
    Frame(usize),
    /// Coordinate of the target.
    Target(usize),
    /// The scale.
    Scale,
    /// The sag.
    Sag,
}

impl Candidate {
    /// A candidate for a cause; its parameter values are irrelevant.
    pub fn of(cause: &Cause, subject: &Subject<'_>) -> Self {
        let (dataset, nominal) = (&subject.observed.dataset, subject.nominal);
        match cause {
            Cause::Arm(effect) if effect.first_moved_frame().is_some() => Self::moving_links(effect, subject),
            Cause::Arm(effect) => Self::arm(effect.clone(), dataset, nominal),
            Cause::Measurement(d) => Self::measurement(d.clone(), dataset, nominal, subject.evaluated_at),
        }
    }

    /// A candidate in the arm, its regressors evaluated at the nominal arm.
    pub fn arm(effect: Effect, dataset: &Dataset, nominal: &Model) -> Self {
        let statics = nominal.statics();
        let count = effect.parameters().len();
        let n = dataset.rows.len();
        let mut rotation: Vec<[Option<Vec<f64>>; 6]> = vec![Default::default(); count];
        let mut growth = vec![Vec::new(); count];
        for (i, row) in dataset.rows.iter().enumerate() {
            let u = nominal.mapped(&row.joints);
            for (k, turn) in
                effect.regressors(&statics, &u, &nominal.gear_condition(&row.condition)).iter().enumerate()
            {
                for j in (0..6).filter(|&j| turn[j] != 0.0) {
                    rotation[k][j].get_or_insert_with(|| vec![0.0; n])[i] = turn[j];
                }
            }
            for (k, g) in effect.growth_regressors(&row.condition).into_iter().enumerate() {
                if g != 0.0 {
                    if growth[k].is_empty() {
                        growth[k] = vec![0.0; n];
                    }
                    growth[k][i] = g;
                }
            }
        }
        let regressors = rotation
            .into_iter()
            .zip(growth)
            .map(|(rotation, growth)| Regressor::Arm {
                rotation: rotation
                    .into_iter()
                    .enumerate()
                    .filter_map(|(j, column)| column.map(|c| (j, c)))
                    .collect(),
                growth,
            })
            .collect();
        Self { cause: Cause::Arm(effect), regressors, tried: 1.0 }
    }

    /// A candidate that moves links, which is a sensor that moves.
    fn moving_links(effect: &Effect, subject: &Subject<'_>) -> Self {
        let dataset = &subject.observed.dataset;
        let motions = motions_by_links(effect, dataset, subject.nominal, subject.evaluated_at);
        let coordinates = if dataset.sensor == Sensor::Pose { 6 } else { 3 };
        let regressors = motions.iter().map(|rows| {
            let of = |k: usize| rows.iter().map(|motion| motion[k / 3][k % 3]).collect::<Vec<f64>>();
            Regressor::Shift((0..coordinates).map(of).collect())
        });
        Self { cause: Cause::Arm(effect.clone()), regressors: regressors.collect(), tried: 1.0 }
    }

    /// A candidate in the measurement.
    pub fn measurement(
        disturbance: Disturbance,
        dataset: &Dataset,
        nominal: &Model,
        frames: &Frames,
    ) -> Self {
        let profile: Vec<f64> = dataset.rows.iter().map(|r| disturbance.profile.at(r)).collect();
        let push = |coordinate| Regressor::Disturbance { coordinate, profile: profile.clone() };
        let regressors = match &disturbance.kind {
            Kind::Zero => vec![push(Coordinate::Zero)],
            Kind::Frame { turning } => {
                (0..if *turning { 6 } else { 3 }).map(|k| push(Coordinate::Frame(k))).collect()
            }
            Kind::Target => (0..3).map(|k| push(Coordinate::Target(k))).collect(),
            Kind::Scale => vec![push(Coordinate::Scale)],
            Kind::Sag => vec![push(Coordinate::Sag)],
            Kind::Empirical(form) if !form.rotates_joints() => {
                let axes =
                    |v: &Vec<Vector3<f64>>| [0, 1, 2].map(|k| v.iter().map(|v| v[k]).collect::<Vec<f64>>());
                let turns = sensor_turns(*form, dataset, nominal, frames);
                let shifts = sensor_shifts(*form, dataset, nominal, frames);
                let both = shifts.iter().enumerate().map(|(k, shift)| {
                    let turn = turns.get(k).into_iter().flat_map(axes);
                    Regressor::Shift(axes(shift).into_iter().chain(turn).collect())
                });
                both.collect()
            }
            kind => joint_rotations(kind, &LoadedRows::new(dataset, nominal))
                .into_iter()
                .map(|rotation| Regressor::Arm {
                    rotation: rotation
                        .into_iter()
                        .enumerate()
                        .filter_map(|(j, r)| Some((j, r?.iter().zip(&profile).map(|(r, c)| r * c).collect())))
                        .collect(),
                    growth: Vec::new(),
                })
                .collect(),
        };
        Self { cause: Cause::Measurement(disturbance), regressors, tried: 1.0 }
    }

    /// A disturbance at all times, from row `from` to row `to` (by number) alone; `tried` as there. Of a joint's zero that changed for
    /// good, the rows before: the arm is what it is at the end.
    pub fn over_rows(&self, dataset: &Dataset, [from, to]: [usize; 2]) -> Self {
        let Cause::Measurement(always) = &self.cause else { return self.clone() };
        let numbers = || dataset.rows.iter().map(|row| row.number);
        let is_last = numbers().next_back() == Some(to);
        let before = numbers().take_while(|number| *number < from).last().filter(|_| is_last);
        let [from, to] = match (&always.kind, before, numbers().next()) {
            (Kind::JointZero { .. }, Some(before), Some(first)) => [first, before],
            _ => [from, to],
        };
        let profile = Profile::Rows { from, to };
        let inside: Vec<f64> = dataset.rows.iter().map(|row| profile.at(row)).collect();
        let part = |values: &Vec<f64>| values.iter().zip(&inside).map(|(v, c)| v * c).collect::<Vec<f64>>();
        let regressors = self.regressors.iter().map(|regressor| match regressor {
            Regressor::Arm { rotation, growth } => Regressor::Arm {
                rotation: rotation.iter().map(|(joint, values)| (*joint, part(values))).collect(),
                growth: part(growth),
            },
            Regressor::Disturbance { coordinate, profile } => {
                Regressor::Disturbance { coordinate: *coordinate, profile: part(profile) }
            }
            Regressor::Shift(vectors) => Regressor::Shift(vectors.iter().map(part).collect()),
        });
        let cause = Cause::Measurement(Disturbance::new(always.kind.clone(), profile));
        Self { cause, regressors: regressors.collect(), tried: self.tried }
    }

    /// The whitened columns of the candidate, rows × parameters.
    pub fn columns(&self, design: &Design) -> DMatrix<f64> {
        self.columns_of(&design.slopes, (design.observations, design.per))
    }

    /// The same from the derivatives alone, for (observations, scalar rows of each).
    pub fn columns_of(&self, slopes: &Slopes, (n, per): (usize, usize)) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(n * per, self.regressors.len());
        for (k, regressor) in self.regressors.iter().enumerate() {
            let mut column = out.column_mut(k);
            let mut add = |profile: &[f64], slope: &dyn Fn(usize) -> f64| {
                for (i, c) in profile.iter().enumerate().filter(|(_, c)| **c != 0.0) {
                    for s in i * per..(i + 1) * per {
                        column[s] += c * slope(s);
                    }
                }
            };
            match regressor {
                Regressor::Arm { rotation, growth } => {
                    for (joint, profile) in rotation {
                        add(profile, &|s| slopes.by_joint[*joint][s]);
                    }
                    add(growth, &|s| slopes.by_growth[s]);
                }
                Regressor::Disturbance { coordinate, profile } => match coordinate {
                    Coordinate::Zero => add(profile, &|s| slopes.by_zero[s]),
                    Coordinate::Frame(axis) => add(profile, &|s| slopes.by_frame[(s, *axis)]),
                    Coordinate::Target(axis) => add(profile, &|s| slopes.by_target[(s, *axis)]),
                    Coordinate::Scale => add(profile, &|s| slopes.by_scale[s]),
                    Coordinate::Sag => add(profile, &|s| slopes.by_sag[s]),
                },
                Regressor::Shift(vectors) => {
                    for (axis, profile) in vectors.iter().enumerate() {
                        add(profile, &|s| slopes.by_frame[(s, axis)]);
                    }
                }
            }
        }
        out
    }
}

/// Logged columns and ranges, which decide the candidates that a data set can test.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedColumns {
    /// For each joint, whether both approach sides occur.
    pub approach: [bool; 6],
    /// First time and duration of the run, where times are logged (h).
    pub clock: Option<[f64; 2]>,
    /// Mean and range of the temperature, where logged [°C].
    pub temperature: Option<(f64, f64)>,
    /// Range of each joint (rad).
    pub range_rad: [f64; 6],
}

impl LoggedColumns {
    /// The logged columns of a data set.
    pub fn of(dataset: &Dataset) -> Self {
        let span = |values: Vec<f64>| {
            let (low, high) =
                values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
            (low, high)
        };
        let times = span(dataset.rows.iter().filter_map(|r| r.condition.time_h).collect());
        let warm: Vec<f64> = dataset.rows.iter().filter_map(|r| r.condition.temperature_c).collect();
        let heat = span(warm.clone());
        Self {
            approach: std::array::from_fn(|j| {
                let has = |side: i8| dataset.rows.iter().any(|r| r.condition.approach[j] == side);
                has(-1) && has(1)
            }),
            clock: (times.1 - times.0 > 0.0 && times.0.is_finite()).then_some([times.0, times.1 - times.0]),
            temperature: (heat.1 - heat.0 > 0.0 && heat.0.is_finite())
                .then(|| (warm.iter().sum::<f64>() / warm.len() as f64, heat.1 - heat.0)),
            range_rad: std::array::from_fn(|j| {
                let (low, high) = span(dataset.rows.iter().map(|r| r.joints[j]).collect());
                high - low
            }),
        }
    }
}

/// Couplings (driver, joint, variants): of the common gear trains of wrist and forearm linkage, and of two pairs that hardly any gear train
/// joins, which have the odds of several variants.
const COUPLINGS: [(usize, usize, f64); 10] = [
    (3, 4, 1.0),
    (3, 5, 1.0),
    (4, 5, 1.0),
    (4, 3, 1.0),
    (5, 4, 1.0),
    (5, 3, 1.0),
    (1, 2, 1.0),
    (2, 1, 1.0),
    (2, 3, 5.0),
    (0, 1, 5.0),
];

/// Fine error maps for the periods of a reducer's stages, tried where the order spectrum has peaks in their range: knots, and the
/// highest resolved order (a cubic spline needs nearly two and a half knots per period).
pub const FINE: [(usize, usize); 2] = [(72, 30), (144, 60)];

/// Fewest poses for each knot of the finest map: with fewer, single harmonics fit as well.
const POSES_PER_KNOT: usize = 10;

/// The fine error maps of each joint, coarsest first: those of [`FINE`] with enough poses.
pub fn fine_maps(subject: &Subject<'_>) -> Vec<Vec<Arc<Candidate>>> {
    let dataset = &subject.observed.dataset;
    let needed = POSES_PER_KNOT * FINE[1].0;
    let all = dataset.rows.len() >= needed && poses(dataset).len() >= needed;
    let map = |joint: usize, knots: usize| {
        let effect = Effect::GearMap(ErrorMap { joint, knots_rad: vec![0.0; knots] });
        Arc::new(Candidate::arm(effect, dataset, subject.nominal))
    };
    let tried = if all { &FINE[..] } else { &FINE[..1] };
    (0..6).map(|joint| tried.iter().map(|&(knots, _)| map(joint, knots)).collect()).collect()
}

/// Range below which an axis counts as not moving (rad).
pub const STILL_RAD: f64 = 0.02;

/// Candidate causes in the arm.
pub fn arm_candidates(subject: &Subject<'_>) -> Vec<Candidate> {
    let dataset = &subject.observed.dataset;
    let columns = LoggedColumns::of(dataset);
    let nominal = subject.nominal;
    let moves = |j: usize| columns.range_rad[j] > STILL_RAD;
    let mut effects: Vec<(Effect, f64)> = Vec::new();
    for joint in (0..6).filter(|&j| moves(j)) {
        for order in [1.0, 2.0] {
            let harmonic = Harmonic { joint, order, sine_rad: 0.0, cosine_rad: 0.0 };
            effects.push((Effect::GearEccentricity(harmonic), 1.0));
        }
        effects.push((Effect::GearRatio(GearRatio { joint, error: 0.0 }), 1.0));
        effects.push((Effect::GearMap(ErrorMap { joint, knots_rad: vec![0.0; MAP_KNOTS] }), 1.0));
    }
    if nominal.bodies.is_some() {
        for joint in 0..6 {
            let compliance = Compliance { joint, compliance_rad_per_nm: 0.0 };
            effects.push((Effect::JointCompliance(compliance), 1.0));
        }
    }
    let lump = |frame, axis, moment| Lump { frame, axis, moment, factor: 0.0 };
    for joint in 0..5 {
        let lumps: Vec<Lump> = lumped_frames(joint).iter().map(|&frame| lump(frame, None, None)).collect();
        effects.push((Effect::LumpedCompliance(LumpedCompliance { joint, lump: lumps.clone() }), 1.0));
        // The first moments of the links between complete the span of the static torques of any masses.
        if (1..4).contains(&joint) {
            let moments = (joint + 1..if joint == 3 { 6 } else { 4 })
                .flat_map(|frame| (0..3).map(move |m| lump(frame, None, Some(m))));
            let all = lumps.into_iter().chain(moments).collect();
            effects.push((Effect::LumpedCompliance(LumpedCompliance { joint, lump: all }), 1.0));
        }
    }
    effects.push((Effect::LumpedCompliance(beside_the_flange_axis()), 1.0));
    effects.extend(
        bending_links(nominal).into_iter().map(|(bending, tried)| (Effect::LinkBending(bending), tried)),
    );
    effects
        .extend(twisting_links(nominal).into_iter().map(|(twist, tried)| (Effect::LinkTwist(twist), tried)));
    // Gravity that is not along the base's vertical axis: the same torques along the two other axes of the base.
    let down = nominal.gravity.iamax();
    let across: Vec<usize> = (0..3).filter(|&axis| axis != down).collect();
    for joint in 0..5 {
        let frames: &[usize] = match joint {
            0 | 1 => &[2, 4],
            2 => &[4],
            _ => &[6],
        };
        let tilted = |frame, moment| across.iter().map(move |&axis| lump(frame, Some(axis), moment));
        let lumps: Vec<Lump> = frames.iter().flat_map(|&frame| tilted(frame, None)).collect();
        effects.push((Effect::LumpedCompliance(LumpedCompliance { joint, lump: lumps.clone() }), 1.0));
        let moments = (joint + 1..5)
            .flat_map(|frame| (0..3).flat_map(move |m| tilted(frame, Some(m))))
            .collect::<Vec<_>>();
        let wrist = if joint < 3 { tilted(6, None).collect() } else { Vec::new() };
        let all = lumps.into_iter().chain(wrist).chain(moments).collect();
        effects.push((Effect::LumpedCompliance(LumpedCompliance { joint, lump: all }), 1.0));
    }
    for (driver, joint, tried) in COUPLINGS.into_iter().filter(|&(driver, ..)| moves(driver)) {
        effects.push((Effect::JointCoupling(Coupling { joint, driver, factor: 0.0 }), tried));
    }
    for joint in (0..6).filter(|&j| columns.approach[j]) {
        effects.push((Effect::Backlash(Backlash { joint, play_rad: 0.0 }), 1.0));
    }
    for (thermal, tried) in growth_profiles(&columns) {
        effects.push((Effect::ThermalDrift(thermal), tried));
    }
    effects
        .into_par_iter()
        .map(|(effect, tried)| {
            checkpoint();
            Candidate { tried, ..Candidate::of(&Cause::Arm(effect), subject) }
        })
        .collect()
}

/// Prior odds of a joint that yields against the link between two joints that does: reducers are some ten times as soft as castings.
const LINK_ODDS: f64 = 10.0;

/// Joint 5 under a tool that stands beside the axis of the flange, or a motor beside the wrist: a mass on that axis, and first moments of
/// the last two links across it, which turn with joint 6 or do not. With a mass on the axis alone most of such a deflection was left, and
/// passed for a target that droops or for a gear.
fn beside_the_flange_axis() -> LumpedCompliance {
    let beside = |frame| [0, 1].map(|axis| Lump { frame, axis: None, moment: Some(axis), factor: 0.0 });
    let on_axis = Lump { frame: 6, axis: None, moment: None, factor: 0.0 };
    LumpedCompliance { joint: 4, lump: [on_axis].into_iter().chain(beside(5)).chain(beside(6)).collect() }
}

/// Least sine of the angle between the axis of a link's joint and gravity where a load beside the arm shows.
const ACROSS_GRAVITY: f64 = 0.5;

/// Links between parallel axes that can twist under a load beside the arm.
fn twisting_links(nominal: &Model) -> Vec<(LinkTwist, f64)> {
    let frames = nominal.at_condition(&Condition::default()).frames(&Joints::zeros());
    let is_across =
        |joint: usize| Vector3::from(frames.z[joint]).cross(&nominal.gravity).norm() > ACROSS_GRAVITY;
    let parallel = (0..5).filter(|&joint| parallel_neighbours(nominal, joint, joint + 1).is_some());
    parallel
        .filter(|&joint| is_across(joint))
        .flat_map(|joint| [None, Some(0.0)].map(|lean_rad| LinkTwist { joint, twist_rad: 0.0, lean_rad }))
        .map(|twist| (twist, LINK_ODDS))
        .collect()
}

/// Links between parallel axes that can bend under gravity, with the number of variants of each: where masses are not known the load is put
/// at elbow, wrist or flange.
fn bending_links(nominal: &Model) -> Vec<(Bending, f64)> {
    let parallel = (0..5).filter(|&joint| parallel_neighbours(nominal, joint, joint + 1).is_some());
    parallel
        .flat_map(|joint| {
            let frames: Vec<Option<usize>> = match nominal.bodies {
                Some(_) => vec![None],
                None => (joint + 1..=6).step_by(2).map(Some).collect(),
            };
            let tried = LINK_ODDS * frames.len() as f64;
            frames.into_iter().map(move |frame| (Bending { joint, frame, compliance_rad_per_nm: 0.0 }, tried))
        })
        .collect()
}

/// Time constants that are tried, as shares of the run.
const TIME_CONSTANTS: [f64; 5] = [0.05, 0.12, 0.3, 0.8, 3.0];

/// Growth of the links by the thermometer and by the clock, as far as they were logged, with the variants tried.
fn growth_profiles(columns: &LoggedColumns) -> Vec<(Thermal, f64)> {
    // Growth by the clock that begins after the last row: there is none.
    let last_h = columns.clock.map_or(0.0, |[start_h, hours]| start_h + hours);
    let reference_c = columns.temperature.map_or(20.0, |(mean, _)| mean);
    let still =
        Thermal { growth: 0.0, time_constant_h: 1.0, start_h: last_h, growth_per_k: 0.0, reference_c };
    let mut out = Vec::new();
    if columns.temperature.is_some() {
        out.push((still.clone(), 1.0));
    }
    if let Some([start_h, hours]) = columns.clock {
        let tried = TIME_CONSTANTS.len() as f64;
        let by_clock = |share: &f64| Thermal { time_constant_h: share * hours, start_h, ..still.clone() };
        out.extend(TIME_CONSTANTS.iter().map(|share| (by_clock(share), tried)));
    }
    out
}

/// Prior odds of a stand that warms up against a target that creeps on the flange, which is rare.
const CREEP_ODDS: f64 = 10.0;

/// Stated standard deviation of the sensor's scale up to which it is no cause: a tenth of the errors that scales have.
const KNOWN_SCALE: f64 = 3e-4;

/// Candidate causes in the measurement that affect all rows.
pub fn measurement_candidates(subject: &Subject<'_>) -> Vec<Candidate> {
    let dataset = &subject.observed.dataset;
    let columns = LoggedColumns::of(dataset);
    let mut list = Vec::new();
    if subject.tolerance.scale.is_none_or(|sigma| sigma > KNOWN_SCALE) {
        list.push((Kind::Scale, Profile::Constant, 1.0));
    }
    if dataset.sensor == Sensor::Cable {
        list.push((Kind::Sag, Profile::Constant, 1.0));
    }
    let turning = dataset.sensor != Sensor::Cable;
    if let Some((mean, _)) = columns.temperature {
        list.push((Kind::Frame { turning }, Profile::Temperature { reference_c: mean }, 1.0));
        list.push((Kind::Target, Profile::Temperature { reference_c: mean }, CREEP_ODDS));
        if turning {
            let air = Kind::Empirical(EmpiricalFault::Refraction);
            list.push((air, Profile::Temperature { reference_c: mean }, EXPANSION_ODDS));
        }
        if dataset.sensor == Sensor::Cable {
            list.push((Kind::Zero, Profile::Temperature { reference_c: mean }, 1.0));
        }
    }
    if let Some([start_h, hours]) = columns.clock {
        let tried = TIME_CONSTANTS.len() as f64;
        for share in TIME_CONSTANTS {
            let clock = Profile::Exponential { start_h, time_constant_h: share * hours };
            list.push((Kind::Frame { turning }, clock, tried));
            list.push((Kind::Target, clock, CREEP_ODDS * tried));
            if dataset.sensor == Sensor::Cable {
                list.push((Kind::Zero, clock, tried));
            }
        }
    }
    let empirical = empirical_faults(subject, &columns)
        .into_iter()
        .map(|(form, tried)| (Kind::Empirical(form), Profile::Constant, tried));
    list.into_iter()
        .chain(empirical)
        .map(|(kind, profile, tried)| Candidate {
            tried,
            ..Candidate::measurement(
                Disturbance::new(kind, profile),
                dataset,
                subject.nominal,
                subject.evaluated_at,
            )
        })
        .collect()
}

/// Poles of a target that may droop, with the number of variants.
fn target_droops(dataset: &Dataset) -> Vec<(EmpiricalFault, f64)> {
    let turning = dataset.sensor == Sensor::Pose;
    let poles = [Pole::Axis, Pole::Offset, Pole::Bracket];
    let tried = poles.len() as f64;
    poles.map(|pole| (EmpiricalFault::TargetDroop { pole, turning }, tried)).to_vec()
}

/// Bases that may tilt, about their origin or below it, as stiff about one horizontal axis as about the other or not, with the number of
/// variants.
fn base_tilts(nominal: &Model) -> Vec<(EmpiricalFault, f64)> {
    let across = match nominal.gravity.iamax() {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    };
    let load = if nominal.bodies.is_some() { Overturning::Masses } else { Overturning::Lumps };
    let forms = [(None, false), (None, true), (Some(across), false), (Some(across), true)];
    let tried = forms.len() as f64;
    forms.iter().map(|&(axes, deep)| (EmpiricalFault::BaseTilt { load, axes, deep }, tried)).collect()
}

/// Deflections under the weight of the arm along its own direction of gravity: of joints, and of a base.
pub(super) fn weight_candidates(subject: &Subject<'_>) -> Vec<Candidate> {
    let nominal = subject.nominal;
    let lump = |frame| Lump { frame, axis: None, moment: None, factor: 0.0 };
    let compliances = (0..5).map(|joint| match nominal.bodies {
        Some(_) => Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 0.0 }),
        None => {
            let lumps = lumped_frames(joint).iter().map(|&frame| lump(frame)).collect();
            Effect::LumpedCompliance(LumpedCompliance { joint, lump: lumps })
        }
    });
    let tilts = base_tilts(nominal).into_iter().map(|(tilt, tried)| {
        let cause = Cause::Measurement(Disturbance::new(Kind::Empirical(tilt), Profile::Constant));
        Candidate { tried: EXPANSION_ODDS * tried, ..Candidate::of(&cause, subject) }
    });
    compliances.map(|effect| Candidate::of(&Cause::Arm(effect), subject)).chain(tilts).collect()
}

/// Ends of links at which lumps stand for masses beyond a joint: elbow, wrist, flange.
fn lumped_frames(joint: usize) -> &'static [usize] {
    match joint {
        0 | 1 => &[2, 4, 6],
        2 => &[4, 6],
        _ => &[6],
    }
}

/// Pairs of joints for two-joint gear errors.
const NEIGHBOURS: [(usize, usize); 10] =
    [(0, 1), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2), (3, 4), (4, 3), (4, 5), (5, 4)];

/// Orders of two-joint gear errors: eccentric and elliptic parts, as for a gear of its own.
const TWO_JOINT_ORDERS: [[u8; 2]; 4] = [[1, 1], [1, 2], [2, 1], [2, 2]];

/// Two-joint gear errors of neighbours that move, with the number of variants of each. Only first orders where the axes are parallel:
/// there the weight depends on both angles, so higher orders are also what a nonlinear spring, or backlash whose side follows the
/// load, looks like.
fn two_joint_gears(nominal: &Model, moves: &dyn Fn(usize) -> bool) -> Vec<(EmpiricalFault, f64)> {
    let pairs = NEIGHBOURS.into_iter().filter(|&(a, b)| moves(a) && moves(b));
    pairs
        .flat_map(|(joint, other)| {
            let parallel = parallel_neighbours(nominal, joint, other).is_some();
            let orders = if parallel { &TWO_JOINT_ORDERS[..1] } else { &TWO_JOINT_ORDERS[..] };
            let tried = orders.len() as f64;
            orders.iter().map(move |&orders| (EmpiricalFault::TwoJointGear { joint, other, orders }, tried))
        })
        .collect()
}

/// A drum fault over the range of the measured lengths.
fn drum(dataset: &Dataset) -> EmpiricalFault {
    let lengths = dataset.rows.iter().filter_map(|row| match row.reading {
        Reading::Cable(length) if length.is_finite() => Some(length),
        _ => None,
    });
    let (low, high) =
        lengths.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), l| (low.min(l), high.max(l)));
    EmpiricalFault::Drum { from_mm: low.min(high).max(0.0).floor() as u32, to_mm: high.ceil() as u32 }
}

/// Whether every target lies within 45° of the z axis of the sensor's frame, on one side, as what a camera sees does.
fn may_be_camera(subject: &Subject<'_>) -> bool {
    let posed = subject.nominal.at_condition(&Condition::default());
    let target = Point3::from(subject.evaluated_at.flange_from_target.translation.vector);
    let sensor_from_base = subject.evaluated_at.base_from_sensor.inverse();
    let mut seen = subject
        .observed
        .dataset
        .rows
        .iter()
        .map(|row| sensor_from_base * (posed.forward(&row.joints) * target));
    let ahead = |at: &Point3<f64>| at.z.abs() > at.x.hypot(at.y);
    let Some(first) = seen.next() else { return false };
    ahead(&first) && seen.all(|at| ahead(&at) && at.z * first.z > 0.0)
}

/// A range fault over the distances of the rows.
fn range(subject: &Subject<'_>) -> EmpiricalFault {
    let posed = subject.nominal.at_condition(&Condition::default());
    let target = Point3::from(subject.evaluated_at.flange_from_target.translation.vector);
    let sensor = subject.evaluated_at.base_from_sensor.translation.vector;
    let rows = subject.observed.dataset.rows.iter();
    let distances = rows.map(|row| ((posed.forward(&row.joints) * target).coords - sensor).norm());
    let (low, high) =
        distances.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), d| (low.min(d), high.max(d)));
    // To 10 mm: one row more must not change the fault.
    let [from_mm, to_mm] = [(low / 10.0).floor(), (high / 10.0).ceil()].map(|d| 10 * d as u32);
    EmpiricalFault::Range { from_mm, to_mm }
}

/// Time from row to row from which an arm may have stopped at each (h): stopping, settling and reading take some seconds.
const STOP_H: f64 = 2.0 / 3600.0;

fn median_interval_h(dataset: &Dataset) -> Option<f64> {
    let times: Vec<f64> = dataset.rows.iter().filter_map(|row| row.condition.time_h).collect();
    let intervals: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    truegrind_math::statistics::median(&intervals)
}

/// Prior odds of a cause with a physical law against an expansion for faults whose law is unknown: it can imitate many
/// laws. Counted as that many variants.
const EXPANSION_ODDS: f64 = 10.0;

/// Empirical faults that the logged columns can test, with the number of variants of each.
fn empirical_faults(subject: &Subject<'_>, columns: &LoggedColumns) -> Vec<(EmpiricalFault, f64)> {
    let dataset = &subject.observed.dataset;
    let mut out = Vec::new();
    let has =
        |rate: bool| dataset.rows.iter().any(|r| r.motion().is_some_and(|m| !rate || m.rates.is_some()));
    if has(true) {
        out.push((latency::fault(dataset), 1.0));
    }
    // Also on a path with a clock, if rows are so far apart that the arm may have stopped at each: then it has no speed there, but a last
    // step.
    if has(false) && (!has(true) || median_interval_h(dataset).is_some_and(|hours| hours > STOP_H)) {
        out.extend([(EmpiricalFault::ArmUnsettled, 2.0), (EmpiricalFault::SensorUnsettled, 2.0)]);
    }
    if has(false) && dataset.sensor == Sensor::Cable {
        out.push((EmpiricalFault::CableReversal, 1.0));
    }
    let moves = |j: usize| columns.range_rad[j] > STILL_RAD;
    let wobble = |joint| [false, true].map(|radial| (EmpiricalFault::AxisWobble { joint, radial }, 2.0));
    out.extend((0..6).filter(|&joint| moves(joint)).flat_map(wobble));
    let exact = out.len();
    out.extend(nonlinear_springs::faults(subject, &moves, &columns.approach));
    out.extend(two_joint_gears(subject.nominal, &moves));
    if dataset.sensor == Sensor::Cable {
        out.extend([(EmpiricalFault::Pulley, 1.0), (drum(dataset), 1.0)]);
    } else {
        out.push((EmpiricalFault::Refraction, 1.0));
        out.extend([(range(subject), 1.0), (EmpiricalFault::SensorAxes, 1.0)]);
        out.extend(may_be_camera(subject).then_some((EmpiricalFault::Lens, 1.0)));
        out.extend([false, true].map(|second| (EmpiricalFault::TargetNest { second }, 2.0)));
    }
    out.extend(target_droops(dataset));
    out.extend(base_tilts(subject.nominal));
    out[exact..].iter_mut().for_each(|(_, tried)| *tried *= EXPANSION_ODDS);
    out
}
