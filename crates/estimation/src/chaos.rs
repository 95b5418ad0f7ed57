//! Chaotic maps of the unit interval, and how evenly they fill it.
//!
//! ltlm-2024 spreads trial points by the logistic-tent map (eq. 11), compares it with six others (Table 2), and
//! holds r = 0.5 to be its most uniform parameter (eq. 12, Figs 2 and 3). [`map`] has the seven maps,
//! [`uniformity`] the study, with the count statistics that any claim about it must be held against.

pub mod map;
pub mod uniformity;
