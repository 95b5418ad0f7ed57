//! Decision rule for a largest error, its uncertainty and a tolerance (ISO 14253-1); the same for positions and orientations.

use truegrind_math::distribution::student_quantile;
use truegrind_math::tail::chi_square_tail;

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

/// Scatter of repeated readings: of a length, or of a vector of three coordinates, which has three degrees of freedom for each of its
/// repetitions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Pooled standard deviation (mm or rad; of a vector the root of the sum over its coordinates).
    pub sigma: f64,
    /// Degrees of freedom of that.
    pub freedom: usize,
}

/// Share of a normal distribution outside of two standard deviations, which k = 2 leaves out.
const OUTSIDE: f64 = 0.045_500_264;

/// Probability below which a stated standard deviation is refuted.
const REFUTED: f64 = 0.05;

impl Scatter {
    /// The coverage factor of 95.45 %: that of Student's t, since the standard deviation is itself estimated from a few readings (GUM,
    /// annex G); 2 for many.
    pub fn coverage_factor(&self) -> f64 {
        student_quantile(OUTSIDE, self.freedom.max(1) as f64)
    }

    /// Whether readings of this standard deviation would scatter as much in less than one of twenty cases.
    fn refutes(&self, sigma: f64) -> bool {
        chi_square_tail(self.freedom as f64 * (self.sigma / sigma).powi(2), self.freedom) < REFUTED
    }
}

/// Source of the sensor's uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncertainty {
    /// Stated by the user.
    Stated,
    /// The scatter of repeated poses with its coverage factor ([`Scatter::coverage_factor`]).
    Repeats,
    /// The same, or twice that scatter, and larger than what the user stated.
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
    /// The expanded uncertainty of 95.45 %: as stated or from the standard deviation of repeated readings, whichever is larger; else 0.
    ///
    /// What was stated comes from many readings. A few that scatter more by chance raise it to twice their scatter; where they refute it, they
    /// count as if nothing had been stated.
    pub(super) fn of(stated: Option<f64>, scatter: Option<Scatter>) -> (f64, Self) {
        match (stated, scatter) {
            (Some(expanded), Some(scatter)) if 2.0 * scatter.sigma > expanded => {
                let factor = if scatter.refutes(expanded / 2.0) { scatter.coverage_factor() } else { 2.0 };
                (factor * scatter.sigma, Self::AboveStated)
            }
            (Some(expanded), _) => (expanded, Self::Stated),
            (None, Some(scatter)) => (scatter.coverage_factor() * scatter.sigma, Self::Repeats),
            (None, None) => (0.0, Self::Unknown),
        }
    }
}
