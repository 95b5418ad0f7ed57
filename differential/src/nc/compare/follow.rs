//! What the arm does along a run: the controller's joints, where the links are, and where the tip really is.

use nalgebra::{Translation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::arm::{Circumstance, Pose, difference};
use crate::model::{Case, START};
use crate::nc::machine::{Mode, Move};
use crate::play::{Links, meant_flanks, meant_links};

/// Pieces in which a path is followed.
const PIECES: u32 = 128;

/// An arm that follows a program.
pub struct Follower<'c> {
    case: &'c Case,
    /// The joints it stands in, where they are known.
    joints: Option<[f64; 6]>,
    links: Links,
    /// Where it stands now, or would if it had not gone where nothing tells.
    last: [f64; 6],
    /// Whether rapid motions go on lines; each joint by itself otherwise. Controls are set up either way.
    straight_rapids: bool,
    /// Where the tip really was on the last motion, with the share of it; none where it was not followed.
    tips: Vec<(f64, Pose)>,
}

impl<'c> Follower<'c> {
    /// An arm of which nothing is known.
    pub fn new(case: &'c Case, seed: u64) -> Follower<'c> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x6c69_6e6b);
        // Mostly on a flank, as an arm comes to rest.
        let rest = std::array::from_fn(|_| [-1.0, 1.0, rng.random_range(-1.0..1.0)][rng.random_range(0..3)]);
        Follower {
            case,
            joints: None,
            links: Links::new(&case.arm, rest),
            last: case.arm.map.counted(&START),
            straight_rapids: rng.random_bool(0.5),
            tips: Vec::new(),
        }
    }

    /// The arm goes where nothing tells.
    pub fn lost(&mut self) {
        self.joints = None;
        self.links.lose();
    }

    fn solve(&self, flange: &Pose, near: &[f64; 6]) -> Option<[f64; 6]> {
        self.case.arm.nominal_nearest(flange, near)
    }

    /// Carries a motion out; where the tip then really is.
    pub fn go(&mut self, done: &Move) -> Option<Pose> {
        self.tips.clear();
        let (Some(pose), Some(tool)) = (done.pose(), done.tool) else {
            self.lost();
            return None;
        };
        let near = self.follow(done, &tool).unwrap_or(self.last);
        let Some(joints) = self.solve(&(pose * tool.inverse()), &near) else {
            self.lost();
            return None;
        };
        self.links.go(&joints);
        self.joints = Some(joints);
        self.last = joints;
        Some(self.real(&joints) * tool)
    }

    /// Takes the links along the way; the joints just before its end, none where the motion does not go along one or the arm
    /// cannot. An arm that goes along a path keeps to its branch, however near another one is in joints.
    fn follow(&mut self, done: &Move, tool: &Pose) -> Option<[f64; 6]> {
        let Some(mut near) = self.joints else {
            self.links.lose();
            return None;
        };
        if !self.straight_rapids && done.mode == Mode::Rapid {
            return None;
        }
        let back = tool.inverse();
        // Where the tip is told to be before, whether the words that led there still hold or not.
        let start = done.chain.map(|chain| chain.inverse() * self.case.arm.nominal_forward(&near) * tool);
        if done.arc.is_some() {
            self.tips.push((0.0, self.real(&near) * tool));
        }
        for k in 1..PIECES {
            let share = f64::from(k) / f64::from(PIECES);
            let pose = start.and_then(|start| between(done, &start, share));
            let Some(joints) = pose.and_then(|pose| self.solve(&(pose * back), &near)) else {
                // Of the way to it nothing is told.
                self.links.lose();
                self.tips.clear();
                return None;
            };
            near = joints;
            self.links.go(&joints);
            if done.arc.is_some() {
                let behind = self.links.behind(&joints);
                let at = Circumstance { behind, ..Circumstance::default() };
                self.tips.push((share, self.case.arm.actual_forward(&joints, &at) * tool));
            }
        }
        Some(near)
    }

    /// On which flanks the links lie, in words.
    pub fn flanks(&self) -> String {
        self.links.flanks(&self.last)
    }

    /// The flanks for which it would have come to where it shall.
    pub fn meant_flanks(&self, wanted: &Pose, tool: &Pose) -> String {
        let flange = wanted * tool.inverse();
        meant_flanks(&self.case.arm, &self.last, &Circumstance::default(), &flange)
    }

    /// How far beside an arc that was meant the tip was at each place of the motion; none where it was not followed.
    pub fn beside(&self, meant: &Move) -> Option<Vec<f64>> {
        let arc = meant.arc?;
        let (a, b, across) = crate::nc::arc::axes(plane_of(&meant.state));
        let back = meant.chain?.inverse();
        let (from, to) = (meant.from[across]?, meant.to[across]?);
        let start = (meant.from[b]? - arc.centre[1]).atan2(meant.from[a]? - arc.centre[0]);
        let off = |tip: &Pose, share: f64| {
            let place = back * nalgebra::Point3::from(tip.translation.vector);
            let (x, y) = (place[a] - arc.centre[0], place[b] - arc.centre[1]);
            // Early or late on the arc is not beside it.
            let near = start + arc.sweep * share;
            let turn = std::f64::consts::TAU;
            let angle = y.atan2(x);
            let angle = angle + turn * ((near - angle) / turn).round();
            let gone = (angle - start) / arc.sweep;
            let (sin, cos) = (start + arc.sweep * gone).sin_cos();
            let radius = arc.radii[0] + (arc.radii[1] - arc.radii[0]) * gone;
            let rise = place[across] - (from + (to - from) * gone);
            // On a helix the nearest place is not the one at the same angle.
            let off = Vector3::new(x - radius * cos, y - radius * sin, rise);
            let along = Vector3::new(-radius * sin, radius * cos, (to - from) / arc.sweep).normalize();
            (off - along * along.dot(&off)).norm()
        };
        (!self.tips.is_empty()).then(|| self.tips.iter().map(|(share, tip)| off(tip, *share)).collect())
    }

    /// How far the tip would really be from where it shall for a told pose (mm, rad) in each of the ways in which the arm can
    /// stand at the pose that was meant, with the links on the flanks that suit it best. A program says no configuration:
    /// which of them the arm stands in is not told where it begins or goes on from what is not followed. `axis_alone`: see [`off`].
    pub fn every_way(&self, meant: &Pose, told: &Pose, tool: &Pose, axis_alone: bool) -> Vec<(f64, f64)> {
        let back = tool.inverse();
        let all = self.case.arm.nominal_inverse(&(meant * back), None);
        let near = all.iter().filter_map(|joints| self.solve(&(told * back), joints));
        let off = |flange: &Pose| off(&(flange * tool), meant, axis_alone);
        near.map(|q| meant_links(&self.case.arm, &q, &Circumstance::default(), &off)).collect()
    }

    /// Where the tip would really be for a told pose, with the links before their motors as they are.
    pub fn at(&self, pose: &Pose, tool: &Pose) -> Option<Pose> {
        let joints = self.solve(&(pose * tool.inverse()), &self.last)?;
        Some(self.real(&joints) * tool)
    }

    fn real(&self, joints: &[f64; 6]) -> Pose {
        let behind = self.links.behind(&self.last);
        let circumstance = Circumstance { behind, ..Circumstance::default() };
        self.case.arm.actual_forward(joints, &circumstance)
    }
}

/// How far a tip is from where it shall be (mm, rad); where only the axis of the tool is told (`axis_alone`), how it is turned
/// about that does not count.
pub fn off(real: &Pose, wanted: &Pose, axis_alone: bool) -> (f64, f64) {
    let (mm, rad) = difference(real, wanted);
    let axis = Vector3::z();
    (mm, if axis_alone { (real.rotation * axis).angle(&(wanted.rotation * axis)) } else { rad })
}

/// Where the tip is told to be part of the way along a motion that begins at `start`, in the coordinates of the program.
fn between(done: &Move, start: &Pose, share: f64) -> Option<Pose> {
    let turn = start.rotation.try_slerp(&done.turns[1]?, share, 1e-9)?;
    let mut at: [f64; 3] = start.translation.vector.into();
    for (axis, at) in at.iter_mut().enumerate() {
        *at += (done.to[axis]? - *at) * share;
    }
    if let Some(arc) = done.arc {
        let (a, b, _) = crate::nc::arc::axes(plane_of(&done.state));
        let angle =
            (done.to[b]? - arc.centre[1]).atan2(done.to[a]? - arc.centre[0]) - arc.sweep * (1.0 - share);
        let radius = arc.radii[0] + (arc.radii[1] - arc.radii[0]) * share;
        at[a] = arc.centre[0] + radius * angle.cos();
        at[b] = arc.centre[1] + radius * angle.sin();
    }
    Some(done.chain? * Pose::from_parts(Translation3::new(at[0], at[1], at[2]), turn))
}

/// The plane that holds in a state.
pub fn plane_of(state: &str) -> u8 {
    [18, 19].into_iter().find(|plane| state.contains(&format!(" G{plane} "))).unwrap_or(17)
}
