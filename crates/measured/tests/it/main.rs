//! What is known of real measurements holds: how they are read, fitted and diagnosed.

// A test that cannot go on panics.
#![allow(clippy::unwrap_used)]

mod diagnosis;
mod identification;
mod import;
mod own_bodies;
mod plausibility;
mod registration;
mod repeats;
