//! How far the arm has moved from the model that the track began with, whether or not an alarm was raised.
//!
//! A drift may be slower than any bound of the innovations, since the filter follows it. Programs were corrected with the first model, so
//! the total change since then is what counts for them. It is the displacement of the target over the measured region, after its best placement:
//! a motion of the base and of the target's mounting is not the arm's shape. A turn about axis 1 that the sensor saw counts by itself
//! (`turn`).
//!
//! **Two distances.** From the first model, whose uncertainty can hide a change; and from the arm as the first poses of the track showed
//! it, which is known better. The arm is another one where either is beyond what the uncertainties explain.
//!
//! **Bound.** With λₖ the mean squares that the axes of the covariances make of the displacement, the square of the distance is a sum of
//! λₖ χ²₁: taken as χ² with g = (Σλ)²/Σλ² degrees of freedom (Satterthwaite 1946), and exceeded in 1 of 10 000 cases. After a change of the
//! arm was told, it is another one as long as a distance is larger than expected at all.

use nalgebra::{DMatrix, Rotation3, Vector3};

use super::alarm::{Alarm, Course};
use super::last_link::LastLink;
use super::tracker::Tracker;
use super::turn::{Turn, is_of_joint_1};
use crate::identification::rigid_motion_columns::{fill, place};
use truegrind_arm::model::{Joints, Model};
use truegrind_math::distribution::wilson_hilferty;

/// The arm as tracked against the model that the track began with.
#[derive(Debug, Clone, PartialEq)]
pub struct Departure {
    /// RMS displacement of the target (mm).
    pub rms_mm: f64,
    /// What the uncertainties of the first model and of the track make of it (mm, 1σ).
    pub expected_mm: f64,
    /// What the uncertainty of the track alone makes of it: the error that its model is expected to have (mm).
    pub tracked_mm: f64,
    /// Displacement since the first poses of the track, and what the uncertainties make of it (mm).
    pub since_first_poses_mm: Option<[f64; 2]>,
    /// Parameters that moved by more than four of the standard deviations that they began with, those that moved most first.
    pub parameters: Vec<MovedParameter>,
    /// A turn about axis 1 against the sensor, which is not part of the distances.
    pub turn: Option<Turn>,
    /// A move of the touched point that the last link may have made, which is not part of the distances either.
    pub last_link: Option<LastLink>,
    /// An earlier or present alarm that tells a change of the arm.
    pub reported: Option<Alarm>,
    /// Whether the arm has another shape now.
    pub is_of_shape: bool,
    /// Whether the arm is another one now, by its shape or a turn.
    pub is_significant: bool,
}

/// A parameter of the arm that moved since the track began.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// By how much.
    pub by: f64,
    /// Present standard deviation.
    pub sigma: f64,
}

/// Poses of the region that are compared.
const POSES: usize = 200;

/// A displacement counts beyond this share of the model's held-out error, or of the track's noise.
const SHARE: f64 = 0.5;

/// Normal quantile of a displacement's bound: 1 in 10 000.
const DEVIATIONS: f64 = 3.72;

/// Parameters count beyond this many of their first standard deviations.
const PARAMETER_SIGMAS: f64 = 4.0;

impl Tracker {
    /// How far the arm has moved; `None` where no pose was measured.
    pub fn departure(&self) -> Option<Departure> {
        let samples = &self.state.region.samples_deg;
        let step = samples.len().div_ceil(POSES).max(1);
        let poses: Vec<Joints> =
            samples.iter().step_by(step).map(|sample| Joints::from(sample.map(f64::to_radians))).collect();
        if poses.len() < MIN_POSES {
            return None;
        }
        let target = self.frames.flange_from_target.translation.vector;
        let placed = |model: &Model| -> Vec<(Vector3<f64>, Rotation3<f64>)> {
            let at = |joints: &Joints| {
                let flange = model.forward(joints, &self.initial.condition);
                let rotation = flange.rotation.to_rotation_matrix();
                (flange.translation.vector + rotation * target, rotation)
            };
            poses.iter().map(at).collect()
        };
        let (first, now) = (placed(&self.initial.model), placed(&self.current().0));
        let arm = self.initial.order.len();
        let rows = 3 * poses.len();
        let problem = self.without_rows();
        let mut x = vec![0.0; self.parameters.len()];
        let tracked = self.filter.covariance().view((0, 0), (arm, arm)).into_owned();
        let scale = self.scatter(self.state.history.len()).unwrap_or(1.0).max(1.0);
        // The displacement, and what one standard deviation along each axis of the covariances makes of it: that of the beginning, and what
        // the track adds to it.
        let mut distance = |from: &[(Vector3<f64>, Rotation3<f64>)], covariance: &DMatrix<f64>| {
            let mut columns = DMatrix::zeros(rows, 1 + 2 * arm);
            fill(columns.column_mut(0).as_mut_slice(), from, &now);
            for (offset, covariance, scale) in [(1, covariance, 1.0), (1 + arm, &tracked, scale)] {
                let axes = covariance.clone().symmetric_eigen();
                for k in 0..arm {
                    let sigma = scale * axes.eigenvalues[k].max(0.0).sqrt();
                    x[..arm].copy_from_slice((axes.eigenvectors.column(k) * sigma).as_slice());
                    let moved = placed(&problem.apply(&x).0);
                    fill(columns.column_mut(offset + k).as_mut_slice(), &first, &moved);
                }
            }
            place(&mut columns, &first);
            Distance::of(&columns, poses.len())
        };
        let whole = distance(&first, &self.initial.covariance);
        let certain = DMatrix::zeros(arm, arm);
        let tracked_mm = distance(&first, &certain).expected_mm;
        let since = self.state.start.as_ref().and_then(|start| {
            let covariance = start.covariance()?.view((0, 0), (arm, arm)).into_owned();
            Some(distance(&placed(&self.without_rows().apply(&start.x).0), &covariance))
        });
        let noise_mm = self.state.sigma_mm * (self.state.sensor.axes() as f64).sqrt();
        let reported = self.state.alarms.iter().rev().find(|alarm| self.tells_of_the_arm(alarm)).cloned();
        // Joint 1 and the last link move no shape: they count by themselves.
        let is_of_shape = |alarm: &Alarm| {
            self.tells_of_the_arm(alarm) && !is_of_joint_1(alarm) && !self.may_be_of_last_link(alarm)
        };
        let reported_of_shape = self.state.alarms.iter().any(is_of_shape);
        let (turn, last_link) = (self.turn(&poses), self.last_link());
        let is_of_shape = whole.is_beyond(SHARE * self.initial.calibrated.held_out.rmse)
            || since.as_ref().is_some_and(|since| since.is_beyond(SHARE * noise_mm))
            || (reported_of_shape && std::iter::once(&whole).chain(&since).any(|d| d.rms_mm > d.expected_mm));
        Some(Departure {
            rms_mm: whole.rms_mm,
            expected_mm: whole.expected_mm,
            tracked_mm,
            since_first_poses_mm: since.as_ref().map(|since| [since.rms_mm, since.expected_mm]),
            parameters: self.moved_parameters(),
            is_of_shape,
            is_significant: is_of_shape
                || turn.as_ref().is_some_and(|turn| turn.is_significant)
                || last_link.as_ref().is_some_and(|last_link| last_link.is_significant),
            turn,
            last_link,
            reported,
        })
    }
}

impl Tracker {
    /// The parameters that moved by more than what the fit left open, the most certain first.
    fn moved_parameters(&self) -> Vec<MovedParameter> {
        let sigmas = self.sigmas();
        let moved = self.initial.order.iter().enumerate().filter_map(|(k, parameter)| {
            let (moved, first) = (self.filter.x[k], self.initial.covariance[(k, k)].max(0.0).sqrt());
            let counts = moved.abs() > PARAMETER_SIGMAS * first;
            let (name, unit) = (parameter.to_string(), parameter.unit().to_owned());
            let parameter = MovedParameter { name, unit, by: moved, sigma: sigmas[k] };
            counts.then_some((moved.abs() / first.max(f64::MIN_POSITIVE), parameter))
        });
        let mut parameters: Vec<(f64, MovedParameter)> = moved.collect();
        parameters.sort_by(|a, b| b.0.total_cmp(&a.0));
        parameters.into_iter().map(|(_, parameter)| parameter).collect()
    }

    /// Whether an alarm tells a change of the arm, or one that nothing explains, rather than one of sensor or target.
    fn tells_of_the_arm(&self, alarm: &Alarm) -> bool {
        match alarm.course {
            Course::Mounted | Course::Burst | Course::Scatter => false,
            Course::Open | Course::Jump | Course::Drift => {
                alarm.parameter.is_empty()
                    || self.initial.order.iter().any(|parameter| parameter.to_string() == alarm.parameter)
            }
        }
    }
}

/// A displacement, and what is expected of it.
struct Distance {
    rms_mm: f64,
    expected_mm: f64,
    bound_mm: f64,
}

impl Distance {
    /// The first column is the displacement, each other one what an axis of the covariances makes of it.
    fn of(columns: &DMatrix<f64>, poses: usize) -> Self {
        let axes = columns.columns(1, columns.ncols() - 1);
        // Σλ is the trace of the Gram matrix, Σλ² the square of its norm.
        let gram = axes.tr_mul(&axes);
        let freedom = (gram.trace().powi(2) / gram.norm_squared()).max(1.0);
        let factor = wilson_hilferty(freedom, DEVIATIONS).sqrt();
        let rms = |square: f64| (square / poses as f64).sqrt();
        let expected_mm = rms(gram.trace());
        Self { rms_mm: rms(columns.column(0).norm_squared()), expected_mm, bound_mm: factor * expected_mm }
    }

    fn is_beyond(&self, smallest_mm: f64) -> bool {
        self.rms_mm > self.bound_mm && self.rms_mm > smallest_mm
    }
}

/// Fewest poses of a comparison: placement has nine parameters.
const MIN_POSES: usize = 8;
