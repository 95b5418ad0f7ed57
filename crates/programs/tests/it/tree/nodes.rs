//! Nodes in eight bytes against a plain list, on the borders of what fits and beyond.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_programs::tree::Node;
use truegrind_programs::tree::nodes::Nodes;

/// A list that is built as a parser does, and the same plainly.
#[derive(Default)]
struct Both {
    nodes: Nodes<u8>,
    plain: Vec<Node<u8>>,
    open: Vec<u32>,
    token: u32,
}

impl Both {
    fn open(&mut self, kind: u8) {
        self.open.push(self.nodes.open(kind, self.token));
        self.plain.push(Node { kind, size: 0, first: self.token, end: self.token });
    }

    fn close(&mut self) {
        let Some(node) = self.open.pop() else { return };
        let size = self.nodes.len() - node;
        let plain = &mut self.plain[node as usize];
        (plain.size, plain.end) = (size, self.token);
        self.nodes.close(node, plain.first, self.token);
    }

    /// The last thing was an operand: it gets a node around it, which stays open.
    fn wrap(&mut self, node: u32, kind: u8) {
        let first = self.plain[node as usize].first;
        self.nodes.open_before(node, kind, first);
        self.plain.insert(node as usize, Node { kind, size: 0, first, end: first });
        self.open.push(node);
    }

    fn truncate(&mut self, node: u32) {
        self.nodes.truncate(node);
        self.plain.truncate(node as usize);
        self.open.retain(|&open| open < node);
    }

    fn check(&self) {
        assert_eq!(self.nodes.len() as usize, self.plain.len());
        assert!(self.nodes.iter().eq(self.plain.iter().copied()));
        for (node, plain) in (0..).zip(&self.plain) {
            assert_eq!((self.nodes.kind(node), self.nodes.first(node)), (plain.kind, plain.first));
            assert_eq!(self.nodes.subtree_end(node), node + plain.size);
        }
    }
}

#[test]
fn sizes_on_either_side_of_what_fits_come_back() {
    for inside in [0, 252, 253, 254, 255, 256, 300, 70_000] {
        for tokens in [0, 1, 65_534, 65_535, 65_536, 65_537, 1 << 20] {
            let mut both = Both::default();
            both.open(0);
            both.open(1);
            (0..inside).for_each(|_| {
                both.open(2);
                both.close();
            });
            both.token += tokens;
            both.close();
            both.close();
            both.check();
        }
    }
}

#[test]
fn what_a_parser_does_gives_the_nodes_of_a_plain_list() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for _ in 0..200 {
        let mut both = Both::default();
        // The last node that was closed, while nothing has followed it.
        let mut closed = None;
        for _ in 0..random.random_range(0..3000) {
            both.token += if random.random_bool(0.01) { 40_000 } else { random.random_range(0..3) };
            match random.random_range(0..100) {
                0 => {
                    let count = both.plain.len() as u32;
                    both.truncate(count - count.min(random.random_range(0..400)));
                    closed = None;
                }
                1..10 => {
                    if let Some(node) = closed.take() {
                        both.wrap(node, random.random());
                    }
                }
                10..52 => {
                    both.open(random.random());
                    closed = None;
                }
                _ => {
                    closed = both.open.last().copied();
                    both.close();
                }
            }
        }
        while !both.open.is_empty() {
            both.close();
        }
        both.check();
        // A later part of the same tree, read by itself.
        let mut whole = Both::default();
        whole.open(7);
        let count = both.plain.len() as u32;
        let from = random.random_range(0..=count);
        whole.nodes.append(&both.nodes, from);
        whole.plain.extend_from_slice(&both.plain[from as usize..]);
        whole.token = both.token;
        whole.close();
        whole.check();
    }
}
