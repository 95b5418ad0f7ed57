//! Score test of a candidate with everything else as nuisance parameters: gain, evidence, p-value.
//!
//! With gradient g and information S of the projected candidate and its size prior Λ:
//!
//! - estimate −(S + Λ)⁻¹ g and gain gᵀ(S + Λ)⁻¹ g, the fall of χ²;
//! - evidence gain − ln det(I + S Λ⁻¹), twice the log Bayes factor against its absence (Laplace): it penalises candidates
//!   with many parameters;
//! - the p-value uses the smaller of gᵀS⁺g under the model's own noise and under the empirical scatter of the residuals by pose
//!   (White 1980, heteroskedasticity-consistent; by clusters, Liang and Zeger 1986): noise that depends on the pose is not
//!   evidence;
//! - non-centrality λ = cᵀ S c of an effect of size c.

use nalgebra::{DMatrix, DVector};

use super::algebra::eigen;
use super::catalogue::Candidate;
use super::design::{Design, Projected};
use truegrind_math::tail::log_chi_square_tail;

/// Non-centrality from which an effect is reliably detected.
pub const VISIBLE: f64 = 40.0;

/// A scored candidate.
#[derive(Debug, Clone)]
pub struct Score {
    /// Fall of χ² with the size prior.
    pub gain: f64,
    /// Twice the log Bayes factor, variants not counted.
    pub evidence: f64,
    /// Evidence less 2 ln of the variants tried.
    pub merit: f64,
    /// First-order estimate of the parameters.
    pub estimate: DVector<f64>,
    /// Information, projected.
    pub information: DMatrix<f64>,
    /// Gradient, projected.
    pub gradient: DVector<f64>,
}

impl Score {
    /// Natural logarithm of the p-value of the candidate alone under the model's own noise, not corrected for trials:
    /// the first stage of [`log_p`]. `sizes` as in scoring.
    pub fn plain_log_p(&self, sizes: &[f64]) -> f64 {
        if self.gain > SOME {
            let (information, gradient) = in_sizes(&self.information, &self.gradient, sizes);
            let (statistic, freedom) = plain_statistic(&information, &gradient);
            log_chi_square_tail(statistic, freedom.max(1))
        } else {
            log_chi_square_tail(self.gain, sizes.len())
        }
    }
}

/// Scores one candidate.
pub fn score(design: &Design, candidate: &Candidate) -> Score {
    score_columns(design, &candidate.columns(design), &candidate.cause.sizes(), candidate.tried)
}

/// Scores columns; `sizes` are the prior standard deviations of their parameters.
pub fn score_columns(design: &Design, columns: &DMatrix<f64>, sizes: &[f64], tried: f64) -> Score {
    score_projected(&design.project(columns), sizes, tried)
}

/// Scores columns whose projection is known.
pub fn score_projected(projected: &Projected, sizes: &[f64], tried: f64) -> Score {
    score_from((projected.gradient.clone(), projected.information.clone()), sizes, tried)
}

/// Scores columns by their gradient (k) and information (k × k), projected, in the units of their parameters.
pub fn score_from(
    (plain_gradient, plain_information): (DVector<f64>, DMatrix<f64>),
    sizes: &[f64],
    tried: f64,
) -> Score {
    let k = sizes.len();
    let (information, gradient) = in_sizes(&plain_information, &plain_gradient, sizes);
    let nothing = |information: DMatrix<f64>| Score {
        gain: 0.0,
        evidence: 0.0,
        merit: -2.0 * tried.ln(),
        estimate: DVector::zeros(k),
        information,
        gradient: DVector::zeros(k),
    };
    let Some(factor) = (&information + DMatrix::identity(k, k)).cholesky() else {
        return nothing(plain_information);
    };
    let step = factor.solve(&gradient);
    let gain = gradient.dot(&step);
    let log_det = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let evidence = gain - log_det;
    if !evidence.is_finite() {
        return nothing(plain_information);
    }
    let merit = evidence - 2.0 * tried.ln();
    Score {
        gain,
        evidence,
        merit,
        estimate: DVector::from_iterator(k, step.iter().zip(sizes).map(|(step, size)| -(size * step))),
        information: plain_information,
        gradient: plain_gradient,
    }
}

/// Information and gradient in units of the prior standard deviations, for conditioning.
fn in_sizes(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    sizes: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let k = sizes.len();
    let information = DMatrix::from_fn(k, k, |a, b| sizes[a] * information[(a, b)] * sizes[b]);
    (information, DVector::from_fn(k, |a, _| sizes[a] * gradient[a]))
}

/// Natural logarithm of a candidate's p-value, the larger of those under the model's own noise and under the empirical scatter
/// of the residuals. Not corrected for trials.
pub fn log_p(design: &Design, candidate: &Candidate, score: &Score) -> f64 {
    log_p_of(design, || candidate.columns(design), &candidate.cause.sizes(), score)
}

/// The same for columns that are computed on demand.
pub fn log_p_of(
    design: &Design,
    columns: impl FnOnce() -> DMatrix<f64>,
    sizes: &[f64],
    score: &Score,
) -> f64 {
    if !is_scattered(sizes, score) {
        return score.plain_log_p(sizes);
    }
    let columns = columns();
    let projected = design.project(&columns);
    let pure = design.pure(&columns, &projected);
    let (information, gradient) = (projected.information, projected.gradient);
    let residuals = Residuals { values: &design.residual, poses: &design.slopes.poses, per: design.per };
    log_p_of_pure(&residuals, pure, &Score { information, gradient, ..score.clone() }, sizes)
}

/// Residuals of a fit whose scatter by pose is looked at.
pub(super) struct Residuals<'a> {
    /// Whitened, n.
    pub(super) values: &'a DVector<f64>,
    /// Pose index of each observation.
    pub(super) poses: &'a [usize],
    /// Scalar rows of an observation.
    pub(super) per: usize,
}

/// The same for columns off which everything free is projected already.
pub(super) fn log_p_of_pure(
    residuals: &Residuals<'_>,
    pure: DMatrix<f64>,
    score: &Score,
    sizes: &[f64],
) -> f64 {
    let (information, gradient) = in_sizes(&score.information, &score.gradient, sizes);
    let k = sizes.len();
    let Some(factor) = (&information + DMatrix::identity(k, k)).cholesky() else {
        return score.plain_log_p(sizes);
    };
    let step = factor.solve(&gradient);
    let scattered = scatter_statistic(residuals, pure, sizes, &gradient, &step);
    let (plain, freedom) = plain_statistic(&information, &gradient);
    log_chi_square_tail(plain.min(scattered), freedom.max(1))
}

/// Whether the empirical scatter counts: a few hundred rows do not determine that of many parameters.
pub(super) fn is_scattered(sizes: &[f64], score: &Score) -> bool {
    score.gain > SOME && sizes.len() <= MAX_SCATTERED
}

/// Fall of χ² below which the empirical scatter is not computed.
const SOME: f64 = 8.0;

/// Most parameters for which the gradient's covariance is estimated from the residuals.
const MAX_SCATTERED: usize = 6;

/// gᵀ S⁺ g over the directions that the data determine, and their number.
fn plain_statistic(information: &DMatrix<f64>, gradient: &DVector<f64>) -> (f64, usize) {
    let (mut sum, mut freedom) = (0.0, 0);
    let Some((values, vectors)) = eigen(information) else { return (0.0, 1) };
    for (value, vector) in values.iter().zip(vectors.column_iter()) {
        // Skips directions that the size prior determines better than the data.
        if *value > 0.1 {
            sum += vector.dot(gradient).powi(2) / value;
            freedom += 1;
        }
    }
    (sum, freedom)
}

/// The same statistic with the covariance of the gradient estimated from the candidate's residuals: Σ over poses of outer products,
/// since readings of one pose share its model error (clusters). For designs of all rows only: a design of a subset has the pose
/// indices of all rows.
fn scatter_statistic(
    residuals: &Residuals<'_>,
    mut pure: DMatrix<f64>,
    sizes: &[f64],
    gradient: &DVector<f64>,
    step: &DVector<f64>,
) -> f64 {
    let k = pure.ncols();
    pure.column_iter_mut().zip(sizes).for_each(|(mut column, size)| column *= *size);
    let Residuals { values, poses, per } = *residuals;
    let left = values - &pure * step;
    debug_assert_eq!(poses.len() * per, values.len(), "a design of a part of the rows");
    let mut by_pose = DMatrix::zeros(k, poses.iter().max().map_or(0, |p| p + 1));
    for (i, &pose) in poses.iter().enumerate() {
        let mut g = by_pose.column_mut(pose);
        for s in i * per..(i + 1) * per {
            g.axpy(left[s], &pure.row(s).transpose(), 1.0);
        }
    }
    let scatter = &by_pose * by_pose.transpose();
    let Some((values, vectors)) = eigen(&scatter) else { return 0.0 };
    let largest = values.iter().copied().fold(0.0, f64::max);
    let mut sum = 0.0;
    for (value, vector) in values.iter().zip(vectors.column_iter()) {
        if *value > 1e-10 * largest {
            sum += vector.dot(gradient).powi(2) / value;
        }
    }
    sum
}

/// Non-centrality of an effect of size `values`.
pub fn non_centrality(information: &DMatrix<f64>, values: &DVector<f64>) -> f64 {
    (values.transpose() * information * values)[0].max(0.0)
}
