//! Reasons why a motion was left, refused or flagged: a closed list.

use std::fmt;

use crate::cell::AXES;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Limited;
use truegrind_programs::motion::Reason;

/// Reason for the status of a motion.
///
/// ```
/// use truegrind_arm::model::Limited;
/// use truegrind_compensation::plan::reason::OutcomeReason;
///
/// assert_eq!(OutcomeReason::OutsideLimits { what: Limited::Joint(4) }.to_string(), "joint 5 would exceed its limits");
/// let far = OutcomeReason::CorrectionTooLarge { mm: 3.25 };
/// assert_eq!(far.to_string(), "correction of 3.250 mm exceeds the bound (--max-correction)");
/// // In a summary, motions are counted by the reason without its figures.
/// assert_eq!(far.kind(), OutcomeReason::CorrectionTooLarge { mm: 8.0 }.kind());
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutcomeReason {
    /// The program states too little, or something that must not be changed.
    Program(Reason),
    /// An external axis carries the robot's base; the moving base is not modelled.
    MovingBase {
        /// Index among the external axes, 0-based.
        axis: usize,
    },
    /// Cell file and program disagree about its tool or work object; see
    /// [`contradictions`](crate::frames::taught::contradictions).
    CellContradiction,
    /// A joint target states joints, not a pose; rewritten only with `joint_targets`.
    JointTarget,
    /// The new numbers equal the old ones to the decimals written; known only after the rewrite.
    NoChange,
    /// No joints reach the target.
    Inverse(InverseError),
    /// A joint or a sum of joints would exceed its limits.
    OutsideLimits {
        /// Which.
        what: Limited,
    },
    /// A joint or a sum of joints would exceed its limits on the corrected segment to this target, but not on the original one.
    PathOutsideLimits {
        /// Which.
        what: Limited,
    },
    /// The position correction exceeds the stated bound.
    CorrectionTooLarge {
        /// The correction (mm).
        mm: f64,
    },
    /// The orientation correction exceeds the stated bound.
    RotationTooLarge {
        /// The correction (°).
        deg: f64,
    },
    /// Near a singularity, where small corrections cause large joint motions.
    NearSingularity,
    /// The correction turns a joint far more than the same correction would elsewhere in the workspace: at the target or on
    /// the segment.
    JointJump {
        /// Joint, 0-based; a byte keeps all reasons short.
        joint: u8,
        /// Joint change caused by the correction (°).
        deg: f64,
        /// Largest joint change allowed for a correction of this size (°).
        most_deg: f64,
        /// Whether this occurs on the segment rather than at the target.
        on_the_way: bool,
    },
    /// The corrected segment passes too close to a singularity.
    SingularPath,
    /// The corrected target has another configuration.
    OtherBranch,
    /// The program does not determine the configuration that the controller selects, and the intended one is not the nearest.
    AmbiguousBranch,
    /// The controller does not check the stated configuration but selects the one nearest to the current joints, which the
    /// program does not determine: the motion is corrected for the stated configuration.
    UnknownStart,
    /// The text does not tell where the line or arc begins, so the path to its end is not checked.
    UncheckedPath,
    /// The path between two targets deviates from the intended one by more than the tolerance.
    PathDeviation {
        /// Largest deviation (mm).
        mm: f64,
    },
    /// The robot rounds the previous point, and the corner deviates from the intended one by more than the tolerance.
    CornerDeviation {
        /// Largest deviation (mm).
        mm: f64,
    },
    /// An arc of about half a turn is programmed by its radius, whose decimals leave the centre ambiguous.
    AmbiguousCentre {
        /// Uncertainty of the centre (mm).
        mm: f64,
    },
    /// Straight segments were requested, but the circle was kept.
    CircleKept,
    /// The tool turns by about half a turn along a line, so that the controller might turn it the other way.
    HalfTurn {
        /// Line of the motion along which it turns.
        line: u32,
    },
    /// Joints were requested, but they would make no line from where it starts.
    LineWithoutStart,
    /// Joints were requested, but they would leave the line, and no inserted targets keep them on it.
    LineAsJoints {
        /// How far they would leave it (mm).
        mm: f64,
    },
    /// At the programmed speed a joint would exceed its speed limit.
    TooFast {
        /// Joint, 0-based.
        joint: usize,
        /// Joint speed over its limit, above 1.
        ratio: f64,
    },
    /// The three points of a circular motion are collinear, two of them coincide, or the circle through them deviates from
    /// the intended path.
    NoCircle,
    /// A circular motion that starts at an uncorrected place, from where its corrected points would make another circle.
    ArcFromUncorrected {
        /// Line of the motion that ends there, 1-based.
        line: u32,
    },
    /// The next circular motion remains unmodified and starts here; from a corrected start it would be a different circle.
    StartOfUnchangedArc {
        /// Line of that motion, 1-based.
        line: u32,
    },
    /// A cut that remains unmodified starts here; from a corrected start its first line would become a wedge.
    StartOfUnchangedCut {
        /// Line of its first motion, 1-based.
        line: u32,
    },
    /// A cut that remains unmodified ends where this motion begins; to a corrected end it would draw the tool out of the part sideways.
    DepartureFromUnchangedCut {
        /// Line of the last motion of the cut, 1-based.
        line: u32,
    },
    /// The next motion remains unmodified and starts here; from a corrected start it would pass too close to a singularity.
    StartOfSingularPath {
        /// Line of that motion, 1-based.
        line: u32,
    },
    /// The next motion remains unmodified and starts here; from a corrected start a joint would exceed its limits on the way.
    StartOfLimitedPath {
        /// Line of that motion, 1-based.
        line: u32,
        /// What would exceed its limits.
        what: Limited,
    },
    /// A full circle: its coincident ends do not determine its plane, so its path is not checked.
    FullCircle,
    /// A joint is outside the range covered by the measurement.
    JointNotMeasured {
        /// Joint, 0-based.
        joint: usize,
        /// Distance beyond that range (°).
        by_deg: f64,
    },
    /// Another motion of its cut remains unmodified: a partial correction would leave a step in the part.
    PartOfCut {
        /// Line of the first motion that remains unmodified for its own reason, 1-based.
        line: u32,
        /// That reason, without figures.
        because: &'static str,
    },
    /// An air move beside a cut that remains unmodified, whose lines would take their omitted axes from it.
    AirMoveAlone,
    /// Every motion that was left out kept others from being corrected, until none was left to leave out.
    NoConsistentPlan,
    /// An adjacent motion of the same cut remains unmodified, and the step to it would be too large.
    Step {
        /// Line of that motion, 1-based.
        line: u32,
        /// The step (mm).
        mm: f64,
    },
    /// The probability that the correction makes the cut worse is too high.
    Risk {
        /// That probability.
        chance: f64,
    },
    /// No measured pose is nearby.
    NotCovered {
        /// Distance to the nearest measured pose over the usual distance between measured poses, above 1.
        ratio: f64,
    },
    /// The model is much less certain here than at the measured poses.
    Uncertain {
        /// Predicted σ (mm).
        sigma_mm: f64,
    },
}

impl OutcomeReason {
    /// Reason for a failed inverse solution.
    pub fn of_inverse(error: InverseError) -> Self {
        match error {
            InverseError::OutsideLimits { what, .. } => OutcomeReason::OutsideLimits { what },
            InverseError::NearSingularity { .. } => OutcomeReason::NearSingularity,
            other => OutcomeReason::Inverse(other),
        }
    }

    /// The reason without the figures of one motion, for counting. `Display` adds them.
    pub fn kind(&self) -> &'static str {
        match self {
            OutcomeReason::Program(reason) => reason.text(),
            OutcomeReason::MovingBase { .. } => {
                "an external axis carries the robot's base, whose position is not modelled"
            }
            OutcomeReason::CellContradiction => {
                "cell file and program disagree about its tool or work object"
            }
            OutcomeReason::JointTarget => {
                "joint target: states joints, not a pose (--joint-targets rewrites it too)"
            }
            OutcomeReason::NoChange => "its numbers are already right to the last written decimal",
            OutcomeReason::Inverse(InverseError::Unreachable { .. }) => "target is out of reach",
            OutcomeReason::Inverse(InverseError::OtherConfiguration { .. }) => {
                "target is not reachable in its configuration"
            }
            OutcomeReason::Inverse(InverseError::OtherBranch { .. }) => {
                "target is reachable only in another configuration"
            }
            OutcomeReason::Inverse(InverseError::Abandoned) => {
                "the search for its joints was stopped: too many targets of this program need a search"
            }
            OutcomeReason::Inverse(_) => "no joint solution was found",
            OutcomeReason::OutsideLimits { .. } => "a joint would exceed its limits",
            OutcomeReason::PathOutsideLimits { .. } => {
                "a joint would exceed its limits on the corrected path to it"
            }
            OutcomeReason::CorrectionTooLarge { .. } => "correction exceeds the bound (--max-correction)",
            OutcomeReason::RotationTooLarge { .. } => {
                "correction of the orientation exceeds the bound (by default 2°)"
            }
            OutcomeReason::NearSingularity => "too close to a singularity",
            OutcomeReason::OtherBranch => "the corrected target lies in another configuration",
            OutcomeReason::PathDeviation { mm } if !mm.is_finite() => "the arm cannot follow the path to it",
            OutcomeReason::PathDeviation { .. } => "the path to it deviates from the intended one",
            OutcomeReason::CornerDeviation { mm } if !mm.is_finite() => {
                "the arm cannot follow the rounded corner before it: round it less (zone, path tolerance)"
            }
            OutcomeReason::CornerDeviation { .. } => {
                "the rounded corner before it deviates from the intended one: round it less (zone, path tolerance)"
            }
            OutcomeReason::AmbiguousCentre { .. } => {
                "an arc of about half a turn programmed by its radius: the written decimals leave its centre ambiguous; state the centre \
                 instead (I, J, K; CC)"
            }
            OutcomeReason::CircleKept => {
                "the circle was kept: its start is unknown or not corrected, the instruction cannot be split, or no straight \
                 segments follow it"
            }
            OutcomeReason::HalfTurn { .. } => {
                "the tool turns by about 180° along a line: after the correction the controller might turn it the other way round; insert a \
                 target halfway"
            }
            OutcomeReason::LineWithoutStart => {
                "joint targets would not follow this line, since its start is unknown or not corrected: begin with a joint motion, add \
                 --joint-targets, or drop --emit joints"
            }
            OutcomeReason::LineAsJoints { .. } => {
                "joint targets would not follow this line, and none can be inserted to keep them on it (\\T, \\Conc, a trigger, SingArea \\Wrist, or \
                 too many needed): drop --emit joints"
            }
            OutcomeReason::TooFast { .. } => "a joint exceeds its speed limit at the programmed speed",
            OutcomeReason::NoCircle => "its three points make no circle that follows the intended path",
            OutcomeReason::ArcFromUncorrected { .. } => {
                "it starts at a place that is not corrected: from there the corrected circle would be another one"
            }
            OutcomeReason::StartOfUnchangedArc { .. } => {
                "a circular motion that is not corrected starts here: from a corrected start it would be a different circle"
            }
            OutcomeReason::StartOfUnchangedCut { .. } => {
                "a cut that is not corrected starts here: correcting its start would tilt its first line"
            }
            OutcomeReason::DepartureFromUnchangedCut { .. } => {
                "it leaves the part at the end of a cut that is not corrected: corrected, it would draw the tool sideways"
            }
            OutcomeReason::StartOfSingularPath { .. } => {
                "a motion that is not corrected starts here: from a corrected start it would pass too close to a singularity"
            }
            OutcomeReason::StartOfLimitedPath { .. } => {
                "a motion that is not corrected starts here: from a corrected start a joint would exceed its limits on the way"
            }
            OutcomeReason::FullCircle => "a full circle: the path between its ends is not checked",
            OutcomeReason::JointNotMeasured { .. } => {
                "a joint is outside the range in which the arm was measured"
            }
            OutcomeReason::JointJump { on_the_way: false, .. } => {
                "the correction would turn a joint too far, because the arm is near a singularity: move the path away from the singularity"
            }
            OutcomeReason::JointJump { on_the_way: true, .. } => {
                "on the path to this target the correction would turn a joint too far, because the arm is near a singularity: move the path away \
                 from the singularity"
            }
            OutcomeReason::SingularPath => "the corrected path to it passes too close to a singularity",
            OutcomeReason::AmbiguousBranch => {
                "no configuration is stated and another one is equally near, so the controller might select it: state the \
                 configuration, or add a target closer to this one"
            }
            OutcomeReason::UnknownStart => {
                "its configuration is not monitored (ConfL \\Off, ConfJ \\Off): it depends on where the arm comes from, which the program does \
                 not say. Corrected for the stated configuration, or for the one that continues from there: check it, or begin with a joint \
                 target"
            }
            OutcomeReason::UncheckedPath => {
                "the path to it is not checked, since the text does not tell where it begins: check it, or begin it behind a motion that the \
                 text states"
            }
            OutcomeReason::PartOfCut { because, .. } => because,
            OutcomeReason::Step { .. } => {
                "the step to an uncorrected motion of the same cut would exceed --tolerance"
            }
            OutcomeReason::AirMoveAlone => {
                "an air move next to a cut that is not corrected: correcting the air move would shift the start of the cut, and the values of the \
                 axes that the blocks of the cut omit"
            }
            OutcomeReason::NoConsistentPlan => {
                "no consistent plan was found: each motion that was not corrected kept others from being corrected; divide the program"
            }
            OutcomeReason::Risk { .. } => {
                "the correction would make this cut worse with a probability above --max-risk: the arm was not measured well enough here"
            }
            OutcomeReason::NotCovered { .. } => "no measured pose is nearby",
            OutcomeReason::Uncertain { .. } => "the model is uncertain here",
        }
    }

    /// What of the reason can be more or less, for the worst of several motions; `None` where nothing can or it is not finite.
    pub fn figure(&self) -> Option<Figure> {
        let figure = match *self {
            OutcomeReason::Inverse(InverseError::Unreachable { beyond_mm }) => {
                Figure::Length { mm: beyond_mm }
            }
            OutcomeReason::CorrectionTooLarge { mm }
            | OutcomeReason::PathDeviation { mm }
            | OutcomeReason::LineAsJoints { mm }
            | OutcomeReason::CornerDeviation { mm }
            | OutcomeReason::AmbiguousCentre { mm }
            | OutcomeReason::Step { mm, .. } => Figure::Length { mm },
            OutcomeReason::RotationTooLarge { deg }
            | OutcomeReason::JointJump { deg, .. }
            | OutcomeReason::JointNotMeasured { by_deg: deg, .. } => Figure::Angle { deg },
            OutcomeReason::TooFast { ratio, .. } => Figure::OverLimit { ratio },
            OutcomeReason::NotCovered { ratio } => Figure::OverSpacing { ratio },
            OutcomeReason::Risk { chance } => Figure::Probability { chance },
            OutcomeReason::Uncertain { sigma_mm } => Figure::Sigma { mm: sigma_mm },
            _ => return None,
        };
        Some(figure).filter(|figure| figure.value().is_finite())
    }

    /// Line of the other motion because of which this one is not corrected.
    pub fn cause_line(&self) -> Option<u32> {
        match *self {
            OutcomeReason::PartOfCut { line, .. }
            | OutcomeReason::Step { line, .. }
            | OutcomeReason::HalfTurn { line }
            | OutcomeReason::ArcFromUncorrected { line }
            | OutcomeReason::StartOfUnchangedArc { line }
            | OutcomeReason::StartOfUnchangedCut { line }
            | OutcomeReason::DepartureFromUnchangedCut { line }
            | OutcomeReason::StartOfSingularPath { line }
            | OutcomeReason::StartOfLimitedPath { line, .. } => Some(line),
            _ => None,
        }
    }

    /// The joint or the sum of joints that it is about.
    pub fn limited(&self) -> Option<Limited> {
        match *self {
            OutcomeReason::OutsideLimits { what }
            | OutcomeReason::PathOutsideLimits { what }
            | OutcomeReason::StartOfLimitedPath { what, .. } => Some(what),
            OutcomeReason::JointJump { joint, .. } => Some(Limited::Joint(joint)),
            OutcomeReason::TooFast { joint, .. } | OutcomeReason::JointNotMeasured { joint, .. } => {
                Some(Limited::joint(joint))
            }
            _ => None,
        }
    }
}

/// A figure of a reason.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Figure {
    /// A length.
    Length {
        /// In mm.
        mm: f64,
    },
    /// A standard deviation.
    Sigma {
        /// In mm.
        mm: f64,
    },
    /// An angle.
    Angle {
        /// In degrees.
        deg: f64,
    },
    /// A speed over its limit.
    OverLimit {
        /// The ratio.
        ratio: f64,
    },
    /// A distance over the usual one between measured poses.
    OverSpacing {
        /// The ratio.
        ratio: f64,
    },
    /// A probability.
    Probability {
        /// From 0 to 1.
        chance: f64,
    },
}

impl Figure {
    /// The number, in its own unit.
    pub fn value(self) -> f64 {
        match self {
            Figure::Length { mm: value }
            | Figure::Sigma { mm: value }
            | Figure::Angle { deg: value }
            | Figure::OverLimit { ratio: value }
            | Figure::OverSpacing { ratio: value }
            | Figure::Probability { chance: value } => value,
        }
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Figure::Length { mm } => write!(f, "{mm:.3} mm"),
            Figure::Sigma { mm } => write!(f, "{mm:.3} mm σ"),
            Figure::Angle { deg } => write!(f, "{deg:.2}°"),
            Figure::OverLimit { ratio } => write!(f, "{ratio:.2} × its limit"),
            Figure::OverSpacing { ratio } => write!(f, "{ratio:.1} × the usual distance"),
            Figure::Probability { chance } => write!(f, "{:.0} %", 100.0 * chance),
        }
    }
}

impl fmt::Display for OutcomeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OutcomeReason::MovingBase { axis } => write!(
                f,
                "external axis {} carries the robot's base, whose position is not modelled",
                AXES.get(*axis).copied().unwrap_or('?')
            ),
            OutcomeReason::Inverse(error) => error.fmt(f),
            OutcomeReason::OutsideLimits { what } => write!(f, "{what} would exceed its limits"),
            OutcomeReason::PathOutsideLimits { what } => {
                write!(f, "{what} would exceed its limits on the corrected path to it")
            }
            OutcomeReason::CorrectionTooLarge { mm } => {
                write!(f, "correction of {mm:.3} mm exceeds the bound (--max-correction)")
            }
            OutcomeReason::RotationTooLarge { deg } => {
                write!(f, "correction of the orientation by {deg:.3}° exceeds the bound (by default 2°)")
            }
            OutcomeReason::JointJump { joint, deg, most_deg, on_the_way } => write!(
                f,
                "{}the correction would turn joint {} by {deg:.1}° (limit {most_deg:.1}°), because the arm is near a singularity: move the path \
                 away from the singularity",
                if *on_the_way { "on the path to this target " } else { "" },
                joint + 1
            ),
            OutcomeReason::PathDeviation { mm } if mm.is_finite() => {
                write!(f, "the path to it deviates from the intended one by {mm:.3} mm")
            }
            OutcomeReason::LineAsJoints { mm } if mm.is_finite() => write!(
                f,
                "joint targets would leave this line by {mm:.3} mm, and none can be inserted to keep them on it (\\T, \\Conc, a trigger, \
                 SingArea \\Wrist, or too many needed): drop --emit joints"
            ),
            OutcomeReason::CornerDeviation { mm } if mm.is_finite() => write!(
                f,
                "the rounded corner before it deviates from the intended one by {mm:.3} mm: round it less (zone, path tolerance)"
            ),
            OutcomeReason::AmbiguousCentre { mm } => write!(
                f,
                "an arc of about half a turn programmed by its radius: the written decimals leave its centre ambiguous by \
                 {mm:.3} mm; state the centre instead (I, J, K; CC)"
            ),
            OutcomeReason::TooFast { joint, ratio } => write!(
                f,
                "at the programmed speed joint {} exceeds its speed limit by a factor of {ratio:.2}",
                joint + 1
            ),
            OutcomeReason::HalfTurn { line } => write!(
                f,
                "on line {line} the tool turns by about 180°: after the correction the controller might turn it the other way round; insert a \
                 target halfway"
            ),
            OutcomeReason::ArcFromUncorrected { line } => write!(
                f,
                "it starts at the end of line {line}, which is not corrected: from there the corrected circle would be another one"
            ),
            OutcomeReason::StartOfUnchangedArc { line } => write!(
                f,
                "the circular motion of line {line} is not corrected and starts here: from a corrected start it would be a different circle"
            ),
            OutcomeReason::StartOfUnchangedCut { line } => write!(
                f,
                "the cut at line {line} is not corrected and starts here: correcting its start would tilt its first line"
            ),
            OutcomeReason::DepartureFromUnchangedCut { line } => write!(
                f,
                "it leaves the part where the cut at line {line} ends, which is not corrected: corrected, it would draw the tool sideways"
            ),
            OutcomeReason::StartOfSingularPath { line } => write!(
                f,
                "the motion of line {line} is not corrected and starts here: from a corrected start it would pass too close to a singularity"
            ),
            OutcomeReason::StartOfLimitedPath { line, what } => write!(
                f,
                "the motion of line {line} is not corrected and starts here: from a corrected start {what} would exceed its limits on the way"
            ),
            OutcomeReason::JointNotMeasured { joint, by_deg } => write!(
                f,
                "joint {} is {by_deg:.1}° outside the range in which the arm was measured",
                joint + 1
            ),
            OutcomeReason::PartOfCut { line, because } => write!(
                f,
                "a cut is corrected as a whole or not at all, and line {line} is not corrected: {because} (--partial corrects the rest)"
            ),
            OutcomeReason::Step { line, mm } => write!(
                f,
                "the step of {mm:.3} mm to line {line} of the same cut, which is not corrected, would exceed --tolerance"
            ),
            OutcomeReason::Risk { chance } => write!(
                f,
                "the correction would make this cut worse with a probability of {:.0} %, above --max-risk: the arm was not measured well \
                 enough here",
                100.0 * chance
            ),
            OutcomeReason::NotCovered { ratio } => {
                write!(f, "no measured pose is nearby: {ratio:.1} times the distance between measured poses")
            }
            OutcomeReason::Uncertain { sigma_mm } => {
                write!(f, "the model is uncertain here: predicted standard deviation {sigma_mm:.3} mm")
            }
            _ => f.write_str(self.kind()),
        }
    }
}
