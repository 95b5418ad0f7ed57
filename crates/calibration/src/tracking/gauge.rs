//! Directions in which arm and sensor can move together without moving any reading: a turn of joint 1 against one of the sensor's frame.
//!
//! Readings say nothing along them. A filter that is linearised anew at every pose learns about them all the same, since they turn with
//! the estimate (Huang, Mourikis, Roumeliotis, "Observability-based rules for designing consistent EKF SLAM estimators", IJRR 29, 2010).
//! So each row of the Jacobian is projected off the directions at the first estimate, as their OC-EKF does. What this leaves out is of
//! second order in the deviations.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::identification::calibration::{CalibrationProblem, Frames, Weight};
use crate::measurement::dataset::{Dataset, Reading, Row, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Problem;

/// The directions, for parameters in units of their columns' lengths.
#[derive(Debug, Clone)]
pub(super) struct Gauge {
    lengths: DVector<f64>,
    /// Orthonormal columns.
    directions: DMatrix<f64>,
}

/// Random poses at which the directions are found.
const POSES: usize = 100;

/// Singular values below this share of the largest are zero but for rounding.
const ZERO: f64 = 1e-9;

impl Gauge {
    /// The directions of `parameters` about `model` and `frames`, for any pose.
    pub(super) fn of(sensor: Sensor, model: &Model, frames: &Frames, parameters: &[Parameter]) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(0);
        // A turn of the sensor's frame moves what it reads, not its origin.
        let reading = |joints: &Joints| {
            let target = model.forward(joints, &Condition::default()) * frames.flange_from_target;
            let read = frames.base_from_sensor.inverse() * target;
            match sensor {
                Sensor::Cable => Reading::Cable(0.0),
                Sensor::Position => Reading::Position(read.translation.vector),
                Sensor::Pose => Reading::Pose(Box::new(read)),
            }
        };
        let outlets = frames.outlets_mm.len().max(1);
        let poses = POSES * outlets;
        let rows = (0..poses).map(|at| {
            let joints: [f64; 6] =
                std::array::from_fn(|_| random.random_range(-std::f64::consts::PI..std::f64::consts::PI));
            let joints = Joints::from(joints);
            let mut row = Row::new(at, joints, reading(&joints));
            row.anchor = at % outlets;
            row
        });
        let dataset = Dataset::new("gauge", sensor, rows.collect::<Vec<_>>());
        // Orientations count as much as positions some 300 mm away.
        let weights = vec![Weight { per_mm: 1.0, per_rad: 300.0 }; poses];
        let problem = CalibrationProblem::new(&dataset, model, frames, parameters, &[], &weights);
        let (p, m) = (parameters.len(), poses * sensor.scalars());
        let (mut r, mut j) = (vec![0.0; m], vec![0.0; m * p]);
        problem.jacobian(&vec![0.0; p], 0..m, &mut r, &mut j);
        let mut j = DMatrix::from_vec(m, p, j);
        // Effects show under their own conditions only: a column without any entry is unknown here, not free.
        let mut lengths = DVector::from_fn(p, |k, _| j.column(k).norm());
        let shown: Vec<usize> = (0..p)
            .filter(|&k| lengths[k] > 0.0 && lengths[k].is_finite() && is_of_geometry(&parameters[k]))
            .collect();
        (0..p).filter(|k| !shown.contains(k)).for_each(|k| lengths[k] = 1.0);
        for k in &shown {
            j.column_mut(*k).unscale_mut(lengths[*k]);
        }
        let svd = j.select_columns(&shown).svd(false, true);
        let largest = svd.singular_values.max();
        let free = svd.v_t.iter().flat_map(|v_t| {
            let zero = |at: &usize| svd.singular_values[*at] <= ZERO * largest;
            (0..v_t.nrows()).filter(zero).map(|at| v_t.row(at).transpose())
        });
        let columns: Vec<DVector<f64>> = free
            .map(|free| {
                let mut column = DVector::zeros(p);
                shown.iter().zip(free.iter()).for_each(|(k, value)| column[*k] = *value);
                column
            })
            .collect();
        let directions =
            if columns.is_empty() { DMatrix::zeros(p, 0) } else { DMatrix::from_columns(&columns) };
        Self { lengths, directions }
    }

    /// Takes out of a row of the Jacobian what it says along the directions.
    pub(super) fn project(&self, row: &mut DVector<f64>) {
        if self.directions.ncols() == 0 {
            return;
        }
        row.component_div_assign(&self.lengths);
        for direction in self.directions.column_iter() {
            let along = direction.dot(row);
            row.axpy(-along, &direction, 1.0);
        }
        row.component_mul_assign(&self.lengths);
    }
}

fn is_of_geometry(parameter: &Parameter) -> bool {
    !parameter.is_of_arm() || matches!(parameter.unit(), "mm" | "rad")
}
