//! A candidate cause: an effect of the arm or a disturbance of the measurement.

use super::cause_kind::CauseKind;
use crate::identification::tolerance::{Tolerance, effect_sigma};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::{EmpiricalFault, Overturning, Pole};
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;

/// A possible cause of errors.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// In the arm: part of the model, and thus of every corrected program.
    Arm(Effect),
    /// In the measurement: a nuisance that is fitted but not part of the model.
    Measurement(Disturbance),
}

/// The part of a joint that a cause concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Compliance.
    Spring,
    /// Transmission.
    Gear,
    /// Lost motion at reversals.
    Backlash,
    /// Bearing.
    Bearing,
}

/// Knots of a smooth error map over a turn.
pub const MAP_KNOTS: usize = 24;

/// Cosine of the angle between two axes from which they count as parallel.
const PARALLEL: f64 = 0.99;

/// Share of the squared amplitude from which a two-joint error depends on the sum or the difference alone.
const MOSTLY: f64 = 0.9;

/// Whether the axes of two neighbouring joints (0-based) turn in the same sense; `None` where they are not parallel neighbours.
pub(super) fn parallel_neighbours(nominal: &Model, joint: usize, other: usize) -> Option<bool> {
    let first = joint.min(other);
    let between = nominal.links[first].alpha_rad.cos();
    (joint.max(other) == first + 1 && between.abs() >= PARALLEL).then_some(between > 0.0)
}

impl Cause {
    /// Its kind, which variants share: harmonics and error map of a gear, drift of the arm and of the sensor's stand.
    pub fn kind(&self) -> CauseKind {
        match self {
            Cause::Arm(effect) => effect.into(),
            Cause::Measurement(disturbance) => match (&disturbance.kind, &disturbance.profile) {
                (Kind::Empirical(fault), _) => match fault {
                    EmpiricalFault::Latency { .. } => CauseKind::Latency,
                    EmpiricalFault::ArmUnsettled | EmpiricalFault::SensorUnsettled => CauseKind::Unsettled,
                    EmpiricalFault::NonlinearStiffness { .. } | EmpiricalFault::Hardening { .. } => {
                        CauseKind::JointStiffness
                    }
                    EmpiricalFault::LoadedPlay { .. } => CauseKind::Backlash,
                    EmpiricalFault::TwoJointGear { .. } => CauseKind::GearTwoJoints,
                    EmpiricalFault::AxisWobble { .. } => CauseKind::AxisWobble,
                    EmpiricalFault::Refraction => CauseKind::AirRefraction,
                    EmpiricalFault::Pulley => CauseKind::CablePulley,
                    EmpiricalFault::Drum { .. } => CauseKind::CableDrum,
                    EmpiricalFault::CableReversal => CauseKind::CableReversal,
                    EmpiricalFault::Range { .. } => CauseKind::SensorRange,
                    EmpiricalFault::SensorAxes => CauseKind::SensorAxes,
                    EmpiricalFault::Lens => CauseKind::LensDistortion,
                    EmpiricalFault::TargetNest { .. } => CauseKind::TargetNest,
                    EmpiricalFault::TargetDroop { .. } => CauseKind::TargetDroop,
                    EmpiricalFault::BaseTilt { .. } => CauseKind::BaseTilt,
                },
                (Kind::Load { .. }, _) => CauseKind::PayloadChange,
                (Kind::JointZero { .. }, _) => CauseKind::JointZeroShift,
                // Glue and wax creep: what moves with the clock on the flange is the target.
                (Kind::Target, _) => CauseKind::ToolShift,
                (_, Profile::Exponential { .. } | Profile::Temperature { .. }) => CauseKind::ThermalDrift,
                (Kind::Zero, _) => CauseKind::SensorZeroShift,
                (Kind::Frame { .. }, _) => CauseKind::SensorFrameShift,
                (Kind::Scale, _) => CauseKind::SensorScale,
                (Kind::Sag, _) => CauseKind::CableSag,
            },
        }
    }

    /// The joints concerned (0-based).
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Cause::Arm(Effect::JointCoupling(c)) => vec![c.driver, c.joint],
            Cause::Arm(Effect::GearTwoJoints(gear)) => vec![gear.joint, gear.other],
            Cause::Arm(Effect::LinkBending(b)) => vec![b.joint],
            Cause::Arm(Effect::LinkTwist(twist)) => vec![twist.joint],
            Cause::Arm(effect) => effect.joint().into_iter().collect(),
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.joints(),
            Cause::Measurement(Disturbance { kind: Kind::JointZero { joint }, .. }) => vec![*joint],
            Cause::Measurement(_) => Vec::new(),
        }
    }

    /// The rows of a shift, both ends included.
    pub fn rows(&self) -> Option<[usize; 2]> {
        match self {
            Cause::Measurement(Disturbance { profile: Profile::Rows { from, to }, .. }) => Some([*from, *to]),
            _ => None,
        }
    }

    /// Its parameters, each in its unit.
    pub fn values(&self) -> Vec<f64> {
        match self {
            Cause::Arm(effect) => effect.parameters().iter().map(|p| p.value).collect(),
            Cause::Measurement(disturbance) => disturbance.values.clone(),
        }
    }

    /// Prior standard deviation of each parameter, in its unit.
    pub fn sizes(&self) -> Vec<f64> {
        match self {
            Cause::Arm(effect) => (0..effect.parameters().len()).map(|k| effect_sigma(effect, k)).collect(),
            Cause::Measurement(d) => (0..d.values.len()).map(|k| Tolerance::of_disturbance(d, k)).collect(),
        }
    }

    /// Whether its sign is physically plausible: compliance, backlash and cable sag are not negative.
    pub fn has_plausible_sign(&self) -> bool {
        match self {
            Cause::Arm(Effect::JointCompliance(c)) => c.compliance_rad_per_nm >= 0.0,
            Cause::Arm(Effect::LinkBending(b)) => b.compliance_rad_per_nm >= 0.0,
            // The same load twists the link and tilts its end, to whichever side it stands.
            Cause::Arm(Effect::LinkTwist(twist)) => {
                twist.lean_rad.is_none_or(|lean| twist.twist_rad * lean >= 0.0)
            }
            Cause::Arm(effect @ (Effect::Backlash(_) | Effect::LoadedBacklash(_))) => {
                effect.play_rad().is_none_or(|(_, play)| play >= 0.0)
            }
            Cause::Measurement(Disturbance {
                kind:
                    Kind::Sag
                    | Kind::Empirical(
                        EmpiricalFault::LoadedPlay { .. }
                        | EmpiricalFault::Hardening { .. }
                        | EmpiricalFault::TargetDroop { pole: Pole::Axis | Pole::Offset, .. }
                        | EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: None, .. },
                    ),
                values,
                ..
            }) => values.iter().all(|v| *v >= 0.0),
            // A compliance about each axis, and one that couples them.
            Cause::Measurement(Disturbance {
                kind:
                    Kind::Empirical(EmpiricalFault::BaseTilt { load: Overturning::Masses, axes: Some(_), .. }),
                values,
                ..
            }) => values.chunks(3).all(|of| of.iter().take(2).all(|v| *v >= 0.0)),
            _ => true,
        }
    }

    /// The effect of the arm that an empirical fault of it is, at size 0; `None` of any other cause.
    pub fn effect(&self) -> Option<Effect> {
        match self {
            Cause::Measurement(Disturbance {
                kind: Kind::Empirical(fault),
                profile: Profile::Constant,
                ..
            }) => fault.effect(),
            _ => None,
        }
    }

    /// The cause as a written arm has it: a fault of the arm as the effect that it is, of size 0; any other as it is.
    pub fn as_written(&self) -> Self {
        self.effect().map_or_else(|| self.clone(), Cause::Arm)
    }

    /// Whether it varies slowly with the joint angles, like the residue of an unknown fault.
    pub fn is_smooth(&self) -> bool {
        match self {
            Cause::Arm(Effect::GearMap(map)) => map.knots_rad.len() <= MAP_KNOTS,
            Cause::Arm(effect) => {
                !matches!(effect, Effect::Backlash(_) | Effect::GearTransmission(_) | Effect::ThermalDrift(_))
            }
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.is_in_arm(),
            Cause::Measurement(_) => false,
        }
    }

    /// Whether it is an error of the sensor's scale that is the same in all rows.
    pub fn is_constant_scale(&self) -> bool {
        matches!(self, Cause::Measurement(Disturbance { kind: Kind::Scale, profile: Profile::Constant, .. }))
    }

    /// By how much the sensor's scale differs in some rows from that of the others; `None` for any other cause.
    pub fn scale_step(&self) -> Option<f64> {
        match self {
            Cause::Measurement(Disturbance { kind: Kind::Scale, profile: Profile::Rows { .. }, values }) => {
                Some(values[0])
            }
            _ => None,
        }
    }

    /// Whether it is deflection by gravity along horizontal axes of the base, as in an arm mounted at a tilt.
    pub fn is_tilt(&self) -> bool {
        let Cause::Arm(Effect::LumpedCompliance(load)) = self else { return false };
        load.lump.iter().all(|lump| lump.axis.is_some())
    }

    /// Whether it is a tilt deflection of joint 1. In an upright arm gravity has no torque about that joint's axis; in a tilted arm the
    /// later joints, which bear gravity torque anyway, must deflect too.
    pub fn requires_tilt(&self) -> bool {
        self.is_tilt() && self.joints() == [0]
    }

    /// Whether a tilt is supported by a cause in a joint other than joint 1.
    pub fn tilt_is_supported(causes: &[Self]) -> bool {
        causes.iter().any(|cause| cause.is_tilt() && !cause.requires_tilt())
    }

    /// Whether it is a two-joint error of neighbouring parallel axes that depends on the angle relative to gravity: the same as a
    /// compliance, or backlash whose side follows the load, with an unknown law.
    pub fn follows_gravity_angle(&self, nominal: &Model) -> bool {
        let Cause::Measurement(Disturbance { kind: Kind::Empirical(form), values, .. }) = self else {
            return false;
        };
        let (EmpiricalFault::TwoJointGear { joint, other, .. }, [a, b, c, d]) = (*form, values.as_slice())
        else {
            return false;
        };
        let Some(same_sense) = parallel_neighbours(nominal, joint, other) else { return false };
        let (sum, difference) = (a * a + b * b, c * c + d * d);
        let with_weight = if same_sense { sum } else { difference };
        with_weight > MOSTLY * (sum + difference)
    }

    /// Whether it is an [`EmpiricalFault`], whose exact law is unknown.
    pub fn is_empirical(&self) -> bool {
        matches!(self, Cause::Measurement(Disturbance { kind: Kind::Empirical(_), .. }))
    }

    /// Whether it is a fault of a cable or its guide.
    pub fn is_in_cable(&self) -> bool {
        match self {
            Cause::Measurement(Disturbance { kind: Kind::Sag, .. }) => true,
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => {
                matches!(form, EmpiricalFault::Pulley | EmpiricalFault::Drum { .. })
            }
            _ => false,
        }
    }

    /// Whether it has a thermal profile, in time or temperature.
    pub fn is_thermal(&self) -> bool {
        match self {
            Cause::Arm(effect) => matches!(effect, Effect::ThermalDrift(_)),
            Cause::Measurement(d) => {
                let by_clock = matches!(d.profile, Profile::Exponential { .. } | Profile::Temperature { .. });
                by_clock && !matches!(d.kind, Kind::Empirical(_))
            }
        }
    }

    /// Whether it is thermal growth of the arm's links.
    pub fn is_growth_of_arm(&self) -> bool {
        matches!(self, Cause::Arm(Effect::ThermalDrift(_)))
    }

    /// Whether it is in the arm: an effect, or an empirical fault of the arm.
    pub fn is_in_arm(&self) -> bool {
        match self {
            Cause::Arm(_) => true,
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.is_in_arm(),
            Cause::Measurement(_) => false,
        }
    }

    /// The part of the arm concerned, with its joint.
    pub fn part(&self) -> Option<(Part, usize)> {
        let joint = match self {
            Cause::Arm(Effect::JointCoupling(c)) => c.joint,
            _ => *self.joints().first()?,
        };
        let part = match self {
            Cause::Arm(
                Effect::JointCompliance(_)
                | Effect::LumpedCompliance(_)
                | Effect::JointStiffness(_)
                | Effect::TorquePowers(_)
                | Effect::LinkBending(_),
            ) => Part::Spring,
            Cause::Arm(Effect::Backlash(_) | Effect::LoadedBacklash(_))
            | Cause::Measurement(Disturbance {
                kind: Kind::Empirical(EmpiricalFault::LoadedPlay { .. }),
                ..
            }) => Part::Backlash,
            Cause::Arm(Effect::AxisWobble(_) | Effect::LinkTwist(_))
            | Cause::Measurement(Disturbance {
                kind: Kind::Empirical(EmpiricalFault::AxisWobble { .. }),
                ..
            }) => Part::Bearing,
            Cause::Measurement(Disturbance {
                kind:
                    Kind::Empirical(EmpiricalFault::NonlinearStiffness { .. } | EmpiricalFault::Hardening { .. }),
                ..
            }) => Part::Spring,
            _ => Part::Gear,
        };
        Some((part, joint))
    }

    /// Whether both are in the arm, or displace the same quantity of the measurement.
    pub fn affects_same_quantity(&self, other: &Self) -> bool {
        match (self, other) {
            (Cause::Arm(_), Cause::Arm(_)) => true,
            (Cause::Measurement(a), Cause::Measurement(b)) => {
                std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind)
            }
            _ => false,
        }
    }

    /// Whether two causes would share a finding: same name, same joints, overlapping rows.
    pub fn is_same_finding(&self, other: &Self) -> bool {
        let rows_meet = match (self.rows(), other.rows()) {
            (Some(a), Some(b)) => a[0] <= b[1] && b[0] <= a[1],
            (None, None) => true,
            _ => false,
        };
        self.kind() == other.kind() && self.joints() == other.joints() && rows_meet
    }
}
