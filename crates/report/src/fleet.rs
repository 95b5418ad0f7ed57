//! Many arms in one run: one row per arm, which causes, how large, and which arm comes first.
//!
//! First comes the arm of which most can be gained: its held-out error with the data sheet's links less that of its extended model.
//! That is what its programs are off by today and need not be.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::diagnosis;
use super::document::{Document, KeyFigure, Verdict};
use super::kept;
use super::status::Status;
use super::table::{Cell, Column, Table};
use truegrind_calibration::diagnosis::finding::{Confidence, Diagnosis};

/// A cause that was found at an arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Contract name of the effect.
    pub effect: String,
    /// Joints or rows.
    pub place: String,
    /// One sentence for a technician.
    pub sentence: String,
    /// Whether its rivals were fitted and beaten.
    pub identified: bool,
    /// By how much it moves the readings (mm RMS over all rows); absent where that is no question.
    #[serde(with = "kept::optional")]
    pub worth_mm: Option<f64>,
    /// What to do about it in the workshop.
    pub remedy: String,
}

/// One arm. As JSON it is what is kept of it: every number comes back with every bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Its measurements.
    pub file: String,
    /// Robot by name; absent where the measurements could not be diagnosed.
    pub robot: Option<String>,
    /// Rows.
    pub rows: usize,
    /// Held-out error of the data sheet's links (mm RMSE).
    #[serde(with = "kept::optional")]
    pub nominal_mm: Option<f64>,
    /// The same with links fitted.
    #[serde(with = "kept::optional")]
    pub geometric_mm: Option<f64>,
    /// The same with causes.
    #[serde(with = "kept::optional")]
    pub extended_mm: Option<f64>,
    /// What sensor and rounding leave (mm).
    #[serde(with = "kept::optional")]
    pub noise_floor_mm: Option<f64>,
    /// Causes, in the order of the diagnosis.
    pub causes: Vec<Cause>,
    /// The model that was written.
    pub output: Option<String>,
    /// Why it failed, or what to know about it.
    pub note: Option<String>,
    /// Whether the arm could not be diagnosed.
    pub failed: bool,
}

impl Row {
    /// The row of an arm that was diagnosed; `note`: what to know of its model.
    pub fn of(file: String, output: Option<String>, note: Option<String>, found: &Diagnosis) -> Row {
        let fits = &found.fits;
        let causes = found.findings.iter().map(|finding| Cause {
            effect: finding.effect.clone(),
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
            noise_floor_mm: found.noise_floor_mm,
            causes: causes.collect(),
            output,
            note,
            failed: false,
        }
    }

    /// The row of an arm that could not be diagnosed.
    pub fn failed(file: String, why: String) -> Row {
        Row {
            file,
            robot: None,
            rows: 0,
            nominal_mm: None,
            geometric_mm: None,
            extended_mm: None,
            noise_floor_mm: None,
            causes: Vec::new(),
            output: None,
            note: Some(why),
            failed: true,
        }
    }

    /// What can be gained: held-out error of the data sheet's links less that of the extended model (mm).
    pub fn to_gain_mm(&self) -> Option<f64> {
        Some(self.nominal_mm? - self.extended_mm?)
    }

    /// The cause that moves the readings most; identified ones come before those that are only possible.
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

    fn all_causes(&self) -> Option<String> {
        let one = |cause: &Cause| {
            let worth = cause.worth_mm.map_or_else(String::new, |mm| format!(", {mm:.3} mm"));
            let doubt = if cause.identified { "" } else { ", not certain" };
            format!("{} ({}{worth}{doubt})", cause.effect.replace('-', " "), cause.place)
        };
        let all: Vec<String> = self.causes.iter().map(one).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// Which arm comes first, second and so on: the place of each row, from 1; of equal ones the earlier first. `None` for those that
/// could not be diagnosed.
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
    let mut table = Table::new(
        "Arms",
        vec![
            Column::count("rank", "Place"),
            Column::text("file", "Measurements"),
            Column::text("status", "Status"),
            Column::text("robot", "Robot"),
            Column::count("rows", "Rows"),
            Column::number("nominal_mm", "Data sheet", "mm", 3),
            Column::number("geometric_mm", "Geometry", "mm", 3),
            Column::number("extended_mm", "With causes", "mm", 3),
            Column::number("to_gain_mm", "To gain", "mm", 3),
            Column::number("noise_floor_mm", "Noise floor", "mm", 3),
            Column::text("largest_cause", "Largest cause"),
            Column::text("largest_place", "Where"),
            Column::number("largest_worth_mm", "Its size", "mm", 3),
            Column::text("causes", "All causes"),
            Column::text("output", "Model"),
            Column::text("note", "Note"),
        ],
    );
    for (row, rank) in rows.iter().zip(ranks(rows)) {
        let largest = row.largest();
        let word = match (row.failed, row.causes.len()) {
            (true, _) => "failed".to_owned(),
            (false, 0) => "geometry alone".to_owned(),
            (false, 1) => "1 cause".to_owned(),
            (false, count) => format!("{count} causes"),
        };
        table.push([
            rank.into(),
            row.file.as_str().into(),
            Cell::Judged(row.judged(), word),
            row.robot.clone().into(),
            if row.failed { Cell::Missing } else { row.rows.into() },
            row.nominal_mm.into(),
            row.geometric_mm.into(),
            row.extended_mm.into(),
            row.to_gain_mm().into(),
            row.noise_floor_mm.into(),
            largest.map(|cause| cause.effect.as_str()).into(),
            largest.map(|cause| cause.place.as_str()).into(),
            largest.and_then(|cause| cause.worth_mm).into(),
            row.all_causes().into(),
            row.output.clone().into(),
            row.note.clone().into(),
        ]);
    }
    table.notes.push(
        "Errors are held out, five random folds. To gain: the data sheet's less that of the model with causes, by which arms are \
         placed. Its size: by how much a cause moves the readings, RMS over all rows."
            .to_owned(),
    );
    table
}

/// Which causes were found, at how many arms, and how large.
pub fn cause_table(rows: &[Row]) -> Table {
    let mut found: BTreeMap<&str, Vec<(&Row, &Cause)>> = BTreeMap::new();
    for row in rows {
        for cause in &row.causes {
            found.entry(&cause.effect).or_default().push((row, cause));
        }
    }
    let arms = |of: &[(&Row, &Cause)]| {
        let mut files: Vec<&str> = of.iter().map(|(row, _)| row.file.as_str()).collect();
        files.dedup();
        files.len()
    };
    let mut found: Vec<_> = found.into_iter().collect();
    found.sort_by_key(|(_, of)| std::cmp::Reverse(arms(of)));
    let mut table = Table::new(
        "Causes over all arms",
        vec![
            Column::text("cause", "Cause"),
            Column::count("arms", "Arms"),
            Column::count("identified", "Identified at"),
            Column::number("largest_mm", "Largest", "mm", 3),
            Column::text("at", "Largest at"),
            Column::text("remedy", "What to do"),
        ],
    );
    for (effect, of) in found {
        let size = |cause: &Cause| cause.worth_mm.unwrap_or(0.0);
        let Some((at, largest)) = of.iter().max_by(|a, b| size(a.1).total_cmp(&size(b.1))) else { continue };
        table.push([
            effect.replace('-', " ").into(),
            arms(&of).into(),
            arms(&of.iter().copied().filter(|(_, cause)| cause.identified).collect::<Vec<_>>()).into(),
            largest.worth_mm.into(),
            format!("{}, {}", at.file, largest.place).into(),
            largest.remedy.as_str().into(),
        ]);
    }
    table
}

/// Rows of the table in a terminal and on a page; all of them are in the CSV file.
const ROWS: usize = 200;

/// The columns that people read, what decides first; where all arms are one robot, that stands above the table.
const READ: [&str; 12] = [
    "file",
    "rank",
    "status",
    "to_gain_mm",
    "causes",
    "nominal_mm",
    "geometric_mm",
    "extended_mm",
    "noise_floor_mm",
    "rows",
    "output",
    "note",
];

/// The table for people: what could not be diagnosed, then the arm of which most can be gained, and no column in which nothing stands.
fn read_table(rows: &[Row]) -> Table {
    let whole = table(rows);
    let mut order: Vec<(Option<usize>, &Vec<Cell>)> = ranks(rows).into_iter().zip(&whole.rows).collect();
    order.sort_by_key(|(rank, _)| *rank);
    let robots = one_robot(rows).is_none().then_some("robot");
    let shown: Vec<usize> = READ
        .into_iter()
        .chain(robots)
        .filter_map(|key| whole.column_index(key))
        .filter(|&column| whole.rows.iter().any(|row| row[column] != Cell::Missing))
        .collect();
    let columns = shown.iter().map(|&column| whole.columns[column].clone()).collect();
    let mut read = Table::new(whole.title.clone(), columns);
    read.rows =
        order.iter().map(|(_, row)| shown.iter().map(|&column| row[column].clone()).collect()).collect();
    read.notes.push(
        "Errors are held out, five random folds. To gain: the data sheet's less that of the model with causes, by which arms are \
         placed. With each cause by how much it moves the readings, RMS over all rows."
            .to_owned(),
    );
    read.excerpt(ROWS)
}

/// The robot that all arms are, of those that could be read.
fn one_robot(rows: &[Row]) -> Option<&str> {
    let mut robots = rows.iter().filter_map(|row| row.robot.as_deref());
    let first = robots.next()?;
    robots.all(|robot| robot == first).then_some(first)
}

fn verdict(rows: &[Row]) -> Verdict {
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
            "{} comes first: {:.3} mm to gain; {with_causes} of {} arms have causes beyond geometry",
            row.file,
            row.to_gain_mm().unwrap_or(f64::NAN),
            rows.len()
        ),
        None => "no arm could be diagnosed".to_owned(),
    };
    /// Arms that are named because they failed; the table has all.
    const NAMED: usize = 20;
    let why = |row: &&Row| format!("{}: {}", row.file, row.note.as_deref().unwrap_or("failed"));
    let mut reasons: Vec<String> = failed.iter().take(NAMED).map(why).collect();
    if failed.len() > NAMED {
        reasons.push(format!("and {} more arms that could not be diagnosed", failed.len() - NAMED));
    }
    if let Some(cause) = first.and_then(Row::largest) {
        reasons.push(format!("what to do there: {}, for {}", cause.remedy, cause.sentence));
    }
    Verdict::new(status, headline, reasons)
}

fn begun(rows: &[Row]) -> Document {
    let mut page = Document::new(match rows.len() {
        1 => "Diagnosis of 1 arm".to_owned(),
        count => format!("Diagnosis of {count} arms"),
    });
    page.subtitle = one_robot(rows).unwrap_or_default().to_owned();
    page.push(verdict(rows));
    page
}

/// What fits a terminal.
pub fn summary(rows: &[Row]) -> Document {
    let mut page = begun(rows);
    page.push(read_table(rows));
    page
}

/// The page.
pub fn document(rows: &[Row]) -> Document {
    let mut page = begun(rows);
    let largest = |value: fn(&Row) -> Option<f64>| rows.iter().filter_map(value).reduce(f64::max);
    page.push(vec![
        KeyFigure::new("Most to gain", largest(Row::to_gain_mm), 3, "mm").note("held out, of one arm"),
        KeyFigure::new("Data sheet", largest(|row| row.nominal_mm), 3, "mm")
            .note("the largest held-out error"),
        KeyFigure::new("With causes", largest(|row| row.extended_mm), 3, "mm")
            .note("the largest held-out error"),
        KeyFigure::new("Not diagnosed", rows.iter().filter(|row| row.failed).count(), 0, "")
            .note(format!("of {} arms", rows.len())),
    ]);
    page.push(read_table(rows));
    let causes = cause_table(rows);
    if !causes.rows.is_empty() {
        page.push(causes);
    }
    page
}

/// The contract `truegrind.fleet/1`.
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
