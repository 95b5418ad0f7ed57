//! Rows that were copied: the same angles, reading, condition and read-out as an earlier row, to the last digit. A copy may have got another
//! time or session.
//!
//! A copy says nothing new, but counts as a further measurement: it pulls the fit towards its pose. Two readings of one pose at different
//! times, or without a clock, can also be equal by chance, where the sensor's steps are coarse; see [`noise_floor::repeats_agree_by_chance`].

use std::hash::{DefaultHasher, Hash, Hasher};

use super::dataset::{Dataset, Row};
use super::noise_floor;
use super::row_list::row_list;
use truegrind_arm::condition::Condition;

/// The rows without copies, with a note on those left out.
pub(super) fn without_copies(dataset: Dataset) -> Dataset {
    let mut copies = copies(&dataset);
    if copies.iter().any(|copy| copy.clock != Clock::Same) && noise_floor::repeats_agree_by_chance(&dataset) {
        copies.retain(|copy| copy.clock == Clock::Same);
    }
    if copies.iter().any(|copy| copy.clock == Clock::Other) && noise_floor::repeats_may_all_agree(&dataset) {
        copies.retain(|copy| copy.clock != Clock::Other);
    }
    let copies: Vec<usize> = copies.into_iter().map(|copy| copy.row).collect();
    if copies.is_empty() {
        return dataset;
    }
    let mut kept = vec![true; dataset.rows.len()];
    copies.iter().for_each(|&i| kept[i] = false);
    let indices: Vec<usize> = (0..kept.len()).filter(|&i| kept[i]).collect();
    let mut out = dataset.subset(&indices);
    let numbers: Vec<usize> = copies.iter().map(|&i| dataset.rows[i].number).collect();
    out.notes.push(format!(
        "{} of earlier rows, identical to the last digit of the reading, and left out",
        if numbers.len() == 1 {
            format!("{} is a copy", row_list(&numbers))
        } else {
            format!("{} are copies", row_list(&numbers))
        }
    ));
    out
}

/// A row that equals an earlier one.
struct Copied {
    row: usize,
    clock: Clock,
}

/// What time and session of a copy are, beside those of the earlier row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Clock {
    /// The same.
    Same,
    /// The same session, without a time.
    None,
    /// Another time or session.
    Other,
}

impl Clock {
    fn of(row: &Row, earlier: &Row) -> Self {
        let time_h = |row: &Row| row.condition.time_h;
        match time_h(row) {
            _ if time_h(row) != time_h(earlier) || row.session() != earlier.session() => Clock::Other,
            Some(_) => Clock::Same,
            None => Clock::None,
        }
    }
}

/// The rows that equal an earlier one. Rows are sorted by a hash, sixteen bytes each: a file can hold a million.
fn copies(dataset: &Dataset) -> Vec<Copied> {
    let hashed = |(i, row)| (hash(row), i as u32);
    let mut hashes: Vec<(u64, u32)> = dataset.rows.iter().enumerate().map(hashed).collect();
    hashes.sort_unstable();
    let row = |(_, index): &(u64, u32)| &dataset.rows[*index as usize];
    let mut out = Vec::new();
    for alike in hashes.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        out.extend((1..alike.len()).filter_map(|k| {
            let this = row(&alike[k]);
            let same = alike[..k].iter().map(row).filter(|earlier| is_same(earlier, this));
            let clock = same.map(|earlier| Clock::of(this, earlier)).min()?;
            Some(Copied { row: alike[k].1 as usize, clock })
        }));
    }
    out.sort_unstable_by_key(|copy| copy.row);
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
    let known = |row: &Row| (row.readout_mm(), row.path().cloned());
    let untimed = |row: &Row| Condition { time_h: None, ..*row.condition };
    a.joints == b.joints
        && a.reading == b.reading
        && a.anchor == b.anchor
        && untimed(a) == untimed(b)
        && known(a) == known(b)
}
