//! A fit linearised and whitened: the effect of a candidate with everything else as nuisance parameters projected off.
//!
//! With J the whitened Jacobian of the n scalar rows by the p free parameters and Λ their prior precisions,
//! JᵀJ + Λ = L Lᵀ and Q = J L⁻ᵀ. A candidate with columns C (n × k) has, with everything else refitted to first order, the
//! gradient g = Cᵀr and the information S = CᵀC − (QᵀC)ᵀ(QᵀC), with r the residual at the optimum. A model without some
//! parameters follows from the same J: their columns are removed, their J x is added back to r, and the rest is solved again,
//! r ← r − Q L⁻¹(Jᵀr + Λx).
//!
//! Source: the score test with nuisance parameters, Rao 1948; the projection is that of Frisch and Waugh.

use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::algebra::{
    back_and_forth, finite, gram, lower_factor, outer, product, product_of_transposed, solved,
};
use super::extension::{Extended, Subject, with_robust_weights};
use super::serial_correlation::prewhiten_transposed;
use crate::identification::calibration::CalibrationProblem;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::repeated_poses::pose_of_rows;
use crate::measurement::sensor::disturbance::sag_mm;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_estimation::problem::Problem;
use truegrind_math::axpy::{Entry, add_sparse_product};
use truegrind_math::work::checkpoint;

/// Derivatives of the whitened residual from which the columns of candidates are built, n each.
#[derive(Debug, Clone)]
pub struct Slopes {
    /// By the rotation of each joint.
    pub by_joint: Vec<DVector<f64>>,
    /// By a common relative growth of all lengths.
    pub by_growth: DVector<f64>,
    /// By a relative growth of each link's lengths.
    pub by_link_growth: [DVector<f64>; 6],
    /// By the target on the flange, n × 3.
    pub by_target: DMatrix<f64>,
    /// By the sensor's frame or the outlet, n × 6 or n × 3.
    pub by_frame: DMatrix<f64>,
    /// By a cable's zero; zeros for other sensors.
    pub by_zero: DVector<f64>,
    /// By the sensor's scale.
    pub by_scale: DVector<f64>,
    /// By a cable's squared weight over tension; zeros for other sensors.
    pub by_sag: DVector<f64>,
    /// Length of a whitened residual of 1 (mm); 0 for orientations.
    pub mm: Vec<f64>,
    /// Pose index of each observation: readings of one pose share its model error.
    pub poses: Vec<usize>,
}

/// A linearised model with everything free projected off; see the module documentation. Scalar rows are ordered by observation.
#[derive(Debug, Clone)]
pub struct Design {
    /// Observations.
    pub observations: usize,
    /// Scalar rows of an observation.
    pub per: usize,
    /// Residuals at the optimum of what is free, n.
    pub residual: DVector<f64>,
    /// Q transposed, p × n.
    pub basis: Arc<DMatrix<f64>>,
    /// Directions removed from the basis.
    pub reduction: Option<Reduction>,
    /// Derivatives for the columns of candidates.
    pub slopes: Arc<Slopes>,
}

/// Directions of a basis that are no longer free.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// U, orthonormal, p × d.
    directions: DMatrix<f64>,
    /// (Q U)ᵀ, d × n, computed on demand.
    removed: OnceLock<DMatrix<f64>>,
    /// Change of the residual along each.
    moved: DVector<f64>,
}

/// A linearised fit, from which the design of any smaller model follows without a refit.
#[derive(Debug, Clone)]
pub struct Linear {
    pub(super) observations: usize,
    pub(super) per: usize,
    /// Mean effective weight of a row.
    pub(super) effective_share: f64,
    /// Jᵀ, p × n.
    pub(super) rows: DMatrix<f64>,
    /// JᵀJ + Λ, computed on demand.
    normal: OnceLock<DMatrix<f64>>,
    /// r, n.
    pub(super) residual: DVector<f64>,
    /// Jᵀr + Λx.
    pub(super) gradient: DVector<f64>,
    pub(super) x: Vec<f64>,
    pub(super) precision: Vec<f64>,
    pub(super) slopes: Arc<Slopes>,
}

/// A design with all parameters free, and the factors for reducing it.
#[derive(Debug, Clone)]
pub struct FullDesign {
    /// All parameters free.
    pub design: Design,
    /// L.
    lower: DMatrix<f64>,
    /// The estimate after one Gauss–Newton step.
    x: DVector<f64>,
}

/// The columns of a candidate projected on a design.
#[derive(Debug, Clone)]
pub struct Projected {
    /// Gradient, k.
    pub gradient: DVector<f64>,
    /// Information with everything else refitted, k × k.
    pub information: DMatrix<f64>,
    /// QᵀC, p × k.
    pub shared: DMatrix<f64>,
    /// The part of that along removed directions, d × k.
    pub given_back: Option<DMatrix<f64>>,
}

/// Lengths and rotations of the joints, the target, and the sensor's frame; with the index of the first of the last.
fn probes(dataset: &Dataset) -> (Vec<Parameter>, usize) {
    let mut probes: Vec<Parameter> = Vec::new();
    for coordinate in [LinkCoordinate::Theta, LinkCoordinate::A, LinkCoordinate::D] {
        probes.extend((0..6).map(|joint| Parameter::Link { joint, coordinate }));
    }
    probes.extend((0..3).map(Parameter::Target));
    let first_frame = probes.len();
    if dataset.sensor == Sensor::Cable {
        for anchor in 0..dataset.anchors() {
            probes.extend((0..3).map(|axis| Parameter::Outlet { anchor, axis }));
            probes.push(Parameter::Zero { anchor });
        }
    } else {
        probes.extend((0..6).map(Parameter::SensorFrame));
    }
    (probes, first_frame)
}

impl Linear {
    /// Linearises a fit at its estimate.
    pub fn of(subject: &Subject<'_>, fit: &Extended) -> Self {
        let dataset = &subject.observed.dataset;
        let per = fit.problem.rows_per_observation();
        let rows = fit.problem.rows();
        // Derivatives for the columns of candidates, at the estimate.
        let anchors = dataset.anchors();
        let (probes, first_frame) = probes(dataset);
        let weights = with_robust_weights(&fit.weights, &fit.robust_weight);
        let problem = fit.problem.with_parameters(dataset, &fit.model, &fit.frames, &probes, &weights);
        let ((residual, transposed), (_, slopes)) = rayon::join(
            || linearised(&fit.problem, &fit.x),
            || linearised(&problem, &vec![0.0; probes.len()]),
        );
        let precision: Vec<f64> = fit.priors.iter().map(|prior| prior.sigma.powi(-2)).collect();
        let mut gradient = &transposed * &residual;
        for (k, precision) in precision.iter().enumerate() {
            gradient[k] += precision * fit.x[k];
        }
        let column = |k: usize| slopes.row(k).transpose();
        let links = &fit.model.links;
        let by_link_growth: [DVector<f64>; 6] = std::array::from_fn(|joint| {
            column(6 + joint) * links[joint].a_mm + column(12 + joint) * links[joint].d_mm
        });
        let by_growth = by_link_growth.iter().fold(DVector::zeros(rows), |sum, slope| sum + slope);
        let summed = |axis: usize| {
            (0..anchors).fold(DVector::zeros(rows), |sum, a| sum + column(first_frame + 4 * a + axis))
        };
        let (by_frame, by_zero) = if dataset.sensor == Sensor::Cable {
            (DMatrix::from_columns(&[summed(0), summed(1), summed(2)]), summed(3))
        } else {
            let columns: Vec<_> = (0..6).map(|k| column(first_frame + k)).collect();
            (DMatrix::from_columns(&columns), DVector::zeros(rows))
        };
        let (by_scale, by_sag) = readings(subject, fit, per, &weights);
        let mm = (0..rows)
            .map(|s| if s % per < 3 { 1.0 / weights[s / per].per_mm.max(1e-12) } else { 0.0 })
            .collect();
        let slopes = Arc::new(Slopes {
            by_joint: (0..6).map(column).collect(),
            by_growth,
            by_link_growth,
            by_target: DMatrix::from_columns(&[column(18), column(19), column(20)]),
            by_frame,
            by_zero,
            by_scale,
            by_sag,
            mm,
            poses: pose_of_rows(dataset),
        });
        let observations = dataset.rows.len();
        Self {
            observations,
            per,
            effective_share: fit.effective_share,
            rows: transposed,
            normal: OnceLock::new(),
            residual,
            gradient,
            x: fit.x.clone(),
            precision,
            slopes,
        }
    }

    /// Restricts to some observations; the derivatives for candidates remain those of all rows.
    pub(super) fn part(&self, observations: &[usize]) -> Self {
        let scalars: Vec<usize> =
            observations.iter().flat_map(|&i| i * self.per..(i + 1) * self.per).collect();
        let residual = DVector::from_iterator(scalars.len(), scalars.iter().map(|&s| self.residual[s]));
        self.with_rows(self.rows.select_columns(&scalars), residual)
    }

    /// What a cause of the linearised `fit` adds to the whitened readings, n.
    pub(super) fn readings_of(&self, fit: &Extended, cause: usize) -> DVector<f64> {
        let parameters = fit.parameter_indices(cause);
        parameters
            .into_iter()
            .fold(DVector::zeros(self.rows.ncols()), |sum, k| sum + self.rows.row(k).transpose() * fit.x[k])
    }

    /// Adds random effects: `columns`, n × m, with coefficients of variance 1.
    pub fn with_random_effects(&self, columns: &DMatrix<f64>) -> Self {
        let (p, m) = (self.rows.nrows(), columns.ncols());
        let mut rows = DMatrix::zeros(p + m, self.rows.ncols());
        rows.rows_mut(0, p).copy_from(&self.rows);
        rows.rows_mut(p, m).tr_copy_from(columns);
        let extended = |own: &[f64], value: f64| [own, vec![value; m].as_slice()].concat();
        self.with(rows, self.residual.clone(), extended(&self.x, 0.0), extended(&self.precision, 1.0))
    }

    /// Prewhitens for a lag-one correlation `rho` and noise that is `noise` times the assumed one; `numbers` are the row numbers of the
    /// observations.
    pub fn prewhitened(&self, rho: f64, numbers: &[usize], noise: f64) -> Self {
        if rho == 0.0 && noise == 1.0 {
            return self.clone();
        }
        if rho == 0.0 {
            return self.with_rows(&self.rows / noise, &self.residual / noise);
        }
        let (mut rows, mut residual) =
            (self.rows.clone(), DMatrix::from_row_slice(1, self.residual.len(), self.residual.as_slice()));
        for columns in [&mut rows, &mut residual] {
            prewhiten_transposed(columns, rho, numbers, self.per);
            *columns /= noise;
        }
        self.with_rows(rows, DVector::from_column_slice(residual.as_slice()))
    }

    fn with_rows(&self, rows: DMatrix<f64>, residual: DVector<f64>) -> Self {
        self.with(rows, residual, self.x.clone(), self.precision.clone())
    }

    fn with(&self, rows: DMatrix<f64>, residual: DVector<f64>, x: Vec<f64>, precision: Vec<f64>) -> Self {
        let mut gradient = &rows * &residual;
        for (k, precision) in precision.iter().enumerate() {
            gradient[k] += precision * x[k];
        }
        Self {
            observations: rows.ncols() / self.per.max(1),
            per: self.per,
            effective_share: self.effective_share,
            rows,
            normal: OnceLock::new(),
            residual,
            gradient,
            x,
            precision,
            slopes: Arc::clone(&self.slopes),
        }
    }

    /// JᵀJ + Λ.
    pub(super) fn normal(&self) -> &DMatrix<f64> {
        self.normal.get_or_init(|| {
            let mut normal = outer(&self.rows);
            for (k, precision) in self.precision.iter().enumerate() {
                normal[(k, k)] += precision;
            }
            normal
        })
    }

    /// Effective number of parameters without those at `dropped`: each counts by the share that its prior does not determine.
    pub(super) fn spent(&self, dropped: &[usize]) -> f64 {
        let kept: Vec<usize> = (0..self.x.len()).filter(|k| !dropped.contains(k)).collect();
        let p = kept.len();
        let normal = self.normal();
        let lower = lower_factor(DMatrix::from_fn(p, p, |a, b| normal[(kept[a], kept[b])]));
        let inverse = solved(&lower, DMatrix::identity(p, p));
        let variances = inverse.column_iter().map(|c| c.norm_squared());
        kept.iter().zip(variances).map(|(&k, v)| (1.0 - v * self.precision[k]).clamp(0.0, 1.0)).sum()
    }

    /// Residuals at x with the parameters at `dropped` set to 0.
    pub(super) fn without(&self, dropped: &[usize]) -> DVector<f64> {
        let mut residual = self.residual.clone();
        if !dropped.is_empty() {
            let mut taken = DVector::zeros(self.x.len());
            dropped.iter().for_each(|&k| taken[k] = -self.x[k]);
            residual.gemv_tr(1.0, &self.rows, &taken, 1.0);
        }
        residual
    }

    /// The parameters after one Gauss–Newton step beside random effects, `columns`, n × m, with coefficients of variance 1, and noise that is
    /// `noise` times the assumed one; and their covariance.
    ///
    /// The same follows from [`Linear::with_random_effects`], which copies J: of a long data set that is hundreds of megabytes, and
    /// its basis as much again.
    pub fn step_beside(&self, columns: &DMatrix<f64>, noise: f64) -> (Vec<f64>, DMatrix<f64>) {
        let (p, m, square) = (self.x.len(), columns.ncols(), noise * noise);
        let shared = product(&self.rows, columns) / square;
        let mut all = DMatrix::zeros(p + m, p + m);
        all.view_mut((0, 0), (p, p)).copy_from(&(self.normal() / square));
        all.view_mut((p, 0), (m, p)).tr_copy_from(&shared);
        all.view_mut((0, p), (p, m)).copy_from(&shared);
        all.view_mut((p, p), (m, m)).copy_from(&(gram(columns) / square));
        let mut gradient = DVector::zeros(p + m);
        gradient.rows_mut(0, p).copy_from(&(&self.gradient / square));
        gradient.rows_mut(p, m).copy_from(&(columns.tr_mul(&self.residual) / square));
        // Priors do not become weaker with more noise.
        for (k, precision) in self.precision.iter().enumerate() {
            let prior = precision * (1.0 - 1.0 / square);
            all[(k, k)] += prior;
            gradient[k] += prior * self.x[k];
        }
        (p..p + m).for_each(|k| all[(k, k)] += 1.0);
        let lower = lower_factor(all);
        let step = back_and_forth(&lower, &gradient).unwrap_or_else(|| DVector::zeros(p + m));
        let own: Vec<usize> = (0..p).collect();
        let covariance = gram(&solved(&lower, units(p + m, &own)));
        (self.x.iter().zip(step.iter()).map(|(x, step)| x - step).collect(), covariance)
    }

    /// The design with all parameters free, from which those of smaller models follow at little cost.
    pub fn whole(&self) -> FullDesign {
        let lower = lower_factor(self.normal().clone());
        let basis = solved(&lower, self.rows.clone());
        let x = DVector::from_column_slice(&self.x);
        let half = lower
            .solve_lower_triangular(&self.gradient)
            .unwrap_or_else(|| DVector::zeros(self.gradient.len()));
        let mut residual = self.residual.clone();
        residual.gemv_tr(-1.0, &basis, &half, 1.0);
        let step = lower.tr_solve_lower_triangular(&half).unwrap_or_else(|| DVector::zeros(half.len()));
        let design = Design {
            observations: self.observations,
            per: self.per,
            residual,
            basis: Arc::new(basis),
            reduction: None,
            slopes: Arc::clone(&self.slopes),
        };
        FullDesign { design, lower, x: x - step }
    }

    /// The design of the model without the parameters at `dropped`, factored from scratch; the reference for
    /// [`FullDesign::without`].
    pub fn design(&self, dropped: &[usize]) -> Design {
        let kept: Vec<usize> = (0..self.x.len()).filter(|k| !dropped.contains(k)).collect();
        let p = kept.len();
        let mut residual = self.without(dropped);
        let all = self.normal();
        let normal = DMatrix::from_fn(p, p, |a, b| all[(kept[a], kept[b])]);
        let lower = lower_factor(normal);
        let part = self.rows.select_rows(&kept);
        let mut gradient = &part * &residual;
        for (g, &k) in gradient.iter_mut().zip(&kept) {
            *g += self.precision[k] * self.x[k];
        }
        let basis = solved(&lower, part);
        let step = lower.solve_lower_triangular(&gradient).unwrap_or_else(|| DVector::zeros(p));
        residual.gemv_tr(-1.0, &basis, &step, 1.0);
        Design {
            observations: self.observations,
            per: self.per,
            residual,
            basis: Arc::new(basis),
            reduction: None,
            slopes: Arc::clone(&self.slopes),
        }
    }
}

impl FullDesign {
    /// The design of the model without the parameters at `dropped`, by removing directions from the full basis.
    ///
    /// With Z = L⁻¹E for the dropped columns E of the identity and ZᵀZ = M Mᵀ, U = Z M⁻ᵀ is orthonormal, the smaller
    /// model's projection is Q(I − UUᵀ)Qᵀ, and its residual r − QU M⁻¹x with x the dropped parameters.
    pub fn without(&self, dropped: &[usize]) -> Design {
        let (p, d) = (self.x.len(), dropped.len());
        let mut out = self.design.clone();
        if d == 0 {
            return out;
        }
        let z = solved(&self.lower, units(p, dropped));
        let taken = DVector::from_iterator(d, dropped.iter().map(|&k| self.x[k]));
        let (directions, moved) = removed_directions(&z, &taken);
        out.residual.gemv_tr(-1.0, &*self.design.basis, &(&directions * &moved), 1.0);
        out.reduction = Some(Reduction { directions, removed: OnceLock::new(), moved });
        out
    }
}

/// Columns of the identity of `p` rows.
pub(super) fn units(p: usize, places: &[usize]) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(p, places.len());
    places.iter().enumerate().for_each(|(a, &k)| out[(k, a)] = 1.0);
    out
}

/// U and the change of the residual along it, from Z and the dropped parameters; see [`FullDesign::without`].
pub(super) fn removed_directions(z: &DMatrix<f64>, dropped: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let m = lower_factor(gram(z));
    let directions = solved(&m, z.transpose()).transpose();
    let moved = m.solve_lower_triangular(dropped).unwrap_or_else(|| DVector::zeros(dropped.len()));
    (directions, moved)
}

impl Design {
    /// The design of a fit with all parameters free.
    pub fn of(subject: &Subject<'_>, fit: &Extended) -> Self {
        Linear::of(subject, fit).whole().design
    }

    /// Projects everything free off `columns`.
    pub fn project(&self, columns: &DMatrix<f64>) -> Projected {
        let (shared, square) = self.sparse_product(columns).unwrap_or_else(|| {
            let shared = product(&self.basis, columns);
            (shared, gram(columns))
        });
        self.projected(columns, shared, square)
    }

    /// The same for many candidates, with one pass over the basis for the dense ones.
    pub fn project_all(&self, all: &[DMatrix<f64>]) -> Vec<Projected> {
        let sparse: Vec<_> = all
            .par_iter()
            .map(|columns| {
                checkpoint();
                self.sparse_product(columns)
            })
            .collect();
        let dense = all.iter().zip(&sparse).filter(|(_, s)| s.is_none()).map(|(columns, _)| columns);
        let shared = product(&self.basis, &side_by_side(dense, self.rows()));
        let mut first = 0;
        let work: Vec<_> = all
            .iter()
            .zip(sparse)
            .map(|(columns, sparse)| {
                let own = first;
                first += if sparse.is_none() { columns.ncols() } else { 0 };
                (columns, sparse, own)
            })
            .collect();
        work.into_par_iter()
            .map(|(columns, sparse, own)| {
                checkpoint();
                let (shared, square) = sparse
                    .unwrap_or_else(|| (shared.columns(own, columns.ncols()).into_owned(), gram(columns)));
                self.projected(columns, shared, square)
            })
            .collect()
    }

    /// QᵀC and CᵀC of sparse columns, such as knots of an error map, in time proportional to the nonzero entries.
    fn sparse_product(&self, columns: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let entries = sparse(columns)?;
        let shared = times_sparse(&self.basis, &entries, columns.ncols());
        let mut square = DMatrix::zeros(columns.ncols(), columns.ncols());
        for row in entries.chunk_by(|a, b| a.from == b.from) {
            for (x, y) in row.iter().flat_map(|x| row.iter().map(move |y| (x, y))) {
                square[(y.to, x.to)] += x.factor * y.factor;
            }
        }
        Some((shared, square))
    }

    fn projected(&self, columns: &DMatrix<f64>, shared: DMatrix<f64>, square: DMatrix<f64>) -> Projected {
        let gradient = columns.tr_mul(&self.residual);
        let mut information = square - gram(&shared);
        let given_back = self.reduction.as_ref().map(|r| product_of_transposed(&r.directions, &shared));
        if let Some(back) = &given_back {
            information += gram(back);
        }
        Projected { gradient, information, shared, given_back }
    }

    /// Gradient (k) and information (k × k) of columns from their projection on the full design of which this is a reduction.
    pub fn gradient_and_information(&self, whole: &Projected) -> (DVector<f64>, DMatrix<f64>) {
        let (mut gradient, mut information) = (whole.gradient.clone(), whole.information.clone());
        if let Some(reduction) = &self.reduction {
            let back = product_of_transposed(&reduction.directions, &whole.shared);
            information += gram(&back);
            gradient.gemv_tr(-1.0, &back, &reduction.moved, 1.0);
        }
        (gradient, information)
    }

    /// The columns with everything free projected off, n × k.
    pub fn pure(&self, columns: &DMatrix<f64>, projected: &Projected) -> DMatrix<f64> {
        let shared = self.shared(projected);
        if columns.ncols() >= MANY_COLUMNS {
            return columns - product_of_transposed(&self.basis, &shared);
        }
        let mut out = columns.clone();
        // Row by row: a matrix product would pack the whole basis for a few columns, and column by column the basis, which is larger
        // than the caches, would be read for each.
        for (row, q) in self.basis.column_iter().enumerate() {
            for (k, shared) in shared.column_iter().enumerate() {
                out[(row, k)] -= q.dot(&shared);
            }
        }
        out
    }

    /// QᵀC of the columns, along what is free, p × k.
    pub(super) fn shared(&self, projected: &Projected) -> DMatrix<f64> {
        let mut shared = projected.shared.clone();
        if let (Some(reduction), Some(back)) = (&self.reduction, &projected.given_back) {
            shared -= product(&reduction.directions, back);
        }
        shared
    }

    /// Of a reduced design, the basis along the removed directions, d × n.
    pub(super) fn removed(&self) -> Option<&DMatrix<f64>> {
        let reduction = self.reduction.as_ref()?;
        Some(reduction.removed.get_or_init(|| product_of_transposed(&reduction.directions, &self.basis)))
    }

    /// Number of scalar rows.
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
}

/// A C, A m × n: where the columns are sparse, in time proportional to their nonzero entries.
pub(super) fn times_columns(a: &DMatrix<f64>, columns: &DMatrix<f64>) -> DMatrix<f64> {
    sparse(columns).map_or_else(|| product(a, columns), |entries| times_sparse(a, &entries, columns.ncols()))
}

/// A C of `count` columns with these entries.
fn times_sparse(a: &DMatrix<f64>, entries: &[Entry], count: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), count);
    add_sparse_product(a.nrows(), entries, a.as_slice(), out.as_mut_slice());
    out
}

/// All columns of some matrices of `rows` rows.
pub(super) fn side_by_side<'a>(
    columns: impl IntoIterator<Item = &'a DMatrix<f64>, IntoIter: Clone>,
    rows: usize,
) -> DMatrix<f64> {
    let columns = columns.into_iter();
    let mut out = DMatrix::zeros(rows, columns.clone().map(DMatrix::ncols).sum());
    let mut first = 0;
    for part in columns {
        out.columns_mut(first, part.ncols()).copy_from(part);
        first += part.ncols();
    }
    out
}

/// Number of columns from which a matrix product is worth packing the basis.
const MANY_COLUMNS: usize = 8;

/// Whitened residuals of a problem at `x` and its Jacobian transposed, p × n; what is no number counts as 0.
pub(super) fn linearised(problem: &CalibrationProblem, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let (mut residual, mut rows) = problem.linearise(x);
    residual.apply(|v| *v = finite(*v));
    rows.apply(|v| *v = finite(*v));
    (residual, rows)
}

/// Columns count as sparse if at most one in this many entries is nonzero.
const SPARSE: usize = 4;

/// The nonzero entries row by row, if the columns are sparse.
fn sparse(columns: &DMatrix<f64>) -> Option<Vec<Entry>> {
    let most = columns.len() / SPARSE;
    if columns.ncols() < 2 * SPARSE {
        return None;
    }
    // Entries before each row, then the place of the next one of each row.
    let (mut places, mut count) = (vec![0; columns.nrows() + 1], 0);
    for column in columns.column_iter() {
        for (place, value) in places[1..].iter_mut().zip(column.iter()) {
            *place += usize::from(*value != 0.0);
        }
        count += column.iter().filter(|value| **value != 0.0).count();
        if count > most {
            return None;
        }
    }
    for row in 1..places.len() {
        places[row] += places[row - 1];
    }
    let mut entries = vec![Entry { from: 0, to: 0, factor: 0.0 }; count];
    for (to, column) in columns.column_iter().enumerate() {
        for (from, &factor) in column.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            entries[places[from]] = Entry { from, to, factor };
            places[from] += 1;
        }
    }
    Some(entries)
}

/// Derivatives by the sensor's scale and by a cable's sag.
fn readings(
    subject: &Subject<'_>,
    fit: &Extended,
    per: usize,
    weights: &[crate::identification::calibration::Weight],
) -> (DVector<f64>, DVector<f64>) {
    let dataset = &subject.observed.dataset;
    let rows = dataset.rows.len() * per;
    let (mut scale, mut sag) = (DVector::zeros(rows), DVector::zeros(rows));
    let origin = fit.frames.base_from_sensor.translation.vector;
    let touched = nalgebra::Point3::from(fit.frames.flange_from_target.translation.vector);
    for (i, row) in dataset.rows.iter().enumerate() {
        let w = weights[i].per_mm;
        // At the modelled point, not the measured one: noise is not evidence of a scale error.
        let at = (fit.model.forward(&row.joints, &row.condition) * touched).coords;
        match row.reading {
            Reading::Cable(_) => {
                let away = at - fit.frames.outlets_mm[row.anchor];
                scale[i] = w * finite(away.norm() + fit.frames.zeros_mm[row.anchor]);
                sag[i] = w * finite(sag_mm(1.0, &away));
            }
            Reading::Position(_) | Reading::Pose(_) => space(&mut scale, i * per, w, at - origin),
        }
    }
    (scale, sag)
}

fn space(scale: &mut DVector<f64>, at: usize, w: f64, seen: Vector3<f64>) {
    for k in 0..3 {
        scale[at + k] = -w * finite(seen[k]);
    }
}
