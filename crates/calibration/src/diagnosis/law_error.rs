//! What is wrong with a law whose form is only assumed: springs that are not linear, errors of two joints, a base that tilts, an axis that
//! wobbles, links that twist or grow alike.
//!
//! The covariance of a fit counts what the rows leave open of the parameters, as if the law were right. It is not: the rest of an effect that
//! its law does not follow shows at other poses too. It is stated as if the whole effect were known to a share s of its size alone: with its
//! parameters v, s² v vᵀ is added to their covariance.
//!
//! The shares are those of the second simulator, whose effects have other forms than these laws (`docs/evidence.md`).

use crate::identification::fit::Fitted;
use truegrind_arm::effect::Effect;
use truegrind_arm::parameter::Parameter;

/// The share of an effect that its law does not follow; none of an effect that is what its law says, or any function of a joint.
fn share(effect: &Effect) -> Option<f64> {
    match effect {
        // Where its load closes it is known to some rows only.
        Effect::LoadedBacklash(_) => Some(0.25),
        Effect::JointStiffness(_) | Effect::TorquePowers(_) | Effect::ThermalDrift(_) => Some(0.1),
        Effect::GearTwoJoints(_) | Effect::LinkBending(_) => Some(0.05),
        // Its load is taken to stand beside the arm by the same length in all poses.
        Effect::LinkTwist(_) => Some(0.1),
        Effect::BaseTilt(_) | Effect::AxisWobble(_) => Some(0.03),
        _ => None,
    }
}

/// Adds them to the covariance of a fit.
pub(super) fn add_law_errors(fitted: &mut Fitted) {
    let Some(covariance) = &mut fitted.estimate.covariance else { return };
    for (index, effect) in fitted.model.effects.iter().enumerate() {
        let Some(share) = share(effect) else { continue };
        let values = effect.parameters();
        let places: Vec<(usize, f64)> = fitted
            .parameters
            .iter()
            .enumerate()
            .filter_map(|(place, parameter)| match *parameter {
                Parameter::Effect { index: of, parameter } if of == index => {
                    Some((place, share * values[parameter].value))
                }
                _ => None,
            })
            .collect();
        for &(a, v) in &places {
            for &(b, w) in &places {
                covariance[(a, b)] += v * w;
            }
        }
    }
}
