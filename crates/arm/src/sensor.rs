//! The kinds of sensor that an arm is measured with.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What the sensor measures of a pose.
///
/// Models without a measurement used to be written with an empty name, which is read as [`Sensor::Position`]:
///
/// ```
/// use serde::Deserialize;
/// use truegrind_arm::sensor::Sensor;
///
/// assert_eq!(Sensor::deserialize(toml::Value::from("")), Ok(Sensor::Position));
/// assert!(Sensor::deserialize(toml::Value::from("tracker")).is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// Length of a draw-wire from an outlet to a hook on the flange.
    Cable,
    /// Position of a reflector on the flange, in the sensor's own frame.
    #[default]
    #[serde(alias = "")]
    Position,
    /// Position and orientation of a target on the flange, in the sensor's own frame.
    Pose,
}

impl Sensor {
    /// Number of scalars in a reading.
    pub fn scalars(self) -> usize {
        match self {
            Sensor::Cable => 1,
            Sensor::Position => 3,
            Sensor::Pose => 6,
        }
    }

    /// Coordinates of its place that a reading has: the length alone of a cable.
    pub fn axes(self) -> usize {
        self.scalars().min(3)
    }

    /// Its name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Sensor::Cable => "cable",
            Sensor::Position => "position",
            Sensor::Pose => "pose",
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
