//! The held-out error of a model with shifts includes the choice of their rows.

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_arm::robots;
use truegrind_calibration::diagnosis::diagnose::{Options, diagnose};
use truegrind_calibration::diagnosis::preparation::prepare;
use truegrind_calibration::identification::fit::summary_on;
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};

const ROWS: usize = 300;

/// Where the tracker is at a row: it wanders, smoothly but as no cause of the catalogue does.
fn wandered(row: f64) -> Vector3<f64> {
    let turn = row / ROWS as f64 * std::f64::consts::TAU;
    Vector3::new((2.3 * turn).sin(), (3.1 * turn + 1.0).cos(), 0.6 * (4.2 * turn).sin()) * 0.25
}

/// Steps take up the wander, their ends chosen by the noise of the rows beside them. Other rows of the same measurement, at the same times,
/// show the error that is told.
#[test]
fn rows_of_the_same_measurement_show_the_held_out_error() {
    let arm = robots::load("abb-irb-120").unwrap().model;
    let (still, target) = (Condition::default(), Point3::new(38.2, 12.6, 61.3));
    let mut told = Vec::new();
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut rows = |name: &str| {
            let rows: Vec<Row> = (0..ROWS)
                .map(|number| {
                    let q = Joints::from_fn(|_, _| rng.random_range(-1.1..1.1));
                    let seen = (arm.forward(&q, &still) * target).coords + wandered(number as f64);
                    let noise = Vector3::from_fn(|_, _| {
                        let normal: f64 = StandardNormal.sample(&mut rng);
                        0.05 * normal
                    });
                    Row::new(number, q, Reading::Position(seen + noise))
                })
                .collect();
            Dataset::new(name, Sensor::Position, rows)
        };
        let (measured, fresh) = (rows("measured.csv"), rows("fresh.csv"));
        let frames = candidate_frames(&measured, &arm).unwrap();
        let found = diagnose(&measured, "arm", &arm, &frames[0], &Options::default(), &|_| {}).unwrap();
        assert!(found.extended.causes.iter().any(|cause| cause.rows().is_some()), "there are steps");
        let shown =
            summary_on(&prepare(&fresh, &arm, true).observed, &found.extended.model, &found.extended.frames);
        told.push(found.diagnosis.fits.extended.cv_rmse_mm / shown.rmse);
    }
    let mean = told.iter().sum::<f64>() / told.len() as f64;
    assert!((0.93..1.1).contains(&mean), "{told:?}");
}
