//! The JSON contract `truegrind.diagnosis/1` counts data rows from 0; reports count as a spreadsheet does.

use std::collections::BTreeMap;

use super::finding::Diagnosis;
use crate::measurement::dataset::Dataset;

impl Diagnosis {
    /// The diagnosis with rows counted from 0 at the first data row of `dataset` in every key with rows but
    /// `rows_in_file`. Sentences are unchanged.
    pub fn with_rows_from_0(mut self, dataset: &Dataset) -> Self {
        let index: BTreeMap<usize, usize> =
            dataset.rows.iter().enumerate().map(|(i, row)| (row.number, i)).collect();
        // An end of an interval can be a skipped row, such as a blank one: then the last row before it.
        let at = |number: &usize| index.range(..=*number).next_back().map_or(0, |(_, i)| *i);
        let first = |number: &usize| index.range(*number..).next().map_or_else(|| at(number), |(_, i)| *i);
        let ends = |rows: [usize; 2]| [first(&rows[0]), at(&rows[1])];
        for finding in &mut self.findings {
            finding.rows_in_file =
                finding.rows.map(|rows| rows.to_vec()).or_else(|| finding.row_list.clone());
            finding.rows = finding.rows.map(ends);
            finding.row_list = finding.row_list.take().map(|list| list.iter().map(at).collect());
            finding.sessions.iter_mut().for_each(|session| session.rows = ends(session.rows));
            for other in &mut finding.alternatives {
                other.rows = other.rows.map(ends);
            }
            finding.members.iter_mut().for_each(|member| member.rows = member.rows.map(ends));
        }
        self.measure_again = self.measure_again.iter().map(at).collect();
        self
    }
}
