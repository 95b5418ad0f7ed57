//! Model discrepancy: random functions of time and pose for errors that no cause in the catalogue describes.
//!
//! Two families of functions, in groups with a variance component each: *functions of time* for every quantity that a
//! measurement depends on (the sensor's frame, the target, the zero, the scale, common growth of the links, unlogged load), with
//! a Brownian spectrum, and *fields over poses*, smooth functions of the joint angles. The variances maximise the marginal
//! likelihood ([`marginal`]); the remaining noise can be serially correlated. An identified cause must remain significant with
//! these functions in the model; their own contribution is reported as unexplained.
//!
//! Source: Kennedy and O'Hagan 2001, Brynjarsdóttir and O'Hagan 2014 on the discrepancy of a model; the features of a field
//! are those of Rahimi and Recht 2007, with frequencies of a fixed seed.

use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::design::{Linear, Slopes};
use super::extension::Subject;
use super::marginal::{self, Variances};
use super::products::Whitening;
use super::serial_correlation::{
    NEGLIGIBLE as NEGLIGIBLE_CORRELATION, correlation_range, lag_one_correlation,
};
use crate::identification::calibration::flange_torques;
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::model::Model;

/// The quantity that a group of functions changes, and the variable that it depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Group {
    /// The sensor's frame or the outlet, over time.
    FrameInTime,
    /// The target, over time.
    TargetInTime,
    /// A cable's zero, over time.
    ZeroInTime,
    /// The sensor's scale, over time.
    ScaleInTime,
    /// A common growth of all lengths of the arm, over time.
    GrowthInTime,
    /// A load at the flange, over time.
    LoadInTime,
    /// The reading, over the joint angles, with a correlation length of half a turn.
    CoarseField,
    /// The reading, over the joint angles, with a correlation length of some ten degrees.
    FineField,
}

impl Group {
    /// Whether it is a function of time, not of the pose.
    pub fn in_time(self) -> bool {
        !matches!(self, Group::CoarseField | Group::FineField)
    }

    /// Correlation length of a field (rad); `None` for a function of time.
    pub fn length_rad(self) -> Option<f64> {
        match self {
            Group::CoarseField => Some(LENGTH_RAD[0]),
            Group::FineField => Some(LENGTH_RAD[1]),
            _ => None,
        }
    }

    /// Description that follows "as if".
    pub fn words(self) -> &'static str {
        match self {
            Group::FrameInTime => "the sensor or its outlet drifted during the measurement",
            Group::TargetInTime => "the target drifted on the flange during the measurement",
            Group::ZeroInTime => "the cable's zero drifted during the measurement",
            Group::ScaleInTime => "the sensor's scale drifted during the measurement",
            Group::GrowthInTime => "the whole arm expanded or contracted during the measurement",
            Group::LoadInTime => "the load at the flange changed during the measurement",
            Group::CoarseField => "the error depends smoothly on the pose",
            Group::FineField => "the error depends on the pose and changes within about ten degrees",
        }
    }
}

/// Number of cosines of a function of time.
const COSINES: usize = 12;

/// Features of a field for each coordinate that it moves.
const FEATURES: usize = 32;

/// Correlation length of a field (rad): coarse, fine.
const LENGTH_RAD: [f64; 2] = [1.2, 0.45];

/// Number of joints that a field depends on: the last one rotates the target about itself.
const JOINTS: usize = 5;

/// Variance of a group's effect on a whitened reading below which it is negligible.
const NEGLIGIBLE: f64 = 1e-4;

/// Groups of functions, with the columns of their coefficients for every scalar row.
#[derive(Debug, Clone)]
pub struct Functions {
    /// Columns, n × m, each group scaled so that coefficients of variance 1 change a whitened reading by 1 RMS.
    pub columns: DMatrix<f64>,
    /// The columns of each group.
    pub groups: Vec<(Group, std::ops::Range<usize>)>,
}

impl Functions {
    /// All functions for a data set.
    pub fn of(subject: &Subject<'_>, linear: &Linear) -> Self {
        let dataset = &subject.observed.dataset;
        let slopes = &linear.slopes;
        let (n, per) = (linear.observations, linear.per);
        let mut out = Self { columns: DMatrix::zeros(n * per, 0), groups: Vec::new() };
        let time = cosines(n);
        let frame: Vec<DVector<f64>> = columns_of(&slopes.by_frame);
        let single = |slope: &DVector<f64>| vec![slope.clone()];
        out.push(Group::FrameInTime, &frame, &time, per);
        out.push(Group::TargetInTime, &columns_of(&slopes.by_target), &time, per);
        if dataset.sensor == Sensor::Cable {
            out.push(Group::ZeroInTime, &single(&slopes.by_zero), &time, per);
        }
        out.push(Group::ScaleInTime, &single(&slopes.by_scale), &time, per);
        out.push(Group::GrowthInTime, &single(&slopes.by_growth), &time, per);
        out.push(Group::LoadInTime, &loads(dataset, subject.nominal, slopes, per), &time, per);
        let reading =
            if dataset.sensor == Sensor::Cable { single(&slopes.by_zero) } else { frame[..3].to_vec() };
        for (group, length) in [Group::CoarseField, Group::FineField].into_iter().zip(LENGTH_RAD) {
            out.push(group, &reading, &features(dataset, length), per);
        }
        out
    }

    /// Adds the products of `slopes` and `basis`.
    fn push(&mut self, group: Group, slopes: &[DVector<f64>], basis: &DMatrix<f64>, per: usize) {
        let (rows, first) = (self.columns.nrows(), self.columns.ncols());
        let count = slopes.len() * basis.ncols();
        let mut added = DMatrix::zeros(rows, count);
        let mut columns = added.column_iter_mut();
        for slope in slopes {
            // Scaled by their effect on a reading, so that shifts and rotations are comparable.
            let rms = (slope.norm_squared() / rows as f64).sqrt();
            for function in basis.column_iter() {
                let Some(mut column) = columns.next() else { continue };
                if rms > 0.0 {
                    column.iter_mut().enumerate().for_each(|(s, v)| *v = slope[s] * function[s / per] / rms);
                }
            }
        }
        let size = (added.norm_squared() / rows as f64).sqrt();
        if !(size > 0.0) {
            return;
        }
        added /= size;
        let columns = std::mem::replace(&mut self.columns, DMatrix::zeros(0, 0));
        self.columns = columns.insert_columns(first, count, 0.0);
        self.columns.columns_mut(first, count).copy_from(&added);
        self.groups.push((group, first..first + count));
    }
}

fn columns_of(matrix: &DMatrix<f64>) -> Vec<DVector<f64>> {
    matrix.column_iter().map(|c| c.into_owned()).collect()
}

/// cos(π k u) / k over the rows, u from 0 to 1: the Karhunen–Loève series of Brownian motion.
pub(super) fn cosines(n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, COSINES, |i, k| {
        let u = (i as f64 + 0.5) / n as f64;
        (std::f64::consts::PI * (k + 1) as f64 * u).cos() / (k + 1) as f64
    })
}

/// Random Fourier features of a smooth function of the joint angles.
fn features(dataset: &Dataset, length_rad: f64) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(length_rad.to_bits());
    let n = dataset.rows.len();
    let mut out = DMatrix::zeros(n, FEATURES);
    for mut column in out.column_iter_mut() {
        let frequency: Vec<f64> = (0..JOINTS)
            .map(|_| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                normal / length_rad
            })
            .collect();
        let phase = rng.random_range(0.0..std::f64::consts::TAU);
        for (entry, row) in column.iter_mut().zip(dataset.rows.iter()) {
            let angle: f64 = frequency.iter().zip(row.joints.iter()).map(|(f, q)| f * q).sum();
            *entry = (angle + phase).cos();
        }
    }
    out
}

/// Slopes by a mass at the flange that deflects joints 2 and 3.
fn loads(dataset: &Dataset, nominal: &Model, slopes: &Slopes, per: usize) -> Vec<DVector<f64>> {
    let torques = flange_torques(dataset, nominal);
    [1, 2]
        .map(|joint| {
            let slope = &slopes.by_joint[joint];
            DVector::from_fn(slope.len(), |s, _| slope[s] * torques[s / per][joint])
        })
        .to_vec()
}

/// The functions with their estimated variances, given a fit.
#[derive(Debug, Clone)]
pub struct Discrepancy {
    /// Standard deviation of the coefficients of each group of the functions.
    sizes: Vec<f64>,
    /// The nonnegligible functions, each with its standard deviation.
    pub(super) terms: Vec<(usize, f64)>,
    /// Their columns in units of it.
    pub columns: DMatrix<f64>,
    /// The group of each column.
    groups: Vec<Group>,
    /// Contribution of each nonnegligible group to the readings (mm RMS), largest first.
    pub contributions: Vec<(Group, f64)>,
    /// Prior standard deviation of each nonnegligible group's effect on a reading (mm), by marginal likelihood.
    pub prior_mm: Vec<(Group, f64)>,
    /// Size of the total effect on each observation (mm).
    pub effect_mm: Vec<f64>,
    /// Twice the log Bayes factor for a discrepancy.
    pub evidence: f64,
    /// Standard deviation of the remaining noise, in units of the fit's noise.
    pub noise: f64,
    /// Lag-one correlation of the remaining noise; 0 if insignificant.
    pub correlation: f64,
    /// Range of the serial correlation in rows; 0 without one.
    pub correlation_range: usize,
}

impl Discrepancy {
    /// Estimates the variances with everything in the fit free except the parameters at `dropped`. `before` is the result of a larger
    /// model as a start.
    pub(super) fn of(
        functions: &Functions,
        whitening: &mut Whitening<'_>,
        dropped: &[usize],
        before: Option<&Self>,
    ) -> Self {
        let rho = before.map_or(0.0, |b| b.correlation);
        let mut out = Self::estimate(functions, whitening, dropped, rho, before);
        if let Some(before) = before.filter(|b| b.correlation != 0.0) {
            out.correlation_range = before.correlation_range;
        }
        if rho == 0.0 && out.correlation != 0.0 {
            let (rho, correlation_range) = (out.correlation, out.correlation_range);
            let whitened = Self::estimate(functions, whitening, dropped, rho, Some(&out));
            out = Self { correlation_range, ..whitened };
        }
        if out.is_significant() { out } else { out.without_functions() }
    }

    /// The noise and its correlation alone.
    fn without_functions(self) -> Self {
        let columns = DMatrix::zeros(self.columns.nrows(), 0);
        let effect_mm = vec![0.0; self.effect_mm.len()];
        Self {
            terms: Vec::new(),
            columns,
            groups: Vec::new(),
            contributions: Vec::new(),
            prior_mm: Vec::new(),
            effect_mm,
            evidence: 0.0,
            noise: 1.0,
            ..self
        }
    }

    /// The estimate for a lag-one correlation of `rho`.
    fn estimate(
        functions: &Functions,
        whitening: &mut Whitening<'_>,
        dropped: &[usize],
        rho: f64,
        before: Option<&Self>,
    ) -> Self {
        let (linear, numbers) = (whitening.linear, whitening.numbers);
        let products = whitening.at(rho);
        let beside = products.without(dropped);
        let rows = beside.residual.len();
        let freedom = rows as f64 * linear.effective_share - products.linear.spent(dropped);
        let square = beside.residual.norm_squared();
        let Variances { sizes, noise, evidence, coefficients } = marginal::variances(
            &beside.information,
            &beside.gradient,
            &functions.groups.iter().map(|(_, range)| range.clone()).collect::<Vec<_>>(),
            (square, freedom),
            before.map(|b| b.sizes.as_slice()),
        );
        let mut contributions = Vec::new();
        let mut prior_mm = Vec::new();
        let mm = typical_mm(linear);
        let mut terms = Vec::new();
        let mut groups = Vec::new();
        let mut effect_mm = vec![0.0; linear.slopes.mm.len()];
        for ((group, range), size) in functions.groups.iter().zip(&sizes) {
            if size * size <= NEGLIGIBLE * noise * noise {
                continue;
            }
            // Excludes the part that links and frames can absorb.
            let part = beside.readings((linear, &functions.columns), range.clone(), &coefficients);
            let lengths: Vec<f64> = linear.slopes.mm.iter().zip(part.iter()).map(|(mm, v)| mm * v).collect();
            let square: f64 = lengths.iter().map(|l| l * l).sum();
            contributions.push((*group, (square / linear.observations.max(1) as f64).sqrt()));
            prior_mm.push((*group, size * mm));
            effect_mm.iter_mut().zip(&lengths).for_each(|(sum, l)| *sum += l);
            terms.extend(range.clone().map(|k| (k, *size)));
            groups.extend(range.clone().map(|_| *group));
        }
        contributions.sort_by(|a, b| b.1.total_cmp(&a.1));
        let scaled: Vec<DVector<f64>> =
            terms.iter().map(|&(k, size)| functions.columns.column(k) * size).collect();
        let columns =
            if scaled.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&scaled) };
        let (mut correlation, mut range) = (rho, 0);
        if rho == 0.0 {
            let left = &beside.residual
                + beside.readings((linear, &functions.columns), 0..coefficients.len(), &coefficients);
            let poses = &linear.slopes.poses;
            correlation = lag_one_correlation(&left, linear.per, numbers, poses);
            if correlation != 0.0 {
                range = correlation_range(&left, linear.per, poses);
            }
        }
        let effect_mm =
            effect_mm.chunks(linear.per).map(|row| row.iter().map(|l| l * l).sum::<f64>().sqrt()).collect();
        Self {
            sizes,
            terms,
            columns,
            groups,
            contributions,
            prior_mm,
            effect_mm,
            evidence,
            noise,
            correlation,
            correlation_range: range,
        }
    }

    /// Contribution of the fields over poses (mm RMS).
    pub fn field_mm(&self) -> f64 {
        let fields = self.contributions.iter().filter(|(group, _)| !group.in_time());
        fields.map(|(_, mm)| mm * mm).sum::<f64>().sqrt()
    }

    /// Contribution of the functions of time (mm RMS).
    pub fn time_mm(&self) -> f64 {
        let courses = self.contributions.iter().filter(|(group, _)| group.in_time());
        courses.map(|(_, mm)| mm * mm).sum::<f64>().sqrt()
    }

    /// Contribution of growth of the arm over time (mm RMS).
    pub fn growth_mm(&self) -> f64 {
        let growth = self.contributions.iter().find(|(group, _)| *group == Group::GrowthInTime);
        growth.map_or(0.0, |(_, mm)| *mm)
    }

    /// The columns that are functions of time, without growth of the arm if `growth_is_known`.
    pub fn in_time_columns(&self, growth_is_known: bool) -> DMatrix<f64> {
        let wanted = |group: Group| group.in_time() && !(growth_is_known && group == Group::GrowthInTime);
        let indices: Vec<usize> = (0..self.groups.len()).filter(|&k| wanted(self.groups[k])).collect();
        self.columns.select_columns(&indices)
    }

    /// Whether it depends on time, by a function or by serial correlation.
    pub fn in_time(&self) -> bool {
        self.correlation != 0.0 || self.contributions.iter().any(|(group, _)| group.in_time())
    }

    /// Total contribution to the readings (mm RMS).
    pub fn rms_mm(&self) -> f64 {
        let square: f64 = self.effect_mm.iter().map(|l| l * l).sum();
        (square / self.effect_mm.len().max(1) as f64).sqrt()
    }

    /// Of serially correlated noise, φ and a: the correlation is a φ^d at a distance of d rows. At the range it has fallen to
    /// `NEGLIGIBLE_CORRELATION`.
    pub fn noise_process(&self) -> (f64, f64) {
        let (near, range) = (self.correlation, self.correlation_range as f64);
        if range < 2.0 || near <= NEGLIGIBLE_CORRELATION {
            return (near, 1.0);
        }
        let decay = (NEGLIGIBLE_CORRELATION / near).powf((range - 1.0).recip());
        // Faster than by the correlation of neighbours it cannot fall.
        let decay = decay.max(near);
        (decay, near / decay)
    }

    /// Whether there is significant discrepancy.
    pub fn is_significant(&self) -> bool {
        (self.evidence > SIGNIFICANT && !self.contributions.is_empty()) || self.correlation != 0.0
    }
}

/// Length of a whitened residual of 1 (mm), root mean square over the readings that are lengths.
pub(super) fn typical_mm(linear: &Linear) -> f64 {
    let lengths = || linear.slopes.mm.iter().filter(|mm| **mm > 0.0);
    (lengths().map(|mm| mm * mm).sum::<f64>() / lengths().count().max(1) as f64).sqrt()
}

/// Twice the log Bayes factor from which a discrepancy is significant: a thousand to one.
const SIGNIFICANT: f64 = 14.0;
