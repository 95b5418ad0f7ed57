//! Particle swarm optimisation.
//!
//! **Method.** v ← ωv + c₁ρ₁(own best − u) + c₂ρ₂(best of all − u), u ← u + v, ρ uniform in [0, 1) for each
//! coordinate.
//! - [`Form::AsPrinted`]: ω falls linearly from 0.9 to 0.4, c₁ = c₂ = 2, |v| at most 0.4 (a fifth of the box).
//! - [`Form::Robust`]: Clerc's constriction (ω = 0.7298, c = 1.4962), for which a swarm is known to contract;
//!   the start is one of the particles.
//!
//! **Shapes.** u in [−1, 1]ᵖ; a particle that leaves the box is set on its wall and loses that component of its velocity.
//!
//! **Stops.** *IterationLimit*, *SmallResidual*, *NotFinite* where no particle ever had a finite cost.
//!
//! **Source and departures.** M4 of ukf-vslm-2023, without equations. Printed: Shi and Eberhart, "A modified
//! particle swarm optimizer", 1998. Robust: Clerc and Kennedy, "The particle swarm — explosion, stability, and
//! convergence", 2002.
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
        /// Particles.
        pub population: usize = 40,
        /// Iterations.
        pub max_iterations: usize = 500,
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
    /// The inertia weight of 1998, without priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, ..Self::default() }
    }
}

/// Searches the box around `start`.
///
/// ```
/// use truegrind_estimation::examples::Line;
/// use truegrind_estimation::swarm::pso;
///
/// // A straight line, from the costs alone: near 1.50 and 0.20, not reported as converged, and reproducible with the same seed.
/// let found = pso::solve(&Line, &[0.0, 0.0], &pso::Options::default());
/// assert!((found.x[0] - 1.50).abs() < 0.02 && (found.x[1] - 0.20).abs() < 0.01, "{:?}", found.x);
/// assert!(!found.termination.is_converged() && found.covariance.is_none());
/// assert_eq!(found.x, pso::solve(&Line, &[0.0, 0.0], &pso::Options::default()).x);
/// ```
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    let p = start.len();
    let n = options.population.max(1);
    let mut search = Search::new(problem, start, &options.region, options.priors, options.small_cost);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut positions: Vec<Vec<f64>> = (0..n).map(|_| uniform_position(&mut rng, p)).collect();
    if options.form == Form::Robust {
        positions[0].fill(0.0);
    }
    let mut velocities = vec![vec![0.0; p]; n];
    let mut own_costs = search.costs(&positions);
    let mut own = positions.clone();
    for iteration in 0..options.max_iterations {
        let share = iteration as f64 / options.max_iterations as f64;
        let (inertia, pull, limit) = match options.form {
            Form::AsPrinted => (0.9 - 0.5 * share, 2.0, 0.4),
            Form::Robust => (0.7298, 1.4962, 2.0),
        };
        let best = search.best.clone();
        for i in 0..n {
            for k in 0..p {
                let (r1, r2): (f64, f64) = (rng.random(), rng.random());
                let u = positions[i][k];
                let v = inertia * velocities[i][k] + pull * r1 * (own[i][k] - u) + pull * r2 * (best[k] - u);
                velocities[i][k] = v.clamp(-limit, limit);
                positions[i][k] = u + velocities[i][k];
                if positions[i][k].abs() > 1.0 {
                    positions[i][k] = positions[i][k].clamp(-1.0, 1.0);
                    velocities[i][k] = 0.0;
                }
            }
        }
        let costs = search.costs(&positions);
        for i in 0..n {
            if costs[i] < own_costs[i] {
                own_costs[i] = costs[i];
                own[i].clone_from(&positions[i]);
            }
        }
        let moved = distance(&best, &search.best);
        if search.note(moved, inertia) {
            break;
        }
    }
    search.finish()
}
