//! What creeps while the rows are measured.

use nalgebra::Vector3;
use rand::Rng;

use super::Scene;
use crate::arms::Pose;
use crate::draw::{between, direction, normal};
use crate::sensors::{Reading, Sensor};

/// Knots of a wandering course.
const KNOTS: usize = 24;

/// The shape of a drift; size in mm.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// The sensor's readings wander: their zero, or the origin of its frame. Places at equal distances of time.
    Readings {
        /// Wandering places.
        knots: Vec<Vector3<f64>>,
        /// Time of the last (h).
        length_h: f64,
    },
    /// The base sinks and leans, ever more slowly: as the logarithm of time.
    Base {
        /// Direction of the displacement.
        sinks: Vector3<f64>,
        /// Rotation vector for each mm (rad).
        leans: Vector3<f64>,
        /// Time after which it slows (h).
        early_h: f64,
        /// Length of the run (h).
        length_h: f64,
    },
}

impl Shape {
    /// Readings that wander: a random walk, made smooth by a slower one.
    pub fn readings(scene: &Scene<'_>, rng: &mut impl Rng) -> Self {
        let keep = between(rng, 0.3, 0.9);
        let (mut at, mut rate) = (Vector3::zeros(), Vector3::zeros());
        let knots = (0..KNOTS)
            .map(|_| {
                rate = rate * keep + Vector3::from_fn(|_, _| normal(rng));
                at += rate;
                at / (KNOTS as f64).sqrt()
            })
            .collect();
        Shape::Readings { knots, length_h: scene.walk.length_h() }
    }

    /// A base that settles.
    pub fn base(scene: &Scene<'_>, rng: &mut impl Rng) -> Self {
        let length_h = scene.walk.length_h();
        Shape::Base {
            sinks: (direction(rng) * 0.6 - Vector3::z()).normalize(),
            leans: direction(rng) * (between(rng, 0.2, 2.0) / scene.sheet.reach_mm()),
            early_h: between(rng, 0.02, 0.3) * length_h,
            length_h,
        }
    }

    /// The least and greatest size that is met.
    pub fn sizes(&self) -> (f64, f64) {
        (0.03, 1.2)
    }

    /// How the base has moved (mm, rad).
    pub fn base_at(&self, size: f64, hours: f64) -> (Vector3<f64>, Vector3<f64>) {
        match self {
            Shape::Readings { .. } => (Vector3::zeros(), Vector3::zeros()),
            Shape::Base { sinks, leans, early_h, length_h } => {
                let course = size * (hours / early_h).ln_1p() / (length_h / early_h).ln_1p();
                (sinks * course, leans * course)
            }
        }
    }

    fn wandered(&self, hours: f64) -> Vector3<f64> {
        match self {
            Shape::Base { .. } => Vector3::zeros(),
            Shape::Readings { knots, length_h } => {
                let place = (hours / length_h).clamp(0.0, 1.0) * (KNOTS - 1) as f64;
                let low = (place.floor() as usize).min(KNOTS - 2);
                knots[low] + (knots[low + 1] - knots[low]) * (place - low as f64)
            }
        }
    }

    /// What the sensor reads without noise.
    pub fn reading(&self, size: f64, sensor: &Sensor, target: &Pose, hours: f64) -> Reading {
        let push = self.wandered(hours) * size;
        match sensor.ideal(target) {
            Reading::Cable(length) => Reading::Cable(length + push.x),
            Reading::Position(at) => Reading::Position(at + push),
            Reading::Pose(pose) => {
                Reading::Pose(Pose::from_parts((pose.translation.vector + push).into(), pose.rotation))
            }
        }
    }
}
