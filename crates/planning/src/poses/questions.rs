//! Ambiguous findings of a diagnosis, and the effects that a further measurement must separate.
//!
//! Reads `truegrind.diagnosis/1`. An ambiguous finding becomes a question: its effect and its alternatives become
//! parameters besides the geometry, and the design prefers poses that distinguish them. Effects that depend on the order
//! or the approach of the rows (backlash, drift, a moved sensor) require additional visits.

use serde::Deserialize;
use thiserror::Error;

use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::effect::bending::Bending;
use truegrind_arm::effect::compliance::Compliance;
use truegrind_arm::effect::coupling::Coupling;
use truegrind_arm::effect::gear_ratio::GearRatio;
use truegrind_arm::effect::harmonic::Harmonic;
use truegrind_arm::effect::thermal::Thermal;
use truegrind_arm::parameter::Parameter;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::finding::{Confidence, FoundParameter, SCHEMA};
use truegrind_calibration::diagnosis::something_else::SomethingElse;

/// A candidate cause.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct CandidateCause {
    /// Its kind.
    pub effect: CauseKind,
    /// Joints, 0-based; empty for an effect without a joint.
    pub joints: Vec<usize>,
}

/// An ambiguous finding with its alternative causes.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// The finding, then its alternatives; a single cause for an effect that could not be tested.
    pub causes: Vec<CandidateCause>,
    /// The found parameters of the finding's effects, where the diagnosis states them.
    pub size: Option<Vec<f64>>,
}

/// Why a diagnosis file cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum DiagnosisFileError {
    /// Not JSON, or a key that is missing or of the wrong type.
    #[error("not a diagnosis: {0}")]
    Syntax(String),
    /// A file of another kind or version.
    #[error("`schema` is \"{found}\", expected \"{SCHEMA}\"")]
    Schema {
        /// Stated schema.
        found: String,
    },
    /// No open finding has the number.
    #[error(
        "finding {number} is not open: expected the number of an ambiguous finding, as in the report ({open})"
    )]
    Finding {
        /// The stated number.
        number: usize,
        /// The open ones, in words.
        open: String,
    },
}

/// A frame or offset of the measurement that is in question.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FramePart {
    /// A cable's zero.
    Zero,
    /// The sensor's frame or outlet.
    Sensor,
    /// The touched point.
    Touched,
}

impl FramePart {
    /// Whether a parameter belongs to it.
    pub fn contains(self, parameter: &Parameter) -> bool {
        match parameter {
            Parameter::Zero { .. } => self == FramePart::Zero,
            Parameter::SensorFrame(_) | Parameter::Outlet { .. } => self == FramePart::Sensor,
            Parameter::Target(_) => self == FramePart::Touched,
            _ => false,
        }
    }
}

/// The keys that are read from the file. A diagnosis always writes them, so all are required.
#[derive(Deserialize)]
struct File {
    findings: Vec<Finding>,
    not_testable: Vec<Named>,
    // Only where part of the residual has no cause; unknown to older files.
    #[serde(default)]
    something_else: Option<SomethingElse>,
}

#[derive(Deserialize)]
struct Kind {
    schema: String,
}

#[derive(Deserialize)]
struct Finding {
    effect: CauseKind,
    confidence: Confidence,
    joints: Option<Vec<usize>>,
    alternatives: Vec<Named>,
    // Unknown to files that others write.
    #[serde(default)]
    parameters: Vec<FoundParameter>,
}

#[derive(Deserialize)]
struct Named {
    effect: CauseKind,
    #[serde(default)]
    joints: Option<Vec<usize>>,
}

fn cause(effect: CauseKind, joints: Option<&Vec<usize>>) -> Result<CandidateCause, DiagnosisFileError> {
    let joints = joints.into_iter().flatten().map(|&joint| match joint {
        1..=6 => Ok(joint - 1),
        _ => Err(DiagnosisFileError::Syntax(format!("{effect}: joints: found {joint}, expected 1 to 6"))),
    });
    Ok(CandidateCause { effect, joints: joints.collect::<Result<_, _>>()? })
}

/// What a diagnosis left open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Open {
    /// Causes to tell apart.
    pub questions: Vec<Question>,
    /// What no cause explains.
    pub something_else: Option<SomethingElse>,
    /// Whether it is a joint that stands elsewhere from reading to reading: repeated readings from either side tell why.
    pub joint_scatters: bool,
}

/// The robot of a diagnosis, as its file names it.
pub fn robot_of(text: &str) -> Option<String> {
    let diagnosis: serde_json::Value = serde_json::from_str(text).ok()?;
    diagnosis["dataset"]["robot"].as_str().map(str::to_owned)
}

/// What a diagnosis left open: everything, or only the finding with a number (from 1, as in the report).
///
/// # Errors
/// [`DiagnosisFileError`] if the text is not a diagnosis, or if that finding is not open.
pub fn open(text: &str, number: Option<usize>) -> Result<Open, DiagnosisFileError> {
    let File { findings, something_else, .. } = file(text)?;
    let unexplained =
        |finding: &Finding| finding.effect == CauseKind::Unexplained && something_else.is_some();
    let Some(number) = number else {
        return Ok(Open { questions: questions(text)?, something_else, joint_scatters: false });
    };
    let is_open = |finding: &Finding| finding.confidence == Confidence::Ambiguous;
    let Some(finding) = number.checked_sub(1).and_then(|k| findings.get(k)).filter(|f| is_open(f)) else {
        let open: Vec<String> = (1..)
            .zip(&findings)
            .filter(|(_, finding)| is_open(finding))
            .map(|(k, finding)| format!("{k}: {}", finding.effect))
            .collect();
        let open = if open.is_empty() { "none is open".to_owned() } else { open.join(", ") };
        return Err(DiagnosisFileError::Finding { number, open });
    };
    if finding.effect == CauseKind::Unexplained && finding.joints.is_some() {
        return Ok(Open { joint_scatters: true, ..Open::default() });
    }
    if unexplained(finding) {
        return Ok(Open { something_else, ..Open::default() });
    }
    Ok(Open { questions: vec![finding.question()?], ..Open::default() })
}

impl Finding {
    /// The finding and its alternatives.
    fn question(&self) -> Result<Question, DiagnosisFileError> {
        let first = cause(self.effect, self.joints.as_ref())?;
        let others = self.alternatives.iter().map(|other| cause(other.effect, other.joints.as_ref()));
        let others = others.collect::<Result<Vec<_>, _>>()?;
        let size: Vec<f64> = self.parameters.iter().map(|parameter| parameter.value).collect();
        Ok(Question {
            causes: std::iter::once(first).chain(others).collect(),
            size: (!size.is_empty()).then_some(size),
        })
    }
}

/// The keys of a diagnosis.
fn file(text: &str) -> Result<File, DiagnosisFileError> {
    let fault = |error: serde_json::Error| DiagnosisFileError::Syntax(error.to_string());
    let Kind { schema } = serde_json::from_str(text).map_err(fault)?;
    if schema != SCHEMA {
        return Err(DiagnosisFileError::Schema { found: schema });
    }
    serde_json::from_str(text).map_err(fault)
}

/// The causes that a diagnosis left open: ambiguous findings with their alternatives, and effects that were not testable.
///
/// ```
/// use truegrind_planning::poses::questions::{DiagnosisFileError, questions};
///
/// let diagnosis = r#"{"schema": "truegrind.diagnosis/1", "findings": [
///     {"effect": "gear-ratio", "joints": [4], "confidence": "identified", "alternatives": []},
///     {"effect": "backlash", "joints": [2], "confidence": "ambiguous", "alternatives": [{"effect": "thermal-drift"}]}
/// ], "not_testable": []}"#;
/// let asked = questions(diagnosis)?;
/// assert_eq!(asked.len(), 1);
/// assert_eq!(asked[0].causes[0].joints, [1]);
/// assert_eq!(asked[0].causes[1].effect, "thermal-drift");
/// assert_eq!(questions(r#"{"schema": "other/1"}"#), Err(DiagnosisFileError::Schema { found: "other/1".into() }));
/// # Ok::<(), DiagnosisFileError>(())
/// ```
///
/// # Errors
/// [`DiagnosisFileError`] if the text is not a diagnosis.
pub fn questions(text: &str) -> Result<Vec<Question>, DiagnosisFileError> {
    let file = file(text)?;
    let mut out = Vec::new();
    for finding in &file.findings {
        // An unambiguous finding is no question, but must be valid.
        let question = finding.question()?;
        if finding.confidence == Confidence::Ambiguous && finding.effect != CauseKind::Unexplained {
            out.push(question);
        }
    }
    for untested in &file.not_testable {
        out.push(Question { causes: vec![cause(untested.effect, untested.joints.as_ref())?], size: None });
    }
    Ok(out)
}

/// The effects of that name at size zero; none for effects of the measurement.
pub fn effects_of(cause: &CandidateCause) -> Vec<Effect> {
    // Without a named joint: those loaded by gravity.
    let joints: &[usize] = if cause.joints.is_empty() { &[1, 2] } else { &cause.joints };
    let each = |make: fn(usize) -> Effect| joints.iter().map(|&j| make(j)).collect();
    match cause.effect {
        CauseKind::JointCompliance => {
            each(|joint| Effect::JointCompliance(Compliance { joint, compliance_rad_per_nm: 0.0 }))
        }
        CauseKind::LinkBending => each(|joint| {
            Effect::LinkBending(Bending { joint: joint.min(4), frame: None, compliance_rad_per_nm: 0.0 })
        }),
        CauseKind::GearEccentricity => {
            joints.iter().flat_map(|&j| [harmonic(j, 1.0), harmonic(j, 2.0)]).collect()
        }
        CauseKind::GearRatio => each(|joint| Effect::GearRatio(GearRatio { joint, error: 0.0 })),
        CauseKind::JointCoupling => match *joints {
            [joint, driver, ..] if joint != driver => vec![coupling(joint, driver)],
            [joint] => vec![coupling(joint, if joint == 0 { 1 } else { joint - 1 })],
            _ => Vec::new(),
        },
        CauseKind::Backlash => each(|joint| Effect::Backlash(Backlash { joint, play_rad: 0.0 })),
        CauseKind::ThermalDrift => vec![thermal()],
        _ => Vec::new(),
    }
}

/// One harmonic of one joint, of size zero.
pub(super) fn harmonic(joint: usize, order: f64) -> Effect {
    Effect::GearEccentricity(Harmonic { joint, order, sine_rad: 0.0, cosine_rad: 0.0 })
}

/// A coupling of size zero.
pub(super) fn coupling(joint: usize, driver: usize) -> Effect {
    Effect::JointCoupling(Coupling { joint, driver, factor: 0.0 })
}

/// Thermal drift over time, of size zero; half an hour is a typical time constant.
pub(super) fn thermal() -> Effect {
    Effect::ThermalDrift(Thermal {
        growth: 0.0,
        time_constant_h: 0.5,
        start_h: 0.0,
        growth_per_k: 0.0,
        reference_c: 20.0,
    })
}

/// The frame parameters of a sensor effect that poses can determine.
fn frame_part(effect: CauseKind) -> Option<FramePart> {
    match effect {
        CauseKind::SensorZeroShift => Some(FramePart::Zero),
        CauseKind::SensorFrameShift => Some(FramePart::Sensor),
        CauseKind::ToolShift => Some(FramePart::Touched),
        _ => None,
    }
}

/// Parameters of the questions that poses can determine: effects to be added, and frames.
pub(super) fn columns_of(questions: &[Question]) -> (Vec<Effect>, Vec<FramePart>) {
    let (mut effects, mut frames): (Vec<Effect>, Vec<FramePart>) = (Vec::new(), Vec::new());
    for cause in questions.iter().flat_map(|q| &q.causes) {
        for effect in effects_of(cause) {
            // Candidates have neither time nor approach direction.
            let by_order = matches!(effect, Effect::Backlash(_) | Effect::ThermalDrift(_));
            if !by_order && !effects.contains(&effect) {
                effects.push(effect);
            }
        }
        if let Some(frame) = frame_part(cause.effect)
            && !frames.contains(&frame)
        {
            frames.push(frame);
        }
    }
    (effects, frames)
}

/// Whether a question is about this effect.
pub(super) fn any_about(questions: &[Question], effect: CauseKind) -> bool {
    questions.iter().flat_map(|q| &q.causes).any(|s| s.effect == effect)
}
