//! M words: which are not known, whose values stand beside them, what they set.
//!
//! Source: LinuxCNC, M codes and "Switchable Kinematics" (M128 to M130 and M428 to M430 choose what X to C mean, by the
//! analogue output 3); Marlin, M92 to M205 (rates and limits, whose X and Y name motors); Haas mill operator's manual
//! (M96, M97, M19 R); Heidenhain iTNC 530 (M99, M104, M114, M142, M144).

use super::super::dialect::Dialect;
use super::super::machine::{Assigned, State, Variables};
use super::{Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// Takes from a block the words that are values of its M word, so that they are no motion.
    pub(super) fn values_of_m(&self, said: &mut Said<'_>) {
        if !self.dialect.paren_comments() {
            return;
        }
        let linux_like = matches!(self.dialect, Dialect::LinuxCnc | Dialect::Iso);
        if linux_like && said.m.iter().any(|m| is_output(*m)) {
            // The number of an output.
            said.others = said.words.iter().any(|word| matches!(word.address(), Some(b'U' | b'V' | b'W')));
        }
        if said.m.contains(&19) && !said.moves() && !said.g.iter().any(|code| matches!(code, 20 | 30)) {
            // The angle of the spindle.
            said.radius = None;
        }
        if self.dialect == Dialect::Iso && said.g.is_empty() && said.m.iter().any(|m| is_setting(*m)) {
            let none = [None; 3];
            (said.axes, said.abc, said.centre, said.radius) = (none, none, none, None);
            (said.feed, said.others) = (None, false);
        }
    }

    /// The first M word of a block of which it is not known what it does.
    pub(super) fn m_not_known(&self, said: &Said<'_>) -> Option<(String, Reason)> {
        let unknown = |m: &u32| -> bool {
            match self.dialect {
                Dialect::LinuxCnc => matches!(m, 128..=130 | 200..),
                Dialect::Iso => {
                    matches!(m, 128..=130 | 200..) && !is_setting(*m) || self.takes_axes(said, *m)
                }
                // The last datum again, tilted axes counted in, what is modal erased.
                Dialect::Heidenhain => matches!(m, 104 | 114 | 142 | 144),
                Dialect::Fanuc | Dialect::Siemens => false,
            }
        };
        if let Some(m) = said.m.iter().find(|m| unknown(m)) {
            return Some((format!("M{m}"), Reason::UnknownWord));
        }
        // M96 P of a Fanuc: a program that a signal may call at any time from here on. That of Haas names a signal (Q).
        if matches!(self.dialect, Dialect::Fanuc | Dialect::Iso)
            && said.m.contains(&96)
            && said.p.is_some()
            && said.q.is_none()
        {
            return Some(("M96".to_owned(), Reason::UnknownFlow));
        }
        // The output by which LinuxCNC switches its kinematics; a computed number may be that one.
        let linux_like = matches!(self.dialect, Dialect::LinuxCnc | Dialect::Iso);
        let m = said.m.iter().find(|m| linux_like && matches!(m, 67 | 68))?;
        let switch = |word: &super::Word<'_>| {
            word.address() == Some(b'E') && self.literal(word).is_none_or(|e| e == 3.0)
        };
        said.words.iter().any(switch).then(|| (format!("M{m} E3"), Reason::UnknownWord))
    }

    /// Whether the axis words of a block may be values of its M word: it stands first, and is none of machine tools.
    fn takes_axes(&self, said: &Said<'_>, m: u32) -> bool {
        let first = said.words.iter().find(|word| word.address() != Some(b'N'));
        (said.moves() || said.others)
            && said.g.is_empty()
            && first
                .is_some_and(|word| word.address() == Some(b'M') && self.literal(word) == Some(f64::from(m)))
            && !matches!(m, 0..=91 | 97..=99 | 198)
    }

    /// M words that set something at the begin of their block.
    pub(super) fn m_words(&mut self, said: &Said<'_>) {
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let linux = self.dialect == Dialect::LinuxCnc;
        for &m in &said.m {
            match m {
                128 if heidenhain => self.tip(true, false),
                // The basic rotation of the preset ends.
                143 if heidenhain => self.frames_assigned(),
                // These end at the next M99, the others set what is not followed here.
                89 if heidenhain => self.state.modal_call = Some(Reason::Cycle),
                70 | 73 if linux => {
                    self.state.kept = None;
                    // Neither variables nor work offsets and tools come back.
                    let kept = State {
                        variables: Variables::default(),
                        frames: Assigned::default(),
                        tools: Assigned::default(),
                        ..self.state.clone()
                    };
                    self.state.kept = Some(Box::new(kept));
                }
                71 if linux => self.state.kept = None,
                72 if linux => self.restore(),
                _ => {}
            }
        }
    }

    /// M99 of Heidenhain in a block that goes nowhere: the cycle runs where the tool stands, and ends where it says.
    pub(super) fn calls_cycle(&mut self, said: &Said<'_>) -> bool {
        if self.dialect != Dialect::Heidenhain || !said.m.contains(&99) {
            return false;
        }
        self.cycle_call(said, "M99");
        true
    }

    /// The cycle that is defined runs.
    pub(super) fn cycle_call(&mut self, said: &Said<'_>, name: &str) {
        if self.calls_program {
            self.subprogram(said, name);
        } else {
            self.left(said, name, Reason::Cycle);
            self.lose_position();
        }
    }
}

/// Outputs and inputs of LinuxCNC, whose E is a number.
fn is_output(m: u32) -> bool {
    matches!(m, 62..=68)
}

/// Rates and limits of printers' controls: they move nothing and change no coordinate.
fn is_setting(m: u32) -> bool {
    matches!(m, 201 | 203..=205 | 220 | 221 | 566)
}
