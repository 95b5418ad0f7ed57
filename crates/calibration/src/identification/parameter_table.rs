//! The parameters of a fit with their values, standard deviations and names.

use super::calibration::Frames;
use super::fit::Fitted;
use truegrind_arm::estimated::EstimatedParameter;
use truegrind_arm::model::Model;
use truegrind_arm::parameter::Parameter;

/// Every free parameter of a fit, in its own unit.
pub(crate) fn parameter_table(fitted: &Fitted, nominal: &Model) -> Vec<EstimatedParameter> {
    let sigmas = fitted.sigmas();
    fitted
        .parameters
        .iter()
        .enumerate()
        .map(|(k, parameter)| {
            let prior = fitted.priors[k].sigma;
            let nominal_value = match *parameter {
                Parameter::Link { joint, coordinate } => nominal.links[joint].get(coordinate),
                _ => 0.0,
            };
            let value = match *parameter {
                Parameter::Link { joint, coordinate } => fitted.model.links[joint].get(coordinate),
                Parameter::Effect { index, parameter } => {
                    fitted.model.effects[index].parameters()[parameter].value
                }
                Parameter::Target(axis) if axis < 3 => {
                    fitted.frames.flange_from_target.translation.vector[axis]
                }
                Parameter::SensorFrame(axis) if axis < 3 => {
                    fitted.frames.base_from_sensor.translation.vector[axis]
                }
                Parameter::Target(axis) => fitted.frames.flange_from_target.rotation.scaled_axis()[axis - 3],
                Parameter::SensorFrame(axis) => {
                    fitted.frames.base_from_sensor.rotation.scaled_axis()[axis - 3]
                }
                Parameter::Outlet { anchor, axis } => fitted.frames.outlets_mm[anchor][axis],
                Parameter::Zero { anchor } => fitted.frames.zeros_mm[anchor],
                Parameter::Disturbance { index, parameter } => {
                    fitted.frames.disturbances[index].values[parameter]
                }
            };
            let unit = match *parameter {
                Parameter::Effect { index, parameter } => {
                    fitted.model.effects[index].parameters()[parameter].unit
                }
                Parameter::Disturbance { index, parameter } => {
                    fitted.frames.disturbances[index].names()[parameter].1
                }
                _ => parameter.unit(),
            };
            EstimatedParameter {
                name: name_of(*parameter, &fitted.frames),
                unit: unit.to_owned(),
                nominal: nominal_value,
                value,
                sigma: sigmas[k],
                prior_sigma: prior.is_finite().then_some(prior),
                determined: (1.0 - (sigmas[k] / prior).powi(2)).clamp(0.0, 1.0),
            }
        })
        .collect()
}

/// The name of a parameter in tables; that of a further station tells which.
fn name_of(parameter: Parameter, frames: &Frames) -> String {
    match parameter {
        Parameter::Disturbance { index, parameter } if index < frames.further_stations() => {
            let coordinate = Parameter::SensorFrame(parameter).to_string();
            coordinate.replacen("sensor", &format!("station{}", index + 2), 1)
        }
        _ => parameter.to_string(),
    }
}
