//! Whether an estimated arm will serve programs better than the data sheet: the benefit that its own data predict.
//!
//! A small held-out error is no proof. A sensor that reads everything too long is held out just as well, and a fit of few
//! noisy rows follows their noise. So what the fit found is judged against what else could have made the same readings:
//!
//! - arms nearer to their data sheet than the prior allows, with more noise: the width of lengths and angles and the
//!   sensor's σ are no numbers here but grids, weighed by evidence;
//! - a sensor whose scale is off, beside any such arm.
//!
//! With x̂ what is written and x the arm as these rivals believe it, a point that rides on the flange moves by J x̂ where it
//! should move by J x. Against the arm of the data sheet that is worth
//!
//! |J x|² − |J (x − x̂)|² = 2 x̂ᵀM x − x̂ᵀM x̂,  M = mean of Jᵀ J over poses of the measured region,
//!
//! which is linear in x: under each rival it has a normal distribution, and their mixture says how likely it is above zero.
//! J is taken apart from motions of the base and of the point on the flange, which the data do not see and which placing
//! the part takes care of.
//!
//! Everything is linear about the estimate, from one pass over the rows: normal equations with the scale's column beside
//! them. Evidence of linear models with normal priors as in any text (Bishop 2006, section 3.5).
//! Checked against: simulated arms at fresh poses (tests, and the sweep in `benches/verdict.rs`).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{MatMut, MatRef, Par};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::identification::calibration::Calibration;
use crate::identification::fit::{Fitted, Observed};
use crate::identification::rounding;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::{Dataset, Reading, Sensor};
use crate::measurement::sensor::disturbance::{Course, Kind};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::jacobian::{Ends, parameter_jacobian};
use truegrind_arm::model::Joints;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Problem;
use truegrind_math::se3::{Pose, vector_from_pose};
use truegrind_math::tail::normal_two_sided;
use truegrind_math::work::checkpoint;

/// What a model promises inside its measured region, apart from where base and flange are placed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Benefit {
    /// Expected RMS position error of the data sheet's arm (mm).
    pub nominal_mm: f64,
    /// Expected RMS position error of the estimated arm (mm).
    pub estimated_mm: f64,
    /// Probability that the estimated arm is the better one.
    pub chance: f64,
    /// The same if the sensor's scale were known to be right.
    pub chance_without_scale: f64,
    /// The sensor's scale as the rival that has one finds it; absent where the fit held one itself.
    pub scale: Option<ScaleError>,
    /// Scalar readings.
    pub readings: usize,
    /// Parameters that the readings determine: Σ (1 − σ²/prior²).
    pub determined: f64,
    /// Parameters of the fit.
    pub parameters: usize,
}

/// A scale of the sensor that explains readings in the place of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ScaleError {
    /// Probability of the rivals with a scale, against those without.
    pub probability: f64,
    /// Relative error: positive where readings are too long.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Share of the squared correction that is left to the arm's geometry beside the scale.
    pub left: f64,
    /// Expected RMS error (mm) of the estimated arm if there is such a scale.
    pub estimated_mm: f64,
    /// Expected RMS error (mm) of the data sheet's arm if there is such a scale.
    pub nominal_mm: f64,
}

/// Widths of lengths and of angles that are tried, as shares of the tolerance.
const LENGTHS: [f64; 6] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0];
const ANGLES: [f64; 7] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0];
/// The sensor's σ that is tried, as a multiple of the fit's.
const NOISES: [f64; 4] = [0.71, 1.0, 1.41, 2.0];
/// With more parameters than this every second width is left out.
const MANY: usize = 90;

/// What may stand beside the arm, with its probability beforehand: nothing, or a scale. Those of a good instrument are
/// parts in a million; what is weighed here are faults, met in a fifth of the cases: atmosphere and drift, a wrong wheel or
/// calibration, a wrong unit.
const RIVALS: [Rival; 4] = [
    Rival { sigma: None, before: 0.8 },
    Rival { sigma: Some(1e-3), before: 0.05 },
    Rival { sigma: Some(4e-3), before: 0.1 },
    Rival { sigma: Some(1e-2), before: 0.05 },
];

#[derive(Debug, Clone, Copy)]
struct Rival {
    /// Standard deviation of the sensor's relative scale error; absent where the scale is taken to be right.
    sigma: Option<f64>,
    before: f64,
}

/// Readings as linear equations in the parameters and a scale of the sensor.
struct Readings {
    /// JᵀJ, the scale last.
    matrix: DMatrix<f64>,
    /// Jᵀy.
    right: DVector<f64>,
    /// yᵀy.
    square: f64,
    count: usize,
}

/// Weighs the fit `fitted` of `dataset` against its rivals. `tolerance` is what an arm plausibly deviates by; `lack` is how
/// many times larger than it should be the square of a held-out error was.
///
/// `None` where nothing of the arm was fitted, or nothing is finite.
pub fn benefit(
    fitted: &Fitted,
    dataset: &Dataset,
    estimated: &Estimated,
    tolerance: &Tolerance,
    lack: f64,
) -> Option<Benefit> {
    let moved = shape_weights(fitted, &estimated.condition, &estimated.region.samples_deg)?;
    let mut readings = readings(fitted, dataset);
    readings.within_the_arm(fitted, tolerance)?;
    let x = DVector::from_column_slice(&fitted.estimate.x);
    let toward = &moved * &x;
    let square = x.dot(&toward);
    let written = Written { moved: &moved, x: &x, toward: &toward, square, lack };
    let weighed = weighed(&beliefs(fitted, tolerance), &readings, &written)?;
    let total: f64 = weighed.iter().map(|(w, _)| w).sum();
    let mean = |of: &dyn Fn(&View) -> f64, only: &dyn Fn(&View) -> bool| {
        let (mut sum, mut weight) = (0.0, 0.0);
        for (w, view) in weighed.iter().filter(|(_, v)| only(v)) {
            sum += w * of(view);
            weight += w;
        }
        if weight > 0.0 { sum / weight } else { f64::NAN }
    };
    let (any, plain) = (&|_: &View| true, &|v: &View| v.scale.is_none());
    let scaled = |v: &View| v.scale.is_some();
    let scale = (!held_already(fitted)).then(|| {
        let value = mean(&|v| v.scale.map_or(0.0, |s| s.0), &scaled);
        let spread = mean(&|v| v.scale.map_or(0.0, |s| s.1 + (s.0 - value).powi(2)), &scaled);
        ScaleError {
            probability: weighed.iter().filter(|(_, v)| scaled(v)).map(|(w, _)| w).sum::<f64>() / total,
            value,
            sigma: spread.sqrt(),
            left: mean(&|v| v.left, &scaled),
            estimated_mm: mean(&|v| v.estimated, &scaled).max(0.0).sqrt(),
            nominal_mm: mean(&|v| v.nominal, &scaled).max(0.0).sqrt(),
        }
    });
    let shares = fitted.sigmas().into_iter().zip(&fitted.priors);
    Some(Benefit {
        nominal_mm: mean(&|v| v.nominal, any).max(0.0).sqrt(),
        estimated_mm: mean(&|v| v.estimated, any).max(0.0).sqrt(),
        chance: mean(&|v| v.chance, any),
        chance_without_scale: mean(&|v| v.chance, plain),
        scale: scale.filter(|s| s.value.is_finite()),
        readings: readings.count,
        determined: shares.map(|(s, p)| (1.0 - (s / p.sigma).powi(2)).clamp(0.0, 1.0)).sum(),
        parameters: x.len(),
    })
}

/// The views of all beliefs that count, with their weights, the largest 1.
fn weighed(beliefs: &[Belief], readings: &Readings, written: &Written<'_>) -> Option<Vec<(f64, View)>> {
    let arm = written.x.len();
    let seen = RIVALS.map(|rival| rival.seen(readings, arm));
    let seen_by = |belief: &Belief| &seen[belief.rival];
    let heard: Vec<Option<f64>> = beliefs
        .par_iter()
        .map(|belief| {
            checkpoint();
            belief.log_weight(seen_by(belief), readings)
        })
        .collect();
    let best = heard.iter().flatten().copied().fold(f64::NEG_INFINITY, f64::max);
    let views = beliefs
        .par_iter()
        .zip(&heard)
        .filter_map(|(belief, heard)| {
            checkpoint();
            let log = (*heard)? - best;
            (log > NEGLIGIBLE).then(|| Some((log.exp(), belief.view(seen_by(belief), written)?)))?
        })
        .collect::<Vec<_>>();
    (!views.is_empty()).then_some(views)
}

/// Rivals whose log evidence is so far behind add nothing.
const NEGLIGIBLE: f64 = -14.0;

impl Readings {
    /// Takes of the scale what the parameters of the fit could explain as well. What is left over would fit whatever else the
    /// arm does that is no geometry, and with thousands of rows make a scale of it; and a true scale has next to nothing left
    /// over, since it is an arm that is larger. Which of two explanations of the same readings holds is then for the
    /// tolerances alone to say.
    fn within_the_arm(&mut self, fitted: &Fitted, tolerance: &Tolerance) -> Option<()> {
        let arm = fitted.parameters.len();
        let held = self.matrix.view((0, 0), (arm, arm)).into_owned();
        let mut matrix = held.clone();
        for (k, (parameter, prior)) in fitted.parameters.iter().zip(&fitted.priors).enumerate() {
            let sigma = match parameter {
                Parameter::Link { .. } => FREE * tolerance.prior(parameter, &fitted.model).sigma,
                _ => prior.sigma,
            };
            matrix[(k, k)] += 1.0 / (sigma * sigma);
        }
        let (factor, _) = factored(&matrix)?;
        let beside = self.matrix.view((0, arm), (arm, 1)).column(0).into_owned();
        let moves = factor.solve(&beside);
        let seen = held * &moves;
        self.right[arm] = moves.dot(&self.right.rows(0, arm));
        self.matrix[(arm, arm)] = moves.dot(&seen);
        for k in 0..arm {
            self.matrix[(k, arm)] = seen[k];
            self.matrix[(arm, k)] = seen[k];
        }
        Some(())
    }
}

/// Links may move this many of their tolerances to explain a scale.
const FREE: f64 = 10.0;

/// Whether the fit itself has a scale for all rows beside the arm.
fn held_already(fitted: &Fitted) -> bool {
    fitted.frames.disturbances.iter().any(|d| d.kind == Kind::Scale && d.course == Course::Always)
}

/// A rival with its widths and noise.
struct Belief {
    /// Place in [`RIVALS`].
    rival: usize,
    /// Weight of each parameter's prior, 1/σ², the scale's included.
    precision: Vec<f64>,
    noise: f64,
}

fn beliefs(fitted: &Fitted, tolerance: &Tolerance) -> Vec<Belief> {
    let step = if fitted.parameters.len() > MANY { 2 } else { 1 };
    let held = held_already(fitted);
    let mut out = Vec::new();
    for (rival, kind) in RIVALS.iter().enumerate() {
        if kind.sigma.is_some() && held {
            continue;
        }
        for length in LENGTHS.iter().step_by(step) {
            for angle in ANGLES.iter().step_by(step) {
                let links =
                    fitted.parameters.iter().zip(&fitted.priors).map(|(parameter, prior)| match parameter {
                        Parameter::Link { coordinate, .. } if coordinate.is_length() => {
                            length * tolerance.length_mm
                        }
                        Parameter::Link { .. } => angle * tolerance.angle_rad,
                        _ => prior.sigma,
                    });
                let precision: Vec<f64> = links.chain(kind.sigma).map(|s| 1.0 / (s * s)).collect();
                out.extend(NOISES.map(|noise| Belief { rival, precision: precision.clone(), noise }));
            }
        }
    }
    out
}

impl Rival {
    /// The readings as this rival sees them.
    fn seen(&self, readings: &Readings, arm: usize) -> Seen {
        let size = arm + usize::from(self.sigma.is_some());
        Seen {
            matrix: readings.matrix.view((0, 0), (size, size)).into_owned(),
            right: readings.right.rows(0, size).into_owned(),
        }
    }
}

/// Normal equations of a rival, priors not included.
struct Seen {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

/// What is written, and where it counts.
struct Written<'a> {
    /// M (mm² per unit of parameters squared).
    moved: &'a DMatrix<f64>,
    /// x̂.
    x: &'a DVector<f64>,
    /// M x̂.
    toward: &'a DVector<f64>,
    /// x̂ᵀ M x̂ (mm²).
    square: f64,
    /// By what variances are multiplied.
    lack: f64,
}

/// What a belief makes of the model.
struct View {
    /// Chance that the model helps.
    chance: f64,
    /// Expected squared error of the data sheet's arm (mm²).
    nominal: f64,
    /// The same of the estimated arm (mm²).
    estimated: f64,
    /// Mean scale and its variance.
    scale: Option<(f64, f64)>,
    /// Share of the squared correction left to geometry.
    left: f64,
}

impl Belief {
    /// The factor of its normal equations, the logarithm of their determinant, and where the arm is.
    fn solved(&self, seen: &Seen) -> Option<(Scaled, f64, DVector<f64>)> {
        let weight = 1.0 / (self.noise * self.noise);
        let mut matrix = &seen.matrix * weight;
        for (k, precision) in self.precision.iter().enumerate() {
            matrix[(k, k)] += precision;
        }
        let (factor, log_determinant) = factored(&matrix)?;
        let found = factor.solve(&(&seen.right * weight));
        Some((factor, log_determinant, found))
    }

    fn log_weight(&self, seen: &Seen, readings: &Readings) -> Option<f64> {
        let (_, log_determinant, found) = self.solved(seen)?;
        let misfit = (readings.square - seen.right.dot(&found)) / (self.noise * self.noise);
        let log_prior: f64 = self.precision.iter().map(|p| p.ln()).sum();
        let spread = 2.0 * readings.count as f64 * self.noise.ln();
        let log = RIVALS[self.rival].before.ln() - 0.5 * (spread + log_determinant - log_prior + misfit);
        log.is_finite().then_some(log)
    }

    fn view(&self, seen: &Seen, written: &Written<'_>) -> Option<View> {
        let (factor, _, found) = self.solved(seen)?;
        let Written { moved, x, toward, square, lack } = *written;
        let arm = x.len();
        let along = DVector::from_fn(found.len(), |k, _| if k < arm { toward[k] } else { 0.0 });
        let variance = 4.0 * lack * along.dot(&factor.solve(&along));
        let there = found.rows(0, arm).into_owned();
        let mean = 2.0 * there.dot(toward) - square;
        let inverse = factor.inverse();
        let unknown = lack * moved.component_mul(&inverse.view((0, 0), (arm, arm))).sum();
        let off = x - &there;
        let believed = there.dot(&(moved * &there));
        let scale = (found.len() > arm).then(|| (found[arm], inverse[(arm, arm)]));
        Some(View {
            chance: if variance > 0.0 { below(mean / variance.sqrt()) } else { 0.5 },
            nominal: believed + unknown,
            estimated: off.dot(&(moved * &off)) + unknown,
            scale,
            left: if square > 0.0 { believed / square } else { f64::NAN },
        })
    }
}

/// Probability of a standard normal number below `value`.
pub(crate) fn below(value: f64) -> f64 {
    let tail = 0.5 * normal_two_sided(value);
    if value < 0.0 { tail } else { 1.0 - tail }
}

/// A Cholesky factor with the logarithm of the determinant, through unit diagonal: mm and rad are far apart.
fn factored(matrix: &DMatrix<f64>) -> Option<(Scaled, f64)> {
    let size = DVector::from_fn(matrix.nrows(), |k, _| matrix[(k, k)].sqrt().recip());
    if size.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let unit = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * size[i] * size[j]);
    let factor = if unit.nrows() > MANY { of_many(unit)? } else { Cholesky::new(unit)? };
    let determinant: f64 = factor.l_dirty().diagonal().iter().map(|v| 2.0 * v.ln()).sum();
    let scaling: f64 = size.iter().map(|s| 2.0 * s.ln()).sum();
    Some((Scaled { factor, size }, determinant - scaling))
}

/// AᵀA, of many columns in blocks.
fn squared(a: &DMatrix<f64>) -> DMatrix<f64> {
    if a.ncols() > MANY { a.transpose() * a } else { a.tr_mul(a) }
}

/// The factor of a large matrix, in blocks.
fn of_many(mut matrix: DMatrix<f64>) -> Option<Cholesky<f64, Dyn>> {
    let n = matrix.nrows();
    let request = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let mut memory = MemBuffer::new(request);
    let place = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
    let stack = MemStack::new(&mut memory);
    llt::factor::cholesky_in_place(place, Default::default(), Par::Seq, stack, Default::default()).ok()?;
    Some(Cholesky::pack_dirty(matrix))
}

/// (L Lᵀ)⁻¹ of a large factor, in blocks: XᵀX with X = L⁻¹.
fn inverse_of_many(factor: &Cholesky<f64, Dyn>) -> DMatrix<f64> {
    let lower = factor.l_dirty();
    let n = lower.nrows();
    let mut x = DMatrix::identity(n, n);
    let lower = MatRef::from_column_major_slice(lower.as_slice(), n, n);
    let place = MatMut::from_column_major_slice_mut(x.as_mut_slice(), n, n);
    faer::linalg::triangular_solve::solve_lower_triangular_in_place(lower, place, Par::Seq);
    squared(&x)
}

struct Scaled {
    factor: Cholesky<f64, Dyn>,
    size: DVector<f64>,
}

impl Scaled {
    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        self.factor.solve(&right.component_mul(&self.size)).component_mul(&self.size)
    }

    fn inverse(&self) -> DMatrix<f64> {
        let n = self.size.len();
        let unit = if n > MANY { inverse_of_many(&self.factor) } else { self.factor.inverse() };
        DMatrix::from_fn(unit.nrows(), unit.ncols(), |i, j| unit[(i, j)] * self.size[i] * self.size[j])
    }
}

/// Mean square of the held-out readings, each in units of the σ that the training fit predicts for it: 1 where the fit knows
/// what it does not know. Never below 1.
pub fn lack(training: &Fitted, held: &Observed) -> f64 {
    let (Some(covariance), x) = (&training.estimate.covariance, &training.estimate.x) else { return 1.0 };
    if x.is_empty() || held.dataset.rows.is_empty() {
        return 1.0;
    }
    let few = held.few();
    let held = few.as_ref().unwrap_or(held);
    let (sigma_mm, sigma_rad) = (training.sigma_mm, training.sigma_rad);
    let weights = rounding::weights(
        &held.dataset,
        &training.model,
        &training.frames,
        &held.angles,
        sigma_mm,
        sigma_rad,
    );
    let task = Calibration::new(
        &held.dataset,
        training.task.start(),
        training.task.starting_frames(),
        &training.parameters,
        &[],
        &weights,
    );
    let (residuals, transposed) = task.linearised(x);
    let mut sum = 0.0;
    // In pieces, as there may be a million rows.
    for from in (0..residuals.len()).step_by(ROWS) {
        let slopes = transposed.columns(from, ROWS.min(residuals.len() - from));
        let known = covariance * slopes;
        for (k, r) in residuals.iter().skip(from).take(slopes.ncols()).enumerate() {
            sum += r * r / (1.0 + slopes.column(k).dot(&known.column(k)).max(0.0));
        }
    }
    let mean = sum / residuals.len() as f64;
    if mean.is_finite() { mean.max(1.0) } else { 1.0 }
}

/// One pass over the rows at the estimate: J x̂ − r is what a linear fit has to meet.
fn readings(fitted: &Fitted, dataset: &Dataset) -> Readings {
    let task = &fitted.task;
    let (p, per) = (task.parameters(), task.rows_per_observation());
    let x = &fitted.estimate.x;
    let turn = fitted.frames.base_from_sensor.rotation;
    let middle = middle(dataset);
    let all = p + 1;
    let mut out =
        Readings { matrix: DMatrix::zeros(all, all), right: DVector::zeros(all), square: 0.0, count: 0 };
    for from in (0..dataset.rows.len()).step_by(ROWS) {
        checkpoint();
        let to = (from + ROWS).min(dataset.rows.len());
        let n = (to - from) * per;
        let (mut residuals, mut jacobian) = (vec![0.0; n], vec![0.0; n * all]);
        task.jacobian(x, from * per..to * per, &mut residuals, &mut jacobian[..n * p]);
        for (i, row) in dataset.rows.iter().skip(from).take(to - from).enumerate() {
            let weight = task.per_mm(from + i);
            let seen = Vector3::from(placed(&row.reading)) - Vector3::from(middle);
            match dataset.sensor {
                Sensor::Cable => jacobian[n * p + i] = weight * seen.x,
                Sensor::Position | Sensor::Pose => {
                    let pushed = -weight * (turn * seen);
                    let first = n * p + i * per;
                    jacobian[first..first + 3].copy_from_slice(pushed.as_slice());
                }
            }
        }
        let jacobian = DMatrix::from_vec(n, all, jacobian);
        let met = jacobian.columns(0, p) * DVector::from_column_slice(x) - DVector::from_vec(residuals);
        out.matrix += squared(&jacobian);
        out.right += jacobian.tr_mul(&met);
        out.square += met.norm_squared();
        out.count += n;
    }
    out
}

/// Rows in one go.
const ROWS: usize = 512;

fn placed(reading: &Reading) -> [f64; 3] {
    match reading {
        Reading::Cable(length) => [*length, 0.0, 0.0],
        Reading::Position(v) => (*v).into(),
        Reading::Pose(pose) => pose.translation.vector.into(),
    }
}

/// Mean reading: a scale about it asks nothing of where the sensor stands.
fn middle(dataset: &Dataset) -> [f64; 3] {
    let n = dataset.rows.len().max(1) as f64;
    let mut sum = [0.0; 3];
    for row in &dataset.rows {
        let seen = placed(&row.reading);
        (0..3).for_each(|k| sum[k] += seen[k] / n);
    }
    sum
}

/// M for the parameters of the fit, at `condition` over the region of these poses (°): rows and columns of the measurement's own are
/// zero. δᵀ M δ is the mean square by which a change δ of the parameters moves the target, apart from motions of base and target (mm²).
pub(crate) fn shape_weights(
    fitted: &Fitted,
    condition: &Condition,
    samples_deg: &[[f64; 6]],
) -> Option<DMatrix<f64>> {
    let places: Vec<usize> =
        fitted.parameters.iter().enumerate().filter(|(_, p)| p.is_of_arm()).map(|(k, _)| k).collect();
    let mut list: Vec<Parameter> = places.iter().map(|&k| fitted.parameters[k]).collect();
    let own = list.len();
    if own == 0 {
        return None;
    }
    list.extend((0..6).map(Parameter::SensorFrame).chain((0..3).map(Parameter::Target)));
    let posed = fitted.model.at_condition(condition);
    let target =
        Pose::from_parts(fitted.frames.flange_from_target.translation, nalgebra::UnitQuaternion::identity());
    let ends = Ends { world_from_base: [0.0; 6], flange_from_tool: vector_from_pose(&target) };
    let poses = inside(samples_deg);
    let mut stack = DMatrix::zeros(3 * poses.len(), list.len());
    for (k, q) in poses.iter().enumerate() {
        let twists = parameter_jacobian(&ends, &posed, q, &list);
        stack.rows_mut(3 * k, 3).copy_from(&twists.rows(0, 3));
    }
    let (arm, rigid) = (stack.columns(0, own).into_owned(), stack.columns(own, 9).into_owned());
    // Turns move by hundreds of millimetres per radian: columns of equal length, then an orthonormal basis.
    let decomposed =
        DMatrix::from_columns(&rigid.column_iter().map(|c| c / c.norm().max(1e-12)).collect::<Vec<_>>())
            .svd(true, false);
    let basis = decomposed.u?;
    let kept: Vec<DVector<f64>> = basis
        .column_iter()
        .zip(decomposed.singular_values.iter())
        .filter(|(_, value)| **value > 1e-6)
        .map(|(column, _)| column.into_owned())
        .collect();
    let apart = if kept.is_empty() {
        arm
    } else {
        let basis = DMatrix::from_columns(&kept);
        &arm - &basis * basis.tr_mul(&arm)
    };
    let mut out = DMatrix::zeros(fitted.parameters.len(), fitted.parameters.len());
    let square = squared(&apart) / poses.len().max(1) as f64;
    for (i, &a) in places.iter().enumerate() {
        for (j, &b) in places.iter().enumerate() {
            out[(a, b)] = square[(i, j)];
        }
    }
    out.iter().all(|v| v.is_finite()).then_some(out)
}

/// Poses of the measured region: its samples, and halfway from each to another, so that a fit of few rows is not judged
/// where it was pinned.
fn inside(samples_deg: &[[f64; 6]]) -> Vec<Joints> {
    let n = samples_deg.len();
    let radians = |q: [f64; 6]| Joints::from_fn(|i, _| q[i].to_radians());
    let mut out: Vec<Joints> = samples_deg.iter().map(|q| radians(*q)).collect();
    for (k, a) in samples_deg.iter().enumerate() {
        let b = &samples_deg[(k + n / 3 + 1) % n];
        out.push(radians(std::array::from_fn(|i| 0.5 * (a[i] + b[i]))));
    }
    out
}
