//! Confounding: doubts about findings that might be residues of a larger fault whose exact law is unknown.
//!
//! An empirical fault (or a discrepancy field over poses, or a sensor noisier than its repeatability) leaves residues wherever its
//! true law differs from the fitted expansion, and smooth causes of the arm absorb them. A cause's unique contribution, beyond
//! everything else that is free in the model, is compared with that of the empirical fault: a smaller one might be its residue.
//! The same holds for a small cause next to a larger one of the same joint, since no model of a spring or a gear is exact.

use super::cause::{Cause, Part};
use super::cause_kind::CauseKind;
use super::confirmation::Confirmation;
use super::contribution::Contributions;
use super::play_flanks;
use crate::measurement::dataset::Dataset;
use truegrind_arm::model::Model;
use truegrind_math::distribution::chi_square_quantile;

/// The model's causes and unexplained errors, as possible confounders.
pub(super) struct Confounding<'a> {
    /// The causes of the fit.
    pub(super) causes: &'a [Cause],
    /// Their confirmations.
    pub(super) confirmations: &'a [Confirmation],
    /// Their contributions.
    pub(super) contributions: &'a Contributions<'a>,
    /// The data sheet's arm.
    pub(super) nominal: &'a Model,
    /// Whether one cable measures: its length shows of a motion what is along the cable alone.
    pub(super) by_one_cable: bool,
    /// The rows.
    pub(super) dataset: &'a Dataset,
    /// Unexplained growth of the arm over time (mm RMS).
    pub(super) growth_mm: f64,
    /// Unexplained dependence on the pose (mm RMS).
    pub(super) field_mm: f64,
    /// Residual in excess of the noise of repeated poses (mm RMS); 0 where insignificant or unknown.
    pub(super) excess_over_noise_mm: f64,
}

/// Ratio of residual to noise from which the residual exceeds the noise.
const EXCESS_RATIO: f64 = 1.5;

/// Probability with which the noise of few repeated poses is larger than its upper bound.
const NOISE_ABOVE: f64 = 0.01;

/// Share of another cause of its joint below which a smooth cause might be a residue of it.
const RESIDUE_SHARE: f64 = 0.15;

/// The same for an error of two joints, relative to the compliance of either.
const TWO_JOINT_SHARE: f64 = 0.5;

/// Share of the drift of stand or zero from which growth of the arm explains both.
const GROWTH_SHARE: f64 = 0.25;

/// Movement of the readings by a drift of the sensor over what it explains from which it may be a compensation.
const COMPENSATED: f64 = 10.0;

/// Residual in excess of the noise of repeated poses, estimated with so many degrees of freedom (mm RMS); 0 where it might be noise.
pub(super) fn excess_over_noise_mm(left_mm: f64, noise_mm: f64, freedom: usize) -> f64 {
    if freedom == 0 {
        return 0.0;
    }
    let at_most = noise_mm * (freedom as f64 / chi_square_quantile(1.0 - NOISE_ABOVE, freedom)).sqrt();
    if left_mm > at_most.max(EXCESS_RATIO * noise_mm) {
        (left_mm * left_mm - noise_mm * noise_mm).sqrt()
    } else {
        0.0
    }
}

impl Confounding<'_> {
    /// Doubts about causes that share a finding; empty if they have no confounder.
    pub(super) fn doubts(&self, causes: &[usize]) -> Vec<String> {
        let all = |test: &dyn Fn(&Cause) -> bool| causes.iter().all(|&k| test(&self.causes[k]));
        if causes.is_empty() {
            return Vec::new();
        }
        let own = self.contributions.unique_rms_mm(causes);
        if all(&Cause::is_thermal) {
            let compensated = self.by_compensation(causes, own);
            return self.by_other_thermal_cause(causes, own).into_iter().chain(compensated).collect();
        }
        if all(&|cause| cause.rows().is_some()) {
            return self
                .by_empirical_fault(own)
                .or_else(|| self.by_growth(causes, own))
                .or_else(|| self.by_flank(causes))
                .into_iter()
                .collect();
        }
        if !all(&Cause::is_in_arm) {
            return if all(&Cause::is_empirical) {
                self.by_other_sensor_fault(causes, own).into_iter().collect()
            } else {
                Vec::new()
            };
        }
        let smooth = all(&Cause::is_smooth);
        let mut out = Vec::new();
        if self.by_one_cable && all(&|cause| cause.kind() == CauseKind::BaseTilt) {
            out.push(
                "one cable shows what a base that tilts does along it and not across it, and along it a cable that sags or whose pulley is \
                 worn may do the same"
                    .to_owned(),
            );
        }
        let rough = self.empirical_rms_mm(causes, smooth);
        let (whole, sensor) = (self.contributions.rms_mm(causes), self.sensor_fault_rms_mm());
        if own < rough {
            out.push(format!(
                "beyond geometry it explains only {own:.4} mm, less than the {rough:.4} mm of another fault whose exact form is \
                 unknown: it may be a part of that one"
            ));
        } else if smooth && whole < sensor {
            out.push(format!(
                "it contributes {whole:.4} mm, less than the {sensor:.4} mm of a sensor fault whose exact form is unknown: it may be \
                 a part of that one"
            ));
        }
        if own < self.excess_over_noise_mm {
            out.push(format!(
                "sensor not excluded: beyond geometry it explains {own:.4} mm, while {:.4} mm in excess of the noise of repeated poses remain",
                self.excess_over_noise_mm
            ));
        }
        if all(&|cause| cause.follows_gravity_angle(self.nominal)) {
            out.push(
                "it depends on the angle relative to gravity: a compliance or backlash with an unknown law looks the same"
                    .to_owned(),
            );
        }
        if smooth && let Some(joint) = self.residue_of(causes, own) {
            out.push(format!(
                "it is small compared with another cause of joint {} and might be a residue of that",
                joint + 1
            ));
        }
        out
    }

    /// A drift of the sensor that is many times what it explains: links and frames, or another cause, take up nearly all of it, so that its
    /// size is what cancels theirs.
    fn by_compensation(&self, causes: &[usize], own: f64) -> Option<String> {
        if causes.iter().any(|&k| self.causes[k].is_in_arm()) {
            return None;
        }
        let moved = self.contributions.movement_rms_mm(causes);
        (moved > COMPENSATED * own).then(|| {
            format!(
                "it moves the readings by {moved:.4} mm but explains only {own:.4} mm, since links and frames cancel the rest: its \
                 size is not reliable"
            )
        })
    }

    /// A shift in some rows next to a larger empirical fault: rows in which the expansion of that is worst look shifted.
    fn by_empirical_fault(&self, own: f64) -> Option<String> {
        let rough = |k: &usize| self.causes[*k].is_empirical() && self.confirmations[*k].is_significant();
        let larger =
            (0..self.causes.len()).filter(rough).find(|&k| own < self.contributions.unique_rms_mm(&[k]))?;
        Some(format!(
            "beyond all other causes it explains {own:.4} mm, less than {}, whose exact law is unknown: it might be a residue of that",
            self.causes[larger].kind()
        ))
    }

    /// A joint's zero that moved in some rows, by less than the arm grew: links that warm up unequally turn joints too.
    fn by_growth(&self, causes: &[usize], own: f64) -> Option<String> {
        if causes.iter().any(|&k| self.causes[k].kind() != CauseKind::JointZeroShift) {
            return None;
        }
        // It need not be identified to leave residues.
        let grows = |k: &usize| self.causes[*k].is_growth_of_arm() && self.confirmations[*k].is_significant();
        let growth: Vec<usize> = (0..self.causes.len()).filter(grows).collect();
        let theirs = self.contributions.unique_rms_mm(&growth).hypot(self.growth_mm);
        (own < theirs).then(|| {
            format!("it explains {own:.4} mm, less than the growth of the arm, {theirs:.4} mm: links that warm up unequally look the same")
        })
    }

    /// A joint's zero that moved as a play moves it.
    fn by_flank(&self, causes: &[usize]) -> Option<String> {
        let doubt = |&k: &usize| play_flanks::doubt(self.causes, k, self.dataset, self.nominal);
        let doubts: Option<Vec<&str>> = causes.iter().map(doubt).collect();
        doubts?.first().map(|doubt| (*doubt).to_owned())
    }

    /// The largest contribution of an empirical fault (mm RMS).
    pub(super) fn largest_empirical_rms_mm(&self) -> f64 {
        let rough = |k: &usize| self.causes[*k].is_empirical() && self.confirmations[*k].is_significant();
        (0..self.causes.len()).filter(rough).map(|k| self.contributions.rms_mm(&[k])).fold(0.0, f64::max)
    }

    /// The largest contribution of an empirical sensor fault, with the arm's geometry fixed (mm RMS).
    fn sensor_fault_rms_mm(&self) -> f64 {
        let of_sensor = |k: &usize| {
            let cause = &self.causes[*k];
            cause.is_empirical() && !cause.is_in_arm() && self.confirmations[*k].is_significant()
        };
        (0..self.causes.len()).filter(of_sensor).map(|k| self.contributions.rms_mm(&[k])).fold(0.0, f64::max)
    }

    fn others<'a>(&'a self, causes: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
        (0..self.causes.len()).filter(|k| !causes.contains(k) && self.confirmations[*k].is_confirmed())
    }

    /// The largest unique contribution of an empirical fault of which these causes might be residues (mm RMS).
    fn empirical_rms_mm(&self, causes: &[usize], smooth: bool) -> f64 {
        let parts: Vec<Option<(Part, usize)>> = causes.iter().map(|&k| self.causes[k].part()).collect();
        // An empirical fault need not be identified to leave residues.
        let there = |k: &usize| !causes.contains(k) && self.confirmations[*k].is_significant();
        let rough = (0..self.causes.len()).filter(there).filter(|&k| self.causes[k].is_empirical());
        let rough = rough.filter(|&k| {
            let part = self.causes[k].part().filter(|_| self.causes[k].is_in_arm());
            // A spring and its nonlinearity do not confound each other, and neither do the errors of one gear.
            let same = part.is_some() && parts.contains(&part);
            let joint = |p: &Option<(Part, usize)>| p.map(|p| p.1);
            let at_joint = part.is_some() && parts.iter().all(|p| joint(p) == joint(&part));
            !same && (smooth || at_joint)
        });
        let single = rough.map(|k| self.contributions.unique_rms_mm(&[k])).fold(0.0, f64::max);
        if !smooth {
            return single;
        }
        let cable: Vec<usize> = self.others(causes).filter(|&k| self.causes[k].is_in_cable()).collect();
        // Two models of one cable fault: neither is exact.
        let cable = if cable.len() > 1 { self.contributions.unique_rms_mm(&cable) } else { 0.0 };
        single.max(cable).max(self.field_mm)
    }

    /// The joint of a much larger cause of which these might be the residue.
    fn residue_of(&self, causes: &[usize], own: f64) -> Option<usize> {
        let cause = &self.causes[*causes.first()?];
        let (_, at) = cause.part()?;
        let joints = cause.joints();
        self.others(causes).filter(|&k| self.causes[k].is_in_arm()).find_map(|k| {
            let (part, joint) = self.causes[k].part()?;
            // The gravity torque of a joint depends on the angles of the joints before it: the residue of a compliance with wrong
            // masses looks like a two-joint error.
            let together = part == Part::Spring && joints.len() > 1 && joints.contains(&joint);
            let share = if together { TWO_JOINT_SHARE } else { RESIDUE_SHARE };
            let near = together || joint == at;
            (near && own < share * self.contributions.unique_rms_mm(&[k])).then_some(joint)
        })
    }

    /// One temperature change moves the arm, the stand and the zero. Links that warm unequally look like a moving stand, since the
    /// first link is a stand; so growth of the arm has precedence, unless it is small compared with the drift.
    fn by_other_thermal_cause(&self, causes: &[usize], own: f64) -> Option<String> {
        let first = &self.causes[causes[0]];
        let warm = self.others(causes).filter(|&k| self.causes[k].is_thermal());
        let other: Vec<usize> = warm.filter(|&k| !first.affects_same_quantity(&self.causes[k])).collect();
        let theirs = self.contributions.unique_rms_mm(&other);
        let growth = other.iter().any(|&k| self.causes[k].is_in_arm());
        // Growth in the discrepancy counts like growth as a cause.
        let (theirs, growth) = if !first.is_in_arm() && !growth && self.growth_mm > 0.0 {
            (theirs.hypot(self.growth_mm), true)
        } else {
            (theirs, growth)
        };
        let share = match (first.is_in_arm(), growth) {
            (true, _) => GROWTH_SHARE,
            (false, true) => 1.0 / GROWTH_SHARE,
            // No thermal growth in the arm.
            (false, false) => 0.0,
        };
        (own < share * theirs).then(|| {
            format!("another cause with the same thermal profile explains {theirs:.4} mm, this one {own:.4} mm: it might be a part of that")
        })
    }

    /// An empirical sensor fault next to a larger one of another part of the sensor.
    fn by_other_sensor_fault(&self, causes: &[usize], own: f64) -> Option<String> {
        let of_cable = |k: usize| self.causes[k].is_in_cable();
        let name = self.causes[causes[0]].kind();
        let larger = self
            .others(causes)
            .filter(|&k| self.causes[k].is_empirical() && !self.causes[k].is_in_arm())
            .filter(|&k| self.causes[k].kind() != name && !(of_cable(k) && of_cable(causes[0])))
            .find(|&k| own < self.contributions.unique_rms_mm(&[k]))?;
        Some(format!(
            "it contributes less than {} and might be a residue of that",
            self.causes[larger].kind()
        ))
    }
}
