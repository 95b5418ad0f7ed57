//! What a measurement is planned for.

use truegrind_arm::model::Model;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::Sensor;

/// What shall be measured, with what.
#[derive(Debug, Clone)]
pub struct MeasurementSetup<'a> {
    /// What the controller computes with.
    pub nominal: &'a Model,
    /// The sensor.
    pub sensor: Sensor,
    /// Where it stands and what it touches, about.
    pub frames: &'a Frames,
}
