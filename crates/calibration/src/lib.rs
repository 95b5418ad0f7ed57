//! From measured poses to the arm that gave them: what was measured, the arm fitted to it, the causes of what geometry does
//! not explain, the same kept up to date as measurements come in, its acceptance, and its export.

pub mod measurement;
pub mod identification;
pub mod diagnosis;
pub mod tracking;
pub mod acceptance;
pub mod exported;
