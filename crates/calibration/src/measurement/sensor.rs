//! Sensor models: the reading of a cable, a position tracker or a pose tracker at a pose of the flange.

pub mod disturbance;
pub mod empirical;

use nalgebra::{Point3, Vector3};

use super::dataset::{Reading, Sensor};
use truegrind_math::se3::{Pose, difference};

/// A sensor with its location and its target on the flange.
#[derive(Debug, Clone, PartialEq)]
pub enum Rig {
    /// Draw-wires: reading = distance from outlet to hook + zero.
    Cable {
        /// Outlets in the arm's base (mm).
        outlets_mm: Vec<Vector3<f64>>,
        /// Reading of each at distance zero (mm).
        zeros_mm: Vec<f64>,
        /// The hook on the flange (mm).
        hook_mm: Vector3<f64>,
    },
    /// A tracker and its reflector.
    Position {
        /// The tracker's frame in the arm's base.
        base_from_sensor: Pose,
        /// The reflector on the flange (mm).
        reflector_mm: Vector3<f64>,
    },
    /// A tracker and its six-dimensional target.
    Pose {
        /// The tracker's frame in the arm's base.
        base_from_sensor: Pose,
        /// The target on the flange.
        flange_from_target: Pose,
    },
}

/// Limits within which a sensor sees its target.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SightLimits {
    /// Shortest and longest distance (mm).
    pub distance_mm: Option<[f64; 2]>,
    /// Largest angle between the flange's z axis and the line from the target to the sensor (rad).
    pub tilt_rad: Option<f64>,
}

impl Rig {
    /// Which sensor it is.
    pub fn sensor(&self) -> Sensor {
        match self {
            Rig::Cable { .. } => Sensor::Cable,
            Rig::Position { .. } => Sensor::Position,
            Rig::Pose { .. } => Sensor::Pose,
        }
    }

    /// The same tracker or camera in another place; a cable stays where it is.
    pub fn at_station(&self, place: Pose) -> Self {
        let mut moved = self.clone();
        match &mut moved {
            Rig::Position { base_from_sensor, .. } | Rig::Pose { base_from_sensor, .. } => {
                *base_from_sensor = place;
            }
            Rig::Cable { .. } => {}
        }
        moved
    }

    /// The target's position in the flange frame (mm).
    pub fn target_on_flange_mm(&self) -> Vector3<f64> {
        match self {
            Rig::Cable { hook_mm, .. } => *hook_mm,
            Rig::Position { reflector_mm, .. } => *reflector_mm,
            Rig::Pose { flange_from_target, .. } => flange_from_target.translation.vector,
        }
    }

    /// The sensor's origin in the base (mm); for a cable its outlet `anchor`, `None` if there is no such outlet.
    pub fn origin_mm(&self, anchor: usize) -> Option<Vector3<f64>> {
        match self {
            Rig::Cable { outlets_mm, .. } => outlets_mm.get(anchor).copied(),
            Rig::Position { base_from_sensor, .. } | Rig::Pose { base_from_sensor, .. } => {
                Some(base_from_sensor.translation.vector)
            }
        }
    }

    /// Distance from the sensor to its target (mm).
    pub fn distance_mm(&self, base_from_flange: &Pose, anchor: usize) -> Option<f64> {
        let at = base_from_flange * Point3::from(self.target_on_flange_mm());
        self.origin_mm(anchor).map(|origin| (at.coords - origin).norm())
    }

    /// The noise-free reading at a pose of the flange; `None` if there is no cable `anchor`.
    pub fn predict(&self, base_from_flange: &Pose, anchor: usize) -> Option<Reading> {
        match self {
            Rig::Cable { zeros_mm, .. } => {
                let zero = zeros_mm.get(anchor).copied().unwrap_or(0.0);
                self.distance_mm(base_from_flange, anchor).map(|d| Reading::Cable(d + zero))
            }
            Rig::Position { base_from_sensor, reflector_mm } => {
                let at = base_from_flange * Point3::from(*reflector_mm);
                Some(Reading::Position(base_from_sensor.inverse_transform_point(&at).coords))
            }
            Rig::Pose { base_from_sensor, flange_from_target } => {
                let seen = base_from_sensor.inv_mul(&(base_from_flange * flange_from_target));
                Some(Reading::Pose(Box::new(seen)))
            }
        }
    }

    /// Whether the sensor sees the flange at a pose.
    pub fn sees(&self, limits: &SightLimits, base_from_flange: &Pose, anchor: usize) -> bool {
        let at = base_from_flange * Point3::from(self.target_on_flange_mm());
        let Some(origin) = self.origin_mm(anchor) else { return false };
        let line = origin - at.coords;
        let near = limits.distance_mm.is_none_or(|[low, high]| (low..=high).contains(&line.norm()));
        let upright = base_from_flange.rotation * Vector3::z();
        near && limits.tilt_rad.is_none_or(|tilt| upright.angle(&line) <= tilt)
    }
}

/// Measured minus predicted: one number (mm) for a cable, three for a position, six (mm, then rotation vector in rad)
/// for a pose; all in the sensor's frame. Empty where the two are of different sensors.
pub fn residual(measured: &Reading, predicted: &Reading) -> Vec<f64> {
    match (measured, predicted) {
        (Reading::Cable(m), Reading::Cable(p)) => vec![m - p],
        (Reading::Position(m), Reading::Position(p)) => (m - p).as_slice().to_vec(),
        (Reading::Pose(m), Reading::Pose(p)) => difference(p, m).as_slice().to_vec(),
        _ => Vec::new(),
    }
}
