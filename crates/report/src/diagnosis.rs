//! Report on a diagnosis: for each finding the cause, the plot that shows it, the gain on held-out rows and the remedy; then what
//! the data cannot decide.

use super::document::{Block, Document, KeyFigure, Provenance, Source, Verdict};
use super::number::{Precision, listed};
use super::plot::{Axis, BarGroup, Bars, Graph, Ink, Reference, Series, Span};
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::decision::DIAGNOSIS_FILE;
use truegrind_calibration::diagnosis::diagnose::Diagnosed;
use truegrind_calibration::diagnosis::finding::{
    Confidence, Diagnosis, Family, Finding, FoundParameter, Member,
};
use truegrind_calibration::diagnosis::picture::Picture;
use truegrind_calibration::measurement::dataset::Dataset;

/// The whole page.
pub fn document(found: &Diagnosed, dataset: &Dataset) -> Document {
    let diagnosis = &found.diagnosis;
    let mut page = summary(found);
    page.figure(
        steps(diagnosis),
        "Held-out error (five random folds, everything refitted in each) from the data sheet to the extended model. All bars have \
         fitted frames, so the gain of fitting them is not shown. Causes are numbered in the order of acceptance.",
    );
    page.push(step_table(diagnosis));
    for (k, finding) in diagnosis.findings.iter().enumerate() {
        page.heading(2, format!("{}. {}", k + 1, title(finding)));
        page.paragraph(format!("{}. ({}.)", sentence(&finding.cause), sentence(word(finding.confidence))));
        page.push(Block::List(reasons(finding)));
        if let Some(picture) = found.pictures.get(k).and_then(Option::as_ref) {
            page.figure(drawn(picture), caption(picture));
        }
        if !finding.parameters.is_empty() {
            page.push(parameters(finding));
        }
        if !finding.sessions.is_empty() {
            page.push(sessions(finding));
        }
        if !finding.members.is_empty() {
            page.push(members(finding));
        }
        if !finding.alternatives.is_empty() {
            page.push(rivals(finding));
        }
        if let Some(decision) = finding.decided_by.as_ref().filter(|decision| **decision != finding.remedy) {
            page.paragraph(format!("What decides: {decision}."));
        }
        page.paragraph(format!("What to do: {}.", finding.remedy));
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

/// Summary for the terminal.
pub fn summary(found: &Diagnosed) -> Document {
    let diagnosis = &found.diagnosis;
    let mut page = Document::new(format!("Diagnosis of {}", diagnosis.dataset.robot));
    page.subtitle = format!(
        "{}, {} rows, sensor {}, {} set aside",
        diagnosis.dataset.file, diagnosis.dataset.rows, diagnosis.dataset.sensor, diagnosis.dataset.set_aside
    );
    page.push(super::identification::judged(&found.estimated));
    let fits = &diagnosis.fits;
    let causes = causes(diagnosis);
    let sure = diagnosis.findings.iter().filter(|f| f.confidence == Confidence::Identified).count();
    let found_there = match (sure, diagnosis.findings.len() - sure) {
        (0, 0) => "No cause beyond geometry was found".to_owned(),
        (0, _) => "No cause beyond geometry is certain".to_owned(),
        (1, _) => "One cause beyond geometry was identified".to_owned(),
        (n, _) => format!("{n} causes beyond geometry were identified"),
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
        None if diagnosis.findings.is_empty() => (Status::Good, found_there),
        None => (Status::Warning, found_there),
    };
    let mut figures = super::identification::benefit_figures(found.benefit.as_ref());
    figures.extend([
        KeyFigure::new("Held-out RMSE", fits.extended.cv_rmse_mm, 3, "mm").note(format!(
            "with all causes, written or not; geometry alone: {:.3} mm",
            fits.geometric.cv_rmse_mm
        )),
        KeyFigure::new("Held-out, blocks", fits.extended.cv_blocks_rmse_mm, 3, "mm")
            .note(format!("geometry alone: {:.3} mm", fits.geometric.cv_blocks_rmse_mm)),
        KeyFigure::new("Noise floor", diagnosis.noise_floor_mm, 3, "mm")
            .note(diagnosis.noise_floor_source.clone()),
        KeyFigure::new("Findings", diagnosis.findings.len(), 0, "").note(format!(
            "{} identified",
            diagnosis.findings.iter().filter(|f| f.confidence == Confidence::Identified).count()
        )),
    ]);
    page.push(figures);
    page.push(Verdict::new(
        status,
        format!(
            "{headline}: held-out error {:.3} mm (geometry alone {:.3}, data sheet {:.3})",
            fits.extended.cv_rmse_mm, fits.geometric.cv_rmse_mm, fits.nominal.cv_rmse_mm
        ),
        causes,
    ));
    if !diagnosis.findings.is_empty() {
        page.push(finding_table(diagnosis));
    }
    page.push(stage_table(diagnosis));
    if !diagnosis.transfers.is_empty() {
        page.push(transfer_table(diagnosis));
    }
    page
}

/// The findings: identified causes as sentences, possible ones by name.
fn causes(diagnosis: &Diagnosis) -> Vec<String> {
    let worth = |f: &Finding| f.worth_mm.map_or_else(String::new, |mm| format!(" ({mm:.3} mm)"));
    let is_sure = |f: &&Finding| f.confidence == Confidence::Identified;
    let named = |f: &&Finding| !matches!(f.effect, CauseKind::Unexplained | CauseKind::SmallDisturbances);
    let mut out: Vec<String> = diagnosis
        .findings
        .iter()
        .filter(is_sure)
        .map(|f| format!("{}{}", sentence(&f.cause), worth(f)))
        .collect();
    let possible: Vec<String> = diagnosis
        .findings
        .iter()
        .filter(|f| !is_sure(f))
        .filter(named)
        .map(|f| {
            if f.members.is_empty() {
                return format!("{}{}", located(f.effect, f.joints.as_deref(), f.rows), worth(f));
            }
            let members: Vec<String> = f.members.iter().map(member).collect();
            format!("an error {}{}: {}", family(f), worth(f), members.join(", "))
        })
        .collect();
    if !possible.is_empty() {
        out.push(format!("Possible, but not certain: {}", possible.join("; ")));
    }
    let rest = diagnosis.findings.iter().filter(|f| !named(f));
    out.extend(rest.map(|f| sentence(&f.cause)));
    out.extend(decisions(diagnosis));
    out
}

/// A cause with its joints or rows, for a sentence.
fn located(effect: CauseKind, joints: Option<&[usize]>, rows: Option<[usize; 2]>) -> String {
    let words = effect.words();
    // "gear two joints of joints 2 and 3" says it twice.
    let name = words.strip_suffix(" two joints").unwrap_or(&words);
    let place = match (joints, rows) {
        (_, Some([from, to])) => format!(" in rows {from} to {to}"),
        (Some([one, other]), _) => format!(" of joints {one} and {other}"),
        (Some([joint]), _) => format!(" of joint {joint}"),
        (Some(joints), _) if !joints.is_empty() => format!(" of joints {}", listed(joints)),
        _ => String::new(),
    };
    format!("{name}{place}")
}

/// A cause that cannot be told apart from others, with its share.
fn member(member: &Member) -> String {
    let share =
        if member.share < 0.01 { "below 1".to_owned() } else { format!("{:.0}", 100.0 * member.share) };
    format!("{} {share} %", located(member.effect, member.joints.as_deref(), member.rows))
}

/// The families of the members of a finding: the only one, or each with its share, largest first; none of less than a hundredth.
fn family(finding: &Finding) -> String {
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

/// The measurements that decide, each once, with the numbers of their findings.
fn decisions(diagnosis: &Diagnosis) -> Vec<String> {
    let asked = (1..).zip(&diagnosis.findings).filter_map(|(k, f)| {
        let number: usize = k;
        Some((format!("{number} ({})", f.effect.words()), f.decided_by.as_deref()?))
    });
    let mut out: Vec<(&str, Vec<String>)> = Vec::new();
    for (number, decision) in asked {
        match out.iter_mut().find(|(same, _)| *same == decision) {
            Some((_, numbers)) => numbers.push(number),
            None => out.push((decision, vec![number])),
        }
    }
    let names_file = out.iter().any(|(decision, _)| decision.contains(DIAGNOSIS_FILE));
    let file =
        names_file.then(|| format!("{DIAGNOSIS_FILE} is what `diagnose --json {DIAGNOSIS_FILE}` writes"));
    let lines = out.into_iter().map(|(decision, numbers)| {
        let of = if numbers.len() == 1 { "finding" } else { "findings" };
        format!("To decide {of} {}: {decision}", numbers.join(" and "))
    });
    lines.chain(file).collect()
}

/// Errors of the models on other measurements of the same arm.
pub fn transfer_table(diagnosis: &Diagnosis) -> Table {
    Table::of(
        "RMSE on other measurements of this arm, only the frames refitted",
        &diagnosis.transfers,
        [
            (Column::text("file", "file"), |other| other.file.as_str().into()),
            (Column::count("rows", "rows"), |other| other.rows.into()),
            (Column::number("nominal_rmse_mm", "data sheet", "mm", 3), |other| other.nominal_rmse_mm.into()),
            (Column::number("geometric_rmse_mm", "geometry", "mm", 3), |other| {
                other.geometric_rmse_mm.into()
            }),
            (Column::number("extended_rmse_mm", "extended", "mm", 3), |other| other.extended_rmse_mm.into()),
        ],
    )
}

/// Errors by stage.
pub fn stage_table(diagnosis: &Diagnosis) -> Table {
    let fits = &diagnosis.fits;
    let mut table = Table::of(
        "Errors by stage",
        &[
            ("nominal: frames fitted", &fits.nominal),
            ("geometric: and links", &fits.geometric),
            ("extended: and causes", &fits.extended),
        ],
        [
            (Column::text("stage", "stage"), |(name, _)| (*name).into()),
            (Column::number("rmse_mm", "RMSE", "mm", 3), |(_, stage)| stage.rmse_mm.into()),
            (Column::number("mean_mm", "mean", "mm", 3), |(_, stage)| stage.mean_mm.into()),
            (Column::number("max_mm", "max", "mm", 3), |(_, stage)| stage.max_mm.into()),
            (Column::number("cv_rmse_mm", "held out, random", "mm", 3), |(_, stage)| stage.cv_rmse_mm.into()),
            (Column::number("cv_blocks_rmse_mm", "held out, blocks", "mm", 3), |(_, stage)| {
                stage.cv_blocks_rmse_mm.into()
            }),
        ],
    );
    table.notes.push(
        "RMSE, mean and max on the rows of the fit. Held out: five random folds, and contiguous blocks, which reveal drifts and \
         jumps along the rows. identify holds out one share of the rows once: its figure scatters more."
            .to_owned(),
    );
    table
}

/// One row per finding.
pub fn finding_table(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::of(
        "Findings",
        &diagnosis.findings,
        [
            (Column::text("effect", "effect"), |finding| finding.effect.as_str().into()),
            (Column::text("where", "where"), |finding| place(finding).into()),
            (Column::text("confidence", "confidence"), |finding| word(finding.confidence).into()),
            (Column::number("worth_mm", "size", "mm", 3), |finding| finding.worth_mm.into()),
            (Column::significant("p_value", "p", "", 2), |finding| p_value(finding.p_value)),
            (Column::number("cv_rmse_before_mm", "held out without", "mm", 4), |finding| {
                finding.gain.cv_rmse_before_mm.into()
            }),
            (Column::number("cv_rmse_after_mm", "held out with", "mm", 4), |finding| {
                finding.gain.cv_rmse_after_mm.into()
            }),
        ],
    );
    table.notes.push(
        "size: change of the readings, RMS over all rows. identified: better than its alternatives, significant once smooth unmodelled \
         trends are allowed for, and found again in halves of the rows."
            .to_owned(),
    );
    table
}

/// The causes that cannot be told apart.
fn members(finding: &Finding) -> Table {
    let mut table = Table::of(
        "Causes that these rows cannot tell apart",
        &finding.members,
        [
            (Column::text("family", "family"), |member| member.family.words().into()),
            (Column::text("effect", "effect"), |member| member.effect.as_str().into()),
            (Column::text("where", "where"), |member| match (&member.joints, member.rows) {
                (_, Some([from, to])) => format!("rows {from} to {to}").into(),
                (Some(joints), _) => format!("joint {}", listed(joints)).into(),
                _ => "all rows".into(),
            }),
            (Column::number("share", "share", "%", 0), |member| (100.0 * member.share).into()),
        ],
    );
    table.notes.push(
        "share: of the evidence, if exactly one of these is true. How often the largest share is right was not measured: it is no probability, and no \
         reason to change a part before the deciding measurement."
            .to_owned(),
    );
    table
}

/// Row ranges of a set-up that changed with time.
fn sessions(finding: &Finding) -> Table {
    Table::of(
        "Sessions",
        &finding.sessions,
        [
            (Column::text("rows", "rows"), |session| {
                format!("{} to {}", session.rows[0], session.rows[1]).into()
            }),
            (Column::text("what", "cause of a shift of these rows alone"), |session| {
                session.effect.as_str().into()
            }),
            (Column::number("worth_mm", "size", "mm", 3), |session| session.worth_mm.into()),
        ],
    )
}

/// A p-value; an underflowing one is stated as a bound.
fn p_value(p: f64) -> Cell {
    if p < 1e-300 { "< 1e-300".into() } else { p.into() }
}

fn word(confidence: Confidence) -> &'static str {
    match confidence {
        Confidence::Identified => "identified",
        Confidence::Ambiguous => "ambiguous",
    }
}

pub(super) fn place(finding: &Finding) -> String {
    if let Some([from, to]) = finding.rows {
        return format!("rows {from} to {to}");
    }
    if let Some(list) = &finding.row_list {
        return format!("rows {}", listed(list));
    }
    match &finding.joints {
        Some(joints) => format!("joint {}", listed(joints)),
        None => "all rows".to_owned(),
    }
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn title(finding: &Finding) -> String {
    format!("{}, {}", sentence(&finding.effect.words()), place(finding))
}

fn reasons(finding: &Finding) -> Vec<String> {
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
    out.push(match finding.confidence {
        Confidence::Identified if finding.alternatives.is_empty() => "no alternative comes close".to_owned(),
        Confidence::Identified => "the alternatives below were fitted in its place and are worse".to_owned(),
        Confidence::Ambiguous if finding.doubts.is_empty() && !finding.alternatives.is_empty() => {
            "an alternative below explains nearly as much, so the cause is not certain".to_owned()
        }
        Confidence::Ambiguous => "the cause is not certain".to_owned(),
    });
    out.extend(finding.doubts.iter().cloned());
    out
}

fn parameters(finding: &Finding) -> Table {
    let mut table = Table::new(
        "Parameters",
        vec![
            Column::text("name", "parameter"),
            Column::significant("value", "value ± 1σ", "", 4),
            Column::text("unit", "unit"),
        ],
    );
    // The knots of a map are shown as a plot.
    let shown: Vec<&FoundParameter> = finding.parameters.iter().filter(|p| p.name != "knot").collect();
    for parameter in shown {
        let (scale, unit) = super::number::handy(&parameter.unit);
        table.push([
            Cell::from(parameter.name.as_str()),
            Cell::with_sigma(parameter.value * scale, parameter.sigma.map(|s| s * scale)),
            unit.into(),
        ]);
    }
    table
}

fn rivals(finding: &Finding) -> Table {
    Table::of(
        "Alternatives fitted in its place",
        &finding.alternatives,
        [
            (Column::text("effect", "effect"), |rival| rival.effect.as_str().into()),
            (Column::text("where", "where"), |rival| match (&rival.joints, rival.rows) {
                (_, Some([from, to])) => format!("rows {from} to {to}").into(),
                (Some(joints), _) => format!("joint {}", listed(joints)).into(),
                _ => "all rows".into(),
            }),
            (Column::number("cv_rmse_mm", "held out", "mm", 4), |rival| rival.cv_rmse_mm.into()),
            (Column::number("beaten_by", "worse by", "2 ln Bayes factor", 1), |rival| rival.beaten_by.into()),
        ],
    )
}

/// Effects that the data cannot decide.
pub fn not_testable_table(diagnosis: &Diagnosis) -> Table {
    Table::of(
        "Not testable",
        &diagnosis.not_testable,
        [
            (Column::text("effect", "effect"), |item| match &item.joints {
                Some(joints) => format!("{}, joint {}", item.effect, listed(joints)).into(),
                None => item.effect.as_str().into(),
            }),
            (Column::text("reason", "why"), |item| item.reason.as_str().into()),
            (Column::text("remedy", "what would decide"), |item| item.remedy.as_str().into()),
        ],
    )
}

fn remaining(diagnosis: &Diagnosis) -> String {
    let rmse = diagnosis.fits.extended.rmse_mm;
    match (&diagnosis.remaining, diagnosis.noise_floor_mm) {
        (Some(text), _) => format!("{}.", sentence(text)),
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

/// Name of a bar: the first two stages, then causes by number.
fn step_name(index: usize) -> String {
    match index {
        0 => "data sheet".to_owned(),
        1 => "geometry".to_owned(),
        n => format!("+ {}", n - 1),
    }
}

/// The steps of the diagnosis.
pub fn step_table(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new(
        "Steps",
        vec![
            Column::text("step", "step"),
            Column::text("added", "added"),
            Column::number("cv_rmse_mm", "held out", "mm", 4),
        ],
    );
    for (index, step) in diagnosis.steps.iter().enumerate() {
        table.push([step_name(index).into(), step.added.as_str().into(), step.cv_rmse_mm.into()]);
    }
    table
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
        sentence(&picture.y.0),
        picture.x.0
    )
}
