//! Logistic-tent chaotic Levenberg–Marquardt (LTLM).
//!
//! **Method** (ltlm-2024, Algorithm I). Two Levenberg–Marquardt steps x_k → x₁ → x₂ (eq. 13, 14), midpoints a =
//! (x_k + x₁)/2 and b = (x₁ + x₂)/2 (eq. 15), chaotic numbers N_1 … N_M in [0, 1) (eq. 11), candidates x₁ − (x₁
//! − a)N_m and x₁ + (x₂ − b)N_m (eq. 16, 17); the best of them and x₁ starts the next iteration (eq. 18).
//!
//! **Properties.** N_m is one scalar for a whole candidate, so this is a line search on the inner halves of [x_k, x₁] and
//! [x₁, x₂]. Eq. 17 is correct as printed: x₂ − b = b − x₁. x₂ itself is never a candidate, so an iteration costs two
//! Jacobians and ends at best halfway between the first and the second Levenberg–Marquardt step: compare methods per
//! Jacobian, not per iteration. An iteration needs two Jacobian passes (the second includes the cost of x₁) and 2M passes
//! of residuals, 2M + 1 evaluations in the paper's count.
//!
//! **Shapes.** As in [`lm`](crate::least_squares::lm).
//!
//! **Stops.** Those of `lm`; as printed, K iterations or no relative change of the cost.
//!
//! **Source and departures.** Liu et al. 2024. M, N₀ and K are not stated: here 10, 0.37 and 60 by default, and
//! the sequence N runs on from iteration to iteration. Eq. 15 mixes k and k + 1 and Algorithm I writes J_{k+1}
//! where J_{k,1} (at x₁) is meant; both are interpreted so. f in eq. 10, 13 is the residual vector, not the scalar of
//! eq. 8. μ = 5 has no unit: see `lm`. The printed form does not compare with x_k, so its cost can rise. Robust form: both
//! steps scaled and damped by Nielsen's rule as in `lm`, the iteration accepted only if its best candidate lowers the cost,
//! and x₂ also a candidate (`second_step`), since otherwise the second Jacobian is wasted.
//!
//! **Checked against** `lm` on the same published problems, and the counts above.

use crate::chaos::map::{Map, Sequence};
use crate::estimate::{Estimate, Termination};
use crate::least_squares::damped::{DampedSystem, Linearisation};
use crate::least_squares::search::{Damping, Point, Search, converged};
use crate::least_squares::{Factorisation, Form};
use crate::objective::Objective;
use crate::problem::Problem;

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// How the two steps are computed.
        pub factorisation: Factorisation = Factorisation::Cholesky,
        /// μ of the printed form; 5 in the paper.
        pub mu: f64 = 5.0,
        /// First μ of the robust form, a pure number.
        pub initial_damping: f64 = 1e-6,
        /// M: candidates on each side. Not stated in the paper.
        pub candidates: usize = 10,
        /// Whether x₂ is also a candidate (robust), unlike in the paper's eq. 18.
        pub second_step: bool = true,
        /// The map that spreads the candidates: eq. 11 with r = 0.5.
        pub map: Map = Map::LogisticTent { r: 0.5 },
        /// N₀: where the sequence starts. Not stated in the paper.
        pub first: f64 = 0.37,
        /// Whether the priors of the problem are used. The paper has none.
        pub priors: bool = true,
        /// K: most iterations. Not stated in the paper.
        pub max_iterations: usize = 60,
        /// Stop when the predicted reduction (as printed: the relative change) is below this share of the cost.
        pub cost_tolerance: f64 = 1e-10,
        /// Stop when the largest cosine between residuals and a column of J is below this (robust).
        pub gradient_tolerance: f64 = 1e-12,
        /// Stop when the cost itself is below this.
        pub small_cost: f64 = 1e-20,
        /// Unused: `map` and `first` determine the sequence. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// The paper's setting: μ = 5, unscaled, no prior, x₂ no candidate.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, second_step: false, ..Self::default() }
    }
}

/// Minimises the cost of `problem` from `start`.
///
/// ```
/// use truegrind_estimation::examples::Valley;
/// use truegrind_estimation::least_squares::ltlm;
///
/// // From the usual start to the end of the valley.
/// let found = ltlm::solve(&Valley, &[-1.2, 1.0], &ltlm::Options::default());
/// assert!(found.termination.is_converged(), "{}", found.termination);
/// assert!((found.x[0] - 1.0).abs() < 1e-4 && (found.x[1] - 1.0).abs() < 1e-4);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let printed = options.form == Form::AsPrinted;
    let mut objective = Objective::new(problem, start, options.priors);
    let (mut here, mut trace) = Point::begin(&mut objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(&objective, Termination::NotFinite, trace);
    }
    let mut system = if printed { DampedSystem::unscaled(p) } else { DampedSystem::new(p) };
    let mut damping = Damping::new(if printed { options.mu } else { options.initial_damping });
    let mut sequence = options.map.sequence(options.first);
    let (mut x1, mut x2) = (vec![0.0; p], vec![0.0; p]);
    for _ in 0..options.max_iterations {
        let cost = here.at.cost();
        let cosine = system.enter(&here.at);
        let tolerance = (!printed).then_some(options.gradient_tolerance);
        if let Some(end) = here.end(options.small_cost, cosine, tolerance) {
            return here.finish(&objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, damping.mu, &here.x, &mut x1) else {
            if printed || damping.is_exhausted() {
                return here.finish(&objective, Termination::Singular, trace);
            }
            damping.refuse();
            continue;
        };
        let search = Search { damping, cosine, cost_tolerance: options.cost_tolerance, step_tolerance: 0.0 };
        if !printed && let Some(end) = converged(&mut system, &here, &predicted, &search) {
            return here.finish(&objective, end, trace);
        }
        let at1 = Linearisation::at(&mut objective, &x1, options.factorisation);
        let gain = (cost - at1.cost()) / predicted.reduction;
        if !(at1.is_finite() && (printed || damping.is_acceptable(gain))) {
            if printed {
                return here.finish(&objective, Termination::NotFinite, trace);
            }
            damping.refuse();
            trace.push(here.entry(0.0, Some(damping.mu), Some(cosine), &objective));
            if damping.is_exhausted() {
                return here.finish(&objective, Termination::Stalled, trace);
            }
            continue;
        }
        if !printed {
            damping.accept(gain);
        }
        system.enter(&at1);
        if system.step(&at1, damping.mu, &x1, &mut x2).is_none() {
            x2.copy_from_slice(&x1);
        }
        let best = best_candidate(&mut objective, options, &mut sequence, [&here.x, &x1, &x2]);
        let before = std::mem::take(&mut here.x);
        // The cost of x₁ was computed with its derivatives, which are reused if x₁ is the best.
        here = match best {
            Some((x, candidate_cost)) if candidate_cost < at1.cost() => {
                Point { at: Linearisation::at(&mut objective, &x, options.factorisation), x }
            }
            _ => Point { x: x1.clone(), at: at1 },
        };
        if !here.at.is_finite() {
            return here.finish(&objective, Termination::NotFinite, trace);
        }
        let moved = before.iter().zip(&here.x).map(|(a, b)| b - a).collect::<Vec<_>>();
        trace.push(here.entry(system.scaled_norm(&moved), Some(damping.mu), Some(cosine), &objective));
        if printed && (cost - here.at.cost()).abs() <= options.cost_tolerance * cost {
            return here.finish(&objective, Termination::Cost, trace);
        }
    }
    here.finish(&objective, Termination::IterationLimit, trace)
}

/// Equations 16 to 18 without x₁, whose cost is known: the best finite candidate.
fn best_candidate(
    objective: &mut Objective<'_>,
    options: &Options,
    sequence: &mut Sequence,
    [x, x1, x2]: [&[f64]; 3],
) -> Option<(Vec<f64>, f64)> {
    let mut best: Option<(Vec<f64>, f64)> = None;
    let mut consider = |candidate: Vec<f64>| {
        let cost = objective.cost(&candidate);
        if cost.is_finite() && best.as_ref().is_none_or(|(_, lowest)| cost < *lowest) {
            best = Some((candidate, cost));
        }
    };
    let between = |from: &[f64], to: &[f64], share: f64| -> Vec<f64> {
        from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect()
    };
    for n in sequence.by_ref().take(options.candidates) {
        // x₁ − (x₁ − a)N = x₁ + ½N (x − x₁), and x₁ + (x₂ − b)N = x₁ + ½N (x₂ − x₁).
        consider(between(x1, x, 0.5 * n));
        consider(between(x1, x2, 0.5 * n));
    }
    if options.form == Form::Robust && options.second_step {
        consider(x2.to_vec());
    }
    best
}
