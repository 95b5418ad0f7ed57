//! The nodes of a tree, eight bytes each.
//!
//! Nearly every node has few nodes and tokens inside, which fit three bytes. The others (files, routines, blocks) are marked, and a
//! table has their sizes.

use rayon::prelude::*;

/// A node: its kind, the size of its subtree, and its tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node<N> {
    /// Its kind.
    pub kind: N,
    /// The number of nodes in the subtree, itself included.
    pub size: u32,
    /// Its first token.
    pub first: u32,
    /// One past its last token.
    pub end: u32,
}

/// A node as it is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Packed<N> {
    first: u32,
    tokens: u16,
    /// The size of its subtree, or [`LARGE`].
    size: u8,
    kind: N,
}

/// The stored size of a node that is in the table.
const LARGE: u8 = u8::MAX;

/// A node with more nodes or tokens than fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Large {
    node: u32,
    size: u32,
    tokens: u32,
}

/// Nodes in preorder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Nodes<N> {
    packed: Vec<Packed<N>>,
    /// In ascending order of node.
    large: Vec<Large>,
}

impl<N> Default for Nodes<N> {
    fn default() -> Self {
        Nodes { packed: Vec::new(), large: Vec::new() }
    }
}

impl<N: Copy> Nodes<N> {
    /// No nodes, but room for so many.
    pub fn with_capacity(nodes: usize) -> Self {
        Nodes { packed: Vec::with_capacity(nodes), large: Vec::new() }
    }

    /// How many there are.
    #[inline]
    pub fn len(&self) -> u32 {
        self.packed.len() as u32
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.packed.is_empty()
    }

    /// A node.
    #[inline]
    pub fn get(&self, node: u32) -> Node<N> {
        let Packed { kind, first, tokens, size } = self.packed[node as usize];
        let (size, tokens) = if size == LARGE { self.sizes(node) } else { (size.into(), tokens.into()) };
        Node { kind, size, first, end: first + tokens }
    }

    /// The kind of a node.
    #[inline]
    pub fn kind(&self, node: u32) -> N {
        self.packed[node as usize].kind
    }

    /// The first token of a node.
    #[inline]
    pub fn first(&self, node: u32) -> u32 {
        self.packed[node as usize].first
    }

    /// One past the last node of a node's subtree.
    #[inline]
    pub fn subtree_end(&self, node: u32) -> u32 {
        let size = self.packed[node as usize].size;
        node + if size == LARGE { self.sizes(node).0 } else { size.into() }
    }

    /// All nodes in order.
    pub fn iter(&self) -> impl Iterator<Item = Node<N>> + '_ {
        (0..self.len()).map(|node| self.get(node))
    }

    /// Appends a node whose end is not known yet; returns its index.
    #[inline]
    pub fn open(&mut self, kind: N, first: u32) -> u32 {
        self.packed.push(Packed { first, tokens: 0, size: 0, kind });
        self.len() - 1
    }

    /// The same before the nodes from `node` on.
    pub fn open_before(&mut self, node: u32, kind: N, first: u32) {
        self.packed.insert(node as usize, Packed { first, tokens: 0, size: 0, kind });
        let at = self.place(node);
        self.large[at..].iter_mut().for_each(|large| large.node += 1);
    }

    /// Ends a node with the last one there is: all that follow it are its subtree.
    #[inline]
    pub fn close(&mut self, node: u32, first: u32, end: u32) {
        let (size, tokens) = (self.len() - node, end - first);
        let packed = &mut self.packed[node as usize];
        packed.first = first;
        if size < LARGE.into() && tokens <= u16::MAX.into() && packed.size != LARGE {
            (packed.size, packed.tokens) = (size as u8, tokens as u16);
        } else {
            self.close_large(Large { node, size, tokens });
        }
    }

    #[cold]
    fn close_large(&mut self, large: Large) {
        let packed = &mut self.packed[large.node as usize];
        let at = self.large.partition_point(|other| other.node < large.node);
        if packed.size == LARGE {
            self.large[at] = large;
        } else {
            packed.size = LARGE;
            self.large.insert(at, large);
        }
    }

    /// Appends a node without nodes inside.
    #[inline]
    pub fn push(&mut self, kind: N, first: u32, end: u32) {
        let node = self.open(kind, first);
        self.close(node, first, end);
    }

    /// Changes the kind of a node.
    #[inline]
    pub fn set_kind(&mut self, node: u32, kind: N) {
        self.packed[node as usize].kind = kind;
    }

    /// Removes the nodes from `node` on.
    pub fn truncate(&mut self, node: u32) {
        self.packed.truncate(node as usize);
        self.large.truncate(self.place(node));
    }

    /// Appends the nodes of another list from its node `from` on.
    pub fn append(&mut self, other: &Self, from: u32)
    where
        N: Send + Sync,
    {
        const AT_ONCE: usize = 1 << 16;
        let begin = self.len();
        let nodes = &other.packed[from as usize..];
        self.packed.par_extend(nodes.par_iter().with_min_len(AT_ONCE).copied());
        let large = &other.large[other.place(from)..];
        self.large.extend(large.iter().map(|large| Large { node: large.node - from + begin, ..*large }));
    }

    /// Where in the table the nodes from `node` on begin.
    fn place(&self, node: u32) -> usize {
        self.large.partition_point(|large| large.node < node)
    }

    /// Size and tokens of a node in the table.
    #[cold]
    fn sizes(&self, node: u32) -> (u32, u32) {
        let Large { size, tokens, .. } = self.large[self.place(node)];
        (size, tokens)
    }
}
