//! Diagnosis of an arm: named physical causes for errors that geometry does not explain.
//!
//! Steps of a diagnosis:
//!
//! 1. [`preparation`]: rounded angles are fused with the read-out; rows with contradicting columns are noted.
//! 2. [`extension`]: robust fit of frames, links and the accepted causes, by steps of [`newton`] from a nearby fit;
//!    `design_effect` weights repeated readings of a pose by their variance components.
//! 3. [`design`]: the fit linearised and whitened, with frames, links and accepted causes projected off.
//! 4. [`catalogue`]: the candidate causes as regressors; [`intervals`] finds the rows of shifts, [`order_spectrum`] the orders
//!    of reducer harmonics.
//! 5. [`score`]: score test of each candidate with everything else as nuisance: gain, evidence, p-value. [`candidate_scores`]
//!    does that for all candidates, also for the model without one of its causes.
//! 6. [`selection`]: accepts the best candidate that is significant after correction for all trials and lowers the held-out
//!    error; then drops or exchanges accepted causes while that helps; repeats. [`levels`] rewrites overlapping shifts as
//!    piecewise-constant levels.
//! 7. [`validation`]: held-out errors of all stages by refits; [`held_out`]: those of candidates, steps and rivals to first order.
//! 8. [`residual_tests`], `data_quality` and `testability`: outliers, noise that grows with range, unexplained structure;
//!    rounding and contradicting columns; effects that the data cannot detect.
//! 9. [`discrepancy`] with [`marginal`]: random functions for model discrepancy. `confirmation`: a cause is identified only if it
//!    remains significant with them and is selected again in [`halves`] of the rows (stability selection); deflections and tilts must
//!    be those of weight ([`lump_direction`], [`overturning_masses`]).
//! 10. `findings` and `merged`: findings, ranked by their `contribution`, with doubts where a larger fault confounds them
//!     (`confounding`); `unexplained`: the rest, with what a planner needs of it
//!     ([`something_else`]); [`decision`]: shares of causes that cannot be told apart, and the measurement that decides. `written_model`: the arm for compensation, fitted beside the
//!     unknown rest of a sensor's law (`sensor_discrepancy`); `in_doubt`: its covariance for uncertain
//!     causes, `law_error` for laws of which only the form is assumed; `sensor_causes`: whether causes of the measurement are fitted with it.
//! 11. [`finding`], `summary` and [`words`]: the result, as a contract for programs and as sentences for technicians.
//!
//! `algebra` has products and factors of large matrices, `products` and `pure_products` those of a linearised fit with many candidates.
//!
//! The prior of a candidate's size is part of its evidence, which penalises candidates with many parameters.

pub mod preparation;
pub mod cause_kind;
pub mod cause;
pub mod catalogue;
mod algebra;
mod serial_correlation;
mod products;
mod pure_products;
pub mod discrepancy;
pub mod elimination;
pub mod halves;
pub mod marginal;
mod odds;
mod other_gravity;
mod confirmation;
pub mod contribution;
mod play_flanks;
mod confounding;
mod merged;
mod joint_scatter;
mod unexplained;
mod written_model;
mod in_doubt;
mod latency;
mod path_speeds;
mod law_error;
mod sensor_causes;
mod sensor_discrepancy;
mod contract;
pub mod newton;
mod nonlinear_springs;
mod design_effect;
mod drift;
pub mod extension;
pub mod design;
mod link_geometry;
mod link_growth;
pub mod lump_direction;
pub mod overturning_masses;
pub mod held_out;
pub mod score;
pub mod intervals;
pub mod candidates;
pub mod candidate_scores;
pub mod order_spectrum;
pub mod levels;
pub mod selection;
pub mod change_points;
pub mod validation;
pub mod transfer;
pub mod residual_tests;
mod data_quality;
mod testability;
pub mod something_else;
pub mod finding;
pub mod decision;
pub mod words;
pub mod picture;
pub mod along_turn;
mod findings;
mod options;
mod search;
mod summary;
mod handover;
pub mod diagnose;
pub mod measured;
