//! Text of others, made harmless for whoever looks at it.
//!
//! File names, headers, cells, names of tools and lines of programs come from outside. Some characters do not show but act: on a
//! terminal they move the cursor, colour, clear or answer; in any viewer they turn the direction of reading round or
//! take no room at all. Each is written as what it is, `\x1b` or `\u{202e}`, so that it is seen and does nothing.

use std::borrow::Cow;
use std::fmt::Write;

/// Text as it may be shown: every character that acts without showing is spelled out. Line feeds and tabs stay, and so
/// does a carriage return before a line feed.
///
/// ```
/// use truegrind_report::format::visible;
/// assert_eq!(visible::text("q1\u{1b}[2J"), r"q1\x1b[2J");
/// assert_eq!(visible::text("a\u{202e}b"), r"a\u{202e}b");
/// ```
pub fn text(text: &str) -> Cow<'_, str> {
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        match c {
            '\r' if characters.peek() == Some(&'\n') => shown.push(c),
            c if acts(c) => shown.push_str(&spelled(c)),
            c => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

/// Text on one line: what ends a line is a space, and so is a tab.
pub fn line(text: &str) -> Cow<'_, str> {
    if !text.contains(|c| acts(c) || matches!(c, '\n' | '\t')) {
        return Cow::Borrowed(text);
    }
    let flat = text.replace("\r\n", " ").replace(['\r', '\n', '\t'], " ");
    Cow::Owned(self::text(&flat).into_owned())
}

/// Bytes that are mostly text, such as a program: what is no UTF-8 is spelled out byte by byte.
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

/// Whether a character does something without being seen. Line feeds and tabs do what everybody expects.
pub fn acts(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        // The soft hyphen, marks of direction, what has no width, separators of lines, shorthand and tags.
        '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{feff}' => true,
        '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' => true,
        '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}' => true,
        c => c.is_control(),
    }
}

fn spelled(c: char) -> String {
    match u32::from(c) {
        code @ 0..=0xff => format!("\\x{code:02x}"),
        code => format!("\\u{{{code:x}}}"),
    }
}
