//! A base that tilts under the overturning moment of the arm, as on a soft pedestal or with bolts that are not tight:
//!
//! ω = Σ κ m about the axes of the base, and a sway of the base's origin by (g × Σ c m), g the direction of gravity, where the base turns
//! about a point below it. m is the moment of gravity about the base's origin: of the arm's masses and the payload or, where the masses
//! are not known, of 1 kg at the origin of a frame, and κ is then compliance times mass.
//!
//! In lanes Newton's method neglects its slopes with respect to the joints, some 1e-3, as those of compliance.

use serde::{Deserialize, Serialize};

use crate::chain::{Chain, cross, minus};
use crate::condition::Condition;
use crate::effect::parameter::EffectParameter;
use crate::effect::statics::Statics;
use crate::gravity::STANDARD_GRAVITY;
use crate::joints::MappedJoints;
use crate::link_motion::LinkMotion;
use truegrind_math::lanes::{Real, SinCos, splats};

/// A base that tilts.
///
/// ```
/// use truegrind_arm::condition::Condition;
/// use truegrind_arm::effect::{Effect, base_tilt::{BaseTilt, TiltTerm}};
/// use truegrind_arm::model::{Joints, Model};
/// use truegrind_arm::robots;
///
/// // Nothing but a load of 3 kg that is held out along x: 3 · 9.81 · 0.374 N m turn the base about y, and the flange goes down.
/// let arm = Model { bodies: None, ..robots::load("abb-irb-120")?.model };
/// let term = TiltTerm { frame: None, about: None, tilt_rad_per_nm: 1e-4, sway_mm_per_nm: 0.0 };
/// let soft = Model { effects: vec![Effect::BaseTilt(BaseTilt { deep: false, term: vec![term] })], ..arm.clone() };
/// let load = Condition { payload_kg: Some(3.0), ..Condition::default() };
/// let moved = soft.forward(&Joints::zeros(), &load).translation.vector
///     - arm.forward(&Joints::zeros(), &load).translation.vector;
/// let turn = 1e-4 * 3.0 * 9.80665 * 0.374;
/// assert!((moved.z + turn * 374.0).abs() < 1e-3 && (moved.x - turn * 630.0).abs() < 1e-3);
/// # Ok::<(), robots::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BaseTilt {
    /// Whether it turns about a point below its origin, which then sways.
    #[serde(default)]
    pub deep: bool,
    /// Its parts, which add up.
    pub term: Vec<TiltTerm>,
}

/// How the base tilts under one load about one axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TiltTerm {
    /// The frame, 1 to 6, at whose origin 1 kg overturns it; absent for the masses of the arm and the payload.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
    /// The axes (0, 1, 2) of the base of an entry of its compliance, which is symmetric: the turn about one under the moment about the
    /// other, and the other way round. Absent where it is as soft about all axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<[usize; 2]>,
    /// Compliance [rad/(N m)]; times kg under 1 kg at a frame.
    pub tilt_rad_per_nm: f64,
    /// The same times the depth of the point about which it turns [mm/(N m)]; 0 unless the base is deep.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub sway_mm_per_nm: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // Serde passes a reference.
fn is_zero(sway: &f64) -> bool {
    *sway == 0.0
}

/// Names of the entries of a symmetric 3 × 3 matrix, for the tilt and for the sway; the last for one that is the same about all axes.
const NAMES: [[&str; 7]; 2] = [
    ["tilt xx", "tilt yy", "tilt zz", "tilt xy", "tilt yz", "tilt xz", "tilt"],
    ["sway xx", "sway yy", "sway zz", "sway xy", "sway yz", "sway xz", "sway"],
];

impl TiltTerm {
    fn name(&self, motion: usize) -> &'static str {
        let entry = match self.about.map(|[a, b]| [a.min(b), a.max(b)]) {
            None => 6,
            Some([a, b]) if a == b => a.min(2),
            Some([0, 1]) => 3,
            Some([0, _]) => 5,
            Some(_) => 4,
        };
        NAMES[motion][entry]
    }

    /// Moment of its load about the base's origin (N m), from the frames and that of the arm.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn moment<R: Real>(&self, statics: &Statics, (frames, of_arm): &(Chain<R>, [R; 3])) -> [R; 3] {
        let Some(frame) = self.frame else { return *of_arm };
        let lever = minus(&frames.origin[frame.min(6)], &frames.origin[0]);
        cross(&lever, &splats(lever[0], &statics.gravity_newton()))
    }

    /// The moment (N m) as its entry of the compliance maps it to a turn.
    #[cfg_attr(not(debug_assertions), inline(always))]
    fn turn<R: Real>(&self, moment: &[R; 3]) -> [R; 3] {
        let Some([a, b]) = self.about else { return *moment };
        let mut out = [moment[0].splat(0.0); 3];
        out[a] += moment[b];
        if a != b {
            out[b] += moment[a];
        }
        out
    }
}

impl BaseTilt {
    pub(super) fn parameters(&self) -> Vec<EffectParameter> {
        let unit = |motion: usize, term: &TiltTerm| match (motion, term.frame) {
            (0, None) => "rad/(N m)",
            (0, Some(_)) => "rad kg/(N m)",
            (_, None) => "mm/(N m)",
            (_, Some(_)) => "mm kg/(N m)",
        };
        let of = |motion: usize| {
            self.term.iter().map(move |term| EffectParameter {
                name: term.name(motion),
                unit: unit(motion, term),
                value: [term.tilt_rad_per_nm, term.sway_mm_per_nm][motion],
            })
        };
        (0..if self.deep { 2 } else { 1 }).flat_map(of).collect()
    }

    pub(super) fn set(&mut self, index: usize, value: f64) {
        let count = self.term.len();
        match self.term.get_mut(index % count.max(1)) {
            Some(term) if index < count => term.tilt_rad_per_nm = value,
            Some(term) => term.sway_mm_per_nm = value,
            None => {}
        }
    }

    /// Motion of the base by a turn, and by the sway of a turn.
    #[inline(always)]
    fn motions<R: Real>(turn: &[R; 3], statics: &Statics) -> [LinkMotion<R>; 2] {
        let gravity = splats(turn[0], &statics.gravity());
        let sway = cross(&gravity, turn);
        let still = LinkMotion::none(turn[0]);
        [LinkMotion { turn: *turn, ..still }, LinkMotion { shift: sway, ..still }]
    }

    /// The motion of the arm on its base at mapped angles `u`.
    #[cfg_attr(not(debug_assertions), inline(always))]
    pub(super) fn motion<R: SinCos>(
        &self,
        statics: &Statics,
        u: &[R; 6],
        condition: &Condition,
    ) -> LinkMotion<R> {
        let mut out = LinkMotion::none(u[0]);
        let loads = statics.overturning(u, condition);
        for term in &self.term {
            let [tilt, sway] = Self::motions(&term.turn(&term.moment(statics, &loads)), statics);
            out.add(u[0].splat(term.tilt_rad_per_nm), &tilt);
            out.add(u[0].splat(term.sway_mm_per_nm), &sway);
        }
        out
    }

    /// Its derivatives with respect to the mapped angles.
    pub(super) fn motion_slopes(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> [LinkMotion<f64>; 6] {
        let (frames, of_arm) = statics.overturning_slopes(u, condition);
        let mut out = [LinkMotion::none(0.0); 6];
        for (joint, out) in out.iter_mut().enumerate() {
            for term in &self.term {
                let moment = match term.frame {
                    None => of_arm[joint],
                    Some(frame) if joint < frame.min(6) => {
                        let lever = minus(&frames.origin[frame.min(6)], &frames.origin[joint]);
                        cross(&cross(&frames.z[joint], &lever), &statics.gravity_newton())
                    }
                    Some(_) => continue,
                };
                let [tilt, sway] = Self::motions(&term.turn(&moment), statics);
                out.add(term.tilt_rad_per_nm, &tilt);
                out.add(term.sway_mm_per_nm, &sway);
            }
        }
        out
    }

    /// Its derivatives with respect to the parameters.
    pub(super) fn motion_regressors(
        &self,
        statics: &Statics,
        u: &MappedJoints,
        condition: &Condition,
    ) -> Vec<LinkMotion<f64>> {
        let u: [f64; 6] = (*u).into();
        let loads = statics.overturning::<f64>(&u, condition);
        let of = |term: &TiltTerm| Self::motions(&term.turn(&term.moment(statics, &loads)), statics);
        let both: Vec<[LinkMotion<f64>; 2]> = self.term.iter().map(of).collect();
        (0..if self.deep { 2 } else { 1 }).flat_map(|motion| both.iter().map(move |of| of[motion])).collect()
    }

    /// How far it can move a point within `extent_mm` of the base at most (mm), under masses of `mass_kg` within twice that.
    pub(super) fn largest_mm(&self, extent_mm: f64, mass_kg: f64) -> f64 {
        let newton_metres = |term: &TiltTerm| {
            let kg = if term.frame.is_some() { 1.0 } else { mass_kg };
            kg * STANDARD_GRAVITY * 2e-3 * extent_mm
        };
        let of = |term: &TiltTerm| {
            newton_metres(term) * (term.tilt_rad_per_nm.abs() * extent_mm + term.sway_mm_per_nm.abs())
        };
        self.term.iter().map(of).sum()
    }
}
