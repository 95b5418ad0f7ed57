//! What the model of an arm gets wrong, and why: named physical causes for what geometry does not explain.
//!
//! The way of a diagnosis:
//!
//! 1. [`rows`]: rounded angles are sharpened by the read-out, rows whose own columns contradict each other are noted.
//! 2. [`extension`]: a robust fit of frames, links and the causes accepted so far, by steps of [`newton`] where one is
//!    nearby; `repeated` readings of a pose are one witness of what the model gets wrong there.
//! 3. [`design`]: that fit linearised and whitened, with frames, links and accepted causes projected off.
//! 4. [`catalogue`]: every candidate cause as regressors; [`intervals`] finds the rows of shifts, [`lines`] the orders of
//!    reducer lines.
//! 5. [`score`]: each candidate fitted jointly with everything else, to first order: gain, evidence, p-value. [`candidate_scores`] does
//!    that for all candidates at once, and again for the model without one of its causes.
//! 6. [`selection`]: the best candidate is accepted when it passes the likelihood ratio corrected for all trials and lowers
//!    the held-out error; then accepted ones are dropped or exchanged while that helps; then again. [`levels`] tells shifts
//!    that overlap as what stood where from which row to which.
//! 7. [`validation`]: held-out errors by refits of all stages; [`held`]: those of candidates, steps and rivals to first order.
//! 8. [`remaining`], `record` and `silence`: outliers, a noise that grows with range, structure that nothing in the catalogue
//!    explains; rounding and contradicting columns; what the rows cannot show.
//! 9. [`discrepancy`] with [`marginal`]: what no cause describes, as random functions beside the causes. `confirmation`: a cause
//!    is identified only if it wins beside those and comes back in [`halves`] of the rows.
//! 10. `stories`: one finding for each story, ranked by what it is `worth`, in doubt where it may be a part of something larger
//!     (`shadow`); `something_else`: what is left; `written`: the arm
//!     for compensation, where `sensor_causes` says beside which causes of the measurement.
//! 11. [`finding`], `account` and [`words`]: the result, in the contract's terms and in a technician's.
//!
//! Products and factors of large matrices are in `algebra`.
//!
//! Every candidate's size prior takes part in its evidence, so a candidate with many parameters has to earn them.

pub mod rows;
pub mod cause;
pub mod catalogue;
mod algebra;
mod correlated;
pub mod discrepancy;
pub mod halves;
pub mod marginal;
mod confirmation;
mod worth;
mod shadow;
mod stories;
mod something_else;
mod written;
mod in_doubt;
mod sensor_causes;
mod contract;
pub mod newton;
mod repeated;
pub mod extension;
pub mod design;
pub mod held;
pub mod score;
pub mod intervals;
pub mod candidates;
pub mod candidate_scores;
pub mod lines;
pub mod levels;
pub mod selection;
pub mod validation;
pub mod transfer;
pub mod remaining;
mod data_quality;
mod testability;
pub mod finding;
pub mod words;
pub mod picture;
mod findings;
mod options;
mod search;
mod telling;
pub mod diagnose;
