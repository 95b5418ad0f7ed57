//! Raises alarms, and restarts the filter after one.

use nalgebra::{DMatrix, DVector};

use super::alarm::{Alarm, Course, Mount, Part};
use super::bounds::{outlier_bound, window_bound};
use super::last_link::ZERO_LOST_RAD;
use super::locate::{Change, Explanation, Form, Group, GroupChange, locate};
use super::mounting::Beside;
use super::scale::SCALE;
use super::state::{Snapshot, extend_region};
use super::tracker::Tracker;
use truegrind_arm::parameter::{LinkCoordinate, Parameter};
use truegrind_estimation::problem::Problem;
use truegrind_math::distribution::{chi_square_quantile, wilson_hilferty};
use truegrind_math::statistics::median;

/// Smallest likelihood ratio of a change that is reported: 1 in 10⁵ for one parameter and one pose, 1 in a hundred after the
/// search over all of them. The change must also explain most of the window's excess.
const SURE: f64 = 20.0;

/// Poses between exceeding the bound and localising the change: too few poses fit many explanations.
const SETTLE: usize = 5;

/// Scatter that is told: this many times what is expected, and what was told before.
const MORE_SCATTER: f64 = 1.4;

/// Scatter that has not been seen for so many windows is told again.
const RECOVERED: usize = 2;

/// Largest change that the linearised search can state (rad, mm).
const LINEAR_RAD: f64 = 0.2;
const LINEAR_MM: f64 = 200.0;

/// Prior standard deviation of a displacement of the sensor or target (mm, rad), for [`Group`].
const REACH_MM: f64 = 10.0;
const REACH_RAD: f64 = 0.05;

impl Tracker {
    /// Tests the window, and localises the change where its bound was exceeded.
    pub(super) fn alarm(&mut self) -> Option<Alarm> {
        if self.state.burst_since > 0 {
            return self.continue_burst();
        }
        let window = self.state.options.window.max(1);
        let history = &self.state.history;
        // The window starts after the first poses, which registered the sensor.
        let earliest = self.state.quiet_until.max(self.state.options.first_poses + window);
        if history.len() < window || self.state.poses < earliest {
            return None;
        }
        let per = self.state.sensor.scalars();
        let bound = window_bound(window * per);
        // An isolated outlier is ignored; three or four consecutive ones exceed the bound.
        let counted = |at: usize| match history[at].nis {
            _ if self.is_lone_outlier(at) => per as f64,
            nis if nis.is_finite() => nis.min(bound / 4.0),
            _ => bound / 4.0,
        };
        let sum: f64 = (history.len() - window..history.len()).map(counted).sum();
        if sum > bound && self.state.pending_since == 0 {
            self.state.pending_since = self.state.poses;
        }
        if self.state.pending_since == 0 || self.state.poses < self.state.pending_since + SETTLE {
            return None;
        }
        self.state.pending_since = 0;
        if let Some(alarm) = self.detect_remount(Beside::Noise) {
            return Some(alarm);
        }
        let history = &self.state.history;
        let groups = self.groups();
        let found = self.locate_change(&groups)?;
        let ratio = found.together.as_ref().map_or(found.best.ratio, |t| t.ratio);
        // Excess scatter is no change of a parameter, however well one fits a few poses: a change must explain most (0.7) of
        // the window's excess.
        let measured = |at: usize| match history[at].nis {
            _ if self.is_lone_outlier(at) => per as f64,
            nis if nis.is_finite() => nis,
            _ => bound,
        };
        let all: f64 = (history.len() - window..history.len()).map(measured).sum();
        let explains = ratio >= SURE.max(0.7 * (all - (window * per) as f64));
        if !(explains && self.is_within_linear_range(&found, &groups)) {
            // No change of one parameter explains it: sensor or target may have been mounted elsewhere, and the arm changed too.
            if let Some(alarm) = self.detect_remount(Beside::ChangedArm) {
                return Some(alarm);
            }
            if self.trailing_outliers() > SETTLE {
                let alarm =
                    self.unexplained_alarm(Course::Burst, self.trailing_outliers(), [sum, bound], ratio);
                self.state.burst_since = self.state.poses;
                return alarm;
            }
            // These poses raise no further alarm.
            let is_ongoing = self.state.poses <= self.state.quiet_until + RECOVERED * window;
            self.state.quiet_until = self.state.poses + window;
            let scatter = self.scatter(window)?;
            if scatter < MORE_SCATTER {
                return self.unexplained_alarm(Course::Open, 0, [sum, bound], ratio);
            }
            let alarm = self.unexplained_alarm(Course::Scatter, 0, [sum, bound], ratio)?;
            let same = |told: &&Alarm| {
                told.course == Course::Scatter && is_ongoing && told.noticed_file == alarm.noticed_file
            };
            if self.state.alarms.last().filter(same).is_some_and(|told| scatter < MORE_SCATTER * told.shift) {
                return None;
            }
            return Some(Alarm { shift: scatter, ..alarm });
        }
        let alarm = self.change_alarm(&found, &groups, [sum, bound], ratio)?;
        self.restart_from_change(&found, &groups);
        Some(alarm)
    }

    /// Whether a change is small enough for the linearisation that found it.
    fn is_within_linear_range(&self, found: &Explanation, groups: &[Group]) -> bool {
        let fits = |k: usize, shift: f64| match self.parameters[k].unit() {
            "rad" => shift.abs() <= LINEAR_RAD,
            "mm" => shift.abs() <= LINEAR_MM,
            _ => true,
        };
        match &found.together {
            Some(together) => {
                let members = &groups[together.group].members;
                members.iter().zip(&together.shifts).all(|((k, _), shift)| fits(*k, *shift))
            }
            None => fits(found.best.parameter, found.best.shift),
        }
    }

    /// How many times as much as expected the latest poses scatter; by their median, which outliers do not move.
    pub(super) fn scatter(&self, poses: usize) -> Option<f64> {
        let history = &self.state.history;
        let latest: Vec<f64> = history[history.len().saturating_sub(poses)..].iter().map(|s| s.nis).collect();
        Some((median(&latest)? / self.expected_median_nis()).sqrt())
    }

    /// The median of a pose's NIS, if arm, sensor and noise match the model.
    pub fn expected_median_nis(&self) -> f64 {
        let degrees = self.state.sensor.scalars() as f64;
        degrees * wilson_hilferty(degrees, 0.0)
    }

    /// Alarm of an explained change.
    fn change_alarm(
        &self,
        found: &Explanation,
        groups: &[Group],
        window_nis: [f64; 2],
        ratio: f64,
    ) -> Option<Alarm> {
        let (history, last) = (&self.state.history, self.state.history.last()?);
        let since = found.together.as_ref().map_or(found.best.since, |t| t.since);
        let onset = &history[since];
        let name = |k: usize| self.name(k);
        let best = &found.best;
        let mut alarm = Alarm {
            noticed_file: last.file.clone(),
            noticed_row: last.row,
            since_file: onset.file.clone(),
            since_row: onset.row,
            since_time_h: onset.time_h,
            parameter: name(best.parameter),
            label: self.label(best.parameter),
            unit: self.parameters[best.parameter].unit().to_owned(),
            course: match (found.other_form, best.form) {
                (Some(_), _) => Course::Open,
                (None, Form::Jump) => Course::Jump,
                (None, Form::Drift) => Course::Drift,
            },
            shift: best.shift,
            sigma: best.sigma,
            poses: history.len() - since,
            ratio,
            alternatives: found
                .alternatives
                .iter()
                .map(|c| name(c.parameter))
                .chain(found.nearly.map(|g| format!("a move of {}", groups[g].mount)))
                .collect(),
            window_nis,
            parts: Vec::new(),
        };
        if let Some(together) = &found.together {
            self.describe_group(&mut alarm, &groups[together.group], together, found);
        }
        Some(alarm)
    }

    /// Alarm without an explanation; the last `poses` poses were consecutive outliers.
    fn unexplained_alarm(
        &self,
        course: Course,
        poses: usize,
        window_nis: [f64; 2],
        ratio: f64,
    ) -> Option<Alarm> {
        let history = &self.state.history;
        let (first, last) = (&history[history.len() - poses.max(1)], history.last()?);
        Some(Alarm {
            noticed_file: last.file.clone(),
            noticed_row: last.row,
            since_file: first.file.clone(),
            since_row: first.row,
            since_time_h: first.time_h,
            parameter: String::new(),
            label: None,
            unit: String::new(),
            course,
            shift: 0.0,
            sigma: 0.0,
            poses,
            ratio,
            alternatives: Vec::new(),
            window_nis,
            parts: Vec::new(),
        })
    }

    /// During a burst the only alarm is a remounted target or sensor. The burst ends after [`SETTLE`] consecutive poses that fit.
    fn continue_burst(&mut self) -> Option<Alarm> {
        let run = self.trailing_outliers();
        if run > 0 {
            return run.is_multiple_of(SETTLE).then(|| self.detect_remount(Beside::ChangedArm)).flatten();
        }
        let bound = outlier_bound(self.state.sensor.scalars());
        let fitting = self.state.history.iter().rev().take_while(|record| record.nis <= bound).count();
        if fitting >= SETTLE {
            self.state.burst_since = 0;
            // The poses of the burst raise no further alarm.
            self.state.quiet_until = self.state.poses + self.state.options.window;
        }
        None
    }

    /// What a parameter of an effect is, or the scale, in words.
    fn label(&self, k: usize) -> Option<String> {
        if self.parameters[k] == SCALE {
            return Some("the scale of the sensor".to_owned());
        }
        let Parameter::Effect { index, parameter } = self.parameters[k] else { return None };
        let effect = self.initial.model.effects.get(index)?;
        let of = effect.joint().map_or(String::new(), |joint| format!(" of joint {}", joint + 1));
        let named = effect.parameters().get(parameter).map(|parameter| parameter.name)?;
        Some(format!("{}{of} ({named})", effect.name().replace('-', " ")))
    }

    /// Describes the displacement of a group in an alarm.
    fn describe_group(&self, alarm: &mut Alarm, group: &Group, together: &GroupChange, found: &Explanation) {
        let part = |(a, (k, _)): (usize, &(usize, f64))| Part {
            parameter: self.parameters[*k].to_string(),
            unit: self.parameters[*k].unit().to_owned(),
            shift: together.shifts[a],
            sigma: together.covariance[(a, a)].max(0.0).sqrt(),
        };
        alarm.parts = group.members.iter().enumerate().map(part).collect();
        (alarm.shift, alarm.sigma) = self.displacement(group, together);
        (alarm.parameter, alarm.unit, alarm.course) =
            (group.mount.to_string(), "mm".to_owned(), Course::Jump);
        alarm.label = None;
        let freedom = group.members.len().saturating_sub(1).max(1);
        let margin = chi_square_quantile(UNLIKELY, freedom).max(NEARLY_ALL * together.ratio);
        let rivals = group.covers.iter().filter(|(k, largest)| {
            let near = |change: &&Change| change.parameter == *k && change.shift.abs() <= *largest;
            std::iter::once(&found.best)
                .chain(&found.alternatives)
                .filter(near)
                .any(|change| change.ratio > together.ratio - margin)
        });
        alarm.alternatives = rivals.map(|(k, _)| self.parameters[*k].to_string()).collect();
    }

    /// RMS displacement of the changed poses' readings (mm), and its standard deviation. The displacement of a frame's origin would be
    /// meaningless: the frame can rotate far from the measured points. A mean would be too small: what moves on the flange moves each
    /// reading in another direction.
    fn displacement(&self, group: &Group, together: &GroupChange) -> (f64, f64) {
        let poses = &self.state.history;
        let (per, p) = (self.state.sensor.scalars(), self.parameters.len());
        let rows = poses.len() * per;
        let (mut r, mut j) = (vec![0.0; rows], vec![0.0; rows * p]);
        self.problem(poses).jacobian(&self.state.reference.x, 0..rows, &mut r, &mut j);
        // Position rows only; a pose has three more.
        let axes = per.min(3);
        let changed = (poses.len() - together.since).max(1) as f64;
        let members = group.members.len();
        let mut square = DMatrix::<f64>::zeros(members, members);
        for pose in together.since..poses.len() {
            let of = |axis: usize, a: usize| {
                j[group.members[a].0 * rows..][pose * per + axis] / poses[pose].per_mm
            };
            let moved = DMatrix::from_fn(axes, members, of);
            square += moved.tr_mul(&moved) / changed;
        }
        let shifts = DVector::from_column_slice(&together.shifts);
        let along = &square * &shifts;
        let length = shifts.dot(&along).max(0.0).sqrt();
        let along = along / length.max(f64::MIN_POSITIVE);
        (length, (&together.covariance * &along).dot(&along).max(0.0).sqrt())
    }

    /// Groups that can move together: the sensor frame, the target, each cable outlet.
    fn groups(&self) -> Vec<Group> {
        let mut groups: Vec<Group> = Vec::new();
        for (k, parameter) in self.parameters.iter().enumerate() {
            let Some(mount) = Mount::of(parameter) else { continue };
            let reach = if parameter.is_length() { REACH_MM } else { REACH_RAD };
            match groups.iter_mut().find(|group| group.mount == mount) {
                Some(group) => group.members.push((k, reach)),
                None => groups.push(Group { mount, members: vec![(k, reach)], covers: Vec::new() }),
            }
        }
        // Whatever is fixed to the last link moves with it: no reading tells a bent flange or a lost zero of joint 6 from a moved target.
        if let Some(target) = groups.iter_mut().find(|group| group.mount == Mount::Target) {
            let carried = self.parameters.iter().enumerate();
            target.covers =
                carried.filter_map(|(k, parameter)| Some((k, largest_of_last_link(parameter)?))).collect();
        }
        groups
    }

    /// Whether a pose of the history is an isolated outlier. After a jump, consecutive poses are outliers.
    fn is_lone_outlier(&self, at: usize) -> bool {
        let bound = outlier_bound(self.state.sensor.scalars());
        let aside = |at: Option<usize>| {
            at.and_then(|at| self.state.history.get(at)).is_some_and(|s| !(s.nis <= bound))
        };
        aside(Some(at)) && !aside(at.checked_sub(1)) && !aside(Some(at + 1))
    }

    fn locate_change(&self, groups: &[Group]) -> Option<Explanation> {
        let poses = &self.state.history;
        let per = self.state.sensor.scalars();
        let reference = &self.state.reference;
        let (rows, p) = (poses.len() * per, self.parameters.len());
        let (mut r, mut j) = (vec![0.0; rows], vec![0.0; rows * p]);
        self.problem(poses).jacobian(&reference.x, 0..rows, &mut r, &mut j);
        for (pose, record) in poses.iter().enumerate() {
            if self.is_lone_outlier(pose) || !record.nis.is_finite() {
                let of_pose = pose * per..(pose + 1) * per;
                r[of_pose.clone()].fill(0.0);
                j.chunks_mut(rows).for_each(|column| column[of_pose.clone()].fill(0.0));
            }
        }
        let (j, covariance) = self.with_frames_of_stations(j, reference.covariance()?);
        locate(&r, &j, per, &covariance, p, groups)
    }

    /// Filters the history again with a wider covariance of the changed parameter and its alternatives, each by its own
    /// estimated change. A drifting parameter keeps its drift per pose as process noise from then on.
    fn restart_from_change(&mut self, found: &Explanation, groups: &[Group]) {
        let Some(filter) = self.state.reference.filter() else { return };
        self.filter = filter;
        let poses = std::mem::take(&mut self.state.history);
        let problem = self.problem(&poses);
        let forgotten = self.state.poses - poses.len();
        let single = found.together.is_none();
        let bound = outlier_bound(self.state.sensor.scalars());
        // What moves the readings exactly as the sensor does is the sensor: see `compare_changes`.
        let is_same = |change: &Change| {
            !self.parameters[found.best.parameter].is_of_arm()
                && self.parameters[change.parameter].is_of_arm()
                && found.best.is_tied_with(change)
        };
        let alternatives: Vec<&Change> =
            found.alternatives.iter().filter(|change| !is_same(change)).collect();
        let all = || std::iter::once(&found.best).chain(alternatives.iter().copied()).filter(|_| single);
        for at in 0..poses.len() {
            let mut widening = vec![0.0; self.parameters.len()];
            let mut any = false;
            for change in all().filter(|c| c.since == at) {
                any = true;
                match change.form {
                    Form::Jump => widening[change.parameter] = 3.0 * change.shift.abs(),
                    Form::Drift => {
                        let rate = change.shift.abs() / (poses.len() - at) as f64;
                        let drift = &mut self.drift[change.parameter];
                        *drift = drift.max(rate);
                        let name = self.parameters[change.parameter].to_string();
                        self.state.options.drift.insert(name, *drift);
                    }
                }
            }
            if let Some(together) = found.together.as_ref().filter(|t| t.since == at) {
                any = true;
                for ((k, _), shift) in groups[together.group].members.iter().zip(&together.shifts) {
                    widening[*k] = 3.0 * shift.abs();
                }
            }
            if any {
                self.filter.predict(&widening);
            }
            if poses[at].begins_station {
                self.release_sensor();
            }
            let registered = self.registered(forgotten + at);
            let taken = !self.update_about(&problem, at, registered.as_ref()).set_aside;
            if taken && !(poses[at].nis <= bound) {
                self.state.outliers = self.state.outliers.saturating_sub(1);
                extend_region(&mut self.state.region, &poses[at].joints);
            }
        }
        // Changes before this one are settled.
        let snapshot = Snapshot::of(&self.filter, 0);
        (self.state.reference, self.state.middle) = (snapshot.clone(), snapshot);
    }
}

/// Largest change of a parameter of the last link that is a likely rival of a moved target; `None` for other parameters. A joint may lose
/// its zero by degrees; a flange is not bent by as much without more being broken.
fn largest_of_last_link(parameter: &Parameter) -> Option<f64> {
    match parameter {
        Parameter::Link { joint: 5, coordinate } => Some(match coordinate {
            LinkCoordinate::Theta => ZERO_LOST_RAD,
            LinkCoordinate::Alpha | LinkCoordinate::Beta => BENT_RAD,
            LinkCoordinate::A | LinkCoordinate::D => BENT_MM,
        }),
        _ => None,
    }
}

/// A part of a group is its rival where the group explains more only as in one of so many cases, or by no more than this share.
const UNLIKELY: f64 = 1e-3;
const NEARLY_ALL: f64 = 0.01;

/// Sizes up to which the last link is likely to have changed (rad, mm).
const BENT_RAD: f64 = 0.003;
const BENT_MM: f64 = 0.3;
