//! Effects of the sensor and its target.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::Rng;

use super::Scene;
use crate::arms::Pose;
use crate::draw::{between, normal};
use crate::sensors::{Kind as Measures, Reading, Sensor, catenary, drooped, on_drum, over_pulley, refracted};
use crate::truth::Kind;

/// The shape of an effect of the sensor.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// size: radius of the pulley (mm).
    Pulley,
    /// size: by what share a layer is thinner than the one before.
    Drum {
        /// Wire in a layer (mm).
        layer_mm: f64,
    },
    /// size: square of weight over tension at a metre (1/m²).
    Catenary {
        /// By how much the tension grows for each metre.
        stiffens: f64,
    },
    /// Distances read too long or too short, size in mm, the more the further away: 1 + bow · ln of the distance over the mean one.
    Range {
        /// How it grows.
        bow: f64,
        /// The mean distance (mm).
        mean_mm: f64,
    },
    /// size: gradient at the floor (K/m).
    Refraction {
        /// Height in which the gradient falls off (mm).
        layer_mm: f64,
    },
    /// The centre of the target moves with the direction from which it is seen, size in mm: along the beam with 1 − cos of the
    /// incidence, and sideways by products of the direction's coordinates.
    Nest {
        /// Where the target looks, on the flange.
        axis: Vector3<f64>,
        /// Share along the beam.
        deep: f64,
        /// Sideways.
        skew: Matrix3<f64>,
    },
    /// The target's pole bends under its weight, size in mm where the pole is level.
    Droop {
        /// From the foot of the pole to the target, on the flange (mm).
        pole: Vector3<f64>,
        /// By what share it is softer where it is level than where it is nearly upright.
        softens: f64,
    },
}

impl Shape {
    /// Draws one.
    pub fn draw(kind: Kind, scene: &Scene<'_>, rng: &mut impl Rng) -> Self {
        match kind {
            Kind::Pulley => Shape::Pulley,
            Kind::Drum => Shape::Drum { layer_mm: scene.sheet.reach_mm() * between(rng, 0.08, 0.35) },
            Kind::Catenary => Shape::Catenary { stiffens: between(rng, 0.5, 1.5) },
            Kind::Range => {
                let place = scene.sensor.place.translation.vector;
                Shape::Range { bow: between(rng, -4.0, 4.0), mean_mm: place.norm() }
            }
            Kind::Droop => {
                // Its foot is somewhere on the flange, not in its middle.
                let foot = Vector3::new(12.0 * normal(rng), 12.0 * normal(rng), between(rng, 0.0, 15.0));
                let pole = scene.sensor.target.translation.vector - foot;
                Shape::Droop { pole, softens: between(rng, -0.15, 0.3) }
            }
            Kind::Refraction => Shape::Refraction { layer_mm: between(rng, 250.0, 900.0) },
            _ => Shape::Nest {
                axis: crate::draw::direction(rng),
                deep: between(rng, 0.3, 1.0),
                skew: Matrix3::from_fn(|_, _| 0.7 * normal(rng)),
            },
        }
    }

    /// The least and greatest size that is met.
    pub fn sizes(&self) -> (f64, f64) {
        match self {
            Shape::Pulley => (2.0, 30.0),
            Shape::Drum { .. } => (2e-4, 2e-3),
            Shape::Catenary { .. } => (2e-3, 8e-2),
            Shape::Range { .. } => (0.01, 1.0),
            Shape::Refraction { .. } => (3.0, 25.0),
            Shape::Nest { .. } | Shape::Droop { .. } => (0.02, 0.5),
        }
    }

    /// What the sensor reads without noise.
    pub fn reading(&self, size: f64, sensor: &Sensor, flange: &Pose, target: &Pose) -> Reading {
        let at = target.translation.vector;
        let from = sensor.place.translation.vector;
        let away = at - from;
        let length = away.norm();
        let cable = |more: f64| Reading::Cable(length + more + sensor.zero_mm);
        let seen = |push: Vector3<f64>| {
            let mut moved = *target;
            moved.translation.vector += push;
            sensor.ideal(&moved)
        };
        match self {
            Shape::Pulley => cable(over_pulley(&away, size) - length),
            Shape::Drum { layer_mm } => cable(-on_drum(length, *layer_mm, size)),
            Shape::Catenary { stiffens } => cable(catenary(&away, size.abs().sqrt(), *stiffens)),
            Shape::Range { bow, mean_mm } => {
                seen(away * (size * (1.0 + bow * (length / mean_mm).ln()) / length))
            }
            Shape::Refraction { layer_mm } => {
                seen(Vector3::new(0.0, 0.0, refracted(&from, &at, size, *layer_mm)))
            }
            Shape::Droop { pole, softens } => {
                let (sag, turn) = drooped(&(flange.rotation.inverse() * -Vector3::z()), pole, size, *softens);
                let mut moved = *target;
                moved.translation.vector += flange.rotation * sag;
                moved.rotation = UnitQuaternion::from_scaled_axis(flange.rotation * turn) * moved.rotation;
                sensor.ideal(&moved)
            }
            Shape::Nest { axis, deep, skew } => {
                debug_assert!(sensor.kind != Measures::Cable, "a hook has no incidence");
                let beam = flange.rotation.inverse() * (away / length);
                let incidence = 1.0 + beam.dot(axis);
                let products = Vector3::new(beam.y * beam.z, beam.z * beam.x, beam.x * beam.y);
                let push = beam * (deep * incidence) + skew * products;
                seen(flange.rotation * push * size)
            }
        }
    }
}
