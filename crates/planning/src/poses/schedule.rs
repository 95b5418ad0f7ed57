//! Order of the rows: repeats, approach directions, warm-up.
//!
//! - Every pose is approached from a stated side of every joint, drawn at random, so that backlash is not confounded with
//!   geometry.
//! - Some poses are measured again at once from the other side of all joints: the difference is due to backlash alone.
//! - Some are measured again later from the same side: their scatter is the noise floor.
//! - One is visited repeatedly, more often at first, to detect warm-up.
//!
//! The order of poses is random, so that time and location are not confounded. If a cable would leave its range or touch a
//! link on a motion, the next pose that can be reached without this is taken instead.

use nalgebra::Point3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::blank::blank_row;
use super::cable::clearance_of_arm_mm;
use super::candidate::{Bounds, Candidate, sensor_mm};
use super::keep_out::CollisionChecker;
use super::own_bodies::OwnBodies;
use super::questions::{Question, any_about};
use super::roadmap::Roadmap;
use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::measurement::dataset::{Row as MeasuredRow, Sensor};

/// Repeated visits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visits {
    /// Number of poses measured twice more, from the same side.
    pub repeats: usize,
    /// Number of poses measured again from the other side.
    pub both_sides: usize,
    /// Number of visits of one pose over the whole run, more frequent at first.
    pub warm_up: usize,
    /// Distance from a pose at which its approach begins, in every joint (rad).
    pub approach_rad: f64,
    /// Time from row to row (s).
    pub seconds_per_row: f64,
}

/// Usual distance from a pose at which its approach begins, in every joint (°).
pub const APPROACH_DEG: f64 = 3.0;

impl Default for Visits {
    fn default() -> Self {
        Self {
            repeats: 4,
            both_sides: 12,
            warm_up: 8,
            approach_rad: APPROACH_DEG.to_radians(),
            seconds_per_row: 12.0,
        }
    }
}

impl Visits {
    /// Adds the visits that the questions of a diagnosis require.
    pub(super) fn with_questions(&self, questions: &[Question]) -> Self {
        let mut out = *self;
        if any_about(questions, CauseKind::Backlash) {
            out.both_sides = out.both_sides.max(20);
        }
        if any_about(questions, CauseKind::ThermalDrift) {
            out.warm_up = out.warm_up.max(16);
        }
        if [CauseKind::SensorZeroShift, CauseKind::SensorFrameShift, CauseKind::ToolShift]
            .iter()
            .any(|&e| any_about(questions, e))
        {
            // A repeated pose shows when something moved.
            out.repeats = out.repeats.max(8);
        }
        out
    }
}

/// Why a row is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Purpose {
    /// For the geometry.
    Geometry,
    /// From the other side, for backlash.
    OtherSide,
    /// Again, for the noise floor.
    Repeat,
    /// Again, for changes over time.
    WarmUp,
}

impl Purpose {
    /// Label in tables.
    pub fn label(self) -> &'static str {
        match self {
            Purpose::Geometry => "geometry",
            Purpose::OtherSide => "other side",
            Purpose::Repeat => "repeat",
            Purpose::WarmUp => "warm-up",
        }
    }
}

/// Spreadsheet number of the first row to measure; row 1 is the header.
pub const FIRST_ROW: usize = 2;

/// A row to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The pose, in the order of the plan.
    pub pose: usize,
    /// Joints where the approach begins (rad).
    pub approach_from: Joints,
    /// The side from which each joint comes to rest: −1 from below, +1 from above.
    pub approach: [i8; 6],
    /// Purpose.
    pub purpose: Purpose,
    /// Time from the start (h).
    pub time_h: f64,
    /// Whether a cable leaves its range or comes too close to a link on the motion to this row.
    pub cable_unclear: bool,
    /// Intermediate stops (rad) of the motion to this row, if the straight motion would hit an obstacle.
    pub waypoints: Vec<Joints>,
}

/// Sources of intermediate stops for motions whose straight path is not clear.
#[derive(Debug, Clone, Copy)]
pub(super) struct Connections<'a> {
    /// Candidate stops, of which one or two are used.
    pub(super) known: &'a [Joints],
    /// Roadmap, used if one or two stops do not suffice.
    pub(super) roadmap: Option<&'a Roadmap>,
}

/// Orders the poses and their visits. Returns the poses in the order of their first visit; `None` if no clear path between
/// two of them is found.
pub(super) fn schedule(
    setup: &MeasurementSetup<'_>,
    poses: Vec<Candidate>,
    visits: &Visits,
    bounds: &Bounds,
    connections: &Connections<'_>,
    seed: u64,
) -> Option<(Vec<Candidate>, Vec<Row>)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x006f_7264_6572);
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.shuffle(&mut random);
    let order = smoothed(setup, bounds, &poses, order);
    let poses: Vec<Candidate> = order.into_iter().map(|i| poses[i].clone()).collect();
    let count = poses.len();
    let sides: Vec<[i8; 6]> =
        poses.iter().map(|_| std::array::from_fn(|_| if random.random_bool(0.5) { 1 } else { -1 })).collect();
    let checker = CollisionChecker::of(setup, &bounds.space);
    // Every candidate has clear sides.
    let sides: Vec<[i8; 6]> = poses
        .iter()
        .zip(sides)
        .map(|(pose, sides)| checker.sides(&pose.joints, sides).unwrap_or(sides))
        .collect();
    // Pose and purpose, with the sides of the pose or the opposite ones.
    let other = visits.both_sides.min(count);
    let mut list: Vec<(usize, Purpose)> = Vec::new();
    for pose in 0..count {
        list.push((pose, Purpose::Geometry));
        // Spread evenly over the run.
        if (pose + 1) * other / count > pose * other / count {
            list.push((pose, Purpose::OtherSide));
        }
    }
    // Repeats: in the middle and at the end.
    let repeats = visits.repeats.min(count);
    let step = count.max(1) / repeats.max(1);
    let repeated: Vec<usize> = (0..repeats).map(|k| k * step).collect();
    let middle = list.len() / 2;
    // Those of the first half are repeated in the middle, the others twice at the end.
    for (at, pose) in repeated.iter().enumerate() {
        let first = list.iter().position(|(p, _)| p == pose).unwrap_or(0);
        let index = if first < middle { middle + at } else { list.len() };
        list.insert(index.min(list.len()), (*pose, Purpose::Repeat));
    }
    list.extend(repeated.iter().map(|&pose| (pose, Purpose::Repeat)));
    // Warm-up: the first pose, at quadratically growing times.
    let total = list.len() + visits.warm_up;
    for k in 1..visits.warm_up {
        let share = k as f64 / (visits.warm_up - 1) as f64;
        let index = ((share * share * total as f64) as usize).clamp(k, list.len());
        list.insert(index, (0, Purpose::WarmUp));
    }
    let posed_rows = list.iter().enumerate().map(|(number, &(pose, purpose))| {
        let sign = if purpose == Purpose::OtherSide { -1 } else { 1 };
        let approach = sides[pose].map(|side| side * sign);
        let target = poses[pose].joints;
        Row {
            pose,
            approach_from: Joints::from_fn(|i, _| target[i] + f64::from(approach[i]) * visits.approach_rad),
            approach,
            purpose,
            time_h: number as f64 * visits.seconds_per_row / 3600.0,
            cable_unclear: false,
            waypoints: Vec::new(),
        }
    });
    let mut rows: Vec<Row> = posed_rows.collect();
    for k in 1..rows.len() {
        let (from, to) = (poses[rows[k - 1].pose].joints, rows[k].approach_from);
        let pose = &poses[rows[k].pose].joints;
        let waypoints = checker.waypoints(&from, &to, connections.known);
        rows[k].waypoints =
            waypoints.or_else(|| connections.roadmap?.waypoints(&checker, &from, pose, &to))?;
        let stops: Vec<Joints> =
            std::iter::once(from).chain(rows[k].waypoints.iter().copied()).chain([to]).collect();
        let anchor = poses[rows[k].pose].anchor;
        rows[k].cable_unclear = !stops.windows(2).all(|way| clear(setup, bounds, &way[0], &way[1], anchor));
    }
    Some((poses, rows))
}

/// The same order, with poses postponed that have no clear motion from the previous one.
fn smoothed(
    setup: &MeasurementSetup<'_>,
    bounds: &Bounds,
    poses: &[Candidate],
    mut order: Vec<usize>,
) -> Vec<usize> {
    for k in 1..order.len() {
        let from = poses[order[k - 1]].joints;
        let good = (k..order.len()).find(|&other| {
            let to = &poses[order[other]];
            clear(setup, bounds, &from, &to.joints, to.anchor)
        });
        if let Some(good) = good {
            let pose = order.remove(good);
            order.insert(k, pose);
        }
    }
    order
}

/// Number of checked points of a motion.
const ON_THE_WAY: usize = 16;

/// Whether a cable stays in its range and clear of the links during a motion.
fn clear(setup: &MeasurementSetup<'_>, bounds: &Bounds, from: &Joints, to: &Joints, anchor: usize) -> bool {
    if setup.sensor != Sensor::Cable {
        return true;
    }
    let posed = setup.nominal.at_condition(&Condition::default());
    let own = OwnBodies::of(setup, &posed.frames(&Joints::zeros()));
    let origin = sensor_mm(setup.sensor, setup.frames, anchor);
    (0..=ON_THE_WAY).all(|k| {
        let joints = from.lerp(to, k as f64 / ON_THE_WAY as f64);
        let frames = posed.frames(&joints);
        let flange = frames.last() * setup.nominal.flange;
        let touched = flange * Point3::from(setup.frames.flange_from_target.translation.vector);
        let distance = (touched.coords - origin).norm();
        bounds.distance_mm.is_none_or(|[low, high]| (low..=high).contains(&distance))
            && bounds
                .clearance_mm
                .is_none_or(|least| clearance_of_arm_mm(&frames, &own, &origin, &touched.coords) >= least)
    })
}

/// The planned rows in the form of logged ones.
pub(super) fn data(planned: &[Row], poses: &[Candidate]) -> Vec<MeasuredRow> {
    planned
        .iter()
        .enumerate()
        .map(|(number, row)| {
            let pose = &poses[row.pose];
            let mut out = blank_row(number, pose.joints, Sensor::Cable);
            out.anchor = pose.anchor;
            let condition =
                Condition { time_h: Some(row.time_h), approach: row.approach, ..Condition::default() };
            out.condition = condition.into();
            out
        })
        .collect()
}
