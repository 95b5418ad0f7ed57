//! A turn of the whole arm about axis 1 against the sensor.
//!
//! A lost zero of joint 1 moves no shape: the [`Departure`](super::Departure) counts it as a placement of the base. But a sensor that stayed
//! where it was saw the arm turn, and programs on parts that stand beside the arm are off by as much. Readings cannot tell joint 1 from the
//! base that turned; they do tell both from the sensor, unless that was moved on a circle about axis 1.
//!
//! **Method.** With p(q) where the sensor sees the target, as the track knows arm and sensor now and as it knew them after its first poses, and
//! c = z × p the motion by a turn about axis 1: the turn is θ = Σ c·Δp / Σ c·c over the measured region. Changes of the other joints move
//! the target mostly in the plane through axis 1, which is at right angles to c. θ is a matter of readings, so what no reading tells
//! (`gauge`) does not enter it; its variance is gᵀ(P₁ + P₂)g, g by differences, as if both states were independent, which makes it larger.
//!
//! A rigid motion of which the turn leaves more than a share ([`UNLIKE`]) is another one: of a sensor that was knocked or sinks. After such an
//! alarm the placement is taken down anew; an earlier turn stays in force, since no reading shows that it was repaired.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::alarm::{Alarm, Course, Mount};
use super::tracker::Tracker;
use crate::measurement::dataset::Sensor;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};

/// A turn of the arm about axis 1 against the sensor, since the first poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Turn {
    /// Angle (rad).
    pub angle_rad: f64,
    /// Standard deviation of that.
    pub sigma_rad: f64,
    /// What it moves, RMS over the measured region (mm).
    pub rms_mm: f64,
    /// The alarm that reported it.
    pub reported: Option<Alarm>,
    /// Whether it counts.
    pub is_significant: bool,
}

/// Normal quantile of the bound: 1 in 10 000.
const DEVIATIONS: f64 = 3.9;

/// The same for a turn that an alarm reported: it counts until it is put right.
const DEVIATIONS_REPORTED: f64 = 2.0;

/// Share of the turn's RMS displacement that the rest of the rigid motion may have.
const UNLIKE: f64 = 0.6;

/// A turn counts beyond this share of the track's noise.
const SHARE: f64 = 0.5;

/// Step of the differences, in standard deviations.
const STEP: f64 = 0.1;

impl Tracker {
    /// The turn since the placement was taken down, over poses of the measured region; `None` for a cable, which sees no turn alone, and
    /// before there is a placement.
    pub(super) fn turn(&self, poses: &[Joints]) -> Option<Turn> {
        if self.state.sensor == Sensor::Cable {
            return None;
        }
        let reported = self.reported_turn();
        let seen = self.seen_turn(poses);
        match (reported, seen) {
            (Some((alarm, is_before_placement)), seen) => {
                let lever_mm = self.lever_mm(poses);
                let from_alarm = Turn {
                    angle_rad: alarm.shift,
                    sigma_rad: alarm.sigma,
                    rms_mm: alarm.shift.abs() * lever_mm,
                    reported: None,
                    is_significant: true,
                };
                let mut turn = seen.filter(|_| !is_before_placement).unwrap_or(from_alarm);
                turn.is_significant |= turn.angle_rad.abs() > DEVIATIONS_REPORTED * turn.sigma_rad;
                turn.reported = Some(alarm);
                Some(turn)
            }
            (None, seen) => seen,
        }
    }

    /// The last alarm of joint 1, and whether the sensor was moved since.
    fn reported_turn(&self) -> Option<(Alarm, bool)> {
        let at = self.state.alarms.iter().rposition(is_of_joint_1)?;
        let moved = self.state.alarms[at..].iter().any(|alarm| self.is_of_sensor(alarm));
        Some((self.state.alarms[at].clone(), moved))
    }

    /// Whether an alarm tells that the sensor moved.
    pub(super) fn is_of_sensor(&self, alarm: &Alarm) -> bool {
        let is_sensor = |parameter: &Parameter| matches!(parameter, Parameter::SensorFrame(_));
        let named = |parameter: &&Parameter| is_sensor(parameter) && parameter.to_string() == alarm.parameter;
        alarm.is_of(Mount::Sensor) || self.parameters.iter().any(|parameter| named(&parameter))
    }

    /// The distance of the target from axis 1, RMS (mm).
    fn lever_mm(&self, poses: &[Joints]) -> f64 {
        let square: f64 = self.seen_in_base(self.filter.x.as_slice(), poses).iter().map(across).sum();
        (square / poses.len().max(1) as f64).sqrt()
    }

    /// Where the sensor sees the target, in the base as it is known now.
    fn seen_in_base(&self, x: &[f64], poses: &[Joints]) -> Vec<Vector3<f64>> {
        let problem = self.without_rows();
        let now = problem.apply(self.filter.x.as_slice()).1;
        let (model, frames) = problem.apply(x);
        let to_now = now.base_from_sensor * frames.base_from_sensor.inverse();
        let target = now.flange_from_target.translation.vector;
        let seen = |joints: &Joints| {
            let flange = to_now * model.forward(joints, &self.initial.condition);
            flange.translation.vector + flange.rotation * target
        };
        poses.iter().map(seen).collect()
    }

    fn seen_turn(&self, poses: &[Joints]) -> Option<Turn> {
        let placed = self.state.placed.as_ref()?;
        let now = self.seen_in_base(self.filter.x.as_slice(), poses);
        let before = self.seen_in_base(&placed.x, poses);
        let moved: Vec<Vector3<f64>> = now.iter().zip(&before).map(|(now, before)| now - before).collect();
        let square: f64 = now.iter().map(across).sum();
        let turn_of = |moved: &[Vector3<f64>]| -> f64 {
            now.iter().zip(moved).map(|(p, moved)| about_axis(p).dot(moved)).sum::<f64>() / square
        };
        let angle_rad = turn_of(&moved);
        let scale = self.scatter(self.state.history.len()).unwrap_or(1.0).max(1.0);
        let covariance = (self.filter.covariance() + placed.covariance()?) * (scale * scale);
        let mut x = self.filter.x.clone();
        let gradient = nalgebra::DVector::from_fn(x.len(), |k, _| {
            let step = STEP * covariance[(k, k)].max(0.0).sqrt();
            if step == 0.0 {
                return 0.0;
            }
            x[k] += step;
            let seen = self.seen_in_base(x.as_slice(), poses);
            x[k] -= step;
            let moved: Vec<Vector3<f64>> = seen.iter().zip(&now).map(|(seen, now)| seen - now).collect();
            turn_of(&moved) / step
        });
        let sigma_rad = (&covariance * &gradient).dot(&gradient).max(0.0).sqrt();
        let rms = |square: f64| (square / poses.len() as f64).sqrt();
        let rms_mm = angle_rad.abs() * rms(square);
        let noise_mm = self.state.sigma_mm * 3f64.sqrt();
        let rest = rigid_rest(&now, &moved, angle_rad)?;
        let is_significant = angle_rad.abs() > DEVIATIONS * sigma_rad
            && rms_mm > SHARE * noise_mm
            && rms(rest) < UNLIKE * rms_mm;
        Some(Turn { angle_rad, sigma_rad, rms_mm, reported: None, is_significant })
    }
}

/// Whether an alarm tells a change of joint 1.
pub(super) fn is_of_joint_1(alarm: &Alarm) -> bool {
    let zero = Parameter::Link { joint: 0, coordinate: LinkCoordinate::Theta };
    matches!(alarm.course, Course::Open | Course::Jump | Course::Drift) && alarm.parameter == zero.to_string()
}

/// Motion of a point by a small turn about axis 1, per radian.
fn about_axis(p: &Vector3<f64>) -> Vector3<f64> {
    Vector3::z().cross(p)
}

fn across(p: &Vector3<f64>) -> f64 {
    about_axis(p).norm_squared()
}

/// Sum of squares of the best rigid motion without the turn about axis 1 (mm²).
fn rigid_rest(points: &[Vector3<f64>], moved: &[Vector3<f64>], angle_rad: f64) -> Option<f64> {
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    // Turns by the length of the arm, so that all columns are of a size.
    let length = (points.iter().map(Vector3::norm_squared).sum::<f64>() / points.len() as f64).sqrt();
    let columns = |p: &Vector3<f64>| -> [Vector3<f64>; 6] {
        std::array::from_fn(|k| match k {
            0..3 => Vector3::ith(k, 1.0),
            _ => Vector3::ith(k - 3, 1.0).cross(p) / length,
        })
    };
    for (p, moved) in points.iter().zip(moved) {
        let columns = columns(p);
        let rest = moved - about_axis(p) * angle_rad;
        for (a, column) in columns.iter().enumerate() {
            right[a] += column.dot(&rest);
            (0..6).for_each(|b| normal[(a, b)] += column.dot(&columns[b]));
        }
    }
    Some(normal.cholesky()?.solve(&right).dot(&right))
}
