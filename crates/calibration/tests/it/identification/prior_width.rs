//! The tolerances of an arm as its own rows tell them.

use nalgebra::DMatrix;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::prior_width::{learn_tolerance, width_uncertainty};
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

/// The root mean square of widths over arms, relative to the catalogue's tolerance.
const OVER_ARMS: f64 = 0.5;

#[test]
fn rows_that_say_nothing_leave_the_widths_of_all_arms() {
    let catalogue = Tolerance::default();
    let (parameters, priors, nothing) = estimate([0.0; 4], [1e6; 4], &catalogue);
    let found = learn_tolerance(&catalogue, &parameters, &priors, &nothing);
    assert!((found.length_mm / catalogue.length_mm / OVER_ARMS - 1.0).abs() < 1e-3, "{found:?}");
    assert!((found.zero_rad / catalogue.zero_rad / OVER_ARMS - 1.0).abs() < 1e-3, "{found:?}");
    // And what is not a link, or has no covariance, is none of its business.
    let without = Estimate { covariance: None, ..nothing };
    assert_eq!(learn_tolerance(&catalogue, &parameters, &priors, &without), catalogue);
    assert_eq!(learn_tolerance(&catalogue, &[Parameter::Target(0)], &priors[..1], &without), catalogue);
}

#[test]
fn small_lengths_that_are_seen_narrow_lengths_and_leave_zeros() {
    let catalogue = Tolerance::default();
    let (parameters, priors, seen) = estimate([0.1, -0.1, 0.0, 0.0], [0.01, 0.01, 1e6, 1e6], &catalogue);
    let found = learn_tolerance(&catalogue, &parameters, &priors, &seen);
    assert!((0.1..0.5).contains(&found.length_mm), "{found:?}");
    assert!((found.zero_rad / catalogue.zero_rad / OVER_ARMS - 1.0).abs() < 1e-3, "{found:?}");
}

/// ½ ln E (τ² | rows) by a fine sum over ln τ, for readings of parameters that are made alike and read one by one.
fn summed(readings: &[f64], sigma: f64, catalogue: f64) -> f64 {
    let spread = 1.0_f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for k in -4000..4000 {
        let log = f64::from(k) * 0.002;
        let width = OVER_ARMS * catalogue * log.exp();
        let variance = width * width + sigma * sigma;
        let rows: f64 = readings.iter().map(|y| -0.5 * (y * y / variance + variance.ln())).sum();
        let weight = (rows - 0.5 * (log / spread + spread).powi(2)).exp();
        sum += weight;
        squares += weight * width * width;
    }
    (squares / sum).sqrt()
}

#[test]
fn a_width_is_the_root_of_the_mean_square_under_what_the_rows_say() {
    let catalogue = Tolerance::default();
    for (length, zero) in
        [([0.1, -0.1], [2e-4, 6e-4]), ([0.02, 0.3], [1e-2, -1e-2]), ([2.0, 3.0], [0.0, 0.0])]
    {
        let sigma = [0.02, 0.02, 1e-4, 1e-4];
        let x = [length[0], length[1], zero[0], zero[1]];
        let (parameters, priors, seen) = estimate(x, sigma, &catalogue);
        let found = learn_tolerance(&catalogue, &parameters, &priors, &seen);
        let meant =
            [summed(&length, sigma[0], catalogue.length_mm), summed(&zero, sigma[2], catalogue.zero_rad)];
        assert!(
            (found.length_mm / meant[0]).ln().abs() < 0.03,
            "{x:?}: {} for {}",
            found.length_mm,
            meant[0]
        );
        assert!((found.zero_rad / meant[1]).ln().abs() < 0.03, "{x:?}: {} for {}", found.zero_rad, meant[1]);
        // Of the twists nothing is said.
        assert!((found.angle_rad / catalogue.angle_rad / OVER_ARMS - 1.0).abs() < 1e-3, "{found:?}");
    }
}

/// Arms that are made as differently as arms are, of which five lengths are read and a sixth is not: it lies as far off as is said.
#[test]
fn what_the_rows_do_not_see_lies_as_far_off_as_the_width_says() {
    let catalogue = Tolerance { length_mm: 0.8, ..Tolerance::default() };
    let (mut rng, sigma, arms) = (ChaCha8Rng::seed_from_u64(41), 0.05_f64, 1500);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (mut square, mut within) = (0.0, [0; 3]);
    for _ in 0..arms {
        let width = OVER_ARMS * catalogue.length_mm * (normal() - 1.0).exp();
        let drawn: [f64; 6] = std::array::from_fn(|_| width * normal());
        let prior = catalogue.length_mm;
        let variance = (sigma.powi(-2) + prior.powi(-2)).recip();
        let x = (0..6)
            .map(|k| if k < 5 { (drawn[k] + sigma * normal()) * variance / sigma.powi(2) } else { 0.0 });
        let estimate = Estimate {
            x: x.collect(),
            covariance: Some(DMatrix::from_fn(6, 6, |i, j| match (i == j, i < 5) {
                (false, _) => 0.0,
                (true, true) => variance,
                (true, false) => prior * prior,
            })),
            cost: 0.0,
            evaluations: Evaluations::default(),
            termination: Termination::Cost,
            trace: Vec::new(),
        };
        let parameters: Vec<Parameter> =
            (0..6).map(|joint| Parameter::Link { joint, coordinate: LinkCoordinate::A }).collect();
        let found =
            learn_tolerance(&catalogue, &parameters, &[Prior { mean: 0.0, sigma: prior }; 6], &estimate);
        let off = (drawn[5] / found.length_mm).abs();
        square += off * off / f64::from(arms);
        (0..3).for_each(|k| within[k] += i32::from(off <= (k + 1) as f64));
    }
    let share = within.map(|count| 100.0 * f64::from(count) / f64::from(arms));
    assert!((square - 1.0).abs() < 0.15, "mean square {square:.2}");
    assert!((66.0..77.0).contains(&share[0]) && (92.0..98.0).contains(&share[1]), "{share:?}");
    assert!((98.5..=100.0).contains(&share[2]), "{share:?}");
}

/// Mean and variance of ln (width / prior) agree with a fine sum over ln τ, for the lengths of [`summed`].
#[test]
fn the_uncertainty_of_a_width_is_that_of_its_posterior() {
    let catalogue = Tolerance::default();
    for length in [[0.1, -0.1], [0.02, 0.3], [2.0, 3.0]] {
        let (parameters, priors, seen) =
            estimate([length[0], length[1], 0.0, 0.0], [0.02, 0.02, 1e6, 1e6], &catalogue);
        let found = width_uncertainty(&catalogue, &parameters, &priors, &seen).unwrap();
        let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
        for k in -4000..4000 {
            let log = f64::from(k) * 0.002;
            let variance = log.exp().powi(2) + 0.02_f64.powi(2);
            let rows: f64 = length.iter().map(|y| -0.5 * (y * y / variance + variance.ln())).sum();
            let weight = (rows - 0.5 * ((log - OVER_ARMS.ln()) + 1.0).powi(2)).exp();
            sum += weight;
            first += weight * log;
            second += weight * log * log;
        }
        let (mean, variance) = (first / sum, second / sum - (first / sum).powi(2));
        assert!((found.log_mean[0] - mean).abs() < 0.05, "{length:?}: {} for {mean}", found.log_mean[0]);
        // Five nodes an axis, centred for the mean square of the width: the variance of its logarithm is good to a seventh.
        let own = found.log_covariance[0][0];
        assert!((own / variance - 1.0).abs() < 0.15, "{length:?}: {own} for {variance}");
        // No reading tells of the zeros: the population of arms, ln τ ~ N(ln τ₀ − s², s²).
        assert!((found.log_mean[2] - OVER_ARMS.ln() + 1.0).abs() < 0.05, "{}", found.log_mean[2]);
        assert!((found.log_covariance[2][2] - 1.0).abs() < 0.15, "{}", found.log_covariance[2][2]);
    }
}
