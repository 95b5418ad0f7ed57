//! All that is printed: results on stdout, talk on stderr.
//!
//! Nothing else in the program writes to stdout or stderr, so that what comes from files (names, headers, cells, words of
//! programs) passes [`visible`] on its way to a terminal or a log.

use std::fmt::Display;
use std::io::{IsTerminal, Write};

use anyhow::Context;
use truegrind::report::format::visible;

use super::colour;

/// Prints a result. A reader that has seen enough (`| head`) is no fault.
///
/// # Errors
/// Where stdout cannot be written, such as to a full disk.
pub(super) fn say(text: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let shown = visible::bytes(text.as_ref());
    if colour::on(&std::io::stdout()) {
        return print(colour::judged(&shown).as_bytes());
    }
    print(shown.as_bytes())
}

/// Hands a file over to stdout: byte by byte as it is, or made visible where somebody looks at it.
///
/// # Errors
/// As [`say`].
pub(super) fn hand_over(bytes: &[u8]) -> anyhow::Result<()> {
    if std::io::stdout().is_terminal() { say(bytes) } else { print(bytes) }
}

fn print(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout cannot be written"),
    }
}

/// Characters of one message; more is not read by anybody.
const MOST_TOLD: usize = 10_000;

/// Tells something on stderr. It begins at the margin and goes on indented, so that no name or cell with an end of line in it
/// passes for a message of its own.
pub(super) fn tell(text: impl Display) {
    let mut text = text.to_string();
    // A file of a megabyte without a line feed is no message.
    if let Some((cut, _)) = text.char_indices().nth(MOST_TOLD) {
        let more = text[cut..].chars().count();
        text.truncate(cut);
        text += &format!("… ({more} more characters)");
    }
    let text = visible::text(&text).replace('\n', "\n  ");
    let text = if colour::on(&std::io::stderr()) { colour::message(&text) } else { text };
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Lines for stderr that have their form already. Nobody reads them where it is closed.
pub(super) fn tell_lines(text: &str) {
    let _ = std::io::stderr().write_all(visible::text(text).as_bytes());
}

/// Columns of the terminal, 100 where there is none.
pub(super) fn width() -> usize {
    let stated = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let seen = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    stated.or_else(seen).unwrap_or(100)
}
