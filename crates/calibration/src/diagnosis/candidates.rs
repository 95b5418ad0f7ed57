//! The candidates of one data set, with what their number costs a p-value.

use std::sync::Arc;

use super::catalogue::{Candidate, arm_candidates, fine_maps, measurement_candidates};
use super::design::Design;
use super::extension::Subject;
use super::lines::Turns;
use super::score::{Score, log_p};
use crate::measurement::dataset::Sensor;
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};

/// A candidate with its score against a fit.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The candidate.
    pub candidate: Arc<Candidate>,
    /// Its score.
    pub score: Score,
}

/// Candidates that do not depend on a fit, built once.
pub struct Catalogue {
    /// Those whose rows and orders are listed.
    pub listed: Vec<Arc<Candidate>>,
    /// Fine error maps of each joint, by how fine they are.
    pub fine: Vec<Vec<Arc<Candidate>>>,
    /// Kinds of shifts with their regressors over all rows.
    pub shifts: Vec<Candidate>,
    /// Kinds of candidates (name and joints).
    pub families: f64,
    /// Where the joints stood, for lines.
    pub turns: Turns,
}

impl Catalogue {
    /// For a data set.
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
        let shifts: Vec<Candidate> = kinds
            .into_iter()
            .map(|kind| {
                let disturbance = Disturbance::new(kind, Profile::Constant);
                Candidate::measurement(disturbance, dataset, subject.nominal, subject.frames)
            })
            .collect();
        let mut stories: Vec<(&str, Vec<usize>)> =
            listed.iter().chain(&shifts).map(|c| (c.cause.name(), c.cause.joints())).collect();
        stories.extend((0..6).map(|j| ("gear-transmission", vec![j])));
        stories.sort();
        stories.dedup();
        let families = stories.len() as f64;
        let fine = fine_maps(subject);
        let listed = listed.into_iter().map(Arc::new).collect();
        Self { listed, fine, shifts, families, turns: Turns::of(subject) }
    }

    /// The corrected p-value's logarithm, against `design`.
    pub(super) fn corrected(&self, design: &Design, scored: &Scored) -> f64 {
        let trials = (scored.candidate.tried * self.families).ln();
        (log_p(design, &scored.candidate, &scored.score) + trials).min(0.0)
    }

    /// Whether that lies below the chance that was allowed for; the scatter is looked at only where the model's own noise
    /// does not settle it.
    pub(super) fn significant(&self, design: &Design, scored: &Scored, alpha: f64) -> bool {
        let trials = (scored.candidate.tried * self.families).ln();
        let plain = scored.score.plain_log_p(&scored.candidate.cause.sizes());
        plain + trials <= alpha.ln() && self.corrected(design, scored) <= alpha.ln()
    }
}
