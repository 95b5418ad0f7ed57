//! Rows that were copied: the same angles, reading, condition and read-out as an earlier row, to the last digit.
//!
//! A copy says nothing new, but counts as a further measurement: it pulls the fit towards its pose. Without a clock, two readings
//! of one pose can also be equal by chance, where the sensor's steps are coarse; see [`split::repeats_agree_by_chance`].

use std::hash::{DefaultHasher, Hash, Hasher};

use super::dataset::{Dataset, Row};
use super::row_list::row_list;
use super::split;

/// The rows without copies, with a note on those left out.
pub(super) fn without_copies(dataset: Dataset) -> Dataset {
    let mut copies = copies(&dataset);
    let timed = |&i: &usize| dataset.rows[i].condition.time_h.is_some();
    if !copies.iter().all(timed) && split::repeats_agree_by_chance(&dataset) {
        copies.retain(timed);
    }
    if copies.is_empty() {
        return dataset;
    }
    let mut kept = vec![true; dataset.rows.len()];
    copies.iter().for_each(|&i| kept[i] = false);
    let indices: Vec<usize> = (0..kept.len()).filter(|&i| kept[i]).collect();
    let mut out = dataset.subset(&indices);
    let numbers: Vec<usize> = copies.iter().map(|&i| dataset.rows[i].number).collect();
    out.notes.push(format!(
        "{} of earlier rows, equal to the last digit of the reading, and left out: a copy is no further measurement",
        if numbers.len() == 1 {
            format!("{} is a copy", row_list(&numbers))
        } else {
            format!("{} are copies", row_list(&numbers))
        }
    ));
    out
}

/// Indices of the rows that equal an earlier one. Rows are sorted by a hash, sixteen bytes each: a file can hold a million.
fn copies(dataset: &Dataset) -> Vec<usize> {
    let hashed = |(i, row)| (hash(row), i as u32);
    let mut hashes: Vec<(u64, u32)> = dataset.rows.iter().enumerate().map(hashed).collect();
    hashes.sort_unstable();
    let row = |(_, index): &(u64, u32)| &dataset.rows[*index as usize];
    let mut out = Vec::new();
    for alike in hashes.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        let is_copy = |k: &usize| alike[..*k].iter().any(|earlier| is_same(row(earlier), row(&alike[*k])));
        out.extend((1..alike.len()).filter(is_copy).map(|k| alike[k].1 as usize));
    }
    out.sort_unstable();
    out
}

/// Hash of angles and reading.
fn hash(row: &Row) -> u64 {
    let mut hasher = DefaultHasher::new();
    let place = row.reading.place_mm();
    row.joints.iter().chain(&place).for_each(|number| number.to_bits().hash(&mut hasher));
    hasher.finish()
}

fn is_same(a: &Row, b: &Row) -> bool {
    let known = |row: &Row| (row.readout_mm(), row.session().map(str::to_owned), row.path().cloned());
    a.joints == b.joints
        && a.reading == b.reading
        && a.anchor == b.anchor
        && a.condition == b.condition
        && known(a) == known(b)
}
