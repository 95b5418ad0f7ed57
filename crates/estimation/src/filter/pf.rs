//! Particle filter for constant parameters.
//!
//! **Method.** N particles are drawn from the prior; each observation multiplies their weights by its
//! likelihood exp(−½‖r‖²); the estimate is the weighted mean, the covariance the weighted spread.
//! - [`Form::AsPrinted`]: sampling, importance, resampling: where the effective number of particles 1/Σw² falls
//!   below N/2 they are resampled systematically. Particles never move, so after some dozen precise observations all of
//!   them are copies of the best of the first N draws: the filter is no better than N random guesses.
//! - [`Form::Robust`]: each likelihood is applied in as many fractional powers as needed to keep half of the particles
//!   effective (tempering). After each power they are resampled and moved by a kernel that preserves their mean and
//!   covariance (Liu and West: x ← a x + (1 − a) x̄ + h L z, with a² + h² = 1 and LLᵀ the weighted covariance).
//!
//! **Shapes.** x has p entries; N particles. An observation costs N evaluations of its rows, in the robust form
//! for each power.
//!
//! **Stops.** *DataProcessed* after the last observation; *NotFinite* if all weights vanish or are NaN.
//!
//! **Source and departures.** M3 of ltlm-2024, "particle filtering", without equations or numbers. Printed:
//! Gordon, Salmond, Smith, "Novel approach to nonlinear/non-Gaussian Bayesian state estimation", 1993. Robust:
//! Liu and West, "Combined parameter and state estimation in simulation-based filtering", 2001; Del Moral,
//! Doucet, Jasra, "Sequential Monte Carlo samplers", 2006, for the tempering. The kernel is exact for normal
//! posteriors only, and its spread carries a sampling error of about √(p/N).
//!
//! **Checked against** batch least squares within a few of its sigmas, and the collapse of the printed form.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

use crate::estimate::{Estimate, Termination};
use crate::filter::{entry, finish, finish_processed, prior_state};
use crate::least_squares::Form;
use crate::objective::Objective;
use crate::problem::{Problem, observations};

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// N.
        pub particles: usize = 1_000,
        /// h of the kernel (robust): share of the spread that is resampled at each move.
        pub kernel: f64 = 0.5,
        /// First standard deviation of a parameter without a prior.
        pub unknown_sigma: f64 = 1.0,
        /// Seed of all random draws.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Sampling, importance, resampling with 1,000 particles.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, ..Self::default() }
    }
}

/// Particles, their log weights, and the random generators.
struct Cloud {
    particles: Vec<DVector<f64>>,
    log_weights: Vec<f64>,
    rng: ChaCha8Rng,
}

impl Cloud {
    /// Weights that sum to one, or `None` if none is positive.
    fn weights(&self) -> Option<Vec<f64>> {
        let largest =
            self.log_weights.iter().copied().filter(|w| w.is_finite()).fold(f64::NEG_INFINITY, f64::max);
        if largest == f64::NEG_INFINITY {
            return None;
        }
        let exponential = |w: &f64| if w.is_nan() { 0.0 } else { (w - largest).exp() };
        let mut weights: Vec<f64> = self.log_weights.iter().map(exponential).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        Some(weights)
    }

    fn moments(&self, weights: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let p = self.particles.first().map_or(0, |x| x.len());
        let mut mean = DVector::zeros(p);
        self.particles.iter().zip(weights).for_each(|(x, w)| mean.axpy(*w, x, 1.0));
        let mut covariance = DMatrix::zeros(p, p);
        for (x, w) in self.particles.iter().zip(weights) {
            let d = x - &mean;
            covariance.ger(*w, &d, &d, 1.0);
        }
        (mean, covariance)
    }

    /// Systematic resampling: one random number, N equal strides through the cumulated weights.
    fn resample(&mut self, weights: &[f64]) {
        let n = self.particles.len();
        let first: f64 = self.rng.random_range(0.0..1.0);
        let mut chosen = Vec::with_capacity(n);
        let (mut cumulated, mut source) = (weights[0], 0);
        for i in 0..n {
            let target = (i as f64 + first) / n as f64;
            while cumulated < target && source + 1 < n {
                source += 1;
                cumulated += weights[source];
            }
            chosen.push(self.particles[source].clone());
        }
        self.particles = chosen;
        self.log_weights.fill(0.0);
    }

    /// The kernel of Liu and West. With a singular covariance no particle moves.
    fn shake(&mut self, mean: &DVector<f64>, covariance: DMatrix<f64>, h: f64) {
        let Some(factor) = covariance.cholesky() else { return };
        let root = factor.unpack();
        let a = (1.0 - h * h).max(0.0).sqrt();
        for x in &mut self.particles {
            let z = DVector::from_fn(mean.len(), |_, _| self.rng.sample::<f64, _>(StandardNormal));
            *x = &*x * a + mean * (1.0 - a) + &root * z * h;
        }
    }
}

fn effective(weights: &[f64]) -> f64 {
    1.0 / weights.iter().map(|w| w * w).sum::<f64>()
}

/// Filters all observations of `problem` in order.
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let mut objective = Objective::new(problem, start, true);
    let n = options.particles.max(2);
    let (mean, covariance) = prior_state(problem, start, options.unknown_sigma);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut draw = |_| {
        let z = |k: usize| covariance[(k, k)].sqrt() * rng.sample::<f64, _>(StandardNormal);
        let z = (0..start.len()).map(z).collect::<Vec<_>>();
        &mean + DVector::from_vec(z)
    };
    let particles = (0..n).map(&mut draw).collect();
    let mut cloud = Cloud { particles, log_weights: vec![0.0; n], rng };
    let mut trace = vec![entry(&mut objective, &mean, 0.0)];
    for rows in observations(problem) {
        let mut left = 1.0;
        while left > 0.0 {
            objective.evaluations.residuals += (rows.len() * n) as u64;
            let log_likelihoods: Vec<f64> = cloud
                .particles
                .par_iter()
                .map(|x| {
                    let mut r = vec![0.0; rows.len()];
                    problem.residuals(x.as_slice(), rows.clone(), &mut r);
                    -0.5 * r.iter().map(|r| r * r).sum::<f64>()
                })
                .collect();
            let power = match options.form {
                Form::AsPrinted => left,
                Form::Robust => tempered_power(&log_likelihoods, left),
            };
            left -= power;
            cloud.log_weights.iter_mut().zip(&log_likelihoods).for_each(|(w, l)| *w += power * l);
            let Some(weights) = cloud.weights() else {
                let x = DVector::from_column_slice(start);
                trace.push(entry(&mut objective, &x, 0.0));
                return finish(&objective, &x, None, Termination::NotFinite, trace);
            };
            if options.form == Form::Robust {
                let (mean, covariance) = cloud.moments(&weights);
                cloud.resample(&weights);
                cloud.shake(&mean, covariance, options.kernel);
            } else if effective(&weights) < 0.5 * n as f64 {
                cloud.resample(&weights);
            }
        }
    }
    let weights = cloud.weights().unwrap_or_else(|| vec![1.0 / n as f64; n]);
    let (x, covariance) = cloud.moments(&weights);
    trace.push(entry(&mut objective, &x, (&x - &mean).norm()));
    finish_processed(&objective, &x, Some(covariance), trace)
}

/// The largest power of the likelihood, at most `left`, that keeps half of equally weighted particles
/// effective.
fn tempered_power(log_likelihoods: &[f64], left: f64) -> f64 {
    let largest = log_likelihoods.iter().copied().filter(|l| l.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let share = |power: f64| {
        let weights =
            log_likelihoods.iter().map(|l| if l.is_nan() { 0.0 } else { (power * (l - largest)).exp() });
        let (mut sum, mut square) = (0.0, 0.0);
        weights.for_each(|w| {
            sum += w;
            square += w * w;
        });
        sum * sum / square / log_likelihoods.len() as f64
    };
    // NaN (nothing finite) is left to the caller, who finds no weights.
    if share(left).is_nan() || share(left) >= 0.5 {
        return left;
    }
    let (mut low, mut high) = (0.0, left);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if share(middle) >= 0.5 { low = middle } else { high = middle }
    }
    // Particles with zero likelihood can make every power too large: continue in small steps.
    if low > 0.0 { low } else { left.min(1e-3) }
}
