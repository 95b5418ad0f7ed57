//! The arms are those that the tool knows, by another way of computing.

use truegrind_unseen::arms::{SHEETS, Strain};
use truegrind_unseen::draw::{Purpose, between, generator};
use truegrind_unseen::under_test::sheet_flange;

#[test]
fn the_flange_of_every_arm_is_the_tools_to_a_millionth_of_a_micrometre() {
    let mut rng = generator(1, 0, 0, 0, Purpose::Poses);
    for sheet in &SHEETS {
        for _ in 0..50 {
            let q = std::array::from_fn(|_| between(&mut rng, -3.0, 3.0));
            let ours = sheet.nominal().flange(&q, &Strain::default());
            let theirs = sheet_flange(sheet.name, &q).unwrap();
            assert!((ours.translation.vector - theirs.translation.vector).norm() < 1e-9, "{}", sheet.name);
            assert!(ours.rotation.angle_to(&theirs.rotation) < 1e-7, "{}", sheet.name);
        }
    }
}

/// The torque of gravity is minus the slope of the potential energy.
#[test]
fn torques_are_slopes_of_the_potential_energy() {
    let mut rng = generator(2, 0, 0, 0, Purpose::Poses);
    for sheet in &SHEETS {
        let arm = sheet.built(&mut rng);
        let energy = |q: &[f64; 6]| -> f64 {
            let frames = arm.frames(q, &Strain::default());
            (0..6)
                .map(|i| {
                    let at = frames[i + 1] * nalgebra::Point3::from(arm.centre[i]);
                    arm.kg[i] * 9.806_65e-3 * at.z
                })
                .sum()
        };
        let q: [f64; 6] = std::array::from_fn(|_| between(&mut rng, -2.0, 2.0));
        let torques = arm.torques(&q);
        for j in 0..6 {
            let (mut up, mut down) = (q, q);
            up[j] += 1e-5;
            down[j] -= 1e-5;
            let slope = (energy(&up) - energy(&down)) / 2e-5;
            assert!(
                (torques[j] + arm.sense[j] * slope).abs() < 1e-6,
                "{} joint {}: {} {slope}",
                sheet.name,
                j + 1,
                torques[j]
            );
        }
    }
}

/// A level beam with nothing beyond bends by w L⁴ / 8 E I, and its end leans by w L³ / 6 E I.
#[test]
fn a_level_beam_bends_as_the_textbook_has_it() {
    let sheet = &SHEETS[0];
    let mut arm = sheet.nominal();
    for i in 2..6 {
        arm.kg[i] = 0.0;
    }
    // Axis 2 at 90°: the upper arm points forwards, level.
    let q = [0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0];
    let (sag, slope) = arm.beam(&q, 1);
    let (length, weight) = (0.27_f64, 9.806_65 * arm.kg[1]);
    assert!((sag.norm() - 1e3 * weight * length.powi(3) / 8.0).abs() < 1e-9 * sag.norm());
    assert!((slope.norm() - weight * length.powi(2) / 6.0).abs() < 1e-9 * slope.norm());
    // Downwards in the room.
    let end = arm.frames(&q, &Strain::default())[2];
    assert!((end.rotation * sag).z < 0.0);
    // A point further out along the arm sinks by the lean as well.
    let further = (end.rotation * slope).cross(&nalgebra::Vector3::x());
    assert!(further.z < 0.0);
}
