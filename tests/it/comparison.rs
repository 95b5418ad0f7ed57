//! Tests of `comparison`: statistics against published tables, experiments as data, protocols, tracking.

mod statistics;
mod experiment;
mod protocol;
mod degradation;
mod grinding;
mod tracking;
mod fixture;
mod command;
