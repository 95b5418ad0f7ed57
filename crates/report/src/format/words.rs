//! Numbers and their units, which are not broken between two lines.

/// Units that follow a number in a sentence.
const UNITS: [&str; 9] = ["%", "mm", "°", "kg", "µm", "ms", "µs", "s", "mm/s"];

/// The text with `glue` in place of the space between a number and its unit, and between ± and its number.
///
/// ```
/// use truegrind_report::format::words::keep_units;
///
/// assert_eq!(keep_units("known to ± 2.9 mm, 1σ", '_'), "known to ±_2.9_mm, 1σ");
/// assert_eq!(keep_units("14 of 14 cuts", '_'), "14 of 14 cuts");
/// ```
pub fn keep_units(text: &str, glue: char) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut words = text.split(' ').peekable();
    while let Some(word) = words.next() {
        kept.push_str(word);
        let Some(next) = words.peek() else { break };
        let bare = next.trim_end_matches([',', ';', '.', ':', ')']);
        let unit = word.ends_with(|c: char| c.is_ascii_digit()) && UNITS.contains(&bare);
        let number = word == "±" && next.starts_with(|c: char| c.is_ascii_digit());
        kept.push(if unit || number { glue } else { ' ' });
    }
    kept
}
