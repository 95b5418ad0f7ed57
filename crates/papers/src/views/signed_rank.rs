//! Report of a paper's repeated signed-rank tests.

use serde_json::{Value, json};

use super::words;
use crate::signed_rank::{PairTest, TableResult};
use crate::statistics::holm;
use crate::verdict::LEVEL;
use truegrind_report::document::{Document, PageVerdict};
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Column, Table};

/// Terminal and page.
pub(super) fn summary(page: &mut Document, tables: &[TableResult]) {
    page.push(verdict(tables));
    for table in tables {
        page.push(one(table));
    }
}

/// Tolerance for a printed p value: half a unit of its last digit, whether printed as 0.002 or with four digits.
const REPRODUCED: f64 = 6e-4;

fn is_reproduced(test: &PairTest) -> bool {
    test.paper_p.is_some_and(|p| (p - test.test.one_sided_positive).abs() < REPRODUCED)
}

/// Whether the printed p values are reproduced, and what they show.
fn verdict(tables: &[TableResult]) -> PageVerdict {
    let all = || tables.iter().flat_map(|t| &t.tests).filter(|t| t.paper_p.is_some());
    let reproduced = all().filter(|t| is_reproduced(t)).count();
    let mut reasons: Vec<String> = Vec::new();
    for table in tables {
        let below = |p: fn(&PairTest) -> f64| table.tests.iter().filter(|t| p(t) < LEVEL).count();
        reasons.push(format!(
            "{}: {} of {} comparisons are below 5 % one-sided as printed, {} two-sided, {} two-sided after Holm's correction. {}",
            short(table),
            below(|t| t.test.one_sided_positive),
            table.tests.len(),
            below(|t| t.test.two_sided),
            holm(&table.tests.iter().map(|t| t.test.two_sided).collect::<Vec<_>>())
                .iter()
                .filter(|p| **p < LEVEL)
                .count(),
            table.table.dependence
        ));
    }
    let status = if reproduced == all().count() { Status::Good } else { Status::Warning };
    PageVerdict::new(
        status,
        format!(
            "{reproduced} of {} printed p values are reproduced; they are weaker evidence than they seem",
            all().count()
        ),
        reasons,
    )
}

fn short(table: &TableResult) -> String {
    table.table.title.split(':').next().unwrap_or_default().to_owned()
}

fn columns() -> Vec<Column> {
    vec![
        Column::text("table", "Table"),
        Column::text("against", "against"),
        Column::count("pairs", "pairs"),
        Column::number("positive", "R+", "", 1),
        Column::number("negative", "R−", "", 1),
        Column::number("p_one_sided", "p, one-sided", "", 4),
        Column::number("paper_p", "paper", "", 4),
        Column::number("p_two_sided", "p, two-sided", "", 4),
    ]
}

fn push(table: &mut Table, of: &TableResult) {
    let short = short(of);
    for test in &of.tests {
        table.push([
            Cell::Text(short.clone()),
            test.id.as_str().into(),
            test.test.pairs.into(),
            test.test.positive.into(),
            test.test.negative.into(),
            test.test.one_sided_positive.into(),
            test.paper_p.into(),
            test.test.two_sided.into(),
        ]);
    }
}

fn one(of: &TableResult) -> Table {
    let mut table = Table::new(of.table.title.clone(), columns());
    push(&mut table, of);
    // All rows belong to this table, so its column is not needed.
    table.columns.remove(0);
    table.rows.iter_mut().for_each(|row| drop(row.remove(0)));
    table.notes = vec![format!(
        "The smallest one-sided p that {} pairs can give is {}.",
        of.table.rows.len(),
        words::p(0.5f64.powi(of.table.rows.len() as i32))
    )];
    table
}

/// All tests in one table.
pub(super) fn table(tables: &[TableResult]) -> Table {
    let mut out = Table::new("Signed-rank tests", columns());
    tables.iter().for_each(|table| push(&mut out, table));
    out
}

/// Everything.
pub(super) fn json(tables: &[TableResult]) -> Value {
    tables
        .iter()
        .map(|table| {
            let tests: Vec<Value> = table
                .tests
                .iter()
                .map(|t| json!({ "against": t.id, "test": t.test, "paper_p": t.paper_p }))
                .collect();
            json!({ "title": table.table.title, "rows": table.table.rows, "note": table.table.dependence, "tests": tests })
        })
        .collect()
}
