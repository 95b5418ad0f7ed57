//! Verdict on a corrected path.

use std::collections::{BTreeMap, BTreeSet};

use super::side::{AFTER, BEFORE, Side};
use super::words::{decimals, meaning};
use crate::document::PageVerdict;
use crate::status::Status;
use truegrind_compensation::deviation::{
    After, BetweenTargets, MissingMotions, MotionStatus, PathPoint, PathReport,
};
use truegrind_compensation::line_list::numbered;
use truegrind_programs::motion::Place;

/// A report with its largest deviation (mm) before and after correction.
type Judged<'a> = (&'a PathReport, f64, f64);

/// A reason, with the status that it gives at least.
type Reason = (Status, String);

/// Whether the risk of a worse path is stated beside the reports. A σ has no direction, so where it exceeds the deviation it may still
/// be certain that a correction helps: the probability knows, and says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Risk {
    Stated,
    Unstated,
}

/// The verdict on one program under all models.
pub(super) fn verdict(reports: &[&PathReport], risk: Risk) -> PageVerdict {
    let judged: Vec<Judged<'_>> = reports
        .iter()
        .filter_map(|report| Some((*report, largest(report, BEFORE)?, largest(report, AFTER)?)))
        .collect();
    let all_worse = judged.iter().all(|(report, before, after)| worse(report, *before, *after).is_some());
    let mut found = uncertain_points(reports);
    for (report, before, after) in &judged {
        found.extend(of_path(report, *before, *after, all_worse));
        found.extend(steps(report).map(|words| (Status::Warning, words)));
        found.extend(between_targets(report));
        found.extend(turns(report));
        found.extend(of_certainty(report, risk));
        found.extend(remainder(report).map(|left| (Status::Warning, left.words(report))));
    }
    let assumptions: BTreeSet<&String> = reports.iter().flat_map(|report| &report.assumptions).collect();
    found.extend(assumptions.into_iter().map(|words| (Status::Warning, words.clone())));
    found.extend(missing(reports));
    let holds = |status: &Status| found.iter().any(|(of, _)| of == status);
    let mut status = [Status::Bad, Status::Warning].into_iter().find(holds).unwrap_or(Status::Good);
    let mut reasons: Vec<String> = found.into_iter().map(|(_, reason)| reason).collect();
    if judged.is_empty() && matches!(status, Status::Good | Status::Warning) {
        status = Status::NotEvaluated;
    }
    if judged.is_empty() && !reports.is_empty() {
        reasons.push(
            "`truegrind compensate` with the same model says which motions it corrects, and what remains of their deviation".to_owned(),
        );
    }
    if let Some(report) = reports.iter().find(|report| !report.differences.is_empty()) {
        return PageVerdict::new(Status::Bad, OTHER_PROGRAM.to_owned(), different(report, reasons));
    }
    PageVerdict::new(status, headline(reports, &judged), reasons)
}

/// Refused and flagged points.
fn uncertain_points(reports: &[&PathReport]) -> Vec<Reason> {
    let count = |status: MotionStatus| {
        let of = |report: &&PathReport| report.points.iter().filter(|point| point.status == status).count();
        reports.iter().map(of).max().unwrap_or(0)
    };
    [
        (MotionStatus::Refused, "refused: not corrected, because that would be wrong or unsafe"),
        (MotionStatus::Flagged, "flagged: corrected with a warning"),
    ]
    .into_iter()
    .filter_map(|(status, text)| match count(status) {
        0 => None,
        1 => Some((Status::Warning, format!("1 point {text}"))),
        points => Some((Status::Warning, format!("{points} points {text}"))),
    })
    .collect()
}

/// What the correction makes of the path. `all_worse`: under every model it makes it worse.
fn of_path(report: &PathReport, before: f64, after: f64, all_worse: bool) -> Option<Reason> {
    if let Some(OnlyShape { shape_mm: [before, after], place_mm }) = only_shape(report) {
        let words = format!(
            "{}: the shape of the path is corrected ({before:.3} → {after:.3} mm RMS after the best rigid registration) but not its placement: \
             with it, the path deviates by {place_mm:.3} mm RMS (see `compensate --placement`)",
            report.model
        );
        return Some((Status::Good, words));
    }
    if let Some(words) = worse(report, before, after) {
        let status = if all_worse { Status::Bad } else { Status::Warning };
        return Some((status, format!("{}: the correction {words}", report.model)));
    }
    let [before, after] = bent(report)?;
    Some((Status::Warning, format!("{}: the correction {}", report.model, bent_words(before, after))))
}

/// Whether the model corrects a cut, and knows the arm well enough for that.
fn of_certainty(report: &PathReport, risk: Risk) -> Option<Reason> {
    // A model that corrects no cut has no correction whose certainty could be judged.
    if report.cut().all(|point| point.status == MotionStatus::Left) {
        let because = report.cut().find_map(|point| point.reason.as_ref());
        let because = because.map_or_else(String::new, |reason| format!(": {reason}"));
        return Some((Status::Warning, format!("{}: no cut is corrected{because}", report.model)));
    }
    let (sigma, rms) = (report.sigma_rms_mm()?, rms(report, BEFORE)?);
    (risk == Risk::Unstated && sigma > rms && only_shape(report).is_none()).then(|| {
        let words = format!(
            "{}: the predicted 1σ, {sigma:.3} mm, exceeds the deviation to correct, {rms:.3} mm RMS: `truegrind compensate` states with what \
             probability the correction makes it worse",
            report.model
        );
        (Status::Warning, words)
    })
}

/// Standard deviations of the model from which what it expects to remain is no uncertainty but a deviation, and the least that counts (mm).
const CERTAIN_SIGMAS: f64 = 3.0;
const CERTAIN_MM: f64 = 0.05;

/// What the model knows to remain at corrected points, though it would correct it: they were corrected for another arm, twice, or by hand.
struct Remainder {
    largest_mm: f64,
    sigma_mm: f64,
    lines: String,
}

impl Remainder {
    fn words(&self, report: &PathReport) -> String {
        format!(
            "{}: targets are not corrected as this model would: up to {:.3} mm remain, known to ± {:.3} mm (1σ), as after a correction for \
             another arm, a second one, or a change by hand ({})",
            report.model, self.largest_mm, self.sigma_mm, self.lines
        )
    }
}

/// What is known to remain; `None` where nothing is. Where the shape alone is corrected the placement stays, by choice.
fn remainder(report: &PathReport) -> Option<Remainder> {
    if report.after == After::Achieved || only_shape(report).is_some() {
        return None;
    }
    let known = |point: &PathPoint| {
        let (mm, sigma) = (point.after?.norm_mm(), point.sigma_mm?);
        (point.is_corrected() && mm > CERTAIN_MM.max(CERTAIN_SIGMAS * sigma)).then_some((mm, sigma))
    };
    let mut parts: BTreeMap<u32, Vec<&PathPoint>> = BTreeMap::new();
    report.cut().for_each(|point| parts.entry(point.part).or_default().push(point));
    parts.retain(|_, points| {
        points.iter().any(|point| known(point).is_some())
            && registered_rms_mm(points, AFTER).is_some()
            && only_shape_of(points).is_none()
    });
    let left = || report.cut().filter(|point| parts.contains_key(&point.part) && known(point).is_some());
    let (largest_mm, sigma_mm) = left().filter_map(known).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let places = left().map(|point| Place { file: point.file, line: point.line, column: 0 });
    let lines = numbered(&report.files, places)?;
    Some(Remainder { largest_mm, sigma_mm, lines })
}

/// The path between the targets of the corrected program.
fn between_targets(report: &PathReport) -> Vec<Reason> {
    let Some(between) = &report.between else { return Vec::new() };
    let BetweenTargets { tolerance_mm, beyond_lines, unchecked_lines, first_lines, .. } = between;
    let mut out = Vec::new();
    if let Some(mm) = between.largest_mm {
        let off = if mm.is_finite() {
            format!("leaves the intended lines and arcs by up to {mm:.3} mm")
        } else {
            "cannot be followed by the arm".to_owned()
        };
        out.push(match beyond_lines {
            None => (
                Status::Good,
                format!("{}: between its targets the path {off} (tolerance {tolerance_mm} mm)", report.model),
            ),
            Some(lines) => (
                Status::Warning,
                format!(
                    "{}: between its targets the path {off}, more than the tolerance of {tolerance_mm} mm ({lines})",
                    report.model
                ),
            ),
        });
    }
    if let Some(lines) = unchecked_lines {
        let starts = if between.unchecked == 1 { "line or arc starts" } else { "lines or arcs start" };
        let words = format!(
            "{}: {} {starts} at a place that is unknown or not corrected: the path from there is not checked ({lines})",
            report.model, between.unchecked
        );
        out.push((Status::Warning, words));
    }
    if let Some(lines) = first_lines {
        let words = format!(
            "{}: nothing tells where the first line or arc of a program or routine starts: the path to its end is not checked ({lines})",
            report.model
        );
        out.push((Status::Good, words));
    }
    out
}

/// The orientation of the tool at the points of the cut.
fn turns(report: &PathReport) -> Option<Reason> {
    let [before, after] = [BEFORE, AFTER].map(|side| report.largest_turn_rad(side).map(f64::to_degrees));
    let sigma = report.turn_sigma_rad.map(f64::to_degrees);
    let sigma = sigma.map_or_else(String::new, |deg| {
        format!(", where a standard deviation (1σ) of at most {deg:.3}° is expected")
    });
    let words = format!(
        "{}: the orientation of the tool deviates by up to {:.3}° before, {:.3}° after{sigma}",
        report.model, before?, after?
    );
    Some((Status::Good, words))
}

/// Motions without a deviation, with the models under which they have none where these differ.
fn missing(reports: &[&PathReport]) -> Vec<Reason> {
    let mut groups: Vec<(&MissingMotions, Vec<&str>)> = Vec::new();
    for (report, missing) in reports.iter().filter_map(|report| Some((report, report.missing.as_ref()?))) {
        let alike = |(other, _): &&mut (&MissingMotions, Vec<&str>)| {
            other.lines == missing.lines && other.motions.len() == missing.motions.len()
        };
        match groups.iter_mut().find(alike) {
            Some((_, models)) => models.push(&report.model),
            None => groups.push((missing, vec![&report.model])),
        }
    }
    let sentence = |(missing, models): (&MissingMotions, Vec<&str>)| {
        let is_of_all = models.len() == reports.len();
        let under = if is_of_all { String::new() } else { format!("{}: ", models.join(", ")) };
        let motions = if missing.motions.len() == 1 { "motion has" } else { "motions have" };
        let words = format!(
            "{under}{} {motions} no known deviation: the target is not in the program text, or out of reach ({}; reasons in --csv)",
            missing.motions.len(),
            missing.lines
        );
        (Status::Warning, words)
    };
    groups.into_iter().map(sentence).collect()
}

/// Headline for a program that is not the original with corrected targets.
const OTHER_PROGRAM: &str = "The program differs from the original in more than corrected targets, so its deviations after correction mean nothing";

/// Differences that are listed.
const MAX_DIFFERENCES: usize = 10;

/// The differences of a program, before what else is to be said.
fn different(report: &PathReport, reasons: Vec<String>) -> Vec<String> {
    let mut out: Vec<String> = report.differences.iter().take(MAX_DIFFERENCES).cloned().collect();
    let more = report.differences.len() - out.len();
    out.extend((more > 0).then(|| format!("and {more} more differences (--json lists them)")));
    out.extend(reasons);
    out
}

/// By how much a correction may bend a path without a word (mm RMS).
const BENT_MM: f64 = 0.05;

/// The shape of a path before and after, over all its cutting points (RMS, mm), where the correction bends it.
fn bent(report: &PathReport) -> Option<[f64; 2]> {
    let shape_mm = [report.registered_rms_mm(BEFORE)?, report.registered_rms_mm(AFTER)?];
    (shape_mm[1] > shape_mm[0] + BENT_MM).then_some(shape_mm)
}

fn bent_words(before: f64, after: f64) -> String {
    format!(
        "bends the path: its shape goes from {before:.3} to {after:.3} mm RMS after the best rigid registration of the cutting points of each part"
    )
}

/// The share of the largest deviation that must remain for a bent path to be worse: one that was displaced as a whole may be bent a little by
/// what brings it near.
const STAYS: f64 = 0.5;

/// Words for a path that is worse after the correction: farther off, or bent and not much nearer. `before` and `after` are the largest
/// deviations (mm).
fn worse(report: &PathReport, before: f64, after: f64) -> Option<String> {
    if only_shape(report).is_some() {
        return None;
    }
    if after > before {
        return Some(format!("makes the path worse: up to {}", known(Some(after))));
    }
    bent(report).filter(|_| after > STAYS * before).map(|[before, after]| bent_words(before, after))
}

/// Sentence on steps between corrected points and others.
fn steps(report: &PathReport) -> Option<String> {
    let steps = report.steps();
    let place = |point: &&PathPoint| Place { file: point.file, line: point.line, column: 0 };
    let lines = numbered(&report.files, steps.points.iter().map(place))?;
    Some(format!(
        "{}: the path steps by up to {:.3} mm between corrected points and uncorrected neighbours ({lines})",
        report.model, steps.largest_mm
    ))
}

/// The held-out error of the model; nothing of a simulated arm, which has none.
fn of_model(report: &PathReport) -> String {
    let words = |mm| format!("; held-out error of the model {}", known(Some(mm)));
    report.held_out_mm.map_or_else(String::new, words)
}

/// Deviation before and after.
fn headline(reports: &[&PathReport], judged: &[Judged<'_>]) -> String {
    match judged {
        [] => {
            let worst = reports.iter().filter_map(|report| size(report)).reduce(f64::max);
            format!("The uncorrected path deviates by up to {}; there is no corrected path", known(worst))
        }
        [(report, ..)]
            if let Some(OnlyShape { shape_mm: [before, after], place_mm }) = only_shape(report) =>
        {
            format!(
                "Shape of the path {before:.3} mm RMS before, {after:.3} mm after ({}); its placement is not corrected, with it {place_mm:.3} mm RMS{}",
                meaning(report.after),
                of_model(report),
            )
        }
        [(report, ..)] if report.points.iter().all(|point| !point.is_corrected()) => {
            format!(
                "Nothing was corrected: both programs state the same targets, and the path deviates by up to {}{}",
                known(size(report)),
                of_model(report),
            )
        }
        [(report, ..)] if report.expected_mm().is_some() => {
            // Both unsigned, since the expected deviation has no sign.
            let before = size(report);
            let largest = |corrected: bool| {
                let points = report.cut().filter(|point| point.is_corrected() == corrected);
                points.filter_map(PathPoint::expected_mm).filter(|mm| mm.is_finite()).reduce(f64::max)
            };
            // A deviation that stays is no standard deviation.
            let remains = remainder(report);
            let after = match (largest(true), largest(false)) {
                _ if let Some(Remainder { largest_mm, sigma_mm, .. }) = remains => {
                    format!("after correction {largest_mm:.3} mm, known to ± {sigma_mm:.3} mm (1σ)")
                }
                (Some(sigma), None) => {
                    format!("after correction a standard deviation (1σ) of at most {sigma:.3} mm is expected")
                }
                (Some(sigma), Some(stays)) => format!(
                    "after correction a standard deviation (1σ) of at most {sigma:.3} mm is expected, and points that are not corrected deviate by \
                     up to {stays:.3} mm"
                ),
                (None, stays) => {
                    format!("no point of a cut is corrected: they deviate by up to {}", known(stays))
                }
            };
            format!("Largest deviation {} before; {after}{}", known(before), of_model(report))
        }
        [(report, before, after)] => format!(
            "Largest deviation{} {before:.3} mm before, {after:.*} mm after ({}){}{}",
            along_normal(report),
            decimals(report.after),
            meaning(report.after),
            report
                .sigma_rms_mm()
                .map_or_else(String::new, |mm| format!("; predicted 1σ {}", known(Some(mm)))),
            of_model(report),
        ),
        [(first, ..), ..] => {
            // Where every model corrects the shape alone, the path as a whole stays where it was.
            let shapes: Option<Vec<[f64; 2]>> =
                judged.iter().map(|(report, ..)| Some(only_shape(report)?.shape_mm)).collect();
            let (what, stays) = match shapes {
                Some(_) => ("Shape of the path (RMS)".to_owned(), "; its placement is not corrected"),
                None => (format!("Largest deviation{}", along_normal(first)), ""),
            };
            let sizes: Vec<[f64; 2]> =
                shapes.unwrap_or_else(|| judged.iter().map(|(_, before, after)| [*before, *after]).collect());
            let of = |pick: fn(&f64, &f64) -> std::cmp::Ordering| {
                let after =
                    sizes.iter().map(|[_, after]| after).zip(judged.iter().map(|(report, ..)| report));
                after.min_by(|a, b| pick(a.0, b.0))
            };
            let decimals = decimals(first.after);
            let under = |found: Option<(&f64, &&PathReport)>| match found {
                Some((after, report)) => format!("{after:.decimals$} mm under {}", report.model),
                None => known(None),
            };
            let before = sizes.iter().map(|[before, _]| *before).fold(0.0, f64::max);
            format!(
                "{what} {before:.3} mm before; after: best {}, worst {} ({}){stays}",
                under(of(|a, b| a.total_cmp(b))),
                under(of(|a, b| b.total_cmp(a))),
                meaning(first.after),
            )
        }
    }
}

/// The largest deviation of a cut before correction, in whatever direction (mm).
pub(super) fn size(report: &PathReport) -> Option<f64> {
    report.cut().filter_map(|point| point.before.map(|d| d.norm_mm())).reduce(f64::max)
}

/// The largest deviation of a cut, along the normal where the surface is known (mm).
fn largest(report: &PathReport, side: Side) -> Option<f64> {
    report.block(side).map(|block| block.all.max)
}

/// Where the surface of a cut is known its deviations are judged along the normal.
fn along_normal(report: &PathReport) -> &'static str {
    if report.cut().any(|point| point.normal.is_some()) { " along the normal" } else { "" }
}

fn known(mm: Option<f64>) -> String {
    mm.map_or("unknown".to_owned(), |mm| format!("{mm:.3} mm"))
}

/// A path whose shape is corrected, but not where it lies.
#[derive(Clone, Copy)]
struct OnlyShape {
    /// Deviation before and after, after the best rigid registration (RMS, mm).
    shape_mm: [f64; 2],
    /// Deviation after, without registration (RMS, mm).
    place_mm: f64,
}

/// Deviation after over that after registration from which it is one of the place.
const PLACE: f64 = 4.0;

fn only_shape(report: &PathReport) -> Option<OnlyShape> {
    only_shape_of(&report.cut().collect::<Vec<_>>())
}

/// The same of the points of a cut.
fn only_shape_of(points: &[&PathPoint]) -> Option<OnlyShape> {
    let shape_mm = [registered_rms_mm(points, BEFORE)?, registered_rms_mm(points, AFTER)?];
    let [before_mm, place_mm] = [rms_of(points, BEFORE)?, rms_of(points, AFTER)?];
    let stays = place_mm > PLACE * shape_mm[1] && 2.0 * place_mm > before_mm;
    (shape_mm[1] < shape_mm[0] && stays).then_some(OnlyShape { shape_mm, place_mm })
}

fn registered_rms_mm(points: &[&PathPoint], side: Side) -> Option<f64> {
    PathReport::registered_rms_mm_of(points.iter().copied(), side)
}

/// RMS of the deviation of the cut (mm).
fn rms(report: &PathReport, side: Side) -> Option<f64> {
    rms_of(&report.cut().collect::<Vec<_>>(), side)
}

fn rms_of(points: &[&PathPoint], side: Side) -> Option<f64> {
    let squares: Vec<f64> =
        points.iter().filter_map(|p| side(p).map(|d| d.vector_mm.norm_squared())).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}
