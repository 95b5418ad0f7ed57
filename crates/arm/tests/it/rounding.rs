//! Rounding, against the standard library.

use truegrind_math::rounding::round;

#[test]
fn rounds_as_the_standard_library_does_bit_by_bit() {
    let edges = [
        0.0,
        0.5,
        1.5,
        2.5,
        0.499_999_999_999_999_94,
        0.500_000_000_000_000_1,
        1e15 + 0.5,
        2f64.powi(52) - 0.5,
    ];
    let far =
        [2f64.powi(51) + 0.5, 2f64.powi(52), 2f64.powi(53) + 2.0, 1e300, f64::INFINITY, f64::MIN_POSITIVE];
    let spread = (0..100_000_u64).map(|k| f64::from_bits(k.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
    let near = (0..100_000).map(|k| f64::from(k) * 0.25 + 1e-11);
    for value in edges.into_iter().chain(far).chain(spread.filter(|value| !value.is_nan())).chain(near) {
        for value in [value, -value] {
            assert_eq!(round(value).to_bits(), value.round().to_bits(), "{value:e}");
        }
    }
    assert!(round(f64::NAN).is_nan());
}
