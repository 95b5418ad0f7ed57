//! A ground surface before and after compensation with each method.

use serde_json::{Value, json};

use crate::comparison::grinding::GrindingResult;
use crate::compensation::deviation::{Block, PathReport};
use crate::report::document::Document;
use crate::report::plot::{Axis, ColorMap, PlanPath, PlanView};
use crate::report::table::{Cell, Column, Table};

/// Terminal.
pub(super) fn summary(page: &mut Document, result: &GrindingResult) {
    page.push(table(result));
}

/// Page.
pub(super) fn page(page: &mut Document, result: &GrindingResult) {
    page.push(table(result));
    page.heading(2, "Where on the part");
    page.figure(
        plan(result),
        "The path from above, coloured by the deviation along the normal, one panel before and one for each method, on a \
         common scale.",
    );
}

/// The paper's table with the figures that it leaves out.
pub(super) fn table(result: &GrindingResult) -> Table {
    let label = if result.simulated { "simulated actual arm" } else { "predicted on the sound estimate" };
    let mut columns = vec![Column::text("id", ""), Column::text("solver", "Method")];
    columns.extend((1..=5).map(|k| Column::number(format!("p{k}_mm"), format!("P{k}"), "mm", 2)));
    columns.extend([
        Column::number("mean_mm", "mean, signed", "mm", 3),
        Column::number("sd_mm", "SD", "mm", 3),
        Column::number("mean_absolute_mm", "mean |d|", "mm", 3),
        Column::number("max_mm", "max", "mm", 3),
        Column::number("held_out_rmse_mm", "held-out RMSE", "mm", 3),
        Column::number("paper_mean_mm", "paper, mean", "mm", 2),
        Column::number("paper_sd_mm", "paper, SD", "mm", 2),
        Column::text("note", ""),
    ]);
    let mut table = Table::new(format!("Deviation along the normal, {}, {label}", result.surface), columns);
    let block = |block: Option<&Block>| -> Vec<Cell> {
        let Some(block) = block else { return vec![Cell::Missing; 9] };
        let mut cells: Vec<Cell> = block.five_mm.iter().map(|v| Cell::Number(*v)).collect();
        cells.extend([
            block.all.mean.into(),
            block.all.standard_deviation.into(),
            block.all.mean_absolute.into(),
            block.all.max.into(),
        ]);
        cells
    };
    let mut before: Vec<Cell> = vec!["BC".into(), "before compensation".into()];
    before.extend(block(result.before.as_ref()));
    let paper = result.settings.before;
    before.extend([Cell::Missing, paper.map(|p| p.mean_mm).into(), paper.map(|p| p.sd_mm).into()]);
    table.push(before);
    for row in &result.rows {
        let mut cells: Vec<Cell> = vec![row.id.as_str().into(), row.solver.name.into()];
        cells.extend(block(row.after.as_ref()));
        let note = match (&row.failure, row.refused) {
            (Some(why), _) => format!("failed: {why}"),
            (None, 0) => String::new(),
            (None, n) => format!("{n} targets refused"),
        };
        cells.extend([
            row.held_out.rmse.into(),
            row.paper.map(|p| p.mean_mm).into(),
            row.paper.map(|p| p.sd_mm).into(),
            note.into(),
        ]);
        table.push(cells);
    }
    table.notes = vec![
        format!(
            "P1 to P5 are spread over the cut; mean, SD (n − 1, signed), mean |d| and max over all {} points of it.",
            result.points
        ),
        "Corrections up to 100 mm and 20° are let through here, so that the consequence of each method is seen; compensate \
         refuses what exceeds 10 mm or 2°."
            .to_owned(),
        "The paper's part, path and errors are not given: its mean and SD, over five points, stand beside for their kind."
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
        "actual": if result.simulated { "simulated" } else { "sound estimate" },
        "points": result.points,
        "before": { "block": result.before, "paper": result.settings.before },
        "methods": rows,
    })
}
