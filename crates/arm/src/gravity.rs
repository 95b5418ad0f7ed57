//! Standard gravity, the only place of its number: what an effect was fitted with is what a load weighs in a program.

/// Standard gravity (m/s², and newtons per kilogram). Source: CGPM 1901, resolution 2.
pub const STANDARD_GRAVITY: f64 = 9.806_65;
