//! Discrepancy of sensor faults whose law is known only roughly: random functions of the sensor's own variables.
//!
//! The catalogue describes a slack cable, a pulley, a drum or a target nest by a few terms of a series. The rest of the law is a
//! smooth function of the same variables. Links fit a part of it without a trace in the residuals, and the data then determine a
//! wrong arm by many standard deviations. So that function is free beside the arm that is written:
//!
//! δ(u) ~ GP(0, s² exp(−|u − u'|²/2)),
//!
//! u the vector from a cable's outlet to its hook, in units of twice its standard deviation along an axis, or the direction from which the
//! target is seen, in the frame of the flange. s is the root mean square of what the faults of the group add to the readings:
//! the rest of a law may be as large as the part that is described. The residuals cannot determine s, since they do not contain
//! what the links have fitted. Refraction has no such function: one over the vectors of the beam is confounded with all links, and without
//! it no arm was found worse (0 of 47 in `unseen`).
//!
//! Layers of a drum change the scale of a cable too, and its rows cannot tell that from the size of the arm: the catalogue has no linear
//! term. With a radius that changes in proportion to what is wound, the error is a parabola of the length whose vertex is the empty
//! drum. Between the lengths m − h and m + h its terms of first and second degree (Legendre) have the ratio 3 m/h. So scale is a random
//! effect with standard deviation 3 m/h² |b|, b the found term of second degree: where the maker adjusted the scale is unknown. The same holds
//! for a tracker or camera whose distances are off.
//!
//! Source: Kennedy and O'Hagan 2001; Brynjarsdóttir and O'Hagan 2014 (parameters are learned beside a discrepancy only under a
//! realistic prior of it); random features of the process: Rahimi and Recht 2007.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::cause::Cause;
use super::design::Linear;
use super::extension::{Extended, Subject};
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use crate::measurement::sensor::empirical::EmpiricalFault;

/// Features of a function with values along one axis, and along three.
const FEATURES: [usize; 2] = [96, 64];

/// The variables of a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Law {
    /// Of a cable: the vector from outlet to hook.
    Cable,
    /// Of a target: the direction from which it is seen, in the frame of the flange.
    Target,
}

impl Law {
    const ALL: [Self; 2] = [Self::Cable, Self::Target];

    fn of(cause: &Cause) -> Option<Self> {
        let of_target =
            |d: &Disturbance| matches!(d.kind, Kind::Empirical(EmpiricalFault::TargetNest { .. }));
        match cause {
            _ if cause.is_in_cable() => Some(Self::Cable),
            Cause::Measurement(disturbance) if of_target(disturbance) => Some(Self::Target),
            _ => None,
        }
    }

    /// u of each observation.
    fn variables(self, subject: &Subject<'_>, fit: &Extended) -> Vec<Vector3<f64>> {
        let dataset = &subject.observed.dataset;
        let touched = Point3::from(fit.frames.flange_from_target.translation.vector);
        let station = fit.frames.base_from_sensor.translation.vector;
        let rows = dataset.rows.iter().map(|row| {
            let flange = fit.model.forward(&row.joints, &row.condition);
            let at = (flange * touched).coords;
            match self {
                Self::Cable => at - fit.frames.outlets_mm[row.anchor],
                Self::Target => flange.rotation.inverse() * (at - station).normalize(),
            }
        });
        let mut out: Vec<Vector3<f64>> = rows.collect();
        if self != Self::Target {
            let count = out.len() as f64;
            let mean = out.iter().sum::<Vector3<f64>>() / count;
            let square = out.iter().map(|u| (u - mean).norm_squared()).sum::<f64>() / count;
            let unit = 2.0 * (square / 3.0).sqrt();
            out.iter_mut().for_each(|u| *u /= unit);
        }
        out
    }
}

/// Columns of the random functions beside a fit for each of its laws; coefficients have variance 1.
pub(super) fn columns(subject: &Subject<'_>, fit: &Extended, linear: &Linear) -> Vec<DMatrix<f64>> {
    let laws = Law::ALL.into_iter().filter(|law| fit.causes.iter().any(|c| Law::of(c) == Some(*law)));
    let rest = laws.filter_map(|law| columns_of(law, subject, fit, linear));
    rest.chain(scale_of_law(fit, linear)).collect()
}

/// Of a fault of lengths between two of them (mm) the term of second degree (mm).
fn second_degree(cause: &Cause) -> Option<([f64; 2], f64)> {
    let Cause::Measurement(Disturbance { kind: Kind::Empirical(fault), values, .. }) = cause else {
        return None;
    };
    match *fault {
        EmpiricalFault::Drum { from_mm, to_mm } => Some(([from_mm, to_mm].map(f64::from), values[0])),
        EmpiricalFault::Range { from_mm, to_mm } => Some(([from_mm, to_mm].map(f64::from), values[1])),
        _ => None,
    }
}

/// The scale of a sensor whose lengths are off, as a random effect.
fn scale_of_law(fit: &Extended, linear: &Linear) -> Option<DMatrix<f64>> {
    let ([from, to], found) = fit.causes.iter().find_map(second_degree)?;
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let sigma = 3.0 * middle / (half * half) * found.abs();
    let column = &linear.slopes.by_scale * sigma;
    column.iter().all(|v| v.is_finite()).then(|| DMatrix::from_columns(&[column]))
}

/// Whether a fit has a fault for which [`columns`] are needed.
pub(super) fn is_needed(fit: &Extended) -> bool {
    fit.causes.iter().any(|cause| Law::of(cause).is_some() || second_degree(cause).is_some())
}

fn columns_of(law: Law, subject: &Subject<'_>, fit: &Extended, linear: &Linear) -> Option<DMatrix<f64>> {
    let causes = (0..fit.causes.len()).filter(|&k| Law::of(&fit.causes[k]) == Some(law));
    let pushed = causes.fold(DVector::zeros(linear.rows.ncols()), |sum, k| sum + linear.readings_of(fit, k));
    let slopes = &linear.slopes;
    let axes: Vec<DVector<f64>> = match law {
        Law::Cable => vec![slopes.by_zero.clone()],
        Law::Target => slopes.by_target.column_iter().map(|c| c.into_owned()).collect(),
    };
    let features = features(&law.variables(subject, fit), FEATURES[usize::from(axes.len() > 1)]);
    let mut out = DMatrix::zeros(pushed.len(), axes.len() * features.ncols());
    let pairs = axes.iter().flat_map(|axis| features.column_iter().map(move |feature| (axis, feature)));
    for (mut column, (axis, feature)) in out.column_iter_mut().zip(pairs) {
        column.iter_mut().enumerate().for_each(|(s, v)| *v = axis[s] * feature[s / linear.per]);
    }
    out *= pushed.norm() / out.norm();
    out.iter().all(|v| v.is_finite()).then_some(out)
}

/// cos(ωᵀu + φ) with ω ~ N(0, I) and φ uniform, of a fixed seed.
fn features(variables: &[Vector3<f64>], count: usize) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut out = DMatrix::zeros(variables.len(), count);
    for mut column in out.column_iter_mut() {
        let frequency: Vector3<f64> = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
        let phase = rng.random_range(0.0..TAU);
        column.iter_mut().zip(variables).for_each(|(v, u)| *v = (frequency.dot(u) + phase).cos());
    }
    out
}
