//! How closely a surface is looked over, and what a look costs.

/// How many intervals each side of the domain has where a surface is looked over: for values that are not finite,
/// and for the starting points of Newton's method.
pub(super) const LATTICE: usize = 40;

/// What a look costs beside the terms of the equation.
pub(super) const AROUND: f64 = 20.0;
