//! The static torques of an arm, for effects that need them.

use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use crate::body::Body;
use crate::chain::{self, Chain, LinkTable, cross, dot, minus};
use crate::condition::Condition;
use crate::gravity::STANDARD_GRAVITY;
use crate::joints::MappedJoints;
use crate::link::Link;
use truegrind_math::lanes::{SinCos, sin_cos, splats};
use truegrind_math::se3::Pose;

/// The static torques of an arm, for effects that need them.
#[derive(Debug, Clone)]
pub struct Statics {
    tables: [LinkTable; 6],
    bodies: [Body; 6],
    gravity: Vector3<f64>,
    /// The flange in the last frame.
    flange: Pose,
}

impl Statics {
    /// Statics of links without joint effects (their share in the torque is of second order), massless where the masses
    /// of the links are unknown (only the payload then counts). `gravity`: its direction in the base; `flange`: its pose in
    /// the last frame.
    pub(crate) fn new(
        links: &[Link; 6],
        bodies: Option<[Body; 6]>,
        gravity: Vector3<f64>,
        flange: Pose,
    ) -> Self {
        let bodies = bodies.unwrap_or([Body { mass_kg: 0.0, centre_mm: [0.0; 3] }; 6]);
        Self { tables: chain::tables(links), bodies, gravity, flange }
    }

    /// Torque of gravity about each joint axis (N m) at mapped angles `u`, and its derivative ∂τⱼ/∂uᵢ, which is
    /// symmetric because torque is the gradient of the potential energy.
    pub fn torques_and_jacobian(
        &self,
        u: &MappedJoints,
        condition: &Condition,
    ) -> (Vector6<f64>, Matrix6<f64>) {
        let (frames, levers) = self.levers::<f64>(&(*u).into(), condition);
        let g = self.gravity_newton();
        let torque = Vector6::from_fn(|j, _| dot(&frames.z[j], &cross(&levers[j], &g)));
        let turned: [[f64; 3]; 6] = std::array::from_fn(|i| cross(&cross(&frames.z[i], &levers[i]), &g));
        let slope = Matrix6::from_fn(|j, i| dot(&frames.z[j.min(i)], &turned[j.max(i)]));
        (torque, slope)
    }

    /// The torques alone, for one row or several in lanes.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn torques<R: SinCos>(&self, u: &[R; 6], condition: &Condition) -> [R; 6] {
        let (frames, levers) = self.levers(u, condition);
        let g = splats(u[0], &self.gravity_newton());
        let mut out = *u;
        for j in 0..6 {
            out[j] = dot(&frames.z[j], &cross(&levers[j], &g));
        }
        out
    }

    /// The frames, and the moment of gravity on everything that moves about the origin of the base (N m): what overturns its pedestal.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn overturning<R: SinCos>(&self, u: &[R; 6], condition: &Condition) -> (Chain<R>, [R; 3]) {
        let (frames, levers) = self.levers(u, condition);
        let moment = cross(&levers[0], &splats(u[0], &self.gravity_newton()));
        (frames, moment)
    }

    /// The frames, and the derivatives of that moment with respect to the mapped angles: a joint turns all that is beyond it.
    pub(super) fn overturning_slopes(
        &self,
        u: &MappedJoints,
        condition: &Condition,
    ) -> (Chain<f64>, [[f64; 3]; 6]) {
        let (frames, levers) = self.levers::<f64>(&(*u).into(), condition);
        let g = self.gravity_newton();
        let slopes = std::array::from_fn(|j| cross(&cross(&frames.z[j], &levers[j]), &g));
        (frames, slopes)
    }

    /// Direction of gravity in the base.
    pub(super) fn gravity(&self) -> [f64; 3] {
        self.gravity.into()
    }

    /// Weight of a kilogram, with metres for the millimetres of the levers.
    #[inline(always)]
    pub(super) fn gravity_newton(&self) -> [f64; 3] {
        let g = &self.gravity;
        [g.x, g.y, g.z].map(|along| along * STANDARD_GRAVITY * 1e-3)
    }

    /// The frames at mapped angles `u`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn frames<R: SinCos>(&self, u: &[R; 6]) -> Chain<R> {
        let (mut sin, mut cos) = (*u, *u);
        for i in 0..6 {
            (sin[i], cos[i]) = sin_cos(u[i]);
        }
        chain::chain(&self.tables, &sin, &cos)
    }

    /// m (c − o) [kg mm] of the body between a joint and the next, about the joint's frame.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn own_lever<R: SinCos>(&self, frames: &Chain<R>, joint: usize) -> [R; 3] {
        let body = &self.bodies[joint];
        let (y, z) = (&frames.y[joint], &frames.z[joint + 1]);
        let x = cross(y, z);
        let mass = y[0].splat(body.mass_kg);
        let c = splats(y[0], &body.centre_mm);
        let mut out = minus(&frames.origin[joint + 1], &frames.origin[joint]);
        for i in 0..3 {
            out[i] = mass * (out[i] + c[0] * x[i] + c[1] * y[i] + c[2] * z[i]);
        }
        out
    }

    /// The frames, and for each joint Σ m (c − o) [kg mm] over everything beyond it.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn levers<R: SinCos>(&self, u: &[R; 6], condition: &Condition) -> (Chain<R>, [[R; 3]; 6]) {
        let zero = u[0].splat(0.0);
        let frames = self.frames(u);
        let mut levers = [[zero; 3]; 6];
        let (mut sum, mut mass) = ([zero; 3], 0.0);
        let payload_centre = self.flange * Point3::from(condition.payload_centre_mm);
        for k in (0..6).rev() {
            let (y, z, o) = (&frames.y[k], &frames.z[k + 1], &frames.origin[k + 1]);
            let x = cross(y, z);
            let body = &self.bodies[k];
            let payload = if k == 5 { condition.payload_kg.unwrap_or(0.0) } else { 0.0 };
            // Σ m c of the body, and of the payload, both in the frame of the link.
            let mut c = [0.0; 3];
            for i in 0..3 {
                c[i] = body.mass_kg * body.centre_mm[i] + payload * payload_centre[i];
            }
            let here = body.mass_kg + payload;
            mass += here;
            let (c, here, total) = (splats(zero, &c), zero.splat(here), zero.splat(mass));
            for i in 0..3 {
                sum[i] += here * o[i] + c[0] * x[i] + c[1] * y[i] + c[2] * z[i];
                levers[k][i] = sum[i] - total * frames.origin[k][i];
            }
        }
        (frames, levers)
    }
}
