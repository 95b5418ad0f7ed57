//! What the arm must not enter: what lies below its mounting plane, and boxes.
//!
//! Links are capsules: the lines between the origins of neighbouring joint frames, to the flange and on to the touched
//! point, with one radius; from the wrist on with half of it. The first of them, the column on the base, never moves and
//! is left out.

use nalgebra::{Point3, Vector3};

use super::wanted::Wanted;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::{Joints, PreparedModel};

/// What the arm must not enter, in its base.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Space {
    /// Nothing goes below this height (mm); `None` does not look.
    pub floor_mm: Option<f64>,
    /// Boxes that nothing enters: lower and upper corner (mm).
    pub boxes_mm: Vec<[[f64; 3]; 2]>,
    /// Radius of the links (mm).
    pub radius_mm: f64,
    /// How far from a pose its approach begins, in every joint (rad).
    pub approach_rad: f64,
}

/// The arm that must not enter it.
#[derive(Debug)]
pub(super) struct Watch<'a> {
    space: &'a Space,
    wanted: &'a Wanted<'a>,
    arm: PreparedModel<'a>,
    /// How far a point of the arm moves at most for each rad of a controller's joint (mm).
    levers_mm: [f64; 6],
}

/// Between two looks at a way the arm moves by at least this (mm): a link comes nearer than its radius by no more than half of it.
const STEP_MM: f64 = 4.0;

impl<'a> Watch<'a> {
    pub(super) fn of(wanted: &'a Wanted<'a>, space: &'a Space) -> Self {
        let arm = wanted.nominal.at_condition(&Condition::default());
        let points = Self::points(wanted, &arm, &Joints::zeros());
        // Behind each link's axis the arm is as long as its lines together.
        let behind =
            |link: usize| points[link..].windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum::<f64>();
        let turns = &wanted.nominal.joint_map;
        let lever = |joint: usize| (0..6).map(|link| turns[(link, joint)].abs() * behind(link)).sum();
        Self { space, wanted, levers_mm: std::array::from_fn(lever), arm }
    }

    /// The origins of the joint frames, the flange and the touched point.
    fn points(wanted: &Wanted<'_>, arm: &PreparedModel<'_>, joints: &Joints) -> Vec<Vector3<f64>> {
        let frames = arm.frames(joints);
        let flange = frames.last() * wanted.nominal.flange;
        let touched = flange * Point3::from(wanted.frames.flange_from_target.translation.vector);
        let origins = frames.origin.iter().map(|origin| Vector3::from(*origin));
        origins.chain([flange.translation.vector, touched.coords]).collect()
    }

    /// Whether there is anything to look for.
    pub(super) fn looks(&self) -> bool {
        self.space.floor_mm.is_some() || !self.space.boxes_mm.is_empty()
    }

    /// Whether the arm stands clear with these joints.
    pub(super) fn stands_clear(&self, joints: &Joints) -> bool {
        self.room_mm(joints) >= 0.0
    }

    /// At least how far the arm may move from here before a link is nearer than its radius (mm); negative where one is.
    fn room_mm(&self, joints: &Joints) -> f64 {
        if !self.looks() {
            return f64::INFINITY;
        }
        let points = Self::points(self.wanted, &self.arm, joints);
        let mut room = f64::INFINITY;
        for segment in 1..points.len() - 1 {
            let (a, b) = (&points[segment], &points[segment + 1]);
            let radius = self.space.radius_mm * if segment < WRIST { 1.0 } else { 0.5 };
            // The end of the column stands where it stands.
            if let Some(floor) = self.space.floor_mm {
                room = room.min(b.z - radius - floor);
            }
            for corners in &self.space.boxes_mm {
                room = room.min(away(a, b, corners, radius));
            }
            if room < 0.0 {
                break;
            }
        }
        room
    }

    /// Whether it stays clear while all joints run evenly from one place to another.
    pub(super) fn way_is_clear(&self, from: &Joints, to: &Joints) -> bool {
        if !self.looks() {
            return true;
        }
        // From each place as far as no link can come nearer than its radius (conservative advancement).
        let whole_mm: f64 =
            (to - from).iter().zip(self.levers_mm).map(|(turn, lever)| turn.abs() * lever).sum();
        let mut share = 0.0;
        while share < 1.0 {
            let room = self.room_mm(&from.lerp(to, share));
            if !(room >= 0.0) {
                return false;
            }
            share += room.max(STEP_MM) / whole_mm.max(f64::MIN_POSITIVE);
        }
        self.stands_clear(to)
    }

    /// Whether a pose can be approached from these sides, and from the opposite ones.
    pub(super) fn both_sides_clear(&self, pose: &Joints, sides: &[i8; 6]) -> bool {
        [1.0, -1.0].iter().all(|sign| {
            let begin =
                Joints::from_fn(|i, _| pose[i] + sign * f64::from(sides[i]) * self.space.approach_rad);
            self.way_is_clear(&begin, pose)
        })
    }

    /// Sides from which a pose can be approached, and from the opposite ones: `first` where they will do.
    pub(super) fn sides(&self, pose: &Joints, first: [i8; 6]) -> Option<[i8; 6]> {
        if !self.stands_clear(pose) {
            return None;
        }
        // The opposite sides are looked at together with them.
        let others = (0..1 << 5).map(|bits: u8| {
            std::array::from_fn(|joint| if joint < 5 && bits >> joint & 1 == 1 { 1 } else { -1 })
        });
        std::iter::once(first).chain(others).find(|sides| self.both_sides_clear(pose, sides))
    }

    /// Stops between two places that make the way clear, taken from these: none, one or two. `None` where they do not.
    pub(super) fn stops(&self, from: &Joints, to: &Joints, known: &[Joints]) -> Option<Vec<Joints>> {
        if self.way_is_clear(from, to) {
            return Some(Vec::new());
        }
        let length = |a: &Joints, b: &Joints| (a - b).amax();
        let mut near: Vec<&Joints> = known.iter().collect();
        near.sort_by(|a, b| (length(from, a) + length(a, to)).total_cmp(&(length(from, b) + length(b, to))));
        near.truncate(MOST_STOPS);
        let reached: Vec<&Joints> =
            near.iter().copied().filter(|stop| self.way_is_clear(from, stop)).collect();
        let leaving: Vec<&Joints> = near.iter().copied().filter(|stop| self.way_is_clear(stop, to)).collect();
        if let Some(stop) = reached.iter().find(|stop| leaving.contains(stop)) {
            return Some(vec![**stop]);
        }
        let pairs = reached.iter().flat_map(|first| leaving.iter().map(move |second| (*first, *second)));
        let found =
            pairs.into_iter().take(MOST_PAIRS).find(|(first, second)| self.way_is_clear(first, second));
        found.map(|(first, second)| vec![*first, *second])
    }
}

/// The first segment of the wrist.
const WRIST: usize = 4;

/// Stops that are tried for a way, and pairs of them.
const MOST_STOPS: usize = 200;
const MOST_PAIRS: usize = 2000;

/// At least how far a capsule is away from a box (mm), negative where it reaches into it. Most are told by their middles.
fn away(a: &Vector3<f64>, b: &Vector3<f64>, corners: &[[f64; 3]; 2], radius: f64) -> f64 {
    let middle = outside(&((a + b) * 0.5), corners) - radius;
    let surely = middle - 0.5 * (b - a).norm();
    if surely >= 0.0 || middle < 0.0 { surely } else { to_box(a, b, corners) - radius }
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
