//! Checks of a model file before its numbers are used: a number that is not finite would give a σ of 0, and an invalid covariance
//! a σ of any size.

use std::collections::HashMap;

use nalgebra::{DMatrix, Matrix3};

use super::{Estimated, EstimatedParameter, StageErrors, WidthUncertainty};
use crate::bounds::{self, Bound, InvalidValue, JOINT_DEG, LENGTH_MM, MASS_KG};
use crate::condition::Condition;
use crate::model::Model;
use crate::parameter::{LinkCoordinate, Parameter, link_coordinates};
use crate::region::Region;
use truegrind_math::statistics::ErrorSummary;

const ERROR_MM: Bound = Bound::new(0.0, 1e6, "an error in mm, 0 or more");
const ERROR_RAD: Bound = Bound::new(0.0, 1.0, "an error of an angle in rad, 0 to 1");
const SIGNED_MM: Bound = Bound::new(-1e6, 1e6, "an error in mm, within ±1,000,000");
const SIGMA_MM: Bound = Bound::new(0.0, 1e4, "a standard deviation in mm, 0 to 10,000");
const SIGMA: Bound = Bound::new(0.0, 1e6, "a standard deviation, 0 or more");
const PRIOR: Bound = Bound::new(f64::MIN_POSITIVE, 1e12, "a standard deviation above 0");
const VALUE: Bound = Bound::new(-1e9, 1e9, "a finite number within ±1e9");
const SHARE: Bound = Bound::new(0.0, 1.0, "a share from 0 to 1");
const LOG_WIDTH: Bound = Bound::new(-20.0, 20.0, "the logarithm of a ratio, within ±20");
const SPACING_DEG: Bound = Bound::new(0.0, 1e4, "a distance in degrees, 0 or more");
const TIME_H: Bound = Bound::new(-1e6, 1e6, "a time in hours");
const TEMPERATURE_C: Bound = Bound::new(-273.15, 2000.0, "a temperature in °C");

/// Largest difference between estimated and nominal links: far more than any arm deviates (mm).
const MAX_LINK_CHANGE_MM: Bound = Bound::new(-200.0, 200.0, "a link within 200 mm of the nominal arm's");
/// The same for angles (°).
const MAX_LINK_CHANGE_DEG: Bound = Bound::new(-45.0, 45.0, "a link within 45° of the nominal arm's");
/// Most samples of a region and parameters of a model.
const MAX_ENTRIES: usize = 100_000;

/// Checks a model after reading; its two arms have passed their own checks.
pub(super) fn check(model: &Estimated) -> Result<(), InvalidValue> {
    if model.robot.trim().is_empty() {
        return Err(InvalidValue::new("robot", "nothing", "the name of the arm"));
    }
    arms(&model.nominal, &model.model)?;
    for (key, errors) in [("registered", &model.registered), ("geometry", &model.calibrated)] {
        stage(errors).map_err(|invalid| invalid.within(key))?;
    }
    ERROR_MM.check_all("beyond_noise_mm", &model.beyond_noise_mm)?;
    ERROR_RAD.check_all("beyond_noise_rad", model.beyond_noise_rad.iter().flatten())?;
    ERROR_MM.check_all("noise_floor_mm", &model.noise_floor_mm)?;
    SHARE.check("provenance.held_out", model.provenance.held_out)?;
    region(&model.region).map_err(|invalid| invalid.within("region"))?;
    condition(&model.condition).map_err(|invalid| invalid.within("condition"))?;
    order(model)?;
    for parameter in &model.parameters {
        number(parameter).map_err(|invalid| invalid.within(&format!("parameter {}", parameter.name)))?;
    }
    estimated_links(model)?;
    if let Some(widths) = &model.width_uncertainty {
        width_uncertainty(widths).map_err(|invalid| invalid.within("width_uncertainty"))?;
    }
    covariance(&model.order, &model.covariance)
}

/// The distribution of the logarithms of widths: plausible numbers and a covariance.
fn width_uncertainty(widths: &WidthUncertainty) -> Result<(), InvalidValue> {
    LOG_WIDTH.check_all("log_mean", &widths.log_mean)?;
    LOG_WIDTH.check_all("log_covariance", widths.log_covariance.as_flattened())?;
    let matrix = Matrix3::from_fn(|i, j| widths.log_covariance[i][j]);
    let smallest = matrix.symmetric_eigenvalues().min();
    if (matrix - matrix.transpose()).amax() > 1e-9 || smallest < -1e-9 {
        let expected = "a symmetric, positive semi-definite matrix";
        return Err(InvalidValue::new(
            "log_covariance",
            format!("smallest eigenvalue {smallest:.3e}"),
            expected,
        ));
    }
    Ok(())
}

/// The estimated arm must have the joint map of the nominal one, and links near its links.
fn arms(nominal: &Model, estimated: &Model) -> Result<(), InvalidValue> {
    if (nominal.joint_map - estimated.joint_map).amax() > 1e-9 {
        return Err(InvalidValue::new(
            "estimated.joint_map",
            "another map than nominal.joint_map",
            "the same: what an arm adds to it is an effect",
        ));
    }
    for (i, (from, to)) in nominal.links.iter().zip(&estimated.links).enumerate() {
        let key = |name: &str| format!("estimated.link {} {name}", i + 1);
        MAX_LINK_CHANGE_MM.check(key("a_mm less nominal"), to.a_mm - from.a_mm)?;
        MAX_LINK_CHANGE_MM.check(key("d_mm less nominal"), to.d_mm - from.d_mm)?;
        for (name, turn) in [
            ("alpha_deg less nominal", to.alpha_rad - from.alpha_rad),
            ("theta_deg less nominal", to.theta_rad - from.theta_rad),
            ("beta_deg less nominal", to.beta_rad - from.beta_rad),
        ] {
            MAX_LINK_CHANGE_DEG.check(key(name), turn.to_degrees())?;
        }
    }
    Ok(())
}

/// How far a link of the estimated arm may be from its parameter (mm, rad): a file states angles in degrees and parameters in radians,
/// and someone may have rounded them.
const SAME_LINK: f64 = 1e-6;

/// What to do about links that contradict their parameters.
const ONE_ESTIMATE: &str = "the same: the estimated arm is the nominal one with the values of its parameters, and their covariance is of that arm; \
    use the file as it was written, or identify the arm again";

/// The links of the estimated arm must be what the file says was identified: the nominal ones with the values of the parameters. Programs
/// follow the links, while their stated uncertainty is that of the parameters.
fn estimated_links(model: &Estimated) -> Result<(), InvalidValue> {
    let values: HashMap<&str, f64> =
        model.parameters.iter().map(|parameter| (parameter.name.as_str(), parameter.value)).collect();
    for joint in 0..6 {
        let [nominal, estimated] = [&model.nominal.links[joint], &model.model.links[joint]];
        for coordinate in ALL_COORDINATES {
            let parameter = Parameter::Link { joint, coordinate };
            let (name, found) = (parameter.to_string(), estimated.get(coordinate));
            let (stated, of) = match values.get(name.as_str()) {
                Some(value) => (*value, format!("parameter {name} of")),
                // The list of parameters may be omitted, and an arm from elsewhere may state neither parameters nor a covariance.
                None if model.order.is_empty() || model.order.contains(&parameter) => continue,
                None => (nominal.get(coordinate), format!("{name}, which is no parameter, nominally of")),
            };
            if !((found - stated).abs() <= SAME_LINK) {
                let unit = parameter.unit();
                let number = bounds::display_number;
                return Err(InvalidValue::new(
                    format!("estimated.link {}", joint + 1),
                    format!("{} {unit} beside {of} {} {unit}", number(found), number(stated)),
                    ONE_ESTIMATE,
                ));
            }
        }
    }
    Ok(())
}

const ALL_COORDINATES: [LinkCoordinate; 5] = [
    LinkCoordinate::A,
    LinkCoordinate::D,
    LinkCoordinate::Alpha,
    LinkCoordinate::Theta,
    LinkCoordinate::Beta,
];

fn stage(errors: &StageErrors) -> Result<(), InvalidValue> {
    let summary = |errors: &ErrorSummary| {
        for (key, value) in [
            ("rmse", errors.rmse),
            ("mean_absolute", errors.mean_absolute),
            ("standard_deviation", errors.standard_deviation),
            ("max", errors.max),
        ] {
            ERROR_MM.check(key, value)?;
        }
        SIGNED_MM.check("mean", errors.mean)
    };
    summary(&errors.fitted).map_err(|invalid| invalid.within("fitted"))?;
    summary(&errors.held_out).map_err(|invalid| invalid.within("held_out"))
}

pub(super) fn region(region: &Region) -> Result<(), InvalidValue> {
    JOINT_DEG.check_all("min_deg", &region.min_deg)?;
    JOINT_DEG.check_all("max_deg", &region.max_deg)?;
    if let Some(i) = (0..6).find(|&i| region.min_deg[i] > region.max_deg[i]) {
        return Err(InvalidValue::new(
            format!("min_deg and max_deg of joint {}", i + 1),
            format!("{} and {}", region.min_deg[i], region.max_deg[i]),
            "min not above max",
        ));
    }
    if region.samples_deg.len() > MAX_ENTRIES {
        return Err(InvalidValue::new(
            "samples_deg",
            format!("{} poses", region.samples_deg.len()),
            "up to 100,000",
        ));
    }
    JOINT_DEG.check_all("samples_deg", region.samples_deg.as_flattened())?;
    SPACING_DEG.check("spacing_deg", region.spacing_deg)?;
    SIGMA_MM.check("sigma_mm", region.sigma_mm)
}

pub(super) fn condition(condition: &Condition) -> Result<(), InvalidValue> {
    for (key, bound, value) in [
        ("time_h", TIME_H, condition.time_h),
        ("temperature_c", TEMPERATURE_C, condition.temperature_c),
        ("payload_kg", MASS_KG, condition.payload_kg),
    ] {
        bound.check_all(key, &value)?;
    }
    LENGTH_MM.check_all("payload_centre_mm", &condition.payload_centre_mm)?;
    match condition.approach.iter().find(|side| !(-1..=1).contains(*side)) {
        Some(side) => Err(InvalidValue::new("approach", side.to_string(), "-1, 0 or 1 for each joint")),
        None => Ok(()),
    }
}

fn number(parameter: &EstimatedParameter) -> Result<(), InvalidValue> {
    VALUE.check("nominal", parameter.nominal)?;
    VALUE.check("value", parameter.value)?;
    SIGMA.check("sigma", parameter.sigma)?;
    PRIOR.check_all("prior_sigma", &parameter.prior_sigma)?;
    SHARE.check("determined", parameter.determined)
}

/// Every parameter of the covariance must belong to the arm, and the list of parameters must have the same order.
fn order(model: &Estimated) -> Result<(), InvalidValue> {
    let arm = &model.model;
    for (i, parameter) in model.order.iter().enumerate() {
        let exists = match *parameter {
            Parameter::Link { joint, coordinate } => {
                link_coordinates(arm.links[joint].model).contains(&coordinate)
            }
            Parameter::Effect { index, parameter } => {
                arm.effects.get(index).is_some_and(|effect| parameter < effect.parameters().len())
            }
            _ => false,
        };
        if !exists {
            return Err(InvalidValue::new(
                "covariance.order",
                parameter.to_string(),
                "parameters that the arm has",
            ));
        }
        if model.order[..i].contains(parameter) {
            return Err(InvalidValue::new(
                "covariance.order",
                format!("{parameter} twice"),
                "each parameter of the arm once",
            ));
        }
    }
    // The list of parameters may be omitted: nothing is computed from it.
    if model.parameters.is_empty() {
        return Ok(());
    }
    let named: Vec<String> = model.order.iter().map(ToString::to_string).collect();
    let found: Vec<&str> = model.parameters.iter().map(|p| p.name.as_str()).collect();
    if named == found {
        return Ok(());
    }
    let at = named.iter().zip(&found).position(|(a, b)| a != b).unwrap_or(named.len().min(found.len()));
    let name = |name: Option<&str>| name.unwrap_or("nothing").to_owned();
    Err(InvalidValue::new(
        format!("parameter, number {}", at + 1),
        format!(
            "{} beside {} in covariance.order",
            name(found.get(at).copied()),
            name(named.get(at).map(String::as_str))
        ),
        "the same parameters in the same order",
    ))
}

/// A covariance must have a Cholesky factor. It is computed on correlations, so that units do not matter; rounding may make
/// a pivot of nearly equal parameters slightly negative.
fn covariance(order: &[Parameter], matrix: &DMatrix<f64>) -> Result<(), InvalidValue> {
    const SLACK: f64 = 1e-6;
    let n = order.len();
    let refuse = |k: usize, found: String, expected| {
        Err(InvalidValue::new(format!("covariance.lower, row {} ({})", k + 1, order[k]), found, expected))
    };
    for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let value = matrix[(i, j)];
        if !value.is_finite() || (i == j && !(0.0..=1e12).contains(&value)) {
            let expected = "finite numbers, and on the diagonal variances of 0 or more";
            return refuse(i, bounds::display_number(value), expected);
        }
    }
    let sigma: Vec<f64> = (0..n).map(|i| matrix[(i, i)].sqrt()).collect();
    let mut factor = DMatrix::<f64>::zeros(n, n);
    for k in 0..n {
        for i in k..n {
            let known: f64 = (0..k).map(|m| factor[(i, m)] * factor[(k, m)]).sum();
            let scale = sigma[i] * sigma[k];
            // A variance of 0 requires covariances of 0.
            if scale == 0.0 && matrix[(i, k)] != 0.0 {
                return refuse(i, bounds::display_number(matrix[(i, k)]), "0 beside a variance of 0");
            }
            let rest = if scale == 0.0 { 0.0 } else { matrix[(i, k)] / scale - known };
            if i == k && rest >= -SLACK {
                factor[(k, k)] = rest.max(0.0).sqrt();
            } else if i > k && factor[(k, k)] > SLACK.sqrt() {
                factor[(i, k)] = rest / factor[(k, k)];
            } else if i == k || rest.abs() > 10.0 * SLACK.sqrt() {
                let expected =
                    "a positive semi-definite covariance: the block up to this row has no Cholesky factor";
                return refuse(
                    i,
                    format!("correlations that contradict each other by {}", bounds::display_number(rest)),
                    expected,
                );
            }
        }
    }
    Ok(())
}
