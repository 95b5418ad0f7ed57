//! Differential evolution.
//!
//! **Method.** For each member i a mutant from others of the population, crossed with i coordinate by
//! coordinate (CR, one coordinate always from the mutant); the better of the two stays.
//! - [`Form::AsPrinted`]: rand/1/bin, u_a + F(u_b − u_c), F = 0.5, CR = 0.9.
//! - [`Form::Robust`]: current-to-best/1/bin, u_i + F(best − u_i) + F(u_a − u_b), F drawn anew in [0.5, 1) for
//!   each member (dither), CR = 0.9; the start is a member.
//!
//! **Shapes.** u in [−1, 1]ᵖ; a coordinate that leaves the box is set halfway between the wall and its previous value.
//!
//! **Stops.** *IterationLimit*, *SmallResidual*, *NotFinite*.
//!
//! **Source and departures.** M7 of ukf-vslm-2023, without equations. Printed: Storn and Price, "Differential
//! evolution", 1997; its advice of ten members for each parameter is the default (`population` 0). Robust: Das
//! and Suganthan, "Differential evolution: a survey of the state-of-the-art", 2011.
//!
//! **Checked against** published problems of few parameters.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::estimate::Estimate;
use crate::least_squares::Form;
use crate::problem::Problem;
use crate::swarm::{Region, Search, distance, uniform_position};

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// Members; 0 for ten times the number of parameters.
        pub population: usize = 0,
        /// Generations.
        pub max_iterations: usize = 300,
        /// F of the printed form.
        pub factor: f64 = 0.5,
        /// CR.
        pub crossover: f64 = 0.9,
        /// Search box.
        pub region: Region = Region::default(),
        /// Whether the cost includes the priors of the problem.
        pub priors: bool = true,
        /// Stop when the cost is below this.
        pub small_cost: f64 = 1e-20,
        /// Seed of all random draws.
        pub seed: u64 = 0,
    }
}

impl Options {
    /// rand/1/bin, without priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, ..Self::default() }
    }
}

/// Searches the box around `start`.
///
/// ```
/// use truegrind_estimation::examples::Line;
/// use truegrind_estimation::swarm::de;
///
/// // A straight line, from the costs alone: near 1.50 and 0.20, not reported as converged, and reproducible with the same seed.
/// let found = de::solve(&Line, &[0.0, 0.0], &de::Options::default());
/// assert!((found.x[0] - 1.50).abs() < 0.02 && (found.x[1] - 0.20).abs() < 0.01, "{:?}", found.x);
/// assert!(!found.termination.is_converged() && found.covariance.is_none());
/// assert_eq!(found.x, de::solve(&Line, &[0.0, 0.0], &de::Options::default()).x);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let n = if options.population == 0 { 10 * p } else { options.population }.max(4);
    let mut search = Search::new(problem, start, &options.region, options.priors, options.small_cost);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut members: Vec<Vec<f64>> = (0..n).map(|_| uniform_position(&mut rng, p)).collect();
    if options.form == Form::Robust {
        members[0].fill(0.0);
    }
    let mut costs = search.costs(&members);
    for _ in 0..options.max_iterations {
        if p == 0 {
            break;
        }
        let best = search.best.clone();
        let mut trials = Vec::with_capacity(n);
        for (i, member) in members.iter().enumerate() {
            let [a, b, c] = three_others(&mut rng, n, i);
            let factor =
                if options.form == Form::Robust { rng.random_range(0.5..1.0) } else { options.factor };
            let always = rng.random_range(0..p);
            let mut trial = member.clone();
            for k in 0..p {
                if k != always && rng.random::<f64>() >= options.crossover {
                    continue;
                }
                let mutant = match options.form {
                    Form::AsPrinted => members[a][k] + factor * (members[b][k] - members[c][k]),
                    Form::Robust => {
                        member[k] + factor * (best[k] - member[k]) + factor * (members[a][k] - members[b][k])
                    }
                };
                trial[k] = if mutant.abs() > 1.0 { 0.5 * (mutant.signum() + member[k]) } else { mutant };
            }
            trials.push(trial);
        }
        let trial_costs = search.costs(&trials);
        for (i, trial) in trials.into_iter().enumerate() {
            if trial_costs[i] <= costs[i] {
                costs[i] = trial_costs[i];
                members[i] = trial;
            }
        }
        let moved = distance(&best, &search.best);
        if search.note(moved, options.factor) {
            break;
        }
    }
    search.finish()
}

/// Three different members, none of them `i`.
fn three_others(rng: &mut ChaCha8Rng, n: usize, i: usize) -> [usize; 3] {
    let mut chosen = [i; 3];
    for k in 0..3 {
        chosen[k] = loop {
            let candidate = rng.random_range(0..n);
            if candidate != i && !chosen[..k].contains(&candidate) {
                break candidate;
            }
        };
    }
    chosen
}
