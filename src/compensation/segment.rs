//! The path between two targets: how far the told line bends under the estimated arm, and which targets straighten it.

use nalgebra::{Point3, Vector3};

use super::circumstance::picked;
use super::mounting::Mounted;
use super::rewrite::{Arms, Emit, Options, extra_of, gap};
use crate::kinematics::model::Joints;
use crate::math::se3::Pose;
use crate::program::motion::SpeedValue;
use crate::program::rewrite::Extra;

/// A corrected end of a motion.
#[derive(Clone)]
pub(super) struct Ends<'a> {
    pub(super) mounted: &'a Mounted,
    pub(super) index: usize,
    /// Intended pose in the work object.
    pub(super) meant: Pose,
    /// What the controller is told.
    pub(super) told: Pose,
    /// Joints there.
    pub(super) joints: Joints,
    /// The condition under which the arm comes there.
    pub(super) place: usize,
}

/// Under which condition the arm goes along a path: from a share of the way on, a place in the list of conditions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Way {
    /// From the start on.
    pub(super) first: usize,
    /// Where it changes, because a joint turns: share of the way, and from there on.
    pub(super) later: Vec<(f64, usize)>,
}

impl Way {
    fn at(&self, s: f64) -> usize {
        self.later.iter().rev().find(|(from, _)| *from <= s).map_or(self.first, |later| later.1)
    }

    /// At which shares of the way from `start` the arm jumps by a play: before, and after.
    fn jumps(&self, start: &Ends<'_>) -> Vec<Jump> {
        let mut out = Vec::new();
        let mut last = start.place;
        for (share, place) in std::iter::once((0.0, self.first)).chain(self.later.iter().copied()) {
            if place != last {
                out.push(Jump { share, before: last, after: place });
            }
            last = place;
        }
        out
    }
}

/// A joint turns on the way, and the arm takes up its play.
struct Jump {
    share: f64,
    before: usize,
    after: usize,
}

/// A path between two corrected ends.
pub(super) struct Path<'a> {
    pub(super) from: Ends<'a>,
    pub(super) to: Ends<'a>,
    pub(super) way: Way,
}

/// Position straight, orientation by the shortest turn: as controllers interpolate a linear motion.
pub(super) fn between(from: &Pose, to: &Pose, s: f64) -> Pose {
    let position = from.translation.vector.lerp(&to.translation.vector, s);
    let rotation = from.rotation.try_slerp(&to.rotation, s, 1e-9).unwrap_or(from.rotation);
    Pose::from_parts(position.into(), rotation)
}

/// How far the tool is from the intended line at share `s` of the way; infinite where the nominal arm cannot go.
fn off_at(from: &Ends<'_>, to: &Ends<'_>, s: f64, place: usize, arms: &Arms<'_>, emit: Emit) -> f64 {
    let joints = from.joints.lerp(&to.joints, s);
    let joints = match emit {
        Emit::Joints => joints,
        Emit::Targets => {
            let told = between(&from.told, &to.told, s);
            match arms.nominal.solve_near(&to.mounted.told.flange_for(&told), &joints) {
                Ok(solution) => solution.joints,
                Err(_) => return f64::INFINITY,
            }
        }
    };
    off_line(from, to, s, &arms.acting.arm(place).forward(&joints))
}

/// How far the tool is from the intended line at share `s` of the way, with the flange where it is then.
///
/// Along the line the tool may be early or late: only what lies beside the line counts, unless it is too short.
fn off_line(from: &Ends<'_>, to: &Ends<'_>, s: f64, flange: &Pose) -> f64 {
    let reached = to.mounted.real.target_of(flange);
    let meant = from.meant.translation.vector.lerp(&to.meant.translation.vector, s);
    let off = reached.translation.vector - meant;
    let along = to.meant.translation.vector - from.meant.translation.vector;
    match along.try_normalize(1e-6) {
        Some(direction) => (off - direction * direction.dot(&off)).norm(),
        None => off.norm(),
    }
}

/// [`off_at`] the middle of many lines, in lanes.
pub(super) fn middles_off(lines: &[&Path<'_>], arms: &Arms<'_>, emit: Emit) -> Vec<f64> {
    let halfway: Vec<Joints> = lines.iter().map(|line| line.from.joints.lerp(&line.to.joints, 0.5)).collect();
    let joints: Vec<Option<Joints>> = match emit {
        Emit::Joints => halfway.into_iter().map(Some).collect(),
        Emit::Targets => {
            let told = |line: &&Path<'_>| {
                line.to.mounted.told.flange_for(&between(&line.from.told, &line.to.told, 0.5))
            };
            let flanges: Vec<Pose> = lines.iter().map(told).collect();
            let solved = arms.nominal.solve_seeded(&flanges, &halfway);
            solved.into_iter().map(|s| s.ok().map(|s| s.joints)).collect()
        }
    };
    let places: Vec<usize> = lines.iter().map(|line| line.way.at(0.5)).collect();
    arms.acting.each(&places, |place, items| {
        let chosen = items.map(|items| picked(&joints, items));
        let chosen = chosen.as_deref().unwrap_or(&joints);
        let known: Vec<Joints> = chosen.iter().flatten().copied().collect();
        let mut flanges = arms.acting.arm(place).forward_many(&known).into_iter();
        chosen
            .iter()
            .enumerate()
            .map(|(k, joints)| {
                let line = lines[items.map_or(k, |items| items[k])];
                match joints.and_then(|_| flanges.next()) {
                    Some(flange) => off_line(&line.from, &line.to, 0.5, &flange),
                    None => f64::INFINITY,
                }
            })
            .collect()
    })
}

/// Longest piece of a line that is judged by three samples (mm).
const PIECE_MM: f64 = 100.0;

/// Largest distance from the intended line along a path (mm): that of the `middle`, which is given, and where that is not
/// clearly straight of samples that get denser until they tell the distance to [`CHORD_MM`]. Where a joint turns and the
/// arm takes up its play, both sides of the jump count.
pub(super) fn straight_bend(path: &Path<'_>, arms: &Arms<'_>, emit: Emit, middle: f64) -> f64 {
    let Path { from, to, way } = path;
    let jumps = way.jumps(from);
    if jumps.is_empty() {
        return even_bend(from, to, to.place, arms, emit, middle);
    }
    let pieces = pieces_of(from, to);
    let even = largest(pieces, &|s| off_at(from, to, s, way.at(s), arms, emit));
    let at_jumps = jumps.iter().flat_map(|jump| {
        let off = |place: usize| off_at(from, to, jump.share, place, arms, emit);
        [if jump.share > 0.0 { off(jump.before) } else { 0.0 }, off(jump.after)]
    });
    at_jumps.fold(even.max(middle), f64::max)
}

/// The same where no joint turns on the way.
fn even_bend(from: &Ends<'_>, to: &Ends<'_>, place: usize, arms: &Arms<'_>, emit: Emit, middle: f64) -> f64 {
    let length = gap(&from.meant.translation.vector, &to.meant.translation.vector);
    let turn = from.meant.rotation.angle_to(&to.meant.rotation);
    if length < PIECE_MM && turn < 0.2 && middle < CLEARLY_STRAIGHT_MM {
        return middle;
    }
    largest(pieces_of(from, to), &|s| off_at(from, to, s, place, arms, emit)).max(middle)
}

fn pieces_of(from: &Ends<'_>, to: &Ends<'_>) -> usize {
    let length = gap(&from.meant.translation.vector, &to.meant.translation.vector);
    ((length / PIECE_MM).ceil() as usize).clamp(1, 25) * 2
}

/// Between two samples the distance from the intended path is known to this (mm): their chord leaves the distance half
/// way by no more.
const CHORD_MM: f64 = 0.002;

/// How often a piece is halved at most.
const HALVINGS: u32 = 5;

/// The largest value of a function over a path, which is 0 at both ends: equal pieces, each halved until its chord tells
/// its middle to [`CHORD_MM`].
fn largest(pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    let at = |k: usize| if k == 0 || k == pieces { 0.0 } else { off(k as f64 / pieces as f64) };
    let mut most = 0.0_f64;
    let mut before = at(0);
    for k in 0..pieces {
        let after = at(k + 1);
        let (begin, end) = (k as f64 / pieces as f64, (k + 1) as f64 / pieces as f64);
        most = most.max(after).max(between_samples((begin, before), (end, after), off, HALVINGS));
        before = after;
    }
    most
}

fn between_samples(a: (f64, f64), b: (f64, f64), off: &dyn Fn(f64) -> f64, halvings: u32) -> f64 {
    let s = 0.5 * (a.0 + b.0);
    let middle = off(s);
    // A path that cannot be gone is told by its first sample.
    if halvings == 0 || !middle.is_finite() || (middle - 0.5 * (a.1 + b.1)).abs() <= CHORD_MM {
        return middle;
    }
    let halves = [
        between_samples(a, (s, middle), off, halvings - 1),
        between_samples((s, middle), b, off, halvings - 1),
    ];
    halves[0].max(halves[1]).max(middle)
}

/// Below this the middle of a short line tells enough: the bend is a parabola to leading order.
const CLEARLY_STRAIGHT_MM: f64 = 0.01;

/// Targets that keep the path within tolerance, and the bend that is left: one where a joint turns, at which the arm takes
/// up its play, and between those by bisection.
pub(super) fn insertions(path: &Path<'_>, arms: &Arms<'_>, options: &Options) -> (Vec<Extra>, f64) {
    let Path { from, to, way } = path;
    let mut extra = Vec::new();
    let mut left = 0.0_f64;
    let mut begin = from.clone();
    for jump in way.jumps(from) {
        let at = |place: usize| end_between(from, to, jump.share, place, arms);
        if jump.share > 0.0
            && let Some(arrived) = at(jump.before)
        {
            left = left.max(split(&begin, &arrived, arms, options, MAX_DEPTH, &mut extra));
            extra.push(extra_of(&arrived.told, &arrived.joints, options.emit));
        }
        let Some(taken_up) = at(jump.after) else { continue };
        extra.push(extra_of(&taken_up.told, &taken_up.joints, options.emit));
        begin = taken_up;
    }
    left = left.max(split(&begin, to, arms, options, MAX_DEPTH, &mut extra));
    (extra, left)
}

/// A point of the intended line as a corrected end, under a condition.
fn end_between<'a>(
    from: &Ends<'a>,
    to: &Ends<'a>,
    s: f64,
    place: usize,
    arms: &Arms<'_>,
) -> Option<Ends<'a>> {
    let meant = between(&from.meant, &to.meant, s);
    let near = from.joints.lerp(&to.joints, s);
    let joints =
        arms.acting.inverse(place).solve_near(&to.mounted.real.flange_for(&meant), &near).ok()?.joints;
    let told = to.mounted.told.target_of(&arms.nominal.arm().forward(&joints));
    Some(Ends { mounted: to.mounted, index: to.index, meant, told, joints, place })
}

/// 63 targets at most on one line: more means that the line cannot be followed.
const MAX_DEPTH: usize = 6;

fn split(
    from: &Ends<'_>,
    to: &Ends<'_>,
    arms: &Arms<'_>,
    options: &Options,
    depth: usize,
    extra: &mut Vec<Extra>,
) -> f64 {
    let middle = off_at(from, to, 0.5, to.place, arms, options.emit);
    let bend = even_bend(from, to, to.place, arms, options.emit, middle);
    if bend <= options.tolerance_mm || depth == 0 {
        return bend;
    }
    let Some(middle) = end_between(from, to, 0.5, to.place, arms) else { return bend };
    let first = split(from, &middle, arms, options, depth - 1, extra);
    extra.push(extra_of(&middle.told, &middle.joints, options.emit));
    let second = split(&middle, to, arms, options, depth - 1, extra);
    first.max(second)
}

/// Largest distance of the tool from the intended circle, both circles through their three points, sampled along the
/// arc until the samples tell it to [`CHORD_MM`]; infinite where three points make no circle, `None` for a whole one.
pub(super) fn circle_bend(
    path: &Path<'_>,
    via_meant: &Pose,
    via_told: &Pose,
    arms: &Arms<'_>,
) -> Option<f64> {
    let Path { from, to, way } = path;
    let point = |p: &Pose| Point3::from(p.translation.vector);
    let closed = gap(&from.meant.translation.vector, &to.meant.translation.vector) < 1e-6;
    if closed {
        return None;
    }
    let meant = Arc::through(&point(&from.meant), &point(via_meant), &point(&to.meant));
    let told = Arc::through(&point(&from.told), &point(via_told), &point(&to.told));
    let (Some(meant), Some(told)) = (meant, told) else { return Some(f64::INFINITY) };
    let off = |s: f64| {
        let rotation = between(&from.told, &to.told, s).rotation;
        let pose = Pose::from_parts(told.at(s).coords.into(), rotation);
        let near = from.joints.lerp(&to.joints, s);
        match arms.nominal.solve_near(&to.mounted.told.flange_for(&pose), &near) {
            Ok(solution) => {
                let flange = arms.acting.arm(way.at(s)).forward(&solution.joints);
                let reached = to.mounted.real.target_of(&flange);
                meant.distance(&point(&reached))
            }
            Err(_) => f64::INFINITY,
        }
    };
    // At least every eighth of a turn, and every piece of a long arc.
    let pieces = ((meant.sweep / std::f64::consts::FRAC_PI_4).ceil() as usize)
        .max((meant.sweep * meant.radius / PIECE_MM).ceil() as usize)
        .clamp(4, 64);
    Some(largest(pieces, &off))
}

/// The joint that turns fastest for what it can, with its speed over its limit, at a speed along a path of this length
/// and turn; `None` where the path or the limits say nothing.
pub(super) fn fastest(
    from: &Ends<'_>,
    to: &Ends<'_>,
    length_mm: f64,
    speed: &SpeedValue,
    arms: &Arms<'_>,
) -> Option<(usize, f64)> {
    let limits = arms.nominal.arm().model.limits.speed_rad_s?;
    let turn_deg = from.meant.rotation.angle_to(&to.meant.rotation).to_degrees();
    let duration_s = (length_mm / speed.tcp_mm_s).max(turn_deg / speed.orientation_deg_s);
    if !(duration_s > 1e-6 && duration_s.is_finite()) {
        return None;
    }
    // Speeds along a line follow its parts; joints at the parts of a long or turning one are worked out.
    let parts = ((length_mm / 50.0).ceil() as usize).max((turn_deg / 10.0).ceil() as usize).clamp(1, 40);
    let mut worst: Option<(usize, f64)> = None;
    let mut before = from.joints;
    for part in 1..=parts {
        let s = part as f64 / parts as f64;
        let joints = if part == parts {
            to.joints
        } else {
            let told = between(&from.told, &to.told, s);
            let near = from.joints.lerp(&to.joints, s);
            arms.nominal.solve_near(&to.mounted.told.flange_for(&told), &near).ok()?.joints
        };
        for joint in 0..6 {
            let ratio = (joints[joint] - before[joint]).abs() * parts as f64 / duration_s / limits[joint];
            if worst.is_none_or(|(_, most)| ratio > most) {
                worst = Some((joint, ratio));
            }
        }
        before = joints;
    }
    worst
}

/// An arc from its start over a point to its end.
pub(super) struct Arc {
    centre: Point3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
    radius: f64,
    /// Angle from start to end (rad).
    pub(super) sweep: f64,
}

impl Arc {
    /// From start to end (mm).
    pub(super) fn length(&self) -> f64 {
        self.radius * self.sweep
    }

    /// The arc through three points; `None` where they are in line or coincide.
    pub(super) fn through(start: &Point3<f64>, via: &Point3<f64>, end: &Point3<f64>) -> Option<Self> {
        let (a, b) = (via - start, end - start);
        let normal = a.cross(&b);
        let square = normal.norm_squared();
        if square < 1e-9 {
            return None;
        }
        let to_centre =
            (normal.cross(&a) * b.norm_squared() + b.cross(&normal) * a.norm_squared()) / (2.0 * square);
        let centre = start + to_centre;
        let radius = to_centre.norm();
        let x = -to_centre / radius;
        let y = normal.normalize().cross(&x);
        let to_end = end - centre;
        let sweep = to_end.dot(&y).atan2(to_end.dot(&x)).rem_euclid(std::f64::consts::TAU);
        Some(Self { centre, x, y, radius, sweep })
    }

    pub(super) fn at(&self, s: f64) -> Point3<f64> {
        let (sin, cos) = (self.sweep * s).sin_cos();
        self.centre + (self.x * cos + self.y * sin) * self.radius
    }

    fn distance(&self, point: &Point3<f64>) -> f64 {
        let off = point - self.centre;
        let height = off.dot(&self.x.cross(&self.y));
        let (u, v) = (off.dot(&self.x), off.dot(&self.y));
        (u.hypot(v) - self.radius).hypot(height)
    }
}
