//! Terminal colours for verdicts and message prefixes. They carry no information of their own.

use std::io::IsTerminal;

use truegrind::report::status::Status;

/// Whether a stream gets colour: never if `NO_COLOR` is set, always if `CLICOLOR_FORCE` is set, otherwise on a terminal that is
/// not dumb.
pub(super) fn is_enabled(stream: &impl IsTerminal) -> bool {
    let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let forced = std::env::var_os("CLICOLOR_FORCE").is_some_and(|value| !value.is_empty() && value != "0");
    !set("NO_COLOR") && (forced || stream.is_terminal() && !is_dumb())
}

/// Whether the terminal can only print lines (`TERM=dumb`).
pub(super) fn is_dumb() -> bool {
    std::env::var_os("TERM").is_some_and(|term| term == "dumb")
}

/// Colours the verdicts `[ok]`, `[warning]` and `[failed]`.
pub(super) fn colour_verdicts(text: &str) -> String {
    let mut out = text.to_owned();
    for (status, colour) in [(Status::Good, GREEN), (Status::Warning, YELLOW), (Status::Bad, RED)] {
        let badge = format!("[{}]", status.word());
        out = out.replace(&badge, &format!("{colour}{badge}{PLAIN}"));
    }
    out
}

/// Colours the prefix of a message.
pub(super) fn colour_prefix(text: &str) -> String {
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
