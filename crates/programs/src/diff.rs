//! Edits as a unified diff.
//!
//! The edits already determine which lines differ, so no search is needed, and the cost is that of printing.

use std::ops::Range;

use crate::edit::{EditError, Edits};

/// Lines of context around a change.
const CONTEXT: usize = 3;

/// A run of changed lines: lines of the source and the replacing text.
struct Piece {
    lines: Range<usize>,
    text: Vec<u8>,
}

/// The unified diff of a file and its edited version; empty if nothing changes.
///
/// ```
/// use truegrind_programs::diff::unified;
/// use truegrind_programs::edit::Edits;
///
/// let source = b"G90\nG1 X10\nM30\n";
/// let mut edits = Edits::new();
/// edits.replace(7..10, b"X10.02");
/// let diff = unified(source, &edits, "old.nc", "new.nc")?;
/// let expected = "--- old.nc\n+++ new.nc\n@@ -1,3 +1,3 @@\n G90\n-G1 X10\n+G1 X10.02\n M30\n";
/// assert_eq!(String::from_utf8_lossy(&diff), expected);
/// assert!(unified(source, &Edits::new(), "old.nc", "new.nc")?.is_empty());
/// # Ok::<(), truegrind_programs::edit::EditError>(())
/// ```
///
/// # Errors
/// As [`Edits::apply`].
pub fn unified(source: &[u8], edits: &Edits, old_name: &str, new_name: &str) -> Result<Vec<u8>, EditError> {
    // The start of each line, and the end.
    let mut begins = vec![0];
    begins.extend(source.iter().enumerate().filter(|&(_, &byte)| byte == b'\n').map(|(at, _)| at + 1));
    if begins.last() != Some(&source.len()) {
        begins.push(source.len());
    }
    let count = begins.len() - 1;
    let pieces = pieces(source, edits, &begins)?;
    let mut out = Vec::new();
    if pieces.is_empty() {
        return Ok(out);
    }
    out.extend_from_slice(format!("--- {old_name}\n+++ {new_name}\n").as_bytes());
    // The line offset of the new file.
    let mut shift = 0_isize;
    let mut at = 0;
    while at < pieces.len() {
        let mut last = at;
        while last + 1 < pieces.len() && pieces[last + 1].lines.start <= pieces[last].lines.end + 2 * CONTEXT
        {
            last += 1;
        }
        let hunk = &pieces[at..=last];
        let first = hunk[0].lines.start.saturating_sub(CONTEXT);
        let end = (hunk[hunk.len() - 1].lines.end + CONTEXT).min(count);
        let removed: usize = hunk.iter().map(|piece| piece.lines.len()).sum();
        let added: usize = hunk.iter().map(|piece| line_count(&piece.text)).sum();
        let (old, new) = (end - first, end - first - removed + added);
        let begin = |lines: usize, from: isize| if lines == 0 { from } else { from + 1 };
        out.extend_from_slice(
            format!(
                "@@ -{},{old} +{},{new} @@\n",
                begin(old, first as isize),
                begin(new, first as isize + shift)
            )
            .as_bytes(),
        );
        let mut line = first;
        for piece in hunk {
            put(&mut out, b' ', &source[begins[line]..begins[piece.lines.start]]);
            put(&mut out, b'-', &source[begins[piece.lines.start]..begins[piece.lines.end]]);
            put(&mut out, b'+', &piece.text);
            line = piece.lines.end;
        }
        put(&mut out, b' ', &source[begins[line]..begins[end]]);
        shift += added as isize - removed as isize;
        at = last + 1;
    }
    Ok(out)
}

fn pieces(source: &[u8], edits: &Edits, begins: &[usize]) -> Result<Vec<Piece>, EditError> {
    let mut sorted: Vec<(Range<usize>, &[u8])> = edits.iter().collect();
    sorted.sort_by_key(|(range, _)| (range.start, range.end));
    // The same checks as in [`Edits::apply`].
    if let Some((range, _)) =
        sorted.iter().find(|(range, _)| range.start > range.end || range.end > source.len())
    {
        return Err(EditError::Outside { range: range.clone(), length: source.len() });
    }
    for pair in sorted.windows(2) {
        if pair[1].0.start < pair[0].0.end {
            return Err(EditError::Overlap { first: pair[0].0.clone(), second: pair[1].0.clone() });
        }
    }
    let count = begins.len() - 1;
    let open_end = source.last().is_some_and(|&byte| byte != b'\n');
    let line_of = |byte: usize| match begins.partition_point(|&begin| begin <= byte) - 1 {
        // Text at the end of an unterminated last line belongs to that line.
        line if line == count && open_end => count - 1,
        line => line.min(count),
    };
    // The lines that an edit touches: none if whole lines are inserted between two.
    let touched = |range: &Range<usize>, text: &[u8]| {
        let first = line_of(range.start);
        let between = range.is_empty() && begins[first] == range.start && text.ends_with(b"\n");
        if between || first == count {
            return first..first;
        }
        let last = if range.is_empty() { first } else { line_of(range.end - 1) };
        first..last + 1
    };
    let mut out: Vec<Piece> = Vec::new();
    let mut index = 0;
    while index < sorted.len() {
        let mut lines = touched(&sorted[index].0, sorted[index].1);
        let mut end = index + 1;
        let text = loop {
            while end < sorted.len() {
                let next = touched(&sorted[end].0, sorted[end].1);
                if next.start >= lines.end && !(next.is_empty() && next.start == lines.end) {
                    break;
                }
                lines.end = lines.end.max(next.end);
                end += 1;
            }
            let (from, to) = (begins[lines.start], begins[lines.end]);
            let mut text = Vec::with_capacity(to - from + 16);
            let mut at = from;
            for (range, new) in &sorted[index..end] {
                text.extend_from_slice(&source[at..range.start]);
                text.extend_from_slice(new);
                at = range.end;
            }
            text.extend_from_slice(&source[at..to.max(at)]);
            if text.is_empty() || text.ends_with(b"\n") || lines.end == count {
                break text;
            }
            // Its line end is removed, so the next line joins it.
            lines.end += 1;
        };
        out.push(Piece { lines, text });
        index = end;
    }
    Ok(out)
}

fn line_count(text: &[u8]) -> usize {
    let ends = text.iter().filter(|&&byte| byte == b'\n').count();
    ends + usize::from(!text.is_empty() && !text.ends_with(b"\n"))
}

/// Appends lines with a sign before each.
fn put(out: &mut Vec<u8>, sign: u8, text: &[u8]) {
    for line in text.split_inclusive(|&byte| byte == b'\n') {
        out.push(sign);
        out.extend_from_slice(line);
        if !line.ends_with(b"\n") {
            out.extend_from_slice(b"\n\\ No newline at end of file\n");
        }
    }
}
