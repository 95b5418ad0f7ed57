//! Runs one calibration method through all groups of an arm, and studies how many poses are enough.

use std::time::Instant;

use serde::Serialize;

use super::arm::{Arm, mean_error};
use super::calibration_state::State;
use super::settings::Degradation;
use truegrind_calibration::identification::fit::Observations;
use truegrind_calibration::identification::identifiability::identifiability;
use truegrind_estimation::least_squares::lm;
use truegrind_math::statistics::median;

/// How a method uses the groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// Recursive least squares without forgetting.
    Rls,
    /// The same with a forgetting factor.
    RlsForgetting,
    /// Levenberg–Marquardt on the current group only, converged.
    Lm,
    /// The same with the last group's covariance as prior.
    LmMemory,
    /// Levenberg–Marquardt with μ = 5 and unweighted rows, stopped.
    LmStopped,
}

impl Strategy {
    /// All methods.
    pub const ALL: [Strategy; 5] =
        [Strategy::Rls, Strategy::RlsForgetting, Strategy::Lm, Strategy::LmMemory, Strategy::LmStopped];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::Rls => "RLS",
            Strategy::RlsForgetting => "RLS, forgetting",
            Strategy::Lm => "LM",
            Strategy::LmMemory => "LM, memory",
            Strategy::LmStopped => "LM, stopped",
        }
    }

    /// The method of the paper that is closest to this one.
    pub fn paper_name(self) -> Option<&'static str> {
        match self {
            Strategy::Rls => Some("RLS"),
            Strategy::LmStopped => Some("LM"),
            _ => None,
        }
    }
}

/// Mean position errors of one method, count and group, over all arms (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Step {
    /// Group, from 0.
    pub group: usize,
    /// Identification poses, before this group was used.
    pub identification_before_mm: f64,
    /// Identification poses, after this group.
    pub identification_after_mm: f64,
    /// Verification poses, before.
    pub verification_before_mm: f64,
    /// Verification poses, after.
    pub verification_after_mm: f64,
}

/// A method with one number of poses, run through all groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// The method.
    #[serde(rename = "way")]
    pub strategy: Strategy,
    /// Poses used in each group.
    pub count: usize,
    /// One step for each group.
    pub steps: Vec<Step>,
    /// Mean error of the verification poses after calibration, over the groups; one value per arm (mm).
    pub arms_mm: Vec<f64>,
    /// Seconds for all groups of one arm, median over the arms. Not the same in every run.
    #[serde(skip)]
    pub seconds: f64,
}

impl Run {
    /// Mean over the groups.
    pub fn mean(&self, figure: fn(&Step) -> f64) -> f64 {
        self.steps.iter().map(figure).sum::<f64>() / self.steps.len().max(1) as f64
    }
}

/// What a given number of poses determines, with known frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Count {
    /// Poses.
    pub poses: usize,
    /// Number of equations.
    pub equations: usize,
    /// Rank of the Jacobian for 24 parameters, smallest over the arms.
    pub rank: usize,
    /// Condition number in units of the priors, the largest over the arms; infinite without full rank.
    pub condition: f64,
    /// Mean error of the identification poses after RLS, first group (mm).
    pub identification_mm: f64,
    /// Mean error of the verification poses after RLS, first group (mm).
    pub verification_mm: f64,
    /// Mean error of the verification poses after one-shot least squares without priors, eq. 9 (mm); absent where singular.
    pub without_prior_mm: Option<f64>,
}

fn first_poses(rows: &Observations, count: usize) -> Observations {
    rows.subset(&(0..count.min(rows.dataset.rows.len())).collect::<Vec<_>>())
}

/// Runs one arm through all groups.
pub(super) fn run_strategy(settings: &Degradation, arm: &Arm, strategy: Strategy, count: usize) -> Run {
    let mut state = State::new(arm);
    let mut steps = Vec::with_capacity(settings.groups);
    let mut seconds = 0.0;
    for (g, group) in arm.groups.iter().enumerate() {
        let rows = first_poses(&group.identify, count);
        let before = state.model(arm);
        let begun = Instant::now();
        match strategy {
            Strategy::Rls => state.rls(arm, &rows, 1.0),
            Strategy::RlsForgetting => state.rls(arm, &rows, settings.forgetting),
            Strategy::Lm => state.lm(arm, &rows, false),
            Strategy::LmMemory => state.lm(arm, &rows, true),
            Strategy::LmStopped => state.stopped(arm, &rows, settings.stopped_after),
        }
        seconds += begun.elapsed().as_secs_f64();
        let after = state.model(arm);
        steps.push(Step {
            group: g,
            identification_before_mm: mean_error(arm, &rows, &before),
            identification_after_mm: mean_error(arm, &rows, &after),
            verification_before_mm: mean_error(arm, &group.verify, &before),
            verification_after_mm: mean_error(arm, &group.verify, &after),
        });
    }
    let mean = steps.iter().map(|s: &Step| s.verification_after_mm).sum::<f64>() / steps.len().max(1) as f64;
    Run { strategy, count, steps, arms_mm: vec![mean], seconds }
}

/// Averages over the arms.
pub(super) fn average(strategy: Strategy, count: usize, each: &[Run]) -> Run {
    let n = each.len().max(1) as f64;
    let groups = each.first().map_or(0, |j| j.steps.len());
    let mean = |g: usize, figure: fn(&Step) -> f64| each.iter().map(|j| figure(&j.steps[g])).sum::<f64>() / n;
    let steps = (0..groups)
        .map(|g| Step {
            group: g,
            identification_before_mm: mean(g, |s| s.identification_before_mm),
            identification_after_mm: mean(g, |s| s.identification_after_mm),
            verification_before_mm: mean(g, |s| s.verification_before_mm),
            verification_after_mm: mean(g, |s| s.verification_after_mm),
        })
        .collect();
    let arms_mm = each.iter().flat_map(|j| j.arms_mm.iter().copied()).collect();
    Run {
        strategy,
        count,
        steps,
        arms_mm,
        seconds: median(&each.iter().map(|j| j.seconds).collect::<Vec<_>>()).unwrap_or(f64::NAN),
    }
}

/// Evaluates one number of poses.
pub(super) fn count_of(arms: &[Arm], count: usize) -> Count {
    let mut out = Count {
        poses: count,
        equations: 6 * count,
        rank: usize::MAX,
        condition: 0.0,
        identification_mm: 0.0,
        verification_mm: 0.0,
        without_prior_mm: Some(0.0),
    };
    let n = arms.len().max(1) as f64;
    for arm in arms {
        let rows = first_poses(&arm.groups[0].identify, count);
        let mut state = State::new(arm);
        let problem = state.problem(arm, &rows, arm.sigma, &[]);
        let scale: Vec<f64> = state.covariance.diagonal().iter().map(|v| v.sqrt()).collect();
        if let Some(seen) = identifiability(&problem, state.x.as_slice(), &scale) {
            out.rank = out.rank.min(seen.rank);
            out.condition = out.condition.max(seen.condition);
        }
        // One linearisation without priors (eq. 9).
        let options = lm::Options { priors: false, max_iterations: 50, ..lm::Options::default() };
        let bare = lm::solve(&problem, state.x.as_slice(), &options);
        let bare_model = problem.apply(&bare.x).0;
        state.rls(arm, &rows, 1.0);
        let model = state.model(arm);
        out.identification_mm += mean_error(arm, &rows, &model) / n;
        out.verification_mm += mean_error(arm, &arm.groups[0].verify, &model) / n;
        let error = mean_error(arm, &arm.groups[0].verify, &bare_model) / n;
        let regular = out.condition.is_finite();
        out.without_prior_mm = out.without_prior_mm.filter(|_| regular).map(|sum| sum + error);
    }
    out
}
