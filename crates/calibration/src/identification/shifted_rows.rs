//! Rows beside which stands the reading of the row before or after them: a reading that is missing or one too many shifts the readings of all
//! later rows, until another mistake shifts them back.
//!
//! Method: where the frames are known, each row is tried with its own joint angles and with those of its neighbours. A run of rows is shifted where the
//! neighbour's angles explain what the own ones do not: the run with the largest sum of points, one for each such row, less some for rows that
//! speak against it (Bentley 1984, maximum subarray). Where they are not, they are fitted to blocks of consecutive rows, as they stand
//! and shifted, and concentrated on the half of the rows that fits best (Rousseeuw and Van Driessen 1999, C-steps); the block that explains most
//! rows counts. A shift that concerns few rows of a block, or more than two thirds of the file in turns, is not found.

use super::calibration::{CalibrationProblem, Frames, Weight};
use super::fit::{OTHER_ARM_MM, Observations, Start, fit, frame_parameters};
use super::solver::SOLVERS;
use super::start::candidate_frames;
use super::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::model::Model;
use truegrind_math::statistics::median;
use truegrind_math::work::checkpoint;

/// What shifts the readings of all rows if they were joined by time.
const CLOCKS_DIFFER: &str =
    ", or the clocks of tracker and controller differ by the time between two rows (--points-ahead)";

/// Shifted rows leave at most this share of their error.
const SHARE: f64 = 0.1;

/// Fewest rows of a run. A single length fits another row by chance where a position does not.
const MIN_RUN: i32 = 3;
const MIN_RUN_OF_CABLE: i32 = 5;

/// Share of rows that neither stand where they belong nor in a run, up to which the file is explained.
const UNEXPLAINED: f64 = 0.1;

/// Blocks into which a file is divided, each of which overlaps the next by half.
const BLOCKS: usize = 6;

/// Rows for each unknown of the frames in a block, in readings.
const READINGS_PER_UNKNOWN: usize = 2;

/// Rows to which frames are fitted at most.
const MANY: usize = 200;

/// Most runs that are told apart.
const MAX_RUNS: usize = 4;

/// Rows from `first` to `last`, by index, whose readings belong to the row that is `step` later.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Run {
    first: usize,
    last: usize,
    step: isize,
}

/// The runs in words; `None` where there are none.
fn sentence(dataset: &Dataset, runs: &[Run]) -> Option<String> {
    let of = |run: &Run| {
        let [first, last] = [run.first, run.last].map(|row| dataset.rows[row].number);
        let clocks = if dataset.joined_by_time { CLOCKS_DIFFER } else { "" };
        let (neighbour, mistake) = if run.step > 0 {
            ("after", "a reading is missing there")
        } else {
            ("before", "there is one reading too many")
        };
        // Without a row after it, that of the last row cannot be told.
        if run.last + 2 >= dataset.rows.len() {
            format!("from row {first} on each reading belongs to the row {neighbour} it: {mistake}{clocks}")
        } else {
            format!(
                "rows {first} to {last}: angles and readings look shifted by one, each reading belongs to the row {neighbour} it"
            )
        }
    };
    let all: Vec<String> = runs.iter().map(of).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// What is said of rows that were set aside under a fitted model and its frames, where they are shifted.
pub(crate) fn note(dataset: &Dataset, model: &Model, frames: &Frames) -> Option<String> {
    let case = Case::of(dataset);
    let runs = case.runs(&case.errors_mm(model, frames));
    Some(format!("{}: they are set aside; mend the table and run this again", sentence(dataset, &runs)?))
}

/// Whether shifted rows explain why the readings fit no arm, in a sentence part.
pub(super) fn explanation(dataset: &Dataset, nominal: &Model) -> Option<String> {
    let case = Case::of(dataset);
    let (left, runs) = case.search(nominal)?;
    (left as f64 <= UNEXPLAINED * dataset.rows.len() as f64).then(|| sentence(dataset, &runs)).flatten()
}

/// The rows as they stand, and with the angles of their neighbours.
struct Case<'a> {
    dataset: &'a Dataset,
    /// With the step of each.
    shifted: Vec<(isize, Dataset)>,
}

/// Sizes of the rows' errors.
struct Errors {
    own_mm: Vec<f64>,
    /// As in [`Case::shifted`]; infinite where there is no neighbour.
    shifted_mm: Vec<Vec<f64>>,
}

impl<'a> Case<'a> {
    fn of(dataset: &'a Dataset) -> Self {
        let places = dataset.rows.iter().any(|row| row.anchor > 0);
        let mut shifted = Vec::new();
        for step in [1, -1] {
            // An outlet or a station may have moved along with the reading, or not.
            for with_place in [false, true].into_iter().take(1 + usize::from(places)) {
                let mut other = dataset.clone();
                for (index, row) in other.rows.iter_mut().enumerate() {
                    let Some(neighbour) = neighbour(dataset, index, step) else { continue };
                    row.joints = dataset.rows[neighbour].joints;
                    row.condition = dataset.rows[neighbour].condition.clone();
                    if !with_place {
                        row.anchor = dataset.rows[neighbour].anchor;
                    }
                }
                shifted.push((step, other));
            }
        }
        Self { dataset, shifted }
    }

    fn errors_mm(&self, model: &Model, frames: &Frames) -> Errors {
        let of = |dataset: &Dataset| -> Vec<f64> {
            let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; dataset.rows.len()];
            let problem = CalibrationProblem::new(dataset, model, frames, &[], &[], &weights);
            problem.errors_mm(&[]).into_iter().map(f64::abs).collect()
        };
        let shifted_mm = self.shifted.iter().map(|(step, dataset)| {
            let mut errors = of(dataset);
            for (index, error) in errors.iter_mut().enumerate() {
                if neighbour(dataset, index, *step).is_none() {
                    *error = f64::INFINITY;
                }
            }
            errors
        });
        Errors { own_mm: of(self.dataset), shifted_mm: shifted_mm.collect() }
    }

    /// The runs of shifted rows.
    fn runs(&self, errors: &Errors) -> Vec<Run> {
        let min_run = if self.dataset.sensor == Sensor::Cable { MIN_RUN_OF_CABLE } else { MIN_RUN };
        let mut is_free = vec![true; self.dataset.rows.len()];
        let mut out: Vec<Run> = Vec::new();
        while out.len() < MAX_RUNS {
            let found = self.shifted.iter().zip(&errors.shifted_mm).filter_map(|((step, _), shifted_mm)| {
                let points: Vec<i32> =
                    (0..is_free.len())
                        .map(|row| {
                            if is_free[row] { points(errors.own_mm[row], shifted_mm[row]) } else { -min_run }
                        })
                        .collect();
                let (sum, first, last) = largest_sum(&points)?;
                let in_run = |errors: &[f64]| median(&errors[first..=last]);
                let is_clear = in_run(shifted_mm)? <= SHARE * in_run(&errors.own_mm)?;
                (sum >= min_run && is_clear).then_some((sum, Run { first, last, step: *step }))
            });
            let Some((_, run)) = found.max_by_key(|(sum, _)| *sum) else { break };
            is_free[run.first..=run.last].fill(false);
            out.push(run);
        }
        out.sort_unstable_by_key(|run| run.first);
        out
    }

    /// The runs under the frames that explain most rows, and how many rows these leave unexplained.
    fn search(&self, nominal: &Model) -> Option<(usize, Vec<Run>)> {
        let count = self.dataset.rows.len();
        let unknowns = frame_parameters(self.dataset).len();
        let min_rows = (READINGS_PER_UNKNOWN * unknowns).div_ceil(self.dataset.sensor.scalars().min(3));
        let size = (count / BLOCKS).max(min_rows);
        let mut best: Option<(usize, Vec<Run>)> = None;
        for first in (0..count).step_by((size / 2).max(1)).take_while(|first| first + size <= count) {
            for variant in std::iter::once(self.dataset).chain(self.shifted.iter().map(|(_, other)| other)) {
                checkpoint();
                let rows: Vec<usize> = (first..first + size).collect();
                let Some(found) = self.under_frames_of(&variant.subset(&rows), nominal, min_rows) else {
                    continue;
                };
                if best.as_ref().is_none_or(|(left, _)| found.0 < *left) {
                    best = Some(found);
                }
            }
        }
        best
    }

    /// The same under the frames of a block, concentrated on the rows that fit them best.
    fn under_frames_of(
        &self,
        block: &Dataset,
        nominal: &Model,
        min_rows: usize,
    ) -> Option<(usize, Vec<Run>)> {
        let frames = self.fitted_frames(block, nominal)?;
        let errors = self.errors_mm(nominal, &frames);
        // Each row as it fits best.
        let mut fitting: Vec<(f64, usize, usize)> = (0..self.dataset.rows.len())
            .map(|row| {
                let variants = std::iter::once(&errors.own_mm).chain(&errors.shifted_mm).enumerate();
                let least = variants.map(|(k, mm)| (mm[row], k)).min_by(|a, b| a.0.total_cmp(&b.0));
                least.map_or((f64::INFINITY, 0, row), |(mm, k)| (mm, k, row))
            })
            .collect();
        fitting.sort_by(|a, b| a.0.total_cmp(&b.0));
        fitting.truncate((self.dataset.rows.len() / 2).max(min_rows));
        fitting.sort_unstable_by_key(|(_, _, row)| *row);
        let mut half = self.dataset.subset(&fitting.iter().map(|(_, _, row)| *row).collect::<Vec<_>>());
        for (row, (_, variant, index)) in half.rows.iter_mut().zip(&fitting) {
            if let Some(variant) = variant.checked_sub(1) {
                *row = self.shifted[variant].1.rows[*index].clone();
            }
        }
        let frames = self.fitted_frames(&half, nominal)?;
        let errors = self.errors_mm(nominal, &frames);
        let runs = self.runs(&errors);
        let is_in_run = |row: usize| runs.iter().any(|run| (run.first..=run.last).contains(&row));
        let left = (0..self.dataset.rows.len())
            .filter(|&row| !(errors.own_mm[row] < OTHER_ARM_MM) && !is_in_run(row))
            .count();
        Some((left, runs))
    }

    /// The frames of some rows; `None` where these have not all outlets, or do not determine them.
    fn fitted_frames(&self, rows: &Dataset, nominal: &Model) -> Option<Frames> {
        let step = rows.rows.len().div_ceil(MANY);
        let rows = rows.subset(&(0..rows.rows.len()).step_by(step).collect::<Vec<_>>());
        if rows.anchors() < self.dataset.anchors() || rows.stations() < self.dataset.stations() {
            return None;
        }
        let frames = candidate_frames(&rows, nominal).ok()?.into_iter().next()?;
        if rows.sensor != Sensor::Cable {
            return Some(frames);
        }
        // The closed form takes the hook to be on the flange.
        let start = Start { model: nominal, frames: &frames };
        let parameters = frame_parameters(&rows);
        let observed = Observations::logged(rows);
        Some(fit(&observed, start, &parameters, &Tolerance::default(), &SOLVERS[0], 0).frames)
    }
}

fn neighbour(dataset: &Dataset, row: usize, step: isize) -> Option<usize> {
    row.checked_add_signed(step).filter(|other| *other < dataset.rows.len())
}

/// What a row says for its being shifted: a point where only the neighbour's angles fit its reading.
fn points(own_mm: f64, shifted_mm: f64) -> i32 {
    let [own, shifted] = [own_mm, shifted_mm].map(|mm| mm < OTHER_ARM_MM);
    match (own, shifted) {
        (false, true) if shifted_mm < 0.5 * own_mm => 1,
        // Two poses close to each other, as repeated ones are.
        (true, true) => 0,
        (false, _) => -1,
        (true, false) => -2,
    }
}

/// The largest sum of consecutive values, and the shortest range that has it; `None` if no value is positive.
fn largest_sum(values: &[i32]) -> Option<(i32, usize, usize)> {
    let (mut sum, mut first) = (0, 0);
    let mut best: Option<(i32, usize, usize)> = None;
    for (index, value) in values.iter().enumerate() {
        if sum <= 0 {
            (sum, first) = (0, index);
        }
        sum += value;
        if sum > best.map_or(0, |(most, ..)| most) {
            best = Some((sum, first, index));
        }
    }
    best
}
