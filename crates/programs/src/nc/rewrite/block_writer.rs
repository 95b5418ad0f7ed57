//! Writes the words of one block: numbers in place, added words at their place in the word order.

use super::word_slots::{ANGLES, ORDER, SPIN, VECTOR, WordSlots, spaced};
use crate::edit::Edits;
use crate::nc::dialect::Dialect;
use crate::nc::expression::literal;
use crate::nc::syntax::{NcTree, Word, WordValue};
use crate::nc::task::BlockContext;
use crate::nc::token::Token;
use crate::rapid::number;
use crate::rewrite::RewriteOutcome;

/// Changes smaller than this are numerical noise, whatever the decimals of the source.
const NOISE: f64 = 1e-9;

/// Writes the words of one block.
pub(super) struct BlockWriter<'p, 's> {
    pub(super) tree: &'p NcTree<'s>,
    pub(super) dialect: Dialect,
    pub(super) edits: &'p mut Edits,
    /// The words of the block in standard order.
    pub(super) order: [Option<Word<'p>>; ORDER],
    /// New words go after this token if the block has none of these words.
    pub(super) end: u32,
    /// The words of a block that is inserted.
    pub(super) added: Vec<u8>,
    pub(super) replaced: RewriteOutcome,
    /// Whether words are separated by white space here.
    pub(super) spaced: bool,
    /// The token before which L must be inserted if a paraxial block of Heidenhain gets words.
    pub(super) lead: Option<u32>,
}

impl<'p, 's: 'p> BlockWriter<'p, 's> {
    /// A writer for an existing block.
    pub(super) fn new(
        tree: &'p NcTree<'s>,
        dialect: Dialect,
        edits: &'p mut Edits,
        slots: &WordSlots<'s>,
        context: &BlockContext,
    ) -> Self {
        BlockWriter {
            tree,
            dialect,
            edits,
            order: slots.order(),
            end: slots.end,
            added: Vec::new(),
            replaced: RewriteOutcome::Unchanged,
            spaced: spaced(tree, slots.last),
            lead: slots.first.filter(|_| context.paraxial).map(|word| word.first),
        }
    }

    /// The outcome for the block.
    pub(super) fn finish(mut self) -> RewriteOutcome {
        if let Some(token) = self.lead.take()
            && self.replaced != RewriteOutcome::Unchanged
        {
            self.edits.insert(self.tree.start(token), b"L ");
        }
        self.replaced
    }
}

impl BlockWriter<'_, '_> {
    /// Adds a word before the next one in standard order, else after the last.
    fn insert(&mut self, place: usize, mut text: Vec<u8>) {
        if self.end == 0 {
            self.added.push(b' ');
            self.added.extend_from_slice(&text);
            return;
        }
        if self.replaced == RewriteOutcome::Unchanged {
            self.replaced = RewriteOutcome::InPlace;
        }
        match self.order[place + 1..].iter().flatten().next() {
            Some(next) => {
                if self.spaced {
                    text.push(b' ');
                }
                if self.lead == Some(next.first) {
                    self.lead = None;
                    text.splice(0..0, *b"L ");
                }
                self.edits.insert(self.tree.start(next.first), &text);
            }
            None => {
                let last = self.order[..place].iter().flatten().next_back().map_or(self.end, |word| word.end);
                if self.spaced {
                    text.insert(0, b' ');
                }
                // After the last byte of the word: white space belongs to the next token.
                let at = self.tree.start(last - 1) + self.tree.text(last - 1).len();
                self.edits.insert(at, &text);
            }
        }
    }

    /// The decimals of a word: a Fanuc takes eight digits.
    fn fitting_decimals(&self, value: f64, decimals: u8) -> u8 {
        const DIGITS: u8 = 8;
        if self.dialect != Dialect::Fanuc {
            return decimals;
        }
        let whole = value.abs().max(1.0).log10() as u8 + 1;
        decimals.min(DIGITS.saturating_sub(whole))
    }

    /// The decimals with which a word is written if the source has no more. A Heidenhain control takes four of a coordinate in mm or
    /// degrees and eight of a tool vector (TNC 640, User's Manual DIN/ISO 1/2015, section 19.3); in inches one more, which is no coarser.
    fn least_decimals(&self, place: usize, least: u8) -> u8 {
        const COORDINATE: u8 = 4;
        match place {
            _ if self.dialect != Dialect::Heidenhain => least,
            VECTOR..SPIN => least,
            ANGLES..VECTOR => least.min(COORDINATE),
            _ => least.min(COORDINATE + 1),
        }
    }

    /// Gives a word a value. An omitted word is added if the value in effect without it (`keep`) differs; an
    /// expression with that value already (`was`) is kept. Returns the value that the control reads.
    pub(super) fn write_word(
        &mut self,
        place: usize,
        name: &[u8],
        value: f64,
        keep: f64,
        was: f64,
        least: u8,
    ) -> f64 {
        if !value.is_finite() {
            return keep;
        }
        let least = self.fitting_decimals(value, self.least_decimals(place, least));
        let Some(word) = self.order[place] else {
            if !differs(keep, value, least) {
                return keep;
            }
            let mut text = name.to_vec();
            if name.len() > 1 && self.dialect == Dialect::Siemens {
                text.push(b'=');
            }
            if self.dialect == Dialect::Heidenhain && number::rounded(value, least) >= 0.0 {
                text.push(b'+');
            }
            number::write(&mut text, value, least);
            self.insert(place, text);
            return number::rounded(value, least);
        };
        match word.value {
            WordValue::Literal { sign, number: token } => {
                let text = self.tree.text(token);
                let minus = sign.is_some_and(|sign| self.tree.kind(sign) == Some(Token::Minus));
                let old = literal(text).map_or(f64::NAN, |old| if minus { -old } else { old });
                let decimals = self.fitting_decimals(value, decimals(text).max(least));
                if !differs(old, value, decimals) {
                    return old;
                }
                let first = sign.unwrap_or(token);
                let plus = sign.is_some_and(|sign| self.tree.kind(sign) == Some(Token::Plus))
                    || self.dialect == Dialect::Heidenhain;
                let rounded = number::rounded(value, decimals);
                self.edits.replace_with(self.tree.range(first, token + 1), |out| {
                    if plus && rounded >= 0.0 {
                        out.push(b'+');
                    }
                    number::write(out, value, decimals);
                });
                if self.replaced == RewriteOutcome::Unchanged {
                    self.replaced = RewriteOutcome::InPlace;
                }
                rounded
            }
            WordValue::Expression { .. } if !differs(was, value, least) => was,
            WordValue::Expression { first, end } => {
                // AC( … ) and IC( … ) keep their name.
                let is_subprogram =
                    self.dialect == Dialect::Siemens && self.tree.kind(first) == Some(Token::Name) && {
                        let name = self.tree.text(first).to_ascii_uppercase();
                        matches!(&*name, b"AC" | b"IC" | b"DC" | b"ACP" | b"ACN")
                    };
                let open = (first..end).find(|&token| self.tree.kind(token) == Some(Token::ParenOpen));
                let range = match open {
                    Some(open) if is_subprogram => self.tree.start(open + 1)..self.tree.start(end - 1),
                    _ => self.tree.range(first, end),
                };
                let rounded = number::rounded(value, least);
                self.edits.replace_with(range, |out| number::write(out, value, least));
                self.replaced = RewriteOutcome::Inlined;
                rounded
            }
            WordValue::Absent | WordValue::Arguments { .. } => keep,
        }
    }
}

/// Half a unit of the last decimal, and at least the noise. NaN differs from everything.
pub(super) fn differs(old: f64, new: f64, decimals: u8) -> bool {
    let half = 0.5 * 10_f64.powi(-i32::from(decimals));
    !((new - old).abs() <= half.max(NOISE))
}

fn decimals(text: &[u8]) -> u8 {
    // 1.5EX1 of Siemens is rewritten without its exponent.
    if text.iter().any(|byte| byte.eq_ignore_ascii_case(&b'E')) {
        return 0;
    }
    let point = text.iter().position(|byte| matches!(byte, b'.' | b','));
    point.map_or(0, |point| (text.len() - point - 1).min(usize::from(number::MAX_DECIMALS)) as u8)
}
