//! The motion of a block: targets, speed, zone, tool and work offset, and why it is left unmodified.

use std::sync::Arc as Shared;

use nalgebra::UnitQuaternion;

use super::super::arc::{Arc, Plane};
use super::super::dialect::Dialect;
use super::super::expression::Evaluated;
use super::super::modal_group::{ARC_GROUPS, MOTION_GROUPS, ModalGroup, TOOL_GROUPS};
use super::super::modal_state::{MotionMode, OrientationMode, all_known};
use super::super::preceding::Preceding;
use super::super::syntax::{Word, WordValue};
use super::turn::{Turn, turn_between, words_at_pole};
use super::{Block, BlockArc, BlockContext, FlowPoint, Interpreter, StartDependency, StateEvent};
use crate::motion::{
    MAX_POSITION_MM, Modal, Motion, MotionKind, MotionTarget, Origin, Reason, RobTarget, Role, Span, Speed,
    SpeedValue, Switch, TargetValue, Zone, ZoneValue,
};
use truegrind_math::option_f64::OptionF64;

impl Interpreter<'_, '_> {
    fn instruction(&mut self, name: &str) -> Shared<str> {
        if let Some(found) = self.instructions.get(name) {
            return found.clone();
        }
        let shared: Shared<str> = name.into();
        self.instructions.insert(name.to_owned(), shared.clone());
        shared
    }

    fn new_motion(&mut self, block: &Block<'_>, name: &str, kind: MotionKind) -> Motion {
        let first = block.words.first().map_or(self.tree.nodes.first(block.node), |word| word.first);
        let (place, statement) = (self.place(first), self.tree.node_span(block.node));
        let modal = Modal { conf_linear: Switch::Off, conf_joint: Switch::Off, ..Modal::START };
        Motion {
            rapid: kind == MotionKind::Joint,
            conditional: block.flags.skippable,
            previous: self.state.preceding.single(),
            ..Motion::new(place, statement, self.instruction(name), kind, modal)
        }
    }

    fn push(&mut self, mut motion: Motion, context: BlockContext) -> u32 {
        let index = self.listing.motions.len() as u32;
        if motion.kind != MotionKind::Unknown
            && let Some(preceding) = self.state.preceding.of_paths()
        {
            match *preceding {
                [before] if before < index => motion.previous = Some(before),
                _ => drop(self.listing.predecessors.insert(index, preceding.to_vec())),
            }
        }
        self.listing.motions.push(motion);
        self.contexts.push(context);
        self.events.push(StateEvent::Motion(index));
        index
    }

    /// Lists a motion that is never modified.
    pub(super) fn list_left(&mut self, block: &Block<'_>, name: &str, reason: Reason) {
        self.list_left_as(block, (name, MotionKind::Unknown), reason);
    }

    fn list_left_as(&mut self, block: &Block<'_>, (name, kind): (&str, MotionKind), reason: Reason) {
        self.state.corners.before = false;
        let mut motion = self.new_motion(block, name, kind);
        motion.own_reason = Some(reason);
        // A path with which the tool may cut belongs to the cut of its neighbours: by tool and work offset.
        if kind != MotionKind::Unknown || matches!(reason, Reason::UnsupportedPath | Reason::RoundedCorner) {
            motion.tool = Some(self.tool());
            motion.work_object = Some(self.work_object());
        }
        let context = self.block_context(block, None);
        self.push(motion, context);
        self.state.preceding = Preceding::default();
        if block.spin.is_some() {
            // The spin stays unknown even if later words state the rest of the orientation.
            self.state.orientation.spin = Err(Reason::OrientationUnknown);
        }
    }

    /// Lists an unsupported path.
    pub(super) fn list_left_path(&mut self, block: &Block<'_>, name: &str, dependency: StartDependency) {
        self.list_left(block, name, Reason::UnsupportedPath);
        if let Some(context) = self.contexts.last_mut() {
            context.start_dependency = dependency;
        }
    }

    /// What the path of a block depends on if it is neither line nor arc, or a line given by an angle.
    fn start_dependency_of(&self, block: &Block<'_>, mode: MotionMode) -> StartDependency {
        match mode {
            MotionMode::Unsupported(Reason::UnsupportedPath) if self.state.starts_tangent => {
                StartDependency::Tangent
            }
            MotionMode::Unsupported(Reason::UnsupportedPath) => StartDependency::Position,
            _ if block.unmodelled == Some(Reason::UnsupportedPath) => StartDependency::Position,
            // A control makes a corner only of lines in its working plane.
            _ if self.ends_in_corner(block, mode) => StartDependency::Position,
            // No word can be added to a block with R+, and no A, B, C to such an LN: the omitted values stay in
            // effect.
            _ if block.flags.paraxial_compensation => StartDependency::Position,
            _ if block.unmodelled == Some(Reason::AlignedToNormal) && block.axes.contains(&None) => {
                StartDependency::Position
            }
            _ => StartDependency::Independent,
        }
    }

    /// Whether the control rounds or chamfers the corner at the end of a block.
    fn ends_in_corner(&self, block: &Block<'_>, mode: MotionMode) -> bool {
        let cuts = matches!(mode, MotionMode::Linear | MotionMode::Circular(_));
        block.flags.corner || cuts && self.state.corners.modal
    }

    fn block_context(&self, block: &Block<'_>, arc: Option<BlockArc>) -> BlockContext {
        let state = &self.state;
        let angles = if state.orientation.mode == OrientationMode::Rpy {
            &state.orientation.rpy
        } else {
            &state.orientation.abc
        };
        let vector = match (state.orientation.vector, state.orientation.spin) {
            ([Ok(x), Ok(y), Ok(z)], Ok(spin)) => Some(([x, y, z], spin)),
            _ => None,
        };
        BlockContext {
            node: block.node,
            absolute: state.groups.absolute(),
            unit_mm: state.groups.unit_mm(),
            distance_mode_unknown: state.unknown_reason(ModalGroup::DistanceMode.bit()).is_some(),
            start: state.position.map(Result::ok),
            start_angles: angles.map(Result::ok),
            angles: angles.map(Result::ok),
            start_vector: vector,
            vector,
            shift: state.shift.map(Result::ok),
            orientation_mode: state.orientation.mode,
            vector_words: state.groups.vector_words(),
            arc,
            insertable: false,
            paraxial: block.flags.paraxial,
            can_restate: false,
            may_omit_words: self.may_omit_words(block),
            start_dependency: StartDependency::Independent,
        }
    }

    /// Whether the control may ignore a word: Fanuc ignores one whose variable has never been set.
    fn may_omit_words(&self, block: &Block<'_>) -> bool {
        let words = block.axes.iter().chain(&block.abc).chain(&block.centre).chain([&block.radius]).flatten();
        let unset = |&index: &usize| {
            let word = &block.words[index];
            matches!(word.value, WordValue::Expression { .. }) && self.evaluate_word(word).0.is_err()
        };
        matches!(self.dialect, Dialect::Fanuc | Dialect::Iso) && { words }.any(unset)
    }

    fn axis_values(
        &self,
        block: &Block<'_>,
        words: &[Option<usize>; 3],
        old: &[Evaluated; 3],
        unit: f64,
    ) -> [Evaluated; 3] {
        std::array::from_fn(|axis| match words[axis] {
            None => old[axis],
            Some(index) => {
                let (value, increment) = self.evaluate_word(&block.words[index]);
                let value = value.map(|value| value * unit);
                if increment.unwrap_or(!self.state.groups.absolute()) {
                    old[axis].and_then(|old| value.map(|value| old + value))
                } else {
                    value
                }
            }
        })
    }

    /// The end position of a block.
    fn end_position(&self, block: &Block<'_>, from: &[Evaluated; 3]) -> [Evaluated; 3] {
        let mut to = self.axis_values(block, &block.axes, from, self.state.groups.unit_mm());
        for (axis, to) in to.iter_mut().enumerate() {
            let Some(index) = block.axes[axis] else { continue };
            let increment =
                self.evaluate_word(&block.words[index]).1.unwrap_or(!self.state.groups.absolute());
            if !increment {
                *to = to.and_then(|value| self.state.shift[axis].map(|shift| value + shift));
            }
        }
        to
    }

    /// Whether the numbers of a target are literals in the block.
    fn origin(&self, block: &Block<'_>, value: &Result<TargetValue, Reason>) -> Origin {
        let words = block.axes.iter().chain(&block.abc).chain(&block.rpy).chain(&block.vector);
        let literal = words.flatten().all(|&index| self.literal(&block.words[index]).is_some());
        match value {
            Ok(_) if literal => Origin::Inline,
            Ok(_) => Origin::Computed,
            Err(_) => Origin::Unknown,
        }
    }

    /// Interprets the motion of a block.
    pub(super) fn motion(&mut self, block: &Block<'_>, machine: bool) {
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let mode = if heidenhain && block.flags.rapid && self.state.mode == MotionMode::Linear {
            MotionMode::Rapid
        } else {
            self.state.mode
        };
        let straight = matches!(mode, MotionMode::Rapid | MotionMode::Linear);
        let vector_words = self.state.groups.vector_words() && straight;
        let has_centre = block.centre.iter().any(Option::is_some);
        let bends = has_centre && !vector_words || block.radius.is_some();
        // On controls with `,R` and `,C`, R, I and K of a straight block may round or chamfer its corner.
        let corner = self.dialect.paren_comments() && straight && bends;
        let circular = matches!(mode, MotionMode::Circular(_));
        self.note_other_axes(block);
        if let Some(on) = block.flags.modal_corner {
            self.state.corners.modal = on;
        }
        if !(block.has_motion_words() || circular && bends || vector_words && has_centre) {
            self.block_without_axes(block, mode);
            return;
        }
        let unknown = match mode {
            MotionMode::Unset => Some(Reason::NoMotionCode),
            MotionMode::Unknown(reason) => Some(reason),
            _ => None,
        };
        if let Some(reason) = unknown {
            if reason == Reason::UnknownFlow {
                let to = self.end_position(block, &self.state.position);
                self.note_unstated(block, mode, &to);
            }
            self.list_left(block, "?", reason);
            self.invalidate_pose();
            return;
        }
        let before = self.block_context(block, None);
        let from = self.state.position;
        let to = self.end_position(block, &from);
        let (name, kind) = name_and_kind(mode, heidenhain);
        let mut motion = self.new_motion(block, name, kind);
        let ends_in_corner = self.ends_in_corner(block, mode);
        let behind_corner = std::mem::replace(&mut self.state.corners.before, ends_in_corner);
        let (old, old_rotation) = (self.state.orientation, self.state.rotation(self.angles));
        self.set_orientation(block, vector_words);
        let rotation = self.state.rotation(self.angles);
        let arc = self.targets(block, mode, [from, to], [old_rotation, rotation], &mut motion);
        motion.speed = (mode != MotionMode::Rapid).then(|| self.speed()).flatten();
        motion.zone = self.zone();
        motion.tool = Some(self.tool());
        motion.work_object = Some(self.work_object());
        motion.own_reason = self.reason_to_leave(block, mode, machine, &motion);
        if motion.own_reason.is_none() && (behind_corner || ends_in_corner) {
            motion.own_reason = Some(Reason::RoundedCorner);
        }
        if corner && motion.own_reason.is_none() {
            motion.own_reason = Some(Reason::UnsupportedPath);
        }
        motion.timed = !self.state.feed.per_minute && kind != MotionKind::Joint;
        if motion.reason().is_none() && self.is_turn_at_a_feed(block, mode) {
            motion.own_reason = Some(Reason::TurnAlone);
            motion.speed = None;
        }
        let turn = turn_between(&old, &self.state.orientation, self.angles);
        let splits = !motion.timed && self.can_split(block, &before) && matches!(turn, Turn::OneWay);
        if let Turn::TwoWays(turn) = turn {
            motion.axis_turn = Some(Box::new(turn));
        }
        motion.insertable = splits && kind == MotionKind::Linear && !block.flags.other_axes;
        let at_pole = words_at_pole(&self.state.orientation, self.angles);
        motion.can_straighten = splits && arc.is_some() && !block.flags.opaque && at_pole.is_none();
        motion.axis = arc.map(|block_arc| Box::new(block_arc.arc.plane.axis(block_arc.positive)));
        motion.by_radius = arc.is_some() && block.radius.is_some();
        let after = self.block_context(block, arc);
        let context = BlockContext {
            insertable: motion.insertable,
            can_restate: self.can_restate(block, &motion),
            start_dependency: self.start_dependency_of(block, mode),
            ..before.joined_with(&after)
        };
        if motion.reason() == Some(Reason::UnknownFlow) {
            self.note_unstated(block, mode, &to);
        }
        let index = self.push(motion, context);
        self.listing.nc.at_poles.extend(at_pole.map(|words| (index, words)));
        self.state.preceding = Preceding::after(index);
        self.state.position = to;
        self.update_after_motion(block, mode, machine);
        // A tool vector holds only in its own LN; later blocks have no word that states the orientation.
        if heidenhain && self.state.orientation.mode == OrientationMode::Vector {
            self.state.invalidate_orientation();
            self.events.push(StateEvent::AxesUnknown(super::ORIENTATION));
        }
    }

    /// Adds the targets of a motion; returns its arc.
    fn targets(
        &self,
        block: &Block<'_>,
        mode: MotionMode,
        [from, to]: [[Evaluated; 3]; 2],
        rotations: [Rotation; 2],
        motion: &mut Motion,
    ) -> Option<BlockArc> {
        let value = match block.flags.paraxial_compensation {
            true => Err(Reason::RadiusCompensation),
            false => target(to, rotations[1]),
        };
        let origin = self.origin(block, &value);
        let argument = self.argument(block);
        let mut arc = None;
        if let MotionMode::Circular(positive) = mode {
            let found = self.arc(block, from, to, positive);
            let via = arc_midpoint(found, [from, to], rotations);
            let via_origin = if via.is_ok() { Origin::Computed } else { Origin::Unknown };
            motion.targets.push(MotionTarget { role: Role::Via, value: via, origin: via_origin, argument });
            arc = found.ok().map(|arc| BlockArc {
                arc,
                positive,
                centre_absolute: self.state.groups.centre_absolute(),
            });
        }
        if motion.kind != MotionKind::Unknown {
            motion.targets.push(MotionTarget { role: Role::To, value, origin, argument });
        }
        arc
    }

    /// Whether a block may be inserted before this one: words of this block that change how numbers are read would
    /// act too late.
    fn can_split(&self, block: &Block<'_>, before: &BlockContext) -> bool {
        self.word_semantics == self.state.word_semantics()
            && !begins_something(block, self.dialect)
            && self.dialect != Dialect::Heidenhain
            && !block.flags.skippable
            && before.start.iter().all(Option::is_some)
    }

    /// Invalidates what the words of the block do not determine after it.
    fn update_after_motion(&mut self, block: &Block<'_>, mode: MotionMode, machine: bool) {
        if let MotionMode::Unsupported(_) = mode {
            // A spline ends at its last point, whatever its path.
            self.state.preceding = Preceding::default();
        }
        let call = self.modal_call(block);
        if call == Some(Reason::Subprogram) || call == Some(Reason::Cycle) && self.cycle_is_program {
            let call = self.state.modal_call;
            // G66 has been listed itself.
            if !self.dialect.paren_comments() {
                self.listing.nc.external_calls.push(self.listing.motions.len() as u32 - 1);
            }
            let callee = Some(self.pass.modal_callee.clone().unwrap_or_default());
            let may_be_own = |name: &Vec<u8>| name.is_empty() || self.scan.programs.contains(name);
            if call == Some(Reason::Subprogram) && callee.as_ref().is_some_and(may_be_own) {
                self.leads_anywhere();
            }
            self.join_unseen_predecessors();
            self.flow(FlowPoint::Call { callee, may_skip: false });
            self.state.modal_call = call;
        } else if (machine || block.unmodelled.is_some())
            && block.abc.iter().chain(&block.rpy).chain(&block.vector).any(Option::is_some)
        {
            self.invalidate_pose();
        } else if mode == MotionMode::Unsupported(Reason::Cycle)
            || machine
            || call.is_some()
            || matches!(block.unmodelled, Some(Reason::Transformed | Reason::UnsupportedPath | Reason::Probe))
            || block.flags.opaque
            || block.flags.other_axes && self.has_incremental_uvw()
        {
            self.invalidate_position();
        } else if block.unmodelled == Some(Reason::AlignedToNormal) {
            // The orientation at the end of this block is unknown.
            self.state.invalidate_orientation();
            self.state.preceding = Preceding::default();
            self.events.push(StateEvent::AxesUnknown(super::ORIENTATION));
        } else if block.unmodelled.is_some() {
            // Omitted axes keep the corrected position of the motion before.
            self.state.invalidate_orientation();
            self.events.push(StateEvent::AxesUnknown(super::ORIENTATION));
        }
        if block.flags.paraxial_compensation {
            self.invalidate_named_axes(block);
        }
        if block.flags.opaque || self.pass.contour_end.is_some() {
            self.invalidate_pose();
        }
        // If it is unknown how numbers are read, so is the end position.
        let meaning = [
            ModalGroup::DistanceMode,
            ModalGroup::Unit,
            ModalGroup::CoordinateShift,
            ModalGroup::Diameter,
            ModalGroup::RotaryOffset,
        ];
        if self.state.unknown_reason(meaning.iter().fold(0, |all, &group| all | group.bit())).is_some() {
            self.invalidate_pose();
        }
    }

    /// Whether words that an unmodified straight motion omits can be added to it.
    fn can_restate(&self, block: &Block<'_>, motion: &Motion) -> bool {
        let straight = matches!(motion.kind, MotionKind::Linear | MotionKind::Joint);
        let plain =
            straight && !block.flags.opaque && block.unmodelled.is_none() && self.pass.contour_end.is_none();
        let set_before_branch = !(ModalGroup::RadiusCompensation.bit() | TOOL_GROUPS) & MOTION_GROUPS;
        // A cycle runs at the position that the words state.
        let call = self.modal_call(block);
        // With added words, a block would move that otherwise does not because its variable has never been set.
        plain
            && !self.may_omit_words(block)
            && call.is_none_or(|call| call == Reason::Cycle)
            && self.state.groups.active_transforms() == 0
            && self.state.unknown_reason(set_before_branch).is_none()
            && match motion.own_reason {
                None
                | Some(
                    Reason::Skippable | Reason::UnknownFlow | Reason::UnknownWord | Reason::RoundedCorner,
                ) => true,
                Some(Reason::Cycle) => call.is_some(),
                _ => false,
            }
    }

    /// Whether a block only turns the tool, at a feed in degrees per minute: a word of X, Y or Z would make it millimetres per minute. An 840D
    /// (FGROUP) and a Heidenhain (M116, FUNCTION TCPM) may be set up otherwise, which the text need not tell.
    fn is_turn_at_a_feed(&self, block: &Block<'_>, mode: MotionMode) -> bool {
        mode == MotionMode::Linear
            && self.state.feed.per_minute
            && block.axes.iter().all(Option::is_none)
            && block.has_motion_words()
    }

    /// Whether U, V and W may be increments of X, Y and Z (lathes).
    fn has_incremental_uvw(&self) -> bool {
        matches!(self.dialect, Dialect::Fanuc | Dialect::Iso)
    }

    /// What runs after this motion: G66, MCALL, M89, or M99 of Heidenhain.
    fn modal_call(&self, block: &Block<'_>) -> Option<Reason> {
        let here = self.dialect == Dialect::Heidenhain && block.m.contains(&99);
        self.state.modal_call.or(here.then_some(Reason::Cycle))
    }

    /// Lists the further axes that a block names. On a Fanuc U, V and W are increments of X, Y and Z.
    fn note_other_axes(&mut self, block: &Block<'_>) {
        if !block.flags.other_axes || self.has_incremental_uvw() {
            return;
        }
        let letter = |task: &Self, word: &Word<'_>| match word.name.to_ascii_uppercase().as_slice() {
            [letter @ (b'U'..=b'W' | b'E')] | [b'I', letter @ b'U'..=b'W'] => Some(char::from(*letter)),
            _ => task.further_axis(word).map(char::from),
        };
        for word in &block.words {
            if let Some(letter) = letter(self, word) {
                let place = self.place(word.first);
                self.listing.nc.other_axes.entry(letter).or_insert(place);
            }
        }
    }

    /// A block without modelled axis words: it may move other axes, or could not be read.
    fn block_without_axes(&mut self, block: &Block<'_>, mode: MotionMode) {
        if !block.flags.opaque && self.calls_cycle(block) {
            return;
        }
        if block.flags.opaque {
            // What cannot be read may be words of a path, such as LinuxCNC's polar `@10 ^30`.
            let kind = match mode {
                MotionMode::Linear | MotionMode::Circular(_) => name_and_kind(mode, false).1,
                _ => MotionKind::Unknown,
            };
            self.list_left_as(block, ("?", kind), Reason::Unreadable);
            self.invalidate_pose();
        } else if let Some(reason) = block.unmodelled {
            if reason == Reason::Transformed {
                // A line or an arc to polar coordinates.
                self.list_left_as(block, name_and_kind(mode, self.dialect == Dialect::Heidenhain), reason);
                self.invalidate_position();
            } else {
                self.list_left(block, "path", reason);
                self.invalidate_pose();
            }
        } else if block.flags.other_axes {
            if self.has_incremental_uvw() {
                self.list_left(block, "axes", Reason::ExternalOnly);
                self.invalidate_position();
            } else {
                self.without_moving(|task| task.list_left(block, "axes", Reason::ExternalOnly));
            }
        }
    }

    /// Updates the orientation by the words of a block.
    fn set_orientation(&mut self, block: &Block<'_>, vector_words: bool) {
        let any = |words: &[Option<usize>; 3]| words.iter().any(Option::is_some);
        // Words of one mode leave the values of the other modes unknown.
        let unknown = [Err(Reason::OrientationUnknown); 3];
        if any(&block.abc) {
            self.state.orientation.abc =
                self.axis_values(block, &block.abc, &self.state.orientation.abc, 1.0);
            (self.state.orientation.rpy, self.state.orientation.vector) = (unknown, unknown);
            self.state.orientation.mode = OrientationMode::Angles;
        }
        if any(&block.rpy) {
            self.state.orientation.rpy =
                self.axis_values(block, &block.rpy, &self.state.orientation.rpy, 1.0);
            (self.state.orientation.abc, self.state.orientation.vector) = (unknown, unknown);
            self.state.orientation.mode = OrientationMode::Rpy;
        }
        let vector = if vector_words { &block.centre } else { &block.vector };
        if any(vector) {
            // An omitted component is 0.
            self.state.orientation.vector =
                vector.map(|index| index.map_or(Ok(0.0), |index| self.evaluate_word(&block.words[index]).0));
            (self.state.orientation.abc, self.state.orientation.rpy) = (unknown, unknown);
            self.state.orientation.mode = OrientationMode::Vector;
        }
        if let Some(index) = block.spin {
            let spin = self.evaluate_word(&block.words[index]).0;
            let absolute = self.state.groups.spin_absolute();
            self.state.orientation.spin = if absolute { spin } else { Err(Reason::OrientationUnknown) };
        }
    }

    fn arc(
        &self,
        block: &Block<'_>,
        from: [Evaluated; 3],
        to: [Evaluated; 3],
        positive: bool,
    ) -> Result<Arc, Reason> {
        let one = |index: usize| self.literal(&block.words[index]) == Some(1.0);
        // P: turns of LinuxCNC; Q, L: spirals and cones.
        let more = self.dialect != Dialect::Siemens
            && (block.p.is_some_and(|index| !one(index)) || block.q.is_some() || block.l.is_some());
        if block.flags.special_arc || more {
            return Err(Reason::UnsupportedPath);
        }
        let (start, end) = (all_known(from)?, all_known(to)?);
        let plane = self.state.groups.plane();
        let unit = self.state.groups.unit_mm();
        if self.dialect == Dialect::Heidenhain && plane != Plane::XY {
            return Err(Reason::Transformed);
        }
        if self.dialect == Dialect::Heidenhain && block.radius.is_none() {
            let centre = [self.state.pole[0]?, self.state.pole[1]?];
            return Arc::from_centre(plane, start, end, centre, positive).ok_or(Reason::NoArc);
        }
        if let Some(index) = block.radius {
            let radius = self.evaluate_word(&block.words[index]).0? * unit;
            return Arc::from_radius(plane, start, end, radius, positive).ok_or(Reason::NoArc);
        }
        let mut centre = [0.0; 2];
        for (place, axis) in [plane.a, plane.b].into_iter().enumerate() {
            centre[place] = match block.centre[axis] {
                None if self.state.groups.centre_absolute() => return Err(Reason::MissingArgument),
                None => start[axis],
                Some(index) => {
                    let (value, increment) = self.evaluate_word(&block.words[index]);
                    let value = value? * unit;
                    if increment.unwrap_or(!self.state.groups.centre_absolute()) {
                        start[axis] + value
                    } else {
                        value + self.state.shift[axis]?
                    }
                }
            };
        }
        if block.centre[plane.a].is_none() && block.centre[plane.b].is_none() {
            return Err(Reason::MissingArgument);
        }
        Arc::from_centre(plane, start, end, centre, positive).ok_or(Reason::NoArc)
    }

    /// The span from the first to the last target word.
    fn argument(&self, block: &Block<'_>) -> Span {
        let words = block
            .axes
            .iter()
            .chain(&block.abc)
            .chain(&block.rpy)
            .chain(&block.vector)
            .chain(&block.centre)
            .flatten()
            .map(|&index| block.words[index]);
        let (first, end) =
            words.fold((u32::MAX, 0), |(first, end), word| (first.min(word.first), end.max(word.end)));
        if first < end { self.tree.span(first, end) } else { self.tree.node_span(block.node) }
    }

    fn reason_to_leave(
        &self,
        block: &Block<'_>,
        mode: MotionMode,
        machine: bool,
        motion: &Motion,
    ) -> Option<Reason> {
        let state = &self.state;
        let has_orientation =
            !matches!(state.orientation.mode, OrientationMode::Unknown(Reason::OrientationUnknown));
        let requires_tcp_mode =
            matches!(self.dialect, Dialect::Fanuc | Dialect::Siemens | Dialect::Heidenhain);
        if block.flags.opaque {
            Some(Reason::Unreadable)
        } else if block.flags.skippable {
            Some(Reason::Skippable)
        } else if let MotionMode::Unsupported(reason) = mode {
            Some(reason)
        } else if machine {
            Some(Reason::MachineCoordinates)
        } else if self.pass.contour_end.is_some() {
            Some(Reason::Cycle)
        } else if let Some(reason) = block.unmodelled.or(self.modal_call(block)) {
            Some(reason)
        } else if let Some(reason) = state.unknown_reason(MOTION_GROUPS) {
            Some(reason)
        } else if let (MotionMode::Circular(_), Some(reason)) = (mode, state.unknown_reason(ARC_GROUPS)) {
            Some(reason)
        } else if state.groups.active_transforms() != 0 {
            Some(Reason::Transformed)
        } else if mode != MotionMode::Rapid && state.groups.is_on(ModalGroup::PointToPoint) {
            Some(Reason::UnsupportedPath)
        } else if state.groups.is_on(ModalGroup::ReferencePoint) {
            Some(Reason::ReferencePoint)
        } else if block.flags.other_axes && self.has_incremental_uvw() {
            Some(Reason::UnknownWord)
        } else if self.dialect == Dialect::Heidenhain
            && matches!(mode, MotionMode::Circular(_))
            && state.groups.plane() != Plane::XY
        {
            // The working plane is perpendicular to the tool axis.
            Some(Reason::Transformed)
        } else if state.groups.is_on(ModalGroup::RadiusCompensation) {
            Some(Reason::RadiusCompensation)
        } else if has_orientation && requires_tcp_mode && !state.groups.tcp_mode() {
            Some(Reason::NoTcpMode)
        } else if self.dialect == Dialect::Heidenhain
            && matches!(mode, MotionMode::Circular(_))
            && block.radius.is_none()
        {
            Some(Reason::CentreElsewhere)
        } else if state.feed.rate == Err(Reason::NumberRange) && mode != MotionMode::Rapid {
            Some(Reason::NumberRange)
        } else {
            self.listing.frame_reason(motion)
        }
    }

    fn speed(&mut self) -> Option<u32> {
        let feed = match (self.state.feed.rate, self.state.feed.per_minute) {
            (Ok(feed), true) => feed,
            _ => return None,
        };
        if let Some(&index) = self.speeds.get(&feed.to_bits()) {
            return Some(index);
        }
        let value = SpeedValue {
            tcp_mm_s: feed,
            orientation_deg_s: 500.0,
            linear_external_mm_s: 5000.0,
            rotating_external_deg_s: 1000.0,
        };
        self.listing.speeds.push(Speed { text: format!("F{}", feed * 60.0), value: Ok(value) });
        let index = self.listing.speeds.len() as u32 - 1;
        self.speeds.insert(feed.to_bits(), index);
        Some(index)
    }

    fn zone(&mut self) -> Option<u32> {
        if !self.state.feed.exact_stop {
            return None;
        }
        let fine = ZoneValue { fine: true, tcp_mm: 0.0, orientation_mm: 0.0, orientation_deg: 0.0 };
        let zone = Zone { text: "exact stop".to_owned(), value: Ok(fine) };
        let found = self.listing.zones.iter().position(|other| *other == zone);
        Some(found.unwrap_or_else(|| {
            self.listing.zones.push(zone);
            self.listing.zones.len() - 1
        }) as u32)
    }
}

impl BlockContext {
    /// Joins this context before the block with the one after it.
    fn joined_with(self, after: &BlockContext) -> BlockContext {
        let same_angles = (self.orientation_mode == OrientationMode::Rpy)
            == (after.orientation_mode == OrientationMode::Rpy);
        BlockContext {
            arc: after.arc,
            start_angles: if same_angles { self.start_angles } else { [None; 3] },
            orientation_mode: after.orientation_mode,
            angles: after.angles,
            vector: after.vector,
            ..self
        }
    }
}

/// The listed name and kind of a motion mode.
fn name_and_kind(mode: MotionMode, heidenhain: bool) -> (&'static str, MotionKind) {
    match mode {
        MotionMode::Rapid if heidenhain => ("L FMAX", MotionKind::Joint),
        MotionMode::Linear if heidenhain => ("L", MotionKind::Linear),
        MotionMode::Circular(_) if heidenhain => ("C", MotionKind::Circular),
        MotionMode::Rapid => ("G0", MotionKind::Joint),
        MotionMode::Linear => ("G1", MotionKind::Linear),
        MotionMode::Circular(false) => ("G2", MotionKind::Circular),
        MotionMode::Circular(true) => ("G3", MotionKind::Circular),
        MotionMode::Unsupported(Reason::Cycle) => ("cycle", MotionKind::Unknown),
        MotionMode::Unsupported(_) | MotionMode::Unset | MotionMode::Unknown(_) => {
            ("path", MotionKind::Unknown)
        }
    }
}

type Rotation = Result<UnitQuaternion<f64>, Reason>;

/// The target at this position and orientation.
fn target(position: [Evaluated; 3], rotation: Rotation) -> Result<TargetValue, Reason> {
    let position_mm = all_known(position)?;
    if !position_mm.iter().all(|coordinate| coordinate.abs() <= MAX_POSITION_MM) {
        return Err(Reason::BeyondReach);
    }
    let q = rotation?;
    let quaternion = [q.w, q.i, q.j, q.k];
    Ok(TargetValue::Cartesian(RobTarget {
        position_mm,
        quaternion,
        conf: [0; 4],
        external: [OptionF64::NONE; 6],
    }))
}

/// The pose half way along an arc.
fn arc_midpoint(
    arc: Result<Arc, Reason>,
    [from, to]: [[Evaluated; 3]; 2],
    rotations: [Rotation; 2],
) -> Result<TargetValue, Reason> {
    let arc = arc?;
    let (Ok(a), Ok(b)) = (all_known(from), all_known(to)) else { return Err(Reason::PositionUnknown) };
    let half = match rotations {
        [Ok(a), Ok(b)] => Ok(a.try_slerp(&b, 0.5, 1e-9).unwrap_or(b)),
        [Err(reason), _] | [_, Err(reason)] => Err(reason),
    };
    target(arc.point_at(a, b, 0.5).map(Ok), half)
}

/// Whether a block starts the spindle, the coolant or another function, or states a feed, an override or a limit that is
/// not modelled: an inserted block would run without it. Stops take effect after the motion.
fn begins_something(block: &Block<'_>, dialect: Dialect) -> bool {
    let siemens = dialect == Dialect::Siemens;
    block.m.iter().any(|m| !matches!(m, 0..=2 | 5 | 9 | 30))
        || block.words.iter().any(|word| match word.address() {
            Some(b'S') => true,
            // Of a Siemens control an auxiliary function, elsewhere the number of a tool length.
            Some(b'H') => siemens,
            Some(_) => false,
            // S1=, M1=, H1=, FB=, OVR=, ACC[X]=, FGROUP(…), $A_OUT[1]=: only names of the path itself wait for its end.
            None => siemens && !is_path_name(&word.name.to_ascii_uppercase()),
        })
}

/// Names of a Siemens control that state the end of a motion or its path.
fn is_path_name(name: &[u8]) -> bool {
    const PATH_NAMES: [&[u8]; 13] =
        [b"A2", b"B2", b"C2", b"A3", b"B3", b"C3", b"THETA", b"CR", b"AR", b"TURN", b"I1", b"J1", b"K1"];
    PATH_NAMES.contains(&name)
}
