//! Seed of Newton's method, from a closed form.

/// Start of Newton's method.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seed {
    /// DH joint rotations (rad).
    pub(super) rotations: [f64; 6],
    /// How far the target lies beyond the nominal arm's reach on this branch (mm); 0 within.
    pub(super) beyond_mm: f64,
}
