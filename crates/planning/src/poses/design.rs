//! D-optimal choice of poses by Fedorov exchange.
//!
//! Method: maximise f = (1 + w) log det M − w log det N, with M = R + Σ xᵢ xᵢᵀ over the readings of the chosen poses, N
//! its block of the nuisance parameters. w = 0 without questions: D-optimality. With questions, w = 3: the difference
//! log det M − log det N is the information about the parameters in question with all others unknown (Ds-optimality), with
//! three quarters of the weight. R is the identity (the priors) for D-optimality, and for O1 a vanishing ridge on the
//! combinations that the candidates determine.
//! Start: greedy, each time the pose that adds most. Then Fedorov's exchange, pose by pose: the pose is replaced by the
//! best one, until a whole round changes nothing.
//! Shapes: p parameters, n candidates with m readings each; a step costs p² m n products, in one matrix product.
//! Stops: after a round without exchange, or 12 rounds.
//! Source: Fedorov 1972, Theory of Optimal Experiments, section 3.2, and Mitchell 1974 (DETMAX,
//! doi 10.1080/00401706.1974.10489175); O1 as in Joubair and Bonev 2013 (doi 10.1016/j.mechmachtheory.2013.07.005).
//! Departures: priors inside M (Bayesian D-optimality, Chaloner and Verdinelli 1995), exchange of one pose at a time.
//! Checked against: all pairs of a small set by brute force, and random sets, in the tests.

use nalgebra::{Cholesky, DMatrix};
use rayon::prelude::*;

use super::rows::ReadingJacobian;
use truegrind_math::spectral;
use truegrind_math::work::checkpoint;

pub use super::options::Index;

/// A design problem.
#[derive(Debug, Clone, Copy)]
pub struct Design<'a> {
    /// Whitened Jacobian of the candidates.
    pub jacobian: &'a ReadingJacobian,
    /// Optimality criterion.
    pub index: Index,
}

/// Weight of the questions.
const QUESTIONS: f64 = 3.0;
const ROUNDS: usize = 12;
/// Smallest gain of an exchange.
const MIN_GAIN: f64 = 1e-9;
/// Combinations with an eigenvalue below this share of the largest are not determined by the candidates.
const DETERMINED: f64 = 1e-12;

/// log det of a positive definite matrix; `None` for any other.
pub fn log_det(matrix: &DMatrix<f64>) -> Option<f64> {
    let factor = Cholesky::new(matrix.clone())?;
    let sum: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
    sum.is_finite().then_some(2.0 * sum)
}

/// One determinant of the objective, with its weight.
struct Part {
    weight: f64,
    ridge: f64,
    /// q × (n · m).
    readings: DMatrix<f64>,
}

impl Part {
    fn information(&self, per: usize, chosen: &[usize], without: Option<usize>) -> DMatrix<f64> {
        let q = self.readings.nrows();
        let rows: Vec<usize> = (0..chosen.len()).filter(|k| Some(*k) != without).map(|k| chosen[k]).collect();
        let mut taken = DMatrix::zeros(q, rows.len() * per);
        for (index, &row) in rows.iter().enumerate() {
            taken.columns_mut(index * per, per).copy_from(&self.readings.columns(row * per, per));
        }
        DMatrix::identity(q, q) * self.ridge + &taken * taken.transpose()
    }

    /// Gain in log det from each candidate.
    fn gains(&self, per: usize, information: &DMatrix<f64>) -> Option<Vec<f64>> {
        let inverse = Cholesky::new(information.clone())?.inverse();
        let count = self.readings.ncols() / per;
        const CHUNK: usize = 128;
        let chunks: Vec<Vec<f64>> = (0..count)
            .into_par_iter()
            .step_by(CHUNK)
            .map(|first| {
                checkpoint();
                let some = CHUNK.min(count - first);
                let x = self.readings.columns(first * per, some * per);
                let vx = &inverse * x;
                (0..some)
                    .map(|k| {
                        let (a, b) = (x.columns(k * per, per), vx.columns(k * per, per));
                        let gram = DMatrix::identity(per, per) + a.transpose() * b;
                        gram.determinant().max(1.0).ln()
                    })
                    .collect()
            })
            .collect();
        Some(chunks.concat())
    }
}

impl Design<'_> {
    fn parts(&self) -> Option<Vec<Part>> {
        let jacobian = self.jacobian;
        if self.index == Index::O1 {
            let total = &jacobian.readings * jacobian.readings.transpose();
            let eigen = spectral::symmetric_eigen(total)?;
            let largest = eigen.eigenvalues.max();
            let kept: Vec<usize> = (0..eigen.eigenvalues.len())
                .filter(|&k| eigen.eigenvalues[k] > DETERMINED * largest)
                .collect();
            let basis = eigen.eigenvectors.select_columns(&kept);
            let ridge = DETERMINED * largest;
            let readings = basis.transpose() * &jacobian.readings;
            return (largest > 0.0).then(|| vec![Part { weight: 1.0, ridge, readings }]);
        }
        let whole = Part { weight: 1.0, ridge: 1.0, readings: jacobian.readings.clone() };
        if jacobian.interest.is_empty() {
            return Some(vec![whole]);
        }
        let others: Vec<usize> =
            (0..jacobian.readings.nrows()).filter(|k| !jacobian.interest.contains(k)).collect();
        let rest = Part { weight: -QUESTIONS, ridge: 1.0, readings: jacobian.readings.select_rows(&others) };
        Some(vec![Part { weight: 1.0 + QUESTIONS, ..whole }, rest])
    }

    /// `count` different candidates in ascending order; `None` if a reading is not finite.
    pub fn choose(&self, count: usize) -> Option<Vec<usize>> {
        let (jacobian, parts) = (self.jacobian, self.parts()?);
        let per = jacobian.per_row;
        let gains = |chosen: &[usize], without: Option<usize>| -> Option<Vec<f64>> {
            let mut sum = vec![0.0; jacobian.rows()];
            for part in &parts {
                let some = part.gains(per, &part.information(per, chosen, without))?;
                sum.iter_mut().zip(some).for_each(|(s, g)| *s += part.weight * g);
            }
            Some(sum)
        };
        let best = |gains: &[f64], taken: &[bool]| {
            (0..gains.len()).filter(|&i| !taken[i]).reduce(|a, b| if gains[b] > gains[a] { b } else { a })
        };
        let mut taken = vec![false; jacobian.rows()];
        let mut chosen: Vec<usize> = Vec::with_capacity(count);
        while chosen.len() < count.min(jacobian.rows()) {
            let next = best(&gains(&chosen, None)?, &taken)?;
            taken[next] = true;
            chosen.push(next);
        }
        for _ in 0..ROUNDS {
            let mut changed = false;
            for index in 0..chosen.len() {
                let all = gains(&chosen, Some(index))?;
                let Some(other) = best(&all, &taken) else { break };
                if all[other] > all[chosen[index]] + MIN_GAIN {
                    taken[chosen[index]] = false;
                    taken[other] = true;
                    chosen[index] = other;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        chosen.sort_unstable();
        Some(chosen)
    }

    /// The objective for a set of candidates.
    pub fn value(&self, chosen: &[usize]) -> Option<f64> {
        let parts = self.parts()?;
        parts
            .iter()
            .map(|part| Some(part.weight * log_det(&part.information(self.jacobian.per_row, chosen, None))?))
            .sum()
    }
}
