//! Convention of the angles in a file: the controller's own, or DH angles that include the links' offsets.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::dataset::Dataset;
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::robots::sheet::Angles;

/// The meaning of `q1` to `q6` in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AngleConvention {
    /// The controller's angles, as its display shows them.
    #[default]
    Logged,
    /// The angles θ of the DH table, joint map and theta offsets included.
    Dh,
}

impl From<Angles> for AngleConvention {
    fn from(angles: Angles) -> Self {
        match angles {
            Angles::Logged => AngleConvention::Logged,
            Angles::Dh => AngleConvention::Dh,
        }
    }
}

impl AngleConvention {
    /// The other one.
    pub fn other(self) -> Self {
        match self {
            AngleConvention::Logged => AngleConvention::Dh,
            AngleConvention::Dh => AngleConvention::Logged,
        }
    }

    /// The controller's angles (rad) for angles of the file (rad): the inverse of `θ = joint_map · q + offset`.
    /// `None` when the arm's joint map cannot be inverted.
    pub fn controller_angles(self, model: &Model, file: &Joints) -> Option<Joints> {
        match self {
            AngleConvention::Logged => Some(*file),
            AngleConvention::Dh => {
                let offsets = Joints::from_fn(|j, _| model.links[j].theta_rad);
                model.joint_map.try_inverse().map(|inverse| inverse * (file - offsets))
            }
        }
    }

    /// The data set with the controller's angles in place of the file's, and a note where they differ.
    /// `None` when the arm's joint map cannot be inverted.
    pub fn apply(self, mut data: Dataset, model: &Model) -> Option<Dataset> {
        // Iterating mutably would copy shared rows.
        if self == AngleConvention::Dh {
            for row in &mut data.rows {
                row.joints = self.controller_angles(model, &row.joints)?;
            }
            data.notes.push("the angles are DH angles: joint map and theta offsets were taken out".into());
        }
        Some(data)
    }
}

impl fmt::Display for AngleConvention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AngleConvention::Logged => "logged",
            AngleConvention::Dh => "dh",
        })
    }
}

/// A word that names no convention of angles.
///
/// ```
/// use truegrind_calibration::measurement::convention::AngleConvention;
///
/// assert_eq!("dh".parse(), Ok(AngleConvention::Dh));
/// let refused = "DH".parse::<AngleConvention>().map_err(|error| error.to_string());
/// assert_eq!(refused, Err("found angle convention \"DH\", expected logged or dh".into()));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("found angle convention \"{found}\", expected logged or dh")]
pub struct UnknownConvention {
    /// The word.
    pub found: String,
}

impl FromStr for AngleConvention {
    type Err = UnknownConvention;

    fn from_str(text: &str) -> Result<Self, UnknownConvention> {
        match text {
            "logged" => Ok(AngleConvention::Logged),
            "dh" => Ok(AngleConvention::Dh),
            other => Err(UnknownConvention { found: other.to_owned() }),
        }
    }
}
