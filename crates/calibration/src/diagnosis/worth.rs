//! What causes are worth: how many millimetres they push the readings by.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::catalogue::Candidate;
use super::cause::Cause;
use super::design::FullDesign;
use super::extension::{Extended, Subject};

/// How many millimetres causes push the readings by.
pub(super) struct Worth<'a> {
    fit: &'a Extended,
    whole: &'a FullDesign,
    /// Whitened columns of each cause times its sizes.
    pushes: Vec<DVector<f64>>,
    /// What each explains alone, as [`Worth::own_of`] has it (mm).
    own: Vec<f64>,
}

impl<'a> Worth<'a> {
    /// Of the causes of `fit`; candidates are made of the slopes of `whole`.
    pub(super) fn new(subject: &Subject<'_>, fit: &'a Extended, whole: &'a FullDesign) -> Self {
        let push = |cause: &Cause| {
            Candidate::of(cause, subject).columns(&whole.design) * DVector::from_vec(cause.values())
        };
        let pushes = fit.causes.par_iter().map(push).collect();
        let mut out = Self { fit, whole, pushes, own: Vec::new() };
        out.own = (0..fit.causes.len()).into_par_iter().map(|k| out.beside_the_others(&[k])).collect();
        out
    }

    /// Of some of the causes together (mm RMS over the observations).
    pub(super) fn of(&self, causes: &[usize]) -> f64 {
        self.in_mm(&self.sum(causes))
    }

    /// What some of the causes explain together that nothing else in the model would (mm RMS over the observations): what links,
    /// frames and the other causes would take over is left out.
    pub(super) fn own_of(&self, causes: &[usize]) -> f64 {
        match causes {
            [] => 0.0,
            [one] => self.own[*one],
            many => self.beside_the_others(many),
        }
    }

    /// The causes of one story are no rivals of each other: all of them are taken out before their push is held against the rest.
    fn beside_the_others(&self, causes: &[usize]) -> f64 {
        let places: Vec<usize> = causes.iter().flat_map(|&k| self.fit.places(k)).collect();
        let without = self.whole.without(&places);
        let push = DMatrix::from_columns(&[self.sum(causes)]);
        let projected = without.project(&push);
        self.in_mm(&without.pure(&push, &projected).column(0).into_owned())
    }

    fn sum(&self, causes: &[usize]) -> DVector<f64> {
        let rows = self.whole.design.slopes.mm.len();
        causes.iter().fold(DVector::zeros(rows), |sum, &k| sum + &self.pushes[k])
    }

    fn in_mm(&self, push: &DVector<f64>) -> f64 {
        let mm = &self.whole.design.slopes.mm;
        let square: f64 = push.iter().zip(mm).map(|(v, mm)| (v * mm).powi(2)).sum();
        (square / self.whole.design.observations.max(1) as f64).sqrt()
    }
}
