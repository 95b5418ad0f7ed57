//! Printing: results to stdout, messages to stderr.
//!
//! No other module writes to stdout or stderr, so that text from files (names, headers, cells, program text) always passes
//! [`visible`].

use std::fmt::Display;
use std::io::{IsTerminal, Write};

use anyhow::Context;
use truegrind::report::format::visible;

use super::colour;

/// Prints a result. A closed pipe (`| head`) is no error.
///
/// # Errors
/// Stdout cannot be written, for example because the disk is full.
pub(super) fn print_result(text: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let shown = visible::bytes(text.as_ref());
    if colour::is_enabled(&std::io::stdout()) {
        return print(colour::colour_verdicts(&shown).as_bytes());
    }
    print(shown.as_bytes())
}

/// Writes a file to stdout: unchanged, or with control characters made visible on a terminal.
///
/// # Errors
/// As [`print_result`].
pub(super) fn write_stdout(bytes: &[u8]) -> anyhow::Result<()> {
    if std::io::stdout().is_terminal() { print_result(bytes) } else { print(bytes) }
}

fn print(bytes: &[u8]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        done => done.context("stdout cannot be written"),
    }
}

/// Longest message (characters).
const MAX_MESSAGE: usize = 10_000;

/// Prints a message to stderr. Further lines are indented, so that text with a line break from a file cannot pass for a message
/// of its own.
pub(super) fn print_message(text: impl Display) {
    let mut text = text.to_string();
    if let Some((cut, _)) = text.char_indices().nth(MAX_MESSAGE) {
        let more = text[cut..].chars().count();
        text.truncate(cut);
        text += &format!("… ({more} more characters)");
    }
    let text = visible::text(&text).replace('\n', "\n  ");
    let text = if colour::is_enabled(&std::io::stderr()) { colour::colour_prefix(&text) } else { text };
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints formatted lines to stderr; ignores a closed stderr.
pub(super) fn print_message_lines(text: &str) {
    let _ = std::io::stderr().write_all(visible::text(text).as_bytes());
}

/// Width of the terminal in characters; 100 if there is none.
pub(super) fn width() -> usize {
    let stated = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let measured = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    stated.or_else(measured).unwrap_or(100)
}
