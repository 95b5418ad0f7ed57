//! The way from the motion before to the end of a motion: how far it leaves the intended one, and what is put in for it.

use crate::arms::Arms;
use crate::options::{Circles, Emit, Options};
use crate::plan::reason::Why;
use crate::segment::circle::Circle;
use crate::segment::corner::{Ways, corner_bend};
use crate::segment::curve::{CLOSED_MM, Curve};
use crate::segment::line::{Ends, Path, gap, insertions, joint_bend, straight_bend};
use crate::target::solved_target::Solved;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, Switch};
use truegrind_programs::rewrite::{Extra, NewTarget};

/// What the way of one motion needs.
#[derive(Default)]
pub(crate) struct Passage {
    /// Largest distance from the intended way that is left (mm); `None` where it is not checked.
    pub(crate) bend_mm: Option<f64>,
    /// Targets that are put in.
    pub(crate) before: Vec<Extra>,
    /// Whether a circle becomes straight pieces.
    pub(crate) straight: bool,
    pub(crate) flag: Option<Why>,
    /// The whole way as meant and as told, targets that are put in left aside; `None` for joint motions.
    pub(crate) courses: Option<[Curve; 2]>,
}

impl Passage {
    /// Of a motion whose targets are all corrected. `middle_mm`: how far its told line bends in the middle.
    pub(crate) fn of(
        motion: &Motion,
        path: Option<&Path<'_>>,
        good: &[&Solved],
        middle_mm: f64,
        arms: &Arms<'_>,
        options: &Options,
    ) -> Passage {
        let segments = options.circles == Circles::Segments && motion.kind == MotionKind::Circular;
        let Some(path) = path else {
            return Passage { flag: segments.then_some(Why::CircleKept), ..Passage::default() };
        };
        match (motion.kind, good) {
            (MotionKind::Linear, _) => line(motion, path, middle_mm, arms, options),
            (MotionKind::Joint, _) => Passage { bend_mm: Some(joint_bend(path, arms)), ..Passage::default() },
            (MotionKind::Circular, [via, _]) => circle(motion, path, via, segments, arms, options),
            _ => Passage::default(),
        }
    }

    /// The last told piece of the way, or the first.
    fn piece(&self, last: bool) -> Option<Curve> {
        let [_, told] = self.courses.as_ref()?;
        let told_at = |extra: Option<&Extra>| extra.and_then(pose_of);
        Some(match (last, told_at(if last { self.before.last() } else { self.before.first() })) {
            (true, Some(pose)) => Curve::line(pose, told.to),
            (false, Some(pose)) => Curve::line(told.from, pose),
            (_, None) => *told,
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

fn line(motion: &Motion, path: &Path<'_>, middle_mm: f64, arms: &Arms<'_>, options: &Options) -> Passage {
    let Path { from, to, .. } = path;
    let bend = straight_bend(path, arms, options.emit, middle_mm);
    let courses = Some([Curve::line(from.meant, to.meant), Curve::line(from.told, to.told)]);
    let mut out = Passage { bend_mm: Some(bend), courses, ..Passage::default() };
    if bend <= options.tolerance_mm {
        return out;
    }
    let mut left = bend;
    // Where the wrist is interpolated by itself, a target on the line would say how the tool turns, which nobody did.
    if motion.insertable
        && motion.modal.wrist_interpolation != Switch::On
        && let Some(cut) = insertions(path, arms, options)
    {
        (out.before, left) = cut;
        out.bend_mm = Some(left);
    }
    out.flag = (!(left <= options.tolerance_mm)).then_some(Why::Bend { mm: left });
    out
}

fn circle(
    motion: &Motion,
    path: &Path<'_>,
    via: &Solved,
    segments: bool,
    arms: &Arms<'_>,
    options: &Options,
) -> Passage {
    let Path { from, to, .. } = path;
    let Some(circle) = Circle::of(from, &via.meant, &via.told, to, motion) else {
        let closed = gap(&from.meant.translation.vector, &to.meant.translation.vector) < CLOSED_MM;
        let flag = if closed { Why::WholeCircle } else { Why::Bend { mm: f64::INFINITY } };
        return Passage { flag: Some(flag), ..Passage::default() };
    };
    let courses = Some([circle.meant, circle.told]);
    // How the tool turns on the way must be known to be written out.
    let may = segments
        && motion.straightens
        && motion.modal.circle_point_orientation != Switch::Either
        && motion.modal.wrist_interpolation != Switch::On;
    if may && let Some((before, left)) = circle.pieces(path, arms, options) {
        return Passage { bend_mm: Some(left), before, straight: true, flag: None, courses };
    }
    let along = circle.bend(path, arms);
    let open = if motion.by_radius { circle.open_centre_mm(options.position_decimals) } else { 0.0 };
    let bend = along + open;
    let flag = if !(along <= options.tolerance_mm) {
        Some(Why::Bend { mm: bend })
    } else if !(bend <= options.tolerance_mm) {
        Some(Why::OpenCentre { mm: open })
    } else {
        segments.then_some(Why::CircleKept)
    };
    Passage { bend_mm: Some(bend), before: Vec::new(), straight: false, flag, courses }
}

/// How far the corner between two ways leaves the intended one; `None` where it is as the ways themselves.
pub(crate) fn corner(
    point: &Ends<'_>,
    way_in: &Passage,
    way_out: &Passage,
    zone_mm: f64,
    places: [usize; 2],
    arms: &Arms<'_>,
    emit: Emit,
) -> Option<f64> {
    // In joints the corner is one of joints, between ways that are told to the same distance already.
    if emit == Emit::Joints {
        return None;
    }
    let meant = [way_in.courses.as_ref()?[0], way_out.courses.as_ref()?[0]];
    let told = [way_in.piece(true)?, way_out.piece(false)?];
    corner_bend(point, &Ways { meant, told }, zone_mm, places, arms)
}
