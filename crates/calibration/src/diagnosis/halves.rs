//! Complementary halves of the rows for stability selection.
//!
//! Two random pairs and one pair on two sides of the joint space; all readings of a pose are in one half. Rows measured along a
//! path resemble their neighbours, so there the random pairs consist of alternate blocks of rows.
//! Source: complementary pairs of halves, Shah and Samworth 2013; halves on two sides of a variable, Peters et al. 2016.

use nalgebra::{DMatrix, DVector};

use super::algebra::eigen;
use crate::measurement::dataset::Dataset;
use crate::measurement::{repeated_poses, split};

/// Number of halves.
pub const HALVES: usize = 6;

/// Median step between consecutive rows, as a share of the median distance of any two, below which rows are a path.
const PATH: f64 = 0.25;

/// Number of alternate blocks of a path.
const PIECES: usize = 24;

/// Indices of the rows of each half, ascending; consecutive halves are complements.
pub fn halves(dataset: &Dataset, seed: u64) -> Vec<Vec<usize>> {
    let poses = repeated_poses::poses(dataset);
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

/// Whether rows are a path: each near the previous one.
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

/// A random half of the poses; the draw depends on the joint angles, so further rows do not change it for the others.
fn random(dataset: &Dataset, poses: &[Vec<usize>], seed: u64) -> Vec<bool> {
    let mut side = vec![false; poses.len()];
    let drawn =
        split::shuffled_by_angles(dataset, (0..poses.len()).map(|p| vec![poses[p][0], p]).collect(), seed);
    drawn.iter().take(poses.len() / 2).for_each(|pose| side[pose[1]] = true);
    side
}

/// Alternate blocks of rows; those of the second pair are offset by half a block.
fn alternate(poses: &[Vec<usize>], n: usize, pair: usize) -> Vec<bool> {
    let block = |row: usize| ((2 * PIECES * row / n.max(1) + pair) / 2).is_multiple_of(2);
    poses.iter().map(|pose| block(pose[0])).collect()
}

/// Poses on the two sides of the median along the first principal component of the joint angles.
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
