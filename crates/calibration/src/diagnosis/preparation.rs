//! Prepares the rows before any fit: read-out fusion, contradicting columns, approach sides and motion from the row order.
//!
//! A read-out is the controller's forward kinematics of the unrounded angles, at its own tool point. If it deviates from the
//! logged angles by more than rounding and the other rows' scatter allow, the two were not logged at the same time or pose. Such
//! a row keeps its logged angles; the others are fused without it.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::halves::is_path;
use super::path_speeds;
use crate::identification::fit::Observations;
use crate::identification::rounding::{NotFused, ReadoutFusion};
use crate::measurement::dataset::{Dataset, Motion};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_math::statistics::median;

/// Rows whose columns contradict each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mismatch {
    /// Index of the row, and deviation of its read-out from its angles (mm).
    pub rows: Vec<(usize, f64)>,
    /// Scatter of the other rows (mm, robust).
    pub usual_mm: f64,
}

/// Ratio of deviation to the other rows' scatter from which a row is a mismatch.
const CUT: f64 = 8.0;

/// Share of mismatches above which they indicate another tool point or arm, not single wrong rows.
const SHARE: f64 = 0.1;

/// Finds rows whose read-out is of another pose.
pub fn mismatches(dataset: &Dataset, nominal: &Model) -> Mismatch {
    let posed = nominal.at_condition(&Condition::default());
    let gaps: Vec<Option<(usize, Vector3<f64>)>> = dataset
        .rows
        .iter()
        .enumerate()
        .map(|(i, row)| {
            row.readout_mm().map(|at| {
                // The read-out's tool point on the flange, as this row has it.
                (i, posed.forward(&row.joints).inverse_transform_point(&Point3::from(at)).coords)
            })
        })
        .collect();
    let gaps: Vec<(usize, Vector3<f64>)> = gaps.into_iter().flatten().collect();
    if gaps.len() < 8 {
        return Mismatch::default();
    }
    let middle =
        Vector3::from_fn(|k, _| median(&gaps.iter().map(|g| g.1[k]).collect::<Vec<_>>()).unwrap_or_default());
    let sizes: Vec<(usize, f64)> = gaps.iter().map(|(i, g)| (*i, (g - middle).norm())).collect();
    // The norm of three normal coordinates has median 1.538 σ.
    let usual = median(&sizes.iter().map(|s| s.1).collect::<Vec<_>>()).unwrap_or(0.0) / 1.538;
    let smallest = dataset.readout_step_mm.unwrap_or(1e-3);
    let rows: Vec<(usize, f64)> =
        sizes.into_iter().filter(|(_, s)| !(*s <= CUT * usual.max(smallest))).collect();
    if rows.len() as f64 > SHARE * dataset.rows.len() as f64 {
        return Mismatch { rows: Vec::new(), usual_mm: usual };
    }
    Mismatch { rows, usual_mm: usual }
}

/// Rows ready for a fit.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// The rows with the covariances of their angles.
    pub observed: Observations,
    /// The rows without read-out fusion.
    pub logged: Observations,
    /// Result of the read-out fusion, or why it was not done.
    pub readout_fusion: Result<ReadoutFusion, NotFused>,
    /// Contradicting rows.
    pub mismatch: Mismatch,
    /// Whether approach sides were inferred from the order of the rows.
    pub sides_from_order: bool,
}

/// Prepares a data set; with `fuse`, rounded angles are fused with the controller's read-out.
pub fn prepare(dataset: &Dataset, nominal: &Model, fuse: bool) -> Prepared {
    let mismatch = mismatches(dataset, nominal);
    let mut rows = dataset.clone();
    let silent = dataset.rows.iter().all(|r| r.condition.approach == [0; 6]);
    if silent {
        for i in 1..rows.rows.len() {
            let step = dataset.rows[i].joints - dataset.rows[i - 1].joints;
            Arc::make_mut(&mut rows.rows[i].condition).approach =
                // An increasing joint angle approaches from below (−1).
                std::array::from_fn(|j| if step[j].abs() < 1e-6 { 0 } else { -step[j].signum() as i8 });
        }
    }
    fill_motion(&mut rows);
    let logged = Observations::logged(rows.clone());
    let mismatching: Vec<usize> = mismatch.rows.iter().map(|(row, _)| *row).collect();
    let (observed, readout_fusion) = if fuse {
        Observations::fused(rows, nominal, &mismatching)
    } else {
        (logged.clone(), Err(NotFused::Nothing))
    };
    Prepared { observed, logged, readout_fusion, mismatch, sides_from_order: silent }
}

/// Fills in the motion from the previous row; the first row has none, since a path may begin there or before. Rows that know it keep it:
/// they are part of a longer record.
fn fill_motion(dataset: &mut Dataset) {
    let path = is_path(dataset);
    let rows: Vec<(Joints, Option<f64>)> =
        dataset.rows.iter().map(|r| (r.joints, r.condition.time_h)).collect();
    let n = rows.len();
    for (i, row) in dataset.rows.iter_mut().enumerate().skip(1) {
        if row.motion().is_some() {
            continue;
        }
        let step = rows[i].0 - rows[i - 1].0;
        let rate = |from: usize, to: usize| {
            let hours = rows[to].1.zip(rows[from].1).map(|(b, a)| b - a).filter(|h| path && *h > 0.0)?;
            Some((rows[to].0 - rows[from].0) / hours)
        };
        let next = (i + 1).min(n - 1);
        let into = |k: usize| (1..n).contains(&k).then(|| rate(k - 1, k)).flatten();
        let rates = rate(i - 1, next)
            .map(|mean| path_speeds::rates(mean, [into(i - 1), into(i), into(i + 1), into(i + 2)]));
        row.extra_mut().motion = Some(Motion { step, rates });
    }
}
