//! Beetle antennae search.
//!
//! **Method.** One beetle at u evaluates the cost at its antennae, f(u + d b) and f(u − d b), in a random direction b of
//! unit length, and steps δ away from the larger one: u ← u − δ b sign(f(u + d b) − f(u − d b)).
//! - [`Form::AsPrinted`]: d ← 0.95 d + 0.01 and δ ← 0.95 δ at each iteration, regardless of success. As δ decays
//!   geometrically, the beetle can travel at most δ₀/(1 − 0.95) = 20 δ₀ in total.
//! - [`Form::Robust`]: the beetle moves only if that lowers the cost; δ shrinks after a failure and grows after a success,
//!   and d follows δ.
//!
//! **Shapes.** u in [−1, 1]ᵖ, clamped to the box. Three evaluations for each iteration.
//!
//! **Stops.** *IterationLimit*, *SmallResidual*, *NotFinite*.
//!
//! **Source and departures.** M2 of ukf-vslm-2023, without equations: Jiang and Li, "BAS: beetle antennae
//! search algorithm for optimization problems", 2017 (arXiv 1710.10724), with the sign for a minimum. The factor 0.95, the
//! 0.01, the unconditional steps and the return of the best position are the original's. The original starts anywhere in its
//! box; here the walk starts at `start`.
//!
//! δ₀ is chosen here: the authors' package (rBAS) has 0.8 for two parameters in a box of 5 by 2, ukf-vslm-2023 states none,
//! and the default is half of the box. It determines the result. With 24 parameters of an arm a first step of half the box
//! moves the beetle so far from a start as good as registered frames that its cost never falls below the start's: on
//! simulated rows the result is the start (0.556 mm RMSE, 120 cable rows). With a tenth of it, the best of eight first steps,
//! the RMSE is 0.383 mm, and 0.282 mm in the robust form. The experiments of ukf-vslm-2023 therefore state a tenth.
//!
//! **Checked against** published problems of few parameters.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::estimate::Estimate;
use crate::least_squares::Form;
use crate::problem::Problem;
use crate::swarm::{Region, Search, distance};

options! {
    /// Options of [`solve`].
    #[derive(Copy)]
    pub struct Options {
        /// As printed or robust.
        pub form: Form = Form::Robust,
        /// Iterations.
        pub max_iterations: usize = 1_000,
        /// δ₀: first step, in half widths of the box.
        pub step: f64 = 1.0,
        /// d₀: first length of the antennae.
        pub antennae: f64 = 0.5,
        /// Decay factor of δ and d.
        pub decay: f64 = 0.95,
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
    /// The algorithm of 2017, without priors.
    pub fn as_printed() -> Self {
        Self { form: Form::AsPrinted, priors: false, ..Self::default() }
    }
}

/// Searches the box around `start`.
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    walk(problem, start, options, false)
}

/// The beetle's walk, with or without the parabola of [`qibas`](crate::swarm::qibas).
pub(super) fn walk(problem: &dyn Problem, start: &[f64], options: &Options, interpolate: bool) -> Estimate {
    let p = start.len();
    let robust = options.form == Form::Robust;
    let mut search = Search::new(problem, start, &options.region, options.priors, options.small_cost);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let mut u = vec![0.0; p];
    let mut cost = search.best_cost;
    let (mut delta, mut d) = (options.step, options.antennae);
    for _ in 0..options.max_iterations {
        let draws: Vec<f64> = (0..p).map(|_| rng.sample(StandardNormal)).collect();
        let length = draws.iter().map(|z| z * z).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let at = |from: &[f64], t: f64| -> Vec<f64> {
            from.iter().zip(&draws).map(|(u, z)| (u + t * z / length).clamp(-1.0, 1.0)).collect()
        };
        let smells = search.costs(&[at(&u, d), at(&u, -d)]);
        let side = (smells[0] - smells[1]).signum();
        let mut next = at(&u, if side.is_nan() { 0.0 } else { -delta * side });
        let mut next_cost = search.cost(&next);
        if interpolate && let Some(t) = vertex(d, smells[1], cost, smells[0]) {
            let parabola = at(&u, t);
            let parabola_cost = search.cost(&parabola);
            if parabola_cost < next_cost {
                (next, next_cost) = (parabola, parabola_cost);
            }
        }
        let better = next_cost < cost;
        let step = if !robust || better { distance(&u, &next) } else { 0.0 };
        if !robust || better {
            (u, cost) = (next, next_cost);
        }
        if search.note(step, delta) {
            break;
        }
        if !robust {
            delta *= options.decay;
            d = options.decay * d + 0.01;
        } else {
            // One success in about five leaves the step unchanged.
            delta = if better { (delta / options.decay.powi(4)).min(2.0) } else { delta * options.decay };
            d = 0.5 * delta;
        }
    }
    search.finish()
}

/// Minimum of the parabola through (−d, left), (0, middle), (d, right), within twice the antennae.
fn vertex(d: f64, left: f64, middle: f64, right: f64) -> Option<f64> {
    let curvature = left - 2.0 * middle + right;
    let t = 0.5 * d * (left - right) / curvature;
    (curvature > 0.0 && t.is_finite()).then(|| t.clamp(-2.0 * d, 2.0 * d))
}
