//! Display of identified parameters.

use truegrind_arm::estimated::EstimatedParameter;
use truegrind_arm::parameter::display_unit;

/// A parameter with all values multiplied by `factor`.
pub(super) fn in_unit(parameter: &EstimatedParameter, factor: f64, unit: &str) -> EstimatedParameter {
    EstimatedParameter {
        name: parameter.name.clone(),
        unit: unit.to_owned(),
        nominal: parameter.nominal * factor,
        value: parameter.value * factor,
        sigma: parameter.sigma * factor,
        prior_sigma: parameter.prior_sigma.map(|sigma| sigma * factor),
        determined: parameter.determined,
    }
}

/// A parameter in display units: degrees for radians, ppm for the small parameters of effects.
pub(super) fn handy(parameter: &EstimatedParameter) -> EstimatedParameter {
    let (factor, unit) = match parameter.unit.as_str() {
        "1" => (1e6, "ppm"),
        "1/K" => (1e6, "ppm/K"),
        "rad/(N m)" => (1e6, "µrad/(N m)"),
        unit => display_unit(unit),
    };
    in_unit(parameter, factor, unit)
}

/// Whether the prior determines a parameter more than the data do.
pub(super) fn held_by_prior(parameter: &EstimatedParameter) -> bool {
    !(parameter.determined >= 0.5)
}
