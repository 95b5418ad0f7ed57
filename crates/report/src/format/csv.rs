//! CSV according to RFC 4180: comma, CRLF, quotes where needed, one header row of column keys.
//!
//! Numbers are bit-exact. A column with σ becomes two. A missing cell is empty. Titles and notes are omitted, since RFC 4180 has no
//! comments.
//!
//! Text may come from foreign files. Invisible control characters are escaped ([`visible`]), and text that a spreadsheet would
//! interpret as a formula (starting with `=`, `+`, `-`, `@`, tab or carriage return, and not a number) is prefixed with an
//! apostrophe.

use super::visible;
use crate::number::exact;
use crate::table::{Cell, Table};

/// The table as CSV.
///
/// ```
/// use truegrind_report::format::csv;
/// use truegrind_report::table::{Cell, Column, Table};
///
/// let mut table = Table::new("", vec![Column::text("name", "name"), Column::number("rmse_mm", "RMSE", "mm", 2)]);
/// table.push(["p10, p20".into(), 0.125.into()]);
/// table.push(["p30".into(), Cell::Missing]);
/// // All digits, and an empty cell for a missing value.
/// assert_eq!(csv::table(&table), "name,rmse_mm\r\n\"p10, p20\",0.125\r\np30,\r\n");
/// ```
pub fn table(table: &Table) -> String {
    let fields = table.fields();
    let header: Vec<String> = fields
        .iter()
        .flat_map(|field| std::iter::once(&field.key).chain(&field.sigma_key))
        .map(|key| words(key))
        .collect();
    let mut text = line(&header);
    for row in 0..table.rows.len() {
        let mut cells = Vec::with_capacity(header.len());
        for (column, field) in fields.iter().enumerate() {
            let cell = table.cell(row, column);
            cells.push(value(cell));
            if field.sigma_key.is_some() {
                cells.push(match cell {
                    Cell::WithSigma { sigma, .. } => number(*sigma),
                    _ => String::new(),
                });
            }
        }
        text.push_str(&line(&cells));
    }
    text
}

fn value(cell: &Cell) -> String {
    match cell {
        Cell::Text(text) => words(text),
        Cell::Number(value) | Cell::Worded { value, .. } | Cell::WithSigma { value, .. } => number(*value),
        Cell::Count(count) => count.to_string(),
        Cell::Judged(status, text) if text.is_empty() => status.word().to_owned(),
        Cell::Judged(_, text) => words(text),
        Cell::Missing => String::new(),
    }
}

fn words(text: &str) -> String {
    let formula = text.starts_with(['=', '+', '-', '@', '\t', '\r'])
        && text.chars().nth(1).is_some()
        && text.parse::<f64>().is_err();
    let mark = if formula { "'" } else { "" };
    // Line breaks are kept inside quotes.
    let shown: Vec<_> = text.split('\r').map(visible::text).collect();
    mark.to_owned() + &shown.join("\r")
}

fn number(value: f64) -> String {
    if value.is_nan() { String::new() } else { exact(value) }
}

fn line<S: AsRef<str>>(cells: &[S]) -> String {
    // A single empty cell would be an empty line, which readers skip.
    if let [cell] = cells
        && cell.as_ref().is_empty()
    {
        return "\"\"\r\n".to_owned();
    }
    let quoted: Vec<String> = cells.iter().map(|cell| quote(cell.as_ref())).collect();
    quoted.join(",") + "\r\n"
}

fn quote(cell: &str) -> String {
    if cell.contains([',', '"', '\r', '\n']) || cell.starts_with(' ') || cell.ends_with(' ') {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}
