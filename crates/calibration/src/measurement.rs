//! What was measured: rows of joint angles with a sensor's reading, from files or from a simulated arm.
//!
//! ```text
//! bytes → import → Dataset → plausibility (does it mean what it says?) → convention (the controller's angles)
//!       → registration (where does the sensor stand?) → split (what is held out?) → identification
//! ```
//!
//! A [`simulation`] writes the same files from a stated arm, so that everything above can be judged against a known
//! truth. Nothing here opens a file, and nothing knows the catalogue of robots: names are resolved by the caller.

pub mod dataset;
pub mod import;
pub mod convention;
pub mod plausibility;
pub mod matching;
pub mod sensor;
pub mod registration;
pub mod split;
pub mod simulation;
