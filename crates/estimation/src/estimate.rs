//! What a solver hands back: the parameters, how sure they are, what they cost, and how the search ended.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The result of a solver. Nothing here is hidden: the cost is the cost at `x`, also where the search failed.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Parameters, p entries, in the units of the problem.
    pub x: Vec<f64>,
    /// Covariance of `x`, p × p: the inverse of the normal matrix with priors (batch solvers), or what a filter
    /// carries. `None` where that matrix is singular or the method has none (swarms).
    pub covariance: Option<DMatrix<f64>>,
    /// ½ Σ r² plus the priors' share, at `x`. Where the solver was told to ignore priors they are left out.
    pub cost: f64,
    /// What the search cost.
    pub evaluations: Evaluations,
    /// How the search ended.
    pub termination: Termination,
    /// One entry for each iteration, the start first.
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
    /// Rows whose residual was evaluated alone.
    pub residuals: u64,
    /// Rows whose residual and derivatives were evaluated together.
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
    /// What is still to gain is a negligible part of the cost.
    Cost,
    /// Nothing is left to explain: the residuals vanish.
    SmallResidual,
    /// Every observation was taken in as often as asked (filters and other one-pass methods).
    DataProcessed,
    /// The iterations allowed are used up.
    IterationLimit,
    /// No step improves the cost although none of the tests of convergence holds.
    Stalled,
    /// The cost, a residual or a derivative was not a finite number; `x` is the last finite point.
    NotFinite,
    /// A matrix that the method must invert is singular, and the method has no remedy.
    Singular,
}

impl Termination {
    /// Whether a test of convergence held. A one-pass method that has seen all data is *finished* but does not
    /// claim a minimum, so it is not converged.
    ///
    /// ```
    /// use truegrind_estimation::estimate::Termination;
    ///
    /// assert!(Termination::Gradient.is_converged());
    /// // To have seen every row is not to stand at a minimum, and no failure either.
    /// assert!(!Termination::DataProcessed.is_converged() && !Termination::DataProcessed.is_failure());
    /// assert_eq!(Termination::DataProcessed.to_string(), "all rows taken in");
    /// ```
    pub fn is_converged(self) -> bool {
        matches!(self, Self::Gradient | Self::Step | Self::Cost | Self::SmallResidual)
    }

    /// Whether the result is unusable as it stands.
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

/// One line of the story of a search.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Iteration {
    /// Cost at the point the iteration ended on.
    pub cost: f64,
    /// The same without the priors' share, where the method knows it apart.
    pub row_cost: Option<f64>,
    /// Euclidean length of the step in the method's own scaling; 0 where the step was refused.
    pub step_norm: f64,
    /// Damping μ (Levenberg–Marquardt), step size (beetle, variable step size), forgetting factor, inertia.
    pub damping: Option<f64>,
    /// Largest cosine between the residual vector and a column of the Jacobian, at the point the iteration
    /// began on or ended on, as the method has it.
    pub gradient_norm: Option<f64>,
    /// Everything evaluated up to the end of this iteration.
    pub evaluations: Evaluations,
}
