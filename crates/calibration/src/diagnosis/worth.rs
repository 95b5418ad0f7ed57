//! What causes are worth: how many millimetres they push the readings by.

use nalgebra::DVector;
use rayon::prelude::*;

use super::catalogue::Candidate;
use super::design::FullDesign;
use super::extension::{Extended, Subject};

/// How many millimetres causes push the readings by.
pub(super) struct Worth {
    /// What each cause does to each scalar row (mm), 0 for orientations.
    pushes: Vec<Vec<f64>>,
    /// The same beside all else that is free: what links, frames and other causes would take over is left out.
    own: Vec<Vec<f64>>,
    observations: usize,
}

impl Worth {
    /// Of the causes of `fit`; candidates are made of the slopes of `whole`.
    pub(super) fn new(subject: &Subject<'_>, fit: &Extended, whole: &FullDesign) -> Self {
        let in_mm = |push: DVector<f64>| -> Vec<f64> {
            push.iter().zip(&whole.design.slopes.mm).map(|(v, mm)| v * mm).collect()
        };
        let both = fit.causes.par_iter().enumerate().map(|(k, cause)| {
            let values = DVector::from_vec(cause.values());
            let columns = Candidate::of(cause, subject).columns(&whole.design);
            let without = whole.without(&fit.places(k));
            let projected = without.project(&columns);
            (in_mm(&columns * &values), in_mm(without.pure(&columns, &projected) * values))
        });
        let (pushes, own) = both.unzip();
        Self { pushes, own, observations: whole.design.observations }
    }

    /// Of some of the causes together (mm RMS over the observations).
    pub(super) fn of(&self, causes: &[usize]) -> f64 {
        self.together(&self.pushes, causes)
    }

    /// What some of the causes explain together that nothing else in the model would (mm RMS over the observations).
    pub(super) fn own_of(&self, causes: &[usize]) -> f64 {
        self.together(&self.own, causes)
    }

    fn together(&self, pushes: &[Vec<f64>], causes: &[usize]) -> f64 {
        let rows = pushes.first().map_or(0, Vec::len);
        let square: f64 = (0..rows).map(|s| causes.iter().map(|&k| pushes[k][s]).sum::<f64>().powi(2)).sum();
        (square / self.observations.max(1) as f64).sqrt()
    }
}
