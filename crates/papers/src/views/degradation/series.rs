//! Shared by the tables and plots of a degrading arm.

use crate::degradation::{DegradationResult, Step};

pub(super) const SIMULATED: &str = "simulated degradation";

/// The numbers of poses of the runs, each once.
pub(super) fn pose_counts(result: &DegradationResult) -> Vec<usize> {
    let mut counts: Vec<usize> = result.runs.iter().map(|j| j.count).collect();
    counts.dedup();
    counts
}

pub(super) fn after_of(step: &Step) -> f64 {
    step.verification_after_mm
}
