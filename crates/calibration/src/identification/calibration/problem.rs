//! A calibration problem: starting values, free parameters, rows and weights.

use std::sync::Arc;

use nalgebra::Vector6;

use super::columns::{Columns, Weights};
use super::frames::{Frames, Weight};
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::problem::Prior;
use truegrind_math::se3::apply_twist;

/// A calibration as a nonlinear least-squares problem. See the module page.
#[derive(Debug, Clone)]
pub struct CalibrationProblem {
    pub(super) start: Model,
    pub(super) frames: Frames,
    pub(super) sensor: Sensor,
    pub(super) parameters: Vec<Parameter>,
    pub(super) priors: Vec<Prior>,
    pub(super) columns: Arc<Columns>,
    pub(super) weights: Weights,
    pub(super) rows: usize,
}

impl CalibrationProblem {
    /// `start` and `frames` are the starting values, `parameters` the free parameters, `priors` one for each of them (mean as a
    /// deviation from the start) or empty, `weights` one for each row of `dataset`.
    ///
    /// # Panics
    /// Where there are not as many weights as rows.
    pub fn new(
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        priors: &[Prior],
        weights: &[Weight],
    ) -> Self {
        Self::evaluated_at(frames, dataset, (start, frames), parameters, priors, weights)
    }

    /// The same, with regressors of disturbances that displace the sensor evaluated at the frames `at` in place of the starting ones.
    pub(crate) fn evaluated_at(
        at: &Frames,
        dataset: &Dataset,
        (start, frames): (&Model, &Frames),
        parameters: &[Parameter],
        priors: &[Prior],
        weights: &[Weight],
    ) -> Self {
        let columns = Columns::of(dataset, start, (frames, at), parameters, None);
        Self::with(columns, dataset, (start, frames), parameters, priors, weights)
    }

    /// Another problem on the same rows, without priors; reuses the sines and cosines.
    pub(crate) fn with_parameters(
        &self,
        dataset: &Dataset,
        start: &Model,
        frames: &Frames,
        parameters: &[Parameter],
        weights: &[Weight],
    ) -> Self {
        let columns = Columns::of(dataset, start, (frames, frames), parameters, Some(&self.columns.angles));
        Self::with(columns, dataset, (start, frames), parameters, &[], weights)
    }

    fn with(
        columns: Columns,
        dataset: &Dataset,
        (start, frames): (&Model, &Frames),
        parameters: &[Parameter],
        priors: &[Prior],
        weights: &[Weight],
    ) -> Self {
        Self {
            start: start.clone(),
            frames: frames.clone(),
            sensor: dataset.sensor,
            parameters: parameters.to_vec(),
            priors: priors.to_vec(),
            columns: Arc::new(columns),
            weights: Weights::of(weights, dataset.rows.len(), dataset.sensor),
            rows: dataset.rows.len(),
        }
    }

    /// The same problem with other weights, one for each row.
    pub fn reweighted(&self, weights: &[Weight]) -> Self {
        self.clone().with_weights(weights)
    }

    /// This problem with other weights, one for each row.
    pub fn with_weights(mut self, weights: &[Weight]) -> Self {
        self.weights = Weights::of(weights, self.rows, self.sensor);
        self
    }

    /// This problem with other priors, one for each parameter.
    pub fn with_priors(mut self, priors: &[Prior]) -> Self {
        self.priors.clear();
        self.priors.extend_from_slice(priors);
        self
    }

    /// Frees the rows (up to 150 bytes each) and keeps their number: a finished fit no longer needs them.
    pub(crate) fn drop_rows(&mut self) {
        (self.columns, self.weights) = (Arc::default(), Weights::default());
    }

    /// Weight of a row's length or position [1/mm].
    ///
    /// # Panics
    /// Beyond the last row.
    pub fn per_mm(&self, row: usize) -> f64 {
        self.weights.per_mm[row]
    }

    /// The free parameters, in the order of x.
    pub fn free_parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The starting model.
    pub fn start(&self) -> &Model {
        &self.start
    }

    /// The starting frames.
    pub fn starting_frames(&self) -> &Frames {
        &self.frames
    }

    /// The model and frames at `x`.
    pub fn apply(&self, x: &[f64]) -> (Model, Frames) {
        let (mut model, mut frames) = (self.start.clone(), self.frames.clone());
        let (mut sensor, mut tool) = (Vector6::zeros(), Vector6::zeros());
        for (parameter, &value) in self.parameters.iter().zip(x) {
            match *parameter {
                Parameter::SensorFrame(k) => sensor[k] += value,
                Parameter::Target(k) => tool[k] += value,
                Parameter::Link { joint, coordinate } => {
                    let link = &mut model.links[joint];
                    link.set(coordinate, link.get(coordinate) + value);
                }
                Parameter::Effect { index, parameter } => {
                    let before = model.effects[index].parameters()[parameter].value;
                    model.effects[index].set(parameter, before + value);
                }
                Parameter::Outlet { anchor, axis } => frames.outlets_mm[anchor][axis] += value,
                Parameter::Zero { anchor } => frames.zeros_mm[anchor] += value,
                Parameter::Disturbance { index, parameter } => {
                    frames.disturbances[index].values[parameter] += value;
                }
            }
        }
        frames.base_from_sensor = apply_twist(&frames.base_from_sensor, &sensor);
        frames.flange_from_target = apply_twist(&frames.flange_from_target, &tool);
        (model, frames)
    }
}
