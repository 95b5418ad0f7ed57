//! A ground surface before and after compensation with each method.

use serde_json::{Value, json};

use super::words;
use crate::experiment::PaperPoints;
use crate::grinding::{GrindingCase, GrindingResult, GrindingRow};
use crate::verdict::LEVEL;
use truegrind_calibration::identification::solver::SOLVERS;
use truegrind_compensation::deviation::{Block as Deviations, PathReport};
use truegrind_math::statistics::mean_and_deviation;
use truegrind_report::document::{Block, Document, Verdict};
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
            "The path of {} from above, coloured by the deviation along the normal, one panel before and one for each method, \
             on a common scale; first case.",
            result.program
        ),
    );
}

fn label(result: &GrindingResult) -> &'static str {
    if result.simulated { "simulated actual arm" } else { "predicted on the sound estimate" }
}

/// What is shown, on which part, with how many measured rows.
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

/// Whether a row's model is the one that the program was judged by.
fn stands_in(result: &GrindingResult, row: &GrindingRow) -> bool {
    !result.simulated && result.all_rows && row.solver.name == SOLVERS[0].name
}

/// Mean ± standard deviation over the cases; nothing where a case has no result.
fn over(row: &GrindingRow, figure: fn(&Deviations) -> f64) -> Cell {
    row.over_cases(figure).map_or(Cell::Missing, |values| repeated::cell(&values))
}

/// RMSE of held-out measurements in every case.
fn held_out(row: &GrindingRow) -> Vec<f64> {
    row.cases.iter().map(|c| c.held_out.rmse).collect()
}

/// What one part and so many draws of measurements can say.
fn verdict(result: &GrindingResult) -> Verdict {
    let mm = |v: f64| Precision::Significant(2).format(v);
    // A program that was only partly rewritten is no result, and what stands in for the arm is right by definition.
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
            "{} leaves least: {} mm of {} mm mean size along the normal ({})",
            best.id,
            mm(*left),
            mm(before),
            label(result)
        ),
        Some((best, left)) => format!(
            "No method leaves less than no compensation: {} {} mm, before {} mm mean size along the normal ({})",
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
            "Not compared, since targets could not be rewritten: {}. There their figures are of a program left as it was.",
            refused.join(", ")
        ));
    }
    let worse: Vec<&str> = order.iter().filter(|(_, v)| *v > before).map(|(r, _)| r.id.as_str()).collect();
    if !worse.is_empty() {
        reasons.push(format!(
            "Worse than no compensation, on the mean of the cases: {}. What the measurements do not see, a method without \
             priors moves at will, and a program in another place or turn shows it.",
            worse.join(", ")
        ));
    }
    reasons.extend(against(result));
    let fits = || order.iter().map(|(r, _)| mean_and_deviation(&held_out(r)).0);
    if let (Some(most), Some(least)) = (fits().reduce(f64::max), fits().reduce(f64::min)) {
        reasons.push(format!(
            "On held-out measurements the methods leave between {} and {} mm: a good fit there is no promise for the part.",
            mm(least),
            mm(most)
        ));
    }
    reasons.push(
        "One part, in one place: the cases vary the measurements only, and another program asks for another order. The \
         paper's Table 8 has one part and one case."
            .to_owned(),
    );
    Verdict::new(Status::Good, headline, reasons)
}

/// Which methods differ from the reference in what they leave on the part.
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
    say(&better, &format!("Leaves significantly less on the part than {reference}"));
    say(&worse, &format!("Leaves significantly more than {reference}"));
    say(&alike, &format!("Not told apart from {reference} by the signed-rank test"));
    if !out.is_empty() {
        out.push(
            "Signed-rank test over the cases, two-sided, after Holm's correction; it takes the cases as independent, and \
             they share rows."
                .to_owned(),
        );
    }
    out
}

/// Table 8 as the paper has it, of the first case.
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
        "P1 to P5 at the middles of five equal sections of the cut. mean is signed, SD is n - 1 of signed values, as in the \
         paper's Table 8: with signs of both kinds a mean near zero says little. Its mean |d| is worked out from its points."
            .to_owned(),
        "The paper's part, path and errors are not given: its figures stand beside for their kind, not for their size.".to_owned(),
    ];
    table
}

/// The points that the paper prints.
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

/// All of the cut.
pub(super) fn table(result: &GrindingResult) -> Table {
    let mut table = Table::new(
        title(result, "All of the cut, deviation along the normal in mm"),
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
            (Some(why), _) => format!("failed: {why}"),
            (None, 0) if stands_in(result, row) => "stands in for the arm".to_owned(),
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
            repeated::cell(&held_out(row)),
            note.into(),
        ]);
    }
    table.notes = vec![
        format!(
            "{} points of the cut; SD is n - 1 of signed values. ± is the standard deviation over the cases. held-out: RMSE of \
             measurements that the fit did not see.",
            result.points
        ),
        "Corrections up to 100 mm and 20° are let through here, so that the consequence of each method is seen; compensate \
         refuses what exceeds 10 mm or 2°."
            .to_owned(),
    ];
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

/// Everything.
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
    })
}
