//! Result of a solver: parameters, covariance, cost, effort and termination.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The result of a solver. The cost is always that at `x`, even if the search failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Parameters, p entries, in the units of the problem.
    pub x: Vec<f64>,
    /// Covariance of `x`, p × p: the inverse of the normal matrix with priors (batch solvers), or the covariance of a
    /// filter's state. `None` if that matrix is singular or the method has none (swarms).
    pub covariance: Option<DMatrix<f64>>,
    /// ½ Σ r² plus the priors' share, at `x`; without the priors if the solver ignores them.
    pub cost: f64,
    /// Rows evaluated by the search.
    pub evaluations: Evaluations,
    /// Termination of the search.
    pub termination: Termination,
    /// One entry for each iteration, starting with the initial point.
    pub trace: Vec<Iteration>,
}

impl Estimate {
    /// 1σ of each parameter, or `None` without a covariance.
    pub fn sigmas(&self) -> Option<Vec<f64>> {
        self.covariance.as_ref().map(|c| c.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect())
    }
}

/// Work done, counted in rows (scalar residuals), so that batch methods, filters and swarms can be compared.
/// Divide by [`crate::problem::Problem::rows`] for passes over the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Evaluations {
    /// Rows evaluated without derivatives.
    pub residuals: u64,
    /// Rows evaluated with derivatives.
    pub jacobians: u64,
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Termination {
    /// The residual vector is orthogonal to every column of the Jacobian within tolerance.
    Gradient,
    /// The step is negligible against the parameters, with little damping.
    Step,
    /// The predicted reduction is a negligible part of the cost.
    Cost,
    /// The residuals vanish.
    SmallResidual,
    /// Every observation was processed as often as required (filters and other one-pass methods).
    DataProcessed,
    /// The iteration limit was reached.
    IterationLimit,
    /// No step improves the cost although no convergence test holds.
    Stalled,
    /// The cost, a residual or a derivative was not a finite number; `x` is the last finite point.
    NotFinite,
    /// A matrix that the method must invert is singular, and the method has no remedy.
    Singular,
}

impl Termination {
    /// Whether a convergence test held. A one-pass method that has processed all data is *finished* but does not claim a
    /// minimum, so it has not converged.
    ///
    /// ```
    /// use truegrind_estimation::estimate::Termination;
    ///
    /// assert!(Termination::Gradient.is_converged());
    /// // Processing every row is neither convergence to a minimum nor a failure.
    /// assert!(!Termination::DataProcessed.is_converged() && !Termination::DataProcessed.is_failure());
    /// assert_eq!(Termination::DataProcessed.to_string(), "all rows taken in");
    /// ```
    pub fn is_converged(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Cost | Self::SmallResidual)
    }

    /// Whether the result is unusable.
    pub fn is_failure(self) -> bool {
        matches!(self, Self::NotFinite | Self::Singular)
    }
}

impl std::fmt::Display for Termination {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Gradient => "converged: gradient",
            Self::Step => "converged: step",
            Self::Cost => "converged: cost",
            Self::SmallResidual => "converged: residuals vanish",
            Self::DataProcessed => "all rows taken in",
            Self::IterationLimit => "iteration limit",
            Self::Stalled => "stalled",
            Self::NotFinite => "not finite",
            Self::Singular => "singular",
        })
    }
}

/// One iteration of a search.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Iteration {
    /// Cost at the end of the iteration.
    pub cost: f64,
    /// The same without the priors' share, if the method computes it separately.
    pub row_cost: Option<f64>,
    /// Euclidean length of the step in the method's scaling; 0 for a refused step.
    pub step_norm: f64,
    /// Damping μ (Levenberg–Marquardt), step size (beetle, variable step size), forgetting factor, inertia.
    pub damping: Option<f64>,
    /// Largest cosine between the residual vector and a column of the Jacobian, at the beginning or the end of the
    /// iteration, depending on the method.
    pub gradient_norm: Option<f64>,
    /// Rows evaluated up to the end of this iteration.
    pub evaluations: Evaluations,
}
