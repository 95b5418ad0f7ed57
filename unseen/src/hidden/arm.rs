//! Effects of the arm itself.

use nalgebra::Vector3;
use rand::{Rng, RngExt};

use super::Scene;
use super::warmth::Warmth;
use crate::arms::{Angles, Arm, Strain};
use crate::designs::Visit;
use crate::draw::{between, one};
use crate::truth::{Kind, Parts};

/// The shape of an effect of the arm.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Links grow with the warmth, each by its share; size: relative growth.
    Warm {
        /// Of each link.
        shares: [f64; 6],
        /// Over time.
        course: Warmth,
    },
    /// A spring whose stiffness grows with the torque, as asinh(τ / bend); size: what it yields under the largest torque (rad).
    Hardening {
        /// From 0.
        joint: usize,
        /// Torque at which it hardens (N m).
        bend_nm: f64,
        /// The largest torque of the walk (N m).
        most_nm: f64,
    },
    /// A joint that holds up to a torque and yields beyond it; size: what it yields under the largest torque (rad).
    DeadBand {
        /// From 0.
        joint: usize,
        /// The torque (N m).
        band_nm: f64,
        /// The largest torque of the walk (N m).
        most_nm: f64,
    },
    /// A beam; size: the largest sag of its end (mm).
    Bending {
        /// From 0.
        link: usize,
        /// 1/(E I) in 1/(N m²) for a largest sag of 1 mm.
        softness: f64,
    },
    /// size · sin(n q + m q' + φ), rad.
    TwoJointGear {
        /// From 0.
        joint: usize,
        /// The other joint.
        other: usize,
        /// n and m.
        orders: [f64; 2],
        /// φ (rad).
        phase: f64,
    },
    /// size · sin(n q + φ) under a hump about one place of the turn, rad.
    ModulatedGear {
        /// From 0.
        joint: usize,
        /// n.
        order: f64,
        /// φ (rad).
        phase: f64,
        /// Where the hump is (rad).
        place: f64,
        /// How narrow it is.
        narrow: f64,
    },
    /// Half the play (rad) to the side to which the load pushes, or from which the joint came where the load is small.
    LoadedPlay {
        /// From 0.
        joint: usize,
        /// Load that decides (N m).
        friction_nm: f64,
    },
    /// A pedestal that tilts about a place below the arm; size: how far under the largest moment of the walk (rad).
    Tilt {
        /// Heading of the horizontal axis about which it is softest (rad).
        heading: f64,
        /// How much stiffer it is about the other: the share of the tilt that is left.
        stiffer: f64,
        /// How deep below the base it turns (mm).
        deep_mm: f64,
        /// Of cables and a gripper at the elbow (kg), which the data sheet does not list.
        dress_kg: f64,
        /// The largest moment of the walk (N m).
        most_nm: f64,
    },
}

impl Shape {
    /// Draws one, and the parts that have it.
    pub fn draw(kind: Kind, scene: &Scene<'_>, rng: &mut impl Rng) -> (Self, Parts) {
        match kind {
            Kind::WarmLinks => Self::warm(scene, rng),
            Kind::Hardening => {
                let (joint, most_nm) = loaded(scene, rng);
                let bend_nm = between(rng, 0.1, 0.3) * most_nm;
                (Shape::Hardening { joint, bend_nm, most_nm }, Parts::joint(joint))
            }
            Kind::DeadBand => {
                let (joint, most_nm) = loaded(scene, rng);
                let band_nm = between(rng, 0.3, 0.6) * most_nm;
                (Shape::DeadBand { joint, band_nm, most_nm }, Parts::joint(joint))
            }
            Kind::Bending => {
                let beam = one(rng, &scene.sheet.beams);
                let sag = |visit: &Visit| scene.arm.beam(&visit.q, beam.body).0.norm();
                let most = scene.walk.visits.iter().map(sag).fold(0.0, f64::max);
                let parts = Parts { joints: beam.joints.to_vec(), links: beam.links.to_vec() };
                (Shape::Bending { link: beam.body, softness: 1.0 / most }, parts)
            }
            Kind::TwoJointGear => {
                let joint = rng.random_range(0..6_usize);
                let other = if joint == 0 || (joint < 5 && rng.random_range(0..2) == 0) {
                    joint + 1
                } else {
                    joint - 1
                };
                let orders = [one(rng, &[1.0, 2.0, 3.0]), one(rng, &[-2.0, -1.0, 1.0, 2.0])];
                let phase = between(rng, 0.0, std::f64::consts::TAU);
                (Shape::TwoJointGear { joint, other, orders, phase }, Parts::joint(joint))
            }
            Kind::ModulatedGear => {
                let joint = rng.random_range(0..6);
                let [low, high] = scene.sheet.room_deg[joint];
                let shape = Shape::ModulatedGear {
                    joint,
                    order: one(rng, &[3.0, 4.0, 6.0, 9.0, 14.0]),
                    phase: between(rng, 0.0, std::f64::consts::TAU),
                    place: between(rng, low, high).to_radians(),
                    narrow: between(rng, 1.0, 4.0),
                };
                (shape, Parts::joint(joint))
            }
            Kind::Tilt => {
                let weight: f64 = scene.sheet.kg.iter().sum();
                let dress_kg = between(rng, 0.0, 0.05) * weight;
                let most = |visit: &Visit| scene.arm.overturning(&visit.q, dress_kg).norm();
                let shape = Shape::Tilt {
                    heading: between(rng, 0.0, std::f64::consts::PI),
                    stiffer: between(rng, 0.4, 1.0),
                    deep_mm: between(rng, 0.0, 400.0),
                    dress_kg,
                    most_nm: scene.walk.visits.iter().map(most).fold(1e-6, f64::max),
                };
                (shape, Parts::default())
            }
            _ => {
                let joint = one(rng, &[1, 2, 2, 3, 4]);
                let friction_nm = between(rng, 0.1, 0.35) * most_torque(scene, joint);
                (Shape::LoadedPlay { joint, friction_nm }, Parts::joint(joint))
            }
        }
    }

    fn warm(scene: &Scene<'_>, rng: &mut impl Rng) -> (Self, Parts) {
        let length = scene.walk.length_h();
        let mut shares = [0.0; 6];
        for share in &mut shares {
            // Some links have no motor near.
            *share = if rng.random_range(0..3) == 0 { 0.0 } else { between(rng, 0.1, 1.0) };
        }
        shares[1] = f64::max(shares[1], 0.5);
        let course = Warmth {
            hours: [between(rng, 0.05, 0.15) * length, between(rng, 0.4, 1.2) * length],
            quick: between(rng, 0.3, 0.7),
            pause: scene.walk.pause,
        };
        // A link without a length does not grow.
        let long = |i: &usize| scene.sheet.links[*i][0] != 0.0 || scene.sheet.links[*i][2] != 0.0;
        let links = (0..6).filter(|i| shares[*i] > 0.0 && long(i)).map(|i| i + 1).collect();
        (Shape::Warm { shares, course }, Parts { joints: Vec::new(), links })
    }

    /// The least and greatest size that is met.
    pub fn sizes(&self) -> (f64, f64) {
        match self {
            // 8 K of aluminium to 60 K of steel.
            Shape::Warm { .. } => (1e-4, 8e-4),
            Shape::Hardening { .. } | Shape::DeadBand { .. } => (1e-4, 2e-3),
            Shape::Bending { .. } => (0.03, 0.8),
            Shape::TwoJointGear { .. } | Shape::ModulatedGear { .. } => (5e-5, 1.5e-3),
            Shape::LoadedPlay { .. } => (1e-4, 2e-3),
            Shape::Tilt { .. } => (5e-5, 1.5e-3),
        }
    }

    /// What it does at a visit.
    pub fn strain(&self, size: f64, arm: &Arm, visit: &Visit) -> Strain {
        let mut out = Strain::default();
        let q = &visit.q;
        match *self {
            Shape::Warm { shares, course } => {
                out.growth = shares.map(|share| size * share * course.at(visit.hours));
            }
            Shape::Hardening { joint, bend_nm, most_nm } => {
                let yields = |torque: f64| (torque / bend_nm).asinh();
                out.turn[joint] = size * yields(arm.torques(q)[joint]) / yields(most_nm);
            }
            Shape::DeadBand { joint, band_nm, most_nm } => {
                let torque = arm.torques(q)[joint];
                out.turn[joint] = size * (torque - torque.clamp(-band_nm, band_nm)) / (most_nm - band_nm);
            }
            Shape::Bending { link, softness } => {
                let (sag, slope) = arm.beam(q, link);
                out.bend[link] = (sag * (size * softness), slope * (size * softness));
            }
            Shape::TwoJointGear { joint, other, orders, phase } => {
                out.turn[joint] = size * (orders[0] * q[joint] + orders[1] * q[other] + phase).sin();
            }
            Shape::ModulatedGear { joint, order, phase, place, narrow } => {
                let hump = (narrow * ((q[joint] - place).cos() - 1.0)).exp();
                out.turn[joint] = size * hump * (order * q[joint] + phase).sin();
            }
            Shape::LoadedPlay { joint, friction_nm } => {
                let torque = arm.torques(q)[joint];
                let step = arm.sense[joint] * (q[joint] - visit.before[joint]);
                let flank = if torque.abs() > friction_nm {
                    torque.signum()
                } else if step.abs() > 1e-6 {
                    // A joint that moved up rests on its lower flank.
                    -step.signum()
                } else {
                    0.0
                };
                out.turn[joint] = 0.5 * size * flank;
            }
            Shape::Tilt { heading, stiffer, deep_mm, dress_kg, most_nm } => {
                let moment = arm.overturning(q, dress_kg) / most_nm;
                let soft = Vector3::new(heading.cos(), heading.sin(), 0.0);
                let turn = size * (stiffer * moment + soft * ((1.0 - stiffer) * soft.dot(&moment)));
                out.base = (turn.cross(&Vector3::new(0.0, 0.0, deep_mm)), turn);
            }
        }
        out
    }
}

/// A joint that carries something, and the most that it carries (N m).
fn loaded(scene: &Scene<'_>, rng: &mut impl Rng) -> (usize, f64) {
    let joint = one(rng, &[1, 1, 2, 2, 4]);
    let most = most_torque(scene, joint);
    if most > 1.0 { (joint, most) } else { (2, most_torque(scene, 2)) }
}

fn most_torque(scene: &Scene<'_>, joint: usize) -> f64 {
    let torque = |q: &Angles| scene.arm.torques(q)[joint].abs();
    scene.walk.visits.iter().map(|v| torque(&v.q)).fold(1e-6, f64::max)
}
