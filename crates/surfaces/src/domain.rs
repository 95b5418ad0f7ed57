//! The plan coordinates over which a surface is used.

use crate::error::SurfaceError;

/// The rectangle of plan coordinates over which a surface is used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain {
    /// Range of the first plan coordinate, x in mm or u.
    pub first: [f64; 2],
    /// Range of the second plan coordinate, y in mm or v.
    pub second: [f64; 2],
}

impl Domain {
    /// Middle of the domain.
    pub fn centre(&self) -> [f64; 2] {
        self.at([0.5, 0.5])
    }

    /// The plan position at shares 0…1 of the two ranges.
    pub fn at(&self, share: [f64; 2]) -> [f64; 2] {
        // Written so that share 1 gives the upper end exactly.
        let between = |[from, to]: [f64; 2], s: f64| from * (1.0 - s) + to * s;
        [between(self.first, share[0]), between(self.second, share[1])]
    }

    /// A lattice of (n + 1)² plan positions over the domain, borders included; the second coordinate runs slowest.
    pub(crate) fn lattice(&self, n: usize) -> impl Iterator<Item = [f64; 2]> + use<> {
        let domain = *self;
        (0..=n).flat_map(move |k| (0..=n).map(move |i| domain.at([i, k].map(|j| j as f64 / n as f64))))
    }

    pub(crate) fn check(&self, names: [&'static str; 2]) -> Result<(), SurfaceError> {
        check_range(names[0], self.first)?;
        check_range(names[1], self.second)
    }
}

/// Refuses a range that is empty, reversed or not finite.
pub(crate) fn check_range(name: &'static str, [from, to]: [f64; 2]) -> Result<(), SurfaceError> {
    if from.is_finite() && to.is_finite() && from < to {
        Ok(())
    } else {
        Err(SurfaceError::Range { name, from, to })
    }
}
