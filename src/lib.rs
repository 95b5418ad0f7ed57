//! truegrind learns how one real robot arm differs from its data sheet, names the causes, and rewrites RAPID and NC
//! programs so that the real arm follows the intended path.
//!
//! Inside, lengths are millimetres and angles radians; degrees and other units live at the edges of files. A frame is
//! named by what it takes to what: `base_from_flange * flange_from_tool` cancels. Three models of one arm are kept apart:
//! *nominal* (the data sheet, what the controller computes with), *estimated* (nominal and everything identified) and
//! *actual* (the real arm, known only in a simulation).
//!
//! ```
//! use truegrind::kinematics::condition::Condition;
//! use truegrind::kinematics::effect::Effect;
//! use truegrind::kinematics::effect::harmonic::Harmonic;
//! use truegrind::kinematics::model::Joints;
//! use truegrind::robots;
//!
//! let nominal = robots::load("abb-irb-120")?.model;
//! // The same arm with a gear of joint 1 that runs 0.05° out of centre.
//! let mut real = nominal.clone();
//! let sine_rad = 0.05_f64.to_radians();
//! real.effects.push(Effect::GearEccentricity(Harmonic { joint: 0, order: 1.0, sine_rad, cosine_rad: 0.0 }));
//! let joints = Joints::new(1.0, 0.2, -0.1, 0.0, 0.5, 0.0);
//! let still = Condition::default();
//! let off = nominal.forward(&joints, &still).translation.vector - real.forward(&joints, &still).translation.vector;
//! assert!(off.norm() > 0.3 && off.norm() < 0.5, "the flange is {:.2} mm away", off.norm());
//! # Ok::<(), truegrind::robots::RobotError>(())
//! ```
//!
//! The modules in reading order: what is measured and moved ([`math`], [`kinematics`], [`program`], [`surface`],
//! [`robots`], [`measurement`]), what is learnt from it ([`estimation`], [`identification`], [`diagnosis`],
//! [`comparison`]), what is done with it ([`compensation`], [`planning`]), and how it is told ([`report`]).

pub use truegrind_arm as kinematics;
pub use truegrind_arm::robots;
pub use truegrind_calibration::{diagnosis, identification, measurement, tracking};
pub use truegrind_compensation as compensation;
pub use truegrind_estimation as estimation;
pub use truegrind_math as math;
pub use truegrind_papers as comparison;
#[cfg(feature = "visual")]
pub use truegrind_pictures as visual;
pub use truegrind_planning as planning;
pub use truegrind_programs as program;
pub use truegrind_report as report;
pub use truegrind_surfaces as surface;
