//! Converts the rows of a table to measured rows: checks every cell and converts units.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};

use super::cell::{Cell, Line, Table};
use super::columns::HeaderColumns;
use super::error::{ImportError, Location};
use super::options::Options;
use super::rounding::{self, StepSearch};
use crate::measurement::dataset::{Dataset, Extra, PathPoint, Reading, Row, Sensor};
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_math::sentence;
use truegrind_math::work::checkpoint;

/// Largest difference of a quaternion's norm from 1: four decimals still pass.
const QUATERNION_TOLERANCE: f64 = 1e-3;

/// Builds the data set from the rows below the header: those of the table, and `further` ones of a text read line by line.
pub(super) fn dataset(
    file: &str,
    table: &Table,
    columns: &HeaderColumns,
    options: &Options,
    further: impl Iterator<Item = Result<Line, ImportError>>,
) -> Result<Dataset, ImportError> {
    let mut notes = columns.notes.clone();
    let reader = Reader { file, sheet: table.sheet.as_deref(), header: &table.rows[columns.header] };
    let (mut rows, mut blank, mut unnamed, mut as_text) = (Vec::new(), table.blank_lines, 0usize, 0usize);
    let (mut conditions, mut angles) = (Conditions::default(), Angles::default());
    let (mut numbered, mut stations) = (None, Stations::default());
    let lines = table.rows[columns.header + 1..].iter().map(|line| Ok(Cow::Borrowed(line)));
    for line in lines.chain(further.map(|line| line.map(Cow::Owned))) {
        checkpoint();
        let line: Cow<'_, Line> = line?;
        let line = line.as_ref();
        let extra = line.cells.iter().skip(columns.width).filter(|c| !c.is_empty()).count();
        if extra > 0 && table.sheet.is_none() {
            let location = Location { row: Some(line.number), ..reader.location() };
            let expected = columns.width;
            return Err(ImportError::LongRow { location, found: line.cells.len(), expected });
        }
        let headed = |i: usize| reader.header.cells.get(i).is_some_and(|c| !c.is_empty());
        if line.cells.iter().enumerate().all(|(i, c)| c.is_empty() || !headed(i)) {
            blank += 1;
            continue;
        }
        let widest = line.cells.iter().rposition(|c| !c.is_empty()).map_or(0, |i| i + 1);
        unnamed = unnamed.max((0..widest).filter(|&i| !headed(i) && !line.cells[i].is_empty()).count());
        as_text += line.cells.iter().filter(|c| matches!(c, Cell::Number { as_text: true, .. })).count();
        if let Some(column) = columns.anchor.or(columns.station) {
            let given = !line.cells.get(column).is_none_or(Cell::is_empty);
            if *numbered.get_or_insert(given) != given {
                let [expected, remedy] = if columns.anchor.is_some() {
                    [
                        "the number of a cable outlet in every row, or in none",
                        "number the cable outlets 1, 2, 3, …",
                    ]
                } else {
                    [
                        "the name of a station in every row, or in none",
                        "name each place of the sensor, such as A and B",
                    ]
                };
                return Err(reader.wrong(line, column, expected, remedy));
            }
        }
        let mut row = reader.row(line, columns, &mut conditions, &mut angles)?;
        row.anchor += stations.index_of(columns.station.and_then(|column| line.cells.get(column)));
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(ImportError::Empty { location: reader.location() });
    }
    rows.shrink_to_fit();
    let headed = reader.header.cells.iter().filter(|c| !c.is_empty()).count();
    let width = reader.header.cells.len().max(table.width);
    let nameless = (width - headed).max(unnamed) + table.blank_columns;
    let counted = [
        (nameless, "column without a header skipped", "columns without a header skipped"),
        (blank, "blank row skipped", "blank rows skipped"),
        (
            as_text,
            "number stored as text was read as a number",
            "numbers stored as text were read as numbers",
        ),
    ];
    notes.extend(
        counted
            .iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, one, several)| sentence::counted(*count, one, several)),
    );
    if columns.anchor.is_some() {
        notes.extend(number_anchors(&mut rows));
    }
    check_outlets(&reader, columns, &rows)?;
    if !options.allow_odd_units {
        check_units(&reader, &rows, &angles, columns.sensor)?;
    }
    let angle_step_rad = angles.step.found().map(f64::to_radians);
    let mut readout_step = StepSearch::default();
    for v in rows.iter().filter_map(Row::readout_mm) {
        v.iter().for_each(|coordinate| readout_step.add(*coordinate));
    }
    let readout_step_mm = readout_step.found();
    let reading_step_mm = reading_step(&rows, columns.sensor);
    Ok(Dataset {
        file: file.into(),
        sheet: table.sheet.clone(),
        sha256: String::new(),
        sensor: columns.sensor,
        rows: rows.into(),
        other_columns: columns.other.iter().map(|(name, _)| name.clone()).collect(),
        notes,
        joined_by_time: false,
        station_names: stations.names(),
        angle_step_rad,
        readout_step_mm,
        reading_step_mm,
    })
}

/// Names of stations in the order in which they are met.
#[derive(Default)]
struct Stations(HashMap<String, usize>);

impl Stations {
    fn index_of(&mut self, cell: Option<&Cell>) -> usize {
        let Some(name) = cell.filter(|cell| !cell.is_empty()).map(Cell::to_string) else { return 0 };
        let next = self.0.len();
        *self.0.entry(name).or_insert(next)
    }

    fn names(self) -> Vec<String> {
        let mut named: Vec<(usize, String)> = self.0.into_iter().map(|(name, index)| (index, name)).collect();
        named.sort_unstable();
        named.into_iter().map(|(_, name)| name).collect()
    }
}

/// Refuses more outlets or stations than can be identified.
fn check_outlets(reader: &Reader<'_>, columns: &HeaderColumns, rows: &[Row]) -> Result<(), ImportError> {
    let places = rows.iter().map(|row| row.anchor + 1).max().unwrap_or(1);
    if places <= MAX_OUTLETS {
        return Ok(());
    }
    let (column, what, remedy) = if columns.station.is_some() {
        (
            "station",
            "stations",
            "each station adds six unknowns; to label rows taken from one station, use the column `session`",
        )
    } else {
        let remedy = "each outlet adds four unknowns: put the rows of further outlets into other files";
        ("anchor", "cable outlets", remedy)
    };
    Err(ImportError::Cell {
        location: Location { column: Some(column.into()), ..reader.location() },
        found: format!("{places} different {what}").into(),
        expected: "at most 64 in one file",
        remedy,
    })
}

/// The step to which readings are rounded (mm).
fn reading_step(rows: &[Row], sensor: Sensor) -> Option<f64> {
    let count = sensor.axes();
    rounding::step_of_readings(rows.iter().flat_map(|r| {
        let at: [f64; 3] = r.reading.place_mm().into();
        at.into_iter().take(count)
    }))
}

/// Largest joint angle: ten turns.
const MAX_ANGLE_DEG: f64 = 3600.0;
/// Largest reading: a kilometre.
const MAX_LENGTH_MM: f64 = 1e6;
const LENGTH: &str = "a length in mm, below a kilometre";
/// Most cable outlets; the cost of identification grows with the cube of their number.
const MAX_OUTLETS: usize = 64;
/// Largest payload.
const MAX_PAYLOAD_KG: f64 = 1e4;

/// Largest distance of the centre of a payload from the flange along an axis.
const MAX_PAYLOAD_CENTRE_MM: f64 = 1e4;

/// Interned conditions: many rows share few of them.
#[derive(Default)]
struct Conditions {
    seen: HashMap<Bits, Arc<Condition>>,
}

/// The bits of a condition: time, temperature, payload; its centre; approach sides.
type Bits = ([Option<u64>; 3], [u64; 3], [i8; 6]);

/// Most interned conditions; in a log with times every row has its own.
const MAX_SHARED: usize = 4096;

impl Conditions {
    fn share(&mut self, condition: Condition) -> Arc<Condition> {
        let Condition { time_h, temperature_c, payload_kg, payload_centre_mm, approach } = condition;
        let logged = [time_h, temperature_c, payload_kg].map(|value| value.map(f64::to_bits));
        let key = (logged, payload_centre_mm.map(f64::to_bits), approach);
        if let Some(shared) = self.seen.get(&key) {
            return shared.clone();
        }
        let new = Arc::new(condition);
        if self.seen.len() < MAX_SHARED {
            self.seen.insert(key, new.clone());
        }
        new
    }
}

struct Reader<'a> {
    file: &'a str,
    sheet: Option<&'a str>,
    header: &'a Line,
}

impl Reader<'_> {
    /// The centre of the payload; the flange where the cells are empty.
    fn payload_centre_mm(&self, line: &Line, columns: &HeaderColumns) -> Result<[f64; 3], ImportError> {
        let given = |c: &[usize; 3]| c.iter().any(|&i| !line.cells.get(i).is_none_or(Cell::is_empty));
        let Some([x, y, z]) = columns.payload_centre.filter(given) else { return Ok([0.0; 3]) };
        let at = |column| self.bounded(line, column, MAX_PAYLOAD_CENTRE_MM, "a length in mm, within ±10,000");
        Ok([at(x)?, at(y)?, at(z)?])
    }

    fn location(&self) -> Location {
        Location { sheet: self.sheet.map(Into::into), ..Location::file(self.file) }
    }

    fn cell_location(&self, line: &Line, column: usize) -> Location {
        let column = self.header.cells.get(column).map(|c| c.to_string().into());
        Location { row: Some(line.number), column, ..self.location() }
    }

    fn wrong(&self, line: &Line, column: usize, expected: &'static str, remedy: &'static str) -> ImportError {
        let found = match line.cells.get(column) {
            None | Some(Cell::Empty) => "an empty cell".into(),
            Some(cell) => format!("`{cell}`").into(),
        };
        ImportError::Cell { location: self.cell_location(line, column), found, expected, remedy }
    }

    /// A required finite number.
    fn number(&self, line: &Line, column: usize) -> Result<f64, ImportError> {
        const EXPECTED: &str = "a finite number";
        match line.cells.get(column) {
            Some(Cell::Number { value, .. }) if value.is_finite() => Ok(*value),
            Some(Cell::Text(text)) if text.contains(':') => {
                let remedy = "t is the time since the start in hours: write 0.0033 for 12 s";
                Err(self.wrong(line, column, EXPECTED, remedy))
            }
            Some(Cell::Text(text)) if text.contains(',') => {
                let remedy = if self.sheet.is_some() {
                    "this cell contains text: turn it into a number"
                } else {
                    "write it with a decimal point (a decimal comma needs columns separated by semicolons)"
                };
                Err(self.wrong(line, column, EXPECTED, remedy))
            }
            _ => Err(self.wrong(line, column, EXPECTED, "correct the cell, or delete the row")),
        }
    }

    /// A required number within ±`largest`.
    fn bounded(
        &self,
        line: &Line,
        column: usize,
        largest: f64,
        expected: &'static str,
    ) -> Result<f64, ImportError> {
        let value = self.number(line, column)?;
        if value.abs() <= largest {
            return Ok(value);
        }
        Err(self.wrong(line, column, expected, "correct the cell, or delete the row"))
    }

    /// An optional number.
    fn optional(&self, line: &Line, column: Option<usize>) -> Result<Option<f64>, ImportError> {
        match column {
            Some(i) if !line.cells.get(i).is_none_or(Cell::is_empty) => self.number(line, i).map(Some),
            _ => Ok(None),
        }
    }

    fn row(
        &self,
        line: &Line,
        columns: &HeaderColumns,
        conditions: &mut Conditions,
        angles: &mut Angles,
    ) -> Result<Row, ImportError> {
        let mut joints = Joints::zeros();
        for (joint, &column) in columns.joints.iter().enumerate() {
            let angle_deg = self.bounded(line, column, MAX_ANGLE_DEG, "an angle in degrees, within ±3600")?;
            angles.add(joint, angle_deg);
            joints[joint] = angle_deg.to_radians();
        }
        let reading = self.reading(line, columns)?;
        let readout_mm = match columns.readout {
            Some(c) if c.iter().any(|&i| !line.cells.get(i).is_none_or(Cell::is_empty)) => {
                Some(Vector3::new(
                    self.bounded(line, c[0], MAX_LENGTH_MM, LENGTH)?,
                    self.bounded(line, c[1], MAX_LENGTH_MM, LENGTH)?,
                    self.bounded(line, c[2], MAX_LENGTH_MM, LENGTH)?,
                ))
            }
            _ => None,
        };
        let approach = self.approach(line, columns)?;
        let payload_kg = self.optional(line, columns.payload)?;
        if payload_kg.is_some_and(|kg| !(0.0..=MAX_PAYLOAD_KG).contains(&kg)) {
            let remedy = "enter the mass at the flange, or leave the cell empty";
            return Err(self.wrong(
                line,
                columns.payload.unwrap_or_default(),
                "a mass in kg, 0 to 10,000",
                remedy,
            ));
        }
        let condition = Condition {
            time_h: self.optional(line, columns.time)?,
            temperature_c: self.optional(line, columns.temperature)?,
            payload_kg,
            payload_centre_mm: self.payload_centre_mm(line, columns)?,
            approach,
        };
        let anchor = match self.optional(line, columns.anchor)?.zip(columns.anchor) {
            None => 0,
            Some((value, column)) => {
                if value < 0.0 || value.fract() != 0.0 || value > 1e6 {
                    let remedy = "number the cable outlets 1, 2, 3, …";
                    return Err(self.wrong(line, column, "the number of a cable outlet", remedy));
                }
                value as usize
            }
        };
        // Trailing empty cells are not stored.
        let kept = columns.other.iter().rposition(|(_, i)| line.cells.get(*i).is_some_and(|c| !c.is_empty()));
        let kept = kept.map_or(0, |last| last + 1);
        let text = |i: usize| line.cells.get(i).map(Cell::to_string).unwrap_or_default();
        let extra = Extra {
            readout_mm,
            motion: None,
            session: columns.session.map(text).filter(|s| !s.is_empty()),
            path: self.path(line, columns)?.map(Box::new),
            other: columns.other[..kept].iter().map(|(_, i)| text(*i)).collect(),
        };
        let extra = (extra != Extra::default()).then(|| Box::new(extra));
        let condition = conditions.share(condition);
        let location = u32::try_from(line.number).unwrap_or(u32::MAX);
        Ok(Row { number: line.number, line: location, joints, reading, condition, anchor, extra })
    }

    /// The sensor's reading.
    fn reading(&self, line: &Line, columns: &HeaderColumns) -> Result<Reading, ImportError> {
        let values: Vec<f64> = columns
            .reading
            .iter()
            .map(|&c| self.bounded(line, c, MAX_LENGTH_MM, LENGTH))
            .collect::<Result<_, _>>()?;
        Ok(match (columns.sensor, values.as_slice()) {
            (Sensor::Cable, [length]) => Reading::Cable(*length),
            (_, [x, y, z]) => Reading::Position(Vector3::new(*x, *y, *z)),
            (_, [x, y, z, w, i, j, k]) => {
                let rotation = self.quaternion(line, columns, Quaternion::new(*w, *i, *j, *k))?;
                Reading::Pose(Box::new(Pose::from_parts(Translation3::new(*x, *y, *z), rotation)))
            }
            // Unreachable: the sensor has one, three or seven columns.
            _ => return Err(ImportError::Empty { location: self.location() }),
        })
    }

    /// The sampling point on a path; `None` where the arm stood still.
    fn path(&self, line: &Line, columns: &HeaderColumns) -> Result<Option<PathPoint>, ImportError> {
        let Some([path, cycle, sample]) = columns.path else { return Ok(None) };
        let is_empty = |column: usize| line.cells.get(column).is_none_or(Cell::is_empty);
        if [path, cycle, sample].into_iter().all(is_empty) {
            return Ok(None);
        }
        if is_empty(path) {
            let remedy = "name it, or leave path, cycle and sample empty where the arm stood still";
            return Err(self.wrong(line, path, "the name of a path", remedy));
        }
        let count = |column: usize, least: f64, expected, remedy| {
            let value = self.number(line, column)?;
            if value < least || value.fract() != 0.0 || value > f64::from(u32::MAX) {
                return Err(self.wrong(line, column, expected, remedy));
            }
            Ok(value as u32)
        };
        Ok(Some(PathPoint {
            path: line.cells.get(path).map(Cell::to_string).unwrap_or_default(),
            cycle: count(
                cycle,
                1.0,
                "the number of a cycle, from 1",
                "count how often the path was run: 1, 2, 3, …",
            )?,
            sample: count(
                sample,
                0.0,
                "the number of a sampling point",
                "count the sampling points along the path, the same in each cycle",
            )?,
        }))
    }

    /// The approach side of each joint.
    fn approach(&self, line: &Line, columns: &HeaderColumns) -> Result<[i8; 6], ImportError> {
        let mut approach = [0i8; 6];
        for (side, column) in approach.iter_mut().zip(columns.approach) {
            *side = match self.optional(line, column)? {
                Some(-1.0) => -1,
                Some(1.0) => 1,
                None | Some(0.0) => 0,
                Some(_) => {
                    let remedy = "enter the side from which the joint approached, or 0 if it is not known";
                    return Err(self.wrong(line, column.unwrap_or_default(), "-1, 0 or 1", remedy));
                }
            };
        }
        Ok(approach)
    }

    fn quaternion(
        &self,
        line: &Line,
        columns: &HeaderColumns,
        q: Quaternion<f64>,
    ) -> Result<UnitQuaternion<f64>, ImportError> {
        if (q.norm() - 1.0).abs() <= QUATERNION_TOLERANCE {
            return Ok(UnitQuaternion::from_quaternion(q));
        }
        let mut location = self.cell_location(line, columns.reading[3]);
        location.column = Some("measured_qw to measured_qz".into());
        Err(ImportError::Cell {
            location,
            found: format!("a quaternion of length {:.4} ({}, {}, {}, {})", q.norm(), q.w, q.i, q.j, q.k)
                .into(),
            expected: "a unit quaternion, scalar first",
            remedy: "export unit quaternions; Euler angles or a rotation vector have to be converted first",
        })
    }
}

/// Renumbers the outlets from 0; notes the numbers of the file if they are not consecutive.
fn number_anchors(rows: &mut [Row]) -> Option<String> {
    let mut labels: Vec<usize> = rows.iter().map(|r| r.anchor).collect();
    labels.sort_unstable();
    labels.dedup();
    for row in rows.iter_mut() {
        row.anchor = labels.binary_search(&row.anchor).unwrap_or_default();
    }
    let plain = labels.iter().enumerate().all(|(i, l)| *l == i)
        || labels.iter().enumerate().all(|(i, l)| *l == i + 1);
    (!plain).then(|| {
        let names: Vec<String> = labels.iter().map(usize::to_string).collect();
        format!("cable outlets {} are numbered 1 to {}", names.join(", "), labels.len())
    })
}

/// The angles of a file as its cells have them (°): their ranges, and the step to which they are rounded.
struct Angles {
    min_deg: [f64; 6],
    max_deg: [f64; 6],
    step: StepSearch,
}

impl Default for Angles {
    fn default() -> Self {
        Self { min_deg: [f64::MAX; 6], max_deg: [f64::MIN; 6], step: StepSearch::default() }
    }
}

impl Angles {
    fn add(&mut self, joint: usize, angle_deg: f64) {
        self.min_deg[joint] = self.min_deg[joint].min(angle_deg);
        self.max_deg[joint] = self.max_deg[joint].max(angle_deg);
        self.step.add(angle_deg);
    }

    /// The largest angle, by its size.
    fn largest_deg(&self) -> f64 {
        self.min_deg.iter().chain(&self.max_deg).fold(0.0, |most, angle| angle.abs().max(most))
    }

    /// The largest range of a joint.
    fn spread_deg(&self) -> f64 {
        self.min_deg.iter().zip(&self.max_deg).map(|(min, max)| max - min).fold(0.0, f64::max)
    }
}

/// Checks of units that need no model of the arm; `plausibility` has those that do.
fn check_units(
    reader: &Reader<'_>,
    rows: &[Row],
    angles: &Angles,
    sensor: Sensor,
) -> Result<(), ImportError> {
    let units = |columns: &str, found: String, expected, remedy| {
        let location = Location { column: Some(columns.into()), ..reader.location() };
        Err(ImportError::Units { location, found: found.into(), expected, remedy })
    };
    let (largest_deg, spread_deg) = (angles.largest_deg(), angles.spread_deg());
    // Joints that move, but never beyond ±2π "degrees" in the whole file, are in radians.
    if rows.len() >= 3 && spread_deg > 0.05 && largest_deg <= 2.0 * std::f64::consts::PI + 1e-6 {
        return units(
            "q1 to q6",
            format!("no angle exceeds {largest_deg:.3}: these look like radians"),
            "degrees",
            "convert the angles to degrees, or allow odd units (--allow-odd-units) if the arm really moved so little",
        );
    }
    let Some(spread_mm) = spread(rows) else { return Ok(()) };
    let columns = if sensor == Sensor::Cable { "L" } else { "measured_x to measured_z" };
    // An arm whose joints turn by tens of degrees moves its flange by more than 5 mm.
    if rows.len() >= 3 && spread_deg > 20.0 && spread_mm < 5.0 && magnitude(rows) < 20.0 {
        return units(
            columns,
            format!(
                "the readings span {spread_mm:.4} while joints turn by {spread_deg:.0}°: these look like metres"
            ),
            "millimetres",
            "multiply the readings by 1000, or allow odd units (--allow-odd-units) if the readings really changed so little",
        );
    }
    let readout = Row::readout_mm;
    let largest = rows.iter().filter_map(readout).map(|v| v.amax()).fold(0.0, f64::max);
    if rows.iter().filter_map(readout).count() >= 3 && spread_deg > 20.0 && largest > 0.0 && largest < 10.0 {
        return units(
            "x, y, z",
            format!(
                "no coordinate of the controller's read-out exceeds {largest:.3}: these look like metres"
            ),
            "millimetres",
            "multiply the read-out by 1000, or allow odd units (--allow-odd-units) if the read-out is right",
        );
    }
    Ok(())
}

/// Largest range of any coordinate of the readings (mm).
fn spread(rows: &[Row]) -> Option<f64> {
    let mut low = [f64::MAX; 3];
    let mut high = [f64::MIN; 3];
    for row in rows {
        let values = row.reading.place_mm();
        for k in 0..3 {
            low[k] = low[k].min(values[k]);
            high[k] = high[k].max(values[k]);
        }
    }
    (0..3).map(|k| high[k] - low[k]).reduce(f64::max)
}

fn magnitude(rows: &[Row]) -> f64 {
    rows.iter().map(|r| r.reading.place_mm().amax()).fold(0.0, f64::max)
}
