//! Path accuracy and repeatability of ISO 9283, by figures worked out by hand and from rows of a file.

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_calibration::acceptance::path::{PATH_CYCLES, characteristics};
use truegrind_calibration::acceptance::{AcceptError, Decision, Options, accept};
use truegrind_calibration::identification::calibration::Frames;
use truegrind_calibration::measurement::dataset::{PathPoint, Reading, Row};

use super::{dataset, model, options, pose, rows};

/// How far the ten cycles lie beside their barycentre, in tenths of a millimetre.
const BESIDE: [f64; PATH_CYCLES] = [3.0, -3.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];

/// Mean distance (2 · 0.3 + 8 · 0.1) / 10 = 0.14, variance (2 · 0.16² + 8 · 0.04²) / 9 = 0.064 / 9.
fn repeatability_mm() -> f64 {
    0.14 + 3.0 * (0.064_f64 / 9.0).sqrt()
}

/// A straight path along x, attained 0.3 mm beside it in y and 0.4 mm above: 0.5 mm off. In the middle the cycles scatter as stated,
/// elsewhere half as much. They are read at other moments, up to 2 mm earlier or later along the path, which counts for nothing.
#[test]
fn a_path_whose_figures_are_worked_out_by_hand() {
    let commanded: Vec<Vector3<f64>> = (0..5).map(|k| Vector3::new(10.0 * f64::from(k), 0.0, 0.0)).collect();
    let attained: Vec<Vec<Vector3<f64>>> = BESIDE
        .iter()
        .enumerate()
        .map(|(cycle, beside)| {
            let early = 0.5 * (cycle as f64 - 4.5);
            let at = |k: usize| {
                // The same offset at both ends of a piece, so that the straight line between readings is the path.
                let scatter = 0.1 * beside * if (1..=3).contains(&k) { 1.0 } else { 0.5 };
                Vector3::new(10.0 * k as f64 + early, 0.3 + scatter, 0.4)
            };
            (0..5).map(at).collect()
        })
        .collect();
    let found = characteristics(&commanded, &attained);
    assert_eq!(found.len(), 5);
    assert!((found[2].deviation_mm - 0.5).abs() < 1e-12, "{found:?}");
    assert!((found[2].repeatability_mm - repeatability_mm()).abs() < 1e-12, "{found:?}");
    assert!((repeatability_mm() - 0.392_982).abs() < 1e-6);
    // A cycle of three readings: it passes the first three points, the last of them on its last piece gone on.
    let mut short = attained.clone();
    short[3].truncate(3);
    assert_eq!(characteristics(&commanded, &short).len(), 3);
    // Back and forth: the way back passes the same planes the other way round and is another path.
    let mut returned = attained;
    for path in &mut returned {
        let back: Vec<_> = path.iter().rev().map(|place| place + Vector3::new(0.0, 5.0, 0.0)).collect();
        path.extend(back);
    }
    assert_eq!(characteristics(&commanded, &returned)[2], found[2]);
    assert!(characteristics(&commanded[..1], &returned).is_empty() && characteristics(&[], &[]).is_empty());
}

/// A corner with a short and a long side, and the next line of a raster beside it: each point is passed where it is, and where a cycle
/// lacks a piece the line beside is not taken for it.
#[test]
fn corners_and_lines_side_by_side_are_passed_where_they_are() {
    let corner =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-40.0, 30.0, 0.0], [-41.0, 30.0, 0.0]].map(Vector3::from);
    let beside: Vec<Vec<Vector3<f64>>> =
        (0..10).map(|_| corner.iter().map(|place| place + Vector3::z() * 0.2).collect()).collect();
    let found = characteristics(&corner, &beside);
    assert_eq!(found.len(), 4);
    assert!(
        found.iter().all(|point| (point.deviation_mm - 0.2).abs() < 1e-12 && point.repeatability_mm < 1e-12)
    );

    let line = |y: f64| (0..40).map(move |k| Vector3::new(f64::from(k), y, 0.0));
    let raster: Vec<Vector3<f64>> = line(0.0).chain(line(5.0)).collect();
    let mut short = raster.clone();
    short.truncate(60);
    let found = characteristics(&raster, &[raster.clone(), short]);
    // The end of what there is goes on for one piece; the first line is passed by both.
    assert!((59..=61).contains(&found.len()), "{}", found.len());
    assert!(found.iter().all(|point| point.deviation_mm < 1e-9), "{found:?}");
    // There and back on the same way: where it turns no plane is normal to it.
    let back = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 0.0, 0.0]].map(Vector3::from);
    assert_eq!(characteristics(&back, &vec![back.to_vec(); 10]).len(), 2);
}

/// Rows on a way of joint 1 from where the arm is at pose 0: in the middle `off_mm` outward, elsewhere two fifths of it, and up by the
/// scatter of the cycle.
fn way(arm: &truegrind_arm::model::Model, cycles: usize, points: u32, off_mm: f64) -> Vec<Row> {
    let mut out = Vec::new();
    for cycle in 0..cycles {
        for sample in 0..points {
            let mut q = pose(0.3, 0);
            q[0] = 0.01 * f64::from(sample);
            let place = arm.at_condition(&Condition::default()).forward(&q).translation.vector;
            let outward = Vector3::new(place.x, place.y, 0.0).normalize();
            let off_mm = off_mm * if sample == points / 2 { 1.0 } else { 0.4 };
            let seen = place + outward * off_mm + Vector3::z() * 0.1 * BESIDE[cycle % PATH_CYCLES];
            let mut row = Row::new(1000 + out.len(), q, Reading::Position(seen));
            let point = PathPoint { path: "arc".into(), cycle: cycle as u32 + 1, sample: 10 * sample };
            row.extra_mut().path = Some(Box::new(point));
            out.push(row);
        }
    }
    out
}

#[test]
fn paths_are_judged_beside_the_poses_and_count_for_nothing_else() {
    let model = model(&dataset(rows(0.1, 120)));
    let stated = Options { frames: Some(Frames::at_origin(1)), ..options(1.0) };
    let alone = accept(&dataset(rows(0.7, 110)), &model, &stated).unwrap();
    assert!(alone.paths.is_empty());
    let with = |path: &[Row]| {
        let mut all = rows(0.7, 110);
        // In the middle of the file.
        all.splice(50..50, path.iter().cloned());
        accept(&dataset(all), &model, &stated)
    };
    let path = way(&model.model, PATH_CYCLES, 21, 0.5);
    let found = with(&path).unwrap();
    assert_eq!((found.poses, found.rows, &found.errors_mm), (110, 110, &alone.errors_mm));
    assert_eq!((found.model, found.decision), (alone.model, Decision::Accepted));
    let of = &found.paths[0];
    assert_eq!(
        (found.paths.len(), of.path.as_str(), of.cycles, of.points, of.left_out),
        (1, "arc", 10, 21, 0)
    );
    // The largest of all points; the planes hold the axis, so that outward stays outward.
    assert!((of.accuracy_mm().unwrap() - 0.5).abs() < 1e-9, "{of:?}");
    assert!((of.repeatability_mm.unwrap() - repeatability_mm()).abs() < 1e-9, "{of:?}");

    // A reading that failed: the point is left out, and said to be.
    let mut missing = path.clone();
    missing.remove(24);
    let of = with(&missing).unwrap().paths.remove(0);
    assert_eq!((of.points, of.left_out), (20, 1));
    // Nine cycles tell how far off the path is in the mean, and no more; two points are none.
    let of = with(&way(&model.model, 9, 21, 0.5)).unwrap().paths.remove(0);
    assert_eq!((of.cycles, of.accuracy_mm(), of.repeatability_mm), (9, None, None));
    assert!((of.deviation_mm.unwrap() - 0.5).abs() < 0.02, "{of:?}");
    let of = with(&way(&model.model, PATH_CYCLES, 2, 0.5)).unwrap().paths.remove(0);
    assert_eq!((of.points, of.deviation_mm), (2, None));
    // A point twice in a cycle, and a file of nothing but paths.
    let mut twice = path.clone();
    twice.push(path[7].clone());
    assert!(matches!(with(&twice), Err(AcceptError::PointTwice { .. })));
    let refused = accept(&dataset(path), &model, &stated);
    assert!(matches!(refused, Err(AcceptError::PathsAlone { .. })));
}

/// Without a stated frame it is the poses that place the sensor, and not the path that is judged.
#[test]
fn the_sensor_is_placed_by_the_poses() {
    let model = model(&dataset(rows(0.1, 120)));
    let mut all = rows(0.7, 110);
    all.extend(way(&model.model, PATH_CYCLES, 201, 0.5));
    let of = accept(&dataset(all), &model, &options(1.0)).unwrap().paths.remove(0);
    assert!((of.accuracy_mm().unwrap() - 0.5).abs() < 0.02, "{of:?}");
}
