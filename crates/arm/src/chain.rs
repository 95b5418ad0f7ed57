//! The forward kernel: link table in, joint frames out, for one row or for several in lanes.
//!
//! Cost: some 45 operations a link, 270 a pose; no branch but the one on Hayati links, no allocation.

use nalgebra::{Matrix3, Vector3};

use super::link::{Link, LinkModel};
use truegrind_math::lanes::{Real, splats};
use truegrind_math::se3::{Pose, rotation_from_matrix};

/// A link with its sines and cosines taken.
#[derive(Debug, Clone, Copy)]
pub struct LinkTable {
    a_mm: f64,
    d_mm: f64,
    sin_alpha: f64,
    cos_alpha: f64,
    sin_theta: f64,
    cos_theta: f64,
    sin_beta: f64,
    cos_beta: f64,
    twisted: bool,
}

impl From<&Link> for LinkTable {
    fn from(link: &Link) -> Self {
        let (sin_alpha, cos_alpha) = link.alpha_rad.sin_cos();
        let (sin_theta, cos_theta) = link.theta_rad.sin_cos();
        let (sin_beta, cos_beta) = link.beta_rad.sin_cos();
        let twisted = link.model == LinkModel::Hayati || link.beta_rad != 0.0;
        let (a_mm, d_mm) = (link.a_mm, link.d_mm);
        Self { a_mm, d_mm, sin_alpha, cos_alpha, sin_theta, cos_theta, sin_beta, cos_beta, twisted }
    }
}

/// The tables of six links.
pub fn tables(links: &[Link; 6]) -> [LinkTable; 6] {
    std::array::from_fn(|i| LinkTable::from(&links[i]))
}

/// All frames of the arm in the base, as columns. Index 0 of `z` and `origin` is the base, i is the end of link i.
#[derive(Debug, Clone, Copy)]
pub struct Chain<R> {
    /// x axis of link i (0-based) after the joint's rotation: the direction of a and the axis of alpha.
    pub lateral: [[R; 3]; 6],
    /// y axis of the frame at the end of link i (0-based): the axis of beta.
    pub y: [[R; 3]; 6],
    /// z axis of frame i, the axis of joint i+1.
    pub z: [[R; 3]; 7],
    /// Origin of frame i (mm).
    pub origin: [[R; 3]; 7],
    /// x axis of the last frame.
    pub x: [R; 3],
}

/// Cross product.
#[inline(always)]
pub fn cross<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Scalar product.
#[inline(always)]
pub fn dot<R: Real>(a: &[R; 3], b: &[R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Difference.
#[inline(always)]
pub fn minus<R: Real>(a: &[R; 3], b: &[R; 3]) -> [R; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A multiple.
#[inline(always)]
pub fn scaled<R: Real>(by: R, v: &[R; 3]) -> [R; 3] {
    [by * v[0], by * v[1], by * v[2]]
}

#[inline(always)]
fn blend<R: Real>(p: R, a: &[R; 3], q: R, b: &[R; 3]) -> [R; 3] {
    [p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]]
}

/// Frames of the chain for joint rotations given by sine and cosine (joint offsets of the links not included).
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn chain<R: Real>(links: &[LinkTable; 6], sin: &[R; 6], cos: &[R; 6]) -> Chain<R> {
    scaled_chain(links, sin, cos, sin[0].splat(1.0))
}

/// Like [`chain`], with all lengths times `scale`, which may differ from row to row (links that grow).
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn scaled_chain<R: Real>(links: &[LinkTable; 6], sin: &[R; 6], cos: &[R; 6], scale: R) -> Chain<R> {
    let mut end = FrameColumns::identity(scale);
    let base = end;
    // Unrolled: unused frames are then never written to memory.
    let (lateral_1, end_1) = (end.advance(&links[0], sin[0], cos[0], scale), end);
    let (lateral_2, end_2) = (end.advance(&links[1], sin[1], cos[1], scale), end);
    let (lateral_3, end_3) = (end.advance(&links[2], sin[2], cos[2], scale), end);
    let (lateral_4, end_4) = (end.advance(&links[3], sin[3], cos[3], scale), end);
    let (lateral_5, end_5) = (end.advance(&links[4], sin[4], cos[4], scale), end);
    let lateral_6 = end.advance(&links[5], sin[5], cos[5], scale);
    let ([x, y, z], origin) = (end.axes, end.origin);
    Chain {
        lateral: [lateral_1, lateral_2, lateral_3, lateral_4, lateral_5, lateral_6],
        y: [end_1.axes[1], end_2.axes[1], end_3.axes[1], end_4.axes[1], end_5.axes[1], y],
        z: [base.axes[2], end_1.axes[2], end_2.axes[2], end_3.axes[2], end_4.axes[2], end_5.axes[2], z],
        origin: [base.origin, end_1.origin, end_2.origin, end_3.origin, end_4.origin, end_5.origin, origin],
        x,
    }
}

/// The last frame alone, with the bits of [`chain`].
#[cfg_attr(not(debug_assertions), inline(always))]
pub fn last_frame<R: Real>(links: &[LinkTable; 6], sin: &[R; 6], cos: &[R; 6]) -> FrameColumns<R> {
    let one = sin[0].splat(1.0);
    let mut end = FrameColumns::identity(one);
    for (i, link) in links.iter().enumerate() {
        end.advance(link, sin[i], cos[i], one);
    }
    end
}

/// One frame in the base.
#[derive(Debug, Clone, Copy)]
pub struct FrameColumns<R> {
    /// x, y and z axis.
    pub axes: [[R; 3]; 3],
    /// Origin (mm).
    pub origin: [R; 3],
}

impl<R: Real> FrameColumns<R> {
    /// The base itself.
    #[inline(always)]
    fn identity(like: R) -> Self {
        let (zero, one) = (like.splat(0.0), like.splat(1.0));
        Self { axes: [[one, zero, zero], [zero, one, zero], [zero, zero, one]], origin: [zero; 3] }
    }

    /// Advances over one link; returns the x axis after the joint's rotation.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn advance(&mut self, link: &LinkTable, sin: R, cos: R, scale: R) -> [R; 3] {
        let [x, y, z] = self.axes;
        // sin and cos of joint angle plus offset
        let (so, co) = (sin.splat(link.sin_theta), sin.splat(link.cos_theta));
        let s = sin * co + cos * so;
        let c = cos * co - sin * so;
        let lateral = blend(c, &x, s, &y);
        let upright = blend(c, &y, -s, &x);
        let (a, d) = (scale * scale.splat(link.a_mm), scale * scale.splat(link.d_mm));
        for k in 0..3 {
            self.origin[k] += d * z[k] + a * lateral[k];
        }
        let (sa, ca) = (sin.splat(link.sin_alpha), sin.splat(link.cos_alpha));
        self.axes[1] = blend(ca, &upright, sa, &z);
        let z = blend(ca, &z, -sa, &upright);
        if link.twisted {
            let (sb, cb) = (sin.splat(link.sin_beta), sin.splat(link.cos_beta));
            self.axes[0] = blend(cb, &lateral, -sb, &z);
            self.axes[2] = blend(cb, &z, sb, &lateral);
        } else {
            self.axes[0] = lateral;
            self.axes[2] = z;
        }
        lateral
    }

    /// A frame that is fixed to this one, in the base.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn compose(&self, fixed: &FrameColumns<f64>) -> Self {
        let mut origin = self.direction_in_base(&fixed.origin);
        for (carried, base) in origin.iter_mut().zip(self.origin) {
            *carried += base;
        }
        let [x, y, z] = &fixed.axes;
        Self {
            axes: [self.direction_in_base(x), self.direction_in_base(y), self.direction_in_base(z)],
            origin,
        }
    }

    /// A direction of this frame, in the base.
    #[inline(always)]
    fn direction_in_base(&self, v: &[f64; 3]) -> [R; 3] {
        let mut out = self.origin;
        let v = splats(out[0], v);
        for (k, out) in out.iter_mut().enumerate() {
            *out = v[0] * self.axes[0][k] + v[1] * self.axes[1][k] + v[2] * self.axes[2][k];
        }
        out
    }
}

impl Chain<f64> {
    /// Pose of frame `i` in the base for i = 6, the last frame.
    pub fn last(&self) -> Pose {
        let column = |v: &[f64; 3]| Vector3::from(*v);
        let matrix = Matrix3::from_columns(&[column(&self.x), column(&self.y[5]), column(&self.z[6])]);
        Pose::from_parts(column(&self.origin[6]).into(), rotation_from_matrix(&matrix))
    }
}
