//! Deviation of each point of a path before and after correction, and the summary of ltlm-2024 Table 8.
//!
//! "After" under the model that made the correction is a *predicted remainder* (rounding, interpolation, inverse kinematics). It is
//! labelled so everywhere and shown with the predicted 1σ and the held-out error of the model, which predict the deviation of the
//! real arm. Only the result on a simulated actual arm or of a measurement is called *achieved*.

mod kept;
mod side;
mod words;
mod pictures;
mod summary;
mod verdict;

use std::collections::BTreeSet;

use serde_json::{Value, json};

use self::side::{AFTER, BEFORE, Side, by_program, has, intended};
pub(super) use self::verdict::Risk;
use self::verdict::{size, verdict};
use self::words::{decimals, meaning, named, notes, words};
use super::document::{Block, Document, KeyFigure};
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_arm::region::Outside;
use truegrind_compensation::deviation::{
    After, Deviation, MissingMotion, MotionStatus, PathPoint, PathReport,
};

pub use kept::{from_kept, kept};
pub use summary::{block_table, registered_table};

/// Rows of a point table on a page; the whole table belongs in the CSV file.
const ROWS_ON_PAGE: usize = 150;

/// Largest number of programs with a verdict on the terminal.
const MAX_VERDICTS: usize = 5;

/// Largest number of models with a key figure.
const MODELS_IN_FIGURES: usize = 7;

/// One row per motion of one program under one model, with all columns. Positions and vectors in the work object frame.
pub fn table(report: &PathReport) -> Table {
    let (word, key) = words(report.after);
    let columns = point_columns((word, key), decimals(report.after), !report.files.is_empty());
    let mut table = Table::new(format!("Deviation of {} under {}", report.program, named(report)), columns);
    rows(report, !report.files.is_empty()).for_each(|row| table.push(row));
    table.notes = notes(report);
    table
}

/// [`table`] for several programs and models, for a file: each row also has program, model, meaning of "after" and held-out error.
pub fn whole_table(reports: &[PathReport]) -> Table {
    let mut columns = vec![
        Column::text("program", "Program"),
        Column::text("model", "Model"),
        Column::text("after_is", "After is"),
        Column::number("model_held_out_rmse_mm", "Held-out error", "mm", 3),
    ];
    let files = reports.iter().any(|report| !report.files.is_empty());
    columns.extend(point_columns(("after", "after"), 4, files));
    let mut table = Table::new("Deviation of path points", columns);
    for report in reports {
        let is_after_known = entries(report).map(|entry| entry.is_ok_and(|point| point.after.is_some()));
        for (cells, is_after_known) in rows(report, files).zip(is_after_known) {
            let mut row: Vec<Cell> = vec![
                report.program.as_str().into(),
                report.model.as_str().into(),
                if is_after_known { meaning(report.after).into() } else { Cell::Missing },
                report.held_out_mm.into(),
            ];
            row.extend(cells);
            table.push(row);
        }
    }
    if let Some(first) = reports.first() {
        table.notes = notes(first);
    }
    table
}

/// The motions of a report in the order of the program: those with a point, and those without.
fn entries(report: &PathReport) -> impl Iterator<Item = Result<&PathPoint, &MissingMotion>> {
    let mut missing = report.missing.iter().flat_map(|missing| &missing.motions).peekable();
    let mut points = report.points.iter().enumerate().peekable();
    std::iter::from_fn(move || {
        let passed = points.peek().map_or(usize::MAX, |(passed, _)| *passed);
        match missing.next_if(|motion| motion.points_before <= passed) {
            Some(motion) => Some(Err(motion)),
            None => points.next().map(|(_, point)| Ok(point)),
        }
    })
}

/// One row per motion. `files`: with the name of its file.
fn rows(report: &PathReport, files: bool) -> impl Iterator<Item = Vec<Cell>> {
    entries(report).map(move |entry| {
        let (mut cells, file) = match entry {
            Ok(point) => (point_cells(point), point.file),
            Err(motion) => (missing_cells(motion), motion.file),
        };
        if files {
            cells.insert(1, report.files.get(file as usize).map(String::as_str).into());
        }
        cells
    })
}

/// `file`: with a column for the name of the file.
fn point_columns((word, key): (&str, &str), decimals: usize, file: bool) -> Vec<Column> {
    let mut columns = vec![Column::count("index", "Point")];
    columns.extend(file.then(|| Column::text("file", "File")));
    columns.extend([
        Column::count("line", "Line"),
        Column::text("instruction", "Instruction"),
        Column::number("x_mm", "x", "mm", 3),
        Column::number("y_mm", "y", "mm", 3),
        Column::number("z_mm", "z", "mm", 3),
    ]);
    for (side, key, decimals) in [("before", "before", 3), (word, key, decimals)] {
        for (part, name) in [("dx", "dx"), ("dy", "dy"), ("dz", "dz"), ("norm", "|d|"), ("normal", "normal")]
        {
            columns.push(Column::number(
                format!("{key}_{part}_mm"),
                format!("{side} {name}"),
                "mm",
                decimals,
            ));
        }
    }
    columns.extend([
        Column::number("sigma_mm", "predicted 1σ", "mm", 3),
        Column::text("sigma_of", "1σ of"),
        Column::text("status", "Status"),
        Column::text("reason", "Reason"),
    ]);
    // After those that files of earlier versions have.
    for (side, key) in [("before", "before"), (word, key)] {
        columns.push(Column::number(format!("{key}_turn_deg"), format!("{side} turn"), "°", 4));
    }
    columns
}

fn point_cells(point: &PathPoint) -> Vec<Cell> {
    let mut row = place(point);
    for side in [point.before, point.after] {
        row.extend(match side {
            Some(d) => [
                d.vector_mm.x.into(),
                d.vector_mm.y.into(),
                d.vector_mm.z.into(),
                d.norm_mm().into(),
                d.normal_mm.into(),
            ],
            None => [const { Cell::Missing }; 5],
        });
    }
    let [sigma, status, reason] = outcome(point);
    row.extend([sigma, sigma_of(point).into(), status, reason]);
    row.extend([point.before, point.after].map(|d| d.map(|d| d.angle_rad.to_degrees()).into()));
    row
}

/// The row of a motion without a point, in the columns of [`point_cells`].
fn missing_cells(motion: &MissingMotion) -> Vec<Cell> {
    let mut row = vec![Cell::Missing, (motion.line as usize).into(), motion.instruction.as_str().into()];
    // Three coordinates, two deviations of five numbers, σ and what it is of.
    row.extend([const { Cell::Missing }; 15]);
    row.extend([status_cell(motion.status), motion.reason.clone().into()]);
    row.extend([const { Cell::Missing }; 2]);
    row
}

/// Short table for a page: position, deviations before and after, 1σ and status.
pub fn short_table(report: &PathReport) -> Table {
    let (word, key) = words(report.after);
    let normals = report.points.iter().any(|point| point.normal.is_some());
    let mut columns = vec![
        Column::count("index", "Point"),
        Column::count("line", "Line"),
        Column::text("instruction", "Instruction"),
        Column::number("x_mm", "x", "mm", 2),
        Column::number("y_mm", "y", "mm", 2),
        Column::number("z_mm", "z", "mm", 2),
    ];
    for (side, key, decimals) in [("before", "before", 3), (word, key, decimals(report.after))] {
        columns.push(Column::number(format!("{key}_norm_mm"), format!("{side} |d|"), "mm", decimals));
        if normals {
            columns.push(Column::number(
                format!("{key}_normal_mm"),
                format!("{side} normal"),
                "mm",
                decimals,
            ));
        }
        columns.push(Column::number(format!("{key}_turn_deg"), format!("{side} turn"), "°", 3));
    }
    columns.push(Column::number("sigma_mm", "1σ", "mm", 3));
    // Approaches have the σ of their place, cuts that of their shape.
    let kinds: BTreeSet<bool> = report
        .points
        .iter()
        .filter(|point| point.sigma_mm.is_some())
        .map(PathPoint::is_sigma_of_shape)
        .collect();
    let is_of_two_kinds = kinds.len() > 1;
    columns.extend(is_of_two_kinds.then(|| Column::text("sigma_of", "1σ of")));
    columns.push(Column::text("status", "Status"));
    columns.push(Column::text("reason", "Reason"));
    let mut table = Table::new(format!("Points of {} under {}", report.program, named(report)), columns);
    for point in &report.points {
        let mut row = place(point);
        for side in [point.before, point.after] {
            row.push(side.map(|d| d.norm_mm()).into());
            if normals {
                row.push(side.and_then(|d| d.normal_mm).into());
            }
            row.push(side.map(|d| d.angle_rad.to_degrees()).into());
        }
        let [sigma, status, reason] = outcome(point);
        row.push(sigma);
        row.extend(is_of_two_kinds.then(|| sigma_of(point).into()));
        row.extend([status, reason]);
        table.push(row);
    }
    table.notes = notes(report);
    table
}

/// Points that were refused, flagged or left, in path order. Neighbours with the same status and kind of reason share a row.
pub fn flag_table(report: &PathReport) -> Table {
    let kind = |point: &PathPoint| (point.status, point.kind_of_reason());
    let runs = report.points.chunk_by(|a, b| kind(a) == kind(b));
    let reason = |run: &[PathPoint]| {
        let reason = run[0].reason.as_ref()?;
        let same = run.iter().all(|point| point.reason.as_ref() == Some(reason));
        Some(if same { reason.clone() } else { format!("{reason} (the first)") })
    };
    Table::of("Points to check", runs.filter(|run| run[0].status != MotionStatus::Changed))
        .text("lines", "Lines", |run| {
            range(run.iter().map(|point| point.line as usize).filter(|line| *line > 0))
        })
        .text("points", "Points", |run| range(run.iter().map(|point| point.index)))
        .count("count", "Count", |run| run.len())
        .text("status", "Status", |run| status_cell(run[0].status))
        .text("reason", "Reason", |run| reason(run))
        .table()
}

/// Smallest and largest number; `None` without numbers.
fn range(numbers: impl Iterator<Item = usize>) -> Option<String> {
    let (low, high) = numbers.fold((usize::MAX, 0), |(low, high), n| (low.min(n), high.max(n)));
    match low.cmp(&high) {
        std::cmp::Ordering::Less => Some(format!("{low}–{high}")),
        std::cmp::Ordering::Equal => Some(low.to_string()),
        std::cmp::Ordering::Greater => None,
    }
}

/// Summary for the terminal: verdicts of the first programs, tables over all.
pub fn summary(name: &str, reports: &[PathReport]) -> Document {
    let mut page = Document::new(format!("Deviation of {name}"));
    let programs = by_program(reports);
    for (program, reports) in programs.iter().take(MAX_VERDICTS) {
        let mut verdict = verdict(reports, Risk::Unstated);
        if programs.len() > 1 {
            verdict.headline = format!("{program}: {}", verdict.headline);
        }
        page.push(verdict);
    }
    page.push(block_table(reports));
    page.push(registered_table(reports));
    page
}

/// The worst status of all programs; the status of the exit code.
pub fn status(reports: &[PathReport]) -> Status {
    let worst = |a: Status, b: Status| if severity(b) > severity(a) { b } else { a };
    by_program(reports)
        .iter()
        .map(|(_, reports)| verdict(reports, Risk::Unstated).status)
        .fold(Status::Good, worst)
}

/// How bad a status is. Without a corrected path there is nothing to be judged, which is no fault.
fn severity(status: Status) -> u8 {
    match status {
        Status::Bad => 2,
        Status::Warning | Status::Found => 1,
        Status::Good | Status::NotEvaluated => 0,
    }
}

/// The page: one section per program with all its models.
pub fn document(reports: &[PathReport]) -> Document {
    let programs = by_program(reports);
    let mut page = match programs.as_slice() {
        [(program, _)] => Document::new(format!("Deviation of {program}")),
        _ => Document::new("Deviation of grinding paths"),
    };
    let mut models: Vec<&str> = Vec::new();
    for report in reports.iter().filter(|report| !report.model.is_empty()) {
        if !models.contains(&report.model.as_str()) {
            models.push(&report.model);
        }
    }
    page.subtitle = match models.as_slice() {
        [] => String::new(),
        [model] => format!("model {model}"),
        _ => format!("models {}", models.join(", ")),
    };
    if reports.is_empty() {
        page.paragraph("No program has a path whose deviation can be determined.");
    }
    if programs.len() > 1 {
        page.push(block_table(reports));
    }
    for (program, reports) in &programs {
        if programs.len() > 1 {
            page.heading(2, *program);
        }
        page.blocks.extend(sections(reports, if programs.len() > 1 { 3 } else { 2 }, Risk::Unstated));
    }
    page
}

/// The blocks of one program, with headings at `level`; also part of the page on its compensation.
pub(super) fn sections(reports: &[&PathReport], level: u8, risk: Risk) -> Vec<Block> {
    let mut page = Document::default();
    let Some(first) = reports.first() else { return page.blocks };
    page.push(verdict(reports, risk));
    page.push(key_figures(reports, risk));
    page.push(summary::block(reports, false));
    page.push(summary::registered(reports, false));
    page.heading(level, "Along the path");
    for figure in pictures::all(reports) {
        page.push(figure);
    }
    page.heading(level, "Points to check");
    let alike = reports.iter().all(|report| same_outcomes(first, report));
    for report in reports.iter().take(if alike { 1 } else { reports.len() }) {
        let flags = flag_table(report);
        let name = if reports.len() == 1 || alike { String::new() } else { report.model.clone() };
        if flags.rows.is_empty() {
            let of = if name.is_empty() { name } else { format!("{name}: ") };
            page.paragraph(format!("{of}All points were corrected without a flag."));
        } else {
            page.push(Table { title: name, ..flags.excerpt(60) });
        }
    }
    page.heading(level, "All points");
    for report in reports {
        let count = report.points.len();
        let mut points = short_table(report);
        points.shorten_repeated("reason");
        page.push(Block::Details {
            summary: format!("{count} points under {}", report.model),
            blocks: vec![points.excerpt(ROWS_ON_PAGE).into()],
        });
    }
    page.blocks
}

/// JSON report, schema `truegrind.deviation/1`.
pub fn json(reports: &[PathReport]) -> Value {
    let programs: Vec<Value> = by_program(reports)
        .into_iter()
        .map(|(program, reports)| {
            let models: Vec<Value> = reports.iter().map(|report| model_json(report)).collect();
            json!({ "program": program, "models": models })
        })
        .collect();
    json!({ "schema": "truegrind.deviation/1", "programs": programs })
}

fn model_json(report: &PathReport) -> Value {
    let points: Vec<Value> = report
        .points
        .iter()
        .map(|point| {
            let at = intended(point);
            json!({
                "index": point.index,
                "line": (point.line > 0).then_some(point.line),
                "instruction": point.instruction,
                "cutting": point.cutting,
                "intended_mm": [at.x, at.y, at.z],
                "before": point.before.map(deviation_json),
                "after": point.after.map(deviation_json),
                "sigma_mm": point.sigma_mm,
                "sigma_of": sigma_of(point),
                "outside": point.outside.map(|outside| match outside {
                    Outside::Joint { joint, by_deg } => json!({ "joint": joint + 1, "by_deg": by_deg }),
                    Outside::Coverage { ratio } => json!({ "coverage_ratio": ratio }),
                }),
                "status": point.status,
                "reason": point.reason,
            })
        })
        .collect();
    let block = |side: Side| {
        report.block(side).map(|block| {
            json!({
                "five_mm": block.five_mm,
                "mean_mm": block.all.mean,
                "mean_absolute_mm": block.all.mean_absolute,
                "standard_deviation_mm": block.all.standard_deviation,
                "rmse_mm": block.all.rmse,
                "max_mm": block.all.max,
                "max_turn_deg": report.largest_turn_rad(side).map(f64::to_degrees),
                "points": block.all.count,
                "registered_rms_mm": report.registered_rms_mm(side),
            })
        })
    };
    json!({
        "model": report.model,
        "after_is": report.after,
        "model_held_out_rmse_mm": report.held_out_mm,
        "turn_sigma_deg": report.turn_sigma_rad.map(f64::to_degrees),
        "assumptions": report.assumptions,
        "differences": report.differences,
        "between_targets": report.between.as_ref().map(|between| json!({
            "tolerance_mm": between.tolerance_mm,
            "largest_mm": between.largest_mm.filter(|mm| mm.is_finite()),
            "beyond_tolerance": between.beyond,
            "beyond_tolerance_lines": between.beyond_lines,
            "unchecked": between.unchecked,
            "unchecked_lines": between.unchecked_lines,
            "first_lines": between.first_lines,
        })),
        "summary": { "before": block(BEFORE), "after": block(AFTER) },
        "points": points,
    })
}

fn deviation_json(deviation: Deviation) -> Value {
    let [dx, dy, dz] = deviation.vector_mm.into();
    json!({
        "dx_mm": dx,
        "dy_mm": dy,
        "dz_mm": dz,
        "norm_mm": deviation.norm_mm(),
        "normal_mm": deviation.normal_mm,
        "turn_deg": deviation.angle_rad.to_degrees(),
    })
}

/// Whether two reports have the same status and reason for every point.
fn same_outcomes(a: &PathReport, b: &PathReport) -> bool {
    let outcomes = |r: &PathReport| r.points.iter().map(|p| (p.status, p.reason.clone())).collect::<Vec<_>>();
    outcomes(a) == outcomes(b)
}

fn line(point: &PathPoint) -> Cell {
    if point.line > 0 { Cell::Count(u64::from(point.line)) } else { Cell::Missing }
}

fn place(point: &PathPoint) -> Vec<Cell> {
    let at = intended(point);
    vec![
        point.index.into(),
        line(point),
        point.instruction.as_str().into(),
        at.x.into(),
        at.y.into(),
        at.z.into(),
    ]
}

/// What the σ of a point is of: of its position, or of the shape of its cut alone where only that is corrected.
fn sigma_of(point: &PathPoint) -> Option<String> {
    point.sigma_mm.map(|_| if point.is_sigma_of_shape() { "shape" } else { "position" }.to_owned())
}

fn outcome(point: &PathPoint) -> [Cell; 3] {
    [point.sigma_mm.into(), status_cell(point.status), point.reason.clone().into()]
}

/// Cell for the status of a motion.
pub(super) fn status_cell(status: MotionStatus) -> Cell {
    let shown = match status {
        MotionStatus::Changed => Status::Good,
        MotionStatus::Left => Status::NotEvaluated,
        MotionStatus::Refused => Status::Bad,
        MotionStatus::Flagged => Status::Warning,
    };
    Cell::Judged(shown, status_word(status).to_owned())
}

/// Word for a status in tables and JSON.
pub(super) fn status_word(status: MotionStatus) -> &'static str {
    match status {
        MotionStatus::Changed => "changed",
        MotionStatus::Left => "left",
        MotionStatus::Refused => "refused",
        MotionStatus::Flagged => "flagged",
    }
}

/// The cards; beside the report on a correction those without what it states itself.
fn key_figures(reports: &[&PathReport], risk: Risk) -> Vec<KeyFigure> {
    let mut figures = Vec::new();
    let block = |report: &PathReport, side: Side| report.block(side);
    let mean = |report: &PathReport, side: Side| {
        let along = if report.cut().any(|p| p.normal.is_some()) { " along the normal" } else { "" };
        block(report, side)
            .map_or_else(String::new, |b| format!(", mean |d| {:.3} mm{along}", b.all.mean_absolute))
    };
    let max = |report: &PathReport, side: Side| block(report, side).map(|block| block.all.max);
    let own = risk == Risk::Unstated;
    if let Some(first) = reports.first().filter(|_| own) {
        // Along the normal only beside a deviation after that is so too: the expected one has no direction.
        let before =
            if has(first, AFTER) && first.expected_mm().is_none() { max(first, BEFORE) } else { size(first) };
        let note = format!("uncorrected{}", mean(first, BEFORE));
        figures.push(KeyFigure::new("Largest before", before, 3, "mm").note(note));
    }
    for report in reports.iter().filter(|report| own && has(report, AFTER)).take(MODELS_IN_FIGURES) {
        let (label, after, note) = match report.after {
            After::Achieved => {
                ("Largest after", max(report, AFTER), format!("achieved{}", mean(report, AFTER)))
            }
            // The remainder of the solver does not predict the arm; the expected deviation does.
            After::PredictedRemainder => {
                let note = "1σ of the model, largest of the cut with its uncorrected points";
                ("Expected after", report.expected_mm(), note.to_owned())
            }
        };
        let label = if reports.len() > 1 { format!("{label}, {}", report.model) } else { label.to_owned() };
        figures.push(KeyFigure::new(label, after, 3, "mm").note(note));
    }
    if let [report] = reports {
        if !has(report, AFTER) {
            let shape = report.registered_rms_mm(BEFORE);
            figures.push(
                KeyFigure::new("Shape only", shape, 3, "mm")
                    .note("RMS after the best rigid registration, for paths adjusted in place"),
            );
        }
        if report.after == After::Achieved || !has(report, AFTER) {
            figures.push(
                KeyFigure::new("Predicted 1σ", report.sigma_rms_mm(), 3, "mm").note("RMS over the cut"),
            );
        }
        figures.push(
            KeyFigure::new("Held-out error of the model", report.held_out_mm, 3, "mm")
                .note("RMSE on rows not used in the fit"),
        );
    }
    figures
}
