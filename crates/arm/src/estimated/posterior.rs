//! The posterior of an arm's parameters, when the manufacturing tolerances that act as priors are uncertain themselves.
//!
//! The covariance Σ of an estimate x (deviations from nominal) rests on priors of assumed widths T. The data determine those widths
//! from a few numbers only: for lengths, twists and joint zeros, ln (T'/T) ~ N(m, V). Given widths T', the estimate is normal with
//!
//! Σ' = (Σ⁻¹ + D)⁻¹,  x' − x = −Σ' D x,  D = T'⁻² − T⁻²,
//!
//! so the posterior over all widths is a mixture of normal distributions: heavier tails than N(x, Σ), and narrower shoulders.
//! N(m, V) is replaced by six points at ±√3 standard deviations along its principal axes, with equal weights: along each axis that
//! is the Gauss–Hermite rule of three points, exact to degree five (the unscented rule of Julier and Uhlmann 1997 with κ = 0).

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};

use super::Estimated;
use super::width_uncertainty::{PosteriorComponent, WidthUncertainty};

impl Estimated {
    /// The posterior of the arm's parameters as a mixture of normal distributions; the single N(x, Σ) if the widths of the tolerances
    /// are certain.
    pub fn posterior(&self) -> Vec<PosteriorComponent> {
        self.width_uncertainty.as_ref().and_then(|widths| self.mixture(widths)).unwrap_or_else(|| {
            let (shift, covariance) = (DVector::zeros(self.order.len()), self.covariance.clone());
            vec![PosteriorComponent { weight: 1.0, shift, covariance }]
        })
    }

    /// For each parameter in order, whether the measurement gave less than half of what is known of it: the rest is its tolerance.
    pub fn unseen(&self) -> Vec<bool> {
        let of = |k: usize| self.parameters.get(k).is_some_and(|known| known.determined < 0.5);
        (0..self.order.len()).map(of).collect()
    }

    /// `None` if Σ has no inverse, or if D makes Σ⁻¹ + D indefinite: doubtful causes are added to Σ, which can then exceed the priors.
    fn mixture(&self, widths: &WidthUncertainty) -> Option<Vec<PosteriorComponent>> {
        let n = self.order.len();
        if n == 0 || self.parameters.len() < n {
            return None;
        }
        // In units of the priors, so that millimetres and radians are commensurable.
        let prior =
            |k: usize| self.parameters[k].prior_sigma.filter(|_| self.order[k].tolerance_group().is_some());
        let unit: Vec<f64> =
            (0..n).map(|k| prior(k).unwrap_or_else(|| self.covariance[(k, k)].sqrt())).collect();
        if unit.iter().any(|unit| !(*unit > 0.0)) {
            return None;
        }
        let scaled = DMatrix::from_fn(n, n, |i, j| self.covariance[(i, j)] / (unit[i] * unit[j]));
        let precision = Cholesky::new(scaled)?.inverse();
        let points = widths.points();
        let component = |logs: &Vector3<f64>| {
            let added = DVector::from_fn(n, |k, _| match self.order[k].tolerance_group() {
                Some(group) if prior(k).is_some() => (-2.0 * logs[group as usize]).exp() - 1.0,
                _ => 0.0,
            });
            let factor = Cholesky::new(&precision + DMatrix::from_diagonal(&added))?;
            let row = &self.parameters;
            let moved = factor
                .solve(&DVector::from_fn(n, |k, _| added[k] * (row[k].value - row[k].nominal) / unit[k]));
            let own = factor.inverse();
            Some(PosteriorComponent {
                weight: 1.0 / points.len() as f64,
                shift: DVector::from_fn(n, |k, _| -moved[k] * unit[k]),
                covariance: DMatrix::from_fn(n, n, |i, j| own[(i, j)] * unit[i] * unit[j]),
            })
        };
        points.iter().map(component).collect()
    }
}
