//! An arm that degrades over a working day, calibrated periodically or continuously: rls-2025.
//!
//! The paper's measurements are not public. Here its TX60 is simulated, with the physics stated in the experiment file:
//! links warm up towards a steady state and grow, zeros of the joints wander with wear. Nothing here is therefore a
//! measurement, and every table says so; a figure of the paper stands beside ours only where its prose states one.
//!
//! **Protocol.** Several groups of poses, hours apart, a full pose read at each. Of each group half identify, half
//! verify. The frames of sensor and target come from a fit of links and frames together to the identification poses of
//! the first group and are then frozen: with known frames four poses give 24 equations for 24 parameters, with unknown
//! ones they do not (rank and condition number are printed). Errors are mean distances of positions.
//!
//! **Methods.** All start from the nominal arm and go from group to group, each beginning where it ended.
//! - *RLS*: rls-2025 eq. 14, row by row in square-root form, rows weighed by the sensor; the prior of the first group is
//!   manufacturing tolerance; each pose is linearised at the state it meets. Without forgetting, as the paper has it.
//! - *RLS, forgetting*: the same with a factor per pose.
//! - *LM*: the poses of the present group alone, converged, rows weighed alike. No memory of earlier groups.
//! - *LM, memory*: the same with the last group's covariance as prior: RLS by another name.
//! - *LM, stopped*: as printed elsewhere in this literature: μ = 5, mm and radians unweighted, a few steps.
//!
//! **What to expect.** Without forgetting, RLS *is* batch least squares of one linearisation, to rounding. A gap
//! between RLS and LM must have another cause, and the three LM variants show which: memory, weights, or the stop. The
//! paper's own before-figures differ between its methods (0.571 and 0.743 mm), which no method can cause.

mod arm;
mod journey;
mod verdict;
mod way;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::arm::{Arm, arm, group_error};
use self::journey::{average, count_of, journey};
use self::way::State;
use crate::experiment::ExperimentError;
use crate::simulated;
use truegrind_arm::model::Model;

pub use verdict::{AgainstRls, Outcome};

/// The experiment's section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Degradation {
    /// Groups of poses.
    pub groups: usize,
    /// Time between two groups (h).
    pub hours_apart: f64,
    /// The first so many poses of a group identify; all others verify.
    pub identification: usize,
    /// Pose counts of the study of counts.
    pub counts: Vec<usize>,
    /// Pose counts of continuous calibration.
    pub continuous: Vec<usize>,
    /// Simulated arms, each with its own deviations, poses and noise.
    pub arms: usize,
    /// Forgetting factor of one pose.
    pub forgetting: f64,
    /// Steps of the stopped LM.
    pub stopped_after: usize,
    /// Links that warm up.
    pub heat: Heat,
    /// Joints that wear.
    pub wear: Wear,
    /// What the paper's prose states.
    #[serde(default)]
    pub paper: Vec<PaperStatement>,
    /// What it states of the study of counts.
    #[serde(default)]
    pub paper_counts: Vec<PaperCount>,
}

/// Links warm up to a steady state and grow: length · growth · rise · (1 − e^(−t/T)).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Heat {
    /// Relative growth per kelvin.
    pub growth_per_k: f64,
    /// By how much each link is warmer in the steady state than when the first group was measured (K).
    pub rise_k: [f64; 6],
    /// T (h).
    pub time_constant_h: f64,
}

/// Zeros of the joints wander: rate · t.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wear {
    /// Of each joint (° per hour).
    pub zero_deg_per_h: [f64; 6],
}

/// Figures that the paper's prose states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperStatement {
    /// Poses per group.
    pub count: usize,
    /// Name of the method: `RLS` or `LM`.
    pub method: String,
    /// Mean error before, poses that identify (mm).
    pub identification_before_mm: Option<f64>,
    /// The same after.
    pub identification_after_mm: Option<f64>,
    /// Mean error before, poses that verify (mm).
    pub verification_before_mm: Option<f64>,
    /// The same after.
    pub verification_after_mm: Option<f64>,
    /// Improvement of the verification poses as stated (%).
    pub improvement_percent: Option<f64>,
    /// The figure that shows it.
    #[serde(default)]
    pub figure: Option<String>,
}

/// What the paper's prose states of the study of counts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperCount {
    /// Poses.
    pub count: usize,
    /// Improvement of the poses that identify (%).
    pub identification_percent: f64,
    /// Improvement of the poses that verify (%).
    pub verification_percent: f64,
}

impl Degradation {
    /// What in the section cannot be used: key, found, expected.
    pub(super) fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let most = self.counts.iter().chain(&self.continuous).max().copied().unwrap_or(0);
        let least = self.counts.iter().chain(&self.continuous).min().copied().unwrap_or(0);
        if self.groups == 0 || self.arms == 0 {
            let found = format!("{} groups, {} arms", self.groups, self.arms);
            return Some(("degradation.groups, .arms", found, "1 of each at least"));
        }
        if most > self.identification || least == 0 {
            let found = format!("{least} to {most} poses");
            return Some(("degradation.counts", found, "1 pose at least, and no more than identify"));
        }
        if !(self.forgetting > 0.0 && self.forgetting <= 1.0) {
            return Some(("degradation.forgetting", self.forgetting.to_string(), "above 0, up to 1"));
        }
        None
    }
}

/// How a method goes through the groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// Recursive least squares that remembers everything.
    Rls,
    /// The same with a forgetting factor.
    RlsForgetting,
    /// Levenberg–Marquardt on the present group, converged.
    Lm,
    /// The same with the last group's covariance as prior.
    LmMemory,
    /// Levenberg–Marquardt with μ = 5 and unweighted rows, stopped.
    LmStopped,
}

impl Way {
    /// All of them.
    pub const ALL: [Way; 5] = [Way::Rls, Way::RlsForgetting, Way::Lm, Way::LmMemory, Way::LmStopped];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Way::Rls => "RLS",
            Way::RlsForgetting => "RLS, forgetting",
            Way::Lm => "LM",
            Way::LmMemory => "LM, memory",
            Way::LmStopped => "LM, stopped",
        }
    }

    /// The paper's name for what it may have run.
    pub fn paper_name(self) -> Option<&'static str> {
        match self {
            Way::Rls => Some("RLS"),
            Way::LmStopped => Some("LM"),
            _ => None,
        }
    }
}

/// Mean position errors of one method, count and group, over all arms (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// Group, from 0.
    pub group: usize,
    /// Poses that identify, with what was known before this group.
    pub identification_before_mm: f64,
    /// The same with what is known after it.
    pub identification_after_mm: f64,
    /// Poses that verify, before.
    pub verification_before_mm: f64,
    /// Poses that verify, after.
    pub verification_after_mm: f64,
}

/// A method with one count through all groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Journey {
    /// The method.
    pub way: Way,
    /// Poses of each group that it takes.
    pub count: usize,
    /// One step for each group.
    pub steps: Vec<Step>,
    /// Mean error of the poses that verify, after, over the groups: one for each arm (mm).
    pub arms_mm: Vec<f64>,
    /// Seconds for all groups of one arm, median over the arms. Not the same in every run.
    #[serde(skip)]
    pub seconds: f64,
}

impl Journey {
    /// Mean over the groups.
    pub fn mean(&self, figure: fn(&Step) -> f64) -> f64 {
        self.steps.iter().map(figure).sum::<f64>() / self.steps.len().max(1) as f64
    }
}

/// What so many poses can tell, with known frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Count {
    /// Poses.
    pub poses: usize,
    /// Equations they give.
    pub equations: usize,
    /// Rank of the Jacobian, the smallest over the arms, of 24 parameters.
    pub rank: usize,
    /// Condition number in units of the priors, the largest over the arms; infinite without full rank.
    pub condition: f64,
    /// Mean error of the poses that identify after RLS, first group (mm).
    pub identification_mm: f64,
    /// Mean error of the poses that verify after RLS, first group (mm).
    pub verification_mm: f64,
    /// Mean error of the poses that verify after one-shot least squares without priors, eq. 9; absent where singular.
    pub without_prior_mm: Option<f64>,
}

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct DegradationResult {
    /// What was asked for.
    pub settings: Degradation,
    /// Robot.
    pub robot: String,
    /// Poses that verify, in each group.
    pub verification: usize,
    /// Mean error of the nominal arm over all poses of each group (mm): Fig. 4.
    pub nominal_mm: Vec<f64>,
    /// Mean error of the arm as known after the first group, not calibrated again (mm).
    pub neglected_mm: Vec<f64>,
    /// The study of counts: Fig. 7 and Table 2.
    pub counts: Vec<Count>,
    /// Periodic (all identification poses) and continuous calibration: Figs 9 to 14, Table 4.
    pub journeys: Vec<Journey>,
    /// Every way against RLS, over the arms.
    pub against_rls: Vec<AgainstRls>,
    /// What the sensor alone scatters by (mm).
    pub noise_floor_mm: f64,
    /// Seed.
    pub seed: u64,
}

/// Runs the experiment on its recipe. `resolve` gives the nominal model of a robot by name.
///
/// # Errors
/// [`ExperimentError::Recipe`] where the recipe gives no measurements.
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
    let mut ways: Vec<(Way, usize)> = vec![];
    let mut counts = settings.continuous.clone();
    counts.push(settings.identification);
    counts.sort_unstable();
    counts.dedup();
    for count in counts {
        ways.extend(Way::ALL.map(|way| (way, count)));
    }
    let journeys: Vec<Journey> = ways
        .par_iter()
        .map(|&(way, count)| {
            let each: Vec<Journey> = arms.iter().map(|arm| journey(settings, arm, way, count)).collect();
            average(way, count, &each)
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
        against_rls: verdict::against_rls(&journeys),
        journeys,
        // The mean length of a vector of three normal numbers is σ √(8/π).
        noise_floor_mm: (noise.sigma_mm + 2.0 * noise.per_metre_mm) * (8.0 / std::f64::consts::PI).sqrt(),
        seed,
    })
}
