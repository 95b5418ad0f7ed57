//! Keywords that state sensor and target.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use truegrind::Pose;
use truegrind::calibration::identification::stated_placement::StatedPlacement;

use crate::errors::Refusal;
use crate::fits::positive;

/// A pose: x, y, z (mm), or x, y, z, qw, qx, qy, qz.
fn pose(name: &str, numbers: &[f64]) -> Result<Pose, Refusal> {
    let expected = "x, y, z (mm), or x, y, z, qw, qx, qy, qz of a unit quaternion";
    let wrong = || Refusal::argument(name, format!("{numbers:?}"), expected);
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err(wrong());
    }
    match *numbers {
        [x, y, z] => Ok(Pose::translation(x, y, z)),
        [x, y, z, w, i, j, k] => {
            let turn = Quaternion::new(w, i, j, k);
            if !((turn.norm() - 1.0).abs() <= 0.01) {
                return Err(wrong());
            }
            Ok(Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::from_quaternion(turn)))
        }
        _ => Err(wrong()),
    }
}

/// Finite numbers.
fn finite(name: &str, numbers: Vec<f64>) -> Result<Vec<f64>, Refusal> {
    match numbers.iter().find(|number| !number.is_finite()) {
        Some(number) => Err(Refusal::argument(name, number, "a length in mm")),
        None => Ok(numbers),
    }
}

/// Sensor and target as keywords.
#[derive(Debug, Clone, Default)]
pub(crate) struct Placement {
    pub(crate) sensor_frame: Option<Vec<f64>>,
    pub(crate) outlets_mm: Option<Vec<[f64; 3]>>,
    pub(crate) cable_zeros_mm: Option<Vec<f64>>,
    pub(crate) touched_point: Option<Vec<f64>>,
    pub(crate) frame_sigma_mm: Option<f64>,
    pub(crate) frame_sigma_deg: Option<f64>,
    pub(crate) touched_sigma_mm: Option<f64>,
    pub(crate) touched_sigma_deg: Option<f64>,
}

impl Placement {
    /// What is stated.
    ///
    /// # Errors
    /// Names the keyword.
    pub(crate) fn stated(self) -> PyResult<StatedPlacement> {
        let outlets = self.outlets_mm.unwrap_or_default();
        finite("outlets_mm", outlets.as_flattened().to_vec())?;
        let frame_sigma = match (self.frame_sigma_mm, self.frame_sigma_deg) {
            (None, None) => None,
            (None, Some(_)) => {
                let expected = "the standard deviation (mm) beside frame_sigma_deg";
                return Err(Refusal::argument("frame_sigma_mm", "nothing", expected).into());
            }
            (Some(mm), deg) => {
                let mm = positive("frame_sigma_mm", mm)?;
                let rad = match deg {
                    Some(deg) => positive("frame_sigma_deg", deg)?.to_radians(),
                    // As on the command line: 1 mm at a distance of 1 m.
                    None => mm * 1e-3,
                };
                Some([mm, rad])
            }
        };
        let at = |name: &str, numbers: Option<Vec<f64>>| -> Result<Option<Pose>, Refusal> {
            numbers.map(|numbers| pose(name, &numbers)).transpose()
        };
        Ok(StatedPlacement {
            sensor_frame: at("sensor_frame", self.sensor_frame)?,
            outlets_mm: outlets.into_iter().map(Vector3::from).collect(),
            zeros_mm: finite("cable_zeros_mm", self.cable_zeros_mm.unwrap_or_default())?,
            touched: at("touched_point", self.touched_point)?,
            frame_sigma,
            touched_sigma_mm: self.touched_sigma_mm.map(|mm| positive("touched_sigma_mm", mm)).transpose()?,
            touched_sigma_rad: self
                .touched_sigma_deg
                .map(|deg| positive("touched_sigma_deg", deg).map(f64::to_radians))
                .transpose()?,
        })
    }
}
