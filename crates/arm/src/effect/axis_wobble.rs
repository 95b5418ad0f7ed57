//! An axis that wobbles twice a turn, as in a bearing with races that are not flat. It tilts all that the joint carries, about axes across
//! its own that stand still with the link before:
//!
//! ω = (a cos 2θ + b sin 2θ) x + (c cos 2θ + d sin 2θ) y, about the origin of the joint's frame, and displaces it likewise where the axis
//! tilts about another point. Once a turn it would be a link that is not straight.

use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross};
use crate::effect::parameter::EffectParameter;
use crate::link_motion::LinkMotion;
use truegrind_math::lanes::{Real, SinCos, sin_cos};

/// An axis that wobbles.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, axis_wobble::AxisWobble};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // At 0 and at half a turn axis 1 leans by 1e-4 rad about y, at a quarter turn by as much the other way: the flange is 374 mm out along
/// // x, then above y.
/// let arm = robots::load("abb-irb-120")?.model;
/// let wobble = AxisWobble { joint: 0, tilt_rad: [0.0, 0.0, 1e-4, 0.0], radial_mm: None };
/// let worn = Model { effects: vec![Effect::AxisWobble(wobble)], ..arm.clone() };
/// let up = |angle: f64| {
///     let q = Joints::new(angle, 0.0, 0.0, 0.0, 0.0, 0.0);
///     let still = Condition::default();
///     (worn.forward(&q, &still).translation.vector - arm.forward(&q, &still).translation.vector).z
/// };
/// assert!((up(0.0) + 0.0374).abs() < 1e-5 && up(std::f64::consts::FRAC_PI_2).abs() < 1e-5);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisWobble {
    /// The joint, 0-based.
    pub joint: usize,
    /// a, b, c and d (rad).
    pub tilt_rad: [f64; 4],
    /// The same of the displacement (mm), where it runs out too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radial_mm: Option<[f64; 4]>,
}

const TILTS: [&str; 4] = ["tilt x cos", "tilt x sin", "tilt y cos", "tilt y sin"];
const RADIALS: [&str; 4] = ["radial x cos", "radial x sin", "radial y cos", "radial y sin"];

impl AxisWobble {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let of = |names: [&'static str; 4], unit, values: [f64; 4]| {
            names.into_iter().zip(values).map(move |(name, value)| EffectParameter { name, unit, value })
        };
        let radial = self.radial_mm.into_iter().flat_map(|values| of(RADIALS, "mm", values));
        of(TILTS, "rad", self.tilt_rad).chain(radial).collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        match &mut self.radial_mm {
            Some(radial) if index >= 4 => radial[(index - 4).min(3)] = value,
            _ => self.tilt_rad[index.min(3)] = value,
        }
    }

    /// Motions of what the joint carries per unit of each tilt, then of each displacement; `rotation` is the joint's. Or their derivatives
    /// with respect to it, with the joint's axes held.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn motions<R: SinCos>(&self, frames: &Chain<R>, rotation: R, slopes: bool) -> [LinkMotion<R>; 8] {
        let (z, across, origin) =
            (&frames.z[self.joint], &frames.lateral[self.joint], &frames.origin[self.joint]);
        let (sin, cos) = sin_cos(rotation);
        let beside = cross(z, across);
        let x: [R; 3] = [0, 1, 2].map(|k| across[k] * cos - beside[k] * sin);
        let y = cross(z, &x);
        let two = sin.splat(2.0);
        let (mut sin, mut cos) = (two * sin * cos, cos * cos - sin * sin);
        if slopes {
            (sin, cos) = (two * cos, -two * sin);
        }
        let zero = [sin.splat(0.0); 3];
        let times = |by: R, v: &[R; 3]| [by * v[0], by * v[1], by * v[2]];
        let directions = [times(cos, &x), times(sin, &x), times(cos, &y), times(sin, &y)];
        let mut out = [LinkMotion::none(sin); 8];
        for (k, direction) in directions.into_iter().enumerate() {
            out[k] = LinkMotion { about: *origin, shift: zero, turn: direction };
            out[4 + k] = LinkMotion { about: *origin, shift: direction, turn: zero };
        }
        out
    }

    /// The motion of what the joint carries.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn motion<R: SinCos>(&self, frames: &Chain<R>, rotations: &[R; 6]) -> LinkMotion<R> {
        self.sum(self.motions(frames, rotations[self.joint], false))
    }

    /// Its derivative with respect to the rotation of the joint.
    pub(super) fn motion_slope(&self, frames: &Chain<f64>, rotations: &[f64; 6]) -> LinkMotion<f64> {
        self.sum(self.motions(frames, rotations[self.joint], true))
    }

    #[cfg_attr(not(debug_assertions), inline(always))]
    fn sum<R: Real>(&self, motions: [LinkMotion<R>; 8]) -> LinkMotion<R> {
        let like = motions[0].turn[0];
        let mut out = LinkMotion { about: motions[0].about, ..LinkMotion::none(like) };
        let radial = self.radial_mm.unwrap_or_default();
        for (motion, size) in motions.iter().zip(self.tilt_rad.iter().chain(&radial)) {
            out.add(like.splat(*size), motion);
        }
        out
    }

    /// Its derivatives with respect to the parameters.
    pub(super) fn motion_regressors(
        &self,
        frames: &Chain<f64>,
        rotations: &[f64; 6],
    ) -> Vec<LinkMotion<f64>> {
        let all = self.motions(frames, rotations[self.joint], false);
        all[..if self.radial_mm.is_some() { 8 } else { 4 }].to_vec()
    }

    /// How far it can move a point within `extent_mm` of its joint at most (mm).
    pub(super) fn largest_mm(&self, extent_mm: f64) -> f64 {
        let sum = |values: &[f64; 4]| values.iter().map(|v| v.abs()).sum::<f64>();
        extent_mm * sum(&self.tilt_rad) + self.radial_mm.as_ref().map_or(0.0, sum)
    }
}
