//! Edits: byte ranges of one file and their replacements.
//!
//! Edits are sorted and disjoint; bytes outside them never change. Overlapping edits are reported as an error of the
//! caller. New text is kept in few buffers, so that a million edits need no million allocations.

use std::borrow::Cow;
use std::ops::Range;

use rayon::prelude::*;
use thiserror::Error;

/// Why edits cannot be applied.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
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
    /// Offsets are limited to 32 bits.
    #[error("more than 4 GiB of file or of new text: nothing was changed")]
    TooLong,
}

/// The line end that a file uses: a line feed, with or without a carriage return, or that alone.
pub(crate) fn line_end(source: &[u8]) -> &'static [u8] {
    match source.iter().position(|&byte| byte == b'\n') {
        None if source.contains(&b'\r') => b"\r",
        Some(at) if at > 0 && source[at - 1] == b'\r' => b"\r\n",
        _ => b"\n",
    }
}

/// 32-bit offsets, because there may be millions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Entry {
    start: u32,
    end: u32,
    text_start: u32,
    text_end: u32,
}

impl Entry {
    fn range(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    fn text<'t>(&self, text: &'t [u8]) -> &'t [u8] {
        &text[self.text_start as usize..self.text_end as usize]
    }
}

/// Edits made one after the other, with one buffer for their text.
#[derive(Debug, Clone, Default)]
struct Part {
    entries: Vec<Entry>,
    text: Vec<u8>,
}

/// The edits of one file, in any order until they are applied.
///
/// They are kept in parts, so that lists made by several threads are concatenated without copying.
#[derive(Debug, Clone, Default)]
pub struct Edits {
    parts: Vec<Part>,
    /// Whether an offset exceeded 32 bits.
    too_long: bool,
}

impl PartialEq for Edits {
    fn eq(&self, other: &Edits) -> bool {
        self.too_long == other.too_long && self.iter().eq(other.iter())
    }
}

impl Eq for Edits {}

/// Edits applied by one thread at a time.
const CHUNK: usize = 1 << 15;

impl Edits {
    /// No edits.
    pub fn new() -> Edits {
        Edits::default()
    }

    /// No edits, with capacity for this many edits and bytes of new text.
    pub fn with_capacity(entries: usize, text: usize) -> Edits {
        let part = Part { entries: Vec::with_capacity(entries), text: Vec::with_capacity(text) };
        Edits { parts: vec![part], too_long: false }
    }

    /// Whether there are no edits.
    pub fn is_empty(&self) -> bool {
        self.parts.iter().all(|part| part.entries.is_empty())
    }

    /// The number of edits.
    pub fn len(&self) -> usize {
        self.parts.iter().map(|part| part.entries.len()).sum()
    }

    /// Replaces `range` by `text`. Several insertions at one byte keep the order in which they were made.
    pub fn replace(&mut self, range: Range<usize>, text: &[u8]) {
        self.replace_with(range, |out| out.extend_from_slice(text));
    }

    /// Inserts `text` before the byte `at`.
    pub fn insert(&mut self, at: usize, text: &[u8]) {
        self.replace(at..at, text);
    }

    /// Replaces `range` by what `write` appends to the buffer.
    pub fn replace_with(&mut self, range: Range<usize>, write: impl FnOnce(&mut Vec<u8>)) {
        if self.parts.is_empty() {
            self.parts.push(Part::default());
        }
        let Some(part) = self.parts.last_mut() else { return };
        let text_start = part.text.len();
        write(&mut part.text);
        let offset = |at: usize| u32::try_from(at);
        let offsets = (offset(range.start), offset(range.end), offset(text_start), offset(part.text.len()));
        match offsets {
            (Ok(start), Ok(end), Ok(text_start), Ok(text_end)) => {
                part.entries.push(Entry { start, end, text_start, text_end });
            }
            _ => self.too_long = true,
        }
    }

    /// Extends the last edit to byte `end` of the source: by `between`, the bytes behind it that stay, and what `write` appends.
    pub(crate) fn extend_last(&mut self, between: &[u8], end: usize, write: impl FnOnce(&mut Vec<u8>)) {
        let Some(Part { entries, text }) = self.parts.last_mut() else { return };
        let Some(entry) = entries.last_mut() else { return };
        text.extend_from_slice(between);
        write(text);
        match (u32::try_from(end), u32::try_from(text.len())) {
            (Ok(end), Ok(text_end)) => (entry.end, entry.text_end) = (end, text_end),
            _ => self.too_long = true,
        }
    }

    /// Appends the edits of another list.
    pub fn append(&mut self, other: Edits) {
        self.too_long |= other.too_long;
        self.parts.extend(other.parts.into_iter().filter(|part| !part.entries.is_empty()));
    }

    fn entries(&self) -> impl Iterator<Item = &Entry> {
        self.parts.iter().flat_map(|part| &part.entries)
    }

    /// Each edit: the range and its replacement.
    pub fn iter(&self) -> impl Iterator<Item = (Range<usize>, &[u8])> {
        let parts = self.parts.iter();
        parts.flat_map(|part| part.entries.iter().map(|entry| (entry.range(), entry.text(&part.text))))
    }

    /// The lines of a source that the edits lengthen to more than `most` bytes. The edits must be sorted.
    ///
    /// ```
    /// use truegrind_programs::edit::Edits;
    ///
    /// let source = b"X1 Y2\nX1 Y2 Z3\nX1 Y2\n";
    /// let mut edits = Edits::new();
    /// // An inserted block is a line of its own.
    /// edits.insert(0, b"G1 X1 Y2 Z3 A0 B0 C0\n");
    /// edits.replace(1..2, b"1.5");
    /// edits.replace(10..11, b"2.5");
    /// edits.insert(14, b" A1");
    /// edits.replace(19..20, b"7");
    /// assert_eq!(edits.grown_lines(source, 12), [6..15]);
    /// assert_eq!(edits.grown_lines(source, 14), []);
    /// assert_eq!(edits.grown_lines(source, 5), [0..6, 6..15]);
    /// ```
    pub fn grown_lines(&self, source: &[u8], most: usize) -> Vec<Range<usize>> {
        let mut out = Vec::new();
        let mut line = 0..0;
        let last = line_end(source).last().copied();
        let ends_line = |byte: &u8| Some(*byte) == last;
        // The bytes that new text adds to the line after its last line end, less the replaced ones.
        let mut more = 0isize;
        let mut close = |line: &Range<usize>, more: isize| {
            let length = line.len() as isize + more;
            if more > 0 && length > most as isize {
                out.push(line.clone());
            }
        };
        for (range, text) in self.iter() {
            if range.start >= line.end {
                close(&line, more);
                let begin = source[..range.start].iter().rposition(ends_line).map_or(0, |at| at + 1);
                let end = source[range.start..].iter().position(ends_line);
                (line, more) = (begin..end.map_or(source.len(), |at| range.start + at + 1), 0);
            }
            // Inserted blocks are lines of their own.
            let own = text.iter().rposition(ends_line).map_or(text, |at| &text[at + 1..]);
            more += own.len() as isize - range.len() as isize;
        }
        close(&line, more);
        out
    }

    /// Sorts the edits by position and checks that no two overlap. An insertion at the first byte of a replacement
    /// goes before it.
    pub fn sort(&mut self) -> Result<(), EditError> {
        let key = |entry: &Entry| (entry.start, entry.end);
        if !self.entries().is_sorted_by_key(key) {
            // Merge into one part; edits at the same position keep their order.
            let mut whole =
                Edits::with_capacity(self.len(), self.parts.iter().map(|part| part.text.len()).sum());
            self.iter().for_each(|(range, text)| whole.replace(range, text));
            whole.too_long |= self.too_long;
            *self = whole;
            self.parts.iter_mut().for_each(|part| part.entries.sort_by_key(key));
        }
        if self.too_long {
            return Err(EditError::TooLong);
        }
        let mut last = 0..0;
        for entry in self.entries() {
            if (entry.start as usize) < last.end {
                return Err(EditError::Overlap { first: last, second: entry.range() });
            }
            last = entry.range();
        }
        Ok(())
    }

    /// The new bytes. Sorts a copy if the list is not sorted.
    ///
    /// ```
    /// use truegrind_programs::edit::Edits;
    ///
    /// let source = b"MoveL p10,v100,fine,tool0;";
    /// let mut edits = Edits::new();
    /// edits.replace(10..14, b"v50");
    /// edits.insert(0, b"! slower\n");
    /// assert_eq!(edits.apply(source)?, b"! slower\nMoveL p10,v50,fine,tool0;");
    ///
    /// // Overlapping edits are an error.
    /// edits.replace(12..16, b"x");
    /// let refused = edits.apply(source).map_err(|error| error.to_string());
    /// assert_eq!(refused, Err("edits of bytes 10..14 and 12..16 overlap: nothing was changed".into()));
    /// # Ok::<(), truegrind_programs::edit::EditError>(())
    /// ```
    pub fn apply(&self, source: &[u8]) -> Result<Vec<u8>, EditError> {
        if self.too_long {
            return Err(EditError::TooLong);
        }
        let mut sorted = Cow::Borrowed(self);
        if !self.entries().is_sorted_by_key(|entry| (entry.start, entry.end)) {
            sorted.to_mut().sort()?;
        }
        // For each extent: the start of the source bytes before its first edit, and the length of its output.
        let chunks = || {
            sorted
                .parts
                .iter()
                .flat_map(|part| part.entries.chunks(CHUNK).map(|entries| (entries, &part.text)))
        };
        let mut extents: Vec<(usize, usize)> = Vec::new();
        let mut last = 0..0;
        for (entries, _) in chunks() {
            let (from, mut length) = (last.end, 0);
            for entry in entries {
                let range = entry.range();
                if range.start > range.end || range.end > source.len() {
                    return Err(EditError::Outside { range, length: source.len() });
                }
                if range.start < last.end {
                    return Err(EditError::Overlap { first: last, second: range });
                }
                length += range.start - last.end + (entry.text_end - entry.text_start) as usize;
                last = range;
            }
            extents.push((from, length));
        }
        let rest = &source[last.end..];
        let mut out = vec![0; extents.iter().map(|extent| extent.1).sum::<usize>() + rest.len()];
        let mut work = Vec::with_capacity(extents.len());
        let mut open = out.as_mut_slice();
        for ((entries, text), (from, length)) in chunks().zip(extents) {
            let (place, after) = open.split_at_mut(length);
            work.push((entries, text, from, place));
            open = after;
        }
        open.copy_from_slice(rest);
        work.into_par_iter().for_each(|(entries, text, from, mut place)| {
            let mut put = |bytes: &[u8]| {
                let (here, after) = std::mem::take(&mut place).split_at_mut(bytes.len());
                here.copy_from_slice(bytes);
                place = after;
            };
            let mut at = from;
            for entry in entries {
                put(&source[at..entry.start as usize]);
                put(entry.text(text));
                at = entry.end as usize;
            }
        });
        Ok(out)
    }
}
