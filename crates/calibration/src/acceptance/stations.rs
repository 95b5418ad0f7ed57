//! Errors at poses that were read from several stations, each of which has a frame of its own.
//!
//! A station of four or five poses places its sensor so badly that a frame fitted without one of them misses it by many times the arm's error,
//! and a frame fitted with it follows it. Neither says much of the arm. So all frames are fitted once, and the residual r of a reading is
//! divided by what the fit leaves of an error there: with H the block of the hat matrix that belongs to the pose, e = (I − H)^(−1/2) r scatters as
//! the errors do, whatever the number of poses. Readings of one pose count together in H. A reading of which the fit follows nearly all along
//! some direction shows nothing along it, and does not count.
//!
//! Source: Cook and Weisberg 1982, section 2.2 (studentised residuals), in three dimensions.

use std::collections::BTreeSet;

use nalgebra::{Matrix3, Vector3};

use crate::identification::fit::{Observations, orientation_errors};
use crate::identification::register::register;
use crate::identification::start::StartError;
use crate::identification::tolerance::Tolerance;
use crate::measurement::repeated_poses::poses;
use truegrind_arm::model::Model;
use truegrind_estimation::problem::Problem;

/// Share of an error that a fit must leave along each direction.
const LEFT: f64 = 0.1;

/// Rows that show nothing of the arm, since the frame of their station follows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uncounted {
    /// Rows that do not count.
    pub rows: usize,
    /// Stations none of whose rows counts.
    pub stations: usize,
    /// All stations.
    pub of_stations: usize,
}

/// Errors of each row (mm), and of its orientation (rad; none if none was measured); `None` where a row does not count.
pub(super) struct StationErrors {
    pub(super) mm: Vec<Option<f64>>,
    pub(super) rad: Vec<f64>,
}

impl StationErrors {
    pub(super) fn of(observed: &Observations, model: &Model) -> Result<Self, StartError> {
        let fitted = register(observed, model, &Tolerance::default())?.fitted;
        let rows: Vec<usize> = (0..observed.dataset.rows.len()).collect();
        let rad = orientation_errors(observed, &rows, &fitted.model, &fitted.frames).unwrap_or_default();
        let (residuals, slopes) = fitted.problem.linearise(&fitted.estimate.x);
        let per = fitted.problem.rows_per_observation();
        let mut mm = vec![None; rows.len()];
        let Some(covariance) = &fitted.estimate.covariance else { return Ok(Self { mm, rad }) };
        for pose in poses(&observed.dataset) {
            for &row in &pose {
                let anchor = observed.dataset.rows[row].anchor;
                let alike =
                    pose.iter().filter(|&&other| observed.dataset.rows[other].anchor == anchor).count();
                let slope = slopes.columns(row * per, per.min(3));
                let hat = alike as f64 * (slope.transpose() * (covariance * slope));
                let hat = Matrix3::from_fn(|i, j| hat[(i, j)]);
                let residual = Vector3::from_fn(|i, _| residuals[row * per + i]);
                mm[row] = studentised(&hat, &residual).map(|size| size / fitted.problem.per_mm(row));
            }
        }
        Ok(Self { mm, rad })
    }
}

/// |(I − H)^(−1/2) r|; `None` where the fit leaves too little.
fn studentised(hat: &Matrix3<f64>, residual: &Vector3<f64>) -> Option<f64> {
    let left = (Matrix3::identity() - hat).symmetric_eigen();
    let along = left.eigenvectors.tr_mul(residual);
    let is_shown = left.eigenvalues.iter().all(|left| *left > LEFT);
    let square: f64 = along.iter().zip(&left.eigenvalues).map(|(r, left)| r * r / left).sum();
    (is_shown && square.is_finite()).then(|| square.sqrt())
}

/// What does not count of rows from several stations; `None` where all of them count.
pub(super) fn uncounted(observed: &Observations, counted: &[usize]) -> Option<Uncounted> {
    let rows = &observed.dataset.rows;
    let left = rows.len() - counted.len();
    let shown: BTreeSet<usize> = counted.iter().map(|&row| rows[row].anchor).collect();
    let of_stations = observed.dataset.stations();
    (left > 0).then(|| Uncounted { rows: left, stations: of_stations - shown.len(), of_stations })
}
