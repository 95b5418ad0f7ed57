//! The uncertainty of a change point, against many draws of a series whose change point is searched.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::change_points::added_squares;
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::identification::fit::{Observations, errors_on};
use truegrind_calibration::measurement::dataset::{Reading, Sensor};
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};

use super::scenarios;
use super::simulator::{Log, Setup, run};

const ROWS: usize = 60;
const SIGMA_MM: f64 = 0.05;

/// Rows of a cable that read exactly what `frames` say, and the frames.
fn exact() -> (Observations, Frames) {
    let nominal = robots::load("abb-irb-120").expect("it ships").model;
    let setup = Setup {
        sensor: Sensor::Cable,
        rows: ROWS,
        sigma_mm: SIGMA_MM,
        dirty: false,
        seed: 4,
        log: Log::default(),
    };
    let dataset = run(&nominal, &[], &setup).dataset;
    let frames = scenarios::frames(&dataset, &nominal);
    let mut observed = prepare(&dataset, &nominal, false).observed;
    let errors = errors_on(&observed, &nominal, &frames);
    shift(&mut observed, |i| errors[i]);
    let left = errors_on(&observed, &nominal, &frames);
    if left.iter().any(|e| e.abs() > 1e-9) {
        // An error is the reading less the model's, so the other sign.
        shift(&mut observed, |i| -2.0 * errors[i]);
    }
    assert!(errors_on(&observed, &nominal, &frames).iter().all(|e| e.abs() < 1e-9));
    (observed, frames)
}

fn shift(observed: &mut Observations, by: impl Fn(usize) -> f64) {
    for (i, row) in observed.dataset.rows.iter_mut().enumerate() {
        if let Reading::Cable(length) = &mut row.reading {
            *length += by(i);
        }
    }
}

/// A standard normal number (Box and Muller 1958).
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v) = (random.random_range(1e-12..1.0_f64), random.random_range(0.0..std::f64::consts::TAU));
    (-2.0 * u.ln()).sqrt() * v.cos()
}

/// Mean growth of the sum of squares in units of σ², stated and found, for a step of some σ whose row is searched.
fn stated_and_found(step: f64, draws: usize) -> ([f64; 2], f64) {
    let nominal = robots::load("abb-irb-120").expect("it ships").model;
    let (observed, frames) = exact();
    let last = observed.dataset.rows[ROWS - 1].number;
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut pairs = Vec::new();
    for _ in 0..draws {
        let truth = random.random_range(20..40_usize);
        let noise: Vec<f64> = (0..ROWS).map(|_| normal(&mut random)).collect();
        let squares = |change: usize| -> f64 {
            (0..ROWS)
                .map(|i| {
                    let [is, said] = [truth, change].map(|change| f64::from(u8::from(i >= change)) * step);
                    (noise[i] + is - said).powi(2)
                })
                .sum()
        };
        let change = (1..ROWS).min_by(|a, b| squares(*a).total_cmp(&squares(*b))).expect("there are rows");
        let mut measured = observed.clone();
        shift(&mut measured, |i| SIGMA_MM * (noise[i] + f64::from(u8::from(i >= truth)) * step));
        let from = measured.dataset.rows[change].number;
        let mut shifted = Disturbance::new(Kind::Zero, Profile::Rows { from, to: last });
        shifted.values[0] = SIGMA_MM * step;
        let mut with_shift = frames.clone();
        with_shift.disturbances.push(shifted);
        let own: f64 = errors_on(&measured, &nominal, &with_shift).iter().map(|e| e * e).sum();
        assert!(
            (own / SIGMA_MM.powi(2) - squares(change)).abs() < 1e-6,
            "the shift is where the series has it"
        );
        let added: f64 = added_squares(&measured, &nominal, &with_shift).iter().sum();
        // Fresh readings have noise of their own, and the step where the two change points differ.
        let fresh = ROWS as f64 + truth.abs_diff(change) as f64 * step * step;
        pairs.push([added / SIGMA_MM.powi(2), fresh - squares(change)]);
    }
    let mean = |k: usize| pairs.iter().map(|p| p[k]).sum::<f64>() / draws as f64;
    let apart = mean(0) - mean(1);
    let spread = pairs.iter().map(|p| (p[0] - p[1] - apart).powi(2)).sum::<f64>() / draws as f64;
    ([mean(0), mean(1)], (spread / draws as f64).sqrt())
}

#[test]
fn a_searched_change_point_costs_what_is_stated() {
    for step in [1.0, 1.5, 2.5] {
        let ([stated, found], sigma) = stated_and_found(step, 2000);
        println!("step {step} σ: stated {stated:.2}, found {found:.2} ± {sigma:.2}");
        assert!((stated - found).abs() < 3.0 * sigma, "step {step} σ: {stated} for {found} ± {sigma}");
        assert!(stated > 2.0, "{stated}");
    }
}

#[test]
fn a_step_that_is_large_against_the_noise_costs_nothing() {
    let ([stated, _], _) = stated_and_found(12.0, 20);
    assert!(stated.abs() < 1e-6, "{stated}");
}
