//! The judge: what it calls true and false, and that its figures are right where the answer is known.

use std::collections::BTreeSet;

use nalgebra::{UnitQuaternion, Vector3};
use truegrind_unseen::arms::{Pose, SHEETS, Strain};
use truegrind_unseen::draw::{Purpose, between, generator, normal};
use truegrind_unseen::sensors::Kind as Measures;
use truegrind_unseen::shape::distance;
use truegrind_unseen::stability::same;
use truegrind_unseen::statistics::{quantile, wilson};
use truegrind_unseen::truth::{Family, Kind, Mark, Meaning, NAMES, Parts, SOMETHING_ELSE, Truth, meanings};
use truegrind_unseen::under_test::{Finding, Fresh};

#[test]
fn a_name_means_one_family_and_a_kind_has_one_name() {
    let names: BTreeSet<&str> = NAMES.iter().map(|n| n.0).chain(SOMETHING_ELSE).collect();
    assert_eq!(names.len(), NAMES.len() + SOMETHING_ELSE.len());
    let kinds: BTreeSet<&str> = Kind::ALL.iter().map(|k| k.name()).collect();
    assert_eq!(kinds.len(), Kind::ALL.len());
    for kind in Kind::ALL {
        for measures in [Measures::Cable, Measures::Position, Measures::Pose] {
            assert_eq!(kind.families(measures).is_empty(), kind == Kind::Clean, "{kind:?}");
        }
    }
}

/// A warm-up is told of the arm, of the stand and of the cable's zero by one name, and by one finding of several; what moves is in
/// its parameters.
#[test]
fn a_thermal_drift_is_of_what_its_parameters_move() {
    let of = |names: &[&str]| {
        meanings("thermal-drift", &names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>())
    };
    let cause = Meaning::Cause;
    assert_eq!(of(&["growth"]), [cause(Family::Thermal)]);
    assert_eq!(of(&["x", "y", "z", "rx"]), [cause(Family::Frame)]);
    assert_eq!(of(&["offset"]), [cause(Family::Zero)]);
    assert_eq!(of(&["growth", "x", "y", "z"]), [cause(Family::Thermal), cause(Family::Frame)]);
    assert_eq!(of(&[]), [cause(Family::Thermal)]);
}

#[test]
fn a_joint_that_has_nothing_is_false_and_an_unknown_name_too() {
    let truth = Truth { kind: Kind::TwoJointGear, families: vec![Family::Gear], parts: Parts::joint(2) };
    let mark = |effect: &str, joints: Option<&[usize]>| truth.mark(effect, meanings(effect, &[])[0], joints);
    assert_eq!(mark("gear-transmission", Some(&[3])), Mark::True);
    assert_eq!(mark("gear-transmission", Some(&[2])), Mark::WrongJoint);
    assert_eq!(mark("joint-coupling", Some(&[2, 3])), Mark::True);
    assert_eq!(mark("joint-coupling", Some(&[3, 2])), Mark::WrongJoint);
    assert_eq!(mark("gear-ratio", Some(&[2, 3])), Mark::WrongJoint);
    assert_eq!(mark("drive", None), Mark::True);
    assert_eq!(mark("backlash", Some(&[3])), Mark::WrongFamily);
    assert_eq!(mark("a-name-of-tomorrow", Some(&[3])), Mark::WrongFamily);
    assert_eq!(mark("unexplained", None), Mark::None);
}

/// A bending link is told as the yielding of a joint beside it, or by the link's own number; a warm link by the link's.
#[test]
fn links_are_told_by_their_own_numbers() {
    let parts = Parts { joints: vec![3, 5], links: vec![3, 4] };
    let bends = Truth { kind: Kind::Bending, families: vec![Family::Compliance], parts: parts.clone() };
    let warm = Truth { kind: Kind::WarmLinks, families: vec![Family::Thermal], parts };
    let mark = |truth: &Truth, effect: &str, part: usize| {
        truth.mark(effect, meanings(effect, &[])[0], Some(&[part]))
    };
    assert_eq!(
        [3, 4, 5].map(|part| mark(&bends, "joint-compliance", part)),
        [Mark::True, Mark::WrongJoint, Mark::True]
    );
    assert_eq!(
        [3, 4, 5].map(|part| mark(&bends, "link-bending", part)),
        [Mark::True, Mark::True, Mark::WrongJoint]
    );
    assert_eq!(
        [3, 4, 5].map(|part| mark(&warm, "link-growth", part)),
        [Mark::True, Mark::True, Mark::WrongJoint]
    );
}

/// Where nothing is hidden no name is true, whatever it is.
#[test]
fn noise_has_no_true_name_of_a_part() {
    for kind in [Kind::Clean, Kind::Correlated] {
        assert!(!kind.has_a_part());
        let truth = Truth { kind, families: kind.families(Measures::Position), parts: Parts::default() };
        for (name, family) in NAMES {
            let right = truth.mark(name, meanings(name, &[])[0], None) == Mark::True;
            assert_eq!(right, kind == Kind::Correlated && family == Family::Noise, "{name}");
        }
    }
}

/// A model that differs by its base and by the point on the flange has the same shape; one that differs in a link has not.
#[test]
fn the_shape_of_a_model_does_not_see_base_and_target() {
    let sheet = &SHEETS[1];
    let arm = sheet.nominal();
    let mut rng = generator(3, 0, 0, 0, Purpose::Clean);
    let poses: Vec<Pose> = (0..200)
        .map(|_| {
            arm.flange(&sheet.room_deg.map(|[l, h]| between(&mut rng, l, h).to_radians()), &Strain::default())
        })
        .collect();
    let point = Vector3::new(20.0, -10.0, 80.0);
    let base = Pose::from_parts(
        Vector3::new(0.4, -0.3, 0.2).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(3e-4, -2e-4, 5e-4)),
    );
    let target = Pose::translation(0.3, 0.1, -0.2);
    let moved: Vec<Pose> = poses.iter().map(|pose| base * pose * target).collect();
    let found = distance(&poses, &moved, &point);
    assert!(found.as_is > 0.3 && found.shape < 1e-3, "{found:?}");
    // Five micrometres of normal noise keep their size but for the nine numbers that were fitted.
    let noisy: Vec<Pose> = poses
        .iter()
        .map(|p| {
            let push = Vector3::from_fn(|_, _| 0.005 * truegrind_unseen::draw::normal(&mut rng));
            Pose::from_parts((p.translation.vector + push).into(), p.rotation)
        })
        .collect();
    let found = distance(&poses, &noisy, &point);
    let expected = 0.005 * 3.0_f64.sqrt();
    assert!(
        (found.as_is / expected - 1.0).abs() < 0.1
            && found.shape < found.as_is
            && found.shape > 0.9 * expected
    );
}

#[test]
fn findings_are_the_same_in_any_order_and_with_rows_that_nearly_agree() {
    let finding = |effect: &str, joint: Option<usize>, rows: Option<[usize; 2]>| Finding {
        effect: effect.to_owned(),
        parameters: Vec::new(),
        joints: joint.map(|j| vec![j]),
        rows,
        identified: true,
    };
    let a = [finding("gear-ratio", Some(1), None), finding("sensor-zero-shift", None, Some([0, 99]))];
    let b = [finding("sensor-zero-shift", None, Some([10, 99])), finding("gear-ratio", Some(1), None)];
    let c = [finding("sensor-zero-shift", None, Some([30, 99])), finding("gear-ratio", Some(1), None)];
    let d = [finding("gear-ratio", Some(2), None), finding("sensor-zero-shift", None, Some([0, 99]))];
    assert!(same(&a, &b) && !same(&a, &c) && !same(&a, &d) && !same(&a, &a[..1]) && same(&[], &[]));
    let twice = [a[0].clone(), a[0].clone()];
    assert!(!same(&twice, &a));
}

/// Wilson's interval of 1 in 20, by the formula of 1927 worked out by hand.
#[test]
fn intervals_and_quantiles() {
    let (low, high) = wilson(1, 20);
    assert!((low - 0.008_881).abs() < 1e-5 && (high - 0.236_131).abs() < 1e-5, "{low} {high}");
    assert_eq!(wilson(0, 0), (0.0, 1.0));
    assert_eq!(quantile(&[3.0, 1.0, 2.0, 5.0], 0.5), Some(2.5));
    assert_eq!(quantile(&[], 0.5), None);
}

/// The judge shares no code with what it judges: one file of it names the tool, and nothing of the tool names the judge.
#[test]
fn only_one_file_names_the_tool() {
    fn sources(folder: &std::path::Path, out: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                sources(&path, out);
            } else if path.extension().is_some_and(|e| e == "rs") {
                out.push(path);
            }
        }
    }
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&here.join("src"), &mut files);
    assert!(files.len() > 15);
    for file in files {
        let names = std::fs::read_to_string(&file).unwrap().contains("use truegrind_");
        assert_eq!(names, file.ends_with("under_test.rs"), "{}", file.display());
    }
    let mut tool = Vec::new();
    for part in ["crates/arm/src", "crates/calibration/src", "crates/estimation/src", "crates/math/src"] {
        sources(&here.join("..").join(part), &mut tool);
    }
    for file in tool {
        assert!(!std::fs::read_to_string(&file).unwrap().contains("truegrind_unseen"), "{}", file.display());
    }
}

/// What chance alone leaves within 10 % is counted among fresh series, so that noise that wanders counts as what it is.
#[test]
fn chance_allows_what_fresh_series_show() {
    let mut rng = generator(1, 2, 3, 4, Purpose::Noise);
    let mut chance = |keep: f64, rows: usize| {
        let mut state = normal(&mut rng);
        let mut series = || {
            let errors = (0..rows).map(|_| {
                state = keep * state + (1.0 - keep * keep).sqrt() * normal(&mut rng);
                state
            });
            let errors: Vec<f64> = errors.collect();
            (errors.iter().map(|e| 2.0 * e).collect(), errors)
        };
        let all: Vec<(Vec<f64>, Vec<f64>)> = (0..400).map(|_| series()).collect();
        let fresh = Fresh::of(&all);
        assert!(
            (fresh.extended_mm - 1.0).abs() < 0.05
                && (fresh.geometry_mm - 2.0 * fresh.extended_mm).abs() < 1e-9
        );
        fresh.near_by_chance()
    };
    // σ of the logarithm of a root mean square is 1 / √(2 n), for n independent errors: Φ(1.348) − Φ(−1.490) and Φ(3.01) − Φ(−3.33).
    let (few, many) = (chance(0.0, 100), chance(0.0, 500));
    assert!((few - 0.843).abs() < 0.06 && (many - 0.998).abs() < 0.01, "{few} {many}");
    // Squares of errors that correlate by ρ count as n (1 − ρ²) / (1 + ρ²) of them, here 20: Φ(0.603) − Φ(−0.666).
    let wandering = chance(0.96, 500);
    assert!((wandering - 0.475).abs() < 0.1, "{wandering}");
}
