//! The arm and sensor of a planned measurement.

use truegrind_arm::model::Model;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::Sensor;

/// The arm and sensor of a planned measurement.
#[derive(Debug, Clone)]
pub struct MeasurementSetup<'a> {
    /// The nominal arm.
    pub nominal: &'a Model,
    /// The sensor.
    pub sensor: Sensor,
    /// Approximate frames of sensor and target.
    pub frames: &'a Frames,
}
