//! The answer of a diagnosis, on one screen: what was found, where, how sure that is, and what to do.

use super::words::{AMBIGUOUS, confidence, family, located, member, not_certain};
use crate::document::{Block, PageVerdict};
use crate::status::Status;
use crate::table::Table;
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::decision::DIAGNOSIS_FILE;
use truegrind_calibration::diagnosis::finding::{Confidence, Diagnosis, Finding};
use truegrind_calibration::measurement::dataset::Sensor;
use truegrind_math::sentence::{capitalised, counted, listed};

/// How many causes were found, and what they gain.
pub(super) fn verdict(diagnosis: &Diagnosis) -> PageVerdict {
    let sure = diagnosis.findings.iter().filter(|f| f.confidence == Confidence::Identified).count();
    let further = diagnosis.findings.iter().filter(|f| is_possible(f)).count();
    let causes = |n: usize| counted(n, "cause", "causes");
    let found = match (sure, further) {
        (0, 0) => "No cause beyond geometry was found".to_owned(),
        (0, n) => format!("No cause beyond geometry is certain, {n} {} possible", be(n)),
        (n, 0) => format!("{} identified", causes(n)),
        (n, m) => format!("{} identified, {m} more possible", causes(n)),
    };
    // With so few rows an empty result proves nothing.
    let (status, headline) = match diagnosis.poses_needed {
        Some(needed) => (
            Status::NotEvaluated,
            format!(
                "{} rows are too few to look for causes (at least {needed} different poses are needed); fitted geometry with its \
                 priors",
                diagnosis.dataset.rows
            ),
        ),
        None if !diagnosis.findings.is_empty() => (Status::Found, found),
        None if diagnosis.times_the_noise().is_some() => (Status::Warning, found),
        None => (Status::Good, found),
    };
    let fits = &diagnosis.fits;
    let floor = match diagnosis.noise_floor_mm {
        Some(floor) if diagnosis.is_noise_measured() => format!("noise floor {floor:.3} mm"),
        // The rounding of the log is no noise of the sensor.
        Some(floor) if floor < SHOWN_MM => {
            "the noise floor is unknown, since too few poses were repeated from the same sides".to_owned()
        }
        Some(floor) => format!(
            "rounding of the logged angles: {floor:.3} mm; the noise of the sensor is unknown, since too few poses were \
             repeated from the same sides"
        ),
        None => format!("the noise floor is unknown, since {}", diagnosis.noise_floor_source),
    };
    let with_causes = if diagnosis.findings.is_empty() {
        String::new()
    } else {
        format!("{:.3} mm with all of them, geometry alone ", fits.extended.cv_rmse_mm)
    };
    PageVerdict::new(
        status,
        format!(
            "{headline}: held-out error {with_causes}{:.3} mm, data sheet {:.3} mm; {floor}",
            fits.geometric.cv_rmse_mm, fits.nominal.cv_rmse_mm
        ),
        too_much_for_noise(diagnosis),
    )
}

/// Least length that three decimals show (mm).
const SHOWN_MM: f64 = 5e-4;

/// What an error that is too large for noise may come from, and what to check.
fn too_much_for_noise(diagnosis: &Diagnosis) -> Vec<String> {
    let (Some(times), Some(floor)) = (diagnosis.times_the_noise(), diagnosis.noise_and_rounding_mm()) else {
        return Vec::new();
    };
    let left = if diagnosis.findings.is_empty() { "" } else { " that is left" };
    let source = match (diagnosis.is_noise_measured(), diagnosis.rounding_mm()) {
        (true, None) => "",
        (true, Some(_)) => " with the rounding of the log",
        (false, _) => ", which is that of rounding alone",
    };
    // A ratio to what three decimals show as 0 is no figure.
    let compared = if floor < SHOWN_MM && !diagnosis.is_noise_measured() {
        "far above the noise floor, of which only a rounding of less than 0.001 mm is known".to_owned()
    } else {
        format!("{times:.0} times the noise floor ({floor:.3} mm{source})")
    };
    let mut out = vec![
        format!(
            "the held-out error{left} ({:.3} mm) is {compared}, too much for noise: its cause is not in the catalogue, or lies in the \
             measurement",
            diagnosis.fits.extended.cv_rmse_mm
        ),
        format!("what to check: {}", what_to_check(diagnosis.dataset.sensor)),
    ];
    if !diagnosis.is_noise_measured() {
        out.push(
            "what would help: measure a few poses several times, which shows the noise of the sensor"
                .to_owned(),
        );
    }
    out
}

/// What leaves large errors that no cause of the catalogue explains.
fn what_to_check(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Cable => {
            "that all rows are of one arm and that the joint angles in each are those of its reading, that the cable runs free and its hook holds, \
             that it is wound in one layer and not over a pulley, that the outlet stayed \
             in one place, and the sensor itself against a known length"
        }
        Sensor::Position | Sensor::Pose => {
            "that all rows are of one arm and that the joint angles in each are those of its reading, that the tracker read in one face, that one \
             target in one nest was read, that the tracker stayed in one place, and the sensor itself against a known length"
        }
    }
}

fn be(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// Whether a finding names a part without being certain of it.
fn is_possible(finding: &Finding) -> bool {
    finding.confidence == Confidence::Ambiguous
        && !matches!(finding.effect, CauseKind::Unexplained | CauseKind::SmallDisturbances)
}

/// One line per finding, and what to do about them.
pub(super) fn blocks(diagnosis: &Diagnosis) -> Vec<Block> {
    if diagnosis.findings.is_empty() {
        return Vec::new();
    }
    let mut out = vec![Block::Table(findings(diagnosis))];
    let actions = actions(diagnosis);
    if !actions.is_empty() {
        out.extend([Block::Heading(2, "What to do".to_owned()), Block::List(actions)]);
    }
    out
}

fn findings(diagnosis: &Diagnosis) -> Table {
    let numbered: Vec<(usize, &Finding)> = (1..).zip(&diagnosis.findings).collect();
    let mut table = Table::of("", &numbered)
        .text("number", "no.", |(number, _)| number.to_string())
        .text("cause", "cause", |(_, finding)| in_short(finding))
        .text("confidence", "how sure", |(_, finding)| match finding.effect {
            CauseKind::Unexplained | CauseKind::SmallDisturbances => "",
            _ => confidence(finding),
        })
        .number("worth_mm", "explains", "mm", 3, |(_, finding)| finding.worth_mm)
.note("explains: the part of the readings that only this cause explains, RMS over all rows. identified: it explains them better \
         than its alternatives, and is found again in halves of the rows.")
.table();
    if diagnosis.findings.iter().any(is_possible) {
        table.notes.push(AMBIGUOUS.to_owned());
    }
    table
}

/// A finding in one sentence.
pub(super) fn in_short(finding: &Finding) -> String {
    let joints = finding.joints.as_deref();
    if !finding.members.is_empty() {
        let members: Vec<String> = finding.members.iter().map(member).collect();
        return capitalised(&format!("an error {}: {}", family(finding), members.join(", ")));
    }
    let names_a_part = finding.non_centrality.is_some();
    let several = joints.is_some_and(|joints| joints.len() > 1);
    if names_a_part && (finding.confidence == Confidence::Ambiguous || several) {
        return capitalised(&located(finding.effect, joints, finding.rows));
    }
    match finding.terms.as_slice() {
        [first, further @ ..] if !further.is_empty() && names_a_part => {
            let further = counted(further.len(), "further term", "further terms");
            format!("{}; with {further}", capitalised(first))
        }
        _ => capitalised(&finding.cause),
    }
}

/// What to do, each once, with the numbers of its findings.
fn actions(diagnosis: &Diagnosis) -> Vec<String> {
    let asked = (1..).zip(&diagnosis.findings).filter(|(_, f)| f.effect != CauseKind::SmallDisturbances);
    let mut out: Vec<(String, Vec<usize>)> = Vec::new();
    for (number, finding) in asked {
        // A command names the number of its finding.
        let action = match (&finding.decided_by, not_certain(finding)) {
            (Some(decision), Some(why)) => format!("{why}; to decide, {decision}"),
            (Some(decision), None) => format!("to decide, {decision}"),
            (None, _) => finding.remedy.clone(),
        };
        match out.iter_mut().find(|(same, _)| *same == action) {
            Some((_, numbers)) => numbers.push(number),
            None => out.push((action, vec![number])),
        }
    }
    let names_file = out.iter().any(|(action, _)| action.contains(DIAGNOSIS_FILE));
    let file =
        names_file.then(|| format!("{DIAGNOSIS_FILE} is what `diagnose --json {DIAGNOSIS_FILE}` writes"));
    out.into_iter().map(|(action, numbers)| format!("{}: {action}", listed(&numbers))).chain(file).collect()
}
