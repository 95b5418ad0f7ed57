//! What a measurement showed beyond its noise counts in every σ and risk: compared with arms whose joints err by as much, alike in
//! neighbouring poses.

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::PathPoint;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_compensation::risk::placement::Placement;
use truegrind_math::se3::Pose;

use super::placement::rigid;
use super::{blade, estimated, perturbed, rewritten};

/// Distance of poses at which errors are alike to 1/e (rad).
const ALIKE_RAD: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// An arm whose parameters are known exactly, and whose joints err by `rad`, those of the wrist by more.
fn erring(rad: f64, joints: &[Joints]) -> Estimated {
    let mut known = estimated(perturbed(4, 1.0), joints);
    known.covariance *= 0.0;
    (known.beyond_noise_mm, known.beyond_noise_rad) =
        (Some(600.0 * rad), Some([1.0, 1.0, 1.0, 2.0, 2.0, 3.0].map(|size| size * rad)));
    known
}

fn planned(source: &[u8], known: &Estimated, placement: Placement) -> Plan {
    let options = Options { placement, points: true, max_risk: 1.0, ..Options::default() };
    rewritten(source, known, &Cell::default(), &options).0
}

/// Every few cut points, enough of them for the rigid motion of the part.
fn some(plan: &Plan) -> Vec<&PathPoint> {
    let cut: Vec<&PathPoint> = plan.points.iter().filter(|p| p.cutting && p.sigma_mm.is_some()).collect();
    let step = cut.len().div_ceil(80);
    cut.into_iter().step_by(step).collect()
}

/// The displacement of a point by small rotations of the joints' axes, from the arm itself.
fn displaced(known: &Estimated, point: &PathPoint, by: &[f64; 6]) -> Vector3<f64> {
    let q = point.joints_after.unwrap();
    let at = |turn: f64| {
        let mut model = known.model.clone();
        for (link, by) in model.links.iter_mut().zip(by) {
            link.theta_rad += turn * by;
        }
        let flange: Pose = model.forward(&q, &known.condition);
        (flange * point.flange_from_tool).translation.vector
    };
    at(0.5) - at(-0.5)
}

/// Displacements (3 n) of the points in `count` drawn arms, one column each.
fn drawn(known: &Estimated, points: &[&PathPoint], count: usize) -> DMatrix<f64> {
    let rad = known.beyond_noise_rad.unwrap();
    let joints: Vec<Joints> = points.iter().map(|p| p.joints_after.unwrap()).collect();
    let n = points.len();
    let alike = DMatrix::from_fn(n, n, |i, j| {
        (-(joints[i] - joints[j]).norm() / ALIKE_RAD).exp() + if i == j { 1e-9 } else { 0.0 }
    });
    let factor = Cholesky::new(alike).unwrap().unpack();
    let slopes: Vec<[Vector3<f64>; 6]> = points
        .iter()
        .map(|point| {
            std::array::from_fn(|j| {
                let mut by = [0.0; 6];
                by[j] = 1e-4;
                displaced(known, point, &by) / 1e-4
            })
        })
        .collect();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut out = DMatrix::zeros(3 * n, count);
    for mut column in out.column_iter_mut() {
        for joint in 0..6 {
            let own = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut rng));
            let errors: DVector<f64> = &factor * own * rad[joint];
            for k in 0..n {
                let mut at = column.fixed_rows_mut::<3>(3 * k);
                at += slopes[k][joint] * errors[k];
            }
        }
    }
    out
}

fn rms(errors: &DMatrix<f64>) -> f64 {
    (errors.norm_squared() / (errors.len() / 3) as f64).sqrt()
}

fn rms_of(sigmas: impl Iterator<Item = f64>) -> f64 {
    let squares: Vec<f64> = sigmas.map(|sigma| sigma * sigma).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn every_sigma_counts_the_errors_that_the_model_does_not_contain() {
    let (source, joints) = blade();
    let known = erring(1e-4, &joints);
    let plan = planned(&source, &known, Placement::Shape);
    let points = some(&plan);
    let errors = drawn(&known, &points, 400);
    let positions: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
    let shape = &errors - rigid(&positions) * &errors;
    let stated = rms_of(points.iter().filter_map(|p| p.shape_sigma_mm));
    assert!((stated / rms(&shape) - 1.0).abs() < 0.08, "shape: {stated} stated, {} drawn", rms(&shape));
    let of_cuts = rms_of(plan.cuts.iter().map(|cut| cut.shape_sigma_mm));
    assert!((of_cuts / rms(&shape) - 1.0).abs() < 0.15, "cuts: {of_cuts} stated, {} drawn", rms(&shape));
    // What moves the whole part is no error of its shape.
    let placed = rms(&(&errors - &shape));
    let placement = &plan.placements[0];
    assert!(
        (placement.sigma_mm / placed - 1.0).abs() < 0.08,
        "{} stated, {placed} drawn",
        placement.sigma_mm
    );
    let plan = planned(&source, &known, Placement::Absolute);
    let stated = rms_of(some(&plan).iter().filter_map(|p| p.sigma_mm));
    assert!((stated / rms(&errors) - 1.0).abs() < 0.08, "{stated} stated, {} drawn", rms(&errors));
    assert!(plan.notes.iter().any(|note| note.contains("every σ includes the 0.060 mm")), "{:?}", plan.notes);
}

#[test]
fn the_risk_of_a_cut_counts_them_too() {
    let (source, joints) = blade();
    // Errors as large as the correction.
    let known = erring(2e-3, &joints);
    for (placement, least) in [(Placement::Absolute, 0.03), (Placement::Shape, 0.01)] {
        let plan = planned(&source, &known, placement);
        let points = some(&plan);
        let errors = drawn(&known, &points, 2000);
        let positions: Vec<Vector3<f64>> = points.iter().map(|p| p.intended.translation.vector).collect();
        let rigid = rigid(&positions);
        let before = |p: &&PathPoint| p.base_from_object.rotation * p.before.unwrap().vector_mm;
        let mut correction =
            DVector::from_iterator(3 * points.len(), points.iter().flat_map(|p| before(p).data.0[0]));
        let mut left = errors.clone();
        if placement == Placement::Shape {
            correction -= &rigid * &correction;
            left -= &rigid * &errors;
        }
        let harmed =
            left.column_iter().filter(|e| e.dot(&correction) < -0.5 * correction.norm_squared()).count();
        let (harmed, stated) = (harmed as f64 / 2000.0, plan.probability_of_harm.unwrap());
        assert!(
            stated > least && (stated - harmed).abs() < 0.05,
            "{placement:?}: {stated} stated, {harmed} drawn"
        );
    }
}

#[test]
fn a_longer_tool_is_known_less_well() {
    let (_, joints) = blade();
    let known = erring(1e-4, &joints);
    let arm = known.model.at_condition(&known.condition);
    let sigma = |mm: f64| known.position_sigma_mm(&arm, &joints[0], &Pose::translation(mm, 0.0, 100.0), None);
    assert!(sigma(600.0) > 1.4 * sigma(0.0), "{} {}", sigma(600.0), sigma(0.0));
}

/// What uncertain causes make of the measurement stands in the covariance that lists them at size 0: it is not told a second time as lying
/// beyond every σ.
#[test]
fn what_uncertain_causes_explain_is_not_beyond_every_sigma() {
    let (source, joints) = blade();
    let mut known = estimated(perturbed(4, 1.0), &joints);
    known.covariance *= 0.0;
    known.beyond_noise_mm = Some(0.08);
    let notes = |known: &Estimated| planned(&source, known, Placement::Shape).notes.join("; ");
    assert!(notes(&known).contains("beyond every σ"), "{}", notes(&known));
    known.model.effects.push(Effect::GearEccentricity(Harmonic {
        joint: 0,
        order: 1.0,
        cosine_rad: 0.0,
        sine_rad: 0.0,
    }));
    assert!(notes(&known).contains("included in every σ but not corrected"), "{}", notes(&known));
    assert!(!notes(&known).contains("beyond every σ"), "{}", notes(&known));
}

/// Without repeated poses nobody knows what the model lacks: a σ that is far smaller than the held-out error must not stand without a word.
#[test]
fn a_sigma_far_below_the_held_out_error_is_not_left_without_a_word() {
    let (source, joints) = blade();
    let mut known = estimated(perturbed(4, 1.0), &joints);
    known.covariance *= 0.0;
    let notes = |known: &Estimated| planned(&source, known, Placement::Shape).notes.join("; ");
    assert!(!notes(&known).contains("repeated poses"), "{}", notes(&known));
    known.calibrated.held_out.rmse = 0.089;
    assert!(
        notes(&known).contains("held-out error of 0.089 mm RMSE, and too few poses were repeated"),
        "{}",
        notes(&known)
    );
    // Repeated poses that explain the rest.
    known.beyond_noise_mm = Some(0.0);
    assert!(!notes(&known).contains("repeated poses"), "{}", notes(&known));
}
