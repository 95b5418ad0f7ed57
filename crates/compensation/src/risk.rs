//! What the model knows of a program: where its path lies, how likely a correction does harm, and what measurement would help.

pub(crate) mod assessment;
pub(crate) mod beyond_noise;
pub mod cut_risk;
pub(crate) mod fixtures;
pub(crate) mod measurement_information;
pub mod placement;
pub mod prepared_estimate;
pub(crate) mod probability;
pub(crate) mod registration;
pub mod remedy;
pub(crate) mod remedy_search;
