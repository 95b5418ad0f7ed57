//! Unmodified motions after modified ones: omitted words are restated, so that the end points do not change.

use super::block_writer::{BlockWriter, differs};
use super::word_slots::{ANGLES, AXES, SPIN, VECTOR, WordSlots, states_increment};
use super::{Rewriter, vector_names};
use crate::motion::Motion;
use crate::nc::dialect::Dialect;
use crate::nc::modal_state::OrientationMode;
use crate::nc::task::BlockContext;

impl<'s> Rewriter<'_, 's> {
    /// Whether the control state is as in the original, so that an unmodified motion needs no words.
    pub(super) fn is_as_intended(&self, context: &BlockContext, start: &[Option<f64>; 3]) -> bool {
        self.control.shift_change == [0.0; 3]
            && start == &context.start
            && (0..3).all(|axis| {
                self.control.angles[axis].is_none_or(|current| Some(current) == context.start_angles[axis])
            })
            && self.control.vector.is_none_or(|current| Some(current) == context.start_vector)
    }

    /// Adds the words that an unmodified motion omits and the motion before it has changed.
    pub(super) fn restate_words(&mut self, motion: &Motion, context: &BlockContext) {
        let task = self.task;
        let file = motion.place.file as usize;
        let (tree, dialect, slots) = task.block_words(motion, context);
        if slots.axes.iter().all(Option::is_none) {
            return;
        }
        let mut edits = std::mem::take(&mut self.edits[file]);
        let mut writer = BlockWriter::new(tree, dialect, &mut edits, &slots, context);
        let decimals = self.options.position_decimals + u8::from(context.unit_mm != 1.0) * 2;
        let unit = context.unit_mm;
        let mut restated = [false; 6];
        let to = motion.cartesian_end();
        for axis in 0..3 {
            let positions = self.control.position[axis].zip(context.start[axis]);
            if let Some(word) = slots.axes[axis] {
                let Some(to) = to.map(|to| to.position_mm[axis]) else { continue };
                // An increment is relative to the commanded position, an absolute value to a shift that may have
                // moved with it.
                let (base, old) =
                    match (states_increment(tree, dialect, &word).unwrap_or(!context.absolute), positions) {
                        (true, Some((current, intended))) => (current, intended),
                        (true, None) => continue,
                        (false, _) => {
                            let shift = context.shift[axis].unwrap_or(0.0);
                            (shift + self.control.shift_change[axis], shift)
                        }
                    };
                if base != old {
                    let (value, was) = ((to - base) / unit, (to - old) / unit);
                    writer.write_word(AXES + axis, b"X", value, value, was, decimals);
                }
                continue;
            }
            let Some((current, intended)) =
                positions.filter(|(current, intended)| differs(*current, *intended, 9))
            else {
                continue;
            };
            let base = if context.absolute {
                context.shift[axis].unwrap_or(0.0) + self.control.shift_change[axis]
            } else {
                current
            };
            let name = [b"X", b"Y", b"Z"][axis];
            writer.write_word(
                AXES + axis,
                name,
                (intended - base) / unit,
                (current - base) / unit,
                f64::NAN,
                decimals,
            );
            restated[axis] = true;
        }
        self.restate_angles(&mut writer, context, &slots, &mut restated);
        self.restate_vector(&mut writer, context, &slots, motion.conditional);
        self.edits[file] = edits;
        for axis in 0..3 {
            // If the block may be skipped, the next one must restate the words again.
            let current = motion.conditional.then_some(f64::NAN);
            if restated[axis] {
                self.control.position[axis] = current;
            }
            if restated[3 + axis] {
                self.control.angles[axis] = current;
            }
        }
    }

    /// The same for the angles of the tool.
    fn restate_angles(
        &self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        restated: &mut [bool; 6],
    ) {
        let names: Option<[&[u8]; 3]> = match context.orientation_mode {
            OrientationMode::Angles => Some([b"A", b"B", b"C"]),
            OrientationMode::Rpy => Some([b"A2", b"B2", b"C2"]),
            _ => None,
        };
        for (axis, name) in names.into_iter().flatten().enumerate() {
            let (Some(current), Some(intended)) = (self.control.angles[axis], context.start_angles[axis])
            else {
                continue;
            };
            if slots.angles[axis].is_some() || !differs(current, intended, 9) {
                continue;
            }
            let base = if context.absolute { 0.0 } else { current };
            let decimals = self.options.joint_decimals;
            writer.write_word(ANGLES + axis, name, intended - base, current - base, f64::NAN, decimals);
            restated[3 + axis] = true;
        }
    }

    /// The same for the tool vector and the spin about it.
    fn restate_vector(
        &mut self,
        writer: &mut BlockWriter<'_, 's>,
        context: &BlockContext,
        slots: &WordSlots<'s>,
        conditional: bool,
    ) {
        let (OrientationMode::Vector, Some((current, current_spin)), Some((intended, intended_spin))) =
            (context.orientation_mode, self.control.vector, context.start_vector)
        else {
            return;
        };
        // Only LN of Heidenhain takes a vector.
        let takes = writer.dialect != Dialect::Heidenhain || slots.first.is_some_and(|word| word.is("LN"));
        let stated = slots.vector.iter().any(Option::is_some);
        if !takes || (current, current_spin) == (intended, intended_spin) {
            return;
        }
        if !stated && current != intended {
            let names = vector_names(writer.dialect, context);
            for axis in 0..3 {
                let decimals = self.options.quaternion_decimals;
                writer.write_word(VECTOR + axis, names[axis], intended[axis], f64::NAN, f64::NAN, decimals);
            }
        }
        if writer.dialect == Dialect::Siemens && slots.spin.is_none() && current_spin != intended_spin {
            writer.write_word(SPIN, b"THETA", intended_spin, f64::NAN, f64::NAN, self.options.joint_decimals);
        }
        self.control.vector = conditional.then_some(([f64::NAN; 3], f64::NAN));
    }

    /// The control state after an unmodified motion: axes with a word are as in the original, the others unchanged.
    /// After a block that may be skipped they are uncertain, and the next block must restate them.
    pub(super) fn skip_unmodified(&mut self, motion: &Motion, context: &BlockContext) {
        let (.., slots) = self.task.block_words(motion, context);
        let conditional = motion.conditional;
        for axis in 0..3 {
            if slots.axes[axis].is_some() {
                match (self.control.position[axis], self.control.intended[axis]) {
                    (Some(current), Some(intended)) if conditional && differs(current, intended, 9) => {
                        self.control.position[axis] = Some(f64::NAN);
                    }
                    _ => (self.control.position[axis], self.control.intended[axis]) = (None, None),
                }
            }
            if slots.angles[axis].is_some() {
                // An angle that increments have brought back differs by rounding.
                let moved = self.control.angles[axis].is_some_and(|current| {
                    context.start_angles[axis].is_none_or(|intended| differs(current, intended, 9))
                });
                self.control.angles[axis] = (conditional && moved).then_some(f64::NAN);
            }
        }
        if slots.vector.iter().any(Option::is_some) {
            // The spin stays in effect if it is omitted.
            self.control.vector = match (self.control.vector, context.start_vector, context.vector) {
                (Some((_, current)), Some((_, intended)), Some((vector, _)))
                    if slots.spin.is_none() && current != intended =>
                {
                    Some((vector, current))
                }
                _ => None,
            };
        }
    }
}
