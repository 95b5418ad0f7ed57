//! Four arms from the numbers of their data sheets, as they are built: every link off by tolerances.
//!
//! An arm is a chain of bodies. Body i turns about the z axis of body i − 1 by the logged angle, which some makers count the other way
//! round, and the zero of its joint;
//! what lies between two joints is one fixed pose, made from the standard DH numbers and then pushed and tilted at random in
//! all six directions. Lengths are in mm, angles in rad, masses in kg, torques in N m.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::Rng;

use crate::draw::normal;

/// A rigid motion (mm).
pub type Pose = Isometry3<f64>;

/// Joint angles (rad).
pub type Angles = [f64; 6];

/// Weight of a kilogram with metres for millimetres (N m per kg and mm).
const WEIGHT: f64 = 9.806_65e-3;

/// What a data sheet says, and the part of the joint ranges in which a workshop measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheet {
    /// Name in the catalogue of the tool under test.
    pub name: &'static str,
    /// a (mm), α (deg), d (mm) and θ at zero (deg) of each link, standard DH.
    pub links: [[f64; 4]; 6],
    /// −1 where the maker counts an angle against that z axis.
    pub sense: [f64; 6],
    /// Mass of each link (kg).
    pub kg: [f64; 6],
    /// Its centre in the DH frame at its far end (mm).
    pub centre: [[f64; 3]; 6],
    /// Lowest and highest angle of each joint where poses are drawn (deg).
    pub room_deg: [[f64; 2]; 6],
    /// Upper arm and forearm.
    pub beams: [Beam; 2],
}

/// A part of an arm that is a long beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Beam {
    /// The body, from 0.
    pub body: usize,
    /// Joints whose yielding looks like its bending, from 1.
    pub joints: [usize; 2],
    /// Links of the data sheet that it is made of, from 1.
    pub links: &'static [usize],
}

const UPPER_ARM: Beam = Beam { body: 1, joints: [2, 3], links: &[2] };

/// The arms.
pub const SHEETS: [Sheet; 4] = [
    Sheet {
        name: "abb-irb-120",
        links: [
            [0.0, -90.0, 290.0, 0.0],
            [270.0, 0.0, 0.0, -90.0],
            [70.0, -90.0, 0.0, 0.0],
            [0.0, 90.0, 302.0, 0.0],
            [0.0, -90.0, 0.0, 0.0],
            [0.0, 0.0, 72.0, 180.0],
        ],
        sense: [1.0; 6],
        kg: [3.067, 3.909, 2.944, 1.328, 0.546, 0.137],
        centre: [
            [0.0977, 51.59, -0.12],
            [-168.76, 0.78, -2.12],
            [-12.09, -1.06, 22.81],
            [0.41, -77.3, 0.15],
            [0.0622, -0.0368, -1.09],
            [0.0013, -0.17, -7.06],
        ],
        room_deg: [
            [-75.0, 75.0],
            [-45.0, 75.0],
            [-70.0, 50.0],
            [-120.0, 120.0],
            [-100.0, 100.0],
            [-150.0, 150.0],
        ],
        beams: [UPPER_ARM, Beam { body: 3, joints: [3, 5], links: &[3, 4] }],
    },
    Sheet {
        name: "universal-robots-ur10",
        links: [
            [0.0, 90.0, 127.3, 0.0],
            [-612.0, 0.0, 0.0, 0.0],
            [-572.3, 0.0, 0.0, 0.0],
            [0.0, 90.0, 163.941, 0.0],
            [0.0, -90.0, 115.7, 0.0],
            [0.0, 0.0, 92.2, 0.0],
        ],
        sense: [1.0; 6],
        kg: [7.1, 12.7, 4.27, 2.0, 2.0, 0.365],
        centre: [
            [21.0, 0.0, 27.0],
            [380.0, 0.0, 158.0],
            [240.0, 0.0, 68.0],
            [0.0, 7.0, 18.0],
            [0.0, 7.0, 18.0],
            [0.0, 0.0, -26.0],
        ],
        room_deg: [
            [-80.0, 80.0],
            [-145.0, -35.0],
            [-130.0, 130.0],
            [-160.0, 20.0],
            [-140.0, 140.0],
            [-160.0, 160.0],
        ],
        beams: [UPPER_ARM, Beam { body: 2, joints: [3, 4], links: &[3] }],
    },
    Sheet {
        name: "staubli-tx60",
        links: [
            [0.0, -90.0, 0.0, 0.0],
            [290.0, 0.0, 0.0, -90.0],
            [0.0, 90.0, 20.0, 90.0],
            [0.0, -90.0, 310.0, 0.0],
            [0.0, 90.0, 0.0, 0.0],
            [0.0, 0.0, 70.0, 0.0],
        ],
        sense: [1.0; 6],
        kg: [6.991_033_76, 4.291_77, 4.527_68, 2.169_76, 0.162_547_14, 0.0082],
        centre: [
            [0.0, 52.6593, 24.6768],
            [-166.0613, -0.0031, 171.591],
            [4.2467, 25.5386, -7.3541],
            [-1.5693, 95.9964, 0.0],
            [-0.0011, 0.0, 12.6897],
            [-0.2263, 0.0, -5.9781],
        ],
        room_deg: [
            [-80.0, 80.0],
            [-60.0, 85.0],
            [-110.0, 125.0],
            [-150.0, 150.0],
            [-105.0, 105.0],
            [-160.0, 160.0],
        ],
        beams: [UPPER_ARM, Beam { body: 3, joints: [3, 5], links: &[3, 4] }],
    },
    // The tool under test knows no masses of it; these are a guess from the 160 kg of its data sheet.
    Sheet {
        name: "kuka-kr10-r1420",
        links: [
            [150.0, -90.0, 450.0, 0.0],
            [610.0, 0.0, 0.0, 0.0],
            [20.0, -90.0, 0.0, -90.0],
            [0.0, 90.0, 660.0, 0.0],
            [0.0, -90.0, 0.0, 0.0],
            [0.0, 0.0, 80.0, 180.0],
        ],
        sense: [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0],
        kg: [45.0, 32.0, 26.0, 12.0, 4.0, 1.5],
        centre: [
            [-75.0, 120.0, 0.0],
            [-320.0, 0.0, 70.0],
            [-15.0, 0.0, 40.0],
            [0.0, -290.0, 0.0],
            [0.0, 0.0, 12.0],
            [0.0, 0.0, -25.0],
        ],
        room_deg: [
            [-80.0, 80.0],
            [-140.0, -20.0],
            [10.0, 140.0],
            [-150.0, 150.0],
            [-105.0, 105.0],
            [-160.0, 160.0],
        ],
        beams: [UPPER_ARM, Beam { body: 3, joints: [3, 5], links: &[3, 4] }],
    },
];

impl Sheet {
    /// Distance along all links (mm): a measure of how large the arm is.
    pub fn reach_mm(&self) -> f64 {
        self.links.iter().map(|[a, _, d, _]| a.hypot(*d)).sum()
    }

    /// The middle of the room in which poses are drawn (rad).
    pub fn middle(&self) -> Angles {
        self.room_deg.map(|[low, high]| (0.5 * (low + high)).to_radians())
    }

    /// Whether angles lie in that room, with a margin (rad).
    pub fn has_room(&self, q: &Angles, margin: f64) -> bool {
        q.iter()
            .zip(self.room_deg)
            .all(|(q, [low, high])| *q >= low.to_radians() - margin && *q <= high.to_radians() + margin)
    }

    /// The arm exactly as the data sheet has it.
    pub fn nominal(&self) -> Arm {
        Arm {
            between: self.links.map(|[a, alpha, d, _]| {
                let twist = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha.to_radians());
                Pose::from_parts(Translation3::new(a, 0.0, d), twist)
            }),
            zero: self.links.map(|link| link[3].to_radians()),
            sense: self.sense,
            kg: self.kg,
            centre: self.centre.map(Vector3::from),
        }
    }

    /// An arm of this type as it left the works.
    pub fn built(&self, rng: &mut impl Rng) -> Arm {
        let mut arm = self.nominal();
        for i in 0..6 {
            let push = Vector3::from_fn(|_, _| 0.3 * normal(rng));
            let tilt = Vector3::from_fn(|_, _| 1.0e-3 * normal(rng));
            arm.between[i] *= Pose::from_parts(push.into(), UnitQuaternion::from_scaled_axis(tilt));
            arm.zero[i] += 1.5e-3 * normal(rng);
            arm.kg[i] *= 1.0 + 0.06 * normal(rng).clamp(-3.0, 3.0);
            arm.centre[i] += Vector3::from_fn(|_, _| 6.0 * normal(rng));
        }
        arm
    }
}

/// An arm: bodies between joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// From each joint, turned, to the next.
    pub between: [Pose; 6],
    /// What each joint is turned by at logged angle zero (rad).
    pub zero: Angles,
    /// −1 where angles are counted against the axis.
    pub sense: [f64; 6],
    /// Masses (kg).
    pub kg: [f64; 6],
    /// Their centres, in the frame at the far end of the body (mm).
    pub centre: [Vector3<f64>; 6],
}

/// What effects do to an arm in one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain {
    /// By how much each joint stands off its angle (rad).
    pub turn: Angles,
    /// Relative growth of each body.
    pub growth: [f64; 6],
    /// A small motion at the far end of each body: displacement (mm), rotation vector (rad).
    pub bend: [(Vector3<f64>, Vector3<f64>); 6],
    /// A small motion of the base in the room: displacement (mm), rotation vector (rad).
    pub base: (Vector3<f64>, Vector3<f64>),
}

impl Default for Strain {
    fn default() -> Self {
        let none = (Vector3::zeros(), Vector3::zeros());
        Self { turn: [0.0; 6], growth: [0.0; 6], bend: [none; 6], base: none }
    }
}

fn small(motion: (Vector3<f64>, Vector3<f64>)) -> Pose {
    Pose::from_parts(motion.0.into(), UnitQuaternion::from_scaled_axis(motion.1))
}

impl Arm {
    /// Base and the far end of each body.
    pub fn frames(&self, q: &Angles, strain: &Strain) -> [Pose; 7] {
        let mut out = [small(strain.base); 7];
        for i in 0..6 {
            let angle = self.sense[i] * q[i] + self.zero[i] + strain.turn[i];
            let turned = out[i] * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            let mut between = self.between[i];
            between.translation.vector *= 1.0 + strain.growth[i];
            out[i + 1] = turned * between * small(strain.bend[i]);
        }
        out
    }

    /// The flange in the room.
    pub fn flange(&self, q: &Angles, strain: &Strain) -> Pose {
        self.frames(q, strain)[6]
    }

    /// Weights of bodies `from` and beyond (N with m for mm), and where they pull (mm).
    fn weights(&self, frames: &[Pose; 7], from: usize) -> Vec<(f64, Vector3<f64>)> {
        (from..6)
            .map(|i| (WEIGHT * self.kg[i], (frames[i + 1] * nalgebra::Point3::from(self.centre[i])).coords))
            .collect()
    }

    /// Torque of gravity on each joint, along its axis (N m).
    pub fn torques(&self, q: &Angles) -> Angles {
        let frames = self.frames(q, &Strain::default());
        std::array::from_fn(|j| {
            let axis = frames[j].rotation * Vector3::z();
            let origin = frames[j].translation.vector;
            let moment: Vector3<f64> = self
                .weights(&frames, j)
                .into_iter()
                .map(|(weight, at)| (at - origin).cross(&Vector3::new(0.0, 0.0, -weight)))
                .sum();
            axis.dot(&moment)
        })
    }

    /// Moment of gravity that overturns what the arm stands on, with a mass (kg) more at the elbow (N m).
    pub fn overturning(&self, q: &Angles, at_elbow_kg: f64) -> Vector3<f64> {
        let frames = self.frames(q, &Strain::default());
        let mut weights = self.weights(&frames, 0);
        weights.push((WEIGHT * at_elbow_kg, frames[2].translation.vector));
        weights.into_iter().map(|(weight, at)| at.cross(&Vector3::new(0.0, 0.0, -weight))).sum()
    }

    /// How the far end of body `beam` moves where the body bends as a beam of constant section, clamped at its joint, under its
    /// own weight spread along it and under everything beyond (Euler and Bernoulli): displacement (mm) and rotation
    /// vector (rad) in the frame at the far end, per 1/(E I) in 1/(N m²).
    pub fn beam(&self, q: &Angles, beam: usize) -> (Vector3<f64>, Vector3<f64>) {
        let frames = self.frames(q, &Strain::default());
        let clamped = frames[beam].translation.vector;
        let tip = frames[beam + 1].translation.vector;
        let length = (tip - clamped).norm() * 1e-3;
        let along = (tip - clamped).normalize();
        let down = -Vector3::z();
        let across = down - along * along.dot(&down);
        let beyond = self.weights(&frames, beam + 1);
        let own = 1e3 * WEIGHT * self.kg[beam];
        let carried: f64 = beyond.iter().map(|(weight, _)| 1e3 * weight).sum();
        let moment: Vector3<f64> =
            beyond.iter().map(|(weight, at)| (at - tip).cross(&(down * *weight))).sum();
        let moment = moment - along * along.dot(&moment);
        let (l2, l3) = (length.powi(2), length.powi(3));
        let sag = across * (own * l3 / 8.0 + carried * l3 / 3.0) + moment.cross(&along) * (l2 / 2.0);
        let slope = along.cross(&across) * (own * l2 / 6.0 + carried * l2 / 2.0) + moment * length;
        let home = frames[beam + 1].rotation.inverse();
        (home * (sag * 1e3), home * slope)
    }
}
