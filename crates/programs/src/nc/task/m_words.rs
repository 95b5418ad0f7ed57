//! M words: which are unknown, which take other words as values, and what they set.
//!
//! Source: LinuxCNC, M codes and "Switchable Kinematics" (M128 to M130 and M428 to M430 choose what X to C mean, by
//! analogue output 3); Marlin, M92 to M205 (rates and limits, whose X and Y name motors); Haas mill operator's manual
//! (M96, M97, M19 R); Heidenhain iTNC 530 (M99, M104, M114, M142, M144).

use super::super::dialect::Dialect;
use super::super::modal_state::{AssignedFrames, Variables};
use super::{Block, Interpreter};
use crate::motion::Reason;

impl Interpreter<'_, '_> {
    /// Removes the words that are values of an M word, so that they are not read as motion.
    pub(super) fn values_of_m(&self, block: &mut Block<'_>) {
        if !self.dialect.paren_comments() {
            return;
        }
        let linux_like = matches!(self.dialect, Dialect::LinuxCnc | Dialect::Iso);
        if linux_like && block.m.iter().any(|m| is_output(*m)) {
            // E is the number of an output.
            block.flags.other_axes =
                block.words.iter().any(|word| matches!(word.address(), Some(b'U' | b'V' | b'W')));
        }
        if block.m.contains(&19)
            && !block.has_motion_words()
            && !block.g.iter().any(|code| matches!(code, 20 | 30))
        {
            // R is the angle of the spindle.
            block.radius = None;
        }
        if self.dialect == Dialect::Iso && block.g.is_empty() && block.m.iter().any(|m| is_setting(*m)) {
            let none = [None; 3];
            (block.axes, block.abc, block.centre, block.radius) = (none, none, none, None);
            (block.feed, block.flags.other_axes) = (None, false);
        }
    }

    /// The first M word of a block whose effect is unknown.
    pub(super) fn unknown_m_word(&self, block: &Block<'_>) -> Option<(String, Reason)> {
        let unknown = |m: &u32| -> bool {
            match self.dialect {
                Dialect::LinuxCnc => matches!(m, 128..=130 | 200..),
                Dialect::Iso => {
                    matches!(m, 128..=130 | 200..) && !is_setting(*m) || self.takes_axes(block, *m)
                }
                // They restore the last datum, include tilted axes, or reset modal functions.
                Dialect::Heidenhain => matches!(m, 104 | 114 | 142 | 144),
                Dialect::Fanuc | Dialect::Siemens => false,
            }
        };
        if let Some(m) = block.m.iter().find(|m| unknown(m)) {
            return Some((format!("M{m}"), Reason::UnknownWord));
        }
        // M96 P of a Fanuc: from here on a signal may call a program at any time. M96 of Haas names the signal (Q).
        if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso)
            && block.m.contains(&96)
            && block.p.is_some()
            && block.q.is_none()
        {
            return Some(("M96".to_owned(), Reason::UnknownFlow));
        }
        // The output by which LinuxCNC switches its kinematics; a computed number may be that one.
        let linux_like = matches!(self.dialect, Dialect::LinuxCnc | Dialect::Iso);
        let m = block.m.iter().find(|m| linux_like && matches!(m, 67 | 68))?;
        let switch = |word: &super::Word<'_>| {
            word.address() == Some(b'E') && self.literal(word).is_none_or(|e| e == 3.0)
        };
        block.words.iter().any(switch).then(|| (format!("M{m} E3"), Reason::UnknownWord))
    }

    /// Whether the axis words of a block may be values of its M word: it comes first, and is not a machine tool
    /// function.
    fn takes_axes(&self, block: &Block<'_>, m: u32) -> bool {
        let first = block.words.iter().find(|word| word.address() != Some(b'N'));
        (block.has_motion_words() || block.flags.other_axes)
            && block.g.is_empty()
            && first
                .is_some_and(|word| word.address() == Some(b'M') && self.literal(word) == Some(f64::from(m)))
            && !matches!(m, 0..=91 | 97..=99 | 198)
    }

    /// M words that take effect at the start of their block.
    pub(super) fn m_words(&mut self, block: &Block<'_>) {
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let linux = self.dialect == Dialect::LinuxCnc;
        for &m in &block.m {
            match m {
                128 if heidenhain => self.set_tcp_mode(true, false),
                // The basic rotation of the preset ends.
                143 if heidenhain => self.invalidate_offsets(),
                // Others end at the next M99 or have unmodelled effects.
                89 if heidenhain => self.state.modal_call = Some(Reason::Cycle),
                70 | 73 if linux => {
                    self.state.saved = None;
                    // Variables, work offsets and tools are not restored.
                    let mut kept = self.state.clone();
                    kept.variables = Variables::default();
                    kept.work_offset.assigned = AssignedFrames::default();
                    kept.tool.assigned = AssignedFrames::default();
                    self.state.saved = Some(Box::new(kept));
                }
                71 if linux => self.state.saved = None,
                72 if linux => self.restore_saved_state(),
                _ => {}
            }
        }
    }

    /// M99 of Heidenhain in a block without motion: the cycle runs at the tool position, and its end is unknown.
    pub(super) fn calls_cycle(&mut self, block: &Block<'_>) -> bool {
        if self.dialect != Dialect::Heidenhain || !block.m.contains(&99) {
            return false;
        }
        self.cycle_call(block, "M99");
        true
    }

    /// Runs the active cycle.
    pub(super) fn cycle_call(&mut self, block: &Block<'_>, name: &str) {
        if self.cycle_is_program {
            self.subprogram(block, name);
        } else {
            self.list_left(block, name, Reason::Cycle);
            self.invalidate_position();
        }
    }
}

/// Outputs and inputs of LinuxCNC, whose E is a number.
fn is_output(m: u32) -> bool {
    matches!(m, 62..=68)
}

/// Rates and limits of 3D printers: no motion, and no effect on coordinates.
fn is_setting(m: u32) -> bool {
    matches!(m, 201 | 203..=205 | 220 | 221 | 566)
}
