//! Findings in a technician's words.

use super::cause::Cause;
use super::extension::Extended;
use super::finding::FoundParameter;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::EmpiricalFault;
use truegrind_arm::effect::Effect;

/// Value and σ of the parameters of cause `index`.
pub fn parameters(fit: &Extended, index: usize) -> Vec<FoundParameter> {
    let sigmas = fit.estimate.sigmas();
    let sigma = |k: usize| sigmas.as_ref().and_then(|s| s.get(k).copied());
    let places = fit.places(index);
    let named: Vec<(String, &str, f64)> = match &fit.causes[index] {
        Cause::Arm(effect) => {
            effect.parameters().into_iter().map(|p| (p.name.to_owned(), p.unit, p.value)).collect()
        }
        Cause::Measurement(d) => d.names().into_iter().zip(&d.values).map(|((n, u), &v)| (n, u, v)).collect(),
    };
    let mut out: Vec<FoundParameter> = named
        .into_iter()
        .zip(&places)
        .map(|((name, unit, value), &k)| FoundParameter {
            name,
            value,
            sigma: sigma(k),
            unit: unit.to_owned(),
        })
        .collect();
    // A regressor that no row has (no clock, no thermometer) is nobody's finding.
    if let Cause::Arm(Effect::ThermalDrift(_)) = &fit.causes[index] {
        out.retain(|p| p.value != 0.0);
    }
    if let Cause::Arm(Effect::GearEccentricity(h) | Effect::GearTransmission(h)) = &fit.causes[index] {
        let order = h.order;
        for p in &mut out {
            p.name = format!("{}, {order} per turn", p.name);
        }
        let spread = out.iter().filter_map(|p| p.sigma).map(|s| s * s).sum::<f64>() / 2.0;
        out.push(FoundParameter {
            name: format!("amplitude, {order} per turn"),
            value: h.amplitude_rad().to_degrees(),
            sigma: Some(spread.sqrt().to_degrees()),
            unit: "°".to_owned(),
        });
    }
    if let Cause::Arm(Effect::GearMap(map)) = &fit.causes[index] {
        let largest = map.knots_rad.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        out.push(FoundParameter {
            name: "largest value of the map".to_owned(),
            value: largest.to_degrees(),
            sigma: None,
            unit: "°".to_owned(),
        });
    }
    out
}

fn found(parameters: &[FoundParameter], k: usize) -> f64 {
    parameters.get(k).map_or(0.0, |p| p.value)
}

fn size(parameters: &[FoundParameter]) -> f64 {
    parameters.iter().take(3).map(|p| p.value * p.value).sum::<f64>().sqrt()
}

/// One sentence of cause.
pub fn cause(cause: &Cause, parameters: &[FoundParameter], last_row: usize) -> String {
    let joint = cause.joints().first().map_or(0, |j| j + 1);
    let value = found(parameters, 0);
    let when = |rows: Option<[usize; 2]>| match rows {
        Some([from, to]) if to == last_row => format!("from row {from} on"),
        Some([from, to]) => format!("in rows {from} to {to}"),
        None => "throughout".to_owned(),
    };
    match cause {
        Cause::Arm(Effect::JointCompliance(_)) => {
            format!("joint {joint} yields under gravity: {:.2e} rad for every N m of static torque", value)
        }
        Cause::Arm(Effect::LumpedCompliance(load)) if load.lump.iter().any(|l| l.axis.is_some()) => format!(
            "joint {joint} yields under a pull of gravity that is not along the arm's own vertical: the arm is tilted"
        ),
        Cause::Arm(Effect::LumpedCompliance(_)) => {
            format!("joint {joint} yields under gravity, with masses other than the data sheet's")
        }
        Cause::Arm(Effect::GearEccentricity(h)) => format!(
            "the gear or encoder of joint {joint} runs out of centre: ±{:.3}° {} per turn",
            h.amplitude_rad().to_degrees(),
            if h.order == 1.0 { "once" } else { "twice" }
        ),
        Cause::Arm(Effect::GearTransmission(h)) => format!(
            "the reducer of joint {joint} transmits unevenly: ±{:.4}° at {} periods per turn",
            h.amplitude_rad().to_degrees(),
            h.order
        ),
        Cause::Arm(Effect::GearMap(_)) => format!(
            "joint {joint} has an error that depends on its own angle and is no simple harmonic: worn teeth or encoder ring"
        ),
        Cause::Arm(Effect::SmoothCorrection(_)) => {
            "something repeatable depends on the joints; it has no physical name".to_owned()
        }
        Cause::Arm(Effect::GearRatio(_)) => {
            format!("the gear ratio of joint {joint} is off by {:.3} % of its angle", value * 100.0)
        }
        Cause::Arm(Effect::JointCoupling(c)) => format!(
            "joint {} turns along with joint {}: {:.3}° for every 100°",
            c.joint + 1,
            c.driver + 1,
            value * 100.0
        ),
        Cause::Arm(Effect::Backlash(_)) if value < 0.0 => format!(
            "joint {joint} goes too far at a reversal: coming from below it stops {:.4}° above where it stops coming from above",
            -value.to_degrees()
        ),
        Cause::Arm(Effect::Backlash(_)) => format!(
            "joint {joint} has play: {:.4}° between coming from below and from above",
            value.to_degrees()
        ),
        Cause::Arm(Effect::ThermalDrift(t)) => {
            if t.growth_per_k != 0.0 && t.growth == 0.0 {
                format!("the links grow by {:.1} µm per metre and kelvin", t.growth_per_k * 1e6)
            } else {
                format!(
                    "the links grow by {:.0} µm per metre while the arm warms up, with a time constant of {:.2} h",
                    t.growth * 1e6,
                    t.time_constant_h
                )
            }
        }
        Cause::Measurement(d) => of_measurement(d, &when(cause.rows()), parameters),
    }
}

/// One sentence for a disturbance of the measurement; `rows`: when.
fn of_measurement(d: &Disturbance, rows: &str, parameters: &[FoundParameter]) -> String {
    let value = found(parameters, 0);
    match (&d.kind, &d.profile) {
        (Kind::Empirical(form), _) => of_form(*form, parameters),
        (Kind::Load { compliance: Some(_), .. }, _) => {
            format!("{rows} the arm carried {value:.1} kg more than the log says")
        }
        (Kind::Load { .. }, _) => {
            format!("{rows} the arm carried a load that the log does not tell of")
        }
        (_, Profile::Exponential { time_constant_h }) => format!(
            "the sensor drifts against the base while things warm up: {:.2} mm, time constant {time_constant_h:.2} h",
            size(parameters)
        ),
        (_, Profile::Temperature { .. }) => format!(
            "the sensor drifts against the base with temperature: {:.1} µm per kelvin",
            size(parameters) * 1e3
        ),
        (Kind::Zero, _) => format!("the cable's zero jumped by {value:.3} mm {rows}"),
        (Kind::Frame { .. }, _) => {
            format!("the sensor stood {:.3} mm elsewhere {rows}: its stand was moved", size(parameters))
        }
        (Kind::Target, _) => format!(
            "the touched point sat {:.3} mm elsewhere on the flange {rows}: hook or reflector slipped",
            size(parameters)
        ),
        (Kind::Scale, _) => format!("the sensor's scale is off by {:.3} %", value * 100.0),
        (Kind::Sag, _) => {
            format!("the cable sags: weight over tension {:.4} per metre", value.max(0.0).sqrt())
        }
    }
}

/// One sentence for a form.
fn of_form(form: EmpiricalFault, parameters: &[FoundParameter]) -> String {
    let value = found(parameters, 0);
    let joint = form.joints().first().map_or(0, |j| j + 1);
    match form {
        EmpiricalFault::Latency { .. } => format!(
            "the reading and the angles of a row are {:.1} ms apart while the arm moves",
            1e3 * value.abs()
        ),
        EmpiricalFault::ArmUnsettled => {
            let share = |k: usize| found(parameters, k).abs();
            let most = (0..parameters.len()).max_by(|&a, &b| share(a).total_cmp(&share(b))).unwrap_or(0);
            format!(
                "readings were taken before the arm stood still: up to {:.2} % of the last step was still to come (joint {})",
                100.0 * share(most),
                most + 1
            )
        }
        EmpiricalFault::SensorUnsettled => format!(
            "readings were taken before the sensor had settled: {:.2} % of the way from the last one was still to come",
            100.0 * value.abs()
        ),
        EmpiricalFault::NonlinearStiffness { .. } => format!(
            "joint {joint} does not yield in proportion to its torque: its spring hardens, or has play"
        ),
        EmpiricalFault::TwoJointGear { other, .. } => {
            format!("the error of joint {joint} depends on its own angle and on that of joint {}", other + 1)
        }
        EmpiricalFault::Refraction => format!(
            "the tracker's beam is bent: {:.3} mm at 3 m, in proportion to the square of the distance, as by air that is warmer above than below",
            9e3 * value.abs()
        ),
        EmpiricalFault::Pulley => {
            "the cable's length depends on its direction, as over a pulley or through a worn outlet"
                .to_owned()
        }
        EmpiricalFault::Drum { .. } => {
            "the cable's reading is not in proportion to its length, as from a drum wound in layers"
                .to_owned()
        }
        EmpiricalFault::TargetNest { .. } => {
            "the target's centre depends on the direction from which it is seen: nest or reflector".to_owned()
        }
    }
}

/// Which pattern showed it.
pub fn pattern(cause: &Cause) -> String {
    let joint = cause.joints().first().map_or(0, |j| j + 1);
    match cause.name() {
        "joint-compliance" => format!("the residual follows the static torque on joint {joint}"),
        "gear-eccentricity" => format!("the residual turned to joint {joint} swings with its angle"),
        "gear-transmission" => format!("the residual turned to joint {joint} repeats with its angle"),
        "gear-ratio" => format!("the residual turned to joint {joint} grows in proportion to its angle"),
        "joint-coupling" => format!("the residual turned to a joint grows with the angle of joint {joint}"),
        "backlash" => format!("the residual turned to joint {joint} changes sign with the side of approach"),
        "thermal-drift" => "the residual grows with time or temperature".to_owned(),
        "payload-change" => {
            "the residual follows the torque of a mass at the flange in these rows alone".to_owned()
        }
        "sensor-zero-shift" => "the cable's residual steps by one amount in these rows".to_owned(),
        "sensor-frame-shift" => "the residual steps by one vector in the base in these rows".to_owned(),
        "tool-shift" => "the residual steps by one vector on the flange in these rows".to_owned(),
        "latency" => "the residual follows the speed of the joints".to_owned(),
        "unsettled" => "the residual points back to the pose before".to_owned(),
        "joint-stiffness" => format!("the residual turned to joint {joint} follows powers of its torque"),
        "gear-two-joints" => {
            format!("the residual turned to joint {joint} swings with the angles of two joints")
        }
        "air-refraction" => "the residual grows up or down with the square of the distance".to_owned(),
        "cable-pulley" => "the residual follows the direction of the cable".to_owned(),
        "cable-drum" => "the residual follows powers of the cable's length".to_owned(),
        "target-nest" => "the residual follows the direction of the beam as the target sees it".to_owned(),
        "sensor-scale" => "the residual grows in proportion to the reading".to_owned(),
        "cable-sag" => "the residual grows with the square of the cable's level span".to_owned(),
        _ => "see the picture".to_owned(),
    }
}

/// What to do about it.
pub fn remedy(effect: &str) -> &'static str {
    match effect {
        "joint-compliance" => {
            "compensate with this model, which carries the compliance; check belts and reducer preload if it grew"
        }
        "gear-eccentricity" => {
            "compensate with this model; on a repair, reseat or replace the eccentric gear or encoder ring"
        }
        "gear-transmission" => {
            "compensate with this model; inspect the reducer for wear if the amplitude grows"
        }
        "gear-ratio" => {
            "check the ratio in the controller's motor configuration against the gear that is built in"
        }
        "joint-coupling" => {
            "check the coupling ratio in the controller's configuration; the wrist's gear train may have been exchanged"
        }
        "backlash" => {
            "approach every point from the same side, or compensate with the side of approach; adjust the gear's mesh"
        }
        "thermal-drift" => "warm the arm up before measuring and grinding, or measure in both states",
        "payload-change" => {
            "log the payload of every row; measure the rows again with the load that the program has"
        }
        "sensor-zero-shift" => {
            "check the cable's clamp and drum; measure a reference point before and after each session"
        }
        "sensor-frame-shift" => {
            "fix the sensor's stand; measure reference points before and after each session"
        }
        "tool-shift" => "fasten the hook or reflector; measure the rows after the slip again",
        "sensor-scale" => "check the sensor against a length standard",
        "latency" => "write angles and reading by one clock, or measure at rest",
        "unsettled" => "wait longer before each reading",
        "joint-stiffness" => {
            "measure this joint with and without load, approached under the same torque; the model that is written has its linear part"
        }
        "gear-two-joints" => {
            "measure both joints over their whole range, one at a time and together; look at the cable that crosses them"
        }
        "air-refraction" => {
            "measure at even temperature and from near, or with the tracker at the height of the arm"
        }
        "cable-pulley" => {
            "look at outlet and pulley; measure with the cable in one direction as far as possible"
        }
        "cable-drum" => "check the cable sensor against a length standard over its whole range",
        "target-nest" => "turn the target towards the sensor; check its nest and exchange the reflector",
        "cable-sag" => "raise the cable's tension or shorten the distance",
        "angle-rounding" => "log angles with more digits",
        "readout-mismatch" => {
            "write angles and read-out at the same moment, at rest; measure these rows again"
        }
        "outliers" => "measure these rows again",
        "setup-change" => {
            "measure reference points before and after each session, and the rows of a session that is off again"
        }
        "small-disturbances" => "nothing: the model carries them where they are the arm's",
        _ => "measure more poses where the picture shows the largest residuals",
    }
}
