//! Collects the words of a block, and evaluates their values.

use super::super::dialect::Dialect;
use super::super::expression::{Evaluated, Evaluator, MAX_NUMBER, Variable, literal};
use super::super::modal_group::ModalGroup;
use super::super::parser::word;
use super::super::syntax::{Syntax, Word, WordValue};
use super::super::token::Token;
use super::{Block, Interpreter, code, is_axis, is_axis_name};
use crate::motion::Reason;
use crate::tree::Node;

/// A value that a control can represent.
fn in_range(value: Evaluated) -> Evaluated {
    value.and_then(|value| if value.abs() < MAX_NUMBER { Ok(value) } else { Err(Reason::NumberRange) })
}

/// The largest number of words that is read; controls take some hundred characters.
const BLOCK_WORDS: u32 = 1000;

impl<'s> Interpreter<'_, 's> {
    pub(super) fn collect_words(&mut self, node: u32, block: &mut Block<'s>) {
        let mut words = std::mem::take(&mut block.words);
        let (mut g, mut m) = (std::mem::take(&mut block.g), std::mem::take(&mut block.m));
        words.clear();
        g.clear();
        m.clear();
        *block = Block { node, words, g, m, ..Block::default() };
        let kind = self.tree.nodes.kind(node);
        block.flags.skippable = kind == Syntax::Skippable;
        block.flags.opaque = kind == Syntax::Opaque;
        if self.tree.nodes.get(node).size > BLOCK_WORDS {
            (block.flags.opaque, block.flags.opaque_may_set) = (true, true);
            return;
        }
        for child in self.tree.child_nodes(node) {
            if self.tree.nodes.kind(child) == Syntax::Opaque {
                let Node { first, end, .. } = self.tree.nodes.get(child);
                block.flags.opaque = true;
                block.flags.opaque_may_set |= self.may_set(first, end);
                continue;
            }
            let found = word(self.tree, child);
            block.words.push(found);
        }
        for index in 0..block.words.len() {
            self.collect_word(block, index);
        }
        self.values_of_m(block);
        if block.flags.surface_normal
            && block.vector.iter().all(Option::is_none)
            && self.may_turn_to_normal(block)
        {
            block.unmodelled.get_or_insert(Reason::AlignedToNormal);
        }
        // Elsewhere the control rejects a tool vector.
        let heidenhain = self.dialect == Dialect::Heidenhain;
        block.flags.opaque |= heidenhain && !block.flags.is_ln && block.vector.iter().any(Option::is_some);
        let first = block.words.first();
        block.flags.paraxial = heidenhain
            && first.is_some_and(|word| is_axis_name(word.name) && word.value != WordValue::Absent);
        // Two different motion codes: which one holds depends on the control.
        let mut modes = block.g.iter().filter(|&&code| matches!(code, 0 | 10 | 20 | 30));
        if let Some(first) = modes.next()
            && modes.any(|other| other != first)
        {
            block.flags.opaque = true;
        }
    }

    /// Whether the control may align the tool with the surface normal, as under M128 and TCPM.
    fn may_turn_to_normal(&self, block: &Block<'_>) -> bool {
        self.state.groups.tcp_mode()
            || block.m.contains(&128)
            || self.state.unknown_reason(ModalGroup::TcpMode.bit()).is_some()
    }

    /// Whether an unreadable part may hold more than axis words.
    fn may_set(&self, first: u32, end: u32) -> bool {
        (first..end).any(|token| match self.tree.kind(token) {
            Some(Token::Name) => self.tree.text(token).iter().any(|byte| !is_axis(*byte)),
            Some(Token::Address) => !is_axis(self.tree.text(token)[0]),
            Some(Token::Hash | Token::Equal) => true,
            _ => false,
        })
    }

    fn collect_word(&mut self, block: &mut Block<'s>, index: usize) {
        let word = block.words[index];
        let at = Some(index);
        let mut twice = false;
        let mut put = |slot: &mut Option<usize>| {
            twice |= slot.is_some();
            *slot = at;
        };
        let heidenhain = self.dialect == Dialect::Heidenhain;
        let comma = index > 0 && block.words[index - 1].name == b",";
        // The words after some M words are their values.
        if heidenhain && word.address() != Some(b'M') && self.is_value_of_m(block, index) {
            return;
        }
        match word.address() {
            Some(b'G') => match self.literal(&word) {
                Some(number) if number >= 0.0 => block.g.push(code(number)),
                _ => match self.evaluate_word(&word).0 {
                    Ok(number) if number >= 0.0 => block.g.push(code(number)),
                    Ok(_) => block.unknown_word = Some(("G".to_owned(), Reason::UnknownWord)),
                    Err(_) => block.unknown_word = Some(("G".to_owned(), Reason::UnknownVariable)),
                },
            },
            Some(b'M') => match self.literal(&word) {
                Some(number) => block.m.push(number.round() as u32),
                // A path block may end with a bare M.
                None if heidenhain && word.value == WordValue::Absent => {}
                None => block.unknown_word = Some(("M".to_owned(), Reason::UnknownVariable)),
            },
            Some(b'X') => put(&mut block.axes[0]),
            Some(b'Y') => put(&mut block.axes[1]),
            Some(b'Z') => put(&mut block.axes[2]),
            Some(b'C') if heidenhain && word.value == WordValue::Absent => {}
            Some(b'C' | b'R') if comma => block.flags.corner |= self.evaluate_word(&word).0 != Ok(0.0),
            // `,A45.`: the angle of the line.
            Some(_) if comma => block.unmodelled = Some(Reason::UnsupportedPath),
            Some(letter @ (b'A' | b'B' | b'C')) => put(&mut block.abc[usize::from(letter - b'A')]),
            Some(letter @ (b'I' | b'J' | b'K')) => put(&mut block.centre[usize::from(letter - b'I')]),
            Some(b'R') if heidenhain => match (word.value, self.literal(&word)) {
                (WordValue::Literal { sign: None, .. }, Some(value))
                    if value == 0.0 || !block.words.first().is_some_and(|word| word.is("CR")) =>
                {
                    block.flags.radius_compensation = Some(value != 0.0);
                }
                // R+ and R- lengthen or shorten the motion of a paraxial block.
                (WordValue::Absent, _) => {
                    (block.flags.radius_compensation, block.flags.paraxial_compensation) = (Some(true), true)
                }
                _ => put(&mut block.radius),
            },
            Some(b'R') => put(&mut block.radius),
            Some(b'F') => block.feed = at,
            Some(b'P') => block.p = at,
            Some(b'L') => block.l = at,
            Some(b'Q') => block.q = at,
            Some(b'H') => block.h = at,
            Some(b'D') => block.d = at,
            Some(b'U' | b'V' | b'W') => block.flags.other_axes = true,
            Some(b'E') if self.dialect != Dialect::Fanuc => block.flags.other_axes = true,
            Some(_) => {}
            None => self.collect_name(block, index),
        }
        block.flags.opaque |= twice && (self.dialect != Dialect::Siemens || word.value != WordValue::Absent);
    }

    /// Whether a word of a Heidenhain block is a value of an M word before it (M118 X1, M94 C), or of one of unknown
    /// kind.
    fn is_value_of_m(&self, block: &mut Block<'s>, index: usize) -> bool {
        let before = block.words[..index].iter().rev().find(|word| word.address() == Some(b'M'));
        let Some(m) = before.and_then(|word| self.literal(word)) else { return false };
        if m == 91.0 || m == 92.0 || !is_axis_name(block.words[index].name) {
            return false;
        }
        if !matches!(m as u32, 94 | 116 | 118 | 138 | 140) {
            block.unknown_word = Some((format!("M{m}"), Reason::UnknownWord));
        }
        true
    }

    fn collect_name(&mut self, block: &mut Block<'s>, index: usize) {
        let word = block.words[index];
        let at = Some(index);
        let name = word.name.to_ascii_uppercase();
        match (self.dialect, &*name) {
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'3']) => block.vector[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, [letter @ b'A'..=b'C', b'2']) => block.rpy[usize::from(letter - b'A')] = at,
            (Dialect::Siemens, b"THETA") => block.spin = at,
            (Dialect::Siemens, b"CR") => block.radius = at,
            (Dialect::Siemens, b"TURN" | b"AR" | b"I1" | b"J1" | b"K1") => block.flags.special_arc = true,
            (Dialect::Siemens, b"RND" | b"CHF" | b"CHR") => {
                block.flags.corner |= self.evaluate_word(&word).0 != Ok(0.0);
            }
            (Dialect::Siemens, b"RNDM") => {
                block.flags.modal_corner = Some(self.evaluate_word(&word).0 != Ok(0.0));
            }
            (Dialect::Siemens, b"SUPA" | b"G153") => block.flags.machine_coordinates = true,
            (Dialect::Siemens, _) => self.collect_siemens_name(block, index, &name),
            (Dialect::Heidenhain, [b'I', letter @ b'X'..=b'Z']) => {
                block.axes[usize::from(letter - b'X')] = at
            }
            (Dialect::Heidenhain, [b'I', letter @ b'A'..=b'C']) => block.abc[usize::from(letter - b'A')] = at,
            (Dialect::Heidenhain, [b'T', letter @ b'X'..=b'Z']) => {
                block.vector[usize::from(letter - b'X')] = at
            }
            (Dialect::Heidenhain, [b'I', b'U'..=b'W']) => block.flags.other_axes = true,
            (Dialect::Heidenhain, b"FMAX") => block.flags.rapid = true,
            (Dialect::Heidenhain, b"RL" | b"RR") => block.flags.radius_compensation = Some(true),
            (
                Dialect::Heidenhain,
                b"L" | b"CC" | b"CR" | b"CT" | b"DR" | b"FU" | b"FZ" | b"FAUTO" | b"AUTO" | b"FQ" | b"FQL"
                | b"FQR" | b"FT" | b"LA" | b"MB" | b"MAX" | b"TCPM",
            ) => {}
            (Dialect::Heidenhain, b"NX" | b"NY" | b"NZ") => block.flags.surface_normal = true,
            (Dialect::Heidenhain, b"LN") => block.flags.is_ln = true,
            (Dialect::Heidenhain, _) => {
                let text = String::from_utf8_lossy(&name).into_owned();
                block.unknown_word = Some((text, Reason::UnknownWord));
            }
            _ => {}
        }
    }

    /// The number of a word that is a literal.
    pub(super) fn literal(&self, word: &Word<'_>) -> Option<f64> {
        match word.value {
            WordValue::Literal { sign, number } => {
                let value = literal(self.tree.text(number))?;
                let minus = sign.is_some_and(|sign| self.tree.kind(sign) == Some(Token::Minus));
                Some(if minus { -value } else { value })
            }
            _ => None,
        }
    }

    /// The value of a word, and whether the word itself states an increment (IC, IX) or an absolute value (AC).
    pub(super) fn evaluate_word(&self, word: &Word<'_>) -> (Evaluated, Option<bool>) {
        let increment =
            (self.dialect == Dialect::Heidenhain && word.name.len() == 2 && word.name[0] | 32 == b'i')
                .then_some(true);
        match word.value {
            WordValue::Absent | WordValue::Arguments { .. } => (Err(Reason::MissingArgument), increment),
            WordValue::Literal { number, .. } => {
                let value = self.literal(word).ok_or(Reason::WrongShape);
                // Without a decimal point a Fanuc counts increments or mm, by a parameter of the control.
                let counted = self.dialect == Dialect::Fanuc
                    && !self.tree.text(number).contains(&b'.')
                    && value != Ok(0.0);
                let value = in_range(value);
                (if counted { Err(Reason::AmbiguousNumber) } else { value }, increment)
            }
            WordValue::Expression { first, end } => {
                let mut range = (first, end);
                let mut block = increment;
                if self.dialect == Dialect::Siemens && self.tree.kind(first) == Some(Token::Name) {
                    match &*self.tree.text(first).to_ascii_uppercase() {
                        b"IC" => (range.0, block) = (first + 1, Some(true)),
                        b"AC" | b"DC" | b"ACP" | b"ACN" => (range.0, block) = (first + 1, Some(false)),
                        _ => {}
                    }
                }
                (self.evaluate_tokens(range), block)
            }
        }
    }

    pub(super) fn evaluate_tokens(&self, range: (u32, u32)) -> Evaluated {
        let variables = |name: &Variable| -> Evaluated {
            self.state.variables.get(name, || self.assigned_variables.contains(name))
        };
        let mut evaluator = Evaluator::new(self.tree, self.dialect, range, &variables);
        match evaluator.expression() {
            Ok(value) if evaluator.at >= range.1 => in_range(value),
            _ => Err(Reason::WrongShape),
        }
    }
}
