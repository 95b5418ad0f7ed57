//! The estimated arm under every condition that a program brings about: from which sides its joints come, and what it
//! carries.
//!
//! A condition is prepared once and shared by all targets under it, so that they still go side by side in lanes.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::backlash::sides::Sides;
use crate::condition::payload::Load;
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model, PreparedModel};
use truegrind_math::se3::Pose;

/// A load as a key: the bits of mass and centre.
type LoadKey = Option<[u64; 4]>;

/// The conditions of one program, with the arm under each.
pub(crate) struct Circumstances<'a> {
    model: &'a Model,
    nominal: &'a Model,
    base: Condition,
    /// Play of each joint (rad); none for a joint without.
    pub(crate) play_rad: [f64; 6],
    places: HashMap<(Sides, LoadKey), usize>,
    list: Vec<Inverse<'a>>,
    /// For each place the one with the same load and every joint in the middle of its play.
    middles: Vec<usize>,
}

impl<'a> Circumstances<'a> {
    pub(crate) fn new(model: &'a Model, nominal: &'a Model, base: &Condition) -> Self {
        let mut play_rad = [0.0; 6];
        for effect in &model.effects {
            if let Effect::Backlash(backlash) = effect {
                play_rad[backlash.joint] += backlash.play_rad;
            }
        }
        let (places, list, middles) = (HashMap::new(), Vec::new(), Vec::new());
        Self { model, nominal, base: *base, play_rad, places, list, middles }
    }

    /// Whether it matters from which side a joint comes.
    pub(crate) fn has_play(&self) -> bool {
        self.play_rad.iter().any(|play| *play != 0.0)
    }

    /// The place of a condition in the list. Sides of joints without play make no difference, and without a load the
    /// base condition's counts.
    pub(crate) fn place(&mut self, sides: Sides, load: Option<&Load>) -> usize {
        let sides: Sides = std::array::from_fn(|j| if self.play_rad[j] == 0.0 { 0 } else { sides[j] });
        let [x, y, z] = load.map_or([0.0; 3], |load| load.centre_mm);
        let key = (sides, load.map(|load| [load.mass_kg, x, y, z].map(f64::to_bits)));
        if let Some(place) = self.places.get(&key) {
            return *place;
        }
        let middle = if sides == [0; 6] { self.list.len() } else { self.place([0; 6], load) };
        let mut condition = Condition { approach: sides, ..self.base };
        if let Some(load) = load {
            (condition.payload_kg, condition.payload_centre_mm) = (Some(load.mass_kg), load.centre_mm);
        }
        let place = self.list.len();
        self.list.push(Inverse::new(self.model, &condition, self.nominal));
        self.middles.push(middle);
        self.places.insert(key, place);
        place
    }

    /// The place with the same load as `place` and every joint in the middle of its play.
    pub(crate) fn middle(&self, place: usize) -> usize {
        self.middles[place]
    }

    /// The inverse of the arm under a condition.
    pub(crate) fn inverse(&self, place: usize) -> &Inverse<'a> {
        &self.list[place]
    }

    /// The arm under a condition.
    pub(crate) fn arm(&self, place: usize) -> &PreparedModel<'a> {
        self.list[place].arm()
    }

    /// Where the links stand under a condition with the motors at `joints`, load apart.
    pub(crate) fn links(&self, place: usize, joints: &Joints) -> Joints {
        let sides = self.arm(place).condition.approach;
        Joints::from_fn(|j, _| joints[j] + 0.5 * self.play_rad[j] * f64::from(sides[j]))
    }

    /// How far a point on the flange stands from where the flanks would have it, where the sides of joints with play are
    /// not known: half the play of each, as independent displacements (mm).
    pub(crate) fn in_play_mm(&self, place: usize, joints: &Joints, flange_from_tool: &Pose) -> f64 {
        let arm = self.arm(place);
        let open = |j: usize| self.play_rad[j] != 0.0 && arm.condition.approach[j] == 0;
        if !(0..6).any(open) {
            return 0.0;
        }
        let frames = arm.frames(joints);
        let point = (frames.last() * arm.model.flange * flange_from_tool).translation.vector;
        let square = |j: usize| {
            let lever = point - Vector3::from(frames.origin[j]);
            (Vector3::from(frames.z[j]).cross(&lever) * (0.5 * self.play_rad[j])).norm_squared()
        };
        (0..6).filter(|&j| open(j)).map(square).sum::<f64>().sqrt()
    }

    /// Runs `work` on the items under each condition together: `work(place, items)` answers in the order of `items`.
    pub(crate) fn each<T>(
        &self,
        places: &[usize],
        mut work: impl FnMut(usize, Option<&[usize]>) -> Vec<T>,
    ) -> Vec<T> {
        let Some(&first) = places.first() else { return Vec::new() };
        if places.iter().all(|place| *place == first) {
            return work(first, None);
        }
        let mut out: Vec<Option<T>> = places.iter().map(|_| None).collect();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&i| places[i]);
        for items in order.chunk_by(|&a, &b| places[a] == places[b]) {
            for (i, found) in items.iter().zip(work(places[items[0]], Some(items))) {
                out[*i] = Some(found);
            }
        }
        out.into_iter().flatten().collect()
    }

    /// Poses of the flange, each under its condition.
    pub(crate) fn forward(&self, places: &[usize], joints: &[Joints]) -> Vec<Pose> {
        self.each(places, |place, items| match items {
            None => self.arm(place).forward_many(joints),
            Some(items) => self.arm(place).forward_many(&picked(joints, items)),
        })
    }
}

/// The items at some places.
pub(crate) fn picked<T: Clone>(all: &[T], items: &[usize]) -> Vec<T> {
    items.iter().map(|&i| all[i].clone()).collect()
}
