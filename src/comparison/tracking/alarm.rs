//! When a track raises an alarm, what it says, and how the filter goes on from there.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::Tracker;
use super::locate::{Form, Found, locate};
use super::state::{Seen, Snapshot};
use crate::comparison::distribution::chi_square_quantile;
use crate::estimation::problem::Problem;

/// A pose beyond this share of χ² is an accident.
const ACCIDENT: f64 = 1e-9;

/// A window beyond so many standard deviations, 1 in 10⁵, raises the alarm.
const ALARM_DEVIATIONS: f64 = 4.265;

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
    /// Name of the parameter that moved.
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
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = match self.unit.as_str() {
            "rad" => (1f64.to_degrees(), "°"),
            "" => (1.0, ""),
            other => (1.0, other),
        };
        let verb = match self.course {
            Course::Open => "moved",
            Course::Jump => "jumped",
            Course::Drift => "has drifted",
        };
        write!(
            f,
            "{} {verb} by {:.4} ± {:.4} {unit} since row {} of {}",
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
        if !self.alternatives.is_empty() {
            write!(f, "; {} would explain it nearly as well", self.alternatives.join(", "))?;
        }
        Ok(())
    }
}

impl Tracker {
    /// Looks at the window, and where it is out of bounds finds out what moved.
    pub(super) fn alarm(&mut self) -> Option<Alarm> {
        let window = self.state.options.window.max(1);
        let history = &self.state.history;
        // The window never reaches back behind the first poses, which place the sensor.
        if history.len() < window || self.state.poses < self.state.options.first_poses + window {
            return None;
        }
        let per = self.rows_per_pose();
        let bound = window_bound(window * per);
        // One accident alone must not raise the alarm, three do.
        let counted = |s: &Seen| if s.nis.is_finite() { s.nis.min(bound / 3.0) } else { bound / 3.0 };
        let sum: f64 = history[history.len() - window..].iter().map(counted).sum();
        if sum <= bound {
            return None;
        }
        let found = self.what_moved()?;
        let last = self.state.history.last()?;
        let onset = &self.state.history[found.best.since];
        let name = |k: usize| self.parameters[k].to_string();
        let alarm = Alarm {
            noticed_file: last.file.clone(),
            noticed_row: last.row,
            since_file: onset.file.clone(),
            since_row: onset.row,
            since_time_h: onset.time_h,
            parameter: name(found.best.parameter),
            unit: self.parameters[found.best.parameter].unit().to_owned(),
            course: match (found.other_form, found.best.form) {
                (Some(_), _) => Course::Open,
                (None, Form::Jump) => Course::Jump,
                (None, Form::Drift) => Course::Drift,
            },
            shift: found.best.shift,
            sigma: found.best.sigma,
            poses: history.len() - found.best.since,
            ratio: found.best.ratio,
            alternatives: found.alternatives.iter().map(|c| name(c.parameter)).collect(),
            window_nis: [sum, bound],
        };
        self.reopen(&found);
        Some(alarm)
    }

    fn what_moved(&self) -> Option<Found> {
        let poses = &self.state.history;
        let per = self.rows_per_pose();
        let reference = &self.state.reference;
        let (rows, p) = (poses.len() * per, self.parameters.len());
        let (mut r, mut j) = (vec![0.0; rows], vec![0.0; rows * p]);
        self.task(poses).jacobian(&reference.x, 0..rows, &mut r, &mut j);
        // After a jump one pose after the other is set aside; one alone is an accident and has no say.
        let aside: Vec<bool> = poses.iter().map(|s| !(s.nis <= accident_bound(per))).collect();
        for pose in 0..poses.len() {
            let alone = |at: Option<usize>| !at.and_then(|at| aside.get(at)).is_some_and(|a| *a);
            let lone = aside[pose] && alone(pose.checked_sub(1)) && alone(Some(pose + 1));
            if lone || !poses[pose].nis.is_finite() {
                let of_pose = pose * per..(pose + 1) * per;
                r[of_pose.clone()].fill(0.0);
                j.chunks_mut(rows).for_each(|column| column[of_pose.clone()].fill(0.0));
            }
        }
        locate(&r, &j, per, &reference.covariance()?)
    }

    /// Takes the history in again, with room for what moved. What looks alike may have moved alike, each by its own
    /// measure. What drifts may go on: its process noise becomes what it drifted by from pose to pose, and stays so.
    fn reopen(&mut self, found: &Found) {
        let Some(recursion) = self.state.reference.recursion() else { return };
        self.recursion = recursion;
        let poses = std::mem::take(&mut self.state.history);
        let task = self.task(&poses);
        let all = || std::iter::once(&found.best).chain(&found.alternatives);
        for at in 0..poses.len() {
            let mut room = vec![0.0; self.parameters.len()];
            let mut any = false;
            for change in all().filter(|c| c.since == at) {
                any = true;
                match change.form {
                    Form::Jump => room[change.parameter] = 3.0 * change.shift.abs(),
                    Form::Drift => {
                        let rate = change.shift.abs() / (poses.len() - at) as f64;
                        let drift = &mut self.drift[change.parameter];
                        *drift = drift.max(rate);
                        let name = self.parameters[change.parameter].to_string();
                        self.state.options.drift.insert(name, *drift);
                    }
                }
            }
            if any {
                self.recursion.predict(&room);
            }
            self.update(&task, at);
        }
        // What came before the change is settled.
        let snapshot = Snapshot::of(&self.recursion, 0);
        (self.state.reference, self.state.middle) = (snapshot.clone(), snapshot);
    }
}

/// The NIS beyond which a pose of so many rows is an accident: the quantile, worked out once.
pub(super) fn accident_bound(rows: usize) -> f64 {
    use std::sync::OnceLock;
    static CUTS: OnceLock<[f64; 7]> = OnceLock::new();
    let cuts = CUTS
        .get_or_init(|| std::array::from_fn(|m| if m == 0 { 0.0 } else { chi_square_quantile(ACCIDENT, m) }));
    cuts[rows.min(6)]
}

/// The bound of a window with so many rows, by Wilson and Hilferty's cube (1931): good to a per cent out here, and
/// cheap enough for every pose.
fn window_bound(rows: usize) -> f64 {
    let (n, z) = (rows as f64, ALARM_DEVIATIONS);
    let spread = 2.0 / (9.0 * n);
    n * (1.0 - spread + z * spread.sqrt()).powi(3)
}
