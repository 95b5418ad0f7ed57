//! From which side each joint comes to rest, from the program's own motion.
//!
//! A joint with play rests on the flank against which it moved last, so the side at a target follows from the joints on
//! the way to it. Every joint has a turning point: the farthest it went in the direction in which it moves. Once it has
//! come back from there by more than [`DEAD_BAND_RAD`] it moves the other way, and did so from the turning point on. A
//! joint that does not move keeps its side. Nothing is known at the start of a program and after a motion that the text
//! does not tell; side 0 then stands for the middle of the play.
//!
//! Lines and arcs are sampled between their ends, and a parabola through neighbouring samples tells where between them
//! a joint turned.

use super::curve::{Arc, between};
use super::effort;
use super::mounting::Mounting;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::MotionKind;

/// The side from which each joint came: −1 from below, +1 from above, 0 not known.
pub(super) type Sides = [i8; 6];

/// A joint that comes back by less has not turned (rad): what a drive at rest may stray by, 0.005 mm at half a metre.
pub(super) const DEAD_BAND_RAD: f64 = 1e-5;

/// Samples on a path are no farther apart than this (mm, rad).
const SAMPLE_MM: f64 = 25.0;
const SAMPLE_RAD: f64 = 0.1;
/// No path has more samples.
const MOST_SAMPLES: usize = 24;

/// Where a motion ends.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stop {
    /// The arm does not move (external axes alone).
    Stays,
    /// The text does not tell where the arm is afterwards.
    Lost,
    /// At joints that are known.
    At(Reached),
}

/// The end of a motion with what is known of the way to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reached {
    /// How the arm goes there.
    pub(super) kind: MotionKind,
    /// Index of the mounting.
    pub(super) mounted: usize,
    /// What the controller is told, in the work object.
    pub(super) told: Pose,
    /// Joints there.
    pub(super) joints: Joints,
    /// The point on the arc of a circular motion.
    pub(super) via: Option<Pose>,
}

/// The sides on the way to the end of a motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Course {
    /// At the share 0 of the way, and from each share on at which a joint turns.
    pub(super) turns: Vec<(f64, Sides)>,
    /// At the end.
    pub(super) end: Sides,
}

impl Course {
    /// The sides at a share of the way.
    pub(super) fn at(&self, s: f64) -> Sides {
        self.turns.iter().rev().find(|(from, _)| *from <= s).map_or(self.end, |turn| turn.1)
    }

    /// Calls every side unknown in which the course ends otherwise than `other`.
    pub(super) fn agree(&mut self, other: &Self) {
        for joint in 0..6 {
            if self.end[joint] != other.end[joint] {
                self.end[joint] = 0;
                self.turns.iter_mut().for_each(|(_, sides)| sides[joint] = 0);
            }
        }
    }
}

/// What one joint did last.
#[derive(Debug, Clone, Copy, Default)]
struct Track {
    side: i8,
    /// The turning point, or where the joint stood when nothing was known of it (rad).
    farthest: f64,
    /// At which share of the present motion that was.
    since: f64,
}

impl Track {
    /// The joint goes on to `angle`; hands back where it turned, if it did.
    fn go(&mut self, angle: f64, share: f64) -> Option<f64> {
        let gone = angle - self.farthest;
        // A joint that moves up came from below.
        let side = if gone > 0.0 { -1 } else { 1 };
        if self.side == side {
            (self.farthest, self.since) = (angle, share);
        } else if gone.abs() > DEAD_BAND_RAD {
            let turned = self.since;
            *self = Self { side, farthest: angle, since: share };
            return Some(turned);
        }
        None
    }
}

/// The sides along all motions. `before[m]`: the motion that ended where motion m starts.
pub(super) fn courses(
    stops: &[Stop],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    mounting: &dyn Fn(usize) -> Mounting,
) -> Vec<Course> {
    let mut samples = Samples::default();
    for (stop, before) in stops.iter().zip(before) {
        let from = before.and_then(|m| stops.get(m as usize));
        samples.of(from, stop, mounting);
    }
    let joints = nominal.solve_seeded_within(&samples.flanges, &samples.seeds, effort::SIDES);
    let mut tracks: Vec<Option<[Track; 6]>> = Vec::with_capacity(stops.len());
    let mut out = Vec::with_capacity(stops.len());
    for (m, stop) in stops.iter().enumerate() {
        let from = before[m].map(|b| b as usize).filter(|b| *b < m);
        let mut track = from.and_then(|b| tracks[b]);
        let mut course = Course::default();
        match stop {
            Stop::Lost => track = None,
            Stop::Stays => course.end = track.map_or([0; 6], |track| track.map(|t| t.side)),
            Stop::At(reached) => {
                let start = from.and_then(|b| match &stops[b] {
                    Stop::At(start) => Some(start.joints),
                    _ => None,
                });
                let mut here = track.unwrap_or_else(|| {
                    let at = start.unwrap_or(reached.joints);
                    std::array::from_fn(|j| Track { side: 0, farthest: at[j], since: 0.0 })
                });
                here.iter_mut().for_each(|t| t.since = 0.0);
                let mut way: Vec<(f64, Joints)> = Vec::new();
                way.extend(start.map(|joints| (0.0, joints)));
                for k in samples.range(m) {
                    if let Ok(solution) = &joints[k] {
                        way.push((samples.shares[k], solution.joints));
                    }
                }
                way.push((1.0, reached.joints));
                course = follow(&mut here, &way);
                track = Some(here);
            }
        }
        tracks.push(track);
        out.push(course);
    }
    out
}

/// Takes all joints along a way.
fn follow(tracks: &mut [Track; 6], way: &[(f64, Joints)]) -> Course {
    let mut sides = tracks.map(|t| t.side);
    let mut turned: Vec<(f64, usize, i8)> = Vec::new();
    for (joint, track) in tracks.iter_mut().enumerate() {
        let mut go = |share: f64, angle: f64| {
            if let Some(at) = track.go(angle, share) {
                turned.push((at, joint, track.side));
            }
        };
        for (k, (share, joints)) in way.iter().enumerate() {
            if k > 0
                && let Some((share, angle)) = turning_point(way, k, joint)
            {
                go(share, angle);
            }
            go(*share, joints[joint]);
        }
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut turns = vec![(0.0, sides)];
    for (share, joint, side) in turned {
        sides[joint] = side;
        match turns.last_mut() {
            Some(last) if share - last.0 < 1e-6 => last.1 = sides,
            _ => turns.push((share, sides)),
        }
    }
    Course { turns, end: sides }
}

/// Where between samples k − 1 and k a joint turns: the vertex of a parabola through these two and a neighbour.
fn turning_point(way: &[(f64, Joints)], k: usize, joint: usize) -> Option<(f64, f64)> {
    let first = match k {
        _ if way.len() < 3 => return None,
        1 => 0,
        _ => k - 2,
    };
    let [a, b, c] = [0, 1, 2].map(|i| (way[first + i].0, way[first + i].1[joint]));
    // Newton's form: f(s) = f(a) + d1 (s − a) + d2 (s − a)(s − b).
    let d1 = (b.1 - a.1) / (b.0 - a.0);
    let d2 = ((c.1 - b.1) / (c.0 - b.0) - d1) / (c.0 - a.0);
    let vertex = 0.5 * (a.0 + b.0) - 0.5 * d1 / d2;
    let within = vertex > way[k - 1].0 && vertex < way[k].0;
    within.then_some((vertex, a.1 + d1 * (vertex - a.0) + d2 * (vertex - a.0) * (vertex - b.0)))
}

/// Points between the ends of all motions.
#[derive(Default)]
struct Samples {
    /// Where those of each motion end.
    ends: Vec<usize>,
    shares: Vec<f64>,
    flanges: Vec<Pose>,
    seeds: Vec<Joints>,
}

impl Samples {
    fn range(&self, motion: usize) -> std::ops::Range<usize> {
        let begin = motion.checked_sub(1).map_or(0, |m| self.ends[m]);
        begin..self.ends[motion]
    }

    fn of(&mut self, from: Option<&Stop>, stop: &Stop, mounting: &dyn Fn(usize) -> Mounting) {
        if let (Some(Stop::At(from)), Stop::At(to)) = (from, stop) {
            // The path is one of the tool and in the object of the motion, also where it begins under others.
            let within = mounting(to.mounted);
            let mut from = *from;
            if from.mounted != to.mounted {
                from.told = within.target_of(&mounting(from.mounted).flange_for(&from.told));
            }
            match to.kind {
                MotionKind::Linear => self.line(&from, to, &within),
                MotionKind::Circular => self.arc(&from, to, &within),
                // Joints in proportion: none turns on the way.
                _ => {}
            }
        }
        self.ends.push(self.shares.len());
    }

    fn line(&mut self, from: &Reached, to: &Reached, mounting: &Mounting) {
        let length = (to.told.translation.vector - from.told.translation.vector).norm();
        let pieces = pieces(length, from.told.rotation.angle_to(&to.told.rotation));
        for k in 1..pieces {
            let s = k as f64 / pieces as f64;
            self.push(s, mounting.flange_for(&between(&from.told, &to.told, s)), from, to);
        }
    }

    fn arc(&mut self, from: &Reached, to: &Reached, mounting: &Mounting) {
        let point = |pose: &Pose| nalgebra::Point3::from(pose.translation.vector);
        let Some(via) = to.via else { return };
        let Some(arc) = Arc::through(&point(&from.told), &point(&via), &point(&to.told), None) else {
            return;
        };
        let pieces = pieces(arc.length_mm(), arc.sweep.max(from.told.rotation.angle_to(&to.told.rotation)));
        for k in 1..pieces {
            let s = k as f64 / pieces as f64;
            let rotation = between(&from.told, &to.told, s).rotation;
            self.push(s, mounting.flange_for(&Pose::from_parts(arc.at(s).coords.into(), rotation)), from, to);
        }
    }

    fn push(&mut self, s: f64, flange: Pose, from: &Reached, to: &Reached) {
        self.shares.push(s);
        self.flanges.push(flange);
        self.seeds.push(from.joints.lerp(&to.joints, s));
    }
}

/// Pieces of a path: at least two, so that one sample tells of a joint that turns half way.
fn pieces(length_mm: f64, turn_rad: f64) -> usize {
    let wanted = (length_mm / SAMPLE_MM).max(turn_rad / SAMPLE_RAD).ceil();
    (wanted as usize).clamp(2, MOST_SAMPLES)
}
