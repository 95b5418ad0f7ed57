//! What is not certain: default-deny for words that are not known, and what still holds where ways meet.

use super::super::dialect::Dialect;
use super::super::expression::{Worth, literal};
use super::super::machine::{Assigns, GROUPS, Group, Mode};
use super::super::syntax::Belongs;
use super::super::token::Token;
use super::found::key;
use super::names::code_name;
use super::{Event, Lister, Said};
use crate::motion::Reason;

impl Lister<'_, '_> {
    /// A group is set to something.
    pub(super) fn set(&mut self, group: Group, value: u64) {
        if self.branched || self.skipping {
            self.found.add(group, value);
        } else {
            // Before ways part only the last one counts.
            self.found.settle(group, value);
            self.settled |= 1 << group as u32;
        }
        self.state.certain(group);
    }

    /// A group is set to what depends on where the tool stands.
    pub(super) fn set_any(&mut self, group: Group) {
        if self.branched || self.skipping {
            self.found.add_any(group);
        } else {
            self.found.settle(group, u64::MAX);
            self.settled |= 1 << group as u32;
        }
        self.state.certain(group);
    }

    /// A group that turns, scales or bends coordinates begins or ends. What ends where nothing is on changes nothing.
    pub(super) fn turn(&mut self, group: Group, on: bool) {
        let bit = 1 << group as u32;
        if !on && self.state.turned & bit == 0 && self.state.doubt(bit).is_none() {
            return self.set(group, 0);
        }
        self.state.turn_frame(group, on);
        self.set(group, u64::from(on));
        match group {
            Group::Diameter => self.lose_position(),
            _ => self.lose_all(),
        }
    }

    /// A place that can be reached from elsewhere: a group that the whole file sets to one thing only keeps that once it has been
    /// set before ways part, and one that it never sets keeps what the control starts with.
    pub(super) fn forget(&mut self) {
        self.branched = true;
        self.found.forgotten += 1;
        let siemens = self.dialect == Dialect::Siemens;
        let (mut constant, mut assigns) = (0, Assigns::ALL);
        if let Some(whole) = &self.whole {
            assigns = whole.assigns;
            for group in 0..GROUPS as usize {
                let bit = 1 << group;
                let start = match group {
                    _ if group == Group::Distance as usize => 900,
                    _ if group == Group::Unit as usize => 21,
                    _ if group == Group::Plane as usize => 170,
                    _ if group == Group::Frame as usize => key(if siemens { "G500" } else { "G54" }),
                    _ if group == Group::Tool as usize => key("T0"),
                    _ => 0,
                };
                let settled = self.settled & bit != 0;
                let held = match whole.value[group] {
                    // What the file never sets is the caller's where it has one.
                    None => !self.called,
                    Some(value) => settled || value == start && !self.called,
                };
                if held && whole.several & bit == 0 {
                    constant |= bit;
                }
            }
        }
        self.state.forget(constant, assigns);
        // What was found for a name before says nothing of what it stands for now.
        self.frame_index = None;
        self.tool_index.clear();
        // Elsewhere an origin may have been set, or a tool made ready.
        self.state.preset |= self.whole.as_ref().is_none_or(|whole| whole.presets);
        self.state.next_tool =
            (self.changes_tools || self.dialect == Dialect::LinuxCnc).then(|| "T?".to_owned());
        self.events.push(Event::Join);
    }

    /// Whether what a block sets is not set once and for all: the way has parted before it, or may pass it by.
    pub(super) fn anywhere_else(&self) -> bool {
        self.branched || self.skipping || self.actions
    }

    /// The way parts: it may go on elsewhere in the file.
    pub(super) fn parts(&mut self) {
        self.branched = true;
        self.events.push(Event::Jump);
    }

    /// Something that is not followed counts from where the tool stands.
    pub(super) fn held_here(&mut self, axes: u8) {
        self.events.push(Event::Held { axes, read: false });
    }

    /// A block that reads where the tool stands: what it makes of that moves with it.
    pub(super) fn position_read(&mut self, said: &Said<'_>) {
        let reads = said.words.iter().any(|word| match word.belongs {
            Belongs::Expression { first, end } | Belongs::Arguments { first, end } => {
                (first..end).any(|token| self.is_position(token, end))
            }
            _ => false,
        });
        if reads {
            self.events.push(Event::Held { axes: super::EVERYWHERE, read: true });
        }
    }

    /// Whether a token begins the name of a position that the control keeps.
    fn is_position(&self, token: u32, end: u32) -> bool {
        match self.tree.kind(token) {
            Some(Token::Hash) => match self.tree.kind(token + 1) {
                Some(Token::Number) => {
                    let number = literal(self.tree.text(token + 1)).unwrap_or(0.0);
                    // Ends of blocks, machine and work positions, where a probe touched; LinuxCNC: 5420 on.
                    matches!(number as u32, 5001..=5120 | 5420..=5428)
                }
                // The number is worked out: it may be one of them where it is near.
                Some(Token::BracketOpen) => {
                    let near = |token: u32| {
                        let number = literal(self.tree.text(token)).unwrap_or(0.0);
                        self.tree.kind(token) == Some(Token::Number) && (4900.0..5500.0).contains(&number)
                    };
                    (token + 2..end)
                        .take_while(|&token| self.tree.kind(token) != Some(Token::BracketClose))
                        .any(near)
                }
                Some(Token::Name) => {
                    let name = self.tree.text(token + 1).to_ascii_uppercase();
                    matches!(&*name, [b'<', b'_', b'X'..=b'Z' | b'A'..=b'C', b'>'])
                        || name.starts_with(b"<_ABS_")
                        || name.starts_with(b"<_ABSOLUTE")
                }
                _ => false,
            },
            Some(Token::Name) if self.dialect == Dialect::Siemens => {
                let name = self.tree.text(token).to_ascii_uppercase();
                [&b"$AA_I"[..], b"$AA_M", b"$AA_ETRANS", b"$P_EP", b"$VA_I", b"$AC_P"]
                    .iter()
                    .any(|begin| name.starts_with(begin))
            }
            _ => false,
        }
    }

    /// The begin of a file that others call: everything is as they have left it.
    pub(super) fn enter(&mut self) {
        self.state.forget(0, Assigns::default());
        self.state.next_tool = Some("T?".to_owned());
        self.events.push(Event::Join);
    }

    /// A length as it is written, in mm; that of what is not 0 is not known where the unit is not.
    pub(super) fn in_mm(&self, value: Worth) -> Worth {
        match (value?, self.state.doubt(1 << Group::Unit as u32)) {
            (0.0, _) => Ok(0.0),
            (_, Some(reason)) => Err(reason),
            (value, None) => Ok(value * self.state.unit_mm),
        }
    }

    /// After the machine has gone where the text does not tell.
    pub(super) fn lose_all(&mut self) {
        self.state.lose_position();
        self.state.lose_orientation();
        self.events.push(Event::Unknown);
    }

    /// After the same, of X, Y and Z only.
    pub(super) fn lose_position(&mut self) {
        self.state.lose_position();
        self.events.push(Event::Lost(super::POSITION));
    }

    /// A block with a word that is not known: it is listed, and whatever the word may do and set is not known from here on.
    pub(super) fn deny(&mut self, said: &Said<'_>, word: &str, reason: Reason) {
        self.left(said, word, reason);
        self.state.lose_everything(reason);
        // It may have been a motion word.
        self.state.mode = Mode::Lost(reason);
        self.found.add_all();
        self.events.push(Event::Unknown);
    }

    /// The same for one group only: the word is no motion.
    pub(super) fn doubt(&mut self, group: Group, because: Reason) {
        self.found.add_any(group);
        self.state.obscure |= 1 << group as u32;
        self.state.because = because;
        self.lose_all();
    }

    /// The first word of a block that is not known, and why.
    pub(super) fn not_known(&self, said: &Said<'_>) -> Option<(String, Reason)> {
        if let Some((word, reason)) = &said.unknown {
            return Some((word.clone(), *reason));
        }
        match said.g.iter().find(|&&code| !super::known::is_g(code, self.dialect, self.says(said))) {
            Some(code) => Some((code_name(*code), Reason::UnknownWord)),
            None => self.m_not_known(said),
        }
    }

    /// What kinds of word a block has, for codes that mean different things with and without.
    pub(super) fn says(&self, said: &Said<'_>) -> super::known::Says {
        super::known::Says {
            axes: said.moves() || said.others,
            centre: said.centre.iter().any(Option::is_some),
        }
    }

    /// M72: what M70 has kept holds again.
    pub(super) fn restore(&mut self) {
        let Some(kept) = self.state.kept.clone() else {
            self.state.lose_everything(Reason::UnknownWord);
            self.found.add_all();
            self.events.push(Event::Unknown);
            return;
        };
        let moved = self.state.frame != kept.frame || self.state.length != kept.length;
        let state = &mut self.state;
        (state.absolute, state.unit_mm, state.plane) = (kept.absolute, kept.unit_mm, kept.plane);
        (state.radius, state.centre_absolute) = (kept.radius, kept.centre_absolute);
        (state.feed, state.feed_per_minute) = (kept.feed, kept.feed_per_minute);
        (state.exact_stop, state.exact_stop_holds) = (kept.exact_stop, kept.exact_stop_holds);
        (state.frame, state.length, state.own_length) = (kept.frame.clone(), kept.length, kept.own_length);
        if state.mode != kept.mode {
            state.mode = Mode::Lost(Reason::UnknownFlow);
        }
        for group in [
            Group::Distance,
            Group::Unit,
            Group::Plane,
            Group::Radius,
            Group::Frame,
            Group::Tool,
            Group::Length,
            Group::Centre,
            Group::Diameter,
        ] {
            let bit = 1 << group as u32;
            state.uncertain = state.uncertain & !bit | kept.uncertain & bit;
            state.obscure = state.obscure & !bit | kept.obscure & bit;
            self.found.add_any(group);
        }
        state.turn_frame(Group::Diameter, kept.turned & 1 << Group::Diameter as u32 != 0);
        if moved {
            self.lose_all();
        }
    }
}
