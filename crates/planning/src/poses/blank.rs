//! A row before anything is measured.

use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::dataset::{Reading, Row, Sensor};
use truegrind_math::se3::Pose;

/// A row of joints alone, with a reading that says nothing.
pub(super) fn blank_row(number: usize, joints: Joints, sensor: Sensor) -> Row {
    let reading = match sensor {
        Sensor::Cable => Reading::Cable(0.0),
        Sensor::Position => Reading::Position(nalgebra::Vector3::zeros()),
        Sensor::Pose => Reading::Pose(Pose::identity().into()),
    };
    Row::new(number, joints, reading)
}
