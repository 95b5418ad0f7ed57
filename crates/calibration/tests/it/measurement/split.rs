//! Splits keep repeated poses together, cover every row, and depend on nothing but the seed.

use nalgebra::Vector3;
use rand::{RngExt as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_calibration::measurement::noise_floor::{
    noise_floor, noise_floor_beside_shift, noise_floor_within,
};
use truegrind_calibration::measurement::repeated_poses::poses;
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

/// Every region is a box of joint space that no row of another shares, whatever the order of the rows.
#[test]
fn regions_cover_every_row_once_and_lie_apart() {
    let data = repeated();
    let regions = split::regions(&data, 8);
    assert_eq!(regions.len(), 8);
    regions.iter().for_each(|region| check(region, 200));
    assert!(regions.iter().all(|r| (24..=26).contains(&r.test.len())), "{regions:?}");
    let range = |rows: &[usize], joint: usize| {
        let angles = rows.iter().map(|&i| data.rows[i].joints[joint]);
        angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)))
    };
    for (k, a) in regions.iter().enumerate() {
        for b in &regions[k + 1..] {
            let is_apart = |joint: usize| {
                let (a, b) = (range(&a.test, joint), range(&b.test, joint));
                a.1 < b.0 || b.1 < a.0
            };
            assert!((0..6).any(is_apart), "{a:?} {b:?}");
        }
    }
    let turned = data.subset(&(0..200).rev().collect::<Vec<usize>>());
    let mirrored = |split: &Split| {
        let mut test: Vec<usize> = split.test.iter().map(|i| 199 - i).collect();
        test.sort_unstable();
        test
    };
    let mut same: Vec<Vec<usize>> = split::regions(&turned, 8).iter().map(mirrored).collect();
    let mut expected: Vec<Vec<usize>> = regions.into_iter().map(|r| r.test).collect();
    same.sort();
    expected.sort();
    assert_eq!(same, expected);
}

/// Poses of one step of a grid are not separated, and two poses make no more than two regions.
#[test]
fn regions_of_a_grid_are_whole_steps() {
    let mut data = repeated();
    for (i, row) in data.rows.iter_mut().enumerate() {
        row.joints = Joints::zeros();
        row.joints[0] = f64::from(u8::from(i % 100 >= 40)) + 1e-4 * (i % 100) as f64;
    }
    let [low, high] = <[Split; 2]>::try_from(split::regions(&data, 2)).unwrap();
    assert_eq!((low.test.len(), high.test.len()), (80, 120));
    assert_eq!(split::regions(&data.subset(&[0, 1]), 8).len(), 2);
}

/// What belongs together in two splits of the same rows, one of which was left out of the second.
fn moved(before: &[Split], after: &[Split], gone: usize) -> usize {
    let same = |i: usize| i - usize::from(i > gone);
    let held = |folds: &[Split], i: usize| folds.iter().position(|fold| fold.test.contains(&i));
    (0..200).filter(|&i| i != gone && held(before, i) != held(after, same(i))).count()
}

/// Chance that hangs on the number or the order of the rows gives another split, and so other findings, for one row more or
/// less. It is drawn from what a row holds.
#[test]
fn folds_hardly_change_where_a_row_is_left_out_and_not_at_all_where_angles_lose_their_last_digits() {
    let data = repeated();
    for split in [|data: &Dataset| split::folds(data, 5, 1), |data: &Dataset| split::purged(data, 5, 3, 1)] {
        let whole = split(&data);
        for gone in [0, 57, 120, 199] {
            let rest: Vec<usize> = (0..200).filter(|&i| i != gone).collect();
            let moved = moved(&whole, &split(&data.subset(&rest)), gone);
            assert!(moved <= 40, "without row {gone} {moved} of 199 rows are held out in another fold");
        }
        let mut rounded = data.clone();
        for row in rounded.rows.iter_mut() {
            row.joints = row.joints.map(|q| (q * 1e8).round() * 1e-8);
        }
        assert_eq!(whole, split(&rounded));
    }
}

#[test]
fn blocks_leave_repetitions_of_their_poses_out_of_the_fit() {
    let data = repeated();
    let blocks = split::blocks(&data, 4);
    assert_eq!(blocks[1].test, (50..100).collect::<Vec<_>>());
    assert_eq!(blocks[1].train, (0..50).chain(100..150).collect::<Vec<_>>());
}

/// A hundred poses and twelve of them again; from `shifted` on the sensor's readings are 0.37 mm off.
fn repeated_at_the_end(seed: u64, shifted: usize, sigma_mm: f64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut poses: Vec<Joints> =
        (0..100).map(|_| Joints::from_fn(|_, _| rng.random_range(-1.0..1.0))).collect();
    poses.extend((0..12).map(|k| poses[8 * k + 3]).collect::<Vec<_>>());
    let rows = poses.iter().enumerate().map(|(i, q)| {
        let noise = Vector3::from_fn(|_, _| {
            let v: f64 = StandardNormal.sample(&mut rng);
            sigma_mm * v
        });
        let shift = if i < shifted { Vector3::zeros() } else { Vector3::new(0.2, 0.3, 0.1) };
        Row::new(i, *q, Reading::Position(Vector3::new(q[0], q[1], q[2]) * 500.0 + shift + noise))
    });
    Dataset::new("shift.csv", Sensor::Position, rows.collect::<Vec<_>>())
}

/// Repetitions on both sides of a shift of the sensor showed six times its noise.
#[test]
fn a_shift_of_the_sensor_is_no_noise() {
    for seed in 0..20 {
        let true_mm = 0.02 * 3_f64.sqrt();
        let data = repeated_at_the_end(seed, 56, 0.02);
        let [whole, beside] = [noise_floor(&data), noise_floor_beside_shift(&data)].map(Option::unwrap);
        assert!(whole.sigma_mm > 3.0 * true_mm, "seed {seed}: {whole:?}");
        assert!((beside.sigma_mm / true_mm - 1.0).abs() < 0.6, "seed {seed}: {beside:?}");
        // Where the rows of the shift are known, the seven poses that were read before and after it do not count.
        let within = noise_floor_within(&data, &[[56, 111]]).unwrap();
        assert_eq!((within.poses, within.freedom), (5, 5), "poses that were read twice behind it");
        assert!((within.sigma_mm / true_mm - 1.0).abs() < 0.9, "seed {seed}: {within:?}");
        // Noise alone, however large, is no shift.
        let noisy = repeated_at_the_end(seed, 200, 0.2);
        assert_eq!(noise_floor(&noisy), noise_floor_beside_shift(&noisy), "seed {seed}");
    }
}

#[test]
fn noise_floor_is_the_sensors() {
    let floor = noise_floor(&repeated()).unwrap();
    assert_eq!((floor.poses, floor.freedom), (100, 100));
    // σ/√(2 ν) = 0.02.
    assert!((floor.sigma_mm - 0.3).abs() < 0.07, "{floor:?}");
    assert_eq!(noise_floor(&measure(&random(50, CABLE)).1), None);
}

#[test]
fn nearly_equal_poses_are_one_unless_the_read_out_differs() {
    let row = |number: usize, q1_deg: f64| {
        let joints = Joints::new(q1_deg.to_radians(), 0.1, 0.2, 0.3, 0.4, 0.5);
        Row::new(number, joints, Reading::Cable(500.0 + number as f64))
    };
    let mut data =
        Dataset::new("made", Sensor::Cable, vec![row(0, 10.0), row(1, 40.0), row(2, 10.002), row(3, 10.02)]);
    assert_eq!(poses(&data), [vec![0, 2], vec![1], vec![3]]);
    data.rows[0].extra_mut().readout_mm = Some(nalgebra::Vector3::new(1.0, 2.0, 3.0));
    data.rows[2].extra_mut().readout_mm = Some(nalgebra::Vector3::new(1.0, 2.3, 3.0));
    assert_eq!(poses(&data).len(), 4);
}

/// The class: a number of rows decides how often they are compared with each other. Rows that are one to the last bit are not
/// compared, and the groups are those that comparing every pair gives.
#[test]
fn poses_are_those_that_comparing_every_pair_gives() {
    let mut data = repeated();
    let rows: Vec<usize> =
        (0..200).chain(std::iter::repeat_n(7, 60)).chain((0..100).map(|i| i % 9)).collect();
    data = data.subset(&rows);
    for (i, row) in data.rows.iter_mut().enumerate() {
        if i % 5 == 0 {
            row.joints[2] += 2e-6 * (i % 3) as f64;
        }
        if i % 11 == 0 {
            row.extra_mut().readout_mm = Some(nalgebra::Vector3::new((i % 2) as f64, 0.0, -0.0));
        }
    }
    let alike = |i: usize, j: usize| {
        let (a, b) = (&data.rows[i], &data.rows[j]);
        let apart = match (a.readout_mm(), b.readout_mm()) {
            (Some(a), Some(b)) => (a - b).amax() > 1.5e-3,
            _ => false,
        };
        (a.joints - b.joints).amax() <= 0.000_5f64.to_radians() && !apart
    };
    let mut group: Vec<usize> = (0..data.rows.len()).collect();
    loop {
        let before = group.clone();
        for i in 0..group.len() {
            for j in 0..group.len() {
                if alike(i, j) {
                    let least = group[i].min(group[j]);
                    (group[i], group[j]) = (least, least);
                }
            }
        }
        if group == before {
            break;
        }
    }
    let expected: Vec<Vec<usize>> = (0..group.len())
        .filter(|i| group[*i] == *i)
        .map(|first| (0..group.len()).filter(|i| group[*i] == first).collect())
        .collect();
    assert!(data.angle_step_rad.is_some());
    assert_eq!(poses(&data), expected);
}

/// Parts share the rows of the whole until one of them is changed.
#[test]
fn a_part_shares_its_rows_until_it_is_changed() {
    let whole = repeated();
    let mut part = whole.subset(&[3, 1, 150]).subset(&[2, 0]);
    assert_eq!(part.rows.iter().collect::<Vec<_>>(), [&whole.rows[150], &whole.rows[3]]);
    assert!(std::ptr::eq(&part.rows[0], &whole.rows[150]), "copied");
    part.rows[0].anchor = 9;
    assert_eq!((part.rows[0].anchor, whole.rows[150].anchor, part.rows.len()), (9, 0, 2));
    part.rows.push(whole.rows[0].clone());
    assert_eq!(part.rows.last(), Some(&whole.rows[0]));
    assert_eq!(part.rows.iter().rev().step_by(2).count(), 2);
}

/// A row of a file that stands there twice says nothing about the noise: of readings equal to the last digit one counts, unless the
/// readings are so coarse that equal ones are chance.
#[test]
fn copied_rows_are_no_noise_floor() {
    let data = repeated();
    let floor = noise_floor(&data).unwrap();
    let with = |more: &dyn Fn(&Row) -> Option<Row>| {
        let mut rows: Vec<Row> = data.rows.iter().cloned().collect();
        rows.extend(data.rows.iter().filter_map(more));
        Dataset { rows: rows.into(), ..data.clone() }
    };
    assert_eq!(noise_floor(&with(&|row| Some(row.clone()))), Some(floor));
    // Once each, and each copied: no pose was read again.
    let first = data.subset(&(0..100).collect::<Vec<_>>());
    let twice: Vec<Row> = first.rows.iter().chain(first.rows.iter()).cloned().collect();
    assert_eq!(noise_floor(&Dataset { rows: twice.into(), ..first }), None);
    // A cable that reads half millimetres reads the same one again and again.
    let coarse = |row: &Row| match row.reading {
        Reading::Cable(length) => {
            Row { reading: Reading::Cable((2.0 * length).round() / 2.0), ..row.clone() }
        }
        _ => row.clone(),
    };
    let rough: Vec<Row> = data.rows.iter().map(coarse).collect();
    let rough = noise_floor(&Dataset { rows: rough.into(), ..data.clone() }).unwrap();
    assert_eq!(rough.freedom, floor.freedom);
}

/// Rows that resemble those beside them in the file: no row of a fit stands within the reach of one that is held out, and every row
/// is held out once. Random folds have both on every side of a held-out row.
#[test]
fn purged_folds_leave_out_what_stands_beside_a_held_out_row() {
    let data = repeated();
    let purged = split::purged(&data, 5, 3, 1);
    let mut tested: Vec<usize> = purged.iter().flat_map(|f| f.test.clone()).collect();
    tested.sort_unstable();
    assert_eq!(tested, (0..200).collect::<Vec<_>>());
    for fold in &purged {
        let apart = |i: usize| fold.test.iter().map(|&t| t.abs_diff(i)).min().unwrap();
        assert!(fold.train.iter().all(|&i| apart(i) > 3));
        assert!(fold.train.iter().all(|&i| !fold.test.contains(&((i + 100) % 200))), "a pose on both sides");
        assert!(fold.train.len() > 60, "{} rows are left to fit", fold.train.len());
    }
    assert_eq!(split::purged(&data, 5, 0, 1), split::folds(&data, 5, 1));
    assert_eq!(split::purged(&data, 5, 100, 1), split::folds(&data, 5, 1), "too few rows for such stretches");
}
