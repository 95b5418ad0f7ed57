//! A persistent map: copies share structure, so that a copy is free, an insertion copies a few small nodes, and
//! joining two copies takes time proportional to their difference.
//!
//! Method: a reference-counted hash trie with four bits per level (Bagwell, Ideal Hash Trees, 2001, without the
//! compressed nodes).

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// Bits of the hash per level.
const STEP: u32 = 4;
/// Children of a node.
const FAN: usize = 1 << STEP;

#[derive(Debug)]
enum Node<K, V> {
    /// Entries with the same hash.
    Leaf(u64, Vec<(K, V)>),
    Branch([Option<Arc<Node<K, V>>>; FAN]),
}

type Link<K, V> = Option<Arc<Node<K, V>>>;

/// A persistent map.
#[derive(Debug)]
pub struct Map<K, V> {
    root: Link<K, V>,
}

impl<K, V> Clone for Map<K, V> {
    fn clone(&self) -> Self {
        Map { root: self.root.clone() }
    }
}

impl<K, V> Default for Map<K, V> {
    fn default() -> Self {
        Map { root: None }
    }
}

fn hash<K: Hash>(key: &K) -> u64 {
    let mut hasher = DefaultHasher::new();
    key.hash(&mut hasher);
    hasher.finish()
}

fn slot(hash: u64, shift: u32) -> usize {
    (hash >> shift) as usize & (FAN - 1)
}

fn same<K, V>(a: &Link<K, V>, b: &Link<K, V>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

impl<K: Hash + Eq + Clone, V: Clone> Map<K, V> {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// The value of a key.
    pub fn get(&self, key: &K) -> Option<&V> {
        self.get_from(key, 0)
    }

    /// Looks up a key in a subtree that begins at bit `shift` of the hash.
    fn get_from(&self, key: &K, mut shift: u32) -> Option<&V> {
        let mut at = self.root.as_deref()?;
        let hash = hash(key);
        loop {
            match at {
                Node::Leaf(of, entries) if *of == hash => {
                    return entries.iter().find(|(other, _)| other == key).map(|(_, value)| value);
                }
                Node::Leaf(..) => return None,
                Node::Branch(children) => at = children[slot(hash, shift)].as_deref()?,
            }
            shift += STEP;
        }
    }

    /// Whether there is a value.
    pub fn contains_key(&self, key: &K) -> bool {
        self.get(key).is_some()
    }

    /// Gives a key a value.
    pub fn insert(&mut self, key: K, value: V) {
        let hash = hash(&key);
        Self::put(&mut self.root, hash, 0, key, value);
    }

    fn put(link: &mut Link<K, V>, hash: u64, shift: u32, key: K, value: V) {
        let next = match link.as_deref() {
            None => Node::Leaf(hash, vec![(key, value)]),
            Some(Node::Leaf(of, entries)) if *of == hash => {
                let mut entries = entries.clone();
                match entries.iter_mut().find(|(other, _)| *other == key) {
                    Some((_, old)) => *old = value,
                    None => entries.push((key, value)),
                }
                Node::Leaf(hash, entries)
            }
            Some(Node::Leaf(of, _)) => {
                let mut children = std::array::from_fn(|_| None);
                children[slot(*of, shift)] = link.clone();
                Self::put(&mut children[slot(hash, shift)], hash, shift + STEP, key, value);
                Node::Branch(children)
            }
            Some(Node::Branch(children)) => {
                let mut children = children.clone();
                Self::put(&mut children[slot(hash, shift)], hash, shift + STEP, key, value);
                Node::Branch(children)
            }
        };
        *link = Some(Arc::new(next));
    }

    /// Removes a key.
    pub fn remove(&mut self, key: &K) {
        if self.contains_key(key) {
            Self::take(&mut self.root, hash(key), 0, key);
        }
    }

    fn take(link: &mut Link<K, V>, hash: u64, shift: u32, key: &K) {
        let next = match link.as_deref() {
            None => return,
            Some(Node::Leaf(of, entries)) => {
                let left: Vec<_> = entries.iter().filter(|(other, _)| other != key).cloned().collect();
                (!left.is_empty()).then(|| Node::Leaf(*of, left))
            }
            Some(Node::Branch(children)) => {
                let mut children = children.clone();
                Self::take(&mut children[slot(hash, shift)], hash, shift + STEP, key);
                children.iter().any(Option::is_some).then_some(Node::Branch(children))
            }
        };
        *link = next.map(Arc::new);
    }

    /// Visits every entry, in an arbitrary but reproducible order.
    pub fn for_each(&self, mut take: impl FnMut(&K, &V)) {
        let mut open: Vec<&Node<K, V>> = self.root.as_deref().into_iter().collect();
        while let Some(node) = open.pop() {
            match node {
                Node::Leaf(_, entries) => entries.iter().for_each(|(key, value)| take(key, value)),
                Node::Branch(children) => open.extend(children.iter().flatten().map(|child| &**child)),
            }
        }
    }

    /// Keeps the entries for which `keep` holds.
    pub fn retain(&mut self, mut keep: impl FnMut(&K, &V) -> bool) {
        let mut gone = Vec::new();
        self.for_each(|key, value| {
            if !keep(key, value) {
                gone.push(key.clone());
            }
        });
        gone.iter().for_each(|key| self.remove(key));
    }

    /// The join of two maps: `agree` merges the values of each key in which they differ; `None` removes the key.
    pub fn joined(&self, other: &Self, agree: &impl Fn(Option<&V>, Option<&V>) -> Option<V>) -> Self {
        let mut out = self.clone();
        Self::differences((&self.root, &other.root), 0, &mut |key, a, b| match agree(a, b) {
            Some(value) => out.insert(key.clone(), value),
            None => out.remove(key),
        });
        out
    }

    /// Visits the keys of subtrees that are not shared.
    fn differences(
        (a, b): (&Link<K, V>, &Link<K, V>),
        shift: u32,
        report: &mut impl FnMut(&K, Option<&V>, Option<&V>),
    ) {
        if same(a, b) {
            return;
        }
        if let (Some(Node::Branch(a)), Some(Node::Branch(b))) = (a.as_deref(), b.as_deref()) {
            a.iter().zip(b).for_each(|(a, b)| Self::differences((a, b), shift + STEP, report));
            return;
        }
        let (a, b) = (Map { root: a.clone() }, Map { root: b.clone() });
        a.for_each(|key, value| report(key, Some(value), b.get_from(key, shift)));
        b.for_each(|key, value| {
            if a.get_from(key, shift).is_none() {
                report(key, None, Some(value));
            }
        });
    }
}

impl<K: Hash + Eq + Clone, V: Clone + PartialEq> PartialEq for Map<K, V> {
    fn eq(&self, other: &Self) -> bool {
        let mut alike = true;
        Self::differences((&self.root, &other.root), 0, &mut |_, a, b| alike &= a == b);
        alike
    }
}
