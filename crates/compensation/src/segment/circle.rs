//! Circular motions: how far the told circle leaves the intended one, and the straight pieces that replace it when asked.
//!
//! Method. The circle is kept: the told circle through the three corrected points is sampled, more densely until the
//! samples tell the distance from the intended circle. The circle is replaced: n equal pieces of the intended arc, each
//! corner a corrected pose on it, with n from the sagitta r (1 − cos(θ / 2n)) and raised until no sample of the told
//! pieces, gone by the estimated arm, is farther from the intended arc than the tolerance.
//! Stops: after [`ROUNDS`] raises, or where the arm cannot go; the circle then stays.

use crate::arms::Arms;
use crate::feasibility::singularity::jumps_joint;
use crate::options::{Emit, Options};
use crate::segment::condition_schedule::CHORD_MM;
use crate::segment::curve::{Curve, between};
use crate::segment::line::{PIECE_MM, STEPS, Segment, SegmentEnd, extra_of, largest};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::Motion;
use truegrind_programs::rewrite::Extra;

/// A circular motion: what was meant, and what the controller is told.
pub(crate) struct Circle {
    pub(crate) intended: Curve,
    pub(crate) commanded: Curve,
}

impl Circle {
    /// From its three corrected points; `None` where they make no circle.
    pub(crate) fn of(
        from: &SegmentEnd<'_>,
        via_meant: &Pose,
        via_told: &Pose,
        to: &SegmentEnd<'_>,
        motion: &Motion,
    ) -> Option<Self> {
        Some(Self {
            intended: Curve::round(from.intended, via_meant, to.intended, motion)?,
            commanded: Curve::round(from.commanded, via_told, to.commanded, motion)?,
        })
    }

    /// Largest distance of the tool from the intended circle, sampled along the arc until the samples tell it to
    /// [`CHORD_MM`]; infinite where the arm cannot go.
    pub(crate) fn deviation(&self, path: &Segment<'_>, arms: &Arms<'_>) -> f64 {
        let Segment { from, to, .. } = path;
        let motor = |s: f64| {
            let near = from.joints.lerp(&to.joints, s);
            let solution =
                arms.nominal.solve_near(&to.frames_index.commanded.flange_for(&self.commanded.at(s)), &near);
            solution.ok().map(|solution| solution.joints)
        };
        let off = |s: f64, flange: &Pose| self.intended.distance(&to.frames_index.real.target_of(flange), s);
        // At least every eighth of a turn, and every piece of a long arc.
        let sweep = self.intended.arc().map_or(0.0, |arc| arc.sweep);
        let pieces = ((sweep / std::f64::consts::FRAC_PI_4).ceil() as usize)
            .max((self.intended.length_mm() / PIECE_MM).ceil() as usize)
            .clamp(4, 64);
        match path.play_operator(arms) {
            Some(play_operator) => play_operator.largest_deviation(STEPS * pieces, &motor, &off),
            None => largest(pieces, &|s| match motor(s) {
                Some(joints) => off(s, &arms.conditions.arm(to.condition_index).forward(&joints)),
                None => f64::INFINITY,
            }),
        }
    }

    /// How far the decimals that are written leave the centre of the told circle open where the motion states its radius
    /// (mm). h² = r² − c²/4 of its distance h from the chord c is known to 2 r δ then: near half a turn, where h is small, h
    /// is known to far less than δ.
    pub(crate) fn open_centre_mm(&self, decimals: u8) -> f64 {
        let Some(arc) = self.commanded.arc() else { return 0.0 };
        let open = 2.0 * arc.radius * 0.1_f64.powi(i32::from(decimals));
        let height = (arc.radius * (0.5 * arc.sweep).cos()).abs();
        let square = height * height;
        let nearer = height - (square - open).max(0.0).sqrt();
        nearer.max((square + open).sqrt() - height)
    }

    /// Targets between the ends such that straight pieces keep to the intended arc within the tolerance, and the
    /// distance that is left; `None` where that is not reached.
    pub(crate) fn pieces(
        &self,
        path: &Segment<'_>,
        arms: &Arms<'_>,
        options: &Options,
    ) -> Option<(Vec<Extra>, f64)> {
        let arc = self.intended.arc()?;
        // The arm's own share of the tolerance is small: what the chords may take.
        let sagitta = (0.8 * options.tolerance_mm / arc.radius).min(1.0);
        let largest_rad = (2.0 * (1.0 - sagitta).acos()).min(LARGEST_PIECE_RAD);
        let turn_pieces = (self.intended.turn_rad() / LARGEST_PIECE_RAD).ceil();
        let mut count = (arc.sweep / largest_rad).ceil().max(turn_pieces).max(1.0);
        for _ in 0..ROUNDS {
            if count > MOST_PIECES {
                return None;
            }
            let (extra, left) = self.cut(count as usize, path, arms, options)?;
            if left <= options.tolerance_mm {
                return Some((extra?, left));
            }
            count = (1.5 * count).ceil();
        }
        None
    }

    /// So many pieces, none where a target of theirs would turn a joint too far near a singularity, and how far they leave
    /// the intended arc; `None` where the arm cannot go.
    fn cut(
        &self,
        count: usize,
        path: &Segment<'_>,
        arms: &Arms<'_>,
        options: &Options,
    ) -> Option<(Option<Vec<Extra>>, f64)> {
        let Segment { from, to, schedule } = path;
        let mut corners = Vec::with_capacity(count + 1);
        corners.push((from.commanded, from.joints));
        for k in 1..count {
            let share = k as f64 / count as f64;
            let flange = to.frames_index.real.flange_for(&self.intended.at(share));
            let near = corners[k - 1].1;
            let joints = arms.conditions.inverse(schedule.at(share)).solve_near(&flange, &near).ok()?.joints;
            corners.push((to.frames_index.commanded.target_of(&arms.nominal.arm().forward(&joints)), joints));
        }
        corners.push((to.commanded, to.joints));
        // Share of the way to the joints there, along the pieces.
        let motor = |s: f64| {
            let u = s * count as f64;
            let k = (u as usize).min(count - 1);
            let ((commanded, joints), (next, after)) = (&corners[k], &corners[k + 1]);
            let part = u - k as f64;
            let pose = between(commanded, next, part);
            let near = joints.lerp(after, part);
            let solution = arms.nominal.solve_near(&to.frames_index.commanded.flange_for(&pose), &near);
            solution.ok().map(|solution| solution.joints)
        };
        let off = |s: f64, flange: &Pose| self.intended.distance(&to.frames_index.real.target_of(flange), s);
        let most = match path.play_operator(arms) {
            Some(play_operator) => play_operator.largest_deviation(STEPS * count, &motor, &off),
            None => {
                let mut most = 0.0_f64;
                for k in 0..count {
                    for part in SAMPLES {
                        let share = (k as f64 + part) / count as f64;
                        most = most.max(off(
                            share,
                            &arms.conditions.arm(to.condition_index).forward(&motor(share)?),
                        ));
                    }
                }
                most
            }
        };
        let corner = |(k, (commanded, joints)): (usize, &(Pose, Joints))| {
            extra_of((commanded, joints), k as f64 / count as f64, Emit::Targets, path, arms)
        };
        let leap = |(k, (commanded, joints)): (usize, &(Pose, Joints))| {
            let intended = self.intended.at(k as f64 / count as f64);
            jumps_joint([&intended, commanded], joints, &to.frames_index.commanded, arms, options)
        };
        let inner = || (1..).zip(&corners[1..count]);
        let extra = (!inner().any(leap)).then(|| inner().map(corner).collect());
        // More pieces turn where the arc does.
        let left =
            if path.ends_on_planned_sides(count, &motor, arms) { most + CHORD_MM } else { f64::INFINITY };
        most.is_finite().then_some((extra, left))
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
