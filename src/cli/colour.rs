//! Colour on a terminal: of judgements and of the words that begin a message. Nothing hangs on it, and it is only there where
//! somebody can see it and has not asked for none (`NO_COLOR`, a dumb terminal).

use std::io::IsTerminal;

use truegrind::report::status::Status;

/// Whether a stream gets colour: never where NO_COLOR says something, always where CLICOLOR_FORCE does, else on a terminal
/// that is not dumb.
pub(super) fn on(stream: &impl IsTerminal) -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let forced = std::env::var_os("CLICOLOR_FORCE").is_some_and(|value| !value.is_empty() && value != "0");
    !set("NO_COLOR") && (forced || stream.is_terminal() && !dumb())
}

/// Whether the terminal knows nothing but lines.
pub(super) fn dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

/// The text with its judgements (`[ok]`, `[warning]`, `[failed]`) in colour.
pub(super) fn judged(text: &str) -> String {
    let mut out = text.to_owned();
    for (status, colour) in [(Status::Good, GREEN), (Status::Warning, YELLOW), (Status::Bad, RED)] {
        let badge = format!("[{}]", status.word());
        out = out.replace(&badge, &format!("{colour}{badge}{PLAIN}"));
    }
    out
}

/// A message with the word that says what it is in colour.
pub(super) fn message(text: &str) -> String {
    for (word, colour) in [("error:", RED), ("failed:", RED), ("note:", CYAN)] {
        if let Some(rest) = text.strip_prefix(word) {
            return format!("{colour}{word}{PLAIN}{rest}");
        }
    }
    text.to_owned()
}

const RED: &str = "\u{1b}[1;31m";
const GREEN: &str = "\u{1b}[32m";
const YELLOW: &str = "\u{1b}[33m";
const CYAN: &str = "\u{1b}[36m";
const PLAIN: &str = "\u{1b}[0m";
