//! What no cause of the catalogue describes, as random functions beside the causes.
//!
//! Two families of functions, each a group with a variance of its own: *courses in time* of everything that a measurement
//! hangs on (the sensor's frame, the touched point, the zero, the scale, common growth of the links, unlogged load), Brownian
//! by their spectrum, and *fields over poses*, smooth functions of the joint angles. The variances are those under
//! which the rows are most probable ([`marginal`]); what is left may be correlated from row to row. A cause that
//! is to be named must win beside all of that, and what it carries is reported as "something else".
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
use super::serial_correlation::{correlation_range, lag_one_correlation, prewhiten};
use crate::identification::calibration::flange_torques;
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::model::Model;

/// What a group of functions moves, and by what it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Group {
    /// The sensor's frame or the outlet, in the course of the rows.
    FrameInTime,
    /// The touched point, in the course of the rows.
    TargetInTime,
    /// A cable's zero, in the course of the rows.
    ZeroInTime,
    /// The sensor's scale, in the course of the rows.
    ScaleInTime,
    /// A common growth of all lengths of the arm, in the course of the rows.
    GrowthInTime,
    /// A load at the flange, in the course of the rows.
    LoadInTime,
    /// The reading, over the joint angles, changing within half a turn.
    CoarseField,
    /// The reading, over the joint angles, changing within some ten degrees.
    FineField,
}

impl Group {
    /// Whether it follows the rows, not the poses.
    pub fn in_time(self) -> bool {
        !matches!(self, Group::CoarseField | Group::FineField)
    }

    /// What it is like, in words that follow "as if".
    pub fn words(self) -> &'static str {
        match self {
            Group::FrameInTime => "the sensor or its outlet wandered while the rows were taken",
            Group::TargetInTime => "the measured point wandered on the flange while the rows were taken",
            Group::ZeroInTime => "the cable's zero wandered while the rows were taken",
            Group::ScaleInTime => "the sensor's scale wandered while the rows were taken",
            Group::GrowthInTime => "the whole arm grew and shrank while the rows were taken",
            Group::LoadInTime => "the load at the flange changed while the rows were taken",
            Group::CoarseField => "the error depends smoothly on the pose",
            Group::FineField => "the error depends on the pose and changes within some ten degrees",
        }
    }
}

/// Cosines of a course in time.
const COSINES: usize = 12;

/// Features of a field for each coordinate that it moves.
const FEATURES: usize = 32;

/// Angle (rad) within which a field changes: coarse, fine.
const REACH_RAD: [f64; 2] = [1.2, 0.45];

/// Joints over which a field is laid: the last one turns the target about itself.
const JOINTS: usize = 5;

/// Variance of a group's push on a whitened reading below which it carries nothing.
const NOTHING: f64 = 1e-4;

/// Groups of functions, with the columns of their coefficients for every scalar row.
#[derive(Debug, Clone)]
pub struct Functions {
    /// Columns, n × m, each group scaled so that coefficients of variance 1 push a whitened reading by 1 on average.
    pub columns: DMatrix<f64>,
    /// Which columns belong to which group.
    pub groups: Vec<(Group, std::ops::Range<usize>)>,
}

impl Functions {
    /// All functions that the rows of a data set can carry.
    pub fn of(subject: &Subject<'_>, linear: &Linear) -> Self {
        let dataset = &subject.observed.dataset;
        let slopes = &linear.slopes;
        let (n, per) = (linear.observations, linear.per);
        let mut out = Self { columns: DMatrix::zeros(n * per, 0), groups: Vec::new() };
        let courses = cosines(n);
        let frame: Vec<DVector<f64>> = columns_of(&slopes.by_frame);
        let single = |slope: &DVector<f64>| vec![slope.clone()];
        out.push(Group::FrameInTime, &frame, &courses, per);
        out.push(Group::TargetInTime, &columns_of(&slopes.by_target), &courses, per);
        if dataset.sensor == Sensor::Cable {
            out.push(Group::ZeroInTime, &single(&slopes.by_zero), &courses, per);
        }
        out.push(Group::ScaleInTime, &single(&slopes.by_scale), &courses, per);
        out.push(Group::GrowthInTime, &single(&slopes.by_growth), &courses, per);
        out.push(Group::LoadInTime, &loads(dataset, subject.nominal, slopes, per), &courses, per);
        let reading =
            if dataset.sensor == Sensor::Cable { single(&slopes.by_zero) } else { frame[..3].to_vec() };
        for (group, reach) in [Group::CoarseField, Group::FineField].into_iter().zip(REACH_RAD) {
            out.push(group, &reading, &features(dataset, reach), per);
        }
        out
    }

    /// Adds slopes × courses.
    fn push(&mut self, group: Group, slopes: &[DVector<f64>], courses: &DMatrix<f64>, per: usize) {
        let (rows, first) = (self.columns.nrows(), self.columns.ncols());
        let count = slopes.len() * courses.ncols();
        let mut added = DMatrix::zeros(rows, count);
        let mut places = added.column_iter_mut();
        for slope in slopes {
            // A shift along one axis and a turn about another are made comparable by what they do to a reading.
            let usual = (slope.norm_squared() / rows as f64).sqrt();
            for course in courses.column_iter() {
                let Some(mut place) = places.next() else { continue };
                if usual > 0.0 {
                    place.iter_mut().enumerate().for_each(|(s, v)| *v = slope[s] * course[s / per] / usual);
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

/// cos(π k u) / k over the rows, u from 0 to 1: the series of a Brownian course.
fn cosines(n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, COSINES, |i, k| {
        let u = (i as f64 + 0.5) / n as f64;
        (std::f64::consts::PI * (k + 1) as f64 * u).cos() / (k + 1) as f64
    })
}

/// Random features of a smooth function of the joint angles.
fn features(dataset: &Dataset, reach_rad: f64) -> DMatrix<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(reach_rad.to_bits());
    let n = dataset.rows.len();
    let mut out = DMatrix::zeros(n, FEATURES);
    for mut column in out.column_iter_mut() {
        let frequency: Vec<f64> = (0..JOINTS)
            .map(|_| {
                let normal: f64 = StandardNormal.sample(&mut rng);
                normal / reach_rad
            })
            .collect();
        let phase = rng.random_range(0.0..std::f64::consts::TAU);
        for (place, row) in column.iter_mut().zip(dataset.rows.iter()) {
            let angle: f64 = frequency.iter().zip(row.joints.iter()).map(|(f, q)| f * q).sum();
            *place = (angle + phase).cos();
        }
    }
    out
}

/// Slopes by a mass at the flange under which joints 2 and 3 yield.
fn loads(dataset: &Dataset, nominal: &Model, slopes: &Slopes, per: usize) -> Vec<DVector<f64>> {
    let torques = flange_torques(dataset, nominal);
    [1, 2]
        .map(|joint| {
            let slope = &slopes.by_joint[joint];
            DVector::from_fn(slope.len(), |s, _| slope[s] * torques[s / per][joint])
        })
        .to_vec()
}

/// The functions with their variances, found beside a fit.
#[derive(Debug, Clone)]
pub struct Discrepancy {
    /// Standard deviation of the coefficients of each group of the functions.
    sizes: Vec<f64>,
    /// The functions that carry anything, each column in units of its standard deviation.
    pub columns: DMatrix<f64>,
    /// Of each column, whether it follows the rows, not the poses.
    in_time: Vec<bool>,
    /// What each group that carries anything is worth in the readings (mm RMS), largest first.
    pub carried: Vec<(Group, f64)>,
    /// How far all of it moves the reading of each observation (mm).
    pub push_mm: Vec<f64>,
    /// Twice the log Bayes factor for there being anything of it.
    pub evidence: f64,
    /// Standard deviation of what is left, in units of what the fit took for the noise.
    pub noise: f64,
    /// Correlation of what is left from one row to the next; 0 where it is none.
    pub correlation: f64,
    /// Over how many rows what is left resembles itself; 0 where it does not.
    pub reach: usize,
}

impl Discrepancy {
    /// Variances beside everything that is free in `linear` but the parameters at `dropped`.
    /// `before` is what was found with more free, to start from.
    pub fn of(
        functions: &Functions,
        linear: &Linear,
        dropped: &[usize],
        numbers: &[usize],
        before: Option<&Self>,
    ) -> Self {
        let rho = before.map_or(0.0, |b| b.correlation);
        let mut out = Self::with(functions, linear, dropped, numbers, rho, before);
        if let Some(before) = before.filter(|b| b.correlation != 0.0) {
            out.reach = before.reach;
        }
        if rho == 0.0 && out.correlation != 0.0 {
            let (rho, reach) = (out.correlation, out.reach);
            out = Self { reach, ..Self::with(functions, linear, dropped, numbers, rho, Some(&out)) };
        }
        if out.speaks() { out } else { out.silent() }
    }

    /// Nothing but the noise, and its correlation.
    fn silent(self) -> Self {
        let columns = DMatrix::zeros(self.columns.nrows(), 0);
        let push_mm = vec![0.0; self.push_mm.len()];
        Self { columns, in_time: Vec::new(), carried: Vec::new(), push_mm, evidence: 0.0, noise: 1.0, ..self }
    }

    /// The same where neighbouring rows are correlated by `rho`.
    fn with(
        functions: &Functions,
        linear: &Linear,
        dropped: &[usize],
        numbers: &[usize],
        rho: f64,
        before: Option<&Self>,
    ) -> Self {
        let filtered = linear.filtered(rho, numbers, 1.0);
        let columns = prewhiten(&functions.columns, rho, numbers, linear.per);
        let design = filtered.design(dropped);
        let projected = design.project(&columns);
        let freedom = design.rows() as f64 * linear.witnesses - filtered.spent(dropped);
        let square = design.residual.norm_squared();
        let Variances { sizes, noise, evidence, coefficients } = marginal::variances(
            &projected.information,
            &projected.gradient,
            &functions.groups.iter().map(|(_, range)| range.clone()).collect::<Vec<_>>(),
            (square, freedom),
            before.map(|b| b.sizes.as_slice()),
        );
        let pure = design.pure(&columns, &projected);
        let left = &design.residual + &pure * &coefficients;
        let mut carried = Vec::new();
        let (mut kept, mut in_time) = (Vec::new(), Vec::new());
        let mut push_mm = vec![0.0; linear.slopes.mm.len()];
        for ((group, range), size) in functions.groups.iter().zip(&sizes) {
            if size * size <= NOTHING * noise * noise {
                continue;
            }
            // What links and frames would take over is not its own.
            let own = if rho == 0.0 { &pure } else { &functions.columns };
            let part = own.columns(range.start, range.len()) * coefficients.rows(range.start, range.len());
            let lengths: Vec<f64> = linear.slopes.mm.iter().zip(part.iter()).map(|(mm, v)| mm * v).collect();
            let square: f64 = lengths.iter().map(|l| l * l).sum();
            carried.push((*group, (square / linear.observations.max(1) as f64).sqrt()));
            push_mm.iter_mut().zip(&lengths).for_each(|(sum, l)| *sum += l);
            kept.extend(range.clone().map(|k| (k, *size)));
            in_time.extend(range.clone().map(|_| group.in_time()));
        }
        carried.sort_by(|a, b| b.1.total_cmp(&a.1));
        let scaled: Vec<DVector<f64>> =
            kept.iter().map(|&(k, size)| functions.columns.column(k) * size).collect();
        let columns =
            if scaled.is_empty() { DMatrix::zeros(design.rows(), 0) } else { DMatrix::from_columns(&scaled) };
        let correlation = if rho == 0.0 {
            lag_one_correlation(&left, linear.per, numbers, &linear.slopes.poses)
        } else {
            rho
        };
        let reach = if rho == 0.0 && correlation != 0.0 {
            correlation_range(&left, linear.per, &linear.slopes.poses)
        } else {
            0
        };
        let push_mm =
            push_mm.chunks(linear.per).map(|row| row.iter().map(|l| l * l).sum::<f64>().sqrt()).collect();
        Self { sizes, columns, in_time, carried, push_mm, evidence, noise, correlation, reach }
    }

    /// What depends on the pose alone is worth so much (mm RMS).
    pub fn field_mm(&self) -> f64 {
        let fields = self.carried.iter().filter(|(group, _)| !group.in_time());
        fields.map(|(_, mm)| mm * mm).sum::<f64>().sqrt()
    }

    /// Growth of the arm in the course of the rows is worth so much (mm RMS).
    pub fn growth_mm(&self) -> f64 {
        let growth = self.carried.iter().find(|(group, _)| *group == Group::GrowthInTime);
        growth.map_or(0.0, |(_, mm)| *mm)
    }

    /// The columns that follow the rows.
    pub fn in_time_columns(&self) -> DMatrix<f64> {
        let places: Vec<usize> = (0..self.in_time.len()).filter(|&k| self.in_time[k]).collect();
        self.columns.select_columns(&places)
    }

    /// Whether something follows the rows, not the poses.
    pub fn in_time(&self) -> bool {
        self.correlation != 0.0 || self.carried.iter().any(|(group, _)| group.in_time())
    }

    /// What all of it together is worth in the readings (mm RMS).
    pub fn worth_mm(&self) -> f64 {
        let square: f64 = self.push_mm.iter().map(|l| l * l).sum();
        (square / self.push_mm.len().max(1) as f64).sqrt()
    }

    /// Whether there is anything of it that a reader should hear of.
    pub fn speaks(&self) -> bool {
        (self.evidence > SPEAKS && !self.carried.is_empty()) || self.correlation != 0.0
    }
}

/// Twice a log Bayes factor from which something else is there: a thousand to one.
const SPEAKS: f64 = 14.0;
