//! Growth of each link on its own, with the course of a drift of the sensor.
//!
//! Links that warm up unequally move the target as a drifting stand does where the poses of a run hardly change, for instance along a
//! short path. The catalogue grows all lengths in one proportion, so a drift of six coordinates would win there for want of a
//! rival. Growth of each link is that rival. It is a random effect, too, beside the drift in the arm that is written, together with
//! growth by any other smooth course: the residuals cannot rule it out, since links have absorbed a part of it.

use nalgebra::{DMatrix, DVector};

use super::cause::Cause;
use super::design::{Linear, Slopes};
use super::discrepancy::cosines;
use super::extension::{Extended, Subject};
use crate::measurement::sensor::disturbance::Disturbance;

/// The drift of the sensor that growth of the links resembles, if `cause` is one.
fn drift(cause: &Cause) -> Option<&Disturbance> {
    match cause {
        Cause::Measurement(disturbance) if cause.is_thermal() => Some(disturbance),
        _ => None,
    }
}

/// Whitened columns of the growth of each link with the course of `cause`, n × links that have a length; `None` if that is no drift of
/// the sensor. `per` is the number of scalar rows of an observation.
pub(super) fn columns(
    cause: &Cause,
    subject: &Subject<'_>,
    slopes: &Slopes,
    per: usize,
) -> Option<DMatrix<f64>> {
    products(slopes, &DMatrix::from_columns(&[course(drift(cause)?, subject)]), per)
}

/// The factor of a drift in each row.
fn course(drift: &Disturbance, subject: &Subject<'_>) -> DVector<f64> {
    DVector::from_vec(subject.observed.dataset.rows.iter().map(|row| drift.profile.at(row)).collect())
}

/// Growth of the links for every drift of the sensor in a fit, as random effects whose coefficients have variance 1: with the course of
/// the drift and with any other over time, each together as large in the readings as the drift itself.
///
/// Growth counts from its mean over the rows, so that the written arm has the links' lengths in the middle of the run. Counted from the
/// first row, a course that soon saturates is nearly 1 in all rows: growth was then an error of the lengths that no row contradicts.
pub(super) fn random_effects(subject: &Subject<'_>, fit: &Extended, linear: &Linear) -> Vec<DMatrix<f64>> {
    let (slopes, per) = (&linear.slopes, linear.per);
    let drifts = (0..fit.causes.len()).filter_map(|k| Some((k, course(drift(&fit.causes[k])?, subject))));
    let mut out: Vec<DMatrix<f64>> = drifts
        .flat_map(|(k, course)| {
            let drifted = linear.readings_of(fit, k).norm();
            let same = course.add_scalar(-course.mean());
            [DMatrix::from_columns(&[same]), cosines(linear.observations)]
                .map(|courses| products(slopes, &courses, per))
                .into_iter()
                .flatten()
                .map(move |columns| &columns * (drifted / columns.norm()))
        })
        .collect();
    out.retain(|columns| columns.iter().all(|v| v.is_finite()));
    out
}

/// Whether a fit has a drift for which [`random_effects`] are needed.
pub(super) fn is_needed(fit: &Extended) -> bool {
    fit.causes.iter().any(|cause| drift(cause).is_some())
}

/// The growth of each link that has a length, times each of `courses` (one row an observation); `None` if no link has one.
fn products(slopes: &Slopes, courses: &DMatrix<f64>, per: usize) -> Option<DMatrix<f64>> {
    let links = slopes.by_link_growth.iter().filter(|slope| slope.amax() > 0.0);
    let columns: Vec<DVector<f64>> = links
        .flat_map(|slope| {
            let grown = |course| DVector::from_fn(slope.len(), |s, _| slope[s] * courses[(s / per, course)]);
            (0..courses.ncols()).map(grown).collect::<Vec<_>>()
        })
        .collect();
    (!columns.is_empty()).then(|| DMatrix::from_columns(&columns))
}
