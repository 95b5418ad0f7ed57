//! Algorithms that fit a model to measurements. Nothing here knows a robot: each algorithm is tested on published
//! problems (Moré–Garbow–Hillstrom, NIST StRD) and serves whatever implements [`problem::Problem`].
//!
//! Every algorithm file has the same two items: `Options` (with a `seed` and a `Default`) and
//! `solve(&dyn Problem, start, &Options) -> Estimate`. A solver returns whatever the data: not a number, no rows, a
//! singular matrix end in a [`estimate::Termination`] that says so, never in a panic.

pub mod problem;
pub mod estimate;
mod objective;
pub mod least_squares;
pub mod filter;
pub mod swarm;
pub mod chaos;
