//! Names of tools and work offsets, compared without regard to leading zeros and blanks.

/// Whether two names are equal: ignoring case, T08 is T8.
///
/// ```
/// use truegrind_programs::label::same;
///
/// assert!(same("T08", "t8") && same("g54.1 P1", "G54.1P1"));
/// assert!(!same("T8", "T80"));
/// ```
pub fn same(one: &str, other: &str) -> bool {
    plain(one) == plain(other)
}

/// The canonical form: upper case without blanks, the number without leading zeros.
pub fn plain(name: &str) -> String {
    let name: String = name.split_whitespace().collect::<String>().to_ascii_uppercase();
    match name.strip_prefix('T') {
        Some(digits) if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()) => {
            let number = digits.trim_start_matches('0');
            format!("T{}", if number.is_empty() { "0" } else { number })
        }
        _ => name,
    }
}
