//! Figures of a study that tables, plots and sentences share.

use crate::experiment::{Treatment, Units};
use crate::protocol::{MethodResult, Outcome, Study};
use truegrind_estimation::estimate::Termination;
use truegrind_math::statistics::{ErrorSummary, median};

/// Held-out errors of all cases; `None` for a method that diverged in any, since a mean over those would be meaningless.
pub(super) fn held_out(result: &MethodResult) -> Option<Vec<ErrorSummary>> {
    let all = result.outcomes.iter().map(|o| (!o.diverged).then_some(o.held_out));
    all.collect()
}

/// Held-out errors of all cases with registered frames and nominal links.
pub(super) fn registered(study: &Study) -> Vec<ErrorSummary> {
    study.cases.iter().map(|c| c.registered).collect()
}

pub(super) fn name_of(study: &Study, id: &str) -> String {
    let found = study.results.iter().find(|r| r.method.id == id);
    found.map_or_else(|| id.to_owned(), |r| format!("{id} ({})", r.method.name))
}

pub(super) fn title(study: &Study, what: &str) -> String {
    let protocol = if study.reduced { "Reduced protocol: " } else { "" };
    let simulated = if study.simulated { ", simulated" } else { "" };
    format!("{protocol}{what}, {} cases of {} rows{simulated}", study.cases.len(), study.rows)
}

/// Summary of the cases' terminations.
pub(super) fn ended(outcomes: &[Outcome]) -> String {
    let n = outcomes.len();
    let diverged = outcomes.iter().filter(|o| o.diverged).count();
    if diverged > 0 {
        return format!("diverged in {diverged} of {n}");
    }
    let converged = outcomes.iter().filter(|o| o.termination.is_converged()).count();
    if converged == n {
        return "converged".to_owned();
    }
    let mut kinds: Vec<Termination> = Vec::new();
    for outcome in outcomes {
        if !kinds.contains(&outcome.termination) {
            kinds.push(outcome.termination);
        }
    }
    match kinds.as_slice() {
        [one] => one.to_string(),
        _ => format!("converged in {converged} of {n}"),
    }
}

pub(super) fn iterations(outcomes: &[Outcome]) -> f64 {
    outcomes.iter().map(|o| o.iterations as f64).sum::<f64>() / outcomes.len().max(1) as f64
}

pub(super) fn treatment(result: &MethodResult) -> &'static str {
    match (result.treatment, result.method.units) {
        (Treatment::Printed, Units::Rad) => "printed, rad",
        (Treatment::Printed, Units::Deg) => "printed, deg",
        (Treatment::Sound, _) => "sound",
    }
}

/// Passes over the rows of the fit: residuals only, and with derivatives.
pub(super) fn passes(study: &Study, result: &MethodResult) -> (f64, f64) {
    let per = study.sensor.scalars();
    let n = result.outcomes.len().max(1) as f64;
    let (mut residuals, mut jacobians) = (0.0, 0.0);
    for (outcome, case) in result.outcomes.iter().zip(&study.cases) {
        let rows = (case.train * per).max(1) as f64;
        residuals += outcome.evaluations.residuals as f64 / rows / n;
        jacobians += outcome.evaluations.jacobians as f64 / rows / n;
    }
    (residuals, jacobians)
}

pub(super) fn seconds(result: &MethodResult) -> f64 {
    median(&result.outcomes.iter().map(|o| o.seconds).collect::<Vec<_>>()).unwrap_or(f64::NAN)
}
