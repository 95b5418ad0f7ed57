//! Initial guess: sensor frame, cable outlet and target in closed form, with the nominal arm.

use std::collections::HashSet;

use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::identification::calibration::Frames;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::{registration, stations};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Model;
use truegrind_math::se3::Pose;

/// The rows do not determine the sensor's frame.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "{file}: rows at {poses} different {}, where copies of a row count once, do not determine the {what}: measure at least {needed} poses that \
     are not collinear, with different wrist orientations",
    if *poses == 1 { "pose" } else { "poses" }
)]
pub struct StartError {
    /// File.
    pub file: String,
    /// Rows.
    pub rows: usize,
    /// Distinct poses among them.
    pub poses: usize,
    /// Outlet or frame.
    pub what: &'static str,
    /// Least number of poses.
    pub needed: usize,
}

impl StartError {
    pub(super) fn of(dataset: &Dataset, what: &'static str, needed: usize) -> Self {
        let poses = count_distinct_poses(dataset, usize::MAX);
        Self { file: dataset.file.clone(), rows: dataset.rows.len(), poses, what, needed }
    }
}

/// Candidate frames, best first: cable lengths from one side can fit two outlets.
///
/// # Errors
/// [`StartError`] if the rows do not determine them.
pub fn candidate_frames(dataset: &Dataset, nominal: &Model) -> Result<Vec<Frames>, StartError> {
    let none = |what, needed| StartError::of(dataset, what, needed);
    let (what, needed) = match dataset.sensor {
        Sensor::Cable => ("cable outlet", 4),
        Sensor::Position => ("sensor frame", 4),
        Sensor::Pose => ("sensor frame", 3),
    };
    if count_distinct_poses(dataset, needed) < needed {
        return Err(none(what, needed));
    }
    let flanges = flanges(dataset, nominal);
    let mut frames = Frames {
        disturbances: stations::disturbances(dataset.stations()),
        ..Frames::at_origin(dataset.anchors())
    };
    match dataset.sensor {
        Sensor::Cable => {
            let mut rival: Option<Frames> = None;
            for anchor in 0..dataset.anchors() {
                let (mut hooks, mut lengths) = (Vec::new(), Vec::new());
                for (row, flange) in dataset.rows.iter().zip(&flanges).filter(|(r, _)| r.anchor == anchor) {
                    if let Reading::Cable(length) = row.reading {
                        hooks.push(flange.translation.vector);
                        lengths.push(length);
                    }
                }
                let found = registration::cable(&hooks, &lengths).ok_or_else(|| none("cable outlet", 4))?;
                frames.outlets_mm[anchor] = found.outlet_mm;
                frames.zeros_mm[anchor] = found.zero_mm;
                if let Some((outlet, zero)) = found.rival {
                    let other = rival.get_or_insert_with(|| frames.clone());
                    other.outlets_mm[anchor] = outlet;
                    other.zeros_mm[anchor] = zero;
                } else if let Some(other) = &mut rival {
                    other.outlets_mm[anchor] = found.outlet_mm;
                    other.zeros_mm[anchor] = found.zero_mm;
                }
            }
            Ok(std::iter::once(frames).chain(rival).collect())
        }
        Sensor::Position => {
            let measured: Vec<Vector3<f64>> = positions(dataset);
            let found =
                registration::target_point(&flanges, &measured).ok_or_else(|| none("sensor frame", 4))?;
            frames.base_from_sensor = found.base_from_sensor;
            frames.flange_from_target = Pose::from_parts(found.target_mm.into(), UnitQuaternion::identity());
            Ok(vec![frames])
        }
        Sensor::Pose => {
            let found =
                registration::poses(&flanges, &poses(dataset)).ok_or_else(|| none("sensor frame", 3))?;
            frames.base_from_sensor = found.base_from_sensor;
            frames.flange_from_target = found.flange_from_target;
            Ok(vec![frames])
        }
    }
}

/// Poses of the flange and readings of a position.
pub(super) struct Places {
    pub(super) flanges: Vec<Pose>,
    pub(super) measured_mm: Vec<Vector3<f64>>,
}

/// The rows of a tracker or camera, if they do not show where on the flange its target is.
pub(super) fn unseen_target(dataset: &Dataset, nominal: &Model) -> Option<Places> {
    let (flanges, measured_mm) = (flanges(dataset, nominal), positions(dataset));
    let held = match dataset.sensor {
        Sensor::Cable => false,
        Sensor::Position => registration::target_point(&flanges, &measured_mm)?.is_target_held,
        Sensor::Pose => registration::poses(&flanges, &poses(dataset))?.is_target_held,
    };
    held.then_some(Places { flanges, measured_mm })
}

fn flanges(dataset: &Dataset, nominal: &Model) -> Vec<Pose> {
    let posed = nominal.at_condition(&Condition::default());
    dataset.rows.iter().map(|r| posed.forward(&r.joints)).collect()
}

fn poses(dataset: &Dataset) -> Vec<Pose> {
    let pose = |reading: &Reading| if let Reading::Pose(p) = reading { Some(**p) } else { None };
    dataset.rows.iter().filter_map(|r| pose(&r.reading)).collect()
}

/// Number of rows that differ in joint angles or cable, counted up to `enough`.
pub fn count_distinct_poses(dataset: &Dataset, enough: usize) -> usize {
    let mut met = HashSet::new();
    for row in &dataset.rows {
        let angles: [i64; 6] = std::array::from_fn(|j| (row.joints[j] * 1e6).round() as i64);
        met.insert((angles, row.anchor));
        if met.len() >= enough {
            break;
        }
    }
    met.len()
}

fn positions(dataset: &Dataset) -> Vec<Vector3<f64>> {
    dataset
        .rows
        .iter()
        .map(|r| match &r.reading {
            Reading::Position(p) => *p,
            Reading::Pose(p) => p.translation.vector,
            Reading::Cable(_) => Vector3::zeros(),
        })
        .collect()
}
