//! The scale of the sensor: known when the track begins, and a candidate for what changes.
//!
//! A draw-wire that was exchanged, or whose millimetres per count were set anew, reads every length longer by one share, as if all of the arm
//! had grown. Links, outlet and target follow that together, and none of them changed. The scale is therefore one of the tracked
//! parameters, of size 0 and as good as exact until an alarm says otherwise: the links are in its millimetres.

use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_arm::parameter::Parameter;

/// The parameter, in the list of the frames' disturbances.
pub(super) const SCALE: Parameter = Parameter::Disturbance { index: 0, parameter: 0 };

/// Its name in alarms, files and tables.
pub const SCALE_NAME: &str = "sensor.scale";

/// Standard deviation of the scale as long as nothing tells that it changed.
pub(super) const AS_CALIBRATED: f64 = 1e-7;

/// A scale that is off by nothing yet.
pub(super) fn scale() -> Disturbance {
    Disturbance::new(Kind::Scale, Profile::Constant)
}
