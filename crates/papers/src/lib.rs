//! Compares identification methods under the protocols of three papers.
//!
//! An experiment is a TOML file under `experiments/` ([`experiment`]); a new one needs no code. Kinds of experiment:
//!
//! - [`protocol`]: methods over seeded splits of measured rows (ltlm-2024 Tables 6 and 7, Figs 6 to 8; ukf-vslm-2023
//!   Tables VII to XIII, Figs 5 to 7); [`verdict`] compares the methods;
//! - [`grinding`]: a program for a surface, rewritten with each method's model (ltlm-2024 Table 8, Fig. 9);
//! - [`uniformity`]: uniformity of a chaotic map over its interval (ltlm-2024 Figs 2 and 3);
//! - [`signed_rank`]: a paper's own test on its own figures (ukf-vslm-2023 Tables X and XI);
//! - [`degradation`]: an arm that warms up and wears, calibrated periodically or continuously (rls-2025).
//!
//! [`statistics`] holds the tests, [`views`] the reports. A method that ends with non-finite numbers is reported in its
//! row of the table, never omitted.

pub mod statistics;
pub mod experiment;
pub mod rescaled;
pub mod simulated;
pub mod named_causes;
pub mod protocol;
pub mod parameters;
pub mod verdict;
pub mod uniformity;
pub mod signed_rank;
pub mod grinding;
pub mod degradation;
pub mod views;

/// The result of an experiment, by its kind.
#[derive(Debug, Clone)]
pub enum Results {
    /// Methods over splits of measured rows.
    Methods(Box<protocol::Study>),
    /// A ground surface.
    Grinding(Box<grinding::GrindingResult>),
    /// Uniformity of a chaotic map.
    Uniformity(uniformity::UniformityResult),
    /// A paper's own test on its own figures.
    SignedRank(Vec<signed_rank::TableResult>),
    /// An arm that degrades.
    Degradation(Box<degradation::DegradationResult>),
}
