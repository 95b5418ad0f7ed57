//! Variance components of random functions by maximum marginal likelihood (evidence).
//!
//! With S the information and c the gradient of m coefficients, everything else projected off, coefficients a ~ N(0, D), D diagonal
//! with one variance for each group, and noise of variance s²: a = −(S/s² + D⁻¹)⁻¹ c/s², and twice the log marginal likelihood is
//! −[ν ln s² + ln det(I + D S/s²) + (R − cᵀ(S + s²D⁻¹)⁻¹c)/s²], R the residual sum of squares of everything else with ν degrees of
//! freedom. Fixed-point update: vᵍ ← |aᵍ|²/γᵍ, γᵍ = Σ(1 − Vₖₖ/vᵍ) the number of well-determined coefficients.
//! Source: MacKay 1992, Bayesian interpolation.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::algebra::{back_and_forth, factored, solved};

/// Most iterations: variances approach 0 slowly and are truncated by [`NEGLIGIBLE`].
const ROUNDS: usize = 30;

/// Standard deviation of a group, relative to the noise, below which it is set to 0.
const NEGLIGIBLE: f64 = 0.02;

/// Relative change of all standard deviations at convergence.
const CONVERGED: f64 = 0.02;

/// Estimated variance components.
#[derive(Debug, Clone)]
pub struct Variances {
    /// Standard deviation of each group's coefficients; 0 if negligible.
    pub sizes: Vec<f64>,
    /// Standard deviation of the noise, in units of the whitened rows.
    pub noise: f64,
    /// Twice the log Bayes factor of all groups together against none.
    pub evidence: f64,
    /// The coefficients, m.
    pub coefficients: DVector<f64>,
}

/// Estimates the variance components; see the module documentation. `square` is R and `freedom` ν; `start` has starting values of the
/// standard deviations.
pub fn variances(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    groups: &[Range<usize>],
    (square, freedom): (f64, f64),
    start: Option<&[f64]>,
) -> Variances {
    let m = gradient.len();
    let nu = freedom.max(1.0);
    let mut noise2 = (square / nu).max(1e-12);
    let usual = 0.3 * noise2.sqrt();
    // A group that was 0 before can reappear when fewer other parameters are free.
    let mut sizes: Vec<f64> = (0..groups.len())
        .map(|g| start.map_or(usual, |s| s[g].max(2.0 * NEGLIGIBLE * noise2.sqrt())))
        .collect();
    let mut coefficients = DVector::zeros(m);
    for _ in 0..ROUNDS {
        let Some(state) = State::of(information, gradient, groups, &sizes, noise2) else { break };
        let mut spent = 0.0;
        let mut moved = 0.0_f64;
        coefficients = state.coefficients(groups, &sizes);
        for (g, range) in groups.iter().enumerate() {
            if sizes[g] == 0.0 {
                continue;
            }
            let gamma: f64 = range.clone().map(|k| 1.0 - state.variance[k]).sum();
            spent += gamma;
            let norm = state.unit.rows(range.start, range.len()).norm_squared() * sizes[g] * sizes[g];
            let next = if gamma > 1e-6 { (norm / gamma).sqrt() } else { 0.0 };
            moved = moved.max((next / sizes[g] - 1.0).abs());
            sizes[g] = if next < NEGLIGIBLE * noise2.sqrt() { 0.0 } else { next };
        }
        let left =
            square + 2.0 * gradient.dot(&coefficients) + (information * &coefficients).dot(&coefficients);
        noise2 = (left / (nu - spent).max(0.05 * nu)).max(1e-12);
        if moved < CONVERGED {
            break;
        }
    }
    let with = State::of(information, gradient, groups, &sizes, noise2);
    let evidence = with.as_ref().map_or(0.0, |state| {
        let without = nu * (square / nu).max(1e-12).ln() + nu;
        let left = square - state.explained * noise2;
        without - (nu * noise2.ln() + state.log_det + left / noise2)
    });
    if let Some(state) = with {
        coefficients = state.coefficients(groups, &sizes);
    }
    Variances { sizes, noise: noise2.sqrt(), evidence, coefficients }
}

/// Coefficients in units of their prior standard deviations, with their posterior variances.
struct State {
    unit: DVector<f64>,
    /// Posterior variance over prior variance.
    variance: Vec<f64>,
    log_det: f64,
    /// c ᵀ(S + s²D⁻¹)⁻¹c / s².
    explained: f64,
}

impl State {
    fn of(
        information: &DMatrix<f64>,
        gradient: &DVector<f64>,
        groups: &[Range<usize>],
        sizes: &[f64],
        noise2: f64,
    ) -> Option<Self> {
        let m = gradient.len();
        let mut size = vec![0.0; m];
        for (range, s) in groups.iter().zip(sizes) {
            size[range.clone()].fill(*s);
        }
        let kept: Vec<usize> = (0..m).filter(|&k| size[k] > 0.0).collect();
        let mut normal = DMatrix::from_fn(kept.len(), kept.len(), |a, b| {
            let (a, b) = (kept[a], kept[b]);
            size[a] * information[(a, b)] * size[b] / noise2 + f64::from(u8::from(a == b))
        });
        factored(&mut normal).then_some(())?;
        let right = DVector::from_iterator(kept.len(), kept.iter().map(|&k| size[k] * gradient[k] / noise2));
        let step = back_and_forth(&normal, &right)?;
        let inverse = solved(&normal, DMatrix::identity(kept.len(), kept.len()));
        let mut out = Self {
            unit: DVector::zeros(m),
            variance: vec![1.0; m],
            log_det: 2.0 * normal.diagonal().iter().map(|d| d.ln()).sum::<f64>(),
            explained: right.dot(&step),
        };
        for (a, &k) in kept.iter().enumerate() {
            out.unit[k] = -step[a];
            out.variance[k] = inverse.column(a).norm_squared();
        }
        Some(out)
    }

    fn coefficients(&self, groups: &[Range<usize>], sizes: &[f64]) -> DVector<f64> {
        let mut out = self.unit.clone();
        for (range, s) in groups.iter().zip(sizes) {
            out.rows_mut(range.start, range.len()).apply(|v| *v *= s);
        }
        out
    }
}
