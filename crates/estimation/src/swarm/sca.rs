//! Sine cosine algorithm.
//!
//! **Method.** u ← u + r₁ sin r₂ |r₃ P − u| or, with even odds, u + r₁ cos r₂ |r₃ P − u|, where P is the best
//! position so far, r₂ uniform in [0, 2π), r₃ in [0, 2), and r₁ falls linearly from a = 2 to 0.
//! - [`Form::AsPrinted`]: as above. |r₃ P − u| depends on the origin: the method is biased towards u = 0, which is the start
//!   here. This is an advantage for deviations from a data sheet, most of which are small.
//! - [`Form::Robust`]: r₃ = 1, so that only differences of positions count, and a member moves only if that lowers its
//!   cost; the start is a member.
//!
//! **Shapes.** u in [−1, 1]ᵖ, clamped to the box.
//!
//! **Stops.** *IterationLimit*, *SmallResidual*, *NotFinite*.
//!
//! **Source and departures.** M4 of ltlm-2024, without equations: Mirjalili, "SCA: a sine cosine algorithm for
//! solving optimization problems", 2016, eq. 3.1 to 3.4.
//!
//! **Checked against** published problems of few parameters, and the pull towards the origin.

use std::f64::consts::TAU;

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
        /// Members.
        pub population: usize = 30,
        /// Iterations.
        pub max_iterations: usize = 500,
        /// a: first size of the moves.
        pub amplitude: f64 = 2.0,
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
    /// The algorithm of 2016, without priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, ..Self::default() }
    }
}

/// Searches the box around `start`.
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let n = options.population.max(1);
    let robust = options.form == Form::Robust;
    let mut search = Search::new(problem, start, &options.region, options.priors, options.small_cost);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut members: Vec<Vec<f64>> = (0..n).map(|_| uniform_position(&mut rng, p)).collect();
    if robust {
        members[0].fill(0.0);
    }
    let mut costs = search.costs(&members);
    for iteration in 0..options.max_iterations {
        let r1 = options.amplitude * (1.0 - iteration as f64 / options.max_iterations as f64);
        let best = search.best.clone();
        let mut moved = members.clone();
        for member in &mut moved {
            for (u, best) in member.iter_mut().zip(&best) {
                let r2 = rng.random_range(0.0..TAU);
                let r3 = if robust { 1.0 } else { rng.random_range(0.0..2.0) };
                let wave = if rng.random::<f64>() < 0.5 { r2.sin() } else { r2.cos() };
                *u = (*u + r1 * wave * (r3 * best - *u).abs()).clamp(-1.0, 1.0);
            }
        }
        let new = search.costs(&moved);
        for (i, member) in moved.into_iter().enumerate() {
            if !robust || new[i] < costs[i] {
                costs[i] = new[i];
                members[i] = member;
            }
        }
        let step = distance(&best, &search.best);
        if search.note(step, r1) {
            break;
        }
    }
    search.finish()
}
