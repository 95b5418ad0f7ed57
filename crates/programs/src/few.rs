//! A list that almost always has one item, which then needs no memory of its own: nearly every motion has one target, and
//! programs have a million motions.

use std::fmt;
use std::ops::{Deref, DerefMut};

/// A list, read as a slice.
///
/// ```
/// use truegrind_programs::few::Few;
///
/// let mut list = Few::default();
/// list.push(7);
/// assert_eq!(list[..], [7]);
/// list.insert(0, 3);
/// assert_eq!(list, Few::from(vec![3, 7]));
/// ```
#[derive(Clone)]
pub struct Few<T>(Items<T>);

#[derive(Clone)]
enum Items<T> {
    One(T),
    /// None, or several.
    Other(Vec<T>),
}

impl<T> Few<T> {
    /// The list of one item.
    pub fn one(item: T) -> Self {
        Few(Items::One(item))
    }

    /// Inserts an item before another one, or at the end.
    pub fn insert(&mut self, at: usize, item: T) {
        let mut items = match std::mem::take(self).0 {
            Items::Other(items) if items.is_empty() => {
                *self = Few::one(item);
                return;
            }
            // A circular motion has two targets.
            Items::One(first) => {
                let mut items = Vec::with_capacity(2);
                items.push(first);
                items
            }
            Items::Other(items) => items,
        };
        items.insert(at, item);
        self.0 = Items::Other(items);
    }

    /// Appends an item.
    pub fn push(&mut self, item: T) {
        self.insert(self.len(), item);
    }
}

impl<T> Default for Few<T> {
    fn default() -> Self {
        Few(Items::Other(Vec::new()))
    }
}

impl<T> Deref for Few<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Items::One(item) => std::slice::from_ref(item),
            Items::Other(items) => items,
        }
    }
}

impl<T> DerefMut for Few<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Items::One(item) => std::slice::from_mut(item),
            Items::Other(items) => items,
        }
    }
}

impl<T> From<Vec<T>> for Few<T> {
    fn from(items: Vec<T>) -> Self {
        items.into_iter().collect()
    }
}

impl<T> FromIterator<T> for Few<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        let mut items = items.into_iter();
        match (items.next(), items.next()) {
            (None, _) => Few::default(),
            (Some(one), None) => Few::one(one),
            (Some(first), Some(second)) => {
                Few(Items::Other([first, second].into_iter().chain(items).collect()))
            }
        }
    }
}

impl<'a, T> IntoIterator for &'a Few<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T> IntoIterator for &'a mut Few<T> {
    type Item = &'a mut T;
    type IntoIter = std::slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: PartialEq> PartialEq for Few<T> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<T: fmt::Debug> fmt::Debug for Few<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self[..].fmt(f)
    }
}
