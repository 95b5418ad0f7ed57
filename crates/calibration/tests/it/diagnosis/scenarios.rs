//! Scenarios that hide effects, and how a diagnosis of them is scored.

use nalgebra::{DVector, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::bending::Bending;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::coupling::Coupling;
use truegrind_arm::effect::gear_ratio::GearRatio;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::model::Model;
use truegrind_calibration::diagnosis::cause::Cause;
use truegrind_calibration::diagnosis::design::Design;
use truegrind_calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind_calibration::diagnosis::extension::{FreeParameters, Subject, fit};
use truegrind_calibration::diagnosis::finding::{Confidence, Finding};
use truegrind_calibration::diagnosis::validation::Validation;
use truegrind_calibration::identification::calibration::{CalibrationProblem, Frames, Weight};
use truegrind_calibration::identification::start::candidate_frames;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};
use truegrind_calibration::measurement::sensor::disturbance::{Disturbance, Kind, Profile};

use super::simulator::{Hidden, Log, Run, Setup, difference, run};

/// Kinds of effects that are hidden.
pub const KINDS: [&str; 10] = [
    "joint-compliance",
    "gear-eccentricity",
    "gear-transmission",
    "gear-ratio",
    "joint-coupling",
    "backlash",
    "thermal-drift",
    "sensor-zero-shift",
    "sensor-frame-shift",
    "tool-shift",
];

/// The same effects and more, as a log of a shop floor has them: what a name has behind its stroke says how.
pub const FIELD: [&str; 12] = [
    "thermal-drift/base",
    "thermal-drift/temperature",
    "sensor-scale",
    "sensor-scale/second",
    "cable-sag",
    "payload-change",
    "joint-compliance/lean",
    "backlash/order",
    "gear-eccentricity/rounded",
    "sensor-zero-shift/twice",
    "sensor-frame-shift/twice",
    "outliers",
];

/// What a kind's log holds.
pub fn log(kind: &str) -> Log {
    let plain = Log::default();
    match kind.split_once('/').map_or("", |k| k.1) {
        "temperature" => Log { clock: false, thermometer: true, ..plain },
        "lean" => Log { lean_rad: 1.2, ..plain },
        "order" => Log { sides: false, clock: false, ..plain },
        "rounded" => Log { angle_step_rad: Some(0.1_f64.to_radians()), ..plain },
        _ => plain,
    }
}

/// What a kind hides: two of the same where it says so.
pub fn hide(kind: &str, rows: usize, rng: &mut ChaCha8Rng) -> Vec<Hidden> {
    let (name, how) = kind.split_once('/').unwrap_or((kind, ""));
    if how == "twice" {
        let first = draw(name, rows / 2, rng);
        let mut second = draw(name, rows / 2, rng);
        if let Hidden::Zero { from, to, .. } | Hidden::Frame { from, to, .. } = &mut second {
            (*from, *to) = (*from + rows / 2, *to + rows / 2);
        }
        return vec![first, second];
    }
    vec![match kind {
        "thermal-drift/base" => {
            let Hidden::Frame { mm, .. } = draw("sensor-frame-shift", rows, rng) else { return Vec::new() };
            Hidden::Drift { mm, time_constant_h: rng.random_range(0.4..2.0) }
        }
        "thermal-drift/temperature" => Hidden::Warm { growth_per_k: rng.random_range(2e-5..2e-4) },
        "sensor-scale/second" => {
            let Hidden::Zero { from, to, mm } = draw("sensor-zero-shift", rows, rng) else {
                return Vec::new();
            };
            Hidden::Scale { rows: Some([from, to]), factor: 5e-4 * mm }
        }
        "outliers" => {
            let mut list: Vec<usize> = (0..rows / 40).map(|_| rng.random_range(0..rows)).collect();
            list.sort_unstable();
            list.dedup();
            Hidden::Outliers { list, mm: rng.random_range(2.0..60.0) }
        }
        _ => draw(name, rows, rng),
    }]
}

/// An effect of a kind, of a size met in practice: 0.05° to 0.15° in a joint, 0.3 to 4 mm at the sensor.
pub fn draw(kind: &str, rows: usize, rng: &mut ChaCha8Rng) -> Hidden {
    let peak = rng.random_range(0.05_f64..0.15).to_radians();
    let sign = if rng.random_range(0..2) == 0 { -1.0 } else { 1.0 };
    let size = rng.random_range(0.3..4.0);
    let joint = rng.random_range(0..6usize);
    let from = rng.random_range(rows / 6..rows / 2);
    let to = if rng.random_range(0..2) == 0 {
        rows - 1
    } else {
        (from + rng.random_range(rows / 6..rows / 2)).min(rows - 8)
    };
    let mut direction = || {
        let v = Vector3::new(
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0_f64),
        );
        (v.normalize() * size).into()
    };
    match kind {
        "joint-compliance" => Hidden::Compliance { joint: 1 + joint % 3, peak_rad: peak },
        "gear-eccentricity" => Hidden::Gear {
            joint,
            order: f64::from(rng.random_range(1..3_u8)),
            peak_rad: peak,
            phase: rng.random_range(0.0..std::f64::consts::TAU),
        },
        "gear-transmission" => Hidden::Gear {
            joint,
            order: f64::from(rng.random_range(3..120_u8)),
            peak_rad: peak,
            phase: rng.random_range(0.0..std::f64::consts::TAU),
        },
        "gear-ratio" => Hidden::Ratio { joint, error: sign * peak / 1.5 },
        "joint-coupling" => {
            let (driver, joint) = [(3, 4), (3, 5), (4, 5), (1, 2)][joint % 4];
            Hidden::Coupling { driver, joint, factor: sign * peak / 1.5 }
        }
        "backlash" => Hidden::Backlash { joint, play_rad: peak },
        "thermal-drift" => {
            Hidden::Thermal { growth: size * 2.5e-4, time_constant_h: rng.random_range(0.4..2.0) }
        }
        "sensor-scale" => Hidden::Scale { rows: None, factor: sign * size * 5e-4 },
        "cable-sag" => Hidden::Sag { square_per_m2: rng.random_range(2e-3..1e-2) },
        "payload-change" => Hidden::Payload { from, to, kg: rng.random_range(1.0..5.0) },
        "sensor-zero-shift" => Hidden::Zero { from, to, mm: sign * size },
        "sensor-frame-shift" => Hidden::Frame { from, to, mm: direction() },
        _ => Hidden::Tool { from, to, mm: direction() },
    }
}

/// How one run was diagnosed.
pub struct Outcome {
    /// What was hidden, with its non-centrality against geometry and frames.
    pub hidden: Vec<(Hidden, f64)>,
    /// Whether each was found by name and joint or rows.
    pub found: Vec<bool>,
    /// Whether each was found and called identified.
    pub identified: Vec<bool>,
    /// Findings that nothing hidden accounts for.
    pub wrong: Vec<String>,
    /// How many of those were called identified.
    pub wrong_identified: usize,
    /// Everything found, in words.
    pub all: Vec<String>,
    /// Parameters that can be compared, and how many lie within three standard deviations.
    pub within: (usize, usize),
    /// FoldErrors-out error over that of the true structure fitted to the same rows.
    pub over_truth: f64,
    /// The diagnosis.
    pub diagnosed: Diagnosed,
}

/// Starting frames.
pub fn frames(dataset: &Dataset, nominal: &Model) -> Frames {
    candidate_frames(dataset, nominal).unwrap().remove(0)
}

/// Diagnoses a run of `hidden` effects.
pub fn outcome(nominal: &Model, hidden: &[Hidden], setup: &Setup) -> Outcome {
    let run = run(nominal, hidden, setup);
    let frames = frames(&run.dataset, nominal);
    let options = Options::default();
    let diagnosed = diagnose(&run.dataset, "arm", nominal, &frames, &options, &|_| {}).unwrap();
    let subject = Subject {
        observed: &diagnosed.prepared.observed,
        nominal,
        frames: &frames,
        evaluated_at: &frames,
        tolerance: &options.tolerance,
    };
    let lambdas = lambdas(&subject, &diagnosed, &run, setup, hidden.len());
    let findings = &diagnosed.diagnosis.findings;
    let found: Vec<bool> =
        hidden.iter().map(|h| findings.iter().any(|f| matches(h, f, setup.rows))).collect();
    let sure = |f: &&Finding| f.confidence == Confidence::Identified;
    let identified: Vec<bool> =
        hidden.iter().map(|h| findings.iter().filter(sure).any(|f| matches(h, f, setup.rows))).collect();
    let strange: Vec<&Finding> =
        findings.iter().filter(|f| !hidden.iter().any(|h| accounts(h, f, setup.rows, &setup.log))).collect();
    let wrong_identified = strange.iter().copied().filter(|f| sure(f)).count();
    let wrong = strange.into_iter().map(told).collect();
    let mut truth: Vec<Cause> = hidden.iter().filter_map(cause).collect();
    if hidden.iter().any(|h| matches!(h, Hidden::Payload { .. })) {
        let yielding = |joint| Compliance { joint, compliance_rad_per_nm: 0.0 };
        truth.extend([1, 2].map(|joint| Cause::Arm(Effect::JointCompliance(yielding(joint)))));
    }
    let validation = Validation::of(&subject, &diagnosed.set_aside, 0, 10);
    let true_structure = fit(&subject, &truth, FreeParameters::All, Some(&diagnosed.geometric));
    let over_truth = diagnosed.diagnosis.fits.extended.cv_rmse_mm / validation.random_rmse(&true_structure);
    let within = compare(hidden, &diagnosed);
    Outcome {
        hidden: hidden.iter().cloned().zip(lambdas).collect(),
        found,
        identified,
        wrong,
        wrong_identified,
        all: findings.iter().map(told).collect(),
        within,
        over_truth,
        diagnosed,
    }
}

fn told(f: &Finding) -> String {
    let sure = if f.confidence == Confidence::Identified { "" } else { "?" };
    let at = match (&f.joints, f.rows, &f.row_list) {
        (Some(j), ..) => format!(" j{j:?}"),
        (_, Some(r), _) => format!(" r{r:?}"),
        (_, _, Some(list)) => format!(" {} rows", list.len()),
        _ => String::new(),
    };
    format!("{}{sure}{at}", f.effect)
}

/// Whether a finding is true of what was hidden, asked for or not: joints that yield under a load yield under the arm too.
pub fn accounts(hidden: &Hidden, finding: &Finding, rows: usize, log: &Log) -> bool {
    let yields = matches!(hidden, Hidden::Payload { .. })
        && finding.effect == "joint-compliance"
        && matches!(finding.joints.as_deref(), Some([2] | [3]));
    let rounded = log.angle_step_rad.is_some() && finding.effect == "angle-rounding";
    yields || rounded || matches(hidden, finding, rows)
}

/// Name, and joints or rows: rows agree when nineteen of twenty do, outliers when all but one are listed.
pub fn matches(hidden: &Hidden, finding: &Finding, rows: usize) -> bool {
    if finding.effect != hidden.name() {
        return false;
    }
    if let (Hidden::Outliers { list, .. }, Some(found)) = (hidden, &finding.row_list) {
        let missed = list.iter().filter(|i| !found.contains(i)).count();
        let more = found.iter().filter(|i| !list.contains(i)).count();
        return missed <= 1 && more <= 1;
    }
    if let Some(joints) = hidden.joints() {
        return finding.joints.as_ref() == Some(&joints);
    }
    match (hidden.rows(), finding.rows) {
        (Some(a), Some(b)) => {
            let inside = |r: [usize; 2], i: usize| (r[0]..=r[1]).contains(&i);
            let same = (0..rows).filter(|&i| inside(a, i) == inside(b, i)).count();
            same as f64 >= 0.95 * rows as f64
        }
        _ => true,
    }
}

/// The hidden effect as a cause to fit.
pub fn cause(hidden: &Hidden) -> Option<Cause> {
    let rows = |from: usize, to: usize| Profile::Rows { from, to };
    Some(match *hidden {
        Hidden::Compliance { joint, .. } => {
            Cause::Arm(Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 0.0 }))
        }
        Hidden::Bending { joint, .. } => {
            Cause::Arm(Effect::LinkBending(Bending { joint, frame: None, compliance_rad_per_nm: 0.0 }))
        }
        Hidden::Gear { joint, order, .. } => {
            Cause::Arm(Effect::GearEccentricity(Harmonic { joint, order, sine_rad: 0.0, cosine_rad: 0.0 }))
        }
        Hidden::Ratio { joint, .. } => Cause::Arm(Effect::GearRatio(GearRatio { joint, error: 0.0 })),
        Hidden::Coupling { driver, joint, .. } => {
            Cause::Arm(Effect::JointCoupling(Coupling { joint, driver, factor: 0.0 }))
        }
        Hidden::Backlash { joint, .. } => Cause::Arm(Effect::Backlash(Backlash { joint, play_rad: 0.0 })),
        Hidden::Thermal { time_constant_h, .. } => Cause::Arm(Effect::ThermalDrift(Thermal {
            start_h: 0.0,
            growth: 0.0,
            time_constant_h,
            growth_per_k: 0.0,
            reference_c: 20.0,
        })),
        Hidden::Zero { from, to, .. } => Cause::Measurement(Disturbance::new(Kind::Zero, rows(from, to))),
        Hidden::Frame { from, to, .. } => {
            Cause::Measurement(Disturbance::new(Kind::Frame { turning: false }, rows(from, to)))
        }
        Hidden::Tool { from, to, .. } => Cause::Measurement(Disturbance::new(Kind::Target, rows(from, to))),
        Hidden::Drift { time_constant_h, .. } => Cause::Measurement(Disturbance::new(
            Kind::Frame { turning: false },
            Profile::Exponential { time_constant_h, start_h: 0.0 },
        )),
        Hidden::Warm { .. } => Cause::Arm(Effect::ThermalDrift(Thermal {
            start_h: 0.0,
            growth: 0.0,
            time_constant_h: 1e12,
            growth_per_k: 0.0,
            reference_c: 20.0,
        })),
        Hidden::Scale { rows: when, .. } => {
            let profile = when.map_or(Profile::Constant, |[from, to]| rows(from, to));
            Cause::Measurement(Disturbance::new(Kind::Scale, profile))
        }
        Hidden::Sag { .. } => Cause::Measurement(Disturbance::new(Kind::Sag, Profile::Constant)),
        Hidden::Payload { from, to, .. } => Cause::Measurement(Disturbance::new(
            Kind::Load { joints: vec![1, 2], compliance: None },
            rows(from, to),
        )),
        Hidden::Outliers { .. }
        | Hidden::Warp { .. }
        | Hidden::Creep { .. }
        | Hidden::LostCounts { .. }
        | Hidden::Range { .. }
        | Hidden::Depth { .. }
        | Hidden::Droop { .. }
        | Hidden::Twist { .. }
        | Hidden::SideTool { .. }
        | Hidden::Reversal { .. }
        | Hidden::Lens { .. }
        | Hidden::Tilt { .. }
        | Hidden::Wobble { .. }
        | Hidden::LoadedPlay { .. } => {
            return None;
        }
    })
}

/// Non-centralities: each effect's difference in units of noise, projected off links and frames.
fn lambdas(subject: &Subject<'_>, found: &Diagnosed, run: &Run, setup: &Setup, count: usize) -> Vec<f64> {
    let mut still = found.geometric.clone();
    let n = setup.rows;
    let weight = Weight { per_mm: 1.0 / setup.sigma_mm, per_rad: 1.0 };
    still.weights = vec![weight; n];
    still.robust_weight = vec![1.0; n];
    still.problem = CalibrationProblem::new(
        &subject.observed.dataset,
        subject.nominal,
        subject.frames,
        &still.parameters,
        &still.priors,
        &still.weights,
    );
    let design = Design::of(subject, &still);
    (0..count)
        .map(|k| {
            let rotation = still.frames.base_from_sensor.rotation;
            let effect: Vec<f64> = difference(run, k)
                .iter()
                .flat_map(|d| match setup.sensor {
                    Sensor::Cable => vec![d.x / setup.sigma_mm],
                    _ => (rotation * d / setup.sigma_mm).as_slice().to_vec(),
                })
                .collect();
            let effect = DVector::from_vec(effect);
            effect.norm_squared() - (&*design.basis * &effect).norm_squared()
        })
        .collect()
}

/// Parameters of what was found under its right name against the truth.
fn compare(hidden: &[Hidden], found: &Diagnosed) -> (usize, usize) {
    let (mut all, mut within) = (0, 0);
    let mut check = |truth: f64, value: f64, sigma: Option<f64>| {
        if let Some(sigma) = sigma {
            all += 1;
            within += usize::from((value - truth).abs() <= 3.0 * sigma);
        }
    };
    for h in hidden {
        let Some(wanted) = cause(h) else { continue };
        for (index, got) in found.extended.causes.iter().enumerate() {
            let same = match (&wanted, got) {
                (
                    Cause::Arm(Effect::GearEccentricity(a)),
                    Cause::Arm(Effect::GearEccentricity(b) | Effect::GearTransmission(b)),
                ) => a.joint == b.joint && a.order == b.order,
                (Cause::Arm(Effect::ThermalDrift(_) | Effect::JointCompliance(_)), _) => false,
                _ => {
                    wanted.kind() == got.kind()
                        && wanted.joints() == got.joints()
                        && wanted.rows() == got.rows()
                }
            };
            if !same {
                continue;
            }
            let numbers = truegrind_calibration::diagnosis::words::found_parameters(&found.extended, index);
            let sigma = |k: usize| numbers[k].sigma;
            let value = |k: usize| numbers[k].value;
            match h {
                Hidden::Gear { peak_rad, phase, .. } => {
                    check(-peak_rad * phase.sin(), value(0), sigma(0));
                    check(peak_rad * phase.cos(), value(1), sigma(1));
                }
                Hidden::Ratio { error, .. } => check(*error, value(0), sigma(0)),
                Hidden::Coupling { factor, .. } => check(*factor, value(0), sigma(0)),
                Hidden::Backlash { play_rad, .. } => check(*play_rad, value(0), sigma(0)),
                Hidden::Zero { mm, .. } => check(*mm, value(0), sigma(0)),
                Hidden::Frame { mm, .. } | Hidden::Tool { mm, .. } => {
                    (0..3).for_each(|k| check(mm[k], value(k), sigma(k)));
                }
                _ => {}
            }
        }
    }
    (all, within)
}

/// A stream for scenario `number` of a family.
pub fn stream(family: &str, number: u64) -> ChaCha8Rng {
    let mark = family.bytes().fold(17_u64, |sum, b| sum.wrapping_mul(31).wrapping_add(u64::from(b)));
    ChaCha8Rng::seed_from_u64(mark.wrapping_add(number.wrapping_mul(0x9e37_79b9)))
}
