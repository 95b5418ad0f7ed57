use proptest::prelude::*;
use truegrind_report::number::Precision::{Decimals, Significant};

#[test]
fn decimals_are_fixed_and_zero_has_no_sign() {
    let shown: Vec<String> = [1.0, -0.0, -0.0004, 1234.5678, f64::NAN, f64::INFINITY, f64::NEG_INFINITY]
        .iter()
        .map(|value| Decimals(3).format(*value))
        .collect();
    assert_eq!(shown, ["1.000", "0.000", "0.000", "1234.568", "–", "∞", "-∞"]);
}

#[test]
fn significant_digits_over_many_magnitudes() {
    let cases = [
        (0.0, "0"),
        (9.996, "10.0"),
        (0.00012345, "0.000123"),
        (0.000012345, "1.23e-5"),
        (123456.0, "123456"),
        (12345678.0, "1.23e7"),
        (-0.0505, "-0.0505"),
        (5e-324, "4.94e-324"),
        (f64::MAX, "1.80e308"),
    ];
    for (value, shown) in cases {
        assert_eq!(Significant(3).format(value), shown);
    }
}

#[test]
fn value_ends_where_its_sigma_ends() {
    let cases = [
        (1.27042, 0.0213, "1.270 ± 0.021"),
        (1.27042, 0.0996, "1.27 ± 0.10"),
        (-290.04, 12.3, "-290 ± 12"),
        (0.0, 0.001, "0.0000 ± 0.0010"),
        (1.5e-7, 2.0e-8, "(1.50 ± 0.20)e-7"),
        (3.2e9, 1.1e8, "(3.20 ± 0.11)e9"),
        (1.0, 0.0, "1.000 ± 0"),
        (1.0, f64::NAN, "1.000 ± –"),
        (1.0, f64::INFINITY, "1.000 ± ∞"),
    ];
    for (value, sigma, shown) in cases {
        assert_eq!(Significant(2).format_with_sigma(value, sigma), shown);
    }
}

proptest! {
    /// Half a unit of the last digit shown is the largest error, for every finite number.
    #[test]
    fn significant_digits_are_right(value in proptest::num::f64::NORMAL, digits in 1usize..9) {
        let shown: f64 = Significant(digits).format(value).parse().unwrap();
        prop_assert!(((shown - value) / value).abs() <= 0.5000001 * 10f64.powi(1 - digits as i32));
    }

    #[test]
    fn any_pair_can_be_shown(value in proptest::num::f64::ANY, sigma in proptest::num::f64::ANY) {
        for precision in [Decimals(3), Significant(2)] {
            prop_assert!(precision.format_with_sigma(value, sigma).contains('±'));
        }
    }
}
