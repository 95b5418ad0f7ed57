//! Empirical Bayes estimate of the prior widths of link parameters: hierarchical prior, marginal likelihood, posterior mean
//! square.
//!
//! The prior width of a parameter that the data do not determine is its standard deviation, so a wrong width is a wrong sigma.
//! The parameters that the data determine show how accurately this arm was made. The widths τ of lengths, twists and joint
//! zeros are therefore estimated from the rows, with a hyperprior over arms: ln τ ~ N(ln τ₀ − s², s²), so that E τ² = τ₀²,
//! where τ₀ is half the catalogue's tolerance and s corresponds to a factor of 2.7 between arms.
//!
//! Half, since 1 mm and 0.3° are what the largest of some two dozen parameters reaches, two standard deviations: Nubiola and Bonev
//! (2013, Robotics and Computer-Integrated Manufacturing 29, 236) find up to 0.9 mm and 0.5° on an IRB 1600. Two arms with measurements
//! by others agree: the widths estimated here are 0.43 mm (lengths), 0.29° (twists) and 0.09° (zeros) for the UR5 of Jacobi 2025, 0.54 mm,
//! 0.05° and 0.03 to 0.05° for the UR10 of Landgraf et al. 2021; their root mean squares are 0.49 mm and 0.16°, and the differences of their logarithms (0.2, 1.8 and 0.8) scatter as those of two draws
//! with a standard deviation of 0.8 do; three differences leave 0.5 to 2 open.
//!
//! With A the information of the rows and b = A x̂ + T⁻¹ x̂ at the estimate x̂ with priors T, widths T' give
//! x = (A + T'⁻¹)⁻¹ b and the log marginal likelihood
//! ln p(rows | τ) = −½ ln |A + T'⁻¹| − ½ ln |T'| + ½ bᵀ x.
//! Its derivative with respect to ln τ of a group is Σ x²/τ² − γ, with γ = Σ (1 − C/τ²) the effective number of determined
//! parameters (MacKay 1992, Bayesian interpolation).
//!
//! A width is estimated from some four to eight parameters and remains uncertain by a third. The variance of an undetermined
//! parameter is E(τ² | rows), a tenth to a third above the posterior mode in τ, so the root of this mean square is returned. The
//! integral over the three log widths is a product of Gauss–Hermite rules about the mode of p(τ | rows) times each τ, halfway
//! between the modes of the normalising integral and the one for τ².

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, SymmetricEigen, Vector3};

use crate::identification::tolerance::Tolerance;
use truegrind_arm::estimated::WidthUncertainty;
use truegrind_arm::parameter::{Parameter, ToleranceGroup};
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::Prior;

/// s, the standard deviation of ln τ over arms: a factor of 2.7.
const SPREAD: f64 = 1.0;
/// τ₀, the root mean square of τ over arms, relative to the catalogue's tolerance.
const RMS_SHARE: f64 = 0.5;
/// Bound of a width relative to the catalogue's.
const MAX_RATIO: f64 = 30.0;
const MAX_ITERATIONS: usize = 40;
/// Largest step of ln τ at convergence.
const STEP_TOLERANCE: f64 = 0.01;

/// Nodes and weights of the Gauss–Hermite rule of five points for a standard normal variable.
const NODES: [(f64, f64); 5] = {
    // Roots of z⁵ − 10 z³ + 15 z; weights 5! / (5 He₄(z))².
    const INNER: (f64, f64) = (1.355_626_179_974_265_7, 0.222_075_922_005_612_7);
    const OUTER: (f64, f64) = (2.856_970_013_872_805_6, 0.011_257_411_327_720_701);
    [(-OUTER.0, OUTER.1), (-INNER.0, INNER.1), (0.0, 8.0 / 15.0), INNER, OUTER]
};

const GROUPS: usize = ToleranceGroup::COUNT;

fn widths(tolerance: &mut Tolerance) -> [&mut f64; GROUPS] {
    [&mut tolerance.length_mm, &mut tolerance.angle_rad, &mut tolerance.zero_rad]
}

/// Estimates the tolerances from `estimate`, which was fitted with `priors`. Returns `catalogue` if the estimate has no
/// covariance or no link was free.
pub fn learn_tolerance(
    catalogue: &Tolerance,
    parameters: &[Parameter],
    priors: &[Prior],
    estimate: &Estimate,
) -> Tolerance {
    estimated_tolerance(catalogue, parameters, priors, estimate).unwrap_or(*catalogue)
}

fn estimated_tolerance(
    catalogue: &Tolerance,
    parameters: &[Parameter],
    priors: &[Prior],
    estimate: &Estimate,
) -> Option<Tolerance> {
    let mut out = *catalogue;
    let links = LinkPosterior::of(widths(&mut out).map(|width| *width), parameters, priors, estimate)?;
    let log = links.root_mean_square()?;
    for (width, log) in widths(&mut out).into_iter().zip(&log) {
        *width *= log.clamp(-MAX_RATIO.ln(), MAX_RATIO.ln()).exp();
    }
    let fine = |w: f64| w.is_finite() && w > 0.0;
    (fine(out.length_mm) && fine(out.angle_rad) && fine(out.zero_rad)).then_some(out)
}

/// How uncertain the widths are that the covariance of `estimate` assumes: the distribution of ln (width / prior sigma) given the
/// data. `None` where [`learn_tolerance`] keeps the catalogue's widths.
pub fn width_uncertainty(
    catalogue: &Tolerance,
    parameters: &[Parameter],
    priors: &[Prior],
    estimate: &Estimate,
) -> Option<WidthUncertainty> {
    let mut widths_of = *catalogue;
    let catalogue = widths(&mut widths_of).map(|width| *width);
    let nodes = LinkPosterior::of(catalogue, parameters, priors, estimate)?.nodes()?;
    // ln (prior / catalogue) of each group; irrelevant for a group without parameters.
    let mut assumed = [0.0; GROUPS];
    for (parameter, prior) in parameters.iter().zip(priors) {
        if let Some(group) = parameter.tolerance_group() {
            assumed[group as usize] = (prior.sigma / catalogue[group as usize]).ln();
        }
    }
    let total: f64 = nodes.iter().map(|(_, weight)| weight).sum();
    let mean = nodes.iter().map(|(log, weight)| log * *weight).sum::<Vector3<f64>>() / total;
    let spread = |(log, weight): &(Vector3<f64>, f64)| (log - mean) * (log - mean).transpose() * *weight;
    let covariance = nodes.iter().map(spread).sum::<Matrix3<f64>>() / total;
    Some(WidthUncertainty {
        log_mean: std::array::from_fn(|g| mean[g] - assumed[g]),
        log_covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
    })
}

/// Marginal posterior of the links. Widths are parametrised by the log of their ratio to the catalogue's.
struct LinkPosterior {
    /// A + T⁻¹, in units of the priors T, so that millimetres and radians are commensurable.
    precision: DMatrix<f64>,
    /// b in these units.
    right: DVector<f64>,
    /// Group of each parameter, and the catalogue's width in units of its prior.
    widths: Vec<(usize, f64)>,
}

impl LinkPosterior {
    fn of(
        catalogue: [f64; GROUPS],
        parameters: &[Parameter],
        priors: &[Prior],
        estimate: &Estimate,
    ) -> Option<Self> {
        let indices: Vec<(usize, usize)> = parameters
            .iter()
            .enumerate()
            .filter_map(|(k, p)| Some((k, p.tolerance_group()? as usize)))
            .collect();
        let covariance = estimate.covariance.as_ref()?;
        let unit = |i: usize| priors[indices[i].0].sigma;
        let n = indices.len();
        if n == 0 {
            return None;
        }
        let scaled =
            DMatrix::from_fn(n, n, |i, j| covariance[(indices[i].0, indices[j].0)] / (unit(i) * unit(j)));
        let precision = Cholesky::new(scaled)?.inverse();
        let right = &precision * DVector::from_fn(n, |i, _| estimate.x[indices[i].0] / unit(i));
        let widths = (0..n).map(|i| (indices[i].1, catalogue[indices[i].1] / unit(i))).collect();
        Some(Self { precision, right, widths })
    }

    /// 1/τ² of each parameter.
    fn weights(&self, log: &Vector3<f64>) -> Vec<f64> {
        self.widths.iter().map(|(g, width)| (width * log[*g].exp()).powi(-2)).collect()
    }

    /// Cholesky factor of A + T'⁻¹.
    fn factor(&self, weights: &[f64]) -> Option<Cholesky<f64, Dyn>> {
        let mut matrix = self.precision.clone();
        weights.iter().enumerate().for_each(|(k, weight)| matrix[(k, k)] += weight - 1.0);
        Cholesky::new(matrix)
    }

    /// ln p(τ | rows), up to a constant.
    fn log_probability(&self, log: &Vector3<f64>) -> Option<f64> {
        let weights = self.weights(log);
        let factor = self.factor(&weights)?;
        let lower = factor.l_dirty();
        let determinant: f64 = lower.diagonal().iter().map(|v| 2.0 * v.ln()).sum();
        let mut whitened = self.right.clone();
        if !lower.solve_lower_triangular_mut(&mut whitened) {
            return None;
        }
        let log_prior: f64 = weights.iter().map(|w| w.ln()).sum();
        let deviation = log.add_scalar(SPREAD * SPREAD - RMS_SHARE.ln()) / SPREAD;
        Some(0.5 * (log_prior - determinant + whitened.norm_squared() - deviation.norm_squared()))
    }

    /// The mode of p(τ | rows) times each τ, and the negative second derivative of its logarithm there.
    fn mode(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let hyperprior = (SPREAD * SPREAD).recip();
        let (mut log, mut curvature) = (Vector3::<f64>::zeros(), Matrix3::<f64>::zeros());
        for _ in 0..MAX_ITERATIONS {
            let weights = self.weights(&log);
            let factor = self.factor(&weights)?;
            let (mean, covariance) = (factor.solve(&self.right), factor.inverse());
            let (mut squares, mut determined) = (Vector3::<f64>::zeros(), Vector3::<f64>::zeros());
            curvature = Matrix3::from_diagonal_element(hyperprior);
            for (i, &(g, _)) in self.widths.iter().enumerate() {
                squares[g] += mean[i] * mean[i] * weights[i];
                determined[g] += 1.0 - covariance[(i, i)] * weights[i];
                curvature[(g, g)] += 2.0 * (mean[i] * mean[i] + covariance[(i, i)]) * weights[i];
                for (j, &(h, _)) in self.widths.iter().enumerate() {
                    let both = covariance[(i, j)] * weights[i] * weights[j];
                    curvature[(g, h)] -= both * (4.0 * mean[i] * mean[j] + 2.0 * covariance[(i, j)]);
                }
            }
            let mut moved = 0.0_f64;
            for g in 0..GROUPS {
                // −ln (τ / τ₀) / s² from the hyperprior; its mean −s² cancels against the extra factor τ.
                let slope: f64 = squares[g] - determined[g] - (log[g] - RMS_SHARE.ln()) * hyperprior;
                // Newton step with the curvature of Σ x²/τ² and the hyperprior.
                let step = (slope / (2.0 * squares[g] + hyperprior)).clamp(-1.0, 1.0);
                let next = (log[g] + step).clamp(-MAX_RATIO.ln(), MAX_RATIO.ln());
                moved = moved.max((next - log[g]).abs());
                log[g] = next;
            }
            if moved < STEP_TOLERANCE {
                break;
            }
        }
        Some((log, curvature))
    }

    /// Quadrature nodes of p(τ | data): log widths with unnormalised weights.
    fn nodes(&self) -> Option<Vec<(Vector3<f64>, f64)>> {
        let (mode, curvature) = self.mode()?;
        // The posterior is at least as narrow as the hyperprior.
        let axes = SymmetricEigen::new(curvature);
        let reach = axes.eigenvalues.map(|value| value.max((SPREAD * SPREAD).recip()).sqrt().recip());
        let scaling = axes.eigenvectors * Matrix3::from_diagonal(&reach);
        let mut points = Vec::with_capacity(NODES.len().pow(3));
        for (x, of_x) in NODES {
            for (y, of_y) in NODES {
                for (z, of_z) in NODES {
                    let normal = Vector3::new(x, y, z);
                    let at = mode + scaling * normal;
                    let log = self.log_probability(&at)? + 0.5 * normal.norm_squared();
                    points.push((at, log + (of_x * of_y * of_z).ln()));
                }
            }
        }
        let most = points.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
        Some(points.into_iter().map(|(at, log)| (at, (log - most).exp())).collect())
    }

    /// ½ ln E (τ² | rows) of each group.
    fn root_mean_square(&self) -> Option<Vector3<f64>> {
        let (mut sum, mut squares) = (0.0, Vector3::<f64>::zeros());
        for (at, weight) in self.nodes()? {
            sum += weight;
            squares += weight * at.map(|log| (2.0 * log).exp());
        }
        Some(squares.map(|square: f64| 0.5 * (square / sum).ln()))
    }
}
