//! The motion instructions of RAPID and the meaning of their arguments.
//!
//! Source: RAPID instructions reference (RobotWare 6) and, for process packages, their application manuals; argument
//! orders of arc, force control, paint, spot and dispense instructions are confirmed by public programs.

use super::token::{fold, same_name};
use crate::motion::MotionKind;

/// Meaning of a required argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// The end point.
    To,
    /// The circle point.
    Via,
    /// A point that the instruction writes.
    Output,
    /// Speed.
    Speed,
    /// Zone.
    Zone,
    /// Tool.
    Tool,
    /// Anything else.
    Other,
}

/// The instruction for motions inserted before a motion without interrupting its process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InsertedForm {
    /// A plain MoveL or MoveJ.
    Plain,
    /// The same instruction with another target.
    Same,
    /// Another instruction of the same process, with the same arguments.
    Other(&'static str),
    /// Nothing.
    Nothing,
}

/// Effect of a motion instruction besides moving.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SideEffect {
    /// Nothing.
    Nothing,
    /// Writes the values of its options whose names begin with Ret.
    Returns,
    /// Calls the procedure that its last required argument names, between any two statements that follow.
    Calls,
    /// May end before its target, on contact.
    Stops,
    /// Ends the soft servo.
    Stiffens,
    /// Triggers events at distances from its start or end: an inserted motion would shift them.
    Triggers,
}

/// A motion instruction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instruction {
    /// Its name in the manual's spelling.
    pub name: &'static str,
    /// Kind of path.
    pub kind: MotionKind,
    /// Required arguments: `T` end, `C` circle point, `J` joint target, `O` output, `S` speed, `Z` zone, `t` tool,
    /// `.` another, `*` any number of others.
    pattern: &'static str,
    /// The instruction for inserted motions.
    pub inserted: InsertedForm,
    /// The equivalent instruction with a joint target.
    pub joint_form: Option<&'static str>,
    /// Whether a sensor moves the path.
    pub sensor_guided: bool,
    /// Its effect besides moving.
    pub side_effect: SideEffect,
}

impl Instruction {
    /// Whether the end is a joint target.
    pub fn takes_joints(&self) -> bool {
        self.pattern.as_bytes().contains(&b'J')
    }

    /// Meaning of the required argument at `index` of `count`; `None` where the count does not match.
    pub fn slot(&self, index: usize, count: usize) -> Option<Slot> {
        let pattern = self.pattern.as_bytes();
        let letter = match pattern.iter().position(|letter| *letter == b'*') {
            None => *pattern.get(index)?,
            Some(star) => {
                let tail = pattern.len() - star - 1;
                if count < star + tail {
                    *pattern.get(index).filter(|_| index < star)?
                } else if index < star {
                    pattern[index]
                } else if index + tail >= count {
                    pattern[pattern.len() - (count - index)]
                } else {
                    b'.'
                }
            }
        };
        Some(match letter {
            b'T' | b'J' => Slot::To,
            b'C' => Slot::Via,
            b'O' => Slot::Output,
            b'S' => Slot::Speed,
            b'Z' => Slot::Zone,
            b't' => Slot::Tool,
            _ => Slot::Other,
        })
    }

    /// The linear instruction of a circular one: the last C of its name becomes L, the circle point is dropped, the other
    /// arguments are kept.
    pub fn line_form(&self) -> Option<&'static Instruction> {
        let rest = self.pattern.strip_prefix('C')?;
        let at = self.name.rfind('C')?;
        let line = |name: &str| {
            name.len() == self.name.len()
                && name[..at] == self.name[..at]
                && name[at..].starts_with('L')
                && name[at + 1..] == self.name[at + 1..]
        };
        INSTRUCTIONS.iter().find(|other| other.pattern == rest && line(other.name))
    }

    /// Whether it ends where a signal comes.
    pub fn searches(&self) -> bool {
        self.pattern.as_bytes().contains(&b'O')
    }

    /// Whether it may end before its target: on a signal or on contact.
    pub fn ends_early(&self) -> bool {
        self.side_effect == SideEffect::Stops || self.searches()
    }

    /// Whether it only moves, as nearly every statement of a long program does.
    pub fn only_moves(&self) -> bool {
        matches!(self.side_effect, SideEffect::Nothing | SideEffect::Triggers) && !self.searches()
    }

    /// Whether motions can be inserted before it. A trigger at a distance along the movement would fire on its last piece.
    pub fn splits(&self) -> bool {
        self.inserted != InsertedForm::Nothing && self.side_effect != SideEffect::Triggers
    }

    /// Least number of required arguments.
    pub fn least(&self) -> usize {
        self.pattern.bytes().filter(|&letter| letter != b'*').count()
    }
}

const fn plain(name: &'static str, kind: MotionKind, pattern: &'static str) -> Instruction {
    let (inserted, joint_form, side_effect) = (InsertedForm::Plain, None, SideEffect::Nothing);
    Instruction { name, kind, pattern, inserted, joint_form, sensor_guided: false, side_effect }
}

const fn same(name: &'static str, kind: MotionKind, pattern: &'static str) -> Instruction {
    Instruction { inserted: InsertedForm::Same, ..plain(name, kind, pattern) }
}

const fn rigid(name: &'static str, kind: MotionKind, pattern: &'static str) -> Instruction {
    Instruction { inserted: InsertedForm::Nothing, ..plain(name, kind, pattern) }
}

const fn within(
    name: &'static str,
    inserted: &'static str,
    kind: MotionKind,
    pattern: &'static str,
) -> Instruction {
    Instruction { inserted: InsertedForm::Other(inserted), ..plain(name, kind, pattern) }
}

const fn with_joints(instruction: Instruction, joint_form: &'static str) -> Instruction {
    Instruction { joint_form: Some(joint_form), ..instruction }
}

const fn guided(instruction: Instruction) -> Instruction {
    Instruction { sensor_guided: true, inserted: InsertedForm::Nothing, ..instruction }
}

const fn besides(instruction: Instruction, side_effect: SideEffect) -> Instruction {
    Instruction { side_effect, ..instruction }
}

use MotionKind::{AbsoluteJoint, Circular, External, Joint, Linear};

/// The instructions, the most frequent first.
pub const INSTRUCTIONS: &[Instruction] = &[
    with_joints(plain("MoveL", Linear, "TSZt"), "MoveAbsJ"),
    with_joints(plain("MoveJ", Joint, "TSZt"), "MoveAbsJ"),
    plain("MoveAbsJ", AbsoluteJoint, "JSZt"),
    rigid("MoveC", Circular, "CTSZt"),
    rigid("MoveExtJ", External, "JSZ"),
    plain("MoveLDO", Linear, "TSZt.."),
    plain("MoveJDO", Joint, "TSZt.."),
    rigid("MoveCDO", Circular, "CTSZt.."),
    plain("MoveAbsJDO", AbsoluteJoint, "JSZt.."),
    plain("MoveLAO", Linear, "TSZt.."),
    plain("MoveJAO", Joint, "TSZt.."),
    rigid("MoveCAO", Circular, "CTSZt.."),
    plain("MoveAbsJAO", AbsoluteJoint, "JSZt.."),
    plain("MoveLGO", Linear, "TSZt."),
    plain("MoveJGO", Joint, "TSZt."),
    rigid("MoveCGO", Circular, "CTSZt."),
    plain("MoveAbsJGO", AbsoluteJoint, "JSZt."),
    besides(plain("MoveLSync", Linear, "TSZt."), SideEffect::Calls),
    besides(plain("MoveJSync", Joint, "TSZt."), SideEffect::Calls),
    besides(rigid("MoveCSync", Circular, "CTSZt."), SideEffect::Calls),
    besides(plain("TriggL", Linear, "TS.Zt"), SideEffect::Triggers),
    besides(plain("TriggJ", Joint, "TS.Zt"), SideEffect::Triggers),
    rigid("TriggC", Circular, "CTS.Zt"),
    besides(plain("TriggAbsJ", AbsoluteJoint, "JS.Zt"), SideEffect::Triggers),
    besides(plain("TriggLIOs", Linear, "TSZt"), SideEffect::Triggers),
    besides(plain("TriggJIOs", Joint, "TSZt"), SideEffect::Triggers),
    rigid("SearchL", Linear, ".OTSt"),
    rigid("SearchC", Circular, ".OCTSt"),
    rigid("SearchExtJ", External, ".OJS"),
    plain("ArcLStart", Linear, "TS*Zt"),
    same("ArcL", Linear, "TS*Zt"),
    within("ArcLEnd", "ArcL", Linear, "TS*Zt"),
    rigid("ArcCStart", Circular, "CTS*Zt"),
    rigid("ArcC", Circular, "CTS*Zt"),
    rigid("ArcCEnd", Circular, "CTS*Zt"),
    plain("ArcL1Start", Linear, "TS*Zt"),
    same("ArcL1", Linear, "TS*Zt"),
    within("ArcL1End", "ArcL1", Linear, "TS*Zt"),
    rigid("ArcC1Start", Circular, "CTS*Zt"),
    rigid("ArcC1", Circular, "CTS*Zt"),
    rigid("ArcC1End", Circular, "CTS*Zt"),
    plain("ArcL2Start", Linear, "TS*Zt"),
    same("ArcL2", Linear, "TS*Zt"),
    within("ArcL2End", "ArcL2", Linear, "TS*Zt"),
    rigid("ArcC2Start", Circular, "CTS*Zt"),
    rigid("ArcC2", Circular, "CTS*Zt"),
    rigid("ArcC2End", Circular, "CTS*Zt"),
    guided(rigid("ArcAdaptLStart", Linear, "TS*Zt")),
    guided(rigid("ArcAdaptL", Linear, "TS*Zt")),
    guided(rigid("ArcAdaptLEnd", Linear, "TS*Zt")),
    guided(rigid("ArcAdaptC", Circular, "CTS*Zt")),
    guided(rigid("ArcAdaptCEnd", Circular, "CTS*Zt")),
    guided(rigid("ArcCalcLStart", Linear, "TS*Zt")),
    guided(rigid("ArcCalcL", Linear, "TS*Zt")),
    guided(rigid("ArcCalcLEnd", Linear, "TS*Zt")),
    guided(rigid("ArcCalcC", Circular, "CTS*Zt")),
    guided(rigid("ArcCalcCEnd", Circular, "CTS*Zt")),
    rigid("ArcMoveExtJ", External, "JSZ"),
    plain("ArcMoveL", Linear, "TSZt"),
    plain("ArcMoveJ", Joint, "TSZt"),
    rigid("ArcMoveC", Circular, "CTSZt"),
    plain("ArcMoveAbsJ", AbsoluteJoint, "JSZt"),
    rigid("FCPress1LStart", Linear, "TS*Zt"),
    same("FCPressL", Linear, "TS.Zt"),
    rigid("FCPressC", Circular, "CTS.Zt"),
    rigid("FCPressEnd", Linear, "TSt"),
    same("PaintL", Linear, "TS*Zt"),
    rigid("PaintC", Circular, "CTS*Zt"),
    plain("SpotL", Linear, "TS*t"),
    plain("SpotJ", Joint, "TS*t"),
    plain("SpotML", Linear, "TS*t"),
    plain("SpotMJ", Joint, "TS*t"),
    plain("NutL", Linear, "TS*t"),
    plain("NutJ", Joint, "TS*t"),
    same("DispL", Linear, "TS.Zt"),
    rigid("DispC", Circular, "CTS.Zt"),
    plain("LaserLStart", Linear, "TS*Zt"),
    same("LaserL", Linear, "TS*Zt"),
    within("LaserLEnd", "LaserL", Linear, "TS*Zt"),
    rigid("LaserCStart", Circular, "CTS*Zt"),
    rigid("LaserC", Circular, "CTS*Zt"),
    rigid("LaserCEnd", Circular, "CTS*Zt"),
    besides(same("CapL", Linear, "TS*Zt"), SideEffect::Triggers),
    rigid("CapC", Circular, "CTS*Zt"),
    besides(rigid("ContactL", Linear, "TSt"), SideEffect::Stops),
    besides(rigid("CSSDeactMoveL", Linear, "TSt"), SideEffect::Stiffens),
    besides(rigid("SCSSDeactMoveL", Linear, "TSt"), SideEffect::Stiffens),
    with_joints(plain("SMoveL", Linear, "TSZt"), "MoveAbsJ"),
    with_joints(plain("SMoveJ", Joint, "TSZt"), "MoveAbsJ"),
    plain("SMoveLDO", Linear, "TSZt.."),
    plain("SMoveJDO", Joint, "TSZt.."),
    plain("SMoveLGO", Linear, "TSZt."),
    plain("SMoveJGO", Joint, "TSZt."),
    besides(plain("SMoveLSync", Linear, "TSZt."), SideEffect::Calls),
    besides(plain("SMoveJSync", Joint, "TSZt."), SideEffect::Calls),
    besides(plain("STriggL", Linear, "TS.Zt"), SideEffect::Triggers),
    besides(plain("STriggJ", Joint, "TS.Zt"), SideEffect::Triggers),
    rigid("SSearchL", Linear, ".OTSt"),
    besides(rigid("CalibL", Linear, "TS*t"), SideEffect::Returns),
    besides(rigid("CalibJ", Joint, "TS*t"), SideEffect::Returns),
    besides(rigid("MeasureWearL", Linear, "TS*t"), SideEffect::Returns),
    guided(rigid("EGMMoveL", Linear, ".TSZt")),
    guided(rigid("EGMMoveC", Circular, ".CTSZt")),
];

/// The instruction of this name in any case, by its index in [`INSTRUCTIONS`].
pub fn find(name: &[u8]) -> Option<usize> {
    // Every name begins with one of these letters, which rejects nearly all others.
    if !matches!(
        name.first().map(|&byte| fold(byte)),
        Some(b'm' | b't' | b's' | b'a' | b'f' | b'p' | b'n' | b'd' | b'l' | b'c' | b'e')
    ) {
        return None;
    }
    INSTRUCTIONS.iter().position(|instruction| instruction.name.as_bytes().eq_ignore_ascii_case(name))
}

/// The slot of a named argument.
pub fn named_slot(name: &[u8]) -> Option<Slot> {
    const NAMES: [(&[u8], Slot); 6] = [
        (b"ToPoint", Slot::To),
        (b"ToJointPos", Slot::To),
        (b"CirPoint", Slot::Via),
        (b"Speed", Slot::Speed),
        (b"Zone", Slot::Zone),
        (b"Tool", Slot::Tool),
    ];
    NAMES.iter().find(|(known, _)| same_name(name, known)).map(|&(_, slot)| slot)
}
