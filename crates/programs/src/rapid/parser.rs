//! Parser: tokens to a tree by the grammar of RAPID (kernel reference, chapter 10), with error recovery.
//!
//! Blocks are on an explicit stack, so that nesting uses no machine stack; expressions recurse to a stated depth. Unreadable
//! text becomes one `Opaque` node that ends at the next `;`, block keyword or, where only a `;` is missing, line; parsing then
//! continues. Chains of one operator are one flat node. The later parts of a large file are parsed ahead on other threads.

mod statement;

use rayon::prelude::*;

use self::statement::Parser;
use self::statement::ahead::{Ahead, cuts};
use super::lexer::{lex, lex_text};
use super::syntax::Syntax;
use super::token::Token;
use crate::tree::Tree;

/// Size of the parts of a file that are parsed in parallel (tokens).
const PART: usize = 1 << 18;

/// Parses one file. Never fails; [`Tree::opaque`] lists the unreadable parts.
pub fn parse(source: &[u8]) -> Tree<'_, Token, Syntax> {
    let tree = lex(source);
    let parts = (tree.len() / PART).min(rayon::current_num_threads());
    nodes_of(tree, parts)
}

/// The same with a stated number of parallel parts; the tree does not depend on it.
pub fn parse_in_parts(source: &[u8], parts: usize) -> Tree<'_, Token, Syntax> {
    nodes_of(lex(source), parts)
}

/// Parses one statement of a file.
pub(super) fn parse_statement(statement: &[u8]) -> Tree<'_, Token, Syntax> {
    nodes_of(lex_text(statement), 0)
}

fn nodes_of(mut tree: Tree<'_, Token, Syntax>, parts: usize) -> Tree<'_, Token, Syntax> {
    let (nodes, opaque) = {
        let cuts = cuts(&tree, parts);
        let mut parser = Parser::new(&tree);
        parser.begin();
        if let Some(&first) = cuts.first() {
            let ends = cuts[1..].iter().copied().chain([u32::MAX]);
            let ranges: Vec<_> = cuts.iter().copied().zip(ends).collect();
            let ((), ahead) = rayon::join(
                || parser.items(first),
                || -> Vec<_> {
                    ranges.into_par_iter().map(|(from, to)| Ahead::read(&tree, from, to)).collect()
                },
            );
            for ahead in ahead {
                parser.items(ahead.from);
                parser.take(&ahead);
            }
        }
        parser.items(u32::MAX);
        parser.finish();
        (parser.nodes, parser.opaque)
    };
    (tree.nodes, tree.opaque) = (nodes, opaque);
    tree
}
