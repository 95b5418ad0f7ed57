//! Reasons why a motion was left, refused or flagged: a closed list.

use std::fmt;

use crate::cell::AXES;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Limited;
use truegrind_programs::motion::Reason;

/// The enum, its sentences and its docs from one list. A row gives the variant and its sentence; one with fields also says
/// what they mean, and then its sentence with their figures.
macro_rules! outcome_reasons {
    ($(#[$meta:meta])* $name:ident { $(
        $(#[$more:meta])*
        $variant:ident $(($inner:ty))? $({ $($field:ident: $type:ty = $doc:literal),* })?
            => $kind:literal $(, $figures:literal $(, $label:ident = $value:expr)*)?;
    )* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum $name { $(
            #[doc = $kind]
            #[doc = ""]
            $(#[$more])*
            $variant $(($inner))? $({ $(#[doc = $doc] $field: $type),* })?,
        )* }

        impl $name {
            /// The sentence of the list without figures.
            fn listed(&self) -> &'static str {
                match self { $($name::$variant { .. } => $kind,)* }
            }

            /// The sentence of the list with the figures.
            #[allow(unused_variables, reason = "not every field is a figure of the sentence")]
            fn write_listed(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $($($name::$variant { $($field),* } => write!(f, $figures $(, $label = $value)*),)?)*
                    _ => f.write_str(self.kind()),
                }
            }
        }
    };
}

outcome_reasons! {
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
    OutcomeReason {
        Program(Reason) => "the program states too little, or something that must not be changed";
        MovingBase { axis: usize = "Index among the external axes, 0-based." }
            => "an external axis carries the robot's base, whose position is not modelled",
            "external axis {letter} carries the robot's base, whose position is not modelled",
            letter = AXES.get(*axis).copied().unwrap_or('?');
        /// See [`contradictions`](crate::frames::taught::contradictions).
        CellContradiction => "cell file and program disagree about its tool or work object";
        JointTarget => "joint target: states joints, not a pose (--joint-targets rewrites it too)";
        /// Known only after the rewrite.
        NoChange => "its numbers are already right to the last written decimal";
        Inverse(InverseError) => "no joint solution was found";
        OutsideLimits { what: Limited = "The joint or the sum of joints." }
            => "a joint would exceed its limits", "{what} would exceed its limits";
        /// On the original path to it nothing would.
        PathOutsideLimits { what: Limited = "The joint or the sum of joints." }
            => "a joint would exceed its limits on the corrected path to it",
            "{what} would exceed its limits on the corrected path to it";
        CorrectionTooLarge { mm: f64 = "The correction (mm)." }
            => "correction exceeds the bound (--max-correction)",
            "correction of {mm:.3} mm exceeds the bound (--max-correction)";
        RotationTooLarge { deg: f64 = "The correction (°)." }
            => "correction of the orientation exceeds the bound (by default 2°)",
            "correction of the orientation by {deg:.3}° exceeds the bound (by default 2°)";
        /// Small corrections cause large joint motions there.
        NearSingularity => "too close to a singularity";
        /// It turns the joint far more than the same correction would elsewhere in the workspace.
        JointJump {
            joint: u8 = "Joint, 0-based; a byte keeps all reasons short.",
            deg: f64 = "Joint change caused by the correction (°).",
            most_deg: f64 = "Largest joint change allowed for a correction of this size (°).",
            on_the_way: bool = "Whether this occurs on the segment rather than at the target."
        }
            => "the correction would turn a joint too far, because the arm is near a singularity: move the path away from the singularity",
            "{way}the correction would turn joint {number} by {deg:.1}° (limit {most_deg:.1}°), because the arm is near a singularity: \
             move the path away from the singularity",
            way = if *on_the_way { "on the path to this target " } else { "" }, number = joint + 1;
        SingularPath => "the corrected path to it passes too close to a singularity";
        OtherBranch => "the corrected target lies in another configuration";
        AmbiguousBranch
            => "no configuration is stated and another one is equally near, so the controller might select it: state the \
                configuration, or add a target closer to this one";
        UnknownStart
            => "its configuration is not monitored (ConfL \\Off, ConfJ \\Off): it depends on where the arm comes from, which the program \
                does not say. Corrected for the stated configuration, or for the one that continues from there: check it, or begin with \
                a joint target";
        UncheckedPath
            => "the path to it is not checked, since the text does not tell where it begins: check it, or begin it behind a motion that \
                the text states";
        /// By more than the tolerance.
        PathDeviation { mm: f64 = "Largest deviation (mm); not finite where the arm cannot follow the path." }
            => "the path to it deviates from the intended one", "the path to it deviates from the intended one by {mm:.3} mm";
        /// By more than the tolerance.
        CornerDeviation { mm: f64 = "Largest deviation (mm); not finite where the arm cannot follow the corner." }
            => "the rounded corner before it deviates from the intended one: round it less (zone, path tolerance)",
            "the rounded corner before it deviates from the intended one by {mm:.3} mm: round it less (zone, path tolerance)";
        AmbiguousCentre { mm: f64 = "Uncertainty of the centre (mm)." }
            => "an arc of about half a turn programmed by its radius: the written decimals leave its centre ambiguous; state the centre \
                instead (I, J, K; CC)",
            "an arc of about half a turn programmed by its radius: the written decimals leave its centre ambiguous by {mm:.3} mm; state \
             the centre instead (I, J, K; CC)";
        /// Straight segments were requested.
        CircleKept
            => "the circle was kept: its start is unknown or not corrected, the instruction cannot be split, or no straight segments \
                follow it";
        HalfTurn { line: u32 = "Line of the motion along which it turns." }
            => "the tool turns by about 180° along a line: after the correction the controller might turn it the other way round; insert \
                a target halfway",
            "on line {line} the tool turns by about 180°: after the correction the controller might turn it the other way round; insert \
             a target halfway";
        LineWithoutStart
            => "joint targets would not follow this line, since its start is unknown or not corrected: begin with a joint motion, add \
                --joint-targets, or drop --emit joints";
        LineAsJoints { mm: f64 = "How far they would leave it (mm)." }
            => "joint targets would not follow this line, and none can be inserted to keep them on it (\\T, \\Conc, a trigger, SingArea \
                \\Wrist, or too many needed): drop --emit joints",
            "joint targets would leave this line by {mm:.3} mm, and none can be inserted to keep them on it (\\T, \\Conc, a trigger, \
             SingArea \\Wrist, or too many needed): drop --emit joints";
        TooFast { joint: usize = "Joint, 0-based.", ratio: f64 = "Joint speed over its limit, above 1." }
            => "a joint exceeds its speed limit at the programmed speed",
            "at the programmed speed joint {number} exceeds its speed limit by a factor of {ratio:.2}", number = joint + 1;
        /// They are collinear, two of them coincide, or the circle through them deviates.
        NoCircle => "its three points make no circle that follows the intended path";
        ArcFromUncorrected { line: u32 = "Line of the motion that ends there, 1-based." }
            => "it starts at a place that is not corrected: from there the corrected circle would be another one",
            "it starts at the end of line {line}, which is not corrected: from there the corrected circle would be another one";
        StartOfUnchangedArc { line: u32 = "Line of that motion, 1-based." }
            => "a circular motion that is not corrected starts here: from a corrected start it would be a different circle",
            "the circular motion of line {line} is not corrected and starts here: from a corrected start it would be a different circle";
        StartOfUnchangedCut { line: u32 = "Line of its first motion, 1-based." }
            => "a cut that is not corrected starts here: correcting its start would tilt its first line",
            "the cut at line {line} is not corrected and starts here: correcting its start would tilt its first line";
        DepartureFromUnchangedCut { line: u32 = "Line of the last motion of the cut, 1-based." }
            => "it leaves the part at the end of a cut that is not corrected: corrected, it would draw the tool sideways",
            "it leaves the part where the cut at line {line} ends, which is not corrected: corrected, it would draw the tool sideways";
        StartOfSingularPath { line: u32 = "Line of that motion, 1-based." }
            => "a motion that is not corrected starts here: from a corrected start it would pass too close to a singularity",
            "the motion of line {line} is not corrected and starts here: from a corrected start it would pass too close to a singularity";
        StartOfLimitedPath { line: u32 = "Line of that motion, 1-based.", what: Limited = "What would exceed its limits." }
            => "a motion that is not corrected starts here: from a corrected start a joint would exceed its limits on the way",
            "the motion of line {line} is not corrected and starts here: from a corrected start {what} would exceed its limits on the way";
        /// Its coincident ends do not determine its plane.
        FullCircle => "a full circle: the path between its ends is not checked";
        JointNotMeasured { joint: usize = "Joint, 0-based.", by_deg: f64 = "Distance beyond that range (°)." }
            => "a joint is outside the range in which the arm was measured",
            "joint {number} is {by_deg:.1}° outside the range in which the arm was measured", number = joint + 1;
        PartOfCut {
            line: u32 = "Line of the first motion that remains unmodified for its own reason, 1-based.",
            because: &'static str = "That reason, without figures."
        }
            => "a cut is corrected as a whole or not at all, and another motion of it is not corrected",
            "a cut is corrected as a whole or not at all, and line {line} is not corrected: {because} (--partial corrects the rest)";
        AirMoveAlone
            => "an air move next to a cut that is not corrected: correcting the air move would shift the start of the cut, and the values \
                of the axes that the blocks of the cut omit";
        NoConsistentPlan
            => "no consistent plan was found: each motion that was not corrected kept others from being corrected; divide the program";
        Step { line: u32 = "Line of that motion, 1-based.", mm: f64 = "The step (mm)." }
            => "the step to an uncorrected motion of the same cut would exceed --tolerance",
            "the step of {mm:.3} mm to line {line} of the same cut, which is not corrected, would exceed --tolerance";
        Risk { chance: f64 = "That probability." }
            => "the correction would make this cut worse with a probability above --max-risk: the arm was not measured well enough here",
            "the correction would make this cut worse with a probability of {percent:.0} %, above --max-risk: the arm was not measured \
             well enough here",
            percent = 100.0 * chance;
        NotCovered { ratio: f64 = "Distance to the nearest measured pose over the usual distance between measured poses, above 1." }
            => "no measured pose is nearby",
            "no measured pose is nearby: {ratio:.1} times the distance between measured poses";
        Uncertain { sigma_mm: f64 = "Predicted σ (mm), much larger than at the measured poses." }
            => "the model is uncertain here",
            "the model is uncertain here: predicted standard deviation {sigma_mm:.3} mm";
    }
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
            OutcomeReason::PartOfCut { because, .. } => because,
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
            OutcomeReason::PathDeviation { mm } if !mm.is_finite() => "the arm cannot follow the path to it",
            OutcomeReason::CornerDeviation { mm } if !mm.is_finite() => {
                "the arm cannot follow the rounded corner before it: round it less (zone, path tolerance)"
            }
            OutcomeReason::JointJump { on_the_way: true, .. } => {
                "on the path to this target the correction would turn a joint too far, because the arm is near a singularity: move the path away \
                 from the singularity"
            }
            _ => self.listed(),
        }
    }

    /// What of the reason can be more or less, for the worst of several motions; `None` where nothing can or it is not finite.
    pub fn figure(&self) -> Option<Figure> {
        let (value, decimals, unit) = match *self {
            OutcomeReason::Inverse(InverseError::Unreachable { beyond_mm: mm })
            | OutcomeReason::CorrectionTooLarge { mm }
            | OutcomeReason::PathDeviation { mm }
            | OutcomeReason::LineAsJoints { mm }
            | OutcomeReason::CornerDeviation { mm }
            | OutcomeReason::AmbiguousCentre { mm }
            | OutcomeReason::Step { mm, .. } => (mm, 3, " mm"),
            OutcomeReason::RotationTooLarge { deg }
            | OutcomeReason::JointJump { deg, .. }
            | OutcomeReason::JointNotMeasured { by_deg: deg, .. } => (deg, 2, "°"),
            OutcomeReason::TooFast { ratio, .. } => (ratio, 2, " × its limit"),
            OutcomeReason::NotCovered { ratio } => (ratio, 1, " × the usual distance"),
            OutcomeReason::Risk { chance } => (100.0 * chance, 0, " %"),
            OutcomeReason::Uncertain { sigma_mm } => (sigma_mm, 3, " mm σ"),
            _ => return None,
        };
        value.is_finite().then_some(Figure { value, decimals, unit })
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
pub struct Figure {
    /// The number; figures of one kind of reason have one unit.
    pub value: f64,
    decimals: usize,
    unit: &'static str,
}

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.*}{}", self.decimals, self.value, self.unit)
    }
}

impl fmt::Display for OutcomeReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OutcomeReason::Inverse(error) => error.fmt(f),
            OutcomeReason::PathDeviation { mm }
            | OutcomeReason::CornerDeviation { mm }
            | OutcomeReason::LineAsJoints { mm }
                if !mm.is_finite() =>
            {
                f.write_str(self.kind())
            }
            _ => self.write_listed(f),
        }
    }
}
