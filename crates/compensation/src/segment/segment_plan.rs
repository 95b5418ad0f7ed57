//! Plan of one segment: its deviation from the intended path, and the targets inserted to reduce it.

use std::borrow::Cow;

use crate::arms::Arms;
use crate::options::{Circles, Emit, Options};
use crate::plan::reason::OutcomeReason;
use crate::segment::circle::{Circle, WHOLE};
use crate::segment::corner::{CornerSegments, corner_deviation};
use crate::segment::curve::{CLOSED_MM, Curve};
use crate::segment::line::{
    Segment, SegmentEnd, distance, insertions, joint_motion_deviation, line_deviation,
};
use crate::segment::rounded_end::RoundedEnd;
use crate::target::solved_target::SolvedTarget;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, Switch};
use truegrind_programs::rewrite::{Extra, NewTarget};

/// What one segment needs.
#[derive(Default)]
pub(crate) struct SegmentPlan {
    /// Largest remaining deviation from the intended path (mm); `None` where it is not checked.
    pub(crate) path_deviation_mm: Option<f64>,
    /// Inserted targets.
    pub(crate) before: Vec<Extra>,
    /// Whether a circle is replaced by straight segments.
    pub(crate) straight: bool,
    pub(crate) flag: Option<OutcomeReason>,
    /// The whole segment as intended and as commanded, without inserted targets; `None` for joint motions.
    pub(crate) curves: Option<[Curve; 2]>,
}

impl SegmentPlan {
    /// For a motion whose targets are all corrected. `via`: its circle point. `middle_mm`: deviation of its commanded line at the
    /// midpoint. `corners`: how the path is rounded at its ends.
    pub(crate) fn of(
        motion: &Motion,
        path: Option<&Segment<'_>>,
        via: Option<&SolvedTarget<'_>>,
        middle_mm: f64,
        corners: &dyn Fn() -> [RoundedEnd; 2],
        arms: &Arms<'_>,
        options: &Options,
    ) -> SegmentPlan {
        let segments = options.circles == Circles::Segments && motion.kind == MotionKind::Circular;
        let Some(path) = path else {
            return SegmentPlan {
                flag: segments.then_some(OutcomeReason::CircleKept),
                ..SegmentPlan::default()
            };
        };
        match (motion.kind, via) {
            (MotionKind::Linear, _) => line(motion, path, middle_mm, corners, arms, options),
            (MotionKind::Joint, _) => SegmentPlan {
                path_deviation_mm: Some(joint_motion_deviation(path, arms)),
                ..SegmentPlan::default()
            },
            (MotionKind::Circular, Some(via)) => circle(motion, path, via, segments, arms, options),
            _ => SegmentPlan::default(),
        }
    }

    /// The last commanded piece of the segment, or the first.
    fn piece(&self, last: bool) -> Option<Cow<'_, Curve>> {
        let [_, commanded] = self.curves.as_ref()?;
        let told_at = |extra: Option<&Extra>| extra.and_then(pose_of);
        Some(match (last, told_at(if last { self.before.last() } else { self.before.first() })) {
            (true, Some(pose)) => Cow::Owned(Curve::line(pose, commanded.to)),
            (false, Some(pose)) => Cow::Owned(Curve::line(commanded.from, pose)),
            (_, None) => Cow::Borrowed(commanded),
        })
    }
}

fn pose_of(extra: &Extra) -> Option<Pose> {
    match extra.target {
        NewTarget::Cartesian { position_mm, quaternion, .. } => {
            Some(truegrind_programs::motion::Frame { position_mm, quaternion }.pose())
        }
        _ => None,
    }
}

fn line(
    motion: &Motion,
    path: &Segment<'_>,
    middle_mm: f64,
    corners: &dyn Fn() -> [RoundedEnd; 2],
    arms: &Arms<'_>,
    options: &Options,
) -> SegmentPlan {
    let Segment { from, to, .. } = path;
    let curves = [Curve::line(from.intended, to.intended), Curve::line(from.commanded, to.commanded)];
    let deviation =
        line_deviation(path, arms, options.emit, middle_mm).max(by_axes_mm(motion, path, &curves, arms));
    let curves = Some(curves);
    let mut out = SegmentPlan { path_deviation_mm: Some(deviation), curves, ..SegmentPlan::default() };
    if deviation <= options.tolerance_mm {
        return out;
    }
    let mut left = deviation;
    // Where the wrist is interpolated separately, an inserted target would impose an orientation that the
    // program never stated.
    if motion.insertable
        && motion.modal.wrist_interpolation != Switch::On
        && let Some(found) = insertions(path, &corners_of(options, corners), arms, options)
        && found.worst_mm() < deviation
    {
        (out.before, left) = (found.before, found.remaining_mm);
        out.path_deviation_mm = Some(left);
    }
    out.flag = (!(left <= options.tolerance_mm)).then_some(OutcomeReason::PathDeviation { mm: left });
    out
}

/// How the path is rounded at the ends of a line. Between joint targets a corner is one of joints, and a line needs its inserted targets to be one.
fn corners_of(options: &Options, corners: &dyn Fn() -> [RoundedEnd; 2]) -> [RoundedEnd; 2] {
    if options.emit == Emit::Joints { <[RoundedEnd; 2]>::default() } else { corners() }
}

/// Deviation on the way that the control may take instead, where A, B and C run linearly (mm); 0 where that is the same way. Which of the
/// two it takes is not known: the worse counts.
pub(crate) fn by_axes_mm(
    motion: &Motion,
    path: &Segment<'_>,
    [intended, commanded]: &[Curve; 2],
    arms: &Arms<'_>,
) -> f64 {
    motion.axis_turn.as_deref().map_or(0.0, |turn| {
        let [intended, commanded] = [intended, commanded].map(|curve| curve.by_axes(turn));
        Circle { intended, commanded, shares: WHOLE }.deviation(path, arms)
    })
}

fn circle(
    motion: &Motion,
    path: &Segment<'_>,
    via: &SolvedTarget<'_>,
    segments: bool,
    arms: &Arms<'_>,
    options: &Options,
) -> SegmentPlan {
    let Segment { from, to, .. } = path;
    let Some(circle) = Circle::of(from, &via.intended.pose(), &via.commanded, to, motion) else {
        let closed = distance(&from.intended.translation.vector, &to.intended.translation.vector) < CLOSED_MM;
        let flag = if closed {
            OutcomeReason::FullCircle
        } else {
            OutcomeReason::PathDeviation { mm: f64::INFINITY }
        };
        return SegmentPlan { flag: Some(flag), ..SegmentPlan::default() };
    };
    let curves = || Some([circle.intended.clone(), circle.commanded.clone()]);
    // Straight segments need a known orientation along the path.
    let may = segments
        && motion.can_straighten
        && motion.modal.circle_point_orientation != Switch::Either
        && motion.modal.wrist_interpolation != Switch::On;
    if may && let Some((before, left)) = circle.pieces(path, arms, options) {
        return SegmentPlan {
            path_deviation_mm: Some(left),
            before,
            straight: true,
            flag: None,
            curves: curves(),
        };
    }
    let along = circle.deviation(path, arms).max(by_axes_mm(
        motion,
        path,
        &[circle.intended.clone(), circle.commanded.clone()],
        arms,
    ));
    let open = if motion.by_radius { circle.open_centre_mm(options.position_decimals) } else { 0.0 };
    let deviation = along + open;
    let flag = if !(along <= options.tolerance_mm) {
        Some(OutcomeReason::PathDeviation { mm: deviation })
    } else if !(deviation <= options.tolerance_mm) {
        Some(OutcomeReason::AmbiguousCentre { mm: open })
    } else {
        segments.then_some(OutcomeReason::CircleKept)
    };
    SegmentPlan {
        path_deviation_mm: Some(deviation),
        before: Vec::new(),
        straight: false,
        flag,
        curves: curves(),
    }
}

/// Deviation from the intended corner between two segments; `None` where the corner has the shape of the segments themselves.
pub(crate) fn corner(
    point: &SegmentEnd<'_>,
    segment_in: &SegmentPlan,
    segment_out: &SegmentPlan,
    zone_mm: f64,
    condition_indices: [usize; 2],
    arms: &Arms<'_>,
    emit: Emit,
) -> Option<f64> {
    // Between joint targets the corner is a joint corner, and its segments are already within the same
    // accuracy.
    if emit == Emit::Joints {
        return None;
    }
    let intended = [&segment_in.curves.as_ref()?[0], &segment_out.curves.as_ref()?[0]];
    let [first, last] = [segment_in.piece(true)?, segment_out.piece(false)?];
    let segments = CornerSegments { intended, commanded: [&*first, &*last] };
    corner_deviation(point, &segments, zone_mm, condition_indices, arms)
}
