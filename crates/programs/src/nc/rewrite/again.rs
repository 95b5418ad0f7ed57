//! What stays as it is written while what is before it has moved: where the control stands now, and the words that are said
//! again.

use super::pen::{Pen, differs};
use super::slots::{ANGLES, AXES, SPIN, Slots, VECTOR, said, slots};
use super::{Follower, vector_names};
use crate::motion::Motion;
use crate::nc::dialect::Dialect;
use crate::nc::machine::Turn;
use crate::nc::syntax::NcTree;
use crate::nc::task::Written;

impl<'s> Follower<'_, 's> {
    /// Whether the control stands where the original has it, so that a motion that stays needs nothing.
    pub(super) fn is_as_meant(&self, written: &Written, start: &[Option<f64>; 3]) -> bool {
        self.now.moved == [0.0; 3]
            && start == &written.start
            && (0..3)
                .all(|axis| self.now.angles[axis].is_none_or(|now| Some(now) == written.start_angles[axis]))
            && self.now.vector.is_none_or(|now| Some(now) == written.start_vector)
    }

    /// What a motion that stays leaves out and the one before it has changed is put in, so that it goes where it always went.
    pub(super) fn say_again(&mut self, motion: &Motion, written: &Written) {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect) = (&task.trees[file], task.dialects[file]);
        let slots = slots(tree, dialect, written);
        if slots.axes.iter().all(Option::is_none) {
            return;
        }
        let mut edits = std::mem::take(&mut self.edits[file]);
        let mut pen = Pen::new(tree, dialect, &mut edits, &slots, written);
        let decimals = self.options.position_decimals + u8::from(written.unit_mm != 1.0) * 2;
        let unit = written.unit_mm;
        let mut again = [false; 6];
        let to =
            motion.to().and_then(|target| target.value.ok().and_then(|value| value.cartesian().copied()));
        for axis in 0..3 {
            let stands = self.now.position[axis].zip(written.start[axis]);
            if let Some(word) = slots.axes[axis] {
                let Some(to) = to.map(|to| to.position_mm[axis]) else { continue };
                // An increment counts from where the tool stands now, a value from a shift that may have moved with it.
                let (base, old) = match (said(tree, dialect, &word).unwrap_or(!written.absolute), stands) {
                    (true, Some((now, meant))) => (now, meant),
                    (true, None) => continue,
                    (false, _) => {
                        let shift = written.shift[axis].unwrap_or(0.0);
                        (shift + self.now.moved[axis], shift)
                    }
                };
                if base != old {
                    let (value, was) = ((to - base) / unit, (to - old) / unit);
                    pen.put(AXES + axis, b"X", value, value, was, decimals);
                }
                continue;
            }
            let Some((now, meant)) = stands.filter(|(now, meant)| differs(*now, *meant, 9)) else { continue };
            let base = if written.absolute {
                written.shift[axis].unwrap_or(0.0) + self.now.moved[axis]
            } else {
                now
            };
            let name = [b"X", b"Y", b"Z"][axis];
            pen.put(AXES + axis, name, (meant - base) / unit, (now - base) / unit, f64::NAN, decimals);
            again[axis] = true;
        }
        let names: Option<[&[u8]; 3]> = match written.turn {
            Turn::Angles => Some([b"A", b"B", b"C"]),
            Turn::Rpy => Some([b"A2", b"B2", b"C2"]),
            _ => None,
        };
        for (axis, name) in names.into_iter().flatten().enumerate() {
            let (Some(now), Some(meant)) = (self.now.angles[axis], written.start_angles[axis]) else {
                continue;
            };
            if slots.angles[axis].is_some() || !differs(now, meant, 9) {
                continue;
            }
            let base = if written.absolute { 0.0 } else { now };
            let decimals = self.options.joint_decimals;
            pen.put(ANGLES + axis, name, meant - base, now - base, f64::NAN, decimals);
            again[3 + axis] = true;
        }
        self.vector_again(&mut pen, written, &slots, motion.conditional);
        self.edits[file] = edits;
        for axis in 0..3 {
            // Where the block may be skipped it is said again by whatever comes next.
            let now = motion.conditional.then_some(f64::NAN);
            if again[axis] {
                self.now.position[axis] = now;
            }
            if again[3 + axis] {
                self.now.angles[axis] = now;
            }
        }
    }

    /// The same for a tool vector and the turn about it.
    fn vector_again(
        &mut self,
        pen: &mut Pen<'_, 's>,
        written: &Written,
        slots: &Slots<'s>,
        conditional: bool,
    ) {
        let (Turn::Vector, Some((now, now_spin)), Some((meant, meant_spin))) =
            (written.turn, self.now.vector, written.start_vector)
        else {
            return;
        };
        // Only LN of Heidenhain takes a vector.
        let takes = pen.dialect != Dialect::Heidenhain || slots.first.is_some_and(|word| word.is("LN"));
        let stated = slots.vector.iter().any(Option::is_some);
        if !takes || (now, now_spin) == (meant, meant_spin) {
            return;
        }
        if !stated && now != meant {
            let names = vector_names(pen.dialect, written);
            for axis in 0..3 {
                let decimals = self.options.quaternion_decimals;
                pen.put(VECTOR + axis, names[axis], meant[axis], f64::NAN, f64::NAN, decimals);
            }
        }
        if pen.dialect == Dialect::Siemens && slots.spin.is_none() && now_spin != meant_spin {
            pen.put(SPIN, b"THETA", meant_spin, f64::NAN, f64::NAN, self.options.joint_decimals);
        }
        self.now.vector = conditional.then_some(([f64::NAN; 3], f64::NAN));
    }

    /// After a motion that stays as it is written: its words say again what the original says, the others hold on. Where the block
    /// may be skipped, what it states may be either: it is said again by whatever comes next.
    pub(super) fn pass(&mut self, tree: &NcTree<'s>, dialect: Dialect, written: &Written, conditional: bool) {
        let slots = slots(tree, dialect, written);
        for axis in 0..3 {
            if slots.axes[axis].is_some() {
                match (self.now.position[axis], self.now.meant[axis]) {
                    (Some(now), Some(meant)) if conditional && now != meant => {
                        self.now.position[axis] = Some(f64::NAN);
                    }
                    _ => (self.now.position[axis], self.now.meant[axis]) = (None, None),
                }
            }
            if slots.angles[axis].is_some() {
                let moved = self.now.angles[axis].is_some_and(|now| Some(now) != written.start_angles[axis]);
                self.now.angles[axis] = (conditional && moved).then_some(f64::NAN);
            }
        }
        if slots.vector.iter().any(Option::is_some) {
            // A turn about the vector that is not said holds on.
            self.now.vector = match (self.now.vector, written.start_vector, written.vector) {
                (Some((_, now)), Some((_, meant)), Some((vector, _)))
                    if slots.spin.is_none() && now != meant =>
                {
                    Some((vector, now))
                }
                _ => None,
            };
        }
    }
}
