//! Load and temperature of the arm while a program runs, as its user states them.

use std::ops::RangeInclusive;

use thiserror::Error;

use super::other_load::is_other_load;
use super::overload::{overload, rated_payload_kg};
use super::warmth::growth_per_k;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;

/// Payloads above this are typing errors (kg).
const MAX_PAYLOAD_KG: f64 = 3000.0;

/// Temperatures of an arm; others are typing errors (°C).
const TEMPERATURES_C: RangeInclusive<f64> = -40.0..=120.0;

/// What is stated; the rest is as in the measurement, and the program's own loads count where no payload is stated.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StatedCondition {
    /// Mass at the flange (kg).
    pub payload_kg: Option<f64>,
    /// Its centre of mass in the flange frame (mm).
    pub payload_centre_mm: Option<[f64; 3]>,
    /// Temperature of the arm (°C).
    pub temperature_c: Option<f64>,
}

/// Why a stated condition cannot be used. Messages name the options of the command line.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConditionError {
    /// No payload of a robot.
    #[error("--payload {found}: expected a mass in kg, from 0 to {MAX_PAYLOAD_KG}")]
    Payload {
        /// The stated mass.
        found: f64,
    },
    /// A centre without a mass.
    #[error("--payload-centre needs --payload")]
    CentreAlone,
    /// The deflection of the arm was identified for one load alone.
    #[error(
        "--payload {found}: the masses of {robot} are not known, so its deflection was identified for the load of the measurement ({measured_kg} \
         kg) and follows no other: measure with {found} kg on the flange, or omit --payload and accept the error from the different load"
    )]
    OtherLoad {
        /// The stated mass.
        found: f64,
        /// The robot.
        robot: String,
        /// The load of the measurement (kg).
        measured_kg: f64,
    },
    /// No temperature of an arm.
    #[error(
        "--temperature {found}: expected the temperature of the arm in °C, from {} to {}", TEMPERATURES_C.start(), TEMPERATURES_C.end()
    )]
    Temperature {
        /// The stated temperature.
        found: f64,
    },
    /// The model does not depend on the temperature.
    #[error(
        "--temperature {found}: the model does not say how the arm grows per kelvin: measure it cold and warm, with its temperature in the \
         column `temperature`, or omit --temperature"
    )]
    NoGrowth {
        /// The stated temperature.
        found: f64,
    },
}

impl StatedCondition {
    /// The condition of a run on the arm `model`; without a model, that of an arm of which nothing is known.
    ///
    /// # Errors
    /// [`ConditionError`].
    pub fn on(&self, model: Option<&Estimated>) -> Result<Condition, ConditionError> {
        let mut condition = model.map(|model| model.condition).unwrap_or_default();
        if let Some(found) = self.payload_kg {
            if !(0.0..=MAX_PAYLOAD_KG).contains(&found) {
                return Err(ConditionError::Payload { found });
            }
            if let Some(model) = model.filter(|model| is_other_load(found, model)) {
                let measured_kg = model.condition.payload_kg.unwrap_or(0.0);
                return Err(ConditionError::OtherLoad { found, robot: model.robot.clone(), measured_kg });
            }
            condition.payload_kg = Some(found);
        }
        if let Some(centre) = self.payload_centre_mm {
            if self.payload_kg.is_none() {
                return Err(ConditionError::CentreAlone);
            }
            condition.payload_centre_mm = centre;
        }
        if let Some(found) = self.temperature_c {
            if !TEMPERATURES_C.contains(&found) {
                return Err(ConditionError::Temperature { found });
            }
            if model.is_some_and(|model| growth_per_k(model).is_none()) {
                return Err(ConditionError::NoGrowth { found });
            }
            condition.temperature_c = Some(found);
        }
        Ok(condition)
    }

    /// A note on a payload above the rated one: perhaps it is in another unit.
    pub fn overload_note(&self, model: Option<&Estimated>) -> Option<String> {
        let (kg, robot) = (self.payload_kg?, &model?.robot);
        let rated = rated_payload_kg(robot).filter(|rated| kg > *rated)?;
        Some(format!("--payload {kg}: {}", overload(kg, robot, rated)))
    }
}
