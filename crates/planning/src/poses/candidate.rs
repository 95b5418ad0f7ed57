//! Candidate poses: random joints within limits, away from singularities, visible to the sensor.

use std::fmt;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::blank::blank_row;
use super::cable::clearance_of_arm_mm;
use super::keep_out::{CollisionChecker, KeepOut};
use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Joints;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::{Row, Sensor};
use truegrind_math::work::checkpoint;

/// Constraints on poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Distance of every joint from its limits (rad), so that it can be approached from both sides.
    pub margin_rad: f64,
    /// Smallest distance to singularity, as
    /// [`Inverse::smallest_singular_value`].
    pub min_singularity: f64,
    /// Box for the touched point in the base: lower and upper corner (mm).
    pub box_mm: Option<[[f64; 3]; 2]>,
    /// Shortest and longest cable, or distance to the sensor (mm).
    pub distance_mm: Option<[f64; 2]>,
    /// Distance of a cable, or of a tracker's line of sight, from the lines in the links (mm); `None` disables the check.
    pub clearance_mm: Option<f64>,
    /// Obstacles.
    pub space: KeepOut,
}

/// Usual distance of every joint from its limits (°).
pub const MARGIN_DEG: f64 = 6.0;

impl Default for Bounds {
    fn default() -> Self {
        Self {
            margin_rad: MARGIN_DEG.to_radians(),
            min_singularity: 0.05,
            box_mm: None,
            distance_mm: None,
            clearance_mm: None,
            space: KeepOut::default(),
        }
    }
}

/// A candidate pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Controller angles (rad).
    pub joints: Joints,
    /// Distance to singularity.
    pub singularity: f64,
    /// Index of the cable that measures it.
    pub anchor: usize,
}

/// Rejection counts of random poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RejectionCounts {
    /// Number of drawn poses.
    pub drawn: usize,
    /// A sum of joints out of its range.
    pub sum: usize,
    /// Too near to a singularity.
    pub singular: usize,
    /// Outside the box.
    pub outside: usize,
    /// The cable, or the line to the sensor, too short or too long.
    pub distance: usize,
    /// The cable or the line of sight too near to a link.
    pub hidden: usize,
    /// A link or the touched point in collision, with an obstacle or the arm itself, at the pose or on its approach.
    pub blocked: usize,
}

impl fmt::Display for RejectionCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} too close to a singularity, {} outside the box, {} too close to or too far from the sensor, {} with the \
            cable or the line of sight too close to a link, {} with the arm below the floor, in a box to keep out of or \
            inside itself",
            self.singular, self.outside, self.distance, self.hidden, self.blocked
        )?;
        match self.sum {
            0 => Ok(()),
            sum => write!(f, ", {sum} with a sum of joints out of its range"),
        }
    }
}

/// Most random poses drawn for each required candidate.
const DRAWS_PER_CANDIDATE: usize = 60;

/// Draws until `count` poses are accepted or the limit of draws is reached. Cables alternate.
pub fn draw(
    setup: &MeasurementSetup<'_>,
    bounds: &Bounds,
    count: usize,
    seed: u64,
) -> (Vec<Candidate>, RejectionCounts) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let limits = &setup.nominal.limits;
    let posed = setup.nominal.at_condition(&Condition::default());
    let inverse = Inverse::new(setup.nominal, &Condition::default(), setup.nominal);
    let mut out: Vec<Candidate> = Vec::with_capacity(count);
    let mut rejections = RejectionCounts::default();
    let checker = CollisionChecker::of(setup, &bounds.space);
    let anchors = if setup.sensor == Sensor::Cable { setup.frames.outlets_mm.len() } else { 1 };
    while out.len() < count && rejections.drawn < DRAWS_PER_CANDIDATE * count.max(20) {
        checkpoint();
        rejections.drawn += 1;
        let joints = Joints::from_fn(|i, _| {
            let (low, high) = (limits.min_rad[i] + bounds.margin_rad, limits.max_rad[i] - bounds.margin_rad);
            // A second turn of a joint gives no new information.
            let (low, high) = (low.max(-std::f64::consts::PI), high.min(std::f64::consts::PI));
            if low < high { random.random_range(low..high) } else { 0.5 * (low + high) }
        });
        if !limits.sums.iter().all(|sum| sum.holds(&joints, -bounds.margin_rad)) {
            rejections.sum += 1;
            continue;
        }
        let singularity = inverse.smallest_singular_value(&joints);
        if !(singularity >= bounds.min_singularity) {
            rejections.singular += 1;
            continue;
        }
        let frames = posed.frames(&joints);
        let flange = frames.last() * setup.nominal.flange;
        let touched = flange * Point3::from(setup.frames.flange_from_target.translation.vector);
        if let Some([low, high]) = bounds.box_mm
            && !(0..3).all(|k| (low[k]..=high[k]).contains(&touched[k]))
        {
            rejections.outside += 1;
            continue;
        }
        let anchor = out.len() % anchors;
        let origin = sensor_mm(setup.sensor, setup.frames, anchor);
        let distance = (touched.coords - origin).norm();
        if let Some([low, high]) = bounds.distance_mm
            && !(low..=high).contains(&distance)
        {
            rejections.distance += 1;
            continue;
        }
        if let Some(required) = bounds.clearance_mm
            && clearance_of_arm_mm(&frames, checker.own(), &origin, &touched.coords) < required
        {
            rejections.hidden += 1;
            continue;
        }
        if checker.sides(&joints, [1; 6]).is_none() {
            rejections.blocked += 1;
            continue;
        }
        out.push(Candidate { joints, singularity, anchor });
    }
    (out, rejections)
}

/// Position of the sensor in the base (mm).
pub(super) fn sensor_mm(sensor: Sensor, frames: &Frames, anchor: usize) -> Vector3<f64> {
    match sensor {
        Sensor::Cable => frames.outlets_mm[anchor],
        Sensor::Position | Sensor::Pose => frames.base_from_sensor.translation.vector,
    }
}

/// Candidates as rows at rest, without time and approach.
pub(super) fn rows(candidates: &[Candidate]) -> Vec<Row> {
    candidates
        .iter()
        .enumerate()
        .map(|(number, candidate)| {
            let mut row = blank_row(number, candidate.joints, Sensor::Cable);
            row.anchor = candidate.anchor;
            row
        })
        .collect()
}
