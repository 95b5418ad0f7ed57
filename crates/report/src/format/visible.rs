//! Escapes invisible characters in text from files.
//!
//! File names, headers, cells, tool names and program lines may contain control characters that move the cursor, change colours or
//! clear the terminal, and Unicode characters that reverse the reading direction or have no width. They are shown as `\x1b` or
//! `\u{202e}`.

use std::borrow::Cow;
use std::fmt::Write;

/// Escapes all invisible characters except line feeds, tabs, and a carriage return before a line feed.
///
/// ```
/// use truegrind_report::format::visible;
/// assert_eq!(visible::text("q1\u{1b}[2J"), r"q1\x1b[2J");
/// assert_eq!(visible::text("a\u{202e}b"), r"a\u{202e}b");
/// ```
pub fn text(text: &str) -> Cow<'_, str> {
    if !text.contains(is_invisible) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '\r' if characters.peek() == Some(&'\n') => shown.push(c),
            c if is_invisible(c) => shown.push_str(&escaped(c)),
            c => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

/// Escaped text on one line; line breaks and tabs become spaces.
pub fn line(text: &str) -> Cow<'_, str> {
    if !text.contains(|c| is_invisible(c) || matches!(c, '\n' | '\t')) {
        return Cow::Borrowed(text);
    }
    let flat = text.replace("\r\n", " ").replace(['\r', '\n', '\t'], " ");
    Cow::Owned(self::text(&flat).into_owned())
}

/// Escaped text of bytes such as a program; bytes that are not UTF-8 are escaped as `\xff`.
pub fn bytes(bytes: &[u8]) -> Cow<'_, str> {
    if let Ok(whole) = std::str::from_utf8(bytes) {
        return text(whole);
    }
    let mut shown = String::with_capacity(bytes.len() + 16);
    for part in bytes.utf8_chunks() {
        shown.push_str(&text(part.valid()));
        for byte in part.invalid() {
            // Writing to a string cannot fail.
            let _ = write!(shown, "\\x{byte:02x}");
        }
    }
    Cow::Owned(shown)
}

/// Whether a character is invisible and has an effect. Line feeds and tabs are not escaped.
pub fn is_invisible(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        // Soft hyphen, direction marks, zero-width characters, line separators, shorthand and tags.
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{feff}' => true,
        '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' => true,
        '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}' => true,
        c => c.is_control(),
    }
}

fn escaped(c: char) -> String {
    match u32::from(c) {
        code @ 0..=0xff => format!("\\x{code:02x}"),
        code => format!("\\u{{{code:x}}}"),
    }
}
