//! The tests and their distributions against published tables and counts by hand.

use truegrind_math::distribution::{chi_square_quantile, ln_gamma, student_two_sided};
use truegrind_papers::statistics::{holm, resampled_t, signed_rank};

/// Differences whose smaller rank sum is `w`: the first pairs are negative as far as their ranks fit into w.
fn with_rank_sum(n: usize, w: usize) -> Vec<f64> {
    let mut left = w;
    let mut signs = vec![1.0; n];
    for rank in (1..=n).rev() {
        if rank <= left {
            signs[rank - 1] = -1.0;
            left -= rank;
        }
    }
    assert_eq!(left, 0);
    (1..=n).map(|rank| rank as f64 * signs[rank - 1]).collect()
}

/// Critical values of Wilcoxon's signed-rank test (Wilcoxon and Wilcox 1964, table 2; two-sided level): the largest sum
/// that is still significant. The next one must not be.
#[test]
fn signed_rank_agrees_with_the_published_critical_values() {
    let table = [
        (6, 0.05, 0),
        (7, 0.05, 2),
        (8, 0.05, 3),
        (9, 0.05, 5),
        (10, 0.05, 8),
        (11, 0.05, 10),
        (12, 0.05, 13),
        (15, 0.05, 25),
        (20, 0.05, 52),
        (25, 0.05, 89),
        (8, 0.01, 0),
        (10, 0.01, 3),
        (15, 0.01, 15),
        (20, 0.01, 37),
        (25, 0.01, 68),
    ];
    for (n, level, critical) in table {
        let at = signed_rank(&with_rank_sum(n, critical));
        assert_eq!((at.negative, at.pairs), (critical as f64, n));
        assert!(at.two_sided <= level, "n = {n}: p({critical}) = {}", at.two_sided);
        let next = signed_rank(&with_rank_sum(n, critical + 1));
        assert!(next.two_sided > level, "n = {n}: p({}) = {}", critical + 1, next.two_sided);
    }
}

#[test]
fn signed_rank_with_ties_and_zeros_is_what_counting_all_signs_gives() {
    let differences = [0.5, -0.5, 0.0, 1.5, 0.5, -2.0, 1.5, 0.0, 3.0];
    let test = signed_rank(&differences);
    assert_eq!((test.pairs, test.zeros), (7, 2));
    // Ranks by hand: three 0.5 share 2, two 1.5 share 4.5, then 6 and 7.
    let ranks = [2.0, 2.0, 2.0, 4.5, 4.5, 6.0, 7.0];
    assert_eq!(test.positive, 2.0 + 2.0 + 4.5 + 4.5 + 7.0);
    assert_eq!(test.negative, 2.0 + 6.0);
    let (mut above, mut extreme) = (0, 0);
    for signs in 0..1_u32 << 7 {
        let sum: f64 = (0..7).filter(|k| signs >> k & 1 == 1).map(|k| ranks[k]).sum();
        above += u32::from(sum >= test.positive);
        extreme += u32::from((sum - 14.0).abs() >= (test.positive - 14.0).abs());
    }
    assert!((test.one_sided_positive - f64::from(above) / 128.0).abs() < 1e-15);
    assert!((test.two_sided - f64::from(extreme) / 128.0).abs() < 1e-15);
}

#[test]
fn what_is_no_number_counts_as_worst_and_nothing_is_no_difference() {
    let test = signed_rank(&[-0.1, f64::NAN, f64::INFINITY]);
    assert_eq!((test.positive, test.negative), (5.0, 1.0));
    assert_eq!(signed_rank(&[0.0, 0.0]).two_sided, 1.0);
    assert_eq!(signed_rank(&[]).two_sided, 1.0);
}

#[test]
fn holm_by_hand() {
    let p = holm(&[0.01, 0.04, f64::NAN, 0.03, 0.005]);
    let expected = [0.03, 0.06, f64::NAN, 0.06, 0.02];
    for (p, e) in p.iter().zip(expected) {
        assert!((p.is_nan() && e.is_nan()) || (p - e).abs() < 1e-15, "{p} {e}");
    }
    assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
}

#[test]
fn distributions_agree_with_tables() {
    // Fisher and Yates; NIST/SEMATECH e-Handbook 1.3.6.7.
    for (freedom, t, p) in [
        (1.0, 12.706, 0.05),
        (2.0, 4.303, 0.05),
        (9.0, 2.262, 0.05),
        (9.0, 3.250, 0.01),
        (30.0, 2.042, 0.05),
        (120.0, 2.617, 0.01),
    ] {
        assert!((student_two_sided(t, freedom) - p).abs() < 5e-5, "t({freedom}) {t}");
    }
    assert!((student_two_sided(1.0, 1.0) - 0.5).abs() < 1e-14);
    for (freedom, x, p) in [
        (1, 3.841, 0.05),
        (5, 15.086, 0.01),
        (9, 16.919, 0.05),
        (20, 45.315, 0.001),
        (100, 124.342, 0.05),
        (6, 1.635, 0.95),
    ] {
        assert!((chi_square_quantile(p, freedom) - x).abs() < 1e-3, "χ²({freedom}) {p}");
    }
    // Two degrees of freedom: e^(−x/2).
    assert!((chi_square_quantile((-3.5_f64).exp(), 2) - 7.0).abs() < 1e-12);
    for n in 1..20 {
        let factorial: f64 = (1..n).map(f64::from).product();
        assert!((ln_gamma(f64::from(n)) - factorial.ln()).abs() < 1e-12 * (1.0 + factorial.ln()));
    }
    assert!((ln_gamma(0.5) - std::f64::consts::PI.sqrt().ln()).abs() < 1e-13);
}

#[test]
fn the_corrected_t_test_is_less_sure_than_the_plain_one() {
    let differences = [0.02, 0.03, 0.01, 0.025, 0.015, 0.03, 0.02, 0.01, 0.02, 0.022];
    let plain = resampled_t(&differences, 0.0);
    let corrected = resampled_t(&differences, 0.25);
    assert!(plain < corrected && corrected < 0.05);
    // By hand: mean 0.0202, s 0.0070993, t = 0.0202 / (s √(0.1 + 0.25)) = 4.8096, 9 degrees of freedom.
    assert!((corrected - student_two_sided(4.8096, 9.0)).abs() < 1e-5);
    assert_eq!(resampled_t(&[0.0; 4], 0.25), 1.0);
    assert!(resampled_t(&[0.1], 0.25).is_nan());
}
