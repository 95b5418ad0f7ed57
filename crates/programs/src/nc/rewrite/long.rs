//! Lines that a correction makes longer than the control takes.
//!
//! Sources: Siemens, 840D sl Programming Manual Fundamentals, "Block length" (512 characters with comment and line end);
//! LinuxCNC, a line is read into 255 bytes, and one that fills them is an error. Fanuc and Heidenhain state no bound.

use std::collections::HashMap;
use std::ops::Range;

use crate::edit::Edits;
use crate::nc::dialect::Dialect;
use crate::nc::task::Task;

/// The most bytes of a line, its end among them; `None` where the control states no bound.
fn most(dialect: Dialect) -> Option<usize> {
    match dialect {
        Dialect::Siemens => Some(512),
        Dialect::LinuxCnc => Some(253),
        _ => None,
    }
}

impl Task<'_> {
    /// The motions that must stay because a line becomes longer than the control takes: the one that is written there, or,
    /// where the line only says again what has changed before it, the last of `wanted` before it.
    pub(super) fn too_long(&self, edits: &[Edits], wanted: &HashMap<u32, usize>) -> Vec<u32> {
        let mut out = Vec::new();
        for (file, edits) in edits.iter().enumerate() {
            let Some(most) = most(self.dialects[file]) else { continue };
            for line in grown(self.trees[file].source(), edits, most) {
                let before = |motion: &&u32| {
                    let motion = &self.listing.motions[**motion as usize];
                    motion.place.file as usize == file && (motion.statement.start as usize) < line.end
                };
                out.extend(wanted.keys().filter(before).max());
            }
        }
        out
    }
}

/// The lines of a source that edits make longer, and longer than `most` bytes; the edits are sorted.
fn grown(source: &[u8], edits: &Edits, most: usize) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut line = 0..0;
    // The bytes that new text puts in after the last line end that it brings along, less those it takes away.
    let mut more = 0isize;
    let mut close = |line: &Range<usize>, more: isize| {
        let length = line.len() as isize + more;
        if more > 0 && length > most as isize {
            out.push(line.clone());
        }
    };
    for (range, text) in edits.iter() {
        if range.start >= line.end {
            close(&line, more);
            let begin = source[..range.start].iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
            let end = source[range.start..].iter().position(|byte| *byte == b'\n');
            (line, more) = (begin..end.map_or(source.len(), |at| range.start + at + 1), 0);
        }
        // Blocks that are put in are lines of their own.
        let own = text.iter().rposition(|byte| *byte == b'\n').map_or(text, |at| &text[at + 1..]);
        more += own.len() as isize - range.len() as isize;
    }
    close(&line, more);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_grows_beyond_the_bound_is_found_and_no_other() {
        let source = b"X1 Y2\nX1 Y2 Z3\nX1 Y2\n";
        let mut edits = Edits::new();
        edits.insert(0, b"G1 X1 Y2 Z3 A0 B0 C0\n");
        edits.replace(1..2, b"1.5");
        edits.replace(10..11, b"2.5");
        edits.insert(14, b" A1");
        edits.replace(19..20, b"7");
        assert_eq!(grown(source, &edits, 12), std::slice::from_ref(&(6..15)));
        assert_eq!(grown(source, &edits, 14), []);
        assert_eq!(grown(source, &edits, 5), [0..6, 6..15]);
    }
}
