//! What the arm does in a run: the joints of every motion as the controller chooses them, and from which side each joint
//! comes.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::run::{Goal, Motion, Way};
use crate::arm::{Arm, Pose, difference};

/// A joint that comes back by less has not turned (rad).
const DEAD_BAND: f64 = 1e-5;

/// A joint that moves by less at the end of a path may as well have turned (rad).
const LITTLE: f64 = 1e-3;

/// What the controller was told at one goal, and what follows.
#[derive(Debug, Clone)]
pub struct Point {
    /// The flange as told; none for joints that were told.
    pub flange: Pose,
    /// The controller's joints; none where it cannot go there.
    pub joints: Option<[f64; 6]>,
    /// The side from which each joint comes.
    pub approach: [i8; 6],
    /// Whether that hangs on less than can be told.
    pub doubt: [bool; 6],
}

/// Where the flange must be for a goal.
pub fn flange(motion: &Motion, in_object: &Pose, displaced: &Pose) -> Pose {
    let (_, object_held, user, object) = &motion.object;
    let (_, tool_held, tool) = &motion.tool;
    let target = user * object * displaced * in_object;
    match (tool_held, object_held) {
        // The part stands on the flange, the tool in the room.
        (false, true) => tool * target.inverse(),
        _ => target * tool.inverse(),
    }
}

/// Follows an arm through a program.
pub struct Course<'a> {
    arm: &'a Arm,
    play: bool,
    joints: Option<[f64; 6]>,
    /// Where the flange was told to be last, with the tool and object frames it was told in.
    last: Option<Pose>,
    sides: [i8; 6],
    farthest: [f64; 6],
    /// Where each joint turned last.
    turned_at: [f64; 6],
    doubt: [bool; 6],
}

impl<'a> Course<'a> {
    /// A start of which nothing is known but the sides.
    pub fn new(arm: &'a Arm, sides: [i8; 6]) -> Self {
        let play = arm.play.iter().any(|p| *p != 0.0);
        Self {
            arm,
            play,
            joints: None,
            last: None,
            sides,
            farthest: [f64::NAN; 6],
            turned_at: [f64::NAN; 6],
            doubt: [false; 6],
        }
    }

    /// Goes through one motion; a point for each goal.
    pub fn go(&mut self, motion: &Motion) -> Vec<Point> {
        let mut out: Vec<Point> = Vec::new();
        for goal in &motion.goals {
            let (flange, joints) = match goal {
                Goal::Joints(q) => (self.arm.nominal_forward(q), Some(*q)),
                Goal::Pose { in_object, displaced, conf } => {
                    let flange = flange(motion, in_object, displaced);
                    (flange, self.choose(&flange, conf, motion.monitored))
                }
            };
            out.push(Point { flange, joints, approach: self.sides, doubt: self.doubt });
        }
        if self.play {
            self.follow(motion, &mut out);
        }
        let end = &out[out.len() - 1];
        self.joints = end.joints;
        self.last = Some(end.flange);
        out
    }

    /// The joints that the controller takes: those of the configuration, or without it those nearest to where it is.
    fn choose(&self, flange: &Pose, conf: &[i32; 4], monitored: bool) -> Option<[f64; 6]> {
        let all = self.arm.nominal_inverse(flange, self.joints.as_ref());
        if !monitored {
            self.joints?;
            return all.first().copied();
        }
        let outside = |q: &[f64; 6]| {
            let quarter = std::f64::consts::FRAC_PI_2;
            [(0, 0), (3, 1), (5, 2)].into_iter().fold(0.0, |most: f64, (joint, word)| {
                let low = f64::from(conf[word]) * quarter;
                most.max(low - q[joint]).max(q[joint] - low - quarter)
            })
        };
        let branch = |q: &[f64; 6]| self.arm.configuration(q)[3] == conf[3];
        all.into_iter().find(|q| branch(q) && outside(q) < 1e-6)
    }

    /// Takes every joint along the way.
    fn follow(&mut self, motion: &Motion, points: &mut [Point]) {
        let Some(end) = points[points.len() - 1].joints else {
            self.doubt = [true; 6];
            self.farthest = [f64::NAN; 6];
            return;
        };
        let Some(start) = self.joints else {
            self.farthest = end;
            self.doubt = [true; 6];
            points.iter_mut().for_each(|p| p.doubt = self.doubt);
            return;
        };
        let before = self.sides;
        let way = self.way(motion, &start, &end, points);
        let mut turned = [false; 6];
        for q in way.iter().chain([&end]) {
            for j in 0..6 {
                self.turn(j, q[j]);
                turned[j] |= self.sides[j] != before[j];
            }
        }
        let last = way.last().unwrap_or(&start);
        for j in 0..6 {
            let moved = |from: f64| (end[j] - from).abs();
            // A joint that has come back by hardly more, or hardly less, than the dead band, or that comes to rest where it
            // might just have turned.
            let near = moved(self.farthest[j]) > 1e-7 && moved(self.farthest[j]) < 1e-4;
            let hardly = moved(start[j]) < 1e-4 && moved(start[j]) > 1e-8;
            let resting = !way.is_empty()
                && (moved(last[j]) < LITTLE || turned[j] && moved(self.turned_at[j]) < LITTLE);
            // How the tool turns along an arc is the controller's own affair.
            if near || hardly || resting || turned[j] && motion.way == Way::Arc {
                self.doubt[j] = true;
            }
        }
        let count = points.len();
        for (k, point) in points.iter_mut().enumerate() {
            point.approach = self.sides;
            point.doubt = self.doubt;
            if k + 1 < count {
                // Somewhere on the arc.
                (0..6).for_each(|j| point.doubt[j] |= turned[j]);
            }
        }
    }

    fn turn(&mut self, j: usize, angle: f64) {
        if self.farthest[j].is_nan() {
            self.farthest[j] = angle;
        }
        let gone = angle - self.farthest[j];
        let side = if gone > 0.0 { -1 } else { 1 };
        if self.sides[j] == side {
            self.farthest[j] = angle;
            if gone.abs() > 1e-3 {
                self.doubt[j] = false;
            }
        } else if gone.abs() > DEAD_BAND {
            self.sides[j] = side;
            self.turned_at[j] = self.farthest[j];
            self.farthest[j] = angle;
            if gone.abs() > 1e-3 {
                self.doubt[j] = false;
            }
        }
    }

    /// Joints between the ends of a motion.
    fn way(&self, motion: &Motion, start: &[f64; 6], end: &[f64; 6], points: &[Point]) -> Vec<[f64; 6]> {
        let mut out = Vec::new();
        let (Some(from), true) = (self.last, motion.way != Way::Joint) else { return out };
        let to = points[points.len() - 1].flange;
        // The path is one of the tool, in the object.
        let tool = |flange: &Pose| match motion.tool.1 {
            true => flange * motion.tool.2,
            false => flange.inverse() * motion.tool.2,
        };
        let back = |tip: Pose| match motion.tool.1 {
            true => tip * motion.tool.2.inverse(),
            false => motion.tool.2 * tip.inverse(),
        };
        let (a, b) = (tool(&from), tool(&to));
        let circle = (motion.way == Way::Arc)
            .then(|| {
                Arc::through(
                    &a.translation.vector,
                    &tool(&points[0].flange).translation.vector,
                    &b.translation.vector,
                )
            })
            .flatten();
        let mut near = *start;
        const PIECES: usize = 24;
        for k in 1..PIECES {
            let s = k as f64 / PIECES as f64;
            let turn = between(&a.rotation, &b.rotation, s);
            let place = match &circle {
                Some(arc) => arc.at(s),
                None => a.translation.vector.lerp(&b.translation.vector, s),
            };
            let flange = back(Isometry3::from_parts(Translation3::from(place), turn));
            match self.arm.nominal_inverse(&flange, Some(&near)).first() {
                Some(q) if (0..6).all(|j| (q[j] - near[j]).abs() < 0.6) => near = *q,
                _ => break,
            }
            out.push(near);
        }
        let _ = end;
        out
    }
}

/// A turn part of the way.
pub fn between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, s: f64) -> UnitQuaternion<f64> {
    let turn = (a.inverse() * b).scaled_axis();
    a * UnitQuaternion::from_scaled_axis(turn * s)
}

/// A circular arc.
pub struct Arc {
    centre: Vector3<f64>,
    spoke: Vector3<f64>,
    axis: Unit<Vector3<f64>>,
    sweep: f64,
}

impl Arc {
    /// The arc from `a` through `via` to `b`.
    pub fn through(a: &Vector3<f64>, via: &Vector3<f64>, b: &Vector3<f64>) -> Option<Self> {
        let (u, v) = (via - a, b - a);
        let normal = u.cross(&v);
        let square = normal.norm_squared();
        if !(square > 1e-9) {
            return None;
        }
        let centre =
            a + (normal.cross(&u) * v.norm_squared() + v.cross(&normal) * u.norm_squared()) / (2.0 * square);
        let axis = Unit::new_normalize(normal);
        let spoke = a - centre;
        let end = b - centre;
        let sweep = spoke.cross(&end).dot(&axis).atan2(spoke.dot(&end)).rem_euclid(std::f64::consts::TAU);
        Some(Self { centre, spoke, axis, sweep })
    }

    /// A point part of the way.
    pub fn at(&self, s: f64) -> Vector3<f64> {
        self.centre + UnitQuaternion::from_axis_angle(&self.axis, self.sweep * s) * self.spoke
    }
}

/// Whether two told poses are one.
pub fn same(a: &Pose, b: &Pose) -> bool {
    let (mm, rad) = difference(a, b);
    mm < 1e-7 && rad < 2e-8
}
