//! Lattice for surveying a surface, and the fixed cost of an evaluation.

/// Intervals along each side of the domain where a surface is surveyed: for non-finite values, and for starting points of
/// Newton's method.
pub(super) const LATTICE: usize = 40;

/// Fixed cost of an evaluation in addition to the terms of the equation.
pub(super) const FIXED_COST: f64 = 20.0;
