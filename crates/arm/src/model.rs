//! An arm: links, joint map, limits, masses, effects, and the forward map from logged joints to the flange.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::chain::{self, Chain, FrameColumns, LinkTable};
use super::condition::Condition;
use super::effect::{Effect, Statics};
use super::link::Link;
use super::link_motion::LinkMotion;
use truegrind_math::lanes::{Real, SinCos, sin_cos};
use truegrind_math::se3::Pose;

pub use super::body::Body;
pub use super::joints::{Joints, MappedJoints};
pub use super::limits::{Limited, Limits, SumLimit};

/// A six-axis arm. See the chapter page for the order of the parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// The links from base to flange.
    pub links: [Link; 6],
    /// DH joint rotation = `joint_map` · controller angle (signs, couplings such as FANUC's J3 with J2).
    pub joint_map: Matrix6<f64>,
    /// Ranges of the controller's angles.
    pub limits: Limits,
    /// The flange in the last DH frame; identity for most arms.
    pub flange: Pose,
    /// Masses of the links, where known.
    pub bodies: Option<[Body; 6]>,
    /// Direction of gravity in the base, a unit vector; (0, 0, −1) for an arm that stands on the floor.
    pub gravity: Vector3<f64>,
    /// Physical effects beyond rigid links.
    pub effects: Vec<Effect>,
}

impl Model {
    /// The angles of the mapped arm for those of the controller.
    pub fn mapped(&self, q: &Joints) -> MappedJoints {
        MappedJoints(self.joint_map * q)
    }

    /// The condition with the sides of approach in the sense of the mapped angles, in which effects count. Where the joint map turns an
    /// angle round, above is below; the gear of a joint that is mapped with others turns with those too, and its side is known where all
    /// turn it the same way.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::robots;
    ///
    /// // FANUC's J3 is stated against the horizontal, so the gear between the links turns by -(J2 + J3); J4 to J6 are turned round.
    /// let arm = robots::load("fanuc-lr-mate-200id")?.model;
    /// let gears = |approach| arm.gear_condition(&Condition { approach, ..Condition::default() }).approach;
    /// assert_eq!(gears([1, 1, 1, 1, 0, -1]), [1, 1, -1, -1, 0, 1]);
    /// assert_eq!(gears([1, 1, -1, 1, 0, -1]), [1, 1, 0, -1, 0, 1]);
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn gear_condition(&self, condition: &Condition) -> Condition {
        if self.joint_map == Matrix6::identity() {
            return *condition;
        }
        let turns = |gear: usize| {
            let parts = (0..6).filter(move |&joint| self.joint_map[(gear, joint)] != 0.0);
            parts.map(move |joint| self.joint_map[(gear, joint)].signum() as i8 * condition.approach[joint])
        };
        let side = |gear: usize| {
            let first = turns(gear).next().unwrap_or(0);
            if turns(gear).all(|turn| turn == first) { first } else { 0 }
        };
        Condition { approach: std::array::from_fn(side), ..*condition }
    }

    /// Whether the gear of a joint turns with other joints of the controller too.
    pub fn is_coupled(&self, joint: usize) -> bool {
        (0..6).any(|other| other != joint && self.joint_map[(joint, other)] != 0.0)
    }

    /// Pose of the flange in the base. For many poses under one condition take [`Model::at_condition`] once.
    ///
    /// ```
    /// use std::f64::consts::FRAC_PI_2;
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// // The picture in the manual, turned by a quarter about axis 1.
    /// let arm = robots::load("abb-irb-120")?.model;
    /// let flange = arm.forward(&Joints::new(FRAC_PI_2, 0.0, 0.0, 0.0, 0.0, 0.0), &Condition::default());
    /// assert!((flange.translation.vector - nalgebra::Vector3::new(0.0, 374.0, 630.0)).norm() < 1e-9);
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn forward(&self, q: &Joints, condition: &Condition) -> Pose {
        self.at_condition(condition).forward(q)
    }

    /// The model with everything precomputed that does not depend on the joints.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::effect::{Effect, thermal::Thermal};
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// let mut arm = robots::load("abb-irb-120")?.model;
    /// let thermal = Thermal { growth: 0.0, time_constant_h: 1.0, start_h: 0.0, growth_per_k: 1.2e-5, reference_c: 20.0 };
    /// arm.effects.push(Effect::ThermalDrift(thermal));
    ///
    /// // Ten kelvin above its reference every length of the arm is 0.12 ‰ longer.
    /// let (cold, warm) = (Condition::default(), Condition { temperature_c: Some(30.0), ..Condition::default() });
    /// let place = |condition| arm.at_condition(condition).forward(&Joints::zeros()).translation.vector;
    /// assert!((place(&warm) - place(&cold) * (1.0 + 1.2e-4)).norm() < 1e-9);
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn at_condition(&self, condition: &Condition) -> PreparedModel<'_> {
        PreparedModel {
            model: self,
            condition: *condition,
            of_effects: self.gear_condition(condition),
            tables: chain::tables(&self.links_at(condition)),
            statics: (!self.effects.is_empty()).then(|| self.statics()),
            loaded: self.effects.iter().any(Effect::needs_torque),
            moves_links: self.effects.iter().any(|effect| effect.first_moved_frame().is_some()),
            has_identity_map: self.joint_map == Matrix6::identity(),
        }
    }

    /// Statics of the rigid arm: joint effects change the torque in second order only. Massless where the masses are unknown;
    /// then only the payload counts.
    pub fn statics(&self) -> Statics {
        Statics::new(&self.links, self.bodies, self.gravity, self.flange)
    }

    /// The links under a condition: grown by whatever effect changes lengths.
    pub fn links_at(&self, condition: &Condition) -> [Link; 6] {
        let growth: f64 = self.effects.iter().map(|e| e.growth(condition)).sum();
        let mut links = self.links;
        if growth != 0.0 {
            for link in &mut links {
                link.a_mm *= 1.0 + growth;
                link.d_mm *= 1.0 + growth;
            }
        }
        links
    }
}

/// A model under one condition, ready for many poses.
#[derive(Debug, Clone)]
pub struct PreparedModel<'a> {
    /// The arm.
    pub model: &'a Model,
    /// The condition.
    pub condition: Condition,
    /// Link tables under the condition.
    pub tables: [LinkTable; 6],
    /// The condition as effects count it ([`Model::gear_condition`]).
    of_effects: Condition,
    statics: Option<Statics>,
    loaded: bool,
    /// Whether an effect moves links against each other or against the base.
    moves_links: bool,
    /// Whether the joint map is the identity.
    has_identity_map: bool,
}

impl PreparedModel<'_> {
    /// Pose of the flange in the base.
    pub fn forward(&self, q: &Joints) -> Pose {
        self.frames(q).last() * self.model.flange
    }

    /// All joint frames in the base.
    pub fn frames(&self, q: &Joints) -> Chain<f64> {
        self.frames_of(&(*q).into())
    }

    /// All joint frames in the base, for one row or several in lanes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn frames_of<R: SinCos>(&self, q: &[R; 6]) -> Chain<R> {
        let mapped = self.apply_joint_map(q);
        if self.moves_links {
            self.frames_at::<R, true>(&mapped)
        } else {
            self.frames_at::<R, false>(&mapped)
        }
    }

    /// Whether an effect moves links. Kernels are compiled for either kind of arm: what only one of them needs costs the other registers.
    pub(crate) fn moves_links(&self) -> bool {
        self.moves_links
    }

    /// The same for mapped angles, of an arm whose effects move links or of one whose do not.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn frames_at<R: SinCos, const MOVES: bool>(&self, mapped: &[R; 6]) -> Chain<R> {
        let rotations = self.apply_effects(mapped);
        let (mut sin, mut cos) = (rotations, rotations);
        for i in 0..6 {
            (sin[i], cos[i]) = sin_cos(rotations[i]);
        }
        let mut frames = chain::chain(&self.tables, &sin, &cos);
        if MOVES && let Some(statics) = &self.statics {
            for effect in &self.model.effects {
                if let Some(first) = effect.first_moved_frame() {
                    let motion = effect.link_motion(statics, (mapped, &rotations), &self.of_effects, &frames);
                    frames.carry(first, &motion);
                }
            }
        }
        frames
    }

    /// The last frame alone, with the bits of [`PreparedModel::frames_of`].
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(crate) fn last_frame_of<R: SinCos, const MOVES: bool>(&self, q: &[R; 6]) -> FrameColumns<R> {
        let mapped = self.apply_joint_map(q);
        if MOVES {
            let frames = self.frames_at::<R, true>(&mapped);
            return FrameColumns { axes: [frames.x, frames.y[5], frames.z[6]], origin: frames.origin[6] };
        }
        let rotations = self.apply_effects(&mapped);
        let (mut sin, mut cos) = (rotations, rotations);
        for i in 0..6 {
            (sin[i], cos[i]) = sin_cos(rotations[i]);
        }
        chain::last_frame(&self.tables, &sin, &cos)
    }

    /// DH joint rotations (offsets of the links not included): joint map, then the joint effects.
    pub fn joint_rotations(&self, q: &Joints) -> Vector6<f64> {
        self.apply_effects(&self.apply_joint_map(&(*q).into())).into()
    }

    /// Whether mapped angles are the controller's.
    pub(crate) fn map_is_identity(&self) -> bool {
        self.has_identity_map
    }

    /// Joint angles after the joint map, for one row or several in lanes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn apply_joint_map<R: Real>(&self, q: &[R; 6]) -> [R; 6] {
        let map = &self.model.joint_map;
        let zero = q[0].splat(0.0);
        if self.has_identity_map {
            // The sum below, bit by bit: −0 becomes 0.
            let mut out = *q;
            for angle in &mut out {
                *angle = zero + *angle;
            }
            return out;
        }
        let mut out = [zero; 6];
        for i in 0..6 {
            for j in 0..6 {
                if map[(i, j)] != 0.0 {
                    out[i] += q[j].splat(map[(i, j)]) * q[j];
                }
            }
        }
        out
    }

    /// DH joint rotations for mapped joint angles: the effects alone, for one row or several in lanes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn apply_effects<R: SinCos>(&self, mapped: &[R; 6]) -> [R; 6] {
        let mut out = *mapped;
        if let Some(statics) = &self.statics {
            let torque = match self.loaded {
                true => statics.torques(mapped, &self.of_effects),
                false => [mapped[0].splat(0.0); 6],
            };
            for effect in &self.model.effects {
                effect.add_offset(statics, mapped, &torque, &self.of_effects, &mut out);
            }
        }
        out
    }

    /// Derivative of [`PreparedModel::joint_rotations`] with respect to the controller's angles.
    ///
    /// ```
    /// use truegrind_arm::condition::Condition;
    /// use truegrind_arm::effect::{Effect, coupling::Coupling};
    /// use truegrind_arm::model::Joints;
    /// use truegrind_arm::robots;
    ///
    /// // A wrist whose sixth axis turns by 0.1 % of what the fifth does.
    /// let mut arm = robots::load("abb-irb-120")?.model;
    /// arm.effects.push(Effect::JointCoupling(Coupling { joint: 5, driver: 4, factor: 1e-3 }));
    /// let still = Condition::default();
    /// let slopes = arm.at_condition(&still).rotation_jacobian(&Joints::repeat(0.3));
    /// assert_eq!((slopes[(5, 4)], slopes[(4, 5)], slopes[(5, 5)]), (1e-3, 0.0, 1.0));
    /// # Ok::<(), robots::RobotError>(())
    /// ```
    pub fn rotation_jacobian(&self, q: &Joints) -> Matrix6<f64> {
        let mut slope = Matrix6::identity();
        if let Some(statics) = &self.statics {
            let mapped = self.model.mapped(q);
            let torque = self.loaded.then(|| statics.torques_and_jacobian(&mapped, &self.of_effects).1);
            for effect in &self.model.effects {
                match (effect, &torque) {
                    (Effect::JointCompliance(compliance), Some(torque)) => {
                        compliance.add_jacobian(torque, &mut slope)
                    }
                    _ => slope += effect.jacobian(statics, &mapped, &self.of_effects),
                }
            }
        }
        slope * self.model.joint_map
    }

    /// Derivatives of the joint rotations with respect to the parameters of effect `index`.
    pub fn effect_regressors(&self, index: usize, q: &Joints) -> Vec<Vector6<f64>> {
        let mapped = self.model.mapped(q);
        match (&self.statics, self.model.effects.get(index)) {
            (Some(statics), Some(effect)) => effect.regressors(statics, &mapped, &self.of_effects),
            _ => Vec::new(),
        }
    }

    /// The play of each joint (rad) that no load closes at the controller's angles `q`: the side of approach decides where the link is in it.
    pub fn open_plays_rad(&self, q: &Joints) -> [f64; 6] {
        let mapped = self.model.mapped(q);
        let mut out = [0.0; 6];
        for effect in &self.model.effects {
            if let (Some((joint, _)), Some(statics)) = (effect.play_rad(), &self.statics) {
                out[joint] += effect.open_play_rad(statics, &mapped, &self.of_effects);
            }
        }
        out
    }

    /// Motions of links per unit of each parameter of effect `index`, about the base's origin; empty of an effect that moves none.
    pub fn link_motion_regressors(&self, index: usize, q: &Joints) -> Vec<LinkMotion<f64>> {
        let (Some(statics), Some(effect)) = (&self.statics, self.model.effects.get(index)) else {
            return Vec::new();
        };
        let mapped = self.model.mapped(q);
        let rotations = self.apply_effects(&mapped.into());
        let frames = chain::chain(&self.tables, &rotations.map(f64::sin), &rotations.map(f64::cos));
        let angles = (&mapped, &rotations.into());
        let all = effect.link_motion_regressors(statics, angles, &self.of_effects, &frames);
        all.iter().map(LinkMotion::about_base).collect()
    }

    /// The motion of links by all effects together, to first order and about the base's origin.
    pub fn link_motion(&self, q: &Joints) -> Option<LinkMotion<f64>> {
        let mut out = LinkMotion::none(0.0);
        let moved = self.link_motions(q);
        moved.iter().for_each(|moved| out.add(1.0, &moved.motion.about_base()));
        (!moved.is_empty()).then_some(out)
    }

    /// The motions of links by effects, in their order.
    pub fn link_motions(&self, q: &Joints) -> Vec<MovedLinks> {
        let Some(statics) = self.statics.as_ref().filter(|_| self.moves_links) else { return Vec::new() };
        let mapped = self.model.mapped(q);
        let rotations = self.apply_effects(&mapped.into());
        let mut frames = chain::chain(&self.tables, &rotations.map(f64::sin), &rotations.map(f64::cos));
        let angles = (&mapped, &rotations.into());
        let mut out = Vec::new();
        for (index, effect) in self.model.effects.iter().enumerate() {
            let Some(first) = effect.first_moved_frame() else { continue };
            let of = &self.of_effects;
            let motion = effect.link_motion(statics, (&mapped.into(), &rotations), of, &frames);
            let [by_rotation, by_mapped_angle] = effect.link_motion_slopes(statics, angles, of, &frames);
            let by_parameter = effect.link_motion_regressors(statics, angles, of, &frames);
            let by_gravity = effect.link_motion_slopes_of_gravity(statics, &frames);
            let joint = effect.joint_turned_before();
            out.push(MovedLinks {
                index,
                first,
                joint,
                motion,
                by_parameter,
                by_rotation,
                by_mapped_angle,
                by_gravity,
            });
            frames.carry(first, &motion);
        }
        out
    }
}

/// The motion of links by an effect, with its derivatives.
#[derive(Debug, Clone)]
pub struct MovedLinks {
    /// The effect in the model's list.
    pub index: usize,
    /// The first frame that moves, 0 the base.
    pub first: usize,
    /// The joint that turns it before it is moved, whose axis moves along.
    pub joint: Option<usize>,
    /// The motion.
    pub motion: LinkMotion<f64>,
    /// With respect to each parameter.
    pub by_parameter: Vec<LinkMotion<f64>>,
    /// With respect to the rotation of each joint, whose axes are held.
    pub by_rotation: [LinkMotion<f64>; 6],
    /// With respect to each mapped angle.
    pub by_mapped_angle: [LinkMotion<f64>; 6],
    /// As the part turns about the axes of the base, beyond being carried along; `None` where it only is.
    pub by_gravity: Option<[LinkMotion<f64>; 3]>,
}
