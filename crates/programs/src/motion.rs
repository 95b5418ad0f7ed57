//! What a program tells the robot to do, whatever language it is written in.
//!
//! A dialect (RAPID in [`crate::rapid`]) reads bytes and hands back one [`Listing`]: every motion
//! instruction with its targets, speed, zone, tool and work object, where each number stands, and for everything
//! that cannot be known from the text alone the [`Reason`]. Nothing is ever guessed.
//!
//! Units are those of the file's edge: mm, degrees for joint targets, quaternions scalar first and exactly as
//! written (not normalised; [`RobTarget::pose`] and [`Frame::pose`] normalise).

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use truegrind_math::se3::Pose;

/// A range of bytes of one file, end excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Span {
    /// First byte.
    pub start: u32,
    /// One past the last byte.
    pub end: u32,
}

impl Span {
    /// The span as a range that indexes the bytes of its file.
    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A place in one of the files that were read together; lines and columns count from 1, columns in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Place {
    /// Index of the file in the order in which the files were given.
    pub file: u32,
    /// Line, from 1.
    pub line: u32,
    /// Column in bytes, from 1.
    pub column: u32,
}

/// A coordinate of a frame or target beyond this (mm) is no place that an arm has to do with, nor is a joint angle beyond
/// it (°).
pub const FARTHEST_MM: f64 = 1e6;

/// A frame as a program writes it: position and scalar-first quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Position (mm).
    pub position_mm: [f64; 3],
    /// Quaternion w, x, y, z as written.
    pub quaternion: [f64; 4],
}

impl Frame {
    /// The frame that changes nothing.
    pub const IDENTITY: Frame = Frame { position_mm: [0.0; 3], quaternion: [1.0, 0.0, 0.0, 0.0] };

    /// The rigid motion, with the quaternion normalised.
    pub fn pose(&self) -> Pose {
        let [w, x, y, z] = self.quaternion;
        let [px, py, pz] = self.position_mm;
        Pose::from_parts(
            Translation3::new(px, py, pz),
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
        )
    }

    /// Itself, where an arm can have to do with it.
    ///
    /// # Errors
    /// [`Reason::BeyondReach`] for a coordinate beyond [`FARTHEST_MM`], or one that is no number.
    pub fn within_reach(self) -> Result<Frame, Reason> {
        let near = self.position_mm.iter().all(|coordinate| coordinate.abs() <= FARTHEST_MM);
        let turned = self.quaternion.iter().all(|part| part.is_finite());
        if near && turned { Ok(self) } else { Err(Reason::BeyondReach) }
    }

    /// The frame of a rigid motion.
    ///
    /// ```
    /// use truegrind_programs::motion::Frame;
    ///
    /// let frame = Frame { position_mm: [420.0, -10.5, 250.0], quaternion: [0.6, 0.0, 0.8, 0.0] };
    /// let back = Frame::from_pose(&frame.pose());
    /// assert_eq!(back.position_mm, frame.position_mm);
    /// assert!(back.quaternion.iter().zip(frame.quaternion).all(|(found, told)| (found - told).abs() < 1e-12));
    /// ```
    pub fn from_pose(pose: &Pose) -> Frame {
        let (t, q) = (pose.translation.vector, pose.rotation.quaternion());
        Frame { position_mm: [t.x, t.y, t.z], quaternion: [q.w, q.i, q.j, q.k] }
    }
}

/// A Cartesian target: where the tool frame shall be in the work object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobTarget {
    /// Position of the TCP in the object frame (mm).
    pub position_mm: [f64; 3],
    /// Orientation, w, x, y, z, as written.
    pub quaternion: [f64; 4],
    /// Configuration cf1, cf4, cf6, cfx.
    pub conf: [i32; 4],
    /// External axes [mm or degrees]; `None` where the program says "not connected" (9E9).
    pub external: [Option<f64>; 6],
}

impl RobTarget {
    /// Position and orientation.
    pub fn frame(&self) -> Frame {
        Frame { position_mm: self.position_mm, quaternion: self.quaternion }
    }

    /// The rigid motion from object frame to tool frame, with the quaternion normalised.
    pub fn pose(&self) -> Pose {
        self.frame().pose()
    }
}

/// A target in joint angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTarget {
    /// Robot axes (degrees).
    pub robot_deg: [f64; 6],
    /// External axes [mm or degrees]; `None` where not connected.
    pub external: [Option<f64>; 6],
}

/// The value of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TargetValue {
    /// A pose.
    Cartesian(RobTarget),
    /// Joint angles.
    Joint(JointTarget),
}

impl TargetValue {
    /// The Cartesian target, where it is one.
    pub fn cartesian(&self) -> Option<&RobTarget> {
        match self {
            TargetValue::Cartesian(target) => Some(target),
            TargetValue::Joint(_) => None,
        }
    }

    /// The external axes (mm or degrees).
    pub fn external(&self) -> &[Option<f64>; 6] {
        match self {
            TargetValue::Cartesian(target) => &target.external,
            TargetValue::Joint(target) => &target.external,
        }
    }

    /// The joint target, where it is one.
    pub fn joint(&self) -> Option<&JointTarget> {
        match self {
            TargetValue::Joint(target) => Some(target),
            TargetValue::Cartesian(_) => None,
        }
    }
}

/// How the robot goes to the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MotionKind {
    /// TCP on a straight line (MoveL, G1).
    Linear,
    /// Joints in proportion to a Cartesian target (MoveJ).
    Joint,
    /// TCP on a circle (MoveC, G2, G3).
    Circular,
    /// Joints in proportion to a joint target (MoveAbsJ).
    AbsoluteJoint,
    /// Only external axes move (MoveExtJ).
    External,
    /// A routine or instruction that takes targets but whose path is not known.
    Unknown,
}

/// What a target is to its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Role {
    /// The end of the motion.
    To,
    /// The point on the arc between start and end of a circular motion.
    Via,
}

/// Where the numbers of a target stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// A literal in the instruction itself.
    Inline,
    /// A declaration of its own, index into [`Listing::declarations`].
    Declared(u32),
    /// One element of a declared array: the declaration, and where the element's literal stands in it.
    Element {
        /// Index into [`Listing::declarations`].
        declaration: u32,
        /// The bytes of the element in the declaration's file.
        literal: Span,
    },
    /// The text computes it (Offs, RelTool, assignments, arithmetic): a new value replaces the whole argument by a
    /// literal.
    Computed,
    /// Not known from the text.
    Unknown,
}

/// One target of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTarget {
    /// What it is to the motion.
    pub role: Role,
    /// Its value, or why that is not known.
    pub value: Result<TargetValue, Reason>,
    /// Where its numbers stand.
    pub origin: Origin,
    /// The bytes of the argument in the instruction.
    pub argument: Span,
}

/// A named target: one declaration that any number of motions use.
#[derive(Debug, Clone, PartialEq)]
pub struct Declaration {
    /// The name as declared.
    pub name: String,
    /// Where the name stands in the declaration.
    pub place: Place,
    /// The bytes of the whole declaration, `;` included.
    pub statement: Span,
    /// The bytes of the initial value.
    pub literal: Option<Span>,
    /// Whether it is an array.
    pub array: bool,
    /// Each use by a motion: (motion, target of that motion).
    pub uses: Vec<(u32, u32)>,
    /// Uses by anything but a motion's own target argument (base of `Offs`, read in an expression, argument of a
    /// routine): an edit of the declaration would reach them too.
    pub other_uses: Vec<OtherUse>,
}

/// A use of a declared target other than as a motion's own target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OtherUse {
    /// The motion whose target is computed from it, where it is one.
    pub motion: Option<(u32, u32)>,
    /// Where.
    pub place: Place,
}

/// A tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Tool {
    /// The name as the program writes it.
    pub name: String,
    /// Its value, or why it is not known.
    pub value: Result<ToolValue, Reason>,
    /// Where it is declared; `None` for a built-in tool and for one that is declared nowhere.
    pub place: Option<Place>,
}

/// What a tool is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolValue {
    /// Whether the robot holds it; otherwise it stands and `frame` is in the world.
    pub robhold: bool,
    /// The TCP in the flange (wrist) frame, or in the world for a standing tool.
    pub frame: Frame,
    /// Mass (kg).
    pub mass_kg: f64,
    /// Centre of gravity (mm) in the flange frame.
    pub centre_of_gravity_mm: [f64; 3],
}

/// A work object.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObject {
    /// The name as the program writes it (`wobj0` where the motion names none).
    pub name: String,
    /// Its value, or why it is not known.
    pub value: Result<WorkObjectValue, Reason>,
    /// Where it is declared; `None` for `wobj0` and for one that is declared nowhere.
    pub place: Option<Place>,
    /// A displacement within it that the program sets (PDispSet, TRANS, ROT) and the text tells; the object frame of
    /// `value` has it in it already.
    pub displacement: Option<Frame>,
}

/// What a work object is. Targets stand in `user_frame * object_frame`.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkObjectValue {
    /// Whether the robot holds it; then the user frame is in the flange frame.
    pub robhold: bool,
    /// Whether the user frame is fixed (TRUE) or moved by `mechanical_unit` (FALSE).
    pub fixed: bool,
    /// The unit that moves the user frame; empty where none does.
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
    /// Its value, or why it is not known.
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
    /// Its value, or why it is not known.
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

/// What is known of a switch that acts in execution order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Switch {
    /// Certainly off.
    Off,
    /// Certainly on.
    On,
    /// On or off depending on what ran before.
    Either,
}

/// The modal state in which a motion runs.
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
    /// Whether circular motions take the orientation of the circle point (CirPathMode).
    pub circle_point_orientation: Switch,
    /// Whether other robots move in step (SyncMoveOn).
    pub synchronised: Switch,
    /// Whether sensors or forces move the path (soft servo).
    pub sensor_guided: Switch,
    /// Whether an axis stands where no target says (independent mode, SingArea \LockAxis4).
    pub axis_apart: Switch,
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
        axis_apart: Switch::Off,
    };
}

/// One motion instruction.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Where the instruction begins.
    pub place: Place,
    /// The bytes of the instruction, `;` included.
    pub statement: Span,
    /// Its name: in the manual's spelling where known, else as written.
    pub instruction: Arc<str>,
    /// How the robot goes.
    pub kind: MotionKind,
    /// The targets in the order of the arguments (the circle point before the end).
    pub targets: Vec<MotionTarget>,
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
    /// Whether the language lets targets be put in before it.
    pub insertable: bool,
    /// Whether the language lets a circular motion be replaced by straight ones.
    pub straightens: bool,
    /// Whether the language lets a target state the configuration of the arm.
    pub configures: bool,
    /// Whether the control goes as fast as it can (G0, FMAX): on a line or joint by joint, as it is set up.
    pub rapid: bool,
    /// The axis about which a circular motion turns, positively, in the axes of its targets; `None` where its three
    /// points alone say it (RAPID).
    pub axis: Option<[f64; 3]>,
    /// Whether a circular motion states its radius and no centre: that leaves the centre open near half a turn.
    pub by_radius: bool,
    /// The modal state in which it runs.
    pub modal: Modal,
    /// Whether it stands in a loop.
    pub in_loop: bool,
    /// Whether it may be skipped (in IF, TEST or an error handler).
    pub conditional: bool,
    /// The motion that ended where this one starts, where that is the same on every way to it.
    pub previous: Option<u32>,
    /// Index into [`Listing::routines`]; `None` outside routines.
    pub routine: Option<u32>,
    /// Why the motion as a whole must be left as it is, targets apart; the first that holds.
    pub left: Option<Reason>,
}

impl Motion {
    /// The end of the motion.
    pub fn to(&self) -> Option<&MotionTarget> {
        self.targets.iter().rev().find(|target| target.role == Role::To)
    }

    /// Why this motion cannot be rewritten, or `None` where it can: first the motion's own reason, then those of its
    /// targets.
    pub fn reason(&self) -> Option<Reason> {
        self.left.or_else(|| self.targets.iter().find_map(|target| target.value.err()))
    }
}

/// A routine of the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Routine {
    /// Its name.
    pub name: String,
    /// The module it stands in, empty for a fragment.
    pub module: String,
    /// Where its name stands.
    pub place: Place,
}

/// A region that could not be read; it is never edited.
///
/// ```
/// use truegrind_programs::rapid::Task;
///
/// // What cannot be read is listed with its line, and the motions around it are read all the same.
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
    /// Where it begins.
    pub place: Place,
    /// Its bytes.
    pub span: Span,
    /// Why.
    pub reason: OpaqueReason,
}

/// Everything that a program, given as one or several files of one task, does with the robot.
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
/// // What only the caller knows is never guessed.
/// assert_eq!((first.reason(), second.reason()), (None, Some(Reason::Parameter)));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Listing {
    /// The motions, in the order of files and lines.
    pub motions: Vec<Motion>,
    /// Named targets that motions use.
    pub declarations: Vec<Declaration>,
    /// Tools that motions use.
    pub tools: Vec<Tool>,
    /// Tools that are declared in the files, or stated beside them, whether motions use them or not: a work object may
    /// have been taught with one that this program never moves.
    pub declared_tools: Vec<Tool>,
    /// How comments of an NC program call its numbered tools and work offsets: number (`T1`, `G54`), name.
    pub labels: Vec<(String, String)>,
    /// Work objects that motions use.
    pub work_objects: Vec<WorkObject>,
    /// Speeds that motions use.
    pub speeds: Vec<Speed>,
    /// How long motions take (s), where the program says so (`\T`), by motion.
    pub durations_s: BTreeMap<u32, Result<f64, Reason>>,
    /// Zones that motions use.
    pub zones: Vec<Zone>,
    /// Routines that hold motions.
    pub routines: Vec<Routine>,
    /// Whether it is of NC programs, which know tools by number and work offsets.
    pub numbered: bool,
    /// Motions that call a program which does not stand in their file (NC).
    pub outside: Vec<u32>,
    /// What could not be read.
    pub opaque: Vec<OpaqueRegion>,
    /// The marks of earlier compensations, per file.
    pub marks: Vec<Option<Mark>>,
    /// Comments that state something for the correction (`truegrind angles …`) and cannot be used: nothing may be corrected
    /// before they are put right.
    pub misstated: Vec<Misstated>,
}

/// A comment that states something for the correction, and does not.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Misstated {
    /// Name of its file.
    pub file: String,
    /// Its line, from 1.
    pub line: u32,
    /// The comment as it stands there.
    pub text: String,
    /// What was expected.
    pub expected: String,
}

impl fmt::Display for Misstated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: line {}: {}: expected {}", self.file, self.line, self.text, self.expected)
    }
}

impl Listing {
    /// How comments of an NC program call a tool or work offset.
    pub fn labels_of(&self, number: &str) -> impl Iterator<Item = &str> {
        let here = self.labels.iter().filter(move |(other, _)| super::label::same(other, number));
        here.map(|(_, label)| label.as_str())
    }

    /// The tool of a motion.
    pub fn tool(&self, motion: &Motion) -> Option<&Tool> {
        motion.tool.and_then(|index| self.tools.get(index as usize))
    }

    /// The work object of a motion.
    pub fn work_object(&self, motion: &Motion) -> Option<&WorkObject> {
        motion.work_object.and_then(|index| self.work_objects.get(index as usize))
    }

    /// Why tool and work object of a motion do not tell where its targets are.
    pub fn left_by_frames(&self, motion: &Motion) -> Option<Reason> {
        let tool = match self.tool(motion).map(|tool| &tool.value) {
            Some(Ok(tool)) => tool,
            Some(Err(Reason::Assigned)) => return Some(Reason::ToolAssigned),
            Some(Err(reason @ (Reason::BeyondReach | Reason::NumberRange))) => return Some(*reason),
            Some(Err(Reason::HandedOver)) => return Some(Reason::ToolHandedOver),
            Some(Err(Reason::Parameter)) => return Some(Reason::ToolParameter),
            Some(Err(_)) => return Some(Reason::ToolUnknown),
            None => return Some(Reason::MissingArgument),
        };
        match self.work_object(motion).map(|work_object| &work_object.value) {
            Some(Ok(work_object)) if !work_object.fixed => Some(Reason::MovingWorkObject),
            Some(Ok(work_object)) if work_object.robhold == tool.robhold => Some(Reason::HeldByBoth),
            Some(Ok(_)) => None,
            Some(Err(Reason::Assigned)) => Some(Reason::WorkObjectAssigned),
            Some(Err(reason @ (Reason::BeyondReach | Reason::NumberRange))) => Some(*reason),
            Some(Err(Reason::HandedOver)) => Some(Reason::WorkObjectHandedOver),
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

/// What a program that was made for the nominal arm says of itself in a comment; the line goes when the program is corrected.
pub const UNCORRECTED: &str = "Written for the nominal arm: run truegrind compensate before grinding.";

/// Whether a comment is that one, in whichever signs a language puts comments.
pub(crate) fn says_uncorrected(comment: &[u8]) -> bool {
    let said = comment.trim_ascii_start();
    let said =
        said.strip_prefix(b"!").or_else(|| said.strip_prefix(b";")).or_else(|| said.strip_prefix(b"("));
    let said = said.unwrap_or(comment).trim_ascii();
    let said = said.strip_suffix(b")").unwrap_or(said).trim_ascii_end();
    said.eq_ignore_ascii_case(UNCORRECTED.as_bytes())
}

/// The comment line that says that a file was compensated, by which version, with which model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The version of truegrind that wrote the file.
    pub version: String,
    /// The hash of the model.
    pub model: String,
    /// Whether cuts may be corrected in part.
    pub partial: bool,
}

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
