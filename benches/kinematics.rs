//! Forward and inverse kinematics of a calibrated IRB 120, one pose at a time and in lanes.
//!
//! `cargo bench --bench kinematics --no-default-features`; items per second are poses per second of one thread.
//!
//! What a pose costs, counted product by product and sum by sum; nothing of a row is fused, so a core with two 512-bit units
//! does 16 of them in a cycle, 46 G/s at 2.9 GHz.
//!
//! | job | operations | bytes | bound at 46 G/s |
//! |---|---|---|---|
//! | forward, links | 606: six sines and cosines 246, six links 354, joint map 6 | 48 in, 96 out | 76 M/s |
//! | forward, effects | 1,582: a second chain for the torques 600, levers and torques 330, one harmonic 46 | the same | 29 M/s |
//! | inverse along a path, links | 3,700: three evaluations of 1,070, distance to singularity 450 | 56 in, 88 out | 12.5 M/s |
//! | inverse along a path, effects | 7,400: 3.7 evaluations of 2,000 | the same | 6.2 M/s |
//!
//! Reached on an Intel Xeon at 2.9 GHz under load: forward 60 to 70 % of the bound, the inverse half of it, since one step waits for
//! the other and the judgement of each row goes row by row. With AVX2 the bound is half as high.
//!
//! An AMD Zen 4 at 3.5 GHz splits 512-bit instructions in two and also does 16 operations in a cycle, 56 G/s, with either width. Reached
//! there: forward 38.8 M/s (42 % of the bound) and 16.9 M/s (48 %), AVX2 33.5 and 12.4; inverse 6.8 and 3.0 M/s, AVX2 5.5 and 2.3.
//!
//! An AMD Zen 5 at 4.17 GHz has two multipliers and two adders of 512 bits: 32 operations in a cycle where products and sums balance, 133 G/s.
//! Medians there, under load: forward 74 to 82 M/s (36 % of the bound) and 31 M/s, AVX2 48 and 18.5, 7c20e9f in turn 22.5 and 12.6; inverse
//! 11.1 and 4.9 M/s (30 %), AVX2 7.1 and 3.1, 7c20e9f 4.9 and 2.3. Eight rows of a path that are
//! certainly accepted are judged together, in lanes: in turn at a load of 20 the inverse went from 11.4-11.8 and 5.2-5.4 M/s to 12.4-13.0 and 5.2-5.8
//! (AVX2 7.0 and 3.1 to 7.6 and 3.2); judging row by row had 22 % of the time.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use nalgebra::{Matrix6, Vector3};
use truegrind::arm::batch::{JointColumns, PoseColumns};
use truegrind::arm::condition::Condition;
use truegrind::arm::effect::Effect;
use truegrind::arm::effect::compliance::Compliance;
use truegrind::arm::effect::harmonic::Harmonic;
use truegrind::arm::inverse::Inverse;
use truegrind::arm::link::{Link, LinkModel};
use truegrind::arm::model::{Body, Joints, Limits, Model};
use truegrind::math::lanes::{Instructions, with_instructions};
use truegrind::math::se3::Pose;

fn main() {
    divan::main();
}

const COUNT: usize = 4096;

/// The nominal arm, as ltlm-2024 Table 1 has it.
fn nominal() -> Model {
    let table = [
        [0.0, 290.0, -90.0, 0.0],
        [270.0, 0.0, 0.0, -90.0],
        [70.0, 0.0, -90.0, 0.0],
        [0.0, 302.0, 90.0, 0.0],
        [0.0, 0.0, -90.0, 0.0],
        [0.0, 72.0, 0.0, 0.0_f64],
    ];
    Model {
        links: std::array::from_fn(|i| {
            let [a_mm, d_mm, alpha, theta] = table[i];
            let model = if i == 1 { LinkModel::Hayati } else { LinkModel::Dh };
            Link {
                model,
                a_mm,
                d_mm,
                alpha_rad: alpha.to_radians(),
                theta_rad: theta.to_radians(),
                beta_rad: 0.0,
            }
        }),
        joint_map: Matrix6::identity(),
        limits: Limits {
            sums: Vec::new(),
            min_rad: [-165.0_f64, -110.0, -110.0, -160.0, -120.0, -400.0].map(f64::to_radians),
            max_rad: [165.0_f64, 110.0, 70.0, 160.0, 120.0, 400.0].map(f64::to_radians),
            speed_rad_s: None,
        },
        flange: Pose::identity(),
        bodies: None,
        gravity: -Vector3::z(),
        effects: Vec::new(),
    }
}

/// Every link number off by some tenths of a millimetre and some thousandths of a radian.
fn calibrated() -> Model {
    let mut out = nominal();
    for (i, link) in out.links.iter_mut().enumerate() {
        let off = 0.3 - 0.1 * i as f64;
        link.a_mm += off;
        link.alpha_rad += 3e-3 * off;
        link.theta_rad -= 4e-3 * off;
        match link.model {
            LinkModel::Dh => link.d_mm -= off,
            LinkModel::Hayati => link.beta_rad = 1e-3,
        }
    }
    out
}

/// The calibrated arm with six compliances and an eccentric gear.
fn with_effects() -> Model {
    let mut out = calibrated();
    out.bodies =
        Some([3.1, 3.9, 2.9, 1.3, 0.5, 0.1].map(|mass_kg| Body { mass_kg, centre_mm: [-50.0, 10.0, 20.0] }));
    out.effects = (0..6)
        .map(|joint| Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 1e-5 }))
        .chain([Effect::GearEccentricity(Harmonic {
            joint: 1,
            order: 1.0,
            sine_rad: 2e-4,
            cosine_rad: 1e-4,
        })])
        .collect();
    out
}

/// Joints along a smooth path, some millimetres from point to point.
fn path() -> Vec<Joints> {
    (0..COUNT)
        .map(|i| {
            let t = i as f64 / COUNT as f64 * std::f64::consts::TAU;
            Joints::from_fn(|j, _| {
                let start = [0.2, 0.4, -0.3, 0.5, 0.8, -0.2][j];
                start + 0.5 * (t * (1.0 + j as f64) + j as f64).sin()
            })
        })
        .collect()
}

fn arm(name: &str) -> Model {
    if name == "effects" { with_effects() } else { calibrated() }
}

fn targets(model: &Model) -> Vec<Pose> {
    let posed = model.at_condition(&Condition::default());
    path().iter().map(|q| posed.forward(q)).collect()
}

#[divan::bench(args = ["links", "effects"])]
fn forward_scalar(bencher: Bencher<'_, '_>, name: &str) {
    let (model, joints) = (arm(name), path());
    let posed = model.at_condition(&Condition::default());
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        for q in &joints {
            black_box(posed.forward(black_box(q)));
        }
    });
}

/// The same with AVX2, for the share that is due to longer registers.
#[divan::bench(args = ["links", "effects"])]
fn forward_lanes_avx2(bencher: Bencher<'_, '_>, name: &str) {
    with_instructions(Instructions::Avx2, || forward_lanes(bencher, name));
}

/// The same with AVX2.
#[divan::bench(args = ["links", "effects"])]
fn inverse_lanes_along_path_avx2(bencher: Bencher<'_, '_>, name: &str) {
    with_instructions(Instructions::Avx2, || inverse_lanes_along_path(bencher, name));
}

#[divan::bench(args = ["links", "effects"])]
fn forward_lanes(bencher: Bencher<'_, '_>, name: &str) {
    let (model, joints) = (arm(name), path().into_iter().collect::<JointColumns>());
    let posed = model.at_condition(&Condition::default());
    let mut poses = PoseColumns::default();
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        posed.forward_columns(black_box(&joints), &mut poses);
        black_box(&poses);
    });
}

#[divan::bench(args = ["links", "effects"])]
fn inverse_scalar_near_nominal_joints(bencher: Bencher<'_, '_>, name: &str) {
    let model = arm(name);
    let (targets, seeds, nominal) = (targets(&model), path(), nominal());
    let inverse = Inverse::new(&model, &Condition::default(), &nominal);
    bencher.counter(ItemsCount::new(COUNT)).bench_local(|| {
        for (target, seed) in targets.iter().zip(&seeds) {
            let _ = black_box(inverse.solve_near(target, &seed.map(|q| q + 3e-3)));
        }
    });
}

#[divan::bench(args = ["links", "effects"])]
fn inverse_lanes_near_nominal_joints(bencher: Bencher<'_, '_>, name: &str) {
    let model = arm(name);
    let nominal = nominal();
    let targets = targets(&model);
    let seeds: Vec<Joints> = path().iter().map(|seed| seed.map(|q| q + 3e-3)).collect();
    let inverse = Inverse::new(&model, &Condition::default(), &nominal);
    let chunk = 1024; // what one thread takes
    assert!(inverse.solve_seeded(&targets, &seeds).iter().all(Result::is_ok));
    bencher
        .counter(ItemsCount::new(chunk))
        .bench_local(|| black_box(inverse.solve_seeded(black_box(&targets[..chunk]), &seeds[..chunk])));
}

#[divan::bench(args = ["links", "effects"])]
fn inverse_lanes_along_path(bencher: Bencher<'_, '_>, name: &str) {
    let model = arm(name);
    let (targets, start, nominal) = (targets(&model), path()[0], nominal());
    let inverse = Inverse::new(&model, &Condition::default(), &nominal);
    assert!(inverse.solve_path(&targets, &start).iter().all(Result::is_ok));
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| black_box(inverse.solve_path(black_box(&targets), &start)));
}

#[divan::bench(args = ["links", "effects"])]
fn inverse_all_branches(bencher: Bencher<'_, '_>, name: &str) {
    let model = arm(name);
    let nominal = nominal();
    let targets: Vec<Pose> = targets(&model).into_iter().step_by(64).collect();
    let inverse = Inverse::new(&model, &Condition::default(), &nominal);
    bencher.counter(ItemsCount::new(targets.len())).bench_local(|| {
        for target in &targets {
            black_box(inverse.all(black_box(target)));
        }
    });
}
