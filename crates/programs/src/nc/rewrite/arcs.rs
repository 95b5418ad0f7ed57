//! Arcs between commanded end points, and arcs that become straight.

use super::word_slots::WordSlots;
use super::{Goal, Rewriter, all};
use crate::motion::{Motion, MotionKind};
use crate::nc::arc::{Arc, Plane};
use crate::nc::syntax::{Word, WordValue};
use crate::nc::task::{BlockArc, BlockContext};

/// A larger gap between the ends of a full circle opens it (mm): 1 µm and rounding. The planner treats circles with
/// gaps up to 0.002 mm as closed.
const MAX_CIRCLE_GAP_MM: f64 = 1.5e-3;

/// Allowed deviation from the intended arc, beyond the relative displacement of its three points (mm).
const MAX_DEVIATION_MM: f64 = 5e-3;

/// Allowed change of the sweep (rad).
const MAX_SWEEP_CHANGE_RAD: f64 = 0.5;

impl<'s> Rewriter<'_, 's> {
    /// Restates G2 or G3 in a block that omits it, if an arc before has become straight.
    pub(super) fn restate_motion_mode(&mut self, motion: &Motion, context: &BlockContext, straightens: bool) {
        if !self.control.straightened || straightens {
            return;
        }
        let task = self.task;
        let file = motion.place.file as usize;
        let (.., slots) = task.block_words(motion, context);
        if slots.mode.is_none() && motion.kind == MotionKind::Circular {
            let at = slots
                .first
                .map_or(motion.statement.start as usize, |word| task.trees[file].start(word.first));
            let text = format!("{} ", motion.instruction);
            self.edits[file].insert(at, text.as_bytes());
        }
        // A motion of another kind has its own motion code. A block that may be skipped might not have set it.
        let commanded = slots.mode.is_some() || motion.kind != MotionKind::Unknown;
        self.control.straightened &= !commanded || motion.conditional;
    }

    /// Makes an arc's block straight: G1 for G2 or G3, and no centre or radius.
    pub(super) fn straighten(&mut self, motion: &Motion, slots: &mut WordSlots<'s>, alone: bool) {
        let file = motion.place.file as usize;
        let tree = &self.task.trees[file];
        let edits = &mut self.edits[file];
        match slots.mode {
            Some(Word { value: WordValue::Literal { number, .. }, .. }) => {
                let range = tree.range(number, number + 1);
                let digits = tree.text(number).iter().rposition(u8::is_ascii_digit).unwrap_or(0);
                // G02 to G01: the last digit before a point.
                let whole =
                    tree.text(number).iter().position(|&byte| byte == b'.').map_or(digits, |point| point - 1);
                edits.replace(range.start + whole..range.start + whole + 1, b"1");
            }
            _ if alone && !self.control.straightened => {
                let at = slots.first.map_or(motion.statement.start as usize, |word| tree.start(word.first));
                edits.insert(at, b"G1 ");
            }
            _ => {}
        }
        let first = slots.first.map(|word| word.first);
        for word in slots.centre.iter_mut().chain([&mut slots.radius]).filter_map(Option::take) {
            let range = tree.range(word.first, word.end);
            let blanks =
                tree.source()[..range.start].iter().rev().take_while(|byte| matches!(byte, b' ' | b'\t'));
            // G1 may be inserted before the first word.
            let begin = range.start - if first == Some(word.first) { 0 } else { blanks.count() };
            let end = tree.start(word.end - 1) + tree.text(word.end - 1).len();
            edits.replace(begin..end, b"");
        }
        self.control.straightened = true;
    }

    /// The arc between the commanded ends; `None` if none stays close to the intended one (start, middle, end).
    pub(super) fn arc(
        &self,
        goal: &mut Goal,
        start: [Option<f64>; 3],
        context: &BlockContext,
        (intended, by_radius): ([[f64; 3]; 3], bool),
    ) -> Option<Arc> {
        let BlockArc { arc: old, positive, .. } = context.arc?;
        let start = all(start).filter(|start| !start.iter().any(|x| x.is_nan()))?;
        let Plane { a, b, .. } = old.plane;
        if old.is_full_circle() {
            let gap = (start[a] - goal.position[a]).hypot(start[b] - goal.position[b]);
            if gap > MAX_CIRCLE_GAP_MM {
                return None;
            }
            // A control takes an arc without any gap for a full circle.
            (goal.position[a], goal.position[b]) = (start[a], start[b]);
        }
        let commanded = [start, goal.via?, goal.position];
        let new = old.displaced(intended, commanded, positive)?;
        // With the written decimals.
        let step = 0.1_f64.powi(i32::from(self.options.position_decimals)) * context.unit_mm.min(1.0);
        let rounded = |value: f64, base: f64| ((value - base) / step).round() * step + base;
        let mut end = goal.position;
        for axis in [a, b] {
            end[axis] =
                rounded(end[axis], context.shift[axis].unwrap_or(0.0) + self.control.shift_change[axis]);
        }
        let as_read = if new.is_full_circle() {
            new
        } else if by_radius {
            let radius = (start[a] - new.centre_mm[0]).hypot(start[b] - new.centre_mm[1]);
            let radius = if new.is_major() { -rounded(radius, 0.0) } else { rounded(radius, 0.0) };
            Arc::from_radius(old.plane, start, end, radius, positive)?
        } else {
            let centre = [rounded(new.centre_mm[0], start[a]), rounded(new.centre_mm[1], start[b])];
            Arc::from_centre(old.plane, start, end, centre, positive)?
        };
        let relative_displacement = |i: usize, j: usize| {
            let moved = |axis: usize| {
                (commanded[i][axis] - intended[i][axis]) - (commanded[j][axis] - intended[j][axis])
            };
            moved(a).hypot(moved(b))
        };
        let allowed = MAX_DEVIATION_MM
            + relative_displacement(0, 1).max(relative_displacement(1, 2)).max(relative_displacement(0, 2));
        let sweep_kept = (as_read.sweep_rad - old.sweep_rad).abs() <= MAX_SWEEP_CHANGE_RAD
            && as_read.is_full_circle() == old.is_full_circle();
        (sweep_kept && old.deviation_mm(intended, commanded, &as_read) <= allowed).then_some(new)
    }
}
