//! Registry of solvers by name, each as printed in its paper and in a robust form.
//!
//! Every solver minimises the cost of a [`Problem`] or filters its rows. Its work is counted in evaluated rows, with and
//! without derivatives ([`Estimate::evaluations`]).

use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

use crate::identification::network::{network_parameters, with_network};
use crate::identification::tolerance::{SMOOTH_SIGMA_RAD, Tolerance};
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::{Parameter, arm_parameters};
use truegrind_estimation::estimate::Estimate;
use truegrind_estimation::filter::{ekf, pf, rls, ukf, ukf_vslm};
use truegrind_estimation::least_squares::{gauss_newton, lm, ltlm, sslm, vslm};
use truegrind_estimation::network::rbf;
use truegrind_estimation::problem::Problem;
use truegrind_estimation::swarm::{bas, de, pso, qibas, sca};

/// Family of a solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Family {
    /// Batch least squares with derivatives and convergence tests.
    LeastSquares,
    /// One observation at a time; ends after the last one.
    Filter,
    /// Derivative-free search; ends when its budget is spent.
    Swarm,
    /// Network of many weights.
    Network,
}

/// Parameters fitted together with a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Scope {
    /// Links and frames; the network explains the rest.
    WithLinks,
    /// None: links are nominal, frames registered.
    Alone,
}

/// A solver of identification problems.
#[derive(Debug, Clone, Copy)]
pub struct Solver {
    /// Name on the command line and in reports.
    pub name: &'static str,
    /// One line for a list.
    pub about: &'static str,
    /// Whether the method runs as printed in its paper, without priors, so that undetermined parameters move freely. Such a fit
    /// is for comparison, never a model.
    pub as_printed: bool,
    /// Family of the method.
    pub family: Family,
    /// Scope of the network; `None` without a network.
    pub network: Option<Scope>,
    run: fn(&dyn Problem, &[f64], u64, StepLimit) -> Estimate,
    configure: fn(&toml::Table) -> Result<ConfiguredSolver, String>,
}

/// An unknown solver, or invalid settings.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SolverError {
    /// No method has that name.
    #[error("unknown method \"{name}\"; the methods are {}", known.join(", "))]
    Unknown {
        /// The requested name.
        name: String,
        /// The known names.
        known: Vec<&'static str>,
    },
    /// An unknown setting, or one of the wrong type.
    #[error("settings of {method}: {fault}")]
    Settings {
        /// The method.
        method: &'static str,
        /// The fault, with the known settings.
        fault: String,
    },
}

/// A method's call: problem, start, seed.
pub type Run = Box<dyn Fn(&dyn Problem, &[f64], u64) -> Estimate + Send + Sync>;

/// A solver with changed settings.
pub struct ConfiguredSolver {
    /// The call.
    pub run: Run,
    /// All settings, unchanged ones included.
    pub settings: toml::Table,
}

impl Solver {
    /// Minimises the cost of `problem` from `start`.
    pub fn solve(&self, problem: &dyn Problem, start: &[f64], seed: u64) -> Estimate {
        (self.run)(problem, start, seed, None)
    }

    /// As [`Solver::solve`], with at most `most_iterations` trial steps if the method has the setting `max-iterations`; never
    /// more than its own.
    pub fn solve_within(
        &self,
        problem: &dyn Problem,
        start: &[f64],
        seed: u64,
        most_iterations: usize,
    ) -> Estimate {
        (self.run)(problem, start, seed, Some(most_iterations))
    }

    /// The method with `changes` to its settings (the fields of its `Options`, in kebab-case).
    ///
    /// # Errors
    /// [`SolverError::Settings`] lists the settings, if a name or a type is wrong.
    pub fn configured(&self, changes: &toml::Table) -> Result<ConfiguredSolver, SolverError> {
        (self.configure)(changes).map_err(|fault| SolverError::Settings { method: self.name, fault })
    }

    /// The arm that the method fits: `nominal`, with a zero network if the method has one.
    pub fn prepare_model(&self, nominal: &Model, dataset: &Dataset) -> Model {
        match self.network {
            Some(_) => with_network(nominal, dataset, &network_options()),
            None => nominal.clone(),
        }
    }

    /// Whether frames must be registered first: the method explores its whole prior, or does not fit frames.
    pub fn needs_registered_frames(&self) -> bool {
        matches!(self.family, Family::Filter | Family::Swarm) || self.network == Some(Scope::Alone)
    }

    /// Free parameters of the method: all of the arm and the measurement, or a network alone.
    pub fn parameters(&self, prepared: &Model, sensing: &[Parameter]) -> Vec<Parameter> {
        match self.network {
            Some(Scope::Alone) => network_parameters(prepared),
            _ => arm_parameters(prepared).into_iter().chain(sensing.iter().copied()).collect(),
        }
    }

    /// Priors for the method: registered frames are off by no more than links of ordinary tolerance shift them (1 mm and
    /// 0.3° at some 0.7 m).
    pub fn tolerance(&self, tolerance: &Tolerance) -> Tolerance {
        if self.needs_registered_frames() {
            Tolerance { target_mm: 10.0, target_rad: 0.02, frame_mm: 10.0, frame_rad: 0.02, ..*tolerance }
        } else {
            *tolerance
        }
    }
}

/// Layout of a method's network.
pub fn network_options() -> rbf::Options {
    rbf::Options { weight_sigma: SMOOTH_SIGMA_RAD, ..rbf::Options::default() }
}

/// Overrides the fields of `base` by those of `changes`, nested tables included.
fn override_options<T: Serialize + DeserializeOwned>(
    base: &T,
    changes: &toml::Table,
) -> Result<(T, toml::Table), String> {
    let mut table = toml::Table::try_from(base).map_err(|e| e.to_string())?;
    merge(&mut table, changes);
    let options = table.clone().try_into::<T>().map_err(|e| e.message().replace('\n', " "))?;
    Ok((options, table))
}

fn merge(into: &mut toml::Table, changes: &toml::Table) {
    for (key, value) in changes {
        match (into.get_mut(key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(changes)) => merge(inner, changes),
            _ => {
                into.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Largest number of trial steps; `None` for that of the method.
type StepLimit = Option<usize>;

/// Options of a method that may limit its trial steps.
trait LimitSteps {
    fn limit_steps(&mut self, _limit: StepLimit) {}
}

macro_rules! limited {
    ($($module:ident),*) => {
        $(impl LimitSteps for $module::Options {
            fn limit_steps(&mut self, limit: StepLimit) {
                self.max_iterations = limit.map_or(self.max_iterations, |most| self.max_iterations.min(most));
            }
        })*
    };
}

// `qibas` has the options of `bas`.
limited!(lm, ltlm, sslm, vslm, gauss_newton, pso, de, sca, bas);

impl LimitSteps for ekf::Options {}
impl LimitSteps for ukf::Options {}
impl LimitSteps for ukf_vslm::Options {}
impl LimitSteps for pf::Options {}
impl LimitSteps for rls::Options {}
impl LimitSteps for rbf::Options {}

/// An entry of the registry; its module provides `Options` and `solve`.
macro_rules! method {
    ($name:literal, $about:literal, $family:ident, $as_printed:literal, $network:expr, $module:ident, $options:expr) => {
        Solver {
            name: $name,
            about: $about,
            as_printed: $as_printed,
            family: Family::$family,
            network: $network,
            run: |problem, start, seed, limit| {
                let mut options: $module::Options = $options;
                options.seed = seed;
                options.limit_steps(limit);
                $module::solve(problem, start, &options)
            },
            configure: |changes| {
                let base: $module::Options = $options;
                let (options, settings) = override_options(&base, changes)?;
                let run: Run = Box::new(move |problem, start, seed| {
                    let mut options = Clone::clone(&options);
                    options.seed = seed;
                    $module::solve(problem, start, &options)
                });
                Ok(ConfiguredSolver { run, settings })
            },
        }
    };
    ($name:literal, $about:literal, $family:ident, robust $module:ident) => {
        method!($name, $about, $family, false, None, $module, $module::Options::default())
    };
    ($name:literal, $about:literal, $family:ident, printed $module:ident) => {
        method!($name, $about, $family, true, None, $module, $module::Options::as_printed())
    };
}

/// The solvers compared by default, the default one first.
pub const SOLVERS: &[Solver] = &[
    method!("lm", "Levenberg–Marquardt, scaled, gain-ratio damping, with priors", LeastSquares, robust lm),
    method!("ltlm", "logistic-tent chaotic LM on the same scaled steps, with priors", LeastSquares, robust ltlm),
    method!("lm-as-printed", "LM of ltlm-2024 eq. 10: fixed mu = 5, unscaled, no priors", LeastSquares, printed lm),
    method!(
        "ltlm-as-printed",
        "LTLM of ltlm-2024 Algorithm I: fixed mu = 5, unscaled, no priors",
        LeastSquares,
        printed ltlm
    ),
];

/// All other solvers.
pub const FURTHER_SOLVERS: &[Solver] = &[
    method!("sslm", "LM with a step size found by line search", LeastSquares, robust sslm),
    method!("vslm", "variable step-size LM that grows back to whole steps", LeastSquares, robust vslm),
    method!("least-squares", "Gauss–Newton with halved steps, with priors", LeastSquares, robust gauss_newton),
    method!("ekf", "extended Kalman filter, one sweep, each row used once", Filter, robust ekf),
    method!("ukf", "scaled unscented Kalman filter with Q and R", Filter, robust ukf),
    method!("ukf-vslm", "scaled UKF, then step-size LM until it converges", LeastSquares, robust ukf_vslm),
    method!("pf", "particle filter, tempered, with a kernel that moves its particles", Filter, robust pf),
    method!(
        "rls",
        "recursive least squares in square-root form, linearised three times",
        Filter,
        false,
        None,
        rls,
        rls::Options { linearisations: 3, ..rls::Options::default() }
    ),
    method!("pso", "particle swarm with constriction", Swarm, robust pso),
    method!("de", "differential evolution, current-to-best", Swarm, robust de),
    method!("sca", "sine cosine algorithm that keeps what is better", Swarm, robust sca),
    method!("bas", "beetle antennae search that keeps what is better", Swarm, robust bas),
    method!("qibas", "beetle antennae search with quadratic interpolation", Swarm, robust qibas),
    Solver {
        name: "rbf",
        about: "LM on links and a radial basis function network together, with priors",
        as_printed: false,
        family: Family::Network,
        network: Some(Scope::WithLinks),
        run: |problem, start, seed, limit| {
            let mut options = lm::Options { seed, ..Default::default() };
            options.limit_steps(limit);
            lm::solve(problem, start, &options)
        },
        configure: |changes| {
            let (options, settings) = override_options(&lm::Options::default(), changes)?;
            let run: Run = Box::new(move |problem, start, seed| {
                lm::solve(problem, start, &lm::Options { seed, ..options })
            });
            Ok(ConfiguredSolver { run, settings })
        },
    },
    method!(
        "rbf-alone",
        "radial basis function network on registered frames, links nominal (ukf-vslm-2023 M5)",
        Network,
        false,
        Some(Scope::Alone),
        rbf,
        network_options()
    ),
    method!("sslm-as-printed", "ukf-vslm-2023 eq. 15, step size decaying per iteration", LeastSquares, printed sslm),
    method!(
        "vslm-as-printed",
        "ukf-vslm-2023 Algorithm 1 lines 16 to 21: step size decaying per sample",
        LeastSquares,
        printed vslm
    ),
    method!(
        "least-squares-as-printed",
        "rls-2025 eq. 9: one step, no priors",
        LeastSquares,
        printed gauss_newton
    ),
    method!("ekf-as-printed", "EKF that sweeps the same rows twelve times as if new", Filter, printed ekf),
    method!("ukf-as-printed", "ukf-vslm-2023 eq. 8 to 12 to the letter", Filter, printed ukf),
    method!("ukf-vslm-as-printed", "ukf-vslm-2023 Algorithm 1 to the letter", LeastSquares, printed ukf_vslm),
    method!("pf-as-printed", "particle filter of 1993, particles never move", Filter, printed pf),
    method!(
        "rls-as-printed",
        "rls-2025 eq. 14: P itself, begun with the first 30 observations",
        Filter,
        true,
        None,
        rls,
        rls::Options::as_printed(30)
    ),
    method!("pso-as-printed", "particle swarm of 1998", Swarm, printed pso),
    method!("de-as-printed", "differential evolution rand/1/bin of 1997", Swarm, printed de),
    method!("sca-as-printed", "sine cosine algorithm of 2016", Swarm, printed sca),
    method!("bas-as-printed", "beetle antennae search of 2017", Swarm, printed bas),
    method!("qibas-as-printed", "the same with quadratic interpolation", Swarm, printed qibas),
];

/// All solvers, the default one first.
pub fn all() -> impl Iterator<Item = &'static Solver> {
    SOLVERS.iter().chain(FURTHER_SOLVERS)
}

/// The solver of that name.
///
/// ```
/// use truegrind_calibration::identification::solver::{SolverError, by_name};
///
/// let method = by_name("lm").map_err(|error| error.to_string())?;
/// assert!(!method.as_printed);
/// let Err(SolverError::Unknown { known, .. }) = by_name("annealing") else { panic!("there is no annealing") };
/// assert!(known.contains(&"ltlm"));
/// // A setting that a method has not is refused, with the method's name.
/// let wrong = method.configured(&"no-such = 1".parse().map_err(|_| "no table")?).map(|_| ());
/// assert!(wrong.is_err_and(|error| error.to_string().starts_with("settings of lm: ")));
/// # Ok::<(), String>(())
/// ```
///
/// # Errors
/// [`SolverError::Unknown`] lists the known names.
pub fn by_name(name: &str) -> Result<&'static Solver, SolverError> {
    all()
        .find(|s| s.name == name)
        .ok_or_else(|| SolverError::Unknown { name: name.to_owned(), known: all().map(|s| s.name).collect() })
}
