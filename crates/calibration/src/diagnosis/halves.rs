//! Halves of the rows in which a diagnosis is looked for again: what is there comes back in them.
//!
//! Two random pairs and one pair on two sides of the joint space; a pose that was measured several times stays whole. Rows
//! measured along a path resemble their neighbours, so there the random pairs are made of alternate blocks of rows.
//! Source: complementary pairs of halves, Shah and Samworth 2013; halves on two sides of a variable, Peters et al. 2016.

use nalgebra::{DMatrix, DVector};

use super::algebra::eigen;
use crate::measurement::dataset::Dataset;
use crate::measurement::split;

/// How many halves there are.
pub const HALVES: usize = 6;

/// Rows are a path where the usual step between rows is below this share of the usual distance of two rows.
const PATH: f64 = 0.25;

/// Blocks of a path that go to one half or the other.
const PIECES: usize = 24;

/// Indices of the rows of each half, ascending; a half and the next are complements.
pub fn halves(dataset: &Dataset, seed: u64) -> Vec<Vec<usize>> {
    let poses = split::poses(dataset);
    let mut out = Vec::with_capacity(HALVES);
    let n = dataset.rows.len();
    let path = is_path(dataset);
    for pair in 0..HALVES as u64 / 2 - 1 {
        let sides = if path {
            alternate(&poses, n, pair as usize)
        } else {
            random(dataset, &poses, seed.wrapping_add(pair))
        };
        out.extend(both(&poses, &sides));
    }
    out.extend(both(&poses, &sides_of_joint_space(dataset, &poses)));
    out
}

/// Whether each row lies near the one before it.
pub fn is_path(dataset: &Dataset) -> bool {
    let n = dataset.rows.len();
    if n < 2 * PIECES {
        return false;
    }
    let apart = |i: usize, j: usize| (dataset.rows[i].joints - dataset.rows[j].joints).norm();
    let usual = |shift: usize| {
        let all: Vec<f64> = (0..n).map(|i| apart(i, (i + shift) % n)).filter(|d| *d > 0.0).collect();
        truegrind_math::statistics::median(&all).unwrap_or(0.0)
    };
    usual(1) < PATH * usual(n / 2 + 1).max(usual(n / 3 + 1))
}

fn both(poses: &[Vec<usize>], first: &[bool]) -> [Vec<usize>; 2] {
    [true, false].map(|side| {
        let of_side = poses.iter().zip(first).filter(|(_, s)| **s == side);
        let mut rows: Vec<usize> = of_side.flat_map(|(pose, _)| pose.iter().copied()).collect();
        rows.sort_unstable();
        rows
    })
}

/// Half of the poses, drawn from the poses themselves: another row changes nothing about the others.
fn random(dataset: &Dataset, poses: &[Vec<usize>], seed: u64) -> Vec<bool> {
    let mut side = vec![false; poses.len()];
    let drawn =
        split::shuffled_by_angles(dataset, (0..poses.len()).map(|p| vec![poses[p][0], p]).collect(), seed);
    drawn.iter().take(poses.len() / 2).for_each(|pose| side[pose[1]] = true);
    side
}

/// Alternate blocks of rows; those of the second pair begin in the middle of those of the first.
fn alternate(poses: &[Vec<usize>], n: usize, pair: usize) -> Vec<bool> {
    let block = |row: usize| ((2 * PIECES * row / n.max(1) + pair) / 2).is_multiple_of(2);
    poses.iter().map(|pose| block(pose[0])).collect()
}

/// Poses on the two sides of the middle along the direction in which the joints vary most.
fn sides_of_joint_space(dataset: &Dataset, poses: &[Vec<usize>]) -> Vec<bool> {
    let all = DMatrix::from_fn(6, poses.len(), |j, p| dataset.rows[poses[p][0]].joints[j]);
    let mean = all.column_mean();
    let centred = DMatrix::from_fn(6, poses.len(), |j, p| all[(j, p)] - mean[j]);
    let direction = eigen(&(&centred * centred.transpose()))
        .and_then(|(values, vectors)| {
            let largest = values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?.0;
            Some(vectors.column(largest).into_owned())
        })
        .unwrap_or_else(|| DVector::from_element(6, 1.0));
    let along = centred.tr_mul(&direction);
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&a, &b| along[a].total_cmp(&along[b]).then(a.cmp(&b)));
    let mut side = vec![false; poses.len()];
    order.iter().take(poses.len() / 2).for_each(|&p| side[p] = true);
    side
}
