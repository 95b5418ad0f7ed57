//! How far the arm has moved from the model that the track began with, whether or not an alarm was raised.
//!
//! A drift may be slower than any bound of the innovations, since the filter follows it. Programs were corrected with the first model, so
//! what counts for them is the whole way since. It is the displacement of the target over the measured region, after its best placement:
//! a motion of the base and of the target's mounting is not the arm's shape.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};

use super::tracker::Tracker;
use truegrind_arm::model::{Joints, Model};

/// The arm as tracked against the model that the track began with.
#[derive(Debug, Clone, PartialEq)]
pub struct Departure {
    /// RMS displacement of the target (mm).
    pub rms_mm: f64,
    /// What the uncertainties of the first model and of the track make of it (mm, 1σ).
    pub expected_mm: f64,
    /// Parameters that moved by more than four of the standard deviations that they began with: name, unit, by how much, and the present
    /// standard deviation; those that moved most first.
    pub parameters: Vec<(String, String, f64, f64)>,
    /// Whether the arm is another one now.
    pub is_significant: bool,
}

/// Poses of the region that are compared.
const POSES: usize = 200;

/// A displacement counts beyond this many of its expected sizes, and beyond this share of the model's held-out error.
const SIGMAS: f64 = 3.0;
const SHARE: f64 = 0.5;

/// Parameters count beyond this many of their first standard deviations.
const PARAMETER_SIGMAS: f64 = 4.0;

impl Tracker {
    /// How far the arm has moved; `None` where no pose was measured.
    pub fn departure(&self) -> Option<Departure> {
        let samples = &self.state.region.samples_deg;
        let step = samples.len().div_ceil(POSES).max(1);
        let poses: Vec<Joints> =
            samples.iter().step_by(step).map(|sample| Joints::from(sample.map(f64::to_radians))).collect();
        if poses.len() < FEWEST {
            return None;
        }
        let target = self.frames.flange_from_target.translation.vector;
        let placed = |model: &Model| -> Vec<(Vector3<f64>, Rotation3<f64>)> {
            let at = |joints: &Joints| {
                let flange = model.forward(joints, &self.initial.condition);
                let rotation = flange.rotation.to_rotation_matrix();
                (flange.translation.vector + rotation * target, rotation)
            };
            poses.iter().map(at).collect()
        };
        let (first, now) = (placed(&self.initial.model), placed(&self.current().0));
        let arm = self.initial.order.len();
        let rows = 3 * poses.len();
        // The displacement, and what one standard deviation along each axis of the covariances makes of it: that of the model, and what the
        // track adds to it.
        let mut columns = DMatrix::zeros(rows, 1 + 2 * arm);
        fill(columns.column_mut(0).as_mut_slice(), &first, &now);
        let problem = self.without_rows();
        let mut x = vec![0.0; self.parameters.len()];
        let tracked = self.filter.covariance().view((0, 0), (arm, arm)).into_owned();
        let scale = self.scatter(self.state.history.len()).unwrap_or(1.0).max(1.0);
        for (offset, covariance, scale) in [(1, &self.initial.covariance, 1.0), (1 + arm, &tracked, scale)] {
            let axes = covariance.clone().symmetric_eigen();
            for k in 0..arm {
                let sigma = scale * axes.eigenvalues[k].max(0.0).sqrt();
                x[..arm].copy_from_slice((axes.eigenvectors.column(k) * sigma).as_slice());
                let moved = placed(&problem.apply(&x).0);
                fill(columns.column_mut(offset + k).as_mut_slice(), &first, &moved);
            }
        }
        place(&mut columns, &first);
        let rms = |square: f64| (square / poses.len() as f64).sqrt();
        let rms_mm = rms(columns.column(0).norm_squared());
        let expected_mm = rms(columns.columns(1, 2 * arm).norm_squared());
        let sigmas = self.sigmas();
        let mut parameters: Vec<(f64, (String, String, f64, f64))> = self
            .initial
            .order
            .iter()
            .enumerate()
            .filter_map(|(k, parameter)| {
                let (moved, first) = (self.filter.x[k], self.initial.covariance[(k, k)].max(0.0).sqrt());
                let counts = moved.abs() > PARAMETER_SIGMAS * first;
                let told = (parameter.to_string(), parameter.unit().to_owned(), moved, sigmas[k]);
                counts.then_some((moved.abs() / first.max(f64::MIN_POSITIVE), told))
            })
            .collect();
        parameters.sort_by(|a, b| b.0.total_cmp(&a.0));
        Some(Departure {
            rms_mm,
            expected_mm,
            parameters: parameters.into_iter().map(|(_, told)| told).collect(),
            is_significant: rms_mm > SIGMAS * expected_mm
                && rms_mm > SHARE * self.initial.geometry.held_out.rmse,
        })
    }
}

/// Fewest poses of a comparison: placement has nine parameters.
const FEWEST: usize = 8;

/// The displacements of the target between two arms.
fn fill(
    column: &mut [f64],
    first: &[(Vector3<f64>, Rotation3<f64>)],
    now: &[(Vector3<f64>, Rotation3<f64>)],
) {
    for ((into, (first, _)), (now, _)) in column.chunks_exact_mut(3).zip(first).zip(now) {
        into.copy_from_slice((now - first).as_slice());
    }
}

/// Takes the best placement out of displacements: a small motion of the base, and one of the target on the flange.
fn place(columns: &mut DMatrix<f64>, first: &[(Vector3<f64>, Rotation3<f64>)]) {
    let mut motions = DMatrix::zeros(columns.nrows(), 9);
    for (pose, (at, rotation)) in first.iter().enumerate() {
        for axis in 0..3 {
            motions[(3 * pose + axis, axis)] = 1.0;
            let turned = Vector3::ith(axis, 1.0).cross(at);
            motions.view_mut((3 * pose, 3 + axis), (3, 1)).copy_from(&turned);
            motions.view_mut((3 * pose, 6 + axis), (3, 1)).copy_from(&rotation.matrix().column(axis));
        }
    }
    for mut motion in motions.column_iter_mut() {
        let length = motion.norm();
        motion.unscale_mut(length.max(f64::MIN_POSITIVE));
    }
    // Not all nine are independent: a target on the axis of the base's turn moves with it.
    let svd = motions.svd(true, false);
    let Some(u) = svd.u else { return };
    let largest = svd.singular_values.max();
    for (k, value) in svd.singular_values.iter().enumerate() {
        if *value > 1e-9 * largest {
            let direction: DVector<f64> = u.column(k).into_owned();
            let along = columns.tr_mul(&direction);
            columns.ger(-1.0, &direction, &along, 1.0);
        }
    }
}
