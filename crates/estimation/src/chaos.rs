//! Chaotic maps of the unit interval, and the uniformity of their sequences.
//!
//! ltlm-2024 distributes trial points by the logistic-tent map (eq. 11), compares it with six others (Table 2), and claims
//! that r = 0.5 is its most uniform parameter (eq. 12, Figs 2 and 3). [`map`] defines the seven maps, [`uniformity`]
//! evaluates their uniformity against the statistics of random counts.

pub mod map;
pub mod uniformity;
