//! Tests of `math::se3`.

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use truegrind_math::difference::jacobian;
use truegrind_math::se3::{
    Pose, angle_bound_rad, apply_twist, difference, left_jacobian, pose_from_vector, rotation_from_matrix,
    skew, vector_from_pose,
};

use super::arms::{even, generator};

fn vector(random: &mut rand_chacha::ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * even(random))
}

fn pose(random: &mut rand_chacha::ChaCha8Rng) -> Pose {
    Pose::new(vector(random, 1000.0), vector(random, 1.7))
}

#[test]
fn moving_by_the_difference_arrives() {
    let mut random = generator(21);
    for _ in 0..1000 {
        let (from, to) = (pose(&mut random), pose(&mut random));
        let error = difference(&apply_twist(&from, &difference(&from, &to)), &to);
        assert!(error.fixed_rows::<3>(0).amax() < 1e-12 * 2000.0 && error.fixed_rows::<3>(3).amax() < 1e-14);
    }
}

#[test]
fn the_difference_after_a_move_is_the_move() {
    let mut random = generator(22);
    for _ in 0..1000 {
        let from = pose(&mut random);
        let (shift, turn) = (vector(&mut random, 10.0), vector(&mut random, 1.7));
        let twist = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
        assert!((difference(&from, &apply_twist(&from, &twist)) - twist).amax() < 1e-12);
    }
}

#[test]
fn a_pose_survives_its_six_numbers() {
    let mut random = generator(23);
    for _ in 0..1000 {
        let there = pose(&mut random);
        assert!(difference(&there, &pose_from_vector(&vector_from_pose(&there))).amax() < 1e-12);
    }
}

#[test]
fn skew_is_the_cross_product_and_matrices_give_back_their_rotation() {
    let mut random = generator(24);
    for _ in 0..200 {
        let (v, w) = (vector(&mut random, 3.0), vector(&mut random, 3.0));
        assert!((skew(&v) * w - v.cross(&w)).amax() < 1e-14 * 10.0);
        let rotation = UnitQuaternion::from_scaled_axis(v);
        let back = rotation_from_matrix(&rotation.to_rotation_matrix().into_inner());
        assert!(rotation.angle_to(&back) < 1e-7 && (rotation * w - back * w).amax() < 1e-14 * 10.0);
    }
}

#[test]
fn left_jacobian_has_a_numerical_twin_and_its_inverse_undoes_it() {
    let mut random = generator(25);
    for size in [1e-9, 1e-4, 9e-4, 1.1e-3, 0.1, 1.0, 1.75] {
        for _ in 0..20 {
            let phi = vector(&mut random, size);
            let here = UnitQuaternion::from_scaled_axis(phi);
            let twin = jacobian(
                |x, out| {
                    let there = UnitQuaternion::from_scaled_axis(Vector3::new(x[0], x[1], x[2]));
                    out.copy_from_slice((there * here.inverse()).scaled_axis().as_slice());
                },
                phi.as_slice(),
                3,
                &[1e-3; 3],
            );
            let analytic = left_jacobian(&phi);
            for i in 0..3 {
                for j in 0..3 {
                    assert!(
                        (analytic[(i, j)] - twin[(i, j)]).abs() < 1e-9,
                        "{phi}: {analytic} against {twin}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_bound_of_an_angle_lies_above_it_and_close() {
    let mut random = generator(12);
    for exponent in -12..=0 {
        for _ in 0..1000 {
            let a = pose(&mut random).rotation;
            let b = a * UnitQuaternion::from_scaled_axis(vector(&mut random, 1.8 * 10f64.powi(exponent)));
            // The other quaternion of the same rotation.
            let other = UnitQuaternion::new_unchecked(-b.into_inner());
            let angle = a.angle_to(&b);
            for bound in [angle_bound_rad(&a, &b), angle_bound_rad(&other, &a)] {
                assert!(angle <= bound && bound <= 1.12 * angle + 1e-6, "{angle:e} {bound:e}");
            }
        }
    }
}
