//! A paper's own signed-rank tests.

use serde_json::{Value, json};

use super::words;
use crate::comparison::signed_rank::TableResult;
use crate::report::document::Document;
use crate::report::table::{Cell, Column, Table};

/// Terminal and page.
pub(super) fn summary(page: &mut Document, tables: &[TableResult]) {
    for table in tables {
        page.push(one(table));
    }
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
    let short = of.table.title.split(':').next().unwrap_or_default().to_owned();
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
    table.notes = vec![of.table.dependence.clone()];
    let agree =
        of.tests.iter().filter(|t| t.paper_p.is_some_and(|p| (p - t.test.one_sided_positive).abs() < 6e-4));
    table.notes.push(format!(
        "The paper's p is reproduced for {} of {} comparisons, as a one-sided exact test; the smallest one-sided p that \
         {} pairs can give is {}.",
        agree.count(),
        of.tests.len(),
        of.table.rows.len(),
        words::p(0.5f64.powi(of.table.rows.len() as i32))
    ));
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
