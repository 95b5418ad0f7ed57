//! The arm that is handed on to compensation: geometry and the causes of the arm that are identified, beside what the
//! measurement suffered.
//!
//! A cause of the arm that is not certain moves real programs, so it stays out; geometry takes what it can of it, and the covariance
//! says what is missing (`in_doubt`). What wandered
//! while the rows were taken is fitted beside the arm and left behind, whatever it was: it widens the arm's covariance and no
//! longer bends its links.

use super::cause::Cause;
use super::design::Linear;
use super::discrepancy::Discrepancy;
use super::extension::{Extended, Freedom, Subject, filled, fit};
use crate::identification::prior_width::learn_tolerance;
use crate::identification::tolerance::Tolerance;
use crate::measurement::sensor::disturbance::Kind;
use truegrind_arm::parameter::Parameter;

/// The causes of a fit that are written or left behind with the measurement: of the arm those that are certain, as `certain` says
/// of each that was tried.
pub(super) fn kept(extended: &Extended, certain: &[bool]) -> Vec<Cause> {
    let causes = extended.causes.iter().enumerate();
    let kept = causes.filter(|&(k, cause)| match cause {
        Cause::Measurement(_) => !is_beyond_an_arm(cause),
        Cause::Arm(_) => certain.get(k) != Some(&false),
    });
    kept.map(|(_, cause)| cause.clone()).collect()
}

/// Whether a cause is of the arm, and yet none that a model of it can carry.
pub(super) fn is_beyond_an_arm(cause: &Cause) -> bool {
    matches!(cause, Cause::Measurement(d) if matches!(d.kind, Kind::Empirical(form) if form.is_in_arm()))
}

/// The fit with these causes as its arm is written, under the tolerances that its own rows tell (the wide ones of the search would
/// leave what the data do not see farther from the data sheet than arms are). It starts near `extended`, and `discrepancy` is that of
/// the same rows.
pub(super) fn written(
    subject: &Subject<'_>,
    extended: &Extended,
    causes: &[Cause],
    discrepancy: Option<&Discrepancy>,
) -> Extended {
    let wandered = wandered(discrepancy);
    let kept = if causes == extended.causes { extended.clone() } else { refit(subject, causes, extended) };
    let wide = subject.tolerance;
    let catalogue = Tolerance { frame_mm: wide.frame_mm, frame_rad: wide.frame_rad, ..Tolerance::default() };
    let tolerance = learn_tolerance(&catalogue, &kept.parameters, &kept.priors, &kept.estimate);
    let held = refit(&Subject { tolerance: &tolerance, ..*subject }, &kept.causes, &kept);
    let written = wandered.and_then(|wandered| beside(subject, &held, wandered)).unwrap_or(held);
    written.whole(&Subject { tolerance: &tolerance, ..*subject })
}

/// What wandered while the rows were taken, where there is such a thing. Readings that resemble those before them may do so for what the
/// model gets wrong along the way: freed of that, the rows would say little of the arm's lengths.
pub(super) fn wandered(discrepancy: Option<&Discrepancy>) -> Option<&Discrepancy> {
    discrepancy.filter(|d| d.in_time() && d.correlation == 0.0)
}

fn refit(subject: &Subject<'_>, causes: &[Cause], near: &Extended) -> Extended {
    fit(subject, causes, Freedom::All, Some(near))
}

/// Standard deviations of its prior beyond which a link was not moved by what the rows say.
const STRAYED: f64 = 6.0;

/// The fit with what wandered free beside it, by one step: it is small against what is linear. Where it is not, and links that the
/// rows do not tell from what wandered go astray, there is none.
fn beside(subject: &Subject<'_>, fit: &Extended, wandered: &Discrepancy) -> Option<Extended> {
    let numbers: Vec<usize> = subject.observed.dataset.rows.iter().map(|r| r.number).collect();
    let linear = Linear::of(subject, fit);
    let whole = linear.beside(&wandered.in_time_columns()).filtered(0.0, &numbers, wandered.noise).whole();
    let (x, covariance) = whole.estimate(fit.x.len());
    let strayed = |k: usize| {
        let is_link = matches!(fit.parameters[k], Parameter::Link { .. });
        is_link && !((x[k] - fit.priors[k].mean).abs() <= STRAYED * fit.priors[k].sigma)
    };
    if !x.iter().all(|v| v.is_finite()) || (0..x.len()).any(strayed) {
        return None;
    }
    let (model, frames) = fit.problem.apply(&x);
    let mut out = fit.clone();
    out.estimate.x.clone_from(&x);
    out.estimate.covariance = Some(covariance);
    Some(Extended { causes: filled(&fit.causes, &model, &frames), x, model, frames, ..out })
}
