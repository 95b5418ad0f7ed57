//! Tables: columns with unit and precision, cells with missing values.

use super::number::{MISSING, Precision};
use super::status::Status;

/// A table, independent of the format.
///
/// ```
/// use truegrind_report::format::terminal;
/// use truegrind_report::table::Table;
/// let table = Table::of("Deviation", [("before", Some(1.62)), ("LTLM", None)])
///     .text("method", "method", |(method, _)| *method)
///     .number("rmse_mm", "RMSE", "mm", 2, |(_, rmse_mm)| *rmse_mm)
///     .table();
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
    /// Title; may be empty.
    pub title: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows. A short row is filled with missing cells; extra cells are not shown.
    pub rows: Vec<Vec<Cell>>,
    /// Remarks below the table; not in CSV and Parquet.
    pub notes: Vec<String>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name in CSV and JSON, with the unit as suffix: `rmse_mm`. A duplicate key gets a number.
    pub key: String,
    /// Heading.
    pub heading: String,
    /// Unit, if any.
    pub unit: Option<String>,
    /// Type of the column, even if single cells differ.
    pub kind: ColumnKind,
    /// Digits shown.
    pub precision: Precision,
}

/// Stands for the text of the row above.
const AS_ABOVE: &str = "as above";

/// Type of a column. A single cell may differ ("diverged 3/10" among errors); in a typed file it is then missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// Text.
    Text,
    /// Integers.
    Count,
    /// Numbers.
    Number,
}

/// Alignment of the cells of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// Left, for text.
    Left,
    /// Right, for numbers.
    Right,
}

/// One cell.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Cell {
    /// Text.
    Text(String),
    /// A number in the unit of its column; NaN counts as missing.
    Number(f64),
    /// An integer: rows, lines, iterations.
    Count(u64),
    /// A number and its standard uncertainty in the unit of the column; an unknown σ is NaN.
    WithSigma {
        /// The value.
        value: f64,
        /// Its 1σ.
        sigma: f64,
    },
    /// A number that pages show in words: a p-value too small for its digits.
    Worded {
        /// The value, for data files.
        value: f64,
        /// What pages show.
        shown: String,
    },
    /// A status with a text.
    Judged(Status, String),
    /// Missing: printed as `–`, empty in CSV, `null` in JSON.
    Missing,
}

/// A table with one row per item, whose columns come one by one, each with the function that makes its cells.
pub struct Rows<'c, I: IntoIterator> {
    items: I,
    cells: Vec<CellOf<'c, I::Item>>,
    /// Still without rows.
    table: Table,
}

/// Makes the cell of an item in one column.
type CellOf<'c, T> = Box<dyn Fn(&T) -> Cell + 'c>;

impl<'c, I: IntoIterator> Rows<'c, I> {
    /// Adds a column.
    pub fn column<C: Into<Cell>>(mut self, column: Column, cell: impl Fn(&I::Item) -> C + 'c) -> Self {
        self.table.columns.push(column);
        self.cells.push(Box::new(move |item| cell(item).into()));
        self
    }

    /// Adds a column of texts.
    pub fn text<C: Into<Cell>>(self, key: &str, heading: &str, cell: impl Fn(&I::Item) -> C + 'c) -> Self {
        self.column(Column::text(key, heading), cell)
    }

    /// Adds a column of integers.
    pub fn count<C: Into<Cell>>(self, key: &str, heading: &str, cell: impl Fn(&I::Item) -> C + 'c) -> Self {
        self.column(Column::count(key, heading), cell)
    }

    /// Adds a column of numbers with fixed decimals; an empty unit means none.
    pub fn number<C: Into<Cell>>(
        self,
        key: &str,
        heading: &str,
        unit: &str,
        decimals: usize,
        cell: impl Fn(&I::Item) -> C + 'c,
    ) -> Self {
        self.column(Column::number(key, heading, unit, decimals), cell)
    }

    /// Adds a column of numbers with significant digits; for cells with σ, those of σ.
    pub fn significant<C: Into<Cell>>(
        self,
        key: &str,
        heading: &str,
        unit: &str,
        digits: usize,
        cell: impl Fn(&I::Item) -> C + 'c,
    ) -> Self {
        self.column(Column::significant(key, heading, unit, digits), cell)
    }

    /// Adds a remark below the table.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.table.notes.push(note.into());
        self
    }

    /// The table.
    pub fn table(mut self) -> Table {
        let row = |item| self.cells.iter().map(|cell| cell(&item)).collect();
        self.table.rows = self.items.into_iter().map(row).collect();
        self.table
    }
}

impl Table {
    /// An empty table.
    pub fn new(title: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { title: title.into(), columns, rows: Vec::new(), notes: Vec::new() }
    }

    /// A table with one row per item, still without columns.
    pub fn of<'c, I: IntoIterator>(title: impl Into<String>, items: I) -> Rows<'c, I> {
        Rows { items, cells: Vec::new(), table: Self::new(title, Vec::new()) }
    }

    /// Adds a row.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) {
        self.rows.push(row.into_iter().collect());
    }

    /// The table with at most `limit` of its first and last rows, dots between them, and a note on the omitted rows. For pages: a
    /// path of 100,000 points belongs in the CSV file.
    pub fn excerpt(&self, limit: usize) -> Table {
        let mut table = self.clone();
        let left_out = self.rows.len().saturating_sub(limit);
        if left_out > 0 {
            let head = limit - limit / 3;
            let dots = vec![Cell::Text("⋮".to_owned()); self.columns.len()];
            table.rows.splice(head..head + left_out, [dots]);
            table.notes.push(format!(
                "{left_out} of {} rows, between the first {head} and the last {}, are omitted here.",
                self.rows.len(),
                limit / 3
            ));
        }
        table
    }

    /// Index of the column with a key.
    pub(super) fn column_index(&self, key: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.key == key)
    }

    /// Removes a column.
    pub(super) fn remove_column(&mut self, index: usize) {
        self.columns.remove(index);
        self.rows.iter_mut().for_each(|row| drop(row.remove(index)));
    }

    /// Replaces a text that is the same as in the row above, so that a reason that many rows share is read once. For pages only.
    pub(super) fn shorten_repeated(&mut self, key: &str) {
        let Some(column) = self.column_index(key) else { return };
        for row in (1..self.rows.len()).rev() {
            if let (Cell::Text(above), Cell::Text(here)) =
                (&self.rows[row - 1][column], &self.rows[row][column])
                && above == here
                && here.chars().count() > AS_ABOVE.len()
            {
                self.rows[row][column] = AS_ABOVE.into();
            }
        }
    }

    /// Removes the columns without any value.
    pub(super) fn remove_empty_columns(&mut self) {
        for index in (0..self.columns.len()).rev() {
            if self.rows.iter().all(|row| row[index] == Cell::Missing) {
                self.remove_column(index);
            }
        }
    }

    /// The cell; [`Cell::Missing`] beyond the end of a short row.
    pub(super) fn cell(&self, row: usize, column: usize) -> &Cell {
        self.rows.get(row).and_then(|row| row.get(column)).unwrap_or(&Cell::Missing)
    }

    /// The cell as shown.
    pub(super) fn shown(&self, row: usize, column: usize) -> String {
        self.cell(row, column).shown(self.columns[column].precision)
    }

    /// The columns of a data file; a column with σ becomes two.
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

/// A column of a data file.
pub(super) struct Field {
    /// Unique key.
    pub(super) key: String,
    /// Key of its σ, if any cell has one: `sigma` for `value`, `sigma_mm` for `value_mm`, `sigma_a_mm` for `a_mm`.
    pub(super) sigma_key: Option<String>,
}

impl Column {
    /// A text column.
    pub fn text(key: impl Into<String>, heading: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            heading: heading.into(),
            unit: None,
            kind: ColumnKind::Text,
            precision: Precision::Significant(4),
        }
    }

    /// A column of integers.
    pub fn count(key: impl Into<String>, heading: impl Into<String>) -> Self {
        Self { kind: ColumnKind::Count, ..Self::text(key, heading) }
    }

    /// A column of numbers with fixed decimals; an empty unit means none.
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

    /// A column of numbers with significant digits; for cells with σ, those of σ.
    pub fn significant(
        key: impl Into<String>,
        heading: impl Into<String>,
        unit: impl Into<String>,
        digits: usize,
    ) -> Self {
        Self { precision: Precision::Significant(digits), ..Self::number(key, heading, unit, 0) }
    }

    /// Alignment of its cells.
    pub fn alignment(&self) -> Alignment {
        if self.kind == ColumnKind::Text { Alignment::Left } else { Alignment::Right }
    }

    /// Heading with its unit, `RMSE [mm]`.
    pub fn label(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} [{unit}]", self.heading),
            None => self.heading.clone(),
        }
    }
}

impl Cell {
    /// A number and its σ, if known.
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
            Cell::Worded { shown, .. } => shown.clone(),
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
