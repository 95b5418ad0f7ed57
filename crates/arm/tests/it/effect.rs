//! Tests of the effects: slopes, torques, and that each does what its name says.

use nalgebra::{Matrix6, Point3, Vector3};
use truegrind_arm::chain::tables;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::bending::Bending;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::joint_load::PointMass;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, MappedJoints, Model, PreparedModel};
use truegrind_math::difference::jacobian;
use truegrind_math::lanes::{AnyWidth, Instructions, SinCos, WIDTH, vectorised, with_instructions};

use super::arms::{SHEETS, Sheet, generator, joints_within, perturbed, with_effects};

fn condition() -> Condition {
    Condition { payload_kg: Some(5.0), payload_centre_mm: [5.0, -30.0, 80.0], ..Condition::default() }
}

fn heavy(sheet: &Sheet, seed: u64) -> Model {
    let mut random = generator(seed);
    let mut model = with_effects(&perturbed(&sheet.model(), &mut random, 1.0, 0.5), &mut random);
    model.gravity = Vector3::new(0.5, 0.1, -0.8).normalize();
    model
}

fn assert_near(a: &Matrix6<f64>, b: &Matrix6<f64>, tolerance: f64, what: &str) {
    assert!((a - b).amax() <= tolerance, "{what}: {a} against {b}");
}

#[test]
fn torque_is_the_negative_gradient_of_the_potential_energy() {
    for sheet in SHEETS {
        let model = heavy(sheet, 41);
        let statics = model.statics();
        let condition = condition();
        let bodies = model.bodies.unwrap();
        // Height of every mass against gravity, summed up from the link poses: nothing of the torque's own code.
        let energy = |u: &[f64]| {
            let g = model.gravity * 9.806_65e-3;
            let mut pose = truegrind_math::se3::Pose::identity();
            let mut out = 0.0;
            for (k, link) in model.links.iter().enumerate() {
                pose *= link.pose(u[k]);
                let centre = |c: [f64; 3]| (pose * nalgebra::Point3::from(Vector3::from(c))).coords;
                out -= bodies[k].mass_kg * g.dot(&centre(bodies[k].centre_mm));
                if k == 5 {
                    out -= condition.payload_kg.unwrap() * g.dot(&centre(condition.payload_centre_mm));
                }
            }
            out
        };
        let mut random = generator(42);
        for _ in 0..5 {
            let u = joints_within(&model, &mut random);
            let (torque, slope) = statics.torques_and_jacobian(&MappedJoints(u), &condition);
            let gradient = jacobian(|x, out| out[0] = energy(x), u.as_slice(), 1, &[2e-3; 6]);
            for j in 0..6 {
                assert!((torque[j] + gradient[(0, j)]).abs() < 1e-7, "{}: joint {j}", sheet.name);
            }
            let twin = jacobian(
                |x, out| {
                    out.copy_from_slice(
                        statics
                            .torques_and_jacobian(&MappedJoints(Joints::from_column_slice(x)), &condition)
                            .0
                            .as_slice(),
                    );
                },
                u.as_slice(),
                6,
                &[1e-3; 6],
            );
            let twin = Matrix6::from_column_slice(twin.as_slice());
            assert_near(&slope, &twin, 1e-8 * (1.0 + twin.amax()), sheet.name);
            assert!((slope - slope.transpose()).amax() < 1e-12 * (1.0 + slope.amax()));
        }
    }
}

#[test]
fn every_slope_has_a_numerical_twin() {
    let model = heavy(&SHEETS[0], 43);
    let statics = model.statics();
    let condition = condition();
    let mut random = generator(44);
    for _ in 0..10 {
        let u = joints_within(&model, &mut random);
        for effect in &model.effects {
            let twin = jacobian(
                |x, out| {
                    let there = MappedJoints(Joints::from_column_slice(x));
                    out.copy_from_slice(effect.offset(&statics, &there, &condition).as_slice());
                },
                u.as_slice(),
                6,
                &[2e-4; 6],
            );
            let twin = Matrix6::from_column_slice(twin.as_slice());
            assert_near(&effect.jacobian(&statics, &MappedJoints(u), &condition), &twin, 1e-9, effect.name());
        }
    }
}

#[test]
fn rotation_slopes_count_couplings_and_effects() {
    let model = heavy(SHEETS.iter().find(|s| s.name == "fanuc-m-20ia").unwrap(), 45);
    let posed = model.at_condition(&condition());
    let mut random = generator(46);
    for _ in 0..10 {
        let q = joints_within(&model, &mut random);
        let twin = jacobian(
            |x, out| out.copy_from_slice(posed.joint_rotations(&Joints::from_column_slice(x)).as_slice()),
            q.as_slice(),
            6,
            &[2e-4; 6],
        );
        assert_near(
            &posed.rotation_jacobian(&q),
            &Matrix6::from_column_slice(twin.as_slice()),
            1e-8,
            "slopes",
        );
    }
}

#[test]
fn an_effect_is_the_sum_of_its_regressors() {
    let model = heavy(&SHEETS[3], 47);
    let statics = model.statics();
    let condition = Condition { approach: [1, 0, -1, 0, 0, 1], ..condition() };
    let mut effects = model.effects.clone();
    effects.push(Effect::Backlash(Backlash { joint: 2, play_rad: 1e-3 }));
    let mut random = generator(48);
    let u = joints_within(&model, &mut random);
    let torque = statics.torques::<f64>(&u.into(), &condition);
    for effect in &effects {
        let parameters = effect.parameters();
        let sum: Joints = effect
            .regressors(&statics, &MappedJoints(u), &condition)
            .iter()
            .zip(&parameters)
            .map(|(regressor, parameter)| regressor * parameter.value)
            .sum();
        let rotation = effect.offset(&statics, &MappedJoints(u), &condition);
        assert!((rotation - sum).amax() < 1e-15, "{}", effect.name());
        let mut turned = [0.0; 6];
        effect.add_offset(&statics, &u.into(), &torque, &condition, &mut turned);
        assert!((rotation - Joints::from(turned)).amax() < 1e-15, "{}", effect.name());
        assert!(effect.joint().is_none_or(|joint| (0..6).all(|j| j == joint || rotation[j] == 0.0)));
    }
}

/// The joint rotations of eight rows.
struct Affected<'a> {
    arm: &'a PreparedModel<'a>,
    rows: &'a [Joints; WIDTH],
}

impl AnyWidth for Affected<'_> {
    type Output = [[f64; WIDTH]; 6];

    fn run<R: SinCos>(self, like: R) -> Self::Output {
        let mut out = [[0.0; WIDTH]; 6];
        for from in (0..WIDTH).step_by(R::ROWS) {
            let mapped = std::array::from_fn(|j| like.load(&self.rows.map(|row| row[j]), from));
            for (number, lanes) in self.arm.apply_effects(&mapped).iter().zip(&mut out) {
                number.store(lanes, from);
            }
        }
        out
    }
}

#[test]
fn effects_in_lanes_get_the_bits_of_one_row_alone() {
    let mut random = generator(50);
    for sheet in SHEETS {
        let model = heavy(sheet, 49);
        let arm = &model.at_condition(&condition());
        let rows: &[Joints; WIDTH] = &std::array::from_fn(|_| joints_within(&model, &mut random));
        for set in Instructions::available() {
            let eight = with_instructions(set, || vectorised(Affected { arm, rows }));
            for (k, row) in rows.iter().enumerate() {
                let one = arm.apply_effects::<f64>(&(*row).into());
                assert_eq!(eight.map(|v| v[k].to_bits()), one.map(f64::to_bits), "{set:?}");
            }
        }
    }
}

#[test]
fn an_effect_whose_circumstance_is_unknown_stands_still() {
    let nominal = SHEETS[0].model();
    let mut warm = nominal.clone();
    warm.effects.push(Effect::ThermalDrift(Thermal {
        start_h: 0.0,
        growth: 1e-3,
        time_constant_h: 1.0,
        growth_per_k: 1e-4,
        reference_c: 20.0,
    }));
    warm.effects.push(Effect::Backlash(Backlash { joint: 0, play_rad: 1e-3 }));
    let q = Joints::from([0.1, 0.2, -0.3, 0.4, 0.5, 0.6]);
    let unknown = Condition::default();
    assert_eq!(warm.forward(&q, &unknown), nominal.forward(&q, &unknown));
}

#[test]
fn a_warm_arm_is_the_cold_arm_with_longer_links() {
    let nominal = SHEETS[0].model();
    let mut warm = nominal.clone();
    warm.effects.push(Effect::ThermalDrift(Thermal {
        start_h: 0.0,
        growth: 1e-3,
        time_constant_h: 2.0,
        growth_per_k: 1e-5,
        reference_c: 20.0,
    }));
    let condition = Condition { time_h: Some(2.0), temperature_c: Some(30.0), ..Condition::default() };
    let growth = 1e-3 * (1.0 - (-1.0_f64).exp()) + 1e-4;
    let q = Joints::from([0.1, 0.2, -0.3, 0.4, 0.5, 0.6]);
    let (cold, warm) = (nominal.forward(&q, &condition), warm.forward(&q, &condition));
    // All lengths grow alike, so the whole arm does.
    assert!((warm.translation.vector - cold.translation.vector * (1.0 + growth)).norm() < 1e-10);
    assert!(cold.rotation.angle_to(&warm.rotation) < 1e-7);
    assert_eq!(tables(&nominal.links).len(), 6);
}

#[test]
fn play_is_felt_between_the_two_sides() {
    let mut model = SHEETS[0].model();
    model.effects.push(Effect::Backlash(Backlash { joint: 1, play_rad: 2e-3 }));
    let from = |side: i8| Condition { approach: [0, side, 0, 0, 0, 0], ..Condition::default() };
    let q = Joints::zeros();
    let (above, below) =
        (model.at_condition(&from(1)).joint_rotations(&q), model.at_condition(&from(-1)).joint_rotations(&q));
    assert!(((above - below)[1] - 2e-3).abs() < 1e-18);
}

#[test]
fn gravity_closes_a_play_where_it_exceeds_the_friction() {
    let mut arm = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    let largest = 2.65;
    let play = LoadedBacklash {
        joint: 1,
        mass: vec![PointMass { frame: 2, mass_kg: 1.0 }],
        friction_nm: 0.3 * largest,
        closing_nm: 0.02 * largest,
        play_rad: 1e-3,
    };
    arm.effects.push(Effect::LoadedBacklash(play));
    let from = |side: i8| Condition { approach: [0, side, 0, 0, 0, 0], ..Condition::default() };
    for k in -40..=40 {
        let angle = 0.04 * f64::from(k);
        let q = Joints::new(0.0, angle, 0.0, 0.3, 0.8, 0.0);
        let [above, middle, below] = [1, 0, -1].map(|side| {
            let turned = (arm.at_condition(&from(side)).joint_rotations(&q) - q)[1];
            assert!(turned.abs() <= 0.5e-3 * (1.0 + 1e-12));
            turned
        });
        // The link falls forwards of the upright, and back behind it.
        let share = angle.sin().abs() / 0.3;
        if share > 1.5 {
            for turned in [above, middle, below] {
                assert!((turned - 0.5e-3 * angle.signum()).abs() < 1e-5, "{k}: {turned}");
            }
        } else if share < 0.5 {
            assert!((above - below - 1e-3).abs() < 2e-5 && middle.abs() < 1e-5, "{k}: {above} {below}");
        }
        let (statics, u) = (arm.statics(), arm.mapped(&q));
        let open = arm.effects[0].open_play_rad(&statics, &u, &from(0));
        assert!((open - (above - below)).abs() < 1e-15);
        // The solver follows the step.
        let conditions = [1, 0, -1].map(from);
        for condition in &conditions {
            let target = arm.forward(&q, condition);
            let inverse = Inverse::new(&arm, condition, &arm);
            let solution = inverse.solve_near(&target, &q.map(|q| q + 1e-3)).unwrap();
            assert!((solution.joints - q).amax() < 1e-8, "{k}");
        }
    }
}

/// The elastic curve of a beam, summed step by step under the moments of all that hangs beyond each step: nothing of the closed form.
#[test]
fn a_link_bends_along_its_elastic_curve() {
    let mut random = generator(47);
    for (name, joint) in [("abb-irb-120", 1), ("universal-robots-ur10", 1), ("universal-robots-ur10", 2)] {
        let mut arm = truegrind_arm::robots::load(name).unwrap().model;
        let mut bodies = arm.bodies.unwrap();
        // The formula spreads the link's own weight evenly.
        bodies[joint].centre_mm = [-0.5 * arm.links[joint].a_mm, 0.0, 0.0];
        arm.bodies = Some(bodies);
        let condition = Condition {
            payload_kg: Some(3.0),
            payload_centre_mm: [20.0, 10.0, 70.0],
            ..Condition::default()
        };
        let compliance_rad_per_nm = 1e-6;
        let bending = Bending { joint, frame: None, compliance_rad_per_nm };
        let bent = Model { effects: vec![Effect::LinkBending(bending)], ..arm.clone() };
        for _ in 0..10 {
            let q = joints_within(&arm, &mut random);
            let frames = arm.at_condition(&condition).frames(&q);
            let at = |k: usize| Vector3::from(frames.origin[k]) * 1e-3;
            let end_of = |k: usize, c: [f64; 3]| {
                let (y, z) = (Vector3::from(frames.y[k]), Vector3::from(frames.z[k + 1]));
                at(k + 1) + (y.cross(&z) * c[0] + y * c[1] + z * c[2]) * 1e-3
            };
            // The link lies along its own x; the offset along its axis neither bends nor matters.
            let across = Vector3::from(frames.z[joint]);
            let whole = at(joint + 1) - at(joint);
            let span = whole - across * across.dot(&whole);
            let (length, along) = (span.norm(), span.normalize());
            let weight = |kg: f64| arm.gravity * (9.806_65 * kg);
            let (mut sag, mut turn) = (Vector3::zeros(), Vector3::zeros());
            let steps = 2000;
            for k in 0..steps {
                let left = length * (1.0 - (k as f64 + 0.5) / steps as f64);
                let here = at(joint + 1) - along * left;
                let mut moment = (along * (0.5 * left)).cross(&weight(bodies[joint].mass_kg * left / length));
                for (k, body) in bodies.iter().enumerate().skip(joint + 1) {
                    moment += (end_of(k, body.centre_mm) - here).cross(&weight(body.mass_kg));
                }
                moment += (end_of(5, condition.payload_centre_mm) - here).cross(&weight(3.0));
                // Gravity bends the link about the axes at its ends; EI = L / c.
                let bend = across * (across.dot(&moment) * compliance_rad_per_nm / steps as f64);
                turn += bend;
                sag += bend.cross(&(along * left));
            }
            let (before, after) = (arm.forward(&q, &condition), bent.forward(&q, &condition));
            let flange = before.translation.vector * 1e-3;
            let expected = (sag + turn.cross(&(flange - at(joint + 1)))) * 1e3;
            let moved = after.translation.vector - before.translation.vector;
            assert!(
                (moved - expected).norm() < 1e-4 + 1e-3 * expected.norm(),
                "{name}: {moved} against {expected}"
            );
            assert!(
                (turn.norm() - before.rotation.angle_to(&after.rotation)).abs() < 1e-6 + 1e-3 * turn.norm()
            );
        }
    }
}

/// A link that lags behind its motor lags in the sense in which the controller counts, however the maker counts the angle: from above it
/// stands above. FANUC's third gear turns with J2 and J3; where these arrive from opposite sides, its own is not known.
#[test]
fn play_lags_in_the_sense_of_the_controller() {
    let play_rad = 6e-4;
    for name in ["kuka-kr10-r1420", "yaskawa-gp12", "fanuc-lr-mate-200id"] {
        let arm = truegrind_arm::robots::load(name).unwrap().model;
        let q = Joints::new(0.3, -0.4, 0.5, 0.2, 0.6, -0.7);
        for joint in 0..6 {
            let worn = Model { effects: vec![Effect::Backlash(Backlash { joint, play_rad })], ..arm.clone() };
            for side in [-1, 1] {
                let from = |approach| Condition { approach, ..Condition::default() };
                let stands = worn.forward(&q, &from([side; 6]));
                let mut lagging = q;
                lagging[joint] += 0.5 * play_rad * f64::from(side);
                if joint == 1 && arm.is_coupled(2) {
                    // The upper arm alone lags: its forearm keeps its angle to it, and J3 is stated against the horizontal.
                    lagging[2] -= 0.5 * play_rad * f64::from(side);
                }
                let expected = arm.forward(&lagging, &Condition::default());
                assert!(
                    (stands.translation.vector - expected.translation.vector).norm() < 1e-9,
                    "{name} {joint}"
                );
                let mut apart = [side; 6];
                apart[1] = -side;
                if arm.is_coupled(joint) {
                    let unknown = worn.forward(&q, &from(apart));
                    let middle = arm.forward(&q, &Condition::default());
                    assert!((unknown.translation.vector - middle.translation.vector).norm() < 1e-9);
                }
            }
        }
    }
    assert!(truegrind_arm::robots::load("fanuc-lr-mate-200id").unwrap().model.is_coupled(2));
}

/// One arm with its flange turned and moved against its last link, and the same arm whose last link ends in the flange: under one load on
/// the flange they sink alike.
#[test]
fn a_load_lies_in_the_flange_frame_however_the_last_link_ends() {
    let mut plain = truegrind_arm::robots::load("abb-irb-120").unwrap().model;
    plain.effects = vec![Effect::JointCompliance(Compliance { joint: 1, compliance_rad_per_nm: 1e-4 })];
    let mut described = plain.clone();
    // Tx(a) Rx(alpha) after the flange of `plain` is its last link; the flange leads back.
    described.links[5].a_mm = 40.0;
    described.links[5].alpha_rad = 1.2;
    let ends = plain.links[5].pose(0.0).inverse() * described.links[5].pose(0.0);
    described.flange = ends.inverse();
    for body in described.bodies.iter_mut().map(|bodies| &mut bodies[5]) {
        body.centre_mm = (described.flange * Point3::from(body.centre_mm)).coords.into();
    }
    let mut random = generator(48);
    for condition in [
        condition(),
        Condition { payload_kg: Some(3.0), payload_centre_mm: [0.0; 3], ..Condition::default() },
    ] {
        for _ in 0..10 {
            let q = joints_within(&plain, &mut random);
            let (one, other) = (plain.forward(&q, &condition), described.forward(&q, &condition));
            let apart = (one.translation.vector - other.translation.vector).norm();
            assert!(apart < 1e-9 && one.rotation.angle_to(&other.rotation) < 1e-9, "{apart} mm");
            let sunk = plain.forward(&q, &Condition::default()).translation.vector - one.translation.vector;
            assert!(sunk.norm() > 1e-3, "{sunk}");
        }
    }
}
