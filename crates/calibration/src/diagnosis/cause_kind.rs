//! The kinds of causes that a diagnosis can name, each with its contract name.

use std::fmt;

use serde::{Deserialize, Serialize};
use truegrind_arm::effect::Effect;

/// The enum and its contract names from one list.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal,)*) => {
        /// What a finding says is wrong. The contract name stands in JSON, tables and recipes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[non_exhaustive]
        pub enum CauseKind {
            $($(#[$doc])* #[serde(rename = $name)] $kind,)*
        }

        impl CauseKind {
            /// Its contract name.
            pub fn as_str(self) -> &'static str {
                match self {
                    $(CauseKind::$kind => $name,)*
                }
            }
        }
    };
}

// In the alphabetical order of the contract names, in which tables list them.
kinds! {
    /// A tracker's beam bent by layers of air.
    AirRefraction = "air-refraction",
    /// Logged joint angles with too few digits.
    AngleRounding = "angle-rounding",
    /// An axis that wobbles twice a turn.
    AxisWobble = "axis-wobble",
    /// Lost motion where a joint reverses.
    Backlash = "backlash",
    /// A base that tilts under the overturning moment of the arm.
    BaseTilt = "base-tilt",
    /// A drum wound in layers.
    CableDrum = "cable-drum",
    /// A pulley or a worn outlet.
    CablePulley = "cable-pulley",
    /// A cable sensor that reads otherwise when the cable pays out than when it winds in.
    CableReversal = "cable-reversal",
    /// A cable that sags under its own weight.
    CableSag = "cable-sag",
    /// An eccentric gear or encoder ring.
    GearEccentricity = "gear-eccentricity",
    /// A wrong gear ratio.
    GearRatio = "gear-ratio",
    /// Harmonics of a reducer, or a smooth error map of a joint.
    GearTransmission = "gear-transmission",
    /// An error that depends on the angles of two joints.
    GearTwoJoints = "gear-two-joints",
    /// A joint that yields under gravity.
    JointCompliance = "joint-compliance",
    /// A joint that turns with another.
    JointCoupling = "joint-coupling",
    /// A joint whose stiffness is not linear.
    JointStiffness = "joint-stiffness",
    /// A joint whose zero moved: lost counts, a slipped belt, another mastering.
    JointZeroShift = "joint-zero-shift",
    /// Angles and reading of a row taken at different times.
    Latency = "latency",
    /// A camera whose lens distorts.
    LensDistortion = "lens-distortion",
    /// A link that bends under what it carries.
    LinkBending = "link-bending",
    /// Links other than those of the data sheet: a rival of findings, never a finding.
    LinkGeometry = "link-geometry",
    /// Single wrong rows.
    Outliers = "outliers",
    /// A load that was not logged.
    PayloadChange = "payload-change",
    /// Angles and Cartesian read-out that contradict each other.
    ReadoutMismatch = "readout-mismatch",
    /// Axes of a sensor whose scales differ.
    SensorAxes = "sensor-axes",
    /// A sensor's frame, or a cable's outlet, that moved.
    SensorFrameShift = "sensor-frame-shift",
    /// Distances that are off by an amount not proportional to them.
    SensorRange = "sensor-range",
    /// An error of the sensor's scale.
    SensorScale = "sensor-scale",
    /// A cable whose zero moved.
    SensorZeroShift = "sensor-zero-shift",
    /// Several shifts of the set-up over time.
    SetupChange = "setup-change",
    /// Several causes too small to justify inspecting a part.
    SmallDisturbances = "small-disturbances",
    /// A correction without a physical cause.
    SmoothCorrection = "smooth-correction",
    /// A target that droops on its pole or adapter.
    TargetDroop = "target-droop",
    /// A target whose apparent centre depends on the viewing direction.
    TargetNest = "target-nest",
    /// Growth with time or temperature, of the arm or of the sensor's stand.
    ThermalDrift = "thermal-drift",
    /// A target that moved on the flange.
    ToolShift = "tool-shift",
    /// The part of the residual that has no cause in the catalogue.
    Unexplained = "unexplained",
    /// Readings taken before arm or sensor had settled.
    Unsettled = "unsettled",
}

impl CauseKind {
    /// Its name in sentences.
    pub fn words(self) -> String {
        self.as_str().replace('-', " ")
    }
}

impl From<&Effect> for CauseKind {
    fn from(effect: &Effect) -> Self {
        match effect {
            Effect::JointCompliance(_) | Effect::LumpedCompliance(_) => CauseKind::JointCompliance,
            Effect::LinkBending(_) => CauseKind::LinkBending,
            Effect::GearEccentricity(_) => CauseKind::GearEccentricity,
            Effect::GearTransmission(_) | Effect::GearMap(_) => CauseKind::GearTransmission,
            Effect::GearRatio(_) => CauseKind::GearRatio,
            Effect::JointCoupling(_) => CauseKind::JointCoupling,
            Effect::Backlash(_) => CauseKind::Backlash,
            Effect::ThermalDrift(_) => CauseKind::ThermalDrift,
            Effect::SmoothCorrection(_) => CauseKind::SmoothCorrection,
        }
    }
}

impl fmt::Display for CauseKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl PartialEq<&str> for CauseKind {
    fn eq(&self, name: &&str) -> bool {
        self.as_str() == *name
    }
}
