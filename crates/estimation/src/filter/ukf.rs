//! Unscented Kalman filter for constant or drifting parameters.
//!
//! **Method.** [`Form::Robust`]: for each observation P ← P + Q; with LLᵀ = P and c = α²(p + κ) the 2p + 1 sigma
//! points x, x ± √c·L_j; weights W₀ᵐ = 1 − p/c, W₀ᶜ = W₀ᵐ + 1 − α² + β, W = 1/(2c) for the others; mean ŷ and
//! covariance S = Σ W(y − ŷ)(y − ŷ)ᵀ + R of the residuals there, cross covariance P_xy, K = P_xy S⁻¹, x ← x −
//! Kŷ, P ← P − KSKᵀ. No derivatives are needed.
//!
//! [`Form::AsPrinted`] (ukf-vslm-2023 eq. 8 to 12, Algorithm 1): p + 2 points (the sums run from 0 to N + 1)
//! with equal weights (W_i is not defined), no Q, no R, P set to a random number at the beginning of each sweep
//! and the gain to zero. Consequences: the points are not symmetric, so their mean, which becomes the state, drifts
//! along the columns of P even if the residual vanishes. Without R each scalar observation is treated as exact and
//! removes one dimension from P, which is singular to rounding after p rows. From then on S is rounding error or zero
//! (the gain then remains zero), and the filter ignores further rows. Its result depends on the first p rows of the last
//! sweep and on rounding.
//!
//! **Shapes.** x has p entries, P is p × p, an observation has m = `rows_per_observation` rows.
//!
//! **Stops.** *DataProcessed* after the sweeps; *NotFinite* or *Singular* at the first update that fails.
//!
//! **Source and departures.** Robust: Wan and van der Merwe, "The unscented Kalman filter for nonlinear
//! estimation", 2000, with the state transition the identity. Printed: Li et al. 2023; X₀ at index 0, columns
//! of the Cholesky factor of (p + 1)P at 1 … p, minus the first of them at p + 1; the random number multiplies
//! the variances of the priors, since it has no unit.
//!
//! **Checked against** batch least squares on linear problems, and the extended filter on mildly nonlinear
//! ones.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::estimate::{Estimate, Termination};
use crate::filter::{Innovation, entry, finish, finish_processed, prior_state, symmetrise};
use crate::least_squares::Form;
use crate::objective::Objective;
use crate::problem::{Problem, observations};

options! {
    /// Options of [`solve`].
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// Number of sweeps over all observations; in the robust form each sweep weights a row by 1 / sweeps.
        pub sweeps: usize = 1,
        /// α: distance of the sigma points in standard deviations, divided by √(p + κ) (robust).
        pub alpha: f64 = 0.1,
        /// β: 2 for a normal distribution (robust).
        pub beta: f64 = 2.0,
        /// κ (robust).
        pub kappa: f64 = 0.0,
        /// Standard deviation of each parameter's drift from one observation to the next (robust); empty for constant
        /// parameters.
        pub process_sigma: Vec<f64> = Vec::new(),
        /// First standard deviation of a parameter without a prior.
        pub unknown_sigma: f64 = 1.0,
        /// Seed of the random P of the printed form.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Algorithm 1, lines 3 to 14, with the eight sweeps of Table IX.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, sweeps: 8, ..Self::default() }
    }
}

/// The filter (robust form), for processing observations one by one.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// State: the parameters.
    pub x: DVector<f64>,
    /// Covariance of the state, p × p.
    pub covariance: DMatrix<f64>,
    /// α of the sigma points.
    pub alpha: f64,
    /// β of the sigma points.
    pub beta: f64,
    /// κ of the sigma points.
    pub kappa: f64,
}

impl Filter {
    /// Lets each parameter drift by a normal step of standard deviation `sigma[k]`.
    pub fn predict(&mut self, sigma: &[f64]) {
        for (k, sigma) in sigma.iter().enumerate().take(self.x.len()) {
            self.covariance[(k, k)] += sigma * sigma;
        }
    }

    /// Processes one observation, `rows` of `problem`, with noise variance `noise` (1 for whitened rows). Returns `None`
    /// and leaves the state unchanged if anything is not finite or P is no longer positive definite.
    pub fn update(&mut self, problem: &dyn Problem, rows: Range<usize>, noise: f64) -> Option<Innovation> {
        let (p, m) = (self.x.len(), rows.len());
        let c = self.alpha * self.alpha * (p as f64 + self.kappa);
        let root = self.covariance.clone().cholesky()?.unpack() * c.sqrt();
        let mut points = DMatrix::zeros(m, 2 * p + 1);
        let mut at = |column: usize, x: &DVector<f64>| {
            let out = &mut points.as_mut_slice()[column * m..(column + 1) * m];
            problem.residuals(x.as_slice(), rows.clone(), out);
        };
        at(0, &self.x);
        for k in 0..p {
            at(1 + k, &(&self.x + root.column(k)));
            at(1 + p + k, &(&self.x - root.column(k)));
        }
        let weight = 0.5 / c;
        let centre = 1.0 - p as f64 / c;
        let centre_spread = centre + 1.0 - self.alpha * self.alpha + self.beta;
        // Differences from the central point first: the weights are large and of both signs.
        let base = points.column(0).into_owned();
        let mut mean = DVector::zeros(m);
        points.column_iter().skip(1).for_each(|y| mean += weight * (y - &base));
        let off_centre = mean.clone();
        let mean = mean + &base;
        let mut spread = centre_spread * &off_centre * off_centre.transpose();
        for y in points.column_iter().skip(1) {
            let d = y - &mean;
            spread += weight * &d * d.transpose();
        }
        symmetrise(&mut spread);
        (0..m).for_each(|i| spread[(i, i)] += noise);
        let mut cross = DMatrix::zeros(p, m);
        for k in 0..p {
            let difference = points.column(1 + k) - points.column(1 + p + k);
            cross += weight * root.column(k) * difference.transpose();
        }
        let factor = spread.clone().cholesky()?;
        let gain = factor.solve(&cross.transpose()).transpose();
        let x = &self.x - &gain * &mean;
        let mut covariance = &self.covariance - &gain * &spread * gain.transpose();
        symmetrise(&mut covariance);
        if !x.iter().chain(covariance.iter()).all(|v| v.is_finite()) {
            return None;
        }
        self.x = x;
        self.covariance = covariance;
        let nis = mean.dot(&factor.solve(&mean));
        Some(Innovation { residual: mean, covariance: spread, nis })
    }
}

/// Filters all observations of `problem` in order.
///
/// ```
/// use truegrind_estimation::estimate::Termination;
/// use truegrind_estimation::examples::Line;
/// use truegrind_estimation::filter::ukf;
/// use truegrind_estimation::least_squares::lm;
///
/// // A straight line with σ = 0.02, one reading after the other: the filter ends with the batch result.
/// let filtered = ukf::solve(&Line, &[0.0, 0.0], &ukf::Options::default());
/// assert_eq!(filtered.termination, Termination::DataProcessed);
/// let at_once = lm::solve(&Line, &[0.0, 0.0], &lm::Options::default());
/// let (some, all) = (filtered.sigmas().ok_or("none")?, at_once.sigmas().ok_or("none")?);
/// for k in 0..2 {
///     assert!((filtered.x[k] - at_once.x[k]).abs() < 1e-6);
///     assert!((some[k] / all[k] - 1.0).abs() < 1e-6);
/// }
/// # Ok::<(), &str>(())
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    match options.form {
        Form::AsPrinted => printed(problem, start, options),
        Form::Robust => robust(problem, start, options),
    }
}

fn robust(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let mut objective = Objective::new(problem, start, true);
    let (x, covariance) = prior_state(problem, start, options.unknown_sigma);
    let Options { alpha, beta, kappa, .. } = *options;
    let mut filter = Filter { x, covariance, alpha, beta, kappa };
    let mut trace = vec![entry(&mut objective, &filter.x, 0.0)];
    let noise = options.sweeps.max(1) as f64;
    for _ in 0..options.sweeps {
        let before = filter.x.clone();
        for rows in observations(problem) {
            filter.predict(&options.process_sigma);
            objective.evaluations.residuals += (rows.len() * (2 * start.len() + 1)) as u64;
            if filter.update(problem, rows, noise).is_none() {
                trace.push(entry(&mut objective, &filter.x, (&filter.x - before).norm()));
                let regular = filter.covariance.clone().cholesky().is_some();
                let end = if regular { Termination::NotFinite } else { Termination::Singular };
                return finish(&objective, &filter.x, Some(filter.covariance), end, trace);
            }
        }
        trace.push(entry(&mut objective, &filter.x, (&filter.x - before).norm()));
    }
    finish_processed(&objective, &filter.x, Some(filter.covariance), trace)
}

fn printed(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let mut objective = Objective::new(problem, start, true);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let (mut x, unit) = prior_state(problem, start, options.unknown_sigma);
    let mut covariance = unit.clone();
    let mut trace = vec![entry(&mut objective, &x, 0.0)];
    let m = problem.rows_per_observation().max(1);
    let share = 1.0 / (p + 2) as f64;
    let mut root = DMatrix::zeros(p, p);
    let mut states = DMatrix::zeros(p, p + 2);
    let mut residuals = DMatrix::zeros(m, p + 2);
    for _ in 0..options.sweeps {
        let before = x.clone();
        covariance = &unit * rng.random_range(0.0..1.0);
        for rows in observations(problem) {
            covariance *= (p + 1) as f64;
            semidefinite_root(&covariance, &mut root);
            states.column_iter_mut().for_each(|mut column| column.copy_from(&x));
            for k in 0..p {
                states.column_mut(1 + k).axpy(1.0, &root.column(k), 1.0);
            }
            if p > 0 {
                states.column_mut(p + 1).axpy(-1.0, &root.column(0), 1.0);
            }
            for k in 0..p + 2 {
                let state = &states.as_slice()[k * p..(k + 1) * p];
                let out = &mut residuals.as_mut_slice()[k * m..(k + 1) * m];
                objective.residuals(state, rows.clone(), out);
            }
            // Equations 9 to 11 with W = 1 / (p + 2).
            let (state, mean) = (states.column_sum() * share, residuals.column_sum() * share);
            states.column_iter_mut().for_each(|mut column| column -= &state);
            residuals.column_iter_mut().for_each(|mut column| column -= &mean);
            let prior = &states * states.transpose() * share;
            let spread = &residuals * residuals.transpose() * share;
            let cross = &states * residuals.transpose() * share;
            // Equation 12; if S cannot be inverted the gain remains zero.
            let gain = spread.clone().cholesky().map(|factor| factor.solve(&cross.transpose()).transpose());
            let (next, mut next_covariance) = match gain {
                Some(gain) => (&state - &gain * &mean, prior - &gain * &spread * gain.transpose()),
                None => (state, prior),
            };
            symmetrise(&mut next_covariance);
            if !next.iter().chain(next_covariance.iter()).all(|v| v.is_finite()) {
                trace.push(entry(&mut objective, &x, (&x - before).norm()));
                return finish(&objective, &x, None, Termination::NotFinite, trace);
            }
            x = next;
            covariance = next_covariance;
        }
        trace.push(entry(&mut objective, &x, (&x - before).norm()));
    }
    finish_processed(&objective, &x, Some(covariance), trace)
}

/// Cholesky factor of a matrix that rounding can have made indefinite: pivots below rounding are set to zero. Column by
/// column, so that the inner loops access contiguous memory.
fn semidefinite_root(matrix: &DMatrix<f64>, root: &mut DMatrix<f64>) {
    let p = matrix.nrows();
    root.fill(0.0);
    let (from, to) = (matrix.as_slice(), root.as_mut_slice());
    let mut sums = vec![0.0; p];
    for j in 0..p {
        // Σ_k root(i, k) root(j, k) for all i at once.
        sums[j..].fill(0.0);
        for k in 0..j {
            let column = &to[k * p + j..(k + 1) * p];
            let own = column[0];
            if own != 0.0 {
                sums[j..].iter_mut().zip(column).for_each(|(sum, other)| *sum += other * own);
            }
        }
        let whole = from[j * p + j];
        let pivot = whole - sums[j];
        if pivot <= f64::EPSILON * p as f64 * whole {
            continue;
        }
        let pivot = pivot.sqrt();
        to[j * p + j] = pivot;
        for i in j + 1..p {
            to[j * p + i] = (from[j * p + i] - sums[i]) / pivot;
        }
    }
}
