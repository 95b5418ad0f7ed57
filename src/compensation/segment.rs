//! The path between two targets: how far the told line bends under the estimated arm, and which targets straighten it.

use nalgebra::Vector3;

use super::circumstance::picked;
use super::curve::{beside, between};
use super::mounting::Mounted;
use super::rewrite::{Arms, Emit, Options};
use crate::kinematics::model::Joints;
use crate::math::se3::Pose;
use crate::program::motion::MotionKind;
use crate::program::rewrite::{Extra, NewTarget};

/// A corrected end of a motion.
#[derive(Clone, Copy)]
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
    /// Joints there with the program as it is.
    pub(super) before: Joints,
    /// The configuration that its target states, where the controller checks it.
    pub(super) conf: Option<[i32; 4]>,
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
    pub(super) fn at(&self, s: f64) -> usize {
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
    beside(&off, &(to.meant.translation.vector - from.meant.translation.vector))
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
pub(super) const PIECE_MM: f64 = 100.0;

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
pub(super) const CHORD_MM: f64 = 0.002;

/// How often a piece is halved at most.
const HALVINGS: u32 = 5;

/// The largest value of a function over a path, which is 0 at both ends: equal pieces, each halved until its chord tells
/// its middle to [`CHORD_MM`].
pub(super) fn largest(pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    largest_from([0.0; 2], pieces, off)
}

/// The same with other values at the ends.
pub(super) fn largest_from(ends: [f64; 2], pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    let at = |k: usize| match k {
        0 => ends[0],
        k if k == pieces => ends[1],
        k => off(k as f64 / pieces as f64),
    };
    let mut most = ends[0];
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
    let mut begin = *from;
    for jump in way.jumps(from) {
        let at = |place: usize| end_between(from, to, jump.share, place, arms);
        if jump.share > 0.0
            && let Some(arrived) = at(jump.before)
        {
            left = left.max(split(&begin, &arrived, arms, options, MAX_DEPTH, &mut extra));
            extra.push(extra_of(&arrived.told, &arrived.joints, options.emit, to, arms));
        }
        let Some(taken_up) = at(jump.after) else { continue };
        extra.push(extra_of(&taken_up.told, &taken_up.joints, options.emit, to, arms));
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
    Some(Ends { meant, told, joints, place, before: near, ..*to })
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
    extra.push(extra_of(&middle.told, &middle.joints, options.emit, to, arms));
    let second = split(&middle, to, arms, options, depth - 1, extra);
    first.max(second)
}

/// How far the tool is, half way of a joint motion, from where the data-sheet arm goes with the program as it is (mm),
/// the largest over the way: a joint motion has no line to keep, so nothing is put in for it.
pub(super) fn joint_bend(path: &Path<'_>, arms: &Arms<'_>) -> f64 {
    let Path { from, to, way } = path;
    let off = |s: f64| {
        let meant = arms.nominal.arm().forward(&from.before.lerp(&to.before, s));
        let reached = arms.acting.arm(way.at(s)).forward(&from.joints.lerp(&to.joints, s));
        let meant = to.mounted.told.target_of(&meant).translation.vector;
        gap(&to.mounted.real.target_of(&reached).translation.vector, &meant)
    };
    largest_from([off(0.0), off(1.0)], 2, &off)
}

/// A target that the told path needs before the end `to`.
pub(super) fn extra_of(told: &Pose, joints: &Joints, emit: Emit, to: &Ends<'_>, arms: &Arms<'_>) -> Extra {
    let q = told.rotation.quaternion();
    match emit {
        Emit::Targets => Extra {
            kind: MotionKind::Linear,
            target: NewTarget::Cartesian {
                position_mm: told.translation.vector.into(),
                quaternion: [q.w, q.i, q.j, q.k],
                // cfx stays where only the quarters are used.
                conf: to.conf.map(|[_, _, _, cfx]| {
                    let here = arms.nominal.configuration(joints);
                    [here.cf1, here.cf4, here.cf6, cfx]
                }),
            },
            external: None,
        },
        Emit::Joints => Extra {
            kind: MotionKind::AbsoluteJoint,
            target: NewTarget::Joint { robot_deg: std::array::from_fn(|i| joints[i].to_degrees()) },
            external: None,
        },
    }
}

/// Distance between two positions (mm).
pub(super) fn gap(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (a - b).norm()
}
