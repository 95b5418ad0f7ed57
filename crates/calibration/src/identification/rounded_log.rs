//! Whether a log rounds the joint angles, or its program commanded them in whole steps: what the residuals say.
//!
//! Angles that are multiples of a step h are the commanded ones to the last digit, or were rounded to it. If they were rounded, the residual of
//! row i beside noise of variance s² in each coordinate has a scatter of known size: with gⱼ the movement of the target for h/√12 about joint j,
//!
//! cov rᵢ = (s² + c²) 1 + Σⱼ (1 + eⱼ) gⱼ gⱼᵀ,  c², eⱼ ≥ 0,
//!
//! eⱼ for what else errs about that joint, c² for what differs from pose to pose but not about a joint; s² is also that of the repetitions of a
//! pose. If they are exact, the arm's own errors make all of it, cov rᵢ = (s² + c²) 1 + Σⱼ tⱼ gⱼ gⱼᵀ with any tⱼ ≥ 0. That all joints scatter by
//! just h/√12 is an accident then, for which as many parameters as there are visible joints must be right.
//! Either model gets those of c², eⱼ and tⱼ that lower its Bayesian information criterion; the difference of the two criteria decides. Arms
//! whose own errors exceed the rounding about every joint look alike under both, and nothing is decided: it would change little.
//!
//! Maximum likelihood by the multiplicative MM step for variance components: Zhou, Hu, Zhou and Lange 2019, equation 3. Degrees of freedom that the
//! parameters took up shrink all residuals alike.

use nalgebra::{DMatrix, Matrix3, Matrix3x6, Point3, Vector3};
use rayon::prelude::*;

use super::calibration::{CalibrationProblem, Frames, Weight};
use super::fit::Observations;
use crate::measurement::dataset::Sensor;
use crate::measurement::noise_floor::NoiseFloor;
use truegrind_arm::jacobian::joint_jacobian;
use truegrind_arm::model::Model;
use truegrind_estimation::problem::{Prior, effective_parameters};
use truegrind_math::work::checkpoint;

/// What a log that rounds the angles leaves in the readings (mm, RMS over all coordinates of a reading).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RoundedLog {
    /// The rounding.
    pub(crate) rounding_mm: f64,
    /// All else: noise of the sensor and errors of the arm.
    pub(crate) other_mm: f64,
}

/// What the residuals say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Rounding {
    /// The log rounds.
    Rounded(RoundedLog),
    /// The angles are exact: rounding would scatter the readings more than they do.
    Exact,
    /// Neither is clear, or nothing is rounded.
    Undecided,
}

/// Least part of the mean square held-out error from which the rounding is told.
const TOLD_SHARE: f64 = 0.25;

impl Rounding {
    /// A note on the angles, in steps of `step_rad`, beside a held-out error that is larger than the expected one.
    pub(crate) fn note(&self, step_rad: Option<f64>, held_out_mm: f64) -> Option<String> {
        let Self::Rounded(RoundedLog { rounding_mm, .. }) = self else { return None };
        let step_deg = step_rad?.to_degrees();
        (rounding_mm.powi(2) >= TOLD_SHARE * held_out_mm.powi(2)).then(|| {
            format!(
                "the log rounds joint angles to {step_deg:.3}°, which alone moves the target by {rounding_mm:.3} mm RMS, in held-out rows too. \
                 This is not an error of the arm, so the expected error does not include it; log the angles with more digits"
            )
        })
    }
}

/// A fit, of which the residuals are asked.
pub(crate) struct Asked<'a> {
    pub(crate) observed: &'a Observations,
    pub(crate) model: &'a Model,
    pub(crate) frames: &'a Frames,
    /// Parameters that it took up; see [`spent`].
    pub(crate) spent: f64,
    /// Rows with a gross error.
    pub(crate) set_aside: &'a [usize],
    /// The scatter of repeated poses.
    pub(crate) repeats: Option<&'a NoiseFloor>,
}

/// Difference of the criteria from which one model is true: twice the log Bayes factor, 20 to 1, as of an identified cause.
const CLEAR_TWICE_LOG_BF: f64 = 6.0;

/// Fewest scalar readings.
const MIN_READINGS: usize = 60;

/// Most rows that are looked at; they are evenly spaced.
const MAX_ROWS: usize = 400;

/// Steps of a maximisation.
const STEPS: usize = 60;

/// Least part of the mean square residual that rounding would make for it to be looked for.
const MIN_SHARE: f64 = 0.05;

/// A row: its residual (mm), and the movement for a step's standard deviation about each joint. A cable has one coordinate; the others are
/// known to be 0.
struct Row {
    residual: Vector3<f64>,
    by_joint: Matrix3x6<f64>,
}

impl Asked<'_> {
    /// Whether the log rounds.
    pub(crate) fn rounding(&self) -> Rounding {
        let Some(rows) = self.rows() else { return Rounding::Undecided };
        let [exact, rounded] = [0.0, 1.0].map(|known| rows.best(known));
        let against_exact = exact.criterion - rounded.criterion;
        if against_exact < -CLEAR_TWICE_LOG_BF {
            Rounding::Exact
        } else if against_exact < CLEAR_TWICE_LOG_BF {
            Rounding::Undecided
        } else {
            Rounding::Rounded(rows.told_by(&rounded))
        }
    }

    /// What there is beside the rounding if the log rounds, as another fit to its rows shows; `None` where rounding is too small to matter.
    pub(crate) fn if_rounded(&self) -> Option<RoundedLog> {
        let rows = self.rows()?;
        Some(rows.told_by(&rows.best(1.0)))
    }

    /// The rows, where there are enough and the rounding might be a good part of their residuals.
    fn rows(&self) -> Option<Rows> {
        let dataset = &self.observed.dataset;
        // Angles that the controller's read-out made finer have their own scatter in each row.
        let sigma_rad = self.observed.angles.common_sigma_rad().filter(|sigma| *sigma > 0.0)?;
        let counted: Vec<usize> =
            (0..dataset.rows.len()).filter(|row| !self.set_aside.contains(row)).collect();
        let axes = dataset.sensor.axes();
        let scalars = (counted.len() * axes) as f64;
        if counted.len() * axes < MIN_READINGS || self.spent > 0.5 * scalars {
            return None;
        }
        let chosen: Vec<usize> = counted.iter().step_by(counted.len().div_ceil(MAX_ROWS)).copied().collect();
        // As large as they would be had no parameter followed them.
        let freed = (1.0 - self.spent / scalars).sqrt().recip();
        let list = self.list(&chosen, sigma_rad, freed);
        let repeats = self.repeats.map(|floor| (floor.sigma_mm.powi(2), floor.freedom as f64));
        let rows = Rows { list, axes, repeats };
        let square = rows.mean(|row| row.residual.norm_squared());
        let by_rounding = rows.mean(|row| row.by_joint.norm_squared());
        (square.is_finite() && by_rounding > MIN_SHARE * square).then_some(rows)
    }

    /// The chosen rows, with angles of this standard deviation and residuals that are `freed` times as large.
    fn list(&self, chosen: &[usize], sigma_rad: f64, freed: f64) -> Vec<Row> {
        let Self { observed, model, frames, .. } = self;
        let part = observed.dataset.subset(chosen);
        let (per, axes) = (part.sensor.scalars(), part.sensor.axes());
        let weights = vec![Weight { per_mm: 1.0, per_rad: 1.0 }; part.rows.len()];
        let plain =
            CalibrationProblem::new(&part, model, frames, &[], &[], &weights).unweighted_residuals(&[]);
        let row = |(i, row): (usize, &crate::measurement::dataset::Row)| {
            checkpoint();
            let posed = model.at_condition(&row.condition);
            let chain = posed.frames(&row.joints);
            let flange = chain.last() * model.flange;
            let at = flange * Point3::from(frames.flange_from_target.translation.vector);
            let full = joint_jacobian(&posed, &row.joints, &chain, &at.coords.into());
            let mut by_joint: Matrix3x6<f64> = full.fixed_view::<3, 6>(0, 0) * sigma_rad;
            if part.sensor == Sensor::Cable {
                let along = (at.coords - frames.outlets_mm[row.anchor]).normalize();
                let lengths = along.transpose() * by_joint;
                by_joint = Matrix3x6::zeros();
                by_joint.row_mut(0).copy_from(&lengths);
            }
            let residual = Vector3::from_fn(|k, _| if k < axes { freed * plain[i * per + k] } else { 0.0 });
            Row { residual, by_joint }
        };
        part.rows.iter().enumerate().map(row).collect()
    }
}

struct Rows {
    list: Vec<Row>,
    /// Coordinates of a reading.
    axes: usize,
    /// Mean square of repeated poses (mm², all coordinates), and its degrees of freedom.
    repeats: Option<(f64, f64)>,
}

/// Further scatters: six about joints, then c².
const FURTHER: usize = 7;
const FROM_POSE_TO_POSE: usize = 6;

/// A model at its most likely.
#[derive(Debug, Clone, Copy)]
struct Likeliest {
    /// −2 ln L + k ln N, without constants.
    criterion: f64,
    /// s² (mm²).
    noise: f64,
    /// eⱼ or tⱼ, then c² (mm²).
    further: [f64; FURTHER],
}

impl Rows {
    fn mean(&self, of: impl Fn(&Row) -> f64) -> f64 {
        self.list.iter().map(of).sum::<f64>() / self.list.len().max(1) as f64
    }

    /// What a model in which the log rounds says.
    fn told_by(&self, rounded: &Likeliest) -> RoundedLog {
        let about_joints = self.mean(|row| {
            (0..6).map(|j| rounded.further[j] * row.by_joint.column(j).norm_squared()).sum::<f64>()
        });
        let other = self.axes as f64 * (rounded.noise + rounded.further[FROM_POSE_TO_POSE]) + about_joints;
        RoundedLog {
            rounding_mm: self.mean(|row| row.by_joint.norm_squared()).sqrt(),
            other_mm: other.max(0.0).sqrt(),
        }
    }

    /// The model in which `known` times the rounding is there whatever else is, with the further scatters that it gains by.
    fn best(&self, known: f64) -> Likeliest {
        let mut free: Vec<usize> = Vec::new();
        let mut best = self.likeliest(known, &free);
        loop {
            let more = (0..FURTHER).filter(|one| !free.contains(one));
            let tried: Vec<Vec<usize>> = more.map(|one| [free.as_slice(), &[one]].concat()).collect();
            let found = tried.into_par_iter().map(|free| (self.likeliest(known, &free), free));
            let found: Vec<(Likeliest, Vec<usize>)> = found.collect();
            let next = found.into_iter().min_by(|a, b| a.0.criterion.total_cmp(&b.0.criterion));
            match next {
                Some((next, with)) if next.criterion < best.criterion => (best, free) = (next, with),
                _ => return best,
            }
        }
    }

    /// The most likely variances with the further scatters `free`.
    fn likeliest(&self, known: f64, free: &[usize]) -> Likeliest {
        let scalars = (self.list.len() * self.axes) as f64;
        let square = self.mean(|row| row.residual.norm_squared()) / self.axes as f64;
        let mut noise = 0.3 * square;
        let mut further = [0.0; FURTHER];
        for &one in free {
            further[one] = if one == FROM_POSE_TO_POSE { 0.3 * square } else { 0.3 };
        }
        let mut minus_twice_log = 0.0;
        for _ in 0..STEPS {
            checkpoint();
            let mut sums = Sums::default();
            self.list.iter().for_each(|row| sums.add(row, self.axes, noise, known, &further, free));
            if let Some((mean_square, freedom)) = self.repeats {
                sums.add_repeats(mean_square, freedom, self.axes as f64, noise);
            }
            minus_twice_log = sums.minus_twice_log;
            let step = |[pull, information]: [f64; 2]| {
                if information > 0.0 { (pull / information).sqrt() } else { 0.0 }
            };
            noise = (noise * step(sums.noise)).max(1e-9 * square);
            free.iter().for_each(|&one| further[one] *= step(sums.further[one]));
        }
        let parameters = 1.0 + free.len() as f64;
        Likeliest { criterion: minus_twice_log + parameters * scalars.ln(), noise, further }
    }
}

/// Sums over the rows: −2 ln L, and of each variance the two sides of its likelihood equation.
#[derive(Default)]
struct Sums {
    minus_twice_log: f64,
    noise: [f64; 2],
    further: [[f64; 2]; FURTHER],
}

impl Sums {
    fn add(
        &mut self,
        row: &Row,
        axes: usize,
        noise: f64,
        known: f64,
        further: &[f64; FURTHER],
        free: &[usize],
    ) {
        let mut covariance = Matrix3::zeros();
        // Coordinates that a reading does not have are 0 with variance 1, which adds nothing.
        let own = noise + further[FROM_POSE_TO_POSE];
        (0..3).for_each(|k| covariance[(k, k)] = if k < axes { own } else { 1.0 });
        for (g, of_joint) in row.by_joint.column_iter().zip(further) {
            covariance += (known + of_joint) * g * g.transpose();
        }
        let Some(factor) = covariance.cholesky() else { return };
        let (inverse, pull) = (factor.inverse(), factor.solve(&row.residual));
        self.minus_twice_log += factor.determinant().ln() + row.residual.dot(&pull);
        let mut alike = [0.0; 2];
        for k in 0..axes {
            alike[0] += pull[k] * pull[k];
            alike[1] += inverse[(k, k)];
        }
        let add = |sum: &mut [f64; 2], [pull, information]: [f64; 2]| {
            sum[0] += pull;
            sum[1] += information;
        };
        add(&mut self.noise, alike);
        for &one in free {
            if one == FROM_POSE_TO_POSE {
                add(&mut self.further[one], alike);
            } else {
                let g = row.by_joint.column(one);
                add(&mut self.further[one], [g.dot(&pull).powi(2), (inverse * g).dot(&g)]);
            }
        }
    }

    /// The differences between the repetitions of a pose: nothing but noise.
    fn add_repeats(&mut self, mean_square: f64, freedom: f64, axes: f64, noise: f64) {
        self.minus_twice_log += freedom * (axes * noise.ln() + mean_square / noise);
        self.noise[0] += freedom * mean_square / noise.powi(2);
        self.noise[1] += freedom * axes / noise;
    }
}

/// Effective number of parameters of a fit; all of them where their covariance is not known.
pub(crate) fn spent(covariance: Option<&DMatrix<f64>>, priors: &[Prior]) -> f64 {
    let variances = covariance.map(DMatrix::diagonal);
    variances.map_or(priors.len() as f64, |found| effective_parameters(found.iter().copied(), priors))
}
