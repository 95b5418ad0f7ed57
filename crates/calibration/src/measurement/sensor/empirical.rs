//! Empirical faults: low-order expansions of faults whose exact law is unknown, in a measurement or an arm.
//!
//! Their effect on a row depends on the whole pose, on the reading, or on the previous row. A fault rotates joints, or moves the
//! sensor; [`calibration`](crate::identification::calibration) has the regressors. All are linear in their parameters and
//! evaluated at the nominal arm. They are rivals of the arm's effects, and nuisance parameters that no model file contains.

use nalgebra::Vector3;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::axis_wobble::AxisWobble;
use truegrind_arm::effect::base_tilt::{BaseTilt, TiltTerm};
use truegrind_arm::effect::hardening::Hardening;
use truegrind_arm::effect::joint_load::PointMass;
use truegrind_arm::effect::loaded_backlash::LoadedBacklash;
use truegrind_arm::effect::torque_powers::TorquePowers;
use truegrind_arm::effect::two_joint_gear::TwoJointGear;

/// What loads a joint whose fault follows its static torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum AssumedLoad {
    /// The masses of the arm, or 1 kg at its flange where these are not known.
    Masses,
    /// 1 kg at the origin of a frame, 1 to 6.
    Frame(u8),
    /// 1 kg divided between the origins of two frames.
    Between {
        /// The nearer frame, 1 to 6.
        near: u8,
        /// The farther one.
        far: u8,
        /// What of it is at the farther one (%).
        far_percent: u8,
    },
}

impl AssumedLoad {
    /// Divided between elbow and wrist as on IRB 120, TX60 and UR10, whose masses are known, each mass divided by the lever rule.
    pub const ELBOW_AND_WRIST: Self = AssumedLoad::Between { near: 2, far: 4, far_percent: 20 };

    /// The masses where they are assumed; none where they are those of the arm.
    pub fn masses(self) -> Vec<PointMass> {
        match self {
            AssumedLoad::Masses => Vec::new(),
            AssumedLoad::Frame(frame) => vec![PointMass { frame: usize::from(frame), mass_kg: 1.0 }],
            AssumedLoad::Between { near, far, far_percent } => {
                let at_far = 0.01 * f64::from(far_percent);
                vec![
                    PointMass { frame: usize::from(near), mass_kg: 1.0 - at_far },
                    PointMass { frame: usize::from(far), mass_kg: at_far },
                ]
            }
        }
    }
}

/// The pole between flange and target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Pole {
    /// Along the axis of the flange.
    Axis,
    /// From the flange's origin to the target.
    Offset,
    /// Of any direction or shape: a compliance in all directions.
    Bracket,
}

/// What overturns the base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Overturning {
    /// The masses of the arm and the logged payload.
    Masses,
    /// Free masses at elbow, wrist and flange, where the arm's are not known.
    Lumps,
}

/// The speeds that a latency has at corners of a path, where they change from row to row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CornerSpeed {
    /// Those from the row before to the next.
    Mean,
    /// Those from the row before: the reading is of an earlier pose.
    Before,
    /// Those to the next row: the reading is of a later pose.
    After,
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
        /// The speeds at corners of the path.
        corners: CornerSpeed,
    },
    /// The arm has not settled: each joint still has a fraction of its last step to go. Drives settle at different rates.
    ArmUnsettled,
    /// The sensor has not settled: the reading still has a fraction of the distance from the previous one to go.
    SensorUnsettled,
    /// A joint (0-based) with a nonlinear spring: square and cube of its torque, up to a largest torque. That is part of the fault, not of
    /// the rows, as are the other torques here: subsets of the rows must see the same regressors.
    NonlinearStiffness {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
        /// That torque (mN m), of that load.
        largest_mnm: u32,
    },
    /// A joint (0-based) that stiffens under its load: it has yielded by half of its parameter at the torque `bend_mnm`, and by all of it
    /// at a torque without end.
    Hardening {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
        /// The torque (mN m), of that load.
        bend_mnm: u32,
    },
    /// A joint (0-based) whose play its load closes: the flank that bears changes where the static torque changes its sign, or, beside a
    /// friction, where the torque exceeds this; below, the side of approach decides.
    LoadedPlay {
        /// The joint.
        joint: usize,
        /// Its load.
        load: AssumedLoad,
        /// The torque of the friction (mN m), of that load; 0 without.
        friction_mnm: u32,
        /// The torque (mN m), of that load, over which it closes.
        closing_mnm: u32,
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
    /// A joint (0-based) whose axis wobbles twice a turn, as in a bearing with races that are not flat: it tilts all that it carries, about two
    /// axes across its own that stand still with the link before. Once a turn it would be a link that is not straight.
    AxisWobble {
        /// The joint.
        joint: usize,
        /// Whether it runs out too: the axis tilts about another point than the origin of its frame.
        radial: bool,
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
    /// A cable sensor whose reading depends on the way in which the cable last moved: friction and lost motion of its drum.
    CableReversal,
    /// A camera whose lens distorts, with the square of the distance from its axis, the z axis of its frame: an image that is too large beside the
    /// axis puts the target too far from the axis, and its marks too far apart, so that it seems nearer too. Radial distortion: Brown 1966.
    Lens,
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
    /// A target that droops on the flange: its pole, or adapter, yields under its weight, in proportion to gravity across the pole.
    ///
    /// Gravity g, a unit vector, displaces the target by C g, with a symmetric compliance C (Maxwell). What C yields alike in all
    /// directions is a shift of the sensor, which is free; so C has five parameters without its trace. A pole along n that yields alike
    /// across it has C = c (1 − n nᵀ) and shows as −c n nᵀ g: one parameter, c the droop of a level pole. n is known where the pole
    /// stands on the flange's axis or points from it to the target.
    TargetDroop {
        /// The pole.
        pole: Pole,
        /// Whether the sensor sees it turn: by k n × g, k the slope of the level pole. Of a bracket k n is any vector.
        turning: bool,
    },
    /// A base that tilts under the overturning moment of the arm: a rotation about the base's origin in proportion to the moment of
    /// gravity about it.
    BaseTilt {
        /// What overturns it.
        load: Overturning,
        /// The two axes of the base (0, 1, 2) across gravity, where it is not as stiff about one as about the other: a compliance about
        /// each, and one that couples them, since the softest axis may lie between (symmetric, Maxwell).
        axes: Option<[u8; 2]>,
        /// Whether it turns below its origin, as a pedestal does: it sways too, by the tilt times that depth.
        deep: bool,
    },
}

/// Priors of square and cube of a torque: relative to a compliance of 1e-5 rad/(N m) the same again at some 30 N m. Of 1 kg in place of some
/// 10: per kg² and kg³.
pub fn torque_power_sigma(has_masses: bool, parameter: usize) -> f64 {
    if has_masses { [1e-6, 1e-7][parameter.min(1)] } else { 1e-4 }
}

/// Prior of an error that depends on two joints.
pub const TWO_JOINT_SIGMA_RAD: f64 = 3e-4;

/// Prior of a parameter of an axis that wobbles: the axial run-out of a crossed roller bearing, some 0.02 mm over its diameter of some 150 mm.
pub fn wobble_sigma(parameter: usize) -> f64 {
    if parameter < 4 { 1.5e-4 } else { 0.02 }
}

/// Prior of the tilt of a base, or of its sway: a joint of 1e-5 rad/(N m) on a pedestal as soft as itself, half a metre high; times some 30 kg
/// where masses are not known.
pub fn base_tilt_sigma(is_lump: bool, sways: bool) -> f64 {
    1e-5 * if is_lump { 30.0 } else { 1.0 } * if sways { 500.0 } else { 1.0 }
}

/// Entries of the matrix that maps the direction of the beam, in the target's frame, to a shift of the target's centre.
const FIRST: [&str; 8] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy"];

/// Coordinates of a symmetric matrix without trace.
const BRACKET: [&str; 5] = ["xy", "yz", "zx", "xx − yy", "2zz − xx − yy"];

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
            | EmpiricalFault::LoadedPlay { joint, .. }
            | EmpiricalFault::AxisWobble { joint, .. } => vec![joint],
            EmpiricalFault::TwoJointGear { joint, other, .. } => vec![joint, other],
            _ => Vec::new(),
        }
    }

    /// Whether it is a fault of the arm and not of the measurement.
    pub fn is_in_arm(self) -> bool {
        matches!(
            self,
            EmpiricalFault::NonlinearStiffness { .. }
                | EmpiricalFault::Hardening { .. }
                | EmpiricalFault::LoadedPlay { .. }
                | EmpiricalFault::TwoJointGear { .. }
                | EmpiricalFault::AxisWobble { .. }
                | EmpiricalFault::BaseTilt { .. }
        )
    }

    /// Whether the sensor, if it reads orientations, sees it turn the target.
    pub fn turns_target(self) -> bool {
        matches!(
            self,
            EmpiricalFault::TargetDroop { turning: true, .. }
                | EmpiricalFault::AxisWobble { .. }
                | EmpiricalFault::BaseTilt { .. }
        )
    }

    /// Whether it rotates joints; the others move the sensor.
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

    /// The effect that a model file has for it, at size 0; `None` of faults in the measurement.
    pub fn effect(self) -> Option<Effect> {
        let newton_metres = |milli: u32| f64::from(milli.max(1)) * 1e-3;
        Some(match self {
            EmpiricalFault::NonlinearStiffness { joint, load, largest_mnm } => {
                Effect::TorquePowers(TorquePowers {
                    joint,
                    mass: load.masses(),
                    largest_nm: newton_metres(largest_mnm),
                    square_rad_per_nm2: 0.0,
                    cube_rad_per_nm3: 0.0,
                })
            }
            EmpiricalFault::Hardening { joint, load, bend_mnm } => Effect::JointStiffness(Hardening {
                joint,
                mass: load.masses(),
                half_nm: newton_metres(bend_mnm),
                deflection_rad: 0.0,
            }),
            EmpiricalFault::LoadedPlay { joint, load, friction_mnm, closing_mnm } => {
                Effect::LoadedBacklash(LoadedBacklash {
                    joint,
                    mass: load.masses(),
                    friction_nm: f64::from(friction_mnm) * 1e-3,
                    closing_nm: newton_metres(closing_mnm),
                    play_rad: 0.0,
                })
            }
            EmpiricalFault::TwoJointGear { joint, other, orders } => {
                Effect::GearTwoJoints(TwoJointGear::still(joint, other, orders))
            }
            EmpiricalFault::AxisWobble { joint, radial } => Effect::AxisWobble(AxisWobble {
                joint,
                tilt_rad: [0.0; 4],
                radial_mm: radial.then_some([0.0; 4]),
            }),
            EmpiricalFault::BaseTilt { load, axes, deep } => {
                let frames: &[Option<usize>] = match load {
                    Overturning::Masses => &[None],
                    Overturning::Lumps => &[Some(2), Some(4), Some(6)],
                };
                let abouts = axes.map_or_else(
                    || vec![None],
                    |axes| {
                        let [a, b] = axes.map(usize::from);
                        [[a, a], [b, b], [a, b]].map(Some).to_vec()
                    },
                );
                let still =
                    |about, frame| TiltTerm { frame, about, tilt_rad_per_nm: 0.0, sway_mm_per_nm: 0.0 };
                let all =
                    abouts.iter().flat_map(|&about| frames.iter().map(move |&frame| still(about, frame)));
                Effect::BaseTilt(BaseTilt { deep, term: all.collect() })
            }
            _ => return None,
        })
    }

    /// Name and unit of each parameter.
    pub fn names(self) -> Vec<(String, &'static str)> {
        let listed = |names: &[&str], unit: &'static str| {
            names.iter().map(|name| ((*name).to_owned(), unit)).collect::<Vec<_>>()
        };
        match self {
            EmpiricalFault::TargetDroop { pole, turning } => {
                let (droop, slope): (&[&str], &[&str]) = match pole {
                    Pole::Bracket => (&BRACKET, &["slope x", "slope y", "slope z"]),
                    _ => (&["droop"], &["slope"]),
                };
                let mut out = listed(droop, "mm");
                out.extend(listed(if turning { slope } else { &[] }, "rad"));
                out
            }
            EmpiricalFault::BaseTilt { load, axes, deep } => {
                let (loads, units): (&[&str], _) = match load {
                    Overturning::Masses => (&[""], ["rad/(N m)", "mm/(N m)"]),
                    Overturning::Lumps => {
                        let loads = &[" x elbow mass", " x wrist mass", " x flange mass"];
                        (loads, ["rad kg/(N m)", "mm kg/(N m)"])
                    }
                };
                let name = |axis: u8| ["x", "y", "z"][usize::from(axis.min(2))];
                let abouts = axes.map_or_else(
                    || vec![String::new()],
                    |[a, b]| {
                        [[a, a], [b, b], [a, b]].map(|pair| format!(" {}", pair.map(name).concat())).to_vec()
                    },
                );
                let both = ["tilt", "sway"].into_iter().zip(units).take(if deep { 2 } else { 1 });
                let named = both.flat_map(|(motion, unit)| {
                    let all = abouts.iter().flat_map(|about| loads.iter().map(move |load| (about, load)));
                    all.map(move |(about, load)| (format!("{motion}{about}{load}"), unit))
                });
                named.collect()
            }
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
            EmpiricalFault::AxisWobble { radial, .. } => {
                let mut out = listed(&["tilt x cos", "tilt x sin", "tilt y cos", "tilt y sin"], "rad");
                let shifts = ["radial x cos", "radial x sin", "radial y cos", "radial y sin"];
                out.extend(listed(if radial { &shifts } else { &[] }, "mm"));
                out
            }
            EmpiricalFault::Refraction => {
                let mut out = listed(&["bend of the beam"], "1/m");
                out.extend(listed(&["its change with height"], "1/m²"));
                out
            }
            EmpiricalFault::Pulley => listed(&["xy", "yz", "zx", "x² − y²", "3z² − 1"], "mm"),
            EmpiricalFault::Drum { .. } => listed(&["square of the length", "cube of the length"], "mm"),
            EmpiricalFault::CableReversal => listed(&["difference of both ways"], "mm"),
            EmpiricalFault::Lens => listed(&["across at 45°", "along at 45°"], "1"),
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
            EmpiricalFault::NonlinearStiffness { load, .. } => {
                torque_power_sigma(load == AssumedLoad::Masses, parameter)
            }
            EmpiricalFault::Hardening { .. } | EmpiricalFault::LoadedPlay { .. } => 0.2_f64.to_radians(),
            EmpiricalFault::TwoJointGear { .. } => TWO_JOINT_SIGMA_RAD,
            EmpiricalFault::AxisWobble { .. } => wobble_sigma(parameter),
            EmpiricalFault::Refraction => 5e-6,
            EmpiricalFault::Pulley | EmpiricalFault::Drum { .. } => 0.5,
            EmpiricalFault::Range { .. } | EmpiricalFault::CableReversal => 0.2,
            EmpiricalFault::Lens => 0.02,
            EmpiricalFault::SensorAxes => 1e-3,
            EmpiricalFault::TargetNest { .. } => 0.05,
            // A reflector of 0.2 kg on 100 mm of a thin rod, of aluminium or steel; the slope of its end over a length of some 100 mm.
            EmpiricalFault::TargetDroop { pole, .. } => {
                let droops = if pole == Pole::Bracket { BRACKET.len() } else { 1 };
                if parameter < droops { 0.2 } else { 2e-3 }
            }
            EmpiricalFault::BaseTilt { load, deep, .. } => {
                base_tilt_sigma(load == Overturning::Lumps, deep && 2 * parameter >= self.names().len())
            }
        }
    }
}
