//! Whether a stated frame of a sensor can be that of the readings.
//!
//! The frame that fits the readings best is right to what the arm of the data sheet is off. A stated one that puts the readings elsewhere by
//! far more is inverted, in metres, or of another set-up.
//!
//! In a small box an arm that is itself a few millimetres off looks like another frame, so that this alone refuses nothing: geometry is
//! fitted with the stated frame and without it ([`judged_by_fit`]). A frame that is right leaves nearly as little; one that is wrong
//! leaves much more, as no links make up for it.
//!
//! What is left of the difference once geometry is fitted is judged in standard deviations. With Δ from the fitted to the stated frame,
//! S the covariance of the fitted one and P that of the stated one, χ² = Δᵀ (S + P)⁻¹ Δ, and the stated one is off by
//! P (S + P)⁻¹ Δ. What links or a scale error of the sensor take up is in S.
//!
//! Where the poses do not show the target's place on the flange, the frame that fits best holds for an assumed place. The stated frame is
//! then judged beside the frame that fits best with the stated target, or with the one that the stated frame implies ([`beside`]).

use nalgebra::{DMatrix, DVector, Point3, UnitQuaternion, Vector3, Vector6};

use super::calibration::Frames;
use super::fit::{Fitted, Observations, errors_on};
use super::identify::{FittedGeometry, Options, fit_geometry};
use super::linearised_readings::widen_by_scale;
use super::rounding::logged_covariance;
use super::sensor_laws::mean_reading;
use super::start::unseen_target;
use super::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::registration::{known_target, target_in_known_frame};
use crate::measurement::split;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_math::se3::{Pose, apply_twist};
use truegrind_math::statistics::median;

/// Distance from the best frame that any arm may cause (mm), and as a multiple of the median error that is left with the best frame.
const OF_ANY_ARM_MM: f64 = 2.0;
const OF_THIS_ARM: f64 = 5.0;
/// The same in one orientation of the flange (mm), where all that an arm is off by there looks like another frame: 0.3° at two metres.
const IN_ONE_ORIENTATION_MM: f64 = 10.0;
/// Standard deviations of the stated frame that it may be off.
const SIGMAS: f64 = 6.0;
/// Share of the distance that is left under another reading of the frame, below which that is the likely one.
const EXPLAINS: f64 = 0.1;

/// Standard deviation of a target (mm) that the poses do not show, where a stated frame is judged beside geometry: with 50 mm geometry moves it
/// to gain what an arm is off by otherwise.
const ASSUMED_TARGET_MM: f64 = 1.0;

/// The tolerances with which geometry is fitted to judge a stated frame.
fn tolerance_beside(dataset: &Dataset, nominal: &Model, tolerance: &Tolerance) -> Tolerance {
    let held = unseen_target(dataset, nominal).is_some();
    let target_mm = if held { tolerance.target_mm.min(ASSUMED_TARGET_MM) } else { tolerance.target_mm };
    Tolerance { target_mm, ..*tolerance }
}

/// Distance of a target from the flange (mm) that no adapter has.
const FAR_OFF_FLANGE_MM: f64 = 1000.0;

/// The frames beside which a stated one is judged: `found` itself, the start from the readings of the arm `nominal`, where the poses show
/// the target's place or that of a cable is asked for; otherwise those that fit the readings best with the target `touched`, or, without
/// one, with the target that the stated frame implies.
pub fn beside(
    dataset: &Dataset,
    nominal: &Model,
    stated: &Frames,
    touched: Option<&Pose>,
    found: &Frames,
) -> Frames {
    let held = || {
        let places = unseen_target(dataset, nominal)?;
        let implied_mm =
            || target_in_known_frame(&places.flanges, &places.measured_mm, &stated.base_from_sensor);
        let target_mm = touched.map_or_else(implied_mm, |touched| touched.translation.vector);
        if !(target_mm.norm() < FAR_OFF_FLANGE_MM) {
            return None;
        }
        let fit = known_target(&places.flanges, &places.measured_mm, &target_mm)?;
        let flange_from_target = Pose::from_parts(target_mm.into(), found.flange_from_target.rotation);
        Some(Frames { base_from_sensor: fit.base_from_sensor, flange_from_target, ..found.clone() })
    };
    held().unwrap_or_else(|| found.clone())
}

/// The frames `found`, the start from the readings of the arm `nominal`, with the target at `touched`: the sensor's frame is registered
/// again beside it where the poses do not show it. A target without a rotation keeps that of `found`.
pub fn with_touched_point(dataset: &Dataset, nominal: &Model, touched: &Pose, found: Frames) -> Frames {
    let target_mm = touched.translation.vector;
    let rotation = if touched.rotation == UnitQuaternion::identity() {
        found.flange_from_target.rotation
    } else {
        touched.rotation
    };
    let fit = unseen_target(dataset, nominal)
        .and_then(|places| known_target(&places.flanges, &places.measured_mm, &target_mm));
    let base_from_sensor = fit.map_or(found.base_from_sensor, |fit| fit.base_from_sensor);
    Frames { base_from_sensor, flange_from_target: Pose::from_parts(target_mm.into(), rotation), ..found }
}

/// What speaks against the target `touched` on the flange beside `found`, the start from the readings of the arm `nominal`, where the poses
/// show its place; `None` if nothing does.
pub fn contradicted_target(
    dataset: &Dataset,
    nominal: &Model,
    touched: &Pose,
    sigma_mm: f64,
    found: &Frames,
) -> Option<String> {
    if dataset.sensor == Sensor::Cable || unseen_target(dataset, nominal).is_some() {
        return None;
    }
    let observed = Observations { dataset: dataset.clone(), angles: logged_covariance(dataset) };
    let of_this_arm_mm = OF_THIS_ARM * median(&errors_on(&observed, nominal, found))?;
    let at = found.flange_from_target.translation.vector;
    let off_mm = (touched.translation.vector - at).norm();
    (off_mm > OF_ANY_ARM_MM.max(of_this_arm_mm).max(SIGMAS * sigma_mm)).then(|| {
        format!(
            "--touched-point: the readings put the target {off_mm:.1} mm from there, at {:.1},{:.1},{:.1} on the flange: check that it is given in \
             mm in the flange frame, and that it belongs to this set-up",
            at.x, at.y, at.z
        )
    })
}

/// What speaks against the target `touched` on the flange, of standard deviation `sigma_mm`, once geometry is fitted; `None` if nothing does.
/// Along a smooth path the flange turns as it moves, so that an arm that is off by what any arm is puts the target centimetres elsewhere:
/// with S the covariance of the target that geometry leaves and P that of the stated one, χ² = Δᵀ (S + P)⁻¹ Δ. A point that is right leaves
/// nearly as little as a free one. Without a fit nothing is judged: that of the readings says why.
pub fn target_contradiction_by_fit(
    of_arm: &Tolerance,
    touched: &Pose,
    sigma_mm: f64,
    found: &Frames,
    (dataset, nominal): (&Dataset, &Model),
) -> Option<String> {
    let mut free = fitted_beside(found, *of_arm, (dataset, nominal))?;
    let stated = with_touched_point(dataset, nominal, touched, found.clone());
    let with = fitted_beside(&stated, Tolerance { target_mm: sigma_mm, ..*of_arm }, (dataset, nominal));
    if of_arm.scale.is_none() {
        free.widen_by_scale(MAX_SCALE_ERROR);
    }
    let free = free.fitted;
    let own: Vec<usize> = (0..free.parameters.len())
        .filter(|&k| matches!(free.parameters[k], Parameter::Target(0..3)))
        .collect();
    let covariance = free.estimate.covariance.as_ref()?;
    let of_fit = covariance.select_rows(&own).select_columns(&own);
    let of_stated = DMatrix::identity(own.len(), own.len()) * sigma_mm.powi(2);
    let at = free.frames.flange_from_target.translation.vector;
    let away = touched.translation.vector - at;
    let difference = DVector::from_column_slice(&away.as_slice()[..own.len()]);
    let weighted = (of_fit + &of_stated).cholesky()?.solve(&difference);
    let square = difference.dot(&weighted);
    let off_mm = (of_stated * weighted).norm();
    let is_off = square > CONTRADICTS && off_mm > OF_FIT * typical_error_mm(&free, dataset);
    let leaves_more = with.is_none_or(|with| with.fitted.sigma_mm > OF_FIT * free.sigma_mm.max(ANY_NOISE_MM));
    (is_off || leaves_more).then(|| {
        format!(
            "--touched-point: with the arm's geometry fitted the readings put the target {:.1} mm from there, at {:.1},{:.1},{:.1} on the flange, \
             which contradicts it by {:.0} standard deviations: check that it is given in mm in the flange frame, and that it belongs to this \
             set-up",
            away.norm(),
            at.x,
            at.y,
            at.z,
            square.sqrt()
        )
    })
}

/// Geometry fitted from `frames` with the priors `tolerance`.
fn fitted_beside(
    frames: &Frames,
    tolerance: Tolerance,
    (dataset, nominal): (&Dataset, &Model),
) -> Option<FittedGeometry> {
    let options = Options { tolerance, ..Options::default() };
    let split = |rows: &Dataset| split::random(rows, options.held_out, options.seed);
    let mut geometry = fit_geometry(dataset, "", nominal, frames, &split, &options).ok()?;
    if let Some(sigma) = tolerance.scale {
        geometry.widen_by_scale(sigma);
    }
    Some(geometry)
}

impl FittedGeometry {
    /// Adds the uncertainty of the sensor's scale to the covariance.
    fn widen_by_scale(&mut self, sigma: f64) {
        widen_by_scale(&mut self.fitted, &self.rows, sigma);
    }
}

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
    let of_any_arm_mm =
        if unseen_target(dataset, nominal).is_some() { IN_ONE_ORIENTATION_MM } else { OF_ANY_ARM_MM };
    if off_mm <= of_any_arm_mm.max(of_this_arm_mm).max(SIGMAS * sigma_mm) {
        return None;
    }
    let in_metres = Pose::from_parts(Vector3::from(1e3 * stated.translation.vector).into(), stated.rotation);
    let explains = |other: &Pose| rms_distance_mm(dataset, other, &best) < EXPLAINS * off_mm;
    let likely = if explains(&stated.inverse()) {
        "it is the arm's base in the sensor's frame: state the sensor in the arm's base"
    } else if explains(&in_metres) {
        "its position is in metres: state it in mm"
    } else {
        "check that it is the pose of the sensor in the base of the arm, in mm with the scalar of the quaternion first, and that it belongs to \
         this set-up"
    };
    let at = best.translation.vector;
    Some(format!(
        "--sensor-frame: with it the readings are {off_mm:.1} mm from where the arm was; the readings put the sensor at {:.1},{:.1},{:.1}: {likely}",
        at.x, at.y, at.z
    ))
}

/// χ² of a stated frame from which it contradicts the readings: six standard deviations in six dimensions, by chance one in 10⁸.
const CONTRADICTS: f64 = 50.0;
/// How many times the error that geometry leaves the stated frame must be off: what else is wrong with an arm shifts the frame too.
const OF_FIT: f64 = 3.0;
/// Relative error of the sensor's scale, where none is stated.
const MAX_SCALE_ERROR: f64 = 1e-2;

/// What speaks against a stated frame, or a cable's outlet and zero, of standard deviation `sigma` (mm; rad), beside `geometry`, fitted
/// with free frames to readings whose scale is right to `scale`; `None` if nothing does.
pub fn contradiction_beside_geometry(
    dataset: &Dataset,
    mut geometry: FittedGeometry,
    stated: &Frames,
    sigma: [f64; 2],
    scale: Option<f64>,
) -> Option<String> {
    if scale.is_none() {
        // What is stated is in the covariance.
        geometry.widen_by_scale(MAX_SCALE_ERROR);
    }
    let geometry = geometry.fitted;
    let own: Vec<usize> =
        (0..geometry.parameters.len()).filter(|&k| is_of_frame(&geometry.parameters[k])).collect();
    let covariance = geometry.estimate.covariance.as_ref()?;
    let centre = mean_reading(dataset);
    let (difference, by_scale) = own
        .iter()
        .map(|&k| difference(&geometry.parameters[k], stated, &geometry.frames, &centre))
        .unzip::<f64, f64, Vec<f64>, Vec<f64>>();
    let (difference, by_scale) =
        (DVector::from_vec(difference), DVector::from_vec(by_scale) * scale.unwrap_or(MAX_SCALE_ERROR));
    let of_stated = DMatrix::from_diagonal(&DVector::from_iterator(
        own.len(),
        own.iter().map(|&k| {
            let turns = matches!(geometry.parameters[k], Parameter::SensorFrame(3..));
            sigma[usize::from(turns)].powi(2)
        }),
    ));
    let of_fit = covariance.select_rows(&own).select_columns(&own) + &by_scale * by_scale.transpose();
    let weighted = (of_fit + &of_stated).cholesky()?.solve(&difference);
    let square = difference.dot(&weighted);
    let off = of_stated * weighted;
    let error_mm = typical_error_mm(&geometry, dataset);
    let cable = dataset.sensor == Sensor::Cable;
    let (off_mm, option) = if cable {
        (off.amax(), "--outlet and --cable-zero")
    } else {
        let right = apply_twist(&stated.base_from_sensor, &-Vector6::from_column_slice(off.as_slice()));
        (rms_distance_mm(dataset, &stated.base_from_sensor, &right), "--sensor-frame")
    };
    (square > CONTRADICTS && off_mm > OF_FIT * error_mm).then(|| {
        format!(
            "{option}: with the arm's geometry fitted the readings contradict it by {:.0} standard deviations, which is {off_mm:.2} mm \
             at the arm: measure it again, state how uncertain it is (--frame-sigma), or leave it out",
            square.sqrt(),
        )
    })
}

/// Error that any instrument has (mm): below it two fits do not differ.
const ANY_NOISE_MM: f64 = 0.01;

/// What speaks against a stated frame, of standard deviation `sigma` (mm; rad), by what geometry leaves with it and without it, and the fit
/// without it. No judgement where that fails: the fit that is asked for says why.
pub fn judged_by_fit(
    [tolerance, of_arm]: [&Tolerance; 2],
    (stated, found): (&Frames, &Frames),
    sigma: [f64; 2],
    (dataset, nominal): (&Dataset, &Model),
) -> (Option<Option<String>>, Option<FittedGeometry>) {
    let of_arm = Tolerance { target_mm: tolerance.target_mm, ..*of_arm };
    let of_arm = tolerance_beside(dataset, nominal, &of_arm);
    let fit = |frames: &Frames, tolerance: Tolerance| fitted_beside(frames, tolerance, (dataset, nominal));
    let Some(free) = fit(found, of_arm) else { return (None, None) };
    let with = fit(stated, Tolerance { frame_mm: sigma[0], frame_rad: sigma[1], ..of_arm });
    let with = with.as_ref().map(|with| &with.fitted);
    (Some(contradiction_by_fit(dataset, &free.fitted, with)), Some(free))
}

/// What speaks against a stated frame, or a cable's outlet and zero, by what geometry leaves `with` it beside what it leaves `free` of it;
/// `None` if nothing does. Without a fit with it, none is possible.
fn contradiction_by_fit(dataset: &Dataset, free: &Fitted, with: Option<&Fitted>) -> Option<String> {
    let (option, it, check) = if dataset.sensor == Sensor::Cable {
        (
            "--outlet and --cable-zero",
            "them",
            "check that they are in mm, the outlet in the base of the arm, and that they belong to this set-up, state how uncertain they are \
             (--frame-sigma), or leave them out",
        )
    } else {
        (
            "--sensor-frame",
            "it",
            "check that it is the pose of the sensor in the base of the arm, in mm with the scalar of the quaternion first, and that it belongs \
             to this set-up, state how uncertain it is (--frame-sigma), or leave it out",
        )
    };
    let least_mm = free.sigma_mm;
    match with {
        None => Some(format!("{option}: no arm fits the readings with {it}: {check}")),
        Some(with) => (with.sigma_mm > OF_FIT * least_mm.max(ANY_NOISE_MM)).then(|| {
            format!(
                "{option}: with {it} the best geometry leaves {:.3} mm along each axis, without {it} {least_mm:.3} mm: {check}",
                with.sigma_mm
            )
        }),
    }
}

fn is_of_frame(parameter: &Parameter) -> bool {
    matches!(parameter, Parameter::SensorFrame(_) | Parameter::Outlet { .. } | Parameter::Zero { .. })
}

/// A parameter of the stated frames minus that of the fitted ones, and what a sensor whose readings, `centre` in the mean, are all too
/// long by their own length does to it.
fn difference(parameter: &Parameter, stated: &Frames, fitted: &Frames, centre: &Vector3<f64>) -> (f64, f64) {
    let (to, from) = (&stated.base_from_sensor, &fitted.base_from_sensor);
    match *parameter {
        Parameter::SensorFrame(k @ 0..3) => {
            ((to.translation.vector - from.translation.vector)[k], (from.rotation * centre)[k])
        }
        Parameter::SensorFrame(k) => ((to.rotation * from.rotation.inverse()).scaled_axis()[k - 3], 0.0),
        Parameter::Outlet { anchor, axis } => {
            (stated.outlets_mm[anchor][axis] - fitted.outlets_mm[anchor][axis], 0.0)
        }
        Parameter::Zero { anchor } => (stated.zeros_mm[anchor] - fitted.zeros_mm[anchor], centre.x),
        _ => (0.0, 0.0),
    }
}

/// Median error of the fitted arm, which outliers do not move (mm).
fn typical_error_mm(geometry: &Fitted, dataset: &Dataset) -> f64 {
    let observed = Observations { dataset: dataset.clone(), angles: logged_covariance(dataset) };
    median(&errors_on(&observed, &geometry.model, &geometry.frames)).unwrap_or(0.0)
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
