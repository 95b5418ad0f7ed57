//! The result of a diagnosis: the JSON contract `truegrind.diagnosis/1`.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::cause_kind::CauseKind;
use super::something_else::SomethingElse;

use crate::identification::identify::IdentifyError;
use truegrind_arm::estimated::Verdict;
use truegrind_arm::sensor::Sensor;

/// Name and version of the JSON form.
pub const SCHEMA: &str = "truegrind.diagnosis/1";

/// The rows that were diagnosed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosedRows {
    /// File.
    pub file: String,
    /// Rows.
    pub rows: usize,
    /// Sensor.
    pub sensor: Sensor,
    /// Robot by name.
    pub robot: String,
    /// Rows set aside as outliers: left out of both held-out errors.
    pub set_aside: usize,
}

/// Errors of one stage (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// On the rows of the fit.
    pub rmse_mm: f64,
    /// Mean size.
    pub mean_mm: f64,
    /// Largest.
    pub max_mm: f64,
    /// Held out, five random folds.
    pub cv_rmse_mm: f64,
    /// Held out, contiguous blocks.
    pub cv_blocks_rmse_mm: f64,
    /// Held out, eight regions of joint space.
    pub cv_regions_rmse_mm: f64,
}

/// The three stages.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fits {
    /// Frames fitted, links of the data sheet.
    pub nominal: Stage,
    /// Links freed.
    pub geometric: Stage,
    /// Findings added.
    pub extended: Stage,
}

/// Confidence in a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Confidence {
    /// It clearly beats all rivals and is confirmed by stability selection.
    Identified,
    /// A rival explains nearly as much.
    Ambiguous,
}

/// A number of a finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FoundParameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation; absent for numbers that are not estimates.
    pub sigma: Option<f64>,
    /// Unit.
    pub unit: String,
}

/// Held-out error without and with the finding, everything else in the model (mm).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// Without.
    pub cv_rmse_before_mm: f64,
    /// With.
    pub cv_rmse_after_mm: f64,
}

/// Branches of the tree of causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Links, springs and warmth of the arm.
    Arm,
    /// Gears, play and couplings.
    Drive,
    /// The sensor, its cable, beam or target.
    Sensor,
    /// What stood or hung somewhere else than was assumed: stand, target, load.
    SetUp,
    /// The record: time, rounding, rows.
    Log,
}

impl Family {
    /// Its name in sentences.
    pub fn words(self) -> &'static str {
        match self {
            Family::Arm => "arm",
            Family::Drive => "drive",
            Family::Sensor => "sensor",
            Family::SetUp => "set-up",
            Family::Log => "log",
        }
    }
}

/// One of the causes that cannot be told apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Its kind.
    pub effect: CauseKind,
    /// Its joints, from 1.
    pub joints: Option<Vec<usize>>,
    /// Its rows.
    pub rows: Option<[usize; 2]>,
    /// Its branch.
    pub family: Family,
    /// Its share of the evidence if exactly one of the members is true and each was as likely before. Not calibrated: no probability.
    pub share: f64,
}

/// A rival cause that was fitted in place of the finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alternative {
    /// Its kind.
    pub effect: CauseKind,
    /// Its joints, from 1.
    pub joints: Option<Vec<usize>>,
    /// Its rows.
    pub rows: Option<[usize; 2]>,
    /// Its branch of the tree of causes.
    pub family: Family,
    /// Held-out error with it in the finding's place (mm).
    pub cv_rmse_mm: f64,
    /// Twice the log Bayes factor of the finding against it.
    #[serde(rename = "beaten_by")]
    pub twice_log_bayes_factor: f64,
}

/// Rows in which the set-up was displaced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Rows as the data set numbers them, both ends included.
    pub rows: [usize; 2],
    /// Kind of a shift of these rows alone.
    pub effect: CauseKind,
    /// The same in a sentence.
    pub cause: String,
    /// What shifted, without its rows and what may have done it; absent in files.
    #[serde(skip)]
    pub shift: Option<String>,
    /// Contribution to the readings (mm RMS over all rows).
    pub worth_mm: f64,
}

/// A finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Its kind.
    pub effect: CauseKind,
    /// One sentence for a technician.
    pub cause: String,
    /// The parts of `cause` where it is a list of several; absent in files.
    #[serde(skip)]
    pub terms: Vec<String>,
    /// What shifted, without its rows and what may have done it, where some rows were displaced; absent in files.
    #[serde(skip)]
    pub shift: Option<String>,
    /// Confidence.
    pub confidence: Confidence,
    /// Rows as the data set numbers them, both ends included; the JSON that `diagnose` writes counts data rows from 0.
    pub rows: Option<[usize; 2]>,
    /// Single rows, of outliers and contradicting rows.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub row_list: Option<Vec<usize>>,
    /// `rows` or `row_list` as the file numbers them and the sentences name them; only in the JSON that `diagnose` writes.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub rows_in_file: Option<Vec<usize>>,
    /// Joints, from 1 as on the teach pendant.
    pub joints: Option<Vec<usize>>,
    /// Its numbers.
    pub parameters: Vec<FoundParameter>,
    /// The pattern that showed it, with its statistic.
    pub evidence: String,
    /// p-value, corrected for all trials.
    pub p_value: f64,
    /// Non-centrality of the estimate with everything else free: below some 40 it could have been missed.
    pub non_centrality: Option<f64>,
    /// Held-out errors without and with it.
    pub gain: Gain,
    /// The part of the readings that nothing else in the model explains (mm RMS over all rows), where applicable.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worth_mm: Option<f64>,
    /// Reasons why it is not identified, apart from the alternatives.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<String>,
    /// The displacements of a set-up that changed with time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<Session>,
    /// Its branch of the tree of causes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<Family>,
    /// Twice the log Bayes factor against its best rival with smooth unmodelled trends in time and pose allowed for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin: Option<f64>,
    /// The causes that cannot be told apart, this one included, with their shares, largest first; empty for an identified finding.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub members: Vec<Member>,
    /// The measurement that decides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decided_by: Option<String>,
    /// Whether the written arm has it, so that `compensate` corrects it; absent for causes of the measurement.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corrected: Option<bool>,
    /// Rivals, best first.
    pub alternatives: Vec<Alternative>,
    /// Recommended action in the workshop.
    pub remedy: String,
}

/// An effect that these rows cannot detect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NotTestable {
    /// Its kind.
    pub effect: CauseKind,
    /// Joints, from 1, if only some are undetectable.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub joints: Option<Vec<usize>>,
    /// Why.
    pub reason: String,
    /// A measurement that would detect it.
    pub remedy: String,
}

/// Noise that grows with range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RangeNoise {
    /// At range 0 (mm).
    pub sigma_mm: f64,
    /// Growth (mm per metre).
    pub per_metre_mm: f64,
    /// p-value.
    pub p_value: f64,
}

/// One step from the data sheet to the extended model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// What was added.
    pub added: String,
    /// Held-out error after it (mm), five random folds.
    pub cv_rmse_mm: f64,
}

/// Errors of the models on another series of the same arm, with only the frames refitted: RMSE (mm).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Transfer {
    /// File.
    pub file: String,
    /// Rows.
    pub rows: usize,
    /// Data sheet.
    pub nominal_rmse_mm: f64,
    /// Geometry of this diagnosis.
    pub geometric_rmse_mm: f64,
    /// Extended model of this diagnosis.
    pub extended_rmse_mm: f64,
    /// The arm that this diagnosis writes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub written_rmse_mm: Option<f64>,
}

/// A diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// [`SCHEMA`].
    pub schema: String,
    /// The rows.
    pub dataset: DiagnosedRows,
    /// The verdict on the extended model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Noise floor of sensor and rounding (mm), if known.
    pub noise_floor_mm: Option<f64>,
    /// Source of the noise floor.
    pub noise_floor_source: NoiseFloorSource,
    /// Errors of the stages.
    pub fits: Fits,
    /// Held-out error after each step.
    pub steps: Vec<Step>,
    /// The findings.
    pub findings: Vec<Finding>,
    /// Effects that the data cannot detect.
    pub not_testable: Vec<NotTestable>,
    /// The residual that the extended model does not explain.
    pub remaining: Option<String>,
    /// What a planner needs to know of the part that no cause explains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub something_else: Option<SomethingElse>,
    /// Noise that grows with range.
    pub noise_model: Option<RangeNoise>,
    /// Rows to measure again, as the data set numbers them.
    pub measure_again: Vec<usize>,
    /// Distinct poses required to separate causes from geometry; absent if there are enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses_needed: Option<usize>,
    /// The models on other series of the same arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub transfers: Vec<Transfer>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl Finding {
    /// The likeliest of the causes that cannot be told apart, with its joints and rows; of a finding without others its own.
    pub fn likeliest(&self) -> (CauseKind, Option<&[usize]>, Option<[usize; 2]>) {
        match self.members.first() {
            Some(member) => (member.effect, member.joints.as_deref(), member.rows),
            None => (self.effect, self.joints.as_deref(), self.rows),
        }
    }
}

/// Errors of a diagnosis.
pub type DiagnoseError = IdentifyError;

impl Diagnosis {
    /// Whether part of the residual has no cause in the catalogue.
    pub fn is_partly_unexplained(&self) -> bool {
        self.findings.iter().any(|finding| finding.effect == CauseKind::Unexplained)
            || self.times_the_noise().is_some()
    }

    /// How many times the noise floor the error of the extended model is, where that is too much for noise.
    pub fn times_the_noise(&self) -> Option<f64> {
        let fits = &self.fits.extended;
        // Of few rows the held-out error is large because the parameters are uncertain, not the readings.
        let error_mm = fits.cv_rmse_mm.min(fits.rmse_mm);
        let floor_mm = self.noise_and_rounding_mm().filter(|_| self.poses_needed.is_none())?;
        too_much_for_noise(error_mm, floor_mm, self.is_noise_measured()).then(|| fits.cv_rmse_mm / floor_mm)
    }

    /// The noise floor with the rounding of the log beside it, where that is a finding: repeated poses are rounded alike, so that their
    /// scatter has none of it.
    pub fn noise_and_rounding_mm(&self) -> Option<f64> {
        let floor_mm = self.noise_floor_mm?;
        Some(
            self.rounding_mm().filter(|_| self.is_noise_measured()).map_or(floor_mm, |mm| mm.hypot(floor_mm)),
        )
    }

    /// What a log that rounds the joint angles leaves in the readings (mm RMS), where that is a finding.
    pub fn rounding_mm(&self) -> Option<f64> {
        self.findings.iter().find(|finding| finding.effect == CauseKind::AngleRounding)?.worth_mm
    }

    /// Whether poses were repeated, so that the noise floor is that of the sensor and not of rounding alone.
    pub fn is_noise_measured(&self) -> bool {
        self.noise_floor_source != NoiseFloorSource::RoundingAlone
    }
}

impl Finding {
    /// Adds a part to the list that its cause is.
    pub(super) fn add_term(&mut self, term: String) {
        if self.terms.is_empty() {
            self.terms.push(self.cause.clone());
        }
        self.terms.push(term);
        self.cause = self.terms.join("; ");
    }

    /// Makes its cause a list of several parts.
    pub(super) fn set_terms(&mut self, terms: Vec<String>) {
        self.cause = terms.join("; ");
        self.terms = terms;
    }
}

/// What a noise floor is known from. In files it is its sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum NoiseFloorSource {
    /// The scatter of repeated poses.
    Repeats {
        /// Repeated poses.
        poses: usize,
        /// Their degrees of freedom.
        freedom: usize,
    },
    /// The rounding of the log, which is no noise of the sensor.
    RoundingAlone,
    /// Nothing.
    Unknown,
}

/// Sentences of sources without numbers.
const ROUNDING_ALONE: &str = "rounding alone; too few poses were repeated";
const UNKNOWN: &str = "too few poses were repeated and nothing is rounded";

impl fmt::Display for NoiseFloorSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoiseFloorSource::Repeats { poses, freedom } => {
                write!(f, "{poses} repeated poses, {freedom} degrees of freedom")
            }
            NoiseFloorSource::RoundingAlone => f.write_str(ROUNDING_ALONE),
            NoiseFloorSource::Unknown => f.write_str(UNKNOWN),
        }
    }
}

impl From<NoiseFloorSource> for String {
    fn from(source: NoiseFloorSource) -> Self {
        source.to_string()
    }
}

impl TryFrom<String> for NoiseFloorSource {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let repeats = || {
            let (poses, rest) = text.split_once(" repeated poses, ")?;
            let freedom = rest.strip_suffix(" degrees of freedom")?;
            Some(NoiseFloorSource::Repeats { poses: poses.parse().ok()?, freedom: freedom.parse().ok()? })
        };
        match text.as_str() {
            ROUNDING_ALONE => Ok(NoiseFloorSource::RoundingAlone),
            UNKNOWN => Ok(NoiseFloorSource::Unknown),
            _ => repeats().ok_or_else(|| format!("{text:?} is no source of a noise floor")),
        }
    }
}

/// Multiple of the noise floor from which an error is not taken for noise.
const NOISE_FLOORS_OF_AN_ERROR: f64 = 3.0;

/// Where only rounding is known, the error (mm) that is still taken for noise of the sensor: several times that of a laser tracker or a
/// camera.
const NOISE_OF_A_SENSOR_MM: f64 = 0.15;

/// Whether an error is too large for noise of sensor and arm; `measured`: by repeated poses.
pub(super) fn too_much_for_noise(error_mm: f64, floor_mm: f64, measured: bool) -> bool {
    error_mm > NOISE_FLOORS_OF_AN_ERROR * floor_mm && (measured || error_mm > NOISE_OF_A_SENSOR_MM)
}
