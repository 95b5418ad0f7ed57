//! Calibration as a fitting task: link, effect and frame parameters against cable lengths, positions or poses.
//!
//! Residuals (whitened by the row's weight w = 1/σ), with p the touched point in the base, C the sensor's frame in
//! the base, m the reading:
//!
//! - cable: w (‖p − outlet‖ + zero − L), with the Jacobian row uᵀ·∂p, u the unit cable direction. ltlm-2024 eq. 10 and
//!   13 need this chain-rule step and print only the 3 × 24 Jacobian of position (eq. 7);
//! - position: w (C m − p), three rows;
//! - pose: the same, and three rows of ½ vee(E − Eᵀ), E = R_C R_m (R R_t)ᵀ, which is the rotation vector up to third
//!   order of the remaining angle, with a weight of its own.
//!
//! Shapes: x holds deviations from the starting values of [`Calibration::parameters`], so that the nominal arm is
//! x = 0 and every prior has mean 0. Rows travel eight at a time in lanes; sines and cosines of the logged joints are
//! taken once. One pass over n rows with 28 parameters costs some 1,200 n operations and reads 13 numbers a row.
//! Checked against: numerical twins of every column in the tests.

mod kernel;

use std::ops::Range;

use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::{NormalEquations, Prior, Problem};
use truegrind_math::lanes::WIDTH;
use truegrind_math::se3::{Pose, moved};

/// How the sensor stands to the arm: what a calibration must find beside the arm itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// The sensor's frame in the arm's base (position and pose sensors).
    pub base_from_sensor: Pose,
    /// What the sensor touches, on the flange: hook, reflector or target. It is not the TCP.
    pub flange_from_target: Pose,
    /// Outlet of each cable in the base (mm).
    pub outlets_mm: Vec<Vector3<f64>>,
    /// What must be added to each cable's free length to give its reading (mm).
    pub zeros_mm: Vec<f64>,
    /// What disturbed the measurement; empty for an undisturbed one.
    pub disturbances: Vec<Disturbance>,
}

impl Frames {
    /// Everything at the origin, for `anchors` cables.
    pub fn at_origin(anchors: usize) -> Self {
        Self {
            base_from_sensor: Pose::identity(),
            flange_from_target: Pose::identity(),
            outlets_mm: vec![Vector3::zeros(); anchors],
            zeros_mm: vec![0.0; anchors],
            disturbances: Vec::new(),
        }
    }
}

/// Weights of one row: 1/σ of a length [1/mm] and of an angle [1/rad]. Weight 0 sets a row aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// For cable lengths and positions.
    pub per_mm: f64,
    /// For orientations; used by full poses alone.
    pub per_rad: f64,
}

/// A calibration task. See the module page.
#[derive(Debug, Clone)]
pub struct Calibration {
    start: Model,
    frames: Frames,
    sensor: Sensor,
    parameters: Vec<Parameter>,
    priors: Vec<Prior>,
    columns: Columns,
    rows: usize,
}

/// Measured rows by columns, padded to whole lanes with rows of weight 0.
#[derive(Debug, Clone, Default)]
struct Columns {
    sin: [Vec<f64>; 6],
    cos: [Vec<f64>; 6],
    /// Cable: length. Position: x, y, z. Pose: x, y, z and the nine entries of the rotation, column-major.
    reading: Vec<Vec<f64>>,
    per_mm: Vec<f64>,
    per_rad: Vec<f64>,
    anchor: Vec<usize>,
    /// Joint rotations that the starting model's effects add; empty without effects.
    extra: Option<[Vec<f64>; 6]>,
    /// Relative growth of the starting model's links; empty without.
    growth: Vec<f64>,
    /// For each free effect parameter: rotations and growth per unit.
    effects: Vec<EffectColumns>,
    /// Where in `effects` each parameter of x is; out of range for those that are no effect's.
    effect_at: Vec<usize>,
    /// How far each disturbance goes in each row.
    courses: Vec<Vec<f64>>,
}

impl Columns {
    /// The columns of the parameter at place `k` of x, where it is an effect's or a load's.
    #[inline(always)]
    fn effect_of(&self, k: usize) -> Option<&EffectColumns> {
        self.effect_at.get(k).and_then(|&e| self.effects.get(e))
    }
}

#[derive(Debug, Clone, Default)]
struct EffectColumns {
    /// Position of the parameter in x.
    place: usize,
    rotation: [Option<Vec<f64>>; 6],
    growth: Option<Vec<f64>>,
}

impl Calibration {
    /// Sets up the task.
    ///
    /// `start` and `frames` are the starting values, `parameters` what may move, `priors` one for each parameter
    /// (mean in deviations from the start) or empty, `weights` one for each row of `dataset`.
    pub fn new(
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        priors: &[Prior],
        weights: &[Weight],
    ) -> Self {
        let columns = Columns::of(dataset, start, frames, parameters, weights);
        Self {
            start: start.clone(),
            frames: frames.clone(),
            sensor: dataset.sensor,
            parameters: parameters.to_vec(),
            priors: priors.to_vec(),
            columns,
            rows: dataset.rows.len(),
        }
    }

    /// The same task with other weights, one for each row.
    pub fn reweighted(&self, weights: &[Weight]) -> Self {
        self.clone().weighted(weights)
    }

    /// This task itself with other weights, one for each row.
    pub fn weighted(mut self, weights: &[Weight]) -> Self {
        for (i, w) in weights.iter().enumerate().take(self.rows) {
            self.columns.per_mm[i] = w.per_mm;
            self.columns.per_rad[i] = w.per_rad;
        }
        self
    }

    /// Weight of a row.
    ///
    /// # Panics
    /// Beyond the last row.
    pub fn weight(&self, row: usize) -> Weight {
        Weight { per_mm: self.columns.per_mm[row], per_rad: self.columns.per_rad[row] }
    }

    /// What may move, in the order of x.
    pub fn parameters_list(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The starting model.
    pub fn start(&self) -> &Model {
        &self.start
    }

    /// The starting frames.
    pub fn starting_frames(&self) -> &Frames {
        &self.frames
    }

    /// The model and the frames that `x` stands for.
    pub fn apply(&self, x: &[f64]) -> (Model, Frames) {
        let (mut model, mut frames) = (self.start.clone(), self.frames.clone());
        let (mut sensor, mut tool) = (nalgebra::Vector6::zeros(), nalgebra::Vector6::zeros());
        for (parameter, &value) in self.parameters.iter().zip(x) {
            match *parameter {
                Parameter::Base(k) => sensor[k] += value,
                Parameter::Tool(k) => tool[k] += value,
                Parameter::Link { joint, coordinate } => {
                    let link = &mut model.links[joint];
                    link.set(coordinate, link.get(coordinate) + value);
                }
                Parameter::Effect { index, parameter } => {
                    let before = model.effects[index].parameters()[parameter].value;
                    model.effects[index].set(parameter, before + value);
                }
                Parameter::Outlet { anchor, axis } => frames.outlets_mm[anchor][axis] += value,
                Parameter::Zero { anchor } => frames.zeros_mm[anchor] += value,
                Parameter::Disturbance { index, parameter } => {
                    frames.disturbances[index].values[parameter] += value;
                }
            }
        }
        frames.base_from_sensor = moved(&frames.base_from_sensor, &sensor);
        frames.flange_from_target = moved(&frames.flange_from_target, &tool);
        (model, frames)
    }

    /// Residuals at `x` without weights: mm for a cable (model minus reading) and for the three coordinates of a
    /// position (reading minus model, in the base), then rad for the orientation of a pose. One entry per scalar row.
    pub fn plain_residuals(&self, x: &[f64]) -> Vec<f64> {
        let per = self.rows_per_observation();
        let state = kernel::State::of(self, x);
        let mut out = vec![0.0; self.rows()];
        let chunk = COST_LANES * WIDTH;
        out.par_chunks_mut(chunk * per).enumerate().for_each(|(k, out)| {
            let first = k * chunk;
            self.scatter(&state, first..first + out.len() / per, Some(out), None);
            for (i, r) in out.iter_mut().enumerate() {
                let (row, component) = (first + i / per, i % per);
                let weight = if component < 3 { &self.columns.per_mm } else { &self.columns.per_rad }[row];
                *r /= weight;
            }
        });
        out
    }

    /// Residuals at `x`, n, and the Jacobian transposed, p × n, rows in the order of the trait.
    ///
    /// # Panics
    /// Where nothing may move.
    pub fn linearised(&self, x: &[f64]) -> (DVector<f64>, nalgebra::DMatrix<f64>) {
        let state = kernel::State::of(self, x);
        let (p, n, per) = (self.parameters.len(), self.rows(), self.components());
        assert!(p > 0, "a task without parameters has no Jacobian");
        let chunk = COST_LANES * WIDTH;
        let (mut residuals, mut transposed) = (DVector::zeros(n), nalgebra::DMatrix::zeros(p, n));
        residuals
            .as_mut_slice()
            .par_chunks_mut(chunk * per)
            .zip(transposed.as_mut_slice().par_chunks_mut(chunk * per * p))
            .enumerate()
            .for_each(|(k, (residuals, transposed))| {
                let (first, rows) = (k * chunk, residuals.len());
                let mut jacobian = vec![0.0; rows * p];
                self.scatter(&state, first..first + rows / per, Some(residuals), Some(&mut jacobian));
                for (i, row) in transposed.chunks_exact_mut(p).enumerate() {
                    row.iter_mut().enumerate().for_each(|(k, v)| *v = jacobian[k * rows + i]);
                }
            });
        (residuals, transposed)
    }

    /// The size of each row's position error at `x` (mm): signed for a cable, the norm otherwise.
    pub fn errors_mm(&self, x: &[f64]) -> Vec<f64> {
        let plain = self.plain_residuals(x);
        match self.sensor {
            Sensor::Cable => plain,
            Sensor::Position => plain.chunks(3).map(|v| Vector3::from_column_slice(v).norm()).collect(),
            Sensor::Pose => plain.chunks(6).map(|v| Vector3::from_column_slice(&v[..3]).norm()).collect(),
        }
    }

    /// Fills columns of residuals (last) and Jacobian for `lanes` groups of eight rows from group `from`:
    /// `out[(k · components + c) · (8 · lanes) + i]`, k = p for the residual.
    fn fill(&self, state: &kernel::State, from: usize, lanes: usize, jacobian: bool, out: &mut [f64]) {
        kernel::fill(self, state, from, lanes, jacobian, out);
    }

    fn components(&self) -> usize {
        match self.sensor {
            Sensor::Cable => 1,
            Sensor::Position => 3,
            Sensor::Pose => 6,
        }
    }
}

/// Groups of eight rows that share one buffer: 512 rows, which with 29 columns stay in the second-level cache.
const BLOCK_LANES: usize = 64;

/// Groups of eight rows that one thread passes over where the pass costs much: few, so that threads end together.
const COST_LANES: usize = 16;

/// Rows from which their columns are made on all threads; fewer are not worth the call.
const MANY_ROWS: usize = 8192;

/// Parameters with which such a buffer stays there.
const FEW: usize = 64;

/// Bytes of a buffer for more of them.
const BUFFER_BYTES: usize = 1 << 20;

/// Groups of eight rows in a block, for p parameters and c components: a function of the task alone, so that sums are the
/// same for any number of threads.
fn block_lanes(p: usize, c: usize) -> usize {
    if p <= FEW { BLOCK_LANES } else { (BUFFER_BYTES / ((p + 1) * c * WIDTH * 8)).clamp(4, BLOCK_LANES) }
}

impl Problem for Calibration {
    fn parameters(&self) -> usize {
        self.parameters.len()
    }

    fn rows(&self) -> usize {
        self.rows * self.components()
    }

    fn rows_per_observation(&self) -> usize {
        self.components()
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        let c = self.components();
        let state = kernel::State::of(self, x);
        self.scatter(&state, rows.start / c..rows.end / c, Some(out), None);
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        let c = self.components();
        let state = kernel::State::of(self, x);
        self.scatter(&state, rows.start / c..rows.end / c, Some(residuals), Some(jacobian));
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn thinned(&self, observations: &[usize]) -> Option<Box<dyn Problem + '_>> {
        Some(Box::new(Self {
            start: self.start.clone(),
            frames: self.frames.clone(),
            sensor: self.sensor,
            parameters: self.parameters.clone(),
            priors: self.priors.clone(),
            columns: self.columns.subset(observations),
            rows: observations.len(),
        }))
    }

    fn row_cost(&self, x: &[f64]) -> f64 {
        let state = kernel::State::of(self, x);
        let c = self.components();
        let parts: Vec<f64> = self
            .blocks_of(if self.parameters.len() > FEW { COST_LANES } else { BLOCK_LANES })
            .into_par_iter()
            .map(|(from, lanes)| {
                let mut out = vec![0.0; c * lanes * WIDTH];
                self.fill(&state, from, lanes, false, &mut out);
                0.5 * out.iter().map(|r| r * r).sum::<f64>()
            })
            .collect();
        parts.iter().sum()
    }

    fn normal_equations(&self, x: &[f64]) -> NormalEquations {
        let state = kernel::State::of(self, x);
        let (p, c) = (self.parameters.len(), self.components());
        let most = block_lanes(p, c);
        let blocks = self.blocks_of(most);
        // A square of its own for each block would cost more than its products where parameters are many.
        let together = if p > FEW { (2 * p).div_ceil(most * WIDTH * c) } else { 1 };
        let parts: Vec<nalgebra::DMatrix<f64>> = blocks
            .par_chunks(together)
            .map_init(
                || vec![0.0; (p + 1) * c * most * WIDTH],
                |buffer, blocks| {
                    let mut square = nalgebra::DMatrix::zeros(p + 1, p + 1);
                    for &(from, lanes) in blocks {
                        let rows = c * lanes * WIDTH;
                        let columns = &mut buffer[..(p + 1) * rows];
                        self.fill(&state, from, lanes, true, columns);
                        add_gram(columns, rows, &mut square);
                    }
                    square
                },
            )
            .collect();
        let total = parts.into_iter().reduce(|sum, part| sum + part);
        let square = total.unwrap_or_else(|| nalgebra::DMatrix::zeros(p + 1, p + 1));
        let mut out = NormalEquations {
            matrix: square.view((0, 0), (p, p)).into_owned(),
            gradient: DVector::from_iterator(p, square.row(p).iter().take(p).copied()),
            cost: 0.5 * square[(p, p)],
        };
        out.mirror();
        out
    }
}

/// Adds [J r]ᵀ[J r] of columns of `rows` entries, the residual in the last, to the lower triangle of `square`.
fn add_gram(columns: &[f64], rows: usize, square: &mut nalgebra::DMatrix<f64>) {
    let size = square.nrows();
    let a = MatRef::from_column_major_slice(columns, rows, size);
    let out = MatMut::from_column_major_slice_mut(square.as_mut_slice(), size, size);
    let (full, lower) = (BlockStructure::Rectangular, BlockStructure::TriangularLower);
    triangular::matmul(out, lower, Accum::Add, a.transpose(), full, a, full, 1.0, Par::Seq);
}

impl Calibration {
    /// First group of eight rows and number of groups of each block of at most `lanes` groups.
    fn blocks_of(&self, lanes: usize) -> Vec<(usize, usize)> {
        let groups = self.rows.div_ceil(WIDTH);
        (0..groups).step_by(lanes).map(|from| (from, lanes.min(groups - from))).collect()
    }

    /// Writes rows in the order of the trait: observation by observation, components inside.
    fn scatter(
        &self,
        state: &kernel::State,
        observations: Range<usize>,
        residuals: Option<&mut [f64]>,
        jacobian: Option<&mut [f64]>,
    ) {
        let (p, c) = (self.parameters.len(), self.components());
        let (first, last) = (observations.start / WIDTH, observations.end.div_ceil(WIDTH));
        let total = observations.len() * c;
        let with_jacobian = jacobian.is_some();
        let mut places: Vec<&mut [f64]> = Vec::new();
        if let Some(jacobian) = jacobian {
            places.extend(jacobian.chunks_mut(total.max(1)).take(p));
        }
        if let Some(residuals) = residuals {
            places.push(residuals);
        }
        let columns = if with_jacobian { p + 1 } else { 1 };
        let mut buffer = vec![0.0; columns * c * BLOCK_LANES.min(last - first) * WIDTH];
        for from in (first..last).step_by(BLOCK_LANES) {
            let lanes = BLOCK_LANES.min(last - from);
            let rows = lanes * WIDTH;
            self.fill(state, from, lanes, with_jacobian, &mut buffer[..columns * c * rows]);
            let (begin, end) =
                (observations.start.max(from * WIDTH), observations.end.min(from * WIDTH + rows));
            for (k, place) in places.iter_mut().enumerate() {
                for component in 0..c {
                    let column = &buffer[(k * c + component) * rows..][..rows];
                    for row in begin..end {
                        place[(row - observations.start) * c + component] = column[row - from * WIDTH];
                    }
                }
            }
        }
    }
}

impl Columns {
    /// The rows at `rows`, padded as all are.
    fn subset(&self, rows: &[usize]) -> Self {
        let n = rows.len();
        let padded = n.div_ceil(WIDTH) * WIDTH;
        let row = |i: usize| rows[i.min(n.saturating_sub(1))];
        let picked = |all: &[f64]| -> Vec<f64> {
            if all.is_empty() || n == 0 { Vec::new() } else { (0..padded).map(|i| all[row(i)]).collect() }
        };
        let weights = |all: &[f64]| -> Vec<f64> {
            (0..padded).map(|i| if i < n { all[row(i)] } else { 0.0 }).collect()
        };
        if n == 0 {
            return Self::default();
        }
        Self {
            sin: std::array::from_fn(|j| picked(&self.sin[j])),
            cos: std::array::from_fn(|j| picked(&self.cos[j])),
            reading: self.reading.iter().map(|column| picked(column)).collect(),
            per_mm: weights(&self.per_mm),
            per_rad: weights(&self.per_rad),
            anchor: (0..padded).map(|i| self.anchor[row(i)]).collect(),
            extra: self.extra.as_ref().map(|extra| std::array::from_fn(|j| picked(&extra[j]))),
            growth: picked(&self.growth),
            effects: self
                .effects
                .iter()
                .map(|effect| EffectColumns {
                    place: effect.place,
                    rotation: std::array::from_fn(|j| effect.rotation[j].as_deref().map(&picked)),
                    growth: effect.growth.as_deref().map(&picked),
                })
                .collect(),
            effect_at: self.effect_at.clone(),
            courses: self.courses.iter().map(|course| picked(course)).collect(),
        }
    }

    fn of(
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        weights: &[Weight],
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
        let mapped: Vec<_> = (0..padded).map(|i| start.joint_map * row(i).joints).collect();
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
        let weight = |i: usize| (i < n).then(|| weights[i]);
        let mut out = Self {
            sin: std::array::from_fn(|j| column(&|i| mapped[i][j].sin())),
            cos: std::array::from_fn(|j| column(&|i| mapped[i][j].cos())),
            reading,
            per_mm: column(&|i| weight(i).map_or(0.0, |w| w.per_mm)),
            per_rad: column(&|i| weight(i).map_or(0.0, |w| w.per_rad)),
            anchor: (0..padded).map(|i| row(i).anchor).collect(),
            ..Self::default()
        };
        let loads = frames.disturbances.iter().any(|d| matches!(d.kind, Kind::Load { .. }));
        if !start.effects.is_empty() || loads {
            out.add_effects(dataset, start, parameters, padded);
        }
        out.courses =
            frames.disturbances.iter().map(|d| column(&|i| d.course.at(row(i)))).collect::<Vec<_>>();
        if loads {
            out.add_loads(dataset, start, frames, parameters, padded);
        }
        out.effect_at = vec![usize::MAX; parameters.len()];
        for (e, effect) in out.effects.iter().enumerate() {
            out.effect_at[effect.place] = e;
        }
        out
    }

    /// Loads that the log does not tell of bend the joints like an effect, in the rows of their course.
    fn add_loads(
        &mut self,
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        padded: usize,
    ) {
        let torques = flange_torques(dataset, start);
        for (index, disturbance) in frames.disturbances.iter().enumerate() {
            let Kind::Load { joints, compliance } = &disturbance.kind else { continue };
            let course = self.courses[index].clone();
            let along = |k: usize, parameter: usize| match compliance {
                Some(compliance) => compliance[k],
                None => f64::from(u8::from(k == parameter)),
            };
            for parameter in 0..disturbance.values.len() {
                let rotation: [Option<Vec<f64>>; 6] = std::array::from_fn(|joint| {
                    let k = joints.iter().position(|&j| j == joint)?;
                    let factor = along(k, parameter);
                    (factor != 0.0).then(|| {
                        (0..padded)
                            .map(|i| {
                                factor * course[i] * torques[i.min(torques.len().saturating_sub(1))][joint]
                            })
                            .collect()
                    })
                });
                if let Some(extra) = &mut self.extra {
                    for (column, rotation) in extra.iter_mut().zip(&rotation) {
                        let Some(rotation) = rotation else { continue };
                        for (e, r) in column.iter_mut().zip(rotation) {
                            *e += disturbance.values[parameter] * r;
                        }
                    }
                }
                let here = Parameter::Disturbance { index, parameter };
                if let Some(place) = parameters.iter().position(|p| *p == here) {
                    self.effects.push(EffectColumns { place, rotation, growth: None });
                }
            }
        }
    }

    fn add_effects(&mut self, dataset: &Dataset, start: &Model, parameters: &[Parameter], padded: usize) {
        let n = dataset.rows.len();
        let mut extra: [Vec<f64>; 6] = std::array::from_fn(|_| vec![0.0; padded]);
        let mut growth = vec![0.0; padded];
        let free: Vec<(usize, usize, usize)> = parameters
            .iter()
            .enumerate()
            .filter_map(|(place, p)| match *p {
                Parameter::Effect { index, parameter } => Some((place, index, parameter)),
                _ => None,
            })
            .collect();
        let mut effects: Vec<EffectColumns> =
            free.iter().map(|&(place, ..)| EffectColumns { place, ..EffectColumns::default() }).collect();
        let still = Condition::default();
        let mut posed = start.under(&still);
        for (i, row) in dataset.rows.iter().enumerate() {
            if posed.condition != row.condition {
                posed = start.under(&row.condition);
            }
            let rotation = posed.rotations(&row.joints) - start.joint_map * row.joints;
            for j in 0..6 {
                extra[j][i] = rotation[j];
            }
            growth[i] = start.effects.iter().map(|e| e.growth(&row.condition)).sum();
            let mut at = (usize::MAX, Vec::new(), Vec::new());
            for (columns, &(_, index, parameter)) in effects.iter_mut().zip(&free) {
                if at.0 != index {
                    let growth = start.effects[index].growth_regressors(&row.condition);
                    at = (index, posed.effect_regressors(index, &row.joints), growth);
                }
                let regressor = at.1[parameter];
                for j in (0..6).filter(|&j| regressor[j] != 0.0) {
                    columns.rotation[j].get_or_insert_with(|| vec![0.0; padded])[i] = regressor[j];
                }
                let grown = at.2.get(parameter).copied().unwrap_or(0.0);
                if grown != 0.0 {
                    columns.growth.get_or_insert_with(|| vec![0.0; padded])[i] = grown;
                }
            }
        }
        // Padding repeats the last row, with weight 0.
        for i in n..padded {
            for column in &mut extra {
                column[i] = column[n - 1];
            }
            growth[i] = growth[n - 1];
        }
        self.extra = Some(extra);
        self.growth = growth;
        self.effects = effects;
    }
}

/// Torque about each joint of 1 kg at the flange, for every row (N m).
pub fn flange_torques(dataset: &Dataset, model: &Model) -> Vec<Joints> {
    let bare = Model { bodies: None, effects: Vec::new(), ..model.clone() };
    let statics = bare.statics();
    let kilogram = Condition { payload_kg: Some(1.0), ..Condition::default() };
    dataset.rows.iter().map(|r| statics.torques(&(model.joint_map * r.joints), &kilogram).0).collect()
}
