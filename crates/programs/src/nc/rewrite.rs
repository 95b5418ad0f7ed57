//! New values to edits of NC text.
//!
//! Words keep their order, spacing and at least their decimals; a word that was left out because it held on is put in
//! where its axis must now change, and a word of a motion that stays is put in where the motion before it has moved, so
//! that what is left as it is goes where it always went. Arcs get the centre (or radius) of the circle through their new
//! start, middle and end, as long as it keeps to the way that was meant, with the numbers as they are written.

mod again;
mod arcs;
mod ends;
mod long;
mod now;
mod origins;
mod pen;
mod slots;

use std::collections::{BTreeSet, HashMap};

use nalgebra::UnitQuaternion;

use self::now::Now;
use self::pen::{Pen, differs};
use self::slots::{ANGLES, AXES, CENTRE, ORDER, RADIUS, SPIN, Slots, VECTOR, said, slots};
use super::arc::{Arc, Plane};
use super::dialect::Dialect;
use super::machine::Turn;
use super::mark;
use super::orientation::{Angles, vector_and_spin};
use super::task::{Event, Task, Written};
use crate::edit::{EditError, Edits};
use crate::motion::{Frame, Motion, MotionKind, Reason, RobTarget, Role, TargetValue};
use crate::rewrite::{Change, Extra, FileEdits, NewTarget, Outcome, RewriteOptions, Rewritten};

/// How often a rewrite begins anew because an arc does not fit; a file that asks for more is left as it is.
const ROUNDS: u32 = 32;

impl Task<'_> {
    /// The edits that make the changes; per file sorted and disjoint.
    ///
    /// # Errors
    /// Edits that overlap, which is a defect of this module.
    pub fn rewrite(&self, changes: &[Change], options: &RewriteOptions) -> Result<Rewritten, EditError> {
        let mut outcomes = vec![Outcome::Unchanged; changes.len()];
        let mut wanted: HashMap<u32, usize> = HashMap::with_capacity(changes.len());
        for (index, change) in changes.iter().enumerate() {
            let refusal = match self.listing.motions.get(change.motion as usize) {
                None => Some(Reason::MissingArgument),
                Some(_) if wanted.contains_key(&change.motion) => Some(Reason::WrongKind),
                Some(motion) => self.refusal(motion, change),
            };
            match refusal {
                Some(reason) => outcomes[index] = Outcome::Refused(reason),
                None => {
                    wanted.insert(change.motion, index);
                }
            }
        }
        let mut edits = vec![Edits::new(); self.trees.len()];
        let mut rounds = 0;
        while !wanted.is_empty() {
            edits.iter_mut().for_each(|edits| *edits = Edits::new());
            let fixed = self.fixed_ends(changes, &mut wanted, &mut outcomes);
            if self.keep_origins(&fixed, &mut wanted, &mut outcomes) {
                // What is refused now stays, and with it what it hangs on.
                continue;
            }
            let unfit = self.follow((changes, &wanted), options, &fixed, &mut edits, &mut outcomes);
            // An arc that no circle fits stays, and with it what ends where it starts.
            let mut again = false;
            for motion in unfit {
                if let Some(index) = wanted.remove(&motion) {
                    outcomes[index] = Outcome::Refused(Reason::WrongShape);
                    again = true;
                }
            }
            if !again {
                for edits in &mut edits {
                    edits.sort()?;
                }
                for motion in self.too_long(&edits, &wanted) {
                    if let Some(index) = wanted.remove(&motion) {
                        outcomes[index] = Outcome::Refused(Reason::LineTooLong);
                        again = true;
                    }
                }
            }
            if !again {
                break;
            }
            rounds += 1;
            if rounds == ROUNDS {
                wanted.clear();
                for outcome in outcomes.iter_mut().filter(|outcome| !matches!(outcome, Outcome::Refused(_))) {
                    *outcome = Outcome::Refused(Reason::BeforeLeftArc);
                }
                edits.iter_mut().for_each(|edits| *edits = Edits::new());
            }
        }
        if wanted.is_empty() {
            // What the last round wrote was for motions that stay after all.
            edits.iter_mut().for_each(|edits| *edits = Edits::new());
        }
        Ok(Rewritten { files: self.marked(edits, options)?, outcomes })
    }

    /// Writes all motions in their order: those of `wanted`, and what the others must say again. Hands back the arcs that no
    /// circle fits.
    fn follow(
        &self,
        (changes, wanted): (&[Change], &HashMap<u32, usize>),
        options: &RewriteOptions,
        fixed: &BTreeSet<u32>,
        edits: &mut Vec<Edits>,
        outcomes: &mut [Outcome],
    ) -> Vec<u32> {
        let mut follower =
            Follower { task: self, options, edits, now: Now::default(), unfit: Vec::new(), fixed };
        for event in &self.events {
            match *event {
                Event::Start => follower.now = Now::default(),
                Event::Unknown | Event::Join => {
                    // A shift that is set where the tool stands elsewhere stays where it is.
                    let Now { straightened, moved, .. } = follower.now;
                    follower.now = Now { straightened, moved, ..Now::default() };
                }
                Event::Lost(axes) => follower.now.lose(axes),
                Event::Shift { stated, .. } => follower.now.shift_at(stated),
                Event::Placed(axes) => follower.now.place(axes),
                // Nothing has moved there: the motions that end there stay.
                Event::MaybePlaced(_) | Event::Restored | Event::Held { .. } | Event::Jump => {}
                Event::Motion(motion) => {
                    let index = wanted.get(&motion).copied();
                    let outcome = follower.motion(motion, index.map(|index| &changes[index]));
                    if let Some(index) = index {
                        outcomes[index] = outcome;
                    }
                }
            }
        }
        follower.unfit
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
        if !change.is_held() {
            return Some(Reason::NumberRange);
        }
        for new in &change.targets {
            if matches!(new, NewTarget::Joint { .. }) {
                return Some(Reason::NoJointForm);
            }
        }
        if change.straightens() && !motion.straightens {
            return Some(Reason::NoInsertion);
        }
        if change.before.is_empty() {
            return None;
        }
        if !change.straightens() && !self.written[change.motion as usize].insertable {
            return Some(Reason::NoInsertion);
        }
        change.before.iter().find_map(|extra| match (extra.kind, &extra.target) {
            (MotionKind::Linear, NewTarget::Cartesian { .. }) => None,
            (_, NewTarget::Joint { .. }) => Some(Reason::NoJointForm),
            _ => Some(Reason::WrongKind),
        })
    }
}

/// Where a motion shall go.
struct Aim {
    position: [f64; 3],
    /// `None` keeps the words of the orientation.
    rotation: Option<UnitQuaternion<f64>>,
    via: Option<[f64; 3]>,
}

struct Follower<'f, 's> {
    task: &'f Task<'s>,
    options: &'f RewriteOptions,
    edits: &'f mut Vec<Edits>,
    now: Now,
    /// Arcs that no circle fits.
    unfit: Vec<u32>,
    /// Motions that end where they always did, whatever is asked.
    fixed: &'f BTreeSet<u32>,
}

impl<'s> Follower<'_, 's> {
    /// Writes one motion; what was asked for it, if anything.
    fn motion(&mut self, index: u32, change: Option<&Change>) -> Outcome {
        let task = self.task;
        let motion = &task.listing.motions[index as usize];
        let written = &task.written[index as usize];
        let to =
            motion.to().and_then(|target| target.value.ok().and_then(|value| value.cartesian().copied()));
        let stays = motion.left.is_some_and(|reason| !stays_in_place(reason));
        let straightens = change.is_some_and(Change::straightens);
        self.mode_again(motion, written, straightens);
        let Some(to) = to.filter(|_| !stays) else {
            if written.restates {
                self.say_again(motion, written);
            }
            let file = motion.place.file as usize;
            self.pass(&task.trees[file], task.dialects[file], written, motion.conditional);
            return Outcome::Unchanged;
        };
        let start: [Option<f64>; 3] =
            std::array::from_fn(|axis| self.now.position[axis].or(written.start[axis]));
        let new =
            change.and_then(|change| aim_of(motion, change)).map(|aim| match self.fixed.contains(&index) {
                true => Aim { position: to.position_mm, rotation: None, via: aim.via },
                false => aim,
            });
        let adds = change.is_some_and(|change| !change.before.is_empty());
        if new.is_none() && !adds && self.is_as_meant(written, &start) {
            self.arrive(&to, written, None);
            return Outcome::Unchanged;
        }
        let original = Aim { position: to.position_mm, rotation: None, via: via_of(motion) };
        let mut aim = new.unwrap_or(original);
        let mut arc = None;
        let mut outcome = Outcome::Unchanged;
        if written.arc.is_some() && !straightens {
            let file = motion.place.file as usize;
            let by_radius = slots(&task.trees[file], task.dialects[file], written).radius.is_some();
            let meant = all(written.start).zip(via_of(motion)).map(|(from, via)| [from, via, to.position_mm]);
            arc = meant.and_then(|meant| self.arc(&mut aim, start, written, (meant, by_radius)));
            if arc.is_none() {
                self.unfit.push(index);
                // No circle goes there: the motion stays.
                if change.is_some() {
                    outcome = Outcome::Refused(Reason::WrongShape);
                    aim = Aim { position: to.position_mm, rotation: None, via: via_of(motion) };
                    arc = meant.and_then(|meant| self.arc(&mut aim, start, written, (meant, by_radius)));
                }
            }
        }
        let tree = &task.trees[motion.place.file as usize];
        let mut slots = slots(tree, task.dialects[motion.place.file as usize], written);
        if straightens {
            self.straighten(motion, &mut slots, change.is_some_and(|change| change.before.is_empty()));
            outcome = Outcome::InPlace;
        }
        if let Some(change) = change
            && !matches!(outcome, Outcome::Refused(_))
            && !change.before.is_empty()
        {
            self.extras(motion, written, &slots, &change.before, &to);
            outcome = Outcome::InPlace;
        }
        let done = self.write(motion, written, &slots, &aim, arc);
        if matches!(outcome, Outcome::Refused(_)) || done == Outcome::Unchanged { outcome } else { done }
    }

    /// After a motion: as meant, or where it has been told to go.
    fn arrive(&mut self, to: &RobTarget, written: &Written, told: Option<([f64; 3], Told)>) {
        self.now.meant = to.position_mm.map(Some);
        match told {
            None => {
                self.now.position = to.position_mm.map(Some);
                self.now.angles = written.angles;
                self.now.vector = written.vector;
            }
            Some((position, told)) => {
                self.now.position = position.map(Some);
                match told {
                    Told::AsMeant => (self.now.angles, self.now.vector) = (written.angles, written.vector),
                    Told::Angles(angles) => (self.now.angles, self.now.vector) = (angles.map(Some), None),
                    Told::Vector(vector, spin) => {
                        (self.now.angles, self.now.vector) = ([None; 3], Some((vector, spin)));
                    }
                }
            }
        }
    }

    /// Writes the words of one block.
    fn write(
        &mut self,
        motion: &Motion,
        written: &Written,
        slots: &Slots<'s>,
        aim: &Aim,
        arc: Option<Arc>,
    ) -> Outcome {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect) = (&task.trees[file], task.dialects[file]);
        let mut edits = std::mem::take(&mut self.edits[file]);
        let mut pen = Pen::new(tree, dialect, &mut edits, slots, written);
        let unit = written.unit_mm;
        let decimals = self.options.position_decimals + u8::from(unit != 1.0) * 2;
        let start: [Option<f64>; 3] =
            std::array::from_fn(|axis| self.now.position[axis].or(written.start[axis]));
        let to =
            motion.to().and_then(|target| target.value.ok().and_then(|value| value.cartesian().copied()));
        let meant = to.map_or(aim.position, |to| to.position_mm);
        let mut reached = aim.position;
        for axis in 0..3 {
            let shift = written.shift[axis].unwrap_or(0.0) + self.now.moved[axis];
            let from = start[axis].unwrap_or(0.0);
            let word = slots.axes[axis];
            let increment = word.and_then(|word| said(tree, dialect, &word)).unwrap_or(!written.absolute);
            let base = if increment { from } else { shift };
            let value = (aim.position[axis] - base) / unit;
            let keep = (from - base) / unit;
            let old_base = if increment { written.start[axis] } else { written.shift[axis] };
            let was = old_base.map_or(f64::NAN, |old| (meant[axis] - old) / unit);
            let name = [b"X", b"Y", b"Z"][axis];
            let value = pen.put(AXES + axis, name, value, keep, was, decimals);
            reached[axis] = value * unit + base;
        }
        let told = self.orientation(&mut pen, written, slots, aim, file);
        if let (Some(arc), Some(begin)) = (arc, all(start)) {
            let Plane { a, b, .. } = arc.plane;
            let absolute_centre = written.arc.is_some_and(|(_, _, absolute)| absolute);
            let old = written.arc.map(|(old, _, _)| old);
            if slots.radius.is_some() {
                let was = old.and_then(|old| {
                    let length = (written.start[a]? - old.centre_mm[0])
                        .hypot(written.start[b]? - old.centre_mm[1])
                        / unit;
                    Some(if old.is_long() { -length } else { length })
                });
                let length = (begin[a] - arc.centre_mm[0]).hypot(begin[b] - arc.centre_mm[1]) / unit;
                let length = if arc.is_long() { -length } else { length };
                pen.put(RADIUS, b"R", length, length, was.unwrap_or(f64::NAN), decimals);
            } else if dialect != Dialect::Heidenhain {
                for (place, axis) in [a, b].into_iter().enumerate() {
                    let word = slots.centre[axis];
                    let increment =
                        word.and_then(|word| said(tree, dialect, &word)).unwrap_or(!absolute_centre);
                    let shift = written.shift[axis].unwrap_or(0.0) + self.now.moved[axis];
                    let base = if increment { begin[axis] } else { shift };
                    let value = (arc.centre_mm[place] - base) / unit;
                    // A centre that is left out is that of the start.
                    let keep = (begin[axis] - base) / unit;
                    let old_base = if increment { written.start[axis] } else { written.shift[axis] };
                    let was = old.and_then(|old| Some((old.centre_mm[place] - old_base?) / unit));
                    pen.put(
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
        let replaced = pen.finish();
        self.edits[file] = edits;
        if let Some(to) = to {
            self.arrive(&to, written, Some((reached, told)));
        }
        replaced
    }

    fn orientation(
        &self,
        pen: &mut Pen<'_, 's>,
        written: &Written,
        slots: &Slots<'s>,
        aim: &Aim,
        file: usize,
    ) -> Told {
        match written.turn {
            Turn::Unknown(_) => Told::AsMeant,
            Turn::Angles | Turn::Rpy => {
                let rpy = written.turn == Turn::Rpy;
                let Some(meant) = all(written.angles) else { return Told::AsMeant };
                let angles =
                    match (aim.rotation, if rpy { Some(Angles::Wpr) } else { self.task.angles[file] }) {
                        (Some(rotation), Some(angles)) => angles.angles(&rotation, meant),
                        _ => meant,
                    };
                let mut reached = angles;
                let names: [&[u8]; 3] = if rpy { [b"A2", b"B2", b"C2"] } else { [b"A", b"B", b"C"] };
                for axis in 0..3 {
                    let from = self.now.angles[axis].or(written.start_angles[axis]);
                    let word = slots.angles[axis];
                    let increment =
                        word.and_then(|word| said(pen.tree, pen.dialect, &word)).unwrap_or(!written.absolute);
                    let base = if increment { from.unwrap_or(0.0) } else { 0.0 };
                    // An angle that was never stated before this block has a word in it.
                    let keep = from.map_or(angles[axis], |from| from - base);
                    let old_base = if increment { written.start_angles[axis] } else { Some(0.0) };
                    let was = old_base.map_or(f64::NAN, |old| meant[axis] - old);
                    let decimals = self.options.joint_decimals;
                    let value = pen.put(ANGLES + axis, names[axis], angles[axis] - base, keep, was, decimals);
                    reached[axis] = value + base;
                }
                Told::Angles(reached)
            }
            Turn::Vector => {
                let Some((meant, meant_spin)) = written.vector else { return Told::AsMeant };
                let length = meant.iter().map(|x| x * x).sum::<f64>().sqrt();
                let (vector, spin) = match &aim.rotation {
                    Some(rotation) => {
                        let (vector, spin) = vector_and_spin(rotation, meant_spin);
                        // As long as the old one, which need not have length 1.
                        (vector.map(|x| x * length), spin)
                    }
                    None => (meant, meant_spin),
                };
                let decimals = self.options.quaternion_decimals;
                let names = vector_names(pen.dialect, written);
                let before = self.now.vector.or(written.start_vector);
                let stated = slots.vector.iter().any(Option::is_some);
                let holds =
                    before.is_some_and(|(old, _)| (0..3).all(|i| !differs(old[i], vector[i], decimals)));
                if stated || !holds {
                    for axis in 0..3 {
                        // A component that is left out is 0.
                        pen.put(VECTOR + axis, names[axis], vector[axis], 0.0, meant[axis], decimals);
                    }
                }
                if pen.dialect == Dialect::Siemens {
                    let held = before.map_or(0.0, |(_, spin)| spin);
                    pen.put(SPIN, b"THETA", spin, held, meant_spin, self.options.joint_decimals);
                }
                Told::Vector(vector, spin)
            }
        }
    }

    /// Blocks before a block, in the words of that block.
    fn extras(
        &mut self,
        motion: &Motion,
        written: &Written,
        slots: &Slots<'s>,
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
            let mut pen = Pen {
                tree,
                dialect,
                edits: &mut scratch,
                order: [None; ORDER],
                end: 0,
                added: Vec::new(),
                replaced: Outcome::Unchanged,
                spaced: true,
                lead: None,
            };
            let unit = written.unit_mm;
            let decimals = self.options.position_decimals + u8::from(unit != 1.0) * 2;
            let mut reached = position_mm;
            for axis in 0..3 {
                let from = self.now.position[axis].or(written.start[axis]).unwrap_or(0.0);
                let shift = written.shift[axis].unwrap_or(0.0) + self.now.moved[axis];
                let base = if written.absolute { shift } else { from };
                let value = (position_mm[axis] - base) / unit;
                let value =
                    pen.put(AXES + axis, [b"X", b"Y", b"Z"][axis], value, f64::NAN, f64::NAN, decimals);
                reached[axis] = value * unit + base;
            }
            let none = Slots::default();
            let aim = Aim { position: position_mm, rotation: Some(rotation), via: None };
            let told = self.orientation(&mut pen, written, &none, &aim, file);
            let words = pen.added;
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
            self.arrive(to, written, Some((reached, told)));
        }
        self.edits[file].insert(begin, &text);
    }
}

/// How the orientation was written.
enum Told {
    AsMeant,
    Angles([f64; 3]),
    Vector([f64; 3], f64),
}

/// The words of a tool vector.
fn vector_names(dialect: Dialect, written: &Written) -> [&'static [u8]; 3] {
    match (dialect, written.vector_words) {
        (_, true) => [b"I", b"J", b"K"],
        (Dialect::Heidenhain, _) => [b"TX", b"TY", b"TZ"],
        _ => [b"A3", b"B3", b"C3"],
    }
}

fn all(values: [Option<f64>; 3]) -> Option<[f64; 3]> {
    Some([values[0]?, values[1]?, values[2]?])
}

/// Whether a motion that is left for this reason still goes to the point that its words say in the work frame, so that
/// words which the motions before it have changed must be said again.
fn stays_in_place(reason: Reason) -> bool {
    matches!(
        reason,
        Reason::RadiusCompensation
            | Reason::NoTipControl
            | Reason::ToolUnknown
            | Reason::WorkObjectUnknown
            | Reason::CentreElsewhere
            | Reason::BeforeLeftArc
            | Reason::BeforeLeftPath
    )
}

fn via_of(motion: &Motion) -> Option<[f64; 3]> {
    let target = motion.targets.iter().find(|target| target.role == Role::Via)?;
    match target.value {
        Ok(TargetValue::Cartesian(target)) => Some(target.position_mm),
        _ => None,
    }
}

fn aim_of(motion: &Motion, change: &Change) -> Option<Aim> {
    let mut aim: Option<Aim> = None;
    let mut via = via_of(motion);
    for (target, new) in motion.targets.iter().zip(&change.targets) {
        let NewTarget::Cartesian { position_mm, quaternion, .. } = *new else { continue };
        match target.role {
            Role::Via => via = Some(position_mm),
            Role::To => {
                let rotation = Some(Frame { position_mm, quaternion }.pose().rotation);
                aim = Some(Aim { position: position_mm, rotation, via: None });
            }
        }
    }
    let mut aim = aim?;
    aim.via = via;
    Some(aim)
}

/// The line end that a file uses.
pub(super) fn line_end(source: &[u8]) -> &'static [u8] {
    match source.iter().position(|&byte| byte == b'\n') {
        None if source.contains(&b'\r') => b"\r",
        Some(at) if at > 0 && source[at - 1] == b'\r' => b"\r\n",
        _ => b"\n",
    }
}
