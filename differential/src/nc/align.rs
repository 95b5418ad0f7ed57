//! Which line of the original a line of the corrected text comes from.

use crate::under_test::Edit;

/// For each line of the corrected text the line of the original (from 0); `None` for one that was put in.
pub fn origins(original: &[u8], corrected: &[u8], edits: &[Edit]) -> Vec<Option<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    let mut line_of = LineOf { bytes: original, at: 0, line: 0 };
    for line in corrected.split(|byte| *byte == b'\n') {
        out.push(origin(start, line, edits).map(|at| line_of.of(at)));
        start += line.len() + 1;
    }
    out
}

/// The byte of the original that a line begins with or holds.
fn origin(start: usize, line: &[u8], edits: &[Edit]) -> Option<usize> {
    let end = start + line.len();
    let mut shift = 0isize;
    let mut replaced = None;
    let mut at = start;
    for edit in edits {
        if edit.new.end <= at && edit.new.end < end.max(start + 1) || edit.new.end < start {
            shift += edit.old.len() as isize - edit.new.len() as isize;
            continue;
        }
        if edit.new.start > at || at >= end {
            break;
        }
        // The line begins within what was written anew.
        if !edit.old.is_empty() {
            replaced = replaced.or(Some(edit.old.start));
        }
        at = edit.new.end;
        shift += edit.old.len() as isize - edit.new.len() as isize;
    }
    let put_in = edits
        .iter()
        .any(|edit| edit.old.is_empty() && edit.new.start <= start && end <= edit.new.end && end > start);
    if put_in {
        return None;
    }
    if at < end || line.is_empty() { Some((at as isize + shift) as usize) } else { replaced }
}

struct LineOf<'b> {
    bytes: &'b [u8],
    at: usize,
    line: usize,
}

impl LineOf<'_> {
    /// The line of a byte; bytes are asked for in order.
    fn of(&mut self, byte: usize) -> usize {
        let byte = byte.min(self.bytes.len());
        if byte < self.at {
            (self.at, self.line) = (0, 0);
        }
        self.line += self.bytes[self.at..byte].iter().filter(|byte| **byte == b'\n').count();
        self.at = byte;
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_are_put_in_have_no_origin() {
        let old = b"A\nX1\nY2\n";
        let new = b"A\n(mark)\nX1.5 Z3\nG1 X2\nY2.5\n";
        let edits = [
            Edit { old: 2..2, new: 2..9 },
            Edit { old: 3..4, new: 10..13 },
            Edit { old: 4..4, new: 13..16 },
            Edit { old: 5..5, new: 17..23 },
            Edit { old: 6..7, new: 24..27 },
        ];
        assert_eq!(origins(old, new, &edits), [Some(0), None, Some(1), None, Some(2), Some(3)]);
    }
}
