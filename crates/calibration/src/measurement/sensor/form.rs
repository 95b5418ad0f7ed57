//! Faults of a measurement or of an arm that are more than a push along an axis: what each does to a row depends on the whole
//! pose, on the reading, or on the row before.
//!
//! A form turns joints or shifts the sensor; [`columns`](crate::identification::calibration) has the regressors. All are linear
//! in their parameters and taken at the data sheet's arm. They stand beside the causes of the arm as rivals, and are left behind
//! when a model is written.

use nalgebra::Vector3;

/// Which fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Form {
    /// The reading belongs to the pose a time τ later or earlier: δq = τ q̇. Two clocks drift apart: τ = τ₀ + κ (t − t₀).
    Latency {
        /// t₀, the middle of the measurement (s), so that τ₀ is what the readings are late by on the whole wherever the clock of the rows
        /// begins. It belongs to the form, as the lengths of a drum do.
        middle_s: i64,
    },
    /// The arm has not settled: a share of its last step is still to be made by each joint. Drives settle each at its own pace.
    LastStep,
    /// The reading has not settled: a share of the way from the last one is still to be made.
    SlowReading,
    /// A joint (0-based) whose spring is not linear: the square and the cube of its torque.
    Stiffness {
        /// The joint.
        joint: usize,
    },
    /// An error of a joint that depends on the sum and the difference of its angle and another's.
    TwoJointGear {
        /// The joint (0-based).
        joint: usize,
        /// The other.
        other: usize,
    },
    /// A tracker's beam bent in air whose temperature changes with height: the square of the distance, along gravity, and its
    /// change with the height of the beam.
    Refraction,
    /// A cable that is led over a pulley: harmonics of second degree of its direction.
    Pulley,
    /// A cable wound in layers: the square and the cube of its length, as Legendre's polynomials between two lengths. Those belong to
    /// the form, not to the rows that it is asked about: else some of the rows would be told another push than all of them.
    Drum {
        /// The shorter length (mm).
        from_mm: u32,
        /// The longer length (mm).
        to_mm: u32,
    },
    /// A target whose centre depends on the direction from which it is seen: first or second degree in that direction.
    Nest {
        /// Whether the second degree takes part.
        second: bool,
    },
}

/// Entries of the matrix that takes the direction of the beam, as the target sees it, to a shift of the target's centre.
const FIRST: [&str; 8] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy"];

/// x y, y z, z x, x² − y² and 3 z² − 1 of a direction: its harmonics of second degree.
pub fn second_degree(u: &Vector3<f64>) -> [f64; 5] {
    [u.x * u.y, u.y * u.z, u.z * u.x, u.x * u.x - u.y * u.y, 3.0 * u.z * u.z - 1.0]
}

impl Form {
    /// The contract name.
    pub fn name(self) -> &'static str {
        match self {
            Form::Latency { .. } => "latency",
            Form::LastStep | Form::SlowReading => "unsettled",
            Form::Stiffness { .. } => "joint-stiffness",
            Form::TwoJointGear { .. } => "gear-two-joints",
            Form::Refraction => "air-refraction",
            Form::Pulley => "cable-pulley",
            Form::Drum { .. } => "cable-drum",
            Form::Nest { .. } => "target-nest",
        }
    }

    /// Joints (0-based) that it is about.
    pub fn joints(self) -> Vec<usize> {
        match self {
            Form::Stiffness { joint } => vec![joint],
            Form::TwoJointGear { joint, other } => vec![joint, other],
            _ => Vec::new(),
        }
    }

    /// Whether it is a fault of the arm, which no model carries so far, and not of the measurement.
    pub fn is_of_the_arm(self) -> bool {
        matches!(self, Form::Stiffness { .. } | Form::TwoJointGear { .. })
    }

    /// Whether it turns joints; the others shift the sensor.
    pub fn turns(self) -> bool {
        matches!(
            self,
            Form::Latency { .. } | Form::LastStep | Form::Stiffness { .. } | Form::TwoJointGear { .. }
        )
    }

    /// Name and unit of each parameter.
    pub fn names(self) -> Vec<(String, &'static str)> {
        let listed = |names: &[&str], unit: &'static str| {
            names.iter().map(|name| ((*name).to_owned(), unit)).collect::<Vec<_>>()
        };
        match self {
            Form::Latency { .. } => {
                let mut out = listed(&["delay"], "s");
                out.extend(listed(&["its change by the hour"], "s/h"));
                out
            }
            Form::LastStep => {
                (1..=6).map(|joint| (format!("share of the last step of joint {joint}"), "1")).collect()
            }
            Form::SlowReading => listed(&["share of the last step"], "1"),
            Form::Stiffness { .. } => {
                let mut out = listed(&["square of the torque"], "rad/(N m)²");
                out.extend(listed(&["cube of the torque"], "rad/(N m)³"));
                out
            }
            Form::TwoJointGear { .. } => listed(
                &[
                    "sine of the sum",
                    "cosine of the sum",
                    "sine of the difference",
                    "cosine of the difference",
                ],
                "rad",
            ),
            Form::Refraction => {
                let mut out = listed(&["bend of the beam"], "1/m");
                out.extend(listed(&["its change with height"], "1/m²"));
                out
            }
            Form::Pulley => listed(&["xy", "yz", "zx", "x² − y²", "3z² − 1"], "mm"),
            Form::Drum { .. } => listed(&["square of the length", "cube of the length"], "mm"),
            Form::Nest { second: false } => listed(&FIRST, "mm"),
            Form::Nest { second: true } => {
                let products = ["xy", "yz", "zx", "x² − y²", "3z² − 1"];
                let of_axes =
                    ["x", "y", "z"].iter().flat_map(|axis| products.map(|p| format!("{axis}: {p}")));
                listed(&FIRST, "mm").into_iter().chain(of_axes.map(|name| (name, "mm"))).collect()
            }
        }
    }

    /// Standard deviation of a parameter before anything was measured, in its unit.
    pub fn size(self, parameter: usize) -> f64 {
        match self {
            // Clocks that nobody set together are tenths of a second apart, and their rates by some 100 ppm (0.36 s/h).
            Form::Latency { .. } => 0.3,
            Form::LastStep | Form::SlowReading => 1e-3,
            // Beside a compliance of 1e-5 rad/(N m): as much again at some 30 N m of a kilogram's torque.
            Form::Stiffness { .. } => [1e-6, 1e-7][parameter.min(1)],
            Form::TwoJointGear { .. } => 3e-4,
            Form::Refraction => 5e-6,
            Form::Pulley | Form::Drum { .. } => 0.5,
            Form::Nest { .. } => 0.05,
        }
    }
}
