//! A planned row without a reading.

use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::dataset::{Reading, Row, Sensor};
use truegrind_math::se3::Pose;

/// A row with joints and a placeholder reading.
pub(super) fn blank_row(number: usize, joints: Joints, sensor: Sensor) -> Row {
    let reading = match sensor {
        Sensor::Cable => Reading::Cable(0.0),
        Sensor::Position => Reading::Position(nalgebra::Vector3::zeros()),
        Sensor::Pose => Reading::Pose(Pose::identity().into()),
    };
    Row::new(number, joints, reading)
}
