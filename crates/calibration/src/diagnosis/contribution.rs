//! Contributions of causes to the readings (mm RMS): total, and unique beyond everything else in the model.
//!
//! Rows that are gross outliers do not count. The fit hardly weighs them, so that no effect is wrong by their readings; but what the other
//! parameters would absorb of an effect is taken from their derivatives there, and those follow the reading: where it is metres off, the
//! turn of a sensor frame by a hundredth of a degree is a millimetre.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::{FullDesign, Linear};
use super::extension::{Extended, Subject};
use super::residual_tests;

/// Contributions of the causes of a fit.
pub struct Contributions<'a> {
    fit: &'a Extended,
    whole: &'a FullDesign,
    /// Whitened columns of each cause times its estimate.
    effects: Vec<DVector<f64>>,
    /// The observations that count.
    counted: Vec<bool>,
    /// [`Contributions::unique_rms_mm`] of each cause alone (mm).
    unique: Vec<f64>,
}

impl<'a> Contributions<'a> {
    /// Contributions of the causes of `fit`, linearised as `whole`.
    pub fn new(subject: &Subject<'_>, fit: &'a Extended, whole: &'a FullDesign) -> Self {
        let effect = |cause: &Cause| {
            Candidate::of(cause, subject).columns(&whole.design) * DVector::from_vec(cause.values())
        };
        let effects = fit.causes.par_iter().map(effect).collect();
        let mut counted = vec![true; whole.design.observations];
        residual_tests::outliers(fit).iter().for_each(|(row, _)| counted[*row] = false);
        let mut out = Self { fit, whole, effects, counted, unique: Vec::new() };
        out.unique = (0..fit.causes.len()).into_par_iter().map(|k| out.unique_of(&[k])).collect();
        out
    }

    /// Total contribution of `causes` together (mm RMS over the observations).
    pub fn rms_mm(&self, causes: &[usize]) -> f64 {
        self.in_mm(&self.sum(causes))
    }

    /// How far `causes` together move the readings from where they are in the mean (mm RMS over the observations): what a constant shift
    /// of the sensor is, is no movement.
    pub fn movement_rms_mm(&self, causes: &[usize]) -> f64 {
        let moved = self.counted_mm(&self.sum(causes));
        let observations = moved.len().max(1) as f64;
        let square = |axis: usize| {
            let along = || moved.iter().map(|of_row| of_row[axis]);
            let mean = along().sum::<f64>() / observations;
            along().map(|v| (v - mean).powi(2)).sum::<f64>()
        };
        let per = moved.first().map_or(0, Vec::len);
        ((0..per).map(square).sum::<f64>() / observations).sqrt()
    }

    /// Unique contribution of `causes` together (mm RMS over the observations): the part that links, frames and the other causes
    /// cannot absorb.
    pub fn unique_rms_mm(&self, causes: &[usize]) -> f64 {
        match causes {
            [] => 0.0,
            [one] => self.unique[*one],
            many => self.unique_of(many),
        }
    }

    /// The same of the deviation of one parameter of the fit from its start.
    pub(super) fn unique_of_parameter(&self, linear: &Linear, k: usize) -> f64 {
        self.beyond_others(&[k], linear.rows.row(k).transpose() * linear.x[k])
    }

    /// The causes are removed together before their effect is projected off the rest: they do not compete with each other.
    fn unique_of(&self, causes: &[usize]) -> f64 {
        let indices: Vec<usize> = causes.iter().flat_map(|&k| self.fit.parameter_indices(k)).collect();
        self.beyond_others(&indices, self.sum(causes))
    }

    /// The part of the effect of the parameters at `indices` that all others cannot absorb (mm RMS).
    fn beyond_others(&self, indices: &[usize], effect: DVector<f64>) -> f64 {
        let without = self.whole.without(indices);
        let effect = DMatrix::from_columns(&[effect]);
        let projected = without.project(&effect);
        self.in_mm(&without.pure(&effect, &projected).column(0).into_owned())
    }

    fn sum(&self, causes: &[usize]) -> DVector<f64> {
        let rows = self.whole.design.slopes.mm.len();
        causes.iter().fold(DVector::zeros(rows), |sum, &k| sum + &self.effects[k])
    }

    /// A whitened effect in mm, for each observation that counts.
    fn counted_mm(&self, effect: &DVector<f64>) -> Vec<Vec<f64>> {
        let mm = &self.whole.design.slopes.mm;
        let per = self.whole.design.per;
        let counted = (0..self.counted.len()).filter(|row| self.counted[*row]);
        counted.map(|row| (row * per..(row + 1) * per).map(|k| effect[k] * mm[k]).collect()).collect()
    }

    fn in_mm(&self, effect: &DVector<f64>) -> f64 {
        let of_rows = self.counted_mm(effect);
        let square: f64 = of_rows.iter().flatten().map(|v| v * v).sum();
        (square / of_rows.len().max(1) as f64).sqrt()
    }
}
