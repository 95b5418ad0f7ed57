//! Compares all solvers over several seeded splits of one data set.

use rayon::prelude::*;

use crate::identification::calibration::Frames;
use crate::identification::identify::{IdentifyError, Options, identify};
use crate::identification::solver::{SOLVERS, Solver};
use crate::measurement::dataset::Dataset;
use crate::measurement::split::Split;
use truegrind_arm::model::Model;
use truegrind_estimation::estimate::Termination;
use truegrind_estimation::problem::Problem;
use truegrind_math::statistics::{ErrorSummary, mean_and_deviation};

/// One method over all splits.
#[derive(Debug, Clone)]
pub struct MethodRow {
    /// The method; `None` for the nominal arm with registered frames, the baseline.
    pub solver: Option<&'static Solver>,
    /// Held-out errors, one for each split.
    pub held_out: Vec<ErrorSummary>,
    /// Termination of each fit.
    pub terminations: Vec<Termination>,
    /// Jacobian passes over the rows, over all rounds of each fit.
    pub jacobian_passes: Vec<f64>,
}

impl MethodRow {
    /// Mean and standard deviation over the splits of one figure.
    pub fn over_splits(&self, figure: fn(&ErrorSummary) -> f64) -> (f64, f64) {
        mean_and_deviation(&self.held_out.iter().map(figure).collect::<Vec<_>>())
    }
}

/// Runs every solver on every split (seeds 0 to `splits` − 1).
///
/// # Errors
/// As [`identify`].
pub fn study(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    frames: &Frames,
    split: &(dyn Fn(&Dataset, u64) -> Split + Sync),
    options: &Options,
    splits: u64,
) -> Result<Vec<MethodRow>, IdentifyError> {
    let runs: Vec<(usize, u64)> =
        (0..SOLVERS.len()).flat_map(|s| (0..splits).map(move |seed| (s, seed))).collect();
    let found = runs
        .par_iter()
        .map(|&(s, seed)| {
            let options = Options { solver: &SOLVERS[s], seed, ..options.clone() };
            let result = identify(dataset, robot, nominal, frames, &|d| split(d, seed), &options)?;
            let rows = result.training.problem.rows().max(1);
            let per = result.training.evaluations.jacobians as f64 / rows as f64;
            Ok((
                s,
                result.estimated.registered.held_out,
                result.estimated.calibrated.held_out,
                result.training.termination(),
                per,
            ))
        })
        .collect::<Result<Vec<_>, IdentifyError>>()?;
    let mut table = vec![MethodRow {
        solver: None,
        held_out: found.iter().filter(|f| f.0 == 0).map(|f| f.1).collect(),
        terminations: Vec::new(),
        jacobian_passes: Vec::new(),
    }];
    for (s, solver) in SOLVERS.iter().enumerate() {
        let of: Vec<_> = found.iter().filter(|f| f.0 == s).collect();
        table.push(MethodRow {
            solver: Some(solver),
            held_out: of.iter().map(|f| f.2).collect(),
            terminations: of.iter().map(|f| f.3).collect(),
            jacobian_passes: of.iter().map(|f| f.4).collect(),
        });
    }
    Ok(table)
}
