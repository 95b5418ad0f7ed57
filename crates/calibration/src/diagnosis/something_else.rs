//! What the named causes leave, in words: something that depends on the pose or on the order of the rows, or noise.

use super::discrepancy::Discrepancy;
use super::finding::{Confidence, Finding, Gain};
use super::remaining::{Structure, stands_out};
use super::validation::StageError;
use super::words;
use crate::measurement::dataset::Dataset;

/// Share of what is left that something else must be worth to be a finding of its own.
const WORTH: f64 = 0.3;

/// Rows that are named as those in which it shows most.
const SHOWN: usize = 10;

/// What is left is told against the floor where it is this many times as large.
const ABOVE_FLOOR: f64 = 1.5;

/// What was looked at.
pub(super) struct Left<'a> {
    /// The rows in which causes were looked for.
    pub(super) dataset: &'a Dataset,
    /// What no cause describes.
    pub(super) discrepancy: &'a Discrepancy,
    /// Correlations of neighbours.
    pub(super) structure: &'a Structure,
    /// Errors of the extended model.
    pub(super) after: &'a StageError,
    /// The held-out error before a smooth correction, where there is one (mm).
    pub(super) smoothed: Option<f64>,
    /// What sensor and rounding leave (mm).
    pub(super) floor_mm: Option<f64>,
}

impl Left<'_> {
    /// Whether something else than noise is left.
    fn speaks(&self) -> bool {
        self.discrepancy.speaks() && self.discrepancy.worth_mm() > WORTH * self.after.fitted.rmse
    }

    /// One sentence; nothing where all is noise as it should be.
    pub(super) fn sentence(&self) -> Option<String> {
        let rmse = self.after.fitted.rmse;
        if self.speaks() {
            return Some(format!(
                "{rmse:.3} mm RMS, {:.3} mm of it something else than noise: {}",
                self.discrepancy.worth_mm(),
                self.likeness()
            ));
        }
        let floor = self.floor_mm.filter(|floor| rmse > ABOVE_FLOOR * floor)?;
        Some(format!(
            "{rmse:.3} mm RMS against a floor of {floor:.3} mm, without a pattern: noise of sensor or arm"
        ))
    }

    /// What it is like, largest part first.
    fn likeness(&self) -> String {
        let parts: Vec<String> = self
            .discrepancy
            .carried
            .iter()
            .take(2)
            .map(|(group, mm)| format!("{mm:.3} mm as if {}", group.words()))
            .collect();
        let correlated = (self.discrepancy.correlation != 0.0).then(|| {
            format!("readings resemble the one before them (correlation {:.2})", self.discrepancy.correlation)
        });
        parts.into_iter().chain(correlated).collect::<Vec<_>>().join("; ")
    }

    /// The finding.
    pub(super) fn finding(&self) -> Option<Finding> {
        self.speaks().then(|| {
            let mut order: Vec<usize> = (0..self.discrepancy.push_mm.len()).collect();
            let push = &self.discrepancy.push_mm;
            order.sort_by(|&a, &b| push[b].total_cmp(&push[a]).then(a.cmp(&b)));
            let mut rows: Vec<usize> =
                order.iter().take(SHOWN).map(|&i| self.dataset.rows[i].number).collect();
            rows.sort_unstable();
            Finding {
                effect: "unexplained".to_owned(),
                cause: format!(
                    "something else is at work that nothing in the catalogue describes: {}{}",
                    self.likeness(),
                    if self.smoothed.is_some() {
                        "; a smooth correction follows a part of it, without saying what it is"
                    } else {
                        ""
                    }
                ),
                confidence: Confidence::Ambiguous,
                rows: None,
                row_list: Some(rows),
                joints: None,
                parameters: Vec::new(),
                evidence: self.evidence(),
                p_value: (-0.5 * self.discrepancy.evidence.max(0.0)).exp().min(1.0),
                non_centrality: None,
                gain: Gain {
                    cv_rmse_before_mm: self.smoothed.unwrap_or(self.after.random.rmse),
                    cv_rmse_after_mm: self.after.random.rmse,
                },
                worth_mm: Some(self.discrepancy.worth_mm()),
                doubts: Vec::new(),
                sessions: Vec::new(),
                alternatives: Vec::new(),
                remedy: words::remedy("unexplained").to_owned(),
            }
        })
    }

    fn evidence(&self) -> String {
        let s = self.structure;
        let mut out = format!(
            "random functions of time and pose beside the causes: twice the log Bayes factor {:.0}",
            self.discrepancy.evidence
        );
        for (r, z, what) in
            [(s.neighbours, s.neighbours_z, "nearest poses"), (s.order, s.order_z, "consecutive rows")]
        {
            if stands_out(r, z) {
                out.push_str(&format!("; residuals of {what} are correlated by {r:.2} (z = {z:.1})"));
            }
        }
        out
    }
}
