//! Readings of one pose are one witness of what the model gets wrong there.
//!
//! What a model gets wrong at a pose is in every reading of that pose; only the sensor's noise is new in each. With variance b
//! from pose to pose and w from reading to reading, k readings say of the pose what one of variance b + w/k would: each counts with
//! 1/(1 + (k − 1) ρ), ρ = b/(b + w). Both variances are those of the residuals, b with the degrees of freedom that the poses have
//! when all parameters are paid for: with few poses a model that follows each of them leaves nothing between them, and that is no
//! proof of it. Where the model is right b is nothing, and each reading counts.
//!
//! Source: Kish 1965 (design effect); Henderson's third method for b and w.

use std::ops::Range;

use crate::measurement::dataset::Dataset;
use crate::measurement::split;

/// Repeated readings from which the noise from reading to reading is known.
const KNOWN: usize = 20;

/// Share of the poses' degrees of freedom that is left however many parameters there are.
const LEFT: f64 = 0.05;

/// Which rows are of one pose.
#[derive(Debug, Clone)]
pub(super) struct Repeated {
    pose_of_row: Vec<usize>,
    poses: usize,
}

/// Variances of whitened residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parts {
    /// From pose to pose.
    pub(super) between: f64,
    /// From reading to reading.
    pub(super) within: f64,
}

impl Parts {
    /// The whole standard deviation of a reading.
    pub(super) fn deviation(&self) -> f64 {
        (self.between + self.within).sqrt()
    }

    /// What one of so many readings of a pose counts.
    fn counts(&self, readings: f64) -> f64 {
        let shared = self.between / (self.between + self.within).max(f64::MIN_POSITIVE);
        1.0 / (1.0 + (readings - 1.0).max(0.0) * shared)
    }
}

impl Repeated {
    /// Of a data set; `None` where too few poses were read again.
    pub(super) fn of(dataset: &Dataset) -> Option<Self> {
        let pose_of_row = split::pose_of_rows(dataset);
        let poses = pose_of_row.iter().max().map_or(0, |p| p + 1);
        (pose_of_row.len() >= poses + KNOWN).then_some(Self { pose_of_row, poses })
    }

    /// The parts of residuals: `whitened` gives scalar `c` of row i, `share` how much a row counts, and `spent` parameters are
    /// paid for by the rows.
    pub(super) fn parts(
        &self,
        range: &Range<usize>,
        whitened: impl Fn(usize, usize) -> f64,
        share: &[f64],
        spent: f64,
    ) -> Parts {
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
        // Readings of a pose, as the sum of squares between poses sees them.
        let usual =
            (all - weight.iter().map(|w| w * w).sum::<f64>() / all) / (self.poses as f64 - 1.0).max(1.0);
        let between = ((between / free - within) / usual.max(1.0)).max(0.0);
        Parts { between, within }
    }

    /// What each row counts.
    pub(super) fn counts(&self, parts: &Parts) -> Vec<f64> {
        let mut readings = vec![0.0; self.poses];
        self.pose_of_row.iter().for_each(|&pose| readings[pose] += 1.0);
        self.pose_of_row.iter().map(|&pose| parts.counts(readings[pose])).collect()
    }
}
