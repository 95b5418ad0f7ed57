//! Files of arms: what they hold is an arm's, whatever number a file was given.
//!
//! The class: a number from a file that is not finite, or that no arm has, reaches a loop that waits for it to become small
//! or a maximum that passes over it. Each number of a complete file is put wrong in turn; either the file is refused, or
//! everything that is computed from it is finite and ends.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use truegrind_arm::arm_file::ArmFile;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::{
    Estimated, EstimatedParameter, FlangePoint, Judgement, Provenance, StageErrors, Verdict, WidthUncertainty,
};
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Body, Joints, Model};
use truegrind_arm::parameter::{LinkCoordinate, Parameter, arm_parameters};
use truegrind_arm::region::Region;
use truegrind_math::se3::Pose;
use truegrind_math::statistics::ErrorSummary;

use truegrind_testing::absurd;

/// One effect of every kind.
const EFFECTS: &str = r#"
[[effect]]
effect = "joint-compliance"
joint = 1
compliance_rad_per_nm = 1e-6
[[effect]]
effect = "joint-compliance-lumped"
joint = 2
lump = [{ frame = 3, axis = 1, factor = 1e-6 }, { frame = 4, moment = 2, factor = 2e-6 }]
[[effect]]
effect = "gear-eccentricity"
joint = 0
order = 1.0
sine_rad = 1e-4
cosine_rad = -2e-4
[[effect]]
effect = "gear-transmission-map"
joint = 4
knots_rad = [1e-4, 0.0, -1e-4, 2e-5]
[[effect]]
effect = "gear-ratio"
joint = 3
error = 1e-4
[[effect]]
effect = "joint-coupling"
joint = 5
driver = 4
factor = 2e-4
[[effect]]
effect = "backlash"
joint = 5
play_rad = 1e-4
[[effect]]
effect = "thermal-drift"
growth = 1e-4
time_constant_h = 1.5
growth_per_k = 1e-5
reference_c = 20.0
[[effect]]
effect = "smooth-correction"
centres_rad = [[0.1, 0.2, 0.3]]
reach_rad = 1.0
weights_rad = [[1e-4, 2e-4, 3e-4]]
"#;

fn nominal() -> Model {
    truegrind_arm::robots::load("abb-irb-120").unwrap().model
}

/// The nominal arm with masses and effects.
fn whole() -> Model {
    #[derive(serde::Deserialize)]
    struct Effects {
        effect: Vec<Effect>,
    }
    let mut model = nominal();
    model.links[1].a_mm += 0.3;
    model.bodies = Some([Body { mass_kg: 3.5, centre_mm: [10.0, -20.0, 30.0] }; 6]);
    model.effects = toml::from_str::<Effects>(EFFECTS).unwrap().effect;
    model
}

/// A model with every key that a file may have.
fn complete() -> Estimated {
    let model = whole();
    // The rows of a covariance are alike: two links stand for six.
    let order: Vec<Parameter> = arm_parameters(&model)
        .into_iter()
        .filter(|p| !matches!(p, Parameter::Link { joint: 2.., .. }))
        .collect();
    let n = order.len();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let half = DMatrix::from_fn(n, n, |_, _| random.random_range(-1e-3..1e-3));
    let joints: Vec<Joints> =
        (0..4).map(|_| Joints::from_fn(|_, _| random.random_range(-1.0..1.0))).collect();
    let errors = ErrorSummary::of([0.1, -0.2, 0.05]);
    let stage = StageErrors { fitted: errors, held_out: errors };
    Estimated {
        robot: "abb-irb-120".into(),
        nominal: nominal(),
        parameters: order
            .iter()
            .map(|parameter| EstimatedParameter {
                name: parameter.to_string(),
                unit: parameter.unit().into(),
                nominal: match *parameter {
                    Parameter::Link { joint, coordinate } => nominal().links[joint].get(coordinate),
                    _ => 0.5,
                },
                value: match *parameter {
                    Parameter::Link { joint, coordinate } => model.links[joint].get(coordinate),
                    _ => 0.25,
                },
                sigma: 0.125,
                prior_sigma: Some(0.5),
                determined: 0.75,
            })
            .collect(),
        covariance: &half * half.transpose(),
        width_uncertainty: Some(WidthUncertainty {
            log_mean: [-0.1, 0.05, -0.2],
            log_covariance: [[0.2, 0.01, 0.02], [0.01, 0.3, 0.03], [0.02, 0.03, 0.4]],
        }),
        order,
        provenance: Provenance { rows: 4, set_aside: vec![2], held_out: 0.2, ..Provenance::default() },
        registered: stage,
        calibrated: stage,
        noise_floor_mm: Some(0.02),
        beyond_noise_mm: None,
        beyond_noise_rad: Some([1e-4, 1e-4, 1e-4, 2e-4, 2e-4, 3e-4]),
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(&joints, 1.0),
        condition: Condition {
            time_h: Some(1.0),
            temperature_c: Some(21.5),
            payload_kg: Some(2.5),
            payload_centre_mm: [1.5, 2.5, 30.5],
            approach: [1, -1, 0, 0, 1, 1],
        },
        model,
    }
}

/// Everything of an arm that a program needs, at one pose.
fn used(nominal: &Model, model: &Model, condition: &Condition) -> bool {
    let joints = Joints::new(0.1, -0.2, 0.3, 0.4, 0.5, -0.6);
    let target = nominal.forward(&joints, condition);
    let inverse = Inverse::new(model, condition, nominal);
    let _ = inverse.all(&target);
    let near = inverse.solve_near(&target, &joints).ok();
    target.translation.vector.iter().all(|v| v.is_finite())
        && inverse.smallest_singular_value(&joints).is_finite()
        && near.is_none_or(|solution| solution.joints.iter().all(|q| q.is_finite()))
}

#[test]
fn a_model_with_any_number_wrong_is_refused_or_computes_finite_numbers() {
    let text = complete().to_toml().unwrap();
    assert!(Estimated::from_toml(&text).is_ok());
    let refused: usize = absurd::each(&text)
        .par_bridge()
        .map(|(said, text)| match Estimated::from_toml(&text) {
            Err(error) => {
                let message = error.to_string();
                assert!(
                    message.contains("expected") || message.contains("not a truegrind model"),
                    "{message}"
                );
                1
            }
            Ok(model) => {
                let posed = model.model.at_condition(&model.condition);
                let joints = Joints::new(0.1, -0.2, 0.3, 0.4, 0.5, -0.6);
                let point = FlangePoint { joints, flange_from_tool: Pose::identity(), carried: None };
                let sigma = model.position_sigmas_mm(&posed, &[point])[0];
                assert!(sigma.is_finite() && sigma >= 0.0, "{said}: σ {sigma}");
                // The rest of the arm stands still where a link, effect or condition was changed by little.
                if said.contains("1e-308") || said.contains("-1 ") {
                    assert!(used(&model.nominal, &model.model, &model.condition), "{said}");
                }
                0
            }
        })
        .sum();
    // NaN, infinities and 1e308 have no place anywhere but in what is not computed with.
    assert!(refused * 6 >= absurd::each(&text).count() * 4 - 12, "{refused} refused");
}

#[test]
fn an_actual_arm_with_any_number_wrong_is_refused_or_computes_finite_numbers() {
    let text = toml::to_string(&ArmFile::from(&whole())).unwrap();
    absurd::each(&text).par_bridge().for_each(|(said, text)| {
        let Ok(file) = toml::from_str::<ArmFile>(&text) else { return };
        let Ok(model) = file.model() else { return };
        assert!(!said.contains("nan") && !said.contains("inf") && !said.contains("1e308"), "{said}");
        let flange = model.forward(&Joints::repeat(0.3), &Condition::default());
        assert!(flange.translation.vector.iter().all(|v| v.is_finite()), "{said}");
        let _ = Inverse::new(&model, &Condition::default(), &model).all(&flange);
    });
}

#[test]
fn faults_of_a_model_are_named() {
    let text = complete().to_toml().unwrap();
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        Estimated::from_toml(&text.replacen(from, to, 1)).unwrap_err().to_string()
    };
    let first = text.find("lower = [[").unwrap() + "lower = [[".len();
    let end = first + text[first..].find(']').unwrap();
    let with = |number: &str| format!("{}{number}{}", &text[..first], &text[end..]);
    for (number, words) in
        [("nan", "NaN"), ("-1.0", "variances of 0 or more"), ("1e-12", "positive semi-definite")]
    {
        let error = Estimated::from_toml(&with(number)).unwrap_err().to_string();
        assert!(error.starts_with("covariance.lower, row") && error.contains(words), "{error}");
    }
    let error = refused("a_mm = 270.0", "a_mm = 1000000.0");
    assert_eq!(
        error,
        "`nominal`: link 2 a_mm: found 1000000, expected a finite length in mm, within ±10,000"
    );
    let error = refused("name = \"link1.alpha\"", "name = \"link1.theta\"");
    assert!(error.contains("the same parameters in the same order"), "{error}");
    let error = refused("\"effect9.3\"", "\"effect9.4\"");
    assert!(error.contains("parameters that the arm has"), "{error}");
    let error = refused("payload_kg = 2.5", "payload_kg = 1e9");
    assert!(error.starts_with("condition.payload_kg: found 1000000000"), "{error}");
    // A map that is no map of joints: its rows depend on each other.
    let error = refused("joint_map = [[1.0, 0.0,", "joint_map = [[0.0, 1.0,");
    assert!(error.contains("joint_map: found a matrix of determinant"), "{error}");
}

/// The class: two statements of one number. Programs follow the links, and their uncertainty is that of the parameters.
#[test]
fn links_that_contradict_the_parameters_are_refused() {
    let text = complete().to_toml().unwrap();
    let estimated = text.find("[estimated]").unwrap();
    let edited = |from: &str, to: &str| {
        let (before, after) = text.split_at(estimated);
        assert!(after.contains(from), "{from}");
        Estimated::from_toml(&format!("{before}{}", after.replacen(from, to, 1)))
    };
    let error = edited("a_mm = 270.3", "a_mm = 273.3").unwrap_err().to_string();
    assert_eq!(
        error.split(": the estimated arm is").next().unwrap(),
        "estimated.link 2: found 273.3 mm beside parameter link2.a of 270.3 mm, expected the same"
    );
    // The parameter alone, and a link that no parameter stands for.
    let error = edited("value = 270.3", "value = 271.3").unwrap_err().to_string();
    assert!(error.contains("270.3 mm beside parameter link2.a of 271.3 mm"), "{error}");
    let error = edited("d_mm = 302.0", "d_mm = 305.0").unwrap_err().to_string();
    assert!(
        error.contains("estimated.link 4: found 305 mm beside link4.d, which is no parameter"),
        "{error}"
    );
    // Rounding as of an editor is none, and without the list only links that no covariance is of are judged.
    assert!(edited("a_mm = 270.3", "a_mm = 270.3000001").is_ok());
    let mut model = complete();
    model.parameters.clear();
    assert!(Estimated::from_toml(&model.to_toml().unwrap()).is_ok());
}

#[test]
fn a_covariance_of_parameters_that_are_one_is_accepted() {
    let mut model = complete();
    let n = model.order.len();
    model.covariance = DMatrix::from_element(n, n, 1e-6);
    assert!(Estimated::from_toml(&model.to_toml().unwrap()).is_ok());
    model.covariance.fill(0.0);
    assert!(Estimated::from_toml(&model.to_toml().unwrap()).is_ok());
}

/// An iteration that waits for a matrix of NaN to become diagonal never ends.
#[test]
fn the_inverse_ends_on_an_arm_that_is_not_finite() {
    let nominal = nominal();
    let target = nominal.forward(&Joints::repeat(0.2), &Condition::default());
    for number in [f64::NAN, f64::INFINITY, 1e308, 1e-308] {
        let mut map = nominal.clone();
        map.joint_map[(0, 1)] = number;
        let mut link = nominal.clone();
        link.links[2].a_mm = number;
        let mut limit = nominal.clone();
        limit.limits.max_rad[3] = number;
        for arm in [map, link, limit] {
            let _ = Inverse::new(&arm, &Condition::default(), &nominal).all(&target);
            let _ = Inverse::new(&arm, &Condition::default(), &arm).all(&target);
        }
    }
}

#[test]
fn a_name_of_the_catalogue_has_the_links_of_the_catalogue() {
    let nominal = nominal();
    assert!(truegrind_arm::robots::check_catalogue_name("ABB-IRB-120", &nominal).is_ok());
    assert!(truegrind_arm::robots::check_catalogue_name("an-arm-of-my-own", &nominal).is_ok());
    let error = truegrind_arm::robots::check_catalogue_name("ur10", &nominal).unwrap_err().to_string();
    assert!(error.contains("has the name ur10") && error.contains("link 1"), "{error}");
    let mut other = nominal.clone();
    let coordinate = LinkCoordinate::D;
    other.links[3].set(coordinate, other.links[3].get(coordinate) + 0.01);
    assert!(truegrind_arm::robots::check_catalogue_name("abb-irb-120", &other).is_err());
    assert!(
        truegrind_arm::robots::check_same_links(&other, &nominal)
            .unwrap_err()
            .to_string()
            .contains("link 4 d_mm")
    );
    assert!(matches!(complete().order[0], Parameter::Link { joint: 0, .. }));
}
