//! Quadratic interpolated beetle antennae search.
//!
//! **Method.** As [`bas`]; in addition the parabola through the costs at both antennae and at the beetle gives
//! a fourth point, its vertex t = ½ d (f₋ − f₊)/(f₋ − 2f₀ + f₊) along the antennae, which is used if it is better than
//! the step.
//!
//! **Shapes, stops.** As `bas`; four evaluations for each iteration.
//!
//! **Source and departures.** M5 of ltlm-2024, without equations: the quadratic interpolation that its
//! reference applies to each coordinate is the same formula, since the three points lie on one line; here it is evaluated
//! along that line, which avoids a division by the difference of two equal coordinates. The vertex is limited to twice the
//! antennae.
//!
//! **Checked against** `bas` with the same draws on published problems.

use crate::estimate::Estimate;
use crate::problem::Problem;
use crate::swarm::bas;

/// Options of [`solve`], the same as without interpolation.
pub type Options = bas::Options;

/// Searches the box around `start`.
///
/// # Panics
/// If `start` does not have one entry for each parameter.
pub fn solve(problem: &dyn Problem, start: &[f64], options: &Options) -> Estimate {
    bas::walk(problem, start, options, true)
}
