//! A list of row numbers for a sentence.

/// Most numbers that a sentence lists.
const MOST: usize = 8;

/// `row 7`, `rows 3, 4 and 7`, or the first few and how many more there are.
pub(super) fn row_list(numbers: &[usize]) -> String {
    let text: Vec<String> = numbers.iter().take(MOST).map(usize::to_string).collect();
    let more = numbers.len() - text.len();
    match text.as_slice() {
        [] => "no row".to_owned(),
        [one] => format!("row {one}"),
        all if more > 0 => format!("rows {} and {more} more", all.join(", ")),
        [first @ .., last] => format!("rows {} and {last}", first.join(", ")),
    }
}
