//! The words of a block, gathered by what they say, and what their values are worth.

use super::super::dialect::Dialect;
use super::super::expression::{LARGEST, Reader, Variable, Worth, literal};
use super::super::machine::Group;
use super::super::parser::word;
use super::super::syntax::{Belongs, Syntax, Word};
use super::super::token::Token;
use super::{Lister, Said, code, is_axis, is_axis_name};
use crate::motion::Reason;
use crate::tree::Node;

/// A value that a control can hold.
fn held(value: Worth) -> Worth {
    value.and_then(|value| if value.abs() < LARGEST { Ok(value) } else { Err(Reason::NumberRange) })
}

/// A block of more words is not read: controls take some hundred characters.
const BLOCK_WORDS: u32 = 1000;

impl<'s> Lister<'_, 's> {
    pub(super) fn gather(&mut self, node: u32, said: &mut Said<'s>) {
        let mut words = std::mem::take(&mut said.words);
        let (mut g, mut m) = (std::mem::take(&mut said.g), std::mem::take(&mut said.m));
        words.clear();
        g.clear();
        m.clear();
        *said = Said { node, words, g, m, ..Said::default() };
        let kind = self.tree.nodes[node as usize].kind;
        said.skippable = kind == Syntax::Skippable;
        said.opaque = kind == Syntax::Opaque;
        if self.tree.nodes[node as usize].size > BLOCK_WORDS {
            // No control takes a block of so many words.
            (said.opaque, said.obscure) = (true, true);
            return;
        }
        for child in self.tree.child_nodes(node) {
            if self.tree.nodes[child as usize].kind == Syntax::Opaque {
                let Node { first, end, .. } = self.tree.nodes[child as usize];
                said.opaque = true;
                said.obscure |= self.may_set(first, end);
                continue;
            }
            let found = word(self.tree, child);
            said.words.push(found);
        }
        for index in 0..said.words.len() {
            self.gather_word(said, index);
        }
        self.values_of_m(said);
        if said.normal && said.vector.iter().all(Option::is_none) && self.may_turn_to_normal(said) {
            said.aside.get_or_insert(Reason::AlongNormal);
        }
        // The control takes no tool vector elsewhere.
        let heidenhain = self.dialect == Dialect::Heidenhain;
        said.opaque |= heidenhain && !said.spatial && said.vector.iter().any(Option::is_some);
        let first = said.words.first();
        said.paraxial = heidenhain
            && first.is_some_and(|word| is_axis_name(word.name) && word.belongs != Belongs::Nothing);
        // Two motion words that differ: which of them holds is not certain.
        let mut modes = said.g.iter().filter(|&&code| matches!(code, 0 | 10 | 20 | 30));
        if let Some(first) = modes.next()
            && modes.any(|other| other != first)
        {
            said.opaque = true;
        }
    }

    /// Whether the control may turn the tool to the normal of a surface: it does under M128 and TCPM.
    fn may_turn_to_normal(&self, said: &Said<'_>) -> bool {
        self.state.tip || said.m.contains(&128) || self.state.doubt(1 << Group::Tip as u32).is_some()
    }

    /// Whether a part that could not be read may hold more than axis words.
    fn may_set(&self, first: u32, end: u32) -> bool {
        (first..end).any(|token| match self.tree.kind(token) {
            Some(Token::Name) => self.tree.text(token).iter().any(|byte| !is_axis(*byte)),
            Some(Token::Address) => !is_axis(self.tree.text(token)[0]),
            Some(Token::Hash | Token::Equal) => true,
            _ => false,
        })
    }

    fn gather_word(&mut self, said: &mut Said<'s>, index: usize) {
        let word = said.words[index];
        let at = Some(index);
        let mut twice = false;
        let mut put = |slot: &mut Option<usize>| {
            twice |= slot.is_some();
            *slot = at;
        };
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let comma = index > 0 && said.words[index - 1].name == b",";
        // Conversational: what follows one of these M words are its own values.
        if heidenhain && word.address() != Some(b'M') && self.is_value_of_m(said, index) {
            return;
        }
        match word.address() {
            Some(b'G') => match self.literal(&word) {
                Some(number) if number >= 0.0 => said.g.push(code(number)),
                _ => match self.worth(&word).0 {
                    Ok(number) if number >= 0.0 => said.g.push(code(number)),
                    Ok(_) => said.unknown = Some(("G".to_owned(), Reason::UnknownWord)),
                    Err(_) => said.unknown = Some(("G".to_owned(), Reason::Variable)),
                },
            },
            Some(b'M') => match self.literal(&word) {
                Some(number) => said.m.push(number.round() as u32),
                // A path block may end with M alone.
                None if heidenhain && word.belongs == Belongs::Nothing => {}
                None => said.unknown = Some(("M".to_owned(), Reason::Variable)),
            },
            Some(b'X') => put(&mut said.axes[0]),
            Some(b'Y') => put(&mut said.axes[1]),
            Some(b'Z') => put(&mut said.axes[2]),
            Some(b'C') if heidenhain && word.belongs == Belongs::Nothing => {}
            Some(b'C' | b'R') if comma => said.corner = true,
            // `,A45.`: the angle of the line.
            Some(_) if comma => (said.corner, said.aside) = (true, Some(Reason::NotFollowed)),
            Some(letter @ (b'A' | b'B' | b'C')) => put(&mut said.abc[usize::from(letter - b'A')]),
            Some(letter @ (b'I' | b'J' | b'K')) => put(&mut said.centre[usize::from(letter - b'I')]),
            Some(b'R') if heidenhain => match (word.belongs, self.literal(&word)) {
                (Belongs::Literal { sign: None, .. }, Some(value))
                    if value == 0.0 || !said.words.first().is_some_and(|word| word.is("CR")) =>
                {
                    said.compensates = Some(value != 0.0);
                }
                // R+ and R- make the way of a positioning block longer or shorter.
                (Belongs::Nothing, _) => (said.compensates, said.lengthens) = (Some(true), true),
                _ => put(&mut said.radius),
            },
            Some(b'R') => put(&mut said.radius),
            Some(b'F') => said.feed = at,
            Some(b'P') => said.p = at,
            Some(b'L') => said.l = at,
            Some(b'Q') => said.q = at,
            Some(b'H') => said.h = at,
            Some(b'D') => said.d = at,
            Some(b'U' | b'V' | b'W') => said.others = true,
            Some(b'E') if self.dialect != Dialect::Fanuc => said.others = true,
            Some(_) => {}
            None => self.gather_name(said, index),
        }
        said.opaque |= twice && (self.dialect != Dialect::Siemens || word.belongs != Belongs::Nothing);
    }

    /// Whether a word of a Heidenhain block is a value of an M word before it (M118 X1, M94 C), or of one of unknown kind.
    fn is_value_of_m(&self, said: &mut Said<'s>, index: usize) -> bool {
        let before = said.words[..index].iter().rev().find(|word| word.address() == Some(b'M'));
        let Some(m) = before.and_then(|word| self.literal(word)) else { return false };
        if m == 91.0 || m == 92.0 || !is_axis_name(said.words[index].name) {
            return false;
        }
        if !matches!(m as u32, 94 | 116 | 118 | 138 | 140) {
            said.unknown = Some((format!("M{m}"), Reason::UnknownWord));
        }
        true
    }

    fn gather_name(&mut self, said: &mut Said<'s>, index: usize) {
        let word = said.words[index];
        let at = Some(index);
        let name = word.name.to_ascii_uppercase();
        match (self.dialect, &*name) {
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'3']) => said.vector[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'2']) => said.rpy[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, b"THETA") => said.spin = at,
            (Dialect::Siemens, b"CR") => said.radius = at,
            (Dialect::Siemens, b"TURN" | b"AR" | b"I1" | b"J1" | b"K1") => said.turns = true,
            (Dialect::Siemens, b"RND" | b"CHF" | b"CHR") => said.corner = true,
            (Dialect::Siemens, b"RNDM") => said.corner = self.worth(&word).0 != Ok(0.0),
            (Dialect::Siemens, b"SUPA" | b"G153") => said.machine = true,
            (Dialect::Siemens, _) => self.gather_siemens(said, index, &name),
            (Dialect::Heidenhain, [b'I', letter @ b'X'..=b'Z']) => said.axes[usize::from(letter - b'X')] = at,
            (Dialect::Heidenhain, [b'I', letter @ b'A'..=b'C']) => said.abc[usize::from(letter - b'A')] = at,
            (Dialect::Heidenhain, [b'T', letter @ b'X'..=b'Z']) => {
                said.vector[usize::from(letter - b'X')] = at
            }
            (Dialect::Heidenhain, [b'I', b'U'..=b'W']) => said.others = true,
            (Dialect::Heidenhain, b"FMAX") => said.rapid = true,
            (Dialect::Heidenhain, b"RL" | b"RR") => said.compensates = Some(true),
            (
                Dialect::Heidenhain,
                b"L" | b"CC" | b"CR" | b"CT" | b"DR" | b"FU" | b"FZ" | b"FAUTO" | b"AUTO" | b"FQ" | b"FQL"
                | b"FQR" | b"FT" | b"LA" | b"MB" | b"MAX" | b"TCPM",
            ) => {}
            (Dialect::Heidenhain, b"NX" | b"NY" | b"NZ") => said.normal = true,
            (Dialect::Heidenhain, b"LN") => said.spatial = true,
            (Dialect::Heidenhain, _) => {
                let text = String::from_utf8_lossy(&name).into_owned();
                said.unknown = Some((text, Reason::UnknownWord));
            }
            _ => {}
        }
    }

    /// The number of a word that is a plain literal.
    pub(super) fn literal(&self, word: &Word<'_>) -> Option<f64> {
        match word.belongs {
            Belongs::Literal { sign, number } => {
                let value = literal(self.tree.text(number))?;
                let minus = sign.is_some_and(|sign| self.tree.kind(sign) == Some(Token::Minus));
                Some(if minus { -value } else { value })
            }
            _ => None,
        }
    }

    /// What a word is worth, and whether it says that it is an increment (IC, IX) or not (AC).
    pub(super) fn worth(&self, word: &Word<'_>) -> (Worth, Option<bool>) {
        let increment =
            (self.dialect == Dialect::Heidenhain && word.name.len() == 2 && word.name[0] | 32 == b'i')
                .then_some(true);
        match word.belongs {
            Belongs::Nothing | Belongs::Arguments { .. } => (Err(Reason::MissingArgument), increment),
            Belongs::Literal { number, .. } => {
                let value = self.literal(word).ok_or(Reason::WrongShape);
                // Fanuc counts increments or mm where no point is written, by a parameter of the control.
                let counted = self.dialect == Dialect::Fanuc
                    && !self.tree.text(number).contains(&b'.')
                    && value != Ok(0.0);
                let value = held(value);
                (if counted { Err(Reason::AmbiguousNumber) } else { value }, increment)
            }
            Belongs::Expression { first, end } => {
                let mut range = (first, end);
                let mut said = increment;
                if self.dialect == Dialect::Siemens && self.tree.kind(first) == Some(Token::Name) {
                    match &*self.tree.text(first).to_ascii_uppercase() {
                        b"IC" => (range.0, said) = (first + 1, Some(true)),
                        b"AC" | b"DC" | b"ACP" | b"ACN" => (range.0, said) = (first + 1, Some(false)),
                        _ => {}
                    }
                }
                (self.evaluated(range), said)
            }
        }
    }

    pub(super) fn evaluated(&self, range: (u32, u32)) -> Worth {
        let variables =
            |name: &Variable| -> Worth { self.state.variables.get(name, || self.ever_set.contains(name)) };
        let mut reader = Reader::new(self.tree, self.dialect, range, &variables);
        match reader.expression() {
            Ok(value) if reader.at >= range.1 => held(value),
            _ => Err(Reason::WrongShape),
        }
    }
}
