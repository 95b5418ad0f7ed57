//! The abstract modal state of a control: the value of every modal group, or the reason why the text does not determine it.
//!
//! Its [`Lattice::join`] merges the states of two control-flow paths.

use super::dialect::Dialect;
use super::expression::{Evaluated, Variable};
use super::modal_group::{ALL_GROUPS, GroupTable, ModalGroup};
use super::orientation::{Angles, spun};
use super::preceding::Preceding;
use crate::dataflow::Lattice;
use crate::motion::{Frame, Reason};
use crate::persistent_map::Map;
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

/// Work offsets or tools that the program assigns, by name in upper case.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct AssignedFrames {
    /// The assigned frame; `None` where its value is unknown.
    by_name: Map<String, Option<Frame>>,
    /// Every name that has been assigned on some path, for after `by_name` has been emptied.
    ever: Map<String, ()>,
    /// Whether any other name may have been assigned too.
    any: bool,
    /// Whether a probing cycle may have done so.
    by_probing: bool,
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

    /// Why what is assigned is unknown.
    pub(super) fn reason(&self) -> Reason {
        if self.by_probing { Reason::AfterProbing } else { Reason::Assigned }
    }

    /// A probing cycle may have assigned any of them any value.
    pub(super) fn invalidate_by_probing(&mut self) {
        self.invalidate();
        self.by_probing = true;
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
        self.by_probing |= other.by_probing;
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

/// The words that state the tool orientation, and their values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Orientation {
    pub(super) mode: OrientationMode,
    /// A, B, C (°).
    pub(super) abc: [Evaluated; 3],
    /// A2, B2, C2 (°).
    pub(super) rpy: [Evaluated; 3],
    /// The tool vector.
    pub(super) vector: [Evaluated; 3],
    /// The rotation about the tool vector (°).
    pub(super) spin: Evaluated,
}

impl Orientation {
    /// Unknown for this reason, but for the rotation about the tool vector.
    fn unknown(because: Reason, spin: Evaluated) -> Orientation {
        let none = [Err(because); 3];
        Orientation { mode: OrientationMode::Unknown(because), abc: none, rpy: none, vector: none, spin }
    }

    fn join(&mut self, other: &Orientation) {
        if self.mode != other.mode {
            self.mode = OrientationMode::Unknown(Reason::UnknownFlow);
        }
        join_all(&mut self.abc, &other.abc);
        join_all(&mut self.rpy, &other.rpy);
        join_all(&mut self.vector, &other.vector);
        join(&mut self.spin, &other.spin);
    }
}

/// The tool in the spindle, and its length offset.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ActiveTool {
    pub(super) name: String,
    /// The tool that the next M6 changes to.
    pub(super) next: Option<String>,
    pub(super) length: ToolLength,
    /// The offset number that belongs to a tool which no T has named.
    pub(super) own_length_offset: Option<u32>,
    /// The cutting edge (Siemens: D).
    pub(super) cutting_edge: u32,
    /// Tools that the program assigns.
    pub(super) assigned: AssignedFrames,
}

impl ActiveTool {
    /// The name of the tool frame in effect: another H or D, or none, makes another tool of it.
    pub(super) fn frame_name(&self, dialect: Dialect) -> String {
        let own = |number: u32| self.own_length_offset == Some(number) || self.name == format!("T{number}");
        match (dialect, self.length) {
            (Dialect::Siemens, _) if self.cutting_edge == 1 => self.name.clone(),
            (Dialect::Siemens, _) if self.cutting_edge == u32::MAX => format!("{} D?", self.name),
            (Dialect::Siemens, _) => format!("{} D{}", self.name, self.cutting_edge),
            (Dialect::Heidenhain, _) | (_, ToolLength::OfTool) => self.name.clone(),
            (_, ToolLength::None) if self.name == "T0" => self.name.clone(),
            (_, ToolLength::None) => "G49".to_owned(),
            (_, ToolLength::Offset(number)) if own(number) => self.name.clone(),
            (_, ToolLength::Offset(u32::MAX)) => "H?".to_owned(),
            (_, ToolLength::Offset(number)) => format!("H{number}"),
        }
    }
}

/// The work offset in effect.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WorkOffset {
    /// G54, G500, …
    pub(super) name: String,
    /// Whether it has been assigned and not yet selected again (Siemens).
    pub(super) pending: bool,
    /// Work offsets that the program assigns.
    pub(super) assigned: AssignedFrames,
}

/// Feed and exact stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feed {
    /// mm/s.
    pub(super) rate: Evaluated,
    /// G94.
    pub(super) per_minute: bool,
    pub(super) exact_stop: bool,
    /// Whether the exact stop is modal (G61) and not of one block (G9).
    pub(super) exact_stop_modal: bool,
}

/// Corners that the control rounds or chamfers itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Corners {
    /// Whether every motion from here on ends in one (RNDM).
    pub(super) modal: bool,
    /// Whether the motion before ended in one.
    pub(super) before: bool,
}

/// The abstract state of a control between two blocks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ModalState {
    pub(super) groups: GroupTable,
    pub(super) mode: MotionMode,
    /// Whether an unsupported path starts in the direction of the motion before it.
    pub(super) starts_tangent: bool,
    /// The motion mode before a cycle (G80 of Fanuc returns to it).
    pub(super) mode_before_cycle: MotionMode,
    /// What runs after each motion (G66, MCALL).
    pub(super) modal_call: Option<Reason>,
    /// Tool position in the work frame (mm), coordinate shift included.
    pub(super) position: [Evaluated; 3],
    pub(super) orientation: Orientation,
    /// The coordinate shift of G92 and G52, added to programmed values (mm).
    pub(super) shift: [Evaluated; 3],
    /// Whether G92 contributes to it.
    pub(super) origin_set: bool,
    pub(super) work_offset: WorkOffset,
    /// The datum shift of X, Y and Z (mm, Heidenhain); `None` where an axis is unknown.
    pub(super) datum_shift: [Option<f64>; 3],
    /// TRANS, ROT: a frame within the work frame.
    pub(super) programmable_frame: Option<Pose>,
    pub(super) tool: ActiveTool,
    pub(super) feed: Feed,
    pub(super) corners: Corners,
    /// The pole: the centre of the last CC (Heidenhain).
    pub(super) pole: [Evaluated; 2],
    pub(super) variables: Variables,
    /// The state that M70 has saved.
    pub(super) saved: Option<Box<ModalState>>,
    /// The motions before this block.
    pub(super) preceding: Preceding,
}

/// The modal state that determines how the words of a straight block are read. A block that is inserted before another is
/// read with the state before that one, so the two must agree.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct WordSemantics {
    groups: [u64; 3],
    feed_per_minute: bool,
    active_transforms: u32,
    programmable_frame: Option<Pose>,
    spin_absolute: bool,
}

impl ModalState {
    pub(super) fn word_semantics(&self) -> WordSemantics {
        let groups = [ModalGroup::Unit, ModalGroup::TcpMode, ModalGroup::RadiusCompensation];
        WordSemantics {
            groups: groups.map(|group| self.groups.value(group)),
            feed_per_minute: self.feed.per_minute,
            active_transforms: self.groups.active_transforms(),
            programmable_frame: self.programmable_frame,
            spin_absolute: self.groups.spin_absolute(),
        }
    }

    /// The state after power-on.
    pub(super) fn start(work_offset: &str, tool: &str) -> ModalState {
        ModalState {
            groups: GroupTable::start(work_offset, tool),
            mode: MotionMode::Unset,
            starts_tangent: true,
            mode_before_cycle: MotionMode::Unset,
            modal_call: None,
            position: [Err(Reason::PositionUnknown); 3],
            orientation: Orientation::unknown(Reason::OrientationUnknown, Ok(0.0)),
            shift: [Ok(0.0); 3],
            origin_set: false,
            work_offset: WorkOffset {
                name: work_offset.to_owned(),
                pending: false,
                assigned: AssignedFrames::default(),
            },
            datum_shift: [Some(0.0); 3],
            programmable_frame: None,
            tool: ActiveTool {
                name: tool.to_owned(),
                next: None,
                length: ToolLength::OfTool,
                own_length_offset: None,
                cutting_edge: 1,
                assigned: AssignedFrames::default(),
            },
            feed: Feed {
                rate: Err(Reason::UnknownVariable),
                per_minute: true,
                exact_stop: false,
                exact_stop_modal: false,
            },
            corners: Corners::default(),
            pole: [Err(Reason::PositionUnknown); 2],
            variables: Variables::default(),
            saved: None,
            preceding: Preceding::default(),
        }
    }

    /// Joins with the states of predecessors elsewhere in the file: only groups that the whole file sets to one value
    /// (`constant`) stay known.
    pub(super) fn join_unseen_predecessors(&mut self, constant: u32, assigned: AssignedKinds) {
        let because = Reason::UnknownFlow;
        self.invalidate_flow(because);
        self.work_offset.assigned.join_unseen_predecessors(assigned.offsets, assigned.rotary);
        self.tool.assigned.join_unseen_predecessors(assigned.tools, false);
        self.saved = None;
        self.position = [Err(because); 3];
        self.orientation = Orientation::unknown(because, Err(because));
        self.groups.mark_unknown_after_join(ALL_GROUPS & !constant);
    }

    /// Forgets what depends on the motions before: modal groups, tools, offsets and variables stay as they are.
    pub(super) fn forget_path(&mut self) {
        let because = Reason::UnknownFlow;
        self.mode = MotionMode::Unknown(because);
        self.mode_before_cycle = self.mode;
        self.feed.rate = Err(because);
        self.pole = [Err(because); 2];
        self.preceding.meet();
        self.saved = None;
        self.position = [Err(because); 3];
        self.orientation = Orientation::unknown(because, Err(because));
        if self.origin_set {
            self.shift = [Err(because); 3];
            self.groups.mark_unknown_after_join(ModalGroup::CoordinateShift.bit());
        }
    }

    /// After a word of unknown effect: every group may have any value.
    pub(super) fn invalidate_all(&mut self, because: Reason) {
        self.invalidate_flow(because);
        self.invalidate_position();
        self.invalidate_orientation();
        self.groups.mark_unknown_by_word(ALL_GROUPS, because);
    }

    /// Motion mode, feed, pole, variables and the prepared tool are unknown.
    fn invalidate_flow(&mut self, because: Reason) {
        self.mode = MotionMode::Unknown(because);
        self.mode_before_cycle = self.mode;
        self.feed.rate = Err(because);
        self.pole = [Err(because); 2];
        self.variables.invalidate(because);
        self.tool.next = None;
        self.preceding = Preceding::default();
    }

    pub(super) fn invalidate_position(&mut self) {
        self.position = [Err(Reason::PositionUnknown); 3];
        self.preceding = Preceding::default();
    }

    pub(super) fn invalidate_orientation(&mut self) {
        self.orientation = Orientation::unknown(Reason::OrientationUnknown, self.orientation.spin);
    }

    /// Why one of these groups is unknown; `None` where all are known.
    pub(super) fn unknown_reason(&self, groups: u32) -> Option<Reason> {
        self.groups.unknown_reason(groups)
    }

    /// The tool orientation, with A, B and C in the given convention.
    pub(super) fn rotation(&self, angles: Option<Angles>) -> Result<nalgebra::UnitQuaternion<f64>, Reason> {
        let Orientation { mode, abc, rpy, vector, spin } = self.orientation;
        match mode {
            OrientationMode::Unknown(reason) => Err(reason),
            OrientationMode::Angles => {
                let values = all_known(abc)?;
                Ok(angles.ok_or(Reason::UnknownConvention)?.rotation(values))
            }
            OrientationMode::Rpy if !self.groups.rpy_convention_stated() => Err(Reason::UnknownConvention),
            OrientationMode::Rpy => Ok(Angles::Wpr.rotation(all_known(rpy)?)),
            OrientationMode::Vector => spun(all_known(vector)?, spin?).ok_or(Reason::WrongShape),
        }
    }
}

/// What both paths agree on stays known.
impl Lattice for ModalState {
    fn join(&mut self, other: &Self) {
        join_all(&mut self.position, &other.position);
        join_all(&mut self.pole, &other.pole);
        self.orientation.join(&other.orientation);
        self.groups.join(&other.groups);
        join_all(&mut self.shift, &other.shift);
        let (tool, theirs) = (&mut self.tool, &other.tool);
        let edges_differ = tool.cutting_edge != theirs.cutting_edge;
        for (group, differs) in [
            (ModalGroup::Tool, tool.own_length_offset != theirs.own_length_offset || edges_differ),
            (ModalGroup::ToolLength, edges_differ),
            (ModalGroup::ProgrammableFrame, self.programmable_frame != other.programmable_frame),
            (ModalGroup::CoordinateShift, self.shift != other.shift),
        ] {
            if differs {
                self.groups.mark_unknown_after_join(group.bit());
            }
        }
        if tool.next != theirs.next {
            tool.next = Some("T?".to_owned());
        }
        tool.assigned.join(&theirs.assigned);
        self.work_offset.assigned.join(&other.work_offset.assigned);
        self.work_offset.pending |= other.work_offset.pending;
        self.origin_set |= other.origin_set;
        for (a, b) in self.datum_shift.iter_mut().zip(other.datum_shift) {
            *a = a.filter(|_| *a == b);
        }
        for (mode, theirs) in
            [(&mut self.mode, other.mode), (&mut self.mode_before_cycle, other.mode_before_cycle)]
        {
            if *mode != theirs {
                *mode = MotionMode::Unknown(Reason::UnknownFlow);
            }
        }
        self.starts_tangent |= other.starts_tangent;
        self.modal_call = self.modal_call.or(other.modal_call);
        join(&mut self.feed.rate, &other.feed.rate);
        if self.feed.per_minute != other.feed.per_minute {
            self.feed.rate = Err(Reason::UnknownFlow);
        }
        // A stop that not every path has is none: motions that may blend belong to one cut.
        self.feed.exact_stop &= other.feed.exact_stop;
        self.feed.exact_stop_modal &= other.feed.exact_stop_modal;
        self.corners.modal |= other.corners.modal;
        self.corners.before |= other.corners.before;
        if self.saved != other.saved {
            self.saved = None;
        }
        self.variables.join(&other.variables);
        self.preceding.join(&other.preceding);
    }
}

/// The join of two values: known where they are the same.
fn join(a: &mut Evaluated, b: &Evaluated) {
    if *a != *b {
        *a = Err(Reason::UnknownFlow);
    }
}

fn join_all(a: &mut [Evaluated], b: &[Evaluated]) {
    a.iter_mut().zip(b).for_each(|(a, b)| join(a, b));
}

/// The three values, or the first reason why one is unknown.
pub(super) fn all_known(values: [Evaluated; 3]) -> Result<[f64; 3], Reason> {
    Ok([values[0]?, values[1]?, values[2]?])
}
