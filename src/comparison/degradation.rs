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

use std::time::Instant;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::comparison::experiment::ExperimentError;
use crate::comparison::simulated;
use crate::estimation::filter::rls::{Memory, Recursion};
use crate::estimation::least_squares::lm;
use crate::estimation::problem::{Prior, Problem};
use crate::identification::calibration::{Calibration, Frames, Weight};
use crate::identification::fit::{Observed, Start, errors_on, fit, frame_parameters};
use crate::identification::identifiability::identifiability;
use crate::identification::identify::observe;
use crate::identification::solver::SOLVERS;
use crate::identification::start::starts;
use crate::identification::tolerance::Tolerance;
use crate::kinematics::model::Model;
use crate::kinematics::parameter::{Parameter, link_parameters};
use crate::measurement::import;
use crate::measurement::simulation::recipe::{LinkDeviation, Recipe};

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
    /// Seconds for all groups of one arm. Not the same in every run.
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
    /// What the sensor alone scatters by (mm).
    pub noise_floor_mm: f64,
    /// Seed.
    pub seed: u64,
}

/// One simulated arm with its groups.
struct Arm {
    nominal: Model,
    frames: Frames,
    groups: Vec<Group>,
    sigma: Weight,
}

struct Group {
    identify: Observed,
    verify: Observed,
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
    let journeys = ways
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
        journeys,
        // The mean length of a vector of three normal numbers is σ √(8/π).
        noise_floor_mm: (noise.sigma_mm + 2.0 * noise.per_metre_mm) * (8.0 / std::f64::consts::PI).sqrt(),
        seed,
    })
}

fn arm(
    settings: &Degradation,
    recipe: &Recipe,
    experiment: &str,
    seed: u64,
    resolve: &(impl Fn(&str) -> Result<Model, String> + Sync),
) -> Result<Arm, ExperimentError> {
    let fail = |message: String| ExperimentError::Recipe { experiment: experiment.to_owned(), message };
    let nominal = resolve(&recipe.robot).map_err(fail)?;
    let mut groups = Vec::with_capacity(settings.groups);
    for g in 0..settings.groups {
        let hours = settings.hours_apart * g as f64;
        let mut now = recipe.clone();
        now.seed = recipe.seed + 1_000 * seed + g as u64;
        if let Some(random) = &mut now.arm.random {
            random.seed += seed;
        }
        for joint in 0..6 {
            let link = &nominal.links[joint];
            let warm = 1.0 - (-hours / settings.heat.time_constant_h).exp();
            let growth = settings.heat.growth_per_k * settings.heat.rise_k[joint] * warm;
            now.arm.link.push(LinkDeviation {
                joint,
                a_mm: link.a_mm * growth,
                d_mm: link.d_mm * growth,
                theta_deg: settings.wear.zero_deg_per_h[joint] * hours,
                ..LinkDeviation::default()
            });
        }
        let simulation = now.simulate(resolve).map_err(|e| fail(e.to_string()))?;
        let file = format!("group {} (simulated)", g + 1);
        let dataset = import::read(&file, simulation.csv.as_bytes(), &import::Options::default())
            .map_err(|e| fail(e.to_string()))?;
        if dataset.rows.len() <= settings.identification {
            return Err(fail(format!(
                "{} poses in a group, expected more than the {} that identify",
                dataset.rows.len(),
                settings.identification
            )));
        }
        let (observed, _) = observe(&dataset, &nominal, false);
        let all: Vec<usize> = (0..dataset.rows.len()).collect();
        let (identify, verify) = all.split_at(settings.identification);
        groups.push(Group { identify: observed.subset(identify), verify: observed.subset(verify) });
    }
    let noise = recipe.noise;
    // At the tracker's usual two metres.
    let sigma_mm = (noise.sigma_mm + 2.0 * noise.per_metre_mm).max(1e-3);
    let sigma_rad = noise.sigma_deg.to_radians().max(1e-6);
    let first = &groups[0].identify;
    let candidates = starts(&first.dataset, &nominal)?;
    let frames = candidates.into_iter().next().unwrap_or_else(|| Frames::at_origin(1));
    let parameters: Vec<Parameter> =
        link_parameters(&nominal).into_iter().chain(frame_parameters(&first.dataset)).collect();
    let start = Start { model: &nominal, frames: &frames };
    let fitted = fit(first, start, &parameters, &Tolerance::default(), &SOLVERS[0], 0);
    Ok(Arm {
        nominal,
        frames: fitted.frames,
        groups,
        sigma: Weight { per_mm: 1.0 / sigma_mm, per_rad: 1.0 / sigma_rad },
    })
}

/// What is known of an arm: link deviations and their covariance.
struct State {
    parameters: Vec<Parameter>,
    x: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl State {
    fn new(arm: &Arm) -> Self {
        let parameters = link_parameters(&arm.nominal);
        let priors = Tolerance::default().priors(&parameters, &arm.nominal);
        let variances = DVector::from_iterator(priors.len(), priors.iter().map(|p| p.sigma * p.sigma));
        Self {
            x: DVector::zeros(parameters.len()),
            covariance: DMatrix::from_diagonal(&variances),
            parameters,
        }
    }

    fn task(&self, arm: &Arm, rows: &Observed, weight: Weight, priors: &[Prior]) -> Calibration {
        let weights = vec![weight; rows.dataset.rows.len()];
        Calibration::new(&rows.dataset, &arm.nominal, &arm.frames, &self.parameters, priors, &weights)
    }

    fn model(&self, arm: &Arm) -> Model {
        self.task(arm, &arm.groups[0].verify, arm.sigma, &[]).apply(self.x.as_slice()).0
    }

    /// Takes the rows in, pose by pose, each linearised at the state it meets.
    fn rls(&mut self, arm: &Arm, rows: &Observed, forgetting: f64) {
        let task = self.task(arm, rows, arm.sigma, &[]);
        let covariance = self.covariance.clone();
        let Some(mut recursion) = Recursion::new(self.x.clone(), covariance, Memory::SquareRoot) else {
            return;
        };
        let (p, per) = (self.x.len(), task.rows_per_observation());
        let (mut r, mut j) = (vec![0.0; per], vec![0.0; per * p]);
        let mut a = DVector::zeros(p);
        // A pose has six rows: each forgets its share.
        let share = forgetting.powf(1.0 / per as f64);
        for pose in 0..rows.dataset.rows.len() {
            let at = recursion.x.clone();
            task.jacobian(at.as_slice(), pose * per..(pose + 1) * per, &mut r, &mut j);
            for i in 0..per {
                (0..p).for_each(|k| a[k] = j[k * per + i]);
                let e = r[i] + a.dot(&recursion.x) - a.dot(&at);
                recursion.update(&a, e, share);
            }
        }
        self.covariance = recursion.covariance();
        self.x = recursion.x;
    }

    /// The rows at once, with the covariance as prior or without any.
    fn lm(&mut self, arm: &Arm, rows: &Observed, memory: bool) {
        let task = self.task(arm, rows, arm.sigma, &[]);
        let estimate = if memory {
            let problem = Remembering::new(&task, &self.x, &self.covariance);
            lm::solve(&problem, self.x.as_slice(), &lm::Options::default())
        } else {
            lm::solve(&task, self.x.as_slice(), &lm::Options { priors: false, ..lm::Options::default() })
        };
        if estimate.x.iter().all(|x| x.is_finite()) {
            self.x = DVector::from_vec(estimate.x);
        }
        if let (true, Some(covariance)) = (memory, estimate.covariance) {
            self.covariance = covariance;
        }
    }

    fn stopped(&mut self, arm: &Arm, rows: &Observed, steps: usize) {
        let task = self.task(arm, rows, Weight { per_mm: 1.0, per_rad: 1.0 }, &[]);
        let options = lm::Options { max_iterations: steps, ..lm::Options::as_printed() };
        let estimate = lm::solve(&task, self.x.as_slice(), &options);
        if estimate.x.iter().all(|x| x.is_finite()) {
            self.x = DVector::from_vec(estimate.x);
        }
    }
}

/// A problem with a normal prior of full covariance: p more rows L⁻¹(x − m) with LLᵀ the covariance.
struct Remembering<'a> {
    inner: &'a Calibration,
    mean: DVector<f64>,
    inverse_root: DMatrix<f64>,
}

impl<'a> Remembering<'a> {
    fn new(inner: &'a Calibration, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Self {
        let p = mean.len();
        let inverse_root = covariance
            .clone()
            .cholesky()
            .and_then(|factor| factor.l().try_inverse())
            .unwrap_or_else(|| DMatrix::zeros(p, p));
        Self { inner, mean: mean.clone(), inverse_root }
    }

    fn prior_rows(&self, x: &[f64]) -> DVector<f64> {
        &self.inverse_root * (DVector::from_column_slice(x) - &self.mean)
    }
}

impl Problem for Remembering<'_> {
    fn parameters(&self) -> usize {
        self.inner.parameters()
    }

    fn rows(&self) -> usize {
        self.inner.rows() + self.mean.len()
    }

    fn residuals(&self, x: &[f64], rows: std::ops::Range<usize>, out: &mut [f64]) {
        let n = self.inner.rows();
        let prior = self.prior_rows(x);
        if rows.start < n {
            let end = rows.end.min(n);
            self.inner.residuals(x, rows.start..end, &mut out[..end - rows.start]);
        }
        for i in rows.start.max(n)..rows.end {
            out[i - rows.start] = prior[i - n];
        }
    }

    fn jacobian(&self, x: &[f64], rows: std::ops::Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        let (n, p, m) = (self.inner.rows(), self.inner.parameters(), rows.len());
        let prior = self.prior_rows(x);
        let end = rows.end.min(n);
        if rows.start < n {
            let own = end - rows.start;
            let mut part = vec![0.0; own * p];
            self.inner.jacobian(x, rows.start..end, &mut residuals[..own], &mut part);
            for k in 0..p {
                jacobian[k * m..k * m + own].copy_from_slice(&part[k * own..(k + 1) * own]);
            }
        }
        for i in rows.start.max(n)..rows.end {
            residuals[i - rows.start] = prior[i - n];
            for k in 0..p {
                jacobian[k * m + i - rows.start] = self.inverse_root[(i - n, k)];
            }
        }
    }
}

fn first_poses(rows: &Observed, count: usize) -> Observed {
    rows.subset(&(0..count.min(rows.dataset.rows.len())).collect::<Vec<_>>())
}

fn mean_error(arm: &Arm, rows: &Observed, model: &Model) -> f64 {
    let errors = errors_on(rows, model, &arm.frames);
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

fn group_error(arm: &Arm, group: usize, model: &Model) -> f64 {
    let group = &arm.groups[group];
    let (a, b) = (group.identify.dataset.rows.len() as f64, group.verify.dataset.rows.len() as f64);
    (a * mean_error(arm, &group.identify, model) + b * mean_error(arm, &group.verify, model)) / (a + b)
}

fn journey(settings: &Degradation, arm: &Arm, way: Way, count: usize) -> Journey {
    let mut state = State::new(arm);
    let mut steps = Vec::with_capacity(settings.groups);
    let mut seconds = 0.0;
    for (g, group) in arm.groups.iter().enumerate() {
        let rows = first_poses(&group.identify, count);
        let before = state.model(arm);
        let begun = Instant::now();
        match way {
            Way::Rls => state.rls(arm, &rows, 1.0),
            Way::RlsForgetting => state.rls(arm, &rows, settings.forgetting),
            Way::Lm => state.lm(arm, &rows, false),
            Way::LmMemory => state.lm(arm, &rows, true),
            Way::LmStopped => state.stopped(arm, &rows, settings.stopped_after),
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
    Journey { way, count, steps, seconds }
}

fn average(way: Way, count: usize, each: &[Journey]) -> Journey {
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
    Journey { way, count, steps, seconds: each.iter().map(|j| j.seconds).sum::<f64>() / n }
}

fn count_of(arms: &[Arm], count: usize) -> Count {
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
        let task = state.task(arm, &rows, arm.sigma, &[]);
        let scale: Vec<f64> = state.covariance.diagonal().iter().map(|v| v.sqrt()).collect();
        if let Some(seen) = identifiability(&task, state.x.as_slice(), &scale) {
            out.rank = out.rank.min(seen.rank);
            out.condition = out.condition.max(seen.condition);
        }
        // One linearisation without priors, as eq. 9 has it.
        let options = lm::Options { priors: false, max_iterations: 50, ..lm::Options::default() };
        let bare = lm::solve(&task, state.x.as_slice(), &options);
        let bare_model = task.apply(&bare.x).0;
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
