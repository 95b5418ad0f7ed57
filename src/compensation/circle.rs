//! Circular motions: how far the told circle leaves the intended one, and the straight pieces that replace it when asked.
//!
//! Method. The circle is kept: the told circle through the three corrected points is sampled, more densely until the
//! samples tell the distance from the intended circle. The circle is replaced: n equal pieces of the intended arc, each
//! corner a corrected pose on it, with n from the sagitta r (1 − cos(θ / 2n)) and raised until no sample of the told
//! pieces, gone by the estimated arm, is farther from the intended arc than the tolerance.
//! Stops: after [`ROUNDS`] raises, or where the arm cannot go; the circle then stays.

use super::curve::{Curve, between};
use super::rewrite::{Arms, Emit, Options};
use super::segment::{CHORD_MM, Ends, PIECE_MM, Path, extra_of, largest};
use crate::program::motion::Motion;
use crate::program::rewrite::Extra;

/// A circular motion: what was meant, and what the controller is told.
pub(super) struct Circle {
    pub(super) meant: Curve,
    pub(super) told: Curve,
}

impl Circle {
    /// From its three corrected points; `None` where they make no circle.
    pub(super) fn of(
        from: &Ends<'_>,
        via_meant: &crate::math::se3::Pose,
        via_told: &crate::math::se3::Pose,
        to: &Ends<'_>,
        motion: &Motion,
    ) -> Option<Self> {
        Some(Self {
            meant: Curve::round(from.meant, via_meant, to.meant, motion)?,
            told: Curve::round(from.told, via_told, to.told, motion)?,
        })
    }

    /// Largest distance of the tool from the intended circle, sampled along the arc until the samples tell it to
    /// [`CHORD_MM`]; infinite where the arm cannot go.
    pub(super) fn bend(&self, path: &Path<'_>, arms: &Arms<'_>) -> f64 {
        let Path { from, to, way } = path;
        let off = |s: f64| {
            let near = from.joints.lerp(&to.joints, s);
            match arms.nominal.solve_near(&to.mounted.told.flange_for(&self.told.at(s)), &near) {
                Ok(solution) => {
                    let reached = arms.acting.arm(way.at(s)).forward(&solution.joints);
                    self.meant.distance(&to.mounted.real.target_of(&reached), s)
                }
                Err(_) => f64::INFINITY,
            }
        };
        // At least every eighth of a turn, and every piece of a long arc.
        let sweep = self.meant.arc().map_or(0.0, |arc| arc.sweep);
        let pieces = ((sweep / std::f64::consts::FRAC_PI_4).ceil() as usize)
            .max((self.meant.length_mm() / PIECE_MM).ceil() as usize)
            .clamp(4, 64);
        largest(pieces, &off)
    }

    /// Targets between the ends such that straight pieces keep to the intended arc within the tolerance, and the
    /// distance that is left; `None` where that is not reached.
    pub(super) fn pieces(
        &self,
        path: &Path<'_>,
        arms: &Arms<'_>,
        options: &Options,
    ) -> Option<(Vec<Extra>, f64)> {
        let arc = self.meant.arc()?;
        // The arm's own share of the tolerance is small: what the chords may take.
        let sagitta = (0.8 * options.tolerance_mm / arc.radius).min(1.0);
        let largest_rad = (2.0 * (1.0 - sagitta).acos()).min(LARGEST_PIECE_RAD);
        let turn_pieces = (self.meant.turn_rad() / LARGEST_PIECE_RAD).ceil();
        let mut count = (arc.sweep / largest_rad).ceil().max(turn_pieces).max(1.0);
        for _ in 0..ROUNDS {
            if count > MOST_PIECES {
                return None;
            }
            let (extra, left) = self.cut(count as usize, path, arms)?;
            if left <= options.tolerance_mm {
                return Some((extra, left));
            }
            count = (1.5 * count).ceil();
        }
        None
    }

    /// So many pieces, and how far they leave the intended arc; `None` where the arm cannot go.
    fn cut(&self, count: usize, path: &Path<'_>, arms: &Arms<'_>) -> Option<(Vec<Extra>, f64)> {
        let Path { from, to, way } = path;
        let mut extra = Vec::with_capacity(count - 1);
        let (mut told, mut joints, mut most) = (from.told, from.joints, 0.0_f64);
        for k in 1..=count {
            let (next, after) = if k == count {
                (to.told, to.joints)
            } else {
                let flange = to.mounted.real.flange_for(&self.meant.at(k as f64 / count as f64));
                let solution =
                    arms.acting.inverse(way.at(k as f64 / count as f64)).solve_near(&flange, &joints).ok()?;
                let told = to.mounted.told.target_of(&arms.nominal.arm().forward(&solution.joints));
                extra.push(extra_of(&told, &solution.joints, Emit::Targets, to, arms));
                (told, solution.joints)
            };
            for part in SAMPLES {
                let pose = between(&told, &next, part);
                let near = joints.lerp(&after, part);
                let reached = arms.nominal.solve_near(&to.mounted.told.flange_for(&pose), &near).ok()?;
                let share = (k as f64 - 1.0 + part) / count as f64;
                let reached = arms.acting.arm(way.at(share)).forward(&reached.joints);
                let reached = to.mounted.real.target_of(&reached);
                most = most.max(self.meant.distance(&reached, share));
            }
            (told, joints) = (next, after);
        }
        Some((extra, most + CHORD_MM))
    }
}

/// Where each piece is sampled.
const SAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

/// Largest angle of one piece, whatever the tolerance (rad): beyond, the tool would turn in visible corners.
const LARGEST_PIECE_RAD: f64 = std::f64::consts::PI / 12.0;

/// How often the count of pieces is raised by half.
const ROUNDS: usize = 8;

/// More pieces than this are no replacement for a circle.
const MOST_PIECES: f64 = 2000.0;
