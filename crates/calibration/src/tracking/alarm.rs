//! An alarm: what moved, since when, by how much.

use std::fmt;

use serde::{Deserialize, Serialize};

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

/// How a parameter changed, as far as the poses tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Course {
    /// A jump or a drift: so far both explain it.
    #[default]
    Open,
    /// At once.
    Jump,
    /// Steadily, and it may go on.
    Drift,
    /// Taken off and put on again elsewhere.
    Mounted,
    /// Readings that are far off and agree with no one change.
    Burst,
}

/// A change that was noticed.
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
    /// Name of the parameter that moved, or of what moved as a whole; empty where nothing explains the poses.
    pub parameter: String,
    /// Unit.
    pub unit: String,
    /// Whether it jumped or drifts.
    #[serde(default)]
    pub course: Course,
    /// By how much so far.
    pub shift: f64,
    /// Standard deviation of that.
    pub sigma: f64,
    /// Poses from the first changed one to the last.
    #[serde(default)]
    pub poses: usize,
    /// Likelihood ratio: χ² with one degree of freedom if nothing had moved.
    pub ratio: f64,
    /// Parameters that would explain it nearly as well.
    pub alternatives: Vec<String>,
    /// Sum of the window's NIS, and what it should not exceed.
    pub window_nis: [f64; 2],
    /// Of something that moved as a whole its parameters; the shift is then what the readings moved by on average.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
}

/// Number and unit for people.
fn shown(unit: &str) -> (f64, &str) {
    match unit {
        "rad" => (1f64.to_degrees(), "°"),
        "" => (1.0, ""),
        other => (1.0, other),
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = shown(&self.unit);
        if self.course == Course::Burst {
            return write!(
                f,
                "the {} readings from row {} of {} on are far off and agree with no one change: they are set aside, and so is what \
                 follows until readings fit again; look at the target, the line of limits and the poses",
                self.poses, self.since_row, self.since_file
            );
        }
        if self.course == Course::Mounted {
            write!(
                f,
                "{} was mounted anew at row {} of {}: moved by {:.1} mm",
                self.parameter, self.since_row, self.since_file, self.shift
            )?;
            if let Some(turn) = self.parts.first() {
                write!(f, " and turned by {:.2}°", turn.shift.to_degrees())?;
            }
            return write!(f, "; {} poses agree on it, and the track goes on from there", self.poses);
        }
        if self.parameter.is_empty() {
            return write!(
                f,
                "innovations left their bounds at row {} of {} (sum of the window {:.0}, bound {:.0}), and no single parameter \
                 explains it so far: look at the sensor, the target, and at effects that the model does not hold; more poses may \
                 tell",
                self.noticed_row, self.noticed_file, self.window_nis[0], self.window_nis[1]
            );
        }
        let verb = match self.course {
            Course::Open | Course::Mounted | Course::Burst => "moved",
            Course::Jump => "jumped",
            Course::Drift => "has drifted",
        };
        let whole = if self.parts.is_empty() { "" } else { ", which moved the readings" };
        write!(
            f,
            "{} {verb}{whole} by {:.4} ± {:.4} {unit} since row {} of {}",
            self.parameter,
            self.shift * scale,
            self.sigma * scale,
            self.since_row,
            self.since_file
        )?;
        if let Some(hours) = self.since_time_h {
            write!(f, " (t = {hours:.3} h)")?;
        }
        if self.course == Course::Drift && self.poses > 0 {
            write!(f, ", {:.6} {unit} with each pose", self.shift * scale / self.poses as f64)?;
        }
        write!(f, ", noticed at row {} of {}", self.noticed_row, self.noticed_file)?;
        let sure = self.parts.iter().filter(|p| p.shift.abs() > 3.0 * p.sigma);
        for (k, part) in sure.enumerate() {
            let (scale, unit) = shown(&part.unit);
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
