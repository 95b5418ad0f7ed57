//! Repeats a paper's signed-rank test on its printed figures, and states its limits.
//!
//! ukf-vslm-2023 Table X has nine pairs: three error figures on each of three data sets. RMSE, mean absolute error and
//! maximum of one data set come from the same residuals, so only three pairs are independent. With nine pairs the smallest
//! one-sided p is 1/512; it shows that all nine have the same sign, not how large they are. With three pairs it is 1/8.

use crate::experiment::{SignedRankTable, SignedRankTables};
use crate::statistics::{SignedRank, signed_rank};

/// The tests of one table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableResult {
    /// Printed table.
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
    /// p as printed in the paper.
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
                    // Rounded, so that equal differences of printed decimals are ties.
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
