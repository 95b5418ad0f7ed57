//! The warmth of the arm for which programs are corrected.

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Model;

use crate::arms::Arms;
use crate::options::Options;

fn thermal(model: &Model) -> Option<(&Effect, &Thermal)> {
    model.effects.iter().find_map(|effect| match effect {
        Effect::ThermalDrift(thermal) => Some((effect, thermal)),
        _ => None,
    })
}

/// How much the links of an arm grow per kelvin (1/K), if its model says so.
pub fn growth_per_k(arm: &Estimated) -> Option<f64> {
    thermal(&arm.model).map(|(_, thermal)| thermal.growth_per_k).filter(|growth| *growth != 0.0)
}

/// For which warmth of the arm programs are corrected; no σ counts another one.
pub(crate) fn warmth_note(arms: &Arms<'_>, options: &Options) -> Option<String> {
    let (effect, thermal) = thermal(arms.estimated.arm().model)?;
    let condition = &options.condition;
    if let Some(celsius) = condition.temperature_c.filter(|_| thermal.growth_per_k != 0.0) {
        return Some(format!(
            "temperature: the arm is taken to have {celsius:.1} °C (without --temperature that of the measurement). With every 10 K of difference \
             a point 1 m away is off by {:.3} mm, which no σ counts",
            thermal.growth_per_k.abs() * 1e4
        ));
    }
    let cold =
        effect.growth(&truegrind_arm::condition::Condition { time_h: Some(thermal.start_h), ..*condition });
    let grown = (effect.growth(condition) - cold).abs();
    (grown > 0.0).then(|| {
        format!(
            "warm-up: the arm is taken to be as warm as halfway through its measurement, when it had grown by {:.0} µm per metre. Run the program \
             on the warm arm: a cold one is off by as much, which no σ counts",
            grown * 1e6
        )
    })
}
