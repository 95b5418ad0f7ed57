//! Rows whose joints lie outside the ranges of the data sheet. No controller goes there: the angles are those of another robot, count from
//! another zero or the other way round, or this arm's ranges were changed.

use super::dataset::Dataset;
use super::row_list::row_list;
use truegrind_arm::model::{Limited, Limits};

/// How far beyond its range a joint may read (rad): data sheets round.
const SLACK_RAD: f64 = 0.0175;

/// The rows in which one joint, or sum of joints, is out of its range.
struct OutOfRange {
    what: Limited,
    rows: Vec<usize>,
    /// The angle farthest out (rad), and the range.
    farthest: [f64; 3],
}

/// Notes rows with joints out of their range. Of a row with several the first counts.
pub(super) fn note_joints_out_of_range(dataset: &mut Dataset, limits: &Limits) {
    let mut all: Vec<OutOfRange> = Vec::new();
    for row in &dataset.rows {
        let Some(what) = limits.violated_beyond(&row.joints, SLACK_RAD) else { continue };
        let here = limits.angle_and_range(what, &row.joints);
        let beyond = |[angle, min, max]: [f64; 3]| (min - angle).max(angle - max);
        match all.iter_mut().find(|known| known.what == what) {
            Some(known) => {
                known.rows.push(row.number);
                if beyond(here) > beyond(known.farthest) {
                    known.farthest = here;
                }
            }
            None => all.push(OutOfRange { what, rows: vec![row.number], farthest: here }),
        }
    }
    let of = dataset.rows.len();
    dataset.notes.extend(all.iter().map(|out| {
        let [angle, min, max] = out.farthest.map(f64::to_degrees);
        format!(
            "{} ({} of {of}): {} is at up to {angle:.1}°, its range in the data sheet is {min:.1}° to {max:.1}°; check that this is the robot \
             and that the angles are those its controller shows",
            row_list(&out.rows),
            out.rows.len(),
            out.what
        )
    }));
}
