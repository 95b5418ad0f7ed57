//! Report on a diagnosis: the answer first, on one screen; then for each finding what to do, the plot that shows it, and its statistics behind
//! a fold; then what the data cannot decide.

mod answer;
mod tables;
mod words;

use super::document::{Block, Document, KeyFigure, Provenance, Source};
use super::number::{Precision, listed};
use super::plot::{Axis, BarGroup, Bars, Graph, Ink, Reference, Series, Span};
pub use tables::{finding_table, not_testable_table, stage_table, step_table, transfer_table};
use tables::{members, parameters, rivals, sessions, step_name};
use truegrind_calibration::diagnosis::diagnose::Diagnosed;
use truegrind_calibration::diagnosis::finding::{Diagnosis, Finding};
use truegrind_calibration::diagnosis::picture::Picture;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_math::sentence::capitalised;
pub(crate) use words::place;
use words::{doubts, reasons, remaining, title};

/// The whole page.
pub fn document(found: &Diagnosed, dataset: &Dataset) -> Document {
    let diagnosis = &found.diagnosis;
    let mut page = summary(found);
    page.push(key_figures(found));
    page.figure(steps(diagnosis), steps_caption(diagnosis));
    page.push(Block::Details {
        summary: "Errors by stage, and statistics of the findings".to_owned(),
        blocks: vec![
            stage_table(diagnosis).into(),
            step_table(diagnosis).into(),
            finding_table(diagnosis).into(),
        ],
    });
    for (k, finding) in diagnosis.findings.iter().enumerate() {
        page.heading(2, format!("{}. {}", k + 1, title(finding)));
        let picture = found.pictures.get(k).and_then(Option::as_ref);
        section(&mut page, finding, picture);
    }
    page.heading(2, "What the data cannot decide");
    if diagnosis.not_testable.is_empty() {
        page.paragraph("Every effect of the catalogue would have been detected at a practical size.");
    } else {
        page.push(not_testable_table(diagnosis));
    }
    page.heading(2, "Remaining error");
    page.paragraph(remaining(diagnosis));
    if let Some(noise) = &diagnosis.noise_model {
        page.paragraph(format!(
            "The noise grows with range: {:.3} mm plus {:.3} mm per metre (p = {:.0e}).",
            noise.sigma_mm, noise.per_metre_mm, noise.p_value
        ));
    }
    if !diagnosis.measure_again.is_empty() {
        page.paragraph(format!("Rows to measure again: {}.", listed(&diagnosis.measure_again)));
    }
    let notes: Vec<String> = diagnosis.notes.iter().chain(&dataset.notes).cloned().collect();
    if !notes.is_empty() {
        page.push(Block::List(notes));
    }
    page.heading(2, "Provenance");
    let from = &found.estimated.provenance;
    page.push(Provenance {
        version: format!("truegrind {}", from.version),
        command: None,
        method: Some("diagnose".to_owned()),
        seed: Some(from.seed),
        sources: vec![Source::new(&from.file, "Measurements", &from.sha256, Some(diagnosis.dataset.rows))],
        remarks: vec![
            ("Robot".to_owned(), diagnosis.dataset.robot.clone()),
            ("Sensor".to_owned(), diagnosis.dataset.sensor.to_string()),
        ],
    });
    page
}

/// Names the bars, which stand in the order of the search and not in that of the table.
fn steps_caption(diagnosis: &Diagnosis) -> String {
    let causes = diagnosis.steps.iter().enumerate().skip(2);
    let named: Vec<String> =
        causes.map(|(index, step)| format!("; {}: {}", step_name(index), step.added)).collect();
    format!(
        "Held-out error (five random folds, everything refitted in each) from the data sheet to the extended model, in the order in which \
         the search took the causes. All bars have fitted frames, so the gain of fitting them is not shown. S: data sheet; G: geometry{}.",
        named.concat()
    )
}

/// What to do about a finding, its picture, and its statistics.
fn section(page: &mut Document, finding: &Finding, picture: Option<&Picture>) {
    let (first, if_so) = if finding.members.is_empty() {
        (capitalised(&finding.cause), "")
    } else {
        // The search had to take one of them, not always the likeliest.
        (answer::in_short(finding), " if that is it")
    };
    page.paragraph(format!("{first} ({}).", words::confidence(finding)));
    if !finding.members.is_empty() {
        page.paragraph(format!("The fit has it as: {}.", finding.cause));
    }
    let mut points = doubts(finding);
    let decision = finding.decided_by.as_ref().filter(|decision| **decision != finding.remedy);
    points.extend(decision.map(|decision| format!("what decides: {decision}")));
    points.push(format!("what to do{if_so}: {}", finding.remedy));
    page.push(Block::List(points));
    if !finding.members.is_empty() {
        page.push(members(finding));
    }
    if let Some(picture) = picture {
        page.figure(drawn(picture), caption(picture));
    }
    if !finding.sessions.is_empty() {
        page.push(sessions(finding));
    }
    let mut statistics = vec![Block::List(reasons(finding))];
    if !finding.parameters.is_empty() {
        statistics.push(parameters(finding).into());
    }
    if !finding.alternatives.is_empty() {
        statistics.push(rivals(finding).into());
    }
    page.push(Block::Details { summary: "Statistics".to_owned(), blocks: statistics });
}

/// The answer, for the terminal and the head of the page.
pub fn summary(found: &Diagnosed) -> Document {
    let diagnosis = &found.diagnosis;
    let mut page = Document::new(format!("Diagnosis of {}", diagnosis.dataset.robot));
    page.subtitle = format!(
        "{}, {} rows, sensor {}, {} set aside",
        diagnosis.dataset.file, diagnosis.dataset.rows, diagnosis.dataset.sensor, diagnosis.dataset.set_aside
    );
    page.push(answer::verdict(diagnosis));
    answer::blocks(diagnosis).into_iter().for_each(|block| page.push(block));
    diagnosis.findings.iter().filter(|finding| !finding.sessions.is_empty()).for_each(|finding| {
        page.push(sessions(finding).excerpt(MAX_SESSIONS));
    });
    page.push(super::identification::judged(&found.estimated));
    if !diagnosis.transfers.is_empty() {
        page.push(transfer_table(diagnosis));
    }
    page
}

/// Sessions shown before the findings' own sections.
const MAX_SESSIONS: usize = 9;

fn key_figures(found: &Diagnosed) -> Vec<KeyFigure> {
    let diagnosis = &found.diagnosis;
    let fits = &diagnosis.fits;
    // Of so few rows the benefit is the priors', not the data's.
    let benefit = found.benefit.as_ref().filter(|_| diagnosis.poses_needed.is_none());
    let mut figures = super::identification::benefit_figures(benefit);
    figures.extend([
        KeyFigure::new("Held-out RMSE", found.estimated.calibrated.held_out.rmse, 3, "mm").note(format!(
            "of the written arm; with all causes found: {:.3} mm; geometry alone: {:.3} mm",
            fits.extended.cv_rmse_mm, fits.geometric.cv_rmse_mm
        )),
        KeyFigure::new("Held-out, blocks", fits.extended.cv_blocks_rmse_mm, 3, "mm").note(format!(
            "with all causes found; geometry alone: {:.3} mm",
            fits.geometric.cv_blocks_rmse_mm
        )),
        KeyFigure::new("Held-out, regions", fits.extended.cv_regions_rmse_mm, 3, "mm").note(format!(
            "with all causes found, far from measured poses; geometry alone: {:.3} mm",
            fits.geometric.cv_regions_rmse_mm
        )),
        KeyFigure::new("Noise floor", diagnosis.noise_floor_mm, 3, "mm")
            .note(diagnosis.noise_floor_source.to_string()),
    ]);
    figures
}

fn steps(diagnosis: &Diagnosis) -> String {
    Bars {
        title: "Held-out error after each step".to_owned(),
        y: Axis::new("held-out RMSE", "mm"),
        names: (0..diagnosis.steps.len()).map(step_name).collect(),
        groups: vec![BarGroup::new("", diagnosis.steps.iter().map(|step| Some(step.cv_rmse_mm)))],
        labels: Some(Precision::Decimals(3)),
    }
    .svg()
}

/// Largest number of points in a plot.
const POINTS: usize = 3000;

fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    points.iter().step_by(points.len().div_ceil(POINTS).max(1)).copied().collect()
}

fn drawn(picture: &Picture) -> String {
    Graph {
        title: String::new(),
        x: Axis::new(picture.x.0.clone(), picture.x.1),
        y: Axis::new(picture.y.0.clone(), picture.y.1),
        series: vec![
            Series::points("without this cause", thinned(&picture.before)).ink(Ink::Vermilion),
            Series::points("with it", thinned(&picture.after)).ink(Ink::Blue),
        ],
        references: vec![Reference::Horizontal(0.0, String::new())],
        spans: picture
            .rows
            .map(|[from, to]| Span { range: [from as f64, to as f64], name: "rows of the cause".to_owned() })
            .into_iter()
            .collect(),
    }
    .svg()
}

fn caption(picture: &Picture) -> String {
    format!(
        "{} against {}, without and with this cause, everything else fitted.",
        capitalised(&picture.y.0),
        picture.x.0
    )
}
