//! The estimated arm under every condition that a program brings about: backlash sides and payload.
//!
//! A condition is prepared once and shared by all its targets, so that they are still computed in lanes.

use std::collections::HashMap;

use nalgebra::{Matrix6, Vector3};

use crate::backlash::sides::JointSides;
use truegrind_arm::condition::Condition;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model, PreparedModel};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::load::Load;

/// A payload as a hash key: the bits of mass and centre.
type LoadKey = Option<[u64; 4]>;

/// The conditions of one program, with the prepared arm for each.
pub(crate) struct ArmConditions<'a> {
    model: &'a Model,
    nominal: &'a Model,
    base: Condition,
    /// Backlash of each joint (rad); 0 without.
    pub(crate) play_rad: [f64; 6],
    /// Angles of the controller for turns of the gears, each in the sense of its own joint: the identity but for an arm with coupled joints.
    pub(crate) joints_of_gears: Matrix6<f64>,
    condition_indices: HashMap<(JointSides, LoadKey), usize>,
    list: Vec<Inverse<'a>>,
    /// For each condition the one with the same payload and every joint at mid-play.
    middles: Vec<usize>,
}

impl<'a> ArmConditions<'a> {
    pub(crate) fn new(model: &'a Model, nominal: &'a Model, base: &Condition) -> Self {
        let mut play_rad = [0.0; 6];
        for effect in &model.effects {
            if let Some((joint, play)) = effect.play_rad() {
                play_rad[joint] += play;
            }
        }
        let sense = Matrix6::from_diagonal(&model.joint_map.diagonal().map(f64::signum));
        let joints_of_gears = model.joint_map.try_inverse().map_or_else(Matrix6::identity, |map| map * sense);
        let (condition_indices, list, middles) = (HashMap::new(), Vec::new(), Vec::new());
        let base = *base;
        Self { model, nominal, base, play_rad, joints_of_gears, condition_indices, list, middles }
    }

    /// Whether the side from which a joint arrives matters.
    pub(crate) fn has_play(&self) -> bool {
        self.play_rad.iter().any(|play| *play != 0.0)
    }

    /// Index of a condition. Sides of joints without backlash make no difference; without a payload that of the base
    /// condition applies.
    pub(crate) fn condition_index(&mut self, sides: JointSides, load: Option<&Load>) -> usize {
        // The gear of a coupled joint turns with others too: from its own angle alone its side is not known.
        let matters = |j: usize| self.play_rad[j] != 0.0 && !self.nominal.is_coupled(j);
        let sides: JointSides = std::array::from_fn(|j| if matters(j) { sides[j] } else { 0 });
        let [x, y, z] = load.map_or([0.0; 3], |load| load.centre_mm);
        let key = (sides, load.map(|load| [load.mass_kg, x, y, z].map(f64::to_bits)));
        if let Some(condition_index) = self.condition_indices.get(&key) {
            return *condition_index;
        }
        let middle = if sides == [0; 6] { self.list.len() } else { self.condition_index([0; 6], load) };
        let mut condition = Condition { approach: sides, ..self.base };
        if let Some(load) = load {
            (condition.payload_kg, condition.payload_centre_mm) = (Some(load.mass_kg), load.centre_mm);
        }
        let condition_index = self.list.len();
        self.list.push(Inverse::new(self.model, &condition, self.nominal));
        self.middles.push(middle);
        self.condition_indices.insert(key, condition_index);
        condition_index
    }

    /// The condition with the same payload and every joint at mid-play.
    pub(crate) fn middle(&self, condition_index: usize) -> usize {
        self.middles[condition_index]
    }

    /// The inverse of the arm under a condition.
    pub(crate) fn inverse(&self, condition_index: usize) -> &Inverse<'a> {
        &self.list[condition_index]
    }

    /// The arm under a condition.
    pub(crate) fn arm(&self, condition_index: usize) -> &PreparedModel<'a> {
        self.list[condition_index].arm()
    }

    /// Link angles under a condition with motor joints `joints`, without what a load does: compliance, and the play that it closes.
    pub(crate) fn links(&self, condition_index: usize, joints: &Joints) -> Joints {
        let arm = self.arm(condition_index);
        let (plays, sides) = (arm.open_plays_rad(joints), arm.condition.approach);
        joints + self.joints_of_gears * Joints::from_fn(|j, _| 0.5 * plays[j] * f64::from(sides[j]))
    }

    /// Position uncertainty of a point on the flange from joints of unknown backlash side: half the backlash of each, as
    /// independent displacements (mm).
    pub(crate) fn play_uncertainty_mm(
        &self,
        condition_index: usize,
        joints: &Joints,
        flange_from_tool: &Pose,
    ) -> f64 {
        let arm = self.arm(condition_index);
        let open = |j: usize| self.play_rad[j] != 0.0 && arm.condition.approach[j] == 0;
        if !(0..6).any(open) {
            return 0.0;
        }
        let (frames, plays) = (arm.frames(joints), arm.open_plays_rad(joints));
        let point = (frames.last() * arm.model.flange * flange_from_tool).translation.vector;
        let square = |j: usize| {
            let lever = point - Vector3::from(frames.origin[j]);
            (Vector3::from(frames.z[j]).cross(&lever) * (0.5 * plays[j])).norm_squared()
        };
        (0..6).filter(|&j| open(j)).map(square).sum::<f64>().sqrt()
    }

    /// Runs `work` on the items of each condition together: `work(condition_index, items)` returns results in the order of
    /// `items`.
    pub(crate) fn each<T>(
        &self,
        condition_indices: &[usize],
        mut work: impl FnMut(usize, Option<&[usize]>) -> Vec<T>,
    ) -> Vec<T> {
        let Some(&first) = condition_indices.first() else { return Vec::new() };
        if condition_indices.iter().all(|condition_index| *condition_index == first) {
            return work(first, None);
        }
        let mut out: Vec<Option<T>> = condition_indices.iter().map(|_| None).collect();
        let mut order: Vec<usize> = (0..condition_indices.len()).collect();
        order.sort_by_key(|&i| condition_indices[i]);
        for items in order.chunk_by(|&a, &b| condition_indices[a] == condition_indices[b]) {
            for (i, found) in items.iter().zip(work(condition_indices[items[0]], Some(items))) {
                out[*i] = Some(found);
            }
        }
        out.into_iter().flatten().collect()
    }

    /// Flange poses, each under its condition.
    pub(crate) fn forward(&self, condition_indices: &[usize], joints: &[Joints]) -> Vec<Pose> {
        self.each(condition_indices, |condition_index, items| match items {
            None => self.arm(condition_index).forward_many(joints),
            Some(items) => self.arm(condition_index).forward_many(&select(joints, items)),
        })
    }
}

/// The items at the given indices.
pub(crate) fn select<T: Clone>(all: &[T], items: &[usize]) -> Vec<T> {
    items.iter().map(|&i| all[i].clone()).collect()
}
