//! Significance tests on paired figures: whether one of two methods is better on the same cases.
//!
//! - [`signed_rank`]: Wilcoxon's signed-rank test with its exact distribution, ties and zeros included. Its null
//!   hypothesis is that both signs of a difference are equally likely.
//! - [`resampled_t`]: the t test with the correction of Nadeau and Bengio for cases resampled from one set of rows. Such
//!   cases share rows, so their differences are not independent; tests that assume independence, the signed-rank test
//!   included, give too small p values.
//! - [`holm`]: p values corrected for multiple tests.
//!
//! **Source.** Wilcoxon 1945; Demšar, "Statistical comparisons of classifiers over multiple data sets", JMLR 7, 2006;
//! Nadeau and Bengio, "Inference for the generalization error", Machine Learning 52, 2003; Holm 1979.
//! **Checked against** the published tables of critical values and p values worked out by hand.

use serde::{Deserialize, Serialize};

use truegrind_math::distribution::student_two_sided;
use truegrind_math::statistics::mean_and_deviation;

/// Wilcoxon's signed-rank test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SignedRank {
    /// Number of pairs that differ.
    pub pairs: usize,
    /// Number of pairs without difference, which are omitted.
    pub zeros: usize,
    /// Sum of the ranks of positive differences.
    pub positive: f64,
    /// Sum of the ranks of negative differences.
    pub negative: f64,
    /// Probability of a sum at least this far from its mean, in either direction.
    pub two_sided: f64,
    /// Probability of a positive sum at least this large.
    pub one_sided_positive: f64,
}

/// The test on paired differences. NaN counts as the largest positive difference, so that a diverged method is the worse
/// one; ties share the mean of their ranks. Without a difference p is 1.
///
/// ```
/// use truegrind_papers::statistics::signed_rank;
/// // Nine differences of one sign: the smallest one-sided p that nine pairs can give is 1/512.
/// let test = signed_rank(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]);
/// assert_eq!(test.positive, 45.0);
/// assert!((test.one_sided_positive - 1.0 / 512.0).abs() < 1e-15);
/// ```
pub fn signed_rank(differences: &[f64]) -> SignedRank {
    let value = |d: &f64| if d.is_nan() { f64::INFINITY } else { *d };
    let mut values: Vec<f64> = differences.iter().map(value).filter(|d| *d != 0.0).collect();
    values.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = values.len();
    // Twice the ranks, so that shared ranks are integers.
    let mut ranks = vec![0_usize; n];
    let mut from = 0;
    while from < n {
        let mut to = from;
        while to + 1 < n && values[to + 1].abs() == values[from].abs() {
            to += 1;
        }
        ranks[from..=to].fill(from + to + 2);
        from = to + 1;
    }
    let total: usize = ranks.iter().sum();
    let positive: usize = ranks.iter().zip(&values).filter(|(_, v)| **v > 0.0).map(|(r, _)| r).sum();
    // Distribution of the sum if every sign has probability 1/2.
    let mut chance = vec![0.0; total + 1];
    chance[0] = 1.0;
    let mut reached = 0;
    for rank in &ranks {
        reached += rank;
        for sum in (0..=reached).rev() {
            let with = if sum >= *rank { chance[sum - rank] } else { 0.0 };
            chance[sum] = 0.5 * (chance[sum] + with);
        }
    }
    let above = |sum: usize| chance[sum..].iter().sum::<f64>().min(1.0);
    let extreme = positive.max(total - positive);
    SignedRank {
        pairs: n,
        zeros: differences.len() - n,
        positive: positive as f64 / 2.0,
        negative: (total - positive) as f64 / 2.0,
        two_sided: (2.0 * above(extreme)).min(1.0),
        one_sided_positive: above(positive),
    }
}

/// The two-sided p of the t test on differences over k cases resampled from the same rows, where `held_out` is the ratio
/// of held-out rows to training rows (0.25 for 80/20): the variance of the mean is (1/k + held_out) s². Returns 1 if all
/// differences are zero, NaN if a difference is NaN.
pub fn resampled_t(differences: &[f64], held_out: f64) -> f64 {
    let k = differences.len() as f64;
    if differences.len() < 2 {
        return f64::NAN;
    }
    let (mean, deviation) = mean_and_deviation(differences);
    if mean == 0.0 && deviation == 0.0 {
        return 1.0;
    }
    let t = mean / (deviation * (1.0 / k + held_out).sqrt());
    student_two_sided(t, k - 1.0)
}

/// Holm's correction: p values adjusted for multiple tests, to be compared with the level. NaN is returned as NaN and not
/// counted as a test.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).filter(|&i| !p[i].is_nan()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]).then(a.cmp(&b)));
    let mut out = vec![f64::NAN; p.len()];
    let mut largest = 0.0_f64;
    for (rank, &i) in order.iter().enumerate() {
        largest = largest.max(p[i] * (order.len() - rank) as f64).min(1.0);
        out[i] = largest;
    }
    out
}
