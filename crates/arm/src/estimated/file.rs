//! The model file: an estimated arm as TOML.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::{
    Estimated, EstimatedParameter, ModelFileError, Provenance, SCHEMA, StageErrors, Verdict,
    WidthUncertainty, checks,
};
use crate::arm_file::ArmFile;
use crate::condition::Condition;
use crate::parameter::{LinkCoordinate, Parameter};
use crate::region::Region;

impl Estimated {
    /// The file.
    ///
    /// # Errors
    /// [`ModelFileError::Unwritable`], when a number cannot be written (not finite).
    pub fn to_toml(&self) -> Result<String, ModelFileError> {
        let file = ModelFile {
            schema: SCHEMA.to_owned(),
            robot: self.robot.clone(),
            provenance: self.provenance.clone(),
            verdict: self.verdict.clone(),
            registered: self.registered,
            calibrated: self.calibrated,
            noise_floor_mm: self.noise_floor_mm,
            beyond_noise_mm: self.beyond_noise_mm,
            beyond_noise_rad: self.beyond_noise_rad,
            region: self.region.clone(),
            condition: self.condition,
            nominal: ArmFile::from(&self.nominal),
            estimated: ArmFile::from(&self.model),
            covariance: CovarianceFile {
                order: self.order.iter().map(ToString::to_string).collect(),
                lower: (0..self.order.len())
                    .map(|i| (0..=i).map(|j| self.covariance[(i, j)]).collect())
                    .collect(),
            },
            width_uncertainty: self.width_uncertainty,
            parameter: self.parameters.clone(),
        };
        let text = toml::to_string(&file).map_err(|e| ModelFileError::Unwritable(e.to_string()))?;
        Ok(format!("# An estimated arm, written by truegrind {}.\n{text}", self.provenance.version))
    }

    /// The hash of a model file by which corrected programs name it: the first twelve hex digits of the SHA-256.
    pub fn file_hash(text: &str) -> String {
        let mut hash = truegrind_math::digest::sha256(text.as_bytes());
        hash.truncate(12);
        hash
    }

    /// Reads the file. Every number is finite and such as an arm has, the covariance is positive semi-definite, and the
    /// parameters are the arm's.
    ///
    /// ```
    /// # use nalgebra::DMatrix;
    /// use truegrind_arm::estimated::{Estimated, ModelFileError};
    /// # use truegrind_arm::estimated::{Judgement, Provenance, StageErrors, Verdict};
    /// # use truegrind_arm::{condition::Condition, model::Joints, region::Region, robots};
    /// # use truegrind_math::statistics::ErrorSummary;
    /// # let nominal = robots::load("abb-irb-120")?.model;
    /// # let summary = ErrorSummary::of([0.1, -0.2]);
    /// # let stage = StageErrors { fitted: summary, held_out: summary };
    /// # let arm = Estimated {
    /// #     robot: "abb-irb-120".into(),
    /// #     nominal: nominal.clone(),
    /// #     model: nominal,
    /// #     parameters: Vec::new(),
    /// #     order: Vec::new(),
    /// #     covariance: DMatrix::zeros(0, 0),
    /// #     width_uncertainty: None,
    /// #     provenance: Provenance::default(),
    /// #     registered: stage,
    /// #     calibrated: stage,
    /// #     noise_floor_mm: None,
    /// #     beyond_noise_mm: None,
    /// #     beyond_noise_rad: None,
    /// #     verdict: Verdict { status: Judgement::NotEvaluated, reasons: Vec::new() },
    /// #     region: Region::of(&[Joints::zeros(), Joints::repeat(0.5)], 0.1),
    /// #     condition: Condition::default(),
    /// # };
    /// let text = arm.to_toml()?;
    /// assert_eq!(Estimated::from_toml(&text)?.verdict, arm.verdict);
    ///
    /// // A number that no arm has is refused under its key, before anything is computed with it.
    /// let error = Estimated::from_toml(&text.replacen("a_mm = 270.0", "a_mm = nan", 1)).err().ok_or("NaN passed")?;
    /// assert_eq!(
    ///     error.to_string(),
    ///     "`nominal`: link 2 a_mm: found NaN, expected a finite length in mm, within ±10,000"
    /// );
    /// let other = Estimated::from_toml(&text.replacen("truegrind.model/1", "truegrind.model/9", 1));
    /// assert_eq!(other, Err(ModelFileError::Schema { found: "truegrind.model/9".into() }));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelFileError`] says what in the file cannot be used: key, what was found, what was expected.
    pub fn from_toml(text: &str) -> Result<Self, ModelFileError> {
        let file: ModelFile =
            truegrind_math::toml_text::read(text).map_err(|e| ModelFileError::Syntax(e.to_string()))?;
        if file.schema != SCHEMA {
            return Err(ModelFileError::Schema { found: file.schema });
        }
        let order = file
            .covariance
            .order
            .iter()
            .map(|name| {
                parse_arm_parameter(name)
                    .ok_or_else(|| ModelFileError::UnknownParameter { name: name.clone() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let n = order.len();
        if file.covariance.lower.len() != n
            || file.covariance.lower.iter().enumerate().any(|(i, r)| r.len() != i + 1)
        {
            return Err(ModelFileError::Triangle { expected: n });
        }
        let covariance = DMatrix::from_fn(n, n, |i, j| file.covariance.lower[i.max(j)][i.min(j)]);
        let model = Self {
            robot: file.robot,
            nominal: file.nominal.model().map_err(|fault| ModelFileError::Arm { part: "nominal", fault })?,
            model: file
                .estimated
                .model()
                .map_err(|fault| ModelFileError::Arm { part: "estimated", fault })?,
            parameters: file.parameter,
            order,
            covariance,
            width_uncertainty: file.width_uncertainty,
            provenance: file.provenance,
            registered: file.registered,
            calibrated: file.calibrated,
            noise_floor_mm: file.noise_floor_mm,
            beyond_noise_mm: file.beyond_noise_mm,
            beyond_noise_rad: file.beyond_noise_rad,
            verdict: file.verdict,
            region: file.region,
            condition: file.condition,
        };
        checks::check(&model)?;
        Ok(model)
    }
}

/// Reads `link2.alpha` or `effect1.2`.
fn parse_arm_parameter(name: &str) -> Option<Parameter> {
    let (part, coordinate) = name.split_once('.')?;
    if let Some(number) = part.strip_prefix("effect") {
        let index = number.parse::<usize>().ok()?.checked_sub(1)?;
        return Some(Parameter::Effect {
            index,
            parameter: coordinate.parse::<usize>().ok()?.checked_sub(1)?,
        });
    }
    let joint = part.strip_prefix("link")?.parse::<usize>().ok()?.checked_sub(1).filter(|j| *j < 6)?;
    let coordinate = match coordinate {
        "a" => LinkCoordinate::A,
        "d" => LinkCoordinate::D,
        "alpha" => LinkCoordinate::Alpha,
        "theta" => LinkCoordinate::Theta,
        "beta" => LinkCoordinate::Beta,
        _ => return None,
    };
    Some(Parameter::Link { joint, coordinate })
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    schema: String,
    robot: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    noise_floor_mm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    beyond_noise_mm: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    beyond_noise_rad: Option<[f64; 6]>,
    provenance: Provenance,
    verdict: Verdict,
    condition: Condition,
    registered: StageErrors,
    #[serde(rename = "geometry")]
    calibrated: StageErrors,
    region: Region,
    nominal: ArmFile,
    estimated: ArmFile,
    covariance: CovarianceFile,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    width_uncertainty: Option<WidthUncertainty>,
    parameter: Vec<EstimatedParameter>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CovarianceFile {
    order: Vec<String>,
    lower: Vec<Vec<f64>>,
}
