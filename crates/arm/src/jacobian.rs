//! Analytic derivatives of the pose with respect to joints and to every parameter.
//!
//! A derivative is a twist: velocity of the point [mm per unit of the parameter], then angular velocity [rad per
//! unit], both in the frame in which the point is given (base or world).
//!
//! With frame i−1 before link i (z, o), x′ its x axis after the joint's rotation, frame i after it (y, o), point p:
//! theta turns about z through oᵢ₋₁, d shifts along z, a shifts along x′, alpha turns about x′ through oᵢ, beta turns
//! about yᵢ through oᵢ.

use nalgebra::{Matrix3, Matrix6, Matrix6xX, Vector3, Vector6};

use super::chain::{Chain, cross, minus};
use super::link_motion::LinkMotion;
use super::model::{MovedLinks, PreparedModel};
use super::parameter::{LinkCoordinate, Parameter};
use crate::joints::Joints;
use truegrind_math::se3::{Pose, left_jacobian, pose_from_vector};

fn turning(axis: &[f64; 3], through: &[f64; 3], point: &[f64; 3]) -> Vector6<f64> {
    let v = cross(axis, &minus(point, through));
    Vector6::new(v[0], v[1], v[2], axis[0], axis[1], axis[2])
}

fn shifting(axis: &[f64; 3]) -> Vector6<f64> {
    Vector6::new(axis[0], axis[1], axis[2], 0.0, 0.0, 0.0)
}

/// Twist of a point [mm, in the base] that rides on the flange, for one coordinate of link `joint` (0-based).
pub fn link_twist(
    frames: &Chain<f64>,
    joint: usize,
    coordinate: LinkCoordinate,
    point: &[f64; 3],
) -> Vector6<f64> {
    let after = &frames.origin[joint + 1];
    match coordinate {
        LinkCoordinate::Theta => turning(&frames.z[joint], &frames.origin[joint], point),
        LinkCoordinate::D => shifting(&frames.z[joint]),
        LinkCoordinate::A => shifting(&frames.lateral[joint]),
        LinkCoordinate::Alpha => turning(&frames.lateral[joint], after, point),
        LinkCoordinate::Beta => turning(&frames.y[joint], after, point),
    }
}

/// 6 × 6 Jacobian of a point [mm, in the base] that rides on the flange with respect to the controller's joints
/// [mm/rad over rad/rad], effects and couplings included.
pub fn joint_jacobian(
    arm: &PreparedModel<'_>,
    q: &Joints,
    frames: &Chain<f64>,
    point: &[f64; 3],
) -> Matrix6<f64> {
    let moved = arm.link_motions(q);
    let mut out = rotation_twists(frames, &moved, point) * arm.rotation_jacobian(q);
    for index in 0..moved.len() {
        let columns = moved[index].by_mapped_angle.map(|change| change_twist(&moved, index, &change, point));
        out += Matrix6::from_columns(&columns) * arm.model.joint_map;
    }
    out
}

/// Twist of a point where the motion of links at `index` changes, and with it those that it carries.
fn change_twist(
    moved: &[MovedLinks],
    index: usize,
    change: &LinkMotion<f64>,
    point: &[f64; 3],
) -> Vector6<f64> {
    let MovedLinks { first, motion, .. } = &moved[index];
    let twist = motion.twist_vector(change, point);
    twist + carried_twist(&moved[index + 1..], *first, twist.fixed_rows::<3>(3).into_owned(), point)
}

/// Twist of a point where the frames from `first` on turn and gravity does not, which changes the motions of links among them, beyond carrying
/// them along.
fn carried_twist(
    moved: &[MovedLinks],
    first: usize,
    mut turn: Vector3<f64>,
    point: &[f64; 3],
) -> Vector6<f64> {
    let mut out = Vector6::zeros();
    for MovedLinks { motion, by_gravity, .. } in moved.iter().filter(|moved| moved.first >= first) {
        let Some(changes) = by_gravity else { continue };
        let twist: Vector6<f64> =
            (0..3).map(|axis| motion.twist_vector(&changes[axis], point) * turn[axis]).sum();
        out += twist;
        // The next is carried by this one.
        turn += twist.fixed_rows::<3>(3);
    }
    out
}

/// Twists of a point for the rotation of each joint, with the motions of links that follow it.
fn rotation_twists(frames: &Chain<f64>, moved: &[MovedLinks], point: &[f64; 3]) -> Matrix6<f64> {
    let mut out = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|joint| {
        let (mut axis, mut through) = (frames.z[joint], frames.origin[joint]);
        // Moved after it has turned, what a joint carries turns about its moved axis.
        for moved in moved.iter().filter(|moved| moved.joint == Some(joint)) {
            (axis, through) = (moved.motion.turned(&axis), moved.motion.moved(&through));
        }
        turning(&axis, &through, point) + carried_twist(moved, joint + 1, axis.into(), point)
    }));
    for (index, moved_links) in moved.iter().enumerate() {
        for (mut column, change) in out.column_iter_mut().zip(&moved_links.by_rotation) {
            column += change_twist(moved, index, change, point);
        }
    }
    out
}

/// An arm between a base frame and a tool frame, both given by translation and rotation vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseAndTool {
    /// The arm's base in the world: x, y, z (mm), rotation vector (rad).
    pub world_from_base: [f64; 6],
    /// The tool on the flange: x, y, z (mm), rotation vector (rad).
    pub flange_from_tool: [f64; 6],
}

impl BaseAndTool {
    /// Pose of the tool in the world.
    pub fn forward(&self, arm: &PreparedModel<'_>, q: &Joints) -> Pose {
        pose_from_vector(&self.world_from_base) * arm.forward(q) * pose_from_vector(&self.flange_from_tool)
    }
}

/// Twists of the tool in the world, one column for each of `parameters` (base, links, effects, tool).
/// Parameters of a cable move no pose: their columns are zero.
pub fn parameter_jacobian(
    ends: &BaseAndTool,
    arm: &PreparedModel<'_>,
    q: &Joints,
    parameters: &[Parameter],
) -> Matrix6xX<f64> {
    let frames = arm.frames(q);
    let base_from_flange = frames.last() * arm.model.flange;
    let world_from_base = pose_from_vector(&ends.world_from_base);
    let flange_from_tool = pose_from_vector(&ends.flange_from_tool);
    let base_from_tool = base_from_flange * flange_from_tool;
    let point: [f64; 3] = base_from_tool.translation.vector.into();
    let to_world = world_from_base.rotation.to_rotation_matrix();
    // Expressed in the base, as in most calls: no rotation to apply.
    let unturned = ends.world_from_base[3..] == [0.0; 3];
    let in_world = |twist: Vector6<f64>| {
        if unturned {
            return twist;
        }
        let v = to_world * twist.fixed_rows::<3>(0);
        let w = to_world * twist.fixed_rows::<3>(3);
        Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
    };
    let rotation_column = |vector: &[f64; 6], k: usize| {
        let phi = Vector3::new(vector[3], vector[4], vector[5]);
        let jacobian: Matrix3<f64> = left_jacobian(&phi);
        jacobian.column(k - 3).into_owned()
    };
    let growth: f64 = arm.model.effects.iter().map(|e| e.growth(&arm.condition)).sum();
    let mut of_effects = EffectTwists::of(arm, q, &frames, point);
    let columns: Vec<Vector6<f64>> = parameters
        .iter()
        .map(|parameter| match *parameter {
            Parameter::SensorFrame(k) if k < 3 => Vector6::ith(k, 1.0),
            Parameter::SensorFrame(k) => {
                let w = rotation_column(&ends.world_from_base, k);
                let v = w.cross(&(world_from_base.rotation * base_from_tool.translation.vector));
                Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
            }
            Parameter::Link { joint, coordinate } => {
                let scale = if coordinate.is_length() { 1.0 + growth } else { 1.0 };
                in_world(link_twist(&frames, joint, coordinate, &point) * scale)
            }
            Parameter::Effect { index, parameter } => in_world(of_effects.twist(index, parameter)),
            Parameter::Target(k) => {
                let to_flange = base_from_flange.rotation;
                if k < 3 {
                    let v = to_flange * Vector3::ith(k, 1.0);
                    in_world(Vector6::new(v.x, v.y, v.z, 0.0, 0.0, 0.0))
                } else {
                    let w = to_flange * rotation_column(&ends.flange_from_tool, k);
                    in_world(Vector6::new(0.0, 0.0, 0.0, w.x, w.y, w.z))
                }
            }
            Parameter::Outlet { .. } | Parameter::Zero { .. } | Parameter::Disturbance { .. } => {
                Vector6::zeros()
            }
        })
        .collect();
    Matrix6xX::from_columns(&columns)
}

/// Twists of a point [mm, in the base] for the parameters of effects.
pub struct EffectTwists<'a> {
    arm: &'a PreparedModel<'a>,
    q: &'a Joints,
    frames: &'a Chain<f64>,
    point: [f64; 3],
    /// For the rotation of each joint.
    of_joints: Matrix6<f64>,
    moved: Vec<MovedLinks>,
    /// The effect that was asked for last, with the joint rotations and the growth per unit of its parameters.
    latest: Option<(usize, Vec<Vector6<f64>>, Vec<f64>)>,
}

impl<'a> EffectTwists<'a> {
    /// Of an arm at controller angles `q`, where its joint frames are `frames`.
    pub fn of(arm: &'a PreparedModel<'a>, q: &'a Joints, frames: &'a Chain<f64>, point: [f64; 3]) -> Self {
        let moved = arm.link_motions(q);
        let of_joints = rotation_twists(frames, &moved, &point);
        Self { arm, q, frames, point, of_joints, moved, latest: None }
    }

    /// The twist for one parameter of effect `index`.
    pub fn twist(&mut self, index: usize, parameter: usize) -> Vector6<f64> {
        let effect = &self.arm.model.effects[index];
        let (rotation, growth) = match &self.latest {
            Some((latest, rotations, growths)) if *latest == index => {
                (rotations[parameter], growths.get(parameter).copied())
            }
            _ => {
                let rotations = self.arm.effect_regressors(index, self.q);
                let growths = effect.growth_regressors(&self.arm.condition);
                let of_this = (rotations[parameter], growths.get(parameter).copied());
                self.latest = Some((index, rotations, growths));
                of_this
            }
        };
        let mut out = Vector6::zeros();
        for joint in (0..6).filter(|&j| rotation[j] != 0.0) {
            out += self.of_joints.column(joint) * rotation[joint];
        }
        let growth = growth.unwrap_or(0.0);
        if growth != 0.0 {
            for (joint, link) in self.arm.model.links.iter().enumerate() {
                let along = |coordinate| link_twist(self.frames, joint, coordinate, &self.point);
                out += along(LinkCoordinate::A) * (growth * link.a_mm);
                out += along(LinkCoordinate::D) * (growth * link.d_mm);
            }
        }
        if let Some(at) = self.moved.iter().position(|moved| moved.index == index) {
            out += change_twist(&self.moved, at, &self.moved[at].by_parameter[parameter], &self.point);
        }
        out
    }
}
