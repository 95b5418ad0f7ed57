//! From causes to what a person is told: one finding for each story, ranked by the millimetres that it is worth.
//!
//! Causes of one name and joint are one finding already. Here three or more shifts become one ("the set-up changed with
//! time"), and so do shifts that cannot be told from a smooth course; what is worth little is summed up without the name of
//! a part.

use super::confirmation::Confirmation;
use super::discrepancy::Discrepancy;
use super::finding::{Confidence, Finding, Gain, Session};
use super::picture::Picture;
use super::shadow::Shadows;
use super::words;
use super::worth::Worth;

/// A finding with what stands behind it.
#[derive(Debug, Clone)]
pub(super) struct Story {
    pub(super) finding: Finding,
    pub(super) picture: Option<Picture>,
    /// Places of its causes in the fit.
    pub(super) causes: Vec<usize>,
    /// Those of them that are in doubt, where others are told with them.
    pub(super) doubted: Vec<usize>,
}

/// Shifts from which on they are one story.
const MANY_SHIFTS: usize = 3;

/// Share of the error of geometry alone below which a finding is a small disturbance.
const SMALL: f64 = 0.02;

/// Stories with a cause that are told, where that many are not in doubt or worth much.
const MOST_TOLD: usize = 9;

/// Share of that error from which a finding is told whatever the doubt.
const LITTLE: f64 = 0.1;

/// Stories of findings that have causes in the fit, in the order of `findings`.
pub(super) fn of(findings: Vec<Finding>, finding_of_cause: &[usize], pictures: Vec<Picture>) -> Vec<Story> {
    findings
        .into_iter()
        .zip(pictures)
        .enumerate()
        .map(|(place, (finding, picture))| Story {
            finding,
            picture: Some(picture),
            causes: (0..finding_of_cause.len()).filter(|&k| finding_of_cause[k] == place).collect(),
            doubted: Vec::new(),
        })
        .collect()
}

/// Marks what is not confirmed, states what each finding is worth, and makes one story of what is one.
pub(super) fn told(
    mut stories: Vec<Story>,
    confirmations: &[Confirmation],
    discrepancy: &Discrepancy,
    shadows: &Shadows<'_>,
    geometric_mm: f64,
) -> Vec<Story> {
    let worth = shadows.worth;
    for story in &mut stories {
        // A story of several causes is confirmed with one of them.
        if !story.causes.iter().any(|&k| confirmations[k].is_confirmed()) {
            story.finding.confidence = Confidence::Ambiguous;
            let first = story.causes.first();
            story.finding.doubts.extend(first.map(|&k| confirmations[k].doubts()).unwrap_or_default());
        }
        story.finding.worth_mm = Some(worth.of(&story.causes));
    }
    for story in &mut stories {
        let doubts = shadows.on(&story.causes);
        if !doubts.is_empty() {
            story.finding.confidence = Confidence::Ambiguous;
            story.finding.doubts.extend(doubts);
        }
    }
    let smooth = discrepancy.in_time();
    let is_shift = |s: &Story| s.finding.rows.is_some();
    let drowned = |s: &Story| smooth && s.causes.iter().all(|&k| !confirmations[k].beside);
    let shifts = stories.iter().filter(|s| is_shift(s)).count();
    if shifts >= MANY_SHIFTS || stories.iter().any(|s| is_shift(s) && drowned(s)) {
        merge(&mut stories, is_shift, worth, |members, worth_mm| {
            let steps = shifts >= MANY_SHIFTS && !members.iter().all(drowned);
            set_up_changed(members, worth_mm, steps, smooth)
        });
    }
    let small = |s: &Story| s.finding.worth_mm.is_some_and(|w| w < SMALL * geometric_mm);
    let crowd = crowd(&stories, small, LITTLE * geometric_mm);
    let of_crowd = |s: &Story| s.causes.first().is_some_and(|k| crowd.contains(k));
    if stories.iter().any(|s| small(s) || of_crowd(s)) {
        let crowded = !crowd.is_empty();
        let told = |members: &[Story], mm: f64| small_disturbances(members, mm, crowded);
        merge(&mut stories, |s| small(s) || of_crowd(s), worth, told);
        let told = stories.iter_mut().find(|s| s.finding.effect == SMALL_DISTURBANCES);
        told.into_iter().for_each(|s| s.doubted = crowd.clone());
    }
    stories
}

/// Causes whose stories are in doubt and worth less than `little_mm`, least first, as many as are beyond what a person reads at
/// once.
fn crowd(stories: &[Story], small: impl Fn(&Story) -> bool, little_mm: f64) -> Vec<usize> {
    let worth = |s: &Story| s.finding.worth_mm.unwrap_or(f64::INFINITY);
    let told: Vec<&Story> = stories.iter().filter(|s| !small(s)).collect();
    if told.len() <= MOST_TOLD {
        return Vec::new();
    }
    let doubted = |s: &&&Story| s.finding.confidence == Confidence::Ambiguous && worth(s) < little_mm;
    let mut least: Vec<&&Story> = told.iter().filter(doubted).collect();
    least.sort_by(|a, b| worth(a).total_cmp(&worth(b)));
    // One line more tells of all of them.
    let beyond = told.len() + 1 - MOST_TOLD;
    least.into_iter().take(beyond).flat_map(|s| s.causes.iter().copied()).collect()
}

/// Of each cause whether it is certain enough to move programs.
pub(super) fn certain(stories: &[Story], confirmations: &[Confirmation]) -> Vec<bool> {
    let mut out: Vec<bool> = confirmations.iter().map(Confirmation::is_confirmed).collect();
    for story in stories.iter().filter(|s| s.finding.effect != SMALL_DISTURBANCES) {
        if story.finding.confidence == Confidence::Ambiguous {
            story.causes.iter().for_each(|&k| out[k] = false);
        }
    }
    stories.iter().flat_map(|s| &s.doubted).for_each(|&k| out[k] = false);
    out
}

/// What small disturbances are called together.
const SMALL_DISTURBANCES: &str = "small-disturbances";

/// Puts findings in the order of what they are worth; those without a number come last, as they were.
pub(super) fn rank(stories: &mut [Story]) {
    let key = |s: &Story| s.finding.worth_mm.unwrap_or(-1.0);
    stories.sort_by(|a, b| key(b).total_cmp(&key(a)));
}

/// Replaces the stories that are `of` a kind by one, in the place of the first.
fn merge(
    stories: &mut Vec<Story>,
    of: impl Fn(&Story) -> bool,
    worth: &Worth<'_>,
    told: impl FnOnce(&[Story], f64) -> Finding,
) {
    let first = stories.iter().position(&of).unwrap_or(0);
    let (members, mut others): (Vec<Story>, Vec<Story>) = stories.drain(..).partition(of);
    let causes: Vec<usize> = members.iter().flat_map(|s| s.causes.iter().copied()).collect();
    let finding = told(&members, worth.of(&causes));
    let size = |s: &Story| s.finding.worth_mm.unwrap_or(0.0);
    let largest = members.into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));
    let picture = largest.and_then(|s| s.picture);
    others.insert(first.min(others.len()), Story { finding, picture, causes, doubted: Vec::new() });
    *stories = others;
}

fn gain(members: &[Story]) -> Gain {
    let gains = members.iter().map(|s| s.finding.gain);
    gains
        .reduce(|a, b| Gain {
            cv_rmse_before_mm: a.cv_rmse_before_mm.max(b.cv_rmse_before_mm),
            cv_rmse_after_mm: a.cv_rmse_after_mm.min(b.cv_rmse_after_mm),
        })
        .unwrap_or(Gain { cv_rmse_before_mm: f64::NAN, cv_rmse_after_mm: f64::NAN })
}

fn set_up_changed(members: &[Story], worth_mm: f64, steps: bool, smooth: bool) -> Finding {
    let mut sessions: Vec<Session> = members
        .iter()
        .filter_map(|s| {
            Some(Session {
                rows: s.finding.rows?,
                effect: s.finding.effect.clone(),
                cause: s.finding.cause.clone(),
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
    Finding {
        effect: "setup-change".to_owned(),
        cause: if steps {
            format!("the set-up changed with time: {} shifts, see the table of sessions", sessions.len())
        } else {
            "the set-up changed with time; whether it moved in steps or wandered cannot be told".to_owned()
        },
        confidence,
        rows: None,
        row_list: None,
        joints: None,
        parameters: Vec::new(),
        evidence: members.iter().map(|s| s.finding.evidence.as_str()).collect::<Vec<_>>().join("; "),
        p_value: members.iter().map(|s| s.finding.p_value).fold(1.0, f64::min),
        non_centrality: None,
        gain: gain(members),
        worth_mm: Some(worth_mm),
        doubts: Vec::new(),
        sessions,
        alternatives: Vec::new(),
        remedy: words::remedy("setup-change").to_owned(),
    }
}

fn small_disturbances(members: &[Story], worth_mm: f64, crowded: bool) -> Finding {
    let doubted = format!(", or less than {:.0} % and in doubt", 100.0 * LITTLE);
    Finding {
        effect: SMALL_DISTURBANCES.to_owned(),
        cause: format!(
            "{} small disturbance{}, together {worth_mm:.4} mm: too little to send anybody to a part",
            members.len(),
            if members.len() == 1 { "" } else { "s" }
        ),
        confidence: Confidence::Ambiguous,
        rows: None,
        row_list: None,
        joints: None,
        parameters: Vec::new(),
        evidence: format!(
            "each is worth less than {:.0} % of the error that geometry alone leaves{}",
            100.0 * SMALL,
            if crowded { doubted.as_str() } else { "" }
        ),
        p_value: members.iter().map(|s| s.finding.p_value).fold(1.0, f64::min),
        non_centrality: None,
        gain: gain(members),
        worth_mm: Some(worth_mm),
        doubts: Vec::new(),
        sessions: Vec::new(),
        alternatives: Vec::new(),
        remedy: words::remedy(SMALL_DISTURBANCES).to_owned(),
    }
}
