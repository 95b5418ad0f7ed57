//! Identifiability: rank, condition, observability indices, and the null space of unidentifiable combinations.
//!
//! Method: singular values of the triangular factor of the whitened Jacobian, its columns in units of the prior's standard
//! deviation. At a singular value of 1 the data contain as much information on that combination as the prior.
//! Observability indices as in Joubair and Bonev 2013 (doi 10.1016/j.mechmachtheory.2013.07.005), for L parameters and
//! m poses: O1 = (σ₁…σ_L)^(1/L) / √m, O2 = σ_L/σ₁, O3 = σ_L, O4 = σ_L²/σ₁, O5 = 1 / Σ 1/σᵢ.

use nalgebra::DMatrix;

use crate::identification::calibration::CalibrationProblem;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::least_squares::rank;
use truegrind_estimation::least_squares::triangular::triangular_factor;
use truegrind_estimation::problem::Problem;

/// Identifiability report.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Number of parameters.
    pub parameters: usize,
    /// Numerical rank of the data alone, without priors.
    pub rank: usize,
    /// Largest over smallest singular value; infinite without full rank.
    pub condition: f64,
    /// The same over the combinations that the data determine, the first `rank` singular values.
    pub determined_condition: f64,
    /// Singular values, in descending order.
    pub singular_values: Vec<f64>,
    /// O1 to O5 over the determined combinations (all parameters at full rank).
    pub observability: [f64; 5],
    /// Null vectors in units of the priors: combinations of parameters that change no reading.
    pub combinations: Vec<Vec<(Parameter, f64)>>,
    /// Number of singular values below 1, where the prior is more informative than the data.
    pub held_by_priors: usize,
}

/// Shares smaller than this are left out of a printed combination.
const SHOWN_SHARE: f64 = 0.05;

/// The report for a calibration at `x`, with `scale[k]` the unit of parameter k (its prior's σ).
///
/// `None` when the Jacobian is not finite.
pub fn identifiability(problem: &CalibrationProblem, x: &[f64], scale: &[f64]) -> Option<Identifiability> {
    let factor = triangular_factor(problem, x, scale);
    let analysis = rank::analyse(&factor.r, Some(RANK_TOLERANCE))?;
    let values = analysis.singular_values.clone();
    let count = values.len();
    let full = analysis.rank == count && count > 0;
    let poses = (problem.rows() / problem.rows_per_observation()) as f64;
    let (first, last) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
    let determined = &values[..analysis.rank.min(count)];
    let least = determined.last().copied().unwrap_or(0.0);
    let observability = if determined.is_empty() {
        [0.0; 5]
    } else {
        let mean_log = determined.iter().map(|v| v.ln()).sum::<f64>() / determined.len() as f64;
        let harmonic = determined.iter().map(|v| 1.0 / v).sum::<f64>();
        [mean_log.exp() / poses.sqrt(), least / first, least, least * least / first, 1.0 / harmonic]
    };
    let determined_condition = if determined.is_empty() { f64::INFINITY } else { first / least };
    let combinations = sparse_basis(analysis.null_space())
        .into_iter()
        .map(|vector| combination(&vector, problem.free_parameters(), scale))
        .collect();
    Some(Identifiability {
        parameters: count,
        rank: analysis.rank,
        condition: if full { first / last } else { f64::INFINITY },
        determined_condition,
        held_by_priors: values.iter().filter(|v| **v < 1.0).count(),
        singular_values: values,
        observability,
        combinations,
    })
}

/// The entries of a null vector that are large in units of the priors, or in mm or radians: a frame's prior is so wide that the
/// millimetre by which it compensates a link is a small share of it.
fn combination(vector: &[f64], parameters: &[Parameter], scale: &[f64]) -> Vec<(Parameter, f64)> {
    let peak = vector.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let amount = |k: usize| (vector[k] * scale[k]).abs();
    let largest = |unit: &str| {
        let of_unit = (0..vector.len()).filter(|&k| parameters[k].unit() == unit);
        of_unit.map(amount).fold(0.0_f64, f64::max)
    };
    (0..vector.len())
        .filter(|&k| {
            let share = vector[k].abs() / peak;
            let beside = amount(k) > SHOWN_SHARE * largest(parameters[k].unit());
            share > SHOWN_SHARE || (share > FAINTEST_SHARE && beside)
        })
        .map(|k| (parameters[k], vector[k] / peak))
        .collect()
}

/// Shares of a null vector below this are rounding errors.
const FAINTEST_SHARE: f64 = 1e-5;

/// Singular values below this share of the largest count as zero.
const RANK_TOLERANCE: f64 = 1e-9;

/// Null vectors by Gauss–Jordan elimination with complete pivoting, so that each names few parameters.
fn sparse_basis(basis: DMatrix<f64>) -> Vec<Vec<f64>> {
    let (n, k) = basis.shape();
    let mut rows: Vec<Vec<f64>> = (0..k).map(|j| basis.column(j).iter().copied().collect()).collect();
    let mut free: Vec<usize> = (0..n).collect();
    for i in 0..k {
        let best = (i..k)
            .flat_map(|r| free.iter().map(move |&c| (r, c)))
            .max_by(|a, b| rows[a.0][a.1].abs().total_cmp(&rows[b.0][b.1].abs()));
        let Some((r, c)) = best.filter(|&(r, c)| rows[r][c] != 0.0) else { break };
        rows.swap(i, r);
        free.retain(|&column| column != c);
        let pivot = rows[i][c];
        rows[i].iter_mut().for_each(|v| *v /= pivot);
        let pivot_row = rows[i].clone();
        for (other, row) in rows.iter_mut().enumerate() {
            let share = row[c];
            if other != i && share != 0.0 {
                row.iter_mut().zip(&pivot_row).for_each(|(v, p)| *v -= share * p);
            }
        }
    }
    rows
}
