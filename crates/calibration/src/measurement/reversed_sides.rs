//! Sides of approach that contradict the order of the rows: a user who logs the direction of motion has the signs reversed.

use super::dataset::Dataset;

/// Fewest sides that are compared.
const FEWEST: usize = 30;

/// Share of the sides against the order of the rows from which they look reversed. A program that passes every pose and comes back to it
/// reverses all of them too, so that this is a note and no error.
const REVERSED: f64 = 0.95;

/// Motion of a joint between rows that has a direction (rad).
const MOVED_RAD: f64 = 1e-6;

/// Notes logged sides of approach that are opposite to the motion from the row before in nearly every row.
pub(super) fn note_reversed_sides(dataset: &mut Dataset) {
    let (mut compared, mut opposite) = (0_usize, 0_usize);
    for (before, row) in dataset.rows.iter().zip(dataset.rows.iter().skip(1)) {
        let step = row.joints - before.joints;
        for (step, side) in step.iter().zip(row.condition.approach) {
            if side != 0 && step.abs() > MOVED_RAD {
                compared += 1;
                // A growing angle comes from below, −1.
                opposite += usize::from(f64::from(side) * step > 0.0);
            }
        }
    }
    if compared >= FEWEST && opposite as f64 >= REVERSED * compared as f64 {
        dataset.notes.push(format!(
            "{opposite} of {compared} sides of approach are opposite to the motion from the row before: in approach1 to approach6, −1 is from \
             below (the angle grew) and +1 from above; if the columns hold the direction of motion, change their signs"
        ));
    }
}
