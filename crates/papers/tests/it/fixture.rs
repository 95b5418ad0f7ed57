//! ukf-vslm-2023 Table II, five rows of an HSR JR680: what they tell, and what they do not.

use std::ops::Range;

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_calibration::measurement::convention::AngleConvention;
use truegrind_calibration::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_estimation::least_squares::lm;
use truegrind_estimation::problem::Problem;

use super::experiment::nominal;

const ROWS: [[f64; 7]; 5] = [
    [1.41, -74.025, 220.99, -166.357, 41.989, 65.122, 350.07],
    [10.14, -75.864, 215.116, -177.022, 37.363, 65.125, 365.28],
    [8.146, -75.865, 215.115, -177.022, 37.363, 65.125, 351.77],
    [2.76, -74.879, 212.85, -177.943, 41.991, 65.124, 389.07],
    [9.998, -75.865, 215.115, -177.022, 37.363, 65.125, 364.54],
];

/// One outlet, no zero.
struct Outlet {
    points: Vec<Vector3<f64>>,
    lengths: Vec<f64>,
}

impl Problem for Outlet {
    fn parameters(&self) -> usize {
        3
    }
    fn rows(&self) -> usize {
        self.points.len()
    }
    fn residuals(&self, x: &[f64], rows: Range<usize>, out: &mut [f64]) {
        let outlet = Vector3::from_column_slice(x);
        for (out, i) in out.iter_mut().zip(rows) {
            *out = (self.points[i] - outlet).norm() - self.lengths[i];
        }
    }
    fn jacobian(&self, x: &[f64], rows: Range<usize>, residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, rows.clone(), residuals);
        let (n, outlet) = (rows.len(), Vector3::from_column_slice(x));
        for (at, i) in rows.enumerate() {
            let u = (outlet - self.points[i]).normalize();
            (0..3).for_each(|k| jacobian[k * n + at] = u[k]);
        }
    }
}

/// RMS that the best outlet leaves (mm).
fn best(convention: AngleConvention) -> f64 {
    let model = nominal("hsr-jr680").unwrap();
    let rows = ROWS
        .iter()
        .enumerate()
        .map(|(i, r)| Row::new(i, Joints::from_fn(|j, _| r[j].to_radians()), Reading::Cable(r[6])));
    let dataset = Dataset::new("Table II", Sensor::Cable, rows.collect::<Vec<_>>());
    let dataset = convention.apply(dataset, &model).unwrap();
    let points: Vec<Vector3<f64>> = dataset
        .rows
        .iter()
        .map(|r| model.forward(&r.joints, &Condition::default()).translation.vector)
        .collect();
    let centre = points.iter().sum::<Vector3<f64>>() / 5.0;
    let task = Outlet { points, lengths: ROWS.iter().map(|r| r[6]).collect() };
    let starts = (0..27).map(|k| {
        let side = |axis: u32| 350.0 * (f64::from(k / 3_i32.pow(axis) % 3) - 1.0);
        centre + Vector3::new(side(0), side(1), side(2) + 1.0)
    });
    starts
        .map(|start| (2.0 * lm::solve(&task, start.as_slice(), &lm::Options::default()).cost / 5.0).sqrt())
        .fold(f64::INFINITY, f64::min)
}

/// The offsets of Table I are in the angles of Table II already. A good fit is no proof of that: with the offsets added
/// again another outlet fits as well.
#[test]
fn table_two_fits_one_outlet_whether_or_not_the_offsets_are_added_again() {
    let (right, wrong) = (best(AngleConvention::Dh), best(AngleConvention::Logged));
    assert!(right < 3.0, "{right} mm");
    assert!(wrong < 3.0, "{wrong} mm");
}
