//! Swarms and other searches that use the cost only.
//!
//! | file | method | passes of residuals per iteration |
//! |---|---|---|
//! | [`pso`] | particle swarm optimisation | population |
//! | [`de`] | differential evolution | population |
//! | [`sca`] | sine cosine algorithm | population |
//! | [`bas`] | beetle antennae search | 3 |
//! | [`qibas`] | the same with quadratic interpolation | 4 |
//!
//! All search in a box around `start`: parameter k in start ± reach · σ_k of its prior, or ± `unknown_reach`
//! where it has none, and all use coordinates from −1 to 1 in that box. None uses derivatives, so none has a covariance or
//! a convergence test: they end at the iteration limit, or when the cost has vanished. They serve as a comparison with
//! least-squares methods under the same budget of evaluations; a least-squares method must confirm that their result is a
//! minimum.

pub mod pso;
pub mod de;
pub mod sca;
pub mod bas;
pub mod qibas;

use rayon::prelude::*;

use crate::estimate::{Estimate, Iteration, Termination};
use crate::objective::Objective;
use crate::problem::{Problem, prior_cost};

options! {
    /// The search box.
    #[derive(Copy)]
    pub struct Region {
        /// Half width of the box, in standard deviations of the prior.
        pub reach: f64 = 3.0,
        /// Half width for a parameter without a prior, in its own unit.
        pub unknown_reach: f64 = 1.0,
    }
}

/// A search in the unit box: best position, its cost, and the evaluated rows.
struct Search<'a> {
    objective: Objective<'a>,
    centre: Vec<f64>,
    half_width: Vec<f64>,
    /// Best position so far, in [−1, 1]ᵖ.
    best: Vec<f64>,
    best_cost: f64,
    trace: Vec<Iteration>,
    small_cost: f64,
}

impl<'a> Search<'a> {
    /// Evaluates the start, the initial best position.
    fn new(problem: &'a dyn Problem, start: &[f64], region: &Region, priors: bool, small_cost: f64) -> Self {
        let mut objective = Objective::new(problem, start, priors);
        let sigma =
            |k: usize| problem.priors().get(k).map(|prior| prior.sigma).filter(|sigma| sigma.is_finite());
        let half_width =
            (0..start.len()).map(|k| sigma(k).map_or(region.unknown_reach, |s| region.reach * s)).collect();
        let cost = objective.cost(start);
        let first = Iteration { cost, evaluations: objective.evaluations, ..Iteration::default() };
        Self {
            objective,
            centre: start.to_vec(),
            half_width,
            best: vec![0.0; start.len()],
            best_cost: if cost.is_finite() { cost } else { f64::INFINITY },
            trace: vec![first],
            small_cost,
        }
    }

    fn place(&self, u: &[f64]) -> Vec<f64> {
        self.centre.iter().zip(&self.half_width).zip(u).map(|((c, h), u)| c + h * u).collect()
    }

    /// Costs of positions, in order; NaN counts as infinite. Records the best one.
    fn costs(&mut self, positions: &[Vec<f64>]) -> Vec<f64> {
        let (problem, priors) = (self.objective.problem, self.objective.priors);
        let places: Vec<Vec<f64>> = positions.iter().map(|u| self.place(u)).collect();
        let costs: Vec<f64> = places
            .par_iter()
            .map(|x| {
                let cost = problem.row_cost(x) + prior_cost(priors, x);
                if cost.is_nan() { f64::INFINITY } else { cost }
            })
            .collect();
        self.objective.evaluations.residuals += (positions.len() * problem.rows()) as u64;
        for (u, cost) in positions.iter().zip(&costs) {
            if *cost < self.best_cost {
                self.best_cost = *cost;
                self.best.clone_from(u);
            }
        }
        costs
    }

    fn cost(&mut self, position: &[f64]) -> f64 {
        self.costs(&[position.to_vec()])[0]
    }

    /// Records the end of an iteration; true if the search is finished because the cost has vanished.
    fn note(&mut self, step_norm: f64, setting: f64) -> bool {
        self.trace.push(Iteration {
            cost: self.best_cost,
            step_norm,
            damping: Some(setting),
            row_cost: None,
            gradient_norm: None,
            evaluations: self.objective.evaluations,
        });
        self.best_cost <= self.small_cost
    }

    fn finish(self) -> Estimate {
        let termination = if !self.best_cost.is_finite() {
            Termination::NotFinite
        } else if self.best_cost <= self.small_cost {
            Termination::SmallResidual
        } else {
            Termination::IterationLimit
        };
        Estimate {
            x: self.place(&self.best),
            covariance: None,
            cost: if self.best_cost.is_finite() { self.best_cost } else { self.trace[0].cost },
            evaluations: self.objective.evaluations,
            termination,
            trace: self.trace,
        }
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn uniform_position(rng: &mut rand_chacha::ChaCha8Rng, p: usize) -> Vec<f64> {
    (0..p).map(|_| rand::RngExt::random_range(rng, -1.0..1.0)).collect()
}
