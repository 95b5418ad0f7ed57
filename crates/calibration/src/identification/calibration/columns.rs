//! Structure of arrays: readings, joint angles, and regressors of effects and disturbances, one column each.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::frames::{Frames, Weight};
use super::regressors::{self, LoadedRows, joint_rotations};
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::sensor::disturbance::Kind;
use crate::measurement::sensor::empirical::EmpiricalFault;
use truegrind_arm::condition::Condition;
use truegrind_arm::link_motion::LinkMotion;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_math::lanes::WIDTH;
use truegrind_math::work::checkpoint;

/// Rows from which columns are built in parallel.
const MANY_ROWS: usize = 8192;

/// Rows from which sines and cosines are recomputed in each pass (some ten nanoseconds a row) instead of stored (a hundred
/// bytes a row).
const MANY_ANGLES: usize = 50_000;

/// The joint angles of the rows (rad, of the mapped arm).
#[derive(Debug, Clone)]
pub(super) enum Angles {
    /// Their sines and cosines.
    SinCos { sin: [Vec<f64>; 6], cos: [Vec<f64>; 6] },
    /// The angles themselves, of very many rows.
    Raw([Vec<f64>; 6]),
}

impl Default for Angles {
    fn default() -> Self {
        Self::Raw(Default::default())
    }
}

/// Weights of the rows, padded to whole lanes with weight 0. Kept apart from [`Columns`], which fits to the same rows share.
#[derive(Debug, Clone, Default)]
pub(super) struct Weights {
    pub(super) per_mm: Vec<f64>,
    /// Empty where the sensor reads no orientation.
    pub(super) per_rad: Vec<f64>,
}

impl Weights {
    /// One for each row.
    pub(super) fn of(weights: &[Weight], rows: usize, sensor: Sensor) -> Self {
        assert_eq!(weights.len(), rows, "one weight for each row");
        let padded = |of: fn(&Weight) -> f64| {
            let mut out = Vec::with_capacity(weights.len().next_multiple_of(WIDTH));
            out.extend(weights.iter().map(of));
            out.resize(weights.len().next_multiple_of(WIDTH), 0.0);
            out
        };
        let per_rad = if sensor == Sensor::Pose { padded(|w| w.per_rad) } else { Vec::new() };
        Self { per_mm: padded(|w| w.per_mm), per_rad }
    }

    /// The weights of the given rows.
    pub(super) fn subset(&self, rows: &[usize]) -> Self {
        let picked = |all: &[f64]| -> Vec<f64> {
            if all.is_empty() {
                return Vec::new();
            }
            let mut out: Vec<f64> = rows.iter().map(|&row| all[row]).collect();
            out.resize(rows.len().next_multiple_of(WIDTH), 0.0);
            out
        };
        Self { per_mm: picked(&self.per_mm), per_rad: picked(&self.per_rad) }
    }
}

/// Measured rows as columns, padded to whole lanes with the last row.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns {
    pub(super) angles: Arc<Angles>,
    /// Cable: length. Position: x, y, z. Pose: x, y, z and the nine entries of the rotation, column-major.
    pub(super) reading: Vec<Vec<f64>>,
    /// The outlet of each row's cable; empty where there is only one.
    pub(super) anchor: Vec<u32>,
    /// Joint rotations by the starting model's effects; absent without effects.
    pub(super) extra: Option<[Vec<f64>; 6]>,
    /// Relative growth of the starting model's links; empty without.
    pub(super) growth: Vec<f64>,
    /// Motion of links by the starting model's effects; absent where none moves any.
    pub(super) moved: Option<MotionColumns>,
    /// For each free effect parameter: rotations, growth and motion of links per unit.
    pub(super) effects: Vec<EffectColumns>,
    /// Index into `effects` of each parameter of x; out of range for parameters of no effect.
    pub(super) effect_at: Vec<usize>,
    /// How far each disturbance goes in each row.
    pub(super) profiles: Vec<Vec<f64>>,
    /// For each disturbance and each of its parameters the shift of the sensor in each row; none for those along an axis.
    pub(super) shifts: Vec<Vec<[Vec<f64>; 3]>>,
    /// Likewise its turns, of disturbances that turn the target of a sensor that reads orientations.
    pub(super) turns: Vec<Vec<[Vec<f64>; 3]>>,
}

impl Columns {
    /// The columns of parameter `k` of x, if it belongs to an effect or a load.
    #[inline(always)]
    pub(super) fn effect_of(&self, k: usize) -> Option<&EffectColumns> {
        self.effect_at.get(k).and_then(|&e| self.effects.get(e))
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct EffectColumns {
    /// Index of the parameter in x.
    pub(super) index: usize,
    pub(super) rotation: [Option<Vec<f64>>; 6],
    pub(super) growth: Option<Vec<f64>>,
    /// The motion of the target's link. That of the links before it differs by what matters in second order.
    pub(super) moved: Option<MotionColumns>,
}

/// Shift (mm), then turn (rad), of the target's link about the base's origin: one column each.
pub(super) type MotionColumns = [Vec<f64>; 6];

impl Columns {
    /// The given rows, padded likewise.
    pub(super) fn subset(&self, rows: &[usize]) -> Self {
        let n = rows.len();
        let padded = n.div_ceil(WIDTH) * WIDTH;
        let row = |i: usize| rows[i.min(n.saturating_sub(1))];
        let picked = |all: &[f64]| -> Vec<f64> {
            if all.is_empty() || n == 0 { Vec::new() } else { (0..padded).map(|i| all[row(i)]).collect() }
        };
        let motion = |all: &MotionColumns| -> MotionColumns { std::array::from_fn(|k| picked(&all[k])) };
        let vectors = |all: &[Vec<[Vec<f64>; 3]>]| -> Vec<Vec<[Vec<f64>; 3]>> {
            let of = |v: &[Vec<f64>; 3]| std::array::from_fn(|k| picked(&v[k]));
            all.iter().map(|parameters| parameters.iter().map(of).collect()).collect()
        };
        if n == 0 {
            return Self::default();
        }
        Self {
            angles: Arc::new(match &*self.angles {
                Angles::SinCos { sin, cos } => Angles::SinCos {
                    sin: std::array::from_fn(|j| picked(&sin[j])),
                    cos: std::array::from_fn(|j| picked(&cos[j])),
                },
                Angles::Raw(angles) => Angles::Raw(std::array::from_fn(|j| picked(&angles[j]))),
            }),
            reading: self.reading.iter().map(|column| picked(column)).collect(),
            anchor: if self.anchor.is_empty() {
                Vec::new()
            } else {
                (0..padded).map(|i| self.anchor[row(i)]).collect()
            },
            extra: self.extra.as_ref().map(|extra| std::array::from_fn(|j| picked(&extra[j]))),
            growth: picked(&self.growth),
            moved: self.moved.as_ref().map(&motion),
            effects: self
                .effects
                .iter()
                .map(|effect| EffectColumns {
                    index: effect.index,
                    rotation: std::array::from_fn(|j| effect.rotation[j].as_deref().map(&picked)),
                    growth: effect.growth.as_deref().map(&picked),
                    moved: effect.moved.as_ref().map(&motion),
                })
                .collect(),
            effect_at: self.effect_at.clone(),
            profiles: self.profiles.iter().map(|profile| picked(profile)).collect(),
            shifts: vectors(&self.shifts),
            turns: vectors(&self.turns),
        }
    }

    /// Columns of a data set, what displaces the sensor evaluated at the frames `at`; `angles` are reused where given.
    pub(super) fn of(
        dataset: &Dataset,
        start: &Model,
        (frames, at): (&Frames, &Frames),
        parameters: &[Parameter],
        angles: Option<&Arc<Angles>>,
    ) -> Self {
        let n = dataset.rows.len();
        let padded = n.div_ceil(WIDTH) * WIDTH;
        let row = |i: usize| &dataset.rows[i.min(n.saturating_sub(1))];
        let column = |value: &(dyn Fn(usize) -> f64 + Sync)| -> Vec<f64> {
            if padded < MANY_ROWS {
                return (0..padded).map(value).collect();
            }
            (0..padded).into_par_iter().map(value).collect()
        };
        if n == 0 {
            return Self::default();
        }
        let mapped = |i: usize, j: usize| start.mapped(&row(i).joints)[j];
        let components = match dataset.sensor {
            Sensor::Cable => 1,
            Sensor::Position => 3,
            Sensor::Pose => 12,
        };
        let reading = (0..components)
            .map(|k| {
                column(&|i| match &row(i).reading {
                    Reading::Cable(length) => *length,
                    Reading::Position(v) => v[k.min(2)],
                    Reading::Pose(pose) if k < 3 => pose.translation.vector[k],
                    Reading::Pose(pose) => pose.rotation.to_rotation_matrix().matrix()[k - 3],
                })
            })
            .collect();
        let angle_columns = || {
            if n < MANY_ANGLES {
                Angles::SinCos {
                    sin: std::array::from_fn(|j| column(&|i| mapped(i, j).sin())),
                    cos: std::array::from_fn(|j| column(&|i| mapped(i, j).cos())),
                }
            } else {
                Angles::Raw(std::array::from_fn(|j| column(&|i| mapped(i, j))))
            }
        };
        let several = dataset.sensor == Sensor::Cable && frames.outlets_mm.len() > 1;
        let mut out = Self {
            angles: angles.cloned().unwrap_or_else(|| Arc::new(angle_columns())),
            reading,
            anchor: if several { (0..padded).map(|i| row(i).anchor as u32).collect() } else { Vec::new() },
            ..Self::default()
        };
        let turned = frames.disturbances.iter().any(|d| d.kind.rotates_joints());
        if !start.effects.is_empty() || turned {
            out.add_effects(dataset, start, parameters, padded);
        }
        out.profiles =
            frames.disturbances.iter().map(|d| column(&|i| d.profile.at(row(i)))).collect::<Vec<_>>();
        if turned {
            out.add_joint_disturbances(dataset, start, frames, parameters, padded);
        }
        let of_sensor = |by: &dyn Fn(EmpiricalFault) -> Vec<Vec<Vector3<f64>>>| {
            let of = |v: &Vec<Vector3<f64>>| std::array::from_fn(|k| column(&|i| v[i.min(n - 1)][k]));
            let all = frames.disturbances.iter().map(|d| match d.kind {
                Kind::Empirical(form) if !form.rotates_joints() => by(form).iter().map(of).collect(),
                _ => Vec::new(),
            });
            all.collect()
        };
        out.shifts = of_sensor(&|form| regressors::sensor_shifts(form, dataset, start, at));
        out.turns = of_sensor(&|form| regressors::sensor_turns(form, dataset, start, at));
        out.effect_at = vec![usize::MAX; parameters.len()];
        for (e, effect) in out.effects.iter().enumerate() {
            out.effect_at[effect.index] = e;
        }
        out
    }

    /// Adds the regressors of disturbances that rotate joints, times their profile.
    fn add_joint_disturbances(
        &mut self,
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        padded: usize,
    ) {
        let last = dataset.rows.len().saturating_sub(1);
        let loaded = LoadedRows::new(dataset, start);
        for (index, disturbance) in frames.disturbances.iter().enumerate() {
            for (parameter, rotation) in joint_rotations(&disturbance.kind, &loaded).into_iter().enumerate() {
                let profile = &self.profiles[index];
                let rotation: [Option<Vec<f64>>; 6] =
                    rotation.map(|r| r.map(|r| (0..padded).map(|i| profile[i] * r[i.min(last)]).collect()));
                if let Some(extra) = &mut self.extra {
                    for (column, rotation) in extra.iter_mut().zip(&rotation) {
                        let Some(rotation) = rotation else { continue };
                        for (e, r) in column.iter_mut().zip(rotation) {
                            *e += disturbance.values[parameter] * r;
                        }
                    }
                }
                let wanted = Parameter::Disturbance { index, parameter };
                if let Some(x_index) = parameters.iter().position(|p| *p == wanted) {
                    self.effects.push(EffectColumns { index: x_index, rotation, ..EffectColumns::default() });
                }
            }
        }
    }

    fn add_effects(&mut self, dataset: &Dataset, start: &Model, parameters: &[Parameter], padded: usize) {
        let n = dataset.rows.len();
        let free: Vec<FreeEffect> = parameters
            .iter()
            .enumerate()
            .filter_map(|(x_index, p)| match *p {
                Parameter::Effect { index, parameter } => Some(FreeEffect { x_index, index, parameter }),
                _ => None,
            })
            .collect();
        let parts: Vec<EffectRows> = (0..n.div_ceil(CHUNK_ROWS))
            .into_par_iter()
            .map(|part| {
                checkpoint();
                let first = part * CHUNK_ROWS;
                EffectRows::of(dataset, first..n.min(first + CHUNK_ROWS), start, &free)
            })
            .collect();
        // Padding repeats the last row, with weight 0 and zero regressors.
        let joined = |of: &dyn Fn(&EffectRows) -> &[f64]| {
            let mut out = Vec::with_capacity(padded);
            parts.iter().for_each(|part| out.extend_from_slice(of(part)));
            out.resize(padded, out.last().copied().unwrap_or(0.0));
            out
        };
        let spread = |of: &dyn Fn(&EffectRows) -> Option<&[f64]>| {
            parts.iter().any(|part| of(part).is_some()).then(|| {
                let mut out = vec![0.0; padded];
                for (chunk, part) in out.chunks_mut(CHUNK_ROWS).zip(&parts) {
                    if let Some(some) = of(part) {
                        chunk[..some.len()].copy_from_slice(some);
                    }
                }
                out
            })
        };
        self.extra = Some(std::array::from_fn(|j| joined(&|part| &part.extra[j])));
        self.growth = joined(&|part| &part.growth);
        let motion = |of: &dyn Fn(&EffectRows) -> Option<&MotionColumns>| -> Option<MotionColumns> {
            of(parts.first()?)?;
            Some(std::array::from_fn(|k| joined(&|part| of(part).map_or(&[], |motion| &motion[k]))))
        };
        self.moved = motion(&|part| part.moved.as_ref());
        self.effects = free
            .iter()
            .enumerate()
            .map(|(k, free)| EffectColumns {
                index: free.x_index,
                rotation: std::array::from_fn(|j| spread(&|part| part.effects[k].rotation[j].as_deref())),
                growth: spread(&|part| part.effects[k].growth.as_deref()),
                moved: motion(&|part| part.effects[k].moved.as_ref()),
            })
            .collect();
    }
}

/// Writes the motion of a row.
fn store(to: &mut MotionColumns, row: usize, motion: &LinkMotion<f64>) {
    let numbers = motion.shift.iter().chain(&motion.turn);
    to.iter_mut().zip(numbers).for_each(|(column, number)| column[row] = *number);
}

/// Rows per parallel chunk.
const CHUNK_ROWS: usize = 128;

/// A free parameter of an effect.
struct FreeEffect {
    /// Index in x.
    x_index: usize,
    /// Effect of the starting model.
    index: usize,
    /// Which of its parameters.
    parameter: usize,
}

/// Joint rotations, growth and regressors of the effects in a chunk of rows.
struct EffectRows {
    extra: [Vec<f64>; 6],
    growth: Vec<f64>,
    /// In every chunk or in none.
    moved: Option<MotionColumns>,
    effects: Vec<EffectColumns>,
}

impl EffectRows {
    fn of(dataset: &Dataset, rows: Range<usize>, start: &Model, free: &[FreeEffect]) -> Self {
        let n = rows.len();
        let still = || -> MotionColumns { std::array::from_fn(|_| vec![0.0; n]) };
        let mut out = Self {
            extra: std::array::from_fn(|_| vec![0.0; n]),
            growth: vec![0.0; n],
            moved: start.effects.iter().any(|effect| effect.first_moved_frame().is_some()).then(still),
            effects: free
                .iter()
                .map(|free| EffectColumns {
                    index: free.x_index,
                    moved: start.effects[free.index].first_moved_frame().map(|_| still()),
                    ..EffectColumns::default()
                })
                .collect(),
        };
        let mut posed = start.at_condition(&Condition::default());
        for (i, row) in rows.map(|row| &dataset.rows[row]).enumerate() {
            if posed.condition != *row.condition {
                posed = start.at_condition(&row.condition);
            }
            let rotation = posed.joint_rotations(&row.joints) - start.mapped(&row.joints).0;
            for j in 0..6 {
                out.extra[j][i] = rotation[j];
            }
            out.growth[i] = start.effects.iter().map(|e| e.growth(&row.condition)).sum();
            if let Some((to, motion)) = out.moved.as_mut().zip(posed.link_motion(&row.joints)) {
                store(to, i, &motion);
            }
            let mut cached = (usize::MAX, Vec::new(), Vec::new(), Vec::new());
            for (columns, free) in out.effects.iter_mut().zip(free) {
                if cached.0 != free.index {
                    let growth = start.effects[free.index].growth_regressors(&row.condition);
                    let moved = posed.link_motion_regressors(free.index, &row.joints);
                    cached = (free.index, posed.effect_regressors(free.index, &row.joints), growth, moved);
                }
                let regressor = cached.1[free.parameter];
                for j in (0..6).filter(|&j| regressor[j] != 0.0) {
                    columns.rotation[j].get_or_insert_with(|| vec![0.0; n])[i] = regressor[j];
                }
                if let Some((to, motion)) = columns.moved.as_mut().zip(cached.3.get(free.parameter)) {
                    store(to, i, motion);
                }
                let row_growth = cached.2.get(free.parameter).copied().unwrap_or(0.0);
                if row_growth != 0.0 {
                    columns.growth.get_or_insert_with(|| vec![0.0; n])[i] = row_growth;
                }
            }
        }
        out
    }
}
