//! The motions of a program, independent of its language.
//!
//! A dialect (such as [`crate::rapid`]) reads bytes and returns one [`Listing`]: every motion instruction with its
//! targets, speed, zone, tool and work object, the location of each number, and a [`Reason`] for every value that the
//! text does not determine. Nothing is guessed.
//!
//! Units are those of the file: mm, degrees for joint targets, quaternions scalar first and exactly as written (not
//! normalised; [`RobTarget::pose`] and [`Frame::pose`] normalise).

mod axis_turn;
pub mod load;
mod reason;
mod target;

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

pub use axis_turn::AxisTurn;
pub use reason::{OpaqueReason, Reason};
use smallvec::SmallVec;

use crate::nc::orientation::WordsAtPole;
pub use target::{Frame, JointTarget, MAX_POSITION_MM, RobTarget, TargetValue};

/// A range of bytes of one file, end excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span as an index range into the bytes of its file.
    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A location in one of the files; lines and columns count from 1, columns in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Place {
    /// Index of the file in the order in which the files were given.
    pub file: u32,
    /// Line, from 1.
    pub line: u32,
    /// Column in bytes, from 1.
    pub column: u32,
}

/// The path to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MotionKind {
    /// TCP on a straight line (MoveL, G1).
    Linear,
    /// Joint interpolation to a Cartesian target (MoveJ).
    Joint,
    /// TCP on a circle (MoveC, G2, G3).
    Circular,
    /// Joint interpolation to a joint target (MoveAbsJ).
    AbsoluteJoint,
    /// Only external axes move (MoveExtJ).
    External,
    /// A routine or instruction with targets whose path is unknown.
    Unknown,
}

/// The role of a target in its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// The end of the motion.
    To,
    /// The circle point between start and end of a circular motion.
    Via,
}

/// Where the numbers of a target are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// A literal in the instruction.
    Inline,
    /// A declaration, index into [`Listing::declarations`].
    Declared(u32),
    /// An element of a declared array.
    Element {
        /// Index into [`Listing::declarations`].
        declaration: u32,
        /// The bytes of the element's literal in the declaration's file.
        literal: Span,
    },
    /// Computed (Offs, RelTool, assignments, arithmetic): a new value replaces the whole argument by a literal.
    Computed,
    /// `Offs` or `RelTool` by persistent data, index into [`Listing::offsets`]: a new value replaces the first argument alone, so that
    /// the data still act.
    Offset(u32),
    /// Unknown.
    Unknown,
}

/// One target of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTarget {
    /// Its role in the motion.
    pub role: Role,
    /// Its value, or why it is unknown.
    pub value: Result<TargetValue, Reason>,
    /// Where its numbers are written.
    pub origin: Origin,
    /// The bytes of the argument in the instruction.
    pub argument: Span,
}

/// A named target: one declaration, used by any number of motions.
#[derive(Debug, Clone, PartialEq)]
pub struct Declaration {
    /// The name as declared.
    pub name: String,
    /// The location of the name in the declaration.
    pub place: Place,
    /// The bytes of the whole declaration, `;` included.
    pub statement: Span,
    /// The bytes of the initial value.
    pub literal: Option<Span>,
    /// Whether it is an array.
    pub array: bool,
    /// Whether it stays on the controller when the program ends (PERS), where an operator or another task may change it.
    pub persistent: bool,
    /// Each use by a motion: (motion, target of that motion).
    pub uses: Vec<(u32, u32)>,
    /// Uses other than as a motion's own target argument (base of `Offs`, operand of an expression, argument of a
    /// routine), which an edit of the declaration would also affect.
    pub other_uses: Vec<OtherUse>,
}

/// A use of a declared target other than as a motion's own target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherUse {
    /// The motion whose target is computed from it, if any.
    pub motion: Option<(u32, u32)>,
    /// Its location.
    pub place: Place,
}

/// A tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// The name as the program writes it.
    pub name: String,
    /// Its value, or why it is unknown.
    pub value: Result<ToolValue, Reason>,
    /// Its declaration; `None` if it is built in or undeclared.
    pub place: Option<Place>,
    /// Whether the program assigns it (RAPID): it may be a copy of another one.
    pub assigned: bool,
}

/// The value of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolValue {
    /// Whether the robot holds it; otherwise it is stationary and `frame` is in the world.
    pub robhold: bool,
    /// The TCP in the flange (wrist) frame, or in the world for a stationary tool.
    pub frame: Frame,
    /// Mass (kg).
    pub mass_kg: f64,
    /// Centre of gravity (mm) in the flange frame.
    pub centre_of_gravity_mm: [f64; 3],
}

/// A work object.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObject {
    /// The name as the program writes it (`wobj0` if the motion names none).
    pub name: String,
    /// Its value, or why it is unknown.
    pub value: Result<WorkObjectValue, Reason>,
    /// Its declaration; `None` for `wobj0` or if it is undeclared.
    pub place: Option<Place>,
    /// Whether the program assigns it (RAPID): it may be a copy of another one.
    pub assigned: bool,
    /// A known displacement within it that the program sets (PDispSet, TRANS, ROT). The object frame of `value`
    /// already includes it.
    pub displacement: Option<Frame>,
}

/// The value of a work object. Targets are relative to `user_frame * object_frame`.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObjectValue {
    /// Whether the robot holds it; then the user frame is in the flange frame.
    pub robhold: bool,
    /// Whether the user frame is fixed (TRUE) or moved by `mechanical_unit` (FALSE).
    pub fixed: bool,
    /// The unit that moves the user frame; empty if none does.
    pub mechanical_unit: String,
    /// The user frame in the world (or flange).
    pub user_frame: Frame,
    /// The object frame in the user frame.
    pub object_frame: Frame,
}

/// A speed argument.
#[derive(Debug, Clone, PartialEq)]
pub struct Speed {
    /// The argument as the program writes it.
    pub text: String,
    /// Its value, or why it is unknown.
    pub value: Result<SpeedValue, Reason>,
}

/// Speeds of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedValue {
    /// Of the TCP [mm/s].
    pub tcp_mm_s: f64,
    /// Of reorientation [°/s].
    pub orientation_deg_s: f64,
    /// Of linear external axes [mm/s].
    pub linear_external_mm_s: f64,
    /// Of rotating external axes [°/s].
    pub rotating_external_deg_s: f64,
}

/// A zone argument.
#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    /// The argument as the program writes it.
    pub text: String,
    /// Its value, or why it is unknown.
    pub value: Result<ZoneValue, Reason>,
}

/// The corner zone of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZoneValue {
    /// Whether the robot stops at the target.
    pub fine: bool,
    /// Size for the TCP (mm).
    pub tcp_mm: f64,
    /// Size for reorientation (mm).
    pub orientation_mm: f64,
    /// Reorientation size (degrees).
    pub orientation_deg: f64,
}

/// The abstract state of a switch that takes effect in execution order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Switch {
    /// Certainly off.
    Off,
    /// Certainly on.
    On,
    /// On or off, depending on the path of control flow.
    Either,
}

/// The modal state of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Modal {
    /// Whether the configuration of linear and circular motions is monitored (ConfL).
    pub conf_linear: Switch,
    /// Whether the configuration of joint motions is monitored (ConfJ).
    pub conf_joint: Switch,
    /// Whether a program displacement or external offset is active (PDispOn, PDispSet, EOffsOn, EOffsSet).
    pub displacement: Switch,
    /// Whether the wrist may deviate near singularities (SingArea \Wrist or \LockAxis4).
    pub wrist_interpolation: Switch,
    /// Whether circular motions follow the orientation of the circle point (CirPathMode).
    pub circle_point_orientation: Switch,
    /// Whether other robots move synchronously (SyncMoveOn).
    pub synchronised: Switch,
    /// Whether sensors or forces move the path (soft servo).
    pub sensor_guided: Switch,
    /// Whether the position of an axis is independent of the targets (independent mode, SingArea \LockAxis4).
    pub independent_axis: Switch,
}

impl Modal {
    /// The state after a start from main.
    pub const START: Modal = Modal {
        conf_linear: Switch::On,
        conf_joint: Switch::On,
        displacement: Switch::Off,
        wrist_interpolation: Switch::Off,
        circle_point_orientation: Switch::Off,
        synchronised: Switch::Off,
        sensor_guided: Switch::Off,
        independent_axis: Switch::Off,
    };
}

/// One motion instruction. More than twenty fields: whatever a motion of any language states.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// The location of the instruction.
    pub place: Place,
    /// The bytes of the instruction, `;` included.
    pub statement: Span,
    /// Its name: in the manual's spelling if known, else as written.
    pub instruction: Arc<str>,
    /// The kind of path.
    pub kind: MotionKind,
    /// The targets in the order of the arguments (the circle point before the end).
    pub targets: SmallVec<[MotionTarget; 1]>,
    /// Index into [`Listing::speeds`].
    pub speed: Option<u32>,
    /// Index into [`Listing::zones`].
    pub zone: Option<u32>,
    /// Index into [`Listing::tools`].
    pub tool: Option<u32>,
    /// Index into [`Listing::work_objects`].
    pub work_object: Option<u32>,
    /// Whether the speed is overridden by a time for the whole motion (`\T`), which forbids extra targets.
    pub timed: bool,
    /// Whether the language allows targets to be inserted before it.
    pub insertable: bool,
    /// Whether the language allows a circular motion to be replaced by straight ones.
    pub can_straighten: bool,
    /// Whether the language allows a target to state the configuration of the arm.
    pub accepts_configuration: bool,
    /// Rapid motion (G0, FMAX): linear or joint by joint, depending on the control.
    pub rapid: bool,
    /// The axis of positive rotation of a circular motion, in the axes of its targets; `None` if only its three
    /// points determine it (RAPID).
    pub axis: Option<Box<[f64; 3]>>,
    /// Whether a circular motion is programmed by its radius, so that the centre is ill-conditioned near half a turn.
    pub by_radius: bool,
    /// How the tool turns where the control may run A, B and C each on its own and that is another way than one rotation
    /// about one axis; elsewhere `None`.
    pub axis_turn: Option<Box<AxisTurn>>,
    /// The modal state.
    pub modal: Modal,
    /// Whether it is in a loop.
    pub in_loop: bool,
    /// Whether it may be skipped (in IF, TEST or an error handler).
    pub conditional: bool,
    /// The motion that ends where this one starts, if every path of control flow has the same one.
    pub previous: Option<u32>,
    /// Index into [`Listing::routines`]; `None` outside routines.
    pub routine: Option<u32>,
    /// Why the motion as a whole must stay unmodified, apart from its targets; the first reason that applies.
    pub own_reason: Option<Reason>,
}

impl Motion {
    /// A motion of which only this is known; `routine` and what stands in the statement follow.
    pub(crate) fn new(
        place: Place,
        statement: Span,
        instruction: Arc<str>,
        kind: MotionKind,
        modal: Modal,
    ) -> Self {
        Motion {
            place,
            statement,
            instruction,
            kind,
            targets: SmallVec::new(),
            speed: None,
            zone: None,
            tool: None,
            work_object: None,
            timed: false,
            insertable: false,
            can_straighten: false,
            accepts_configuration: false,
            rapid: false,
            axis: None,
            by_radius: false,
            axis_turn: None,
            modal,
            in_loop: false,
            conditional: false,
            previous: None,
            routine: None,
            own_reason: None,
        }
    }

    /// Whether both motions have the same tool and the same work object, as most neighbours do.
    pub fn same_frames(&self, other: &Motion) -> bool {
        (self.tool, self.work_object) == (other.tool, other.work_object)
    }

    /// The end of the motion.
    pub fn to(&self) -> Option<&MotionTarget> {
        self.targets.iter().rev().find(|target| target.role == Role::To)
    }

    /// The circle point of a circular motion.
    pub fn via(&self) -> Option<&MotionTarget> {
        self.targets.iter().find(|target| target.role == Role::Via)
    }

    /// The Cartesian target at the end of the motion, if it is known.
    pub fn cartesian_end(&self) -> Option<RobTarget> {
        self.to()?.value.ok()?.cartesian().copied()
    }

    /// Whether it is a search of RAPID (SearchL, SearchC, SSearchL), which ends, and stops, at its signal.
    pub fn is_search(&self) -> bool {
        self.instruction.contains("Search")
    }

    /// Why this motion cannot be rewritten: first the motion's own reason, then those of its targets. `None` if it
    /// can.
    pub fn reason(&self) -> Option<Reason> {
        self.own_reason.or_else(|| self.targets.iter().find_map(|target| target.value.err()))
    }
}

/// A routine of the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Routine {
    /// Its name.
    pub name: String,
    /// Its module, empty for a fragment.
    pub module: String,
    /// The location of its name.
    pub place: Place,
}

/// A region that could not be parsed; it is never edited.
///
/// ```
/// use truegrind_programs::rapid::Task;
///
/// // An unreadable region is listed with its line, and the motions around it are read.
/// let source = b"MODULE M
///   PROC main()
///     MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;
///     x := ;
///     MoveL [[530,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,fine,tool0;
///   ENDPROC
/// ENDMODULE
/// ";
/// let listing = Task::read(&[("m.mod", &source[..])]).listing;
/// assert_eq!(listing.motions.iter().map(|motion| motion.place.line).collect::<Vec<_>>(), [3, 5]);
/// assert_eq!(listing.opaque.iter().map(|region| region.place.line).collect::<Vec<_>>(), [4]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OpaqueRegion {
    /// Its location.
    pub place: Place,
    /// Its bytes.
    pub span: Span,
    /// Why.
    pub reason: OpaqueReason,
}

/// The motions of a program of one or several files.
///
/// ```
/// use truegrind_programs::motion::Reason;
/// use truegrind_programs::rapid::Task;
///
/// let source = b"MODULE M
///   CONST robtarget p10 := [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
///   PROC grind(robtarget given)
///     MoveL p10, v50, z1, tool0;
///     MoveL given, v50, fine, tool0;
///   ENDPROC
/// ENDMODULE
/// ";
/// let listing = Task::read(&[("m.mod", &source[..])]).listing;
/// let [first, second] = &listing.motions[..] else { panic!("two motions") };
/// let speed = listing.speed(first).ok_or("none")?;
/// assert_eq!((speed.text.as_str(), speed.value.map(|value| value.tcp_mm_s)), ("v50", Ok(50.0)));
/// assert_eq!(listing.zone(first).ok_or("none")?.value.map(|zone| (zone.fine, zone.tcp_mm)), Ok((false, 1.0)));
/// // A value that only the caller knows is never guessed.
/// assert_eq!((first.reason(), second.reason()), (None, Some(Reason::Parameter)));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Listing {
    /// The names of the files, as given.
    pub files: Vec<String>,
    /// The motions, in the order of files and lines.
    pub motions: Vec<Motion>,
    /// Named targets that motions use.
    pub declarations: Vec<Declaration>,
    /// Offsets of targets by persistent data.
    pub offsets: Vec<PersistentOffset>,
    /// Tools that motions use.
    pub tools: Vec<Tool>,
    /// Tools that are declared in the files or stated beside them, used or not: a work object may have been taught
    /// with a tool that this program never uses.
    pub declared_tools: Vec<Tool>,
    /// Work objects that motions use.
    pub work_objects: Vec<WorkObject>,
    /// Speeds that motions use.
    pub speeds: Vec<Speed>,
    /// Programmed durations of motions (s, `\T`), by motion.
    pub durations_s: BTreeMap<u32, Result<f64, Reason>>,
    /// Zones that motions use.
    pub zones: Vec<Zone>,
    /// Routines that hold motions.
    pub routines: Vec<Routine>,
    /// Whether it is of NC programs, with numbered tools and work offsets.
    pub numbered: bool,
    /// What NC programs alone have.
    pub nc: NcFacts,
    /// Calls of routines that no file declares (RAPID).
    pub outside_calls: Vec<OutsideCall>,
    /// Motions that may follow each other across a call of a routine or its return, and in NC files across a jump: the earlier and the
    /// later one, sorted.
    pub across_calls: Vec<[u32; 2]>,
    /// All motions from which one without [`Motion::previous`] may begin, where these are known: behind branches, in loops, and
    /// across calls.
    pub predecessors: BTreeMap<u32, Vec<u32>>,
    /// Where the program decides by the position that the robot reads (CRobT) and may stand at the end of a motion that is corrected all the
    /// same (RAPID).
    pub position_decisions: Vec<Place>,
    /// The procedures `main` of the files, where there are several: a controller loads one task with one (RAPID).
    pub mains: Vec<Place>,
    /// Regions that could not be parsed.
    pub opaque: Vec<OpaqueRegion>,
    /// The marks of earlier compensations, per file.
    pub marks: Vec<Option<Mark>>,
    /// Unusable comments that state something for the correction (`truegrind angles …`); nothing may be corrected
    /// before they are fixed.
    pub invalid_statements: Vec<InvalidStatement>,
}

/// What a listing of NC programs has beside its motions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NcFacts {
    /// Names in comments of an NC program for its numbered tools and work offsets: number (`T1`, `G54`), name.
    pub labels: Vec<(String, String)>,
    /// The joints in which the arm starts (°), if a comment of an NC program states them.
    pub start_deg: Option<[f64; 6]>,
    /// The first motion of each NC file that could be corrected and whose control neither its words nor a comment show: it is read as plain
    /// ISO 6983.
    pub open_controls: Vec<Place>,
    /// The first motion with a tool of some length in each LinuxCNC file, if nothing takes the length over (G43): T and M6 alone do not.
    pub unstated_lengths: Vec<Place>,
    /// The first readable motion under a tool vector in each file that states no turn about it (THETA).
    pub unstated_turns: Vec<Place>,
    /// Letters of the axes that NC blocks name beside X, Y, Z, A, B and C, and the first of each.
    pub other_axes: BTreeMap<char, Place>,
    /// Motions that call a program outside their file (NC).
    pub external_calls: Vec<u32>,
    /// Motions behind a label, a jump, a call or a loop that are left because words are missing there, with these words.
    pub unstated: BTreeMap<u32, String>,
    /// Work offsets and tools that the program sets to another value than the cell file or a comment states, by where it does.
    pub replaced_frames: BTreeMap<Place, ReplacedFrame>,
    /// Words of orientation at the ends of motions where they are near a pole of their convention.
    pub at_poles: BTreeMap<u32, WordsAtPole>,
}

/// A work offset or tool that a program sets to another value than is stated beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplacedFrame {
    /// Its name (`G54`, `T1`).
    pub name: String,
    /// What the program sets.
    pub set: Frame,
    /// What the cell file or a comment states.
    pub stated: Frame,
}

/// An offset of a target by persistent data, which stay on the controller when the program ends: an operator or another task may change
/// them.
#[derive(Debug, Clone, PartialEq)]
pub struct PersistentOffset {
    /// The bytes of the argument that is offset.
    pub base: Span,
    /// The offset with the values that the files state.
    pub offset: Offset,
}

/// An offset of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Offset {
    /// Along the axes of the work object (mm).
    OfObject([f64; 3]),
    /// In the frame of the tool.
    OfTool(truegrind_math::se3::Pose),
}

impl Offset {
    /// The target from which the offset leads to position (mm) and orientation.
    pub fn base_of(&self, position_mm: [f64; 3], quaternion: [f64; 4]) -> ([f64; 3], [f64; 4]) {
        match self {
            Self::OfObject(shift) => {
                (std::array::from_fn(|axis| position_mm[axis] - shift[axis]), quaternion)
            }
            Self::OfTool(moved) => {
                let there = Frame { position_mm, quaternion }.pose();
                let base = there * moved.inverse();
                let q = base.rotation;
                (base.translation.vector.into(), [q.w, q.i, q.j, q.k])
            }
        }
    }
}

/// A call of a routine that no file declares and that takes no target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutsideCall {
    /// The routine as the program writes it.
    pub name: String,
    /// The call.
    pub place: Place,
}

/// A comment that states something for the correction and cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidStatement {
    /// Name of its file.
    pub file: String,
    /// Its line, from 1.
    pub line: u32,
    /// The comment as written.
    pub text: String,
    /// What was expected.
    pub expected: String,
}

impl fmt::Display for InvalidStatement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: line {}: {}: expected {}", self.file, self.line, self.text, self.expected)
    }
}

impl Listing {
    /// The names in comments for a tool or work offset.
    pub fn labels_of(&self, number: &str) -> impl Iterator<Item = &str> {
        let here = self.nc.labels.iter().filter(move |(other, _)| super::label::same(other, number));
        here.map(|(_, label)| label.as_str())
    }

    /// Whether a target follows persistent data, so that only a change of its own numbers or of the first argument of its offset lets it
    /// do so still.
    pub fn follows_persistent(&self, target: &MotionTarget) -> bool {
        match target.origin {
            Origin::Offset(_) => true,
            Origin::Declared(declaration) | Origin::Element { declaration, .. } => {
                self.declarations[declaration as usize].persistent
            }
            Origin::Inline | Origin::Computed | Origin::Unknown => false,
        }
    }

    /// Whether a target of a motion is itself declared as persistent.
    pub fn has_persistent_target(&self, motion: &Motion) -> bool {
        let is_declared = |target: &MotionTarget| !matches!(target.origin, Origin::Offset(_));
        motion.targets.iter().any(|target| is_declared(target) && self.follows_persistent(target))
    }

    /// The tool of a motion.
    pub fn tool(&self, motion: &Motion) -> Option<&Tool> {
        motion.tool.and_then(|index| self.tools.get(index as usize))
    }

    /// The work object of a motion.
    pub fn work_object(&self, motion: &Motion) -> Option<&WorkObject> {
        motion.work_object.and_then(|index| self.work_objects.get(index as usize))
    }

    /// Whether two motions have the same tool and work object, as far as is known before the program runs: a parameter or a value that is
    /// assigned may be any, and a block whose modal state is unknown has none.
    pub fn may_share_frames(&self, a: &Motion, b: &Motion) -> bool {
        let may_be_any = |reason: Option<Reason>| match reason {
            Some(
                Reason::Assigned
                | Reason::AfterProbing
                | Reason::Escaped
                | Reason::Parameter
                | Reason::UnknownFlow,
            ) => true,
            // Frames of NC programs have numbers, and are stated elsewhere.
            Some(_) => !self.numbered,
            None => false,
        };
        let unread = |motion: &Motion| motion.own_reason == Some(Reason::UnknownFlow);
        let unknown_tool = |motion: &Motion| match self.tool(motion) {
            Some(tool) => may_be_any(tool.value.as_ref().err().copied()),
            None => unread(motion),
        };
        let unknown_object = |motion: &Motion| match self.work_object(motion) {
            Some(work_object) => may_be_any(work_object.value.as_ref().err().copied()),
            None => unread(motion),
        };
        (a.tool == b.tool || unknown_tool(a) || unknown_tool(b))
            && (a.work_object == b.work_object || unknown_object(a) || unknown_object(b))
    }

    /// Why the tool and work object of a motion do not determine where its targets are.
    pub fn frame_reason(&self, motion: &Motion) -> Option<Reason> {
        let tool = match self.tool(motion).map(|tool| &tool.value) {
            Some(Ok(tool)) => tool,
            Some(Err(Reason::Assigned)) => return Some(Reason::ToolAssigned),
            Some(Err(
                reason @ (Reason::BeyondReach
                | Reason::NumberRange
                | Reason::AfterProbing
                | Reason::LengthAllowance),
            )) => {
                return Some(*reason);
            }
            Some(Err(Reason::Escaped)) => return Some(Reason::ToolEscaped),
            Some(Err(Reason::Parameter)) => return Some(Reason::ToolParameter),
            Some(Err(_)) => return Some(Reason::ToolUnknown),
            None => return Some(Reason::MissingArgument),
        };
        match self.work_object(motion).map(|work_object| &work_object.value) {
            Some(Ok(work_object)) if !work_object.fixed => Some(Reason::MovingWorkObject),
            Some(Ok(work_object)) if work_object.robhold == tool.robhold => Some(Reason::HeldByBoth),
            Some(Ok(_)) => None,
            Some(Err(Reason::Assigned)) => Some(Reason::WorkObjectAssigned),
            Some(Err(reason @ (Reason::BeyondReach | Reason::NumberRange | Reason::AfterProbing))) => {
                Some(*reason)
            }
            Some(Err(Reason::Escaped)) => Some(Reason::WorkObjectEscaped),
            Some(Err(Reason::Parameter)) => Some(Reason::WorkObjectParameter),
            _ => Some(Reason::WorkObjectUnknown),
        }
    }

    /// The speed of a motion.
    pub fn speed(&self, motion: &Motion) -> Option<&Speed> {
        motion.speed.and_then(|index| self.speeds.get(index as usize))
    }

    /// The zone of a motion.
    pub fn zone(&self, motion: &Motion) -> Option<&Zone> {
        motion.zone.and_then(|index| self.zones.get(index as usize))
    }
}

/// The comment in a program that was made for the nominal arm; the correction removes it.
pub const UNCORRECTED: &str = "Written for the nominal arm: run truegrind compensate before grinding.";

/// Whether a comment is [`UNCORRECTED`], in the comment syntax of any language.
pub(crate) fn is_uncorrected_comment(comment: &[u8]) -> bool {
    let text = comment.trim_ascii_start();
    let text =
        text.strip_prefix(b"!").or_else(|| text.strip_prefix(b";")).or_else(|| text.strip_prefix(b"("));
    let text = text.unwrap_or(comment).trim_ascii();
    let text = text.strip_suffix(b")").unwrap_or(text).trim_ascii_end();
    text.eq_ignore_ascii_case(UNCORRECTED.as_bytes())
}

/// The mark of a compensated file: by which version, with which model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The version of truegrind that wrote the file.
    pub version: String,
    /// The hash of the model.
    pub model: String,
    /// Whether cuts may be corrected in part.
    pub partial: bool,
}

/// The index of an equal item among the last, else of the new one: thousands of different inline speeds must not cost
/// their square.
pub(crate) fn intern<T: PartialEq>(list: &mut Vec<T>, item: T) -> u32 {
    match list.iter().rev().take(256).position(|other| *other == item) {
        Some(back) => (list.len() - 1 - back) as u32,
        None => {
            list.push(item);
            list.len() as u32 - 1
        }
    }
}
