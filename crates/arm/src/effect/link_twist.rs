//! A link that twists, and an axis at its end that leans, because what it carries stands beside the plane in which the arm moves: drives at
//! one side of the forearm, a wrist beside it.
//!
//! Such a load pulls about the link's end with a moment of constant size along h = z × g, z the axis of the link's joint and g the direction
//! of gravity. Of that the part along the link, x, twists it like a shaft, and the part across it, y = z × x, tilts the bearing at its end:
//!
//! ω = t (x · h) x + l (y · h) y, about the link's end.
//!
//! t is the twist of a level link, l the lean of a link that stands upright. Once written for an upright arm, ω goes around twice while the
//! joint turns once, as an axis does that wobbles; but the load says in which phase, and where t and l are alike ω stands still.
//!
//! Source: torsion of shafts and reactions of bearings, as any text on the mechanics of materials has them (Gere and Goodno). That the side
//! of the load does not change is an approximation: it neglects how the wrist turns beside the forearm.

use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross, dot, scaled};
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::link_motion::LinkMotion;
use truegrind_math::lanes::{Real, splats};

/// A link that twists under a load beside it.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, link_twist::LinkTwist};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // The upper link lies level along x and twists by 1e-4 rad; the wrist centre, 302 mm below its line, goes aside by as much of that.
/// let arm = robots::load("abb-irb-120")?.model;
/// let twist = LinkTwist { joint: 1, twist_rad: 1e-4, lean_rad: None };
/// let soft = Model { effects: vec![Effect::LinkTwist(twist)], ..arm.clone() };
/// let level = Joints::new(0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0);
/// let wrist = |arm: &Model| arm.at_condition(&Condition::default()).frames(&level).origin[4];
/// let aside = wrist(&soft)[1] - wrist(&arm)[1];
/// assert!((aside.abs() - 0.0302).abs() < 1e-6, "{aside}");
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkTwist {
    /// Joint at which the link begins, 0-based; it ends at the next one, whose axis is parallel.
    pub joint: usize,
    /// t (rad).
    pub twist_rad: f64,
    /// l (rad), where the axis at its end leans too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lean_rad: Option<f64>,
}

/// The frame at the end of the link: its axis, and the directions along the link and across it.
struct Directions<R> {
    z: [R; 3],
    x: [R; 3],
    y: [R; 3],
}

impl LinkTwist {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let twist = EffectParameter { name: "twist of the level link", unit: "rad", value: self.twist_rad };
        let lean = self.lean_rad.map(|value| EffectParameter {
            name: "lean of the upright link",
            unit: "rad",
            value,
        });
        std::iter::once(twist).chain(lean).collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        match &mut self.lean_rad {
            Some(lean) if index > 0 => *lean = value,
            _ => self.twist_rad = value,
        }
    }

    /// Of the frame at the link's end, whose axis is parallel to that of the joint.
    #[inline(always)]
    fn directions<R: Real>(&self, frames: &Chain<R>) -> Directions<R> {
        let joint = self.joint.min(4);
        let (z, x) = (frames.z[joint + 1], frames.lateral[joint]);
        Directions { z, x, y: cross(&z, &x) }
    }

    #[inline(always)]
    fn about_end<R: Real>(&self, frames: &Chain<R>, turn: [R; 3]) -> LinkMotion<R> {
        LinkMotion { about: frames.origin[self.joint.min(4) + 1], turn, ..LinkMotion::none(turn[0]) }
    }

    /// The turns where gravity points to `g`, per unit of twist and of lean.
    #[inline(always)]
    fn turns<R: Real>(of: &Directions<R>, g: &[R; 3]) -> [[R; 3]; 2] {
        let h = cross(&of.z, g);
        [scaled(dot(&of.x, &h), &of.x), scaled(dot(&of.y, &h), &of.y)]
    }

    /// The motion of what the link carries, where gravity points to `g`.
    #[inline(always)]
    fn motion_under<R: Real>(&self, frames: &Chain<R>, g: &[R; 3]) -> LinkMotion<R> {
        let [twist, lean] = Self::turns(&self.directions(frames), g);
        let number = |value: f64| g[0].splat(value);
        let (t, l) = (number(self.twist_rad), number(self.lean_rad.unwrap_or(0.0)));
        self.about_end(frames, [0, 1, 2].map(|k| t * twist[k] + l * lean[k]))
    }

    /// The motion of what the link carries.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn motion<R: Real>(&self, statics: &Statics, frames: &Chain<R>) -> LinkMotion<R> {
        self.motion_under(frames, &splats(frames.x[0], &statics.gravity()))
    }

    /// Its derivatives with respect to the parameters.
    pub(super) fn motion_regressors(&self, statics: &Statics, frames: &Chain<f64>) -> Vec<LinkMotion<f64>> {
        let turns = Self::turns(&self.directions(frames), &statics.gravity());
        let count = if self.lean_rad.is_some() { 2 } else { 1 };
        turns[..count].iter().map(|turn| self.about_end(frames, *turn)).collect()
    }

    /// Its derivatives as the link turns about the axes of the base, beyond being carried along: to the link, gravity turns the other way.
    pub(super) fn motion_slopes(&self, statics: &Statics, frames: &Chain<f64>) -> [LinkMotion<f64>; 3] {
        std::array::from_fn(|axis| {
            let mut about = [0.0; 3];
            about[axis] = 1.0;
            self.motion_under(frames, &cross(&statics.gravity(), &about))
        })
    }

    /// How far it can move a point within `extent_mm` of the link's end at most (mm).
    pub(super) fn largest_mm(&self, extent_mm: f64) -> f64 {
        extent_mm * (self.twist_rad.abs() + self.lean_rad.unwrap_or(0.0).abs())
    }
}
