//! Copy-on-write rows of a data set: a subset costs the indices of its rows, not copies of them.

use std::fmt;
use std::ops::{Index, IndexMut, Range};
use std::sync::Arc;

use super::row::Row;

/// Measured rows. Clones and subsets share storage until one of them is modified.
#[derive(Clone, Default)]
pub struct Rows {
    all: Arc<Vec<Row>>,
    /// Which of them, in this order; all where absent.
    at: Option<Arc<Vec<u32>>>,
}

impl Rows {
    /// How many.
    pub fn len(&self) -> usize {
        self.at.as_ref().map_or(self.all.len(), |at| at.len())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The row at an index.
    pub fn get(&self, index: usize) -> Option<&Row> {
        match &self.at {
            None => self.all.get(index),
            Some(at) => self.all.get(*at.get(index)? as usize),
        }
    }

    /// The last row.
    pub fn last(&self) -> Option<&Row> {
        self.get(self.len().checked_sub(1)?)
    }

    /// Iterates over the rows.
    pub fn iter(&self) -> Iter<'_> {
        Iter { rows: self, indices: 0..self.len() }
    }

    /// Iterates over mutable rows; shared ones are copied first.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Row> {
        self.make_mut().iter_mut()
    }

    /// Adds a row.
    pub fn push(&mut self, row: Row) {
        self.make_mut().push(row);
    }

    /// The rows at `indices`, all of which must exist.
    pub fn select(&self, indices: &[usize]) -> Self {
        let in_all = |&index: &usize| self.at.as_ref().map_or(index as u32, |at| at[index]);
        Self { all: self.all.clone(), at: Some(Arc::new(indices.iter().map(in_all).collect())) }
    }

    /// Unshared storage, copied if necessary.
    fn make_mut(&mut self) -> &mut Vec<Row> {
        if let Some(at) = self.at.take() {
            self.all = Arc::new(at.iter().map(|&index| self.all[index as usize].clone()).collect());
        }
        Arc::make_mut(&mut self.all)
    }
}

impl Index<usize> for Rows {
    type Output = Row;

    fn index(&self, index: usize) -> &Row {
        match &self.at {
            None => &self.all[index],
            Some(at) => &self.all[at[index] as usize],
        }
    }
}

impl IndexMut<usize> for Rows {
    fn index_mut(&mut self, index: usize) -> &mut Row {
        &mut self.make_mut()[index]
    }
}

impl From<Vec<Row>> for Rows {
    fn from(rows: Vec<Row>) -> Self {
        Self { all: Arc::new(rows), at: None }
    }
}

impl FromIterator<Row> for Rows {
    fn from_iter<I: IntoIterator<Item = Row>>(rows: I) -> Self {
        Vec::from_iter(rows).into()
    }
}

impl Extend<Row> for Rows {
    fn extend<I: IntoIterator<Item = Row>>(&mut self, rows: I) {
        self.make_mut().extend(rows);
    }
}

impl PartialEq for Rows {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

impl fmt::Debug for Rows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self).finish()
    }
}

/// Iterator over [`Rows`].
#[derive(Debug, Clone)]
pub struct Iter<'a> {
    rows: &'a Rows,
    indices: Range<usize>,
}

impl<'a> Iterator for Iter<'a> {
    type Item = &'a Row;

    fn next(&mut self) -> Option<&'a Row> {
        self.nth(0)
    }

    fn nth(&mut self, over: usize) -> Option<&'a Row> {
        self.indices.nth(over).map(|index| &self.rows[index])
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.indices.size_hint()
    }
}

impl DoubleEndedIterator for Iter<'_> {
    fn next_back(&mut self) -> Option<Self::Item> {
        self.indices.next_back().map(|index| &self.rows[index])
    }
}

impl ExactSizeIterator for Iter<'_> {}

impl<'a> IntoIterator for &'a Rows {
    type Item = &'a Row;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Rows {
    type Item = &'a mut Row;
    type IntoIter = std::slice::IterMut<'a, Row>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl IntoIterator for Rows {
    type Item = Row;
    type IntoIter = std::vec::IntoIter<Row>;

    fn into_iter(mut self) -> Self::IntoIter {
        std::mem::take(self.make_mut()).into_iter()
    }
}
