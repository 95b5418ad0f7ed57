//! Recursive least squares.
//!
//! **Method** (rls-2025 eq. 8 to 14). For each row with derivatives a and residual e: k = Pa / (ϕ + aᵀPa), x ←
//! x − k e, P ← (P − k aᵀP)/ϕ, where ϕ ≤ 1 is the forgetting factor. Rows are linearised once, at the point of
//! linearisation ξ: e = r(ξ) + aᵀ(x − ξ).
//! - [`Memory::Covariance`]: P itself, by the formula of Sherman and Morrison as printed (eq. 14). Rounding can
//!   make it indefinite.
//! - [`Memory::SquareRoot`]: S with SSᵀ = P (Potter): f = Sᵀa, d = ϕ + fᵀf, k = Sf/d, S ← (S − Sf fᵀ/(d +
//!   √(ϕd)))/√ϕ. P cannot become indefinite.
//!
//! Without forgetting this equals batch least squares of one linearisation, to rounding. `linearisations` above 1
//! restarts from the prior with ξ at the last result: Gauss–Newton, one row at a time.
//!
//! **Shapes.** x has p entries, P is p × p; rows are processed one by one.
//!
//! **Stops.** *DataProcessed* after the last linearisation; *Singular* where the first rows do not determine
//! the parameters ([`Initial::FirstRows`]); *NotFinite*.
//!
//! **Source and departures.** Qiao et al. 2025. The text at hand lost eq. 1 to 13: reconstructed from the
//! definitions around them. The denominator of eq. 14 is a scalar, which holds for one row; a pose brings
//! several, processed one after the other, each divided by its own standard deviation. P₀ = (A₀ᵀA₀)⁻¹ from the
//! first poses is near singular with few of them: `Initial::FirstRows` uses it, the default starts from the
//! prior. The paper has no forgetting factor in eq. 14; 1 by default. Forgetting without excitation lets P grow
//! without bound (wind-up): use process noise per parameter in [`ekf`](crate::filter::ekf) where
//! that can happen. Potter's form: Bierman, *Factorization Methods for Discrete Sequential Estimation*, 1977,
//! ch. II.
//!
//! **Checked against** batch least squares of one linearisation (equal to rounding), and Bierman's example,
//! where the printed form loses positive definiteness.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::estimate::{Estimate, Termination};
use crate::filter::ordered::Ordered;
use crate::filter::{entry, finish, finish_processed, prior_state};
use crate::least_squares::damped::inverse_of_normal;
use crate::objective::Objective;
use crate::problem::{NormalEquations, Problem, observations};

/// Stored form of the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Memory {
    /// P, as printed.
    Covariance,
    /// A square root of P.
    #[default]
    SquareRoot,
}

/// Initial state of the recursion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Initial {
    /// The priors of the problem.
    #[default]
    Prior,
    /// Batch least squares of this number of first observations, without priors (as in the paper).
    FirstRows(usize),
}

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// Stored form of the covariance.
        pub memory: Memory = Memory::SquareRoot,
        /// Initial state of the recursion.
        pub initial: Initial = Initial::Prior,
        /// Forgetting factor ϕ: 1 for none, 0.99 for a memory of about a hundred rows.
        pub forgetting: f64 = 1.0,
        /// Passes over the data, each linearised at the result of the previous one.
        pub linearisations: usize = 1,
        /// First standard deviation of a parameter without a prior.
        pub unknown_sigma: f64 = 1e3,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Equation 14 from P₀ = (A₀ᵀA₀)⁻¹ of the first `observations`.
    pub fn as_printed(observations: usize) -> Self {
        Self { memory: Memory::Covariance, initial: Initial::FirstRows(observations), ..Self::default() }
    }
}

/// The recursion, for processing rows one by one.
#[derive(Debug, Clone, PartialEq)]
pub struct RecursiveLeastSquares {
    /// The parameters.
    pub x: DVector<f64>,
    kept: Kept,
}

/// Stored form of the covariance P.
#[derive(Debug, Clone, PartialEq)]
enum Kept {
    /// P itself.
    Covariance(DMatrix<f64>),
    /// Any S with SSᵀ = P.
    Root(DMatrix<f64>),
    /// A triangular one, once parameters drift.
    Ordered(Ordered),
}

impl RecursiveLeastSquares {
    /// Starts with `x` and its covariance; `None` for the square-root form if the covariance is not positive definite.
    pub fn new(x: DVector<f64>, covariance: DMatrix<f64>, memory: Memory) -> Option<Self> {
        let kept = match memory {
            Memory::Covariance => Kept::Covariance(covariance),
            Memory::SquareRoot => Kept::Root(covariance.cholesky()?.unpack()),
        };
        Some(Self { x, kept })
    }

    /// Resumes in square-root form from a state and the root S of its covariance, as returned by [`RecursiveLeastSquares::root`].
    pub fn from_root(x: DVector<f64>, root: DMatrix<f64>) -> Self {
        Self { x, kept: Kept::Root(root) }
    }

    /// S of the square-root form, for bit-exact storage; `None` in the other form.
    pub fn root(&self) -> Option<DMatrix<f64>> {
        match &self.kept {
            Kept::Covariance(_) => None,
            Kept::Root(root) => Some(root.clone()),
            Kept::Ordered(ordered) => Some(ordered.root()),
        }
    }

    /// The covariance P.
    pub fn covariance(&self) -> DMatrix<f64> {
        match &self.kept {
            Kept::Covariance(covariance) => covariance.clone(),
            Kept::Root(root) => root * root.transpose(),
            Kept::Ordered(ordered) => {
                let root = ordered.root();
                &root * root.transpose()
            }
        }
    }

    /// Processes one row: derivatives `a` and residual `e` at the current `x`. Returns ϕ + aᵀPa, the predicted variance
    /// of the residual.
    pub fn update(&mut self, a: &DVector<f64>, e: f64, forgetting: f64) -> f64 {
        match &mut self.kept {
            Kept::Covariance(covariance) => {
                let pa = &*covariance * a;
                let d = forgetting + a.dot(&pa);
                self.x.axpy(-e / d, &pa, 1.0);
                // Written out as in eq. 14, which also keeps P exactly symmetric.
                for (mut column, right) in covariance.column_iter_mut().zip(pa.iter()) {
                    column.iter_mut().zip(pa.iter()).for_each(|(entry, left)| *entry -= left * right / d);
                }
                if forgetting != 1.0 {
                    *covariance /= forgetting;
                }
                d
            }
            Kept::Root(root) => {
                let f = root.tr_mul(a);
                let d = forgetting + f.norm_squared();
                let sf = &*root * &f;
                self.x.axpy(-e / d, &sf, 1.0);
                root.ger(-1.0 / (d + (forgetting * d).sqrt()), &sf, &f, 1.0);
                if forgetting != 1.0 {
                    *root /= forgetting.sqrt();
                }
                d
            }
            Kept::Ordered(ordered) => {
                let (d, pa) = ordered.update(a, forgetting);
                self.x.axpy(-e / d, &pa, 1.0);
                d
            }
        }
    }

    /// Adds process noise: each parameter drifts by a normal step of standard deviation `sigma[k]`. A square root becomes
    /// triangular the first time (p³); afterwards the cost is the cube of the number of drifting parameters. Non-finite
    /// sigmas change nothing.
    ///
    /// # Panics
    /// If `sigma` does not have one entry for each parameter.
    pub fn predict(&mut self, sigma: &[f64]) {
        assert_eq!(sigma.len(), self.x.len(), "one standard deviation for each parameter");
        if let Kept::Covariance(covariance) = &mut self.kept {
            sigma.iter().enumerate().for_each(|(k, sigma)| covariance[(k, k)] += sigma * sigma);
            return;
        }
        let fits = matches!(&self.kept, Kept::Ordered(ordered) if ordered.fits(sigma));
        if !fits && let Some(root) = self.root() {
            self.kept = Kept::Ordered(Ordered::of(&root, sigma));
        }
        if let Kept::Ordered(ordered) = &mut self.kept {
            ordered.drift(sigma);
        }
    }
}

/// Filters all rows of `problem` in order.
///
/// ```
/// use truegrind_estimation::estimate::Termination;
/// use truegrind_estimation::examples::Line;
/// use truegrind_estimation::filter::rls;
/// use truegrind_estimation::least_squares::lm;
///
/// // A straight line with σ = 0.02, one reading after the other: the filter ends with the batch result.
/// let filtered = rls::solve(&Line, &[0.0, 0.0], &rls::Options::default());
/// assert_eq!(filtered.termination, Termination::DataProcessed);
/// let at_once = lm::solve(&Line, &[0.0, 0.0], &lm::Options::default());
/// let (some, all) = (filtered.sigmas().ok_or("none")?, at_once.sigmas().ok_or("none")?);
/// for k in 0..2 {
///     assert!((filtered.x[k] - at_once.x[k]).abs() < 1e-8);
///     assert!((some[k] / all[k] - 1.0).abs() < 1e-8);
/// }
/// # Ok::<(), &str>(())
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let mut objective = Objective::new(problem, start, options.initial == Initial::Prior);
    let per = problem.rows_per_observation().max(1);
    let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
    let mut point = DVector::from_column_slice(start);
    let mut trace = vec![entry(&mut objective, &point, 0.0)];
    let mut covariance = None;
    for _ in 0..options.linearisations {
        let begun = match options.initial {
            Initial::Prior => {
                let (x, covariance) = prior_state(problem, start, options.unknown_sigma);
                RecursiveLeastSquares::new(x, covariance, options.memory).map(|recursion| (recursion, 0))
            }
            Initial::FirstRows(count) => first_rows(&mut objective, &point, count, options.memory),
        };
        let Some((mut recursion, taken)) = begun else {
            return finish(&objective, &point, None, Termination::Singular, trace);
        };
        let mut a = DVector::zeros(p);
        for rows in observations(problem).skip(taken) {
            objective.jacobian(point.as_slice(), rows, &mut r, &mut j);
            for i in 0..per {
                (0..p).for_each(|k| a[k] = j[k * per + i]);
                let e = r[i] + a.dot(&recursion.x) - a.dot(&point);
                recursion.update(&a, e, options.forgetting);
            }
        }
        if !recursion.x.iter().all(|x| x.is_finite()) {
            return finish(&objective, &point, None, Termination::NotFinite, trace);
        }
        let moved = (&recursion.x - &point).norm();
        point = recursion.x.clone();
        covariance = Some(recursion.covariance());
        let mut last = entry(&mut objective, &point, moved);
        last.damping = Some(options.forgetting);
        trace.push(last);
    }
    finish_processed(&objective, &point, covariance, trace)
}

/// x₀ = ξ − (A₀ᵀA₀)⁻¹A₀ᵀr and P₀ = (A₀ᵀA₀)⁻¹ of the first observations.
fn first_rows(
    objective: &mut Objective<'_>,
    point: &DVector<f64>,
    count: usize,
    memory: Memory,
) -> Option<(RecursiveLeastSquares, usize)> {
    let p = point.len();
    let per = objective.problem.rows_per_observation().max(1);
    let n = (count * per).min(objective.problem.rows() / per * per);
    let (mut r, mut j) = (vec![0.0; n], vec![0.0; n * p]);
    objective.jacobian(point.as_slice(), 0..n, &mut r, &mut j);
    let (j, r) = (DMatrix::from_vec(n, p, j), DVector::from_vec(r));
    let equations = NormalEquations { matrix: j.tr_mul(&j), gradient: j.tr_mul(&r), cost: 0.0 };
    let covariance = inverse_of_normal(&equations.matrix)?;
    let x = point - &covariance * equations.gradient;
    RecursiveLeastSquares::new(x, covariance, memory).map(|recursion| (recursion, n / per))
}
