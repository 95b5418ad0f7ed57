//! What to say where the poses do not show the place of the target on the flange.
//!
//! In one orientation of the flange, moving the target has the same effect as moving the sensor, so that the target stays where its prior has it.
//! The fit then describes the motion of the target, wherever it is. At a tip at r from it the arm's errors of orientation ω are added,
//! ω × r, of which these poses show as little: with J the rotations that the arm's parameters cause at a pose, less their mean over the
//! poses (which placing the work object takes up), and Σ the covariance of the parameters, the mean square over all directions of r is
//! ⅔ |r|² trace(J Σ Jᵀ).

use nalgebra::{DMatrix, Matrix3, SymmetricEigen, UnitQuaternion};

use super::fit::Fitted;
use crate::measurement::dataset::{Dataset, Sensor};
use crate::measurement::registration;
use truegrind_arm::estimated::{Estimated, Reason, ReasonKind};
use truegrind_arm::jacobian::{BaseAndTool, parameter_jacobian};
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_math::se3::Pose;
use truegrind_math::work::checkpoint;

/// Standard deviation that the readings alone leave of a direction from which it counts as not seen (mm): more than half of the
/// prior of a target of which nothing is stated is left. What is stated of it does not make it less seen.
const UNSEEN_MM: f64 = 28.87;

/// Distance of a tip from the target for which its further error is stated (mm).
const TIP_MM: f64 = 100.0;

/// Range of orientations below which they are one (°).
const ONE_ORIENTATION_DEG: f64 = 5.0;

/// Spread of orientations beside their main axis below which they turn about that axis only (°, RMS).
const ONE_AXIS_DEG: f64 = 5.0;

/// The reason; `None` where the poses or a stated frame show the target's place, or a cable measures: its length hardly ever does.
/// `dataset` has the rows that count: none with a gross error.
pub(crate) fn unseen_target(fitted: &Fitted, dataset: &Dataset, estimated: &Estimated) -> Option<Reason> {
    if dataset.sensor == Sensor::Cable {
        return None;
    }
    let place = |parameter| fitted.parameters.iter().position(|p| *p == parameter);
    let axes = [0, 1, 2];
    let [x, y, z] = axes.map(|axis| place(Parameter::Target(axis)));
    let places = [x?, y?, z?];
    let covariance = fitted.estimate.covariance.as_ref()?;
    let own = Matrix3::from_fn(|i, j| covariance[(places[i], places[j])]);
    let sigma_mm = SymmetricEigen::new(own).eigenvalues.max().max(0.0).sqrt();
    let prior_mm = fitted.priors[places[0]].sigma;
    // What an arm's unmodelled errors look like moves an unseen target farther than its standard deviation says.
    let is_frame_stated = place(Parameter::SensorFrame(0)).is_some_and(|k| fitted.priors[k].sigma < prior_mm);
    let at = fitted.frames.flange_from_target.translation.vector;
    let flanges = flanges(dataset, estimated);
    // By the poses, and how far the arm of the data sheet is off. Not by what the readings leave beside it in one frame: these may be of
    // several stations, or displaced, and turn the flange all the same.
    let is_held =
        !is_frame_stated && !registration::poses_show_target(&flanges, &at, estimated.registered.fitted.rmse);
    let of_readings_mm = (sigma_mm.powi(-2) - prior_mm.powi(-2)).max(0.0).sqrt().recip();
    if !is_held && of_readings_mm < UNSEEN_MM {
        return None;
    }
    let moved_mm = axes.map(|k| fitted.estimate.x[places[k]].abs()).into_iter().fold(0.0, f64::max);
    let poses = turning(&flanges);
    let known_mm = sigma_mm.max(prior_mm).max(moved_mm);
    // To what it is known to, not a rounded 0.
    let decimals = if known_mm < 0.95 { (-known_mm.max(1e-3).log10().floor()) as usize } else { 0 };
    // A rounded −0 is 0.
    let [x, y, z] = axes.map(|k| {
        let scale = 10_f64.powi(decimals as i32);
        format!("{:.decimals$}", (at[k] * scale).round() / scale + 0.0)
    });
    let text = format!(
        "these poses, {poses}, do not show where the target sits on the flange: moving the target has the same effect on the readings as moving the sensor. Its position is \
         taken as {x},{y},{z} mm, known only to ± {known_mm:.decimals$} mm (--touched-point and --touched-sigma state it). The errors in mm here \
         are those of the target; a tool whose tip is {TIP_MM:.0} mm from it may be off by a further {:.3} mm (1 sigma), in proportion to its \
         distance. To see it, measure two or three more poses with the flange turned by 30° or more about different axes",
        tip_mm(estimated)
    );
    Some(Reason::new(ReasonKind::TargetNotShown, text))
}

/// The flange in each row, by the data sheet.
fn flanges(dataset: &Dataset, estimated: &Estimated) -> Vec<Pose> {
    let arm = estimated.nominal.at_condition(&estimated.condition);
    dataset.rows.iter().map(|row| arm.forward(&row.joints)).collect()
}

/// How poses turn the flange, as a clause.
fn turning(flanges: &[Pose]) -> String {
    let rotations: Vec<UnitQuaternion<f64>> = flanges.iter().map(|flange| flange.rotation).collect();
    let Some(first) = rotations.first() else { return String::new() };
    let range_deg = rotations.iter().map(|r| r.angle_to(first)).fold(0.0, f64::max).to_degrees();
    if range_deg < ONE_ORIENTATION_DEG {
        return format!("which hold the flange in one orientation (within {range_deg:.1}°)");
    }
    if beside_main_axis_deg(&rotations) < ONE_AXIS_DEG {
        return "which turn the flange about one axis only".to_owned();
    }
    "which are too few, or turn the flange too little about different axes, compared with the errors of the readings"
        .to_owned()
}

/// Spread of rotations beside the axis about which they turn most (°, RMS). A rotation by θ about an axis a moves a direction d by up to
/// 2 sin(θ/2) |a × d|: turned about one axis alone, that axis stays where it is.
fn beside_main_axis_deg(rotations: &[UnitQuaternion<f64>]) -> f64 {
    let count = rotations.len().max(1) as f64;
    let matrices = || rotations.iter().map(|r| r.to_rotation_matrix().into_inner());
    let mean = matrices().sum::<Matrix3<f64>>() / count;
    let spread = matrices().map(|r| (r - mean).transpose() * (r - mean)).sum::<Matrix3<f64>>() / count;
    SymmetricEigen::new(spread).eigenvalues.min().max(0.0).sqrt().to_degrees()
}

/// Error that a tip has beside that of the target (mm, 1 σ, RMS over the measured region and all directions).
fn tip_mm(estimated: &Estimated) -> f64 {
    let arm = estimated.model.at_condition(&estimated.condition);
    let ends = BaseAndTool { world_from_base: [0.0; 6], flange_from_tool: [0.0; 6] };
    let rotations: Vec<DMatrix<f64>> = estimated
        .region
        .samples_deg
        .iter()
        .map(|q| {
            checkpoint();
            let q = Joints::from_fn(|i, _| q[i].to_radians());
            let twists = parameter_jacobian(&ends, &arm, &q, &estimated.order);
            DMatrix::from_fn(3, twists.ncols(), |i, k| twists[(3 + i, k)])
        })
        .collect();
    let Some(sum) = rotations.iter().cloned().reduce(|a, b| a + b) else { return 0.0 };
    let (count, mean) = (rotations.len() as f64, sum / rotations.len() as f64);
    let square = |rotation: &DMatrix<f64>| {
        let about_mean = rotation - &mean;
        (&about_mean * &estimated.covariance * about_mean.transpose()).trace()
    };
    let mean_square = rotations.iter().map(square).sum::<f64>() / count;
    TIP_MM * (2.0 / 3.0 * mean_square).max(0.0).sqrt()
}
