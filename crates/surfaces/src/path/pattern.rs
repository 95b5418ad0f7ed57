//! The families of curves: where in the plan each pass runs.
//!
//! A family maps two shares 0…1, one across its curves and one along them, to a place in the domain. The spacing across is
//! determined on the surface itself: on a lattice of curves the distance of neighbours is measured, divided by the distance
//! allowed there, and summed; the passes are placed at equal parts of that sum, as few as keep every part within 1.

use nalgebra::{Point3, Vector3};

use crate::budget::Budget;
use crate::contact::Contact;
use crate::error::SurfaceError;
use crate::path::options::{Along, PathOptions, Pattern, Spacing, Traverse};
use crate::sampling::{self, interpolated};
use crate::surface::Surface;

/// Number of curves of the lattice, and of places on each.
const ACROSS: usize = 120;
const ALONG: usize = 36;

/// One curve over the plan, a function of a share 0…1.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    family: Family,
    /// Position across the family: one place, or for a spiral the places after each full turn.
    across: Vec<f64>,
    backwards: bool,
}

/// A family of curves in shares of the two ranges of the domain.
#[derive(Debug, Clone, Copy)]
enum Family {
    /// Straight lines along the first or second coordinate.
    Lines(Along),
    /// Ellipses about the centre.
    Ellipses,
    /// Rectangles inset from the border by an equal distance on the surface; the numbers are the insets of the innermost one,
    /// of no width, in each coordinate, as a share of the half range.
    Rectangles([f64; 2]),
}

impl Family {
    /// Place in the domain, as shares of its ranges. `across` is 0 at the first line or in the middle, 1 at the
    /// last line or on the border.
    fn at(self, across: f64, along: f64) -> [f64; 2] {
        let turn = (std::f64::consts::TAU * along).sin_cos();
        match self {
            Family::Lines(Along::First) => [along, across],
            Family::Lines(Along::Second) => [across, along],
            Family::Ellipses => [0.5 + 0.5 * across * turn.1, 0.5 + 0.5 * across * turn.0],
            Family::Rectangles(inset) => {
                let half = inset.map(|i| 0.5 * (1.0 - (1.0 - across) * i));
                let [x, y] = round_a_square(along);
                [0.5 + half[0] * x, 0.5 + half[1] * y]
            }
        }
    }

    /// The same place whichever way rounding went: shares never leave 0…1.
    fn place(self, across: f64, along: f64) -> [f64; 2] {
        self.at(across, along).map(|share| share.clamp(0.0, 1.0))
    }
}

/// Counter-clockwise round the square ±1 from the middle of its right side, each side a quarter of the way.
fn round_a_square(along: f64) -> [f64; 2] {
    let way = 8.0 * along.clamp(0.0, 1.0);
    match way {
        w if w <= 1.0 => [1.0, w],
        w if w <= 3.0 => [2.0 - w, 1.0],
        w if w <= 5.0 => [-1.0, 4.0 - w],
        w if w <= 7.0 => [w - 6.0, -1.0],
        w => [1.0, w - 8.0],
    }
}

impl Curve {
    /// Place in the domain at a share of the curve, as shares of its ranges.
    pub(crate) fn place(&self, share: f64) -> [f64; 2] {
        let share = if self.backwards { 1.0 - share } else { share };
        match self.across.as_slice() {
            [across] => self.family.place(*across, share),
            turns => {
                let turn = share * (turns.len() - 1) as f64;
                let whole = (turn.floor() as usize).min(turns.len() - 2);
                let part = turn - whole as f64;
                self.family.place(turns[whole] * (1.0 - part) + turns[whole + 1] * part, part)
            }
        }
    }

    /// Shares of the curve's corners, between its ends.
    pub(crate) fn corners(&self) -> &'static [f64] {
        match self.family {
            Family::Rectangles(_) => &[0.125, 0.375, 0.625, 0.875],
            Family::Lines(_) | Family::Ellipses => &[],
        }
    }

    /// Initial number of samples of the curve: enough for every turn.
    pub(crate) fn initial_samples(&self) -> usize {
        64 * (self.across.len().max(2) - 1)
    }
}

/// The curves of a pattern over a surface, in the order of cutting.
///
/// # Errors
/// A hollow into which the tool does not fit, more than [`PathOptions::MAX_POINTS`] passes, an exhausted budget, or a pattern
/// that nowhere meets the surface.
pub(crate) fn curves(
    surface: &Surface,
    options: &PathOptions,
    budget: &Budget,
) -> Result<Vec<Curve>, SurfaceError> {
    budget.charge((ACROSS + 1) * (ALONG + 3))?;
    let family = match options.pattern {
        Pattern::Raster => Family::Lines(options.along),
        Pattern::Spiral => Family::Ellipses,
        Pattern::Contour => Family::Rectangles(insets(surface)),
    };
    let sums = steps_across(surface, family, &options.spacing)?;
    let total = sums[ACROSS];
    if total.is_nan() || total <= 0.0 {
        return Err(SurfaceError::NoPass);
    }
    if total >= PathOptions::MAX_POINTS as f64 {
        return Err(SurfaceError::TooLong { limit: PathOptions::MAX_POINTS });
    }
    let places: Vec<f64> = (0..=ACROSS).map(|k| k as f64 / ACROSS as f64).collect();
    let across = |sum: f64| interpolated(&sums, &places, sum);
    // Slightly more than the sum, so that rounding cannot require one pass too few or too many.
    let parts = |sum: f64| (sum - 1e-9).ceil().max(1.0);
    let one = |across: f64, backwards: bool| Curve { family, across: vec![across], backwards };
    Ok(match options.pattern {
        Pattern::Raster => {
            let count = parts(total) as usize;
            let backwards = |k: usize| options.traverse == Traverse::Zigzag && k % 2 == 1;
            (0..=count).map(|k| one(across(total * k as f64 / count as f64), backwards(k))).collect()
        }
        Pattern::Spiral => {
            let count = parts(total) as usize;
            let mut turns: Vec<f64> = (0..=count).map(|k| across(total * k as f64 / count as f64)).collect();
            turns.push(1.0);
            vec![Curve { family, across: turns, backwards: false }]
        }
        // The innermost rectangle is half a step wide to each side of the middle.
        Pattern::Contour => {
            let count = parts(total + 0.5);
            let ring = |k: usize| one(across(total * (k as f64 - 0.5) / (count - 0.5)), false);
            (1..=count as usize).rev().map(ring).collect()
        }
    })
}

/// Insets of the innermost rectangle in each coordinate: all of the shorter side, and the same distance of the longer one.
fn insets(surface: &Surface) -> [f64; 2] {
    let domain = surface.domain();
    let length = |along: fn(f64) -> [f64; 2]| {
        let curve = |share: f64| surface.contact(domain.at(along(share))).map(|c| c.position_mm);
        sampling::Trace::runs(curve, 0.0, 1.0, ACROSS).iter().map(sampling::Trace::length_mm).sum::<f64>()
    };
    let (first, second) = (length(|s| [s, 0.5]), length(|s| [0.5, s]));
    let shorter = first.min(second);
    if shorter > 0.0 { [shorter / first, shorter / second] } else { [1.0, 1.0] }
}

/// For each curve of the lattice, the number of allowed steps between the first curve and it, where they are most.
fn steps_across(surface: &Surface, family: Family, spacing: &Spacing) -> Result<Vec<f64>, SurfaceError> {
    let domain = surface.domain();
    let curve = |k: usize| -> Vec<Option<Contact>> {
        let across = k as f64 / ACROSS as f64;
        let along = (0..=ALONG).map(|i| i as f64 / ALONG as f64);
        along.map(|s| surface.contact(domain.at(family.place(across, s)))).collect()
    };
    let mut sums = vec![0.0];
    let mut here = curve(0);
    for k in 1..=ACROSS {
        let next = curve(k);
        let mut most: f64 = 0.0;
        for i in 0..=ALONG {
            let (Some(from), Some(to)) = (here[i], next[i]) else { continue };
            // The outer of the two curves has a direction even where the inner one is a point.
            let direction = tangent(&next, i).unwrap_or_else(Vector3::zeros);
            let step = to.position_mm - from.position_mm;
            let across = step - direction * direction.dot(&step);
            let allowed = allowed_mm(surface, &to, &across, spacing)?;
            most = most.max(across.norm() / allowed);
        }
        sums.push(sums[k - 1] + most);
        here = next;
    }
    Ok(sums)
}

fn tangent(curve: &[Option<Contact>], i: usize) -> Option<Vector3<f64>> {
    let point = |k: usize| -> Option<Point3<f64>> { curve.get(k).copied().flatten().map(|c| c.position_mm) };
    let here = point(i)?;
    let ahead = point(i + 1).unwrap_or(here);
    let behind = i.checked_sub(1).and_then(point).unwrap_or(here);
    (ahead - behind).try_normalize(f64::MIN_POSITIVE)
}

fn allowed_mm(
    surface: &Surface,
    at: &Contact,
    across: &Vector3<f64>,
    spacing: &Spacing,
) -> Result<f64, SurfaceError> {
    match *spacing {
        Spacing::StepOver { step_over_mm } => Ok(step_over_mm),
        Spacing::Scallop { scallop_mm, tool_radius_mm } => {
            let curvature = surface.curvature_per_mm(at, across);
            let p = at.position_mm;
            sampling::step_over_mm(scallop_mm, tool_radius_mm, curvature).ok_or(SurfaceError::Hollow {
                hollow_mm: -1.0 / curvature,
                tool_mm: tool_radius_mm,
                x: p.x,
                y: p.y,
                z: p.z,
            })
        }
    }
}
