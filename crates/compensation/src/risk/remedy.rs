//! Measurements that can make the position of a path known, and their cost.
//!
//! `remedy_search` computes which of them is cheapest for a program, and the uncertainty that remains.

/// Minutes to touch one point of a part with the tool of the program and note its joints.
const TOUCH_MIN: f64 = 5.0;
/// Minutes to measure the pose of a sensor in the robot's base: three points of the robot's foot, and the fit.
const FRAME_MIN: f64 = 30.0;
/// Minutes to mount a target beside the axis of joint 6.
const BESIDE_MIN: f64 = 10.0;
/// Minutes to have the positions of three targets on the flange measured on a coordinate measuring machine.
const PLATE_MIN: f64 = 90.0;
/// Minutes to move a sensor, or the outlet of a cable, to a second station.
const STATION_MIN: f64 = 20.0;
/// Minutes per pose: motion, half a second of rest, reading.
const POSE_MIN: f64 = 0.5;

/// A measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Measurement {
    /// Three points of the work object, touched with this arm and the tool of the program.
    Touch,
    /// Pose of the sensor, or position of the outlet of its cable, in the robot's base; makes the existing rows more
    /// informative.
    Frame,
    /// Poses with a target beside the axis of joint 6, wherever on the flange.
    Beside {
        /// How many.
        poses: u32,
    },
    /// Poses with three targets whose places on the flange were measured.
    Plate {
        /// How many.
        poses: u32,
    },
    /// Poses with the sensor, or the outlet of its cable, at a second station.
    Station {
        /// How many.
        poses: u32,
    },
    /// More poses of the existing kind.
    More {
        /// How many.
        poses: u32,
    },
}

impl Measurement {
    /// Cost (minutes of robot cell and staff).
    pub fn minutes(&self) -> f64 {
        let poses = POSE_MIN * f64::from(self.poses());
        match self {
            Measurement::Touch => 3.0 * TOUCH_MIN,
            Measurement::Frame => FRAME_MIN,
            Measurement::Beside { .. } => BESIDE_MIN + poses,
            Measurement::Plate { .. } => PLATE_MIN + poses,
            Measurement::Station { .. } => STATION_MIN + poses,
            Measurement::More { .. } => poses,
        }
    }

    /// Poses of the arm that it needs.
    pub fn poses(&self) -> u32 {
        match *self {
            Measurement::Touch | Measurement::Frame => 0,
            Measurement::Beside { poses }
            | Measurement::Plate { poses }
            | Measurement::Station { poses }
            | Measurement::More { poses } => poses,
        }
    }

    /// Short name for files.
    pub fn name(&self) -> &'static str {
        match self {
            Measurement::Touch => "touch-work-object",
            Measurement::Frame => "sensor-frame",
            Measurement::Beside { .. } => "target-beside-axis-6",
            Measurement::Plate { .. } => "targets-measured-on-flange",
            Measurement::Station { .. } => "second-station",
            Measurement::More { .. } => "more-poses",
        }
    }

    /// Instruction to the user; `object` is what the program's language calls the workpiece frame (work object, work offset).
    pub fn instruction(&self, object: &str) -> String {
        match self {
            Measurement::Touch => format!(
                "touch three points of the {object} with this arm and give their joints (cell file, origin = \"taught\")"
            ),
            Measurement::Frame => {
                "measure the pose of the sensor in the robot's base and state it (--sensor-frame, or \
                         --outlet and --cable-zero, with --frame-sigma)"
                    .to_owned()
            }
            Measurement::Beside { poses } => format!(
                "measure {poses} poses with the target beside the axis of joint 6, at many angles of that joint"
            ),
            Measurement::Plate { poses } => format!(
                "measure {poses} poses with three targets whose positions on the flange were measured on a \
                 coordinate measuring machine"
            ),
            Measurement::Station { poses } => {
                format!(
                    "measure {poses} poses with the sensor, or the outlet of its cable, at a second station"
                )
            }
            Measurement::More { poses } => format!("measure {poses} more poses as before"),
        }
    }
}

/// The cheapest measurement that makes a position known, or the best one available.
#[derive(Debug, Clone, PartialEq)]
pub struct Remedy {
    /// All measurements to make.
    pub measurements: Vec<Measurement>,
    /// Predicted standard deviation of the path's position afterwards (RMS over the points, mm).
    pub sigma_mm: f64,
    /// Whether the position is then expected to be corrected. Otherwise no candidate suffices, and this one leaves the
    /// smallest sigma.
    pub suffices: bool,
}

impl Remedy {
    /// Total cost (minutes).
    pub fn minutes(&self) -> f64 {
        self.measurements.iter().map(Measurement::minutes).sum()
    }
}
