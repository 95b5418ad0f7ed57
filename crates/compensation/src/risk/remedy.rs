//! What could be measured so that the place of a path becomes known, and what it costs.
//!
//! Which of it is cheapest for a program, and what it would leave, is worked out in `foreseen`.

/// Minutes to touch one point of a part with the tool of the program, and to write its joints down.
const TOUCH_MIN: f64 = 5.0;
/// Minutes to find out where a sensor stands in the robot's base: three points of the robot's foot, and the fit.
const FRAME_MIN: f64 = 30.0;
/// Minutes to mount a target beside the axis of joint 6.
const BESIDE_MIN: f64 = 10.0;
/// Minutes to have the places of three targets on the flange measured, on a coordinate measuring machine.
const PLATE_MIN: f64 = 90.0;
/// Minutes to put a sensor, or the outlet of a cable, at a second place.
const STATION_MIN: f64 = 20.0;
/// Minutes for one pose: the way there, half a second of rest, the reading.
const POSE_MIN: f64 = 0.5;

/// One thing to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Measurement {
    /// Three points of the work object, touched with this arm and the tool of the program.
    Touch,
    /// Where the sensor stands in the robot's base, or the outlet of its cable; the rows that there are count again.
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
    /// Poses with the sensor, or the outlet of its cable, at a second place.
    Station {
        /// How many.
        poses: u32,
    },
    /// Poses measured as those that there are.
    More {
        /// How many.
        poses: u32,
    },
}

impl Measurement {
    /// What it costs (minutes of a robot cell and of those who stand in it).
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

    /// Poses of the arm that are measured for it.
    pub fn poses(&self) -> u32 {
        match *self {
            Measurement::Touch | Measurement::Frame => 0,
            Measurement::Beside { poses }
            | Measurement::Plate { poses }
            | Measurement::Station { poses }
            | Measurement::More { poses } => poses,
        }
    }

    /// A short name for files.
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

    /// What to do, with the name that a program of this language has for what is cut (work object, work offset).
    pub fn instruction(&self, object: &str) -> String {
        match self {
            Measurement::Touch => format!(
                "touch three points of the {object} with this arm and give their joints (cell file, origin = \"taught\")"
            ),
            Measurement::Frame => "measure where the sensor stands in the robot's base and state it (--sensor-frame, or --outlet and \
                                   --cable-zero, with --frame-sigma)"
                .to_owned(),
            Measurement::Beside { poses } => format!(
                "measure {poses} poses with the target beside the axis of joint 6, at many angles of that joint"
            ),
            Measurement::Plate { poses } => format!(
                "measure {poses} poses with three targets whose places on the flange a coordinate measuring machine has told"
            ),
            Measurement::Station { poses } => {
                format!("measure {poses} poses with the sensor, or the outlet of its cable, at a second place")
            }
            Measurement::More { poses } => format!("measure {poses} more poses as before"),
        }
    }
}

/// The cheapest measurement that makes a place known, or the best there is.
#[derive(Debug, Clone, PartialEq)]
pub struct Remedy {
    /// What is to be measured, all of it.
    pub measurements: Vec<Measurement>,
    /// Predicted standard deviation of the path's place once it is measured (RMS over the points, mm).
    pub sigma_mm: f64,
    /// Whether the place has then to be expected to be corrected. Otherwise nothing that was looked at is enough, and this leaves
    /// the smallest sigma.
    pub suffices: bool,
}

impl Remedy {
    /// What all of it costs (minutes).
    pub fn minutes(&self) -> f64 {
        self.measurements.iter().map(Measurement::minutes).sum()
    }
}
