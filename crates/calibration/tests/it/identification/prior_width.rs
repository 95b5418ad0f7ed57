//! The tolerances of an arm as its own rows tell them.

use nalgebra::DMatrix;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::prior_width::learned;
use truegrind_calibration::identification::tolerance::Tolerance;
use truegrind_estimation::estimate::{Estimate, Evaluations, Termination};
use truegrind_estimation::problem::Prior;

use super::promise::Case;

fn widths(found: &Identification) -> [f64; 3] {
    let of = |is: fn(LinkCoordinate) -> bool| {
        let place = found.geometry.parameters.iter().position(|p| match p {
            Parameter::Link { coordinate, .. } => is(*coordinate),
            _ => false,
        });
        found.geometry.priors[place.unwrap()].sigma
    };
    [
        of(LinkCoordinate::is_length),
        of(|c| c == LinkCoordinate::Alpha).to_degrees(),
        of(|c| c == LinkCoordinate::Theta).to_degrees(),
    ]
}

/// Arms twice as good and twice as bad as the usual one: their widths, mean of eight arms each, are found within a third.
#[test]
fn how_well_an_arm_is_made_shows_in_its_rows() {
    for spread in [0.5, 2.0] {
        let mut logs = [0.0; 3];
        for seed in 1..9 {
            let case = Case {
                robot: "abb-irb-120",
                cable: false,
                rows: 150,
                noise_mm: 0.02,
                scale: 0.0,
                spread,
                seed,
            };
            let found = widths(&case.outcome().found.unwrap());
            (0..3).for_each(|k| logs[k] += (found[k] / ([0.25, 0.03, 0.1][k] * spread)).ln() / 8.0);
        }
        for (name, log) in ["lengths", "twists", "zeros"].iter().zip(logs) {
            assert!(log.abs() < 1.33_f64.ln(), "{name} at {spread}: {:.2} times the drawn width", log.exp());
        }
    }
}

/// An estimate of two lengths and two joint zeros, each with the standard deviation that its readings alone would give it.
fn estimate(x: [f64; 4], sigma: [f64; 4], catalogue: &Tolerance) -> (Vec<Parameter>, Vec<Prior>, Estimate) {
    let link = |joint, coordinate| Parameter::Link { joint, coordinate };
    let parameters = vec![
        link(0, LinkCoordinate::A),
        link(1, LinkCoordinate::A),
        link(0, LinkCoordinate::Theta),
        link(1, LinkCoordinate::Theta),
    ];
    let wide = [catalogue.length_mm, catalogue.length_mm, catalogue.zero_rad, catalogue.zero_rad];
    let priors = wide.map(|sigma| Prior { mean: 0.0, sigma }).to_vec();
    let variance = |k: usize| (sigma[k].powi(-2) + wide[k].powi(-2)).recip();
    let estimate = Estimate {
        x: (0..4).map(|k| x[k] * variance(k) / sigma[k].powi(2)).collect(),
        covariance: Some(DMatrix::from_fn(4, 4, |i, j| if i == j { variance(i) } else { 0.0 })),
        cost: 0.0,
        evaluations: Evaluations::default(),
        termination: Termination::Cost,
        trace: Vec::new(),
    };
    (parameters, priors, estimate)
}

#[test]
fn rows_that_say_nothing_leave_the_catalogue() {
    let catalogue = Tolerance::default();
    let (parameters, priors, nothing) = estimate([0.0; 4], [1e6; 4], &catalogue);
    let found = learned(&catalogue, &parameters, &priors, &nothing);
    assert!((found.length_mm / catalogue.length_mm - 1.0).abs() < 1e-3, "{found:?}");
    assert!((found.zero_rad / catalogue.zero_rad - 1.0).abs() < 1e-3, "{found:?}");
    // And what is not a link, or has no covariance, is none of its business.
    let without = Estimate { covariance: None, ..nothing };
    assert_eq!(learned(&catalogue, &parameters, &priors, &without), catalogue);
    assert_eq!(learned(&catalogue, &[Parameter::Target(0)], &priors[..1], &without), catalogue);
}

#[test]
fn small_lengths_that_are_seen_narrow_lengths_and_leave_zeros() {
    let catalogue = Tolerance::default();
    let (parameters, priors, seen) = estimate([0.1, -0.1, 0.0, 0.0], [0.01, 0.01, 1e6, 1e6], &catalogue);
    let found = learned(&catalogue, &parameters, &priors, &seen);
    assert!((0.1..0.5).contains(&found.length_mm), "{found:?}");
    assert!((found.zero_rad / catalogue.zero_rad - 1.0).abs() < 1e-3, "{found:?}");
}
