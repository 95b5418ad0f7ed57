//! Endpoints pinned because unmodified blocks depend on them: an origin set at the tool position (G92), an increment,
//! a position that the program reads, an axis that the block does not state.
//!
//! Method: a reaching-definitions analysis over the events of a file. For each axis it tracks the set of modified
//! motions on which the tool position, and the origin, depend. In an unmodified motion that cannot be restated, an
//! absolute value depends on the origin and an increment on the position. At a join the position depends on the
//! positions at all branches, and the origin on all places where origins are set; both sets are collected over the
//! whole file and substituted at its end, which accounts for loops and backward jumps.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::keeps_endpoint;
use super::word_slots::{WordSlots, states_increment};
use crate::motion::{Motion, MotionKind, Reason};
use crate::nc::dialect::Dialect;
use crate::nc::expression::literal;
use crate::nc::syntax::{NcTree, Word, WordValue};
use crate::nc::task::{StartDependency, StateEvent, Task};
use crate::rewrite::RewriteOutcome;

/// The most motions in one dependency set; beyond it the set is all motions of the file.
const SINGLE: usize = 4;

/// X, Y, Z, A, B, C.
const AXES: usize = 6;
/// All of them as bits.
const ALL: u8 = 0b11_1111;

/// What a coordinate depends on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Dependencies {
    motions: [Option<u32>; SINGLE],
    /// All modified motions of the file.
    all_motions: bool,
    /// The positions at branches.
    branches: bool,
    /// The positions where origins are set.
    origins: bool,
    /// Whether its displacement differs between paths.
    path_dependent: bool,
}

impl Dependencies {
    const NONE: Dependencies = Dependencies {
        motions: [None; SINGLE],
        all_motions: false,
        branches: false,
        origins: false,
        path_dependent: false,
    };

    fn on_motion(motion: u32) -> Dependencies {
        let mut motions = [None; SINGLE];
        motions[0] = Some(motion);
        Dependencies { motions, ..Dependencies::NONE }
    }

    fn is_empty(&self) -> bool {
        self.motions[0].is_none() && !self.all_motions && !self.branches && !self.origins
    }

    fn union(mut self, other: Dependencies) -> Dependencies {
        for motion in other.motions.into_iter().flatten() {
            if self.motions.contains(&Some(motion)) {
                continue;
            }
            match self.motions.iter_mut().find(|position| position.is_none()) {
                Some(free) => *free = Some(motion),
                None => self.all_motions = true,
            }
        }
        self.all_motions |= other.all_motions;
        self.branches |= other.branches;
        self.origins |= other.origins;
        self.path_dependent |= other.path_dependent;
        self
    }
}

/// The union of dependencies over many places.
#[derive(Debug, Clone, Default)]
struct DependencySet {
    motions: BTreeSet<u32>,
    all_motions: bool,
    branches: bool,
    origins: bool,
}

impl DependencySet {
    fn add(&mut self, dependencies: &Dependencies) {
        self.motions.extend(dependencies.motions.iter().flatten());
        self.all_motions |= dependencies.all_motions;
        self.branches |= dependencies.branches;
        self.origins |= dependencies.origins;
    }

    fn join(&mut self, other: &DependencySet) {
        self.motions.extend(&other.motions);
        self.all_motions |= other.all_motions;
        self.branches |= other.branches;
        self.origins |= other.origins;
    }

    /// Substitutes the sets of branches and origins that it refers to.
    fn resolved(mut self, branches: &DependencySet, origins: &DependencySet) -> DependencySet {
        for _ in 0..2 {
            if self.branches {
                self.join(branches);
            }
            if self.origins {
                self.join(origins);
            }
        }
        self
    }
}

/// The analysis state within one file.
#[derive(Default)]
struct FileDependencies {
    position: [Dependencies; AXES],
    origin: [Dependencies; 3],
    /// The positions at branches.
    branches: [DependencySet; AXES],
    /// The positions where origins are set.
    origins: [DependencySet; 3],
    /// What must not move, by cause.
    pinned: [[DependencySet; AXES]; CAUSES.len()],
    file_motions: std::ops::Range<u32>,
    /// Whether the axis directions may change anywhere in the file: joins then mix axes.
    mixes_axes: bool,
    /// The axes that the canned cycle before has stated: a block that repeats it there takes its word, wherever the tool has returned to.
    stated_by_cycle: [bool; 3],
}

/// The causes in [`FileDependencies::pinned`].
const ORIGIN: usize = 0;
const INCREMENT: usize = 1;
const OMITTED: usize = 2;
const CAUSES: [Reason; 3] = [Reason::BeforeOrigin, Reason::BeforeIncrement, Reason::BeforeOmitted];

impl FileDependencies {
    fn pin_position(&mut self, dependency: usize, axis: usize) {
        self.pinned[dependency][axis].add(&self.position[axis]);
    }

    fn pin_origin(&mut self, axis: usize) {
        self.pinned[ORIGIN][axis].add(&self.origin[axis]);
    }

    fn event(&mut self, event: &StateEvent) {
        if !matches!(event, StateEvent::AxesUnknown(_)) {
            self.stated_by_cycle = [false; 3];
        }
        match *event {
            StateEvent::OriginSet { stated, named } => {
                for axis in (0..3).filter(|&axis| named[axis]) {
                    if stated[axis].is_none() || self.position[axis].path_dependent {
                        // The displacement of the origin is not computable.
                        self.pin_position(ORIGIN, axis);
                    }
                    self.origin[axis] = self.position[axis];
                    self.origins[axis].add(&self.position[axis]);
                }
            }
            StateEvent::ShiftStated(axes) => {
                (0..3).filter(|&axis| axes[axis]).for_each(|axis| self.origin[axis] = Dependencies::NONE);
            }
            StateEvent::ShiftMaybeStated(axes) => {
                (0..3).filter(|&axis| axes[axis]).for_each(|axis| self.pin_origin(axis));
            }
            StateEvent::ShiftRestored => self.origin.iter_mut().for_each(|origin| origin.origins = true),
            StateEvent::PositionUsed { axes, read } => {
                let dependency = if read { INCREMENT } else { ORIGIN };
                (0..AXES)
                    .filter(|axis| axes & 1 << axis != 0)
                    .for_each(|axis| self.pin_position(dependency, axis));
            }
            StateEvent::Branch => self.branch(),
            StateEvent::Join => {
                self.branch();
                for position in &mut self.position {
                    (position.branches, position.path_dependent) = (true, true);
                }
                self.origin.iter_mut().for_each(|origin| origin.origins = true);
            }
            StateEvent::PoseUnknown => self.mix_axes(),
            StateEvent::FileStart
            | StateEvent::AxesUnknown(_)
            | StateEvent::FrameMoved(_)
            | StateEvent::Motion(_) => {}
        }
    }

    /// X, Y and Z may have other directions from here on.
    fn mix_axes(&mut self) {
        let [x, y, z, ..] = self.position;
        self.position[..3].fill(x.union(y).union(z));
        let [x, y, z] = self.origin;
        self.origin.fill(x.union(y).union(z));
    }

    fn branch(&mut self) {
        if self.mixes_axes {
            self.mix_axes();
        }
        for (all, position) in self.branches.iter_mut().zip(&self.position) {
            all.add(position);
        }
    }

    /// The motions that must not move, by cause.
    fn pinned_motions(&self) -> [DependencySet; CAUSES.len()] {
        std::array::from_fn(|dependency| {
            let mut all = DependencySet::default();
            for (axis, pinned) in self.pinned[dependency].iter().enumerate() {
                let none = DependencySet::default();
                let origins = self.origins.get(axis).unwrap_or(&none);
                all.join(&pinned.clone().resolved(&self.branches[axis], origins));
            }
            all
        })
    }
}

impl Task<'_> {
    /// Refuses the motions on whose end points unmodified words depend, and puts those of `carried` back in all axes. Returns whether there
    /// are any.
    pub(super) fn refuse_position_dependents(
        &self,
        pinned: &BTreeSet<u32>,
        wanted: &mut HashMap<u32, usize>,
        carried: &mut BTreeMap<u32, u8>,
        outcomes: &mut [RewriteOutcome],
    ) -> bool {
        let mut state = FileDependencies::default();
        let mut refused: Vec<(u32, Reason)> = Vec::new();
        let mut end = |state: &FileDependencies| {
            for (set, reason) in state.pinned_motions().iter().zip(CAUSES) {
                let all = state.file_motions.clone().filter(|_| set.all_motions);
                refused.extend(set.motions.iter().copied().chain(all).map(|motion| (motion, reason)));
            }
        };
        for (at, event) in self.events.iter().enumerate() {
            match *event {
                StateEvent::FileStart => {
                    end(&state);
                    let next = state.file_motions.end;
                    let of_file =
                        self.events[at + 1..].iter().take_while(|event| **event != StateEvent::FileStart);
                    let mut moving = of_file.skip_while(|event| !matches!(event, StateEvent::Motion(_)));
                    let mixes_axes = moving.any(|event| *event == StateEvent::PoseUnknown);
                    state = FileDependencies {
                        file_motions: next..next,
                        mixes_axes,
                        ..FileDependencies::default()
                    };
                }
                StateEvent::Motion(motion) => {
                    state.file_motions.end = motion + 1;
                    let moves = wanted.contains_key(&motion) && !pinned.contains(&motion);
                    let moved = if moves { ALL } else { carried.get(&motion).copied().unwrap_or(0) };
                    self.transfer(motion, moved, &mut state);
                }
                _ => state.event(event),
            }
        }
        end(&state);
        let mut any = false;
        for (motion, reason) in refused {
            any |= !wanted.contains_key(&motion) && carried.remove(&motion).is_some();
            if let Some(change) = wanted.remove(&motion) {
                outcomes[change] = RewriteOutcome::Refused(reason);
                any = true;
            }
        }
        any
    }

    /// After a skippable block the tool is at the corrected or the original position, so that no increment from there
    /// is right on both paths.
    fn pin_path_dependent_increments(&self, index: u32, state: &mut FileDependencies) {
        if !state.position.iter().any(|position| position.path_dependent) {
            return;
        }
        let (motion, context) = (&self.listing.motions[index as usize], &self.contexts[index as usize]);
        let (tree, dialect, slots) = self.block_words(motion, context);
        for (axis, word) in slots.axes.iter().chain(&slots.angles).enumerate() {
            let counts = word
                .as_ref()
                .and_then(|word| states_increment(tree, dialect, word))
                .unwrap_or(!context.absolute);
            if counts && state.position[axis].path_dependent {
                state.pin_position(INCREMENT, axis);
            }
        }
    }

    /// The transfer function of a motion that does not end at its original place in the axes `moved` (bits).
    fn transfer(&self, index: u32, moved: u8, state: &mut FileDependencies) {
        let (motion, context) = (&self.listing.motions[index as usize], &self.contexts[index as usize]);
        let known = motion.to().is_some_and(|target| target.value.is_ok());
        if known {
            self.pin_path_dependent_increments(index, state);
        }
        let stated_by_cycle = std::mem::take(&mut state.stated_by_cycle);
        if known && motion.own_reason.is_none_or(keeps_endpoint) {
            // It is rewritten, or omitted words are restated.
            state.position = std::array::from_fn(|axis| match moved & 1 << axis {
                0 => Dependencies::NONE,
                _ => Dependencies::on_motion(index),
            });
            return;
        }
        let (tree, dialect, slots) = self.block_words(motion, context);
        let reason = motion.reason();
        let machine = reason == Some(Reason::MachineCoordinates);
        let returns = reason == Some(Reason::ReferenceReturn);
        let cycle = motion.kind == MotionKind::Unknown && reason == Some(Reason::Cycle);
        let restates = context.can_restate && known && slots.axes.iter().any(Option::is_some);
        let elsewhere = machine || returns || reason == Some(Reason::ExternalOnly);
        let states_axis = slots.axes.iter().any(Option::is_some);
        let moves = may_move(motion, &slots, dialect);
        let gets_words = context.can_restate && states_axis;
        let before = state.position;
        for (axis, was) in before.iter().enumerate() {
            let linear = axis < 3;
            let word = if linear { slots.axes[axis] } else { slots.angles[axis - 3] };
            let start = if linear { context.start[axis] } else { context.start_angles[axis - 3] };
            if linear && context.may_omit_words && moves && !elsewhere {
                // The control may ignore the word of an axis, so that it ends where the motion before does.
                state.pin_position(OMITTED, axis);
            }
            let increment =
                word.map(|word| states_increment(tree, dialect, &word).unwrap_or(!context.absolute));
            match (word, increment) {
                _ if restates && linear && start.is_some() => state.position[axis] = Dependencies::NONE,
                (Some(_), Some(false)) if restates && linear => state.position[axis] = Dependencies::NONE,
                (Some(word), Some(true)) if returns && is_zero(tree, &word) => {
                    state.position[axis] = Dependencies::NONE;
                }
                (Some(_), _) if machine => state.position[axis] = Dependencies::NONE,
                // It may be relative to the position or to the origin.
                (Some(word), _)
                    if context.distance_mode_unknown && states_increment(tree, dialect, &word).is_none() =>
                {
                    state.pin_position(INCREMENT, axis);
                    if linear {
                        state.pin_origin(axis);
                        state.position[axis] = was.union(state.origin[axis]);
                    }
                }
                (Some(_), Some(true)) => state.pin_position(INCREMENT, axis),
                // A canned cycle may return to the level at which it began (G98), whatever its words state.
                (Some(_), _) if cycle && linear => {
                    state.stated_by_cycle[axis] = !motion.conditional && !context.may_omit_words;
                    state.pin_origin(axis);
                    state.position[axis] = was.union(state.origin[axis]);
                }
                (Some(_), _) => {
                    if linear {
                        state.pin_origin(axis);
                    }
                    state.position[axis] =
                        if linear && !returns { state.origin[axis] } else { Dependencies::NONE };
                }
                (None, _) if cycle && linear && stated_by_cycle[axis] => state.stated_by_cycle[axis] = true,
                // It ends where the motion before does in this axis.
                // Where the motion before ended is not restated behind a join, at which it is open.
                (None, _) if linear && gets_words && start.is_some() && !was.branches => {}
                (None, _) if linear && moves && !elsewhere => state.pin_position(OMITTED, axis),
                (None, _) => {}
            }
            if motion.conditional || context.may_omit_words {
                let dependencies = state.position[axis].union(*was);
                state.position[axis] =
                    Dependencies { path_dependent: !dependencies.is_empty(), ..dependencies };
            }
        }
        self.pin_start_and_origin(index, known, elsewhere, &before, state);
    }

    /// Pins what an unmodified block depends on beyond the words of its axes: its start (arcs), and the origin.
    fn pin_start_and_origin(
        &self,
        index: u32,
        known: bool,
        elsewhere: bool,
        before: &[Dependencies; AXES],
        state: &mut FileDependencies,
    ) {
        let motion = &self.listing.motions[index as usize];
        if self.start_dependency(index as usize, true) != StartDependency::Independent {
            let axes = self.pinned_start_axes(index as usize, true, 0);
            for axis in (0..3).filter(|axis| axes & 1 << axis != 0) {
                state.pinned[INCREMENT][axis].add(&before[axis]);
            }
        }
        let absolute_centre = motion.kind == MotionKind::Circular && !known;
        if motion.kind == MotionKind::Unknown && !elsewhere || absolute_centre {
            // Its words, or the subprogram, may be relative to the origin in any axis.
            (0..3).for_each(|axis| state.pin_origin(axis));
        }
    }
}

/// Whether a block that is left may move an axis.
fn may_move(motion: &Motion, slots: &WordSlots<'_>, dialect: Dialect) -> bool {
    if motion.kind != MotionKind::Unknown {
        return true;
    }
    let arc = slots.radius.is_some() || slots.centre.iter().any(Option::is_some);
    let states_any = slots.axes.iter().any(Option::is_some) || slots.turns || arc;
    match motion.reason() {
        Some(Reason::Subprogram) => false,
        // A word that was not read may have been that of an axis.
        Some(Reason::UnknownWord) => states_any || slots.mode.is_some() || dialect == Dialect::Heidenhain,
        Some(Reason::Cycle | Reason::TiltsTool) => true,
        _ => states_any,
    }
}

fn is_zero(tree: &NcTree<'_>, word: &Word<'_>) -> bool {
    matches!(word.value, WordValue::Literal { number, .. } if literal(tree.text(number)) == Some(0.0))
}
