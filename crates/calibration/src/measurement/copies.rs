//! Rows that were copied: the same angles, reading, condition and read-out as an earlier row, to the last digit.
//!
//! A copy says nothing new, but counts as a further measurement: it pulls the fit towards its pose. Without a clock, two readings
//! of one pose can also be equal by chance, where the sensor's steps are coarse; see [`split::repeats_agree_by_chance`].

use std::collections::HashMap;

use super::dataset::{Dataset, Reading, Row};
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

/// Indices of the rows that equal an earlier one.
fn copies(dataset: &Dataset) -> Vec<usize> {
    let mut seen: HashMap<[u64; 7], Vec<usize>> = HashMap::new();
    let mut out = Vec::new();
    for (i, row) in dataset.rows.iter().enumerate() {
        let like = seen.entry(key(row)).or_default();
        if like.iter().any(|&earlier| is_same(&dataset.rows[earlier], row)) {
            out.push(i);
        } else {
            like.push(i);
        }
    }
    out
}

/// Angles and the first number of the reading.
fn key(row: &Row) -> [u64; 7] {
    let first = match &row.reading {
        Reading::Cable(length) => *length,
        Reading::Position(at) => at.x,
        Reading::Pose(pose) => pose.translation.x,
    };
    std::array::from_fn(|k| if k < 6 { row.joints[k] } else { first }.to_bits())
}

fn is_same(a: &Row, b: &Row) -> bool {
    let known = |row: &Row| (row.readout_mm(), row.session().map(str::to_owned), row.path().cloned());
    a.joints == b.joints
        && a.reading == b.reading
        && a.anchor == b.anchor
        && a.condition == b.condition
        && known(a) == known(b)
}
