//! A lossless syntax tree over bytes, in flat arrays.
//!
//! Tokens tile the file: each ends where the next starts, white space and comments included, so that the concatenated
//! tokens are the file, whatever its bytes. Nodes are in preorder; each has the size of its subtree and its range of
//! tokens, so that traversal follows no pointers and construction needs no allocation per node. The tree is
//! independent of the language: a dialect supplies the kinds of token (`T`) and node (`N`) and typed views of the
//! nodes.
//!
//! Offsets are 32 bits. A file of 4 GiB or more becomes a single token (the dialect marks it as opaque).

pub mod nodes;
pub mod starts;

use std::ops::Range;

use rayon::prelude::*;

pub use self::nodes::Node;
use self::nodes::Nodes;
use self::starts::Starts;
use crate::motion::{OpaqueReason, Span};

/// A range extended to its whole line, with blanks and line end, if nothing else is on the line.
pub(crate) fn whole_line(source: &[u8], range: Range<usize>) -> Range<usize> {
    let before = source[..range.start].iter().rposition(|byte| !matches!(byte, b' ' | b'\t'));
    let after = source[range.end..].iter().position(|byte| !matches!(byte, b' ' | b'\t' | b'\r'));
    let begins = before.is_none_or(|at| source[at] == b'\n');
    match after.map(|at| range.end + at) {
        Some(at) if begins && source[at] == b'\n' => before.map_or(0, |at| at + 1)..at + 1,
        _ => range,
    }
}

/// A region that the parser could not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Opaque {
    /// Its first token.
    pub first: u32,
    /// One past its last token.
    pub end: u32,
    /// Why.
    pub reason: OpaqueReason,
    /// The token at which parsing failed.
    pub at: u32,
}

/// The tree of one file.
#[derive(Debug, Clone)]
pub struct Tree<'s, T, N> {
    source: &'s [u8],
    kinds: Vec<T>,
    starts: Starts,
    lines: Vec<u32>,
    /// The nodes in preorder.
    pub nodes: Nodes<N>,
    /// The regions that could not be parsed, in file order.
    pub opaque: Vec<Opaque>,
}

/// A child of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Child {
    /// A token that belongs to no child node, by index.
    Token(u32),
    /// A child node, by index.
    Node(u32),
}

impl<'s, T: Copy, N: Copy> Tree<'s, T, N> {
    /// A tree of tokens without nodes. `estimate` is the expected number of tokens.
    pub fn new(source: &'s [u8], estimate: usize) -> Self {
        Tree {
            source,
            kinds: Vec::with_capacity(estimate),
            starts: Starts::with_capacity(estimate),
            lines: vec![0],
            nodes: Nodes::default(),
            opaque: Vec::new(),
        }
    }

    /// The tokens of a later part of the file, for [`Tree::append`].
    pub fn part(source: &'s [u8], estimate: usize) -> Self {
        Tree { lines: Vec::new(), ..Tree::new(source, estimate) }
    }

    /// Appends the tokens of the next parts of the same file.
    pub fn append(&mut self, parts: &[Self])
    where
        T: Send + Sync,
    {
        const AT_ONCE: usize = 1 << 16;
        for part in parts {
            self.starts.append(&part.starts);
            self.kinds.par_extend(part.kinds.par_iter().with_min_len(AT_ONCE).copied());
            self.lines.extend_from_slice(&part.lines);
        }
    }

    /// Appends the token that begins at `start`; it ends where the next begins.
    #[inline]
    pub fn push(&mut self, kind: T, start: usize) {
        self.kinds.push(kind);
        self.starts.push(start as u32);
    }

    /// Appends tokens with their starts.
    #[inline]
    pub fn extend(&mut self, kinds: &[T], starts: &[u32]) {
        self.kinds.extend_from_slice(kinds);
        self.starts.extend(starts);
    }

    /// Records that a line begins at `start`.
    #[inline]
    pub fn line_starts(&mut self, start: usize) {
        self.lines.push(start as u32);
    }

    /// The bytes of the file.
    pub fn source(&self) -> &'s [u8] {
        self.source
    }

    /// How many tokens there are.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Whether the file is empty.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// The kind of a token; `None` past the end.
    #[inline]
    pub fn kind(&self, token: u32) -> Option<T> {
        self.kinds.get(token as usize).copied()
    }

    /// Kinds of all tokens.
    pub fn kinds(&self) -> &[T] {
        &self.kinds
    }

    /// Where a token begins; the length of the file past the end.
    #[inline]
    pub fn start(&self, token: u32) -> usize {
        self.starts.get(token).map_or(self.source.len(), |start| start as usize)
    }

    /// The bytes of a token.
    #[inline]
    pub fn text(&self, token: u32) -> &'s [u8] {
        &self.source[self.range(token, token + 1)]
    }

    /// The byte range of tokens `first..end`.
    #[inline]
    pub fn range(&self, first: u32, end: u32) -> Range<usize> {
        let (start, end) = self.starts.pair(first, end);
        let length = self.source.len();
        start.map_or(length, |start| start as usize)..end.map_or(length, |end| end as usize)
    }

    /// The same as a [`Span`].
    pub fn span(&self, first: u32, end: u32) -> Span {
        let Range { start, end } = self.range(first, end);
        Span { start: start as u32, end: end as u32 }
    }

    /// The bytes of a node.
    pub fn node_text(&self, node: u32) -> &'s [u8] {
        let node = self.nodes.get(node);
        &self.source[self.range(node.first, node.end)]
    }

    /// The span of a node.
    pub fn node_span(&self, node: u32) -> Span {
        let node = self.nodes.get(node);
        self.span(node.first, node.end)
    }

    /// Line and column, from 1, of a byte; the column counts bytes.
    pub fn line_column(&self, byte: usize) -> (u32, u32) {
        let line = self.lines.partition_point(|&start| start as usize <= byte);
        (line as u32, (byte - self.lines[line - 1] as usize) as u32 + 1)
    }

    /// [`Tree::line_column`] of a byte that is probably on the line `last` or soon after it, as places in file order are.
    pub fn line_column_after(&self, byte: usize, last: u32) -> (u32, u32) {
        const NEAR: usize = 4;
        let from = last.saturating_sub(1) as usize;
        let near = self.lines.get(from..).unwrap_or_default();
        let begun = near.iter().take(NEAR).take_while(|&&start| start as usize <= byte).count();
        if begun == 0 || begun == NEAR {
            return self.line_column(byte);
        }
        ((from + begun) as u32, (byte - near[begun - 1] as usize) as u32 + 1)
    }

    /// The children of a node, tokens and nodes in order.
    pub fn children(&self, node: u32) -> Children<'_, 's, T, N> {
        let Node { size, first, end, .. } = self.nodes.get(node);
        Children { tree: self, token: first, end, node: node + 1, end_node: node + size }
    }

    /// The child nodes of a node.
    pub fn child_nodes(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let end = self.nodes.subtree_end(node);
        let mut next = node + 1;
        std::iter::from_fn(move || {
            (next < end).then(|| {
                let this = next;
                next = self.nodes.subtree_end(this);
                this
            })
        })
    }

    /// The concatenated tokens: the file.
    pub fn print(&self) -> Vec<u8> {
        (0..self.len() as u32).flat_map(|token| self.text(token).iter().copied()).collect()
    }
}

/// Iterator of [`Tree::children`].
#[derive(Debug)]
pub struct Children<'t, 's, T, N> {
    tree: &'t Tree<'s, T, N>,
    token: u32,
    end: u32,
    node: u32,
    end_node: u32,
}

impl<T: Copy, N: Copy> Iterator for Children<'_, '_, T, N> {
    type Item = Child;

    fn next(&mut self) -> Option<Child> {
        if self.node < self.end_node {
            let node = self.tree.nodes.get(self.node);
            if node.first <= self.token {
                let child = Child::Node(self.node);
                self.node += node.size;
                self.token = node.end;
                return Some(child);
            }
        }
        (self.token < self.end).then(|| {
            self.token += 1;
            Child::Token(self.token - 1)
        })
    }
}
