//! Design effect of repeated poses: readings of one pose share its model error (a random effect of the pose).
//!
//! With variance b between poses and w within a pose, k readings of a pose are equivalent to one of variance b + w/k: each counts
//! 1/(1 + (k − 1) ρ), ρ = b/(b + w) the intraclass correlation. Both are estimated from the residuals, b with the degrees of freedom
//! of the poses less the fitted parameters: a flexible model of few poses leaves no variance between them, which does not prove the
//! model. For a correct model b = 0, and every reading counts fully.
//!
//! Source: Kish 1965 (design effect); Henderson's third method for b and w.

use std::ops::Range;

use crate::measurement::dataset::Dataset;
use crate::measurement::repeated_poses::pose_of_rows;

/// Fewest repeated readings for an estimate of the variance within poses.
const KNOWN: usize = 20;

/// Smallest assumed share of the poses' degrees of freedom after the parameters are fitted.
const LEFT: f64 = 0.05;

/// The pose of each row.
#[derive(Debug, Clone)]
pub(super) struct RepeatedPoses {
    pose_of_row: Vec<usize>,
    poses: usize,
}

/// Variance components of whitened residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VarianceComponents {
    /// Between poses.
    pub(super) between: f64,
    /// Within poses.
    pub(super) within: f64,
}

impl VarianceComponents {
    /// Total standard deviation of a reading.
    pub(super) fn deviation(&self) -> f64 {
        (self.between + self.within).sqrt()
    }

    /// Effective weight of one of `readings` readings of a pose.
    fn effective_weight(&self, readings: f64) -> f64 {
        let shared = self.between / (self.between + self.within).max(f64::MIN_POSITIVE);
        1.0 / (1.0 + (readings - 1.0).max(0.0) * shared)
    }
}

impl RepeatedPoses {
    /// The poses of a data set; `None` for too few repeated readings.
    pub(super) fn of(dataset: &Dataset) -> Option<Self> {
        let pose_of_row = pose_of_rows(dataset);
        let poses = pose_of_row.iter().max().map_or(0, |p| p + 1);
        (pose_of_row.len() >= poses + KNOWN).then_some(Self { pose_of_row, poses })
    }

    /// Variance components of residuals: `whitened` gives scalar `c` of row i, `share` is the weight of a row, and `spent` the effective
    /// number of fitted parameters.
    pub(super) fn components(
        &self,
        range: &Range<usize>,
        whitened: impl Fn(usize, usize) -> f64,
        share: &[f64],
        spent: f64,
    ) -> VarianceComponents {
        let rows = self.pose_of_row.len();
        let mut weight = vec![0.0; self.poses];
        (0..rows).for_each(|i| weight[self.pose_of_row[i]] += share[i]);
        let (mut within, mut between) = (0.0, 0.0);
        for c in range.clone() {
            let mut mean = vec![0.0; self.poses];
            for i in 0..rows {
                let pose = self.pose_of_row[i];
                mean[pose] += share[i] * whitened(i, c) / weight[pose].max(f64::MIN_POSITIVE);
            }
            within += (0..rows)
                .map(|i| share[i] * (whitened(i, c) - mean[self.pose_of_row[i]]).powi(2))
                .sum::<f64>();
            between += mean.iter().zip(&weight).map(|(m, w)| w * m * m).sum::<f64>();
        }
        let scalars = range.len() as f64;
        let all: f64 = weight.iter().sum();
        let free = (self.poses as f64 * scalars - spent).max(LEFT * self.poses as f64 * scalars);
        let within = within / ((rows - self.poses) as f64 * scalars);
        // Effective number of readings per pose in the sum of squares between poses.
        let usual =
            (all - weight.iter().map(|w| w * w).sum::<f64>() / all) / (self.poses as f64 - 1.0).max(1.0);
        let between = ((between / free - within) / usual.max(1.0)).max(0.0);
        VarianceComponents { between, within }
    }

    /// The effective weight of each row.
    pub(super) fn effective_weights(&self, components: &VarianceComponents) -> Vec<f64> {
        let mut readings = vec![0.0; self.poses];
        self.pose_of_row.iter().for_each(|&pose| readings[pose] += 1.0);
        self.pose_of_row.iter().map(|&pose| components.effective_weight(readings[pose])).collect()
    }
}
