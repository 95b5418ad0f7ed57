//! A ground surface before and after compensation with each method.

use serde_json::{Value, json};

use crate::comparison::experiment::PaperPoints;
use crate::comparison::grinding::{GrindingResult, GrindingRow};
use crate::compensation::deviation::{Block as Deviations, PathReport};
use crate::identification::solver::SOLVERS;
use crate::math::statistics::mean_and_deviation;
use crate::report::document::{Block, Document, Verdict};
use crate::report::number::Precision;
use crate::report::plot::{Axis, ColorMap, PlanPath, PlanView};
use crate::report::status::Status;
use crate::report::table::{Cell, Column, Table};

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
        summary: "The paper's Table 8".to_owned(),
        blocks: vec![papers(result).into()],
    });
    page.push(table(result));
    page.heading(2, "Where on the part");
    page.figure(
        plan(result),
        format!(
            "The path of {} from above, coloured by the deviation along the normal, one panel before and one for each method, \
             on a common scale.",
            result.program
        ),
    );
}

fn label(result: &GrindingResult) -> &'static str {
    if result.simulated { "simulated actual arm" } else { "predicted on the sound estimate" }
}

/// Whether a row's model is the one that the program was judged by.
fn stands_in(result: &GrindingResult, row: &GrindingRow) -> bool {
    !result.simulated && row.solver.name == SOLVERS[0].name
}

/// What one part and one draw of measurements can say.
fn verdict(result: &GrindingResult) -> Verdict {
    let mm = |v: f64| Precision::Significant(2).format(v);
    let size = |row: &GrindingRow| row.after.as_ref().map(|b| b.all.mean_absolute);
    // A program that was only partly rewritten is no result, and what stands in for the arm is right by definition.
    let counts = |r: &&GrindingRow| r.refused == 0 && !stands_in(result, r);
    let mut order: Vec<(&GrindingRow, f64)> = result
        .rows
        .iter()
        .filter(counts)
        .filter_map(|r| size(r).filter(|v| v.is_finite()).map(|v| (r, v)))
        .collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    let before = result.before.as_ref().map_or(f64::NAN, |b| b.all.mean_absolute);
    let headline = match order.first() {
        Some((best, left)) => format!(
            "{} leaves least: {} mm of {} mm mean size along the normal ({})",
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
        .filter(|r| r.refused > 0)
        .map(|r| format!("{} ({} targets)", r.id, r.refused))
        .collect();
    if !refused.is_empty() {
        reasons.push(format!(
            "Not compared, since targets could not be rewritten: {}. Their figures are of a program left as it was there.",
            refused.join(", ")
        ));
    }
    let worse: Vec<&str> = order.iter().filter(|(_, v)| *v > before).map(|(r, _)| r.id.as_str()).collect();
    if !worse.is_empty() {
        reasons.push(format!(
            "Worse than no compensation: {}. What the measurements do not see, a method without priors moves at will, and a \
             program in another place or turn shows it.",
            worse.join(", ")
        ));
    }
    if let (Some(printed), Some(lowest)) = (
        order.iter().map(|(r, _)| r.held_out.rmse).reduce(f64::max),
        order.iter().map(|(r, _)| r.held_out.rmse).reduce(f64::min),
    ) {
        reasons.push(format!(
            "On held-out measurements the methods leave between {} and {} mm: a good fit there is no promise for the part.",
            mm(lowest),
            mm(printed)
        ));
    }
    reasons.push(
        "One part and one draw of measurements: without a spread the order of methods that lie close to each other says \
         nothing. The same holds for the paper's Table 8."
            .to_owned(),
    );
    Verdict::new(Status::Good, headline, reasons)
}

/// Table 8 as the paper has it.
fn five(result: &GrindingResult) -> Table {
    let mut columns = vec![Column::text("id", ""), Column::text("solver", "Method")];
    columns.extend((1..=5).map(|k| Column::number(format!("p{k}_mm"), format!("P{k}"), "mm", 2)));
    columns.extend([
        Column::number("mean_mm", "mean", "mm", 2),
        Column::number("paper_mean_mm", "paper", "mm", 2),
        Column::number("sd_mm", "SD", "mm", 2),
        Column::number("paper_sd_mm", "paper", "mm", 2),
    ]);
    let mut table = Table::new(
        format!("Five points, deviation along the normal, {}, {}", result.surface, label(result)),
        columns,
    );
    let mut add = |id: &str, name: &str, ours: Option<&Deviations>, paper: Option<PaperPoints>| {
        let mut cells: Vec<Cell> = vec![id.into(), name.into()];
        match ours {
            Some(block) => {
                let (mean, deviation) = mean_and_deviation(&block.five_mm);
                cells.extend(block.five_mm.iter().map(|v| Cell::Number(*v)));
                cells.extend([
                    mean.into(),
                    paper.map(|p| p.mean_mm).into(),
                    deviation.into(),
                    paper.map(|p| p.sd_mm).into(),
                ]);
            }
            None => {
                cells.extend([const { Cell::Missing }; 6]);
                cells.extend([paper.map(|p| p.mean_mm).into(), Cell::Missing, paper.map(|p| p.sd_mm).into()]);
            }
        }
        table.push(cells);
    };
    add("BC", "before compensation", result.before.as_ref(), result.settings.before);
    for row in &result.rows {
        add(&row.id, row.solver.name, row.after.as_ref(), row.paper);
    }
    table.notes = vec![
        "P1 to P5 at the middles of five equal sections of the cut. mean is signed, SD is n - 1 of signed values, as in the \
         paper's Table 8: with signs of both kinds a mean near zero says little."
            .to_owned(),
        "The paper's part, path and errors are not given: its figures stand beside for their kind, not for their size.".to_owned(),
    ];
    table
}

/// What the paper prints.
fn papers(result: &GrindingResult) -> Table {
    let mut columns = vec![Column::text("id", "")];
    columns.extend((1..=5).map(|k| Column::number(format!("p{k}_mm"), format!("P{k}"), "mm", 2)));
    columns.extend([
        Column::number("mean_mm", "mean", "mm", 2),
        Column::number("mean_absolute_mm", "mean |d|, from its points", "mm", 2),
        Column::number("sd_mm", "SD", "mm", 2),
    ]);
    let mut table = Table::new("The paper's Table 8, its own part and arm", columns);
    let all = std::iter::once(("BC", result.settings.before))
        .chain(result.rows.iter().map(|r| (r.id.as_str(), r.paper)));
    for (id, paper) in all {
        let Some(paper) = paper else { continue };
        let mut cells: Vec<Cell> = vec![id.into()];
        cells.extend(paper.points_mm.iter().map(|v| Cell::Number(*v)));
        let size = paper.points_mm.iter().map(|v| v.abs()).sum::<f64>() / 5.0;
        cells.extend([paper.mean_mm.into(), size.into(), paper.sd_mm.into()]);
        table.push(cells);
    }
    table
}

/// All of the cut.
pub(super) fn table(result: &GrindingResult) -> Table {
    let mut table = Table::new(
        format!("All of the cut, deviation along the normal, {}, {}", result.surface, label(result)),
        vec![
            Column::text("id", ""),
            Column::text("solver", "Method"),
            Column::number("mean_mm", "mean, signed", "mm", 3),
            Column::number("mean_absolute_mm", "mean |d|", "mm", 3),
            Column::number("sd_mm", "SD", "mm", 3),
            Column::number("max_mm", "max", "mm", 3),
            Column::number("held_out_rmse_mm", "held-out RMSE", "mm", 3),
            Column::text("note", ""),
        ],
    );
    let block = |block: Option<&Deviations>| match block {
        Some(b) => {
            [b.all.mean.into(), b.all.mean_absolute.into(), b.all.standard_deviation.into(), b.all.max.into()]
        }
        None => [const { Cell::Missing }; 4],
    };
    let mut before: Vec<Cell> = vec!["BC".into(), "before compensation".into()];
    before.extend(block(result.before.as_ref()));
    before.extend([Cell::Missing, Cell::Missing]);
    table.push(before);
    for row in &result.rows {
        let mut cells: Vec<Cell> = vec![row.id.as_str().into(), row.solver.name.into()];
        cells.extend(block(row.after.as_ref()));
        let note = match (&row.failure, row.refused) {
            (Some(why), _) => format!("failed: {why}"),
            (None, 0) if stands_in(result, row) => "stands in for the arm".to_owned(),
            (None, 0) => String::new(),
            (None, n) => format!("{n} targets refused"),
        };
        cells.extend([row.held_out.rmse.into(), note.into()]);
        table.push(cells);
    }
    table.notes = vec![
        format!("{} points of the cut; SD is n - 1 of signed values.", result.points),
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
    let rows: Vec<Value> = result
        .rows
        .iter()
        .map(|row| {
            json!({
                "id": row.id,
                "solver": row.solver.name,
                "after": row.after,
                "refused": row.refused,
                "held_out": row.held_out,
                "termination": row.termination,
                "paper": row.paper,
                "failure": row.failure,
            })
        })
        .collect();
    json!({
        "surface": result.surface,
        "program": result.program,
        "actual": if result.simulated { "simulated" } else { "sound estimate" },
        "points": result.points,
        "before": { "block": result.before, "paper": result.settings.before },
        "methods": rows,
    })
}
