//! Reasons why a value is unknown, or a motion stays unmodified: one line each, for reports.

use std::fmt;

macro_rules! reasons {
    ($(#[$meta:meta])* $name:ident { $($variant:ident => $text:literal,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum $name { $(#[doc = $text] $variant,)* }

        impl $name {
            /// Every reason.
            pub const ALL: &[$name] = &[$($name::$variant),*];

            /// One line for a report.
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
    /// Why a value is unknown, or a motion is not corrected.
    Reason {
        Parameter => "a parameter of the routine: its value comes from the caller, and one text cannot hold a correction for each; write a routine for each target",
        Undeclared => "declared in none of the given files",
        Ambiguous => "declared globally in several modules",
        Uninitialised => "declared without a value: only the controller has it",
        Assigned => "assigned while the program runs",
        Escaped => "passed to a routine outside the given files, which may change it",
        RunTimeFunction => "result of a function known only at run time",
        CurrentPosition => "relative to the current position of the robot (CRobT): it follows the corrected path without a change",
        RunTimeOffset => "offset by a value known only at run time, and one text cannot hold a correction for each pass: write the passes one after another, with numbers",
        Persistent => "needs persistent data (PERS), of which the controller may hold another value than the file; declare data that never change as CONST",
        RunTimeIndex => "array element chosen at run time: write a motion for each element",
        IndexOutOfRange => "array index outside the declared array",
        WrongShape => "the value does not have the form that the instruction requires",
        BadQuaternion => "the quaternion is not normalised (the squares of its numbers add up to less than 0.9 or more than 1.1)",
        BeyondReach => "physically implausible number (above 1,000,000 mm, degrees or kg)",
        UndefinedJoint => "a robot axis of the joint target is undefined (9E9)",
        Placeholder => "a placeholder instead of a value",
        MissingArgument => "a required argument is missing",
        Displacement => "a program displacement or external axis offset is or may be active",
        Synchronised => "moves in step with another robot (\\ID, SyncMoveOn)",
        SensorGuided => "a sensor corrects, or may correct, the path (\\Corr, CorrCon, EGM, soft servo)",
        IndependentAxis => "an axis is, or may be, in independent mode or locked (SingArea \\LockAxis4): the target does not determine its position",
        MovingWorkObject => "the work object is moved by an external axis",
        ToolUnknown => "the tool frame is unknown",
        LengthAllowance => "the tool is called with a length allowance (TOOL CALL … DL), and is another tool than without: state its frame in the cell file, under the name with the allowance (such as \"T1 DL+0.5\")",
        WorkObjectUnknown => "the frame of the work object or work offset is unknown",
        ToolAssigned => "the tool is or may be assigned while the program runs",
        WorkObjectAssigned => "the work object is or may be assigned while the program runs",
        ToolEscaped => "the tool is passed to a routine outside the given files, which may change it",
        WorkObjectEscaped => "the work object is passed to a routine outside the given files, which may change it",
        ToolParameter => "the tool is a parameter of the routine: its value comes from the caller",
        WorkObjectParameter => "the work object is a parameter of the routine: its value comes from the caller",
        AfterProbing => "a probing or measuring cycle before it (TCH PROBE, CYCLE97x, G37) may have changed the work offset, its rotation or the tool; run that cycle in a program of its own and state what it sets",
        HeldByBoth => "exactly one of tool and work object must be held by the robot",
        ExternalOnly => "moves only external axes",
        NoTarget => "moves the robot or an axis without a target in the program",
        OwnRoutine => "a routine of the program takes the target; its motions are listed there",
        UnknownInstruction => "an unknown instruction takes the target",
        LateBinding => "called by a name computed at run time",
        NoInsertion => "no target can be inserted before this instruction",
        NoJointForm => "the instruction has no form with joint targets",
        WrongKind => "the instruction does not take this kind of target",
        SideEffect => "the target's expression calls a function with side effects and must not be replaced",
        NumberRange => "a number exceeds the range of the controller",
        BeforeDisplacement => "a displacement (PDispOn) is relative to the end of this motion, or the program decides by the position that it reads there (CRobT, CPos, CJointT)",
        BeforeOrigin => "an uncorrected block uses an origin set at the end of this motion (G92, G10 L20, PRESETON)",
        BeforeIncrement => "an uncorrected block is relative to the end of this motion (increment, or a position read by the program)",
        BeforeOmitted => "a later uncorrected block omits an axis, whose position is then that of the end of this motion",
        PositionUnknown => "the position of an axis is unknown: not programmed since the start, a reference return, or a change of frame or tool",
        OrientationUnknown => "the tool orientation is unknown: no A, B, C or tool vector with known values since the start, a call or a change of frame; state all three again",
        UnknownConvention => "the convention of A, B and C is unknown: neither the program nor the cell file states it",
        UnknownVariable => "a variable known only at run time: write its number, and the passes of a loop one after another",
        AmbiguousNumber => "a number without decimal point: mm or increments, depending on a parameter of the control",
        NoMotionCode => "no motion code (G0, G1, ...) before this block, or none since G80: the mode depends on the control",
        UnknownFlow => "reached by a jump, call or loop: the modal state here is known only at run time, until its words are stated again",
        Skippable => "the block may be skipped (block skip, /)",
        NoTcpMode => "no tool centre point control (G43.4, TRAORI, M128): X Y Z are not the tool tip",
        Transformed => "coordinates are rotated, scaled, mirrored, polar or in a tilted plane",
        RadiusCompensation => "tool radius compensation is active (G41, G42)",
        ReferencePoint => "FUNCTION TCPM with another reference point than TIP-TIP: X Y Z are not the tool tip; state REFPNT TIP-TIP, and points of the tip",
        TurnAlone => "turns the tool only: its feed is in °/min, and adding X, Y, Z would make it mm/min",
        AlignedToNormal => "the control aligns the tool with the surface normal (LN without a tool vector under M128)",
        MachineCoordinates => "in machine coordinates (G53, SUPA, M91)",
        Cycle => "a canned cycle: its motions are not in the program",
        TiltsTool => "turns the tool into a tilted plane (CYCLE800, PLANE TURN or MOVE, G53.1): where the axes then stand only the control knows; state X, Y, Z and the angles again behind it",
        UnsupportedPath => "a path that is neither a line nor an arc by end and centre or radius (spline, thread, contour, helix of several turns, opening angle, PTP)",
        RoundedCorner => "the control rounds or chamfers the corner at its end or start (RND, CHF, ,R, ,C), which it can do only in its working plane, and corrected lines leave that plane: program the corner as an arc or a line of its own",
        OpenCircle => "a full turn whose start and end are corrected by different amounts (backlash, a helix), so that no one arc leads from one to the other: program it as two arcs, or replace arcs by lines (--circles segments)",
        NoArc => "no arc leads to its end: the radius is shorter than half the way, or the centre is not as far from the end as from the start",
        Subprogram => "calls a subprogram, which contains the motions",
        ReferenceReturn => "moves to a reference point stored in the control",
        Probe => "moves until a signal (probing): its end is known only at run time",
        CentreElsewhere => "the centre of the arc is in another block (CC): program the arc with its radius (CR), and it can be corrected",
        Unreadable => "part of the block could not be read",
        UnknownWord => "an unknown word in this or an earlier block may have changed the modal state",
        LineTooLong => "its line, or a later one that restates changed words, would exceed the line length of the control (512 characters on an 840D, 253 on LinuxCNC)",
        BeforeUnmodifiedArc => "an uncorrected arc starts at the end of this motion",
        BeforeUnmodifiedPath => "an uncorrected path starts at the end of this motion, or continues in its direction",
    }
}

reasons! {
    /// Why a region could not be parsed.
    OpaqueReason {
        Unexpected => "not expected here",
        ExpectedExpression => "expected a value",
        ExpectedName => "expected a name",
        MissingSemicolon => "missing `;`",
        Unclosed => "bracket not closed",
        UnclosedString => "string not closed on its line",
        StrayEnd => "closes nothing",
        MissingEnd => "not closed before the end",
        TooDeep => "nested too deeply",
        Binary => "not text: encoded or binary file, or UTF-16 (save it as UTF-8 or Latin-1)",
    }
}
