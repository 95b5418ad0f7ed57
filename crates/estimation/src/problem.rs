//! Interface of a fitting problem: weighted residuals by blocks of rows, and a prior.
//!
//! Solvers minimise ½ Σ r_i(x)² + ½ Σ ((x_k − m_k) / s_k)², the second sum over parameters with a prior. Residuals are
//! divided by the standard deviation of their measurement (so that the covariance of the estimate is the inverse of the
//! normal matrix), unless a problem states otherwise.
//!
//! A *row* is one scalar residual; an *observation* has [`Problem::rows_per_observation`] rows (1 for a cable length, 3 for
//! a position, 6 for a pose). Batch solvers use the normal equations or stack all rows, filters process one observation at
//! a time, swarms use the cost only.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use truegrind_math::work::checkpoint;

/// Normal prior of one parameter. Infinite `sigma` means no prior.
///
/// ```
/// use std::ops::Range;
/// use truegrind_estimation::least_squares::lm;
/// use truegrind_estimation::problem::{Prior, Problem};
///
/// /// Measures one length; a second one is unobserved.
/// struct OneOfTwo;
///
/// impl Problem for OneOfTwo {
///     fn parameters(&self) -> usize {
///         2
///     }
///     fn rows(&self) -> usize {
///         1
///     }
///     fn residuals(&self, x: &[f64], _: Range<usize>, out: &mut [f64]) {
///         out[0] = (x[0] - 0.4) / 0.01;
///     }
///     fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
///         self.residuals(x, rows, residuals);
///         jacobian.copy_from_slice(&[1.0 / 0.01, 0.0]);
///     }
///     fn priors(&self) -> &[Prior] {
///         &[Prior { mean: 0.0, sigma: f64::INFINITY }, Prior { mean: 0.1, sigma: 0.5 }]
///     }
/// }
///
/// // A parameter without data keeps its prior mean and standard deviation.
/// let found = lm::solve(&OneOfTwo, &[0.0, 0.0], &lm::Options::default());
/// let sigmas = found.sigmas().ok_or("none")?;
/// assert!((found.x[0] - 0.4).abs() < 1e-9 && (sigmas[0] - 0.01).abs() < 1e-9);
/// assert!((found.x[1] - 0.1).abs() < 1e-9 && (sigmas[1] - 0.5).abs() < 1e-9);
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Mean, in the unit of the parameter.
    pub mean: f64,
    /// Standard deviation, in the unit of the parameter; `f64::INFINITY` for a parameter without a prior.
    pub sigma: f64,
}

impl Prior {
    /// The share of a parameter that the data determine, given its variance: 1 − variance / σ², between 0 and 1.
    pub fn determined_share(&self, variance: f64) -> f64 {
        (1.0 - variance / (self.sigma * self.sigma)).clamp(0.0, 1.0)
    }

    /// 1 / σ², 0 without a prior.
    fn precision(&self) -> f64 {
        1.0 / (self.sigma * self.sigma)
    }
}

/// Effective number of parameters: each counts by the share that the data determine, not its prior.
pub fn effective_parameters(variances: impl IntoIterator<Item = f64>, priors: &[Prior]) -> f64 {
    priors.iter().zip(variances).map(|(prior, variance)| prior.determined_share(variance)).sum()
}

/// JᵀJ, Jᵀr and ½ rᵀr of a set of rows, priors not included.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalEquations {
    /// JᵀJ, p × p; only the lower triangle is guaranteed to be filled until [`NormalEquations::symmetrize`] is
    /// called.
    pub matrix: DMatrix<f64>,
    /// Jᵀr, p.
    pub gradient: DVector<f64>,
    /// ½ Σ r².
    pub cost: f64,
}

impl NormalEquations {
    /// All zero, for `p` parameters.
    pub fn zeros(p: usize) -> Self {
        Self { matrix: DMatrix::zeros(p, p), gradient: DVector::zeros(p), cost: 0.0 }
    }

    /// Adds another set of rows.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.cost += other.cost;
    }

    /// Adds the priors of the parameters at `x`: one for each, or none at all; one of infinite width has no effect.
    pub fn add_priors(&mut self, priors: &[Prior], x: &[f64]) {
        for (k, prior) in priors.iter().enumerate() {
            self.matrix[(k, k)] += prior.precision();
        }
        add_prior_gradient(priors, x, &mut self.gradient);
        self.cost += prior_cost(priors, x);
    }

    /// Copies the lower triangle onto the upper one.
    pub fn symmetrize(&mut self) {
        self.matrix.fill_upper_triangle_with_lower_triangle();
    }
}

/// A fitting task. See the module page for shapes and weights.
pub trait Problem: Sync {
    /// Number of parameters p.
    fn parameters(&self) -> usize;

    /// Number of scalar residuals n, a multiple of [`Problem::rows_per_observation`].
    fn rows(&self) -> usize;

    /// Rows that belong to one observation.
    fn rows_per_observation(&self) -> usize {
        1
    }

    /// Writes the residuals of `rows` at `x` into `out` (`out.len() == rows.len()`). `rows` contains whole observations.
    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]);

    /// Writes residuals and their derivatives: `jacobian` is `rows.len()` × p, column-major
    /// (`jacobian[k * rows.len() + i]` is ∂r_i/∂x_k).
    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]);

    /// One prior for each parameter, or an empty slice for no priors at all.
    fn priors(&self) -> &[Prior] {
        &[]
    }

    /// The same problem with these `observations` only, by index; `None` if not supported.
    fn subsample(&self, _observations: &[usize]) -> Option<Box<dyn Problem + '_>> {
        None
    }

    /// ½ Σ r² over all rows at `x`, without priors.
    fn row_cost(&self, x: &[f64]) -> f64 {
        let parts = map_chunks(self, |rows| {
            let mut out = vec![0.0; rows.len()];
            self.residuals(x, rows, &mut out);
            0.5 * out.iter().map(|r| r * r).sum::<f64>()
        });
        parts.iter().sum()
    }

    /// The normal equations of all rows at `x`, without priors. Chunks are summed in order, so the result does
    /// not depend on the number of threads. A problem with a faster way (rows in SIMD lanes) overrides this.
    fn normal_equations(&self, x: &[f64]) -> NormalEquations {
        let p = self.parameters();
        let parts = map_chunks(self, |rows| {
            let (j, r) = linearised(self, x, rows);
            NormalEquations { matrix: j.tr_mul(&j), gradient: j.tr_mul(&r), cost: 0.5 * r.norm_squared() }
        });
        let mut total = NormalEquations::zeros(p);
        parts.iter().for_each(|part| total.add(part));
        total
    }

    /// Cost ½ Σ r² and gradient Jᵀr of all rows at `x`, without priors: with many parameters much cheaper than the normal equations.
    fn gradient(&self, x: &[f64]) -> (f64, DVector<f64>) {
        let p = self.parameters();
        let parts = map_chunks(self, |rows| {
            let (j, r) = linearised(self, x, rows);
            (0.5 * r.norm_squared(), j.tr_mul(&r))
        });
        parts.into_iter().fold((0.0, DVector::zeros(p)), |sum, part| (sum.0 + part.0, sum.1 + part.1))
    }
}

/// Jacobian and residuals of some rows.
fn linearised<P: Problem + ?Sized>(
    problem: &P,
    x: &[f64],
    rows: Range<usize>,
) -> (DMatrix<f64>, DVector<f64>) {
    let (n, p) = (rows.len(), problem.parameters());
    let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
    problem.jacobian(x, rows, &mut r, &mut j);
    (DMatrix::from_vec(n, p, j), DVector::from_vec(r))
}

/// Adds the gradient of the priors at `x`.
pub(crate) fn add_prior_gradient(priors: &[Prior], x: &[f64], gradient: &mut DVector<f64>) {
    for (k, (prior, x)) in priors.iter().zip(x).enumerate() {
        if prior.sigma.is_finite() {
            gradient[k] += prior.precision() * (x - prior.mean);
        }
    }
}

/// ½ Σ ((x − mean)/sigma)² over the parameters that have a prior.
pub fn prior_cost(priors: &[Prior], x: &[f64]) -> f64 {
    let term =
        |(p, x): (&Prior, &f64)| if p.sigma.is_finite() { ((x - p.mean) / p.sigma).powi(2) } else { 0.0 };
    0.5 * priors.iter().zip(x).map(term).sum::<f64>()
}

/// Rows in one chunk of parallel work: fixed, so that sums are the same for any number of threads.
const CHUNK_ROWS: usize = 1536;

/// The rows of each observation in turn. Rows beyond the last whole observation are omitted.
pub(crate) fn observations(problem: &dyn Problem) -> impl Iterator<Item = Range<usize>> + use<> {
    let per = problem.rows_per_observation().max(1);
    (0..problem.rows() / per).map(move |i| i * per..(i + 1) * per)
}

/// Results of `work` for each chunk of rows, in order; chunks are processed in parallel.
pub(crate) fn map_chunks<P, T>(problem: &P, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T>
where
    P: Problem + ?Sized,
    T: Send,
{
    let chunks = chunks(problem);
    let work = |rows: Range<usize>| {
        checkpoint();
        work(rows)
    };
    // Scheduling one small chunk on the pool costs more than a swarm's whole evaluation of it.
    if chunks.len() <= 1 {
        chunks.into_iter().map(work).collect()
    } else {
        chunks.into_par_iter().map(&work).collect()
    }
}

/// Ranges of whole observations, of fixed size, that cover all rows in order.
fn chunks<P: Problem + ?Sized>(problem: &P) -> Vec<Range<usize>> {
    let per = problem.rows_per_observation().max(1);
    let step = (CHUNK_ROWS / per).max(1) * per;
    (0..problem.rows()).step_by(step).map(|from| from..(from + step).min(problem.rows())).collect()
}
