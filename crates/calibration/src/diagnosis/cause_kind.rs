//! The kinds of causes that a diagnosis can name, each with its contract name.

use std::fmt;

use serde::{Deserialize, Serialize};
use truegrind_arm::effect::Effect;

/// The enum, its contract names, the pattern in the residual that reveals each kind, and what to do about it, from one list. In a
/// pattern `{joint}` stands for the number of the joint, `{next}` for that of the joint behind it.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal $(, pattern: $pattern:literal)? $(, remedy: $remedy:literal)?;)*) => {
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

            /// The pattern in the residual that usually reveals it, at the joint with this number.
            pub(super) fn pattern(self, joint: usize) -> String {
                let pattern = match self {
                    $($(CauseKind::$kind => $pattern,)?)*
                    _ => "see the picture",
                };
                pattern.replace("{joint}", &joint.to_string()).replace("{next}", &(joint + 1).to_string())
            }

            /// The action usually recommended.
            pub(super) fn remedy(self) -> &'static str {
                match self {
                    $($(CauseKind::$kind => $remedy,)?)*
                    _ => "measure more poses where the picture shows the largest residuals",
                }
            }
        }
    };
}

// In the alphabetical order of the contract names, in which tables list them.
kinds! {
    /// A tracker's beam bent by layers of air.
    AirRefraction = "air-refraction",
        pattern: "the vertical residual grows with the square of the distance",
        remedy: "measure at uniform air temperature and short distance, or with the tracker at the height of the arm";
    /// Logged joint angles with too few digits.
    AngleRounding = "angle-rounding",
        remedy: "log angles with more digits";
    /// An axis that wobbles twice a turn.
    AxisWobble = "axis-wobble",
        pattern: "the residual tilts about the axis of joint {joint} twice in a turn of it",
        remedy: "inspect the bearing of this joint with a dial gauge, axially, over a whole turn; after a repair measure again, since the \
            written model corrects for it";
    /// Lost motion where a joint reverses.
    Backlash = "backlash",
        pattern: "the residual about joint {joint} changes sign with the approach side",
        remedy: "approach every point from the same side, or compensate with the approach side; adjust the gear mesh";
    /// A base that tilts under the overturning moment of the arm.
    BaseTilt = "base-tilt",
        pattern: "the residual turns about the base with the overturning moment of the arm",
        remedy: "bolt or grout the pedestal, and read a level on it with the arm stretched out and folded; measure again \
            afterwards, since the written model corrects for the tilt";
    /// A drum wound in layers.
    CableDrum = "cable-drum",
        pattern: "the residual follows powers of the cable's length",
        remedy: "check the cable sensor against a length standard over its whole range";
    /// A pulley or a worn outlet.
    CablePulley = "cable-pulley",
        pattern: "the residual follows the direction of the cable",
        remedy: "inspect outlet and pulley; measure with the cable in one direction as far as possible";
    /// A cable sensor that reads otherwise when the cable pays out than when it winds in.
    CableReversal = "cable-reversal",
        pattern: "the residual changes sign with the way in which the cable last moved",
        remedy: "approach each pose so that the cable always pays out; check its drum, guide and spring";
    /// A cable that sags under its own weight.
    CableSag = "cable-sag",
        pattern: "the residual grows with the square of the cable's horizontal span",
        remedy: "increase the cable's tension or shorten the distance";
    /// An eccentric gear or encoder ring.
    GearEccentricity = "gear-eccentricity",
        pattern: "the residual about joint {joint} oscillates with its angle",
        remedy: "compensate with this model; at the next repair, reseat or replace the eccentric gear or encoder ring";
    /// A wrong gear ratio.
    GearRatio = "gear-ratio",
        pattern: "the residual about joint {joint} is proportional to its angle",
        remedy: "compare the ratio in the controller's motor configuration with the installed gear";
    /// Harmonics of a reducer, or a smooth error map of a joint.
    GearTransmission = "gear-transmission",
        pattern: "the residual about joint {joint} is periodic in its angle",
        remedy: "compensate with this model; inspect the reducer for wear if the amplitude grows";
    /// An error that depends on the angles of two joints.
    GearTwoJoints = "gear-two-joints",
        pattern: "the residual about joint {joint} oscillates with the angles of two joints",
        remedy: "compensate with this model; inspect the cable or gear train that crosses both joints";
    /// A joint that yields under gravity.
    JointCompliance = "joint-compliance",
        pattern: "the residual follows the static torque on joint {joint}",
        remedy: "compensate with this model, which includes the compliance; check belts and reducer preload if it has grown";
    /// A joint that turns with another.
    JointCoupling = "joint-coupling",
        pattern: "the residual about a joint grows with the angle of joint {joint}",
        remedy: "check the coupling ratio in the controller's configuration; the wrist's gear train might have been replaced";
    /// A joint whose stiffness is not linear.
    JointStiffness = "joint-stiffness",
        pattern: "the residual about joint {joint} follows its torque, but not in proportion",
        remedy: "compensate with this model, for the load of the measurement; check the preload of the gear";
    /// A joint whose zero moved: lost counts, a slipped belt, another mastering.
    JointZeroShift = "joint-zero-shift",
        pattern: "the residual about joint {joint} steps by one angle in these rows",
        remedy: "check encoder, belt and mastering of this joint; measure these rows again, since the written arm is that of the \
            other rows";
    /// Angles and reading of a row taken at different times.
    Latency = "latency",
        pattern: "the residual follows the speed of the joints",
        remedy: "record angles and readings with the same clock, or measure at rest";
    /// A camera whose lens distorts.
    LensDistortion = "lens-distortion",
        pattern: "the residual grows with the distance from the camera's axis",
        remedy: "calibrate the camera's lens again, or keep the target near the middle of the picture";
    /// A link that bends under what it carries.
    LinkBending = "link-bending",
        pattern: "the residual about joints {joint} and {next} follows the static torques on both",
        remedy: "compensate with this model, which includes the bending; check the bolts of this link and keep the payload as \
            measured";
    /// Links other than those of the data sheet: a rival of findings, never a finding.
    LinkGeometry = "link-geometry",
        remedy: "compare the type plate and the controller's kinematics with the data sheet before anything else; write the arm's \
            own data sheet if it is a variant";
    /// A link that twists under a load beside it.
    LinkTwist = "link-twist",
        pattern: "the residual tilts about the end of link {joint} as the link turns against gravity",
        remedy: "check the bolts of this link and the bearing at its end, axially, with a load beside the arm; the written model \
            corrects for it with the tool that was measured";
    /// Single wrong rows.
    Outliers = "outliers",
        remedy: "measure these rows again";
    /// A load that was not logged.
    PayloadChange = "payload-change",
        pattern: "the residual follows the torque of a mass at the flange in these rows alone",
        remedy: "log the payload of every row; measure these rows again with the payload of the program";
    /// Angles and Cartesian read-out that contradict each other.
    ReadoutMismatch = "readout-mismatch",
        remedy: "record angles and read-out at the same time, at rest; measure these rows again";
    /// Axes of a sensor whose scales differ.
    SensorAxes = "sensor-axes",
        pattern: "the residual is proportional to the reading, but not alike along the sensor's axes",
        remedy: "recalibrate the sensor, and check it against a length standard along each of its axes";
    /// A sensor's frame, or a cable's outlet, that moved.
    SensorFrameShift = "sensor-frame-shift",
        pattern: "the residual steps by one vector in the base in these rows",
        remedy: "fix the sensor's stand, check the bolts of the arm's base; measure reference points before and after each session";
    /// Distances that are off by an amount not proportional to them.
    SensorRange = "sensor-range",
        pattern: "the residual follows the distance along the beam",
        remedy: "check the reflector's constant and the sensor against a length standard at several distances";
    /// An error of the sensor's scale.
    SensorScale = "sensor-scale",
        pattern: "the residual is proportional to the reading",
        remedy: "check the sensor against a length standard";
    /// A cable whose zero moved.
    SensorZeroShift = "sensor-zero-shift",
        pattern: "the cable's residual steps by one amount in these rows",
        remedy: "check the cable's clamp and drum; measure a reference point before and after each session";
    /// Several shifts of the set-up over time.
    SetupChange = "setup-change",
        remedy: "measure reference points before and after each session, and repeat the rows of displaced sessions";
    /// Several causes too small to justify inspecting a part.
    SmallDisturbances = "small-disturbances",
        remedy: "nothing: the arm's share of them is in the model";
    /// A correction without a physical cause.
    SmoothCorrection = "smooth-correction";
    /// A target that droops on its pole or adapter.
    TargetDroop = "target-droop",
        pattern: "the residual follows the direction of gravity in the flange's frame",
        remedy: "stiffen the target's pole or adapter, or measure with the target near the flange; the written model leaves it \
            out, since a tool does not droop this way";
    /// A target whose apparent centre depends on the viewing direction.
    TargetNest = "target-nest",
        pattern: "the residual follows the direction of the beam in the target's frame",
        remedy: "turn the target towards the sensor; check its nest and replace the reflector";
    /// Growth with time or temperature, of the arm or of the sensor's stand.
    ThermalDrift = "thermal-drift",
        pattern: "the residual grows with time or temperature",
        remedy: "warm the arm up before measuring and grinding, or measure in both states";
    /// A target that moved on the flange.
    ToolShift = "tool-shift",
        pattern: "the residual steps by one vector on the flange in these rows",
        remedy: "fasten the hook or reflector; measure the rows after the slip again";
    /// The part of the residual that has no cause in the catalogue.
    Unexplained = "unexplained";
    /// Readings taken before arm or sensor had settled.
    Unsettled = "unsettled",
        pattern: "the residual points to the previous pose",
        remedy: "wait longer before each reading";
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
            Effect::LinkTwist(_) => CauseKind::LinkTwist,
            Effect::GearEccentricity(_) => CauseKind::GearEccentricity,
            Effect::GearTransmission(_) | Effect::GearMap(_) => CauseKind::GearTransmission,
            Effect::GearRatio(_) => CauseKind::GearRatio,
            Effect::JointStiffness(_) | Effect::TorquePowers(_) => CauseKind::JointStiffness,
            Effect::GearTwoJoints(_) => CauseKind::GearTwoJoints,
            Effect::JointCoupling(_) => CauseKind::JointCoupling,
            Effect::Backlash(_) | Effect::LoadedBacklash(_) => CauseKind::Backlash,
            Effect::ThermalDrift(_) => CauseKind::ThermalDrift,
            Effect::AxisWobble(_) => CauseKind::AxisWobble,
            Effect::BaseTilt(_) => CauseKind::BaseTilt,
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
