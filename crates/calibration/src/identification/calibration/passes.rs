//! Residuals, Jacobians and normal equations, in blocks that do not depend on the number of threads.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::kernel::{self, Axes, State};
use super::problem::CalibrationProblem;
use crate::measurement::dataset::Sensor;
use truegrind_estimation::problem::{NormalEquations, Prior, Problem};
use truegrind_math::gram::{add_products, add_products_with_last};
use truegrind_math::lanes::{Buffer, WIDTH};
use truegrind_math::work::checkpoint;

/// Groups of eight rows that share one buffer: 512 rows, which with 29 columns stay in the second-level cache.
const BLOCK_LANES: usize = 64;

/// Groups of eight rows per parallel chunk of an expensive pass: few, for load balance.
const COST_LANES: usize = 16;

/// Up to this number of parameters a block of [`BLOCK_LANES`] stays in the cache.
const FEW_PARAMETERS: usize = 64;

/// Bytes of a buffer for more parameters.
const BUFFER_BYTES: usize = 1 << 20;

thread_local! {
    /// Columns of a block of rows, written anew for each: to clear them for every pass would take a tenth of it.
    static COLUMNS: RefCell<Buffer> = RefCell::default();
}

/// Groups of eight rows in a block, for p parameters and c components: a function of the problem alone, so that sums are the
/// same for any number of threads.
fn block_lanes(p: usize, c: usize) -> usize {
    if p <= FEW_PARAMETERS {
        BLOCK_LANES
    } else {
        (BUFFER_BYTES / ((p + 1) * c * WIDTH * 8)).clamp(4, BLOCK_LANES)
    }
}

impl CalibrationProblem {
    /// Residuals at `x` without weights: mm for a cable (model minus reading) and for the three coordinates of a
    /// position (reading minus model, in the base), then rad for the orientation of a pose. One entry per scalar row.
    pub fn unweighted_residuals(&self, x: &[f64]) -> Vec<f64> {
        let per = self.rows_per_observation();
        let state = State::of(self, x);
        let mut out = vec![0.0; self.rows()];
        let chunk = COST_LANES * WIDTH;
        out.par_chunks_mut(chunk * per).enumerate().for_each(|(k, out)| {
            checkpoint();
            let first = k * chunk;
            self.scatter(&state, first..first + out.len() / per, Some(out), None);
            for (i, r) in out.iter_mut().enumerate() {
                let (row, component) = (first + i / per, i % per);
                let weight = if component < 3 { &self.weights.per_mm } else { &self.weights.per_rad }[row];
                *r /= weight;
            }
        });
        out
    }

    /// Residuals at `x`, n, and the Jacobian transposed, p × n, rows in the order of the trait.
    ///
    /// # Panics
    /// Where no parameter is free.
    pub fn linearise(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let state = State::of(self, x);
        let (p, n, per) = (self.parameters.len(), self.rows(), self.sensor.scalars());
        assert!(p > 0, "a problem without parameters has no Jacobian");
        let chunk = COST_LANES * WIDTH;
        let (mut residuals, mut transposed) = (DVector::zeros(n), DMatrix::zeros(p, n));
        residuals
            .as_mut_slice()
            .par_chunks_mut(chunk * per)
            .zip(transposed.as_mut_slice().par_chunks_mut(chunk * per * p))
            .enumerate()
            .for_each(|(k, (residuals, transposed))| {
                checkpoint();
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
        let plain = self.unweighted_residuals(x);
        match self.sensor {
            Sensor::Cable => plain,
            Sensor::Position => plain.chunks(3).map(|v| Vector3::from_column_slice(v).norm()).collect(),
            Sensor::Pose => plain.chunks(6).map(|v| Vector3::from_column_slice(&v[..3]).norm()).collect(),
        }
    }

    /// Fills columns of residuals (last) and Jacobian for `lanes` groups of eight rows from group `from`:
    /// `out[(k · components + c) · (8 · lanes) + i]`, k = p for the residual.
    fn fill(&self, state: &State, from: usize, lanes: usize, jacobian: Option<Axes>, out: &mut [f64]) {
        kernel::fill(self, state, from, lanes, jacobian, out);
    }
}

impl Problem for CalibrationProblem {
    fn parameters(&self) -> usize {
        self.parameters.len()
    }

    fn rows(&self) -> usize {
        self.rows * self.sensor.scalars()
    }

    fn rows_per_observation(&self) -> usize {
        self.sensor.scalars()
    }

    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        let c = self.sensor.scalars();
        let state = State::of(self, x);
        self.scatter(&state, rows.start / c..rows.end / c, Some(out), None);
    }

    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        let c = self.sensor.scalars();
        let state = State::of(self, x);
        self.scatter(&state, rows.start / c..rows.end / c, Some(residuals), Some(jacobian));
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn subsample(&self, observations: &[usize]) -> Option<Box<dyn Problem + '_>> {
        Some(Box::new(Self {
            start: self.start.clone(),
            frames: self.frames.clone(),
            sensor: self.sensor,
            parameters: self.parameters.clone(),
            priors: self.priors.clone(),
            columns: Arc::new(self.columns.subset(observations)),
            weights: self.weights.subset(observations),
            rows: observations.len(),
        }))
    }

    fn row_cost(&self, x: &[f64]) -> f64 {
        let state = State::of(self, x);
        let c = self.sensor.scalars();
        let parts: Vec<f64> = self
            .blocks_of(if self.parameters.len() > FEW_PARAMETERS { COST_LANES } else { BLOCK_LANES })
            .into_par_iter()
            .map(|(from, lanes)| {
                checkpoint();
                let mut out = vec![0.0; c * lanes * WIDTH];
                self.fill(&state, from, lanes, None, &mut out);
                0.5 * out.iter().map(|r| r * r).sum::<f64>()
            })
            .collect();
        parts.iter().sum()
    }

    /// JᵀJ is that of the residuals as the sensor sees them (`kernel::Axes::Sensor`).
    fn normal_equations(&self, x: &[f64]) -> NormalEquations {
        let p = self.parameters.len();
        // [J r]ᵀ[J r], the residual in the last column.
        let square = self.products(x, (p + 1, p + 1), add_products);
        let mut out = NormalEquations {
            matrix: square.view((0, 0), (p, p)).into_owned(),
            gradient: DVector::from_iterator(p, square.row(p).iter().take(p).copied()),
            cost: 0.5 * square[(p, p)],
        };
        out.symmetrize();
        out
    }

    fn gradient(&self, x: &[f64]) -> (f64, DVector<f64>) {
        let p = self.parameters.len();
        let row = self.products(x, (p + 1, 1), add_products_with_last);
        (0.5 * row[p], DVector::from_column_slice(&row.as_slice()[..p]))
    }
}

impl CalibrationProblem {
    /// Sums, over blocks of rows, of products of the columns of [J r], which `add` adds to a matrix of the given shape.
    fn products(
        &self,
        x: &[f64],
        shape: (usize, usize),
        add: impl Fn(&[f64], usize, &mut [f64]) + Sync,
    ) -> DMatrix<f64> {
        let state = State::of(self, x);
        let (p, c) = (self.parameters.len(), self.sensor.scalars());
        let most = block_lanes(p, c);
        let blocks = self.blocks_of(most);
        // With many parameters a square matrix per block would cost more than its products, so several blocks share one.
        let together = if p > FEW_PARAMETERS { (2 * p).div_ceil(most * WIDTH * c) } else { 1 };
        let part = |blocks: &[(usize, usize)]| {
            checkpoint();
            let mut sums = DMatrix::zeros(shape.0, shape.1);
            COLUMNS.with_borrow_mut(|buffer| {
                for &(from, lanes) in blocks {
                    let rows = c * lanes * WIDTH;
                    let columns = buffer.first_mut((p + 1) * rows);
                    self.fill(&state, from, lanes, Some(Axes::Sensor), columns);
                    add(columns, rows, sums.as_mut_slice());
                }
            });
            sums
        };
        let parts: Vec<DMatrix<f64>> = blocks.par_chunks(together).map(part).collect();
        let total = parts.into_iter().reduce(|sum, part| sum + part);
        total.unwrap_or_else(|| DMatrix::zeros(shape.0, shape.1))
    }
}

impl CalibrationProblem {
    /// First group of eight rows and number of groups of each block of at most `lanes` groups.
    fn blocks_of(&self, lanes: usize) -> Vec<(usize, usize)> {
        let groups = self.rows.div_ceil(WIDTH);
        (0..groups).step_by(lanes).map(|from| (from, lanes.min(groups - from))).collect()
    }

    /// Writes rows in the trait's order: observation by observation, components innermost.
    fn scatter(
        &self,
        state: &State,
        observations: Range<usize>,
        residuals: Option<&mut [f64]>,
        jacobian: Option<&mut [f64]>,
    ) {
        let (p, c) = (self.parameters.len(), self.sensor.scalars());
        let (first, last) = (observations.start / WIDTH, observations.end.div_ceil(WIDTH));
        let total = observations.len() * c;
        let axes = jacobian.is_some().then_some(Axes::Base);
        let mut places: Vec<&mut [f64]> = Vec::new();
        if let Some(jacobian) = jacobian {
            places.extend(jacobian.chunks_mut(total.max(1)).take(p));
        }
        if let Some(residuals) = residuals {
            places.push(residuals);
        }
        let columns = if axes.is_some() { p + 1 } else { 1 };
        let mut buffer = vec![0.0; columns * c * BLOCK_LANES.min(last - first) * WIDTH];
        for from in (first..last).step_by(BLOCK_LANES) {
            let lanes = BLOCK_LANES.min(last - from);
            let rows = lanes * WIDTH;
            self.fill(state, from, lanes, axes, &mut buffer[..columns * c * rows]);
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
