//! How wide the tolerances of one arm are, as its own rows tell.
//!
//! The catalogue's tolerance holds what the data do not see, and says how uncertain that is: a wrong width is a wrong sigma.
//! What the data do see of this arm tells how well it was made. So the widths of lengths, of twists and of joint zeros are
//! those under which the rows are most probable, weighed by the catalogue's: ln τ ~ N(ln τ₀, s²).
//!
//! With A the information of the rows and b = A x̂ + T⁻¹ x̂ at the estimate x̂ with priors T, a width makes x = (A + T'⁻¹)⁻¹ b,
//! and the derivative of the log of the rows' probability with respect to ln τ of a group of parameters is
//! Σ x²/τ² − γ, γ = Σ (1 − C/τ²) the number of them that are determined (MacKay 1992, Bayesian interpolation).

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::identification::tolerance::Tolerance;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::problem::Prior;

/// Standard deviation of ln τ about the catalogue's: arms are made three times better or worse than that.
const SPREAD: f64 = 1.1;
/// A width is kept within this factor of the catalogue's.
const MOST: f64 = 30.0;
const ROUNDS: usize = 40;
const SETTLED: f64 = 0.01;

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
pub fn learned(
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
    let groups: Vec<Option<usize>> = parameters.iter().map(group).collect();
    if groups.iter().all(Option::is_none) {
        return None;
    }
    // In units of the priors, so that millimetres and radians are of one size.
    let unit: Vec<f64> = priors.iter().map(|p| p.sigma).collect();
    let n = unit.len();
    let covariance = estimate.covariance.as_ref()?;
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (unit[i] * unit[j]));
    let precision = Cholesky::new(scaled)?.inverse();
    let x = DVector::from_fn(n, |k, _| estimate.x[k] / unit[k]);
    let right = &precision * &x;
    let mut out = *catalogue;
    let first: [f64; GROUPS] = widths(&mut out).map(|width| *width);
    let mut log = [0.0_f64; GROUPS];
    for _ in 0..ROUNDS {
        // τ² over the square of the unit.
        let square = |k: usize| groups[k].map(|g| (first[g] * log[g].exp() / unit[k]).powi(2));
        let mut matrix = precision.clone();
        for k in 0..n {
            if let Some(square) = square(k) {
                matrix[(k, k)] += 1.0 / square - 1.0;
            }
        }
        let factor = Cholesky::new(matrix)?;
        let (found, inverse) = (factor.solve(&right), factor.inverse());
        let mut moved = 0.0_f64;
        for (g, log) in log.iter_mut().enumerate() {
            let here = (0..n).filter(|&k| groups[k] == Some(g));
            let (sum, determined) = here.fold((0.0, 0.0), |(sum, determined), k| {
                let square = (first[g] * log.exp() / unit[k]).powi(2);
                (sum + found[k] * found[k] / square, determined + 1.0 - inverse[(k, k)] / square)
            });
            // Newton's step on the derivative, with the curvature that Σ x²/τ² and the catalogue have.
            let slope = sum - determined - *log / (SPREAD * SPREAD);
            let step = (slope / (2.0 * sum + (SPREAD * SPREAD).recip())).clamp(-1.0, 1.0);
            let next = (*log + step).clamp(-MOST.ln(), MOST.ln());
            moved = moved.max((next - *log).abs());
            *log = next;
        }
        if moved < SETTLED {
            break;
        }
    }
    for (width, log) in widths(&mut out).into_iter().zip(log) {
        *width *= log.exp();
    }
    let fine = |w: f64| w.is_finite() && w > 0.0;
    (fine(out.length_mm) && fine(out.angle_rad) && fine(out.zero_rad)).then_some(out)
}
