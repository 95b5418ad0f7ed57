//! A candidate cause: physics of the arm or a disturbance of the measurement, by its contract name.

use crate::identification::tolerance::{Tolerance, effect_sigma};
use crate::measurement::sensor::disturbance::{Disturbance, Kind, Profile};
use crate::measurement::sensor::empirical::EmpiricalFault;
use truegrind_arm::effect::Effect;
use truegrind_arm::model::Model;

/// What may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// In the arm: goes into the model and into every program.
    Arm(Effect),
    /// In the measurement: fitted, and left behind.
    Measurement(Disturbance),
}

/// A part of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// What yields under load.
    Spring,
    /// What transmits the motion.
    Gear,
    /// What reverses late.
    Play,
}

/// Knots of an error map over a turn: a smooth curve.
pub const MAP_KNOTS: usize = 24;

/// Cosine of the angle between two axes from which they are parallel.
const PARALLEL: f64 = 0.99;

/// Share of its square from which an error of two joints goes with one of sum and difference.
const MOSTLY: f64 = 0.9;

impl Cause {
    /// The contract name.
    pub fn name(&self) -> &'static str {
        match self {
            Cause::Arm(effect) => effect.name(),
            Cause::Measurement(disturbance) => match (&disturbance.kind, &disturbance.profile) {
                (Kind::Empirical(form), _) => form.name(),
                (Kind::Load { .. }, _) => "payload-change",
                (_, Profile::Exponential { .. } | Profile::Temperature { .. }) => "thermal-drift",
                (Kind::Zero, _) => "sensor-zero-shift",
                (Kind::Frame { .. }, _) => "sensor-frame-shift",
                (Kind::Target, _) => "tool-shift",
                (Kind::Scale, _) => "sensor-scale",
                (Kind::Sag, _) => "cable-sag",
            },
        }
    }

    /// Joints (0-based) that it is about.
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Cause::Arm(Effect::JointCoupling(c)) => vec![c.driver, c.joint],
            Cause::Arm(effect) => effect.joint().into_iter().collect(),
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.joints(),
            Cause::Measurement(_) => Vec::new(),
        }
    }

    /// Data rows that it is about, both ends included.
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

    /// Standard deviation of each parameter before anything was measured, in its unit.
    pub fn sizes(&self) -> Vec<f64> {
        match self {
            Cause::Arm(effect) => (0..effect.parameters().len()).map(|k| effect_sigma(effect, k)).collect(),
            Cause::Measurement(d) => (0..d.values.len()).map(|k| Tolerance::of_disturbance(d, k)).collect(),
        }
    }

    /// Whether its size is one that nature has: a joint does not yield upwards, a reversal does not overshoot, no cable sags
    /// upwards.
    pub fn is_possible(&self) -> bool {
        match self {
            Cause::Arm(Effect::JointCompliance(c)) => c.compliance_rad_per_nm >= 0.0,
            Cause::Arm(Effect::Backlash(b)) => b.play_rad >= 0.0,
            Cause::Measurement(Disturbance { kind: Kind::Sag, values, .. }) => {
                values.iter().all(|v| *v >= 0.0)
            }
            _ => true,
        }
    }

    /// Whether it changes slowly over the joint angles, as what a fault that nobody has described does to a reading may too.
    pub fn is_smooth(&self) -> bool {
        match self {
            Cause::Arm(Effect::GearMap(map)) => map.knots_rad.len() <= MAP_KNOTS,
            Cause::Arm(effect) => {
                !matches!(effect, Effect::Backlash(_) | Effect::GearTransmission(_) | Effect::ThermalDrift(_))
            }
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.is_of_the_arm(),
            Cause::Measurement(_) => false,
        }
    }

    /// Whether weight does this only because the arm leans: gravity pulls along axes of the base that are none of its own.
    pub fn leans(&self) -> bool {
        let Cause::Arm(Effect::LumpedCompliance(load)) = self else { return false };
        load.lump.iter().all(|lump| lump.axis.is_some())
    }

    /// Whether it says that the first joint yields because the arm leans. Its axis is that of the base, along which weight turns
    /// nothing; in an arm that leans the joints behind it, which carry weight already, yield to that too.
    pub fn needs_lean(&self) -> bool {
        self.leans() && self.joints() == [0]
    }

    /// Whether another cause says that the arm leans.
    pub fn lean_is_seen(causes: &[Self]) -> bool {
        causes.iter().any(|cause| cause.leans() && !cause.needs_lean())
    }

    /// Whether it is an error of two neighbouring joints with parallel axes that goes with the angle in which weight turns: what a
    /// spring does, or play whose flank follows the load, with a law that nobody has described.
    pub fn goes_with_weight(&self, nominal: &Model) -> bool {
        let Cause::Measurement(Disturbance { kind: Kind::Empirical(form), values, .. }) = self else {
            return false;
        };
        let (EmpiricalFault::TwoJointGear { joint, other }, [a, b, c, d]) = (*form, values.as_slice()) else {
            return false;
        };
        let (first, last) = (joint.min(other), joint.max(other));
        let between = nominal.links[first].alpha_rad.cos();
        if last != first + 1 || between.abs() < PARALLEL {
            return false;
        }
        let (sum, difference) = (a * a + b * b, c * c + d * d);
        let with_weight = if between > 0.0 { sum } else { difference };
        with_weight > MOSTLY * (sum + difference)
    }

    /// Whether only the shape of it is known, not the law: a form.
    pub fn is_roughly_described(&self) -> bool {
        matches!(self, Cause::Measurement(Disturbance { kind: Kind::Empirical(_), .. }))
    }

    /// Whether it is a fault of a cable and of what leads it.
    pub fn is_of_the_cable(&self) -> bool {
        match self {
            Cause::Measurement(Disturbance { kind: Kind::Sag, .. }) => true,
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => {
                matches!(form, EmpiricalFault::Pulley | EmpiricalFault::Drum { .. })
            }
            _ => false,
        }
    }

    /// Whether it follows the clock or the thermometer.
    pub fn follows_warmth(&self) -> bool {
        match self {
            Cause::Arm(effect) => matches!(effect, Effect::ThermalDrift(_)),
            Cause::Measurement(d) => {
                matches!(d.profile, Profile::Exponential { .. } | Profile::Temperature { .. })
            }
        }
    }

    /// Whether it is in the arm: one of its effects, or a form that its model does not carry.
    pub fn is_of_the_arm(&self) -> bool {
        match self {
            Cause::Arm(_) => true,
            Cause::Measurement(Disturbance { kind: Kind::Empirical(form), .. }) => form.is_of_the_arm(),
            Cause::Measurement(_) => false,
        }
    }

    /// The part of the arm that it sends to: what yields, gear or play, and the joint that has it.
    pub fn part(&self) -> Option<(Part, usize)> {
        let joint = match self {
            Cause::Arm(Effect::JointCoupling(c)) => c.joint,
            _ => *self.joints().first()?,
        };
        let part = match self {
            Cause::Arm(Effect::JointCompliance(_) | Effect::LumpedCompliance(_)) => Part::Spring,
            Cause::Arm(Effect::Backlash(_)) => Part::Play,
            Cause::Measurement(Disturbance {
                kind: Kind::Empirical(EmpiricalFault::NonlinearStiffness { .. }),
                ..
            }) => Part::Spring,
            _ => Part::Gear,
        };
        Some((part, joint))
    }

    /// Whether both are in the arm, or push the same thing of the measurement.
    pub fn moves_the_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Cause::Arm(_), Cause::Arm(_)) => true,
            (Cause::Measurement(a), Cause::Measurement(b)) => {
                std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind)
            }
            _ => false,
        }
    }

    /// Whether two causes would be told to a technician as the same thing: same name, same joints, rows that overlap.
    pub fn same_story(&self, other: &Self) -> bool {
        let rows_meet = match (self.rows(), other.rows()) {
            (Some(a), Some(b)) => a[0] <= b[1] && b[0] <= a[1],
            (None, None) => true,
            _ => false,
        };
        self.name() == other.name() && self.joints() == other.joints() && rows_meet
    }
}
