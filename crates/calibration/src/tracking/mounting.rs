//! Detects a remounted target or sensor from consecutive outliers that agree on one new location.
//!
//! A knocked target or sensor moves little and is found as a parameter change ([`super::locate`]). A remounted one can be
//! anywhere, often rotated by 90°, outside the range of the linearisation. So each consecutive outlier is solved separately for
//! the location of the target (or the sensor); if the locations agree within the scatter of the readings, that is the new
//! one. Otherwise the poses are a burst of outliers.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::alarm::{Alarm, Course, Mount, Part};
use super::bounds::outlier_bound;
use super::gauge::Gauge;
use super::last_link::JOINT_6;
use super::state::{PoseRecord, Snapshot, extend_region};
use super::tracker::Tracker;
use crate::identification::calibration::Frames;
use crate::measurement::dataset::Sensor;
use crate::measurement::registration::points;
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::filter::rls::RecursiveLeastSquares;
use truegrind_math::se3::{Pose, pose_from_vector, vector_from_pose};

/// Fewest consecutive outliers that are tested.
const MIN_OUTLIERS: usize = 6;
/// Locations agree within this number of standard deviations of a reading.
const AGREE: f64 = 6.0;
/// The arm may have changed at the same time: they also agree within this length (mm), if it is no more than this share of how far the
/// readings moved.
const CHANGED_MM: f64 = 3.0;
const CHANGED_SHARE: f64 = 0.05;
/// A displacement below this is a knock, not a remount (mm, rad).
const KNOCKED_MM: f64 = 10.0;
const KNOCKED_RAD: f64 = 0.05;
/// Standard deviation of the new location (mm, rad).
const ROOM_MM: f64 = 1.0;
const ROOM_RAD: f64 = 0.005;

/// An arm's typical length, which turns a displacement into an angle (mm).
const TYPICAL_ARM_MM: f64 = 300.0;

/// The remounted part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mounted {
    Target,
    Sensor,
}

/// What else the poses may show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Beside {
    /// Nothing but noise.
    Noise,
    /// A change of the arm, too.
    ChangedArm,
}

/// A location that the poses agree on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Remount {
    what: Mounted,
    pose: Pose,
    /// RMS distance of the single poses' locations from it (mm).
    scatter_mm: f64,
    poses: usize,
    /// Whether that is more than the readings scatter, so that the arm changed too.
    with_arm: bool,
}

impl Tracker {
    /// Number of consecutive outliers at the end of the history.
    pub(super) fn trailing_outliers(&self) -> usize {
        let bound = outlier_bound(self.state.sensor.scalars());
        self.state.history.iter().rev().take_while(|record| !(record.nis <= bound)).count()
    }

    /// If the latest poses agree on a remounted target or sensor, continues the track there and returns the alarm.
    pub(super) fn detect_remount(&mut self, beside: Beside) -> Option<Alarm> {
        let run = self.trailing_outliers();
        if run < MIN_OUTLIERS || self.state.sensor == Sensor::Cable {
            return None;
        }
        let history = &self.state.history;
        let poses: Vec<PoseRecord> = history[history.len() - run..].to_vec();
        let (found, old) = self.find_remount(&poses, beside)?;
        let mut alarm = alarm_of(&found, &old, &poses, self.state.sensor.scalars());
        if found.what == Mounted::Target && self.is_turn_of_joint_6(&old, &found.pose, found.scatter_mm) {
            alarm.alternatives.push(JOINT_6.to_owned());
        }
        self.apply_remount(&found, poses);
        Some(alarm)
    }

    /// The location that the poses agree on, and the old one.
    fn find_remount(&self, poses: &[PoseRecord], beside: Beside) -> Option<(Remount, Pose)> {
        let (model, frames) = self.current();
        let flanges: Vec<Pose> = poses
            .iter()
            .map(|record| model.forward(&Joints::from(record.joints), &record.condition))
            .collect();
        let of_noise_mm = AGREE * self.state.sigma_mm * 3f64.sqrt();
        let of_arm_mm = match beside {
            Beside::Noise => 0.0,
            Beside::ChangedArm => CHANGED_MM.min(CHANGED_SHARE * misfit_mm(poses, &flanges, &frames)),
        };
        let agreement = Agreement {
            mm: of_noise_mm.max(of_arm_mm),
            rad: (AGREE * self.state.sigma_rad.max(1e-5) * 3f64.sqrt()).max(of_arm_mm / TYPICAL_ARM_MM),
        };
        let (target, sensor) = if self.state.sensor == Sensor::Pose {
            let readings: Vec<Pose> = poses.iter().filter_map(pose_of).collect();
            if readings.len() != poses.len() {
                return None;
            }
            let each = |pose: &dyn Fn(&Pose, &Pose) -> Pose| -> Vec<Pose> {
                flanges.iter().zip(&readings).map(|(flange, reading)| pose(flange, reading)).collect()
            };
            let target = each(&|flange, reading| flange.inverse() * frames.base_from_sensor * reading);
            let sensor = each(&|flange, reading| flange * frames.flange_from_target * reading.inverse());
            (agreement.consensus(&target), agreement.consensus(&sensor))
        } else {
            of_points(poses, &flanges, &frames, &agreement)
        };
        let candidates = [
            (Mounted::Target, target, frames.flange_from_target),
            (Mounted::Sensor, sensor, frames.base_from_sensor),
        ];
        let far = |pose: &Pose, old: &Pose| {
            (pose.translation.vector - old.translation.vector).norm() > KNOCKED_MM
                || pose.rotation.angle_to(&old.rotation) > KNOCKED_RAD
        };
        let all = candidates.into_iter().filter_map(|(what, found, old)| {
            let (pose, scatter_mm, poses) = found?;
            let with_arm = scatter_mm > of_noise_mm / 2.0;
            far(&pose, &old).then_some((Remount { what, pose, scatter_mm, poses, with_arm }, old))
        });
        all.min_by(|(a, _), (b, _)| a.scatter_mm.total_cmp(&b.scatter_mm))
    }

    /// Sets the new location, keeps the covariance of all other parameters, and filters the poses again.
    fn apply_remount(&mut self, found: &Remount, poses: Vec<PoseRecord>) {
        let members: Vec<usize> = (0..self.parameters.len())
            .filter(|&k| match self.parameters[k] {
                Parameter::Target(_) => found.what == Mounted::Target,
                Parameter::SensorFrame(_) => found.what == Mounted::Sensor,
                _ => false,
            })
            .collect();
        let Some(mut root) = self.filter.root() else { return };
        let mut x = self.filter.x.clone();
        let mut widening = vec![0.0; x.len()];
        for &k in &members {
            x[k] = 0.0;
            root.row_mut(k).fill(0.0);
            widening[k] = if self.parameters[k].is_length() { ROOM_MM } else { ROOM_RAD };
        }
        // Through the state's own numbers, so that a resumed track gives the same bits.
        match found.what {
            Mounted::Target => {
                self.state.flange_from_target = vector_from_pose(&found.pose);
                self.frames.flange_from_target = pose_from_vector(&self.state.flange_from_target);
            }
            Mounted::Sensor => {
                self.state.base_from_sensor = vector_from_pose(&found.pose);
                self.frames.base_from_sensor = pose_from_vector(&self.state.base_from_sensor);
            }
        }
        self.filter = RecursiveLeastSquares::from_root(x, root);
        self.filter.predict(&widening);
        self.gauge = Gauge::of(self.state.sensor, &self.initial.model, &self.frames, &self.parameters);
        let before = Snapshot::of(&self.filter, 0);
        let problem = self.problem(&poses);
        let mut again = poses;
        for (at, record) in again.iter_mut().enumerate() {
            // The remount is where the sensor stands now, whatever was stated before.
            record.begins_station = false;
            let taken = self.update(&problem, at);
            record.nis = taken.nis;
            record.error_mm = self.error_mm(&problem, at, record.per_mm);
            if !taken.set_aside {
                self.state.outliers = self.state.outliers.saturating_sub(1);
                extend_region(&mut self.state.region, &record.joints);
            }
        }
        // Changes before this one are settled. A change of the arm at the same time is found in the poses since.
        let (history, snapshot) = match found.with_arm {
            true => (again, before),
            false => (Vec::new(), Snapshot::of(&self.filter, 0)),
        };
        self.state.history = history;
        (self.state.reference, self.state.middle) = (snapshot.clone(), snapshot);
        (self.state.pending_since, self.state.burst_since) = (0, 0);
    }
}

/// Alarm of a remount.
fn alarm_of(found: &Remount, old: &Pose, poses: &[PoseRecord], per: usize) -> Alarm {
    let (first, last) = (&poses[0], &poses[poses.len() - 1]);
    let many = (found.poses.max(1) as f64).sqrt();
    Alarm {
        noticed_file: last.file.clone(),
        noticed_row: last.row,
        since_file: first.file.clone(),
        since_row: first.row,
        since_time_h: first.time_h,
        parameter: match found.what {
            Mounted::Target => Mount::Target.to_string(),
            Mounted::Sensor => Mount::Sensor.to_string(),
        },
        label: None,
        unit: "mm".to_owned(),
        course: Course::Mounted,
        shift: (found.pose.translation.vector - old.translation.vector).norm(),
        sigma: found.scatter_mm / many,
        poses: poses.len(),
        ratio: 0.0,
        alternatives: Vec::new(),
        window_nis: [0.0; 2],
        // A point has no orientation.
        parts: (per == 6 || found.what == Mounted::Sensor)
            .then(|| Part {
                parameter: "turn".to_owned(),
                unit: "rad".to_owned(),
                shift: found.pose.rotation.angle_to(&old.rotation),
                sigma: 0.0,
            })
            .into_iter()
            .collect(),
    }
}

/// RMS distance between the readings and where target and sensor were before (mm).
fn misfit_mm(poses: &[PoseRecord], flanges: &[Pose], frames: &Frames) -> f64 {
    let square: f64 = poses
        .iter()
        .zip(flanges)
        .map(|(record, flange)| {
            let read = record.reading.iter().take(3).copied();
            let read = frames.base_from_sensor * Point3::from(Vector3::from_iterator(read));
            let target = flange * Point3::from(frames.flange_from_target.translation.vector);
            (read - target).norm_squared()
        })
        .sum();
    (square / poses.len().max(1) as f64).sqrt()
}

fn pose_of(record: &PoseRecord) -> Option<Pose> {
    let [x, y, z, a, b, c] = record.reading.as_slice() else { return None };
    Some(pose_from_vector(&[*x, *y, *z, *a, *b, *c]))
}

type Consensus = Option<(Pose, f64, usize)>;

/// Target and sensor from readings that are points.
fn of_points(
    poses: &[PoseRecord],
    flanges: &[Pose],
    frames: &Frames,
    agreement: &Agreement,
) -> (Consensus, Consensus) {
    let readings: Vec<Point3<f64>> = poses
        .iter()
        .filter_map(|record| <[f64; 3]>::try_from(record.reading.as_slice()).ok())
        .map(|[x, y, z]| Point3::new(x, y, z))
        .collect();
    if readings.len() != poses.len() {
        return (None, None);
    }
    let pairs = flanges.iter().zip(&readings);
    let on_flange: Vec<Pose> = pairs
        .map(|(flange, reading)| {
            let point = flange.inverse() * (frames.base_from_sensor * reading);
            Pose::from_parts(point.coords.into(), frames.flange_from_target.rotation)
        })
        .collect();
    let target = Point3::from(frames.flange_from_target.translation.vector);
    let in_base: Vec<Vector3<f64>> = flanges.iter().map(|flange| (flange * target).coords).collect();
    let read: Vec<Vector3<f64>> = readings.iter().map(|point| point.coords).collect();
    let sensor = points(&in_base, &read).filter(|found| found.rmse_mm <= agreement.mm);
    (
        agreement.consensus(&on_flange),
        sensor.map(|found| (found.base_from_sensor, found.rmse_mm, poses.len())),
    )
}

/// Tolerance within which two locations agree.
struct Agreement {
    mm: f64,
    rad: f64,
}

impl Agreement {
    /// Mean of the locations if at least four in five agree, their RMS scatter (mm), and their number.
    fn consensus(&self, poses: &[Pose]) -> Consensus {
        let agrees = |a: &Pose, b: &Pose| {
            (a.translation.vector - b.translation.vector).norm() <= self.mm
                && a.rotation.angle_to(&b.rotation) <= self.rad
        };
        let count = |pose: &Pose| poses.iter().filter(|other| agrees(pose, other)).count();
        let best = poses.iter().max_by_key(|pose| count(pose))?;
        let own: Vec<&Pose> = poses.iter().filter(|other| agrees(best, other)).collect();
        if own.len() < MIN_OUTLIERS || 5 * own.len() < 4 * poses.len() {
            return None;
        }
        let share = 1.0 / own.len() as f64;
        let mean = own.iter().map(|pose| pose.translation.vector).sum::<Vector3<f64>>() * share;
        let turns = own.iter().map(|pose| (best.rotation.inverse() * pose.rotation).scaled_axis());
        let turn = best.rotation * UnitQuaternion::from_scaled_axis(turns.sum::<Vector3<f64>>() * share);
        let square = own.iter().map(|pose| (pose.translation.vector - mean).norm_squared()).sum::<f64>();
        Some((Pose::from_parts(mean.into(), turn), (square * share).sqrt(), own.len()))
    }
}
