//! What stays as it is written while what is before it has moved: where the control stands now, and the words that are said
//! again.

use super::block_writer::{BlockWriter, differs};
use super::word_slots::{ANGLES, AXES, SPIN, VECTOR, WordSlots, slots, states_increment};
use super::{Rewriter, vector_names};
use crate::motion::Motion;
use crate::nc::dialect::Dialect;
use crate::nc::modal_state::OrientationMode;
use crate::nc::syntax::NcTree;
use crate::nc::task::BlockContext;

impl<'s> Rewriter<'_, 's> {
    /// Whether the control stands where the original has it, so that a motion that stays needs nothing.
    pub(super) fn is_as_intended(&self, context: &BlockContext, start: &[Option<f64>; 3]) -> bool {
        self.control.moved == [0.0; 3]
            && start == &context.start
            && (0..3).all(|axis| {
                self.control.angles[axis].is_none_or(|now| Some(now) == context.start_angles[axis])
            })
            && self.control.vector.is_none_or(|now| Some(now) == context.start_vector)
    }

    /// What a motion that stays leaves out and the one before it has changed is put in, so that it goes where it always went.
    pub(super) fn restate_words(&mut self, motion: &Motion, context: &BlockContext) {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect) = (&task.trees[file], task.dialects[file]);
        let slots = slots(tree, dialect, context);
        if slots.axes.iter().all(Option::is_none) {
            return;
        }
        let mut edits = std::mem::take(&mut self.edits[file]);
        let mut writer = BlockWriter::new(tree, dialect, &mut edits, &slots, context);
        let decimals = self.options.position_decimals + u8::from(context.unit_mm != 1.0) * 2;
        let unit = context.unit_mm;
        let mut again = [false; 6];
        let to =
            motion.to().and_then(|target| target.value.ok().and_then(|value| value.cartesian().copied()));
        for axis in 0..3 {
            let stands = self.control.position[axis].zip(context.start[axis]);
            if let Some(word) = slots.axes[axis] {
                let Some(to) = to.map(|to| to.position_mm[axis]) else { continue };
                // An increment counts from where the tool stands now, a value from a shift that may have moved with it.
                let (base, old) =
                    match (states_increment(tree, dialect, &word).unwrap_or(!context.absolute), stands) {
                        (true, Some((now, intended))) => (now, intended),
                        (true, None) => continue,
                        (false, _) => {
                            let shift = context.shift[axis].unwrap_or(0.0);
                            (shift + self.control.moved[axis], shift)
                        }
                    };
                if base != old {
                    let (value, was) = ((to - base) / unit, (to - old) / unit);
                    writer.put(AXES + axis, b"X", value, value, was, decimals);
                }
                continue;
            }
            let Some((now, intended)) = stands.filter(|(now, intended)| differs(*now, *intended, 9)) else {
                continue;
            };
            let base = if context.absolute {
                context.shift[axis].unwrap_or(0.0) + self.control.moved[axis]
            } else {
                now
            };
            let name = [b"X", b"Y", b"Z"][axis];
            writer.put(AXES + axis, name, (intended - base) / unit, (now - base) / unit, f64::NAN, decimals);
            again[axis] = true;
        }
        let names: Option<[&[u8]; 3]> = match context.orientation_mode {
            OrientationMode::Angles => Some([b"A", b"B", b"C"]),
            OrientationMode::Rpy => Some([b"A2", b"B2", b"C2"]),
            _ => None,
        };
        for (axis, name) in names.into_iter().flatten().enumerate() {
            let (Some(now), Some(intended)) = (self.control.angles[axis], context.start_angles[axis]) else {
                continue;
            };
            if slots.angles[axis].is_some() || !differs(now, intended, 9) {
                continue;
            }
            let base = if context.absolute { 0.0 } else { now };
            let decimals = self.options.joint_decimals;
            writer.put(ANGLES + axis, name, intended - base, now - base, f64::NAN, decimals);
            again[3 + axis] = true;
        }
        self.restate_vector(&mut writer, context, &slots, motion.conditional);
        self.edits[file] = edits;
        for axis in 0..3 {
            // Where the block may be skipped it is said again by whatever comes next.
            let now = motion.conditional.then_some(f64::NAN);
            if again[axis] {
                self.control.position[axis] = now;
            }
            if again[3 + axis] {
                self.control.angles[axis] = now;
            }
        }
    }

    /// The same for a tool vector and the turn about it.
    fn restate_vector(
        &mut self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        conditional: bool,
    ) {
        let (OrientationMode::Vector, Some((now, now_spin)), Some((intended, meant_spin))) =
            (context.orientation_mode, self.control.vector, context.start_vector)
        else {
            return;
        };
        // Only LN of Heidenhain takes a vector.
        let takes = writer.dialect != Dialect::Heidenhain || slots.first.is_some_and(|word| word.is("LN"));
        let stated = slots.vector.iter().any(Option::is_some);
        if !takes || (now, now_spin) == (intended, meant_spin) {
            return;
        }
        if !stated && now != intended {
            let names = vector_names(writer.dialect, context);
            for axis in 0..3 {
                let decimals = self.options.quaternion_decimals;
                writer.put(VECTOR + axis, names[axis], intended[axis], f64::NAN, f64::NAN, decimals);
            }
        }
        if writer.dialect == Dialect::Siemens && slots.spin.is_none() && now_spin != meant_spin {
            writer.put(SPIN, b"THETA", meant_spin, f64::NAN, f64::NAN, self.options.joint_decimals);
        }
        self.control.vector = conditional.then_some(([f64::NAN; 3], f64::NAN));
    }

    /// After a motion that stays as it is written: its words say again what the original says, the others hold on. Where the block
    /// may be skipped, what it states may be either: it is said again by whatever comes next.
    pub(super) fn skip_unmodified(
        &mut self,
        tree: &NcTree<'s>,
        dialect: Dialect,
        context: &BlockContext,
        conditional: bool,
    ) {
        let slots = slots(tree, dialect, context);
        for axis in 0..3 {
            if slots.axes[axis].is_some() {
                match (self.control.position[axis], self.control.intended[axis]) {
                    (Some(now), Some(intended)) if conditional && now != intended => {
                        self.control.position[axis] = Some(f64::NAN);
                    }
                    _ => (self.control.position[axis], self.control.intended[axis]) = (None, None),
                }
            }
            if slots.angles[axis].is_some() {
                let moved =
                    self.control.angles[axis].is_some_and(|now| Some(now) != context.start_angles[axis]);
                self.control.angles[axis] = (conditional && moved).then_some(f64::NAN);
            }
        }
        if slots.vector.iter().any(Option::is_some) {
            // A turn about the vector that is not said holds on.
            self.control.vector = match (self.control.vector, context.start_vector, context.vector) {
                (Some((_, now)), Some((_, intended)), Some((vector, _)))
                    if slots.spin.is_none() && now != intended =>
                {
                    Some((vector, now))
                }
                _ => None,
            };
        }
    }
}
