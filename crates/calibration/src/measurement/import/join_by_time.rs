//! Joins a tracker's exported points with a log of the joints by the time stamps of two clocks.
//!
//! A point is matched with the row nearest in time, and only if the match is unambiguous: all rows within the stated tolerance have
//! the same joints (the arm stood still), and no second point matches the same row.

use super::cell::{Cell, Line, Table};
use super::clock::{FORMS, Stamp};
use super::column_names::POSITION;
use super::columns::HeaderColumns;
use super::error::{ImportError, Location};
use super::options::TimeMatching;
use super::tracker_export::{Point, Points, cells, headed, unusable};

/// Columns of a log that hold the time, in this order of preference.
const TIMES: [&str; 5] = ["time", "timestamp", "time_stamp", "datetime", "date_time"];

/// Joints that differ by less are of one pose (°): encoders flicker by some thousandths.
const SAME_DEG: f64 = 0.01;

const SECONDS_A_DAY: f64 = 86_400.0;

/// Most points and rows that a message or note lists.
const NAMED: usize = 5;

/// A row of the log.
struct Logged {
    /// Its index in the table.
    index: usize,
    /// Its line in the file.
    number: usize,
    time_s: f64,
}

/// The log with the measured points as columns `measured_x` to `measured_z`, and notes on omitted rows and points.
pub(super) fn join_by_time(
    points: &Points,
    file: &str,
    mut log: Table,
    clocks: &TimeMatching,
) -> Result<(Table, Vec<String>), ImportError> {
    let location = Location { sheet: log.sheet.as_deref().map(Into::into), ..Location::file(file) };
    let header = log.rows.iter().position(|line| headed(line, &TIMES).is_some());
    let Some((header, column)) = header.and_then(|at| Some((at, headed(&log.rows[at], &TIMES)?))) else {
        let message =
            "has no column with the time of each row; expected `time` beside q1 to q6, such as 10:15:30.25";
        return Err(unusable(location, message.to_owned()));
    };
    let width = log.rows.iter().map(|line| line.cells.len()).max().unwrap_or(0);
    log.rows.drain(..header);
    log.rows.iter_mut().for_each(|line| line.cells.resize(width, Cell::Empty));
    log.rows[0].cells.extend(POSITION.map(|name| Cell::Text(name.to_owned())));
    let columns = HeaderColumns::find(file, &log)?;
    let (logged, measured) = times(points, &log, column, &location)?;
    let pairing = Pairing { points, log: &log, joints: columns.joints, clocks, logged, measured };
    let pairs = pairing.pairs(file, &location)?;
    let notes = pairing.notes(&pairs);
    let mut partner: Vec<Option<usize>> = vec![None; log.rows.len()];
    pairs.iter().for_each(|pair| partner[pair.index] = Some(pair.point));
    let mut rows = std::mem::take(&mut log.rows).into_iter().zip(partner);
    let first = rows.next().map(|(line, _)| line);
    let taken = rows.filter_map(|(mut line, point)| {
        line.cells.extend(cells(points.all[point?].at_mm));
        Some(line)
    });
    log.rows = first.into_iter().chain(taken).collect();
    Ok((log, notes))
}

/// The times of the rows and of the points, each in their order (s from a common origin).
fn times(
    points: &Points,
    log: &Table,
    column: usize,
    location: &Location,
) -> Result<(Vec<Logged>, Vec<f64>), ImportError> {
    let time = log.rows[0].cells[column].to_string();
    let rows: Vec<(usize, &Line)> = log
        .rows
        .iter()
        .enumerate()
        .skip(1)
        .filter(|(_, line)| line.cells.iter().any(|cell| !cell.is_empty()))
        .collect();
    let stamp = |location: Location, text: &str| {
        Stamp::of(text).ok_or_else(|| unusable(location, format!("found `{text}`; expected {FORMS}")))
    };
    let of_rows = rows.iter().map(|(_, line)| {
        let location =
            Location { row: Some(line.number), column: Some(time.as_str().into()), ..location.clone() };
        stamp(location, &line.cells[column].to_string())
    });
    let of_rows = of_rows.collect::<Result<Vec<_>, _>>()?;
    let of_points = points.all.iter().map(|point| {
        let location = Location { row: Some(point.row), ..Location::file(&points.file) };
        let without = || {
            let message = format!(
                "no time after the coordinates of point `{}`, found `{}`; expected {FORMS}: export the points with their time stamps",
                point.name, point.more
            );
            unusable(location.clone(), message)
        };
        Stamp::of(&point.more).ok_or_else(without)
    });
    let of_points = of_points.collect::<Result<Vec<_>, _>>()?;
    let dated = days(location, &of_rows)? && days(&Location::file(&points.file), &of_points)?;
    if !dated && let Some((location, [first, last])) = over_midnight(location, &of_rows, points, &of_points) {
        let message = format!(
            "has times of {} days, and the other file has no dates; expected dates in both, or one day",
            last - first + 1
        );
        return Err(unusable(location, message));
    }
    let base = of_rows.first().and_then(|stamp| stamp.day).unwrap_or(0);
    let seconds = |stamp: &Stamp| {
        let days = if dated { stamp.day.unwrap_or(base) - base } else { 0 };
        days as f64 * SECONDS_A_DAY + stamp.seconds
    };
    let logged = rows.iter().zip(&of_rows);
    let logged = logged
        .map(|((index, line), stamp)| Logged { index: *index, number: line.number, time_s: seconds(stamp) })
        .collect();
    Ok((logged, of_points.iter().map(seconds).collect()))
}

/// Whether the times of a file have dates; an error if only some have.
fn days(location: &Location, stamps: &[Stamp]) -> Result<bool, ImportError> {
    let dated = stamps.iter().filter(|stamp| stamp.day.is_some()).count();
    if dated == 0 || dated == stamps.len() {
        return Ok(dated > 0);
    }
    let message =
        format!("{dated} of {} times have a date; expected one in every line or in none", stamps.len());
    Err(unusable(location.clone(), message))
}

/// The file that spans several days, with its first and last day, while the other has no dates.
fn over_midnight(
    location: &Location,
    rows: &[Stamp],
    points: &Points,
    measured: &[Stamp],
) -> Option<(Location, [i64; 2])> {
    let range = |stamps: &[Stamp]| {
        let days = || stamps.iter().filter_map(|stamp| stamp.day);
        Some([days().min()?, days().max()?]).filter(|[first, last]| first < last)
    };
    let of_points = || Some((Location::file(&points.file), range(measured)?));
    range(rows).map(|days| (location.clone(), days)).or_else(of_points)
}

/// A row and its point.
struct Pair {
    /// The row's index in the table.
    index: usize,
    point: usize,
    /// Difference of their times (s).
    apart_s: f64,
}

struct Pairing<'a> {
    points: &'a Points,
    log: &'a Table,
    joints: [usize; 6],
    clocks: &'a TimeMatching,
    logged: Vec<Logged>,
    measured: Vec<f64>,
}

impl Pairing<'_> {
    fn pairs(&self, file: &str, location: &Location) -> Result<Vec<Pair>, ImportError> {
        let mut order: Vec<&Logged> = self.logged.iter().collect();
        order.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let within = self.clocks.within_s;
        let mut pairs: Vec<Pair> = Vec::new();
        let mut nearest_s = Vec::new();
        for (at, (point, time)) in self.points.all.iter().zip(&self.measured).enumerate() {
            let time = time - self.clocks.ahead_s;
            let from = order.partition_point(|row| row.time_s < time - within);
            let to = order.partition_point(|row| row.time_s <= time + within);
            let apart = |row: &&&Logged| (row.time_s - time).abs();
            let near = |rows: &[&Logged]| {
                rows.iter().map(|row| (row.time_s - time).abs()).fold(f64::INFINITY, f64::min)
            };
            nearest_s.push(near(&order[from.saturating_sub(1)..(to + 1).min(order.len())]));
            let rows = &order[from..to];
            let Some(row) = rows.iter().min_by(|a, b| apart(a).total_cmp(&apart(b))) else { continue };
            self.check_at_rest(point, rows, file)?;
            pairs.push(Pair { index: row.index, point: at, apart_s: apart(&row) });
        }
        if pairs.is_empty() {
            nearest_s.sort_by(f64::total_cmp);
            let message = format!(
                "no row lies within {within} s of a measured point; the nearest rows are {:.3} to {:.3} s away; state a wider \
                 --points-within, or by how much the tracker's clock is ahead (--points-ahead)",
                nearest_s.first().copied().unwrap_or(f64::NAN),
                nearest_s.last().copied().unwrap_or(f64::NAN)
            );
            return Err(unusable(location.clone(), message));
        }
        self.check_unique(pairs, location)
    }

    /// Refuses a point during which the arm moved: its row would be ambiguous.
    fn check_at_rest(&self, point: &Point, rows: &[&Logged], file: &str) -> Result<(), ImportError> {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 6];
        for row in rows {
            for (range, column) in range.iter_mut().zip(self.joints) {
                let angle = self.log.rows[row.index].cells[column].number().unwrap_or(f64::NAN);
                *range = [range[0].min(angle), range[1].max(angle)];
            }
        }
        let spread = range.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return Ok(()) };
        if spread <= SAME_DEG {
            return Ok(());
        }
        let message = format!(
            "point `{}` is ambiguous: {} rows of {file} lie within {} s of it (rows {} to {}) and their joints differ by {spread:.3}°; \
             expected one pose: state a narrower --points-within, or leave the point out",
            point.name,
            rows.len(),
            self.clocks.within_s,
            first.number.min(last.number),
            first.number.max(last.number),
        );
        Err(unusable(Location { row: Some(point.row), ..Location::file(&self.points.file) }, message))
    }

    /// Refuses two points for one row. Returns the pairs in the order of the rows.
    fn check_unique(&self, mut pairs: Vec<Pair>, location: &Location) -> Result<Vec<Pair>, ImportError> {
        pairs.sort_by_key(|pair| (pair.index, pair.point));
        let mut beside = pairs.iter().zip(pairs.iter().skip(1));
        let Some((one, two)) = beside.find(|(one, two)| one.index == two.index) else { return Ok(pairs) };
        let named = |pair: &Pair| {
            let Point { row, name, .. } = &self.points.all[pair.point];
            format!("`{name}` ({}, row {row}, {:.3} s away)", self.points.file, pair.apart_s)
        };
        let message = format!(
            "is ambiguous: it is the row nearest to two points, {} and {}; expected one: state a narrower --points-within, or leave \
             one of the points out",
            named(one),
            named(two)
        );
        Err(unusable(Location { row: Some(self.log.rows[one.index].number), ..location.clone() }, message))
    }

    fn notes(&self, pairs: &[Pair]) -> Vec<String> {
        let largest = pairs.iter().map(|pair| pair.apart_s).fold(0.0, f64::max);
        let ahead = match self.clocks.ahead_s {
            0.0 => String::new(),
            ahead => format!(", the tracker's clock taken as {ahead} s ahead"),
        };
        let mut notes = vec![format!(
            "{} rows joined by time with {} measured points, at most {largest:.3} s apart ({} s were allowed){ahead}",
            pairs.len(),
            self.points.all.len(),
            self.clocks.within_s
        )];
        let mut left_out = |what: &str, names: Vec<String>| {
            let more = if names.len() > NAMED { ", …" } else { "" };
            if !names.is_empty() {
                let shown = names.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
                notes.push(format!("{} {what} are left out: {shown}{more}", names.len()));
            }
        };
        let joined = |point: usize| pairs.iter().any(|pair| pair.point == point);
        let alone = self.points.all.iter().enumerate().filter(|(at, _)| !joined(*at));
        left_out(
            "points without a row at their time",
            alone.map(|(_, point)| format!("`{}`", point.name)).collect(),
        );
        let rows = self
            .logged
            .iter()
            .filter(|row| pairs.binary_search_by_key(&row.index, |pair| pair.index).is_err());
        left_out("rows without a point at their time", rows.map(|row| row.number.to_string()).collect());
        notes
    }
}
