//! Radial basis function network as an effect of the arm, its centres spread over the measured poses.

use crate::measurement::dataset::Dataset;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::smooth_correction::SmoothCorrection;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;
use truegrind_estimation::network::rbf::{Layout, Options};

/// The arm with a zero correction, its centres spread over the poses of `dataset`. Without poses the arm is returned
/// unchanged. The layout is always the robust one: a model must not extrapolate beyond its measurements.
pub fn with_network(model: &Model, dataset: &Dataset, options: &Options) -> Model {
    let wrists: Vec<[f64; 3]> = dataset
        .rows
        .iter()
        .map(|row| {
            let u = model.mapped(&row.joints);
            [u[0], u[1], u[2]]
        })
        .collect();
    let layout = Layout::of(&wrists, &Options { form: Default::default(), ..*options });
    let mut out = model.clone();
    if !layout.centres.is_empty() {
        out.effects.push(Effect::SmoothCorrection(SmoothCorrection::still(layout.centres, layout.reach)));
    }
    out
}

/// The weights of the arm's last effect, where that is a network.
pub fn network_parameters(model: &Model) -> Vec<Parameter> {
    match model.effects.split_last() {
        Some((effect @ Effect::SmoothCorrection(_), before)) => (0..effect.parameters().len())
            .map(|parameter| Parameter::Effect { index: before.len(), parameter })
            .collect(),
        _ => Vec::new(),
    }
}
