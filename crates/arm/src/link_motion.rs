//! Small rigid motions of a part of the arm against the rest: a base that tilts, an axis that wobbles in its bearing.
//!
//! A point p comes to o + v + R(ω) (p − o), all in the base: o the point about which the part turns, v its displacement, ω the turn. R is the
//! rotation of Cayley, tan(angle/2) = |ω|/2: exactly orthogonal without sine or cosine, and for a milliradian the rotation by ω to 1e-10 rad.

use nalgebra::Vector6;

use super::chain::{Chain, cross, dot, minus};
use truegrind_math::lanes::Real;

/// Such a motion, or its derivative with respect to one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkMotion<R> {
    /// The point about which it turns (mm).
    pub about: [R; 3],
    /// Displacement of that point (mm).
    pub shift: [R; 3],
    /// Turn (rad).
    pub turn: [R; 3],
}

impl<R: Real> LinkMotion<R> {
    /// No motion.
    #[inline(always)]
    pub fn none(like: R) -> Self {
        let zero = [like.splat(0.0); 3];
        Self { about: zero, shift: zero, turn: zero }
    }

    /// Adds a multiple of another, about the same point.
    #[inline(always)]
    pub fn add(&mut self, by: R, other: &Self) {
        for k in 0..3 {
            self.shift[k] += by * other.shift[k];
            self.turn[k] += by * other.turn[k];
        }
    }

    /// A direction, turned.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn turned(&self, v: &[R; 3]) -> [R; 3] {
        let half = [0, 1, 2].map(|k| self.turn[k].splat(0.5) * self.turn[k]);
        let once = cross(&half, v);
        let twice = cross(&half, &once);
        let one = half[0].splat(1.0);
        let factor = half[0].splat(2.0) / (one + dot(&half, &half));
        [0, 1, 2].map(|k| v[k] + factor * (once[k] + twice[k]))
    }

    /// Where a point comes to.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn moved(&self, point: &[R; 3]) -> [R; 3] {
        let turned = self.turned(&minus(point, &self.about));
        [0, 1, 2].map(|k| self.about[k] + turned[k] + self.shift[k])
    }

    /// Velocity and angular velocity of a point that has come to `point`, where the motion changes by `change` about the same point: the turn by
    /// (δω + ω × δω / 2) / (1 + |ω|²/4).
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn twist(&self, change: &Self, point: &[R; 3]) -> [[R; 3]; 2] {
        let (half, one) = (point[0].splat(0.5), point[0].splat(1.0));
        let factor = one / (one + half * half * dot(&self.turn, &self.turn));
        let beside = cross(&self.turn, &change.turn);
        let turn = [0, 1, 2].map(|k| factor * (change.turn[k] + half * beside[k]));
        let lever = [0, 1, 2].map(|k| point[k] - self.about[k] - self.shift[k]);
        let around = cross(&turn, &lever);
        [[0, 1, 2].map(|k| change.shift[k] + around[k]), turn]
    }
}

impl LinkMotion<f64> {
    /// [`LinkMotion::twist`] as one vector.
    pub fn twist_vector(&self, change: &Self, point: &[f64; 3]) -> Vector6<f64> {
        let [v, w] = self.twist(change, point);
        Vector6::new(v[0], v[1], v[2], w[0], w[1], w[2])
    }

    /// The same about the base's origin, to first order.
    pub fn about_base(&self) -> Self {
        let moved = cross(&self.about, &self.turn);
        Self { about: [0.0; 3], shift: [0, 1, 2].map(|k| self.shift[k] + moved[k]), turn: self.turn }
    }
}

impl<R: Real> Chain<R> {
    /// Moves the frames from `first` on, 0 the base, with the links that end in them.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub fn carry(&mut self, first: usize, motion: &LinkMotion<R>) {
        for i in first..7 {
            self.z[i] = motion.turned(&self.z[i]);
            self.origin[i] = motion.moved(&self.origin[i]);
            if i > 0 {
                self.lateral[i - 1] = motion.turned(&self.lateral[i - 1]);
                self.y[i - 1] = motion.turned(&self.y[i - 1]);
            }
        }
        self.x = motion.turned(&self.x);
    }
}
