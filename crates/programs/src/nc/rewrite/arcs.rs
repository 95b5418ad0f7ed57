//! Arcs between their new ends, and arcs that become straight.

use super::word_slots::{WordSlots, slots};
use super::{Goal, Rewriter, all};
use crate::motion::{Motion, MotionKind};
use crate::nc::arc::{Arc, Plane};
use crate::nc::syntax::{Word, WordValue};
use crate::nc::task::{BlockArc, BlockContext};

/// Ends of a whole circle that are farther apart than this are none (mm): a thousandth, and what is rounded. Whoever asks
/// for changes follows circles of up to 0.002 mm as closed.
const CLOSED_MM: f64 = 1.5e-3;

/// How far an arc may leave the one that was meant, beside what its three points move apart (mm): an arc that grows keeps no
/// closer.
const LEAVES_MM: f64 = 5e-3;

/// How much more or less of a turn it may be than the one that was meant (rad).
const TURNS_RAD: f64 = 0.5;

impl<'s> Rewriter<'_, 's> {
    /// Says G2 or G3 again in a block that leaves it out, where an arc before has become straight.
    pub(super) fn restate_motion_mode(&mut self, motion: &Motion, context: &BlockContext, straightens: bool) {
        if !self.control.straightened || straightens {
            return;
        }
        let task = self.task;
        let file = motion.place.file as usize;
        let slots = slots(&task.trees[file], task.dialects[file], context);
        if slots.mode.is_none() && motion.kind == MotionKind::Circular {
            let at = slots
                .first
                .map_or(motion.statement.start as usize, |word| task.trees[file].start(word.first));
            let text = format!("{} ", motion.instruction);
            self.edits[file].insert(at, text.as_bytes());
        }
        // A motion of another kind that stands here has been told by a word of its own. A block that may be skipped
        // may not have said it.
        let commanded = slots.mode.is_some() || motion.kind != MotionKind::Unknown;
        self.control.straightened &= !commanded || motion.conditional;
    }

    /// An arc's block becomes a straight one: G1 for G2 or G3, and no centre or radius.
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
            // Before the first word G1 may be put in.
            let begin = range.start - if first == Some(word.first) { 0 } else { blanks.count() };
            let end = tree.start(word.end - 1) + tree.text(word.end - 1).len();
            edits.replace(begin..end, b"");
        }
        self.control.straightened = true;
    }

    /// The arc of a motion between its new ends; `None` where none keeps to the way that was meant (start, middle, end).
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
        if old.is_whole() {
            let gap = (start[a] - goal.position[a]).hypot(start[b] - goal.position[b]);
            if gap > CLOSED_MM {
                return None;
            }
            // The control takes it for a whole circle as long as nothing of a gap is left.
            (goal.position[a], goal.position[b]) = (start[a], start[b]);
        }
        let commanded = [start, goal.via?, goal.position];
        let new = old.moved(intended, commanded, positive)?;
        // As the control will read it.
        let step = 0.1_f64.powi(i32::from(self.options.position_decimals)) * context.unit_mm.min(1.0);
        let rounded = |value: f64, base: f64| ((value - base) / step).round() * step + base;
        let mut end = goal.position;
        for axis in [a, b] {
            end[axis] = rounded(end[axis], context.shift[axis].unwrap_or(0.0) + self.control.moved[axis]);
        }
        let as_read = if new.is_whole() {
            new
        } else if by_radius {
            let radius = (start[a] - new.centre_mm[0]).hypot(start[b] - new.centre_mm[1]);
            let radius = if new.is_long() { -rounded(radius, 0.0) } else { rounded(radius, 0.0) };
            Arc::of_radius(old.plane, start, end, radius, positive)?
        } else {
            let centre = [rounded(new.centre_mm[0], start[a]), rounded(new.centre_mm[1], start[b])];
            Arc::about(old.plane, start, end, centre, positive)?
        };
        let apart = |i: usize, j: usize| {
            let moved = |axis: usize| {
                (commanded[i][axis] - intended[i][axis]) - (commanded[j][axis] - intended[j][axis])
            };
            moved(a).hypot(moved(b))
        };
        let most = LEAVES_MM + apart(0, 1).max(apart(1, 2)).max(apart(0, 2));
        let turns =
            (as_read.sweep_rad - old.sweep_rad).abs() <= TURNS_RAD && as_read.is_whole() == old.is_whole();
        (turns && old.leaves(intended, commanded, &as_read) <= most).then_some(new)
    }
}
