//! Overlapping shifts of one kind rewritten as piecewise-constant levels.
//!
//! Shifts that were found successively can overlap: one over rows 72 to 535, another that cancels it in 300 to 387. A technician
//! can check a level between two rows, so overlapping shifts are cut at their ends, each piece gets the sum of the shifts
//! that cover it, and negligible pieces are dropped. The result has at most as many parameters.

use super::cause::Cause;
use super::extension::Extended;
use super::intervals::{MIN_INTERVAL_ROWS, tried};
use crate::identification::tolerance::Tolerance;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_estimation::problem::Problem;

/// Share of the largest level below which a piece is dropped.
const NEGLIGIBLE_SHARE: f64 = 0.25;

/// Penalised χ² by which the levels can be worse and are still preferred, because they are simpler.
const SIMPLICITY_BONUS: f64 = 4.0;

/// A shift and its rows.
fn shift(cause: &Cause) -> Option<(&Disturbance, usize, usize)> {
    match cause {
        Cause::Measurement(d) => match d.profile {
            Profile::Rows { from, to } => Some((d, from, to)),
            _ => None,
        },
        Cause::Arm(_) => None,
    }
}

/// The causes with overlapping shifts as levels, with starting values; `None` if none overlap.
pub fn piecewise_levels(causes: &[Cause]) -> Option<Vec<Cause>> {
    let mut kinds: Vec<&Kind> = Vec::new();
    for (d, ..) in causes.iter().filter_map(shift) {
        if !kinds.contains(&&d.kind) {
            kinds.push(&d.kind);
        }
    }
    let mut out = causes.to_vec();
    let mut changed = false;
    for kind in kinds {
        let group: Vec<(&Disturbance, usize, usize)> =
            causes.iter().filter_map(shift).filter(|(d, ..)| d.kind == *kind).collect();
        let overlaps =
            |a: &(&Disturbance, usize, usize), b: &(&Disturbance, usize, usize)| a.1 <= b.2 && b.1 <= a.2;
        if !group.iter().enumerate().any(|(i, a)| group[..i].iter().any(|b| overlaps(a, b))) {
            continue;
        }
        let levels = levels(&group);
        let first = causes.iter().position(|c| shift(c).is_some_and(|(d, ..)| d.kind == *kind));
        let Some(first) = first else { continue };
        let index = out.iter().position(|c| c == &causes[first]).unwrap_or(out.len());
        out.retain(|c| shift(c).is_none_or(|(d, ..)| d.kind != *kind));
        let index = index.min(out.len());
        out.splice(index..index, levels.into_iter().map(Cause::Measurement));
        changed = true;
    }
    changed.then_some(out)
}

/// The nonnegligible pieces between the ends of a group of shifts of one kind.
fn levels(group: &[(&Disturbance, usize, usize)]) -> Vec<Disturbance> {
    let mut cuts: Vec<usize> = group.iter().flat_map(|(_, from, to)| [*from, to + 1]).collect();
    cuts.sort_unstable();
    cuts.dedup();
    let kind = &group[0].0.kind;
    let unit = Disturbance::new(kind.clone(), Profile::Constant);
    let sizes: Vec<f64> = (0..unit.values.len()).map(|k| Tolerance::of_disturbance(&unit, k)).collect();
    let nothing = vec![0.0; sizes.len()];
    let apart = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(&sizes).map(|((a, b), s)| ((a - b) / s).powi(2)).sum::<f64>().sqrt()
    };
    // First row, row after the last, level; the level is 0 before the first and after the last piece.
    let mut pieces: Vec<(usize, usize, Vec<f64>)> = cuts
        .windows(2)
        .map(|cut| {
            let mut level = nothing.clone();
            for (d, ..) in group.iter().filter(|(_, low, high)| *low <= cut[0] && cut[0] <= *high) {
                level.iter_mut().zip(&d.values).for_each(|(l, v)| *l += v);
            }
            (cut[0], cut[1], level)
        })
        .collect();
    // Ends that nearly coincide are one event: a short piece is joined with the more similar neighbour.
    while let Some(k) = pieces.iter().position(|(from, to, _)| to - from < MIN_INTERVAL_ROWS) {
        let (from, to, level) = pieces.remove(k);
        let beside = |at: Option<usize>| at.and_then(|i| pieces.get(i)).map_or(&nothing, |p| &p.2);
        let (before, after) = (k.checked_sub(1), Some(k));
        let left = apart(&level, beside(before)) <= apart(&level, beside(after));
        if left && let Some(piece) = before.and_then(|i| pieces.get_mut(i)) {
            piece.1 = to;
        } else if !left && let Some(piece) = pieces.get_mut(k) {
            piece.0 = from;
        }
    }
    let largest = pieces.iter().map(|p| apart(&p.2, &nothing)).fold(0.0, f64::max);
    pieces
        .into_iter()
        .filter(|p| apart(&p.2, &nothing) > NEGLIGIBLE_SHARE * largest)
        .map(|(from, to, values)| Disturbance {
            values,
            ..Disturbance::new(kind.clone(), Profile::Rows { from, to: to - 1 })
        })
        .collect()
}

/// Whether `levels` fits as well as `before`, with a penalty of ln n for each parameter and for the searched ends.
pub fn is_as_good(levels: &Extended, before: &Extended) -> bool {
    let per = before.problem.rows_per_observation();
    let criterion = |fit: &Extended| {
        let plain = fit.problem.unweighted_residuals(&fit.x);
        let rows: f64 = plain
            .chunks(per)
            .zip(before.weights.iter().zip(&before.robust_weight))
            .map(|(row, (w, robust_weight))| {
                let square: f64 = row
                    .iter()
                    .enumerate()
                    .map(|(c, r)| (r * if c < 3 { w.per_mm } else { w.per_rad }).powi(2))
                    .filter(|s| s.is_finite())
                    .sum();
                robust_weight * square
            })
            .sum();
        let n = (plain.len() / per.max(1)) as f64;
        let shifts = fit.causes.iter().filter(|c| shift(c).is_some()).count() as f64;
        // The ends of a shift were searched among all rows.
        rows + fit.parameters.len() as f64 * (plain.len() as f64).ln() + shifts * 2.0 * tried(n).ln()
    };
    criterion(levels) <= criterion(before) + SIMPLICITY_BONUS
}
