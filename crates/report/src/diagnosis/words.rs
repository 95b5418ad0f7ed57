//! Sentences on findings.

use crate::number::listed;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::finding::{Confidence, Diagnosis, Family, Finding, Member};
use truegrind_math::sentence;

/// A cause with its joints or rows, for a sentence.
pub(super) fn located(effect: CauseKind, joints: Option<&[usize]>, rows: Option<[usize; 2]>) -> String {
    let words = effect.words();
    // "gear two joints of joints 2 and 3" says it twice, and so does "link bending of link 2".
    let name = words.strip_suffix(" two joints").or(words.strip_prefix("link ")).unwrap_or(&words);
    let place_of = |joints, rows| place_of(effect, joints, rows);
    let of = match joints {
        Some([_, ..]) => format!(" of {}", place_of(joints, None)),
        _ => String::new(),
    };
    let within = rows.map_or_else(String::new, |rows| format!(" in {}", place_of(None, Some(rows))));
    format!("{name}{of}{within}")
}

/// A cause that cannot be told apart from others, with its share.
pub(super) fn member(member: &Member) -> String {
    let share =
        if member.share < 0.01 { "below 1".to_owned() } else { format!("{:.0}", 100.0 * member.share) };
    format!("{} ({share} %)", located(member.effect, member.joints.as_deref(), member.rows))
}

/// The families of the members of a finding: the only one, or each with its share, largest first; none of less than a hundredth.
pub(super) fn family(finding: &Finding) -> String {
    let mut shares: Vec<(Family, f64)> = Vec::new();
    for member in &finding.members {
        match shares.iter_mut().find(|(family, _)| *family == member.family) {
            Some((_, share)) => *share += member.share,
            None => shares.push((member.family, member.share)),
        }
    }
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    shares.retain(|(_, share)| *share >= 0.01);
    match shares[..] {
        [(family, _)] => format!("in the {}", family.words()),
        _ => {
            let each = shares
                .iter()
                .map(|(family, share)| format!("the {} ({:.0} %)", family.words(), 100.0 * share));
            format!("in {}", each.collect::<Vec<_>>().join(" or "))
        }
    }
}

pub(super) fn confidence(finding: &Finding) -> &'static str {
    match finding.confidence {
        Confidence::Identified => "identified",
        Confidence::Ambiguous => "ambiguous",
    }
}

pub(crate) fn place(finding: &Finding) -> String {
    if let Some(list) = &finding.row_list {
        return format!("rows {}", listed(list));
    }
    place_of(finding.effect, finding.joints.as_deref(), finding.rows)
}

/// Links, joints or rows, for a cell.
pub(super) fn place_of(effect: CauseKind, joints: Option<&[usize]>, rows: Option<[usize; 2]>) -> String {
    let is_link = matches!(effect, CauseKind::LinkBending | CauseKind::LinkTwist);
    let part = if is_link { "link" } else { "joint" };
    let at = match joints {
        Some([one]) => Some(format!("{part} {one}")),
        Some(several @ [_, ..]) => Some(format!("{part}s {}", sentence::listed(several))),
        _ => None,
    };
    let within = rows.map(|[from, to]| format!("rows {from} to {to}"));
    match (at, within) {
        (Some(at), Some(within)) => format!("{at}, {within}"),
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => "all rows".to_owned(),
    }
}

/// The likeliest cause and its place.
pub(super) fn title(finding: &Finding) -> String {
    let (effect, joints, rows) = finding.likeliest();
    let place = if finding.row_list.is_some() { place(finding) } else { place_of(effect, joints, rows) };
    format!("{}, {place}", sentence::capitalised(&effect.words()))
}

/// The statistics of a finding.
pub(super) fn reasons(finding: &Finding) -> Vec<String> {
    let mut out = vec![finding.evidence.clone()];
    let gain = &finding.gain;
    if gain.cv_rmse_before_mm > gain.cv_rmse_after_mm {
        out.push(format!(
            "held-out error {:.4} mm without it, {:.4} mm with it",
            gain.cv_rmse_before_mm, gain.cv_rmse_after_mm
        ));
    }
    if let Some(lambda) = finding.non_centrality {
        out.push(format!(
            "non-centrality {lambda:.0} with all other parameters free; from 40 on an effect is reliably detected"
        ));
    }
    if finding.confidence == Confidence::Identified {
        out.push(if finding.alternatives.is_empty() {
            "no alternative comes close".to_owned()
        } else {
            "the alternatives below were fitted in its place and are worse".to_owned()
        });
    }
    out
}

/// Why an ambiguous finding is not certain.
pub(super) fn doubts(finding: &Finding) -> Vec<String> {
    match finding.confidence {
        Confidence::Identified => Vec::new(),
        Confidence::Ambiguous if finding.doubts.is_empty() && !finding.alternatives.is_empty() => {
            vec!["not certain: an alternative explains nearly as much".to_owned()]
        }
        Confidence::Ambiguous => finding.doubts.iter().map(|doubt| format!("not certain: {doubt}")).collect(),
    }
}

/// Explains the word in tables.
pub(super) const AMBIGUOUS: &str = "ambiguous: there is such an error, but not certainly of this cause, for the reason given with the finding; \
                                    programs are corrected for it only where that is said.";

/// Why a finding is not certain, its nearest rival, and whether programs are corrected for it all the same; `None` where nothing is known
/// against it.
pub(super) fn not_certain(finding: &Finding) -> Option<String> {
    let (doubt, rival) = match finding.confidence {
        Confidence::Identified => return None,
        Confidence::Ambiguous => (finding.doubts.first(), finding.alternatives.first()),
    };
    // Rivals that have a share stand in the table.
    let rival = rival.filter(|_| finding.members.is_empty()).map(|rival| {
        format!("nearest rival: {}", located(rival.effect, rival.joints.as_deref(), rival.rows))
    });
    let why = match (doubt, rival) {
        (Some(doubt), Some(rival)) => format!("not certain: {doubt} ({rival})"),
        (Some(doubt), None) => format!("not certain: {doubt}"),
        (None, Some(rival)) => format!("not certain ({rival})"),
        (None, None) => return None,
    };
    Some(match finding.corrected {
        Some(true) => format!("{why}; programs are corrected for it, since only its place is uncertain"),
        Some(false) => format!("{why}; the written model leaves it out"),
        None => why,
    })
}

pub(super) fn remaining(diagnosis: &Diagnosis) -> String {
    let rmse = diagnosis.fits.extended.rmse_mm;
    match (&diagnosis.remaining, diagnosis.noise_floor_mm) {
        (Some(text), _) => format!("{}.", sentence::capitalised(text)),
        (None, Some(floor)) => format!(
            "Explained: {rmse:.3} mm RMS remains, and the noise floor is {floor:.3} mm ({}).",
            diagnosis.noise_floor_source
        ),
        (None, None) => format!(
            "{rmse:.3} mm RMS remains, without a pattern; {}, so the noise floor is unknown.",
            diagnosis.noise_floor_source
        ),
    }
}
