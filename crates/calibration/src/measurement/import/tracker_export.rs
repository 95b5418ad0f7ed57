//! Reads points exported by a tracker's software, and joins them with a log of the joints by name (by time: `join_by_time`).
//!
//! SpatialAnalyzer, "Export ASCII Points" (user's manual): lines of a name, x, y, z and more, separated by blanks, tabs or commas; the
//! name is that of the target, optionally preceded by group and collection; lines that begin with `//` are comments. The user chooses
//! what follows the coordinates (offsets, time stamps, comments).

use std::collections::BTreeMap;

use super::cell::{Cell, Line, Table, number};
use super::column_names::POSITION;
use super::csv;
use super::error::{ImportError, Location};

/// Columns of a log of joints that name the point, in this order of preference.
const NAMES: [&str; 4] = ["name", "point", "target", "tag"];

/// Most names before x: collection, group, target.
const MAX_NAMES: usize = 3;

/// A measured point.
#[derive(Debug)]
pub(super) struct Point {
    /// Its line in the export, from 1.
    pub(super) row: usize,
    /// The name of its target, without group and collection.
    pub(super) name: String,
    /// Its position (mm).
    pub(super) at_mm: [f64; 3],
    /// The text after the coordinates.
    pub(super) more: String,
}

/// The measured points of an export, in its order.
#[derive(Debug)]
pub(super) struct Points {
    /// The export's name in messages.
    pub(super) file: String,
    /// At least one.
    pub(super) all: Vec<Point>,
}

pub(super) fn unusable(location: Location, message: String) -> ImportError {
    ImportError::Unusable { location, message }
}

impl Points {
    /// Reads an export.
    pub(super) fn read(file: &str, bytes: &[u8]) -> Result<Self, ImportError> {
        let text = csv::text(bytes);
        let location = |row: Option<usize>| Location { row, ..Location::file(file) };
        let mut lines: Vec<(usize, Vec<&str>)> = Vec::new();
        for (index, line) in text.lines().map(str::trim).enumerate() {
            if let Some(comment) = line.strip_prefix("//") {
                let comment = comment.to_ascii_lowercase();
                if let Some(unit) = ["inch", "meters", "feet"].iter().find(|unit| {
                    comment.contains("unit") && comment.contains(**unit) && !comment.contains("millimeter")
                }) {
                    let message = format!("found `{unit}` in a comment on units; expected millimetres");
                    return Err(unusable(location(Some(index + 1)), message));
                }
                continue;
            }
            if !line.is_empty() {
                lines.push((index + 1, fields(line)));
            }
        }
        let names = layout(&lines).ok_or_else(|| {
            let message = "no line has a name and x, y, z; expected points as SpatialAnalyzer exports them (target, x, y, z, with group \
                           and collection before it or not), coordinates with a decimal point";
            unusable(location(lines.first().map(|(row, _)| *row)), message.to_owned())
        })?;
        let mut all = Vec::new();
        for (row, fields) in &lines {
            let number = |at: usize| fields.get(names + at).and_then(|text| coordinate(text));
            let (Some(x), Some(y), Some(z)) = (number(0), number(1), number(2)) else {
                let message = format!(
                    "found `{}`; expected {names} {} and finite x, y, z (mm, with a decimal point) as in the other lines: correct \
                     the line, or leave it out",
                    fields.join(" "),
                    if names == 1 { "name" } else { "names" }
                );
                return Err(unusable(location(Some(*row)), message));
            };
            all.push(Point {
                row: *row,
                name: target(fields[names - 1]).to_owned(),
                at_mm: [x, y, z],
                more: fields[names + 3..].join(" "),
            });
        }
        Ok(Self { file: file.to_owned(), all })
    }

    /// The points by the names of their targets.
    fn by_name(&self) -> Result<BTreeMap<&str, [f64; 3]>, ImportError> {
        let mut by_name = BTreeMap::new();
        for Point { row, name, at_mm, .. } in &self.all {
            if by_name.insert(name.as_str(), *at_mm).is_some() {
                let location = Location { row: Some(*row), ..Location::file(&self.file) };
                let message = format!(
                    "point `{name}` occurs twice; expected each name once: export one group, rename the repeats, or join by time \
                     (--points-within)"
                );
                return Err(unusable(location, message));
            }
        }
        Ok(by_name)
    }

    /// The log with the measured points as columns `measured_x` to `measured_z`, and notes on omitted rows.
    pub(super) fn join_by_name(
        &self,
        file: &str,
        mut log: Table,
    ) -> Result<(Table, Vec<String>), ImportError> {
        let by_name = self.by_name()?;
        let location = Location { sheet: log.sheet.as_deref().map(Into::into), ..Location::file(file) };
        let header = log.rows.iter().position(|line| named(line).is_some());
        let Some((header, column)) = header.and_then(|at| Some((at, named(&log.rows[at])?))) else {
            let message =
                "has no column that names the measured points; expected `name` beside q1 to q6, or join by time (--points-within)"
                    .to_owned();
            return Err(unusable(location, message));
        };
        let width = log.rows.iter().map(|line| line.cells.len()).max().unwrap_or(0);
        let mut used = 0_usize;
        let mut without = Vec::new();
        for (index, line) in log.rows.iter_mut().enumerate().skip(header) {
            line.cells.resize(width, Cell::Empty);
            if index == header {
                line.cells.extend(POSITION.map(|name| Cell::Text(name.to_owned())));
                continue;
            }
            if line.cells.iter().all(Cell::is_empty) {
                continue;
            }
            let name = line.cells[column].to_string();
            match by_name.get(target(name.trim())) {
                Some(point) => {
                    used += 1;
                    line.cells.extend(cells(*point));
                }
                None => {
                    without.push(name);
                    line.cells.clear();
                }
            }
        }
        if used == 0 {
            let some = |names: &mut dyn Iterator<Item = &str>| {
                names.take(3).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            };
            let message = format!(
                "none of its names is that of a measured point: the log has {}, the points are {}",
                some(&mut without.iter().map(String::as_str)),
                some(&mut by_name.keys().copied())
            );
            return Err(unusable(location, message));
        }
        log.rows.retain(|line| !line.cells.is_empty());
        let mut notes = vec![format!("{used} rows joined by name with {} measured points", by_name.len())];
        if !without.is_empty() {
            let shown = without.iter().take(5).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
            notes.push(format!("{} rows without a measured point are left out: {shown}", without.len()));
        }
        Ok((log, notes))
    }
}

/// A point as cells of a row.
pub(super) fn cells(at_mm: [f64; 3]) -> [Cell; 3] {
    at_mm.map(|value| Cell::Number { value, as_text: false })
}

/// The fields of a line, separated by commas if there are any, else by blanks.
fn fields(line: &str) -> Vec<&str> {
    match line.contains(',') {
        true => line.split(',').map(str::trim).collect(),
        false => line.split_whitespace().collect(),
    }
}

/// The number of names before x, y and z in most lines.
fn layout(lines: &[(usize, Vec<&str>)]) -> Option<usize> {
    let is_coordinate = |text: &&str| coordinate(text).is_some();
    let fitting = |names: usize| {
        let fits = |(_, fields): &&(usize, Vec<&str>)| {
            fields.len() >= names + 3
                && fields[names..names + 3].iter().all(is_coordinate)
                && !fields[..names].iter().any(is_coordinate)
        };
        lines.iter().filter(fits).count()
    };
    (1..=MAX_NAMES).find(|&names| fitting(names) * 2 > lines.len())
}

/// A coordinate. Names can be numbers: a coordinate has a point or an exponent.
fn coordinate(text: &str) -> Option<f64> {
    number(text, false).filter(|value| value.is_finite() && text.contains(['.', 'e', 'E']))
}

/// The target of a full name: `A::Main::p1`.
fn target(name: &str) -> &str {
    name.rsplit("::").next().unwrap_or(name).trim_matches('"')
}

fn named(line: &Line) -> Option<usize> {
    headed(line, &NAMES)
}

/// The column under the first of these names that occurs in the line, ignoring case.
pub(super) fn headed(line: &Line, names: &[&str]) -> Option<usize> {
    let is = |wanted: &str| line.cells.iter().position(|cell| cell.to_string().eq_ignore_ascii_case(wanted));
    names.iter().find_map(|name| is(name))
}
