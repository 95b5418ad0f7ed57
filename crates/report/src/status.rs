//! How a result is judged. Always shown with a sign and a word, so that nothing hangs on colour.

/// A judgement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// As it should be.
    Good,
    /// Usable, with a reservation that is stated.
    Warning,
    /// Not to be used, refused or failed.
    Bad,
    /// Not judged: no limit was stated, or there is nothing to judge by.
    NotEvaluated,
}

impl Status {
    /// The word: `ok`, `warning`, `failed`, `not evaluated`.
    pub fn word(self) -> &'static str {
        match self {
            Status::Good => "ok",
            Status::Warning => "warning",
            Status::Bad => "failed",
            Status::NotEvaluated => "not evaluated",
        }
    }

    /// The sign: one character, and for the warning the selector that asks for text instead of an emoji.
    pub fn sign(self) -> &'static str {
        match self {
            Status::Good => "✓",
            Status::Warning => "⚠\u{fe0e}",
            Status::Bad => "✗",
            Status::NotEvaluated => "○",
        }
    }

    /// Name for style sheets.
    pub(super) fn class(self) -> &'static str {
        match self {
            Status::Good => "good",
            Status::Warning => "warning",
            Status::Bad => "bad",
            Status::NotEvaluated => "open",
        }
    }
}
