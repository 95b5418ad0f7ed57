//! Report over many arms: one row per arm with its causes, ranked by possible gain.
//!
//! The gain is the held-out error of the nominal links minus that of the written arm: what its user gets, without causes that are uncertain.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::diagnosis;
use super::document::{Document, KeyFigure, PageVerdict};
use super::kept;
use super::status::Status;
use super::table::{Cell, Table};
use truegrind_calibration::diagnosis::cause_kind::CauseKind;
use truegrind_calibration::diagnosis::diagnose::Diagnosed;
use truegrind_calibration::diagnosis::finding::{Confidence, NoiseFloorSource};

/// A cause found for an arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Its kind.
    pub effect: CauseKind,
    /// Joints or rows.
    pub place: String,
    /// One sentence for a technician.
    pub sentence: String,
    /// Whether it is better than its alternatives.
    pub identified: bool,
    /// Change of the readings (mm RMS over all rows), where defined.
    #[serde(with = "kept::optional")]
    pub worth_mm: Option<f64>,
    /// Remedy.
    pub remedy: String,
}

/// One arm. Serialised as its bit-exact record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Row {
    /// Measurement file.
    pub file: String,
    /// Robot name; `None` if the diagnosis failed.
    pub robot: Option<String>,
    /// Rows.
    pub rows: usize,
    /// Held-out error of the nominal links (mm RMSE).
    #[serde(with = "kept::optional")]
    pub nominal_mm: Option<f64>,
    /// Held-out error with fitted links (mm RMSE).
    #[serde(with = "kept::optional")]
    pub geometric_mm: Option<f64>,
    /// Held-out error with causes (mm RMSE).
    #[serde(with = "kept::optional")]
    pub extended_mm: Option<f64>,
    /// Held-out error of the written arm, which lacks uncertain causes (mm RMSE).
    #[serde(with = "kept::optional")]
    pub written_mm: Option<f64>,
    /// Scatter of repeated poses (mm); rounding of the log alone is far below what a sensor scatters.
    #[serde(with = "kept::optional")]
    pub noise_floor_mm: Option<f64>,
    /// Causes, in the order of the diagnosis.
    pub causes: Vec<Cause>,
    /// The written model.
    pub output: Option<String>,
    /// The error, or a remark.
    pub note: Option<String>,
    /// Whether the arm could not be diagnosed.
    pub failed: bool,
}

impl Row {
    /// The row of a diagnosed arm; `note`: remark on its model.
    pub fn of(file: String, output: Option<String>, note: Option<String>, diagnosed: &Diagnosed) -> Row {
        let found = &diagnosed.diagnosis;
        let fits = &found.fits;
        let causes = found.findings.iter().map(|finding| Cause {
            effect: finding.effect,
            place: diagnosis::place(finding),
            sentence: finding.cause.clone(),
            identified: finding.confidence == Confidence::Identified,
            worth_mm: finding.worth_mm,
            remedy: finding.remedy.clone(),
        });
        Row {
            file,
            robot: Some(found.dataset.robot.clone()),
            rows: found.dataset.rows,
            nominal_mm: Some(fits.nominal.cv_rmse_mm),
            geometric_mm: Some(fits.geometric.cv_rmse_mm),
            extended_mm: Some(fits.extended.cv_rmse_mm),
            written_mm: Some(diagnosed.estimated.calibrated.held_out.rmse),
            noise_floor_mm: found
                .noise_floor_mm
                .filter(|_| found.noise_floor_source != NoiseFloorSource::RoundingAlone),
            causes: causes.collect(),
            output,
            note,
            failed: false,
        }
    }

    /// The row of an arm that could not be diagnosed.
    pub fn failed(file: String, reason: String) -> Row {
        Row { file, note: Some(reason), failed: true, ..Row::default() }
    }

    /// Possible gain: held-out error of the nominal links minus that of the written arm (mm).
    pub fn to_gain_mm(&self) -> Option<f64> {
        Some(self.nominal_mm? - self.written_mm?)
    }

    /// The cause with the largest effect on the readings; identified causes come first.
    fn largest(&self) -> Option<&Cause> {
        let size = |cause: &Cause| (cause.identified, cause.worth_mm.unwrap_or(0.0));
        let larger = |a: &&Cause, b: &&Cause| {
            let (a, b) = (size(a), size(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        self.causes.iter().filter(|cause| cause.worth_mm.is_some()).max_by(larger)
    }

    fn judged(&self) -> Status {
        match (self.failed, self.output.is_some() || self.note.is_none()) {
            (true, _) => Status::Bad,
            (false, true) if self.causes.is_empty() => Status::Good,
            _ => Status::Warning,
        }
    }

    fn status_text(&self) -> String {
        match (self.failed, self.causes.len()) {
            (true, _) => "failed".to_owned(),
            (false, 0) => "geometry alone".to_owned(),
            (false, 1) => "1 cause".to_owned(),
            (false, count) => format!("{count} causes"),
        }
    }

    fn all_causes(&self) -> Option<String> {
        let one = |cause: &Cause| {
            let worth = cause.worth_mm.map_or_else(String::new, |mm| format!(", {mm:.3} mm"));
            let doubt = if cause.identified { "" } else { ", not certain" };
            format!("{} ({}{worth}{doubt})", cause.effect.words(), cause.place)
        };
        let all: Vec<String> = self.causes.iter().map(one).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// Rank of each row by possible gain, from 1; ties in row order. `None` if the diagnosis failed.
pub fn ranks(rows: &[Row]) -> Vec<Option<usize>> {
    let mut order: Vec<(usize, f64)> =
        rows.iter().enumerate().filter_map(|(at, row)| Some((at, row.to_gain_mm()?))).collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let mut ranks = vec![None; rows.len()];
    for (rank, (at, _)) in order.into_iter().enumerate() {
        ranks[at] = Some(rank + 1);
    }
    ranks
}

/// One row per arm, in the order of the rows.
pub fn table(rows: &[Row]) -> Table {
    let ranked: Vec<(&Row, Option<usize>)> = rows.iter().zip(ranks(rows)).collect();
    Table::of("Arms", &ranked)
        .count("rank", "Rank", |(_, rank)| *rank)
        .text("file", "Measurements", |(row, _)| row.file.as_str())
        .text("status", "Status", |(row, _)| Cell::Judged(row.judged(), row.status_text()))
        .text("robot", "Robot", |(row, _)| row.robot.clone())
        .count("rows", "Rows", |(row, _)| (!row.failed).then_some(row.rows))
        .number("nominal_mm", "Data sheet", "mm", 3, |(row, _)| row.nominal_mm)
        .number("geometric_mm", "Geometry", "mm", 3, |(row, _)| row.geometric_mm)
        .number("extended_mm", "All causes found", "mm", 3, |(row, _)| row.extended_mm)
        .number("written_mm", "Written model", "mm", 3, |(row, _)| row.written_mm)
        .number("to_gain_mm", "Gain", "mm", 3, |(row, _)| row.to_gain_mm())
        .number("noise_floor_mm", "Noise floor", "mm", 3, |(row, _)| row.noise_floor_mm)
        .text("largest_cause", "Largest cause", |(row, _)| row.largest().map(|cause| cause.effect.as_str()))
        .text("largest_place", "Where", |(row, _)| row.largest().map(|cause| cause.place.as_str()))
        .number("largest_worth_mm", "Its size", "mm", 3, |(row, _)| {
            row.largest().and_then(|cause| cause.worth_mm)
        })
        .text("causes", "All causes", |(row, _)| row.all_causes())
        .text("output", "Model", |(row, _)| row.output.clone())
        .text("note", "Note", |(row, _)| row.note.clone())
.note("Errors are held out (five random folds). Gain: error of the data sheet minus that of the written model, which has none of the causes that are not \
         certain; arms are ranked by it. Its size: change of the readings by the cause, RMS over all rows.")
.table()
}

/// Causes over all arms, with their number and size.
pub fn cause_table(rows: &[Row]) -> Table {
    let mut found: BTreeMap<CauseKind, Vec<(&Row, &Cause)>> = BTreeMap::new();
    for row in rows {
        for cause in &row.causes {
            found.entry(cause.effect).or_default().push((row, cause));
        }
    }
    let arms = |of: &[(&Row, &Cause)]| {
        let mut files: Vec<&str> = of.iter().map(|(row, _)| row.file.as_str()).collect();
        files.dedup();
        files.len()
    };
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|(_, of)| std::cmp::Reverse(arms(of)));
    let size = |cause: &Cause| cause.worth_mm.unwrap_or(0.0);
    let largest = found.into_iter().filter_map(|(effect, of)| {
        let largest = of.iter().copied().max_by(|a, b| size(a.1).total_cmp(&size(b.1)))?;
        Some((effect, of, largest))
    });
    Table::of("Causes over all arms", largest)
        .text("cause", "Cause", |(effect, ..)| effect.words())
        .count("arms", "Arms", |(_, of, _)| arms(of))
        .count("identified", "Identified at", |(_, of, _)| {
            arms(&of.iter().copied().filter(|(_, cause)| cause.identified).collect::<Vec<_>>())
        })
        .number("largest_mm", "Largest", "mm", 3, |(.., (_, largest))| largest.worth_mm)
        .text("at", "Largest at", |(.., (at, largest))| format!("{}, {}", at.file, largest.place))
        .text("remedy", "What to do", |(.., (_, largest))| largest.remedy.as_str())
        .table()
}

/// Rows of the table on a terminal or page; the CSV file has all.
const ROWS: usize = 200;

/// The columns for display, most important first; a common robot is named above the table.
const DISPLAYED: [&str; 13] = [
    "file",
    "rank",
    "status",
    "to_gain_mm",
    "causes",
    "nominal_mm",
    "geometric_mm",
    "written_mm",
    "extended_mm",
    "noise_floor_mm",
    "rows",
    "output",
    "note",
];

/// The table for display: failures first, then by rank, without empty columns.
fn display_table(rows: &[Row]) -> Table {
    let whole = table(rows);
    let mut order: Vec<(Option<usize>, &Vec<Cell>)> = ranks(rows).into_iter().zip(&whole.rows).collect();
    order.sort_by_key(|(rank, _)| *rank);
    let robots = one_robot(rows).is_none().then_some("robot");
    let shown: Vec<usize> = DISPLAYED
        .into_iter()
        .chain(robots)
        .filter_map(|key| whole.column_index(key))
        .filter(|&column| whole.rows.iter().any(|row| row[column] != Cell::Missing))
        .collect();
    let columns = shown.iter().map(|&column| whole.columns[column].clone()).collect();
    let mut table = Table::new(whole.title.clone(), columns);
    table.rows =
        order.iter().map(|(_, row)| shown.iter().map(|&column| row[column].clone()).collect()).collect();
    table.notes.push(
        "Errors are held out (five random folds). Gain: error of the data sheet minus that of the written model, which has none of the causes that are not \
         certain; arms are ranked by it. Causes are listed with their change of the readings, RMS over all rows."
            .to_owned(),
    );
    table.excerpt(ROWS)
}

/// The common robot of all diagnosed arms, if any.
fn one_robot(rows: &[Row]) -> Option<&str> {
    let mut robots = rows.iter().filter_map(|row| row.robot.as_deref());
    let first = robots.next()?;
    robots.all(|robot| robot == first).then_some(first)
}

fn verdict(rows: &[Row]) -> PageVerdict {
    let failed: Vec<&Row> = rows.iter().filter(|row| row.failed).collect();
    let with_causes = rows.iter().filter(|row| !row.causes.is_empty()).count();
    let status = match (failed.is_empty(), with_causes) {
        (false, _) => Status::Bad,
        (true, 0) => Status::Good,
        (true, _) => Status::Warning,
    };
    let first = rows.iter().zip(ranks(rows)).find(|(_, rank)| *rank == Some(1)).map(|(row, _)| row);
    let headline = match first {
        Some(row) => format!(
            "Largest gain: {} with {:.3} mm; {with_causes} of {} arms have causes beyond geometry",
            row.file,
            row.to_gain_mm().unwrap_or(f64::NAN),
            rows.len()
        ),
        None => "no arm could be diagnosed".to_owned(),
    };
    /// Largest number of listed failures; the table has all.
    const MAX_FAILED: usize = 20;
    let reason = |row: &&Row| format!("{}: {}", row.file, row.note.as_deref().unwrap_or("failed"));
    let mut reasons: Vec<String> = failed.iter().take(MAX_FAILED).map(reason).collect();
    if failed.len() > MAX_FAILED {
        reasons.push(format!("and {} more arms that could not be diagnosed", failed.len() - MAX_FAILED));
    }
    if let Some((row, cause)) = first.and_then(|row| Some((row, row.largest()?))) {
        reasons.push(format!("{}: what to do: {} ({})", row.file, cause.remedy, cause.sentence));
    }
    PageVerdict::new(status, headline, reasons)
}

fn heading(rows: &[Row]) -> Document {
    let mut page = Document::new(match rows.len() {
        1 => "Diagnosis of 1 arm".to_owned(),
        count => format!("Diagnosis of {count} arms"),
    });
    page.subtitle = one_robot(rows).unwrap_or_default().to_owned();
    page.push(verdict(rows));
    page
}

/// Summary for the terminal.
pub fn summary(rows: &[Row]) -> Document {
    let mut page = heading(rows);
    page.push(display_table(rows));
    page
}

/// The page.
pub fn document(rows: &[Row]) -> Document {
    let mut page = heading(rows);
    let largest = |value: fn(&Row) -> Option<f64>| rows.iter().filter_map(value).reduce(f64::max);
    page.push(vec![
        KeyFigure::new("Largest gain", largest(Row::to_gain_mm), 3, "mm").note("held-out error, single arm"),
        KeyFigure::new("Data sheet", largest(|row| row.nominal_mm), 3, "mm")
            .note("the largest held-out error"),
        KeyFigure::new("Written model", largest(|row| row.written_mm), 3, "mm")
            .note("the largest held-out error"),
        KeyFigure::new("Not diagnosed", rows.iter().filter(|row| row.failed).count(), 0, "")
            .note(format!("of {} arms", rows.len())),
    ]);
    page.push(display_table(rows));
    let causes = cause_table(rows);
    if !causes.rows.is_empty() {
        page.push(causes);
    }
    page
}

/// JSON report, schema `truegrind.fleet/1`.
pub fn json(rows: &[Row]) -> Value {
    let arms: Vec<Value> = rows
        .iter()
        .zip(ranks(rows))
        .map(|(row, rank)| {
            let causes: Vec<Value> = row
                .causes
                .iter()
                .map(|cause| {
                    json!({
                        "effect": cause.effect,
                        "where": cause.place,
                        "cause": cause.sentence,
                        "identified": cause.identified,
                        "worth_mm": cause.worth_mm,
                        "remedy": cause.remedy,
                    })
                })
                .collect();
            json!({
                "rank": rank,
                "file": row.file,
                "robot": row.robot,
                "rows": row.rows,
                "nominal_mm": row.nominal_mm,
                "geometric_mm": row.geometric_mm,
                "extended_mm": row.extended_mm,
                "written_mm": row.written_mm,
                "to_gain_mm": row.to_gain_mm(),
                "noise_floor_mm": row.noise_floor_mm,
                "causes": causes,
                "output": row.output,
                "failed": row.failed,
                "note": row.note,
            })
        })
        .collect();
    json!({ "schema": "truegrind.fleet/1", "arms": arms })
}
