//! Circular motions, and lines on which the tool does not turn about one axis: deviation of the commanded curve from the intended one, and
//! its replacement by straight segments.
//!
//! Method. Kept circle: the commanded circle through the three corrected points is sampled ever more densely until the
//! samples determine the deviation from the intended circle. Replaced circle: n equal chords of the intended arc whose
//! corners are corrected poses on it; n starts from the sagitta r (1 − cos(θ / 2n)) and grows until no sample of the
//! commanded chords, followed by the estimated arm, deviates from the intended arc by more than the tolerance.
//! Stops: after [`ROUNDS`] increases, or where the arm cannot follow; the circle is then kept.

use crate::arms::Arms;
use crate::feasibility::joint_jump::jumps_joint;
use crate::options::{Emit, Options};
use crate::segment::condition_schedule::CHORD_MM;
use crate::segment::curve::{Curve, between};
use crate::segment::line::{PIECE_MM, STEPS, Segment, SegmentEnd, extra_of, largest};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::Motion;
use truegrind_programs::rewrite::Extra;

/// A circular motion, or a line that turns by axes, as intended and as commanded.
pub(crate) struct Circle {
    pub(crate) intended: Curve,
    pub(crate) commanded: Curve,
    /// The part of the intended curve that the commanded one stands for, by share.
    pub(crate) shares: [f64; 2],
}

/// All of a curve.
pub(crate) const WHOLE: [f64; 2] = [0.0, 1.0];

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
            shares: WHOLE,
        })
    }

    /// Largest deviation of the tool from the intended curve (mm), sampled until the samples determine it to [`CHORD_MM`];
    /// infinite where the arm cannot follow.
    pub(crate) fn deviation(&self, path: &Segment<'_>, arms: &Arms<'_>) -> f64 {
        let Segment { from, to, .. } = path;
        let motor = |s: f64| {
            let near = from.joints.lerp(&to.joints, s);
            let solution =
                arms.nominal.solve_near(&to.frames.commanded.flange_for(&self.commanded.at(s)), &near);
            solution.ok().map(|solution| solution.joints)
        };
        let [first, last] = self.shares;
        let near = |s: f64| first + (last - first) * s;
        let off = |s: f64, flange: &Pose| self.intended.distance(&to.frames.real.target_of(flange), near(s));
        // At least one sample per eighth of a turn, of the tool too, and per piece of a long arc.
        let sweep = self.intended.arc().map_or(0.0, |arc| arc.sweep).max(self.intended.axes_turn_rad());
        let part = last - first;
        let pieces = ((part * sweep / std::f64::consts::FRAC_PI_4).ceil() as usize)
            .max((part * self.intended.length_mm() / PIECE_MM).ceil() as usize)
            .clamp(4, 64);
        match path.play_operator(arms) {
            Some(play_operator) => play_operator.largest_deviation(STEPS * pieces, &motor, &off),
            None => largest(pieces, &|s| match motor(s) {
                Some(joints) => off(s, &arms.conditions.arm(to.condition_index).forward(&joints)),
                None => f64::INFINITY,
            }),
        }
    }

    /// How far the written decimals leave the centre of the commanded circle ambiguous where the motion states its radius
    /// (mm). From h² = r² − c²/4, the squared distance h² of the centre from the chord c is then uncertain by 2 r δ: near
    /// half a turn, where h is small, h is uncertain by far more than δ.
    pub(crate) fn open_centre_mm(&self, decimals: u8) -> f64 {
        let Some(arc) = self.commanded.arc() else { return 0.0 };
        let open = 2.0 * arc.radius * 0.1_f64.powi(i32::from(decimals));
        let height = (arc.radius * (0.5 * arc.sweep).cos()).abs();
        let square = height * height;
        let nearer = height - (square - open).max(0.0).sqrt();
        nearer.max((square + open).sqrt() - height)
    }

    /// Targets between the ends such that straight segments follow the intended arc within the tolerance, and the remaining
    /// deviation; `None` where that is not achieved.
    pub(crate) fn pieces(
        &self,
        path: &Segment<'_>,
        arms: &Arms<'_>,
        options: &Options,
    ) -> Option<(Vec<Extra>, f64)> {
        let arc = self.intended.arc()?;
        // Most of the tolerance is available to the chords; the arm's own deviation is small.
        let sagitta = (0.8 * options.tolerance_mm / arc.radius).min(1.0);
        let largest_rad = (2.0 * (1.0 - sagitta).acos()).min(MAX_PIECE_RAD);
        let turn_pieces = (self.intended.turn_rad() / MAX_PIECE_RAD).ceil();
        let mut count = (arc.sweep / largest_rad).ceil().max(turn_pieces).max(1.0);
        for _ in 0..ROUNDS {
            if count > MAX_PIECES {
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

    /// The corrected corners of `count` chords and their deviation from the intended arc; no corners where one of them would
    /// turn a joint too far near a singularity; `None` where the arm cannot follow.
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
            let flange = to.frames.real.flange_for(&self.intended.at(share));
            let near = corners[k - 1].1;
            let joints = arms.conditions.inverse(schedule.at(share)).solve_near(&flange, &near).ok()?.joints;
            corners.push((to.frames.commanded.target_of(&arms.nominal.arm().forward(&joints)), joints));
        }
        corners.push((to.commanded, to.joints));
        // Joints at a share of the path along the chords.
        let motor = |s: f64| {
            let u = s * count as f64;
            let k = (u as usize).min(count - 1);
            let ((commanded, joints), (next, after)) = (&corners[k], &corners[k + 1]);
            let part = u - k as f64;
            let pose = between(commanded, next, part);
            let near = joints.lerp(after, part);
            let solution = arms.nominal.solve_near(&to.frames.commanded.flange_for(&pose), &near);
            solution.ok().map(|solution| solution.joints)
        };
        let off = |s: f64, flange: &Pose| self.intended.distance(&to.frames.real.target_of(flange), s);
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
            jumps_joint([&intended, commanded], joints, &to.frames.commanded, arms, options)
        };
        let inner = || (1..).zip(&corners[1..count]);
        let extra = (!inner().any(leap)).then(|| inner().map(corner).collect());
        // With more chords the joint reversals coincide with those of the arc.
        let left =
            if path.ends_on_planned_sides(count, &motor, arms) { most + CHORD_MM } else { f64::INFINITY };
        most.is_finite().then_some((extra, left))
    }
}

/// Shares of each chord that are sampled.
const SAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

/// Largest angle of one chord, whatever the tolerance (rad): beyond it, the tool would visibly turn in corners.
const MAX_PIECE_RAD: f64 = std::f64::consts::PI / 12.0;

/// How often the number of chords is increased by half.
const ROUNDS: usize = 8;

/// A circle is not replaced by more chords than this.
const MAX_PIECES: f64 = 2000.0;
