//! Ends that stay because something that stays counts from them: an origin that is set where the tool stands (G92), an
//! increment, a position that the program reads.
//!
//! Method: for each axis, which motions that shall move the place of the tool hangs on, and which the origin; followed
//! through the events of the file. A motion that stays and cannot be mended by the words that are said again is told by its own
//! words: a value counts from the origin, an increment from the place. Where ways meet, the place may hang on what holds
//! wherever a jump may begin, and the origin on every place where one is set: both are gathered over the whole file
//! and put in at its end, so that loops and jumps back are counted.

use std::collections::{BTreeSet, HashMap};

use super::keeps_endpoint;
use super::word_slots::{slots, states_increment};
use crate::motion::{MotionKind, Reason};
use crate::nc::expression::literal;
use crate::nc::syntax::{NcTree, Word, WordValue};
use crate::nc::task::{StartDependency, StateEvent, Task};
use crate::rewrite::Outcome;

/// More single motions are not told apart: all of the file then.
const SINGLE: usize = 4;

/// Axes: X, Y, Z, A, B, C.
const AXES: usize = 6;

/// What a coordinate hangs on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Dependencies {
    on: [Option<u32>; SINGLE],
    /// All motions of the file that move.
    on_all: bool,
    /// On the places where jumps may begin.
    places: bool,
    /// On the places where origins are set.
    origins: bool,
    /// Whether how far it has moved differs from way to way.
    unsettled: bool,
}

impl Dependencies {
    const NOTHING: Dependencies =
        Dependencies { on: [None; SINGLE], on_all: false, places: false, origins: false, unsettled: false };

    fn only(motion: u32) -> Dependencies {
        let mut on = [None; SINGLE];
        on[0] = Some(motion);
        Dependencies { on, ..Dependencies::NOTHING }
    }

    fn is_nothing(&self) -> bool {
        self.on[0].is_none() && !self.on_all && !self.places && !self.origins
    }

    fn and(mut self, other: Dependencies) -> Dependencies {
        for motion in other.on.into_iter().flatten() {
            if self.on.contains(&Some(motion)) {
                continue;
            }
            match self.on.iter_mut().find(|place| place.is_none()) {
                Some(free) => *free = Some(motion),
                None => self.on_all = true,
            }
        }
        self.on_all |= other.on_all;
        self.places |= other.places;
        self.origins |= other.origins;
        self.unsettled |= other.unsettled;
        self
    }
}

/// The same over many places.
#[derive(Debug, Clone, Default)]
struct DependencySet {
    on: BTreeSet<u32>,
    on_all: bool,
    places: bool,
    origins: bool,
}

impl DependencySet {
    fn add(&mut self, hangs: &Dependencies) {
        self.on.extend(hangs.on.iter().flatten());
        self.on_all |= hangs.on_all;
        self.places |= hangs.places;
        self.origins |= hangs.origins;
    }

    fn join(&mut self, other: &DependencySet) {
        self.on.extend(&other.on);
        self.on_all |= other.on_all;
        self.places |= other.places;
        self.origins |= other.origins;
    }

    /// With the places and origins that it names.
    fn whole(mut self, places: &DependencySet, origins: &DependencySet) -> DependencySet {
        for _ in 0..2 {
            if self.places {
                self.join(places);
            }
            if self.origins {
                self.join(origins);
            }
        }
        self
    }
}

/// One file while its events are followed.
#[derive(Default)]
struct FileDependencies {
    place: [Dependencies; AXES],
    origin: [Dependencies; 3],
    /// Where jumps may begin.
    places: [DependencySet; AXES],
    /// Where origins are set.
    origins: [DependencySet; 3],
    /// What must not move: because of origins, because of increments.
    held: [[DependencySet; AXES]; 2],
    motions: std::ops::Range<u32>,
    /// Whether the axes may turn anywhere in the file: where ways meet they may come from another frame.
    turns: bool,
}

/// The two reasons in [`Course::held`].
const BY_ORIGIN: usize = 0;
const BY_INCREMENT: usize = 1;

impl FileDependencies {
    fn hold_place(&mut self, why: usize, axis: usize) {
        self.held[why][axis].add(&self.place[axis]);
    }

    fn hold_origin(&mut self, axis: usize) {
        self.held[BY_ORIGIN][axis].add(&self.origin[axis]);
    }

    fn event(&mut self, event: &StateEvent) {
        match *event {
            StateEvent::OriginSet { stated, named } => {
                for axis in (0..3).filter(|&axis| named[axis]) {
                    if stated[axis].is_none() || self.place[axis].unsettled {
                        // By how much it moves cannot be counted.
                        self.hold_place(BY_ORIGIN, axis);
                    }
                    self.origin[axis] = self.place[axis];
                    self.origins[axis].add(&self.place[axis]);
                }
            }
            StateEvent::ShiftStated(axes) => {
                (0..3).filter(|&axis| axes[axis]).for_each(|axis| self.origin[axis] = Dependencies::NOTHING);
            }
            StateEvent::ShiftMaybeStated(axes) => {
                (0..3).filter(|&axis| axes[axis]).for_each(|axis| self.hold_origin(axis));
            }
            StateEvent::ShiftRestored => self.origin.iter_mut().for_each(|origin| origin.origins = true),
            StateEvent::PositionUsed { axes, read } => {
                let why = if read { BY_INCREMENT } else { BY_ORIGIN };
                (0..AXES).filter(|axis| axes & 1 << axis != 0).for_each(|axis| self.hold_place(why, axis));
            }
            StateEvent::Branch => self.leave(),
            StateEvent::Join => {
                self.leave();
                for place in &mut self.place {
                    (place.places, place.unsettled) = (true, true);
                }
                self.origin.iter_mut().for_each(|origin| origin.origins = true);
            }
            StateEvent::PoseUnknown => self.turn(),
            StateEvent::FileStart | StateEvent::AxesUnknown(_) | StateEvent::Motion(_) => {}
        }
    }

    /// X, Y and Z may be other directions from here on.
    fn turn(&mut self) {
        let [x, y, z, ..] = self.place;
        self.place[..3].fill(x.and(y).and(z));
        let [x, y, z] = self.origin;
        self.origin.fill(x.and(y).and(z));
    }

    fn leave(&mut self) {
        if self.turns {
            self.turn();
        }
        for (all, place) in self.places.iter_mut().zip(&self.place) {
            all.add(place);
        }
    }

    /// The motions that must not move, and why.
    fn ends(&self) -> [DependencySet; 2] {
        std::array::from_fn(|why| {
            let mut all = DependencySet::default();
            for (axis, held) in self.held[why].iter().enumerate() {
                let none = DependencySet::default();
                let origins = self.origins.get(axis).unwrap_or(&none);
                all.join(&held.clone().whole(&self.places[axis], origins));
            }
            all
        })
    }
}

impl Task<'_> {
    /// Refuses the motions from whose ends something counts that stays. Whether there is one.
    pub(super) fn refuse_position_dependents(
        &self,
        pinned: &BTreeSet<u32>,
        wanted: &mut HashMap<u32, usize>,
        outcomes: &mut [Outcome],
    ) -> bool {
        let mut course = FileDependencies::default();
        let mut refused: Vec<(u32, Reason)> = Vec::new();
        let mut end = |course: &FileDependencies| {
            for (gathered, reason) in
                course.ends().iter().zip([Reason::BeforeOrigin, Reason::BeforeIncrement])
            {
                let all = course.motions.clone().filter(|_| gathered.on_all);
                refused.extend(gathered.on.iter().copied().chain(all).map(|motion| (motion, reason)));
            }
        };
        for (at, event) in self.events.iter().enumerate() {
            match *event {
                StateEvent::FileStart => {
                    end(&course);
                    let next = course.motions.end;
                    let of_file =
                        self.events[at + 1..].iter().take_while(|event| **event != StateEvent::FileStart);
                    let mut moving = of_file.skip_while(|event| !matches!(event, StateEvent::Motion(_)));
                    let turns = moving.any(|event| *event == StateEvent::PoseUnknown);
                    course = FileDependencies { motions: next..next, turns, ..FileDependencies::default() };
                }
                StateEvent::Motion(motion) => {
                    course.motions.end = motion + 1;
                    let moves = wanted.contains_key(&motion) && !pinned.contains(&motion);
                    self.goes(motion, moves, &mut course);
                }
                _ => course.event(event),
            }
        }
        end(&course);
        let mut any = false;
        for (motion, reason) in refused {
            if let Some(change) = wanted.remove(&motion) {
                outcomes[change] = Outcome::Refused(reason);
                any = true;
            }
        }
        any
    }

    /// After a block that may be skipped the tool stands as corrected or as it always did: no increment can be written from
    /// there that is right on both ways.
    fn hold_unsettled(&self, index: u32, course: &mut FileDependencies) {
        if !course.place.iter().any(|place| place.unsettled) {
            return;
        }
        let (motion, context) = (&self.listing.motions[index as usize], &self.contexts[index as usize]);
        let file = motion.place.file as usize;
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        let slots = slots(tree, dialect, context);
        for (axis, word) in slots.axes.iter().chain(&slots.angles).enumerate() {
            let counts = word
                .as_ref()
                .and_then(|word| states_increment(tree, dialect, word))
                .unwrap_or(!context.absolute);
            if counts && course.place[axis].unsettled {
                course.hold_place(BY_INCREMENT, axis);
            }
        }
    }

    /// What a motion makes of place and origin.
    fn goes(&self, index: u32, moves: bool, course: &mut FileDependencies) {
        let (motion, context) = (&self.listing.motions[index as usize], &self.contexts[index as usize]);
        let known = motion.to().is_some_and(|target| target.value.is_ok());
        if known {
            self.hold_unsettled(index, course);
        }
        if known && motion.left.is_none_or(keeps_endpoint) {
            // It is written anew, or says again what must be said again.
            let hangs = if moves { Dependencies::only(index) } else { Dependencies::NOTHING };
            course.place = [hangs; AXES];
            return;
        }
        let file = motion.place.file as usize;
        let (tree, dialect) = (&self.trees[file], self.dialects[file]);
        let slots = slots(tree, dialect, context);
        let reason = motion.reason();
        let machine = reason == Some(Reason::MachineCoordinates);
        let returns = reason == Some(Reason::ReferenceReturn);
        let mends = context.can_restate && known && slots.axes.iter().any(Option::is_some);
        let before = course.place;
        for (axis, was) in before.iter().enumerate() {
            let linear = axis < 3;
            let word = if linear { slots.axes[axis] } else { slots.angles[axis - 3] };
            let start = if linear { context.start[axis] } else { context.start_angles[axis - 3] };
            let increment =
                word.map(|word| states_increment(tree, dialect, &word).unwrap_or(!context.absolute));
            match (word, increment) {
                _ if mends && linear && start.is_some() => course.place[axis] = Dependencies::NOTHING,
                (Some(_), Some(false)) if mends && linear => course.place[axis] = Dependencies::NOTHING,
                (Some(word), Some(true)) if returns && is_zero(tree, &word) => {
                    course.place[axis] = Dependencies::NOTHING;
                }
                (Some(_), _) if machine => course.place[axis] = Dependencies::NOTHING,
                // It may count from the place or from the origin.
                (Some(word), _)
                    if context.distance_mode_unknown && states_increment(tree, dialect, &word).is_none() =>
                {
                    course.hold_place(BY_INCREMENT, axis);
                    if linear {
                        course.hold_origin(axis);
                        course.place[axis] = was.and(course.origin[axis]);
                    }
                }
                (Some(_), Some(true)) => course.hold_place(BY_INCREMENT, axis),
                (Some(_), _) => {
                    if linear {
                        course.hold_origin(axis);
                    }
                    course.place[axis] =
                        if linear && !returns { course.origin[axis] } else { Dependencies::NOTHING };
                }
                (None, _) => {}
            }
            if motion.conditional || context.may_omit_words {
                let hangs = course.place[axis].and(*was);
                course.place[axis] = Dependencies { unsettled: !hangs.is_nothing(), ..hangs };
            }
        }
        if self.start_dependency(index as usize, true) != StartDependency::Independent {
            let axes = self.start_axes(index as usize, true, 0);
            for axis in (0..3).filter(|axis| axes & 1 << axis != 0) {
                course.held[BY_INCREMENT][axis].add(&before[axis]);
            }
        }
        let elsewhere = machine || returns || reason == Some(Reason::ExternalOnly);
        let absolute_centre = motion.kind == MotionKind::Circular && !known;
        if motion.kind == MotionKind::Unknown && !elsewhere || absolute_centre {
            // Its words, or what it calls, may count from the origin in any axis.
            (0..3).for_each(|axis| course.hold_origin(axis));
        }
    }
}

fn is_zero(tree: &NcTree<'_>, word: &Word<'_>) -> bool {
    matches!(word.value, WordValue::Literal { number, .. } if literal(tree.text(number)) == Some(0.0))
}
