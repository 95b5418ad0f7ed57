//! Shared by the Levenberg–Marquardt methods: state of a search, damping, convergence tests.

use crate::estimate::{Estimate, Iteration, Termination};
use crate::least_squares::Factorisation;
use crate::least_squares::damped::{DampedSystem, Linearisation, PredictedReduction};
use crate::objective::Objective;

/// Current point of a search.
pub(crate) struct Point {
    pub(crate) x: Vec<f64>,
    pub(crate) at: Linearisation,
}

impl Point {
    /// The linearised start and its trace entry.
    pub(crate) fn begin(
        objective: &mut Objective<'_>,
        start: &[f64],
        factorisation: Factorisation,
    ) -> (Self, Vec<Iteration>) {
        let at = Linearisation::at(objective, start, factorisation);
        let first = Iteration { cost: at.cost(), evaluations: objective.evaluations, ..Iteration::default() };
        (Self { x: start.to_vec(), at }, vec![first])
    }

    /// Trace entry of an iteration that ends here.
    pub(crate) fn entry(
        &self,
        step_norm: f64,
        damping: Option<f64>,
        cosine: Option<f64>,
        objective: &Objective<'_>,
    ) -> Iteration {
        let (cost, evaluations) = (self.at.cost(), objective.evaluations);
        Iteration { cost, row_cost: None, step_norm, damping, gradient_norm: cosine, evaluations }
    }

    /// The tests that need no step: the cost itself, and the largest cosine between residuals and a column of J, if a
    /// tolerance is given for it.
    pub(crate) fn end(&self, small_cost: f64, cosine: f64, tolerance: Option<f64>) -> Option<Termination> {
        if self.at.cost() <= small_cost {
            return Some(Termination::SmallResidual);
        }
        tolerance.is_some_and(|tolerance| cosine <= tolerance).then_some(Termination::Gradient)
    }

    pub(crate) fn finish(
        self,
        objective: &Objective<'_>,
        termination: Termination,
        trace: Vec<Iteration>,
    ) -> Estimate {
        let covariance = if self.at.is_finite() { self.at.covariance() } else { None };
        let (cost, evaluations) = (self.at.cost(), objective.evaluations);
        Estimate { x: self.x, covariance, cost, evaluations, termination, trace }
    }
}

/// Nielsen's rule for μ, which also remembers what was refused and what worked: in a curved valley μ otherwise falls below the
/// least μ that works after every few steps, and each refusal costs several steps to come back.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Damping {
    pub(crate) mu: f64,
    growth: f64,
    /// μ of the last accepted step.
    accepted: f64,
    /// A refused μ, which fades with every accepted step.
    refused: f64,
    /// Steps refused since the last accepted one.
    pub(crate) refusals: usize,
}

/// Smallest and largest μ with an effect beside a unit diagonal in double precision.
pub(crate) const DAMPING_RANGE: (f64, f64) = (1e-16, 1e16);

/// μ after the first refusal: less would hardly change the refused step.
const FIRST_REFUSAL: f64 = 1e-3;

/// Least μ after an accepted step, relative to the refused one that is remembered.
const ABOVE_REFUSED: f64 = 3.0;

/// Share of the refused μ that an accepted step leaves.
const FADING: f64 = 0.3;

impl Damping {
    pub(crate) fn new(mu: f64) -> Self {
        Self {
            mu: mu.clamp(DAMPING_RANGE.0, DAMPING_RANGE.1),
            growth: 2.0,
            accepted: f64::INFINITY,
            refused: 0.0,
            refusals: 0,
        }
    }

    /// Whether a step with this gain ratio is accepted. A nearly undamped step must achieve a quarter of the predicted
    /// reduction: otherwise one leap from a distant start can end on a plateau from which the search does not return.
    pub(crate) fn is_acceptable(&self, gain: f64) -> bool {
        gain > if self.mu < FIRST_REFUSAL { 0.25 } else { 1e-4 }
    }

    /// Updates μ after an accepted step; `gain` is actual over predicted reduction.
    pub(crate) fn accept(&mut self, gain: f64) {
        let factor =
            if (gain - 1.0).abs() < 0.1 { 0.1 } else { (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0) };
        self.accepted = self.mu;
        self.mu = (self.mu * factor).max((ABOVE_REFUSED * self.refused).min(self.mu)).max(DAMPING_RANGE.0);
        self.refused *= FADING;
        self.growth = 2.0;
        self.refusals = 0;
    }

    pub(crate) fn refuse(&mut self) {
        self.refused = self.mu;
        // Where more damping has worked, less than that is not skipped.
        let least = if self.accepted > self.mu { self.accepted.min(FIRST_REFUSAL) } else { FIRST_REFUSAL };
        self.mu = (self.mu * self.growth).max(least).min(DAMPING_RANGE.1);
        self.growth *= 2.0;
        self.refusals += 1;
    }

    pub(crate) fn is_exhausted(&self) -> bool {
        self.mu >= DAMPING_RANGE.1
    }
}

/// State of a search for the convergence tests.
pub(crate) struct Search {
    pub(crate) damping: Damping,
    pub(crate) cosine: f64,
    pub(crate) cost_tolerance: f64,
    pub(crate) step_tolerance: f64,
}

/// Convergence tests that need a step: predicted reduction of the cost, and step size. A small prediction under heavy
/// damping is inconclusive, so it is repeated almost without damping. If the undamped model predicts more than the problem
/// achieves (large residuals), a small prediction after refusals counts as converged if the gradient is also small.
pub(crate) fn converged(
    system: &mut DampedSystem,
    here: &Point,
    predicted: &PredictedReduction,
    search: &Search,
) -> Option<Termination> {
    const LIGHT: f64 = 1e-8;
    const SMALL_COSINE: f64 = 1e-5;
    let enough = search.cost_tolerance * here.at.cost();
    let tiny = search.step_tolerance * (system.scaled_norm(&here.x) + search.step_tolerance);
    if predicted.reduction > enough && predicted.step_norm > tiny {
        return None;
    }
    if search.damping.mu <= LIGHT {
        return Some(if predicted.reduction <= enough { Termination::Cost } else { Termination::Step });
    }
    let mut unused = vec![0.0; here.x.len()];
    match system.step(&here.at, LIGHT, &here.x, &mut unused) {
        Some(light) if light.reduction <= enough => Some(Termination::Cost),
        Some(light) if light.step_norm <= tiny => Some(Termination::Step),
        _ if search.damping.refusals > 0 && search.cosine <= SMALL_COSINE => Some(Termination::Cost),
        _ if search.damping.refusals > 0 => Some(Termination::Stalled),
        _ => None,
    }
}
