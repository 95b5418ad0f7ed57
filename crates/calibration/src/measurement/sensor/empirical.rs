//! Empirical faults: low-order expansions of faults whose exact law is unknown, in a measurement or an arm.
//!
//! Their effect on a row depends on the whole pose, on the reading, or on the previous row. A fault rotates joints or shifts the
//! sensor; [`calibration`](crate::identification::calibration) has the regressors. All are linear in their parameters and
//! evaluated at the nominal arm. They are rivals of the arm's effects, and nuisance parameters that no model file contains.

use nalgebra::Vector3;

/// What loads a joint whose fault follows its static torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AssumedLoad {
    /// The masses of the arm, or 1 kg at its flange where these are not known.
    Masses,
    /// 1 kg at the origin of a frame, 1 to 6.
    Frame(u8),
    /// 1 kg divided between elbow and wrist, as on the arms of the catalogue whose masses are known.
    ElbowAndWrist,
}

/// An empirical fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EmpiricalFault {
    /// The reading is of the pose a time τ later or earlier: δq = τ q̇. Two clocks drift apart: τ = τ₀ + κ (t − t₀).
    Latency {
        /// t₀, the middle of the measurement (s), so that τ₀ is the mean delay wherever the clock of the rows begins. It is part of
        /// the fault, not of the rows: subsets of the rows must see the same regressors.
        middle_s: i64,
    },
    /// The arm has not settled: each joint still has a fraction of its last step to go. Drives settle at different rates.
    ArmUnsettled,
    /// The sensor has not settled: the reading still has a fraction of the distance from the previous one to go.
    SensorUnsettled,
    /// A joint (0-based) with a nonlinear spring: square and cube of its torque.
    NonlinearStiffness {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
    },
    /// A joint (0-based) that stiffens under its load: it has yielded by half of its parameter at the torque `bend_mnm`, and by all of it
    /// at a torque without end. The torque is part of the fault, not of the rows: subsets of the rows must see the same regressors.
    Hardening {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
        /// The torque (mN m), of that load.
        bend_mnm: u32,
    },
    /// A joint (0-based) whose play its load closes: the flank that bears changes where the static torque changes its sign.
    LoadedPlay {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
    },
    /// A joint error with harmonics of the sum and the difference of multiples of its angle and of another joint's.
    TwoJointGear {
        /// The joint (0-based).
        joint: usize,
        /// The other.
        other: usize,
        /// The multiples: of its own angle, of the other's.
        orders: [u8; 2],
    },
    /// Refraction of a tracker's beam by a vertical temperature gradient: an error along gravity with the square of the distance,
    /// and its change with the height of the beam.
    Refraction,
    /// A cable over a pulley: second-degree harmonics of its direction.
    Pulley,
    /// A cable wound in layers: second and third Legendre polynomials of its length between two lengths. These are part of the fault,
    /// not of the rows: subsets of the rows must see the same regressors.
    Drum {
        /// The shorter length (mm).
        from_mm: u32,
        /// The longer length (mm).
        to_mm: u32,
    },
    /// Distances of a tracker or camera that are off by an amount not proportional to them: a constant, and the second Legendre polynomial of
    /// the distance between two distances. These are part of the fault, as with a drum.
    Range {
        /// The shorter distance (mm).
        from_mm: u32,
        /// The longer distance (mm).
        to_mm: u32,
    },
    /// Axes of a sensor of positions whose scales differ. A camera measures depth otherwise than across, a measuring machine each axis by
    /// its own scale. The reading is (1 + S) times the position in the sensor's frame, with a diagonal S without trace: a common scale is a
    /// fault of its own. Axes that are not perpendicular are left out: such a shear imitates errors of the arm that bend its space.
    SensorAxes,
    /// A target whose apparent centre depends on the viewing direction: first or second degree in that direction.
    TargetNest {
        /// Whether the second degree is included.
        second: bool,
    },
}

/// Entries of the matrix that maps the direction of the beam, in the target's frame, to a shift of the target's centre.
const FIRST: [&str; 8] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy"];

/// x y, y z, z x, x² − y² and 3 z² − 1: the second-degree harmonics of a direction.
pub fn second_degree(u: &Vector3<f64>) -> [f64; 5] {
    [u.x * u.y, u.y * u.z, u.z * u.x, u.x * u.x - u.y * u.y, 3.0 * u.z * u.z - 1.0]
}

impl EmpiricalFault {
    /// The joints concerned (0-based).
    pub fn joints(self) -> Vec<usize> {
        match self {
            EmpiricalFault::NonlinearStiffness { joint, .. }
            | EmpiricalFault::Hardening { joint, .. }
            | EmpiricalFault::LoadedPlay { joint, .. } => vec![joint],
            EmpiricalFault::TwoJointGear { joint, other, .. } => vec![joint, other],
            _ => Vec::new(),
        }
    }

    /// Whether it is a fault of the arm (which no model file can represent yet) and not of the measurement.
    pub fn is_in_arm(self) -> bool {
        matches!(
            self,
            EmpiricalFault::NonlinearStiffness { .. }
                | EmpiricalFault::Hardening { .. }
                | EmpiricalFault::LoadedPlay { .. }
                | EmpiricalFault::TwoJointGear { .. }
        )
    }

    /// Whether it rotates joints; the others shift the sensor.
    pub fn rotates_joints(self) -> bool {
        matches!(
            self,
            EmpiricalFault::Latency { .. }
                | EmpiricalFault::ArmUnsettled
                | EmpiricalFault::NonlinearStiffness { .. }
                | EmpiricalFault::Hardening { .. }
                | EmpiricalFault::LoadedPlay { .. }
                | EmpiricalFault::TwoJointGear { .. }
        )
    }

    /// Name and unit of each parameter.
    pub fn names(self) -> Vec<(String, &'static str)> {
        let listed = |names: &[&str], unit: &'static str| {
            names.iter().map(|name| ((*name).to_owned(), unit)).collect::<Vec<_>>()
        };
        match self {
            EmpiricalFault::Latency { .. } => {
                let mut out = listed(&["delay"], "s");
                out.extend(listed(&["its change by the hour"], "s/h"));
                out
            }
            EmpiricalFault::ArmUnsettled => {
                (1..=6).map(|joint| (format!("share of the last step of joint {joint}"), "1")).collect()
            }
            EmpiricalFault::SensorUnsettled => listed(&["share of the last step"], "1"),
            EmpiricalFault::NonlinearStiffness { .. } => {
                let mut out = listed(&["square of the torque"], "rad/(N m)²");
                out.extend(listed(&["cube of the torque"], "rad/(N m)³"));
                out
            }
            EmpiricalFault::Hardening { .. } => listed(&["deflection"], "rad"),
            EmpiricalFault::LoadedPlay { .. } => listed(&["play"], "rad"),
            EmpiricalFault::TwoJointGear { .. } => listed(
                &[
                    "sine of the sum",
                    "cosine of the sum",
                    "sine of the difference",
                    "cosine of the difference",
                ],
                "rad",
            ),
            EmpiricalFault::Refraction => {
                let mut out = listed(&["bend of the beam"], "1/m");
                out.extend(listed(&["its change with height"], "1/m²"));
                out
            }
            EmpiricalFault::Pulley => listed(&["xy", "yz", "zx", "x² − y²", "3z² − 1"], "mm"),
            EmpiricalFault::Drum { .. } => listed(&["square of the length", "cube of the length"], "mm"),
            EmpiricalFault::Range { .. } => listed(&["constant", "square of the distance"], "mm"),
            EmpiricalFault::SensorAxes => listed(&["scale of x over z", "scale of y over z"], "1"),
            EmpiricalFault::TargetNest { second: false } => listed(&FIRST, "mm"),
            EmpiricalFault::TargetNest { second: true } => {
                let products = ["xy", "yz", "zx", "x² − y²", "3z² − 1"];
                let of_axes =
                    ["x", "y", "z"].iter().flat_map(|axis| products.map(|p| format!("{axis}: {p}")));
                listed(&FIRST, "mm").into_iter().chain(of_axes.map(|name| (name, "mm"))).collect()
            }
        }
    }

    /// Prior standard deviation of a parameter, in its unit.
    pub fn prior_sigma(self, parameter: usize) -> f64 {
        match self {
            // Unsynchronised clocks are tenths of a second apart, and their rates differ by some 100 ppm (0.36 s/h).
            EmpiricalFault::Latency { .. } => 0.3,
            EmpiricalFault::ArmUnsettled | EmpiricalFault::SensorUnsettled => 1e-3,
            // Relative to a compliance of 1e-5 rad/(N m): the same again at some 30 N m. Of 1 kg in place of some 10: per kg² and kg³.
            EmpiricalFault::NonlinearStiffness { load: AssumedLoad::Masses, .. } => {
                [1e-6, 1e-7][parameter.min(1)]
            }
            EmpiricalFault::NonlinearStiffness { .. } => [1e-4, 1e-4][parameter.min(1)],
            EmpiricalFault::Hardening { .. } | EmpiricalFault::LoadedPlay { .. } => 0.2_f64.to_radians(),
            EmpiricalFault::TwoJointGear { .. } => 3e-4,
            EmpiricalFault::Refraction => 5e-6,
            EmpiricalFault::Pulley | EmpiricalFault::Drum { .. } => 0.5,
            EmpiricalFault::Range { .. } => 0.2,
            EmpiricalFault::SensorAxes => 1e-3,
            EmpiricalFault::TargetNest { .. } => 0.05,
        }
    }
}
