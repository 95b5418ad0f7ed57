//! An arm that degrades over a working day, calibrated periodically or continuously: rls-2025.
//!
//! The paper's measurements are not public, so its TX60 is simulated with the physics stated in the experiment file:
//! links warm up and grow towards a steady state, joint zeros drift with wear. Every table is therefore labelled as
//! simulated. A figure of the paper is shown next to ours only where its prose states one.
//!
//! **Protocol.** Several groups of poses are measured hours apart, with a full pose reading at each. Half of each group
//! identifies, half verifies. The frames of sensor and target are fitted together with the links to the identification
//! poses of the first group, then frozen: with known frames four poses give 24 equations for 24 parameters, with unknown
//! frames they do not (rank and condition number are printed). Errors are mean position distances.
//!
//! **Methods.** All start from the nominal arm and process the groups in order, each group from the previous result.
//! - *RLS*: rls-2025 eq. 14, row by row in square-root form, rows weighted by the sensor's noise. The prior of the first
//!   group is the manufacturing tolerance. Each pose is linearised at the current state. No forgetting, as in the paper.
//! - *RLS, forgetting*: the same with a forgetting factor per pose.
//! - *LM*: only the poses of the current group, converged, with the same weights. No memory of earlier groups.
//! - *LM, memory*: the same with the last group's covariance as prior; equivalent to RLS.
//! - *LM, stopped*: as printed elsewhere in this literature: μ = 5, mm and radians unweighted, a few steps.
//!
//! **Expected result.** Without forgetting, RLS equals batch least squares of one linearisation, to rounding. A gap
//! between RLS and LM must have another cause; the three LM variants separate memory, weights and early stopping. The
//! errors before calibration differ between the paper's own methods in the identification poses (0.571 and 0.743 mm): "before" is by the
//! parameters of the period before, which are each method's own.

pub(crate) mod settings;
mod arm;
mod strategy_run;
mod verdict;
mod calibration_state;

use rayon::prelude::*;

use self::arm::{Arm, arm, group_error};
use self::calibration_state::State;
use self::strategy_run::{average, count_of, run_strategy};
use crate::experiment::ExperimentError;
use crate::simulated;
use truegrind_arm::model::Model;

pub use self::settings::{Degradation, Heat, PaperCount, PaperStatement, Wear};
pub use self::strategy_run::{Count, Run, Step, Strategy};
pub use verdict::{AgainstRls, Outcome};

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct DegradationResult {
    /// Settings of the experiment.
    pub settings: Degradation,
    /// Robot.
    pub robot: String,
    /// Verification poses in each group.
    pub verification: usize,
    /// Mean error of the nominal arm over all poses of each group (mm): Fig. 4.
    pub nominal_mm: Vec<f64>,
    /// Mean error of the arm calibrated with the first group only (mm).
    pub neglected_mm: Vec<f64>,
    /// Error over the number of poses: Fig. 7 and Table 2.
    pub counts: Vec<Count>,
    /// Periodic (all identification poses) and continuous calibration: Figs 9 to 14, Table 4.
    pub runs: Vec<Run>,
    /// Every method against RLS, over the arms.
    pub against_rls: Vec<AgainstRls>,
    /// Mean position error from the sensor's noise alone (mm).
    pub noise_floor_mm: f64,
    /// Seed.
    pub seed: u64,
}

/// Simulates the experiment's recipe and runs all methods. `resolve` returns the nominal model of a robot by name.
///
/// # Errors
/// [`ExperimentError::Recipe`] when the recipe cannot be simulated.
pub fn run(
    settings: &Degradation,
    experiment: &str,
    recipe: &str,
    seed: u64,
    resolve: impl Fn(&str) -> Result<Model, String> + Sync,
) -> Result<DegradationResult, ExperimentError> {
    let recipe = simulated::recipe(recipe, experiment)?;
    let arms = (0..settings.arms as u64)
        .into_par_iter()
        .map(|k| arm(settings, &recipe, experiment, seed + k, &resolve))
        .collect::<Result<Vec<_>, ExperimentError>>()?;
    let mut strategies: Vec<(Strategy, usize)> = vec![];
    let mut counts = settings.continuous.clone();
    counts.push(settings.identification);
    counts.sort_unstable();
    counts.dedup();
    for count in counts {
        strategies.extend(Strategy::ALL.map(|strategy| (strategy, count)));
    }
    let runs: Vec<Run> = strategies
        .par_iter()
        .map(|&(strategy, count)| {
            let each: Vec<Run> =
                arms.iter().map(|arm| run_strategy(settings, arm, strategy, count)).collect();
            average(strategy, count, &each)
        })
        .collect();
    let mean_over = |figure: &(dyn Fn(&Arm) -> f64 + Sync)| {
        arms.iter().map(figure).sum::<f64>() / arms.len().max(1) as f64
    };
    let nominal_mm =
        (0..settings.groups).map(|g| mean_over(&|arm| group_error(arm, g, &arm.nominal))).collect();
    let first: Vec<Model> = arms
        .iter()
        .map(|arm| {
            let mut state = State::new(arm);
            state.rls(arm, &arm.groups[0].identify, 1.0);
            state.model(arm)
        })
        .collect();
    let neglected_mm = (0..settings.groups)
        .map(|g| {
            let sum: f64 = arms.iter().zip(&first).map(|(arm, model)| group_error(arm, g, model)).sum();
            sum / arms.len().max(1) as f64
        })
        .collect();
    let noise = recipe.noise;
    Ok(DegradationResult {
        settings: settings.clone(),
        robot: recipe.robot.clone(),
        verification: arms.first().map_or(0, |arm| arm.groups[0].verify.dataset.rows.len()),
        nominal_mm,
        neglected_mm,
        counts: settings.counts.iter().map(|&count| count_of(&arms, count)).collect(),
        against_rls: verdict::against_rls(&runs),
        runs,
        // Mean norm of a vector of three normal variates: σ √(8/π).
        noise_floor_mm: (noise.sigma_mm + 2.0 * noise.per_metre_mm) * (8.0 / std::f64::consts::PI).sqrt(),
        seed,
    })
}
