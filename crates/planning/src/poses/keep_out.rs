//! Collision checks: links as capsules against a floor, boxes and the arm's own bodies, at poses and along joint motions.
//!
//! Links are capsules: the segments between the origins of neighbouring joint frames, to the flange and on to the touched
//! point, with one radius, halved from the wrist on. The first of them, the column on the base, never moves and is excluded.
//! Which of them the arm can run into itself, and at what distance, is in `own_bodies`.
//!
//! A motion is checked continuously, not at sampled poses: a point of a link moves by no more than the sum over the joints of
//! rotation times the largest distance of the link from the axis. One distance check therefore clears an interval of the
//! motion; if the clearance is too small for the whole interval, the interval is halved.

use nalgebra::{Point3, Vector3};

use super::cable::segment_distance;
use super::own_bodies::{BODIES, FIRST_JOINT, Lines, OwnBodies};
use super::setup::MeasurementSetup;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, PreparedModel};

/// Obstacles in the arm's base.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KeepOut {
    /// Height of the floor (mm); `None` disables the check.
    pub floor_mm: Option<f64>,
    /// Forbidden boxes: lower and upper corner (mm).
    pub boxes_mm: Vec<[[f64; 3]; 2]>,
    /// Radius of the links (mm); 0 disables the check against the arm's own bodies.
    pub radius_mm: f64,
    /// Distance from a pose at which its approach begins, in every joint (rad).
    pub approach_rad: f64,
}

/// Whether an arm is clear of obstacles and of itself with these joints.
pub fn is_clear(setup: &MeasurementSetup<'_>, space: &KeepOut, joints: &Joints) -> bool {
    CollisionChecker::of(setup, space).pose_is_clear(joints)
}

/// Checks an arm against obstacles.
#[derive(Debug)]
pub(super) struct CollisionChecker<'a> {
    space: &'a KeepOut,
    setup: &'a MeasurementSetup<'a>,
    arm: PreparedModel<'a>,
    own: OwnBodies,
    /// Largest distance of the ends of the segments from the axis of each joint that moves them (mm).
    levers_mm: [[f64; 6]; ENDS],
}

/// Ends of segments: base, ends of the links, flange, touched point.
const ENDS: usize = 9;

/// Finest interval, as motion of an end (mm): a motion that is not cleared at this resolution counts as blocked.
const MIN_INTERVAL_MM: f64 = 0.2;

impl<'a> CollisionChecker<'a> {
    pub(super) fn of(setup: &'a MeasurementSetup<'a>, space: &'a KeepOut) -> Self {
        let arm = setup.nominal.at_condition(&Condition::default());
        let own = OwnBodies::of(setup, &arm.frames(&Joints::zeros()));
        let levers_mm = [[0.0; 6]; ENDS];
        let mut out = Self { space, setup, arm, own, levers_mm };
        out.levers_mm = out.levers();
        out
    }

    /// Largest distance of each end from each axis. The end of the link after a joint has a constant distance from the axis;
    /// later ends are at most the sum of the link lengths in between farther away.
    fn levers(&self) -> [[f64; 6]; ENDS] {
        let still = Joints::zeros();
        let (Shape { ends, .. }, frames) = (self.shape(&still), self.arm.frames(&still));
        let from_axis = |joint: usize, end: usize| {
            (ends[end] - ends[joint]).cross(&Vector3::from(frames.z[joint])).norm()
        };
        std::array::from_fn(|end| {
            std::array::from_fn(|joint| {
                let link = joint + 1;
                if end < link {
                    return 0.0;
                }
                // Flange and touched point are fixed to the last link.
                let rides = end.min(LINKS);
                if rides == link {
                    return from_axis(joint, end);
                }
                let along: f64 = (link..rides).map(|k| (ends[k + 1] - ends[k]).norm()).sum();
                from_axis(joint, link) + along + (ends[end] - ends[rides]).norm()
            })
        })
    }

    /// Whether there is anything to run into.
    pub(super) fn is_active(&self) -> bool {
        self.space.floor_mm.is_some() || !self.space.boxes_mm.is_empty() || self.minds_itself()
    }

    /// The arm's own bodies.
    pub(super) fn own(&self) -> &OwnBodies {
        &self.own
    }

    /// Whether the arm's own bodies count.
    fn minds_itself(&self) -> bool {
        self.space.radius_mm > 0.0
    }

    /// Where the arm is.
    fn shape(&self, joints: &Joints) -> Shape {
        let frames = self.arm.frames(joints);
        let flange = frames.last() * self.setup.nominal.flange;
        let touched = flange * Point3::from(self.setup.frames.flange_from_target.translation.vector);
        let ends = std::array::from_fn(|end| match end {
            FLANGE => flange.translation.vector,
            TOUCHED => touched.coords,
            link => Vector3::from(frames.origin[link]),
        });
        Shape { ends, own: self.own.lines(&frames) }
    }

    /// Whether the arm is clear of obstacles and of itself with these joints.
    pub(super) fn pose_is_clear(&self, joints: &Joints) -> bool {
        !self.is_active() || self.has_clearance(&self.shape(joints), &Moved::default())
    }

    /// Whether all moving links have a clearance of their radius plus the motion of their ends.
    fn has_clearance(&self, shape: &Shape, moved: &Moved) -> bool {
        (1..ENDS - 1).all(|segment| {
            let (a, b) = (&shape.ends[segment], &shape.ends[segment + 1]);
            let radius = self.space.radius_mm * if segment < WRIST { 1.0 } else { 0.5 };
            // A point between two ends moves no more than the end that moves most.
            let room = radius + moved.most(segment);
            // Only the far end: the near end of the first segment is the fixed column's.
            let above =
                self.space.floor_mm.is_none_or(|floor| b.z - radius - moved.in_base_mm[segment + 1] >= floor);
            above
                && self.space.boxes_mm.iter().all(|corners| keeps_off(a, b, corners, room))
                && (!self.minds_itself() || self.keeps_off_itself(segment, shape, moved))
        })
    }

    /// Whether a segment keeps off the arm's own bodies.
    fn keeps_off_itself(&self, segment: usize, shape: &Shape, moved: &Moved) -> bool {
        let (a, b) = (&shape.ends[segment], &shape.ends[segment + 1]);
        (0..BODIES).all(|body| {
            let Some(room) = self.own.room_mm(body, segment, self.space.radius_mm) else { return true };
            let room = room + moved.most_against(body, segment);
            shape.own[body].iter().all(|[from, to]| segment_distance(a, b, from, to) >= room)
        })
    }

    /// Whether a linear joint motion between two joint configurations is clear.
    pub(super) fn motion_is_clear(&self, from: &Joints, to: &Joints) -> bool {
        if !self.is_active() {
            return true;
        }
        let turns = self.setup.nominal.mapped(&(to - from)).0;
        let since = |first: usize| {
            self.levers_mm.each_ref().map(|levers| {
                let pairs = levers.iter().zip(&turns).skip(first);
                pairs.map(|(lever, turn)| lever * turn.abs()).sum()
            })
        };
        let moved = Moved { in_base_mm: since(0), against_mm: FIRST_JOINT.map(since) };
        self.interval_is_clear(from, to, &moved)
    }

    /// The same for an interval in which the ends of the segments move by no more than `moved`.
    fn interval_is_clear(&self, from: &Joints, to: &Joints, moved: &Moved) -> bool {
        let middle = from.lerp(to, 0.5);
        let (shape, half) = (self.shape(&middle), moved.half());
        if self.has_clearance(&shape, &half) {
            return true;
        }
        half.in_base_mm.iter().any(|half| *half > MIN_INTERVAL_MM)
            && self.has_clearance(&shape, &Moved::default())
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

    /// Sides from which, and from whose opposites, a pose can be approached; `first` if possible.
    pub(super) fn sides(&self, pose: &Joints, first: [i8; 6]) -> Option<[i8; 6]> {
        if !self.pose_is_clear(pose) {
            return None;
        }
        // The opposite sides are checked with them, so half of the combinations suffice.
        let others = (0..1 << 5).map(|bits: u8| {
            std::array::from_fn(|joint| if joint < 5 && bits >> joint & 1 == 1 { 1 } else { -1 })
        });
        std::iter::once(first).chain(others).find(|sides| self.both_sides_clear(pose, sides))
    }

    /// Stops, chosen from `known`, that make the motion between two configurations clear: none, one or two. `None` if there are none such.
    pub(super) fn waypoints(&self, from: &Joints, to: &Joints, known: &[Joints]) -> Option<Vec<Joints>> {
        if self.motion_is_clear(from, to) {
            return Some(Vec::new());
        }
        let length = |a: &Joints, b: &Joints| (a - b).amax();
        let mut near: Vec<&Joints> = known.iter().collect();
        near.sort_by(|a, b| (length(from, a) + length(a, to)).total_cmp(&(length(from, b) + length(b, to))));
        near.truncate(MAX_STOPS);
        let reached: Vec<&Joints> =
            near.iter().copied().filter(|stop| self.motion_is_clear(from, stop)).collect();
        let leaving: Vec<&Joints> =
            near.iter().copied().filter(|stop| self.motion_is_clear(stop, to)).collect();
        if let Some(stop) = reached.iter().find(|stop| leaving.contains(stop)) {
            return Some(vec![**stop]);
        }
        let pairs = reached.iter().flat_map(|first| leaving.iter().map(move |second| (*first, *second)));
        let found =
            pairs.into_iter().take(MAX_PAIRS).find(|(first, second)| self.motion_is_clear(first, second));
        found.map(|(first, second)| vec![*first, *second])
    }
}

/// Ends of the segments, and the arm's own bodies (mm, base).
struct Shape {
    ends: [Vector3<f64>; ENDS],
    own: Lines,
}

/// How far the ends of the segments move at most: in the base, and against each of the arm's own bodies (mm).
#[derive(Default)]
struct Moved {
    in_base_mm: [f64; ENDS],
    against_mm: [[f64; ENDS]; BODIES],
}

impl Moved {
    fn most(&self, segment: usize) -> f64 {
        self.in_base_mm[segment].max(self.in_base_mm[segment + 1])
    }

    fn most_against(&self, body: usize, segment: usize) -> f64 {
        self.against_mm[body][segment].max(self.against_mm[body][segment + 1])
    }

    fn half(&self) -> Self {
        let half = |moved: [f64; ENDS]| moved.map(|moved| 0.5 * moved);
        Self { in_base_mm: half(self.in_base_mm), against_mm: self.against_mm.map(half) }
    }
}

/// Number of links; the last carries the flange.
const LINKS: usize = 6;

/// Indices of flange and touched point among the ends.
const FLANGE: usize = 7;
const TOUCHED: usize = 8;

/// The first segment of the wrist.
const WRIST: usize = 4;

/// Most stops tried for a motion, and most pairs of them.
const MAX_STOPS: usize = 200;
const MAX_PAIRS: usize = 2000;

/// Whether a capsule is clear of a box. The distance of its midpoint decides most cases.
fn keeps_off(a: &Vector3<f64>, b: &Vector3<f64>, corners: &[[f64; 3]; 2], radius: f64) -> bool {
    let middle = (a + b) * 0.5;
    let away = outside(&middle, corners);
    if away >= radius + 0.5 * (b - a).norm() {
        return true;
    }
    away >= radius && to_box(a, b, corners) >= radius
}

/// Distance of a point from a box (mm); 0 inside.
fn outside(point: &Vector3<f64>, [low, high]: &[[f64; 3]; 2]) -> f64 {
    Vector3::from_fn(|k, _| (low[k] - point[k]).max(point[k] - high[k]).max(0.0)).norm()
}

/// Distance of a segment from a box (mm); 0 inside. The distance is convex along the segment, so its minimum is found by
/// ternary search.
fn to_box(a: &Vector3<f64>, b: &Vector3<f64>, corners: &[[f64; 3]; 2]) -> f64 {
    const CUTS: usize = 48;
    let at = |t: f64| outside(&(a + (b - a) * t), corners);
    let (mut from, mut to) = (0.0, 1.0);
    for _ in 0..CUTS {
        let (first, second) = (from + (to - from) / 3.0, to - (to - from) / 3.0);
        // Inside the box both are 0, so either third can be dropped.
        if at(first) <= at(second) {
            to = second;
        } else {
            from = first;
        }
    }
    at(0.5 * (from + to)).min(at(0.0)).min(at(1.0))
}
