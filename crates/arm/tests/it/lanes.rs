//! Tests of `math::lanes`.

use rand::RngExt;
use truegrind_math::lanes::{Lanes, Real, WIDTH, sin_cos, vectorised};

use super::arms::generator;

/// Distance in units in the last place of a number of the size of `scale`.
fn ulps(a: f64, b: f64) -> f64 {
    (a - b).abs() / (f64::EPSILON * b.abs().max(f64::MIN_POSITIVE))
}

fn arguments() -> Vec<f64> {
    let mut random = generator(11);
    let mut out = vec![0.0, -0.0, 1e-300, -1e-20, 1e-8, 0.5, 1.0, -1.0, 3.0, 99_999.0, -99_999.9];
    for k in -200..=200 {
        let x = f64::from(k) * std::f64::consts::FRAC_PI_4;
        out.extend([x, x.next_up(), x.next_down()]);
    }
    out.extend((0..20_000).map(|_| random.random_range(-10.0..10.0)));
    out.extend((0..5_000).map(|_| random.random_range(-1e5..1e5)));
    out
}

#[test]
fn sine_and_cosine_agree_with_the_standard_library() {
    for x in arguments() {
        let ((s, c), (sine, cosine)) = (sin_cos(x), x.sin_cos());
        // Near a zero of the function the reduction's absolute error counts, which grows with the argument.
        let absolute = 1e-25 * x.abs() + 3e-33;
        assert!(ulps(s, sine) <= 2.0 || (s - sine).abs() <= absolute, "sin {x}: {s} instead of {sine}");
        assert!(ulps(c, cosine) <= 2.0 || (c - cosine).abs() <= absolute, "cos {x}: {c} instead of {cosine}");
    }
}

#[test]
fn what_has_no_short_reduction_goes_through_the_standard_library() {
    for x in [1e5, -1e6, 1e9, 1e22, f64::MAX, f64::MIN] {
        assert_eq!(sin_cos(x), x.sin_cos());
    }
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (s, c) = sin_cos(x);
        assert!(s.is_nan() && c.is_nan());
    }
}

#[test]
fn eight_sines_at_once_are_the_bits_of_eight_sines() {
    let mut values = arguments();
    // Odd values spoil only their own lane, wherever they stand.
    for (k, odd) in [f64::NAN, f64::INFINITY, 1e6, 1e300, f64::NEG_INFINITY].into_iter().enumerate() {
        values.insert(100 + 9 * k, odd);
    }
    for from in (0..values.len()).step_by(WIDTH) {
        let (s, c) = vectorised(|| sin_cos(Lanes::load(&values, from)));
        for (k, &x) in values[from..].iter().take(WIDTH).enumerate() {
            let one = sin_cos(x);
            assert_eq!((s.0[k].to_bits(), c.0[k].to_bits()), (one.0.to_bits(), one.1.to_bits()), "{x}");
        }
    }
}

#[test]
fn a_short_column_repeats_its_last_value() {
    let column = [1.0, 2.0, 3.0];
    assert_eq!(Lanes::load(&column, 1).0, [2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0]);
    assert_eq!(Lanes::load(&column, 5).0, [3.0; WIDTH]);
    assert_eq!(Lanes::load(&[], 0).0, [0.0; WIDTH]);
}

#[test]
fn arithmetic_in_lanes_is_arithmetic_of_each_lane() {
    let a = Lanes(std::array::from_fn(|k| 0.3 + k as f64));
    let b = Lanes(std::array::from_fn(|k| -1.7 + 0.9 * k as f64));
    for k in 0..WIDTH {
        let (x, y) = (a.0[k], b.0[k]);
        assert_eq!((a + b).0[k], x + y);
        assert_eq!((a - b).0[k], x - y);
        assert_eq!((a * b).0[k], x * y);
        assert_eq!((a / b).0[k], x / y);
        assert_eq!((-a).0[k], -x);
        assert_eq!(a.sqrt().0[k], x.sqrt());
        assert_eq!(b.within(2.0).0[k], y.within(2.0));
        assert_eq!(b.positive().0[k], y.positive());
    }
    assert_eq!(b.max_abs(), b.0[WIDTH - 1]);
    assert_eq!((f64::NAN.within(1.0), f64::NAN.positive(), 0.0.positive()), (0.0, 0.0, 0.0));
}
