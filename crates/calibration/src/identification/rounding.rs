//! Rounding of logged angles: its variance in the readings, and fusion with the controller's Cartesian read-out
//! (errors-in-variables).
//!
//! A logged angle with step h is uniform within ±h/2, variance h²/12. The read-out is the controller's forward map of the
//! unrounded angles at its tool point t, x = F(q) t, rounded too. Each row's angles minimise
//! ‖(q − q̄)/σ_q‖² + ‖(F(q) t − x)/σ_x‖² by a few Gauss–Newton steps, with covariance P = (I/σ_q² + JᵀJ/σ_x²)⁻¹. The row's
//! reading then has the variance u J P Jᵀ uᵀ in addition to the sensor's.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

use crate::identification::calibration::{Frames, Weight};
use crate::measurement::dataset::{Dataset, Sensor};
use rayon::prelude::*;
use truegrind_arm::condition::Condition;
use truegrind_arm::jacobian::joint_jacobian;
use truegrind_arm::model::Model;
use truegrind_math::work::checkpoint;

/// Covariance of the joint angles of each row (rad²): common, or individual.
#[derive(Debug, Clone)]
pub struct AngleCovariance {
    rows: usize,
    common: Matrix6<f64>,
    /// One for each row; empty where all are equal.
    own: Vec<Matrix6<f64>>,
}

impl AngleCovariance {
    /// Covariance of row `i`.
    pub fn of(&self, i: usize) -> &Matrix6<f64> {
        self.own.get(i).unwrap_or(&self.common)
    }

    /// Standard deviation of an angle, root mean square of joints and rows (rad).
    pub fn typical_rad(&self) -> f64 {
        let trace = match self.own.len() {
            0 => self.common.trace(),
            rows => self.own.iter().map(Matrix6::trace).sum::<f64>() / rows as f64,
        };
        (trace / 6.0).sqrt()
    }

    /// Standard deviation of every angle (rad), where it is one for all joints and rows.
    pub(crate) fn common_sigma_rad(&self) -> Option<f64> {
        self.own.is_empty().then(|| (self.common.trace() / 6.0).sqrt())
    }

    /// Gives row `i` a covariance of its own.
    pub fn set(&mut self, i: usize, covariance: Matrix6<f64>) {
        if self.own.is_empty() {
            self.own = vec![self.common; self.rows];
        }
        self.own[i] = covariance;
    }

    /// The rows at `indices`.
    pub fn subset(&self, indices: &[usize]) -> Self {
        let own =
            if self.own.is_empty() { Vec::new() } else { indices.iter().map(|&i| self.own[i]).collect() };
        Self { rows: indices.len(), common: self.common, own }
    }

    /// Whether all angles are exact.
    fn is_zero(&self) -> bool {
        match self.own.as_slice() {
            [] => self.common.trace() == 0.0,
            own => own.iter().all(|p| p.trace() == 0.0),
        }
    }
}

/// Covariance of the logged angles: h²/12 on the diagonal, 0 without visible rounding.
pub fn logged_covariance(dataset: &Dataset) -> AngleCovariance {
    let variance = dataset.angle_step_rad.map_or(0.0, |h| h * h / 12.0);
    AngleCovariance { rows: dataset.rows.len(), common: Matrix6::identity() * variance, own: Vec::new() }
}

/// Result of a read-out fusion.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadoutFusion {
    /// The controller's tool point on the flange (mm).
    pub readout_point_mm: Vector3<f64>,
    /// RMS difference of read-out and nominal forward map before (mm).
    pub before_mm: f64,
    /// The same with fused angles (mm).
    pub after_mm: f64,
    /// Expected RMS difference from rounding alone, before (mm).
    pub expected_mm: f64,
    /// Ratio of the angles' standard deviation after and before, mean over rows and joints.
    pub narrowed: f64,
}

/// Why the read-out was not used.
#[derive(Debug, Clone, PartialEq)]
pub enum NotFused {
    /// A row has no read-out, or angles are not rounded.
    Nothing,
    /// The read-out contradicts the angles under the nominal model.
    Mismatch {
        /// RMS difference (mm).
        found_mm: f64,
        /// Expected from rounding alone (mm).
        expected_mm: f64,
    },
}

/// Fuses the read-out into the angles of all rows in place, and returns their covariance. See the module page.
///
/// # Errors
/// [`NotFused`]; the rows are then unchanged.
pub fn fuse_readout(
    dataset: &mut Dataset,
    nominal: &Model,
) -> Result<(ReadoutFusion, Vec<Matrix6<f64>>), NotFused> {
    let (Some(step), true) = (dataset.angle_step_rad, dataset.rows.iter().all(|r| r.readout_mm().is_some()))
    else {
        return Err(NotFused::Nothing);
    };
    if dataset.rows.is_empty() {
        return Err(NotFused::Nothing);
    }
    let angle_variance = step * step / 12.0;
    // Without a visible step, single precision is assumed.
    let readout_variance = dataset.readout_step_mm.map_or(1e-3_f64.powi(2), |h| h * h / 12.0);
    let posed = nominal.at_condition(&Condition::default());
    let readout = |i: usize| dataset.rows[i].readout_mm().unwrap_or_default();
    // The tool point of the read-out: linear least squares of R t = x − p.
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (i, row) in dataset.rows.iter().enumerate() {
        let flange = posed.forward(&row.joints);
        let rotation = flange.rotation.to_rotation_matrix();
        let gap = readout(i) - flange.translation.vector;
        normal += Matrix3::identity();
        right += rotation.transpose() * gap;
    }
    let point = normal.try_inverse().unwrap_or_default() * right;
    let jacobian = |q: &_| {
        let frames = posed.frames(q);
        let flange = frames.last() * nominal.flange;
        let at = flange * nalgebra::Point3::from(point);
        let full = joint_jacobian(&posed, q, &frames, &at.coords.into());
        (at.coords, full.fixed_view::<3, 6>(0, 0).into_owned())
    };
    let (mut before, mut expected) = (0.0, 0.0);
    let n = dataset.rows.len() as f64;
    let parts: Vec<(Vector3<f64>, Matrix3x6<f64>)> =
        dataset.rows.iter().map(|r| jacobian(&r.joints)).collect();
    for (i, (at, j)) in parts.iter().enumerate() {
        before += (readout(i) - at).norm_squared() / n;
        expected += ((j * j.transpose()).trace() * angle_variance + 3.0 * readout_variance) / n;
    }
    let (before_mm, expected_mm) = (before.sqrt(), expected.sqrt());
    if before_mm > 3.0 * expected_mm {
        return Err(NotFused::Mismatch { found_mm: before_mm, expected_mm });
    }
    let mut covariances = Vec::with_capacity(dataset.rows.len());
    let (mut after, mut narrowed) = (0.0, 0.0);
    for row in &mut dataset.rows {
        let target = row.readout_mm().unwrap_or_default();
        let logged = row.joints;
        let mut covariance = Matrix6::identity() * angle_variance;
        for _ in 0..4 {
            let (at, j) = jacobian(&row.joints);
            let information = Matrix6::identity() / angle_variance + j.transpose() * j / readout_variance;
            let Some(inverse) = information.cholesky().map(|c| c.inverse()) else { break };
            let pull =
                j.transpose() * (target - at) / readout_variance + (logged - row.joints) / angle_variance;
            row.joints += inverse * pull;
            covariance = inverse;
        }
        after += (target - jacobian(&row.joints).0).norm_squared() / n;
        narrowed += (covariance.trace() / (6.0 * angle_variance)).sqrt() / n;
        covariances.push(covariance);
    }
    let report =
        ReadoutFusion { readout_point_mm: point, before_mm, after_mm: after.sqrt(), expected_mm, narrowed };
    Ok((report, covariances))
}

/// Weights of all rows from the sensor's standard deviations and the covariance of the angles.
///
/// `sigma_mm` is the sensor's standard deviation, unmodelled effects included, `sigma_rad` that of an orientation. For
/// positions and poses the variance due to the angles is averaged over the three axes.
pub fn weights(
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
    angles: &AngleCovariance,
    sigma_mm: f64,
    sigma_rad: f64,
) -> Vec<Weight> {
    if angles.is_zero() {
        return vec![Weight { per_mm: 1.0 / sigma_mm, per_rad: 1.0 / sigma_rad }; dataset.rows.len()];
    }
    weights_of(&angle_shares(dataset, model, frames, angles), sigma_mm, sigma_rad)
}

/// The same from the shares of the angles.
pub(crate) fn weights_of(shares: &[(f64, f64)], sigma_mm: f64, sigma_rad: f64) -> Vec<Weight> {
    shares
        .iter()
        .map(|(mm, rad)| Weight {
            per_mm: 1.0 / (sigma_mm * sigma_mm + mm).sqrt(),
            per_rad: 1.0 / (sigma_rad * sigma_rad + rad).sqrt(),
        })
        .collect()
}

/// Variance of each row's length (mm²) and orientation (rad²) due to the angles.
pub fn angle_shares(
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
    angles: &AngleCovariance,
) -> Vec<(f64, f64)> {
    if angles.is_zero() {
        return vec![(0.0, 0.0); dataset.rows.len()];
    }
    let still = Condition::default();
    let posed = model.at_condition(&still);
    // Rows are independent, so the result does not depend on the number of threads.
    (0..dataset.rows.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            checkpoint();
            let row = &dataset.rows[i];
            let covariance = angles.of(i);
            if covariance.trace() == 0.0 {
                return (0.0, 0.0);
            }
            let chain = posed.frames(&row.joints);
            let flange = chain.last() * model.flange;
            let point = flange * nalgebra::Point3::from(frames.flange_from_target.translation.vector);
            let full = joint_jacobian(&posed, &row.joints, &chain, &point.coords.into());
            let spread = full * covariance * full.transpose();
            let length = match dataset.sensor {
                Sensor::Cable => {
                    let u = (point.coords - frames.outlets_mm[row.anchor]).normalize();
                    (u.transpose() * spread.fixed_view::<3, 3>(0, 0) * u)[0]
                }
                Sensor::Position | Sensor::Pose => spread.fixed_view::<3, 3>(0, 0).trace() / 3.0,
            };
            (length, spread.fixed_view::<3, 3>(3, 3).trace() / 3.0)
        })
        .collect()
}

/// Step of readings from which it counts (mm): finer ones are below the noise of any sensor.
const COARSE_MM: f64 = 0.05;

/// RMS effect of rounded angles and of the reading's own rounding on a reading (mm), of a position over all three coordinates; `None` where
/// nothing is rounded.
pub fn rounding_floor_mm(
    dataset: &Dataset,
    model: &Model,
    frames: &Frames,
    angles: &AngleCovariance,
) -> Option<f64> {
    let shares = angle_shares(dataset, model, frames, angles);
    let coordinates = dataset.sensor.axes() as f64;
    let of_angles = shares.iter().map(|share| share.0).sum::<f64>() / shares.len().max(1) as f64;
    let of_reading =
        dataset.reading_step_mm.filter(|step| *step >= COARSE_MM).map_or(0.0, |step| step * step / 12.0);
    let mean = coordinates * (of_angles + of_reading);
    (mean > 0.0).then(|| mean.sqrt())
}
