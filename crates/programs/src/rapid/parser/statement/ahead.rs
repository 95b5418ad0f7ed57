//! Statements read ahead of their place: the later parts of a large file, on other threads.
//!
//! A part begins after a `;`. Where the parser comes to its first token right in the body of a routine, what was read
//! ahead is what it would read there; anywhere else it reads the part itself. What is read ahead ends before the first
//! thing that is no whole statement without fault.

use super::{Block, Parser};
use crate::rapid::syntax::Syntax;
use crate::rapid::token::Token;
use crate::tree::Tree;
use crate::tree::nodes::Nodes;

/// The blocks around what is read ahead.
const AROUND: [Syntax; 4] = [Syntax::File, Syntax::Module, Syntax::Proc, Syntax::Body];

/// Greatest distance from a cut to the statement that begins the next part (tokens).
const FAR: usize = 1 << 16;

/// Statements of the body of a routine.
pub(crate) struct Ahead {
    /// Their first token.
    pub(crate) from: u32,
    nodes: Nodes<Syntax>,
    at: u32,
    last: u32,
}

/// Where to cut a file into so many parts: tokens that begin a statement, if they stand in a body.
pub(crate) fn cuts(tree: &Tree<'_, Token, Syntax>, parts: usize) -> Vec<u32> {
    let kinds = tree.kinds();
    let begin = |part: usize| {
        let from = part * kinds.len() / parts;
        let mut behind =
            kinds[from..].iter().take(FAR).zip(from..).skip_while(|(kind, _)| **kind != Token::Semicolon);
        behind.next()?;
        let (kind, at) = behind.find(|(kind, _)| !kind.is_trivia())?;
        kind.begins_plain().then_some(at as u32)
    };
    let mut cuts: Vec<u32> = (1..parts).filter_map(begin).collect();
    cuts.dedup();
    cuts
}

impl Ahead {
    /// Reads from one token to the first statement that begins at or after another.
    pub(crate) fn read(tree: &Tree<'_, Token, Syntax>, from: u32, until: u32) -> Self {
        let mut parser = Parser::new(tree);
        (parser.at, parser.last) = (from, from);
        // One node stands for all blocks around, which are not ours.
        let node = parser.open(Syntax::File);
        parser.blocks.extend(AROUND.map(|kind| Block { kind, node, opener: from }));
        let mut good = (parser.nodes.len(), parser.at, parser.last);
        while parser.at < until && parser.peek().begins_plain() {
            parser.item();
            while parser.blocks.len() > AROUND.len()
                && parser.opaque.is_empty()
                && parser.peek() != Token::End
            {
                parser.item();
            }
            if parser.blocks.len() != AROUND.len() || !parser.opaque.is_empty() {
                break;
            }
            good = (parser.nodes.len(), parser.at, parser.last);
        }
        let (count, at, last) = good;
        parser.nodes.truncate(count);
        Ahead { from, nodes: parser.nodes, at, last }
    }
}

impl Parser<'_, '_> {
    /// Takes over what was read ahead, where it begins here.
    pub(crate) fn take(&mut self, ahead: &Ahead) {
        let here = self.at == ahead.from
            && self.blocks.len() == AROUND.len()
            && self.blocks.iter().zip(AROUND).all(|(block, around)| {
                block.kind == around || around == Syntax::Proc && block.kind.is_routine()
            });
        if here && ahead.nodes.len() > 1 {
            self.nodes.append(&ahead.nodes, 1);
            (self.at, self.last) = (ahead.at, ahead.last);
        }
    }
}

impl Token {
    /// Whether a statement that may stand anywhere in a body begins with it.
    fn begins_plain(self) -> bool {
        self.begins_with_keyword()
            || matches!(self, Token::Ident | Token::Percent | Token::Placeholder | Token::Semicolon)
    }
}
