//! The rows of a data set, shared by its parts: half of a million rows costs the places of its rows and no copies.

use std::fmt;
use std::ops::{Index, IndexMut, Range};
use std::sync::Arc;

use super::row::Row;

/// Measured rows. A copy and a part share them with the whole until one of them is changed.
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

    /// The row at a place.
    pub fn get(&self, place: usize) -> Option<&Row> {
        match &self.at {
            None => self.all.get(place),
            Some(at) => self.all.get(*at.get(place)? as usize),
        }
    }

    /// The last row.
    pub fn last(&self) -> Option<&Row> {
        self.get(self.len().checked_sub(1)?)
    }

    /// One after the other.
    pub fn iter(&self) -> Iter<'_> {
        Iter { rows: self, places: 0..self.len() }
    }

    /// One after the other, to be changed; shared ones are copied first.
    pub fn iter_mut(&mut self) -> std::slice::IterMut<'_, Row> {
        self.own().iter_mut()
    }

    /// Adds a row.
    pub fn push(&mut self, row: Row) {
        self.own().push(row);
    }

    /// The rows at some places, which must be there.
    pub fn part(&self, places: &[usize]) -> Self {
        let place = |&place: &usize| self.at.as_ref().map_or(place as u32, |at| at[place]);
        Self { all: self.all.clone(), at: Some(Arc::new(places.iter().map(place).collect())) }
    }

    /// Rows that nothing else shares.
    fn own(&mut self) -> &mut Vec<Row> {
        if let Some(at) = self.at.take() {
            self.all = Arc::new(at.iter().map(|&place| self.all[place as usize].clone()).collect());
        }
        Arc::make_mut(&mut self.all)
    }
}

impl Index<usize> for Rows {
    type Output = Row;

    fn index(&self, place: usize) -> &Row {
        match &self.at {
            None => &self.all[place],
            Some(at) => &self.all[at[place] as usize],
        }
    }
}

impl IndexMut<usize> for Rows {
    fn index_mut(&mut self, place: usize) -> &mut Row {
        &mut self.own()[place]
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
        self.own().extend(rows);
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

/// Goes through [`Rows`].
#[derive(Debug, Clone)]
pub struct Iter<'a> {
    rows: &'a Rows,
    places: Range<usize>,
}

impl<'a> Iterator for Iter<'a> {
    type Item = &'a Row;

    fn next(&mut self) -> Option<&'a Row> {
        self.nth(0)
    }

    fn nth(&mut self, over: usize) -> Option<&'a Row> {
        self.places.nth(over).map(|place| &self.rows[place])
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.places.size_hint()
    }
}

impl DoubleEndedIterator for Iter<'_> {
    fn next_back(&mut self) -> Option<Self::Item> {
        self.places.next_back().map(|place| &self.rows[place])
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
        std::mem::take(self.own()).into_iter()
    }
}
