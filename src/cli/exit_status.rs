//! Exit status of a verb.

/// Exit status of a verb that ended without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExitStatus {
    /// Everything done.
    Done,
    /// Done, but something was refused or flagged.
    Flagged,
}
