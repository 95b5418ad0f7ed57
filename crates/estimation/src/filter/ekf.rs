//! Extended Kalman filter for constant or drifting parameters.
//!
//! **Method.** For each observation with residual r and Jacobian J at x: S = JPJᵀ + R, K = PJᵀS⁻¹, x ← x − Kr,
//! P ← (I − KJ)P(I − KJ)ᵀ + KRKᵀ (Joseph's form, multiplied out so that it costs p²m); before it P ← P + Q.
//! `iterations` above 1 repeats the linearisation at the new state within one observation (iterated filter).
//! - [`Form::AsPrinted`]: R = 1 in each of several sweeps over the same data, with P continued: every row is counted
//!   once per sweep, and the covariance is too small by that factor.
//! - [`Form::Robust`]: R = number of sweeps, so that all sweeps together weight each row once, and a later sweep only
//!   corrects the linearisation of the earlier ones. One sweep by default.
//!
//! **Shapes.** x has p entries, P is p × p, an observation has m = `rows_per_observation` rows.
//!
//! **Stops.** *DataProcessed* after the sweeps; *NotFinite* at the first observation whose update is not
//! finite.
//!
//! **Source and departures.** M2 of ltlm-2024 and M1 of ukf-vslm-2023, "the conventional extended Kalman
//! filter", without equations; U's Table IX has it iterate 12 to 14 times, taken here as sweeps of the printed
//! form. Equations: Simon, *Optimal State Estimation*, 2006, ch. 13.
//!
//! **Checked against** batch least squares with the same priors on linear problems (equal to rounding).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::estimate::{Estimate, Iteration, Termination};
use crate::filter::{Innovation, entry, finish, finish_processed, prior_state, symmetrise};
use crate::least_squares::Form;
use crate::objective::Objective;
use crate::problem::{Problem, observations};

options! {
    /// Options of [`solve`].
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// Number of sweeps over all observations.
        pub sweeps: usize = 1,
        /// Linearisations within one observation.
        pub iterations: usize = 1,
        /// Standard deviation of each parameter's drift from one observation to the next; empty for constant parameters.
        pub process_sigma: Vec<f64> = Vec::new(),
        /// First standard deviation of a parameter without a prior.
        pub unknown_sigma: f64 = 1.0,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Twelve sweeps that each count the data as new.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, sweeps: 12, ..Self::default() }
    }
}

/// The filter, for processing observations one by one.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// State: the parameters.
    pub x: DVector<f64>,
    /// Covariance of the state, p × p.
    pub covariance: DMatrix<f64>,
}

impl Filter {
    /// Lets each parameter drift by a normal step of standard deviation `sigma[k]`.
    pub fn predict(&mut self, sigma: &[f64]) {
        for (k, sigma) in sigma.iter().enumerate().take(self.x.len()) {
            self.covariance[(k, k)] += sigma * sigma;
        }
    }

    /// Processes one observation, `rows` of `problem`, with noise variance `noise` (1 for whitened rows). Returns `None`
    /// and leaves the state unchanged if anything is not finite.
    pub fn update(
        &mut self,
        problem: &dyn Problem,
        rows: Range<usize>,
        noise: f64,
        iterations: usize,
    ) -> Option<Innovation> {
        let (p, m) = (self.x.len(), rows.len());
        let (mut r, mut j) = (DVector::zeros(m), DMatrix::zeros(m, p));
        let mut x = self.x.clone();
        let mut first: Option<Innovation> = None;
        let mut gain = DMatrix::zeros(p, m);
        let (mut cross, mut spread) = (DMatrix::zeros(p, m), DMatrix::zeros(m, m));
        for _ in 0..iterations.max(1) {
            problem.jacobian(x.as_slice(), rows.clone(), r.as_mut_slice(), j.as_mut_slice());
            cross = &self.covariance * j.transpose();
            spread = &j * &cross;
            symmetrise(&mut spread);
            (0..m).for_each(|i| spread[(i, i)] += noise);
            let factor = spread.clone().cholesky()?;
            gain = factor.solve(&cross.transpose()).transpose();
            // Residual predicted by the linearisation at x for the state before this observation.
            let residual = &r + &j * (&self.x - &x);
            let step = &gain * &residual;
            if first.is_none() {
                let nis = residual.dot(&factor.solve(&residual));
                first = Some(Innovation { residual, covariance: spread.clone(), nis });
            }
            x = &self.x - step;
        }
        // (I − KJ)P(I − KJ)ᵀ + KRKᵀ = P − K(PJᵀ)ᵀ − (PJᵀ)Kᵀ + KSKᵀ.
        let shared = &gain * cross.transpose();
        let mut covariance =
            &self.covariance - &shared - shared.transpose() + &gain * &spread * gain.transpose();
        symmetrise(&mut covariance);
        if !x.iter().chain(covariance.iter()).all(|v| v.is_finite()) {
            return None;
        }
        self.x = x;
        self.covariance = covariance;
        first
    }
}

/// Filters all observations of `problem` in order.
///
/// ```
/// use truegrind_estimation::estimate::Termination;
/// use truegrind_estimation::examples::Line;
/// use truegrind_estimation::filter::ekf;
/// use truegrind_estimation::least_squares::lm;
///
/// // A straight line with σ = 0.02, one reading after the other: the filter ends with the batch result.
/// let filtered = ekf::solve(&Line, &[0.0, 0.0], &ekf::Options::default());
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
    let mut objective = Objective::new(problem, start, true);
    let (x, covariance) = prior_state(problem, start, options.unknown_sigma);
    let mut filter = Filter { x, covariance };
    let mut trace: Vec<Iteration> = vec![entry(&mut objective, &filter.x, 0.0)];
    let noise = if options.form == Form::Robust { options.sweeps.max(1) as f64 } else { 1.0 };
    for _ in 0..options.sweeps {
        let before = filter.x.clone();
        for rows in observations(problem) {
            filter.predict(&options.process_sigma);
            objective.evaluations.jacobians += (rows.len() * options.iterations.max(1)) as u64;
            if filter.update(problem, rows, noise, options.iterations).is_none() {
                trace.push(entry(&mut objective, &filter.x, (&filter.x - before).norm()));
                return finish(&objective, &filter.x, Some(filter.covariance), Termination::NotFinite, trace);
            }
        }
        trace.push(entry(&mut objective, &filter.x, (&filter.x - before).norm()));
    }
    finish_processed(&objective, &filter.x, Some(filter.covariance), trace)
}
