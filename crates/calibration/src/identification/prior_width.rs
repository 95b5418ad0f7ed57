//! How wide the tolerances of one arm are, as its own rows tell.
//!
//! The catalogue's tolerance holds what the data do not see, and says how uncertain that is: a wrong width is a wrong sigma.
//! What the data do see of this arm tells how well it was made. So the widths τ of lengths, of twists and of joint zeros follow from
//! the rows, weighed by what is known of arms: one is made three times better or worse than another, and all of them together deviate
//! by the catalogue's τ₀, which is the root mean square over arms: ln τ ~ N(ln τ₀ − s², s²), so that E τ² = τ₀².
//!
//! With A the information of the rows and b = A x̂ + T⁻¹ x̂ at the estimate x̂ with priors T, a width makes x = (A + T'⁻¹)⁻¹ b, and
//! ln p(rows | τ) = −½ ln |A + T'⁻¹| − ½ ln |T'| + ½ bᵀ x.
//! Its derivative with respect to ln τ of a group of parameters is Σ x²/τ² − γ, γ = Σ (1 − C/τ²) the number of them that are determined
//! (MacKay 1992, Bayesian interpolation).
//!
//! The rows tell a width by some four to eight numbers, so it stays uncertain by a third, and what they do not see deviates by
//! E (τ² | rows), not by the most probable τ, which is a tenth to a third less. So the width that is handed on is the root of that mean
//! square. The three integrals are a product of Gauss–Hermite rules about the mode of p(τ | rows) times each τ, halfway between the
//! mode of what is normalised and that of what is sought.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, SymmetricEigen, Vector3};

use crate::identification::tolerance::Tolerance;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::Prior;

/// s, the standard deviation of ln τ over arms: they are made three times better or worse than each other.
const SPREAD: f64 = 1.1;
/// A width is kept within this factor of the catalogue's.
const MOST: f64 = 30.0;
const ROUNDS: usize = 40;
const SETTLED: f64 = 0.01;

/// Nodes and weights of the Gauss–Hermite rule of five points for a standard normal variable.
const NODES: [(f64, f64); 5] = {
    // Roots of z⁵ − 10 z³ + 15 z; weights 5! / (5 He₄(z))².
    const INNER: (f64, f64) = (1.355_626_179_974_265_7, 0.222_075_922_005_612_7);
    const OUTER: (f64, f64) = (2.856_970_013_872_805_6, 0.011_257_411_327_720_701);
    [(-OUTER.0, OUTER.1), (-INNER.0, INNER.1), (0.0, 8.0 / 15.0), INNER, OUTER]
};

/// Groups of link parameters that are made alike.
const GROUPS: usize = 3;

fn group(parameter: &Parameter) -> Option<usize> {
    match parameter {
        Parameter::Link { coordinate, .. } if coordinate.is_length() => Some(0),
        Parameter::Link { coordinate: LinkCoordinate::Theta, .. } => Some(2),
        Parameter::Link { .. } => Some(1),
        _ => None,
    }
}

fn widths(tolerance: &mut Tolerance) -> [&mut f64; GROUPS] {
    [&mut tolerance.length_mm, &mut tolerance.angle_rad, &mut tolerance.zero_rad]
}

/// The tolerances of the arm that `estimate` was fitted to with `priors`; those of the `catalogue` where the estimate says
/// nothing of its covariance, or no link was free.
pub fn learn_tolerance(
    catalogue: &Tolerance,
    parameters: &[Parameter],
    priors: &[Prior],
    estimate: &Estimate,
) -> Tolerance {
    told(catalogue, parameters, priors, estimate).unwrap_or(*catalogue)
}

fn told(
    catalogue: &Tolerance,
    parameters: &[Parameter],
    priors: &[Prior],
    estimate: &Estimate,
) -> Option<Tolerance> {
    let mut out = *catalogue;
    let links = Links::of(widths(&mut out).map(|width| *width), parameters, priors, estimate)?;
    let log = links.root_mean_square()?;
    for (width, log) in widths(&mut out).into_iter().zip(&log) {
        *width *= log.clamp(-MOST.ln(), MOST.ln()).exp();
    }
    let fine = |w: f64| w.is_finite() && w > 0.0;
    (fine(out.length_mm) && fine(out.angle_rad) && fine(out.zero_rad)).then_some(out)
}

/// What rows say of the links, whatever the rest of the fit is. Widths are logarithms of multiples of the catalogue's.
struct Links {
    /// A + T⁻¹, in units of the priors T, so that millimetres and radians are of one size.
    precision: DMatrix<f64>,
    /// b in these units.
    right: DVector<f64>,
    /// Of each parameter its group, and the catalogue's width in units of its prior.
    made: Vec<(usize, f64)>,
}

impl Links {
    fn of(
        catalogue: [f64; GROUPS],
        parameters: &[Parameter],
        priors: &[Prior],
        estimate: &Estimate,
    ) -> Option<Self> {
        let places: Vec<(usize, usize)> =
            parameters.iter().enumerate().filter_map(|(k, p)| Some((k, group(p)?))).collect();
        let covariance = estimate.covariance.as_ref()?;
        let unit = |i: usize| priors[places[i].0].sigma;
        let n = places.len();
        if n == 0 {
            return None;
        }
        let scaled =
            DMatrix::from_fn(n, n, |i, j| covariance[(places[i].0, places[j].0)] / (unit(i) * unit(j)));
        let precision = Cholesky::new(scaled)?.inverse();
        let right = &precision * DVector::from_fn(n, |i, _| estimate.x[places[i].0] / unit(i));
        let made = (0..n).map(|i| (places[i].1, catalogue[places[i].1] / unit(i))).collect();
        Some(Self { precision, right, made })
    }

    /// 1/τ² of each parameter.
    fn weights(&self, log: &Vector3<f64>) -> Vec<f64> {
        self.made.iter().map(|(g, width)| (width * log[*g].exp()).powi(-2)).collect()
    }

    /// The factor of A + T'⁻¹.
    fn factor(&self, weights: &[f64]) -> Option<Cholesky<f64, Dyn>> {
        let mut matrix = self.precision.clone();
        weights.iter().enumerate().for_each(|(k, weight)| matrix[(k, k)] += weight - 1.0);
        Cholesky::new(matrix)
    }

    /// ln p(τ | rows), but for a constant.
    fn log_probability(&self, log: &Vector3<f64>) -> Option<f64> {
        let weights = self.weights(log);
        let factor = self.factor(&weights)?;
        let lower = factor.l_dirty();
        let determinant: f64 = lower.diagonal().iter().map(|v| 2.0 * v.ln()).sum();
        let mut met = self.right.clone();
        if !lower.solve_lower_triangular_mut(&mut met) {
            return None;
        }
        let widths: f64 = weights.iter().map(|w| w.ln()).sum();
        let off = log.add_scalar(SPREAD * SPREAD) / SPREAD;
        Some(0.5 * (widths - determinant + met.norm_squared() - off.norm_squared()))
    }

    /// The mode of p(τ | rows) times each τ, and the negative second derivative of its logarithm there.
    fn mode(&self) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let held = (SPREAD * SPREAD).recip();
        let (mut log, mut curvature) = (Vector3::<f64>::zeros(), Matrix3::<f64>::zeros());
        for _ in 0..ROUNDS {
            let weights = self.weights(&log);
            let factor = self.factor(&weights)?;
            let (found, inverse) = (factor.solve(&self.right), factor.inverse());
            let (mut squares, mut determined) = (Vector3::<f64>::zeros(), Vector3::<f64>::zeros());
            curvature = Matrix3::from_diagonal_element(held);
            for (i, &(g, _)) in self.made.iter().enumerate() {
                squares[g] += found[i] * found[i] * weights[i];
                determined[g] += 1.0 - inverse[(i, i)] * weights[i];
                curvature[(g, g)] += 2.0 * (found[i] * found[i] + inverse[(i, i)]) * weights[i];
                for (j, &(h, _)) in self.made.iter().enumerate() {
                    let both = inverse[(i, j)] * weights[i] * weights[j];
                    curvature[(g, h)] -= both * (4.0 * found[i] * found[j] + 2.0 * inverse[(i, j)]);
                }
            }
            let mut moved = 0.0_f64;
            for g in 0..GROUPS {
                // −ln τ over s² from the catalogue's spread, where its −s² and the τ beside the probability cancel.
                let slope: f64 = squares[g] - determined[g] - log[g] * held;
                // Newton's step, with the curvature that Σ x²/τ² and the catalogue have.
                let step = (slope / (2.0 * squares[g] + held)).clamp(-1.0, 1.0);
                let next = (log[g] + step).clamp(-MOST.ln(), MOST.ln());
                moved = moved.max((next - log[g]).abs());
                log[g] = next;
            }
            if moved < SETTLED {
                break;
            }
        }
        Some((log, curvature))
    }

    /// ½ ln E (τ² | rows) of each group.
    fn root_mean_square(&self) -> Option<Vector3<f64>> {
        let (mode, curvature) = self.mode()?;
        // The rows make no width less certain than it is without them.
        let axes = SymmetricEigen::new(curvature);
        let reach = axes.eigenvalues.map(|value| value.max((SPREAD * SPREAD).recip()).sqrt().recip());
        let away = axes.eigenvectors * Matrix3::from_diagonal(&reach);
        let mut points = Vec::with_capacity(NODES.len().pow(3));
        for (x, of_x) in NODES {
            for (y, of_y) in NODES {
                for (z, of_z) in NODES {
                    let normal = Vector3::new(x, y, z);
                    let at = mode + away * normal;
                    let log = self.log_probability(&at)? + 0.5 * normal.norm_squared();
                    points.push((at, log + (of_x * of_y * of_z).ln()));
                }
            }
        }
        let most = points.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
        let (mut sum, mut squares) = (0.0, Vector3::<f64>::zeros());
        for (at, log) in &points {
            let weight = (log - most).exp();
            sum += weight;
            squares += weight * at.map(|log| (2.0 * log).exp());
        }
        Some(squares.map(|square: f64| 0.5 * (square / sum).ln()))
    }
}
