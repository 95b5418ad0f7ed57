//! The arm for compensation: geometry and identified effects, fitted with the causes of the measurement as nuisance.
//!
//! Every effect in this model moves real programs, so uncertain effects are excluded; geometry absorbs part of them, and the
//! covariance accounts for the rest (`in_doubt`). The discrepancy in time and that of a sensor fault's law (`sensor_discrepancy`) are nuisances
//! too: they widen the arm's covariance instead of biasing its links.

use nalgebra::DMatrix;

use super::cause::Cause;
use super::design::{Linear, linearised};
use super::discrepancy::Discrepancy;
use super::extension::{Extended, FreeParameters, Subject, filled, fit};
use super::link_growth;
use super::selection::contains_cause;
use super::sensor_discrepancy;
use crate::identification::calibration::CalibrationProblem;
use crate::identification::prior_width::learn_tolerance;
use crate::identification::tolerance::Tolerance;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Problem;

/// Causes as a written arm has them, each once.
pub(super) fn written_causes<'c>(causes: impl Iterator<Item = &'c Cause>) -> Vec<Cause> {
    // Faults of the arm last, behind the effects.
    let (faults, others): (Vec<&Cause>, Vec<&Cause>) = causes.partition(|cause| cause.effect().is_some());
    let mut out: Vec<Cause> = others.into_iter().cloned().collect();
    for written in faults.into_iter().map(Cause::as_written) {
        if !contains_cause(&out, &written) {
            out.push(written);
        }
    }
    out
}

/// Fits the written model with `causes` under the tolerances of the arm, by default learned from its own rows (with the wide ones of
/// the search, parameters that the data do not determine would deviate more from the data sheet than real arms do). It starts near
/// `extended`; `discrepancy` is that of the same rows.
pub(super) fn fit_written(
    subject: &Subject<'_>,
    arm_tolerance: &Tolerance,
    extended: &Extended,
    causes: &[Cause],
    discrepancy: Option<&Discrepancy>,
) -> Extended {
    let time_discrepancy = time_discrepancy(discrepancy);
    let kept = if causes == extended.causes { extended.clone() } else { refit(subject, causes, extended) };
    let stated = Tolerance { learn_widths: false, ..*arm_tolerance }.with_frames_of(subject.tolerance);
    let tolerance = if arm_tolerance.learn_widths {
        learn_tolerance(&stated, &kept.parameters, &kept.priors, &kept.estimate)
    } else {
        stated
    };
    let held = refit(&Subject { tolerance: &tolerance, ..*subject }, &kept.causes, &kept);
    let written = with_random_functions(subject, &held, time_discrepancy)
        .unwrap_or_else(|| with_correlated_noise(subject, held, discrepancy));
    written.whole(&Subject { tolerance: &tolerance, ..*subject })
}

/// The discrepancy if it has functions of time. Not with serial correlation: that can be model error along a path, and without it the
/// rows would hardly determine the arm's lengths.
pub(super) fn time_discrepancy(discrepancy: Option<&Discrepancy>) -> Option<&Discrepancy> {
    discrepancy.filter(|d| d.in_time() && d.correlation == 0.0)
}

fn refit(subject: &Subject<'_>, causes: &[Cause], near: &Extended) -> Extended {
    fit(subject, causes, FreeParameters::All, Some(near))
}

/// The fit with its covariance under serially correlated noise.
fn with_correlated_noise(
    subject: &Subject<'_>,
    mut fit: Extended,
    discrepancy: Option<&Discrepancy>,
) -> Extended {
    let numbers: Vec<usize> = subject.observed.dataset.rows.iter().map(|row| row.number).collect();
    let under = |own| under_correlated_noise(&fit.problem, &fit.x, own, discrepancy, &numbers);
    fit.estimate.covariance = fit.estimate.covariance.as_ref().map(under);
    fit
}

/// The covariance that an estimate has under serially correlated noise. `own` is that for independent rows, `numbers` are the rows.
///
/// With C = `own`, J the whitened Jacobian, Λ the prior precisions and R the correlation of the noise, the estimate has the covariance
/// C (JᵀR J + Λ) C = C + C Jᵀ(R − 1)J C. R is that of a first-order process beside independent noise, a φ^d between rows d apart, with
/// the found correlation of neighbours and range. The estimate remains: rows weighted by R would be more efficient, but what is
/// correlated can be model error along a path, and without it the rows would hardly determine the arm's lengths.
/// Source: White 1980; Newey and West 1987 (covariance of least squares under correlated errors).
pub(super) fn under_correlated_noise(
    problem: &CalibrationProblem,
    x: &[f64],
    own: &DMatrix<f64>,
    discrepancy: Option<&Discrepancy>,
    numbers: &[usize],
) -> DMatrix<f64> {
    let Some(discrepancy) = discrepancy.filter(|d| d.correlation > 0.0) else { return own.clone() };
    let (decay, share) = discrepancy.noise_process();
    let (_, rows) = linearised(problem, x);
    let (p, per) = (rows.nrows(), problem.rows_per_observation());
    let mut before = DMatrix::zeros(p, per);
    let mut pairs = DMatrix::zeros(p, p);
    for (i, gap) in numbers.windows(2).map(|pair| pair[1].abs_diff(pair[0])).enumerate() {
        before += rows.columns(i * per, per);
        before *= decay.powi(gap.clamp(1, 1000) as i32);
        pairs.gemm(share, &rows.columns((i + 1) * per, per), &before.transpose(), 1.0);
    }
    own + own * (&pairs + pairs.transpose()) * own
}

/// Prior standard deviations beyond which a link estimate is implausible.
const IMPLAUSIBLE: f64 = 6.0;

/// The fit with the functions of time, of the sensor's law and of the links' growth as random effects, by one Gauss–Newton step, since their effect is small.
/// `None` without any, and if a link that is confounded with them becomes implausible.
fn with_random_functions(
    subject: &Subject<'_>,
    fit: &Extended,
    time_discrepancy: Option<&Discrepancy>,
) -> Option<Extended> {
    if time_discrepancy.is_none() && !sensor_discrepancy::is_needed(fit) && !link_growth::is_needed(fit) {
        return None;
    }
    let linear = Linear::of(subject, fit);
    let mut functions = sensor_discrepancy::columns(subject, fit, &linear);
    functions.extend(link_growth::random_effects(subject, fit, &linear));
    // Beside a random course of the arm's growth the growth that the model has would be free to take any sign.
    let growth_is_known = fit.causes.iter().any(Cause::is_growth_of_arm);
    functions.extend(time_discrepancy.map(|d| d.in_time_columns(growth_is_known)));
    let columns: Vec<_> = functions.iter().flat_map(|columns| columns.column_iter()).collect();
    if columns.is_empty() {
        return None;
    }
    let noise = time_discrepancy.map_or(1.0, |discrepancy| discrepancy.noise);
    let (x, covariance) = linear.step_beside(&DMatrix::from_columns(&columns), noise);
    let is_implausible = |k: usize| {
        let is_link = matches!(fit.parameters[k], Parameter::Link { .. });
        is_link && !((x[k] - fit.priors[k].mean).abs() <= IMPLAUSIBLE * fit.priors[k].sigma)
    };
    if !x.iter().all(|v| v.is_finite()) || (0..x.len()).any(is_implausible) {
        return None;
    }
    let (model, frames) = fit.problem.apply(&x);
    let mut out = fit.clone();
    out.estimate.x.clone_from(&x);
    out.estimate.covariance = Some(covariance);
    Some(Extended { causes: filled(&fit.causes, &model, &frames), x, model, frames, ..out })
}
