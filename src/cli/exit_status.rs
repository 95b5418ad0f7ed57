//! How a verb ended.

/// How a verb ended, short of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ExitStatus {
    /// Everything done.
    Done,
    /// Done, but something was refused or flagged.
    Flagged,
}
