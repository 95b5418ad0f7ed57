//! Variants of a TOML text with one implausible number each.

/// Replacements for each number.
pub const NUMBERS: [&str; 6] = ["nan", "inf", "-inf", "1e308", "1e-308", "-1"];

/// Every variant of a TOML text with one number replaced, with the line and the replacement. Numbers in strings and
/// comments are not replaced.
pub fn each(text: &str) -> impl Iterator<Item = (String, String)> {
    let places = places(text);
    assert!(!places.is_empty());
    places.into_iter().flat_map(move |(from, to)| {
        let line = text[..from].matches('\n').count() + 1;
        NUMBERS.map(move |number| {
            let said = format!("line {line}: {number} for {}", &text[from..to]);
            (said, format!("{}{number}{}", &text[..from], &text[to..]))
        })
    })
}

/// Positions of numbers: after `=`, `[` or `,`, outside strings and comments.
fn places(text: &str) -> Vec<(usize, usize)> {
    let bytes = text.as_bytes();
    let (mut out, mut at, mut before) = (Vec::new(), 0, b'\n');
    while at < bytes.len() {
        let skip = |end: u8, at: usize| bytes[at + 1..].iter().position(|b| *b == end).map_or(0, |n| n + 1);
        match bytes[at] {
            b'#' => at += skip(b'\n', at),
            b'"' => at += skip(b'"', at) + 1,
            b'0'..=b'9' | b'-' | b'+' if matches!(before, b'=' | b'[' | b',') => {
                let number =
                    |b: &u8| b.is_ascii_digit() || matches!(b, b'-' | b'+' | b'.' | b'e' | b'E' | b'_');
                let length = bytes[at..].iter().take_while(|b| number(b)).count();
                out.push((at, at + length));
                at += length;
            }
            _ => at += 1,
        }
        if let Some(b) = bytes.get(at.saturating_sub(1)).filter(|b| !b.is_ascii_whitespace()) {
            before = *b;
        }
    }
    out
}

#[test]
fn numbers_are_found_where_they_stand() {
    let text = "a2 = 1.5 # 3\n\"4\" = \"5\"\n[b6]\nc = [7, -8e1]\n";
    let found: Vec<String> = each(text).step_by(NUMBERS.len()).map(|m| m.0).collect();
    assert_eq!(found, ["line 1: nan for 1.5", "line 4: nan for 7", "line 4: nan for -8e1"]);
}
