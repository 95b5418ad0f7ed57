//! What is wrong: a shape that is drawn once, times a size.

pub mod arm;
pub mod drift;
pub mod sensor;
pub mod warmth;

use rand::{Rng, RngExt};

use crate::arms::{Angles, Arm, Pose, Sheet, Strain};
use crate::designs::{Visit, Walk};
use crate::sensors::{Reading, Sensor};
use crate::truth::{Kind, Parts, Truth};

/// The shape of an effect.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// None.
    Nothing,
    /// In the arm.
    Arm(arm::Shape),
    /// On the way from the target to the reading.
    Sensor(sensor::Shape),
    /// Over time.
    Drift(drift::Shape),
    /// The reading belongs to the pose of `size` hours before, and the clocks drift apart by this share over the run.
    Latency(f64),
    /// Each joint still lacks a share of its last step, the less the further it went: shares, and the step (rad) at which they are
    /// halved.
    Unsettled([f64; 6], f64),
    /// Until an hour of the run a joint (from 0) stood off by the size (rad); then it lost counts, and is where it is still.
    LostCounts(usize, f64),
    /// Noise that remembers: the share that a reading keeps of the one before.
    Correlated(f64),
}

impl Shape {
    /// The least and greatest size that is met, in the unit of the shape.
    pub fn sizes(&self) -> (f64, f64) {
        match self {
            Shape::Nothing => (1.0, 1.0),
            Shape::Arm(shape) => shape.sizes(),
            Shape::Sensor(shape) => shape.sizes(),
            Shape::Drift(shape) => shape.sizes(),
            // 10 ms to 1 s.
            Shape::Latency(_) => (0.01 / 3600.0, 1.0 / 3600.0),
            Shape::Unsettled(..) => (2e-4, 6e-3),
            Shape::LostCounts(..) => (1e-4, 5e-3),
            Shape::Correlated(_) => crate::worth::WORTH,
        }
    }
}

/// A hidden effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Hidden {
    /// Its shape.
    pub shape: Shape,
    /// Its size, in the unit of the shape.
    pub size: f64,
    /// What is true of it.
    pub truth: Truth,
}

/// Everything that is not drawn for each visit.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The data sheet.
    pub sheet: &'a Sheet,
    /// The arm as built.
    pub arm: &'a Arm,
    /// The sensor.
    pub sensor: &'a Sensor,
    /// The measured walk.
    pub walk: &'a Walk,
}

impl Hidden {
    /// Draws the shape of a kind, at size 1.
    pub fn draw(kind: Kind, scene: &Scene<'_>, rng: &mut impl Rng) -> Self {
        let (shape, parts) = match kind {
            Kind::Clean => (Shape::Nothing, Parts::default()),
            Kind::WarmLinks
            | Kind::Hardening
            | Kind::DeadBand
            | Kind::Bending
            | Kind::TwoJointGear
            | Kind::ModulatedGear
            | Kind::LoadedPlay
            | Kind::Tilt => {
                let (shape, parts) = arm::Shape::draw(kind, scene, rng);
                (Shape::Arm(shape), parts)
            }
            Kind::Pulley
            | Kind::Drum
            | Kind::Catenary
            | Kind::Refraction
            | Kind::Nest
            | Kind::Range
            | Kind::Droop => (Shape::Sensor(sensor::Shape::draw(kind, scene, rng)), Parts::default()),
            Kind::Drift => (Shape::Drift(drift::Shape::readings(scene, rng)), Parts::default()),
            Kind::Settling => (Shape::Drift(drift::Shape::base(scene, rng)), Parts::default()),
            Kind::Latency => (Shape::Latency(crate::draw::between(rng, 0.0, 0.5)), Parts::default()),
            Kind::Unsettled => {
                let shares = std::array::from_fn(|_| crate::draw::between(rng, 0.0, 1.0).powi(2));
                (Shape::Unsettled(shares, crate::draw::between(rng, 0.3, 1.5)), Parts::default())
            }
            Kind::LostCounts => {
                let joint = rng.random_range(0..5);
                // Between two rows: a fresh row belongs to the nearer one.
                let visits = &scene.walk.visits;
                let row = rng.random_range(visits.len() / 5..visits.len() * 4 / 5);
                let hours = 0.5 * (visits[row].hours + visits[row + 1].hours);
                (Shape::LostCounts(joint, hours), Parts::joint(joint))
            }
            Kind::Correlated => (Shape::Correlated(crate::draw::between(rng, 0.7, 0.97)), Parts::default()),
        };
        let families = kind.families(scene.sensor.kind);
        Self { shape, size: 1.0, truth: Truth { kind, families, parts } }
    }

    /// The same at another size.
    pub fn sized(&self, size: f64) -> Self {
        Self { size, ..self.clone() }
    }

    /// What it does to the arm in the arm itself: in programs too.
    pub fn strain(&self, arm: &Arm, visit: &Visit) -> Strain {
        match &self.shape {
            Shape::Arm(shape) => shape.strain(self.size, arm, visit),
            _ => Strain::default(),
        }
    }

    /// What the sensor would read without noise.
    pub fn reading(&self, scene: &Scene<'_>, visit: &Visit) -> Reading {
        let mut visit = *visit;
        if let Shape::Latency(apart) = self.shape {
            let lag = self.size * (1.0 + apart * (visit.hours / scene.walk.length_h() - 0.5));
            visit.q = scene.walk.joints_at(visit.hours - lag);
        }
        let mut strain = self.strain(scene.arm, &visit);
        if let Shape::Unsettled(shares, halved) = &self.shape {
            strain.turn = lacking(&visit, shares, *halved, self.size);
        }
        if let Shape::LostCounts(joint, hours) = self.shape
            && visit.hours < hours
        {
            strain.turn[joint] = self.size;
        }
        if let Shape::Drift(shape) = &self.shape {
            strain.base = shape.base_at(self.size, visit.hours);
        }
        let flange = scene.arm.flange(&visit.q, &strain);
        let target = flange * scene.sensor.target;
        match &self.shape {
            Shape::Sensor(shape) => shape.reading(self.size, scene.sensor, &flange, &target),
            Shape::Drift(shape) => shape.reading(self.size, scene.sensor, &target, visit.hours),
            _ => scene.sensor.ideal(&target),
        }
    }

    /// The flange of the arm as it stands without any fault of the measurement.
    pub fn clean_flange(&self, arm: &Arm, visit: &Visit) -> Pose {
        arm.flange(&visit.q, &self.strain(arm, visit))
    }
}

/// What joints still lack of their last step; each further reading waits for it.
fn lacking(visit: &Visit, shares: &[f64; 6], halved: f64, size: f64) -> Angles {
    std::array::from_fn(|j| {
        let step = visit.q[j] - visit.before[j];
        -size * shares[j] * (-1.5 * visit.repeat as f64).exp() * step / (1.0 + step.abs() / halved)
    })
}
