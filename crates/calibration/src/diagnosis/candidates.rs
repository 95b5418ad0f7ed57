//! The candidates of one data set, with the correction of p-values for their number.

use std::sync::Arc;

use super::catalogue::{Candidate, arm_candidates, fine_maps, measurement_candidates};
use super::cause_kind::CauseKind;
use super::design::Design;
use super::extension::Subject;
use super::order_spectrum::AngleHarmonics;
use super::score::{Score, log_p};
use crate::measurement::dataset::Sensor;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};

/// Prior odds of a stand, target or cable that was moved against a joint that lost counts of its encoder, which is rare, and there are six.
const JOINT_ZERO_ODDS: f64 = 100.0;

/// Those against a sensor that was exchanged for another, or whose constant was entered anew, between two rows.
const EXCHANGED_SENSOR_ODDS: f64 = 100.0;

/// A candidate with its score against a fit.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Arc<Candidate>,
    /// Its score.
    pub score: Score,
    /// Head start in the search that a variant of an accepted cause has over other causes; not evidence.
    pub head_start: f64,
}

impl Scored {
    /// Merit with the head start, by which the search ranks candidates.
    pub fn preference(&self) -> f64 {
        self.score.merit + self.head_start
    }
}

/// Candidates that do not depend on a fit, built once.
pub struct Catalogue {
    /// Listed candidates.
    pub listed: Vec<Arc<Candidate>>,
    /// Fine error maps of each joint, coarsest first.
    pub fine: Vec<Vec<Arc<Candidate>>>,
    /// Kinds of shifts with their regressors over all rows.
    pub shifts: Vec<Arc<Candidate>>,
    /// Number of candidate families (name and joints).
    pub families: f64,
    /// Harmonics of the joint angles, for the order spectrum.
    pub turns: AngleHarmonics,
}

impl Catalogue {
    /// The candidates of a data set.
    pub fn of(subject: &Subject<'_>) -> Self {
        let dataset = &subject.observed.dataset;
        let mut listed = arm_candidates(subject);
        listed.extend(measurement_candidates(subject));
        let mut kinds = vec![Kind::Frame { turning: false }, Kind::Target];
        if dataset.sensor == Sensor::Cable {
            kinds.push(Kind::Zero);
        } else {
            kinds.push(Kind::Frame { turning: true });
        }
        kinds.push(Kind::Load { joints: vec![1, 2], compliance: None });
        kinds.extend((0..6).map(|joint| Kind::JointZero { joint }));
        kinds.push(Kind::Scale);
        let shifts: Vec<Arc<Candidate>> = kinds
            .into_iter()
            .map(|kind| {
                let tried = match kind {
                    Kind::JointZero { .. } => JOINT_ZERO_ODDS,
                    Kind::Scale => EXCHANGED_SENSOR_ODDS,
                    _ => 1.0,
                };
                let disturbance = Disturbance::new(kind, Profile::Constant);
                let candidate =
                    Candidate::measurement(disturbance, dataset, subject.nominal, subject.evaluated_at);
                Arc::new(Candidate { tried, ..candidate })
            })
            .collect();
        let mut families: Vec<(CauseKind, Vec<usize>)> = listed
            .iter()
            .chain(shifts.iter().map(|s| &**s))
            .map(|c| (c.cause.kind(), c.cause.joints()))
            .collect();
        families.extend((0..6).map(|j| (CauseKind::GearTransmission, vec![j])));
        families.sort();
        families.dedup();
        let families = families.len() as f64;
        let fine = fine_maps(subject);
        let listed = listed.into_iter().map(Arc::new).collect();
        Self { listed, fine, shifts, families, turns: AngleHarmonics::of(subject) }
    }

    /// Natural logarithm of the p-value against `design`, corrected for variants and families.
    pub(super) fn corrected_log_p(&self, design: &Design, scored: &Scored) -> f64 {
        let trials = (scored.candidate.tried * self.families).ln();
        (log_p(design, &scored.candidate, &scored.score) + trials).min(0.0)
    }

    /// Whether the corrected p-value is at most `alpha`. The robust statistic is computed only if the model's own noise does not
    /// already decide.
    pub(super) fn is_significant(&self, design: &Design, scored: &Scored, alpha: f64) -> bool {
        let trials = (scored.candidate.tried * self.families).ln();
        let plain = scored.score.plain_log_p(&scored.candidate.cause.sizes());
        plain + trials <= alpha.ln() && self.corrected_log_p(design, scored) <= alpha.ln()
    }
}
