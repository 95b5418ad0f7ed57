//! What a model leaves beyond the noise, as far as it is known.

use truegrind_arm::estimated::StageErrors;
use truegrind_calibration::identification::beyond_noise::BeyondNoise;
use truegrind_calibration::measurement::dataset::Sensor;
use truegrind_math::statistics::ErrorSummary;

/// Errors of this size (mm).
fn of_size(mm: f64) -> StageErrors {
    let errors = ErrorSummary::of([mm, -mm, mm, -mm]);
    StageErrors { fitted: errors, held_out: errors }
}

/// The bound of an arm without its play was that of all causes: below the held-out error that stood beside it.
#[test]
fn an_arm_that_lacks_a_cause_is_off_by_it() {
    let of = |own_mm, of_arm| {
        let all = BeyondNoise::AtMost(0.03);
        all.of_submodel(&of_size(0.03), &of_size(own_mm), Sensor::Position, of_arm)
    };
    let BeyondNoise::Between { least_mm, most_mm } = of(0.05, true) else { panic!() };
    assert!((least_mm - 0.04).abs() < 1e-12 && (most_mm - 0.05).abs() < 1e-12, "{least_mm}, {most_mm}");
    // What the sensor did is not the arm's, but may be.
    let BeyondNoise::AtMost(most_mm) = of(0.05, false) else { panic!() };
    assert!((most_mm - 0.05).abs() < 1e-12);
    assert_eq!(of(0.03, true), BeyondNoise::AtMost(0.03));
}

#[test]
fn rounding_of_the_log_is_no_error_of_the_arm() {
    let BeyondNoise::AtMost(mm) = BeyondNoise::AtMost(0.5).less_rounding(Some(0.4), Sensor::Position) else {
        panic!()
    };
    assert!((mm - 0.3).abs() < 1e-12, "{mm}");
    let all = BeyondNoise::AtMost(0.3).less_rounding(Some(0.4), Sensor::Position);
    assert_eq!(all, BeyondNoise::AtMost(0.0));
    assert_eq!(BeyondNoise::AtMost(0.3).less_rounding(None, Sensor::Cable), BeyondNoise::AtMost(0.3));
}

#[test]
fn a_scatter_that_is_seen_does_not_hide_what_else_may_be_left() {
    let left = BeyondNoise::AtMost(0.5).at_least_scatter(0.1);
    assert_eq!(left, BeyondNoise::Between { least_mm: 0.1, most_mm: 0.5 });
    assert_eq!(left.known_mm(), Some(0.1));
    assert_eq!(BeyondNoise::AtMost(0.5).at_least_scatter(0.0), BeyondNoise::AtMost(0.5));
    assert_eq!(BeyondNoise::Known(0.05).at_least_scatter(0.1), BeyondNoise::Known(0.1));
}
