//! Compares every calibration method with RLS on the same poses, paired over the simulated arms.
//!
//! The arms are drawn independently, as Wilcoxon's test assumes; p is Holm-corrected over all comparisons. A
//! difference below 2 % of the error counts as negligible even if it is significant.

use serde::Serialize;

use super::strategy_run::{Run, Strategy};
use crate::statistics::{holm, signed_rank};
use crate::verdict::LEVEL;

/// Differences below this share of RLS's error are negligible.
pub(super) const SAME: f64 = 0.02;

/// One method against RLS.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AgainstRls {
    /// The method.
    #[serde(rename = "way")]
    pub strategy: Strategy,
    /// Poses of each group that both use.
    pub count: usize,
    /// Mean difference of the error after calibration, method minus RLS (mm).
    pub mean_mm: f64,
    /// Arms on which RLS was better.
    pub rls_better: usize,
    /// Number of arms.
    pub arms: usize,
    /// Two-sided p of Wilcoxon's test after Holm's correction.
    pub p: f64,
    /// Conclusion.
    pub outcome: Outcome,
}

/// Conclusion for one pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// RLS has the smaller error.
    RlsBetter,
    /// The other method has the smaller error.
    #[serde(rename = "way-better")]
    StrategyBetter,
    /// The difference is below 2 % of the error.
    Same,
    /// No significant difference.
    NotSignificant,
}

pub(super) fn against_rls(runs: &[Run]) -> Vec<AgainstRls> {
    let mut out: Vec<AgainstRls> = runs
        .iter()
        .filter(|j| j.strategy != Strategy::Rls)
        .filter_map(|j| {
            let rls = runs.iter().find(|r| r.strategy == Strategy::Rls && r.count == j.count)?;
            let differences: Vec<f64> = j.arms_mm.iter().zip(&rls.arms_mm).map(|(a, b)| a - b).collect();
            let arms = differences.len();
            let mean_mm = differences.iter().sum::<f64>() / arms.max(1) as f64;
            let error = rls.arms_mm.iter().sum::<f64>() / arms.max(1) as f64;
            let outcome = match mean_mm {
                d if d.abs() < SAME * error => Outcome::Same,
                d if d < 0.0 => Outcome::StrategyBetter,
                // Also for NaN.
                _ => Outcome::RlsBetter,
            };
            Some(AgainstRls {
                strategy: j.strategy,
                count: j.count,
                mean_mm,
                rls_better: differences.iter().filter(|d| !(**d <= 0.0)).count(),
                arms,
                p: signed_rank(&differences).two_sided,
                outcome,
            })
        })
        .collect();
    let corrected = holm(&out.iter().map(|a| a.p).collect::<Vec<_>>());
    for (one, p) in out.iter_mut().zip(corrected) {
        one.p = p;
        if one.outcome != Outcome::Same && !(p < LEVEL) {
            one.outcome = Outcome::NotSignificant;
        }
    }
    out
}
