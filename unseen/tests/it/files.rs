//! Rows that somebody measured, changed by nothing that matters.

use truegrind_unseen::draw::{Purpose, generator};
use truegrind_unseen::file::{Table, trials};
use truegrind_unseen::stability::Change;

const REPEATED: &str = "q1,q2,q3,q4,q5,q6,L\n1,2,3,4,5,6,500.1\n1,2,3,4,5,6,500.2\n9,2,3,4,5,6,612.3\n";

#[test]
fn changes_are_those_that_do_not_matter() {
    let table = Table::read(REPEATED);
    assert_eq!((table.rows(), table.text().as_str()), (3, REPEATED));
    let mut rng = generator(1, 0, 0, 0, Purpose::Variant);
    assert_eq!(table.changed(Change::OneLess, &mut rng).unwrap().rows(), 2);
    let moved = table.changed(Change::Rounded, &mut rng).unwrap().text();
    for (line, other) in REPEATED.lines().zip(moved.lines()).skip(1) {
        for (a, b) in line.split(',').zip(other.split(',')) {
            let (a, b): (f64, f64) = (a.parse().unwrap(), b.parse().unwrap());
            assert!((a - b).abs() <= 0.6e-8, "{a} {b}");
        }
    }
    let other = (0..20).find_map(|_| table.changed(Change::Shuffled, &mut rng)).unwrap().text();
    assert_eq!(other, REPEATED.replace("500.1", "x").replace("500.2", "500.1").replace('x', "500.2"));
}

/// Identified findings that hang on a seed, a place in the file or a last digit are no findings. The judge's example asks it of any
/// file, as often as one likes (`--file`, `--stability`).
#[test]
fn the_same_rows_give_the_same_identified_findings() {
    let text = include_str!("../../../tests/data/irb120-tracker.csv");
    let found = trials(&Table::read(text), "abb-irb-120", (6, 5), |_, _, _, _| {}).unwrap();
    assert!(!found.plain.is_empty());
    for (change, (count, others)) in &found.changed {
        assert!(others.is_empty(), "{}: {} of {count} tell {others:?}", change.name(), others.len());
    }
}
