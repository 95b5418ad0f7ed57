//! Converts tables of other programs, recognised by their content.
//!
//! - RoboDK, exported measurements of a calibration: six joints (°), the measured point (mm), the TCP (mm); or the measured pose and the
//!   TCP as a pose, each x, y, z (mm) and three angles (rad) about x, then the new y, then the new z. The first line holds no numbers.
//!   A point near zero was not measured. Source: RoboDK's macros on such tables, `CalculateErrorsDistances.py`, `CalculateErrorsPoses.py`
//!   and the one that shows measured poses as frames; their columns, their units, "the first line should be ignored", and "incomplete" where
//!   |x| + |y| + |z| < 0.001.
//! - DELMIA, input of Auto ID: name of the tag, x, y, z (mm), roll, pitch, yaw (°) as measured, six joints (°); an optional header is
//!   ignored. Source: DELMIA robotics offline programming, "Auto ID input file".
//!
//! The result is a table with truegrind's header, whose cells are checked as usual.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use super::cell::{Cell, Line, Table};
use super::column_names::{POSITION, QUATERNION, joint};
use super::columns::is_known;
use super::error::{ImportError, Location};

/// A point with |x| + |y| + |z| below this was not measured (mm).
const NOT_MEASURED_MM: f64 = 1e-3;

/// TCPs that differ by less than this in every number are the same (mm, rad).
const SAME_TCP: f64 = 1e-3;

/// Cells of a row of RoboDK: six joints and two points, or two poses.
const ROBODK: [usize; 2] = [12, 18];

/// Largest angle of a pose of RoboDK: half a turn, and what rounding adds (rad).
const MAX_ANGLE_RAD: f64 = std::f64::consts::PI + 1e-3;

/// Cells of a row of DELMIA for an arm of six joints.
const DELMIA: usize = 13;

/// Index of the first joint in a row of DELMIA.
const DELMIA_JOINT: usize = 7;

/// Fewest rows by which such a table can be recognised.
const MIN_ROWS: usize = 4;

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
    if rows.len() < MIN_ROWS {
        return None;
    }
    let foreign = |first_joint: usize| !headed || !is_ours(first, first_joint);
    let location = Location { sheet: table.sheet.as_deref().map(Into::into), ..Location::file(file) };
    let widths = ROBODK.into_iter().filter(|_| foreign(0));
    if let Some(found) = widths.filter_map(|width| robodk(rows, width, &location)).next() {
        return Some(found.map(|(rows, notes)| (under_our_header(table, rows), notes)));
    }
    if !foreign(DELMIA_JOINT) {
        return None;
    }
    delmia(rows, &location).map(|found| found.map(|(rows, notes)| (under_our_header(table, rows), notes)))
}

/// Whether a header states another meaning than the foreign format, whose joints begin at column `first_joint`: a joint's name elsewhere,
/// or another name of truegrind. Missing columns are then reported by name.
fn is_ours(header: &Line, first_joint: usize) -> bool {
    header.cells.iter().map(ToString::to_string).enumerate().any(|(at, name)| match joint(&name) {
        Some(joint) => at + 1 != first_joint + joint,
        None => is_known(&name),
    })
}

fn widest(line: &Line) -> usize {
    line.cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |at| at + 1)
}

/// The `count` numbers from index `from` to the end of the line.
fn numbers(line: &Line, from: usize, count: usize) -> Option<Vec<f64>> {
    if widest(line) != from + count {
        return None;
    }
    line.cells[from..from + count].iter().map(Cell::number).collect()
}

/// Whether so many of the rows are of a format that the others are faults.
fn are_most(fitting: usize, rows: usize) -> bool {
    fitting * 4 >= rows * 3
}

fn misfit(line: &Line, location: &Location, expected: String) -> ImportError {
    let cells: Vec<String> = line.cells[..widest(line)].iter().map(ToString::to_string).collect();
    let location = Location { row: Some(line.number), ..location.clone() };
    let message = format!(
        "found {} cells, `{}`; expected {expected}: correct the row, or delete it",
        cells.len(),
        cells.join(", ")
    );
    ImportError::Unusable { location, message }
}

type Rows = (Vec<Line>, Vec<String>);

/// A row of RoboDK.
struct Measured<'a> {
    line: &'a Line,
    joints: [f64; 6],
    /// x, y, z; with three angles, or none.
    target: Vec<f64>,
    tcp: Vec<f64>,
}

fn robodk(rows: &[&Line], width: usize, location: &Location) -> Option<Result<Rows, ImportError>> {
    let all: Vec<Measured<'_>> = rows
        .iter()
        .filter_map(|line| {
            let row = numbers(line, 0, width)?;
            let (joints, rest) = row.split_at(6);
            let (target, tcp) = rest.split_at((width - 6) / 2);
            let joints = joints.try_into().ok()?;
            Some(Measured { line, joints, target: target.to_vec(), tcp: tcp.to_vec() })
        })
        .collect();
    if !are_most(all.len(), rows.len()) {
        return None;
    }
    let is_measured =
        |row: &&Measured<'_>| row.target[..3].iter().map(|v| v.abs()).sum::<f64>() >= NOT_MEASURED_MM;
    let measured: Vec<&Measured<'_>> = all.iter().filter(is_measured).collect();
    let tcp = &measured.first()?.tcp;
    let others =
        measured.iter().filter(|row| row.tcp.iter().zip(tcp).any(|(a, b)| (a - b).abs() > SAME_TCP)).count();
    if others * 2 >= all.len() {
        // Columns that change from row to row are not a TCP.
        return None;
    }
    let refuse = |row: Option<usize>, message: String| {
        let location = Location { row, ..location.clone() };
        Some(Err(ImportError::Unusable { location, message }))
    };
    if let Some(line) = rows.iter().find(|line| numbers(line, 0, width).is_none()) {
        let expected = format!("{width} numbers as in the other rows of this calibration table of RoboDK");
        return Some(Err(misfit(line, location, expected)));
    }
    if others > 0 {
        let message = "a calibration table of RoboDK with more than one TCP; expected one: write a file for each target on the \
                       arm, and give the others with --also";
        return refuse(None, message.to_owned());
    }
    let wide = |row: &&Measured<'_>| row.target[3..].iter().any(|angle| angle.abs() > MAX_ANGLE_RAD);
    if let Some(row) = measured.iter().copied().find(|row| wide(row)) {
        let found = row.target[3..].iter().fold(0.0_f64, |largest, angle| largest.max(angle.abs()));
        let message = format!(
            "a calibration table of RoboDK with an angle of {found} in columns 10 to 12; expected the measured orientation in \
             radians, within ±π, as RoboDK writes it: convert the angles, or leave out columns 10 to 12 and 16 to 18"
        );
        return refuse(Some(row.line.number), message);
    }
    let turned = measured.iter().any(|row| row.target[3..].iter().any(|angle| *angle != 0.0));
    let taken: Vec<Line> = measured
        .iter()
        .map(|row| {
            let mut cells: Vec<Cell> = row.joints.iter().chain(&row.target[..3]).map(|v| cell(*v)).collect();
            if let ([rx, ry, rz], true) = (&row.target[3..], turned) {
                let about =
                    |axis: UnitVector3<f64>, angle: &f64| UnitQuaternion::from_axis_angle(&axis, *angle);
                let q = about(Vector3::x_axis(), rx)
                    * about(Vector3::y_axis(), ry)
                    * about(Vector3::z_axis(), rz);
                cells.extend([q.w, q.i, q.j, q.k].map(cell));
            }
            Line { number: row.line.number, cells }
        })
        .collect();
    let what = if turned { "pose" } else { "point" };
    let mut notes = vec![format!(
        "read as a calibration table of RoboDK: joints, measured {what}, TCP; its TCP ({}, {}, {}) mm is not used, the {what} of the \
         target on the flange is fitted",
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

fn delmia(rows: &[&Line], location: &Location) -> Option<Result<Rows, ImportError>> {
    let tagged = |line: &Line| matches!(line.cells.first(), Some(Cell::Text(_)));
    let values: Vec<Option<Vec<f64>>> = rows
        .iter()
        .map(|line| {
            numbers(line, 1, widest(line).saturating_sub(1))
                .filter(|row| tagged(line) && row.len() >= DELMIA - 1)
        })
        .collect();
    let width = values.iter().flatten().map(Vec::len).next()?;
    let fitting = |row: &Option<Vec<f64>>| row.as_ref().is_some_and(|row| row.len() == width);
    if !are_most(values.iter().filter(|row| fitting(row)).count(), rows.len()) {
        return None;
    }
    let joint = width + 1 - DELMIA_JOINT;
    if joint > 6 {
        return Some(Err(ImportError::TooManyJoints { location: location.clone(), joint }));
    }
    if let Some((line, _)) = rows.iter().zip(&values).find(|(_, row)| !fitting(row)) {
        let expected = "a tag and 12 numbers as in the other rows of this input of DELMIA Auto ID".to_owned();
        return Some(Err(misfit(line, location, expected)));
    }
    let values: Vec<Vec<f64>> = values.into_iter().flatten().collect();
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
    Some(Ok((lines, vec![format!("read as input of DELMIA Auto ID: tag, measured {what}, joints")])))
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
