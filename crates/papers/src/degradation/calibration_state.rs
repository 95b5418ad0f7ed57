//! State of knowledge of an arm from group to group, and its update by each calibration method.

use nalgebra::{DMatrix, DVector};

use super::arm::Arm;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, link_parameters};
use truegrind_calibration::identification::calibration::{CalibrationProblem, Weight};
use truegrind_calibration::identification::fit::Observations;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_estimation::filter::rls::{Memory, RecursiveLeastSquares};
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::{Prior, Problem};

/// Estimate of an arm: link deviations and their covariance.
pub(super) struct State {
    parameters: Vec<Parameter>,
    pub(super) x: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl State {
    pub(super) fn new(arm: &Arm) -> Self {
        let parameters = link_parameters(&arm.nominal);
        let priors = Tolerance::default().priors(&parameters, &arm.nominal);
        let variances = DVector::from_iterator(priors.len(), priors.iter().map(|p| p.sigma * p.sigma));
        Self {
            x: DVector::zeros(parameters.len()),
            covariance: DMatrix::from_diagonal(&variances),
            parameters,
        }
    }

    pub(super) fn problem(
        &self,
        arm: &Arm,
        rows: &Observations,
        weight: Weight,
        priors: &[Prior],
    ) -> CalibrationProblem {
        let weights = vec![weight; rows.dataset.rows.len()];
        CalibrationProblem::new(&rows.dataset, &arm.nominal, &arm.frames, &self.parameters, priors, &weights)
    }

    pub(super) fn model(&self, arm: &Arm) -> Model {
        self.problem(arm, &arm.groups[0].verify, arm.sigma, &[]).apply(self.x.as_slice()).0
    }

    /// Recursive update pose by pose, each linearised at the current state.
    pub(super) fn rls(&mut self, arm: &Arm, rows: &Observations, forgetting: f64) {
        let problem = self.problem(arm, rows, arm.sigma, &[]);
        let covariance = self.covariance.clone();
        let Some(mut recursion) = RecursiveLeastSquares::new(self.x.clone(), covariance, Memory::SquareRoot)
        else {
            return;
        };
        let (p, per) = (self.x.len(), problem.rows_per_observation());
        let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
        let mut a = DVector::zeros(p);
        // A pose has six rows; each applies its root of the factor.
        let share = forgetting.powf(1.0 / per as f64);
        for pose in 0..rows.dataset.rows.len() {
            let at = recursion.x.clone();
            problem.jacobian(at.as_slice(), pose * per..(pose + 1) * per, &mut r, &mut j);
            for i in 0..per {
                (0..p).for_each(|k| a[k] = j[k * per + i]);
                let e = r[i] + a.dot(&recursion.x) - a.dot(&at);
                recursion.update(&a, e, share);
            }
        }
        self.covariance = recursion.covariance();
        self.x = recursion.x;
    }

    /// Batch update, with the covariance as prior or without a prior.
    pub(super) fn lm(&mut self, arm: &Arm, rows: &Observations, memory: bool) {
        let problem = self.problem(arm, rows, arm.sigma, &[]);
        let estimate = if memory {
            let remembering = Remembering::new(&problem, &self.x, &self.covariance);
            lm::solve(&remembering, self.x.as_slice(), &lm::Options::default())
        } else {
            lm::solve(&problem, self.x.as_slice(), &lm::Options { priors: false, ..lm::Options::default() })
        };
        if estimate.x.iter().all(|x| x.is_finite()) {
            self.x = DVector::from_vec(estimate.x);
        }
        if let (true, Some(covariance)) = (memory, estimate.covariance) {
            self.covariance = covariance;
        }
    }

    pub(super) fn stopped(&mut self, arm: &Arm, rows: &Observations, steps: usize) {
        let problem = self.problem(arm, rows, Weight { per_mm: 1.0, per_rad: 1.0 }, &[]);
        let options = lm::Options { max_iterations: steps, ..lm::Options::as_printed() };
        let estimate = lm::solve(&problem, self.x.as_slice(), &options);
        if estimate.x.iter().all(|x| x.is_finite()) {
            self.x = DVector::from_vec(estimate.x);
        }
    }
}

/// A problem with a normal prior of full covariance LLᵀ, added as p rows L⁻¹(x − m).
struct Remembering<'a> {
    inner: &'a CalibrationProblem,
    mean: DVector<f64>,
    inverse_root: DMatrix<f64>,
}

impl<'a> Remembering<'a> {
    fn new(inner: &'a CalibrationProblem, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Self {
        let p = mean.len();
        let inverse_root = covariance
            .clone()
            .cholesky()
            .and_then(|factor| factor.l().try_inverse())
            .unwrap_or_else(|| DMatrix::zeros(p, p));
        Self { inner, mean: mean.clone(), inverse_root }
    }

    fn prior_rows(&self, x: &[f64]) -> DVector<f64> {
        &self.inverse_root * (DVector::from_column_slice(x) - &self.mean)
    }
}

impl Problem for Remembering<'_> {
    fn parameters(&self) -> usize {
        self.inner.parameters()
    }

    fn rows(&self) -> usize {
        self.inner.rows() + self.mean.len()
    }

    fn residuals(&self, x: &[f64], rows: std::ops::Range<usize>, out: &mut [f64]) {
        let n = self.inner.rows();
        let prior = self.prior_rows(x);
        if rows.start < n {
            let end = rows.end.min(n);
            self.inner.residuals(x, rows.start..end, &mut out[..end - rows.start]);
        }
        for i in rows.start.max(n)..rows.end {
            out[i - rows.start] = prior[i - n];
        }
    }

    fn jacobian(&self, x: &[f64], rows: std::ops::Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        let (n, p, m) = (self.inner.rows(), self.inner.parameters(), rows.len());
        let prior = self.prior_rows(x);
        let end = rows.end.min(n);
        if rows.start < n {
            let own = end - rows.start;
            let mut part = vec![0.0; own * p];
            self.inner.jacobian(x, rows.start..end, &mut residuals[..own], &mut part);
            for k in 0..p {
                jacobian[k * m..k * m + own].copy_from_slice(&part[k * own..(k + 1) * own]);
            }
        }
        for i in rows.start.max(n)..rows.end {
            residuals[i - rows.start] = prior[i - n];
            for k in 0..p {
                jacobian[k * m + i - rows.start] = self.inverse_root[(i - n, k)];
            }
        }
    }
}
