//! A candidate cause: physics of the arm or a disturbance of the measurement, by its contract name.

use crate::identification::tolerance::{Tolerance, effect_sigma};
use crate::measurement::sensor::disturbance::{Course, Disturbance, Kind};
use truegrind_arm::effect::Effect;

/// What may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// In the arm: goes into the model and into every program.
    Arm(Effect),
    /// In the measurement: fitted, and left behind.
    Measurement(Disturbance),
}

/// Knots of an error map over a turn: a smooth curve.
pub const MAP_KNOTS: usize = 24;

impl Cause {
    /// The contract name.
    pub fn name(&self) -> &'static str {
        match self {
            Cause::Arm(effect) => effect.name(),
            Cause::Measurement(disturbance) => match (&disturbance.kind, &disturbance.course) {
                (Kind::Form(form), _) => form.name(),
                (Kind::Load { .. }, _) => "payload-change",
                (_, Course::Clock { .. } | Course::Thermometer { .. }) => "thermal-drift",
                (Kind::Zero, _) => "sensor-zero-shift",
                (Kind::Frame { .. }, _) => "sensor-frame-shift",
                (Kind::Tool, _) => "tool-shift",
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
            Cause::Measurement(Disturbance { kind: Kind::Form(form), .. }) => form.joints(),
            Cause::Measurement(_) => Vec::new(),
        }
    }

    /// Data rows that it is about, both ends included.
    pub fn rows(&self) -> Option<[usize; 2]> {
        match self {
            Cause::Measurement(Disturbance { course: Course::Rows { from, to }, .. }) => Some([*from, *to]),
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
            Cause::Measurement(Disturbance { kind: Kind::Form(form), .. }) => form.is_of_the_arm(),
            Cause::Measurement(_) => false,
        }
    }

    /// Whether it is a fault of the sensor of which only the shape is known, not the law.
    pub fn is_roughly_described(&self) -> bool {
        let form = match self {
            Cause::Measurement(Disturbance { kind: Kind::Form(form), .. }) => form,
            _ => return false,
        };
        !form.is_of_the_arm()
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
