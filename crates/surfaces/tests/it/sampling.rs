use truegrind_surfaces::sampling::{scallop_mm, step_over_mm};

/// The cusp between two balls on a circle of curvature k, by looking: the lowest point of the hull left between
/// their centres.
fn looked_at(step: f64, radius: f64, k: f64) -> f64 {
    // Surface: y = 0, or a circle of radius 1/|k| through the origin, rounded up (k > 0) or hollow (k < 0). Arc
    // length s from the middle.
    let surface = |s: f64| {
        if k == 0.0 {
            ([s, 0.0], [0.0, 1.0])
        } else {
            ([(k * s).sin() / k, ((k * s).cos() - 1.0) / k], [(k * s).sin(), (k * s).cos()])
        }
    };
    let ball = |s: f64| {
        let (p, n) = surface(s);
        [p[0] + radius * n[0], p[1] + radius * n[1]]
    };
    let (a, b) = (ball(-0.5 * step), ball(0.5 * step));
    // Material above the middle of the surface is left up to where the first ball begins: straight up from the origin.
    let left = |h: f64| (0.0_f64 - a[0]).hypot(h - a[1]) >= radius && (0.0 - b[0]).hypot(h - b[1]) >= radius;
    let (mut low, mut high) = (0.0, radius);
    assert!(left(low) && !left(high));
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if left(middle) { low = middle } else { high = middle }
    }
    low
}

#[test]
fn the_cusp_between_two_passes_has_the_stated_height() {
    for radius in [3.0, 10.0, 25.0] {
        for scallop in [0.001, 0.02, 0.3] {
            for k in [0.0, 1e-12, 1.0 / 400.0, 1.0 / 30.0, 0.2, -1.0 / 400.0, -1.0 / 60.0, -1.0 / 26.0] {
                let step = step_over_mm(scallop, radius, k).unwrap();
                let cusp = looked_at(step, radius, k);
                assert!((cusp - scallop).abs() < 1e-9, "R {radius}, h {scallop}, k {k}: {cusp}");
                let back = scallop_mm(step, radius, k).unwrap();
                assert!((back - scallop).abs() < 1e-9, "R {radius}, h {scallop}, k {k}: {back}");
            }
        }
    }
}

#[test]
fn a_rounded_surface_wants_closer_passes_and_a_hollow_wider_ones() {
    let step = |k| step_over_mm(0.01, 10.0, k).unwrap();
    assert!((step(0.0) - (8.0_f64 * 10.0 * 0.01).sqrt()).abs() < 1e-3);
    assert!(step(0.05) < step(0.0) && step(0.0) < step(-0.05));
    assert!((step(1e-7) - step(0.0)).abs() < 1e-5 && (step(-1e-7) - step(0.0)).abs() < 1e-5);
}

#[test]
fn what_has_no_step_over_has_none() {
    assert_eq!(step_over_mm(0.01, 10.0, -0.1), None);
    assert_eq!(step_over_mm(0.01, 10.0, -0.2), None);
    assert_eq!(step_over_mm(10.0, 10.0, 0.0), None);
    assert_eq!(step_over_mm(0.0, 10.0, 0.0), None);
    assert_eq!(step_over_mm(f64::NAN, 10.0, 0.0), None);
    assert_eq!(scallop_mm(20.0, 10.0, 0.0), None);
}
