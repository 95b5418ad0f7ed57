//! A paper's own signed-rank test on its own figures: reproduce the number, then say what it does not show.
//!
//! ukf-vslm-2023 Table X takes nine pairs, three error figures on each of three data sets. RMSE, mean absolute error and
//! maximum of one data set are three views of the same residuals, so there are three pairs, not nine; and with nine
//! pairs of one sign p = 1/512 is the smallest that a one-sided test can give: it says that all nine point one way, not
//! by how much. With three pairs of one sign the smallest one-sided p is 1/8.

use crate::experiment::{SignedRankTable, SignedRankTables};
use crate::statistics::{SignedRank, signed_rank};

/// The tests of one table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableResult {
    /// What was asked for.
    pub table: SignedRankTable,
    /// One test for each method that is not the reference.
    pub tests: Vec<PairTest>,
}

/// The reference against one method.
#[derive(Debug, Clone, PartialEq)]
pub struct PairTest {
    /// Id of the method.
    pub id: String,
    /// The test on method minus reference: positive where the reference is better.
    pub test: SignedRank,
    /// The paper's p.
    pub paper_p: Option<f64>,
}

/// Runs all tests.
pub fn run(tables: &SignedRankTables) -> Vec<TableResult> {
    tables
        .table
        .iter()
        .map(|table| {
            let reference = table.method.iter().find(|m| m.id == tables.reference);
            let own = reference.map_or(&[][..], |m| m.figures.as_slice());
            let tests = table
                .method
                .iter()
                .filter(|m| m.id != tables.reference)
                .map(|m| {
                    // Printed figures are decimal: their differences must tie where the printed ones do.
                    let decimal = |d: f64| (d * 1e6).round() / 1e6;
                    let differences: Vec<f64> =
                        m.figures.iter().zip(own).map(|(m, r)| decimal(m - r)).collect();
                    PairTest { id: m.id.clone(), test: signed_rank(&differences), paper_p: m.paper_p }
                })
                .collect();
            TableResult { table: table.clone(), tests }
        })
        .collect()
}
