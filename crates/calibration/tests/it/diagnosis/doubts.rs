//! Doubts that keep a cause from being identified, so that no part is inspected and no program moved for it: dependent rows, physics
//! that would show elsewhere too, and larger faults whose exact law is unknown.

use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::lumped_compliance::{Lump, LumpedCompliance};
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::candidate_scores::CandidateScores;
use truegrind_calibration::diagnosis::candidates::Catalogue;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::extension::{Extended, FreeParameters, Subject, fit};
use truegrind_calibration::diagnosis::finding::Confidence;
use truegrind_calibration::diagnosis::lump_direction::is_one_direction;
use truegrind_calibration::diagnosis::overturning_masses::are_weights;
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Sensor};
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use truegrind_calibration::measurement::sensor::empirical::{EmpiricalFault, Overturning};

use super::scenarios::frames;
use super::simulator::{Hidden, Log, Setup, run};

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

fn diagnosed(dataset: &Dataset) -> Diagnosed {
    let arm = arm();
    diagnose(dataset, "arm", &arm, &frames(dataset, &arm), &Options::default(), &|_| {}).unwrap()
}

fn identified(found: &Diagnosed) -> Vec<&str> {
    let findings = found.diagnosis.findings.iter();
    findings.filter(|f| f.confidence == Confidence::Identified).map(|f| f.effect.as_str()).collect()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Each row of a run `times` over, read anew each time with a noise of `sigma_mm`.
fn read_again(dataset: &Dataset, times: usize, sigma_mm: f64, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = Vec::new();
    for row in dataset.rows.iter() {
        for _ in 0..times {
            let mut row = row.clone();
            row.number = rows.len();
            match &mut row.reading {
                Reading::Cable(length) => *length += sigma_mm * normal(&mut rng),
                Reading::Position(p) => *p += Vector3::from_fn(|_, _| sigma_mm * normal(&mut rng)),
                Reading::Pose(_) => {}
            }
            rows.push(row);
        }
    }
    Dataset { rows: rows.into(), ..dataset.clone() }
}

fn geometry(dataset: &Dataset) -> Extended {
    let (arm, options) = (arm(), Options::default());
    let prepared = prepare(dataset, &arm, true);
    let frames = frames(dataset, &arm);
    let subject = Subject {
        observed: &prepared.observed,
        nominal: &arm,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    fit(&subject, &[], FreeParameters::All, None)
}

/// The mean over the rows of the square of what a millimetre counts.
fn information(fit: &Extended) -> f64 {
    fit.weights.iter().map(|w| w.per_mm.powi(2)).sum::<f64>() / fit.weights.len() as f64
}

/// Whoever reads a pose five times has not seen the arm at five poses. What the model gets wrong there is in all five readings; only
/// the sensor's noise is averaged. Rows counted one by one prove five times too much, and error maps follow each pose.
#[test]
fn readings_of_one_pose_are_one_witness_of_what_the_model_gets_wrong_there() {
    for sensor in [Sensor::Position, Sensor::Cable] {
        let setup = Setup { sensor, rows: 150, sigma_mm: 0.0, dirty: false, seed: 61, log: Log::default() };
        let exact = |hidden: &[Hidden]| run(&arm(), hidden, &setup).dataset;
        let wrong = exact(&[Hidden::Warp { mm: 1.0 }]);
        let once = information(&geometry(&read_again(&wrong, 1, 0.02, 62)));
        let again = information(&geometry(&read_again(&wrong, 5, 0.02, 62)));
        let poses = 5.0 * again / once;
        assert!((0.6..1.4).contains(&poses), "{sensor:?}: five readings count as {poses:.2} poses");
        // Where the model is right each reading is a witness of its own.
        let right = exact(&[]);
        let once = information(&geometry(&read_again(&right, 1, 0.02, 62)));
        let again = information(&geometry(&read_again(&right, 5, 0.02, 62)));
        let poses = 5.0 * again / once;
        assert!((3.5..6.0).contains(&poses), "{sensor:?}: five readings count as {poses:.2} poses");
    }
}

/// Few poses, each read often, beside something that no cause describes: nothing of the arm is proven, and the arm that is written is on
/// poses that were held out no worse than geometry.
#[test]
fn few_poses_prove_nothing_however_often_they_are_read() {
    for seed in [63, 64, 65] {
        let setup =
            Setup { sensor: Sensor::Cable, rows: 80, sigma_mm: 0.0, dirty: false, seed, log: Log::default() };
        let rows = run(&arm(), &[Hidden::Warp { mm: 0.3 }], &setup).dataset;
        let found = diagnosed(&read_again(&rows, 5, 0.02, seed));
        assert_eq!(identified(&found), Vec::<&str>::new(), "{seed}");
        // What is in doubt is in the file with size 0, for its covariance.
        let effects = &found.estimated.model.effects;
        assert!(effects.iter().all(Effect::is_zero), "{seed}: {effects:?}");
    }
}

fn leaning(joint: usize) -> Cause {
    let across = |axis| Lump { frame: 4, axis: Some(axis), moment: None, factor: 1e-5 };
    Cause::Arm(Effect::LumpedCompliance(LumpedCompliance { joint, lump: vec![across(0), across(1)] }))
}

/// The first joint turns about the vertical: weight turns it only in an arm that leans, and there the joints behind it yield sideways
/// too. Smooth faults of a cable look like such a joint, and the arm was bent by tenths of a millimetre for them.
#[test]
fn the_first_joint_yields_only_where_another_shows_that_the_arm_leans() {
    let arm = arm();
    let setup = Setup {
        sensor: Sensor::Cable,
        rows: 120,
        sigma_mm: 0.03,
        dirty: false,
        seed: 66,
        log: Log::default(),
    };
    let dataset = run(&arm, &[], &setup).dataset;
    let (options, prepared) = (Options::default(), prepare(&dataset, &arm, true));
    let frames = frames(&dataset, &arm);
    let subject = Subject {
        observed: &prepared.observed,
        nominal: &arm,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    let catalogue = Catalogue::of(&subject);
    let tried = |causes: &[Cause]| {
        let board = CandidateScores::of(
            &catalogue,
            &subject,
            Arc::new(fit(&subject, causes, FreeParameters::All, None)),
        );
        let all = board.score_all(&board.whole.design, true);
        all.iter().any(|s| s.candidate.cause.requires_tilt())
    };
    assert!(!tried(&[]), "nothing shows that the arm leans");
    assert!(tried(&[leaning(1)]));
    assert!(leaning(0).requires_tilt() && !leaning(1).requires_tilt());
    assert!(!Cause::tilt_is_supported(&[leaning(0)]), "it is no witness of itself");
}

fn of_two_joints(joint: usize, other: usize, values: [f64; 4]) -> Cause {
    let disturbance = Disturbance::new(
        Kind::Empirical(EmpiricalFault::TwoJointGear { joint, other, orders: [1, 1] }),
        Profile::Constant,
    );
    Cause::Measurement(Disturbance { values: values.to_vec(), ..disturbance })
}

/// The load of joint 3 turns with the sum of the angles of joints 2 and 3. An error of joint 3 that goes with that sum is a spring's, or
/// that of play whose flank follows the load, as soon as its law is not the linear one.
#[test]
fn an_error_of_two_joints_that_goes_with_the_weight_may_be_a_spring() {
    let arm = arm();
    assert!(of_two_joints(2, 1, [3e-4, 1e-4, 2e-5, 0.0]).follows_gravity_angle(&arm));
    assert!(of_two_joints(1, 2, [3e-4, 1e-4, 2e-5, 0.0]).follows_gravity_angle(&arm));
    assert!(!of_two_joints(2, 1, [3e-4, 1e-4, 3e-4, 0.0]).follows_gravity_angle(&arm));
    assert!(!of_two_joints(2, 3, [3e-4, 1e-4, 0.0, 0.0]).follows_gravity_angle(&arm), "axes that cross");
    assert!(!of_two_joints(4, 1, [3e-4, 1e-4, 0.0, 0.0]).follows_gravity_angle(&arm), "no neighbours");
}

/// Gravity has one direction and masses are positive: deflections that point elsewhere are no tilt of the mounting.
#[test]
fn a_tilt_has_one_direction_for_all_lumps() {
    let lump = |frame, axis| Lump { frame, axis: Some(axis), moment: None, factor: 0.0 };
    let load = LumpedCompliance {
        joint: 1,
        lump: [2, 4, 6].iter().flat_map(|&f| [lump(f, 0), lump(f, 1)]).collect(),
    };
    let covariance = DMatrix::from_diagonal_element(6, 6, 1e-12);
    let one = |values: [f64; 6]| is_one_direction(&load, &values, &covariance);
    // Along (0.6, 0.8), with masses of 2, 3 and 1, and noise of a standard deviation.
    assert!(one([1.2e-5, 1.6e-5, 1.8e-5, 2.4e-5, 0.6e-5, 0.8e-5]));
    assert!(one([1.3e-5, 1.5e-5, 1.9e-5, 2.3e-5, 0.5e-5, 0.9e-5]));
    // The second points the other way, or across.
    assert!(!one([1.2e-5, 1.6e-5, -1.8e-5, -2.4e-5, 0.6e-5, 0.8e-5]));
    assert!(!one([1.2e-5, 1.6e-5, -2.4e-5, 1.8e-5, 0.6e-5, 0.8e-5]));
    // Too little is known to say so.
    let wide = DMatrix::from_diagonal_element(6, 6, 1e-9);
    assert!(is_one_direction(&load, &[1.2e-5, 1.6e-5, -2.4e-5, 1.8e-5, 0.6e-5, 0.8e-5], &wide));
}

/// What overturns a base is weight: of an arm whose masses are not known no lump is negative but for a link that lies behind its joint.
#[test]
fn what_overturns_a_base_is_weight() {
    let of = |axes| {
        let fault = EmpiricalFault::BaseTilt { load: Overturning::Lumps, axes, deep: false };
        Cause::Measurement(Disturbance::new(Kind::Empirical(fault), Profile::Constant))
    };
    let sure = DMatrix::from_diagonal_element(3, 3, 1e-12);
    let alike = |values: [f64; 3], covariance: &DMatrix<f64>| are_weights(&of(None), &values, covariance);
    assert!(alike([7e-5, 1e-5, 2e-6], &sure));
    assert!(alike([7e-5, -1e-5, 2e-6], &sure), "a forearm behind the elbow");
    assert!(!alike([-4e-5, 5e-5, 2e-6], &sure), "an elbow that rises where the wrist falls");
    assert!(!alike([-4e-5, -1e-5, -2e-6], &sure));
    assert!(alike([-4e-5, 5e-5, 2e-6], &DMatrix::from_diagonal_element(3, 3, 1e-9)), "not known so well");
    // Stiffer about one axis than about the other; what couples them has either sign.
    let sure = DMatrix::from_diagonal_element(9, 9, 1e-12);
    let unlike = |about_y: f64| {
        let values = [7e-5, 1e-5, 2e-6, about_y, 1e-5, 2e-6, -4e-5, -1e-5, -2e-6];
        are_weights(&of(Some([0, 1])), &values, &sure)
    };
    assert!(unlike(3e-5) && !unlike(-3e-5));
}
