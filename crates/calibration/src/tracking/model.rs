//! The tracked model: the initial one with the filter's current parameters and covariance.

use super::tracker::Tracker;
use crate::identification::calibration::{CalibrationProblem, Frames};
use crate::measurement::dataset::{Dataset, Sensor};
use truegrind_arm::estimated::{Estimated, EstimatedParameter, Judgement, Reason, Verdict};
use truegrind_arm::model::Model;
use truegrind_math::statistics::ErrorSummary;

impl Tracker {
    /// The current arm and sensor frames.
    pub fn current(&self) -> (Model, Frames) {
        self.without_rows().apply(self.filter.x.as_slice())
    }

    /// The parameters alone.
    pub(super) fn without_rows(&self) -> CalibrationProblem {
        let none = Dataset::new("track", Sensor::Position, Vec::new());
        CalibrationProblem::new(&none, &self.initial.model, &self.frames, &self.parameters, &[], &[])
    }

    /// The current model.
    pub fn model(&self) -> Estimated {
        let x = self.filter.x.as_slice();
        let (model, _) = self.current();
        let arm = self.initial.order.len();
        let whole = self.filter.covariance();
        let covariance = whole.view((0, 0), (arm, arm)).into_owned();
        let mut out = self.initial.clone();
        for (k, parameter) in self.initial.order.iter().enumerate() {
            let name = parameter.to_string();
            if let Some(row) = out.parameters.iter_mut().find(|p| p.name == name) {
                update_row(row, x[k], covariance[(k, k)].max(0.0).sqrt());
            }
        }
        out.model = model;
        out.covariance = covariance;
        out.provenance.method = "track".to_owned();
        out.provenance.rows = self.initial.provenance.rows + self.state.poses;
        if let Some(last) = self.state.consumed.last() {
            out.provenance.file.clone_from(&last.file);
            out.provenance.sha256.clone_from(&last.digest);
        }
        if !self.state.history.is_empty() {
            out.calibrated.fitted = ErrorSummary::of(self.state.history.iter().map(|s| s.error_mm));
        }
        out.condition = self.condition;
        out.region.clone_from(&self.state.region);
        out.verdict = Verdict {
            status: match self.initial.verdict.status {
                // Tracking does not repair a bad initial model.
                bad @ (Judgement::Fail | Judgement::Doubtful) => bad,
                Judgement::Pass | Judgement::NotEvaluated => Judgement::NotEvaluated,
            },
            reasons: self.reasons(),
        };
        out
    }

    fn reasons(&self) -> Vec<Reason> {
        let mut reasons = vec![Reason::from(format!(
            "tracked over {} poses since {}, {} set aside as outliers; held-out errors are those of the first \
             identification",
            self.state.poses, self.initial.provenance.file, self.state.outliers
        ))];
        reasons.extend(self.state.alarms.iter().map(|alarm| alarm.to_string().into()));
        reasons
    }
}

fn update_row(row: &mut EstimatedParameter, deviation: f64, sigma: f64) {
    row.value += deviation;
    row.sigma = sigma;
    if let Some(prior) = row.prior_sigma {
        row.determined = (1.0 - (sigma / prior).powi(2)).clamp(0.0, 1.0);
    }
}
