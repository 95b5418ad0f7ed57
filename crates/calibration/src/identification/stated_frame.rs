//! Whether a stated frame of a tracker or camera can be that of the readings.
//!
//! The frame that fits the readings best is right to what the arm of the data sheet is off. A stated one that puts the readings elsewhere by
//! far more is inverted, in metres, or of another set-up.

use nalgebra::{Point3, Vector3};

use super::calibration::Frames;
use super::fit::{Observations, errors_on};
use super::rounding::logged_covariance;
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::median;

/// Distance from the best frame that any arm may cause (mm), and as a multiple of the median error that is left with the best frame.
const OF_ANY_ARM_MM: f64 = 2.0;
const OF_THIS_ARM: f64 = 5.0;
/// Standard deviations of the stated frame that it may be off.
const SIGMAS: f64 = 6.0;
/// Share of the distance that is left under another reading of the frame, below which that is the likely one.
const EXPLAINS: f64 = 0.1;

/// What speaks against the stated frame, whose standard deviation is `sigma_mm`, beside the frame `found` from the readings of the arm
/// `nominal`; `None` if nothing does. A cable's outlet is not judged: lengths determine it much less.
pub fn contradiction(
    dataset: &Dataset,
    nominal: &Model,
    stated: &Frames,
    found: &Frames,
    sigma_mm: f64,
) -> Option<String> {
    if dataset.sensor == Sensor::Cable {
        return None;
    }
    let observed = Observations { dataset: dataset.clone(), angles: logged_covariance(dataset) };
    let of_this_arm_mm = OF_THIS_ARM * median(&errors_on(&observed, nominal, found))?;
    let (stated, best) = (stated.base_from_sensor, found.base_from_sensor);
    let off_mm = rms_distance_mm(dataset, &stated, &best);
    if off_mm <= OF_ANY_ARM_MM.max(of_this_arm_mm).max(SIGMAS * sigma_mm) {
        return None;
    }
    let in_metres = Pose::from_parts(Vector3::from(1e3 * stated.translation.vector).into(), stated.rotation);
    let explains = |other: &Pose| rms_distance_mm(dataset, other, &best) < EXPLAINS * off_mm;
    let likely = if explains(&stated.inverse()) {
        "it is the arm's base in the sensor's frame: state the sensor in the arm's base"
    } else if explains(&in_metres) {
        "its position is in metres: state it in mm"
    } else {
        "check that it is the sensor in the arm's base, in mm and scalar first, and of this set-up"
    };
    let at = best.translation.vector;
    Some(format!(
        "--sensor-frame: with it the readings are {off_mm:.1} mm from where the arm was; the readings put the sensor at {:.1},{:.1},{:.1}: {likely}",
        at.x, at.y, at.z
    ))
}

/// RMS distance of the readings in the base under two frames (mm).
fn rms_distance_mm(dataset: &Dataset, one: &Pose, other: &Pose) -> f64 {
    let square: f64 = dataset
        .rows
        .iter()
        .map(|row| Point3::from(row.reading.place_mm()))
        .map(|at| (one * at - other * at).norm_squared())
        .sum();
    (square / dataset.rows.len().max(1) as f64).sqrt()
}
