//! Sentences of the findings for service technicians: cause, evidence, remedy.

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::decision;
use super::drift;
use super::extension::Extended;
use super::finding::{Confidence, Finding, FoundParameter, Gain};
use crate::identification::calibration::Frames;
use crate::measurement::dataset::{Dataset, Row, Sensor};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::{EmpiricalFault, Overturning, Pole};
use nalgebra::Vector3;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::link_twist::LinkTwist;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;

/// Values and standard deviations of the parameters of cause `index`.
pub fn found_parameters(fit: &Extended, index: usize) -> Vec<FoundParameter> {
    let sigmas = fit.estimate.sigmas();
    let sigma = |k: usize| sigmas.as_ref().and_then(|s| s.get(k).copied());
    let places = fit.parameter_indices(index);
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
    // Without logged time or temperature a parameter has no regressor and remains 0.
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

fn value_of(parameters: &[FoundParameter], k: usize) -> f64 {
    parameters.get(k).map_or(0.0, |p| p.value)
}

fn norm(parameters: &[FoundParameter]) -> f64 {
    parameters.iter().take(3).map(|p| p.value * p.value).sum::<f64>().sqrt()
}

/// A finding of `effect` with its usual remedy and without rows, joints, parameters or rivals.
pub(super) fn finding(
    effect: CauseKind,
    cause: String,
    confidence: Confidence,
    evidence: String,
    gain: Gain,
) -> Finding {
    Finding {
        effect,
        cause,
        terms: Vec::new(),
        shift: None,
        confidence,
        rows: None,
        row_list: None,
        rows_in_file: None,
        joints: None,
        parameters: Vec::new(),
        evidence,
        p_value: 0.0,
        non_centrality: None,
        gain,
        worth_mm: None,
        doubts: Vec::new(),
        sessions: Vec::new(),
        family: decision::family(effect),
        margin: None,
        members: Vec::new(),
        decided_by: None,
        corrected: None,
        alternatives: Vec::new(),
        remedy: effect.remedy().to_owned(),
    }
}

/// One sentence that states the part and the size of a cause, found in `dataset` with the sensor at `frames`.
pub fn describe_cause(
    cause: &Cause,
    parameters: &[FoundParameter],
    dataset: &Dataset,
    frames: &Frames,
) -> String {
    let last_row = dataset.rows.last().map_or(0, |row| row.number);
    let joint = cause.joints().first().map_or(0, |j| j + 1);
    let value = value_of(parameters, 0);
    let when = |rows: Option<[usize; 2]>| match rows {
        Some([from, to]) if to == last_row => format!("from row {from} on"),
        Some([from, to]) => format!("in rows {from} to {to}"),
        None => "throughout".to_owned(),
    };
    match cause {
        Cause::Arm(Effect::JointCompliance(_)) => {
            // A milliradian is a millimetre at one metre.
            format!(
                "joint {joint} is compliant: each N m of gravity torque moves what is 1 m away by {:.1} µm",
                value * 1e6
            )
        }
        Cause::Arm(Effect::LumpedCompliance(load)) if load.lump.iter().any(|l| l.axis.is_some()) => format!(
            "joint {joint} deflects under gravity that is not along the vertical axis of the base: the arm is mounted at a tilt"
        ),
        Cause::Arm(Effect::LumpedCompliance(_)) => {
            format!("joint {joint} deflects under gravity with masses that differ from the data sheet")
        }
        Cause::Arm(Effect::JointStiffness(_)) => stiffens(joint, value),
        Cause::Arm(Effect::TorquePowers(_)) => is_nonlinear(joint),
        // c = L/EI turns the link's end by a third of it under a force whose torque at the root is 1 N m.
        Cause::Arm(Effect::LinkBending(b)) if b.frame.is_none() => format!(
            "link {joint} bends: each N m at its root moves what is 1 m away by {:.1} µm",
            value * 1e6 / 3.0
        ),
        Cause::Arm(Effect::LinkBending(_)) => format!("link {joint} bends under what it carries"),
        Cause::Arm(Effect::LinkTwist(twist)) => twists(joint, twist),
        Cause::Arm(Effect::GearEccentricity(h)) => format!(
            "the gear or encoder of joint {joint} is eccentric: ±{:.3}° {} per turn",
            h.amplitude_rad().to_degrees(),
            match h.order {
                1.0 => "once".to_owned(),
                2.0 => "twice".to_owned(),
                order => format!("{order} times"),
            }
        ),
        Cause::Arm(Effect::GearTransmission(h)) => format!(
            "the reducer of joint {joint} has a transmission error of ±{:.4}° at {} periods per turn",
            h.amplitude_rad().to_degrees(),
            h.order
        ),
        Cause::Arm(Effect::GearMap(_)) => format!(
            "joint {joint} has an error that depends on its angle and is not a simple harmonic: worn teeth or encoder ring"
        ),
        Cause::Arm(Effect::SmoothCorrection(_)) => {
            "a repeatable error depends on the joint angles; its physical cause is unknown".to_owned()
        }
        Cause::Arm(Effect::GearRatio(_)) => {
            format!("the gear ratio of joint {joint} is wrong by {:.3} %", value * 100.0)
        }
        Cause::Arm(Effect::JointCoupling(c)) => format!(
            "joint {} moves with joint {}: {:.3}° for every 100°",
            c.joint + 1,
            c.driver + 1,
            value * 100.0
        ),
        Cause::Arm(Effect::GearTwoJoints(gear)) => depends_on_two(joint, gear.other),
        Cause::Arm(Effect::Backlash(_)) if value < 0.0 => format!(
            "joint {joint} stops {:.4}° higher when approached from below than from above: it overshoots, or the signs in column approach{joint} \
             are exchanged (-1 is from below)",
            -value.to_degrees()
        ),
        Cause::Arm(Effect::Backlash(_)) => format!(
            "joint {joint} has {:.4}° of backlash between approaches from below and from above",
            value.to_degrees()
        ),
        Cause::Arm(Effect::LoadedBacklash(play)) => is_closed_by_gravity(value, play),
        Cause::Arm(Effect::ThermalDrift(t)) if t.growth == 0.0 => {
            format!("the links grow by {:.1} µm per metre and kelvin", t.growth_per_k * 1e6)
        }
        Cause::Arm(growth @ Effect::ThermalDrift(_)) => drift::describe_growth(&[growth], dataset),
        Cause::Arm(Effect::AxisWobble(wobble)) => wobbles(joint, wobble.tilt_rad),
        Cause::Arm(Effect::BaseTilt(tilt)) if tilt.term.iter().any(|term| term.frame.is_some()) => {
            TILTS_UNDER_UNKNOWN_MASSES.to_owned()
        }
        Cause::Arm(Effect::BaseTilt(_)) => {
            "the base tilts under the overturning moment of the arm".to_owned()
        }
        Cause::Measurement(d) => describe_disturbance(d, &when(cause.rows()), parameters, (dataset, frames)),
    }
}

/// One sentence for a disturbance of the measurement; `rows` states when.
fn describe_disturbance(
    d: &Disturbance,
    rows: &str,
    parameters: &[FoundParameter],
    (dataset, frames): (&Dataset, &Frames),
) -> String {
    let value = value_of(parameters, 0);
    let shift = || what_shifted(d, parameters, (dataset, frames)).unwrap_or_default();
    match (&d.kind, &d.profile) {
        (Kind::Empirical(EmpiricalFault::Refraction), Profile::Temperature { .. }) => format!(
            "the tracker's beam is refracted more as the air warms up: {:.3} mm at 3 m per kelvin, growing with the square of the distance",
            9e3 * value.abs()
        ),
        (Kind::Empirical(form), _) => describe_empirical_fault(*form, parameters),
        (Kind::Load { .. }, _) => format!("{rows} {}", shift()),
        _ if drift::is_in_time(d) => drift::describe(&[d], dataset, frames),
        (Kind::Target, Profile::Temperature { .. }) => format!(
            "the target moves on the flange with temperature: {:.1} µm per kelvin",
            norm(parameters) * 1e3
        ),
        (Kind::Zero, Profile::Temperature { .. }) => {
            format!("the cable's zero drifts with temperature: {:.1} µm per kelvin", value.abs() * 1e3)
        }
        (_, Profile::Temperature { .. }) => format!(
            "the sensor moves relative to the base with temperature, by {:.1} µm per kelvin",
            at_target_mm(d, (dataset, frames)) * 1e3
        ),
        (Kind::JointZero { .. }, _) => {
            format!("{rows} {}: its encoder lost counts, a belt slipped, or it was mastered again", shift())
        }
        (Kind::Zero, _) => format!("{} {rows}", shift()),
        (Kind::Frame { .. }, _) => {
            let moved = if dataset.sensor == Sensor::Cable { "its outlet" } else { "its stand" };
            format!("{} {rows}: {moved} or the base of the arm moved", shift())
        }
        (Kind::Target, _) => format!("{} {rows}: the hook or reflector slipped", shift()),
        (Kind::Scale, Profile::Rows { .. }) => {
            format!("{rows} {}: it is another sensor, or its constant was entered anew", shift())
        }
        (Kind::Scale, _) => format!("the sensor's scale is wrong by {:.3} %", value * 100.0),
        (Kind::Sag, _) => {
            format!("the cable sags: weight over tension {:.4} per metre", value.max(0.0).sqrt())
        }
    }
}

/// What a cause shifted in some of the rows, without these and what may have done it; `None` for a cause of all rows.
pub(super) fn describe_shift(
    cause: &Cause,
    parameters: &[FoundParameter],
    measured: (&Dataset, &Frames),
) -> Option<String> {
    match cause {
        Cause::Measurement(d) if cause.rows().is_some() => what_shifted(d, parameters, measured),
        _ => None,
    }
}

fn what_shifted(
    d: &Disturbance,
    parameters: &[FoundParameter],
    measured: (&Dataset, &Frames),
) -> Option<String> {
    let value = value_of(parameters, 0);
    Some(match &d.kind {
        Kind::Load { compliance: Some(_), .. } => {
            let side = if value < 0.0 { "less" } else { "more" };
            format!("the arm carried {:.1} kg {side} than logged", value.abs())
        }
        Kind::Load { .. } => "the arm carried a load that was not logged".to_owned(),
        Kind::JointZero { joint } => format!(
            "the zero of joint {} was off by {:.4}° compared with all other rows",
            joint + 1,
            value.to_degrees().abs()
        ),
        Kind::Zero => format!("the cable's zero jumped by {value:.3} mm"),
        Kind::Frame { .. } => {
            format!("the sensor was displaced by {:.3} mm relative to the arm", at_target_mm(d, measured))
        }
        Kind::Target => format!("the target was displaced on the flange by {:.3} mm", norm(parameters)),
        Kind::Scale => {
            let side = if value < 0.0 { "shorter" } else { "longer" };
            format!("the sensor reads lengths {:.3} % {side} than in the other rows", 100.0 * value.abs())
        }
        _ => return None,
    })
}

/// How far a disturbance moves the target in the rows that it is in (mm).
fn at_target_mm(d: &Disturbance, (dataset, frames): (&Dataset, &Frames)) -> f64 {
    let among = |row: &Row| d.profile.at(row) != 0.0;
    Vector3::from(drift::shift_at_target(d, dataset, frames, among)).norm()
}

/// One sentence for an empirical fault.
fn describe_empirical_fault(form: EmpiricalFault, parameters: &[FoundParameter]) -> String {
    let value = value_of(parameters, 0);
    let joint = form.joints().first().map_or(0, |j| j + 1);
    match form {
        EmpiricalFault::Latency { .. } => format!(
            "the reading and the angles of a row are {:.1} ms apart while the arm moves",
            1e3 * value.abs()
        ),
        EmpiricalFault::ArmUnsettled => {
            let share = |k: usize| value_of(parameters, k).abs();
            let most = (0..parameters.len()).max_by(|&a, &b| share(a).total_cmp(&share(b))).unwrap_or(0);
            format!(
                "readings were taken before the arm had settled: up to {:.2} % of the last step remained (joint {})",
                100.0 * share(most),
                most + 1
            )
        }
        EmpiricalFault::SensorUnsettled => format!(
            "readings were taken before the sensor had settled: {:.2} % of the change from the previous reading remained",
            100.0 * value.abs()
        ),
        EmpiricalFault::NonlinearStiffness { .. } => is_nonlinear(joint),
        EmpiricalFault::Hardening { .. } => stiffens(joint, value),
        EmpiricalFault::LoadedPlay { .. } => match form.effect() {
            Some(Effect::LoadedBacklash(play)) => is_closed_by_gravity(value, &play),
            _ => String::new(),
        },
        EmpiricalFault::TwoJointGear { other, .. } => depends_on_two(joint, other),
        EmpiricalFault::AxisWobble { .. } => wobbles(joint, [0, 1, 2, 3].map(|k| value_of(parameters, k))),
        EmpiricalFault::Refraction => format!(
            "the tracker's beam is refracted: {:.3} mm at 3 m, growing with the square of the distance, as in air with a vertical temperature gradient",
            9e3 * value.abs()
        ),
        EmpiricalFault::Pulley => {
            "the cable's length error depends on its direction, as from a pulley or a worn outlet".to_owned()
        }
        EmpiricalFault::Drum { .. } => {
            "the cable's reading is not proportional to its length, as from a drum wound in layers".to_owned()
        }
        EmpiricalFault::CableReversal => format!(
            "the cable's reading is {:.3} mm {} where the cable had paid out than where it had wound in",
            value.abs(),
            if value < 0.0 { "shorter" } else { "longer" }
        ),
        EmpiricalFault::Lens => {
            let side = |k: usize, [more, less]: [&str; 2]| {
                let percent = 100.0 * value_of(parameters, k);
                format!("{:.2} % {}", percent.abs(), if percent < 0.0 { less } else { more })
            };
            format!(
                "the camera's lens distorts: 45° beside its axis positions are read {} from the axis and {} from the camera",
                side(0, ["further", "less far"]),
                side(1, ["further", "less far"])
            )
        }
        EmpiricalFault::Range { .. } => format!(
            "the sensor's distances are off by {:.3} mm and an amount that is not proportional to them: wrong reflector constant, or lens",
            value.abs()
        ),
        EmpiricalFault::SensorAxes => {
            let over_z = |k: usize| {
                let percent = 100.0 * value_of(parameters, k);
                let longer = if percent < 0.0 { "shorter" } else { "longer" };
                format!("{:.3} % {longer}", percent.abs())
            };
            format!(
                "the sensor's axes have different scales: along x it reads {} and along y {} than along z",
                over_z(0),
                over_z(1)
            )
        }
        EmpiricalFault::TargetNest { .. } => {
            "the target's apparent centre depends on the viewing direction: faulty nest or reflector"
                .to_owned()
        }
        EmpiricalFault::TargetDroop { pole: Pole::Bracket, .. } => {
            let most = parameters.iter().take(5).map(|p| p.value.abs()).fold(0.0, f64::max);
            format!(
                "the target droops on its adapter by about {most:.3} mm under gravity, as the flange turns"
            )
        }
        EmpiricalFault::TargetDroop { pole, .. } => format!(
            "the target droops by {value:.3} mm under gravity across its pole, {}",
            if pole == Pole::Axis {
                "which is along the flange's axis"
            } else {
                "which points to it from the flange"
            }
        ),
        EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: None, .. } => format!(
            "the base tilts under the arm: each N m of overturning moment turns it by {:.1} µrad",
            value * 1e6
        ),
        EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: Some(axes), .. } => {
            let about = |k: usize| {
                let axis = ["x", "y", "z"][usize::from(axes[k].min(2))];
                format!("{:.1} µrad about its {axis}", value_of(parameters, k) * 1e6)
            };
            format!(
                "the base tilts under the arm: each N m of overturning moment turns it by {}, or {}",
                about(0),
                about(1)
            )
        }
        EmpiricalFault::BaseTilt { .. } => TILTS_UNDER_UNKNOWN_MASSES.to_owned(),
    }
}

/// Of a joint (from 1) with this deflection (rad).
fn stiffens(joint: usize, deflection: f64) -> String {
    format!(
        "joint {joint} stiffens under its load: most of its deflection, up to {:.4}°, comes with the first newton metres",
        deflection.to_degrees()
    )
}

/// Of a play of this size (rad), which its load closes.
fn is_closed_by_gravity(size: f64, play: &LoadedBacklash) -> String {
    let held = if play.friction_nm == 0.0 {
        String::new()
    } else if play.mass.is_empty() {
        format!("; below {:.1} N m, friction holds it on the side from which it came", play.friction_nm)
    } else {
        // Under masses that are only assumed the torque is none that could be measured.
        "; where the load is small, friction holds it on the side from which it came".to_owned()
    };
    format!(
        "joint {} has {:.4}° of backlash that gravity closes: the load decides which flank of the gear carries it{held}",
        play.joint + 1,
        size.to_degrees()
    )
}

/// Of a joint (from 1) whose axis tilts by these factors (rad).
fn wobbles(joint: usize, tilt_rad: [f64; 4]) -> String {
    format!(
        "the axis of joint {joint} wobbles by up to {:.4}° twice a turn, as in a bearing with races that are not flat",
        largest_tilt(tilt_rad).to_degrees()
    )
}

/// Of a link (from 1) that turns under a load beside it.
fn twists(link: usize, twist: &LinkTwist) -> String {
    let level = twist.twist_rad.abs().to_degrees();
    let upright = twist.lean_rad.map_or_else(String::new, |lean| {
        format!(", and the axis at its end leans by up to {:.4}°", lean.abs().to_degrees())
    });
    format!("link {link} twists under a load beside the plane of the arm by up to {level:.4}°{upright}")
}

/// Of a base whose load is not known.
const TILTS_UNDER_UNKNOWN_MASSES: &str =
    "the base tilts under the overturning moment of the arm, with masses that no data sheet states";

/// Of a joint (from 1) with another law.
fn is_nonlinear(joint: usize) -> String {
    format!(
        "the deflection of joint {joint} is not proportional to its torque: its stiffness is nonlinear, or it has backlash"
    )
}

/// Of a joint (from 1) whose error depends on another (from 0) too.
fn depends_on_two(joint: usize, other: usize) -> String {
    format!("the error of joint {joint} depends on its own angle and on the angle of joint {}", other + 1)
}

/// Largest tilt of an axis that tilts about x by a cos φ + b sin φ and about y by c cos φ + d sin φ: two circles, one that runs with φ and
/// one against it.
fn largest_tilt([a, b, c, d]: [f64; 4]) -> f64 {
    0.5 * ((a + d).hypot(c - b) + (a - d).hypot(c + b))
}

/// The residual pattern that reveals a cause.
pub fn describe_pattern(cause: &Cause) -> String {
    let joint = cause.joints().first().map_or(0, |j| j + 1);
    match cause.kind() {
        CauseKind::Backlash if cause.is_empirical() => {
            format!("the residual about joint {joint} changes sign with its static torque")
        }
        CauseKind::ToolShift if cause.is_thermal() => {
            "the residual grows with time or temperature along one vector on the flange".to_owned()
        }
        kind => kind.pattern(joint),
    }
}

/// The recommended action for a cause.
pub(super) fn remedy_of(cause: &Cause) -> &'static str {
    match cause.kind() {
        CauseKind::Backlash if cause.is_empirical() => {
            "adjust the gear mesh; keep programs away from poses at which the load changes sides"
        }
        CauseKind::SensorScale if cause.scale_step().is_some() => {
            "measure a known length with the sensor of these rows and with that of the others: no row tells which of them is right, and the \
             size of the arm follows the others"
        }
        CauseKind::ThermalDrift
            if matches!(cause, Cause::Measurement(Disturbance { kind: Kind::Zero, .. })) =>
        {
            "switch the sensor on long before measuring; measure a reference point before and after each session"
        }
        CauseKind::ThermalDrift if !cause.is_in_arm() => {
            "from the sensor's place measure one point on the floor and one on the base of the arm, before and after: if both move, it is the \
             sensor's stand, if only the base, its bolts"
        }
        kind => kind.remedy(),
    }
}

/// The recommended action for a kind of cause of the arm that the written model does not have; `uncertain`: since it is not certain.
pub(super) fn remedy_left_out(effect: CauseKind, uncertain: bool) -> String {
    use CauseKind::*;
    let why = if uncertain { ", since it is not certain" } else { " (see the notes)" };
    let left = format!("do not expect programs to be corrected for it: the written model leaves it out{why}");
    // What of the usual remedy holds without a model.
    let further = match effect {
        JointCompliance => "check belts and reducer preload",
        LinkBending => "check the bolts of this link",
        LinkTwist => "check the bolts of this link, and the bearing at its end, axially",
        GearEccentricity => "at the next repair, look at the gear and the encoder ring",
        GearTransmission => "inspect the reducer for wear",
        GearTwoJoints => {
            "measure both joints over their whole range, one at a time and together; inspect the cable that crosses them"
        }
        JointStiffness => "measure this joint with and without load, approached under the same torque",
        Backlash => "approach every point from the same side",
        AxisWobble => "inspect the bearing of this joint with a dial gauge, axially, over a whole turn",
        BaseTilt => {
            "bolt or grout the pedestal, and read a level on it with the arm stretched out and folded"
        }
        SmoothCorrection => return left,
        _ => effect.remedy(),
    };
    format!("{left}; {further}")
}
