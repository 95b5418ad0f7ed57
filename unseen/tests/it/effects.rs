//! The effects are what they are said to be.

use nalgebra::Vector3;
use truegrind_unseen::arms::{SHEETS, Strain};
use truegrind_unseen::hidden::warmth::Warmth;
use truegrind_unseen::sensors::{catenary, drooped, on_drum, over_pulley, refracted};

/// Two exponentials that rise, fall in the pause and rise again, without a jump.
#[test]
fn warmth_rises_falls_in_the_pause_and_rises_again() {
    let course = Warmth { hours: [0.1, 1.0], quick: 0.5, pause: Some([1.0, 1.6]) };
    assert_eq!(course.at(0.0), 0.0);
    let by_hand = |t: f64| 0.5 * (1.0 - (-t / 0.1_f64).exp()) + 0.5 * (1.0 - (-t).exp());
    assert!((course.at(0.7) - by_hand(0.7)).abs() < 1e-12);
    assert!(
        course.at(1.3) < course.at(1.0) && course.at(1.6) < course.at(1.3) && course.at(2.0) > course.at(1.6)
    );
    for corner in [1.0, 1.6] {
        assert!((course.at(corner + 1e-9) - course.at(corner - 1e-9)).abs() < 1e-6);
    }
    assert!(course.at(1e3) > 0.999_999);
}

/// The wire goes from the entry along the rim and leaves it as a tangent: found again by unrolling it point by point.
#[test]
fn the_wire_over_a_pulley_is_as_long_as_when_laid_out_point_by_point() {
    let (away, radius): (Vector3<f64>, f64) = (Vector3::new(900.0, 300.0, 250.0), 20.0);
    let (out, up) = (away.x.hypot(away.y), away.z);
    // The shortest way around the rim from its near side: over all places where the wire may leave.
    let shortest = (0..400_000)
        .map(|k| {
            let place = std::f64::consts::PI * (1.0 - f64::from(k) / 400_000.0);
            let rim = (radius + radius * place.cos(), radius * place.sin());
            let free = (out - rim.0).hypot(up - rim.1);
            // Only tangents that leave outside of the rim are wires.
            let tangent = ((out - rim.0) * place.cos() + (up - rim.1) * place.sin()).abs() / free;
            (tangent, radius * (std::f64::consts::PI - place) + free)
        })
        .filter(|(tangent, _)| *tangent < 1e-5)
        .map(|(_, length)| length)
        .fold(f64::INFINITY, f64::min);
    assert!((over_pulley(&away, radius) - shortest).abs() < 1e-3, "{shortest}");
    assert!((over_pulley(&away, 1e-9) - away.norm()).abs() < 1e-6);
}

/// The slope of a drum grows by one share with each layer, without a jump.
#[test]
fn each_layer_of_a_drum_reads_shorter_by_one_more_share() {
    let at = |length: f64| on_drum(length, 300.0, 1e-3);
    for (from, to, slope) in [(10.0, 290.0, 0.0), (310.0, 590.0, 1e-3), (610.0, 890.0, 2e-3)] {
        assert!(((at(to) - at(from)) / (to - from) - slope).abs() < 1e-12);
    }
    assert!((at(600.0 + 1e-9) - at(600.0 - 1e-9)).abs() < 1e-9);
}

/// The catenary, by adding up short pieces of the curve.
#[test]
fn a_catenary_is_as_long_as_its_pieces() {
    let away = Vector3::new(1500.0, 800.0, 400.0);
    let weight = 0.08;
    let (level, up) = (1.7_f64, 0.4_f64);
    let chord = level.hypot(up);
    let c = (level / chord) / weight;
    // y = c cosh((x − m)/c), with m so that the ends differ by `up`.
    let rise = |m: f64| c * ((level - m) / c).cosh() - c * (m / c).cosh();
    let (mut low, mut high) = (-40.0, 40.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if rise(middle) > up { low = middle } else { high = middle }
    }
    let n = 200_000;
    let y = |k: i32| c * ((level * f64::from(k) / f64::from(n) - low) / c).cosh();
    let length: f64 = (0..n).map(|k| (level / f64::from(n)).hypot(y(k + 1) - y(k))).sum();
    assert!((catenary(&away, weight, 0.0) - 1e3 * (length - chord)).abs() < 1e-4);
}

/// In air with one gradient a beam is a circle: it strays by κ R² / 2.
#[test]
fn a_beam_in_evenly_layered_air_is_a_circle() {
    let to = Vector3::new(5000.0, 0.0, 0.0);
    let strayed = refracted(&Vector3::zeros(), &to, 2.0, 1e12);
    assert!((strayed - 1e3 * 0.5 * 0.93e-6 * 2.0 * 25.0).abs() < 1e-9, "{strayed}");
}

/// The end of a pole sags across it, most where it is level, and turns downwards.
#[test]
fn a_pole_sags_across_and_its_end_turns_downwards() {
    let down = -Vector3::z();
    let pole = Vector3::new(80.0, 0.0, 0.0);
    let (sag, turn) = drooped(&down, &pole, 0.2, 0.3);
    assert!((sag - down * 0.2).norm() < 1e-12 && (turn.y - 1.5 * 0.2 / 80.0).abs() < 1e-12);
    assert!((turn.cross(&pole).normalize() - down).norm() < 1e-12);
    assert!(drooped(&down, &Vector3::z(), 0.2, 0.3).0.norm() < 1e-12);
    let (sag, _) = drooped(&down, &Vector3::new(60.0, 0.0, 60.0), 0.2, 0.0);
    assert!(sag.dot(&Vector3::new(1.0, 0.0, 1.0)).abs() < 1e-12 && sag.z < 0.0);
}

/// What overturns an arm is about its second axis what the torque of that joint is, but for what does not move with it.
#[test]
fn an_arm_overturns_as_its_second_joint_bears() {
    for sheet in &SHEETS {
        let arm = sheet.nominal();
        let beside = |q2: f64, q3: f64| {
            let q = [0.4, q2, q3, 0.3, 0.5, 0.2];
            let axis = arm.frames(&q, &Strain::default())[1].rotation * Vector3::z();
            axis.dot(&arm.overturning(&q, 0.0)) - arm.torques(&q)[1]
        };
        assert!((beside(0.3, 0.8) - beside(-0.7, 0.1)).abs() < 1e-9, "{}", sheet.name);
        assert!(arm.overturning(&[0.4, 0.3, 0.8, 0.3, 0.5, 0.2], 1.0).z.abs() < 1e-12);
    }
}
