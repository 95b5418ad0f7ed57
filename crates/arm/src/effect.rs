//! Physical effects beyond rigid links, one file each: what they do to the joints and links of an arm.
//!
//! Every joint effect is linear in its parameters: it adds Σ pₖ φₖ(u, condition) to the mapped joint angles u, so one
//! set of regressors φ serves simulation, identification and compensation. Whether an effect is there is not decided
//! here.

pub mod compliance;
pub mod load;
pub mod harmonic;
pub mod map;
pub mod ratio;
pub mod coupling;
pub mod backlash;
pub mod thermal;
pub mod smooth;
pub mod bounds;

use nalgebra::{Matrix6, Vector3};
use serde::{Deserialize, Serialize};

use self::backlash::Backlash;
use self::compliance::Compliance;
use self::coupling::Coupling;
use self::harmonic::Harmonic;
use self::load::GravityLoad;
use self::map::JointMap;
use self::ratio::Ratio;
use self::smooth::Smooth;
use self::thermal::Thermal;
use super::chain::{self, Chain, LinkTable, cross, dot};
use super::condition::Condition;
use super::model::{Body, Joints, Model};
use truegrind_math::lanes::{SinCos, sin_cos};

/// One effect with its parameters. The serialised names are those of the diagnosis contract.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "effect", rename_all = "kebab-case")]
pub enum Effect {
    /// A joint that yields under the static torque of gravity.
    JointCompliance(Compliance),
    /// The same where masses or gravity's direction are unknown.
    #[serde(rename = "joint-compliance-lumped")]
    LumpedCompliance(GravityLoad),
    /// An eccentric gear: once or twice per joint turn.
    GearEccentricity(Harmonic),
    /// A line of the reducer at a higher order.
    GearTransmission(Harmonic),
    /// An error map fixed to a joint.
    #[serde(rename = "gear-transmission-map")]
    GearMap(JointMap),
    /// A gear whose ratio is not the nominal one.
    GearRatio(Ratio),
    /// A joint that moves along with another.
    JointCoupling(Coupling),
    /// Play that depends on the side from which the joint came.
    Backlash(Backlash),
    /// Links that grow with time or temperature.
    ThermalDrift(Thermal),
    /// What a network learned of errors without a physical name.
    SmoothCorrection(Smooth),
}

/// A parameter of an effect as the tables show it.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Name within the effect.
    pub name: &'static str,
    /// Unit as printed.
    pub unit: &'static str,
    /// Present value.
    pub value: f64,
}

macro_rules! each {
    ($self:expr, $e:ident => $body:expr) => {
        match $self {
            Effect::JointCompliance($e) => $body,
            Effect::LumpedCompliance($e) => $body,
            Effect::GearMap($e) => $body,
            Effect::GearEccentricity($e) | Effect::GearTransmission($e) => $body,
            Effect::GearRatio($e) => $body,
            Effect::JointCoupling($e) => $body,
            Effect::Backlash($e) => $body,
            Effect::ThermalDrift($e) => $body,
            Effect::SmoothCorrection($e) => $body,
        }
    };
}

impl Effect {
    /// The contract name of the effect.
    pub fn name(&self) -> &'static str {
        match self {
            Effect::JointCompliance(_) | Effect::LumpedCompliance(_) => "joint-compliance",
            Effect::GearEccentricity(_) => "gear-eccentricity",
            Effect::GearTransmission(_) | Effect::GearMap(_) => "gear-transmission",
            Effect::GearRatio(_) => "gear-ratio",
            Effect::JointCoupling(_) => "joint-coupling",
            Effect::Backlash(_) => "backlash",
            Effect::ThermalDrift(_) => "thermal-drift",
            Effect::SmoothCorrection(_) => "smooth-correction",
        }
    }

    /// The joint (0-based) that the effect acts on; `None` where it acts on the links or on several joints.
    pub fn joint(&self) -> Option<usize> {
        each!(self, e => e.joint())
    }

    /// Parameters with their present values.
    pub fn parameters(&self) -> Vec<EffectParameter> {
        each!(self, e => e.parameters())
    }

    /// Sets parameter `index` of [`Effect::parameters`].
    pub fn set(&mut self, index: usize, value: f64) {
        each!(self, e => e.set(index, value))
    }

    /// What each parameter adds to the joint rotations, per unit, at mapped joint angles `u` (rad).
    pub fn regressors(&self, statics: &Statics, u: &Joints, condition: &Condition) -> Vec<Joints> {
        each!(self, e => e.regressors(statics, u, condition))
    }

    /// What the effect adds to the joint rotations (rad).
    pub fn rotation(&self, statics: &Statics, u: &Joints, condition: &Condition) -> Joints {
        each!(self, e => e.rotation(statics, u, condition))
    }

    /// Adds [`Effect::rotation`] for one row or eight in lanes; `torque` from [`Statics::loads`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn turn<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        torque: &[R; 6],
        condition: &Condition,
        out: &mut [R; 6],
    ) {
        match self {
            Effect::LumpedCompliance(e) => e.turn(statics, u, out),
            Effect::GearMap(e) => e.turn(u, out),
            Effect::JointCompliance(e) => e.turn(torque, out),
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => e.turn(u, out),
            Effect::GearRatio(e) => e.turn(u, out),
            Effect::JointCoupling(e) => e.turn(u, out),
            Effect::Backlash(e) => e.turn(condition, out),
            Effect::SmoothCorrection(e) => e.turn(u, out),
            Effect::ThermalDrift(_) => {}
        }
    }

    /// Adds the slope times a step of u, for one row or eight in lanes, where that is cheap: the slope of compliance,
    /// some 1e-3, is left out. For Newton's method, which forgives it.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn carry<R: SinCos>(&self, u: &[R; 6], step: &[R; 6], out: &mut [R; 6]) {
        match self {
            Effect::GearEccentricity(e) | Effect::GearTransmission(e) => e.carry(u, step, out),
            Effect::GearRatio(e) => e.carry(step, out),
            Effect::JointCoupling(e) => e.carry(step, out),
            Effect::SmoothCorrection(e) => e.carry(u, step, out),
            Effect::GearMap(e) => e.carry(u, step, out),
            Effect::JointCompliance(_)
            | Effect::LumpedCompliance(_)
            | Effect::Backlash(_)
            | Effect::ThermalDrift(_) => {}
        }
    }

    /// Whether the effect depends on the torques of gravity.
    pub fn needs_torque(&self) -> bool {
        matches!(self, Effect::JointCompliance(_))
    }

    /// Derivative of [`Effect::rotation`] with respect to u.
    pub fn slope(&self, statics: &Statics, u: &Joints, condition: &Condition) -> Matrix6<f64> {
        each!(self, e => e.slope(statics, u, condition))
    }

    /// Relative growth of all lengths.
    pub fn growth(&self, condition: &Condition) -> f64 {
        match self {
            Effect::ThermalDrift(thermal) => thermal.growth(condition),
            _ => 0.0,
        }
    }

    /// Derivatives of [`Effect::growth`] with respect to the parameters; empty for an effect that lets nothing grow.
    pub fn growth_regressors(&self, condition: &Condition) -> Vec<f64> {
        match self {
            Effect::ThermalDrift(thermal) => thermal.growth_regressors(condition),
            _ => Vec::new(),
        }
    }
}

/// The static torques of an arm, for effects that need them.
#[derive(Debug, Clone)]
pub struct Statics {
    tables: [LinkTable; 6],
    bodies: [Body; 6],
    gravity: Vector3<f64>,
}

/// Standard gravity [m/s²].
const GRAVITY: f64 = 9.806_65;

impl Statics {
    /// Statics of a model: its links as they are, without joint effects (their share in the torque is of second
    /// order), massless where masses are unknown (only the payload then counts).
    pub fn of(model: &Model) -> Self {
        let bodies = model.bodies.unwrap_or([Body { mass_kg: 0.0, centre_mm: [0.0; 3] }; 6]);
        Self { tables: chain::tables(&model.links), bodies, gravity: model.gravity }
    }

    /// Torque of gravity about each joint axis (N m) at mapped angles `u`, and its derivative ∂τⱼ/∂uᵢ, which is
    /// symmetric because torque is the gradient of the potential energy.
    pub fn torques(&self, u: &Joints, condition: &Condition) -> (Joints, Matrix6<f64>) {
        let (frames, levers) = self.levers::<f64>(&(*u).into(), condition);
        let g = self.gravity_newton();
        let torque = Joints::from_fn(|j, _| dot(&frames.z[j], &cross(&levers[j], &g)));
        let turned: [[f64; 3]; 6] = std::array::from_fn(|i| cross(&cross(&frames.z[i], &levers[i]), &g));
        let slope = Matrix6::from_fn(|j, i| dot(&frames.z[j.min(i)], &turned[j.max(i)]));
        (torque, slope)
    }

    /// The torques alone, for one row or eight in lanes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn loads<R: SinCos>(&self, u: &[R; 6], condition: &Condition) -> [R; 6] {
        let (frames, levers) = self.levers(u, condition);
        let g = self.gravity_newton().map(R::splat);
        let mut out = [R::splat(0.0); 6];
        for j in 0..6 {
            out[j] = dot(&frames.z[j], &cross(&levers[j], &g));
        }
        out
    }

    /// Weight of a kilogram, with metres for the millimetres of the levers.
    #[inline(always)]
    fn gravity_newton(&self) -> [f64; 3] {
        [self.gravity.x, self.gravity.y, self.gravity.z].map(|v| v * GRAVITY * 1e-3)
    }

    /// The frames at mapped angles `u`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn frames<R: SinCos>(&self, u: &[R; 6]) -> Chain<R> {
        let zero = R::splat(0.0);
        let (mut sin, mut cos) = ([zero; 6], [zero; 6]);
        for i in 0..6 {
            (sin[i], cos[i]) = sin_cos(u[i]);
        }
        chain::chain(&self.tables, &sin, &cos)
    }

    /// The frames, and for each joint Σ m (c − o) [kg mm] over everything beyond it.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn levers<R: SinCos>(&self, u: &[R; 6], condition: &Condition) -> (Chain<R>, [[R; 3]; 6]) {
        let zero = R::splat(0.0);
        let frames = self.frames(u);
        let mut levers = [[zero; 3]; 6];
        let (mut sum, mut mass) = ([zero; 3], 0.0);
        for k in (0..6).rev() {
            let (y, z, o) = (&frames.y[k], &frames.z[k + 1], &frames.origin[k + 1]);
            let x = cross(y, z);
            let body = &self.bodies[k];
            let payload = if k == 5 { condition.payload_kg.unwrap_or(0.0) } else { 0.0 };
            // Σ m c of the body, and of the payload, which has its centre in the same frame.
            let c = std::array::from_fn::<f64, 3, _>(|i| {
                body.mass_kg * body.centre_mm[i] + payload * condition.payload_centre_mm[i]
            });
            let here = body.mass_kg + payload;
            mass += here;
            for i in 0..3 {
                sum[i] += R::splat(here) * o[i]
                    + R::splat(c[0]) * x[i]
                    + R::splat(c[1]) * y[i]
                    + R::splat(c[2]) * z[i];
                levers[k][i] = sum[i] - R::splat(mass) * frames.origin[k][i];
            }
        }
        (frames, levers)
    }
}
