//! What the arm does along a run: the controller's joints, the side from which each came, and where the tip really is.

use nalgebra::Translation3;

use crate::arm::{Circumstance, Pose};
use crate::model::Case;
use crate::nc::machine::{Mode, Move};

/// Joints that move less than this have no direction (rad).
const STILL: f64 = 1e-7;

/// An arm that follows a program.
pub struct Follower<'c> {
    case: &'c Case,
    /// The joints it stands in, where they are known.
    joints: Option<[f64; 6]>,
    /// From which side each came.
    approach: [i8; 6],
    last: [f64; 6],
}

impl<'c> Follower<'c> {
    /// An arm of which nothing is known.
    pub fn new(case: &'c Case) -> Follower<'c> {
        Follower { case, joints: None, approach: [0; 6], last: [0.8, 0.3, 0.2, 0.0, 1.0, 0.8] }
    }

    /// The arm goes where nothing tells.
    pub fn lost(&mut self) {
        self.joints = None;
        self.approach = [0; 6];
    }

    fn solve(&self, flange: &Pose, near: &[f64; 6]) -> Option<[f64; 6]> {
        self.case.arm.nominal_inverse(flange, Some(near)).first().copied()
    }

    /// Carries a motion out; where the tip then really is.
    pub fn go(&mut self, done: &Move) -> Option<Pose> {
        let (Some(pose), Some(tool)) = (done.pose(), done.tool) else {
            self.lost();
            return None;
        };
        let back = tool.inverse();
        let Some(joints) = self.solve(&(pose * back), &self.last) else {
            self.lost();
            return None;
        };
        // Where it comes from at the very end.
        let before = match done.mode {
            Mode::Rapid => self.joints,
            _ => shortly_before(done).and_then(|pose| self.solve(&(pose * back), &joints)),
        };
        if let Some(before) = before {
            for joint in 0..6 {
                let by = joints[joint] - before[joint];
                if by.abs() > STILL {
                    self.approach[joint] = if by > 0.0 { -1 } else { 1 };
                }
            }
        }
        self.joints = Some(joints);
        self.last = joints;
        Some(self.real(&joints) * tool)
    }

    /// Where the tip would really be for a told pose in each of the ways in which the arm can stand at the pose that was
    /// meant. A program says no configuration: which of them the arm stands in is not told where it begins or goes on
    /// from what is not followed.
    pub fn every_way(&self, meant: &Pose, told: &Pose, tool: &Pose) -> Vec<Pose> {
        let back = tool.inverse();
        let all = self.case.arm.nominal_inverse(&(meant * back), None);
        let near = all.iter().filter_map(|joints| self.solve(&(told * back), joints));
        near.map(|joints| self.real(&joints) * tool).collect()
    }

    /// Where the tip would really be for a told pose, from the same sides.
    pub fn at(&self, pose: &Pose, tool: &Pose) -> Option<Pose> {
        let joints = self.solve(&(pose * tool.inverse()), &self.last)?;
        Some(self.real(&joints) * tool)
    }

    fn real(&self, joints: &[f64; 6]) -> Pose {
        let circumstance = Circumstance { approach: self.approach, ..Circumstance::default() };
        self.case.arm.actual_forward(joints, &circumstance)
    }
}

/// Where the tip is told to be shortly before the end of a motion.
fn shortly_before(done: &Move) -> Option<Pose> {
    let share = 0.99;
    let chain = done.chain?;
    let turn = done.turns[0]?.try_slerp(&done.turns[1]?, share, 1e-9)?;
    let part = |axis: usize| {
        let (from, to) = (done.from[axis]?, done.to[axis]?);
        Some(from + (to - from) * share)
    };
    let mut at = [part(0)?, part(1)?, part(2)?];
    if let Some(arc) = done.arc {
        let (a, b, _) = crate::nc::arc::axes(plane_of(&done.state));
        let angle =
            (done.to[b]? - arc.centre[1]).atan2(done.to[a]? - arc.centre[0]) - arc.sweep * (1.0 - share);
        at[a] = arc.centre[0] + arc.radii[1] * angle.cos();
        at[b] = arc.centre[1] + arc.radii[1] * angle.sin();
    }
    Some(chain * Pose::from_parts(Translation3::new(at[0], at[1], at[2]), turn))
}

/// The plane that holds in a state.
pub fn plane_of(state: &str) -> u8 {
    [18, 19].into_iter().find(|plane| state.contains(&format!(" G{plane} "))).unwrap_or(17)
}
