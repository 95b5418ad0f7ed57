//! Merges findings for the report, and ranks them by their contribution (mm RMS): what nothing else in the model explains, since links
//! and frames absorb most of a movement that grows with the angles.
//!
//! Causes of one effect and joint share a finding already. Here three or more shifts are merged ("the set-up changed with
//! time"), as are shifts that cannot be distinguished from a smooth drift; small contributions are merged without naming a
//! part. If that is still more than a person reads at once, one effect at several joints is one finding.

use std::collections::BTreeSet;

use super::cause::Cause;
use super::cause_kind::CauseKind;
use super::confirmation::Confirmation;
use super::confounding::Confounding;
use super::contribution::Contributions;
use super::discrepancy::Discrepancy;
use super::finding::{Confidence, Family, Finding, FoundParameter, Gain, Session};
use super::findings::is_some_spring;
use super::picture::Picture;
use super::words;
use truegrind_math::sentence::listed;

/// A finding with its causes.
#[derive(Debug, Clone)]
pub(super) struct MergedFinding {
    pub(super) finding: Finding,
    pub(super) picture: Option<Picture>,
    /// Indices of its causes in the fit.
    pub(super) causes: Vec<usize>,
    /// Those of them that are doubtful, in a finding that also has others.
    pub(super) doubted: Vec<usize>,
}

impl MergedFinding {
    /// A finding on the record or the data sheet, which no cause of the fit stands behind.
    pub(super) fn without_cause(finding: Finding) -> Self {
        Self { finding, picture: None, causes: Vec::new(), doubted: Vec::new() }
    }
}

/// Number of shifts from which they are merged.
const MANY_SHIFTS: usize = 3;

/// Contribution, as a share of the error of geometry alone, below which a finding is a small disturbance.
const SMALL_SHARE: f64 = 0.02;

/// Number of findings with a cause above which small doubtful ones are merged.
const MAX_REPORTED: usize = 9;

/// Contribution, as a share of that error, from which a doubtful finding is always reported separately.
const DOUBTFUL_SHARE: f64 = 0.1;

/// Contribution, as a share of that error, from which an identified finding is always reported separately.
const IDENTIFIED_SHARE: f64 = 0.2;

/// The findings with the causes that refer to them, in the order of `findings`.
pub(super) fn from_findings(
    findings: Vec<Finding>,
    finding_of_cause: &[usize],
    pictures: Vec<Picture>,
) -> Vec<MergedFinding> {
    findings
        .into_iter()
        .zip(pictures)
        .enumerate()
        .map(|(place, (finding, picture))| MergedFinding {
            finding,
            picture: Some(picture),
            causes: (0..finding_of_cause.len()).filter(|&k| finding_of_cause[k] == place).collect(),
            doubted: Vec::new(),
        })
        .collect()
}

/// Marks unconfirmed findings, computes contributions, and merges findings.
pub(super) fn merge_findings(
    mut findings: Vec<MergedFinding>,
    confirmations: &[Confirmation],
    discrepancy: &Discrepancy,
    confounding: &Confounding<'_>,
    geometric_mm: f64,
) -> Vec<MergedFinding> {
    let contributions = confounding.contributions;
    for merged in &mut findings {
        // A finding is confirmed with any of its causes, but bears the name of the first.
        let first = merged.causes.first();
        let is_implausible = first.is_some_and(|&k| !confirmations[k].plausible);
        if is_implausible || !merged.causes.iter().any(|&k| confirmations[k].is_confirmed()) {
            merged.finding.confidence = Confidence::Ambiguous;
            merged.finding.doubts.extend(first.map(|&k| confirmations[k].doubts()).unwrap_or_default());
        }
        merged.finding.worth_mm = Some(contributions.unique_rms_mm(&merged.causes));
        merged.finding.margin =
            merged.causes.iter().map(|&k| confirmations[k].margin).reduce(f64::max).filter(|m| m.is_finite());
    }
    for merged in &mut findings {
        let doubts = confounding.doubts(&merged.causes);
        if !doubts.is_empty() {
            merged.finding.confidence = Confidence::Ambiguous;
            merged.finding.doubts.extend(doubts);
        }
    }
    let smooth = discrepancy.in_time();
    let is_shift = |s: &MergedFinding| s.finding.rows.is_some();
    let is_absorbed = |s: &MergedFinding| smooth && s.causes.iter().all(|&k| !confirmations[k].significant);
    let shifts = findings.iter().filter(|s| is_shift(s)).count();
    if shifts >= MANY_SHIFTS || findings.iter().any(|s| is_shift(s) && is_absorbed(s)) {
        merge(&mut findings, is_shift, contributions, |members, worth_mm| {
            let steps = shifts >= MANY_SHIFTS && !members.iter().all(is_absorbed);
            setup_change(members, worth_mm, steps, smooth)
        });
    }
    let small = |s: &MergedFinding| s.finding.worth_mm.is_some_and(|w| w < SMALL_SHARE * geometric_mm);
    let excess = excess(&findings, small, DOUBTFUL_SHARE * geometric_mm);
    let is_excess = |s: &MergedFinding| s.causes.first().is_some_and(|k| excess.contains(k));
    if findings.iter().any(|s| small(s) || is_excess(s)) {
        let excess_only = !excess.is_empty();
        let build = |members: &[MergedFinding], mm: f64| small_disturbances(members, mm, excess_only);
        merge(&mut findings, |s| small(s) || is_excess(s), contributions, build);
        let small_finding = findings.iter_mut().find(|s| s.finding.effect == CauseKind::SmallDisturbances);
        small_finding.into_iter().for_each(|s| s.doubted = excess.clone());
    }
    merge_joints(&mut findings, contributions, IDENTIFIED_SHARE * geometric_mm);
    findings
}

/// Merges identified findings of one effect at several joints, the smallest effect first, while more than [`MAX_REPORTED`] findings
/// are left. Effects that contribute `separate_mm` at any joint stay separate.
fn merge_joints(findings: &mut Vec<MergedFinding>, contributions: &Contributions<'_>, separate_mm: f64) {
    let is_member = |s: &MergedFinding, effect: CauseKind| {
        let finding = &s.finding;
        finding.effect == effect
            && finding.confidence == Confidence::Identified
            && finding.rows.is_none()
            && finding.joints.as_ref().is_some_and(|joints| joints.len() == 1)
    };
    while findings.len() > MAX_REPORTED {
        let largest = |effect: CauseKind| -> Option<f64> {
            let members: Vec<f64> = findings
                .iter()
                .filter(|s| is_member(s, effect))
                .map(|s| s.finding.worth_mm.unwrap_or(f64::INFINITY))
                .collect();
            (members.len() > 1).then(|| members.iter().copied().fold(0.0, f64::max))
        };
        let smallest = findings
            .iter()
            .filter_map(|s| Some((largest(s.finding.effect)?, s.finding.effect)))
            .filter(|(largest, _)| *largest < separate_mm)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, effect)) = smallest else { return };
        merge(findings, |s| is_member(s, effect), contributions, several_joints);
    }
}

/// One effect at several joints. Its p-value is that of the least significant of them.
fn several_joints(members: &[MergedFinding], worth_mm: f64) -> Finding {
    let mut members: Vec<&MergedFinding> = members.iter().collect();
    members.sort_by_key(|s| s.finding.joints.clone());
    let first = &members[0].finding;
    let findings = || members.iter().map(|s| &s.finding);
    let joint = |finding: &Finding| finding.joints.as_ref().map_or(0, |joints| joints[0]);
    let parameters = findings().flat_map(|finding| {
        let at = joint(finding);
        finding.parameters.iter().map(move |parameter| FoundParameter {
            name: format!("joint {at} {}", parameter.name),
            ..parameter.clone()
        })
    });
    let mut merged = Finding {
        joints: Some(findings().map(joint).collect()),
        parameters: parameters.collect(),
        evidence: findings().map(|f| f.evidence.as_str()).collect::<Vec<_>>().join("; "),
        p_value: findings().map(|f| f.p_value).fold(0.0, f64::max),
        non_centrality: findings().filter_map(|f| f.non_centrality).reduce(f64::min),
        gain: gain(members.iter().copied()),
        worth_mm: Some(worth_mm),
        alternatives: findings().flat_map(|f| f.alternatives.iter().cloned()).collect(),
        ..first.clone()
    };
    let terms = |f: &Finding| if f.terms.is_empty() { vec![f.cause.clone()] } else { f.terms.clone() };
    merged.set_terms(findings().flat_map(terms).collect());
    merged
}

/// Causes of doubtful findings below `doubtful_mm`, smallest first, as many as exceed [`MAX_REPORTED`].
fn excess(
    findings: &[MergedFinding],
    small: impl Fn(&MergedFinding) -> bool,
    doubtful_mm: f64,
) -> Vec<usize> {
    let worth = |s: &MergedFinding| s.finding.worth_mm.unwrap_or(f64::INFINITY);
    let reported: Vec<&MergedFinding> = findings.iter().filter(|s| !small(s)).collect();
    if reported.len() <= MAX_REPORTED {
        return Vec::new();
    }
    let doubted =
        |s: &&&MergedFinding| s.finding.confidence == Confidence::Ambiguous && worth(s) < doubtful_mm;
    let mut least: Vec<&&MergedFinding> = reported.iter().filter(doubted).collect();
    least.sort_by(|a, b| worth(a).total_cmp(&worth(b)));
    // The merged finding takes one line.
    let beyond = reported.len() + 1 - MAX_REPORTED;
    least.into_iter().take(beyond).flat_map(|s| s.causes.iter().copied()).collect()
}

/// For each of `causes`, whether it is certain enough for compensation. Causes beyond the confirmed ones (the smooth correction, which
/// held-out rows have confirmed) are.
pub(super) fn certain_flags(
    findings: &[MergedFinding],
    confirmations: &[Confirmation],
    causes: &[Cause],
) -> Vec<bool> {
    let mut out: Vec<bool> = confirmations.iter().map(Confirmation::is_confirmed).collect();
    // Growth with several time constants is one course: its terms nearly cancel, so that one of them alone would be another arm.
    for merged in findings {
        let growth = || merged.causes.iter().copied().filter(|&k| causes[k].is_growth_of_arm());
        if growth().any(|k| out[k]) {
            growth().for_each(|k| out[k] = true);
        }
    }
    for merged in findings.iter().filter(|s| s.finding.effect != CauseKind::SmallDisturbances) {
        if merged.finding.confidence == Confidence::Ambiguous && !is_some_spring(&merged.finding) {
            merged.causes.iter().for_each(|&k| out[k] = false);
        }
    }
    findings.iter().flat_map(|s| &s.doubted).for_each(|&k| out[k] = false);
    out
}

/// Sorts findings by descending contribution; those without one come last (stable).
pub(super) fn rank(findings: &mut [MergedFinding]) {
    let key = |s: &MergedFinding| s.finding.worth_mm.unwrap_or(-1.0);
    findings.sort_by(|a, b| key(b).total_cmp(&key(a)));
}

/// Replaces the findings selected by `of` with a merged one, at the index of the first.
fn merge(
    findings: &mut Vec<MergedFinding>,
    of: impl Fn(&MergedFinding) -> bool,
    contributions: &Contributions<'_>,
    build: impl FnOnce(&[MergedFinding], f64) -> Finding,
) {
    let first = findings.iter().position(&of).unwrap_or(0);
    let (members, mut others): (Vec<MergedFinding>, Vec<MergedFinding>) = findings.drain(..).partition(of);
    let causes: Vec<usize> = members.iter().flat_map(|s| s.causes.iter().copied()).collect();
    let finding = build(&members, contributions.unique_rms_mm(&causes));
    let size = |s: &MergedFinding| s.finding.worth_mm.unwrap_or(0.0);
    let largest = members.into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));
    let picture = largest.and_then(|s| s.picture);
    others.insert(first.min(others.len()), MergedFinding { finding, picture, causes, doubted: Vec::new() });
    *findings = others;
}

fn gain<'a>(members: impl IntoIterator<Item = &'a MergedFinding>) -> Gain {
    let gains = members.into_iter().map(|s| s.finding.gain);
    gains
        .reduce(|a, b| Gain {
            cv_rmse_before_mm: a.cv_rmse_before_mm.max(b.cv_rmse_before_mm),
            cv_rmse_after_mm: a.cv_rmse_after_mm.min(b.cv_rmse_after_mm),
        })
        .unwrap_or(Gain { cv_rmse_before_mm: f64::NAN, cv_rmse_after_mm: f64::NAN })
}

fn setup_change(members: &[MergedFinding], worth_mm: f64, steps: bool, smooth: bool) -> Finding {
    let mut sessions: Vec<Session> = members
        .iter()
        .filter_map(|s| {
            Some(Session {
                rows: s.finding.rows?,
                effect: s.finding.effect,
                cause: s.finding.cause.clone(),
                shift: s.finding.shift.clone(),
                worth_mm: s.finding.worth_mm.unwrap_or(0.0),
            })
        })
        .collect();
    sessions.sort_by_key(|s| s.rows);
    let confidence =
        if steps && !smooth && members.iter().any(|s| s.finding.confidence == Confidence::Identified) {
            Confidence::Identified
        } else {
            Confidence::Ambiguous
        };
    // Where nothing but zeros of joints moved, it is the arm that changed.
    let zeros = members.iter().all(|s| s.finding.effect == CauseKind::JointZeroShift);
    let joints: BTreeSet<usize> =
        members.iter().flat_map(|s| s.finding.joints.iter().flatten()).copied().collect();
    let what = if zeros { zeros_of(&joints) } else { "the set-up".to_owned() };
    let cause = if steps {
        format!("{what} changed with time: {} shifts, see the table of sessions", sessions.len())
    } else {
        format!("{what} changed with time; steps and a gradual drift cannot be distinguished")
    };
    let evidence = members.iter().map(|s| s.finding.evidence.as_str()).collect::<Vec<_>>().join("; ");
    let finding = Finding {
        p_value: least_p_value(members),
        worth_mm: Some(worth_mm),
        sessions,
        ..words::finding(CauseKind::SetupChange, cause, confidence, evidence, gain(members))
    };
    if !zeros {
        return finding;
    }
    Finding {
        joints: Some(joints.into_iter().collect()),
        family: Some(Family::Drive),
        remedy: "check encoder, battery, belt and mastering of these joints, and whether they had warmed up; measure the shifted rows again, since the written arm is that of the \
                 other rows"
            .to_owned(),
        ..finding
    }
}

/// "The zero of joint 2", "the zeros of joints 1, 2 and 3".
fn zeros_of(joints: &BTreeSet<usize>) -> String {
    match joints.len() {
        0 => "the zeros of joints".to_owned(),
        1 => format!("the zero of joint {}", listed(joints)),
        _ => format!("the zeros of joints {}", listed(joints)),
    }
}

fn least_p_value(members: &[MergedFinding]) -> f64 {
    members.iter().map(|s| s.finding.p_value).fold(1.0, f64::min)
}

fn small_disturbances(members: &[MergedFinding], worth_mm: f64, excess_only: bool) -> Finding {
    let doubted = format!(", or less than {:.0} % and is doubtful", 100.0 * DOUBTFUL_SHARE);
    let cause = format!(
        "{} small disturbance{}, together {worth_mm:.4} mm: too small to justify inspecting a part",
        members.len(),
        if members.len() == 1 { "" } else { "s" }
    );
    let evidence = format!(
        "each contributes less than {:.0} % of the error of geometry alone{}",
        100.0 * SMALL_SHARE,
        if excess_only { doubted.as_str() } else { "" }
    );
    Finding {
        p_value: least_p_value(members),
        worth_mm: Some(worth_mm),
        ..words::finding(CauseKind::SmallDisturbances, cause, Confidence::Ambiguous, evidence, gain(members))
    }
}
