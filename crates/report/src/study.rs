//! Comparison of solvers over several splits.

use serde_json::{Value, json};

use super::document::{Document, KeyFigure, PageVerdict, Provenance, Source};
use super::number::Precision;
use super::plot::{Axis, Graph, Series};
use super::repeated;
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_calibration::identification::study::MethodRow;
use truegrind_calibration::measurement::dataset::Dataset;
use truegrind_math::statistics::{ErrorSummary, mean_and_deviation};

/// Methods whose held-out RMSE agrees within this ratio on every split reached the same optimum.
const SAME_OPTIMUM: f64 = 1e-3;

/// Name of the first row.
const REGISTERED: &str = "frames registered";

/// One row per method, the first for registered frames alone; mean ± standard deviation over the splits.
pub fn table(rows: &[MethodRow]) -> Table {
    let splits = rows.first().map_or(0, |row| row.held_out.len());
    let mut table = Table::new(
        format!("Held-out errors over {splits} splits"),
        std::iter::once(Column::text("method", "Method"))
            .chain(repeated::columns([3; 3]))
            .chain([
                Column::number("jacobian_passes", "Jacobian passes", "", 1),
                Column::text("converged", "Converged"),
            ])
            .collect(),
    );
    for row in rows {
        let ended = converged(row).map(|(yes, of)| format!("{yes} of {of}"));
        let cells = std::iter::once(Cell::from(name(row))).chain(repeated::cells(&row.held_out));
        table.push(cells.chain([passes(row).into(), ended.into()]));
    }
    table.notes = notes(rows);
    table
}

/// The page.
pub fn document(rows: &[MethodRow], robot: &str, dataset: &Dataset) -> Document {
    let splits = rows.first().map_or(0, |row| row.held_out.len());
    let mut page = Document::new(format!("Methods compared on {}", dataset.file));
    page.subtitle = format!("{robot}, {} rows, {splits} seeded splits", dataset.rows.len());
    if let Some((best, rmse, spread)) = best(rows) {
        let registered =
            rows.iter().find(|row| row.solver.is_none()).map(|row| row.over_splits(|s| s.rmse).0);
        let headline = match registered {
            Some(registered) => format!(
                "{best} has the smallest held-out error: {rmse:.3} mm RMSE ({registered:.3} mm with registered frames alone)"
            ),
            None => format!("{best} has the smallest held-out error: {rmse:.3} mm RMSE"),
        };
        let stuck: Vec<String> = rows
            .iter()
            .filter_map(|row| {
                let (yes, of) = converged(row)?;
                (yes < of).then(|| format!("{} did not converge on {} of {of} splits", name(row), of - yes))
            })
            .collect();
        let status = if stuck.is_empty() { Status::Good } else { Status::Warning };
        page.push(PageVerdict::new(status, headline, stuck));
        page.push(vec![
            KeyFigure::new("Best held-out RMSE", Cell::with_sigma(rmse, spread), 3, "mm").note(best),
            KeyFigure::new("Registered frames alone", registered, 3, "mm").note("nominal links"),
            KeyFigure::new("Splits", splits, 0, "").note("same rows for every method"),
        ]);
    }
    page.push(table(rows));
    page.heading(2, "Errors by method");
    page.figure(
        bars(rows),
        "Held-out errors, mean over the splits; whiskers are one standard deviation. They show the influence of the split, not the \
         uncertainty of the difference between two methods, which share their rows.",
    );
    if splits > 1 {
        page.figure(
            by_split(rows),
            "Held-out RMSE of each split. All methods use the same rows, so lines can be compared split by split; coinciding lines \
             reached the same optimum.",
        );
    }
    page.push(Provenance {
        sources: vec![Source::new(&dataset.file, "Measurements", &dataset.sha256, Some(dataset.rows.len()))],
        remarks: vec![
            ("Robot".to_owned(), robot.to_owned()),
            ("Splits".to_owned(), format!("{splits}, seeds 0 to {}", splits.saturating_sub(1))),
        ],
        ..Provenance::here()
    });
    page
}

/// JSON report with the figures of each split, schema `truegrind.study/1`.
pub fn json(rows: &[MethodRow], robot: &str, dataset: &Dataset) -> Value {
    let methods: Vec<Value> = rows
        .iter()
        .map(|row| {
            let over = |figure: fn(&ErrorSummary) -> f64| {
                let (mean, deviation) = row.over_splits(figure);
                json!({ "mean": mean, "standard_deviation": (row.held_out.len() > 1).then_some(deviation) })
            };
            json!({
                "method": row.solver.map(|s| s.name),
                "literal": row.solver.map(|s| s.as_printed),
                "held_out": {
                    "rmse_mm": over(|s| s.rmse),
                    "mean_absolute_mm": over(|s| s.mean_absolute),
                    "max_mm": over(|s| s.max),
                },
                "jacobian_passes": passes(row),
                "converged": converged(row).map(|(yes, _)| yes),
                "splits": row.held_out,
                "terminations": row.terminations,
            })
        })
        .collect();
    json!({
        "schema": "truegrind.study/1",
        "dataset": { "file": dataset.file, "sha256": dataset.sha256, "rows": dataset.rows.len(), "robot": robot },
        "methods": methods,
        "notes": notes(rows),
    })
}

fn name(row: &MethodRow) -> &'static str {
    row.solver.map_or(REGISTERED, |solver| solver.name)
}

fn passes(row: &MethodRow) -> Option<f64> {
    (!row.jacobian_passes.is_empty()).then(|| mean_and_deviation(&row.jacobian_passes).0)
}

/// Number of converged splits, and of all splits.
fn converged(row: &MethodRow) -> Option<(usize, usize)> {
    row.solver?;
    Some((row.terminations.iter().filter(|t| t.is_converged()).count(), row.terminations.len()))
}

/// Name, mean and standard deviation of the method with the smallest mean held-out RMSE; the first among equals.
fn best(rows: &[MethodRow]) -> Option<(&'static str, f64, Option<f64>)> {
    rows.iter()
        .filter(|row| row.solver.is_some() && !row.held_out.is_empty())
        .map(|row| {
            let (mean, deviation) = row.over_splits(|s| s.rmse);
            (name(row), mean, (row.held_out.len() > 1).then_some(deviation))
        })
        // A later method must be better by more than the tolerance of the optimum.
        .reduce(|a, b| if b.1 < a.1 * (1.0 - SAME_OPTIMUM) { b } else { a })
}

fn notes(rows: &[MethodRow]) -> Vec<String> {
    let mut notes: Vec<String> = rows
        .iter()
        .map(|row| {
            let about = row
                .solver
                .map_or("nominal links; base or outlet, zero and touched point fitted", |s| s.about);
            format!("{}: {about}.", name(row))
        })
        .collect();
    notes.extend([
        "mean |e| is called \"STD\" in the papers (ltlm-2024 eq. 20). ±: standard deviation over the splits."
            .to_owned(),
        "A Jacobian pass evaluates all rows once with derivatives; all rounds of a fit count. LTLM needs two per iteration, so compare \
         methods by passes rather than iterations."
            .to_owned(),
    ]);
    let literal: Vec<&str> =
        rows.iter().filter(|row| row.solver.is_some_and(|s| s.as_printed)).map(name).collect();
    if !literal.is_empty() {
        notes.push(format!(
            "{} as printed in the paper: fixed μ = 5, no scaling, no priors. Undetermined parameters move freely, so such a fit serves \
             for comparison and is not a model. μ has no unit in the paper; here it acts on mm and radians, where it is negligible \
             for hundreds of rows.",
            literal.join(" and ")
        ));
    }
    notes.extend(same_optimum(rows));
    notes
}

/// A sentence per group of methods with the same errors.
fn same_optimum(rows: &[MethodRow]) -> Vec<String> {
    let methods: Vec<&MethodRow> =
        rows.iter().filter(|row| row.solver.is_some() && !row.held_out.is_empty()).collect();
    let gap = |a: &MethodRow, b: &MethodRow| {
        let pairs = a.held_out.iter().zip(&b.held_out);
        pairs.map(|(a, b)| ((a.rmse - b.rmse).abs(), a.rmse.min(b.rmse))).fold(
            (0.0_f64, 0.0_f64),
            |worst, (gap, of)| {
                let share = if gap == 0.0 { 0.0 } else { gap / of };
                // NaN counts as different.
                (worst.0.max(gap), if share.is_nan() { f64::INFINITY } else { worst.1.max(share) })
            },
        )
    };
    let mut grouped = vec![false; methods.len()];
    let mut notes = Vec::new();
    for first in 0..methods.len() {
        if grouped[first] {
            continue;
        }
        let mut group = vec![name(methods[first])];
        let mut widest = 0.0_f64;
        for other in first + 1..methods.len() {
            let (mm, share) = gap(methods[first], methods[other]);
            if !grouped[other] && share < SAME_OPTIMUM {
                grouped[other] = true;
                widest = widest.max(mm);
                group.push(name(methods[other]));
            }
        }
        if group.len() > 1 {
            notes.push(format!(
                "{} reach the same optimum on every split (held-out RMSE within {} mm), so they differ only in computing effort.",
                group.join(" and "),
                Precision::Significant(2).format(widest)
            ));
        }
    }
    notes
}

fn bars(rows: &[MethodRow]) -> String {
    let names = rows.iter().map(|row| name(row).to_owned()).collect();
    let errors: Vec<_> = rows.iter().map(|row| Some(row.held_out.clone())).collect();
    repeated::bars(names, &errors, Some(Precision::Decimals(2)))
}

fn by_split(rows: &[MethodRow]) -> String {
    let series = rows
        .iter()
        .map(|row| Series::sequence(name(row), &row.held_out.iter().map(|s| s.rmse).collect::<Vec<_>>()));
    Graph {
        title: "Held-out RMSE of each split".to_owned(),
        x: Axis::new("seed of the split", ""),
        y: Axis::new("RMSE", "mm"),
        series: series.collect(),
        ..Graph::default()
    }
    .svg()
}
