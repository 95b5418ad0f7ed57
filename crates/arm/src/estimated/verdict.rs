//! How a fit is judged, and why.

use serde::{Deserialize, Serialize};
use std::fmt;

/// How a fit is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Judgement {
    /// All stated limits are met.
    Pass,
    /// The fit may not be used.
    Fail,
    /// The data do not show that a correction helps: used only on explicit request.
    Doubtful,
    /// No objection to the fit, and no stated limits to judge it by.
    NotEvaluated,
}

/// Judgement with its reasons.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// The judgement.
    pub status: Judgement,
    /// One sentence each.
    pub reasons: Vec<Reason>,
}

impl Verdict {
    /// Whether a reason is of this kind. A verdict read from a file has [`ReasonKind::Other`] only.
    pub fn has(&self, kind: ReasonKind) -> bool {
        self.reasons.iter().any(|reason| reason.kind == kind)
    }

    /// The sentences.
    pub fn sentences(&self) -> Vec<&str> {
        self.reasons.iter().map(|reason| reason.text.as_str()).collect()
    }
}

/// What a reason is about, where more than its sentence depends on it: the headline of a report, or which reasons it repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReasonKind {
    /// The fit converged.
    Converged,
    /// No limits of the held-out error were stated.
    NoLimits,
    /// Repeated poses show more than noise: what was measured moved.
    MoreThanNoise,
    /// The poses do not show the place of the target.
    TargetNotShown,
    /// Anything else, and every reason read from a file.
    #[default]
    Other,
}

/// A reason for or against a model. Files contain its sentence only.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct Reason {
    /// What it is about.
    pub kind: ReasonKind,
    /// The sentence.
    pub text: String,
}

impl Reason {
    /// A reason of a kind.
    pub fn new(kind: ReasonKind, text: impl Into<String>) -> Self {
        Self { kind, text: text.into() }
    }
}

impl From<String> for Reason {
    fn from(text: String) -> Self {
        Self::new(ReasonKind::Other, text)
    }
}

impl From<&str> for Reason {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<Reason> for String {
    fn from(reason: Reason) -> Self {
        reason.text
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}
