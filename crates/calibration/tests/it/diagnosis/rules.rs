//! Rules of confirmation and of merged findings: the order of rows does not prove backlash in a joint that moves by equal steps, and the causes of
//! one finding are removed together.

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::catalogue::Candidate;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::contribution::Contributions;
use truegrind_calibration::diagnosis::design::Linear;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::extension::{FreeParameters, Subject, fit};
use truegrind_calibration::diagnosis::finding::{Confidence, Finding};
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};

use super::scenarios;
use super::simulator::{Hidden, Log, Setup, run};

fn arm() -> Model {
    robots::load("abb-irb-120").unwrap().model
}

fn diagnosed(dataset: &Dataset) -> Diagnosed {
    let arm = arm();
    diagnose(dataset, "arm", &arm, &scenarios::frames(dataset, &arm), &Options::default(), &|_| {}).unwrap()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Tracker readings of the data sheet's arm whose `joint` walks with the steps that `step` draws, and which is off by half of `play_rad`
/// to the side from which it came. The log has no sides.
fn walked(joint: usize, play_rad: f64, step: impl Fn(&mut ChaCha8Rng) -> f64) -> Dataset {
    let (arm, mut rng) = (arm(), ChaCha8Rng::seed_from_u64(71));
    let target = Point3::new(20.0, -30.0, 80.0);
    let mut at = 0.0_f64;
    let rows: Vec<Row> = (0..300)
        .map(|number| {
            let length = step(&mut rng);
            let up = if at.abs() > 0.7 { at < 0.0 } else { rng.random_range(0..2) == 0 };
            let side = if up { 1.0 } else { -1.0 };
            at += side * length;
            let mut q = Joints::from_fn(|_, _| rng.random_range(-0.8..0.8));
            q[joint] = at;
            let mut actual = q;
            actual[joint] -= 0.5 * play_rad * side;
            let seen = (arm.forward(&actual, &Condition::default()) * target).coords;
            let noise = Vector3::from_fn(|_, _| 0.02 * normal(&mut rng));
            Row::new(number, q, Reading::Position(seen + noise))
        })
        .collect();
    Dataset::new("walk.csv", Sensor::Position, rows)
}

fn backlash(found: &Diagnosed) -> &Finding {
    found.diagnosis.findings.iter().find(|f| f.effect == "backlash").expect("the play is found")
}

/// Sides that were taken from the order of the rows are, in a joint that moves by steps of one size, the steps themselves: what follows
/// them may be a reading before the arm stood still.
#[test]
fn equal_steps_do_not_prove_play_by_the_order_of_the_rows() {
    let uneven = diagnosed(&walked(2, 1e-3, |rng| rng.random_range(0.05..0.6)));
    assert_eq!(backlash(&uneven).confidence, Confidence::Identified);
    let even = diagnosed(&walked(2, 1e-3, |_| 0.3));
    assert_eq!(backlash(&even).confidence, Confidence::Ambiguous, "{:?}", backlash(&even));
    assert!(even.estimated.model.effects.iter().all(Effect::is_zero), "it moves no program");
}

/// With several causes in one finding, what they explain is judged with all of them taken out of the model. Taken out one at a time, each
/// leaves its share to the other, and two descriptions of one gear would explain next to nothing.
#[test]
fn causes_of_one_finding_are_no_rivals_of_each_other() {
    let nominal = arm();
    let setup = Setup {
        sensor: Sensor::Position,
        rows: 150,
        sigma_mm: 0.05,
        dirty: false,
        seed: 12,
        log: Log::default(),
    };
    let gear = |order: f64| Hidden::Gear { joint: 1, order, peak_rad: 1.5e-3, phase: 0.4 };
    let data = run(&nominal, &[gear(1.0)], &setup).dataset;
    let (prepared, frames, options) =
        (prepare(&data, &nominal, true), scenarios::frames(&data, &nominal), Options::default());
    let subject = Subject {
        observed: &prepared.observed,
        nominal: &nominal,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    let causes: Vec<Cause> = [gear(1.0), gear(1.15)].iter().filter_map(scenarios::cause).collect();
    let fitted = fit(&subject, &causes, FreeParameters::All, None);
    let linear = Linear::of(&subject, &fitted);
    let whole = linear.whole();
    let contributions = Contributions::new(&subject, &fitted, &whole);
    // The long way: the smaller model's own basis, and the push as residuals that everything left in the model is fitted to.
    let expected = |told: &[usize]| {
        let places: Vec<usize> = told.iter().flat_map(|&k| fitted.parameter_indices(k)).collect();
        let push = told.iter().fold(DVector::zeros(linear.design(&[]).rows()), |sum, &k| {
            let columns = Candidate::of(&fitted.causes[k], &subject).columns(&whole.design);
            sum + columns * DVector::from_vec(fitted.causes[k].values())
        });
        let design = linear.design(&places);
        let push = DMatrix::from_columns(&[push]);
        let rest = design.pure(&push, &design.project(&push));
        let mm = &design.slopes.mm;
        let square: f64 = rest.iter().zip(mm).map(|(v, mm)| (v * mm).powi(2)).sum();
        (square / design.observations as f64).sqrt()
    };
    for told in [vec![0], vec![1], vec![0, 1]] {
        let (found, expected) = (contributions.unique_rms_mm(&told), expected(&told));
        assert!((found / expected - 1.0).abs() < 1e-6, "{told:?}: {found} against {expected}");
    }
    let (both, single) = (
        contributions.unique_rms_mm(&[0, 1]),
        contributions.unique_rms_mm(&[0]).max(contributions.unique_rms_mm(&[1])),
    );
    assert!(both > 1.5 * single, "{both} mm together, {single} mm at most alone");
    assert_eq!(contributions.unique_rms_mm(&[]), 0.0);
}

/// On a grid the rows that are held out stand at the angles of the others: the diagnosis says at which joints. Of joints that stood at
/// other angles in every pose it says nothing.
#[test]
fn single_angles_of_a_grid_are_named() {
    let (arm, mut rng) = (arm(), ChaCha8Rng::seed_from_u64(5));
    let levels = [-0.6, 0.0, 0.6];
    let rows = (0..81).map(|number| {
        let mut q = Joints::from_fn(|_, _| rng.random_range(-0.8..0.8));
        // Joints 1 to 4 step through the grid; an arm stops within some thousandths of a degree.
        for (joint, place) in [27, 9, 3, 1].into_iter().enumerate() {
            q[joint] = levels[number / place % 3] + 2e-5 * normal(&mut rng);
        }
        let seen = (arm.forward(&q, &Condition::default()) * Point3::new(20.0, -30.0, 80.0)).coords;
        let noise = Vector3::from_fn(|_, _| 0.02 * normal(&mut rng));
        Row::new(number, q, Reading::Position(seen + noise))
    });
    let grid = diagnosed(&Dataset::new("grid.csv", Sensor::Position, rows.collect::<Vec<Row>>()));
    let told = |found: &Diagnosed| -> Option<String> {
        found.diagnosis.notes.iter().find(|note| note.contains("at a few angles only")).cloned()
    };
    let note = told(&grid).expect("a note");
    assert!(note.contains("(joint 1 at 3, joint 2 at 3, joint 3 at 3, joint 4 at 3)"), "{note}");
    assert_eq!(told(&diagnosed(&walked(2, 0.0, |rng| rng.random_range(0.05..0.6)))), None);
}
