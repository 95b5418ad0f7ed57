//! How far apart passes and points may be.
//!
//! **Method.** Between two passes a ball of radius R leaves a cusp of height h. Across the passes the surface is a
//! circle of curvature κ (positive where it is rounded outwards); the triangle of its centre, the ball's centre and
//! the cusp gives, for the distance s on the surface,
//!
//! ```text
//! s = 4/|κ| · asin( |κ|/2 · √( (2Rh − h²) / ((1 + κR)(1 + κh)) ) ),     s = 2√(2Rh − h²) on a plane
//! ```
//!
//! which is exact, not the usual approximation for small h. Along a pass, points are put as far apart as two bounds
//! allow: the length of the step, and the distance of the curve from its chord.
//!
//! **Shapes.** A curve is a function of a share 0…1 to a point; what comes back are shares in ascending order, both
//! ends included.
//!
//! **Stops.** A curve is sampled at no more than [`MAX_CURVE_SAMPLES`] points.
//!
//! **Source and departures.** The cusp formula is derived here from the law of cosines; for small h and κ it is the
//! √(8Rh) of the handbooks.
//!
//! **Checked against.** Cusps measured on a plane, a cylinder and a hollow.

use nalgebra::Point3;

use super::budget::Budget;

/// Largest number of samples of a curve.
pub const MAX_CURVE_SAMPLES: usize = 1 << 20;

/// Distance of two passes on the surface in mm at which a ball of radius `tool_radius_mm` leaves a cusp of height
/// `scallop_mm` where the surface's curvature across the passes is `curvature_per_mm` (positive: rounded outwards).
///
/// `None` where there is none: a ball that does not fit into the hollow, or a cusp not below the ball's radius. On
/// a surface so strongly rounded that any distance leaves a lower cusp, half the way round.
///
/// ```
/// use truegrind_surfaces::sampling::{scallop_mm, step_over_mm};
///
/// // A ball of 10 mm on a plane, passes 2 mm apart: a cusp of some s² / 8r = 0.05 mm.
/// let cusp = scallop_mm(2.0, 10.0, 0.0).ok_or("none")?;
/// assert!((cusp - 0.05).abs() < 2e-4);
/// assert!((step_over_mm(cusp, 10.0, 0.0).ok_or("none")? - 2.0).abs() < 1e-9);
/// // It does not fit into a hollow of 8 mm.
/// assert_eq!(step_over_mm(0.05, 10.0, -1.0 / 8.0), None);
/// # Ok::<(), &str>(())
/// ```
pub fn step_over_mm(scallop_mm: f64, tool_radius_mm: f64, curvature_per_mm: f64) -> Option<f64> {
    let (h, r, k) = (scallop_mm, tool_radius_mm, curvature_per_mm);
    let fits = (1.0 + k * r) * (1.0 + k * h);
    if !(h > 0.0 && r > h && 1.0 + k * r > 0.0 && fits > 0.0) {
        return None;
    }
    let flat = (2.0 * r * h - h * h) / fits;
    let half_sine = 0.5 * k.abs() * flat.sqrt();
    if half_sine < 1e-8 {
        return Some(2.0 * flat.sqrt());
    }
    Some(4.0 / k.abs() * half_sine.min(std::f64::consts::FRAC_1_SQRT_2).asin())
}

/// Height of the cusp in mm that a ball of radius `tool_radius_mm` leaves between two passes `step_over_mm` apart:
/// the inverse of [`step_over_mm`]. `None` where the balls do not meet or do not fit.
pub fn scallop_mm(step_over_mm: f64, tool_radius_mm: f64, curvature_per_mm: f64) -> Option<f64> {
    let (s, r, k) = (step_over_mm, tool_radius_mm, curvature_per_mm);
    // Half the distance of the two ball centres, and how far their middle lies below a centre's height.
    let (apart, sag) = if (k * s).abs() < 1e-8 {
        (0.5 * s * (1.0 + k * r), 0.0)
    } else {
        ((1.0 + k * r) * (0.5 * k * s).sin() / k, (1.0 + k * r) * 2.0 * (0.25 * k * s).sin().powi(2) / k)
    };
    (apart > 0.0 && apart < r).then(|| r - sag - (r * r - apart * apart).sqrt())
}

/// The two bounds on the distance of neighbouring points of a pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Largest distance in mm.
    pub max_step_mm: f64,
    /// Largest distance of the curve from the chord in mm.
    pub chord_mm: f64,
}

/// A curve sampled so densely that its chords can be judged.
#[derive(Debug, Clone, Default)]
pub(crate) struct Trace {
    /// Shares 0…1, ascending.
    pub(crate) shares: Vec<f64>,
    /// Points at these shares.
    pub(crate) points: Vec<Point3<f64>>,
    /// Arc length of the curve up to these shares in mm.
    pub(crate) lengths: Vec<f64>,
}

impl Trace {
    /// Samples `curve` in `count` + 1 equally spaced shares of `from`…`to`; every run of consecutive samples on the surface
    /// becomes a trace.
    pub(crate) fn runs(
        curve: impl Fn(f64) -> Option<Point3<f64>>,
        from: f64,
        to: f64,
        count: usize,
    ) -> Vec<Trace> {
        let mut runs = vec![Trace::default()];
        for i in 0..=count {
            let part = i as f64 / count as f64;
            let share = from * (1.0 - part) + to * part;
            let last = runs.len() - 1;
            match curve(share) {
                Some(point) => runs[last].push(share, point),
                None if !runs[last].points.is_empty() => runs.push(Trace::default()),
                None => {}
            }
        }
        // A single point is no pass.
        runs.retain(|run| run.points.len() > 1 && run.length_mm() > 0.0);
        runs
    }

    pub(crate) fn length_mm(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    /// Longest distance of neighbouring points in mm.
    pub(crate) fn coarsest_mm(&self) -> f64 {
        self.lengths.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max)
    }

    /// The share at which the curve reaches a given length.
    pub(crate) fn share_at(&self, length_mm: f64) -> f64 {
        interpolated(&self.lengths, &self.shares, length_mm)
    }

    /// The length of the curve at a given share.
    pub(crate) fn length_at(&self, share: f64) -> f64 {
        interpolated(&self.shares, &self.lengths, share)
    }

    /// Shares that divide the curve so that both bounds hold: equally long steps where that takes at most a third more of
    /// them, else each step as long as the bounds allow. The second number is the smallest number of sampled intervals in a
    /// step: below four the curve should be sampled more densely. Where more than `room` steps are needed, as many as were
    /// found to be too many.
    pub(crate) fn divided(&self, steps: &Steps, room: usize, budget: &Budget) -> (Vec<f64>, usize) {
        let mut breaks = vec![0];
        while breaks[breaks.len() - 1] + 1 < self.points.len() && breaks.len() <= room + 1 {
            let from = breaks[breaks.len() - 1];
            breaks.push(self.farthest(from, steps));
        }
        let needed = breaks.len() - 1;
        let fewest = breaks.windows(2).rev().skip(1).map(|w| w[1] - w[0]).min().unwrap_or(usize::MAX);
        let equal = if needed > room { 0 } else { needed / 3 + 1 };
        for count in needed..needed + equal {
            let share = |i: usize| self.share_at(self.length_mm() * i as f64 / count as f64);
            let mut shares = vec![share(0)];
            while shares.len() <= count {
                let (from, to) = (shares[shares.len() - 1], share(shares.len()));
                if !(budget.charge_step() && self.holds(from, to, steps)) {
                    break;
                }
                shares.push(to);
            }
            if shares.len() > count {
                return (shares, fewest);
            }
        }
        (breaks.into_iter().map(|i| self.shares[i]).collect(), fewest)
    }

    /// The part of the trace between two shares, with points at both ends.
    pub(crate) fn between(&self, from: f64, to: f64) -> Trace {
        let mut part = Trace::default();
        part.push(from, self.point_at(from));
        for (share, point) in self.shares.iter().zip(&self.points) {
            if *share > from && *share < to {
                part.push(*share, *point);
            }
        }
        part.push(to, self.point_at(to));
        part
    }

    fn push(&mut self, share: f64, point: Point3<f64>) {
        let length = match (self.lengths.last(), self.points.last()) {
            (Some(length), Some(last)) => length + (point - last).norm(),
            _ => 0.0,
        };
        self.shares.push(share);
        self.points.push(point);
        self.lengths.push(length);
    }

    /// The last point that can be reached from `from` in one step; the next one if none can.
    fn farthest(&self, from: usize, steps: &Steps) -> usize {
        let holds = |to: usize| {
            let (a, b) = (self.points[from], self.points[to]);
            (b - a).norm() <= steps.max_step_mm
                && self.points[from + 1..to].iter().all(|p| beside_chord_mm(p, &a, &b) <= steps.chord_mm)
        };
        // Doubling, then bisection: whatever is returned was itself found to hold, so a curve that bends
        // back does no harm.
        let last = self.points.len() - 1;
        let (mut reached, mut stride) = (from + 1, 1);
        while reached < last && holds((reached + stride).min(last)) {
            reached = (reached + stride).min(last);
            stride *= 2;
        }
        while stride > 0 {
            if reached + stride <= last && holds(reached + stride) {
                reached += stride;
            }
            stride /= 2;
        }
        reached
    }

    fn holds(&self, from: f64, to: f64, steps: &Steps) -> bool {
        let (a, b) = (self.point_at(from), self.point_at(to));
        let first = self.shares.partition_point(|s| *s <= from);
        let end = self.shares.partition_point(|s| *s < to);
        (b - a).norm() <= steps.max_step_mm
            && self.points[first..end.max(first)].iter().all(|p| beside_chord_mm(p, &a, &b) <= steps.chord_mm)
    }

    fn point_at(&self, share: f64) -> Point3<f64> {
        let i = self.shares.partition_point(|s| *s < share).clamp(1, self.shares.len() - 1);
        let part = (share - self.shares[i - 1]) / (self.shares[i] - self.shares[i - 1]);
        self.points[i - 1] + (self.points[i] - self.points[i - 1]) * part.clamp(0.0, 1.0)
    }
}

/// Distance of a point from the chord between two others in mm.
pub fn beside_chord_mm(point: &Point3<f64>, from: &Point3<f64>, to: &Point3<f64>) -> f64 {
    let (chord, away) = (to - from, point - from);
    let squared = chord.norm_squared();
    let part = if squared > 0.0 { (away.dot(&chord) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (away - chord * part).norm()
}

/// `to` at `x`, linear between the entries of the ascending list `from`.
pub(crate) fn interpolated(from: &[f64], to: &[f64], x: f64) -> f64 {
    let i = from.partition_point(|f| *f < x).clamp(1, from.len() - 1);
    let width = from[i] - from[i - 1];
    let part = if width > 0.0 { ((x - from[i - 1]) / width).clamp(0.0, 1.0) } else { 1.0 };
    to[i - 1] * (1.0 - part) + to[i] * part
}
