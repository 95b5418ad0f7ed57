//! Rewriting of NC text.
//!
//! Words keep their order, spacing and at least their decimals. An omitted modal word is added where its axis must
//! change, and to an unmodified motion where the motion before it has moved, so that its end point does not change.
//! An arc gets the centre (or radius) of the circle through its commanded start, middle and end, if with the written
//! decimals it stays close to the intended path.

mod restate;
mod arcs;
mod carried_axes;
mod pinned_ends;
mod line_length;
mod control_state;
mod position_dependencies;
mod block_writer;
mod word_slots;

use std::collections::{BTreeMap, BTreeSet, HashMap};

use nalgebra::UnitQuaternion;

use self::block_writer::{BlockWriter, differs};
use self::control_state::ControlState;
use self::word_slots::{ANGLES, AXES, CENTRE, ORDER, RADIUS, SPIN, VECTOR, WordSlots, states_increment};
use super::arc::{Arc, Plane};
use super::dialect::Dialect;
use super::mark;
use super::modal_state::OrientationMode;
use super::orientation::{Angles, vector_and_spin};
use super::task::{BlockContext, StateEvent, Task};
use crate::edit::{EditError, Edits, line_end};
use crate::motion::{Frame, Motion, MotionKind, Reason, RobTarget, Role, TargetValue};
use crate::rewrite::{Change, Extra, FileEdits, NewTarget, RewriteOptions, RewriteOutcome, Rewritten};

/// The most passes over a file whose arcs do not fit; then the file is left unmodified.
const MAX_PASSES: u32 = 32;

impl Task<'_> {
    /// The edits that make the changes, sorted and disjoint for each file.
    ///
    /// # Errors
    /// Edits that overlap, which is a defect of this module.
    pub fn rewrite(&self, changes: &[Change], options: &RewriteOptions) -> Result<Rewritten, EditError> {
        let mut outcomes = vec![RewriteOutcome::Unchanged; changes.len()];
        let mut wanted: HashMap<u32, usize> = HashMap::with_capacity(changes.len());
        for (index, change) in changes.iter().enumerate() {
            let refusal = match self.listing.motions.get(change.motion as usize) {
                None => Some(Reason::MissingArgument),
                Some(_) if wanted.contains_key(&change.motion) => Some(Reason::WrongKind),
                Some(motion) => self.refusal(motion, change),
            };
            match refusal {
                Some(reason) => outcomes[index] = RewriteOutcome::Refused(reason),
                None => {
                    wanted.insert(change.motion, index);
                }
            }
        }
        let mut edits = vec![Edits::new(); self.trees.len()];
        let mut passes = 0;
        let mut carried = self.carried_axes();
        while !wanted.is_empty() {
            edits.iter_mut().for_each(|edits| *edits = Edits::new());
            let pinned = self.find_pinned_ends(changes, &mut wanted, &mut outcomes);
            if self.refuse_position_dependents(&pinned, &mut wanted, &mut carried, &mut outcomes) {
                // A refused motion becomes unmodified and may depend on other motions.
                continue;
            }
            let ends = MotionEnds { pinned: &pinned, carried: &carried };
            let unfit_arcs =
                self.rewrite_motions((changes, &wanted), options, ends, &mut edits, &mut outcomes);
            // An arc that no circle fits becomes unmodified, and so does the motion that ends at its start.
            let mut again = false;
            for (motion, reason) in unfit_arcs {
                if let Some(index) = wanted.remove(&motion) {
                    outcomes[index] = RewriteOutcome::Refused(reason);
                    again = true;
                }
            }
            if !again {
                for edits in &mut edits {
                    edits.sort()?;
                }
                for motion in self.motions_on_long_lines(&edits, &wanted) {
                    if let Some(index) = wanted.remove(&motion) {
                        outcomes[index] = RewriteOutcome::Refused(Reason::LineTooLong);
                        again = true;
                    }
                }
            }
            if !again {
                break;
            }
            passes += 1;
            if passes == MAX_PASSES {
                wanted.clear();
                for outcome in
                    outcomes.iter_mut().filter(|outcome| !matches!(outcome, RewriteOutcome::Refused(_)))
                {
                    *outcome = RewriteOutcome::Refused(Reason::BeforeUnmodifiedArc);
                }
                edits.iter_mut().for_each(|edits| *edits = Edits::new());
            }
        }
        if wanted.is_empty() {
            // Discard edits of motions that are unmodified after all.
            edits.iter_mut().for_each(|edits| *edits = Edits::new());
        }
        Ok(Rewritten { files: self.marked(edits, options)?, outcomes })
    }

    /// Writes all motions in order: those of `wanted`, and restated words of the others. Returns the arcs that no
    /// circle fits, with the reason.
    fn rewrite_motions(
        &self,
        (changes, wanted): (&[Change], &HashMap<u32, usize>),
        options: &RewriteOptions,
        ends: MotionEnds<'_>,
        edits: &mut Vec<Edits>,
        outcomes: &mut [RewriteOutcome],
    ) -> Vec<(u32, Reason)> {
        let mut rewriter = Rewriter {
            task: self,
            options,
            edits,
            control: ControlState::default(),
            unfit_arcs: Vec::new(),
            ends,
        };
        for event in &self.events {
            match *event {
                StateEvent::FileStart => rewriter.control = ControlState::default(),
                StateEvent::PoseUnknown | StateEvent::Join => {
                    // A shift that was set at a corrected position keeps its change.
                    let ControlState { straightened, shift_change, .. } = rewriter.control;
                    rewriter.control = ControlState { straightened, shift_change, ..ControlState::default() };
                }
                StateEvent::AxesUnknown(axes) => rewriter.control.invalidate_axes(axes),
                StateEvent::FrameMoved(by_mm) => rewriter.control.move_frame(by_mm),
                StateEvent::OriginSet { stated, .. } => rewriter.control.set_origin(stated),
                StateEvent::ShiftStated(axes) => rewriter.control.shift_stated(axes),
                // No position changes there: the motions that end there are refused.
                StateEvent::ShiftMaybeStated(_)
                | StateEvent::ShiftRestored
                | StateEvent::PositionUsed { .. }
                | StateEvent::Branch => {}
                StateEvent::Motion(motion) => {
                    let index = wanted.get(&motion).copied();
                    let outcome = rewriter.motion(motion, index.map(|index| &changes[index]));
                    if let Some(index) = index {
                        outcomes[index] = outcome;
                    }
                }
            }
        }
        rewriter.unfit_arcs
    }

    /// The edits of each file, with the mark of this version.
    fn marked(&self, edits: Vec<Edits>, options: &RewriteOptions) -> Result<Vec<FileEdits>, EditError> {
        let mut files = Vec::with_capacity(self.trees.len());
        for ((edits, tree), &dialect) in edits.into_iter().zip(&self.trees).zip(&self.dialects) {
            let mut file = FileEdits { edits, unmarked: false };
            if let Some(mark) = options.mark.as_ref().filter(|_| !file.edits.is_empty()) {
                let comment = mark::text(mark, dialect);
                for line in mark::uncorrected(tree) {
                    file.edits.replace(line, b"");
                }
                match mark::token(tree) {
                    Some(old) => file.edits.replace(tree.range(old, old + 1), comment.as_bytes()),
                    None => {
                        let line = [comment.as_bytes(), line_end(tree.source())].concat();
                        file.edits.insert(mark::place(tree, dialect), &line);
                    }
                }
            }
            file.edits.sort()?;
            files.push(file);
        }
        Ok(files)
    }

    fn refusal(&self, motion: &Motion, change: &Change) -> Option<Reason> {
        if let Some(reason) = motion.reason() {
            return Some(reason);
        }
        if !change.is_representable() {
            return Some(Reason::NumberRange);
        }
        for new in &change.targets {
            if matches!(new, NewTarget::Joint { .. }) {
                return Some(Reason::NoJointForm);
            }
        }
        if change.straightens() && !motion.can_straighten {
            return Some(Reason::NoInsertion);
        }
        if change.before.is_empty() {
            return None;
        }
        if !change.straightens() && !self.contexts[change.motion as usize].insertable {
            return Some(Reason::NoInsertion);
        }
        change.before.iter().find_map(|extra| match (extra.kind, &extra.target) {
            (MotionKind::Linear, NewTarget::Cartesian { .. }) => None,
            (_, NewTarget::Joint { .. }) => Some(Reason::NoJointForm),
            _ => Some(Reason::WrongKind),
        })
    }
}

/// Where a motion is commanded to go.
struct Goal {
    position: [f64; 3],
    /// `None` keeps the orientation words.
    rotation: Option<UnitQuaternion<f64>>,
    via: Option<[f64; 3]>,
}

struct Rewriter<'f, 's> {
    task: &'f Task<'s>,
    options: &'f RewriteOptions,
    edits: &'f mut Vec<Edits>,
    control: ControlState,
    /// Arcs that no circle fits, with the reason.
    unfit_arcs: Vec<(u32, Reason)>,
    ends: MotionEnds<'f>,
}

/// Motions that do not end where a change, or the original, has them.
#[derive(Clone, Copy)]
struct MotionEnds<'f> {
    /// With a change, but at the original end point.
    pinned: &'f BTreeSet<u32>,
    /// Without a change, but in these axes where the motion before them ends.
    carried: &'f BTreeMap<u32, u8>,
}

impl<'s> Rewriter<'_, 's> {
    /// Writes one motion, with its change if it has one.
    fn motion(&mut self, index: u32, change: Option<&Change>) -> RewriteOutcome {
        let task = self.task;
        let motion = &task.listing.motions[index as usize];
        let context = &task.contexts[index as usize];
        let to = motion.cartesian_end();
        let stays = motion.own_reason.is_some_and(|reason| !keeps_endpoint(reason));
        let straightens = change.is_some_and(Change::straightens);
        self.restate_motion_mode(motion, context, straightens);
        let Some(to) = to.filter(|_| !stays) else {
            if context.can_restate {
                self.restate_words(motion, context);
            }
            self.skip_unmodified(motion, context);
            return RewriteOutcome::Unchanged;
        };
        let start = self.control.start(context);
        let new = change.and_then(|change| goal_of(motion, change)).map(|goal| {
            match self.ends.pinned.contains(&index) {
                true => Goal { position: to.position_mm, rotation: None, via: goal.via },
                false => goal,
            }
        });
        let adds = change.is_some_and(|change| !change.before.is_empty());
        if new.is_none() && !adds && self.is_as_intended(context, &start) {
            self.update_after_motion(&to, context, None);
            return RewriteOutcome::Unchanged;
        }
        let carried = self.ends.carried.get(&index).copied().unwrap_or(0);
        let position = std::array::from_fn(|axis| match start[axis].filter(|from| !from.is_nan()) {
            Some(from) if carried & 1 << axis != 0 => from,
            _ => to.position_mm[axis],
        });
        let original = Goal { position, rotation: None, via: via_of(motion) };
        let mut goal = new.unwrap_or(original);
        let mut arc = None;
        let mut outcome = RewriteOutcome::Unchanged;
        if let Some(block_arc) = context.arc
            && !straightens
        {
            let by_radius = task.block_words(motion, context).2.radius.is_some();
            let intended =
                all(context.start).zip(via_of(motion)).map(|(from, via)| [from, via, to.position_mm]);
            arc = intended.and_then(|intended| self.arc(&mut goal, start, context, (intended, by_radius)));
            if arc.is_none() {
                let reason =
                    if block_arc.arc.is_full_circle() { Reason::OpenCircle } else { Reason::WrongShape };
                self.unfit_arcs.push((index, reason));
                // No circle fits: the motion is refused.
                if change.is_some() {
                    outcome = RewriteOutcome::Refused(reason);
                    goal = Goal { position: to.position_mm, rotation: None, via: via_of(motion) };
                    arc = intended
                        .and_then(|intended| self.arc(&mut goal, start, context, (intended, by_radius)));
                }
            }
        }
        let (.., mut slots) = task.block_words(motion, context);
        if straightens {
            self.straighten(motion, &mut slots, change.is_some_and(|change| change.before.is_empty()));
            outcome = RewriteOutcome::InPlace;
        }
        if let Some(change) = change
            && !matches!(outcome, RewriteOutcome::Refused(_))
            && !change.before.is_empty()
        {
            self.extras(motion, context, &slots, &change.before, &to);
            outcome = RewriteOutcome::InPlace;
        }
        let done = self.write(motion, context, &slots, &goal, arc);
        if matches!(outcome, RewriteOutcome::Refused(_)) || done == RewriteOutcome::Unchanged {
            outcome
        } else {
            done
        }
    }

    /// The control state after a motion that was written, or that is unmodified (`commanded` is `None`).
    fn update_after_motion(
        &mut self,
        to: &RobTarget,
        context: &BlockContext,
        commanded: Option<([f64; 3], CommandedOrientation)>,
    ) {
        self.control.intended = to.position_mm.map(Some);
        match commanded {
            None => {
                self.control.position = to.position_mm.map(Some);
                self.control.angles = context.angles;
                self.control.vector = context.vector;
            }
            Some((position, commanded)) => {
                self.control.position = position.map(Some);
                match commanded {
                    CommandedOrientation::Unchanged => {
                        (self.control.angles, self.control.vector) = (context.angles, context.vector)
                    }
                    CommandedOrientation::Angles(angles) => {
                        (self.control.angles, self.control.vector) = (angles.map(Some), None)
                    }
                    CommandedOrientation::Vector(vector, spin) => {
                        (self.control.angles, self.control.vector) = ([None; 3], Some((vector, spin)));
                    }
                }
            }
        }
    }

    /// Writes the words of one block.
    fn write(
        &mut self,
        motion: &Motion,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        goal: &Goal,
        arc: Option<Arc>,
    ) -> RewriteOutcome {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect) = (&task.trees[file], task.dialects[file]);
        let mut edits = std::mem::take(&mut self.edits[file]);
        let mut writer = BlockWriter::new(tree, dialect, &mut edits, slots, context);
        let unit = context.unit_mm;
        let decimals = self.options.position_decimals + u8::from(unit != 1.0) * 2;
        let start = self.control.start(context);
        let to = motion.cartesian_end();
        let intended = to.map_or(goal.position, |to| to.position_mm);
        let mut reached = goal.position;
        for axis in 0..3 {
            let shift = context.shift[axis].unwrap_or(0.0) + self.control.shift_change[axis];
            let from = start[axis].unwrap_or(0.0);
            let word = slots.axes[axis];
            let increment =
                word.and_then(|word| states_increment(tree, dialect, &word)).unwrap_or(!context.absolute);
            let base = if increment { from } else { shift };
            let value = (goal.position[axis] - base) / unit;
            let keep = (from - base) / unit;
            let old_base = if increment { context.start[axis] } else { context.shift[axis] };
            let was = old_base.map_or(f64::NAN, |old| (intended[axis] - old) / unit);
            let name = [b"X", b"Y", b"Z"][axis];
            let value = writer.write_word(AXES + axis, name, value, keep, was, decimals);
            reached[axis] = value * unit + base;
        }
        let commanded = self.orientation(&mut writer, context, slots, goal, file);
        if let (Some(arc), Some(begin)) = (arc, all(start)) {
            let Plane { a, b, .. } = arc.plane;
            let absolute_centre = context.arc.is_some_and(|old| old.centre_absolute);
            let old = context.arc.map(|old| old.arc);
            if slots.radius.is_some() {
                let was = old.and_then(|old| {
                    let length = (context.start[a]? - old.centre_mm[0])
                        .hypot(context.start[b]? - old.centre_mm[1])
                        / unit;
                    Some(if old.is_major() { -length } else { length })
                });
                let length = (begin[a] - arc.centre_mm[0]).hypot(begin[b] - arc.centre_mm[1]) / unit;
                let length = if arc.is_major() { -length } else { length };
                writer.write_word(RADIUS, b"R", length, length, was.unwrap_or(f64::NAN), decimals);
            } else if dialect != Dialect::Heidenhain {
                for (place, axis) in [a, b].into_iter().enumerate() {
                    let word = slots.centre[axis];
                    let increment = word
                        .and_then(|word| states_increment(tree, dialect, &word))
                        .unwrap_or(!absolute_centre);
                    let shift = context.shift[axis].unwrap_or(0.0) + self.control.shift_change[axis];
                    let base = if increment { begin[axis] } else { shift };
                    let value = (arc.centre_mm[place] - base) / unit;
                    // An omitted centre word is that of the start.
                    let keep = (begin[axis] - base) / unit;
                    let old_base = if increment { context.start[axis] } else { context.shift[axis] };
                    let was = old.and_then(|old| Some((old.centre_mm[place] - old_base?) / unit));
                    writer.write_word(
                        CENTRE + axis,
                        [b"I", b"J", b"K"][axis],
                        value,
                        keep,
                        was.unwrap_or(f64::NAN),
                        decimals,
                    );
                }
            }
        }
        let replaced = writer.finish();
        self.edits[file] = edits;
        if let Some(to) = to {
            self.update_after_motion(&to, context, Some((reached, commanded)));
        }
        replaced
    }

    fn orientation(
        &self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        goal: &Goal,
        file: usize,
    ) -> CommandedOrientation {
        let written = match context.orientation_mode {
            OrientationMode::Unknown(_) => None,
            OrientationMode::Angles => {
                let names = [&b"A"[..], b"B", b"C"];
                self.write_angles(writer, context, slots, goal, (names, self.task.angles[file]))
            }
            OrientationMode::Rpy => {
                let names = [&b"A2"[..], b"B2", b"C2"];
                self.write_angles(writer, context, slots, goal, (names, Some(Angles::Wpr)))
            }
            OrientationMode::Vector => self.write_vector(writer, context, slots, goal),
        };
        written.unwrap_or(CommandedOrientation::Unchanged)
    }

    fn write_angles(
        &self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        goal: &Goal,
        (names, convention): ([&[u8]; 3], Option<Angles>),
    ) -> Option<CommandedOrientation> {
        let intended = all(context.angles)?;
        let angles = match (goal.rotation, convention) {
            (Some(rotation), Some(angles)) => angles.angles(&rotation, intended),
            _ => intended,
        };
        let mut reached = angles;
        for axis in 0..3 {
            let from = self.control.angles[axis].or(context.start_angles[axis]);
            let word = slots.angles[axis];
            let increment = word
                .and_then(|word| states_increment(writer.tree, writer.dialect, &word))
                .unwrap_or(!context.absolute);
            let base = if increment { from.unwrap_or(0.0) } else { 0.0 };
            // An angle that no block before has stated has a word in this block.
            let keep = from.map_or(angles[axis], |from| from - base);
            let old_base = if increment { context.start_angles[axis] } else { Some(0.0) };
            let was = old_base.map_or(f64::NAN, |old| intended[axis] - old);
            let decimals = self.options.joint_decimals;
            let value =
                writer.write_word(ANGLES + axis, names[axis], angles[axis] - base, keep, was, decimals);
            reached[axis] = value + base;
        }
        Some(CommandedOrientation::Angles(reached))
    }

    fn write_vector(
        &self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        goal: &Goal,
    ) -> Option<CommandedOrientation> {
        let (intended, intended_spin) = context.vector?;
        let length = intended.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (vector, spin) = match &goal.rotation {
            Some(rotation) => {
                let (vector, spin) = vector_and_spin(rotation, intended_spin);
                // Keep the length of the vector, which need not be 1.
                (vector.map(|x| x * length), spin)
            }
            None => (intended, intended_spin),
        };
        let decimals = self.options.quaternion_decimals;
        let names = vector_names(writer.dialect, context);
        let before = self.control.vector.or(context.start_vector);
        let stated = slots.vector.iter().any(Option::is_some);
        let holds = before.is_some_and(|(old, _)| (0..3).all(|i| !differs(old[i], vector[i], decimals)));
        if stated || !holds {
            for axis in 0..3 {
                // An omitted component is 0.
                writer.write_word(VECTOR + axis, names[axis], vector[axis], 0.0, intended[axis], decimals);
            }
        }
        if writer.dialect == Dialect::Siemens {
            let held = before.map_or(0.0, |(_, spin)| spin);
            writer.write_word(SPIN, b"THETA", spin, held, intended_spin, self.options.joint_decimals);
        }
        Some(CommandedOrientation::Vector(vector, spin))
    }

    /// Inserts blocks before a block, in the style of its words.
    fn extras(
        &mut self,
        motion: &Motion,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        extras: &[Extra],
        to: &RobTarget,
    ) {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect) = (&task.trees[file], task.dialects[file]);
        let source = tree.source();
        let begin = motion.statement.start as usize;
        let mut text = Vec::new();
        for extra in extras {
            let NewTarget::Cartesian { position_mm, quaternion, .. } = extra.target else { continue };
            let rotation = Frame { position_mm, quaternion }.pose().rotation;
            let mut scratch = Edits::new();
            let mut writer = BlockWriter {
                tree,
                dialect,
                edits: &mut scratch,
                order: [None; ORDER],
                end: 0,
                added: Vec::new(),
                replaced: RewriteOutcome::Unchanged,
                spaced: true,
                lead: None,
            };
            let unit = context.unit_mm;
            let decimals = self.options.position_decimals + u8::from(unit != 1.0) * 2;
            let mut reached = position_mm;
            for axis in 0..3 {
                let from = self.control.position[axis].or(context.start[axis]).unwrap_or(0.0);
                let shift = context.shift[axis].unwrap_or(0.0) + self.control.shift_change[axis];
                let base = if context.absolute { shift } else { from };
                let value = (position_mm[axis] - base) / unit;
                let value = writer.write_word(
                    AXES + axis,
                    [b"X", b"Y", b"Z"][axis],
                    value,
                    f64::NAN,
                    f64::NAN,
                    decimals,
                );
                reached[axis] = value * unit + base;
            }
            let none = WordSlots::default();
            let goal = Goal { position: position_mm, rotation: Some(rotation), via: None };
            let commanded = self.orientation(&mut writer, context, &none, &goal, file);
            let words = writer.added;
            text.extend_from_slice(b"G1");
            if let Some(distance) = slots.distance {
                text.push(b' ');
                text.extend_from_slice(&source[tree.range(distance.first, distance.end)]);
            }
            text.extend_from_slice(&words);
            if let Some(feed) = slots.feed {
                text.push(b' ');
                text.extend_from_slice(&source[tree.range(feed.first, feed.end)]);
            }
            text.extend_from_slice(line_end(source));
            self.update_after_motion(to, context, Some((reached, commanded)));
        }
        self.edits[file].insert(begin, &text);
    }
}

/// The orientation as it was written.
enum CommandedOrientation {
    Unchanged,
    Angles([f64; 3]),
    Vector([f64; 3], f64),
}

/// The words of a tool vector.
fn vector_names(dialect: Dialect, context: &BlockContext) -> [&'static [u8]; 3] {
    match (dialect, context.vector_words) {
        (_, true) => [b"I", b"J", b"K"],
        (Dialect::Heidenhain, _) => [b"TX", b"TY", b"TZ"],
        _ => [b"A3", b"B3", b"C3"],
    }
}

fn all(values: [Option<f64>; 3]) -> Option<[f64; 3]> {
    Some([values[0]?, values[1]?, values[2]?])
}

/// Whether a motion that is left for this reason still ends where its words state in the work frame, so that omitted
/// words must be restated.
fn keeps_endpoint(reason: Reason) -> bool {
    matches!(
        reason,
        Reason::RadiusCompensation
            | Reason::NoTcpMode
            | Reason::ToolUnknown
            | Reason::LengthAllowance
            | Reason::WorkObjectUnknown
            | Reason::CentreElsewhere
            | Reason::BeforeUnmodifiedArc
            | Reason::BeforeUnmodifiedPath
    )
}

/// Whether a correction may give a block words of positions: it moves the motion, or restates what the block omits.
pub(super) fn may_get_words(motion: &Motion, context: &BlockContext) -> bool {
    motion.own_reason.is_none_or(keeps_endpoint) || context.can_restate
}

fn via_of(motion: &Motion) -> Option<[f64; 3]> {
    let target = motion.via()?;
    match target.value {
        Ok(TargetValue::Cartesian(target)) => Some(target.position_mm),
        _ => None,
    }
}

fn goal_of(motion: &Motion, change: &Change) -> Option<Goal> {
    let mut goal: Option<Goal> = None;
    let mut via = via_of(motion);
    for (target, new) in motion.targets.iter().zip(&change.targets) {
        let NewTarget::Cartesian { position_mm, quaternion, .. } = *new else { continue };
        match target.role {
            Role::Via => via = Some(position_mm),
            Role::To => {
                let rotation = Some(Frame { position_mm, quaternion }.pose().rotation);
                goal = Some(Goal { position: position_mm, rotation, via: None });
            }
        }
    }
    let mut goal = goal?;
    goal.via = via;
    Some(goal)
}
