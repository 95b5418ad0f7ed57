//! Levenberg–Marquardt with a variable step size (VSLM).
//!
//! **Method.** x ← x − δ_t (JᵀJ + λI)⁻¹ Jᵀr, δ_{t+1} = μ δ_t (ukf-vslm-2023 eq. 15), δ₀ = 0.8, μ = 0.95.
//! - [`Form::AsPrinted`] with [`Decay::PerSample`]: Algorithm 1 to the letter. Inside each iteration a loop
//!   over the samples applies eq. 15 to one sample after the other (its row of J, its residual), and δ decays at each:
//!   0.95¹⁰⁰ = 0.006, so after one pass over 100 rows the steps vanish, and the first rows determine the result.
//! - [`Form::AsPrinted`] with [`Decay::PerIteration`]: eq. 15 with all rows, δ decaying once for each pass. The
//!   steps sum to a finite length: the remaining share of a linear error is about e^(−δ₀/(1 − μ)) = e^(−16).
//! - [`Form::Robust`]: scaled columns and Nielsen's damping as in [`lm`](crate::least_squares::lm);
//!   δ is halved when a step is refused and grows (÷ μ, at most 1) when one is accepted.
//!
//! **Shapes.** As in `lm`.
//!
//! **Stops.** Robust: as `lm`. As printed: relative change of cost below tolerance, or the iterations (20, Table
//! IX).
//!
//! **Source and departures.** Li et al. 2023, eq. 15, Algorithm 1 lines 16 to 21. λ is not stated; 5 is taken
//! over from ltlm-2024, by the same group. The paper's sign is that of E = Z − Z′. Its line 17 (X₀ = x_ukf
//! inside the loop) discards each iteration: option `restart`, off unless
//! [`ukf_vslm`](crate::filter::ukf_vslm) sets it. A fixed decay is not suitable for every problem: it limits the total
//! length of the steps in advance.
//!
//! **Checked against** the printed recurrence by hand, and published minima for the robust form.

use serde::{Deserialize, Serialize};

use crate::estimate::{Estimate, Termination};
use crate::least_squares::damped::{DampedSystem, Linearisation};
use crate::least_squares::search::{Damping, Point, Search, converged};
use crate::least_squares::{Factorisation, Form};
use crate::objective::Objective;
use crate::problem::{Problem, observations};

/// When δ decays in the printed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decay {
    /// After each observation, as in Algorithm 1.
    PerSample,
    /// After each pass over all rows, as in the text of eq. 15.
    #[default]
    PerIteration,
}

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// When δ decays (as printed).
        pub decay: Decay = Decay::PerIteration,
        /// λ of the printed form. Not stated in the paper.
        pub lambda: f64 = 5.0,
        /// δ₀: first step size.
        pub step_size: f64 = 0.8,
        /// μ: decay factor of δ.
        pub decay_factor: f64 = 0.95,
        /// Whether each iteration restarts from the initial point (Algorithm 1 line 17; as printed).
        pub restart: bool = false,
        /// How the robust form computes its step.
        pub factorisation: Factorisation = Factorisation::Cholesky,
        /// First damping of the robust form, a pure number.
        pub initial_damping: f64 = 1e-6,
        /// Whether the priors of the problem are used.
        pub priors: bool = true,
        /// Iteration limit.
        pub max_iterations: usize = 200,
        /// Stop when the predicted reduction (as printed: the relative change) is below this share of the cost.
        pub cost_tolerance: f64 = 1e-10,
        /// Stop when the largest cosine between residuals and a column of J is below this (robust).
        pub gradient_tolerance: f64 = 1e-12,
        /// Stop when the cost itself is below this.
        pub small_cost: f64 = 1e-20,
        /// Unused: the method is deterministic. Present so that all methods have the same fields.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// Algorithm 1 to the letter, 20 iterations.
    pub fn as_printed() -> Self {
        Self {
            form: Form::AsPrinted,
            decay: Decay::PerSample,
            priors: false,
            max_iterations: 20,
            ..Self::default()
        }
    }
}

/// Minimises the cost of `problem` from `start`.
///
/// ```
/// use truegrind_estimation::examples::Valley;
/// use truegrind_estimation::least_squares::vslm;
///
/// // From the usual start to the end of the valley.
/// let found = vslm::solve(&Valley, &[-1.2, 1.0], &vslm::Options::default());
/// assert!(found.termination.is_converged(), "{}", found.termination);
/// assert!((found.x[0] - 1.0).abs() < 1e-4 && (found.x[1] - 1.0).abs() < 1e-4);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let mut objective = Objective::new(problem, start, options.priors);
    match (options.form, options.decay) {
        (Form::AsPrinted, Decay::PerSample) => per_sample(&mut objective, start, options),
        (Form::AsPrinted, Decay::PerIteration) => per_iteration(&mut objective, start, options),
        (Form::Robust, _) => robust(&mut objective, start, options),
    }
}

fn per_sample(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let (mut here, mut trace) = Point::begin(objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(objective, Termination::NotFinite, trace);
    }
    let per = objective.problem.rows_per_observation().max(1);
    let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
    let mut delta = options.step_size;
    for _ in 0..options.max_iterations {
        let before = here.at.cost();
        let mut x = if options.restart { start.to_vec() } else { here.x.clone() };
        let mut moved = 0.0;
        for rows in observations(objective.problem) {
            objective.jacobian(&x, rows, &mut r, &mut j);
            for i in 0..per {
                // (jjᵀ + λI)⁻¹ j = j / (λ + jᵀj): eq. 15 for one row.
                let square: f64 = (0..p).map(|k| j[k * per + i].powi(2)).sum();
                let share = delta * r[i] / (options.lambda + square);
                (0..p).for_each(|k| x[k] -= share * j[k * per + i]);
                moved += share * share * square;
            }
            delta *= options.decay_factor;
        }
        let at = Linearisation::at(objective, &x, options.factorisation);
        if !at.is_finite() {
            return here.finish(objective, Termination::NotFinite, trace);
        }
        here = Point { x, at };
        trace.push(here.entry(moved.sqrt(), Some(delta), None, objective));
        if (before - here.at.cost()).abs() <= options.cost_tolerance * before {
            // The step size has vanished, which does not imply a minimum.
            return here.finish(objective, Termination::Stalled, trace);
        }
    }
    here.finish(objective, Termination::IterationLimit, trace)
}

fn per_iteration(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Estimate {
    let (mut here, mut trace) = Point::begin(objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(objective, Termination::NotFinite, trace);
    }
    let mut system = DampedSystem::unscaled(start.len());
    let mut trial = vec![0.0; start.len()];
    let mut delta = options.step_size;
    for _ in 0..options.max_iterations {
        let cosine = system.enter(&here.at);
        if let Some(end) = here.end(options.small_cost, cosine, None) {
            return here.finish(objective, end, trace);
        }
        let Some(predicted) = system.step(&here.at, options.lambda, &here.x, &mut trial) else {
            return here.finish(objective, Termination::Singular, trace);
        };
        let from = if options.restart { start } else { &here.x };
        let x: Vec<f64> = from
            .iter()
            .zip(&here.x)
            .zip(&trial)
            .map(|((from, x), trial)| from + delta * (trial - x))
            .collect();
        let at = Linearisation::at(objective, &x, options.factorisation);
        if !at.is_finite() {
            return here.finish(objective, Termination::NotFinite, trace);
        }
        let (before, after) = (here.at.cost(), at.cost());
        here = Point { x, at };
        trace.push(here.entry(delta * predicted.step_norm, Some(delta), Some(cosine), objective));
        delta *= options.decay_factor;
        if (before - after).abs() <= options.cost_tolerance * before {
            return here.finish(objective, Termination::Cost, trace);
        }
    }
    here.finish(objective, Termination::IterationLimit, trace)
}

fn robust(objective: &mut Objective<'_>, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let (mut here, mut trace) = Point::begin(objective, start, options.factorisation);
    if !here.at.is_finite() {
        return here.finish(objective, Termination::NotFinite, trace);
    }
    let mut system = DampedSystem::new(p);
    let mut damping = Damping::new(options.initial_damping);
    let mut delta = options.step_size;
    let mut trial = vec![0.0; p];
    let mut cosine = system.enter(&here.at);
    for _ in 0..options.max_iterations {
        let cost = here.at.cost();
        if let Some(end) = here.end(options.small_cost, cosine, Some(options.gradient_tolerance)) {
            return here.finish(objective, end, trace);
        }
        let predicted = system.step(&here.at, damping.mu, &here.x, &mut trial);
        if predicted.is_none() && damping.is_exhausted() {
            return here.finish(objective, Termination::Singular, trace);
        }
        let Some(predicted) = predicted else {
            damping.refuse();
            continue;
        };
        let search = Search { damping, cosine, cost_tolerance: options.cost_tolerance, step_tolerance: 0.0 };
        if let Some(end) = converged(&mut system, &here, &predicted, &search) {
            return here.finish(objective, end, trace);
        }
        trial.iter_mut().zip(&here.x).for_each(|(trial, x)| *trial = x + delta * (*trial - x));
        // Along the step the model predicts δ(2 − δ) of the whole reduction (exact without damping).
        let promised = delta * (2.0 - delta) * predicted.reduction;
        let at = Linearisation::at(objective, &trial, options.factorisation);
        let gain = (cost - at.cost()) / promised;
        let taken = at.is_finite() && damping.is_acceptable(gain);
        if taken {
            damping.accept(gain);
            here.at = at;
            std::mem::swap(&mut here.x, &mut trial);
            cosine = system.enter(&here.at);
        }
        let step_norm = if taken { delta * predicted.step_norm } else { 0.0 };
        trace.push(here.entry(step_norm, Some(delta), Some(cosine), objective));
        if taken {
            delta = (delta / options.decay_factor).min(1.0);
        } else {
            delta = (0.5 * delta).max(0.05);
            damping.refuse();
            if damping.is_exhausted() {
                return here.finish(objective, Termination::Stalled, trace);
            }
        }
    }
    here.finish(objective, Termination::IterationLimit, trace)
}
