//! Edits are disjoint, and bytes outside them do not change.

use proptest::prelude::*;
use truegrind_programs::diff::unified;
use truegrind_programs::edit::{EditError, Edits};
use truegrind_programs::rapid::task_list;

#[test]
fn edits_apply_in_the_order_of_the_file() {
    let mut edits = Edits::new();
    edits.replace(6..11, b"arm");
    edits.insert(0, b"<");
    edits.insert(11, b">");
    edits.insert(11, b"!");
    edits.replace(0..5, b"hey");
    assert_eq!(edits.apply(b"hello world").unwrap(), b"<hey arm>!");
    edits.sort().unwrap();
    assert_eq!(edits.len(), 5);
    assert_eq!(edits.apply(b"hello world").unwrap(), b"<hey arm>!");
}

#[test]
fn overlapping_and_outlying_edits_are_errors() {
    let mut edits = Edits::new();
    edits.replace(2..5, b"x");
    edits.replace(4..6, b"y");
    assert_eq!(edits.apply(b"0123456789"), Err(EditError::Overlap { first: 2..5, second: 4..6 }));
    assert_eq!(edits.sort(), Err(EditError::Overlap { first: 2..5, second: 4..6 }));
    let mut edits = Edits::new();
    edits.replace(2..5, b"x");
    edits.insert(3, b"y");
    assert!(edits.sort().is_err());
    let mut edits = Edits::new();
    edits.replace(8..11, b"x");
    assert_eq!(edits.apply(b"0123456789"), Err(EditError::Outside { range: 8..11, length: 10 }));
}

#[test]
fn a_hundred_thousand_edits_are_applied_in_chunks() {
    let source: Vec<u8> = (0..1_000_000_u32).map(|at| b'a' + (at % 26) as u8).collect();
    let (mut edits, mut expected, mut last) = (Edits::new(), Vec::new(), 0);
    for edit in 0..100_000_usize {
        let at = edit * 9 + 4;
        let (length, text) = (edit % 5, &b"0123456789"[..edit % 7]);
        edits.replace(at..at + length, text);
        expected.extend_from_slice(&source[last..at]);
        expected.extend_from_slice(text);
        last = at + length;
    }
    expected.extend_from_slice(&source[last..]);
    assert!(edits.apply(&source).unwrap() == expected);
}

proptest! {
    #[test]
    fn bytes_outside_edits_stay(cuts in proptest::collection::btree_set(0_usize..200, 0..20), source in proptest::collection::vec(any::<u8>(), 200)) {
        let cuts: Vec<usize> = cuts.into_iter().collect();
        let mut edits = Edits::new();
        let mut expected = Vec::new();
        let mut at = 0;
        for pair in cuts.chunks_exact(2) {
            expected.extend_from_slice(&source[at..pair[0]]);
            expected.extend_from_slice(b"new");
            at = pair[1];
            edits.replace(pair[0]..pair[1], b"new");
        }
        expected.extend_from_slice(&source[at..]);
        prop_assert_eq!(edits.apply(&source).unwrap(), expected);
    }
}

#[test]
fn task_lists_name_their_modules() {
    let list = b"<?xml version=\"1.0\"?>\r\n<Program>\r\n <Module>A.mod</Module><Module> B C.sys\n</Module>\n</Program>";
    assert_eq!(task_list::modules(list), ["A.mod", "B C.sys"]);
    assert!(task_list::modules(b"<Module>not closed").is_empty());
}

#[test]
fn edits_print_as_a_unified_diff() {
    let source = b"one\ntwo\nthree\nfour\nfive\nsix\nseven\neight\nnine\nten";
    let mut edits = Edits::new();
    edits.replace(4..7, b"TWO");
    edits.insert(8, b"between\n");
    edits.replace(source.len() - 3..source.len(), b"TEN");
    let text = String::from_utf8(unified(source, &edits, "a.mod", "b.mod").unwrap()).unwrap();
    let expected = "--- a.mod\n+++ b.mod\n@@ -1,5 +1,6 @@\n one\n-two\n+TWO\n+between\n three\n four\n five\n\
                    @@ -7,4 +8,4 @@\n seven\n eight\n nine\n-ten\n\\ No newline at end of file\n+TEN\n\
                    \\ No newline at end of file\n";
    assert_eq!(text, expected);
    assert!(unified(source, &Edits::new(), "a", "b").unwrap().is_empty());
    let mut bad = Edits::new();
    bad.replace(3..99, b"");
    assert!(unified(source, &bad, "a", "b").is_err());
}

/// Applies the diff to the source, as `patch` does.
fn patched(source: &[u8], diff: &[u8]) -> Vec<u8> {
    let lines: Vec<&[u8]> = source.split_inclusive(|&byte| byte == b'\n').collect();
    let (mut out, mut at) = (Vec::new(), 0);
    let mut parts = diff.split_inclusive(|&byte| byte == b'\n').skip(2).peekable();
    while let Some(line) = parts.next() {
        let bare = parts.peek().is_some_and(|next| next.starts_with(b"\\"));
        let text = if bare { &line[1..line.len() - 1] } else { &line[1..] };
        match line[0] {
            b'@' => {
                let head = String::from_utf8_lossy(line).into_owned();
                let old: Vec<usize> =
                    head[4..].split(' ').next().unwrap().split(',').map(|n| n.parse().unwrap()).collect();
                let begin = if old[1] == 0 { old[0] } else { old[0] - 1 };
                out.extend(lines[at..begin].concat());
                at = begin;
            }
            b' ' => {
                assert_eq!(lines[at], text);
                out.extend_from_slice(text);
                at += 1;
            }
            b'-' => {
                assert_eq!(lines[at], text);
                at += 1;
            }
            b'+' => out.extend_from_slice(text),
            _ => assert!(line.starts_with(b"\\")),
        }
    }
    out.extend(lines[at..].concat());
    out
}

proptest! {
    #[test]
    fn a_diff_carried_out_gives_what_the_edits_give(
        words in proptest::collection::vec("[a-c\n]{0,6}", 1..30),
        places in proptest::collection::vec((0_usize..200, 0_usize..5, "[x\n]{0,3}"), 0..8),
    ) {
        let source = words.concat().into_bytes();
        let mut edits = Edits::new();
        let mut sorted = places.clone();
        sorted.sort();
        let mut free = 0;
        for (at, length, text) in sorted {
            let start = at.min(source.len()).max(free);
            let end = (start + length).min(source.len());
            edits.replace(start..end, text.as_bytes());
            free = end + 1;
            if free > source.len() {
                break;
            }
        }
        let applied = edits.apply(&source).unwrap();
        let diff = unified(&source, &edits, "a", "b").unwrap();
        prop_assert_eq!(patched(&source, &diff), applied);
    }
}
