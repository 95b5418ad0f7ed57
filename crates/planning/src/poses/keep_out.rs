//! Collision checks: links as capsules against a floor and boxes, at poses and along joint motions.
//!
//! Links are capsules: the lines between the origins of neighbouring joint frames, to the flange and on to the touched
//! point, with one radius; from the wrist on with half of it. The first of them, the column on the base, never moves and
//! is left out.
//!
//! A way is clear as a whole, and not at single looks at it: what runs on a link, from a place on the way to another, moves by no more
//! than each joint turns times how far the link can be from its axis. So a look clears as much of the way as the room that it finds
//! allows, and where that is too little the way is halved.

use nalgebra::{Point3, Vector3};

use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, PreparedModel};

/// Obstacles in the arm's base.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeepOut {
    /// Nothing goes below this height (mm); `None` does not look.
    pub floor_mm: Option<f64>,
    /// Boxes that nothing enters: lower and upper corner (mm).
    pub boxes_mm: Vec<[[f64; 3]; 2]>,
    /// Radius of the links (mm).
    pub radius_mm: f64,
    /// How far from a pose its approach begins, in every joint (rad).
    pub approach_rad: f64,
}

/// Checks an arm against obstacles.
#[derive(Debug)]
pub(super) struct CollisionChecker<'a> {
    space: &'a KeepOut,
    setup: &'a MeasurementSetup<'a>,
    arm: PreparedModel<'a>,
    /// How far the ends of the segments can be from the axis of each joint that moves them (mm).
    levers_mm: [[f64; 6]; ENDS],
}

/// Ends of segments: base, ends of the links, flange, touched point.
const ENDS: usize = 9;

/// Moving less than this between two looks tells nothing more: a way that comes so near to what is stated counts as blocked (mm).
const FINEST_MM: f64 = 0.2;

impl<'a> CollisionChecker<'a> {
    pub(super) fn of(setup: &'a MeasurementSetup<'a>, space: &'a KeepOut) -> Self {
        let arm = setup.nominal.at_condition(&Condition::default());
        let levers_mm = [[0.0; 6]; ENDS];
        let mut out = Self { space, setup, arm, levers_mm };
        out.levers_mm = out.levers();
        out
    }

    /// How far each end can be from each axis. The end of the link behind a joint keeps its distance from the axis, and what comes after
    /// that link is no farther from its end than along all links between.
    fn levers(&self) -> [[f64; 6]; ENDS] {
        let still = Joints::zeros();
        let (ends, frames) = (self.ends(&still), self.arm.frames(&still));
        let from_axis = |joint: usize, end: usize| {
            (ends[end] - ends[joint]).cross(&Vector3::from(frames.z[joint])).norm()
        };
        std::array::from_fn(|end| {
            std::array::from_fn(|joint| {
                let link = joint + 1;
                if end < link {
                    return 0.0;
                }
                // Flange and touched point ride on the last link.
                let rides = end.min(LINKS);
                if rides == link {
                    return from_axis(joint, end);
                }
                let along: f64 = (link..rides).map(|k| (ends[k + 1] - ends[k]).norm()).sum();
                from_axis(joint, link) + along + (ends[end] - ends[rides]).norm()
            })
        })
    }

    /// Whether there is anything to look for.
    pub(super) fn is_active(&self) -> bool {
        self.space.floor_mm.is_some() || !self.space.boxes_mm.is_empty()
    }

    /// Base, ends of the links, flange and touched point (mm).
    fn ends(&self, joints: &Joints) -> [Vector3<f64>; ENDS] {
        let frames = self.arm.frames(joints);
        let flange = frames.last() * self.setup.nominal.flange;
        let touched = flange * Point3::from(self.setup.frames.flange_from_target.translation.vector);
        std::array::from_fn(|end| match end {
            FLANGE => flange.translation.vector,
            TOUCHED => touched.coords,
            link => Vector3::from(frames.origin[link]),
        })
    }

    /// Whether the arm stands clear with these joints.
    pub(super) fn pose_is_clear(&self, joints: &Joints) -> bool {
        !self.is_active() || self.has_clearance(&self.ends(joints), &[0.0; ENDS])
    }

    /// Whether all that moves has room about it: the radius of the link, and as much more as its ends may move (mm).
    fn has_clearance(&self, ends: &[Vector3<f64>; ENDS], moved_mm: &[f64; ENDS]) -> bool {
        (1..ENDS - 1).all(|segment| {
            let (a, b) = (&ends[segment], &ends[segment + 1]);
            let radius = self.space.radius_mm * if segment < WRIST { 1.0 } else { 0.5 };
            // A point between two ends moves no more than the one that moves most.
            let room = radius + moved_mm[segment].max(moved_mm[segment + 1]);
            // The end of the column stands where it stands.
            let above = self.space.floor_mm.is_none_or(|floor| b.z - radius - moved_mm[segment + 1] >= floor);
            above && self.space.boxes_mm.iter().all(|corners| keeps_off(a, b, corners, room))
        })
    }

    /// Whether it stays clear while all joints run evenly from one place to another.
    pub(super) fn motion_is_clear(&self, from: &Joints, to: &Joints) -> bool {
        if !self.is_active() {
            return true;
        }
        let turns = self.setup.nominal.joint_map * (to - from);
        let moved =
            |levers: &[f64; 6]| levers.iter().zip(&turns).map(|(lever, turn)| lever * turn.abs()).sum();
        self.interval_is_clear(from, to, &self.levers_mm.each_ref().map(moved))
    }

    /// The same of a stretch on which the ends of the segments move by no more than `moved_mm`.
    fn interval_is_clear(&self, from: &Joints, to: &Joints, moved_mm: &[f64; ENDS]) -> bool {
        let middle = from.lerp(to, 0.5);
        let (ends, half) = (self.ends(&middle), moved_mm.map(|moved| 0.5 * moved));
        if self.has_clearance(&ends, &half) {
            return true;
        }
        half.iter().any(|half| *half > FINEST_MM)
            && self.has_clearance(&ends, &[0.0; ENDS])
            && self.interval_is_clear(from, &middle, &half)
            && self.interval_is_clear(&middle, to, &half)
    }

    /// Whether a pose can be approached from these sides, and from the opposite ones.
    pub(super) fn both_sides_clear(&self, pose: &Joints, sides: &[i8; 6]) -> bool {
        [1.0, -1.0].iter().all(|sign| {
            let begin =
                Joints::from_fn(|i, _| pose[i] + sign * f64::from(sides[i]) * self.space.approach_rad);
            self.motion_is_clear(&begin, pose)
        })
    }

    /// Sides from which a pose can be approached, and from the opposite ones: `first` where they will do.
    pub(super) fn sides(&self, pose: &Joints, first: [i8; 6]) -> Option<[i8; 6]> {
        if !self.pose_is_clear(pose) {
            return None;
        }
        // The opposite sides are looked at together with them.
        let others = (0..1 << 5).map(|bits: u8| {
            std::array::from_fn(|joint| if joint < 5 && bits >> joint & 1 == 1 { 1 } else { -1 })
        });
        std::iter::once(first).chain(others).find(|sides| self.both_sides_clear(pose, sides))
    }

    /// Stops between two places that make the way clear, taken from these: none, one or two. `None` where they do not.
    pub(super) fn waypoints(&self, from: &Joints, to: &Joints, known: &[Joints]) -> Option<Vec<Joints>> {
        if self.motion_is_clear(from, to) {
            return Some(Vec::new());
        }
        let length = |a: &Joints, b: &Joints| (a - b).amax();
        let mut near: Vec<&Joints> = known.iter().collect();
        near.sort_by(|a, b| (length(from, a) + length(a, to)).total_cmp(&(length(from, b) + length(b, to))));
        near.truncate(MOST_STOPS);
        let reached: Vec<&Joints> =
            near.iter().copied().filter(|stop| self.motion_is_clear(from, stop)).collect();
        let leaving: Vec<&Joints> =
            near.iter().copied().filter(|stop| self.motion_is_clear(stop, to)).collect();
        if let Some(stop) = reached.iter().find(|stop| leaving.contains(stop)) {
            return Some(vec![**stop]);
        }
        let pairs = reached.iter().flat_map(|first| leaving.iter().map(move |second| (*first, *second)));
        let found =
            pairs.into_iter().take(MOST_PAIRS).find(|(first, second)| self.motion_is_clear(first, second));
        found.map(|(first, second)| vec![*first, *second])
    }
}

/// Links, the last of which carries the flange.
const LINKS: usize = 6;

/// Where flange and touched point stand among the ends.
const FLANGE: usize = 7;
const TOUCHED: usize = 8;

/// The first segment of the wrist.
const WRIST: usize = 4;

/// Stops that are tried for a way, and pairs of them.
const MOST_STOPS: usize = 200;
const MOST_PAIRS: usize = 2000;

/// Whether a capsule keeps off a box. Most are jacobian by their middles.
fn keeps_off(a: &Vector3<f64>, b: &Vector3<f64>, corners: &[[f64; 3]; 2], radius: f64) -> bool {
    let middle = (a + b) * 0.5;
    let away = outside(&middle, corners);
    if away >= radius + 0.5 * (b - a).norm() {
        return true;
    }
    away >= radius && to_box(a, b, corners) >= radius
}

/// Distance of a point from a box (mm), 0 inside.
fn outside(point: &Vector3<f64>, [low, high]: &[[f64; 3]; 2]) -> f64 {
    Vector3::from_fn(|k, _| (low[k] - point[k]).max(point[k] - high[k]).max(0.0)).norm()
}

/// Distance of a segment from a box (mm), 0 inside. The distance of a point that runs along the segment is convex, so its
/// least value is found by cutting off thirds.
fn to_box(a: &Vector3<f64>, b: &Vector3<f64>, corners: &[[f64; 3]; 2]) -> f64 {
    const CUTS: usize = 48;
    let at = |t: f64| outside(&(a + (b - a) * t), corners);
    let (mut from, mut to) = (0.0, 1.0);
    for _ in 0..CUTS {
        let (first, second) = (from + (to - from) / 3.0, to - (to - from) / 3.0);
        // Inside the box both are 0, and any place will do.
        if at(first) <= at(second) {
            to = second;
        } else {
            from = first;
        }
    }
    at(0.5 * (from + to)).min(at(0.0)).min(at(1.0))
}
