//! The touched point against the last link.
//!
//! A lost zero of joint 6, and a flange that was bent, move the readings exactly as a reflector that was exchanged or bumped: both are fixed
//! to the last link. What no reading tells is told in every run until it is decided, as a turn about axis 1 is (`turn`): a tool away from
//! axis 6 may be off by as much as the touched point.
//!
//! **Method.** Of the state as known now and as it was after the first poses only the last link and the target are compared, with everything
//! else as now: d is what they moved the target by in the flange's frame, c its motion by joint 6 (per radian), θ = c·d / c·c. Whatever
//! shares of it the filter gave to link and target, their sum is a matter of readings. Its variance is gᵀ(P₁ + P₂)g, as for a turn about
//! axis 1. Of a pose the three axes count with the point.
//!
//! It counts where an alarm told a move of the touched point that the last link explains as well, until the point is back; and where no alarm told it,
//! if it lies on the circle about axis 6, which a reflector that is bumped hardly follows.

use nalgebra::{DVector, Vector3};

use super::alarm::{Alarm, Course, Mount};
use super::tracker::Tracker;
use crate::measurement::dataset::Sensor;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_math::se3::Pose;

/// A move of the touched point that the last link may have made, since the first poses.
#[derive(Debug, Clone, PartialEq)]
pub struct LastLink {
    /// Zero that joint 6 would have lost (rad).
    pub angle_rad: f64,
    /// Standard deviation of that; 0 where only the alarm knows the move.
    pub sigma_rad: f64,
    /// How far the touched point moved (mm).
    pub moved_mm: f64,
    /// The alarm that reported it.
    pub reported: Option<Alarm>,
    /// Whether it counts.
    pub is_significant: bool,
}

/// Normal quantile of the bound: 1 in 10 000.
const DEVIATIONS: f64 = 3.9;

/// The same for what an alarm told: it counts until it is put right.
const DEVIATIONS_TOLD: f64 = 2.0;

/// Share of the way about axis 6 that the rest of a move may have which no alarm told.
const UNLIKE: f64 = 0.4;

/// A move that no alarm told counts beyond this share of the track's noise.
const SHARE: f64 = 0.5;

/// A point nearer to axis 6 tells nothing of joint 6 (mm).
const MIN_LEVER_MM: f64 = 5.0;

/// Largest zero that joint 6 is likely to lose (rad).
pub(super) const ZERO_LOST_RAD: f64 = 0.09;

/// Step of the differences, in standard deviations; and of joint 6 (rad).
const STEP: f64 = 0.1;
const STEP_RAD: f64 = 0.01;

/// Length of the axes that count with the point of a pose (mm).
const AXIS_MM: f64 = 100.0;

impl Tracker {
    /// The move since the first poses that the last link may have made; `None` before there are any.
    pub(super) fn last_link(&self) -> Option<LastLink> {
        let about = self.about_axis_6()?;
        let reported = self.state.alarms.iter().rev().find(|alarm| self.may_be_of_last_link(alarm)).cloned();
        // The location that a remount states replaces the first one: what moved before and since then is not comparable.
        let is_remounted = |alarm: &Alarm| alarm.course == Course::Mounted && alarm.is_of(Mount::Target);
        let seen = match self.state.alarms.iter().any(is_remounted) {
            true => None,
            false => self.seen_last_link(&about),
        };
        let Some(alarm) = reported else {
            return seen.map(|seen| seen.moved);
        };
        let moved = match seen {
            Some(seen) => {
                let is_significant =
                    seen.moved.is_significant || seen.moved.moved_mm > DEVIATIONS_TOLD * seen.sigma_mm;
                LastLink { is_significant, ..seen.moved }
            }
            None => self.reported_by(&alarm, &about),
        };
        Some(LastLink { reported: Some(alarm), ..moved })
    }

    /// Whether an alarm tells a move that the last link may have made.
    pub(super) fn may_be_of_last_link(&self, alarm: &Alarm) -> bool {
        let last = |name: &String| {
            self.parameters
                .iter()
                .any(|parameter| is_of_last_link(parameter) && parameter.to_string() == *name)
        };
        let is_of_target = alarm.is_of(Mount::Target)
            || self.parameters.iter().any(|parameter| {
                matches!(parameter, Parameter::Target(_)) && parameter.to_string() == alarm.parameter
            });
        match alarm.course {
            Course::Burst | Course::Scatter => false,
            Course::Open | Course::Jump | Course::Drift | Course::Mounted => {
                last(&alarm.parameter)
                    || (is_of_target && alarm.alternatives.iter().any(|name| last(name) || name == JOINT_6))
            }
        }
    }

    fn reported_by(&self, alarm: &Alarm, about: &DVector<f64>) -> LastLink {
        let radius_mm = about.rows(0, 3).norm();
        let (angle_rad, moved_mm) = match alarm.unit.as_str() {
            "rad" => (alarm.shift, alarm.shift.abs() * radius_mm),
            _ => (alarm.shift / radius_mm.max(MIN_LEVER_MM), alarm.shift),
        };
        LastLink { angle_rad, sigma_rad: 0.0, moved_mm, reported: None, is_significant: true }
    }

    fn seen_last_link(&self, about: &DVector<f64>) -> Option<Seen> {
        let start = self.state.start.as_ref()?;
        let x = self.filter.x.clone();
        let now = self.on_flange(x.as_slice());
        let moved = &now - self.on_flange(&start.x);
        let square = about.norm_squared();
        let scale = self.scatter(self.state.history.len()).unwrap_or(1.0).max(1.0);
        let covariance = (self.filter.covariance() + start.covariance()?) * (scale * scale);
        let mut columns = nalgebra::DMatrix::zeros(now.len(), x.len());
        for k in (0..x.len()).filter(|&k| self.is_on_last_link(k)) {
            let step = STEP * covariance[(k, k)].max(0.0).sqrt();
            if step > 0.0 {
                let mut beside = x.clone();
                beside[k] += step;
                columns.set_column(k, &((self.on_flange(beside.as_slice()) - &now) / step));
            }
        }
        let along = |direction: &DVector<f64>| {
            let gradient = columns.tr_mul(direction);
            (&covariance * &gradient).dot(&gradient).max(0.0).sqrt()
        };
        let length = moved.norm();
        let sigma_mm = along(&(&moved / length.max(f64::MIN_POSITIVE)));
        let moved_mm = moved.rows(0, 3).norm();
        if about.rows(0, 3).norm() < MIN_LEVER_MM {
            let none =
                LastLink { angle_rad: 0.0, sigma_rad: 0.0, moved_mm, reported: None, is_significant: false };
            return Some(Seen { moved: none, sigma_mm });
        }
        let angle_rad = about.dot(&moved) / square;
        let sigma_rad = along(&(about / square));
        let way_mm = angle_rad.abs() * square.sqrt();
        let rest_mm = (&moved - about * angle_rad).norm();
        let noise_mm = self.state.sigma_mm * 3f64.sqrt();
        let is_significant = angle_rad.abs() > DEVIATIONS * sigma_rad
            && angle_rad.abs() < ZERO_LOST_RAD
            && angle_rad.abs() * about.rows(0, 3).norm() > SHARE * noise_mm
            && rest_mm < UNLIKE * way_mm;
        let moved = LastLink { angle_rad, sigma_rad, moved_mm, reported: None, is_significant };
        Some(Seen { moved, sigma_mm })
    }

    fn is_on_last_link(&self, k: usize) -> bool {
        is_of_last_link(&self.parameters[k]) || matches!(self.parameters[k], Parameter::Target(_))
    }

    /// The target on the flange as it is now, with last link and target of `x`; of a pose its axes too.
    fn on_flange(&self, x: &[f64]) -> DVector<f64> {
        let mut mixed = self.filter.x.clone();
        (0..mixed.len()).filter(|&k| self.is_on_last_link(k)).for_each(|k| mixed[k] = x[k]);
        let (joints, problem) = (Joints::zeros(), self.without_rows());
        let flange = self.current().0.forward(&joints, &self.initial.condition);
        let (model, frames) = problem.apply(mixed.as_slice());
        let target = model.forward(&joints, &self.initial.condition) * frames.flange_from_target;
        self.points_of(&(flange.inverse() * target))
    }

    fn points_of(&self, pose: &Pose) -> DVector<f64> {
        let origin = pose.translation.vector;
        let axes = match self.state.sensor {
            Sensor::Pose => 3,
            Sensor::Position | Sensor::Cable => 0,
        };
        let axis = |k: usize| pose.rotation * (Vector3::ith(k, AXIS_MM));
        let points: Vec<f64> = std::iter::once(origin)
            .chain((0..axes).map(axis))
            .flat_map(|point| point.iter().copied().collect::<Vec<_>>())
            .collect();
        DVector::from_vec(points)
    }

    /// Motion of the target by joint 6, per radian, in the flange's frame.
    fn about_axis_6(&self) -> Option<DVector<f64>> {
        let (model, frames) = self.current();
        let at = |q6: f64| {
            let mut joints = Joints::zeros();
            joints[5] = q6;
            model.forward(&joints, &self.initial.condition)
        };
        let points = |q6: f64| self.points_of(&(at(0.0).inverse() * at(q6) * frames.flange_from_target));
        let about = (points(STEP_RAD) - points(-STEP_RAD)) / (2.0 * STEP_RAD);
        about.iter().all(|v| v.is_finite()).then_some(about)
    }

    /// Whether joint 6 alone, having lost its zero, takes the target from `old` to `new`, within `scatter_mm`.
    pub(super) fn is_turn_of_joint_6(&self, old: &Pose, new: &Pose, scatter_mm: f64) -> bool {
        let model = self.current().0;
        let at = |q6: f64| {
            let mut joints = Joints::zeros();
            joints[5] = q6;
            model.forward(&joints, &self.initial.condition)
        };
        let [old_points, new_points] = [old, new].map(|pose| self.points_of(pose));
        let whole_mm = (&new_points - &old_points).norm();
        let rest_mm = |q6: f64| (self.points_of(&(at(0.0).inverse() * at(q6) * old)) - &new_points).norm();
        // The distance has one minimum within a quarter of a turn: a search by steps, each a tenth of the last.
        let (mut best, mut step) = (0.0, ZERO_LOST_RAD / 10.0);
        for _ in 0..4 {
            let tried = (-10..=10).map(|k| best + f64::from(k) * step);
            best = tried.min_by(|a, b| rest_mm(*a).total_cmp(&rest_mm(*b))).unwrap_or(best);
            step /= 10.0;
        }
        rest_mm(best) < (OFF_CIRCLE * whole_mm).max(3.0 * scatter_mm) && rest_mm(best) < UNLIKE * whole_mm
    }
}

/// Share of its way by which a remounted target may miss the circle about axis 6.
const OFF_CIRCLE: f64 = 0.1;

/// Name of the rival of a remounted target.
pub(super) const JOINT_6: &str = "a lost zero of joint 6";

/// What the filter knows of a move.
struct Seen {
    moved: LastLink,
    sigma_mm: f64,
}

fn is_of_last_link(parameter: &Parameter) -> bool {
    matches!(parameter, Parameter::Link { joint: 5, .. })
}
