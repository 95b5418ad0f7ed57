//! What programs would gain from the tracked model where no change is to be told.
//!
//! A model may leave open what the poses of its fit did not show: causes that are alike on them, directions that stayed at their tolerance. The
//! filter learns these from a healthy arm's poses. That is no change of the arm, and the programs remain what they were; corrected again with
//! the tracked model they may be several times better.
//!
//! The tracked model is judged by poses that it has not used: each is predicted before it is filtered. The model in use predicts the same poses
//! with sensor and target placed as they suit it best, so that it is not blamed for their frames.

use nalgebra::{DMatrix, DVector};

use super::state::PoseRecord;
use super::tracker::Tracker;
use crate::tracking::bounds::outlier_bound;
use truegrind_estimation::problem::Problem;

/// Fewest poses of a judgement.
const MIN_POSES: usize = 30;
/// Latest poses that are judged at most.
const MAX_POSES: usize = 200;
/// Standard deviations of the mean by which squared errors must differ: 1 in 1000.
const SIGNIFICANT: f64 = 3.1;
/// Steps that place sensor and target under the model in use.
const STEPS: usize = 4;
/// Added to the normal equations, as a share of their diagonal.
const DAMPING: f64 = 1e-9;

/// Errors of the model in use and of the tracked one on poses that neither had used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Poses.
    pub poses: usize,
    /// RMS error of the readings under the model in use, with sensor and target placed anew (mm).
    pub in_use_mm: f64,
    /// RMS error of the tracked model, each pose before it was used (mm).
    pub tracked_mm: f64,
    /// Standard deviation of the difference of the squares (mm²).
    pub sigma_mm2: f64,
}

impl Gain {
    /// Mean square that the tracked model takes off (mm²).
    fn square_mm2(&self) -> f64 {
        self.in_use_mm.powi(2) - self.tracked_mm.powi(2)
    }

    /// Whether it is no chance, and larger than the noise of what the tracked model leaves.
    fn counts(&self) -> bool {
        self.square_mm2() > SIGNIFICANT * self.sigma_mm2 && self.square_mm2() > self.tracked_mm.powi(2)
    }
}

impl Tracker {
    /// What the tracked model is better by, where that is significant and larger than the noise; `None` also after any alarm, which tells more.
    pub fn gain(&self) -> Option<Gain> {
        if !self.state.alarms.is_empty() {
            return None;
        }
        self.gain_on(&self.unused()?).filter(Gain::counts)
    }

    /// The latest poses that were predicted before they were used, after those that place the sensor; without those set aside.
    fn unused(&self) -> Option<Vec<PoseRecord>> {
        let options = &self.state.options;
        let history = &self.state.history;
        let forgotten = self.state.poses.saturating_sub(history.len());
        let from = (options.first_poses + options.window.max(1)).saturating_sub(forgotten);
        let bound = outlier_bound(self.state.sensor.scalars());
        let is_used = |record: &&PoseRecord| record.predicted_mm.is_some() && record.nis <= bound;
        let kept: Vec<PoseRecord> = history.iter().skip(from).filter(is_used).cloned().collect();
        let latest = kept.len().saturating_sub(MAX_POSES);
        (kept.len() >= MIN_POSES).then(|| kept[latest..].to_vec())
    }

    fn gain_on(&self, records: &[PoseRecord]) -> Option<Gain> {
        let in_use = self.squares_of_model_in_use(records)?;
        let tracked: Vec<f64> = records.iter().filter_map(|r| Some(r.predicted_mm?.powi(2))).collect();
        let count = records.len() as f64;
        let mean = |of: &[f64]| of.iter().sum::<f64>() / count;
        let gains: Vec<f64> = in_use.iter().zip(&tracked).map(|(a, b)| a - b).collect();
        let scatter = gains.iter().map(|gain| (gain - mean(&gains)).powi(2)).sum::<f64>() / (count - 1.0);
        let gain = Gain {
            poses: records.len(),
            in_use_mm: mean(&in_use).sqrt(),
            tracked_mm: mean(&tracked).sqrt(),
            sigma_mm2: (scatter / count).sqrt(),
        };
        (gain.in_use_mm.is_finite() && gain.tracked_mm.is_finite()).then_some(gain)
    }

    /// Squared errors (mm²) under the model that tracking began with, by Gauss–Newton in the frames alone, as many as these take up counted.
    fn squares_of_model_in_use(&self, records: &[PoseRecord]) -> Option<Vec<f64>> {
        let problem = self.problem(records);
        let (arm, p) = (self.initial.order.len(), self.parameters.len());
        let frames = self.first_of_frames();
        let rows = problem.rows();
        let mut x = vec![0.0; p];
        x[arm..].copy_from_slice(&self.filter.x.as_slice()[arm..]);
        let (mut r, mut j) = (vec![0.0; rows], vec![0.0; rows * p]);
        for _ in 0..STEPS {
            problem.jacobian(&x, 0..rows, &mut r, &mut j);
            let slopes = DMatrix::from_column_slice(rows, p - frames, &j[frames * rows..]);
            let mut normal = slopes.tr_mul(&slopes);
            // What no reading tells of the frames stays where it is.
            let damping = DAMPING * normal.diagonal();
            (0..p - frames).for_each(|k| normal[(k, k)] += damping[k].max(f64::MIN_POSITIVE));
            let step = normal.cholesky()?.solve(&slopes.tr_mul(&DVector::from_column_slice(&r)));
            x[frames..].iter_mut().zip(step.iter()).for_each(|(x, step)| *x -= step);
        }
        problem.residuals(&x, 0..rows, &mut r);
        let per = problem.rows_per_observation();
        let freedom = rows as f64 / (rows.checked_sub(p - frames).filter(|left| *left > 0)?) as f64;
        let square = |(rows, record): (&[f64], &PoseRecord)| {
            freedom * rows.iter().take(3).map(|r| r * r).sum::<f64>() / record.per_mm.powi(2)
        };
        Some(r.chunks(per).zip(records).map(square).collect())
    }
}
