//! Report of a ground surface before and after compensation with each method.

use serde_json::{Value, json};

use super::{named_causes, words};
use crate::experiment::PaperPoints;
use crate::grinding::{GrindingCase, GrindingResult, GrindingRow};
use crate::verdict::LEVEL;
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_compensation::deviation::{Block as Deviations, PathReport};
use truegrind_math::statistics::mean_and_deviation;
use truegrind_report::document::{Block, Document, PageVerdict};
use truegrind_report::number::Precision;
use truegrind_report::plot::{Axis, ColorMap, PlanPath, PlanView};
use truegrind_report::repeated;
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Column, Table};

/// Terminal.
pub(super) fn summary(page: &mut Document, result: &GrindingResult) {
    page.push(verdict(result));
    page.push(five(result));
    page.push(table(result));
}

/// Page.
pub(super) fn page(page: &mut Document, result: &GrindingResult) {
    page.push(verdict(result));
    page.push(five(result));
    page.push(Block::Details {
        summary: "The five points of the paper's Table 8".to_owned(),
        blocks: vec![papers(result).into()],
    });
    page.push(table(result));
    page.heading(2, "Where on the part");
    page.figure(
        plan(result),
        format!(
            "The path of {} from above, coloured by the deviation along the normal: one panel before compensation and one for \
             each method, on a common scale; first case.",
            result.program
        ),
    );
}

fn label(result: &GrindingResult) -> &'static str {
    if result.simulated { "simulated actual arm" } else { "predicted on the sound estimate" }
}

/// Title of a table: content, part, arm, number of cases and rows.
fn title(result: &GrindingResult, what: &str) -> String {
    let protocol = if result.reduced { "Reduced protocol: " } else { "" };
    let cases = result.rows.first().map_or(0, |r| r.cases.len());
    format!(
        "{protocol}{what}, {}, {}, {cases} cases of {} rows",
        result.surface,
        label(result),
        result.measured
    )
}

/// Whether a row's model replaces the actual arm.
fn stands_in(result: &GrindingResult, row: &GrindingRow) -> bool {
    !result.simulated && result.all_rows && row.solver.name == SOLVERS[0].name
}

/// Mean ± standard deviation over the cases; missing if a case has no result.
fn over(row: &GrindingRow, figure: fn(&Deviations) -> f64) -> Cell {
    row.over_cases(figure).map_or(Cell::Missing, |values| repeated::cell(&values))
}

/// RMSE of held-out measurements in every case; `None` if a case has no model.
fn held_out(row: &GrindingRow) -> Option<Vec<f64>> {
    row.cases.iter().map(|c| (c.held_out.count > 0).then_some(c.held_out.rmse)).collect()
}

/// Verdict from one part and several draws of measurements.
fn verdict(result: &GrindingResult) -> PageVerdict {
    let mm = |v: f64| Precision::Significant(2).format(v);
    // Partly rewritten programs are not ranked, nor is the model that replaces the arm: its error is zero by definition.
    let mut order: Vec<(&GrindingRow, f64)> = result
        .rows
        .iter()
        .filter(|r| !stands_in(result, r))
        .filter_map(|r| Some((r, mean_and_deviation(&r.sizes_mm()?).0)))
        .collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let before = result.before.as_ref().map_or(f64::NAN, |b| b.all.mean_absolute);
    let headline = match order.first() {
        Some((best, left)) if *left < before => format!(
            "{} has the smallest deviation: {} mm, before {} mm, mean size along the normal ({})",
            best.id,
            mm(*left),
            mm(before),
            label(result)
        ),
        Some((best, left)) => format!(
            "No method improves on no compensation: {} {} mm, before {} mm, mean size along the normal ({})",
            best.id,
            mm(*left),
            mm(before),
            label(result)
        ),
        None => "no method could rewrite the program".to_owned(),
    };
    let mut reasons = Vec::new();
    let refused: Vec<String> = result
        .rows
        .iter()
        .filter(|r| r.refused() > 0)
        .map(|r| {
            let cases = r.cases.iter().filter(|c| c.refused > 0).count();
            format!("{} ({} targets in {cases} of {} cases)", r.id, r.refused(), r.cases.len())
        })
        .collect();
    if !refused.is_empty() {
        reasons.push(format!(
            "Not compared, since some targets could not be rewritten: {}. At these targets the figures are of the uncorrected program.",
            refused.join(", ")
        ));
    }
    let worse: Vec<&str> = order.iter().filter(|(_, v)| *v > before).map(|(r, _)| r.id.as_str()).collect();
    if !worse.is_empty() {
        reasons.push(format!(
            "Worse than no compensation, on the mean of the cases: {}. A method without priors changes parameters that the \
             measurements do not determine; the effect appears in a program at another position or orientation.",
            worse.join(", ")
        ));
    }
    reasons.extend(against(result));
    let fits = || order.iter().filter_map(|(r, _)| Some(mean_and_deviation(&held_out(r)?).0));
    if let (Some(most), Some(least)) = (fits().reduce(f64::max), fits().reduce(f64::min)) {
        reasons.push(format!(
            "On held-out measurements the methods' errors are between {} and {} mm: a good fit there does not guarantee a good part.",
            mm(least),
            mm(most)
        ));
    }
    reasons.push(
        "One part, in one place: only the measurements vary between the cases, and another program can give another order of \
         the methods. The paper's Table 8 has one part and one case."
            .to_owned(),
    );
    PageVerdict::new(Status::Good, headline, reasons)
}

/// Methods whose deviation on the part differs from the reference's.
fn against(result: &GrindingResult) -> Vec<String> {
    let reference = &result.settings.reference;
    let mut better = Vec::new();
    let mut worse = Vec::new();
    let mut alike = Vec::new();
    for (row, test) in result.rows.iter().zip(&result.against) {
        let Some(test) = test.as_ref().filter(|_| !stands_in(result, row)) else { continue };
        let difference = format!(
            "{} ({}{} mm, p = {})",
            row.id,
            if test.mean_mm > 0.0 { "+" } else { "" },
            Precision::Significant(2).format(test.mean_mm),
            words::p(test.signed_rank_holm)
        );
        match (test.signed_rank_holm < LEVEL, test.mean_mm < 0.0) {
            (true, true) => better.push(difference),
            (true, false) => worse.push(difference),
            (false, _) => alike.push(row.id.clone()),
        }
    }
    let mut out = Vec::new();
    let mut say = |of: &[String], what: &str| {
        if !of.is_empty() {
            out.push(format!("{what}: {}.", of.join(", ")));
        }
    };
    say(&better, &format!("Significantly smaller deviation than {reference}"));
    say(&worse, &format!("Significantly larger deviation than {reference}"));
    say(&alike, &format!("No significant difference from {reference} in the signed-rank test"));
    if !out.is_empty() {
        out.push(
            "Signed-rank test over the cases, two-sided, after Holm's correction; it assumes independent cases, but they \
             share rows."
                .to_owned(),
        );
    }
    out
}

/// The paper's Table 8 with our figures, first case.
fn five(result: &GrindingResult) -> Table {
    let mut columns = vec![Column::text("id", "")];
    columns.extend((1..=5).map(|k| Column::number(format!("p{k}_mm"), format!("P{k}"), "", 2)));
    columns.extend([
        Column::number("mean_mm", "mean", "", 2),
        Column::number("paper_mean_mm", "paper", "", 2),
        Column::number("mean_absolute_mm", "mean |d|", "", 2),
        Column::number("paper_mean_absolute_mm", "paper", "", 2),
        Column::number("sd_mm", "SD", "", 2),
        Column::number("paper_sd_mm", "paper", "", 2),
    ]);
    let mut table =
        Table::new(title(result, "Five points, deviation along the normal in mm, first case"), columns);
    let size = |points: &[f64; 5]| points.iter().map(|v| v.abs()).sum::<f64>() / 5.0;
    let mut add = |id: &str, ours: Option<&Deviations>, paper: Option<PaperPoints>| {
        let mut cells: Vec<Cell> = vec![id.into()];
        let points = ours.map(|block| block.five_mm);
        cells.extend((0..5).map(|k| Cell::from(points.map(|p| p[k]))));
        let both = points.map(|p| mean_and_deviation(&p));
        cells.extend([
            both.map(|b| b.0).into(),
            paper.map(|p| p.mean_mm).into(),
            points.map(|p| size(&p)).into(),
            paper.map(|p| size(&p.points_mm)).into(),
            both.map(|b| b.1).into(),
            paper.map(|p| p.sd_mm).into(),
        ]);
        table.push(cells);
    };
    add("BC", result.before.as_ref(), result.settings.before);
    for row in &result.rows {
        add(&row.id, row.cases.first().and_then(|c| c.after.as_ref()), row.paper);
    }
    table.notes = vec![
        "P1 to P5 lie in the middle of five equal sections of the cut. mean is signed and SD is that of signed values with \
         n - 1, as in the paper's Table 8; a signed mean near zero shows little. The paper's mean |d| is computed from its points."
            .to_owned(),
        "The paper does not state its part, path and errors: do not compare the size of its figures with ours.".to_owned(),
    ];
    table
}

/// The points printed in the paper.
fn papers(result: &GrindingResult) -> Table {
    let mut columns = vec![Column::text("id", "")];
    columns.extend((1..=5).map(|k| Column::number(format!("p{k}_mm"), format!("P{k}"), "mm", 2)));
    let mut table = Table::new("The paper's Table 8, its own part and arm", columns);
    let all = std::iter::once(("BC", result.settings.before))
        .chain(result.rows.iter().map(|r| (r.id.as_str(), r.paper)));
    for (id, paper) in all {
        let Some(paper) = paper else { continue };
        let mut cells: Vec<Cell> = vec![id.into()];
        cells.extend(paper.points_mm.iter().map(|v| Cell::Number(*v)));
        table.push(cells);
    }
    table
}

/// Deviations over the whole cut.
pub(super) fn table(result: &GrindingResult) -> Table {
    let mut table = Table::new(
        title(result, "Whole cut, deviation along the normal in mm"),
        vec![
            Column::text("id", ""),
            Column::text("solver", "Method"),
            Column::number("mean_mm", "mean, signed", "", 3),
            Column::number("mean_absolute_mm", "mean |d|", "", 3),
            Column::number("sd_mm", "SD", "", 3),
            Column::number("max_mm", "max", "", 3),
            Column::number("held_out_rmse_mm", "held-out", "", 3),
            Column::text("note", ""),
        ],
    );
    let mut before: Vec<Cell> = vec!["BC".into(), "before compensation".into()];
    match &result.before {
        Some(b) => before
            .extend([b.all.mean, b.all.mean_absolute, b.all.standard_deviation, b.all.max].map(Cell::Number)),
        None => before.extend([const { Cell::Missing }; 4]),
    }
    before.extend([Cell::Missing, "".into()]);
    table.push(before);
    for row in &result.rows {
        let failed = row.cases.iter().find_map(|c| c.failure.as_ref());
        let note = match (failed, row.refused()) {
            (Some(reason), _) => format!("failed: {reason}"),
            (None, 0) if stands_in(result, row) => "replaces the actual arm".to_owned(),
            (None, 0) => String::new(),
            (None, n) => format!("{n} targets refused"),
        };
        table.push([
            row.id.as_str().into(),
            row.solver.name.into(),
            over(row, |b| b.all.mean),
            over(row, |b| b.all.mean_absolute),
            over(row, |b| b.all.standard_deviation),
            over(row, |b| b.all.max),
            held_out(row).map_or(Cell::Missing, |errors| repeated::cell(&errors)),
            note.into(),
        ]);
    }
    if let Some(cases) = &result.named_causes {
        let (id, name) = named_causes::LABEL;
        let (held_out, note) = match named_causes::complete(cases) {
            Some(found) => {
                let errors: Vec<f64> = found.iter().map(|case| case.held_out.rmse).collect();
                (repeated::cell(&errors), "measurements only")
            }
            None => (Cell::Missing, "refused"),
        };
        let unknown = [const { Cell::Missing }; 4];
        table.push([id.into(), name.into()].into_iter().chain(unknown).chain([held_out, note.into()]));
    }
    table.notes = vec![
        format!(
            "{} points of the cut; SD is that of signed values with n - 1. ± is the standard deviation over the cases. \
             held-out: RMSE of measurements not used in the fit.",
            result.points
        ),
        "Corrections up to 100 mm and 20° are allowed here to show the effect of each method; compensate refuses those above \
         10 mm or 2°."
            .to_owned(),
    ];
    if let Some(cases) = &result.named_causes {
        table.notes.extend(named_causes::note(cases, result.rows.iter().filter_map(held_out)));
        table.notes.push(
            "NC is not judged on the part: the estimate that replaces the actual arm knows geometry alone, so a model with causes would \
             seem worse the more of them it has."
                .to_owned(),
        );
    }
    table
}

fn plan(result: &GrindingResult) -> String {
    let path = |name: String, report: &PathReport, after: bool| {
        let cut: Vec<_> = report.points.iter().filter(|p| p.cutting).collect();
        PlanPath {
            name,
            points: cut
                .iter()
                .map(|p| {
                    let at = p.base_from_object.inverse() * p.intended;
                    [at.translation.vector.x, at.translation.vector.y]
                })
                .collect(),
            values: cut
                .iter()
                .map(|p| if after { p.after } else { p.before }.map_or(f64::NAN, |d| d.signed_mm()))
                .collect(),
        }
    };
    let mut paths: Vec<PlanPath> =
        result.reports.first().map(|r| path("before".to_owned(), r, false)).into_iter().collect();
    paths.extend(result.reports.iter().map(|r| path(r.model.clone(), r, true)));
    PlanView {
        title: "Deviation along the normal".to_owned(),
        x: Axis::new("x", "mm"),
        y: Axis::new("y", "mm"),
        value: Axis::new("deviation", "mm"),
        colors: ColorMap::CoolWarm,
        paths,
    }
    .svg()
}

/// The whole result as JSON.
pub(super) fn json(result: &GrindingResult) -> Value {
    let case = |case: &GrindingCase| {
        json!({
            "after": case.after,
            "refused": case.refused,
            "held_out": case.held_out,
            "termination": case.termination,
            "failure": case.failure,
        })
    };
    let rows: Vec<Value> = result
        .rows
        .iter()
        .zip(&result.against)
        .map(|(row, test)| {
            json!({
                "id": row.id,
                "solver": row.solver.name,
                "paper": row.paper,
                "cases": row.cases.iter().map(case).collect::<Vec<_>>(),
                "against_reference": test,
            })
        })
        .collect();
    json!({
        "surface": result.surface,
        "program": result.program,
        "actual": if result.simulated { "simulated" } else { "sound estimate" },
        "rows": result.measured,
        "reduced_protocol": result.reduced,
        "reference": result.settings.reference,
        "points": result.points,
        "before": { "block": result.before, "paper": result.settings.before },
        "methods": rows,
        "named_causes": result.named_causes,
    })
}
