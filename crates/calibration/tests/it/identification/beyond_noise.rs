//! What a model leaves beyond the noise, as far as it is known.

use truegrind_calibration::identification::beyond_noise::BeyondNoise;

#[test]
fn a_scatter_that_is_seen_does_not_hide_what_else_may_be_left() {
    let left = BeyondNoise::AtMost(0.5).or_scatter(0.1);
    assert_eq!(left, BeyondNoise::Between { least_mm: 0.1, most_mm: 0.5 });
    assert_eq!(left.known_mm(), Some(0.1));
    assert_eq!(BeyondNoise::AtMost(0.5).or_scatter(0.0), BeyondNoise::AtMost(0.5));
    assert_eq!(BeyondNoise::Known(0.05).or_scatter(0.1), BeyondNoise::Known(0.1));
}
