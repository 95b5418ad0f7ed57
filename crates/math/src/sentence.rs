//! Parts of sentences.

use std::fmt::Display;

/// "a", "a and b", "a, b and c"; empty for none.
///
/// ```
/// use truegrind_math::sentence::listed;
///
/// assert_eq!(listed([2, 3, 5]), "2, 3 and 5");
/// assert_eq!(listed(["one", "other"]), "one and other");
/// assert_eq!(listed([7]), "7");
/// assert_eq!(listed(Vec::<usize>::new()), "");
/// ```
pub fn listed(items: impl IntoIterator<Item = impl Display>) -> String {
    let items: Vec<String> = items.into_iter().map(|item| item.to_string()).collect();
    match items.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// A number of things, in the singular for one.
///
/// ```
/// use truegrind_math::sentence::counted;
///
/// assert_eq!(counted(1, "pose", "poses"), "1 pose");
/// assert_eq!(counted(0, "pose", "poses"), "0 poses");
/// ```
pub fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// With a capital first letter.
///
/// ```
/// use truegrind_math::sentence::capitalised;
///
/// assert_eq!(capitalised("ärmel 3"), "Ärmel 3");
/// assert_eq!(capitalised(""), "");
/// ```
pub fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
