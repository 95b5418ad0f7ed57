//! A diagnosis as other programs read it: `truegrind.diagnosis/1` counts data rows from 0, people count as the spreadsheet does.

use std::collections::BTreeMap;

use super::finding::Diagnosis;
use crate::measurement::dataset::Dataset;

impl Diagnosis {
    /// The same with rows counted from 0 at the first data row of `dataset`, in every key that holds rows. Sentences are for
    /// people and stay.
    pub fn counted_from_0(mut self, dataset: &Dataset) -> Self {
        let place: BTreeMap<usize, usize> =
            dataset.rows.iter().enumerate().map(|(i, row)| (row.number, i)).collect();
        // The end of an interval may be a row that was not read, like a blank one: the last one before it.
        let at = |number: &usize| place.range(..=*number).next_back().map_or(0, |(_, i)| *i);
        let first = |number: &usize| place.range(*number..).next().map_or_else(|| at(number), |(_, i)| *i);
        let ends = |rows: [usize; 2]| [first(&rows[0]), at(&rows[1])];
        for finding in &mut self.findings {
            finding.rows = finding.rows.map(ends);
            finding.row_list = finding.row_list.take().map(|list| list.iter().map(at).collect());
            finding.sessions.iter_mut().for_each(|session| session.rows = ends(session.rows));
            for other in &mut finding.alternatives {
                other.rows = other.rows.map(ends);
            }
        }
        self.measure_again = self.measure_again.iter().map(at).collect();
        self
    }
}
