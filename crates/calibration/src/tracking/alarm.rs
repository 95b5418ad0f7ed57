//! A detected change: which parameter, since which pose, by how much.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::scale::SCALE_NAME;
use truegrind_arm::parameter::{Parameter, display_unit};

/// One of several parameters that moved at once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Name of the parameter.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// By how much.
    pub shift: f64,
    /// Standard deviation of that.
    pub sigma: f64,
}

/// Kind of change, as far as the poses determine it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Course {
    /// Undecided: a jump and a drift both explain the poses.
    #[default]
    Open,
    /// A step at one pose.
    Jump,
    /// A steady drift, possibly still going on.
    Drift,
    /// The target or sensor was remounted elsewhere.
    Mounted,
    /// Outliers that no single change explains.
    Burst,
    /// The readings scatter more than before: `shift` is the ratio.
    Scatter,
}

/// What can be moved as a whole. An alarm of it has its words for a parameter, in files too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// The sensor, or the arm's base: readings show only that one moved against the other.
    Sensor,
    /// The target on the flange.
    Target,
    /// The outlet of a cable, counted from 0.
    Outlet(usize),
}

impl Mount {
    /// What a parameter is part of.
    pub fn of(parameter: &Parameter) -> Option<Self> {
        match parameter {
            Parameter::SensorFrame(_) => Some(Mount::Sensor),
            Parameter::Target(_) => Some(Mount::Target),
            Parameter::Outlet { anchor, .. } => Some(Mount::Outlet(*anchor)),
            _ => None,
        }
    }
}

impl fmt::Display for Mount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Mount::Sensor => f.write_str("the sensor against the arm's base"),
            Mount::Target => f.write_str("the touched point"),
            Mount::Outlet(0) => f.write_str("the outlet"),
            Mount::Outlet(anchor) => write!(f, "outlet {}", anchor + 1),
        }
    }
}

/// A detected change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alarm {
    /// File and data row at which the alarm went off.
    pub noticed_file: String,
    /// Data row.
    pub noticed_row: usize,
    /// File of the first changed pose.
    pub since_file: String,
    /// Data row of the first changed pose.
    pub since_row: usize,
    /// Its time, where logged (h).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub since_time_h: Option<f64>,
    /// Name of the changed parameter or group; empty where nothing explains the poses.
    pub parameter: String,
    /// What an effect's parameter is, in words; absent where the name says it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// Unit.
    pub unit: String,
    /// Kind of change.
    #[serde(default)]
    pub course: Course,
    /// Size of the change so far.
    pub shift: f64,
    /// Standard deviation of that.
    pub sigma: f64,
    /// Poses from the first changed one to the last.
    #[serde(default)]
    pub poses: usize,
    /// Likelihood ratio: χ² with one degree of freedom under the hypothesis of no change.
    pub ratio: f64,
    /// Parameters that would explain it nearly as well.
    pub alternatives: Vec<String>,
    /// Sum of the window's NIS, and its bound.
    pub window_nis: [f64; 2],
    /// The parameters of a group that moved together; `shift` is then the mean displacement of the readings.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
}

impl Alarm {
    /// Whether it is of the sensor's scale.
    pub fn is_of_scale(&self) -> bool {
        self.parameter == SCALE_NAME
    }

    /// Whether `mount` moved as a whole.
    pub fn is_of(&self, mount: Mount) -> bool {
        self.parameter == mount.to_string()
    }
}

/// Value and standard deviation with the digits that tell something: two of the standard deviation, four decimals where these are enough.
fn with_sigma(value: f64, sigma: f64) -> String {
    let places = if sigma > 0.0 && sigma.is_finite() { 1.0 - sigma.log10().floor() } else { 4.0 };
    if places > MAX_DECIMALS {
        let exponent = value.abs().max(sigma).log10().floor() as i32;
        let scale = 10f64.powi(-exponent);
        let decimals = (places as i32 + exponent).max(0) as usize;
        return format!("({:.decimals$} ± {:.decimals$})e{exponent}", value * scale, sigma * scale);
    }
    let decimals = places.max(4.0) as usize;
    format!("{value:.decimals$} ± {sigma:.decimals$}")
}

/// Most decimals without an exponent.
const MAX_DECIMALS: f64 = 6.0;

impl Alarm {
    fn fmt_mounted(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} was remounted at row {} of {}: moved by {:.1} mm",
            self.parameter, self.since_row, self.since_file, self.shift
        )?;
        if let Some(turn) = self.parts.first() {
            write!(f, " and turned by {:.2}°", turn.shift.to_degrees())?;
        }
        write!(f, "; {} poses agree on it, and tracking continues from there", self.poses)?;
        if let [rival, ..] = self.alternatives.as_slice() {
            write!(f, "; {rival} would explain it as well")?;
        }
        Ok(())
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = if self.is_of_scale() { (100.0, "%") } else { display_unit(&self.unit) };
        if self.course == Course::Burst {
            return write!(
                f,
                "the {} readings from row {} of {} on are outliers that no single change explains: they and the following readings are \
                 set aside until readings fit again; check the target, the line of sight and the poses",
                self.poses, self.since_row, self.since_file
            );
        }
        if self.course == Course::Scatter {
            return write!(
                f,
                "the readings scatter {:.1} times as much as before at row {} of {}, and no single change explains it: \
                 check how the target is fastened, the line of sight, and whether the arm has settled when it is read",
                self.shift, self.noticed_row, self.noticed_file
            );
        }
        if self.course == Course::Mounted {
            return self.fmt_mounted(f);
        }
        if self.parameter.is_empty() {
            return write!(
                f,
                "innovations exceeded their bound at row {} of {} (sum of the window {:.0}, bound {:.0}), and no single parameter \
                 explains it so far: check the sensor, the target and effects that the model does not contain, or measure more \
                 poses",
                self.noticed_row, self.noticed_file, self.window_nis[0], self.window_nis[1]
            );
        }
        let verb = match self.course {
            Course::Open | Course::Mounted | Course::Burst | Course::Scatter => "moved",
            Course::Jump => "jumped",
            Course::Drift => "has drifted",
        };
        let name = self.label.as_ref().unwrap_or(&self.parameter);
        write!(f, "{name} {verb}")?;
        let is_whole = !self.parts.is_empty();
        if is_whole && self.shift < 2.0 * self.sigma {
            write!(f, ", by an amount that the poses do not show yet,")?;
        } else {
            let whole = if is_whole { ", which moved the readings" } else { "" };
            write!(f, "{whole} by {} {unit}", with_sigma(self.shift * scale, self.sigma * scale))?;
        }
        write!(f, " since row {} of {}", self.since_row, self.since_file)?;
        if let Some(hours) = self.since_time_h {
            write!(f, " (t = {hours:.3} h)")?;
        }
        if self.course == Course::Drift && self.poses > 0 {
            write!(f, ", {:.6} {unit} per pose", self.shift * scale / self.poses as f64)?;
        }
        write!(f, ", detected at row {} of {}", self.noticed_row, self.noticed_file)?;
        let sure = self.parts.iter().filter(|p| p.shift.abs() > 3.0 * p.sigma);
        for (k, part) in sure.enumerate() {
            let (scale, unit) = display_unit(&part.unit);
            let lead = if k == 0 { ": " } else { ", " };
            write!(
                f,
                "{lead}{} {:+.4} ± {:.4} {unit}",
                part.parameter,
                part.shift * scale,
                part.sigma * scale
            )?;
        }
        if !self.alternatives.is_empty() {
            write!(f, "; {} would explain it nearly as well", self.alternatives.join(", "))?;
        }
        Ok(())
    }
}
