//! Why something is not known from the text, or stays as it is: one line each, for people.

use std::fmt;

macro_rules! reasons {
    ($(#[$meta:meta])* $name:ident { $($(#[doc = $doc:literal])* $variant:ident => $text:literal,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum $name { $($(#[doc = $doc])* $variant,)* }

        impl $name {
            /// Every reason there is.
            pub const ALL: &[$name] = &[$($name::$variant),*];

            /// One short line for a report.
            pub fn text(self) -> &'static str {
                match self { $($name::$variant => $text,)* }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.text())
            }
        }

        impl std::error::Error for $name {}
    };
}

reasons! {
    /// Why a value is not known from the text, or a motion is left as it is.
    Reason {
        /// The target is a parameter of the routine.
        Parameter => "a parameter of the routine: its value comes from the caller",
        /// The name is declared in none of the files.
        Undeclared => "declared in none of the given files",
        /// The name is declared in several modules at once.
        Ambiguous => "declared globally in several modules",
        /// The declaration has no initial value.
        Uninitialised => "declared without a value: the controller holds it",
        /// The program assigns it while it runs.
        Assigned => "assigned while the program runs",
        /// It is given to a routine that is declared in none of the files, or called by a computed name.
        HandedOver => "given to a routine that is not known from the given files and may change it",
        /// A function whose result is known only when the program runs (CRobT, CalcRobT, a function of the program).
        RunTimeFunction => "result of a function that is known only at run time",
        /// Offs, RelTool or arithmetic with a value that is known only at run time.
        RunTimeOffset => "offset by a value that is known only at run time",
        /// An array index that is known only at run time.
        RunTimeIndex => "array element chosen at run time",
        /// An array index outside the array.
        IndexOutOfRange => "array index outside the declared array",
        /// The value has not the shape that its use needs.
        WrongShape => "value has not the shape that the instruction needs",
        /// A quaternion that is far from norm 1.
        BadQuaternion => "quaternion is not of length 1 (off by more than 0.1)",
        /// A number that no arm can hold.
        BeyondReach => "a number beyond what any arm can hold (1,000,000 mm or degrees, 1,000,000 kg)",
        /// A robot axis says 9E9.
        UndefinedJoint => "a robot axis of the joint target is undefined (9E9)",
        /// A placeholder stands for the argument.
        Placeholder => "a placeholder stands where the value should be",
        /// An argument that the instruction needs is missing.
        MissingArgument => "an argument that the instruction needs is missing",
        /// A program displacement or external offset is or may be active.
        Displacement => "a program displacement or external offset is or may be active",
        /// The robot moves in step with another.
        Synchronised => "moves in step with another robot (\\ID, SyncMoveOn)",
        /// Sensors correct the path.
        SensorGuided => "a sensor corrects the path (\\Corr, CorrCon, EGM, soft servo), or may do so",
        /// An axis is in independent mode or locked: its place does not follow from the target.
        AxisApart => "an axis stands, or may stand, where no target says (independent mode, SingArea \\LockAxis4)",
        /// The work object is moved by an external axis or a conveyor.
        MovingWorkObject => "the work object is moved by an external axis",
        /// The tool's value is not known.
        ToolUnknown => "the value of the tool is not known",
        /// The work object's value is not known.
        WorkObjectUnknown => "where the work object or work offset lies is not known",
        /// The program assigns the tool.
        ToolAssigned => "the tool is or may be assigned while the program runs",
        /// The program assigns the work object.
        WorkObjectAssigned => "the work object is or may be assigned while the program runs",
        /// The tool is given to a routine that is not known.
        ToolHandedOver => "the tool is given to a routine that is not known from the given files and may change it",
        /// The work object is given to a routine that is not known.
        WorkObjectHandedOver => "the work object is given to a routine that is not known from the given files and may change it",
        /// The tool is a parameter of the routine.
        ToolParameter => "the tool is a parameter of the routine: its value comes from the caller",
        /// The work object is a parameter of the routine.
        WorkObjectParameter => "the work object is a parameter of the routine: its value comes from the caller",
        /// Tool and work object are both held by the robot, or neither is.
        HeldByBoth => "exactly one of tool and work object must be held by the robot",
        /// Only external axes move.
        ExternalOnly => "moves external axes only",
        /// An instruction that moves the robot along a recorded or built-in path.
        NoTarget => "moves the robot or an axis without a target in the text",
        /// A routine of the program that takes targets.
        OwnRoutine => "a routine of the program takes the target: its motions are inside",
        /// An instruction that is not in the table and takes a target.
        UnknownInstruction => "an instruction that is not known takes the target",
        /// A routine called by a name that is computed at run time.
        LateBinding => "called by a name that is computed at run time",
        /// The motion may not be split, so no target can be put before it.
        NoInsertion => "no target can be put before this instruction",
        /// The instruction cannot be turned into one with joint targets.
        NoJointForm => "the instruction has no form with joint targets",
        /// The new value is of a kind that the instruction does not take.
        WrongKind => "the new value is not of the kind that the instruction takes",
        /// The expression of the target does more than answer.
        SideEffect => "the target's expression calls a function that does more than answer: it must stay as it is written",
        /// A number that no controller can hold.
        NumberRange => "a number here is beyond what the controller can hold",
        /// What comes after counts from where it ends.
        BeforeDisplacement => "a displacement (PDispOn) is counted from where this ends",
        /// NC: an origin is set where it ends.
        BeforeOrigin => "a block that stays counts from an origin that is set where this ends (G92, G10 L20, PRESETON)",
        /// NC: increments are counted from where it ends.
        BeforeIncrement => "a block that stays counts from where this ends (an increment, a position that is read)",
        /// NC: an axis has no value yet.
        PositionUnknown => "an axis has no value: none is stated since the start, a reference return, or a change of frame or tool",
        /// NC: nothing has said how the tool is turned.
        OrientationUnknown => "the orientation is not stated: no A, B, C and no tool vector before it",
        /// NC: what A, B and C mean is not known.
        Convention => "what A, B and C mean is not known: the robot file does not name a convention",
        /// NC: a variable without a known value.
        Variable => "a variable whose value is known only at run time",
        /// NC: a number without a point, which may count increments.
        AmbiguousNumber => "a number without decimal point: mm or increments, by a parameter of the control",
        /// NC: axis words, and no motion before.
        NoMotionCode => "no motion code (G0, G1 and so on) is stated before it, or after G80: what it does is set in the control",
        /// NC: the place can be reached by a jump.
        UnknownFlow => "reached by a jump, call or loop: what holds here is known only at run time",
        /// NC: the block has a slash.
        Skippable => "the block may be skipped (/)",
        /// NC: without tool centre point control X, Y and Z are not the tip.
        NoTipControl => "without tool centre point control (G43.4, TRAORI, M128) X Y Z are not the tip",
        /// NC: coordinates are turned, scaled, mirrored, polar or in a tilted plane.
        Transformed => "coordinates are turned, scaled, mirrored, polar or in a tilted plane",
        /// NC: the control offsets the path by the tool's radius.
        RadiusCompensation => "the control offsets the path by the tool radius (G41, G42)",
        /// NC: LN with a surface normal and no tool vector.
        AlongNormal => "the control turns the tool to the surface normal of the block (LN without a tool vector under M128)",
        /// NC: in machine coordinates.
        MachineCoordinates => "in machine coordinates (G53, SUPA, M91)",
        /// NC: a cycle of the control.
        Cycle => "a cycle of the control: its motions are not in the text",
        /// NC: a path that is not made of lines and arcs.
        NotFollowed => "a spline, thread, contour or other path that is neither line nor arc",
        /// NC: a call.
        Subprogram => "calls a subprogram: its motions are in it",
        /// NC: a return to a stored point.
        ReferenceReturn => "goes to a reference point that the control holds",
        /// NC: moves until a signal comes.
        Probe => "moves until a signal comes: where it ends is known only at run time",
        /// NC: the centre of the arc stands in another block.
        CentreElsewhere => "the centre of the arc stands in another block (CC)",
        /// NC: part of the block could not be read.
        Unread => "part of the block could not be read",
        /// NC: a word that is not in the tables, in the block or before it.
        UnknownWord => "a word that is not known stands here or before: what it does and sets is not known",
        /// NC: a control takes lines of so many bytes.
        LineTooLong => "its line, or one after it that says again what has changed, would become longer than the control takes (512 characters on an 840D, 253 on LinuxCNC)",
        /// NC: the arc after it stays as it is, and starts here.
        BeforeLeftArc => "an arc that stays as it is starts where this ends",
        /// NC: a path that is neither line nor arc stays as it is, and starts here.
        BeforeLeftPath => "a path that stays as it is starts where this ends, or goes on in its direction",
    }
}

reasons! {
    /// Why a region could not be read.
    OpaqueReason {
        /// A token that no rule allows here.
        Unexpected => "not expected here",
        /// An expression was expected.
        ExpectedExpression => "expected a value",
        /// A name was expected.
        ExpectedName => "expected a name",
        /// The `;` is missing.
        MissingSemicolon => "missing `;`",
        /// A bracket is not closed.
        Unclosed => "bracket not closed",
        /// A string is not closed on its line.
        UnclosedString => "string not closed on its line",
        /// An END that closes nothing, or the wrong thing.
        StrayEnd => "closes nothing that is open",
        /// A block is not closed.
        MissingEnd => "not closed before the end",
        /// Nested more deeply than any program is.
        TooDeep => "nested too deeply",
        /// Bytes that are no text.
        Binary => "not text: an encoded or binary file",
    }
}
