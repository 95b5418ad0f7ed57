//! Tables: columns that know their unit and precision, cells that know what is absent.

use super::number::{MISSING, Precision};
use super::status::Status;

/// A table, in no format yet.
///
/// ```
/// use truegrind_report::table::{Cell, Column, Table};
/// use truegrind_report::format::terminal;
/// let mut table = Table::new(
///     "Deviation",
///     vec![Column::text("method", "method"), Column::number("rmse_mm", "RMSE", "mm", 2)],
/// );
/// table.push(["before".into(), 1.62.into()]);
/// table.push(["LTLM".into(), Cell::Missing]);
/// assert_eq!(terminal::table(&table, 80), "\
/// Deviation
/// method  RMSE [mm]
/// ──────  ─────────
/// before       1.62
/// LTLM            –
/// ");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What the table shows; may be empty.
    pub title: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows. Cells that a row has too few are missing; those it has too many are not shown.
    pub rows: Vec<Vec<Cell>>,
    /// Remarks under the table. Files for programs do not carry them.
    pub notes: Vec<String>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in CSV and JSON, with the unit as suffix: `rmse_mm`. A key that an earlier column already has gets a number.
    pub key: String,
    /// Heading for people.
    pub heading: String,
    /// Unit, where there is one.
    pub unit: Option<String>,
    /// What stands in it, whatever a single cell says.
    pub kind: ColumnKind,
    /// Digits shown to people.
    pub precision: Precision,
}

/// What stands in a column. A single cell may say something else to people ("diverged 3/10" among errors); in a file with
/// types, such a cell of a column of numbers is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// Words.
    Text,
    /// Whole numbers.
    Count,
    /// Numbers.
    Number,
}

/// Side on which the cells of a column stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// Left, for words.
    Left,
    /// Right, for numbers.
    Right,
}

/// One cell.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number in the unit of its column. NaN counts as missing.
    Number(f64),
    /// A whole number: rows, lines, iterations.
    Count(u64),
    /// A number and its standard uncertainty, both in the unit of the column; σ may be NaN where it is not known.
    WithSigma {
        /// The value.
        value: f64,
        /// Its 1σ.
        sigma: f64,
    },
    /// A judgement and what it is about.
    Judged(Status, String),
    /// Nothing. Printed as `–`; empty in CSV, `null` in JSON.
    Missing,
}

impl Table {
    /// A table without rows and notes.
    pub fn new(title: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { title: title.into(), columns, rows: Vec::new(), notes: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        self.rows.push(row.into_iter().collect());
    }

    /// The table with at most `limit` rows, the first and the last ones, dots between them and a note that says how many
    /// are left out. For pages: a path of 100,000 points belongs in the CSV file.
    pub fn excerpt(&self, limit: usize) -> Table {
        let mut table = self.clone();
        let left_out = self.rows.len().saturating_sub(limit);
        if left_out > 0 {
            let head = limit - limit / 3;
            let dots = vec![Cell::Text("⋮".to_owned()); self.columns.len()];
            table.rows.splice(head..head + left_out, [dots]);
            table.notes.push(format!(
                "{left_out} of {} rows are left out here, between the first {head} and the last {}.",
                self.rows.len(),
                limit / 3
            ));
        }
        table
    }

    /// The cell, [`Cell::Missing`] where the row is too short.
    pub(super) fn cell(&self, row: usize, column: usize) -> &Cell {
        self.rows.get(row).and_then(|row| row.get(column)).unwrap_or(&Cell::Missing)
    }

    /// What people read in a cell.
    pub(super) fn shown(&self, row: usize, column: usize) -> String {
        self.cell(row, column).shown(self.columns[column].precision)
    }

    /// The columns of a file for programs: key, and whether the column holds a σ beside its value.
    pub(super) fn fields(&self) -> Vec<Field> {
        let mut fields = Vec::new();
        let mut used = std::collections::BTreeSet::new();
        let mut unique = |key: String| {
            let mut candidate = key.clone();
            let mut number = 2;
            while !used.insert(candidate.clone()) {
                candidate = format!("{key}_{number}");
                number += 1;
            }
            candidate
        };
        for (index, column) in self.columns.iter().enumerate() {
            let with_sigma =
                (0..self.rows.len()).any(|row| matches!(self.cell(row, index), Cell::WithSigma { .. }));
            let key = unique(column.key.clone());
            let sigma_key = with_sigma.then(|| {
                unique(match column.key.strip_prefix("value") {
                    Some(suffix) => format!("sigma{suffix}"),
                    None => format!("sigma_{}", column.key),
                })
            });
            fields.push(Field { key, sigma_key });
        }
        fields
    }
}

/// A column as programs see it.
pub(super) struct Field {
    /// Its key, unique in the table.
    pub(super) key: String,
    /// Key of the σ that belongs to it, where any cell has one: `sigma` for `value`, `sigma_mm` for `value_mm`,
    /// `sigma_a_mm` for `a_mm`.
    pub(super) sigma_key: Option<String>,
}

impl Column {
    /// A column of words.
    pub fn text(key: impl Into<String>, heading: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            heading: heading.into(),
            unit: None,
            kind: ColumnKind::Text,
            precision: Precision::Significant(4),
        }
    }

    /// A column of whole numbers.
    pub fn count(key: impl Into<String>, heading: impl Into<String>) -> Self {
        Self { kind: ColumnKind::Count, ..Self::text(key, heading) }
    }

    /// A column of numbers with fixed decimals. An empty unit is no unit.
    pub fn number(
        key: impl Into<String>,
        heading: impl Into<String>,
        unit: impl Into<String>,
        decimals: usize,
    ) -> Self {
        let unit = Some(unit.into()).filter(|unit| !unit.is_empty());
        Self {
            kind: ColumnKind::Number,
            unit,
            precision: Precision::Decimals(decimals),
            ..Self::text(key, heading)
        }
    }

    /// A column of numbers with so many significant digits; with σ in its cells, that many of σ.
    pub fn significant(
        key: impl Into<String>,
        heading: impl Into<String>,
        unit: impl Into<String>,
        digits: usize,
    ) -> Self {
        Self { precision: Precision::Significant(digits), ..Self::number(key, heading, unit, 0) }
    }

    /// Side on which its cells stand.
    pub fn alignment(&self) -> Alignment {
        if self.kind == ColumnKind::Text { Alignment::Left } else { Alignment::Right }
    }

    /// Heading with its unit, `RMSE (mm)`.
    pub fn label(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} [{unit}]", self.heading),
            None => self.heading.clone(),
        }
    }
}

impl Cell {
    /// A number and, where it is known, its σ.
    pub fn with_sigma(value: f64, sigma: Option<f64>) -> Self {
        match sigma {
            Some(sigma) => Cell::WithSigma { value, sigma },
            None => Cell::Number(value),
        }
    }

    pub(super) fn shown(&self, precision: Precision) -> String {
        match self {
            Cell::Text(text) => text.clone(),
            Cell::Number(value) => precision.format(*value),
            Cell::Count(count) => count.to_string(),
            Cell::WithSigma { value, .. } if value.is_nan() => MISSING.to_owned(),
            Cell::WithSigma { value, sigma } => precision.format_with_sigma(*value, *sigma),
            Cell::Judged(status, text) if text.is_empty() => format!("{} {}", status.sign(), status.word()),
            Cell::Judged(status, text) => format!("{} {text}", status.sign()),
            Cell::Missing => MISSING.to_owned(),
        }
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Cell::Number(value)
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Cell::Count(count as u64)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Cell::Missing, Into::into)
    }
}
