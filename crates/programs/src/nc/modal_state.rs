//! The abstract modal state of a control: the value of every modal group, or the reason why the text does not determine it.
//!
//! [`ModalState::join`] merges the states of two control-flow paths.

use super::arc::Plane;
use super::dialect::Dialect;
use super::expression::{Evaluated, Variable};
use super::orientation::{Angles, spun};
use crate::motion::{Frame, Reason};
use crate::shared::Map;
use truegrind_math::se3::Pose;

/// The motion group (group 01).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum MotionMode {
    /// No motion code since the start of the program.
    Unset,
    /// Unknown, for this reason.
    Unknown(Reason),
    /// G0.
    Rapid,
    /// G1.
    Linear,
    /// G2 (false) and G3 (true).
    Circular(bool),
    /// A spline, thread, contour or cycle, whose path is not modelled.
    Unsupported(Reason),
}

/// Which words state the tool orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum OrientationMode {
    /// Not stated, or unknown.
    Unknown(Reason),
    /// A, B, C.
    Angles,
    /// A2, B2, C2 (Siemens, ORIRPY).
    Rpy,
    /// A tool vector.
    Vector,
}

/// Modal groups: a word of a group stays in effect until another word of the same group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum ModalGroup {
    /// G90, G91.
    DistanceMode,
    /// G20, G21.
    Unit,
    /// G17, G18, G19.
    Plane,
    /// G54 and following.
    WorkOffset,
    /// G40 to G42.
    RadiusCompensation,
    /// G43.4, TRAORI, M128.
    TcpMode,
    /// T, M6 and TOOL CALL.
    Tool,
    /// G43, G49, H; the cutting edge D of Siemens.
    ToolLength,
    /// G92, G52.
    CoordinateShift,
    // Coordinate transforms. Each is a group of its own, because each has its own cancel word.
    /// G15, G16.
    Polar,
    /// G50, G51; cycle 11.
    Scaling,
    /// G50.1, G51.1, G100, G101; cycle 8.
    Mirror,
    /// G68, G68.2, G69; cycle 10.
    Rotation,
    /// G12.1, G13.1: polar interpolation.
    PolarPath,
    /// G7.1, G107: cylindrical interpolation.
    Cylinder,
    /// G7, G8, DIAMON: diameter programming.
    Diameter,
    /// TRANSMIT, TRACYL, TRAANG.
    Kinematic,
    /// ORIMKS, ORIWKS.
    OrientationFrame,
    /// CYCLE800, PLANE, cycle 19, G268.
    TiltedPlane,
    /// TRANS, ROT, SCALE, MIRROR. The transform bit is set where they are not a known rigid motion.
    ProgrammableFrame,
    /// TOFRAME, TOROT.
    ToolFrame,
    /// PAROT.
    PartFrame,
    /// G54.2, G54.4, G254: offsets of the table.
    FixtureOffset,
    /// TRANS DATUM TABLE, cycle 7 with a row of the table.
    DatumShift,
    /// Cycle 26: one scale for each axis.
    AxisScaling,
    /// Offsets of A, B, C (G92 A0).
    RotaryOffset,
    // Groups that matter for some motions only.
    /// G90.1, G91.1: absolute or incremental arc centres.
    ArcCentreMode,
    /// ORIRPY, ORIEULER.
    RpyConvention,
    /// ORIROTA, ORIROTR.
    SpinReference,
}

impl ModalGroup {
    /// The bit of the group in a set of groups.
    pub(super) const fn bit(self) -> u32 {
        1 << self as u32
    }
}

pub(super) const GROUP_COUNT: u32 = ModalGroup::SpinReference as u32 + 1;

pub(super) const ALL_GROUPS: u32 = (1 << GROUP_COUNT) - 1;

/// Groups that matter for arcs only.
pub(super) const ARC_GROUPS: u32 = ModalGroup::Plane.bit() | ModalGroup::ArcCentreMode.bit();

/// Groups that select the tool and its length offset.
pub(super) const TOOL_GROUPS: u32 = ModalGroup::Tool.bit() | ModalGroup::ToolLength.bit();

/// Groups that matter for every motion. `RpyConvention` and `SpinReference` only interpret some words: where they are
/// unknown, so are the values of those words.
pub(super) const MOTION_GROUPS: u32 =
    ALL_GROUPS & !(ARC_GROUPS | ModalGroup::RpyConvention.bit() | ModalGroup::SpinReference.bit());

/// Work offsets or tools that the program assigns, by name in upper case.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct AssignedFrames {
    /// The assigned frame; `None` where its value is unknown.
    by_name: Map<String, Option<Frame>>,
    /// Every name that has been assigned on some path, for after `by_name` has been emptied.
    ever: Map<String, ()>,
    /// Whether any other name may have been assigned too.
    any: bool,
    /// Names with offsets of rotary axes, which a shift and a rotation about Z cannot represent.
    rotary: Map<String, ()>,
    /// Whether any other name may have such offsets too.
    any_rotary: bool,
}

impl AssignedFrames {
    /// The value that the program has, or may have, assigned to a name; `None` where it certainly has not.
    pub(super) fn get(&self, name: &str) -> Option<Option<Frame>> {
        let name = name.to_ascii_uppercase();
        match self.by_name.get(&name) {
            Some(frame) => Some(*frame),
            None => (self.any || self.ever.contains_key(&name)).then_some(None),
        }
    }

    pub(super) fn set(&mut self, name: &str, frame: Option<Frame>) {
        let name = name.to_ascii_uppercase();
        self.ever.insert(name.clone(), ());
        self.by_name.insert(name, frame);
    }

    /// Whether a name has, or may have, offsets of rotary axes.
    pub(super) fn is_rotary(&self, name: &str) -> bool {
        self.any_rotary || self.rotary.contains_key(&name.to_ascii_uppercase())
    }

    pub(super) fn set_rotary(&mut self, name: &str, rotary: bool) {
        let name = name.to_ascii_uppercase();
        if rotary {
            self.rotary.insert(name, ());
        } else {
            self.rotary.remove(&name);
        }
    }

    /// Any of them may have been assigned any value.
    pub(super) fn invalidate(&mut self) {
        self.by_name = Map::new();
        self.any = true;
        self.any_rotary = true;
    }

    fn join(&mut self, other: &AssignedFrames) {
        let agree = |a: Option<&Option<Frame>>, b: Option<&Option<Frame>>| {
            if a == b { a.copied() } else { Some(None) }
        };
        self.by_name = self.by_name.joined(&other.by_name, &agree);
        self.ever = self.ever.joined(&other.ever, &|_, _| Some(()));
        self.any |= other.any;
        self.rotary = self.rotary.joined(&other.rotary, &|_, _| Some(()));
        self.any_rotary |= other.any_rotary;
    }

    /// Joins with the states of unseen predecessors, which may have assigned frames (`assigned`) and rotary offsets.
    fn join_unseen_predecessors(&mut self, assigned: bool, rotary: bool) {
        if assigned {
            let before = self.any_rotary;
            self.invalidate();
            self.any_rotary = before || rotary;
        }
    }
}

/// What a file assigns on some path.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AssignedKinds {
    /// Work offsets.
    pub(super) offsets: bool,
    /// Work offsets of rotary axes.
    pub(super) rotary: bool,
    /// Tools.
    pub(super) tools: bool,
}

impl AssignedKinds {
    pub(super) const ALL: AssignedKinds = AssignedKinds { offsets: true, rotary: true, tools: true };
}

/// The values of variables; a copy shares them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variables {
    known: Map<Variable, Evaluated>,
    /// Why the other variables that have ever been assigned are unknown.
    unknown: Reason,
}

impl Default for Variables {
    fn default() -> Self {
        Variables { known: Map::new(), unknown: Reason::UnknownVariable }
    }
}

impl Variables {
    /// The value of a variable; `assigned`: whether the file has ever assigned it.
    pub(super) fn get(&self, name: &Variable, assigned: impl FnOnce() -> bool) -> Evaluated {
        match self.known.get(name) {
            Some(value) => *value,
            None if self.unknown != Reason::UnknownVariable && assigned() => Err(self.unknown),
            None => Err(Reason::UnknownVariable),
        }
    }

    pub(super) fn insert(&mut self, name: Variable, value: Evaluated) {
        self.known.insert(name, value);
    }

    pub(super) fn invalidate(&mut self, because: Reason) {
        *self = Variables { known: Map::new(), unknown: because };
    }

    fn join(&mut self, other: &Variables) {
        let (a_unknown, b_unknown) = (Err(self.unknown), Err(other.unknown));
        let unknown = if self.unknown == other.unknown { self.unknown } else { Reason::UnknownFlow };
        let agree = |a: Option<&Evaluated>, b: Option<&Evaluated>| {
            let (a, b) = (a.unwrap_or(&a_unknown), b.unwrap_or(&b_unknown));
            let value = if a == b { *a } else { Err(Reason::UnknownFlow) };
            (value != Err(unknown)).then_some(value)
        };
        self.known = self.known.joined(&other.known, &agree);
        self.unknown = unknown;
    }
}

/// The tool length offset in effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ToolLength {
    /// That of the tool: no word states another.
    OfTool,
    /// That of an offset number (H).
    Offset(u32),
    /// Cancelled (G49).
    None,
}

/// The abstract state of a control between two blocks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModalState {
    pub(super) mode: MotionMode,
    /// Whether an unsupported path starts in the direction of the motion before it.
    pub(super) starts_tangent: bool,
    /// G90.
    pub(super) absolute: bool,
    /// mm per unit: 1 or 25.4.
    pub(super) unit_mm: f64,
    pub(super) plane: Plane,
    /// G90.1.
    pub(super) centre_absolute: bool,
    /// Tool position in the work frame (mm), coordinate shift included.
    pub(super) position: [Evaluated; 3],
    pub(super) orientation_mode: OrientationMode,
    /// A, B, C (°).
    pub(super) abc: [Evaluated; 3],
    /// A2, B2, C2 (°).
    pub(super) rpy: [Evaluated; 3],
    /// The tool vector.
    pub(super) vector: [Evaluated; 3],
    /// The rotation about the tool vector (°).
    pub(super) spin: Evaluated,
    /// Whether A2, B2, C2 are roll, pitch, yaw (ORIRPY).
    pub(super) rpy_convention_stated: bool,
    /// The coordinate shift of G92 and G52, added to programmed values (mm).
    pub(super) shift: [Evaluated; 3],
    /// Whether G92 contributes to it.
    pub(super) origin_set: bool,
    /// G54, G500, …
    pub(super) work_offset: String,
    /// The datum shift of X, Y and Z (mm, Heidenhain); `None` where an axis is unknown.
    pub(super) datum_shift: [Option<f64>; 3],
    /// TRANS, ROT: a frame within the work frame.
    pub(super) programmable_frame: Option<Pose>,
    /// The coordinate transforms in effect, as a set of groups.
    pub(super) active_transforms: u32,
    /// G41, G42.
    pub(super) radius_compensation: bool,
    /// G43.4, TRAORI, M128.
    pub(super) tcp_mode: bool,
    /// G43.5: I, J, K are a tool vector.
    pub(super) vector_words: bool,
    pub(super) tool: String,
    /// The tool that the next M6 changes to.
    pub(super) next_tool: Option<String>,
    pub(super) tool_length: ToolLength,
    /// The offset number that belongs to a tool which no T has named.
    pub(super) own_length_offset: Option<u32>,
    /// The cutting edge (Siemens: D).
    pub(super) cutting_edge: u32,
    pub(super) assigned_offsets: AssignedFrames,
    pub(super) assigned_tools: AssignedFrames,
    /// Whether the active work offset has been assigned and not yet selected again (Siemens).
    pub(super) offset_pending: bool,
    /// Whether THETA counts from the frame of the tool vector (ORIROTA).
    pub(super) spin_absolute: bool,
    /// What runs after each motion (G66, MCALL).
    pub(super) modal_call: Option<Reason>,
    /// The motion mode before a cycle (G80 of Fanuc returns to it).
    pub(super) mode_before_cycle: MotionMode,
    /// The state that M70 has saved.
    pub(super) saved: Option<Box<ModalState>>,
    /// mm/s.
    pub(super) feed: Evaluated,
    /// G94.
    pub(super) feed_per_minute: bool,
    pub(super) exact_stop: bool,
    /// Whether the exact stop is modal (G61) and not of one block (G9).
    pub(super) exact_stop_modal: bool,
    /// The pole: the centre of the last CC (Heidenhain).
    pub(super) pole: [Evaluated; 2],
    pub(super) variables: Variables,
    /// Groups whose paths disagree at a join.
    pub(super) unknown_after_join: u32,
    /// Groups that an unknown word may have set, and `word_reason` why.
    pub(super) unknown_by_word: u32,
    pub(super) word_reason: Reason,
    /// The motion before this block, where every path has the same one.
    pub(super) previous: Option<u32>,
}

/// The modal state that determines how the words of a straight block are read. A block that is inserted before another is
/// read with the state before that one, so the two must agree.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct WordSemantics {
    unit_mm: f64,
    tcp_mode: (bool, bool),
    radius_compensation: bool,
    feed_per_minute: bool,
    active_transforms: u32,
    programmable_frame: Option<Pose>,
    spin_absolute: bool,
}

impl ModalState {
    pub(super) fn word_semantics(&self) -> WordSemantics {
        WordSemantics {
            unit_mm: self.unit_mm,
            tcp_mode: (self.tcp_mode, self.vector_words),
            radius_compensation: self.radius_compensation,
            feed_per_minute: self.feed_per_minute,
            active_transforms: self.active_transforms,
            programmable_frame: self.programmable_frame,
            spin_absolute: self.spin_absolute,
        }
    }

    /// The state after power-on.
    pub(super) fn start(work_offset: &str, tool: &str) -> ModalState {
        ModalState {
            mode: MotionMode::Unset,
            starts_tangent: true,
            absolute: true,
            unit_mm: 1.0,
            plane: Plane::XY,
            centre_absolute: false,
            position: [Err(Reason::PositionUnknown); 3],
            orientation_mode: OrientationMode::Unknown(Reason::OrientationUnknown),
            abc: [Err(Reason::OrientationUnknown); 3],
            rpy: [Err(Reason::OrientationUnknown); 3],
            vector: [Err(Reason::OrientationUnknown); 3],
            spin: Ok(0.0),
            rpy_convention_stated: false,
            shift: [Ok(0.0); 3],
            origin_set: false,
            work_offset: work_offset.to_owned(),
            datum_shift: [Some(0.0); 3],
            programmable_frame: None,
            active_transforms: 0,
            radius_compensation: false,
            tcp_mode: false,
            vector_words: false,
            tool: tool.to_owned(),
            next_tool: None,
            tool_length: ToolLength::OfTool,
            own_length_offset: None,
            cutting_edge: 1,
            assigned_offsets: AssignedFrames::default(),
            assigned_tools: AssignedFrames::default(),
            offset_pending: false,
            spin_absolute: true,
            modal_call: None,
            mode_before_cycle: MotionMode::Unset,
            saved: None,
            feed: Err(Reason::UnknownVariable),
            feed_per_minute: true,
            exact_stop: false,
            exact_stop_modal: false,
            pole: [Err(Reason::PositionUnknown); 2],
            variables: Variables::default(),
            unknown_after_join: 0,
            unknown_by_word: 0,
            word_reason: Reason::UnknownWord,
            previous: None,
        }
    }

    /// Joins with the states of predecessors elsewhere in the file: only groups that the whole file sets to one value
    /// (`constant`) stay known.
    pub(super) fn join_unseen_predecessors(&mut self, constant: u32, assigned: AssignedKinds) {
        let flow = Err(Reason::UnknownFlow);
        self.mode = MotionMode::Unknown(Reason::UnknownFlow);
        self.mode_before_cycle = self.mode;
        self.assigned_offsets.join_unseen_predecessors(assigned.offsets, assigned.rotary);
        self.assigned_tools.join_unseen_predecessors(assigned.tools, false);
        self.next_tool = None;
        self.saved = None;
        self.position = [flow; 3];
        self.orientation_mode = OrientationMode::Unknown(Reason::UnknownFlow);
        (self.abc, self.rpy, self.vector, self.spin) = ([flow; 3], [flow; 3], [flow; 3], flow);
        self.feed = flow;
        self.pole = [flow; 2];
        self.variables.invalidate(Reason::UnknownFlow);
        self.unknown_after_join |= ALL_GROUPS & !constant;
        self.rpy_convention_stated &= constant & ModalGroup::RpyConvention.bit() != 0;
        self.spin_absolute &= constant & ModalGroup::SpinReference.bit() != 0;
        self.previous = None;
    }

    pub(super) fn invalidate_position(&mut self) {
        self.position = [Err(Reason::PositionUnknown); 3];
        self.previous = None;
    }

    pub(super) fn invalidate_orientation(&mut self) {
        let none = [Err(Reason::OrientationUnknown); 3];
        (self.abc, self.rpy, self.vector) = (none, none, none);
        self.orientation_mode = OrientationMode::Unknown(Reason::OrientationUnknown);
    }

    /// After a word of unknown effect: every group may have any value.
    pub(super) fn invalidate_all(&mut self, because: Reason) {
        self.invalidate_position();
        self.invalidate_orientation();
        self.mode = MotionMode::Unknown(because);
        self.mode_before_cycle = self.mode;
        self.feed = Err(because);
        self.pole = [Err(because); 2];
        self.variables.invalidate(because);
        self.unknown_by_word = ALL_GROUPS;
        self.word_reason = because;
        self.next_tool = None;
    }

    pub(super) fn mark_known(&mut self, group: ModalGroup) {
        self.unknown_after_join &= !group.bit();
        self.unknown_by_word &= !group.bit();
    }

    pub(super) fn set_transform(&mut self, group: ModalGroup, on: bool) {
        self.active_transforms = self.active_transforms & !group.bit() | u32::from(on) << group as u32;
    }

    pub(super) fn is_transform_active(&self, group: ModalGroup) -> bool {
        self.active_transforms & group.bit() != 0
    }

    /// The name of the tool frame in effect: another H or D, or none, makes another tool of it.
    pub(super) fn tool_name(&self, dialect: Dialect) -> String {
        let own = |number: u32| self.own_length_offset == Some(number) || self.tool == format!("T{number}");
        match (dialect, self.tool_length) {
            (Dialect::Siemens, _) if self.cutting_edge == 1 => self.tool.clone(),
            (Dialect::Siemens, _) if self.cutting_edge == u32::MAX => format!("{} D?", self.tool),
            (Dialect::Siemens, _) => format!("{} D{}", self.tool, self.cutting_edge),
            (Dialect::Heidenhain, _) | (_, ToolLength::OfTool) => self.tool.clone(),
            (_, ToolLength::None) if self.tool == "T0" => self.tool.clone(),
            (_, ToolLength::None) => "G49".to_owned(),
            (_, ToolLength::Offset(number)) if own(number) => self.tool.clone(),
            (_, ToolLength::Offset(u32::MAX)) => "H?".to_owned(),
            (_, ToolLength::Offset(number)) => format!("H{number}"),
        }
    }

    /// Why one of these groups is unknown; `None` where all are known.
    pub(super) fn unknown_reason(&self, groups: u32) -> Option<Reason> {
        if self.unknown_by_word & groups != 0 {
            return Some(self.word_reason);
        }
        (self.unknown_after_join & groups != 0).then_some(Reason::UnknownFlow)
    }

    /// The join of the states of two paths: what they agree on stays known.
    pub(super) fn join(mut self, other: &ModalState) -> ModalState {
        let join = |a: &mut Evaluated, b: &Evaluated| {
            if *a != *b {
                *a = Err(Reason::UnknownFlow);
            }
        };
        let join_all =
            |a: &mut [Evaluated], b: &[Evaluated]| a.iter_mut().zip(b).for_each(|(a, b)| join(a, b));
        join_all(&mut self.position, &other.position);
        join_all(&mut self.abc, &other.abc);
        join_all(&mut self.rpy, &other.rpy);
        join_all(&mut self.vector, &other.vector);
        join_all(&mut self.shift, &other.shift);
        join_all(&mut self.pole, &other.pole);
        join(&mut self.spin, &other.spin);
        join(&mut self.feed, &other.feed);
        for (a, b) in self.datum_shift.iter_mut().zip(other.datum_shift) {
            *a = a.filter(|_| *a == b);
        }
        if self.orientation_mode != other.orientation_mode {
            self.orientation_mode = OrientationMode::Unknown(Reason::UnknownFlow);
        }
        if self.mode != other.mode {
            self.mode = MotionMode::Unknown(Reason::UnknownFlow);
        }
        if self.mode_before_cycle != other.mode_before_cycle {
            self.mode_before_cycle = MotionMode::Unknown(Reason::UnknownFlow);
        }
        self.unknown_after_join |= self.active_transforms ^ other.active_transforms;
        self.active_transforms |= other.active_transforms;
        self.assigned_offsets.join(&other.assigned_offsets);
        self.assigned_tools.join(&other.assigned_tools);
        self.offset_pending |= other.offset_pending;
        self.starts_tangent |= other.starts_tangent;
        self.origin_set |= other.origin_set;
        self.rpy_convention_stated &= other.rpy_convention_stated;
        self.spin_absolute &= other.spin_absolute;
        self.modal_call = self.modal_call.or(other.modal_call);
        if self.next_tool != other.next_tool {
            self.next_tool = Some("T?".to_owned());
        }
        let edges_differ = self.cutting_edge != other.cutting_edge;
        for (group, differs) in [
            (ModalGroup::DistanceMode, self.absolute != other.absolute),
            (ModalGroup::Unit, self.unit_mm != other.unit_mm),
            (ModalGroup::Plane, self.plane != other.plane),
            (ModalGroup::WorkOffset, self.work_offset != other.work_offset),
            (ModalGroup::ProgrammableFrame, self.programmable_frame != other.programmable_frame),
            (ModalGroup::RadiusCompensation, self.radius_compensation != other.radius_compensation),
            (ModalGroup::TcpMode, self.tcp_mode != other.tcp_mode || self.vector_words != other.vector_words),
            (
                ModalGroup::Tool,
                self.tool != other.tool || self.own_length_offset != other.own_length_offset || edges_differ,
            ),
            (ModalGroup::ToolLength, self.tool_length != other.tool_length || edges_differ),
            (ModalGroup::ArcCentreMode, self.centre_absolute != other.centre_absolute),
            (ModalGroup::CoordinateShift, self.shift != other.shift),
        ] {
            if differs {
                self.unknown_after_join |= group.bit();
            }
        }
        self.unknown_after_join |= other.unknown_after_join;
        if other.unknown_by_word != 0 {
            self.unknown_by_word |= other.unknown_by_word;
            self.word_reason = other.word_reason;
        }
        if self.saved != other.saved {
            self.saved = None;
        }
        if self.feed_per_minute != other.feed_per_minute {
            self.feed = Err(Reason::UnknownFlow);
        }
        self.variables.join(&other.variables);
        if self.previous != other.previous {
            self.previous = None;
        }
        self
    }

    /// The tool orientation, with A, B and C in the given convention.
    pub(super) fn rotation(&self, angles: Option<Angles>) -> Result<nalgebra::UnitQuaternion<f64>, Reason> {
        match self.orientation_mode {
            OrientationMode::Unknown(reason) => Err(reason),
            OrientationMode::Angles => {
                let values = all_known(self.abc)?;
                Ok(angles.ok_or(Reason::UnknownConvention)?.rotation(values))
            }
            OrientationMode::Rpy if !self.rpy_convention_stated => Err(Reason::UnknownConvention),
            OrientationMode::Rpy => Ok(Angles::Wpr.rotation(all_known(self.rpy)?)),
            OrientationMode::Vector => spun(all_known(self.vector)?, self.spin?).ok_or(Reason::WrongShape),
        }
    }
}

/// The three values, or the first reason why one is unknown.
pub(super) fn all_known(values: [Evaluated; 3]) -> Result<[f64; 3], Reason> {
    Ok([values[0]?, values[1]?, values[2]?])
}
