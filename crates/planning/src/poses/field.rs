//! Poses for an error that no cause explains: those that tell most about its Gaussian process over the joint angles.
//!
//! Method: the posterior covariance C of the field at the candidates, given the poses that were measured, and its mean m. Greedily, each
//! time the candidate i that most lowers the sum over all candidates of the remaining variance, weighted by the expected
//! square of the field there, w = m² + C:
//!
//! i = argmax Σⱼ wⱼ Cᵢⱼ² / (Cᵢᵢ + σ²),   then C ← C − cᵢ cᵢᵀ / (Cᵢᵢ + σ²).
//!
//! So poses go where the error is large or may be, and not twice to one place. Shapes: n candidates, p measured poses; p² n + p n² products
//! once, n² for each choice and candidate.
//! Source: Cohn 1996, Neural networks 9 (active learning by expected variance); Gramacy and Lee 2009, section 3.2 (ALC);
//! Rasmussen and Williams 2006, equations 2.25 and 2.26. Departure: the weights.
//! Checked against: the error of the field predicted at fresh poses, beside random poses, in the tests.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use truegrind_arm::model::Joints;
use truegrind_calibration::diagnosis::something_else::SomethingElse;
use truegrind_math::work::checkpoint;

/// Number of candidates considered. They are random, so the first ones serve; the cost grows with the square.
const MAX_CANDIDATES: usize = 2000;

/// Joints that the field depends on: the last one rotates the target about itself.
const JOINTS: usize = 5;

/// What is known of the field at candidates.
#[derive(Debug, Clone)]
pub struct FieldDesign {
    /// Posterior covariance (mm²).
    covariance: DMatrix<f64>,
    /// Weights of the candidates.
    weights: DVector<f64>,
    noise: f64,
}

/// Remaining standard deviation of the field, root mean square over all candidates (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldUncertainty {
    /// Before.
    pub before_mm: f64,
    /// With the chosen poses.
    pub after_mm: f64,
    /// With as many random ones, mean of ten draws.
    pub random_mm: f64,
    /// Where the chosen poses tell little ([`TELLS`]): the number of poses that would halve it, and what remains with them; fewer do not
    /// within [`MAX_POSES`].
    pub needed: Option<(usize, f64)>,
}

/// Poses tell little if more than this share of the uncertainty remains with them.
pub const TELLS: f64 = 0.9;

/// Most poses that are suggested.
pub const MAX_POSES: usize = 160;

/// Covariances of the field between two lists of poses.
fn covariances(unexplained: &SomethingElse, a: &[Joints], b: &[Joints]) -> DMatrix<f64> {
    let one = |p: &Joints, q: &Joints| {
        let square: f64 = (0..JOINTS).map(|j| (p[j] - q[j]).powi(2)).sum();
        let field = |sigma: f64, length: f64| sigma * sigma * (-0.5 * square / (length * length)).exp();
        unexplained.fields.iter().map(|f| field(f.sigma_mm, f.length_rad)).sum()
    };
    let columns: Vec<Vec<f64>> = b
        .par_iter()
        .map(|q| {
            checkpoint();
            a.iter().map(|p| one(p, q)).collect()
        })
        .collect();
    DMatrix::from_vec(a.len(), b.len(), columns.concat())
}

impl FieldDesign {
    /// Of the field at candidates; `None` if a number is not finite or the file states no noise.
    pub fn of(unexplained: &SomethingElse, candidates: &[Joints]) -> Option<Self> {
        let candidates = &candidates[..candidates.len().min(MAX_CANDIDATES)];
        let measured: Vec<Joints> = unexplained
            .poses
            .iter()
            .map(|pose| Joints::from_fn(|j, _| pose.joints_deg[j].to_radians()))
            .collect();
        let noise = unexplained.noise_mm * unexplained.noise_mm;
        let mut known = covariances(unexplained, &measured, &measured);
        (0..known.nrows()).for_each(|k| known[(k, k)] += noise);
        let factor = Cholesky::new(known)?;
        let shared = covariances(unexplained, &measured, candidates);
        let coordinates = unexplained.poses.iter().map(|p| p.residual_mm.len()).min().unwrap_or(0);
        let residual =
            DMatrix::from_fn(measured.len(), coordinates, |i, k| unexplained.poses[i].residual_mm[k]);
        let mean = shared.tr_mul(&factor.solve(&residual));
        let covariance =
            covariances(unexplained, candidates, candidates) - shared.tr_mul(&factor.solve(&shared));
        let weights = DVector::from_fn(candidates.len(), |i, _| {
            mean.row(i).norm_squared() / coordinates.max(1) as f64 + covariance[(i, i)].max(0.0)
        });
        let finite = covariance.iter().chain(weights.iter()).all(|v| v.is_finite());
        (finite && noise > 0.0).then_some(Self { covariance, weights, noise })
    }

    /// The covariance once a candidate is measured.
    fn measured(&mut self, candidate: usize) {
        let column = self.covariance.column(candidate).into_owned();
        let variance = column[candidate].max(0.0) + self.noise;
        self.covariance.ger(-1.0 / variance, &column, &column, 1.0);
    }

    /// `count` different candidates, the most informative first, without those in `taken`.
    pub fn choose(&self, count: usize, taken: &[usize]) -> Vec<usize> {
        let mut state = self.clone();
        let mut chosen: Vec<usize> = Vec::with_capacity(count);
        taken.iter().filter(|&&k| k < self.weights.len()).for_each(|&k| state.measured(k));
        while chosen.len() < count {
            let gain = |i: usize| -> f64 {
                let column = state.covariance.column(i);
                let told: f64 = column.iter().zip(state.weights.iter()).map(|(c, w)| w * c * c).sum();
                told / (column[i].max(0.0) + state.noise)
            };
            let gains: Vec<f64> = (0..state.weights.len()).into_par_iter().map(gain).collect();
            let free = (0..gains.len()).filter(|i| !taken.contains(i) && !chosen.contains(i));
            let Some(best) = free.reduce(|a, b| if gains[b] > gains[a] { b } else { a }) else { break };
            state.measured(best);
            chosen.push(best);
        }
        chosen
    }

    /// The fewest poses, in steps of a factor of two from `from`, with which at most half of `before_mm` remains, and what remains;
    /// [`MAX_POSES`] if no fewer do.
    pub fn needed(&self, from: usize, before_mm: f64) -> (usize, f64) {
        let chosen = self.choose(MAX_POSES.min(self.weights.len()), &[]);
        let mut count = from.max(1);
        loop {
            count = (2 * count).min(chosen.len());
            let left = self.remaining_mm(&chosen[..count]);
            if left <= 0.5 * before_mm || count == chosen.len() {
                return (count, left);
            }
        }
    }

    /// Standard deviation of the field once some candidates are measured, root mean square over all candidates (mm).
    pub fn remaining_mm(&self, measured: &[usize]) -> f64 {
        let mut state = self.clone();
        measured.iter().filter(|&&k| k < self.weights.len()).for_each(|&k| state.measured(k));
        (state.covariance.diagonal().iter().map(|v| v.max(0.0)).sum::<f64>()
            / self.weights.len().max(1) as f64)
            .sqrt()
    }
}
