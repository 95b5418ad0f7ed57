//! Tests of links, chain and the forward map.

use nalgebra::{Isometry3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use truegrind_arm::chain::{LinkTable, chain, tables};
use truegrind_arm::condition::Condition;
use truegrind_arm::link::{Link, LinkModel};
use truegrind_arm::model::{Joints, Model};
use truegrind_math::lanes::{AnyWidth, Instructions, SinCos, WIDTH, sin_cos, vectorised, with_instructions};
use truegrind_math::se3::{Pose, difference};

use super::arms::{SHEETS, Sheet, generator, joints_within, perturbed, with_effects};

#[test]
fn flange_of_the_irb_120_at_zero_is_where_the_drawing_has_it() {
    let pose = Sheet::named("abb-irb-120").forward(&Joints::zeros(), &Condition::default());
    let expected = Vector3::new(374.0, 0.0, 630.0);
    assert!((pose.translation.vector - expected).norm() < 1e-12 * 630.0, "{}", pose.translation);
    // tool0 looks along the base's x axis.
    assert!((pose.rotation * Vector3::z() - Vector3::x()).norm() < 1e-12);
}

/// ltlm-2024 eq. 2, entry by entry.
fn printed_matrix(link: &Link, angle: f64) -> Matrix4<f64> {
    let (st, ct) = (angle + link.theta_rad).sin_cos();
    let (sa, ca) = link.alpha_rad.sin_cos();
    let (a, d) = (link.a_mm, link.d_mm);
    #[rustfmt::skip]
    let out = Matrix4::new(
        ct, -st * ca,  st * sa, a * ct,
        st,  ct * ca, -ct * sa, a * st,
        0.0,      sa,       ca, d,
        0.0,     0.0,      0.0, 1.0,
    );
    out
}

#[test]
fn a_dh_link_is_equation_2_of_the_paper() {
    let mut random = generator(3);
    for sheet in SHEETS {
        let model = perturbed(&sheet.model(), &mut random, 1.0, 1.0);
        for (i, link) in model.links.iter().enumerate().filter(|(_, l)| l.model == LinkModel::Dh) {
            let angle = 0.3 + i as f64;
            let error = (link.pose(angle).to_homogeneous() - printed_matrix(link, angle)).amax();
            assert!(error < 1e-12 * 2000.0, "{} link {i}: {error:e}", sheet.name);
        }
    }
}

/// The product of six link poses, each from nalgebra's own rotations.
fn product(model: &Model, rotations: &Joints) -> Pose {
    let turn = |axis: Vector3<f64>| -> Pose {
        Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from(Rotation3::new(axis)))
    };
    let mut out = Pose::identity();
    for (link, angle) in model.links.iter().zip(rotations.iter()) {
        out *= turn(Vector3::z() * (angle + link.theta_rad));
        out *= Pose::translation(link.a_mm, 0.0, link.d_mm);
        out *= turn(Vector3::x() * link.alpha_rad);
        out *= turn(Vector3::y() * link.beta_rad);
    }
    out * model.flange
}

#[test]
fn the_kernel_agrees_with_the_product_of_link_poses() {
    let mut random = generator(4);
    let condition = Condition { payload_kg: Some(2.0), ..Condition::default() };
    for sheet in SHEETS {
        let mut model = with_effects(&perturbed(&sheet.model(), &mut random, 2.0, 1.0), &mut random);
        // Motions of links have tests of their own.
        model.effects.retain(|effect| effect.first_moved_frame().is_none());
        model.flange = Pose::new(Vector3::new(10.0, -20.0, 30.0), Vector3::new(0.1, 0.2, -0.3));
        let posed = model.at_condition(&condition);
        for _ in 0..50 {
            let q = joints_within(&model, &mut random);
            let error = difference(&posed.forward(&q), &product(&model, &posed.joint_rotations(&q)));
            assert!(error.fixed_rows::<3>(0).amax() < 1e-9, "{}: {error}", sheet.name);
            assert!(error.fixed_rows::<3>(3).amax() < 1e-13 * 10.0, "{}: {error}", sheet.name);
        }
    }
}

#[test]
fn frames_hold_the_axes_of_the_links_on_the_way() {
    let mut random = generator(5);
    let model = perturbed(&Sheet::named("staubli-tx90"), &mut random, 2.0, 1.0);
    let posed = model.at_condition(&Condition::default());
    let q = joints_within(&model, &mut random);
    let frames = posed.frames(&q);
    let mut pose = Pose::identity();
    for (i, link) in model.links.iter().enumerate() {
        let z = Vector3::from(frames.z[i]);
        assert!((pose.rotation * Vector3::z() - z).norm() < 1e-13);
        assert!((pose.translation.vector - Vector3::from(frames.origin[i])).norm() < 1e-10);
        pose *= link.pose(q[i]);
        let y = Vector3::from(frames.y[i]);
        assert!((pose.rotation * Vector3::y() - y).norm() < 1e-13);
    }
    assert!((pose.rotation * Vector3::x() - Vector3::from(frames.x)).norm() < 1e-13);
}

/// All numbers of the chain of eight rows, row by row.
struct Chains<'a> {
    tables: &'a [LinkTable; 6],
    rows: &'a [Joints; WIDTH],
}

impl AnyWidth for Chains<'_> {
    type Output = [Vec<u64>; WIDTH];

    fn run<R: SinCos>(self, like: R) -> Self::Output {
        let mut out = [const { Vec::new() }; WIDTH];
        for from in (0..WIDTH).step_by(R::ROWS) {
            let (mut sin, mut cos) = ([like; 6], [like; 6]);
            for j in 0..6 {
                let column = self.rows.map(|row| row[j]);
                (sin[j], cos[j]) = sin_cos(like.load(&column, from));
            }
            let frames = chain(self.tables, &sin, &cos);
            let vectors = frames.z.iter().chain(&frames.origin).chain(&frames.y).chain(&frames.lateral);
            for number in vectors.chain([&frames.x]).flatten() {
                let mut lanes = [0.0; WIDTH];
                number.store(&mut lanes, 0);
                (0..R::ROWS).for_each(|k| out[from + k].push(lanes[k].to_bits()));
            }
        }
        out
    }
}

#[test]
fn rows_in_lanes_get_the_bits_of_one_row_alone() {
    let mut random = generator(6);
    for sheet in SHEETS {
        let model = perturbed(&sheet.model(), &mut random, 2.0, 1.0);
        let tables = &tables(&model.links);
        let rows: &[Joints; WIDTH] = &std::array::from_fn(|_| joints_within(&model, &mut random));
        let alone = Chains { tables, rows }.run(0.0);
        for set in Instructions::available() {
            assert_eq!(with_instructions(set, || vectorised(Chains { tables, rows })), alone, "{set:?}");
        }
    }
}
