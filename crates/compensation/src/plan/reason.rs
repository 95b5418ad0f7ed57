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

    /// The reason without the figures of one motion, for counting.
    pub fn kind(&self) -> &'static str {
        match self {
            OutcomeReason::Program(reason) => reason.text(),
            OutcomeReason::MovingBase { .. } => "an external axis carries the robot's base",
            OutcomeReason::CellContradiction => "cell file and program contradict each other",
            OutcomeReason::JointTarget => "a joint target",
            OutcomeReason::NoChange => "nothing to change",
            OutcomeReason::Inverse(InverseError::Unreachable { .. }) => "out of reach",
            OutcomeReason::Inverse(
                InverseError::OtherConfiguration { .. } | InverseError::OtherBranch { .. },
            ) => "not reachable in its configuration",
            OutcomeReason::Inverse(InverseError::Abandoned) => "the search budget of the program was used up",
            OutcomeReason::Inverse(_) => "no joint solution was found",
            OutcomeReason::OutsideLimits { .. } => "a joint would exceed its limits",
            OutcomeReason::PathOutsideLimits { .. } => "a joint would exceed its limits on the way",
            OutcomeReason::CorrectionTooLarge { .. } => "correction exceeds the bound (--max-correction)",
            OutcomeReason::RotationTooLarge { .. } => "correction of the orientation exceeds the bound",
            OutcomeReason::NearSingularity => "too close to a singularity",
            OutcomeReason::OtherBranch => "the corrected target lies in another configuration",
            OutcomeReason::PathDeviation { .. } => "the path between targets deviates from the intended one",
            OutcomeReason::CornerDeviation { .. } => "the rounded corner deviates from the intended one",
            OutcomeReason::AmbiguousCentre { .. } => {
                "the radius of a half circle leaves its centre ambiguous"
            }
            OutcomeReason::CircleKept => "the circle was kept",
            OutcomeReason::HalfTurn { .. } => "the tool turns by about half a turn along a line",
            OutcomeReason::LineWithoutStart => {
                "a line with an unknown or uncorrected start cannot be written as joints"
            }
            OutcomeReason::TooFast { .. } => "a joint exceeds its speed limit",
            OutcomeReason::NoCircle => "no circle through its points follows the intended path",
            OutcomeReason::StartOfUnchangedArc { .. } => "an unmodified circular motion starts where it ends",
            OutcomeReason::StartOfUnchangedCut { .. } => "a cut that remains unmodified starts where it ends",
            OutcomeReason::StartOfSingularPath { .. } => {
                "an unmodified motion near a singularity starts where it ends"
            }
            OutcomeReason::StartOfLimitedPath { .. } => {
                "a joint would exceed its limits on an unmodified motion that starts here"
            }
            OutcomeReason::FullCircle => "a full circle",
            OutcomeReason::JointNotMeasured { .. } => {
                "a joint is outside the range in which the arm was measured"
            }
            OutcomeReason::JointJump { .. } => "near a singularity the correction turns a joint too far",
            OutcomeReason::SingularPath => "the path to it passes too close to a singularity",
            OutcomeReason::AmbiguousBranch => "the controller's choice of configuration is ambiguous",
            OutcomeReason::UnknownStart => {
                "corrected for the stated configuration, which is not checked, from an unknown start"
            }
            OutcomeReason::PartOfCut { because, .. } => because,
            OutcomeReason::Step { .. } => "the step to its neighbour is too large",
            OutcomeReason::AirMoveAlone => "an air move beside a cut that is not corrected",
            OutcomeReason::Risk { .. } => "the correction is too likely to make the cut worse (--max-risk)",
            OutcomeReason::NotCovered { .. } => "no measured pose is nearby",
            OutcomeReason::Uncertain { .. } => "the model is uncertain here",
        }
    }

    /// The whole sentence, where it contains no figures and says more than [`Self::kind`].
    fn sentence(&self) -> Option<&'static str> {
        Some(match self {
            OutcomeReason::NoChange => "its numbers are already right to the last written decimal",
            OutcomeReason::JointTarget => {
                "joint target: states joints, not a pose (--joint-targets rewrites it too)"
            }
            OutcomeReason::CellContradiction => {
                "cell file and program disagree about its tool or work object"
            }
            OutcomeReason::AirMoveAlone => {
                "an air move beside a cut that is not corrected: the lines of the cut would begin elsewhere and take the axes that they \
                 omit from it"
            }
            OutcomeReason::SingularPath => "the corrected path to it passes too close to a singularity",
            OutcomeReason::AmbiguousBranch => {
                "no configuration is stated and another one is equally near, so the controller might select it: state the \
                 configuration, or add a target closer to this one"
            }
            OutcomeReason::UnknownStart => {
                "its configuration is not checked (ConfL \\Off, ConfJ \\Off): the controller selects the one next to where the arm \
                 stands, and the program does not determine its start. It is corrected for the stated configuration, or the \
                 one that continues from there: check it, or begin with a joint target"
            }
            OutcomeReason::PathDeviation { mm } if !mm.is_finite() => "the arm cannot follow the path to it",
            OutcomeReason::CornerDeviation { mm } if !mm.is_finite() => {
                "the arm cannot follow the rounded corner before it: round it less (zone, path tolerance)"
            }
            OutcomeReason::CircleKept => {
                "the circle was kept: its start is unknown or not corrected, the instruction cannot be split, or no straight \
                 segments follow it"
            }
            OutcomeReason::LineWithoutStart => {
                "its start is unknown or not corrected, so joints would make another path than this line: begin with a joint motion, rewrite \
                 joint targets too (--joint-targets), or write targets (without --emit joints)"
            }
            OutcomeReason::NoCircle => {
                "its three points make no circle, or none that follows the intended path"
            }
            OutcomeReason::FullCircle => "a full circle: the path between its ends is not checked",
            _ => return None,
        })
    }
}

impl fmt::Display for OutcomeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(sentence) = self.sentence() {
            return f.write_str(sentence);
        }
        match self {
            OutcomeReason::Program(reason) => reason.fmt(f),
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
            OutcomeReason::RotationTooLarge { deg } => write!(f, "correction of {deg:.3}° exceeds the bound"),
            OutcomeReason::JointJump { joint, deg, most_deg, on_the_way } => write!(
                f,
                "{}the correction would turn joint {} by {deg:.1}°, but at most {most_deg:.1}° is needed away from \
                 singularities: keep farther from the singular configuration",
                if *on_the_way { "on the way to it " } else { "" },
                joint + 1
            ),
            OutcomeReason::PathDeviation { mm } => {
                write!(f, "the path to it deviates from the intended one by {mm:.3} mm")
            }
            OutcomeReason::CornerDeviation { mm } => {
                write!(
                    f,
                    "the rounded corner before it deviates from the intended one by {mm:.3} mm: round it less (zone, path tolerance)"
                )
            }
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
                "on line {line} the tool turns by about half a turn: after the correction the controller might turn it the other way; put \
                 a target between"
            ),
            OutcomeReason::StartOfUnchangedArc { line } => write!(
                f,
                "the circular motion of line {line} remains unmodified and starts here: from a corrected start it would be a \
                 different circle"
            ),
            OutcomeReason::StartOfUnchangedCut { line } => write!(
                f,
                "the cut of line {line} remains unmodified and starts here: from a corrected start its first line would become a wedge"
            ),
            OutcomeReason::StartOfSingularPath { line } => write!(
                f,
                "the motion of line {line} remains unmodified and starts here: from a corrected start it would pass too close to \
                 a singularity"
            ),
            OutcomeReason::StartOfLimitedPath { line, what } => write!(
                f,
                "the motion of line {line} remains unmodified and starts here: from a corrected start {what} would exceed its \
                 limits on the way"
            ),
            OutcomeReason::JointNotMeasured { joint, by_deg } => write!(
                f,
                "joint {} is {by_deg:.1}° outside the range in which the arm was measured",
                joint + 1
            ),
            OutcomeReason::PartOfCut { line, because } => write!(
                f,
                "a cut is corrected as a whole or not at all, and line {line} remains unmodified: {because} (--partial corrects \
                 the rest)"
            ),
            OutcomeReason::Step { line, mm } => write!(
                f,
                "line {line} of the same cut remains unmodified: the step of {mm:.3} mm between the two exceeds --tolerance"
            ),
            OutcomeReason::Risk { chance } => write!(
                f,
                "the correction makes this cut worse with a probability of {:.0} %, more than --max-risk allows: the \
                 measurement does not determine the arm well enough here",
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
