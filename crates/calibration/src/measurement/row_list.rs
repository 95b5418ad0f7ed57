//! A list of row numbers for a sentence.

use truegrind_math::sentence::listed;

/// Most numbers that a sentence lists.
const MAX_LISTED: usize = 8;

/// `row 7`, `rows 3, 4 and 7`, or the first few and how many more there are.
pub(crate) fn row_list(numbers: &[usize]) -> String {
    let more = numbers.len().saturating_sub(MAX_LISTED);
    let further = (more > 0).then(|| format!("{more} more"));
    match numbers {
        [] => "no row".to_owned(),
        [one] => format!("row {one}"),
        all => format!("rows {}", listed(all.iter().take(MAX_LISTED).map(usize::to_string).chain(further))),
    }
}
