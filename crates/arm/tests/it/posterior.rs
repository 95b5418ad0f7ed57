//! The posterior under uncertain widths of the tolerances.

use nalgebra::{DMatrix, DVector};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{
    Estimated, EstimatedParameter, Judgement, PosteriorComponent, Provenance, StageErrors, Verdict,
    WidthUncertainty,
};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::{Parameter, link_parameters};
use truegrind_arm::region::Region;
use truegrind_arm::robots;
use truegrind_math::statistics::ErrorSummary;

/// Priors of the links: mm and rad.
const PRIOR: [f64; 3] = [0.8, 4e-3, 3e-3];
/// Logarithms of the ratio of the true widths to these.
const LOGS: [f64; 3] = [0.4, -0.3, 0.7];

/// An arm whose links are determined by readings y = B x + noise, under priors of widths `ratio` · [`PRIOR`].
fn arm(ratio: [f64; 3], width_uncertainty: Option<WidthUncertainty>) -> Estimated {
    let nominal = robots::load("abb-irb-120").unwrap().model;
    let order = link_parameters(&nominal);
    let n = order.len();
    let prior = |k: usize| {
        let group = order[k].tolerance_group().unwrap() as usize;
        PRIOR[group] * ratio[group]
    };
    let rows = 2 * n / 3;
    let wave = |i: usize, j: usize| ((i * 31 + j * 17 + 3) as f64 * 0.73).sin();
    // Fewer readings than parameters: some combinations are seen well, others not at all.
    let slopes = DMatrix::from_fn(rows, n, |i, j| {
        wave(i, j) / (0.3 * PRIOR[order[j].tolerance_group().unwrap() as usize])
    });
    let readings = DVector::from_fn(rows, |i, _| 3.0 * wave(i, 90));
    let mut precision = slopes.tr_mul(&slopes);
    (0..n).for_each(|k| precision[(k, k)] += prior(k).powi(-2));
    let covariance = precision.try_inverse().unwrap();
    let covariance = 0.5 * (&covariance + covariance.transpose());
    let x = &covariance * slopes.tr_mul(&readings);
    let summary = ErrorSummary::of([0.1, -0.2]);
    let stage = StageErrors { fitted: summary, held_out: summary };
    let mut model = nominal.clone();
    for (parameter, deviation) in order.iter().zip(&x) {
        let Parameter::Link { joint, coordinate } = *parameter else { continue };
        let link = &mut model.links[joint];
        link.set(coordinate, link.get(coordinate) + deviation);
    }
    let of = |arm: &Model, k: usize| match order[k] {
        Parameter::Link { joint, coordinate } => arm.links[joint].get(coordinate),
        _ => f64::NAN,
    };
    let parameters = (0..n).map(|k| EstimatedParameter {
        name: order[k].to_string(),
        unit: order[k].unit().to_owned(),
        nominal: of(&nominal, k),
        value: of(&model, k),
        sigma: covariance[(k, k)].sqrt(),
        prior_sigma: Some(prior(k)),
        determined: 0.5,
    });
    Estimated {
        robot: "abb-irb-120".into(),
        model: model.clone(),
        nominal: nominal.clone(),
        parameters: parameters.collect(),
        order: order.clone(),
        covariance,
        width_uncertainty,
        provenance: Provenance::default(),
        registered: stage,
        calibrated: stage,
        noise_floor_mm: None,
        beyond_noise_mm: None,
        beyond_noise_rad: None,
        verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
        region: Region::of(&[Joints::zeros(), Joints::repeat(0.5)], 0.1),
        condition: Condition::default(),
    }
}

fn estimate(arm: &Estimated) -> DVector<f64> {
    DVector::from_iterator(arm.order.len(), arm.parameters.iter().map(|p| p.value - p.nominal))
}

#[test]
fn without_width_uncertainty_the_posterior_is_the_estimate_and_its_covariance() {
    let arm = arm([1.0; 3], None);
    let posterior = arm.posterior();
    assert_eq!(posterior.len(), 1);
    assert_eq!((posterior[0].weight, &posterior[0].covariance), (1.0, &arm.covariance));
    assert_eq!(posterior[0].shift.amax(), 0.0);
}

/// Widths that are known to be others than those assumed give the fit under those other widths.
#[test]
fn a_known_width_gives_the_fit_under_that_width() {
    let sure = WidthUncertainty { log_mean: LOGS, log_covariance: [[0.0; 3]; 3] };
    let assumed = arm([1.0; 3], Some(sure));
    let direct = arm(LOGS.map(f64::exp), None);
    let moved = estimate(&direct) - estimate(&assumed);
    for component in assumed.posterior() {
        for k in 0..moved.len() {
            let scale = assumed.parameters[k].prior_sigma.unwrap();
            assert!((component.shift[k] - moved[k]).abs() < 1e-9 * scale, "shift of {}", assumed.order[k]);
            for j in 0..moved.len() {
                let of = scale * assumed.parameters[j].prior_sigma.unwrap();
                let off = component.covariance[(k, j)] - direct.covariance[(k, j)];
                assert!(off.abs() < 1e-9 * of, "covariance of {} and {}", assumed.order[k], assumed.order[j]);
            }
        }
    }
}

/// Mean and covariance of ln(width) are those of the points that stand for it: seen on a combination that no reading determines,
/// whose standard deviation is the width itself.
#[test]
fn the_components_carry_the_moments_of_the_logarithms() {
    let widths = WidthUncertainty {
        log_mean: [-0.2, 0.1, 0.0],
        log_covariance: [[0.09, 0.02, 0.0], [0.02, 0.16, 0.0], [0.0, 0.0, 0.04]],
    };
    // Hardly any reading: slopes count for nothing beside the priors.
    let mut arm = arm([1.0; 3], Some(widths));
    let n = arm.order.len();
    let prior: Vec<f64> = arm.parameters.iter().map(|p| p.prior_sigma.unwrap()).collect();
    arm.covariance = DMatrix::from_fn(n, n, |i, j| if i == j { prior[i] * prior[i] } else { 0.0 });
    arm.parameters.iter_mut().for_each(|p| p.value = p.nominal);
    let posterior = arm.posterior();
    let total: f64 = posterior.iter().map(|c| c.weight).sum();
    assert!((total - 1.0).abs() < 1e-12);
    let log = |c: &PosteriorComponent, k: usize| 0.5 * (c.covariance[(k, k)] / (prior[k] * prior[k])).ln();
    let mean = |k: usize| posterior.iter().map(|c| c.weight * log(c, k)).sum::<f64>();
    for k in 0..n {
        for j in 0..n {
            let [g, h] = [k, j].map(|k| arm.order[k].tolerance_group().unwrap() as usize);
            let product = |c: &PosteriorComponent| c.weight * (log(c, k) - mean(k)) * (log(c, j) - mean(j));
            let covariance: f64 = posterior.iter().map(product).sum();
            assert!((mean(k) - widths.log_mean[g]).abs() < 1e-9);
            assert!((covariance - widths.log_covariance[g][h]).abs() < 1e-9, "{g} {h}: {covariance}");
        }
    }
}

#[test]
fn a_covariance_without_an_inverse_is_taken_as_it_is() {
    let widths = WidthUncertainty {
        log_mean: [0.0; 3],
        log_covariance: [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
    };
    let mut arm = arm([1.0; 3], Some(widths));
    arm.covariance.fill(0.0);
    let posterior = arm.posterior();
    assert_eq!(posterior.len(), 1);
    assert_eq!(posterior[0].covariance, arm.covariance);
}

#[test]
fn widths_that_are_no_distribution_are_refused_on_loading() {
    let widths =
        |covariance: [[f64; 3]; 3]| WidthUncertainty { log_mean: [0.0; 3], log_covariance: covariance };
    let read = |widths| Estimated::from_toml(&arm([1.0; 3], Some(widths)).to_toml().unwrap());
    let fine = widths([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]);
    assert_eq!(read(fine).unwrap().width_uncertainty, Some(fine));
    let indefinite =
        read(widths([[0.1, 0.5, 0.0], [0.5, 0.1, 0.0], [0.0, 0.0, 0.1]])).unwrap_err().to_string();
    assert!(
        indefinite.contains("width_uncertainty") && indefinite.contains("positive semi-definite"),
        "{indefinite}"
    );
    let lopsided =
        read(widths([[0.1, 0.05, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])).unwrap_err().to_string();
    assert!(lopsided.contains("symmetric"), "{lopsided}");
}
