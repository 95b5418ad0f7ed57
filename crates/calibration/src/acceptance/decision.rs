//! The rule by which a largest error, its uncertainty and a tolerance come to a decision; the same for positions and orientations.

/// Fewer poses decide nothing.
pub const FEWEST_POSES: usize = 100;

/// The decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decision {
    /// The largest error and the uncertainty lie within the tolerance.
    Accepted,
    /// The largest error exceeds it by more than the uncertainty.
    Refused,
    /// The uncertainty does not let it be decided.
    Open,
    /// Too few poses, nothing measured, or no tolerance.
    NotEvaluated,
}

/// Where the uncertainty of the sensor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertainty {
    /// It was stated.
    Stated,
    /// Twice the scatter of repeated poses.
    Repeats,
    /// Nothing tells it, and it is left out.
    Unknown,
}

impl Decision {
    /// Of a largest error, its expanded uncertainty and a tolerance, in one unit (ISO 14253-1).
    pub(super) fn of(poses: usize, largest: f64, uncertainty: f64, tolerance: f64) -> Self {
        if poses < FEWEST_POSES || !largest.is_finite() {
            Self::NotEvaluated
        } else if largest + uncertainty <= tolerance {
            Self::Accepted
        } else if largest - uncertainty > tolerance {
            Self::Refused
        } else {
            Self::Open
        }
    }

    /// Of two that are both asked for: refused where either is, accepted where both are.
    pub(super) fn and(self, other: Self) -> Self {
        let order = [Self::Refused, Self::NotEvaluated, Self::Open];
        order.into_iter().find(|one| self == *one || other == *one).unwrap_or(Self::Accepted)
    }
}

impl Uncertainty {
    /// The expanded uncertainty (k = 2) that was stated, else that of repeated readings with this standard deviation, else 0.
    pub(super) fn of(stated: Option<f64>, scatter: Option<f64>) -> (f64, Self) {
        match (stated, scatter) {
            (Some(expanded), _) => (expanded, Self::Stated),
            (None, Some(sigma)) => (2.0 * sigma, Self::Repeats),
            (None, None) => (0.0, Self::Unknown),
        }
    }
}
