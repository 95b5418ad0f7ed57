//! Decision rule for a largest error, its uncertainty and a tolerance (ISO 14253-1); the same for positions and orientations.

/// Fewest poses for a decision.
pub const MIN_POSES: usize = 100;

/// The decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// The largest error plus the uncertainty is within the tolerance.
    Accepted,
    /// The largest error exceeds the tolerance by more than the uncertainty.
    Refused,
    /// Undecided because of the uncertainty, or because that is unknown.
    Open,
    /// Too few poses, nothing measured, or no tolerance.
    NotEvaluated,
}

/// Source of the sensor's uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertainty {
    /// Stated by the user.
    Stated,
    /// Twice the scatter of repeated poses.
    Repeats,
    /// The same, and larger than what the user stated.
    AboveStated,
    /// Unknown: nothing can be accepted.
    Unknown,
}

impl Decision {
    /// Decides on a largest error with its expanded uncertainty and a tolerance, all in one unit (ISO 14253-1). With an unknown
    /// uncertainty nothing is accepted.
    pub(super) fn of(
        poses: usize,
        largest: f64,
        (uncertainty, source): (f64, Uncertainty),
        tolerance: f64,
    ) -> Self {
        if poses < MIN_POSES || !largest.is_finite() {
            Self::NotEvaluated
        } else if largest + uncertainty <= tolerance {
            if source == Uncertainty::Unknown { Self::Open } else { Self::Accepted }
        } else if largest - uncertainty > tolerance {
            Self::Refused
        } else {
            Self::Open
        }
    }

    /// Combines two required decisions: refused if either is, accepted if both are.
    pub(super) fn and(self, other: Self) -> Self {
        let order = [Self::Refused, Self::NotEvaluated, Self::Open];
        order.into_iter().find(|one| self == *one || other == *one).unwrap_or(Self::Accepted)
    }
}

impl Uncertainty {
    /// The expanded uncertainty (k = 2): as stated or from the standard deviation of repeated readings, whichever is larger; else 0.
    pub(super) fn of(stated: Option<f64>, scatter: Option<f64>) -> (f64, Self) {
        match (stated, scatter) {
            (Some(expanded), Some(sigma)) if 2.0 * sigma > expanded => (2.0 * sigma, Self::AboveStated),
            (Some(expanded), _) => (expanded, Self::Stated),
            (None, Some(sigma)) => (2.0 * sigma, Self::Repeats),
            (None, None) => (0.0, Self::Unknown),
        }
    }
}
