//! The solvers that identification can use, by name.

use crate::estimation::estimate::Estimate;
use crate::estimation::least_squares::{lm, ltlm};
use crate::estimation::problem::Problem;

/// A method of identification.
#[derive(Debug, Clone, Copy)]
pub struct Solver {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// One line for a list.
    pub about: &'static str,
    /// Whether the method is a paper's literal form: without priors, so that what the data cannot see moves freely.
    /// Such a fit is a comparison, never a model.
    pub literal: bool,
    run: fn(&dyn Problem, &[f64], u64) -> Estimate,
}

impl Solver {
    /// Minimises the cost of `problem` from `start`.
    pub fn solve(&self, problem: &dyn Problem, start: &[f64], seed: u64) -> Estimate {
        (self.run)(problem, start, seed)
    }
}

/// All solvers, the default first.
pub const SOLVERS: &[Solver] = &[
    Solver {
        name: "lm",
        about: "Levenberg–Marquardt, scaled, gain-ratio damping, with priors",
        literal: false,
        run: |problem, start, seed| lm::solve(problem, start, &lm::Options { seed, ..Default::default() }),
    },
    Solver {
        name: "ltlm",
        about: "logistic-tent chaotic LM on the same scaled steps, with priors",
        literal: false,
        run: |problem, start, seed| {
            ltlm::solve(problem, start, &ltlm::Options { seed, ..Default::default() })
        },
    },
    Solver {
        name: "lm-as-printed",
        about: "LM of ltlm-2024 eq. 10: fixed mu = 5, unscaled, no priors",
        literal: true,
        run: |problem, start, seed| {
            lm::solve(problem, start, &lm::Options { seed, ..lm::Options::as_printed() })
        },
    },
    Solver {
        name: "ltlm-as-printed",
        about: "LTLM of ltlm-2024 Algorithm I: fixed mu = 5, unscaled, no priors",
        literal: true,
        run: |problem, start, seed| {
            ltlm::solve(problem, start, &ltlm::Options { seed, ..ltlm::Options::as_printed() })
        },
    },
];

/// The solver of that name.
///
/// # Errors
/// A sentence that lists the names that exist.
pub fn by_name(name: &str) -> Result<&'static Solver, String> {
    SOLVERS.iter().find(|s| s.name == name).ok_or_else(|| {
        let names: Vec<&str> = SOLVERS.iter().map(|s| s.name).collect();
        format!("unknown method \"{name}\"; the methods are {}", names.join(", "))
    })
}
