//! Status of a result. It is always shown with a sign and a word, so that colour carries no information of its own.

/// Status of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// No reservation.
    Good,
    /// Usable with a stated reservation.
    Warning,
    /// Something was found that someone should look at.
    Found,
    /// Failed or refused; not to be used.
    Bad,
    /// Not judged: no limit was stated, or the data do not suffice.
    NotEvaluated,
}

impl Status {
    /// `ok`, `warning`, `found`, `failed` or `not evaluated`.
    pub fn word(self) -> &'static str {
        match self {
            Status::Good => "ok",
            Status::Warning => "warning",
            Status::Found => "found",
            Status::Bad => "failed",
            Status::NotEvaluated => "not evaluated",
        }
    }

    /// One character; the warning sign is followed by the variation selector for text instead of an emoji.
    pub fn sign(self) -> &'static str {
        match self {
            Status::Good => "✓",
            Status::Warning => "⚠\u{fe0e}",
            Status::Found => "●",
            Status::Bad => "✗",
            Status::NotEvaluated => "○",
        }
    }

    /// CSS class.
    pub(super) fn class(self) -> &'static str {
        match self {
            Status::Good => "good",
            Status::Warning => "warning",
            Status::Found => "found",
            Status::Bad => "bad",
            Status::NotEvaluated => "open",
        }
    }
}
