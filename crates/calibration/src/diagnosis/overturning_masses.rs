//! Whether the masses that overturn a base are positive.
//!
//! Where the masses of an arm are not known, a base tilts by κ m under each of three lumps, m the mass at the elbow, the wrist or the flange. A link whose
//! centre lies behind its joint makes a negative share of the lump at its end; the whole is held by positive ones. A tilt one of whose lumps is
//! surely negative and nearly as large as the largest is no weight: the elbow rises where the wrist falls, as it seems to do in air
//! that bends the beam of a tracker.

use nalgebra::DMatrix;

use super::cause::Cause;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use crate::measurement::sensor::empirical::{EmpiricalFault, Overturning};

/// Lumps: elbow, wrist, flange.
const LUMPS: usize = 3;

/// Standard deviations below zero from which a lump is surely negative.
const SURELY: f64 = 3.0;

/// Share of the largest positive lump that a link behind its joint may take off another.
const BEHIND: f64 = 0.3;

/// Whether the lumps of a tilting base, by the `values` of the cause and their covariance, can be weights; true of any other cause.
pub fn are_weights(cause: &Cause, values: &[f64], covariance: &DMatrix<f64>) -> bool {
    let Cause::Measurement(Disturbance {
        kind: Kind::Empirical(EmpiricalFault::BaseTilt { load: Overturning::Lumps, axes, .. }),
        ..
    }) = cause
    else {
        return true;
    };
    // About each axis; a third, which couples two, has either sign, and so has a sway.
    let abouts = if axes.is_some() { 2 } else { 1 };
    (0..abouts).all(|about| {
        let lumps = about * LUMPS..(about + 1) * LUMPS;
        let largest = values[lumps.clone()].iter().copied().fold(0.0, f64::max);
        let mut lumps = lumps.map(|k| (values[k], covariance[(k, k)].sqrt()));
        lumps.all(|(value, sigma)| value > -SURELY * sigma || value > -BEHIND * largest)
    })
}
