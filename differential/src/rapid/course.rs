//! What the arm does in a run: the joints of every motion as the controller chooses them, and where the links are, which
//! follow with play.

use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion, Vector3};

use super::run::{Goal, Motion, Way};
use crate::arm::{Arm, Pose, difference};
use crate::play::Links;

/// Pieces in which a path is followed where no joint has play.
const PIECES: usize = 64;
/// The same where joints have: between two samples a joint may go farther than at both, by an eighth of its acceleration over
/// the square of their number, and takes its link along. On long arcs joints accelerate by some 10 rad.
const PIECES_WITH_PLAY: usize = 128;
const PIECES_OF_ARCS: usize = 640;

/// A joint that would have to go farther from one piece to the next has no way there (rad).
const MAX_JOINT_STEP_RAD: f64 = 0.6;

/// How often a piece is halved before that is said.
const HALVINGS: u32 = 6;

/// Nearer points (mm), or such that its point and its end are seen from its start under a smaller angle (rad), make no arc: 0.1 mm
/// and 1° (ABB, RAPID, limitations of `MoveC`).
const MIN_DISTANCE_MM: f64 = 0.1;
const MIN_ANGLE_RAD: f64 = std::f64::consts::PI / 180.0;

/// What the controller was told at one goal, and what follows.
#[derive(Debug, Clone)]
pub struct Point {
    /// The flange as told; none for joints that were told.
    pub flange: Pose,
    /// The controller's joints; none where it cannot go there.
    pub joints: Option<[f64; 6]>,
    /// How far each link is before its motor (rad).
    pub behind: [f64; 6],
    /// On which flanks the links lie, in words.
    pub flanks: String,
    /// The direction in which the tool passes a point on its way, where it is held and that is followed: early or late is not
    /// beside the path.
    pub along: Option<Unit<Vector3<f64>>>,
    /// The joints on the way there, where that is followed: the tool is turned as the way turns it.
    pub passing: Option<[f64; 6]>,
    /// Whether the tool is turned so far from what is told at a circle point that the joints there are those of the way.
    pub turned: bool,
    /// Whether the way turns the tool at a circle point otherwise than is told there.
    pub turned_on_way: bool,
    /// Whether the controller stops here since the three points make no arc for it.
    pub no_arc: bool,
    /// Whether the controller has stopped at a motion before that it cannot carry out: how the arm went on is not told.
    pub adrift: bool,
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
    joints: Option<[f64; 6]>,
    /// Where the flange was told to be last, with the tool and object frames it was told in.
    last: Option<Pose>,
    links: Links,
    adrift: bool,
}

impl<'a> Course<'a> {
    /// A start of which nothing is known. `rest`: where in its play each link lies then, from −1 to 1.
    pub fn new(arm: &'a Arm, rest: [f64; 6]) -> Self {
        Self { arm, joints: None, last: None, links: Links::new(arm, rest), adrift: false }
    }

    /// Goes through one motion; a point for each goal.
    pub fn go(&mut self, motion: &Motion) -> Vec<Point> {
        let mut out: Vec<Point> = Vec::new();
        for goal in &motion.goals {
            let (flange, joints) = match goal {
                Goal::Joints(q) => (self.arm.nominal_forward(q), Some(*q)),
                Goal::Pose { in_object, displaced, conf } => {
                    let flange = flange(motion, in_object, displaced);
                    let along = !motion.monitored && motion.way != Way::Joint && !motion.wrist;
                    let joints = if along { None } else { self.choose(&flange, conf, motion.monitored) };
                    (flange, joints)
                }
            };
            let (behind, flanks, adrift) = ([0.0; 6], String::new(), self.adrift);
            out.push(Point {
                flange,
                joints,
                behind,
                flanks,
                along: None,
                passing: None,
                turned: false,
                turned_on_way: false,
                no_arc: false,
                adrift,
            });
        }
        if !motion.monitored && motion.way != Way::Joint && !motion.wrist {
            self.along(motion, &mut out);
        }
        if motion.way == Way::Arc && !self.makes_arc(motion, &out) {
            out.iter_mut().for_each(|point| (point.no_arc, point.joints) = (point.joints.is_some(), None));
        }
        if self.links.have_play() {
            self.follow(motion, &mut out);
        }
        let end = &out[out.len() - 1];
        self.adrift |= end.joints.is_none();
        self.joints = end.joints;
        self.last = Some(end.flange);
        out
    }

    /// Whether the controller takes three points for an arc: it stops where they lie too near to each other or to a line.
    fn makes_arc(&self, motion: &Motion, points: &[Point]) -> bool {
        let (Some(from), [via, to]) = (&self.last, points) else { return true };
        let place = |flange: &Pose| tool_in_object(motion, flange).translation.vector;
        let from = place(from);
        let [via, to] = [via, to].map(|point| place(&point.flange) - from);
        via.norm() >= MIN_DISTANCE_MM && to.norm() >= MIN_DISTANCE_MM && via.angle(&to) >= MIN_ANGLE_RAD
    }

    /// The joints that the controller takes: those of the configuration, or without it those nearest to where it is.
    fn choose(&self, flange: &Pose, conf: &[i32; 4], monitored: bool) -> Option<[f64; 6]> {
        if !monitored {
            return self.arm.nominal_nearest(flange, self.joints.as_ref()?);
        }
        let all = self.arm.nominal_inverse(flange, self.joints.as_ref());
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

    /// The joints of a line or an arc of which no configuration is checked: those to which the way leads that the arm
    /// goes, from where it is.
    fn along(&self, motion: &Motion, points: &mut [Point]) {
        let Some(start) = self.joints else { return };
        let way = self.way(motion, &start, &start, points);
        if way.len() + 1 < self.pieces(motion) {
            return;
        }
        let count = points.len();
        let near_to = |point: &Point, near: &[f64; 6]| {
            let reached = self.arm.nominal_nearest(&point.flange, near);
            reached.filter(|q| (0..6).all(|j| (q[j] - near[j]).abs() < MAX_JOINT_STEP_RAD))
        };
        let (last, before) = way.split_last().map_or((start, &way[..]), |(last, before)| (last.1, before));
        points[count - 1].joints = near_to(&points[count - 1], &last);
        let passing = self.passing(motion, points);
        let [via, _] = points else { return };
        let from = way.iter().rev().find(|(share, _)| *share <= passing).copied().unwrap_or((0.0, start));
        via.joints = near_to(via, &from.1);
        let Some(to) = way.iter().find(|(share, _)| *share > passing).or(before.last()) else { return };
        if via.joints.is_none() {
            // On its way the tool is turned far from what is told at the circle point: what it has there, it has on the way.
            let there = part_of(from, *to, passing);
            let tip = |q: &[f64; 6]| tool_in_object(motion, &self.arm.nominal_forward(q)).translation.vector;
            via.along = Unit::try_new(tip(&to.1) - tip(&from.1), 1e-6);
            (via.joints, via.passing, via.turned) = (Some(there), Some(there), true);
        }
    }

    /// Takes the links along the way.
    fn follow(&mut self, motion: &Motion, points: &mut [Point]) {
        let count = points.len();
        let Some(end) = points[count - 1].joints else { return self.links.lose() };
        let way = match self.joints {
            Some(start) => {
                let way = self.way(motion, &start, &end, points);
                if motion.way != Way::Joint && self.last.is_some() && way.len() + 1 < self.pieces(motion) {
                    // The arm cannot go along the path: how it comes to the end is not told.
                    self.links.lose();
                    Vec::new()
                } else {
                    way
                }
            }
            None => {
                self.links.lose();
                Vec::new()
            }
        };
        let mut passed = false;
        let passing = self.passing(motion, points);
        let whole = way.len() + 1 >= self.pieces(motion);
        let tip = |q: &[f64; 6]| tool_in_object(motion, &self.arm.nominal_forward(q)).translation.vector;
        let mut before = self.joints.map(|joints| (0.0, joints));
        for (share, q) in way.iter().chain([&(1.0, end)]) {
            // The circle point, which is passed on the way; the tool need not be turned there as it is told.
            if count > 1 && !passed && *share >= passing {
                passed = true;
                let between = before.filter(|_| whole).map(|before| part_of(before, (*share, *q), passing));
                let there = between.unwrap_or(*q);
                self.links.go(&there);
                (points[0].behind, points[0].flanks) = (self.links.behind(&there), self.links.flanks(&there));
                let gone = before.filter(|_| motion.tool.1).map(|(_, before)| tip(q) - tip(&before));
                points[0].passing = between;
                let turned =
                    |q: &[f64; 6]| self.arm.nominal_forward(q).rotation.angle_to(&points[0].flange.rotation);
                points[0].turned_on_way = between.as_ref().is_some_and(|q| turned(q) > TURNED);
                points[0].along = gone.and_then(|gone| Unit::try_new(gone, 1e-6));
            }
            self.links.go(q);
            before = Some((*share, *q));
        }
        let last = &mut points[count - 1];
        (last.behind, last.flanks) = (self.links.behind(&end), self.links.flanks(&end));
    }

    fn pieces(&self, motion: &Motion) -> usize {
        match (self.links.have_play(), motion.way) {
            (false, _) => PIECES,
            (true, Way::Arc) => PIECES_OF_ARCS,
            (true, _) => PIECES_WITH_PLAY,
        }
    }

    /// At which share of an arc its point is passed.
    fn passing(&self, motion: &Motion, points: &[Point]) -> f64 {
        let (Some(from), true) = (&self.last, points.len() > 1) else { return 1.0 };
        let place = |flange: &Pose| tool_in_object(motion, flange).translation.vector;
        let arc = Arc::through(&place(from), &place(&points[0].flange), &place(&points[1].flange));
        arc.map_or(0.5, |arc| arc.share(&place(&points[0].flange)))
    }

    /// Joints between the ends of a motion, with the share of the way.
    fn way(
        &self,
        motion: &Motion,
        start: &[f64; 6],
        end: &[f64; 6],
        points: &[Point],
    ) -> Vec<(f64, [f64; 6])> {
        let mut out = Vec::new();
        let (Some(from), true) = (self.last, motion.way != Way::Joint) else { return out };
        let to = points[points.len() - 1].flange;
        // The path is one of the tool, in the object.
        let (a, b) = (tool_in_object(motion, &from), tool_in_object(motion, &to));
        let circle = (motion.way == Way::Arc)
            .then(|| {
                let via = tool_in_object(motion, &points[0].flange);
                let arc =
                    Arc::through(&a.translation.vector, &via.translation.vector, &b.translation.vector)?;
                let turn = arc.turn_within(&a.rotation, &via, &b.rotation);
                Some((arc, turn))
            })
            .flatten();
        let mut near = *start;
        let pieces = self.pieces(motion);
        let tip = |s: f64| match &circle {
            Some((arc, turn)) => {
                let turned = arc.turned(s) * a.rotation * UnitQuaternion::from_scaled_axis(turn * s);
                Isometry3::from_parts(Translation3::from(arc.at(s)), turned)
            }
            None => {
                let place = a.translation.vector.lerp(&b.translation.vector, s);
                Isometry3::from_parts(Translation3::from(place), between(&a.rotation, &b.rotation, s))
            }
        };
        let joints = |s: f64, near: &[f64; 6]| {
            if motion.wrist {
                let wrist = std::array::from_fn(|j| start[j + 3] + (end[j + 3] - start[j + 3]) * s);
                self.with_wrist(motion, &tip(s).translation.vector, near, wrist)
            } else {
                self.arm.nominal_nearest(&flange_of(motion, &tip(s)), near)
            }
        };
        for k in 1..pieces {
            let [from, s] = [k - 1, k].map(|k| k as f64 / pieces as f64);
            match gone(&joints, [from, s], near, HALVINGS) {
                Some(q) => near = q,
                None => break,
            }
            out.push((s, near));
        }
        // The circle point by itself: where the tool turns far, joints between two samples lead beside the path.
        let passing = self.passing(motion, points);
        let before = out.iter().rposition(|(s, _)| *s < passing);
        if let (true, Some(before)) = (circle.is_some() && out.len() + 1 == pieces && passing < 1.0, before)
            && let Some(q) = joints(passing, &out[before].1)
        {
            out.insert(before + 1, (passing, q));
        }
        out
    }

    /// Joints at which the tool's tip is at a place of the object with the last three as they are (SingArea \Wrist).
    fn with_wrist(
        &self,
        motion: &Motion,
        place: &Vector3<f64>,
        near: &[f64; 6],
        wrist: [f64; 3],
    ) -> Option<[f64; 6]> {
        let mut q = *near;
        q[3..].copy_from_slice(&wrist);
        let at = |q: &[f64; 6]| tool_in_object(motion, &self.arm.nominal_forward(q)).translation.vector;
        for _ in 0..12 {
            let here = at(&q);
            let off = place - here;
            if off.norm() < 1e-9 {
                return Some(q);
            }
            let slope = Matrix3::from_columns(&std::array::from_fn::<_, 3, _>(|j| {
                let mut moved = q;
                moved[j] += 1e-6;
                (at(&moved) - here) / 1e-6
            }));
            let step = slope.try_inverse()? * off;
            (0..3).for_each(|j| q[j] += step[j]);
        }
        ((at(&q) - place).norm() < 1e-6).then_some(q)
    }
}

/// Turn of the tool on its way (rad) beside what is told at a circle point from which its joints are those of the way.
const TURNED: f64 = 1e-3;

/// The joints at a share of the way, next to others.
type Reach<'a> = dyn Fn(f64, &[f64; 6]) -> Option<[f64; 6]> + 'a;

/// The joints at the end of a piece of the way, from those at its start; none where a joint would have to leap. Next to a singularity
/// joints are fast, and the piece is halved.
fn gone(joints: &Reach<'_>, piece: [f64; 2], near: [f64; 6], halvings: u32) -> Option<[f64; 6]> {
    let [from, to] = piece;
    let steady = |q: &[f64; 6]| (0..6).all(|j| (q[j] - near[j]).abs() < MAX_JOINT_STEP_RAD);
    if let Some(q) = joints(to, &near).filter(steady) {
        return Some(q);
    }
    let middle = 0.5 * (from + to);
    let half = gone(joints, [from, middle], near, halvings.checked_sub(1)?)?;
    gone(joints, [middle, to], half, halvings - 1)
}

/// Joints at a share of the way between two samples of it.
fn part_of(before: (f64, [f64; 6]), after: (f64, [f64; 6]), share: f64) -> [f64; 6] {
    let part = ((share - before.0) / (after.0 - before.0)).clamp(0.0, 1.0);
    std::array::from_fn(|j| before.1[j] + (after.1[j] - before.1[j]) * part)
}

/// The tool as seen from the object that it works on, but for where the object stands.
fn tool_in_object(motion: &Motion, flange: &Pose) -> Pose {
    match motion.tool.1 {
        true => flange * motion.tool.2,
        false => flange.inverse() * motion.tool.2,
    }
}

/// The flange that holds the tool so.
fn flange_of(motion: &Motion, tip: &Pose) -> Pose {
    match motion.tool.1 {
        true => tip * motion.tool.2.inverse(),
        false => motion.tool.2 * tip.inverse(),
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

    /// At which share of the way a point on it lies.
    pub fn share(&self, point: &Vector3<f64>) -> f64 {
        let off = point - self.centre;
        let angle = self.spoke.cross(&off).dot(&self.axis).atan2(self.spoke.dot(&off));
        angle.rem_euclid(std::f64::consts::TAU) / self.sweep
    }

    /// How far the path itself has turned part of the way.
    pub fn turned(&self, s: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&self.axis, self.sweep * s)
    }

    /// How the tool turns within the frame that goes along with the path, on the whole way: evenly, by the shortest turn,
    /// or by one that is a whole turn longer where that comes clearly nearer to the orientation of the circle point (ABB,
    /// RAPID, `MoveC` and `CirPathMode`).
    fn turn_within(&self, from: &UnitQuaternion<f64>, via: &Pose, to: &UnitQuaternion<f64>) -> Vector3<f64> {
        let short = (from.inverse() * self.turned(-1.0) * to).scaled_axis();
        let axis = short.try_normalize(1e-3).unwrap_or_else(|| from.inverse() * self.axis.into_inner());
        let share = self.share(&via.translation.vector);
        let off = |v: &Vector3<f64>| {
            let there = self.turned(share) * from * UnitQuaternion::from_scaled_axis(v * share);
            there.angle_to(&via.rotation)
        };
        let whole = axis * std::f64::consts::TAU;
        [short - whole, short + whole]
            .iter()
            .fold(short, |best, other| if off(other) + 0.1 < off(&best) { *other } else { best })
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
