//! The order of measuring. Steps of the set-up, drifts and approach directions are read from the order of the rows, but a file may be
//! sorted otherwise, by pose or by name: then the clock tells the order, or the session labels do. Rows are numbered as in a file that is
//! sorted so, since steps of the set-up are told as ranges of row numbers.

use std::collections::HashMap;

use super::dataset::Dataset;
use super::row_list::row_list;
use truegrind_math::statistics::extent;

/// Share of the logged time within which a clock that goes back is near its first value: it was restarted.
const NEAR_START: f64 = 0.01;

/// Changes of the session label, for each session, from which its rows are mixed: a session that is continued once is not.
const CHANGES: usize = 3;

/// The rows in the order in which they were measured, as far as `t` and `session` tell, with a note on what was changed.
///
/// - `t` runs over the file in any order: sorted by `t`.
/// - `t` goes back to its start, once or more often: a clock that was restarted. It cannot order the rows and is left out.
/// - without `t`, rows of one session stand in several places: brought together, the sessions in the order of their first rows.
pub(super) fn in_order_of_measuring(dataset: Dataset) -> Dataset {
    match times(&dataset) {
        Some(times) => by_clock(dataset, &times),
        None => by_session(dataset),
    }
}

/// The time of every row (h), if all rows have one.
fn times(dataset: &Dataset) -> Option<Vec<f64>> {
    dataset.rows.iter().map(|row| row.condition.time_h).collect()
}

fn by_clock(mut dataset: Dataset, times: &[f64]) -> Dataset {
    let back: Vec<usize> = (1..times.len()).filter(|&i| times[i] < times[i - 1]).collect();
    if back.is_empty() {
        return dataset;
    }
    let [first, last] = extent(times.iter().copied());
    let near = first + NEAR_START * (last - first);
    if times[0] <= near && back.iter().all(|&i| times[i] <= near) {
        let numbers: Vec<usize> = back.iter().map(|&i| dataset.rows[i].number).collect();
        for row in dataset.rows.iter_mut() {
            std::sync::Arc::make_mut(&mut row.condition).time_h = None;
        }
        dataset.notes.push(format!(
            "column t starts again at {}; how much time passed in between is unknown, so t is not used and the rows are taken in the order of the \
             file; give hours since one common start in all rows",
            row_list(&numbers)
        ));
        return dataset;
    }
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
    let numbers: Vec<usize> = back.iter().map(|&i| dataset.rows[i].number).collect();
    let mut out = sorted(&dataset, &order);
    out.notes.push(format!(
        "the rows are not in the order of column t, which goes back at {}: they were sorted by t, and row numbers are those of the sorted file",
        row_list(&numbers)
    ));
    out
}

fn by_session(dataset: Dataset) -> Dataset {
    let mut places: HashMap<&str, usize> = HashMap::new();
    let mut labels = Vec::with_capacity(dataset.rows.len());
    for row in &dataset.rows {
        let Some(session) = row.session() else { return dataset };
        let next = places.len();
        labels.push(*places.entry(session).or_insert(next));
    }
    let changes = labels.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let sessions = places.len();
    if sessions < 2 || changes < CHANGES * sessions {
        return dataset;
    }
    let mut order: Vec<usize> = (0..labels.len()).collect();
    order.sort_by_key(|&i| labels[i]);
    let mut out = sorted(&dataset, &order);
    out.notes.push(format!(
        "the rows of {sessions} sessions are mixed: they were sorted by column session, in the order of the sessions' first rows, and row numbers \
         are those of the sorted file"
    ));
    out
}

/// The rows in another order, with the numbers that stand there in a file sorted so.
fn sorted(dataset: &Dataset, order: &[usize]) -> Dataset {
    let mut out = dataset.subset(order);
    let numbers: Vec<usize> = dataset.rows.iter().map(|row| row.number).collect();
    for (row, number) in out.rows.iter_mut().zip(numbers) {
        row.number = number;
    }
    out
}
