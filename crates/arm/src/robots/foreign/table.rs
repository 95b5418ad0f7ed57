//! Tables of Denavit–Hartenberg parameters as CSV: standard or modified (Craig), which the table itself says.
//!
//! One row for each joint, from the base on. Columns by name, in any order: `convention` (`standard` or `modified`), `theta_deg`,
//! `d_mm`, `a_mm`, `alpha_deg`, or in `_rad` and `_m`; where known `min_deg`, `max_deg`, `speed_deg_s`; and `q1` to `q6`, how far
//! the row's link turns for a turn of each joint of the controller, where that is more than one for one (the sign of a joint, or a
//! joint 3 that is measured relative to the ground: 1 under its own and −1 under `q2`).
//!
//! Standard: T = Rz(theta) Tz(d) Tx(a) Rx(alpha). Modified: T = Rx(alpha) Tx(a) Rz(theta) Tz(d), with alpha and a of the link
//! before; Craig, Introduction to Robotics, eq. 3.6.

use nalgebra::{Matrix6, UnitQuaternion, Vector3};

use super::chain::{ForeignArm, Step, about_z};
use super::common::{foreign_error, maker_of};
use crate::bounds;
use crate::robots::error::RobotError;
use truegrind_math::se3::Pose;

const NAMES: &str = "convention, theta_deg, d_mm, a_mm, alpha_deg (or _rad and _m)";

struct Table<'a> {
    file: &'a str,
    header: Vec<&'a str>,
    /// Line of the file and cells.
    rows: Vec<(usize, Vec<&'a str>)>,
    decimal_comma: bool,
}

impl<'a> Table<'a> {
    fn of(text: &'a str, file: &'a str) -> Result<Self, RobotError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text
            .lines()
            .enumerate()
            .map(|(k, line)| (k + 1, line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let (_, first) = lines.next().ok_or_else(|| {
            foreign_error(
                file,
                "table",
                "nothing",
                "a header line and six rows",
                "the columns are convention, theta_deg, d_mm, a_mm, alpha_deg",
            )
        })?;
        let separator = [';', '\t'].into_iter().find(|c| first.contains(*c)).unwrap_or(',');
        let cells = |line: &'a str| line.split(separator).map(str::trim).collect::<Vec<_>>();
        let table = Self {
            file,
            header: cells(first),
            rows: lines.map(|(number, line)| (number, cells(line))).collect(),
            decimal_comma: separator != ',',
        };
        if table.rows.len() != 6 {
            return Err(foreign_error(
                file,
                "table",
                format!("{} rows", table.rows.len()),
                "six, one for each joint from the base on",
                "truegrind supports arms with six rotary axes; a fixed flange is not a row: add it to d and theta of the last row",
            ));
        }
        let width = table.header.len();
        if let Some((line, cells)) = table.rows.iter().find(|(_, cells)| cells.len() > width) {
            return Err(foreign_error(
                file,
                format!("line {line}"),
                format!("{} cells under a header of {width}", cells.len()),
                "as many as the header has",
                "decimal commas need semicolons between the columns",
            ));
        }
        Ok(table)
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|cell| cell.eq_ignore_ascii_case(name))
    }

    fn cell(&self, row: usize, column: usize) -> &'a str {
        self.rows[row].1.get(column).copied().unwrap_or_default()
    }

    fn location(&self, row: usize, column: usize) -> String {
        format!("line {}, column {}", self.rows[row].0, self.header[column])
    }

    fn number(&self, row: usize, column: usize) -> Result<f64, RobotError> {
        let text = self.cell(row, column);
        let plain = if self.decimal_comma { text.replace(',', ".") } else { text.to_owned() };
        plain.replace('\u{2212}', "-").parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
            let found = if text.is_empty() { "an empty cell".to_owned() } else { format!("`{text}`") };
            foreign_error(self.file, self.location(row, column), found, "a finite number", "correct the cell")
        })
    }

    /// Six numbers under the first of some names that is there, each in its unit.
    fn numbers(&self, names: &[(&str, f64)]) -> Result<Option<[f64; 6]>, RobotError> {
        let mut out = [0.0; 6];
        let Some((column, scale)) = names.iter().find_map(|(name, scale)| Some((self.column(name)?, *scale)))
        else {
            return Ok(None);
        };
        for (row, value) in out.iter_mut().enumerate() {
            *value = self.number(row, column)? * scale;
        }
        Ok(Some(out))
    }

    /// An angle in degrees or radians, whichever its column says; refused where it is plainly the other.
    fn angles(&self, in_degrees: &str, in_radians: &str) -> Result<[f64; 6], RobotError> {
        use std::f64::consts::{FRAC_PI_2, TAU};
        let values = self.needed(&[(in_degrees, 1.0), (in_radians, 1.0)])?;
        let shown = || format!("{values:?}");
        let quarter =
            |v: &f64| *v != 0.0 && ((v / FRAC_PI_2).round() * FRAC_PI_2 - v).abs() < 0.01 && v.round() != *v;
        if self.column(in_degrees).is_some() {
            if values.iter().all(|v| v.abs() < TAU + 0.01) && values.iter().any(quarter) {
                return Err(foreign_error(
                    self.file,
                    format!("column {in_degrees}"),
                    shown(),
                    "degrees",
                    "these look like radians: name the column after them",
                ));
            }
            return Ok(values.map(f64::to_radians));
        }
        if values.iter().any(|v| v.abs() > TAU + 0.01) {
            return Err(foreign_error(
                self.file,
                format!("column {in_radians}"),
                shown(),
                "radians",
                "these look like degrees: name the column after them",
            ));
        }
        Ok(values)
    }

    /// A length in millimetres or metres, whichever its column says; refused where metres are plainly millimetres. (Links of a calibrated
    /// table may lead hundreds of metres away, but not all of them do.)
    fn lengths(&self, in_mm: &str, in_metres: &str) -> Result<[f64; 6], RobotError> {
        let lengths = self.needed(&[(in_mm, 1.0), (in_metres, 1000.0)])?;
        let mut stated = lengths.iter().filter(|length| **length != 0.0).peekable();
        if self.column(in_mm).is_none()
            && stated.peek().is_some()
            && stated.all(|length| !bounds::LENGTH_MM.contains(*length))
        {
            return Err(foreign_error(
                self.file,
                format!("column {in_metres}"),
                format!("{:?}", lengths.map(|mm| mm / 1000.0)),
                "metres",
                "these look like millimetres: name the column after them",
            ));
        }
        Ok(lengths)
    }

    fn needed(&self, names: &[(&str, f64)]) -> Result<[f64; 6], RobotError> {
        self.numbers(names)?.ok_or_else(|| {
            foreign_error(
                self.file,
                format!("column {}", names[0].0),
                format!("the columns {}", self.header.join(", ")),
                NAMES,
                "name the columns so",
            )
        })
    }

    /// Whether the table is Craig's.
    fn modified(&self) -> Result<bool, RobotError> {
        const EXPECTED: &str = "standard or modified, the same in every row";
        let Some(column) = self.column("convention") else {
            return Err(foreign_error(
                self.file,
                "column convention",
                format!("the columns {}", self.header.join(", ")),
                EXPECTED,
                "the two look alike and are different arms: standard where T = Rz(theta) Tz(d) Tx(a) Rx(alpha), modified \
                 (Craig) where T = Rx(alpha) Tx(a) Rz(theta) Tz(d)",
            ));
        };
        let first = self.cell(0, column).to_ascii_lowercase();
        for row in 1..6 {
            if !self.cell(row, column).eq_ignore_ascii_case(&first) {
                let found = format!("`{}`, and `{first}` above", self.cell(row, column));
                return Err(foreign_error(
                    self.file,
                    self.location(row, column),
                    found,
                    EXPECTED,
                    "a table is of one convention",
                ));
            }
        }
        match first.as_str() {
            "standard" => Ok(false),
            "modified" => Ok(true),
            other => Err(foreign_error(
                self.file,
                self.location(0, column),
                format!("`{other}`"),
                EXPECTED,
                "write one of the two",
            )),
        }
    }

    /// Turns of the links for turns of the controller's joints.
    fn joint_map(&self) -> Result<Option<Matrix6<f64>>, RobotError> {
        let mut map = Matrix6::identity();
        let mut stated = false;
        for j in 0..6 {
            let names = [format!("q{}", j + 1), format!("J{}", j + 1)];
            let Some(column) = names.iter().find_map(|name| self.column(name)) else { continue };
            stated = true;
            for i in 0..6 {
                map[(i, j)] = if self.cell(i, column).is_empty() { 0.0 } else { self.number(i, column)? };
            }
        }
        Ok(stated.then_some(map))
    }
}

/// The arm of a table.
pub(super) fn read(text: &str, file: &str) -> Result<ForeignArm, RobotError> {
    let table = Table::of(text, file)?;
    let degree = 1.0_f64.to_radians();
    let modified = table.modified()?;
    let theta = table.angles("theta_deg", "theta_rad")?;
    let alpha = table.angles("alpha_deg", "alpha_rad")?;
    let d = table.lengths("d_mm", "d_m")?;
    let a = table.lengths("a_mm", "a_m")?;
    let low = table.numbers(&[("min_deg", 1.0), ("min_rad", 1.0 / degree)])?;
    let high = table.numbers(&[("max_deg", 1.0), ("max_rad", 1.0 / degree)])?;
    let (maker, dialect) = {
        let (dialect, maker) = maker_of(file);
        (maker.to_owned(), dialect)
    };
    let (steps, after) = steps(modified, &theta, &d, &a, &alpha);
    let word = if modified { "modified (Craig)" } else { "standard" };
    Ok(ForeignArm {
        steps,
        after,
        gravity: -Vector3::z(),
        limits_deg: low.zip(high).map(|(low, high)| std::array::from_fn(|i| [low[i], high[i]])),
        speed_deg_s: table.numbers(&[("speed_deg_s", 1.0), ("speed_rad_s", 1.0 / degree)])?,
        joint_map: table.joint_map()?,
        masses: None,
        maker,
        designation: String::new(),
        dialect,
        source: format!("{file}, {word} table of link parameters"),
        visuals: Vec::new(),
        notes: vec![format!("the table is read as {word}")],
    })
}

/// A table as joints about z with fixed transforms between them.
pub(super) fn steps(
    modified: bool,
    theta: &[f64; 6],
    d: &[f64; 6],
    a: &[f64; 6],
    alpha: &[f64; 6],
) -> ([Step; 6], Pose) {
    let screw_z = |i: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), theta[i]);
        Pose::from_parts(Vector3::new(0.0, 0.0, d[i]).into(), turn)
    };
    let screw_x = |i: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha[i]);
        Pose::from_parts(Vector3::new(a[i], 0.0, 0.0).into(), turn)
    };
    // A joint turns about the z that its screw is along, so its own turn commutes with it.
    if modified {
        let steps = std::array::from_fn(|i| about_z(screw_x(i) * screw_z(i)));
        return (steps, Pose::identity());
    }
    let steps =
        std::array::from_fn(|i| about_z(if i == 0 { screw_z(0) } else { screw_x(i - 1) * screw_z(i) }));
    (steps, screw_x(5))
}
