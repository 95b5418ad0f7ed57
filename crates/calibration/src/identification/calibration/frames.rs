//! Sensor frame, target, cable outlets and disturbances: the parameters of a measurement.

use nalgebra::Vector3;

use crate::measurement::sensor::disturbance::{Disturbance, Profile};
use truegrind_math::se3::Pose;

/// Parameters of the measurement that a calibration estimates along with the arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Frames {
    /// The sensor's frame in the arm's base (position and pose sensors).
    pub base_from_sensor: Pose,
    /// The measured point or frame on the flange: hook, reflector or target. It is not the TCP.
    pub flange_from_target: Pose,
    /// Outlet of each cable in the base (mm).
    pub outlets_mm: Vec<Vector3<f64>>,
    /// Zero offset of each cable: reading minus free length (mm).
    pub zeros_mm: Vec<f64>,
    /// Disturbances of the measurement.
    pub disturbances: Vec<Disturbance>,
}

impl Frames {
    /// How many stations but the first there are; their disturbances come before all others.
    pub fn further_stations(&self) -> usize {
        let of_station = |d: &&Disturbance| matches!(d.profile, Profile::Station { .. });
        self.disturbances.iter().take_while(of_station).count()
    }

    /// Everything at the origin, for `anchors` cables.
    pub fn at_origin(anchors: usize) -> Self {
        Self {
            base_from_sensor: Pose::identity(),
            flange_from_target: Pose::identity(),
            outlets_mm: vec![Vector3::zeros(); anchors],
            zeros_mm: vec![0.0; anchors],
            disturbances: Vec::new(),
        }
    }
}

/// Weights of one row: 1/σ of a length [1/mm] and of an angle [1/rad]. Weight 0 sets a row aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    /// For cable lengths and positions.
    pub per_mm: f64,
    /// For orientations; used by full poses alone.
    pub per_rad: f64,
}
