//! What the whole file sets, and where its jumps go: read once before the blocks are followed.

use super::super::dialect::Dialect;
use super::super::expression::literal;
use super::super::parser::word;
use super::super::syntax::{Belongs, Syntax};
use super::super::token::Token;
use super::{Lister, code};

impl Lister<'_, '_> {
    /// What the whole file sets, and where its jumps go.
    pub(super) fn survey(&mut self) {
        let mut jump = false;
        // `%NAME G71 *`: DIN/ISO of Heidenhain, whose G words have meanings of their own.
        let tape = (0..self.tree.len() as u32).find(|&token| self.tree.kind(token) == Some(Token::Tape));
        self.foreign = self.dialect.paren_comments()
            && tape.is_some_and(|token| {
                let text = self.tree.text(token).to_ascii_uppercase();
                text.split(u8::is_ascii_whitespace).any(|word| matches!(word, b"G70" | b"G71"))
            });
        let mut block = Block::default();
        let (mut programs, mut back) = (0, false);
        for node in 0..self.tree.nodes.len() as u32 {
            if matches!(self.tree.nodes[node as usize].kind, Syntax::Block | Syntax::Skippable) {
                self.survey_block(&block);
                back |= block.back && block.p.is_none();
                block = Block::default();
            }
            if self.tree.nodes[node as usize].kind != Syntax::Word {
                continue;
            }
            let said = word(self.tree, node);
            let number = match said.belongs {
                Belongs::Literal { sign: None, number } => literal(self.tree.text(number)),
                _ => None,
            };
            let address = said.address();
            if jump {
                // GOTO N100: the block number stands in a word of its own.
                jump = false;
                match (address, number) {
                    (Some(b'N'), Some(number)) => {
                        self.targets.insert(number as u64);
                        continue;
                    }
                    // A label; anything else is computed.
                    (None, _)
                        if said
                            .name
                            .first()
                            .is_some_and(|byte| byte.is_ascii_alphabetic() || *byte == b'_') => {}
                    _ => self.anywhere = true,
                }
            }
            match (address, number) {
                (Some(b'G'), Some(number)) => block.cycle |= matches!(code(number), 700..=730),
                (Some(b'M'), Some(number)) => {
                    self.changes_tools |= number == 6.0;
                    block.back |= number == 99.0;
                }
                (Some(b'P'), Some(number)) => block.p = Some(number as u64),
                (Some(b'Q'), Some(number)) => block.q = Some(number as u64),
                (Some(b'O'), Some(_)) => programs += 1,
                (None, _) if said.is("DEF") || block.declares => {
                    block.declares = true;
                    self.declared.insert(said.name.to_ascii_uppercase());
                }
                (None, number) if said.name.len() >= 4 && said.name[..4].eq_ignore_ascii_case(b"GOTO") => {
                    match number {
                        Some(number) => {
                            self.targets.insert(number as u64);
                        }
                        None if said.belongs == Belongs::Nothing && said.index.is_none() => jump = true,
                        None => self.anywhere = true,
                    }
                }
                _ => {}
            }
        }
        self.survey_block(&block);
        back |= block.back && block.p.is_none();
        self.repeats = back && programs <= 1;
    }

    fn survey_block(&mut self, block: &Block) {
        if block.back
            && let Some(p) = block.p
        {
            self.targets.insert(p);
        }
        if block.cycle
            && let (Some(p), Some(q)) = (block.p, block.q)
        {
            self.contours.push((p, q));
        }
    }

    /// Whether the program begins again at its end (M99 in one that calls nothing).
    pub(super) fn repeats(&self) -> bool {
        self.dialect != Dialect::Heidenhain && self.repeats
    }
}

/// What a block says that the survey looks at.
#[derive(Default)]
struct Block {
    /// M99.
    back: bool,
    /// G70 to G73.
    cycle: bool,
    /// DEF.
    declares: bool,
    p: Option<u64>,
    q: Option<u64>,
}
