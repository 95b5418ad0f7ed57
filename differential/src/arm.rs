//! The arm of the test: what the controller believes (the data sheet) and what stands in the cell (the actual arm).
//!
//! Both are chains of links Rot_z(θ) Trans(a, 0, d) Rot_x(α) Rot_y(β). The actual arm has other numbers, joints that
//! yield under the torque of gravity on links and payload, a base that tilts under it, an axis that wobbles, and joints with play, whose links
//! stay where they are until a flank takes them along ([`play`](crate::play)). The controller's inverse is the closed form of an arm with a spherical wrist.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::joint_map::JointMap;

/// A pose (mm).
pub type Pose = Isometry3<f64>;

/// Standard gravity, in N per kg and with metres for millimetres.
const WEIGHT: f64 = 9.806_65e-3;

/// One link (mm, rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Length along x.
    pub a: f64,
    /// Length along z.
    pub d: f64,
    /// Twist about x.
    pub alpha: f64,
    /// Angle about z at joint angle 0.
    pub theta: f64,
    /// Twist about y.
    pub beta: f64,
}

/// The mass of a link and its centre in the frame of the link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mass {
    /// kg.
    pub kg: f64,
    /// mm.
    pub centre: [f64; 3],
}

/// What beside the joint angles decides where the actual arm stands.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Circumstance {
    /// How far each link stands before its motor (rad): the negative half of its play where it was pushed from below.
    pub behind: [f64; 6],
    /// Mass at the flange (kg).
    pub payload_kg: f64,
    /// Its centre on the flange (mm).
    pub payload_centre_mm: [f64; 3],
}

/// RAPID's `confdata` of a joint vector.
pub type Configuration = [i32; 4];

/// An arm as told and as it is.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Links of the data sheet.
    pub nominal: [Link; 6],
    /// Links as they are.
    pub actual: [Link; 6],
    /// How the controller counts the joints; everything but the axes' own angles is as counted.
    pub map: JointMap,
    /// Lowest joint angles (rad).
    pub min: [f64; 6],
    /// Highest joint angles (rad).
    pub max: [f64; 6],
    /// How far the third axis itself turns, whatever is counted (rad).
    pub elbow: [f64; 2],
    /// Masses of the links; none where the maker does not say.
    pub masses: Option<[Mass; 6]>,
    /// What each joint yields (rad per N m).
    pub compliance: [f64; 6],
    /// Play of each joint (rad).
    pub play: [f64; 6],
    /// What the base tilts (rad per N m).
    pub soft_base: f64,
    /// An axis that wobbles twice a turn.
    pub wobble: Option<Wobble>,
}

/// An axis that wobbles twice a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wobble {
    /// The joint.
    pub joint: usize,
    /// Tilt about x with the cosine and the sine of twice the angle, then about y (rad).
    pub tilt: [f64; 4],
}

fn step(link: &Link, angle: f64) -> Pose {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle + link.theta);
    let twist = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), link.alpha)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), link.beta);
    Pose::from_parts(Translation3::from(turn * Vector3::new(link.a, 0.0, link.d)), turn * twist)
}

fn frames(links: &[Link; 6], angles: &[f64; 6]) -> [Pose; 7] {
    let mut out = [Pose::identity(); 7];
    for j in 0..6 {
        out[j + 1] = out[j] * step(&links[j], angles[j]);
    }
    out
}

impl Arm {
    /// The flange as the controller computes it.
    pub fn nominal_forward(&self, q: &[f64; 6]) -> Pose {
        frames(&self.nominal, &self.map.axes(q))[6]
    }

    /// The flange as it stands.
    pub fn actual_forward(&self, q: &[f64; 6], circumstance: &Circumstance) -> Pose {
        let yields = self.compliance.iter().any(|c| *c != 0.0);
        let torque = if yields { self.torques(q, circumstance) } else { [0.0; 6] };
        let axes = self.map.axes(q);
        let mut pose = self.base(q, circumstance);
        for j in 0..6 {
            let angle = axes[j] + self.compliance[j] * torque[j] + circumstance.behind[j];
            if let Some(wobble) = self.wobble.filter(|wobble| wobble.joint == j) {
                // Of axes that stand still: where the link stands at the angle 0.
                let x =
                    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.actual[j].theta) * Vector3::x();
                let ((sin, cos), [a, b, c, d]) = ((2.0 * angle).sin_cos(), wobble.tilt);
                let turn = x * (a * cos + b * sin) + Vector3::z().cross(&x) * (c * cos + d * sin);
                pose *= Pose::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(turn));
            }
            pose *= step(&self.actual[j], angle);
        }
        pose
    }

    /// Where the base stands under the moment of gravity about its origin.
    fn base(&self, q: &[f64; 6], circumstance: &Circumstance) -> Pose {
        if self.soft_base == 0.0 {
            return Pose::identity();
        }
        let weights = self.weights(&frames(&self.actual, &self.map.axes(q)), circumstance);
        let moment: Vector3<f64> = weights
            .iter()
            .map(|(_, kg, centre)| centre.coords.cross(&Vector3::new(0.0, 0.0, -WEIGHT * kg)))
            .sum();
        let turn = UnitQuaternion::from_scaled_axis(moment * self.soft_base);
        Pose::from_parts(Translation3::identity(), turn)
    }

    /// What gravity pulls at: the link that carries it, its mass (kg) and its centre.
    fn weights(&self, at: &[Pose; 7], circumstance: &Circumstance) -> Vec<(usize, f64, Point3<f64>)> {
        let mut weights = Vec::new();
        for (j, mass) in self.masses.iter().flatten().enumerate() {
            weights.push((j, mass.kg, at[j + 1] * Point3::from(mass.centre)));
        }
        weights.push((5, circumstance.payload_kg, at[6] * Point3::from(circumstance.payload_centre_mm)));
        weights
    }

    /// Torque of gravity about each axis (N m).
    pub fn torques(&self, q: &[f64; 6], circumstance: &Circumstance) -> [f64; 6] {
        let at = frames(&self.actual, &self.map.axes(q));
        let weights = self.weights(&at, circumstance);
        std::array::from_fn(|j| {
            let (axis, origin) = (at[j].rotation * Vector3::z(), at[j].translation.vector);
            let carried = weights.iter().filter(|(link, ..)| *link >= j);
            carried
                .map(|(_, kg, centre)| {
                    let force = Vector3::new(0.0, 0.0, -WEIGHT * kg);
                    axis.dot(&(centre.coords - origin).cross(&force))
                })
                .sum()
        })
    }

    /// All joint vectors within the limits at which the data sheet's arm has its flange at a pose, every turn of every
    /// branch, the one nearest to `near` first.
    pub fn nominal_inverse(&self, flange: &Pose, near: Option<&[f64; 6]>) -> Vec<[f64; 6]> {
        let mut out = Vec::new();
        for branch in self.branches(flange) {
            self.turns(&branch, 0, &mut branch.clone(), &mut out);
        }
        if let Some(near) = near {
            let far = |q: &[f64; 6]| (0..6).map(|j| (q[j] - near[j]).abs()).fold(0.0, f64::max);
            out.sort_by(|a, b| far(a).total_cmp(&far(b)));
        }
        out
    }

    /// The one of them that is nearest to `near`, by the joint that goes farthest.
    pub fn nominal_nearest(&self, flange: &Pose, near: &[f64; 6]) -> Option<[f64; 6]> {
        let mut best: Option<(f64, [f64; 6])> = None;
        for branch in self.branches(flange) {
            let nearest = |j: usize, q: &[f64; 6]| {
                let fits = |angle: &f64| self.is_within(j, *angle, q[1]);
                let all = (-2..=2).map(|turn| branch[j] + TAU * f64::from(turn)).filter(fits);
                all.min_by(|a, b| (a - near[j]).abs().total_cmp(&(b - near[j]).abs()))
            };
            let mut q = [0.0; 6];
            let mut far = 0.0_f64;
            let mut reached = true;
            for j in 0..6 {
                match nearest(j, &q) {
                    Some(angle) => (q[j], far) = (angle, far.max((angle - near[j]).abs())),
                    None => reached = false,
                }
            }
            if reached && best.is_none_or(|(least, _)| far < least) {
                best = Some((far, q));
            }
        }
        best.map(|best| best.1)
    }

    /// Whether a joint goes to an angle while the second one stands at `second`.
    fn is_within(&self, joint: usize, angle: f64, second: f64) -> bool {
        let counted = [self.min[joint], self.max[joint]];
        let within = |angle: f64, [low, high]: [f64; 2]| angle >= low - 1e-9 && angle <= high + 1e-9;
        let axis = self.map.sign[2] * angle + self.map.coupling * second;
        within(angle, counted) && (joint != 2 || within(axis, self.elbow))
    }

    fn turns(&self, branch: &[f64; 6], joint: usize, here: &mut [f64; 6], out: &mut Vec<[f64; 6]>) {
        if joint == 6 {
            return out.push(*here);
        }
        for turn in -2..=2 {
            let angle = branch[joint] + TAU * f64::from(turn);
            if self.is_within(joint, angle, here[1]) {
                here[joint] = angle;
                self.turns(branch, joint + 1, here, out);
            }
        }
    }

    /// The branches of the closed form, the angles about the axes within half a turn, as counted.
    fn branches(&self, flange: &Pose) -> Vec<[f64; 6]> {
        let l = &self.nominal;
        let wrist = flange * Point3::new(0.0, 0.0, -l[5].d);
        let reach = wrist.x.hypot(wrist.y);
        let (upper, lower) = (l[1].a, l[2].a.hypot(l[3].d));
        let bend = l[3].d.atan2(l[2].a);
        let mut out = Vec::new();
        for (radius, q1) in [(reach, wrist.y.atan2(wrist.x)), (-reach, (-wrist.y).atan2(-wrist.x))] {
            // In the plane of the arm: outwards, and downwards.
            let (r, down) = (radius - l[0].a, l[0].d - wrist.z);
            let square = r * r + down * down;
            let cosine = (square - upper * upper - lower * lower) / (2.0 * upper * lower);
            if !(cosine.abs() <= 1.0) {
                continue;
            }
            for elbow in [cosine.acos(), -cosine.acos()] {
                let phi = down.atan2(r) - (lower * elbow.sin()).atan2(upper + lower * elbow.cos());
                let q2 = wrapped(phi - l[1].theta);
                let q3 = wrapped(elbow - bend);
                self.wrist(flange, wrapped(q1), q2, q3, &mut out);
            }
        }
        out.iter_mut().for_each(|axes| *axes = self.map.counted(axes));
        out
    }

    fn wrist(&self, flange: &Pose, q1: f64, q2: f64, q3: f64, out: &mut Vec<[f64; 6]>) {
        let arm = frames(&self.nominal, &[q1, q2, q3, 0.0, 0.0, 0.0])[3];
        let goal = arm.rotation.inverse() * flange.rotation;
        let z = goal * Vector3::z();
        let sine = z.x.hypot(z.y);
        for sign in [1.0, -1.0] {
            let q5 = (sign * sine).atan2(z.z);
            let q4 = if sine > 1e-12 { (-sign * z.y).atan2(-sign * z.x) } else { 0.0 };
            let before = step(&self.nominal[3], q4).rotation * step(&self.nominal[4], q5).rotation;
            let rest = before.inverse() * goal;
            let x = rest * Vector3::x();
            let q6 = wrapped(x.y.atan2(x.x) - self.nominal[5].theta);
            out.push([q1, q2, q3, q4, q5, q6]);
        }
    }

    /// `confdata` of a joint vector: quarter turns of axes 1, 4 and 6, and the branch.
    pub fn configuration(&self, q: &[f64; 6]) -> Configuration {
        let quarter = |angle: f64| (angle / FRAC_PI_2).floor() as i32;
        let [shoulder, elbow, wrist] = self.borders(q);
        let branch = 4 * i32::from(shoulder < 0.0) + 2 * i32::from(elbow < 0.0) + i32::from(wrist < 0.0);
        [quarter(q[0]), quarter(q[3]), quarter(q[5]), branch]
    }

    /// How far the arm stands from its three singularities: wrist centre over axis 1 (share of the reach), arm stretched
    /// (sine), axes 4 and 6 in line (sine). The signs tell the branches apart: the arm leans forward and axis 5 is positive as
    /// counted.
    pub fn borders(&self, q: &[f64; 6]) -> [f64; 3] {
        let l = &self.nominal;
        let [_, forward, _, _, fifth, _] = self.map.sign;
        let q = self.map.axes(q);
        let bend = l[3].d.atan2(l[2].a);
        let (upper, lower) = (l[1].a, l[2].a.hypot(l[3].d));
        let (first, second) = (q[1] + l[1].theta, q[1] + l[1].theta + q[2] + bend);
        let reach = l[0].a + upper * first.cos() + lower * second.cos();
        [forward * reach / (upper + lower), forward * (second - first).sin(), fifth * q[4].sin()]
    }

    /// Joints at which the *actual* arm has its flange at a pose, from a start (Newton's method).
    pub fn actual_inverse(&self, flange: &Pose, start: &[f64; 6], at: &Circumstance) -> Option<[f64; 6]> {
        let mut q = *start;
        for _ in 0..40 {
            let here = self.actual_forward(&q, at);
            let off = twist(&here, flange);
            if off.fixed_rows::<3>(0).norm() < 1e-9 && off.fixed_rows::<3>(3).norm() < 1e-12 {
                return Some(q);
            }
            let mut slope = nalgebra::Matrix6::zeros();
            for j in 0..6 {
                let mut moved = q;
                moved[j] += 1e-6;
                slope.set_column(j, &(twist(&here, &self.actual_forward(&moved, at)) / 1e-6));
            }
            let step = slope.try_inverse()? * off;
            let most = step.amax();
            let share = if most > 0.3 { 0.3 / most } else { 1.0 };
            (0..6).for_each(|j| q[j] += share * step[j]);
        }
        let (mm, rad) = difference(&self.actual_forward(&q, at), flange);
        (mm < 1e-6 && rad < 1e-8).then_some(q)
    }
}

/// An angle within half a turn.
pub fn wrapped(angle: f64) -> f64 {
    let turned = (angle + PI).rem_euclid(TAU) - PI;
    if turned <= -PI { turned + TAU } else { turned }
}

/// The motion that takes `a` to `b`: of its origin (mm), and its rotation vector in the base (rad).
fn twist(a: &Pose, b: &Pose) -> nalgebra::Vector6<f64> {
    let moved = b.translation.vector - a.translation.vector;
    let turned = (b.rotation * a.rotation.inverse()).scaled_axis();
    nalgebra::Vector6::new(moved.x, moved.y, moved.z, turned.x, turned.y, turned.z)
}

/// How far two poses are apart: mm, rad.
pub fn difference(a: &Pose, b: &Pose) -> (f64, f64) {
    // The arc cosine of the trace would be blind below 1e-8.
    let turn = a.rotation.inverse() * b.rotation;
    let angle = 2.0 * turn.imag().norm().atan2(turn.w.abs());
    ((a.translation.vector - b.translation.vector).norm(), angle)
}
