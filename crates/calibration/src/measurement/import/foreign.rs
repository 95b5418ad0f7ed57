//! Converts tables of other programs, recognised by their content.
//!
//! - RoboDK, exported measurements of a calibration: six joints (°), the measured point (mm), the TCP (mm). A point near zero was
//!   not measured. Source: RoboDK's macro for distance errors after a calibration, which reads the columns in that order.
//! - DELMIA, input of Auto ID: name of the tag, x, y, z (mm), roll, pitch, yaw (°) as measured, six joints (°); an optional header is
//!   ignored. Source: DELMIA robotics offline programming, "Auto ID input file".
//!
//! The result is a table with truegrind's header, whose cells are checked as usual.

use nalgebra::UnitQuaternion;

use super::cell::{Cell, Line, Table};
use super::columns::{POSITION, QUATERNION};
use super::error::{ImportError, Location};

/// A point nearer to zero than this in every coordinate was not measured (mm).
const NOT_MEASURED_MM: f64 = 1e-3;

/// Cells of a row of RoboDK: six joints, the point, the TCP.
const ROBODK: usize = 12;

/// Cells of a row of DELMIA for an arm of six joints.
const DELMIA: usize = 13;

/// Fewest rows by which such a table can be recognised.
const LEAST: usize = 4;

/// The table under truegrind's header, and notes; `None` for an unknown format.
///
/// # Errors
/// [`ImportError`] for a known format that cannot be used: several TCPs, more than six joints, nothing measured.
pub(super) fn convert(file: &str, table: &Table) -> Option<Result<(Table, Vec<String>), ImportError>> {
    let used: Vec<&Line> = table.rows.iter().filter(|line| widest(line) > 0).collect();
    let (first, rest) = used.split_first()?;
    // In a header, only the first cell can be a number.
    let headed = first.cells.iter().skip(1).all(|cell| cell.number().is_none());
    let rows = if headed { rest } else { &used[..] };
    if rows.len() < LEAST || headed && is_ours(first) {
        return None;
    }
    let location = Location { sheet: table.sheet.as_deref().map(Into::into), ..Location::file(file) };
    if rows.iter().all(|line| numbers::<ROBODK>(line, 0).is_some()) {
        return robodk(rows, &location)
            .map(|found| found.map(|(rows, notes)| (under_our_header(table, rows), notes)));
    }
    let joints = rows.iter().map(|line| widest(line)).max()?.saturating_sub(DELMIA - 6);
    let tags = rows.iter().all(|line| {
        matches!(line.cells.first(), Some(Cell::Text(_))) && line.cells[1..].iter().take(12).all(is_number)
    });
    if !tags || joints < 6 {
        return None;
    }
    if joints > 6 {
        return Some(Err(ImportError::TooManyJoints { location, joint: joints }));
    }
    delmia(rows).map(|(rows, notes)| Ok((under_our_header(table, rows), notes)))
}

/// Whether a header uses truegrind's column names; missing columns are then reported by name.
fn is_ours(header: &Line) -> bool {
    let ours = |name: &str| name.starts_with("measured_") || ["q1", "x", "y", "z", "L"].contains(&name);
    header.cells.iter().any(|cell| ours(&cell.to_string()))
}

fn widest(line: &Line) -> usize {
    line.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |at| at + 1)
}

fn is_number(cell: &Cell) -> bool {
    cell.number().is_some()
}

/// The `N` numbers from index `from` to the end of the line.
fn numbers<const N: usize>(line: &Line, from: usize) -> Option<[f64; N]> {
    if widest(line) != from + N {
        return None;
    }
    let mut out = [0.0; N];
    for (out, cell) in out.iter_mut().zip(&line.cells[from..]) {
        *out = cell.number()?;
    }
    Some(out)
}

type Rows = (Vec<Line>, Vec<String>);

fn robodk(rows: &[&Line], location: &Location) -> Option<Result<Rows, ImportError>> {
    let values: Vec<[f64; ROBODK]> = rows.iter().filter_map(|line| numbers(line, 0)).collect();
    let measured = |row: &[f64; ROBODK]| row[6..9].iter().any(|v| v.abs() >= NOT_MEASURED_MM);
    let tcp = values.iter().find(|row| measured(row))?[9..].to_vec();
    let other = |row: &&[f64; ROBODK]| {
        measured(row) && row[9..].iter().zip(&tcp).any(|(a, b)| (a - b).abs() > NOT_MEASURED_MM)
    };
    if values.iter().any(|row| other(&row)) {
        let groups = values.iter().filter(other).count();
        // Columns that change from row to row are not a TCP.
        return (groups * 2 < values.len()).then(|| {
            Err(ImportError::Format {
                location: location.clone(),
                message: "a calibration table of RoboDK with more than one TCP; expected one: write a file for each target on \
                          the arm, and give the others with --also"
                    .to_owned(),
            })
        });
    }
    let taken: Vec<Line> = rows
        .iter()
        .zip(&values)
        .filter(|(_, row)| measured(row))
        .map(|(line, row)| Line { number: line.number, cells: row[..9].iter().map(|v| cell(*v)).collect() })
        .collect();
    let mut notes = vec![format!(
        "read as a calibration table of RoboDK: joints, measured point, TCP; its TCP ({}, {}, {}) mm is not used, the point that \
         is touched is fitted",
        tcp[0], tcp[1], tcp[2]
    )];
    if taken.len() < rows.len() {
        notes.push(format!(
            "{} rows whose point is near zero were not measured and are left out",
            rows.len() - taken.len()
        ));
    }
    Some(Ok((taken, notes)))
}

fn delmia(rows: &[&Line]) -> Option<Rows> {
    let values: Vec<[f64; DELMIA - 1]> = rows.iter().map(|line| numbers(line, 1)).collect::<Option<_>>()?;
    let turned = values.iter().any(|row| row[3..6].iter().any(|angle| *angle != 0.0));
    let lines = rows
        .iter()
        .zip(&values)
        .map(|(line, row)| {
            let mut cells: Vec<Cell> = row[6..].iter().chain(&row[..3]).map(|v| cell(*v)).collect();
            if turned {
                let [roll, pitch, yaw] = [row[3], row[4], row[5]].map(f64::to_radians);
                // Fixed axes: roll about x, then pitch about y, then yaw about z.
                let q = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
                cells.extend([q.w, q.i, q.j, q.k].map(cell));
            }
            Line { number: line.number, cells }
        })
        .collect();
    let what = if turned { "pose (roll, pitch, yaw)" } else { "point (no orientation was measured)" };
    Some((lines, vec![format!("read as input of DELMIA Auto ID: tag, measured {what}, joints")]))
}

fn cell(value: f64) -> Cell {
    Cell::Number { value, as_text: false }
}

fn under_our_header(table: &Table, rows: Vec<Line>) -> Table {
    let width = rows.iter().map(|line| line.cells.len()).max().unwrap_or(0);
    let joints = (1..=6).map(|joint| format!("q{joint}"));
    let measured = POSITION.into_iter().chain(QUATERNION).map(str::to_owned);
    let names = joints.chain(measured).take(width).map(Cell::Text).collect();
    let header = Line { number: 1, cells: names };
    Table { rows: std::iter::once(header).chain(rows).collect(), width, ..table.clone() }
}
