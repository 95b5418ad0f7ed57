//! Significance of the differences between methods, and whether early stopping is their cause.
//!
//! Every method is compared with one reference, case by case, on the same rows. A difference is significant if both tests
//! find it at 5 % after Holm's correction over all comparisons: the exact signed-rank test, and the t test corrected for
//! cases that share rows ([`statistics`](crate::statistics)). The second is needed because the first assumes independent
//! cases, which cases drawn from one file are not.
//!
//! Two least-squares methods whose converged errors agree to a thousandth in every case have the same optimum: an earlier
//! difference is due to stopping one of them.

use serde::Serialize;

use crate::protocol::outcome::{MethodResult, Outcome};
use crate::statistics::{SignedRank, holm, resampled_t, signed_rank};
use truegrind_math::statistics::median;

/// Significance level of the tests.
pub const LEVEL: f64 = 0.05;

/// Errors that agree to this share in every case count as the same.
pub const SAME: f64 = 1e-3;

/// All comparisons with the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Id of the reference.
    pub reference: String,
    /// Number of cases.
    pub cases: usize,
    /// Whether a significant difference is possible at all with this number of cases.
    pub can_be_significant: bool,
    /// One comparison for each other method.
    pub comparisons: Vec<Comparison>,
}

/// A method against the reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Id of the method.
    pub id: String,
    /// Both under the experiment's limits.
    pub limited: Test,
    /// Both continued to convergence; absent if one is no least-squares method.
    pub converged: Option<Test>,
    /// Conclusion.
    pub conclusion: Conclusion,
}

/// Differences of an error (for methods the held-out RMSE), method minus reference: positive if the reference is better.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Test {
    /// Mean difference (mm).
    pub mean_mm: f64,
    /// Median difference (mm).
    pub median_mm: f64,
    /// Largest difference as a share of the smaller error.
    pub largest_share: f64,
    /// Number of cases in which the reference was better.
    pub reference_better: usize,
    /// Number of cases in which the method was better.
    pub method_better: usize,
    /// Wilcoxon's test.
    pub signed_rank: SignedRank,
    /// Its two-sided p after Holm's correction.
    pub signed_rank_holm: f64,
    /// p of the corrected t test.
    pub resampled: f64,
    /// p of the corrected t test after Holm's correction.
    pub resampled_holm: f64,
}

impl Test {
    /// Whether both tests find a significant difference.
    pub fn is_significant(&self) -> bool {
        self.signed_rank_holm < LEVEL && self.resampled_holm < LEVEL
    }
}

/// Conclusion for one pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "is", rename_all = "kebab-case")]
pub enum Conclusion {
    /// The reference is significantly better.
    ReferenceBetter,
    /// The method is significantly better.
    MethodBetter,
    /// No significant difference.
    NotSignificant,
    /// The same optimum: the methods in `stopped` were stopped before they reached it.
    SameOptimum {
        /// Ids of the methods that had not converged when they were stopped.
        stopped: Vec<String>,
        /// Whether the difference under the experiment's limits was significant.
        was_significant: bool,
    },
    /// The method diverged in some cases.
    Diverged {
        /// In how many.
        cases: usize,
    },
    /// The reference diverged in some cases, so nothing can be compared with it.
    ReferenceDiverged {
        /// In how many.
        cases: usize,
    },
}

/// Compares every method with the reference. `held_out` is the ratio of held-out rows to training rows.
pub fn judge(results: &[MethodResult], reference: &str, held_out: f64) -> Judgement {
    let Some(of) = results.iter().find(|r| r.method.id == reference) else {
        return Judgement {
            reference: reference.to_owned(),
            cases: 0,
            can_be_significant: false,
            comparisons: Vec::new(),
        };
    };
    let cases = of.outcomes.len();
    let others: Vec<&MethodResult> = results.iter().filter(|r| r.method.id != reference).collect();
    let rmse = |outcomes: &[Outcome]| -> Vec<f64> { outcomes.iter().map(|o| o.held_out.rmse).collect() };
    let reference_rmse = rmse(&of.outcomes);
    let limited = paired(
        &reference_rmse,
        &others.iter().map(|r| Some(rmse(&r.outcomes))).collect::<Vec<_>>(),
        held_out,
    );
    let converged = paired(
        &of.converged.as_deref().map(rmse).unwrap_or_default(),
        &others
            .iter()
            .map(|r| of.converged.as_ref().and(r.converged.as_deref()).map(rmse))
            .collect::<Vec<_>>(),
        held_out,
    );
    // Smallest possible p: two-sided, all cases of one sign, corrected for all comparisons.
    let smallest = 2.0_f64 * 0.5_f64.powi(cases as i32) * others.len().max(1) as f64;
    let comparisons = others
        .iter()
        .zip(limited)
        .zip(converged)
        .filter_map(|((result, limited), converged)| {
            let limited = limited?;
            let conclusion = conclude(result, of, &limited, converged.as_ref());
            Some(Comparison { id: result.method.id.clone(), limited, converged, conclusion })
        })
        .collect();
    Judgement { reference: reference.to_owned(), cases, can_be_significant: smallest < LEVEL, comparisons }
}

fn conclude(
    result: &MethodResult,
    reference: &MethodResult,
    limited: &Test,
    converged: Option<&Test>,
) -> Conclusion {
    let diverged = |r: &MethodResult| r.outcomes.iter().filter(|o| o.diverged).count();
    if diverged(result) > 0 {
        return Conclusion::Diverged { cases: diverged(result) };
    }
    if diverged(reference) > 0 {
        return Conclusion::ReferenceDiverged { cases: diverged(reference) };
    }
    if let Some(converged) = converged
        && converged.largest_share < SAME
    {
        let stopped =
            [result, reference].into_iter().filter(|r| was_stopped(r)).map(|r| r.method.id.clone()).collect();
        return Conclusion::SameOptimum { stopped, was_significant: limited.is_significant() };
    }
    match (limited.is_significant(), limited.mean_mm > 0.0) {
        (false, _) => Conclusion::NotSignificant,
        (true, true) => Conclusion::ReferenceBetter,
        (true, false) => Conclusion::MethodBetter,
    }
}

/// Whether a method was stopped before it converged.
fn was_stopped(result: &MethodResult) -> bool {
    let Some(converged) = &result.converged else { return false };
    result.outcomes.iter().zip(converged).any(|(a, b)| !(share(a.held_out.rmse, b.held_out.rmse) < SAME))
}

fn share(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / a.min(b) }
}

/// Compares each of `others` with `reference`, case by case, Holm-corrected over all of them. `held_out` is the ratio of
/// held-out rows to training rows. `None` where there is nothing to compare.
pub fn paired(reference: &[f64], others: &[Option<Vec<f64>>], held_out: f64) -> Vec<Option<Test>> {
    let mut tests: Vec<Option<Test>> =
        others.iter().map(|other| Some(test(other.as_ref()?, reference, held_out))).collect();
    let ranks = holm(
        &tests.iter().map(|t| t.as_ref().map_or(f64::NAN, |t| t.signed_rank.two_sided)).collect::<Vec<_>>(),
    );
    let ts = holm(&tests.iter().map(|t| t.as_ref().map_or(f64::NAN, |t| t.resampled)).collect::<Vec<_>>());
    for ((test, rank), t) in tests.iter_mut().zip(ranks).zip(ts) {
        if let Some(test) = test {
            (test.signed_rank_holm, test.resampled_holm) = (rank, t);
        }
    }
    tests
}

fn test(method: &[f64], reference: &[f64], held_out: f64) -> Test {
    let pairs = || method.iter().zip(reference).map(|(m, r)| (*m, *r));
    let differences: Vec<f64> = pairs().map(|(m, r)| m - r).collect();
    let shares = pairs().map(|(m, r)| share(m, r));
    Test {
        mean_mm: differences.iter().sum::<f64>() / differences.len().max(1) as f64,
        median_mm: median(&differences).unwrap_or(f64::NAN),
        largest_share: shares.fold(0.0, |most, s| if s.is_nan() { f64::INFINITY } else { most.max(s) }),
        reference_better: differences.iter().filter(|d| !(**d <= 0.0)).count(),
        method_better: differences.iter().filter(|d| **d < 0.0).count(),
        signed_rank: signed_rank(&differences),
        signed_rank_holm: f64::NAN,
        resampled: resampled_t(&differences, held_out),
        resampled_holm: f64::NAN,
    }
}
