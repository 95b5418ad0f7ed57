//! Splits keep repeated poses together, cover every row, and depend on nothing but the seed.

use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::split::{self, Split};

use super::simulation::{CABLE, measure, random};

/// 100 poses, each measured twice, the second round after the first.
fn repeated() -> Dataset {
    measure(&random(
        100,
        &format!("repeats = 2\n{CABLE}[noise]\nsigma_mm = 0.3\n[rounding]\nangles_deg = 0.001\n"),
    ))
    .1
}

fn check(split: &Split, rows: usize) {
    let mut all = [split.train.clone(), split.test.clone()].concat();
    all.sort_unstable();
    assert_eq!(all, (0..rows).collect::<Vec<_>>());
    for i in 0..100 {
        assert_eq!(split.test.contains(&i), split.test.contains(&(i + 100)), "pose {i} is on both sides");
    }
}

#[test]
fn random_split_holds_out_the_share() {
    let data = repeated();
    let split = split::random(&data, 0.2, 3);
    check(&split, 200);
    assert_eq!((split.train.len(), split.test.len()), (160, 40));
    assert_eq!(split, split::random(&data, 0.2, 3));
    assert_ne!(split, split::random(&data, 0.2, 4));
    assert_eq!(split::random(&data, 0.0, 3).test.len(), 0);
    assert_eq!(split::random(&data, 1.0, 3).train.len(), 0);
}

#[test]
fn folds_cover_every_row_once() {
    let data = repeated();
    let folds = split::folds(&data, 5, 1);
    assert_eq!(folds.len(), 5);
    folds.iter().for_each(|fold| check(fold, 200));
    let mut tested: Vec<usize> = folds.iter().flat_map(|f| f.test.clone()).collect();
    tested.sort_unstable();
    assert_eq!(tested, (0..200).collect::<Vec<_>>());
    assert!(folds.iter().all(|f| f.test.len() == 40));
    assert_eq!(split::folds(&data, 1000, 1).len(), 100, "no more folds than poses");
}

#[test]
fn blocks_leave_repetitions_of_their_poses_out_of_the_fit() {
    let data = repeated();
    let blocks = split::blocks(&data, 4);
    assert_eq!(blocks[1].test, (50..100).collect::<Vec<_>>());
    assert_eq!(blocks[1].train, (0..50).chain(100..150).collect::<Vec<_>>());
}

#[test]
fn noise_floor_is_the_sensors() {
    let floor = split::noise_floor(&repeated()).unwrap();
    assert_eq!((floor.poses, floor.freedom), (100, 100));
    // σ/√(2 ν) = 0.02.
    assert!((floor.sigma_mm - 0.3).abs() < 0.07, "{floor:?}");
    assert_eq!(split::noise_floor(&measure(&random(50, CABLE)).1), None);
}

#[test]
fn nearly_equal_poses_are_one_unless_the_read_out_differs() {
    let row = |number: usize, q1_deg: f64| {
        let joints = Joints::new(q1_deg.to_radians(), 0.1, 0.2, 0.3, 0.4, 0.5);
        Row::new(number, joints, Reading::Cable(500.0 + number as f64))
    };
    let mut data =
        Dataset::new("made", Sensor::Cable, vec![row(0, 10.0), row(1, 40.0), row(2, 10.002), row(3, 10.02)]);
    assert_eq!(split::poses(&data), [vec![0, 2], vec![1], vec![3]]);
    data.rows[0].readout_mm = Some(nalgebra::Vector3::new(1.0, 2.0, 3.0));
    data.rows[2].readout_mm = Some(nalgebra::Vector3::new(1.0, 2.3, 3.0));
    assert_eq!(split::poses(&data).len(), 4);
}
