//! Builds a finding for every accepted cause: size, evidence, confidence and rivals.

use nalgebra::DVector;
use rayon::prelude::*;

use super::along_turn::{along_turn, in_words};
use super::candidates::Scored;
use super::catalogue::{Candidate, LoggedColumns};
use super::cause::{Cause, MAP_KNOTS};
use super::cause_kind::CauseKind;
use super::confirmation::CLEAR_TWICE_LOG_BF;
use super::decision;
use super::design::{Design, FullDesign};
use super::drift;
use super::extension::{Extended, Subject};
use super::finding::{Alternative, Confidence, Family, Finding, Gain, Step};
use super::held_out::{FoldErrors, Reduced};
use super::odds;
use super::picture::{Picture, picture};
use super::score::VISIBLE;
use super::score::{non_centrality, score};
use super::selection::Accepted;
use super::words;
use crate::measurement::sensor::disturbance::{Disturbance, Kind};
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::error_map::ErrorMap;
use truegrind_math::sentence::{counted, listed};

/// A rival (including the model without the finding) whose held-out error is below this share of the finding's is not beaten,
/// whatever the Bayes factor.
const BETTER: f64 = 0.99;

/// Part of a harmonic's period (rad) below which it cannot be distinguished from any other smooth error.
const SHORT_ARC: f64 = 1.0;

/// Joints as on the teach pendant, from 1.
pub(super) fn pendant(joints: &[usize]) -> Option<Vec<usize>> {
    (!joints.is_empty()).then(|| joints.iter().map(|j| j + 1).collect())
}

pub(super) struct FindingBuilder<'a> {
    /// The searched rows: all, or a subset of very many.
    pub(super) subject: &'a Subject<'a>,
    /// The fit to the searched rows.
    pub(super) fit: &'a Extended,
    /// The fit to all rows.
    pub(super) extended: &'a Extended,
    /// The linearised fit to the searched rows.
    pub(super) whole: &'a FullDesign,
    /// Its cross-validation.
    pub(super) held: &'a FoldErrors<'a>,
    pub(super) set_aside: &'a [usize],
}

/// The model without a cause, and what each predicts of held-out rows.
#[derive(Clone, Copy)]
struct Beside<'a> {
    without: &'a Design,
    held: &'a Reduced<'a>,
    before_mm: f64,
    after_mm: f64,
}

/// Whether a cause is told apart from every alternative.
struct CauseVerdict {
    clear: bool,
    alternatives: Vec<Alternative>,
    doubts: Vec<String>,
}

impl FindingBuilder<'_> {
    /// The findings, the index of each cause's finding, and their pictures. Causes of the same effect and joint share one.
    pub(super) fn findings(
        &self,
        accepted: &[Accepted],
        steps: &mut Vec<Step>,
    ) -> (Vec<Finding>, Vec<usize>, Vec<Picture>) {
        let mut pictures = Vec::new();
        let mut findings: Vec<Finding> = Vec::new();
        let mut places = Vec::new();
        let after_mm = self.held.without(&[]).rmse_mm(None, self.set_aside);
        let judged: Vec<(f64, Finding, Picture)> = accepted
            .par_iter()
            .enumerate()
            .map(|(index, own)| {
                let later: Vec<usize> =
                    (index + 1..accepted.len()).flat_map(|k| self.fit.parameter_indices(k)).collect();
                let step = self.held.without(&later).rmse_mm(None, self.set_aside);
                let (finding, picture) = self.finding(index, own, after_mm);
                (step, finding, picture)
            })
            .collect();
        for (index, (step, finding, picture)) in judged.into_iter().enumerate() {
            let cause = &self.extended.causes[index];
            steps.push(Step { added: short_name(cause), cv_rmse_mm: step });
            let existing = findings.iter().position(|f: &Finding| {
                cause.rows().is_none()
                    && f.effect == cause.kind()
                    && f.rows.is_none()
                    && f.joints == pendant(&cause.joints())
            });
            // Thermal growth of the arm and thermal drift of the sensor have the same name but are separate findings.
            let existing = existing.filter(|index_of| {
                let first = places.iter().position(|p| p == index_of).unwrap_or(index);
                self.extended.causes[first].affects_same_quantity(cause)
            });
            if let Some(place) = existing {
                findings[place].add_term(finding.cause);
                findings[place].parameters.extend(finding.parameters);
                places.push(place);
                continue;
            }
            places.push(findings.len());
            findings.push(finding);
            pictures.push(picture);
        }
        for (place, finding) in findings.iter_mut().enumerate() {
            let of_finding = || (0..places.len()).filter(|&index| places[index] == place);
            self.tell_change_along_turn(finding, of_finding());
            self.tell_sum_of_drifts(finding, of_finding());
        }
        (findings, places, pictures)
    }

    /// Adds to a finding of a gear's transmission where along the turn it is largest, if it changes there.
    fn tell_change_along_turn(&self, finding: &mut Finding, indices: impl Iterator<Item = usize>) {
        let (CauseKind::GearTransmission, Some(&[joint])) = (finding.effect, finding.joints.as_deref())
        else {
            return;
        };
        let causes: Vec<&Cause> = indices.map(|index| &self.extended.causes[index]).collect();
        if let Some(stretches) = along_turn(self.subject, joint - 1, &causes) {
            finding.add_term(in_words(stretches));
        }
    }

    /// States several drifts of one quantity as the movement of their sum, and several terms of growth as their growth.
    fn tell_sum_of_drifts(&self, finding: &mut Finding, indices: impl Iterator<Item = usize>) {
        let dataset = &self.subject.observed.dataset;
        let (mut drifts, mut growth, mut others) = (Vec::new(), Vec::new(), Vec::new());
        for index in indices {
            match &self.extended.causes[index] {
                Cause::Measurement(disturbance) if drift::is_in_time(disturbance) => drifts.push(disturbance),
                Cause::Arm(effect) if drift::is_growth_in_time(effect) => growth.push(effect),
                other => {
                    let parameters = words::found_parameters(self.extended, index);
                    others.push(words::describe_cause(other, &parameters, dataset, &self.extended.frames));
                }
            }
        }
        if drifts.len() < 2 && growth.len() < 2 {
            return;
        }
        let moved = (!drifts.is_empty()).then(|| drift::describe(&drifts, dataset, &self.extended.frames));
        let grown = (!growth.is_empty()).then(|| drift::describe_growth(&growth, dataset));
        finding.set_terms(moved.into_iter().chain(grown).chain(others).collect());
    }

    /// Whether the joint moved through so small a part of a turn, or of a harmonic's period, that any smooth joint error fits.
    fn is_any_curve(&self, cause: &Cause) -> bool {
        let range = |joint: usize| LoggedColumns::of(&self.subject.observed.dataset).range_rad[joint];
        match cause {
            Cause::Arm(Effect::GearEccentricity(h) | Effect::GearTransmission(h)) => {
                range(h.joint) * h.order < SHORT_ARC
            }
            Cause::Arm(Effect::GearMap(map)) => range(map.joint) < SHORT_ARC,
            _ => false,
        }
    }

    /// For a harmonic of such a joint: the joint's error map as a rival, which fits any smooth curve.
    fn any_curve(&self, cause: &Cause) -> Option<Candidate> {
        let Cause::Arm(Effect::GearEccentricity(harmonic)) = cause else { return None };
        self.is_any_curve(cause).then(|| {
            let map = ErrorMap { joint: harmonic.joint, knots_rad: vec![0.0; MAP_KNOTS] };
            Candidate::arm(Effect::GearMap(map), &self.subject.observed.dataset, self.subject.nominal)
        })
    }

    /// The best rivals of an accepted cause, each fitted in its place.
    fn rivals(&self, own: &Accepted, without: &Design, held: &Reduced<'_>) -> Vec<Alternative> {
        let alternative = |rival: &Scored| {
            let columns = rival.candidate.columns(without);
            let sizes = rival.candidate.cause.sizes();
            Alternative {
                effect: rival.candidate.cause.kind(),
                joints: pendant(&rival.candidate.cause.joints()),
                rows: rival.candidate.cause.rows(),
                family: decision::family_of(&rival.candidate.cause),
                cv_rmse_mm: held.rmse_mm(Some((&columns, &sizes)), self.set_aside),
                twice_log_bayes_factor: own.own.merit - rival.score.merit,
            }
        };
        own.rivals.iter().take(3).map(alternative).collect()
    }

    /// Compares a cause with its alternatives.
    fn verdict(&self, cause: &Cause, own: &Accepted, beside: &Beside<'_>) -> CauseVerdict {
        let Beside { without, held, before_mm, after_mm } = *beside;
        let mut alternatives = self.rivals(own, without, held);
        let mut clear = alternatives.iter().all(|rival| is_beaten(rival, after_mm));
        let plain = |effect, family, cv_rmse_mm, twice_log_bayes_factor| Alternative {
            effect,
            joints: None,
            rows: None,
            family,
            cv_rmse_mm,
            twice_log_bayes_factor,
        };
        // A finding that raises the held-out error is not confirmed, however well it fits the other rows.
        let unconfirmed = before_mm < BETTER * after_mm;
        if unconfirmed || own.information_beside_growth.is_some_and(|lambda| lambda < VISIBLE) {
            clear = false;
            alternatives.insert(0, plain(CauseKind::LinkGeometry, Family::Arm, before_mm, own.own.merit));
        }
        if let Some(effect) = same_readings(cause) {
            clear = false;
            alternatives.retain(|other| other.effect != effect);
            let rows = cause.rows();
            alternatives.insert(0, Alternative { rows, ..plain(effect, Family::SetUp, after_mm, 0.0) });
        }
        let mut doubts = Vec::new();
        if self.is_any_curve(cause) {
            clear = false;
            doubts.push(
                "the joint moved through too small a part of a turn to distinguish this from other faults of the joint"
                    .to_owned(),
            );
        }
        if let Some(map) = self.any_curve(cause)
            && !alternatives.iter().any(|a| a.effect == map.cause.kind())
        {
            let columns = map.columns(without);
            let cv_rmse_mm = held.rmse_mm(Some((&columns, &map.cause.sizes())), self.set_aside);
            let twice_log_bayes_factor = own.own.merit - score(without, &map).merit;
            let family = decision::family_of(&map.cause);
            let joints = pendant(&map.cause.joints());
            alternatives.push(Alternative {
                joints,
                ..plain(map.cause.kind(), family, cv_rmse_mm, twice_log_bayes_factor)
            });
        }
        CauseVerdict { clear, alternatives, doubts }
    }

    fn finding(&self, index: usize, own: &Accepted, after_mm: f64) -> (Finding, Picture) {
        let cause = &self.extended.causes[index];
        let parameters = words::found_parameters(self.extended, index);
        let places = self.fit.parameter_indices(index);
        let without = self.whole.without(&places);
        let held = self.held.without(&places);
        let before_mm = held.rmse_mm(None, self.set_aside);
        let beside = Beside { without: &without, held: &held, before_mm, after_mm };
        let CauseVerdict { clear, alternatives, doubts } = self.verdict(cause, own, &beside);
        let values = DVector::from_iterator(own.own.estimate.len(), own.own.estimate.iter().copied());
        let lambda = non_centrality(&own.own.information, &values);
        let picture = picture(self.subject, cause, &without, &self.whole.design);
        let measured = (&self.subject.observed.dataset, &self.extended.frames);
        let finding = Finding {
            effect: cause.kind(),
            cause: words::describe_cause(cause, &parameters, measured.0, measured.1),
            terms: Vec::new(),
            shift: words::describe_shift(cause, &parameters, measured),
            confidence: if clear { Confidence::Identified } else { Confidence::Ambiguous },
            rows: cause.rows(),
            row_list: None,
            rows_in_file: None,
            joints: pendant(&cause.joints()),
            evidence: format!(
                "{}: χ² falls by {:.0} for {} with everything else refitted; {}; {} tried",
                words::describe_pattern(cause),
                own.own.gain,
                counted(own.own.estimate.len(), "parameter", "parameters"),
                odds::readings_with_it(own.own.evidence),
                counted(own.tried.round() as usize, "variant", "variants"),
            ),
            parameters,
            p_value: own.log_p.exp(),
            non_centrality: Some(lambda),
            gain: Gain { cv_rmse_before_mm: before_mm, cv_rmse_after_mm: after_mm },
            worth_mm: None,
            doubts,
            sessions: Vec::new(),
            family: Some(decision::family_of(cause)),
            margin: None,
            members: Vec::new(),
            decided_by: None,
            corrected: None,
            alternatives,
            remedy: words::remedy_of(cause).to_owned(),
        };
        (finding, picture)
    }
}

/// The disturbance that changes every reading as `cause` does: a base that turned about the axis of joint 1 moves the sensor against the
/// arm, a target that turned about the axis of joint 6 moves on the flange. That they have more parameters says nothing against them.
fn same_readings(cause: &Cause) -> Option<CauseKind> {
    match cause {
        Cause::Measurement(Disturbance { kind: Kind::JointZero { joint: 0 }, .. }) => {
            Some(CauseKind::SensorFrameShift)
        }
        Cause::Measurement(Disturbance { kind: Kind::JointZero { joint: 5 }, .. }) => {
            Some(CauseKind::ToolShift)
        }
        _ => None,
    }
}

/// Whether a finding clearly beats a rival; `after_mm` is the held-out error with the finding.
fn is_beaten(rival: &Alternative, after_mm: f64) -> bool {
    rival.twice_log_bayes_factor >= CLEAR_TWICE_LOG_BF && !(rival.cv_rmse_mm < BETTER * after_mm)
}

/// Whether a spring of the arm is certain and only its place is not: every rival that might be true is another spring, a link or a joint.
/// The arm is nearer to the truth with it than without.
pub(super) fn is_some_spring(finding: &Finding) -> bool {
    let spring =
        |kind| matches!(kind, CauseKind::JointCompliance | CauseKind::LinkBending | CauseKind::LinkTwist);
    let after_mm = finding.gain.cv_rmse_after_mm;
    let mut rivals = finding.alternatives.iter().filter(|rival| !is_beaten(rival, after_mm));
    spring(finding.effect) && finding.doubts.is_empty() && rivals.all(|rival| spring(rival.effect))
}

pub(super) fn short_name(cause: &Cause) -> String {
    let joints = cause.joints();
    match (joints.as_slice(), cause.rows()) {
        ([], Some([from, to])) => format!("{} in rows {from} to {to}", cause.kind()),
        ([], None) => cause.kind().to_string(),
        ([joint], _) => format!("{} of joint {}", cause.kind(), joint + 1),
        (many, _) => {
            format!("{} of joints {}", cause.kind(), listed(many.iter().map(|j| j + 1)))
        }
    }
}
