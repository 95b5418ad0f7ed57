//! Chaotic maps.
