//! Edits are disjoint, and bytes outside them do not change.

use proptest::prelude::*;
use truegrind::program::edit::{EditError, Edits};
use truegrind::program::rapid::task_list;

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
