//! Tables of an identification.

use super::parameter::{handy, held_by_prior};
use crate::status::Status;
use crate::table::{Cell, Column, Table};
use truegrind_arm::estimated::EstimatedParameter;
use truegrind_calibration::identification::fit::{OUTLIER_CUT, Outlier};
use truegrind_calibration::identification::identifiability::Identifiability;
use truegrind_calibration::identification::identify::Identification;
use truegrind_calibration::identification::solver;
use truegrind_calibration::measurement::dataset::{Dataset, Sensor};
use truegrind_math::statistics::ErrorSummary;

/// Errors of each stage, on the rows of the fit and on held-out rows.
pub fn stage_table(found: &Identification) -> Table {
    let mut table = Table::new(
        "Errors by stage",
        vec![
            Column::text("stage", "Stage"),
            Column::text("rows", "Rows"),
            Column::count("count", "Count"),
            Column::number("rmse_mm", "RMSE", "mm", 3),
            Column::number("mean_absolute_mm", "mean |e|", "mm", 3),
            Column::number("standard_deviation_mm", "SD", "mm", 3),
            Column::number("max_mm", "max", "mm", 3),
            Column::number("mean_mm", "signed mean", "mm", 3),
        ],
    );
    let signed = signed(found);
    let mut push = |stage: &str, rows: &str, errors: Option<&ErrorSummary>| {
        let mut row: Vec<Cell> = vec![stage.into(), rows.into()];
        row.extend(match errors.filter(|errors| errors.count > 0) {
            Some(errors) => [
                errors.count.into(),
                errors.rmse.into(),
                errors.mean_absolute.into(),
                cell(errors.standard_deviation, errors.count > 1),
                errors.max.into(),
                cell(errors.mean, signed),
            ],
            None => [const { Cell::Missing }; 6],
        });
        table.push(row);
    };
    push("raw", "all", found.raw.as_ref());
    let estimated = &found.estimated;
    for (stage, errors) in [("frames registered", &estimated.registered), ("geometry", &estimated.calibrated)]
    {
        push(stage, "fitted", Some(&errors.fitted));
        push(stage, "held out", Some(&errors.held_out));
    }
    if found.raw.is_none() {
        table.notes.push(
            "raw: not available, since no sensor frame was stated (--sensor-frame, or --outlet and --cable-zero)."
                .to_owned(),
        );
    }
    table.notes.push(
        "The gain of registering frames (raw to frames registered) is not a property of the arm; the gain of the model is that from \
         frames registered to geometry."
            .to_owned(),
    );
    table.notes.push(if signed {
        "mean |e| is called \"STD\" or \"SD\" in the papers (ltlm-2024 eq. 20, Table 6); SD here is the standard deviation of the \
         signed errors with n − 1."
            .to_owned()
    } else {
        "Errors are lengths of vectors, so they have no signed mean, and SD is the standard deviation of the lengths. mean |e| is \
         called \"STD\" in the papers (ltlm-2024 eq. 20)."
            .to_owned()
    });
    table
}

/// The arm's parameters: nominal, estimated ± σ, deviation; angles in degrees.
pub fn parameter_table(found: &Identification) -> Table {
    let as_printed =
        solver::by_name(&found.estimated.provenance.method).is_ok_and(|solver| solver.as_printed);
    let of_arm = found.parameters.iter().filter(|parameter| parameter.is_of_arm());
    let mut table = Table::of(
        "Estimated parameters",
        &of_arm.map(|parameter| (handy(parameter), held(parameter, as_printed))).collect::<Vec<_>>(),
    )
    .text("name", "Parameter", |(shown, _)| shown.name.as_str())
    .significant("nominal", "Nominal", "", 6, |(shown, _)| shown.nominal)
    .significant("value", "Estimated ± σ", "", 2, |(shown, _)| {
        Cell::with_sigma(shown.value, Some(shown.sigma))
    })
    .number("deviation", "Deviation", "", 4, |(shown, _)| shown.value - shown.nominal)
    .text("unit", "Unit", |(shown, _)| shown.unit.as_str())
    .significant("prior_sigma", "Tolerance", "", 2, |(shown, _)| shown.prior_sigma)
    .number("determined_percent", "Determined", "%", 0, |(shown, _)| 100.0 * shown.determined)
    .text("held", "Held by", |(_, held)| held.clone())
.note("Tolerance: standard deviation of the prior, the manufacturing tolerance. Determined: share contributed by the data, \
         1 − (σ / tolerance)². A parameter below 50 % is known more from its prior than from the data; if it changed anyway, the data \
         determine a combination of parameters, which the priors distribute over its members.")
.table();
    if as_printed {
        table.notes.push(
            "This method has no priors: undetermined parameters moved freely. These values are not a geometry.".to_owned(),
        );
    }
    table
}

/// Deviations above this many tolerances are marked.
const FAR: f64 = 3.0;

/// Whether data or prior determine a parameter, and whether it is far from the data sheet.
fn held(parameter: &EstimatedParameter, as_printed: bool) -> Cell {
    let (status, mut text) = match (held_by_prior(parameter), as_printed) {
        (false, _) => (None, "data".to_owned()),
        (true, false) => (Some(Status::Warning), "held by prior".to_owned()),
        (true, true) => (Some(Status::Bad), "not determined".to_owned()),
    };
    let off = parameter.prior_sigma.map_or(0.0, |prior| (parameter.value - parameter.nominal).abs() / prior);
    if off > FAR {
        text.push_str(&format!(", {off:.1} tolerances off"));
    }
    match status.or((off > FAR).then_some(Status::Warning)) {
        Some(status) => Cell::Judged(status, text),
        None => Cell::Text(text),
    }
}

/// Sensor frame, outlets, cable zeros and the measured point.
pub fn frame_table(found: &Identification) -> Table {
    let mut table = Table::new(
        "Sensor and measured point",
        vec![
            Column::text("name", "Parameter"),
            Column::text("meaning", "Meaning"),
            Column::significant("value", "Estimated ± σ", "", 2),
            Column::text("unit", "Unit"),
        ],
    );
    for parameter in found.parameters.iter().filter(|parameter| !parameter.is_of_arm()) {
        let shown = handy(parameter);
        table.push([
            shown.name.as_str().into(),
            meaning(&shown.name).into(),
            Cell::with_sigma(shown.value, Some(shown.sigma)),
            shown.unit.as_str().into(),
        ]);
    }
    if table.rows.is_empty() {
        let frames = &found.geometry.frames;
        let touched = frames.flange_from_target.translation.vector;
        let fixed =
            [("target.x", touched.x, "mm"), ("target.y", touched.y, "mm"), ("target.z", touched.z, "mm")];
        for (name, value, unit) in fixed {
            table.push([name.into(), meaning(name).into(), value.into(), unit.into()]);
        }
        for (anchor, (outlet, zero)) in frames.outlets_mm.iter().zip(&frames.zeros_mm).enumerate() {
            let number = if anchor == 0 { String::new() } else { (anchor + 1).to_string() };
            for (axis, value) in ["x", "y", "z"].iter().zip(outlet.iter()) {
                let name = format!("outlet{number}.{axis}");
                table.push([name.as_str().into(), meaning(&name).into(), (*value).into(), "mm".into()]);
            }
            let name = format!("zero{number}");
            table.push([name.as_str().into(), meaning(&name).into(), (*zero).into(), "mm".into()]);
        }
        table.notes.push("From the fit of the frames alone; this method does not change them.".to_owned());
    }
    table.notes.push(
        "target is the point on the flange that the sensor measures (hook, reflector, target). It is not the TCP and does not affect \
         programs."
            .to_owned(),
    );
    table
}

fn meaning(name: &str) -> &'static str {
    match name.split(['.', '1', '2', '3', '4', '5', '6', '7', '8', '9', '0']).next() {
        Some("target") => "measured point on the flange, not the TCP",
        Some("sensor") => "sensor frame in the robot base",
        Some("outlet") => "cable outlet in the robot base",
        Some("zero") => "reading of the cable at length zero",
        _ => "",
    }
}

/// Error of each held-out row, frames registered and geometry.
pub fn held_out_table(found: &Identification) -> Table {
    Table::of("Held-out rows", &by_row(found))
        .count("row", "Row", |(row, ..)| *row)
        .number("registered_mm", "frames registered", "mm", 3, |(_, before, _)| *before)
        .number("geometry_mm", "geometry", "mm", 3, |(.., after)| *after)
        .note("Row numbers as in the spreadsheet.")
        .table()
}

/// Held-out errors in the order of the file.
pub(super) fn by_row(found: &Identification) -> Vec<(usize, f64, f64)> {
    let mut rows = found.held_out.clone();
    rows.sort_by_key(|(row, ..)| *row);
    rows
}

/// Rows that were set aside, with their errors.
pub fn outlier_table(found: &Identification, dataset: &Dataset) -> Table {
    let session = |outlier: &Outlier| dataset.rows.get(outlier.index).and_then(|row| row.session());
    let mut table = Table::of("Rows set aside", &found.outliers.rows)
        .count("row", "Row", |outlier| row_number(dataset, outlier.index))
        .text("session", "Session", |outlier| session(outlier).map(str::to_owned))
        .number("error_mm", "Error", "mm", 3, |outlier| outlier.error_mm.abs())
        .number("robust_sigmas", "Size", "robust σ", 1, |outlier| outlier.robust_sigmas)
        .table();
    if table.rows.iter().all(|row| row[1] == Cell::Missing) {
        table.remove_column(1);
    }
    table.notes.push(format!(
        "Beyond {OUTLIER_CUT} robust standard deviations of a robust fit of geometry. Rows are numbered as in the spreadsheet."
    ));
    table
}

/// Rank, condition number and observability indices.
pub fn observability_table(report: &Identifiability) -> Table {
    let mut table = Table::new(
        "Identifiability",
        vec![
            Column::text("figure", "Figure"),
            Column::significant("value", "Value", "", 4),
            Column::text("meaning", "Meaning"),
        ],
    );
    table.push([
        "rank".into(),
        report.rank.into(),
        format!("of {} parameters, data alone", report.parameters).into(),
    ]);
    table.push([
        "condition".into(),
        report.condition.into(),
        "largest over smallest singular value, all parameters".into(),
    ]);
    let full = report.rank == report.parameters;
    if !full {
        table.push([
            "condition, seen".into(),
            report.determined_condition.into(),
            "the same over the combinations that the data determine".into(),
        ]);
    }
    let meanings = [
        "geometric mean of the singular values over √poses",
        "smallest over largest singular value",
        "smallest singular value",
        "O2 times O3",
        "1 / Σ 1/σ",
    ];
    for (index, (value, meaning)) in report.observability.iter().zip(meanings).enumerate() {
        table.push([format!("O{}", index + 1).into(), cell(*value, report.rank > 0), meaning.into()]);
    }
    table.push([
        "below 1".into(),
        report.held_by_priors.into(),
        "singular values below 1: the prior knows more than the data".into(),
    ]);
    table.notes.push(format!(
        "Parameters in units of their priors' σ. O1 to O5 after Joubair and Bonev 2013{}.",
        if full {
            ""
        } else {
            ", over the combinations that the data determine: over all parameters they would be 0"
        }
    ));
    table
}

/// A value that is defined only for some sensors or counts.
fn cell(value: f64, meaningful: bool) -> Cell {
    if meaningful { value.into() } else { Cell::Missing }
}

/// Row number in the file; the index if the data set does not match.
pub(super) fn row_number(dataset: &Dataset, index: usize) -> usize {
    dataset.rows.get(index).map_or(index, |row| row.number)
}

/// Whether errors are signed (cable) rather than lengths of vectors.
pub(super) fn signed(found: &Identification) -> bool {
    found.estimated.provenance.sensor == Sensor::Cable
}
