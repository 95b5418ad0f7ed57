//! The colour map and its scale.

use truegrind_pictures::colour::{STEPS, Scale, map};

/// Lightness L* of a colour (CIE 1976, D65).
fn lightness([r, g, b, _]: [u8; 4]) -> f64 {
    let linear = |c: u8| {
        let c = f64::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let y = 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b);
    if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
}

/// Told apart in grey too: lightness rises, by steps of much the same size.
#[test]
fn lightness_rises_evenly() {
    let steps: Vec<f64> = (0..STEPS).map(|k| lightness(map(k as f64 / (STEPS - 1) as f64))).collect();
    let rises: Vec<f64> = steps.windows(2).map(|w| w[1] - w[0]).collect();
    let mean = (steps[STEPS - 1] - steps[0]) / (STEPS - 1) as f64;
    assert!(mean > 1.5, "{mean}");
    assert!(rises.iter().all(|r| *r > 0.6 * mean && *r < 1.5 * mean), "{rises:?}");
}

#[test]
fn scale_ends_at_a_round_figure_above_all() {
    for (largest, top) in [(0.37, 0.5), (0.5, 0.5), (1.01, 2.0), (2.2, 2.5), (7.3, 10.0), (0.0031, 0.005)] {
        assert!((Scale::over([0.0, largest, f64::NAN]).top_mm / top - 1.0).abs() < 1e-12, "{largest}");
    }
    assert_eq!(Scale::over([]).top_mm, 1.0);
    assert_eq!(Scale::over([0.0]).top_mm, 1.0);
}

#[test]
fn every_size_has_a_step() {
    let scale = Scale { top_mm: 2.0 };
    assert_eq!((scale.step(0.0), scale.step(2.0), scale.step(9.0)), (0, STEPS - 1, STEPS - 1));
    assert_eq!(scale.step(f64::NAN), 0);
    assert_ne!(scale.of(f64::NAN), scale.of(0.0));
    assert_eq!(map(-1.0), map(0.0));
    assert_eq!(map(7.0), [0xfd, 0xe7, 0x25, 255]);
}
