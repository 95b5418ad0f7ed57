//! Summary of ltlm-2024 Table 8, and shape error after rigid registration.

use super::side::{AFTER, BEFORE, Side, by_program, has};
use super::words::{REMAINDER, meaning};
use crate::table::{Cell, Column, Table};
use truegrind_compensation::deviation::{After, Block, PathReport};

/// Summary of ltlm-2024 Table 8: a row before compensation and one per model after. If the models disagree on the deviation before,
/// each has its own row.
pub fn block_table(reports: &[PathReport]) -> Table {
    let all: Vec<&PathReport> = reports.iter().collect();
    block(&all, by_program(reports).len() > 1)
}

/// RMS deviation before and after the best rigid registration, for a base that was not measured in the work object.
pub fn registered_table(reports: &[PathReport]) -> Table {
    let all: Vec<&PathReport> = reports.iter().collect();
    registered(&all, by_program(reports).len() > 1)
}

/// [`block_table`], with a program column if there are several.
pub(super) fn block(reports: &[&PathReport], programs: bool) -> Table {
    // The unit is in the title, so that the table fits the terminal width.
    let number = |key: &str, heading: &str| Column::number(key, heading, "", 3);
    let mut columns = first_columns(programs);
    columns.extend((1..=5).map(|point| number(&format!("p{point}_mm"), &format!("P{point}"))));
    columns.extend([
        number("mean_mm", "mean"),
        number("mean_absolute_mm", "mean |d|"),
        number("standard_deviation_mm", "SD"),
        number("max_mm", "max"),
        number("sigma_mm", "1σ"),
        number("model_held_out_rmse_mm", "held-out"),
    ]);
    let mut table = Table::new("Deviation of path points before and after compensation [mm]", columns);
    for row in rows(reports, |report, side| report.block(side)) {
        let Block { five_mm, all } = row.value;
        let mut cells = row.first_cells(programs);
        cells.extend(five_mm.map(Cell::from));
        cells.extend([all.mean, all.mean_absolute, all.standard_deviation, all.max].map(Cell::from));
        // The uncorrected path on an actual arm is no prediction of the model.
        let model = (!row.before || row.report.after != After::Achieved).then_some(row.report);
        cells.extend([model.and_then(|m| m.sigma_rms_mm()).into(), model.and_then(|m| m.held_out_mm).into()]);
        table.push(cells);
    }
    let (mut with, mut without) = (0, 0);
    for point in reports.iter().flat_map(|report| report.cut()) {
        match point.normal {
            Some(_) => with += 1,
            None => without += 1,
        }
    }
    table.notes.push(
        match (with, without) {
            (_, 0) => {
                "Signed along the outward surface normal: positive is off the surface, negative is too deep."
            }
            (0, _) => "No surface is given: deviations are unsigned, so mean and mean |d| are equal.",
            _ => "Signed along the outward surface normal where the surface is known; unsigned elsewhere.",
        }
        .to_owned(),
    );
    table.notes.push(
        "P1 to P5 are the centres of five equal sections of the cut; the other columns are over the whole cut. The mean is signed, \
         as in ltlm-2024 Table 8; SD uses n − 1. Compare models by mean |d| and max. 1σ: predicted from the covariance (RMS over \
         the cut). held-out: RMSE of the model on rows not used in the fit."
            .to_owned(),
    );
    if reports.iter().any(|report| report.after == After::PredictedRemainder && has(report, AFTER)) {
        table.notes.push(REMAINDER.to_owned());
    }
    table
}

/// [`registered_table`], with a program column if there are several.
pub(super) fn registered(reports: &[&PathReport], programs: bool) -> Table {
    let mut columns = first_columns(programs);
    columns.push(Column::number("rms_mm", "RMS", "mm", 4));
    columns.push(Column::number("registered_rms_mm", "RMS after rigid registration", "mm", 4));
    let mut table = Table::new("Absolute deviation, and shape of the path alone", columns);
    let both = |report: &PathReport, side: Side| {
        let squares: Vec<f64> =
            report.cut().filter_map(|p| side(p).map(|d| d.vector_mm.norm_squared())).collect();
        let rms = (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt());
        rms.map(|rms| (rms, report.registered_rms_mm(side)))
    };
    for row in rows(reports, both) {
        let mut cells = row.first_cells(programs);
        cells.extend([row.value.0.into(), row.value.1.into()]);
        table.push(cells);
    }
    table.notes.push(
        "RMS over all points of the cut, corrected or not. Registration removes the best rigid motion; the rest is the shape error of the path, \
         which matters if the base was not measured in the work object."
            .to_owned(),
    );
    table
}

/// One row of a summary.
struct Row<'a, T> {
    report: &'a PathReport,
    before: bool,
    path: String,
    value: T,
}

impl<T> Row<'_, T> {
    fn first_cells(&self, programs: bool) -> Vec<Cell> {
        let mut cells = vec![self.path.as_str().into()];
        if programs {
            cells.insert(0, self.report.program.as_str().into());
        }
        cells
    }
}

fn first_columns(programs: bool) -> Vec<Column> {
    let mut columns = vec![Column::text("path", "Path")];
    if programs {
        columns.insert(0, Column::text("program", "Program"));
    }
    columns
}

/// Rows of each program: before compensation, once if all models agree, then each model after.
fn rows<'a, T: PartialEq>(
    reports: &[&'a PathReport],
    value: impl Fn(&'a PathReport, Side) -> Option<T>,
) -> Vec<Row<'a, T>> {
    let mut programs: Vec<&str> = Vec::new();
    for report in reports {
        if !programs.contains(&report.program.as_str()) {
            programs.push(&report.program);
        }
    }
    let mut out = Vec::new();
    for program in programs {
        let of: Vec<&'a PathReport> =
            reports.iter().copied().filter(|report| report.program == program).collect();
        let before: Vec<(&'a PathReport, T)> =
            of.iter().filter_map(|report| Some((*report, value(report, BEFORE)?))).collect();
        let agreed = before.windows(2).all(|pair| pair[0].1 == pair[1].1);
        let shown = if agreed { 1 } else { before.len() };
        for (report, value) in before.into_iter().take(shown) {
            let path = if agreed { "before".to_owned() } else { format!("before, under {}", report.model) };
            out.push(Row { report, before: true, path, value });
        }
        for report in of.into_iter().filter(|report| has(report, AFTER)) {
            if let Some(value) = value(report, AFTER) {
                let path = format!("{}, {}", report.model, meaning(report.after));
                out.push(Row { report, before: false, path, value });
            }
        }
    }
    out
}
