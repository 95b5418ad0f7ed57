//! Edits: byte ranges of one file and what shall stand there instead.
//!
//! Edits are sorted and disjoint; bytes outside them never change. Two that overlap are an error of the caller and
//! are reported, never resolved silently. All new text stands in one buffer, so that a million edits cost no million
//! allocations.

use std::borrow::Cow;
use std::ops::Range;

use thiserror::Error;

/// Why edits cannot be applied.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum EditError {
    /// Two edits share bytes.
    #[error("edits of bytes {}..{} and {}..{} overlap: nothing was changed", .first.start, .first.end, .second.start, .second.end)]
    Overlap {
        /// The earlier range.
        first: Range<usize>,
        /// The later range.
        second: Range<usize>,
    },
    /// An edit lies outside the file.
    #[error("edit of bytes {}..{} lies outside the file of {length} bytes: nothing was changed", .range.start, .range.end)]
    Outside {
        /// The range.
        range: Range<usize>,
        /// Length of the file.
        length: usize,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Entry {
    start: usize,
    end: usize,
    text_start: usize,
    text_end: usize,
}

/// The edits of one file, in any order until they are applied.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Edits {
    entries: Vec<Entry>,
    text: Vec<u8>,
}

impl Edits {
    /// No edits.
    pub fn new() -> Edits {
        Edits::default()
    }

    /// Whether nothing changes.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// How many edits there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Replaces `range` by `text`. Several insertions at one byte keep the order in which they were made.
    pub fn replace(&mut self, range: Range<usize>, text: &[u8]) {
        self.replace_with(range, |out| out.extend_from_slice(text));
    }

    /// Puts `text` before the byte `at`.
    pub fn insert(&mut self, at: usize, text: &[u8]) {
        self.replace(at..at, text);
    }

    /// Replaces `range` by what `write` appends to the buffer.
    pub fn replace_with(&mut self, range: Range<usize>, write: impl FnOnce(&mut Vec<u8>)) {
        let text_start = self.text.len();
        write(&mut self.text);
        let text_end = self.text.len();
        self.entries.push(Entry { start: range.start, end: range.end, text_start, text_end });
    }

    /// Makes room for lists that will be appended.
    pub fn reserve<'e>(&mut self, others: impl Iterator<Item = &'e Edits>) {
        let (mut entries, mut text) = (0, 0);
        for other in others {
            entries += other.entries.len();
            text += other.text.len();
        }
        self.entries.reserve_exact(entries);
        self.text.reserve_exact(text);
    }

    /// Adds the edits of another list behind those of this one.
    pub fn append(&mut self, other: &Edits) {
        let shift = self.text.len();
        self.text.extend_from_slice(&other.text);
        self.entries.extend(other.entries.iter().map(|entry| Entry {
            text_start: entry.text_start + shift,
            text_end: entry.text_end + shift,
            ..*entry
        }));
    }

    /// Each edit: the bytes to replace and what shall stand there.
    pub fn iter(&self) -> impl Iterator<Item = (Range<usize>, &[u8])> {
        self.entries
            .iter()
            .map(|entry| (entry.start..entry.end, &self.text[entry.text_start..entry.text_end]))
    }

    /// Sorts the edits by place and checks that no two overlap. An insertion at the first byte of a replacement goes
    /// before it.
    pub fn sort(&mut self) -> Result<(), EditError> {
        let key = |entry: &Entry| (entry.start, entry.end);
        if !self.entries.is_sorted_by_key(key) {
            self.entries.sort_by_key(key);
        }
        for pair in self.entries.windows(2) {
            if pair[1].start < pair[0].end {
                return Err(EditError::Overlap {
                    first: pair[0].start..pair[0].end,
                    second: pair[1].start..pair[1].end,
                });
            }
        }
        Ok(())
    }

    /// The new bytes. Sorts a copy of the list where it is not sorted.
    pub fn apply(&self, source: &[u8]) -> Result<Vec<u8>, EditError> {
        let key = |entry: &Entry| (entry.start, entry.end);
        let mut sorted = Cow::Borrowed(&self.entries);
        if !sorted.is_sorted_by_key(key) {
            sorted.to_mut().sort_by_key(key);
        }
        let mut length = source.len();
        let mut last = 0..0;
        for entry in sorted.iter() {
            let range = entry.start..entry.end;
            if entry.start > entry.end || entry.end > source.len() {
                return Err(EditError::Outside { range, length: source.len() });
            }
            if entry.start < last.end {
                return Err(EditError::Overlap { first: last, second: range });
            }
            length = length + (entry.text_end - entry.text_start) - range.len();
            last = range;
        }
        let mut out = Vec::with_capacity(length);
        let mut at = 0;
        for entry in sorted.iter() {
            out.extend_from_slice(&source[at..entry.start]);
            out.extend_from_slice(&self.text[entry.text_start..entry.text_end]);
            at = entry.end;
        }
        out.extend_from_slice(&source[at..]);
        Ok(out)
    }
}
