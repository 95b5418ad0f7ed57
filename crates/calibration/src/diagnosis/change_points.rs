//! Uncertainty of the change points of shifts, in held-out errors.
//!
//! The rows of a shift are chosen with the rows that are held out later, so folds with fixed change points promise too much. Let a change
//! point b stand between rows b − 1 and b, eᵢ be the error of row i, and jᵢ what the other side of b would add to it. Moved to t, rows
//! between b and t have the errors eᵢ + jᵢ, so that with noise σ
//!
//! p(t) ∝ exp(−Σ (|eᵢ + jᵢ|² − |eᵢ|²) / 2σ²), over the rows between b and t.
//!
//! If t is true, a row in between has the noise eᵢ + jᵢ, and a new reading there the error of that noise and jᵢ. With P the probability
//! that row i belongs to the other side, its squared error is therefore expected to be larger by P (|eᵢ + jᵢ|² − |eᵢ|² + |jᵢ|²). A step
//! that is large against the noise adds nothing. Serially correlated errors count as fewer independent ones.
//!
//! Source: posterior of a change point given the means, Smith 1975; that a searched change point costs more than a regular
//! parameter, Ninomiya 2005.

use std::collections::BTreeSet;

use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::identification::fit::Observations;
use crate::measurement::dataset::Sensor;
use crate::measurement::sensor::disturbance::{Disturbance, Profile};
use truegrind_arm::model::Model;

/// Most rows on either side of a change point to which it may move.
const MAX_MOVED_ROWS: usize = 64;

/// The expected growth of each row's squared error (mm²) because the change points of shifts are uncertain; empty without shifts. For a
/// single row it may be negative.
pub fn added_squares(observed: &Observations, model: &Model, frames: &Frames) -> Vec<f64> {
    let numbers: Vec<usize> = observed.dataset.rows.iter().map(|row| row.number).collect();
    let changes = change_points(&frames.disturbances, &numbers);
    if changes.is_empty() {
        return Vec::new();
    }
    let n = numbers.len();
    let errors = error_vectors(observed, model, frames);
    let doubled_variance = 2.0 * variance_of_independent(&errors);
    let mut added = vec![0.0; n];
    for (k, &change) in changes.iter().enumerate() {
        let first = change.saturating_sub(MAX_MOVED_ROWS).max(if k > 0 { changes[k - 1] } else { 0 });
        let end = (change + MAX_MOVED_ROWS).min(changes.get(k + 1).copied().unwrap_or(n));
        let near: Vec<usize> = (first..end).collect();
        let rows = observed.subset(&near);
        let sides = [end, first].map(|to| {
            let moved = with_moved_change(frames, &numbers, change, to);
            error_vectors(&rows, model, &moved)
        });
        // What moving the change point beyond each row adds to the squared errors, and the squared step.
        let moved = |i: usize| {
            let (own, other) = (&errors[i], &sides[usize::from(i < change)][i - first]);
            (square(other) - square(own), square(&minus(other, own)))
        };
        let probabilities = other_side(first, change, end, |i| moved(i).0 / doubled_variance);
        for (i, probability) in near.into_iter().zip(probabilities) {
            let (growth, step) = moved(i);
            added[i] += probability * (growth + step);
        }
    }
    added
}

/// The first rows of the sides that follow a change point, ascending.
fn change_points(disturbances: &[Disturbance], numbers: &[usize]) -> Vec<usize> {
    let place = |number: usize| numbers.partition_point(|n| *n < number);
    let ends = disturbances.iter().filter_map(|disturbance| match disturbance.profile {
        Profile::Rows { from, to } => Some([place(from), place(to + 1)]),
        _ => None,
    });
    let inside: BTreeSet<usize> = ends.flatten().filter(|b| (1..numbers.len()).contains(b)).collect();
    inside.into_iter().collect()
}

/// The frames with a change point moved to stand before row `to`.
fn with_moved_change(frames: &Frames, numbers: &[usize], change: usize, to: usize) -> Frames {
    let mut out = frames.clone();
    let before = |place: usize| numbers[place - 1] + 1;
    let moved = if to == 0 { numbers[0] } else { before(to) };
    for disturbance in &mut out.disturbances {
        if let Profile::Rows { from, to } = &mut disturbance.profile {
            if numbers.partition_point(|n| n < from) == change {
                *from = moved;
            }
            if numbers.partition_point(|n| *n < *to + 1) == change {
                // Row numbers begin at 1.
                *to = moved.saturating_sub(1);
            }
        }
    }
    out
}

/// For each row from `first` to before `end`, the probability that the change point stands beyond it, seen from `change`. `cost` is what
/// a row on the other side takes from the logarithm of the probability.
fn other_side(first: usize, change: usize, end: usize, cost: impl Fn(usize) -> f64) -> Vec<f64> {
    let walk = |rows: &mut dyn Iterator<Item = usize>| {
        let mut sum = 0.0;
        rows.map(|i| {
            sum -= cost(i);
            // The change point that is stated is the best one beside all other parameters, not always beside fixed ones.
            sum.min(0.0).exp()
        })
        .collect::<Vec<f64>>()
    };
    let (before, after) = (walk(&mut (first..change).rev()), walk(&mut (change..end)));
    let all = 1.0 + before.iter().chain(&after).sum::<f64>();
    // Row i is passed by every change point that is farther away.
    let beyond = |weights: &[f64]| {
        let mut left: f64 = weights.iter().sum();
        weights
            .iter()
            .map(|weight| {
                let here = left / all;
                left -= weight;
                here
            })
            .collect::<Vec<f64>>()
    };
    let mut out = beyond(&before);
    out.reverse();
    out.extend(beyond(&after));
    out
}

/// Errors of position or length (mm) of each row.
fn error_vectors(observed: &Observations, model: &Model, frames: &Frames) -> Vec<[f64; 3]> {
    let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; observed.dataset.rows.len()];
    let problem = CalibrationProblem::new(&observed.dataset, model, frames, &[], &[], &weights);
    let (per, lengths) = match observed.dataset.sensor {
        Sensor::Cable => (1, 1),
        Sensor::Position => (3, 3),
        Sensor::Pose => (6, 3),
    };
    let row = |all: &[f64]| std::array::from_fn(|k| if k < lengths { all[k] } else { 0.0 });
    problem.unweighted_residuals(&[]).chunks(per).map(row).collect()
}

fn square(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum()
}

fn minus(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// Variance of a coordinate (mm²), larger by as much as serial correlation makes the sum of errors vary more than that of independent
/// ones: (1 + ρ) / (1 − ρ).
fn variance_of_independent(errors: &[[f64; 3]]) -> f64 {
    let lengths = if errors.iter().any(|e| e[1] != 0.0) { 3.0 } else { 1.0 };
    let sum: f64 = errors.iter().map(square).sum();
    let beside: f64 =
        errors.windows(2).map(|p| p[0].iter().zip(&p[1]).map(|(a, b)| a * b).sum::<f64>()).sum();
    let rho = if sum > 0.0 { (beside / sum).clamp(0.0, 0.95) } else { 0.0 };
    (sum / (lengths * errors.len().max(1) as f64)).max(f64::MIN_POSITIVE) * (1.0 + rho) / (1.0 - rho)
}
