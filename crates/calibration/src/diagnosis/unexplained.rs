//! The unexplained part of the residual: a significant discrepancy over poses or time, or noise.

use super::cause_kind::CauseKind;
use super::discrepancy::{Discrepancy, typical_mm};
use super::finding::{Confidence, Finding, Gain, too_much_for_noise};
use super::joint_scatter::JointScatter;
use super::odds;
use super::residual_tests::{Structure, is_structure};
use super::search::Confirmed;
use super::something_else::{Field, RemainingAt, SomethingElse};
use super::validation::StageError;
use super::words;
use crate::measurement::dataset::Dataset;

/// Smallest share of the residual that makes a discrepancy a finding.
const MIN_SHARE: f64 = 0.3;

/// Number of rows listed, those with the largest discrepancy.
const MAX_ROWS: usize = 10;

/// Ratio of residual to noise floor from which the residual is reported.
const FLOOR_RATIO: f64 = 1.5;

/// The residual of the extended model and its discrepancy.
pub(super) struct Unexplained<'a> {
    /// The searched rows.
    pub(super) dataset: &'a Dataset,
    /// The model discrepancy.
    pub(super) discrepancy: &'a Discrepancy,
    /// The joint about which the residual scatters, if there is one.
    pub(super) scatter: Option<&'a JointScatter>,
    /// Correlations of neighbouring residuals.
    pub(super) structure: &'a Structure,
    /// Errors of the extended model.
    pub(super) after: &'a StageError,
    /// The held-out error before a smooth correction, if there is one (mm).
    pub(super) smoothed: Option<f64>,
    /// The noise floor (mm).
    pub(super) floor_mm: Option<f64>,
    /// Whether it was measured by repeated poses.
    pub(super) noise_measured: bool,
}

impl Unexplained<'_> {
    /// Whether the residual has a significant part that is not noise.
    fn is_significant(&self) -> bool {
        self.has_discrepancy() || self.scatter().is_some()
    }

    fn has_discrepancy(&self) -> bool {
        self.discrepancy.is_significant() && self.is_large(self.discrepancy.rms_mm())
    }

    /// The scatter about a joint, where it is a large part of the residual.
    pub(super) fn scatter(&self) -> Option<&JointScatter> {
        self.scatter.filter(|scatter| self.is_large(scatter.rms_mm()))
    }

    fn is_large(&self, mm: f64) -> bool {
        mm > MIN_SHARE * self.after.fitted.rmse
    }

    /// What is not noise (mm), for each row: the discrepancy and the scatter about a joint.
    fn effect_mm(&self) -> Vec<f64> {
        let mut out = match self.has_discrepancy() {
            true => self.discrepancy.effect_mm.clone(),
            false => vec![0.0; self.discrepancy.effect_mm.len()],
        };
        if let Some(scatter) = self.scatter() {
            out.iter_mut().zip(&scatter.effect_mm).for_each(|(sum, mm)| *sum = sum.hypot(*mm));
        }
        out
    }

    /// Its size (mm RMS), no more than the residual.
    fn rms_mm(&self) -> f64 {
        let effect = self.effect_mm();
        let square: f64 = effect.iter().map(|mm| mm * mm).sum();
        (square / effect.len().max(1) as f64).sqrt().min(self.after.fitted.rmse)
    }

    /// One sentence; `None` for a residual at the noise floor.
    pub(super) fn sentence(&self) -> Option<String> {
        let rmse = self.after.fitted.rmse;
        if self.is_significant() {
            return Some(format!(
                "{rmse:.3} mm RMS, of which {:.3} mm is not noise: {}",
                self.rms_mm(),
                self.description()
            ));
        }
        let floor = self.floor_mm.filter(|floor| rmse > FLOOR_RATIO * floor)?;
        let compared = format!("{rmse:.3} mm RMS compared with a noise floor of {floor:.3} mm");
        Some(match (too_much_for_noise(rmse, floor, self.noise_measured), self.noise_measured) {
            (true, _) => format!(
                "{compared}, {:.0} times as much: too much for noise, and without a pattern that a cause in the catalogue explains",
                rmse / floor
            ),
            (false, true) => format!("{compared}, without a pattern: noise of sensor or arm"),
            (false, false) => format!(
                "{compared} (rounding alone), without a pattern: probably noise of sensor or arm; repeated poses would \
                 show how large that is"
            ),
        })
    }

    /// The largest parts of the discrepancy.
    fn description(&self) -> String {
        let mut parts: Vec<(f64, String)> = match self.has_discrepancy() {
            true => self
                .discrepancy
                .contributions
                .iter()
                .take(2)
                .map(|(group, mm)| (*mm, group.words().to_owned()))
                .collect(),
            false => Vec::new(),
        };
        parts.extend(self.scatter().map(|scatter| (scatter.rms_mm(), scatter.words())));
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let parts = parts.into_iter().map(|(mm, words)| format!("{mm:.3} mm as if {words}"));
        let correlated = (self.discrepancy.correlation != 0.0)
            .then(|| format!("consecutive readings are correlated ({:.2})", self.discrepancy.correlation));
        parts.chain(correlated).collect::<Vec<_>>().join("; ")
    }

    /// The finding.
    pub(super) fn finding(&self) -> Option<Finding> {
        self.is_significant().then(|| {
            let effect = self.effect_mm();
            let mut order: Vec<usize> = (0..effect.len()).collect();
            order.sort_by(|&a, &b| effect[b].total_cmp(&effect[a]).then(a.cmp(&b)));
            let mut rows: Vec<usize> =
                order.iter().take(MAX_ROWS).map(|&i| self.dataset.rows[i].number).collect();
            rows.sort_unstable();
            let follows = if self.smoothed.is_some() {
                "; a smooth correction without a physical cause follows part of it"
            } else {
                ""
            };
            let cause = format!(
                "an error remains that no cause in the catalogue explains: {}{follows}",
                self.description()
            );
            let gain = Gain {
                cv_rmse_before_mm: self.smoothed.unwrap_or(self.after.random.rmse),
                cv_rmse_after_mm: self.after.random.rmse,
            };
            let evidence =
                self.discrepancy.evidence.max(self.scatter().map_or(0.0, |scatter| scatter.evidence));
            // The larger part says where.
            let mostly =
                self.scatter().filter(|s| !self.has_discrepancy() || s.rms_mm() > self.discrepancy.rms_mm());
            Finding {
                row_list: Some(rows),
                joints: mostly.map(|scatter| vec![scatter.joint + 1]),
                p_value: (-0.5 * evidence.max(0.0)).exp().min(1.0),
                worth_mm: Some(self.rms_mm()),
                ..words::finding(CauseKind::Unexplained, cause, Confidence::Ambiguous, self.evidence(), gain)
            }
        })
    }

    fn evidence(&self) -> String {
        let s = self.structure;
        let mut out = format!(
            "random functions of time and pose in addition to the causes: {}",
            odds::readings_with_it(self.discrepancy.evidence)
        );
        if let Some(scatter) = self.scatter() {
            out.push_str(&format!(
                "; scatter about joint {}: the residuals are {} times more probable with it (twice the log likelihood ratio {:.0})",
                scatter.joint + 1,
                odds::times(scatter.evidence),
                scatter.evidence
            ));
        }
        for (r, z, what) in
            [(s.neighbours, s.neighbours_z, "nearest poses"), (s.order, s.order_z, "consecutive rows")]
        {
            if is_structure(r, z) {
                out.push_str(&format!("; residuals of {what} are correlated by {r:.2} (z = {z:.1})"));
            }
        }
        out
    }
}

/// Most poses that are handed to a planner.
const MAX_POSES: usize = 300;

/// The same for a planner, of the searched rows.
pub(super) fn something_else(dataset: &Dataset, confirmed: &Confirmed) -> SomethingElse {
    let (linear, discrepancy) = (&confirmed.linear, &confirmed.outcome.discrepancy);
    let mut fields: Vec<Field> = Vec::new();
    for (group, sigma_mm) in &discrepancy.prior_mm {
        fields.extend(group.length_rad().map(|length_rad| Field { length_rad, sigma_mm: *sigma_mm }));
    }
    let times = || dataset.rows.iter().filter_map(|row| row.condition.time_h);
    let hours = times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
    SomethingElse {
        size_mm: discrepancy.rms_mm(),
        in_time_mm: discrepancy.time_mm(),
        over_poses_mm: discrepancy.field_mm(),
        correlation: discrepancy.correlation,
        hours: Some(hours).filter(|h| h.is_finite() && *h > 0.0),
        noise_mm: discrepancy.noise * typical_mm(linear),
        fields,
        poses: remaining(dataset, confirmed),
    }
}

/// The mean residual at each pose.
fn remaining(dataset: &Dataset, confirmed: &Confirmed) -> Vec<RemainingAt> {
    let slopes = &confirmed.linear.slopes;
    let (per, residual) = (confirmed.linear.per, &confirmed.whole.design.residual);
    let shown = per.min(3);
    let count = slopes.poses.iter().max().map_or(0, |last| last + 1);
    let mut sums: Vec<Option<(usize, usize, Vec<f64>)>> = vec![None; count];
    for (i, &pose) in slopes.poses.iter().enumerate() {
        let (_, readings, sum) = sums[pose].get_or_insert_with(|| (i, 0, vec![0.0; shown]));
        *readings += 1;
        for (k, sum) in sum.iter_mut().enumerate() {
            *sum += residual[i * per + k] * slopes.mm[i * per + k];
        }
    }
    let sums: Vec<_> = sums.into_iter().flatten().collect();
    let stride = sums.len().div_ceil(MAX_POSES).max(1);
    sums.into_iter()
        .step_by(stride)
        .map(|(row, readings, sum)| RemainingAt {
            joints_deg: std::array::from_fn(|j| dataset.rows[row].joints[j].to_degrees()),
            residual_mm: sum.into_iter().map(|v| v / readings as f64).collect(),
        })
        .collect()
}
