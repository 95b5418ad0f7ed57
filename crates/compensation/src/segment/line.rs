//! The path between two targets: how far the told line bends under the estimated arm, and which targets straighten it.

use nalgebra::Vector3;

use crate::arms::Arms;
use crate::backlash::play_operator::PlayOperator;
use crate::condition::arm_conditions::select;
use crate::feasibility::singularity::jumps_joint;
use crate::frames::frame_pair::ResolvedFrames;
use crate::options::{Emit, Options};
use crate::segment::condition_schedule::{CHORD_MM, ConditionSchedule};
use crate::segment::curve::{beside, between};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::MotionKind;
use truegrind_programs::rewrite::{Extra, NewTarget};

/// A corrected end of a motion.
#[derive(Clone, Copy)]
pub(crate) struct SegmentEnd<'a> {
    pub(crate) frames_index: &'a ResolvedFrames,
    pub(crate) index: usize,
    /// Intended pose in the work object.
    pub(crate) intended: Pose,
    /// What the controller is told.
    pub(crate) commanded: Pose,
    /// Joints there.
    pub(crate) joints: Joints,
    /// The condition under which the arm comes there.
    pub(crate) condition_index: usize,
    /// Joints there with the program as it is.
    pub(crate) before: Joints,
    /// The configuration that its target states, where the controller checks it.
    pub(crate) conf: Option<[i32; 4]>,
    /// The external axes of its target, where that is known.
    pub(crate) external: Option<&'a [Option<f64>; 6]>,
}

impl<'a> SegmentEnd<'a> {
    /// The same place of the flange for the tool and in the work object of `other`, as told and as meant. The controller goes
    /// from there on a path of that tool in that object.
    pub(crate) fn with_frames_of(self, other: &SegmentEnd<'a>) -> Self {
        let (old, new) = (self.frames_index, other.frames_index);
        SegmentEnd {
            frames_index: new,
            index: other.index,
            intended: new.real.target_of(&old.real.flange_for(&self.intended)),
            commanded: new.commanded.target_of(&old.commanded.flange_for(&self.commanded)),
            ..self
        }
    }
}

impl ConditionSchedule {
    /// At which shares of the way from `start` a joint has a play to take up, or the load is another: under which
    /// condition the arm comes there, and under which it goes on.
    fn changes(&self, start: &SegmentEnd<'_>) -> Vec<ConditionChange> {
        let mut out = Vec::new();
        let mut last = start.condition_index;
        for (share, condition_index) in std::iter::once((0.0, self.first)).chain(self.later.iter().copied()) {
            if condition_index != last {
                out.push(ConditionChange { share, before: last, after: condition_index });
            }
            last = condition_index;
        }
        out
    }
}

/// A joint turns on the way, and has its play to take up.
struct ConditionChange {
    share: f64,
    before: usize,
    after: usize,
}

/// A path between two corrected ends.
pub(crate) struct Segment<'a> {
    pub(crate) from: SegmentEnd<'a>,
    pub(crate) to: SegmentEnd<'a>,
    pub(crate) schedule: ConditionSchedule,
}

impl Segment<'_> {
    /// The external axes at a share of the way, on which the controller runs them in proportion; `None` where none moves,
    /// so that those of the end count.
    fn external_at(&self, share: f64) -> Option<[Option<f64>; 6]> {
        let (from, to) = (self.from.external?, self.to.external?);
        (from != to).then(|| {
            std::array::from_fn(|axis| match (from[axis], to[axis]) {
                (Some(from), Some(to)) => Some(from + (to - from) * share),
                (_, to) => to,
            })
        })
    }

    /// The links at its start, where a joint turns on it or the load is another than before.
    pub(crate) fn play_operator<'s>(&self, arms: &'s Arms<'_>) -> Option<PlayOperator<'s>> {
        let changes = self.schedule.first != self.from.condition_index || !self.schedule.later.is_empty();
        changes.then(|| self.links(arms))
    }

    fn links<'s>(&self, arms: &'s Arms<'_>) -> PlayOperator<'s> {
        PlayOperator::at(
            &self.from.joints,
            self.from.condition_index,
            self.to.condition_index,
            &arms.conditions,
        )
    }

    /// Whether links that are told to lie on a side at its end do so where the motors go in so many `pieces` with targets that
    /// are put in, which need not turn where the whole way does.
    pub(crate) fn ends_on_planned_sides(
        &self,
        pieces: usize,
        motor: &dyn Fn(f64) -> Option<Joints>,
        arms: &Arms<'_>,
    ) -> bool {
        let sides = arms.conditions.arm(self.to.condition_index).condition.approach;
        !arms.conditions.has_play() || self.links(arms).ends_on_sides(&sides, STEPS * pieces, motor)
    }
}

/// How far the tool is from the intended line at share `s` of the way; infinite where the nominal arm cannot go.
fn offset_at(
    from: &SegmentEnd<'_>,
    to: &SegmentEnd<'_>,
    s: f64,
    condition_index: usize,
    arms: &Arms<'_>,
    emit: Emit,
) -> f64 {
    match motor_joints_at(from, to, s, arms, emit) {
        Some(joints) => line_offset(from, to, s, &arms.conditions.arm(condition_index).forward(&joints)),
        None => f64::INFINITY,
    }
}

/// Joints to which the controller goes at share `s` of the told line; `None` where the nominal arm cannot go.
fn motor_joints_at(
    from: &SegmentEnd<'_>,
    to: &SegmentEnd<'_>,
    s: f64,
    arms: &Arms<'_>,
    emit: Emit,
) -> Option<Joints> {
    let joints = from.joints.lerp(&to.joints, s);
    match emit {
        Emit::Joints => Some(joints),
        Emit::Targets => {
            let commanded = between(&from.commanded, &to.commanded, s);
            let solution =
                arms.nominal.solve_near(&to.frames_index.commanded.flange_for(&commanded), &joints);
            solution.ok().map(|solution| solution.joints)
        }
    }
}

/// How far the tool is from the intended line at share `s` of the way, with the flange where it is then.
///
/// Along the line the tool may be early or late: only what lies beside the line counts, unless it is too short.
fn line_offset(from: &SegmentEnd<'_>, to: &SegmentEnd<'_>, s: f64, flange: &Pose) -> f64 {
    let reached = to.frames_index.real.target_of(flange);
    let intended = from.intended.translation.vector.lerp(&to.intended.translation.vector, s);
    let off = reached.translation.vector - intended;
    beside(&off, &(to.intended.translation.vector - from.intended.translation.vector))
}

/// [`offset_at`] the middle of many lines, in lanes.
pub(crate) fn midpoint_deviations(lines: &[&Segment<'_>], arms: &Arms<'_>, emit: Emit) -> Vec<f64> {
    let halfway: Vec<Joints> = lines.iter().map(|line| line.from.joints.lerp(&line.to.joints, 0.5)).collect();
    let joints: Vec<Option<Joints>> = match emit {
        Emit::Joints => halfway.into_iter().map(Some).collect(),
        Emit::Targets => {
            let commanded = |line: &&Segment<'_>| {
                line.to.frames_index.commanded.flange_for(&between(
                    &line.from.commanded,
                    &line.to.commanded,
                    0.5,
                ))
            };
            let flanges: Vec<Pose> = lines.iter().map(commanded).collect();
            let reached = arms.nominal.solve_seeded_joints(&flanges, &halfway).into_iter();
            reached.map(|reached| reached.ok().map(|reached| reached.joints)).collect()
        }
    };
    let condition_indices: Vec<usize> = lines.iter().map(|line| line.schedule.at(0.5)).collect();
    arms.conditions.each(&condition_indices, |condition_index, items| {
        let chosen = items.map(|items| select(&joints, items));
        let chosen = chosen.as_deref().unwrap_or(&joints);
        let known: Vec<Joints> = chosen.iter().flatten().copied().collect();
        let mut flanges = arms.conditions.arm(condition_index).forward_many(&known).into_iter();
        chosen
            .iter()
            .enumerate()
            .map(|(k, joints)| {
                let line = lines[items.map_or(k, |items| items[k])];
                match joints.and_then(|_| flanges.next()) {
                    Some(flange) => line_offset(&line.from, &line.to, 0.5, &flange),
                    None => f64::INFINITY,
                }
            })
            .collect()
    })
}

/// Longest piece of a line that is judged by three samples (mm).
pub(crate) const PIECE_MM: f64 = 100.0;

/// Largest distance from the intended line along a path (mm): that of the `middle`, which is given, and where that is not
/// clearly straight of samples that get denser until they tell the distance to [`CHORD_MM`]. Where a joint turns, its link
/// waits until the play is taken up.
pub(crate) fn line_deviation(path: &Segment<'_>, arms: &Arms<'_>, emit: Emit, middle: f64) -> f64 {
    let Segment { from, to, .. } = path;
    match path.play_operator(arms) {
        None => deviation_without_play(from, to, to.condition_index, arms, emit, middle),
        Some(play_operator) => play_operator.largest_deviation(
            STEPS * pieces_of(from, to),
            &|s| motor_joints_at(from, to, s, arms, emit),
            &|s, flange| line_offset(from, to, s, flange),
        ),
    }
}

/// Steps of links with play on each piece of a way, to begin with.
pub(crate) const STEPS: usize = 8;

/// The same where no joint turns on the way.
fn deviation_without_play(
    from: &SegmentEnd<'_>,
    to: &SegmentEnd<'_>,
    condition_index: usize,
    arms: &Arms<'_>,
    emit: Emit,
    middle: f64,
) -> f64 {
    let length = distance(&from.intended.translation.vector, &to.intended.translation.vector);
    let turn = from.intended.rotation.angle_to(&to.intended.rotation);
    if length < PIECE_MM && turn < 0.2 && middle < CLEARLY_STRAIGHT_MM {
        return middle;
    }
    largest(pieces_of(from, to), &|s| offset_at(from, to, s, condition_index, arms, emit)).max(middle)
}

fn pieces_of(from: &SegmentEnd<'_>, to: &SegmentEnd<'_>) -> usize {
    let length = distance(&from.intended.translation.vector, &to.intended.translation.vector);
    ((length / PIECE_MM).ceil() as usize).clamp(1, 25) * 2
}

/// How often a piece is halved at most.
const HALVINGS: u32 = 5;

/// The largest value of a function over a path, which is 0 at both ends: equal pieces, each halved until its chord tells
/// its middle to [`CHORD_MM`].
pub(crate) fn largest(pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    largest_from([0.0; 2], pieces, off)
}

/// The same with other values at the ends.
pub(crate) fn largest_from(ends: [f64; 2], pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    let at = |k: usize| match k {
        0 => ends[0],
        k if k == pieces => ends[1],
        k => off(k as f64 / pieces as f64),
    };
    let mut most = ends[0];
    let mut before = at(0);
    for k in 0..pieces {
        let after = at(k + 1);
        let (begin, end) = (k as f64 / pieces as f64, (k + 1) as f64 / pieces as f64);
        most = most.max(after).max(between_samples((begin, before), (end, after), off, HALVINGS));
        before = after;
    }
    most
}

fn between_samples(a: (f64, f64), b: (f64, f64), off: &dyn Fn(f64) -> f64, halvings: u32) -> f64 {
    let s = 0.5 * (a.0 + b.0);
    let middle = off(s);
    // A path that cannot be gone is told by its first sample.
    if halvings == 0 || !middle.is_finite() || (middle - 0.5 * (a.1 + b.1)).abs() <= CHORD_MM {
        return middle;
    }
    let halves = [
        between_samples(a, (s, middle), off, halvings - 1),
        between_samples((s, middle), b, off, halvings - 1),
    ];
    halves[0].max(halves[1]).max(middle)
}

/// Below this the middle of a short line tells enough: the bend is a parabola to leading order.
const CLEARLY_STRAIGHT_MM: f64 = 0.01;

/// Targets that keep the path within tolerance, and the bend that is left: one where a joint turns, at which the arm takes
/// up its play, and between those by bisection.
///
/// A told line between two of them bends a joint's course a little. Close to where the joint turns it then turns once more,
/// and the link waits: where this leaves more than the tolerance, the lines are cut finer.
///
/// `None` where such a target would turn a joint by far more than the correction elsewhere, near a singularity; where the arm
/// cannot go that way with them either; and where a link with play would not come to lie at the end as is told of it.
pub(crate) fn insertions(
    path: &Segment<'_>,
    arms: &Arms<'_>,
    options: &Options,
) -> Option<(Vec<Extra>, f64)> {
    let mut best = split_line(path, arms, options.emit, options.tolerance_mm);
    if let Some(play_operator) = path.play_operator(arms) {
        let mut aim_mm = options.tolerance_mm;
        best.remaining_mm = deviation_with_play(path, &best, &play_operator, arms, options.emit);
        for _ in 0..FINER {
            if best.remaining_mm <= options.tolerance_mm {
                break;
            }
            aim_mm *= 0.5;
            let mut finer = split_line(path, arms, options.emit, aim_mm);
            finer.remaining_mm = deviation_with_play(path, &finer, &play_operator, arms, options.emit);
            if finer.remaining_mm < best.remaining_mm {
                best = finer;
            }
        }
    }
    let extra = |stop: &InsertedTarget<'_>| {
        extra_of((&stop.at.commanded, &stop.at.joints), stop.share, options.emit, path, arms)
    };
    let commanded = &path.to.frames_index.commanded;
    let leap = |stop: &InsertedTarget<'_>| {
        let intended = between(&path.from.intended, &path.to.intended, stop.share);
        jumps_joint([&intended, &stop.at.commanded], &stop.at.joints, commanded, arms, options)
    };
    let goes = best.remaining_mm.is_finite()
        && path.ends_on_planned_sides(
            best.inserted.len() + 1,
            &|u| motor_joints_on(path, &best, u, arms, options.emit),
            arms,
        );
    (goes && !best.inserted.iter().any(leap))
        .then(|| (best.inserted.iter().map(extra).collect(), best.remaining_mm))
}

/// How often the lines between targets that are put in are cut finer.
const FINER: usize = 4;

/// A target that is put in.
#[derive(Clone, Copy)]
struct InsertedTarget<'a> {
    share: f64,
    at: SegmentEnd<'a>,
}

/// A line that is cut.
struct SplitLine<'a> {
    inserted: Vec<InsertedTarget<'a>>,
    /// Largest distance from the intended line (mm).
    remaining_mm: f64,
}

/// Cuts a line so that its pieces, gone with the links on the flanks where they come to lie, keep within `aim_mm`.
fn split_line<'a>(path: &Segment<'a>, arms: &Arms<'_>, emit: Emit, aim_mm: f64) -> SplitLine<'a> {
    let Segment { from, to, schedule } = path;
    let mut out = SplitLine { inserted: Vec::new(), remaining_mm: 0.0 };
    let mut begin = InsertedTarget { share: 0.0, at: *from };
    let splitting = LineSplitter { arms, emit, aim_mm };
    for turn in schedule.changes(from) {
        let at = |condition_index: usize| {
            end_between(from, to, turn.share, condition_index, arms)
                .map(|at| InsertedTarget { share: turn.share, at })
        };
        if turn.share > 0.0
            && let Some(arrived) = at(turn.before)
        {
            splitting.split(&begin, &arrived, MAX_DEPTH, &mut out);
            out.inserted.push(arrived);
        }
        let Some(taken_up) = at(turn.after) else { continue };
        begin = taken_up;
        out.inserted.push(taken_up);
    }
    splitting.split(&begin, &InsertedTarget { share: 1.0, at: *to }, MAX_DEPTH, &mut out);
    out
}

/// Largest distance from the intended line where it is cut, gone by links with play (mm). While a play is taken up on the
/// spot nothing is judged: the arm may stand off there because it was just loaded.
fn deviation_with_play(
    path: &Segment<'_>,
    split_line: &SplitLine<'_>,
    play_operator: &PlayOperator<'_>,
    arms: &Arms<'_>,
    emit: Emit,
) -> f64 {
    let off = |u: f64, flange: &Pose| match piece_of(path, split_line, u) {
        (a, b, _) if a.0 == b.0 => 0.0,
        (a, b, t) => line_offset(&path.from, &path.to, a.0 + t * (b.0 - a.0), flange),
    };
    play_operator.largest_deviation(
        STEPS * (split_line.inserted.len() + 1),
        &|u| motor_joints_on(path, split_line, u, arms, emit),
        &off,
    )
}

/// The piece of a cut line on which `u` lies, of all pieces taken as equally long: both of its ends with their share of the
/// way, and the share of the piece.
fn piece_of<'c, 'a>(
    path: &'c Segment<'a>,
    split_line: &'c SplitLine<'a>,
    u: f64,
) -> ((f64, &'c SegmentEnd<'a>), (f64, &'c SegmentEnd<'a>), f64) {
    let pieces = split_line.inserted.len() + 1;
    let node = |k: usize| match k {
        0 => (0.0, &path.from),
        k if k == pieces => (1.0, &path.to),
        k => (split_line.inserted[k - 1].share, &split_line.inserted[k - 1].at),
    };
    let u = u * pieces as f64;
    let k = (u as usize).min(pieces - 1);
    (node(k), node(k + 1), u - k as f64)
}

/// Joints to which the controller goes there.
fn motor_joints_on(
    path: &Segment<'_>,
    split_line: &SplitLine<'_>,
    u: f64,
    arms: &Arms<'_>,
    emit: Emit,
) -> Option<Joints> {
    let (a, b, t) = piece_of(path, split_line, u);
    motor_joints_at(a.1, b.1, t, arms, emit)
}

/// A point of the intended line as a corrected end, under a condition.
fn end_between<'a>(
    from: &SegmentEnd<'a>,
    to: &SegmentEnd<'a>,
    s: f64,
    condition_index: usize,
    arms: &Arms<'_>,
) -> Option<SegmentEnd<'a>> {
    let intended = between(&from.intended, &to.intended, s);
    let near = from.joints.lerp(&to.joints, s);
    let joints = arms
        .conditions
        .inverse(condition_index)
        .solve_near(&to.frames_index.real.flange_for(&intended), &near)
        .ok()?
        .joints;
    let commanded = to.frames_index.commanded.target_of(&arms.nominal.arm().forward(&joints));
    Some(SegmentEnd { intended, commanded, joints, condition_index, before: near, ..*to })
}

/// 63 targets at most on one line: more means that the line cannot be followed.
const MAX_DEPTH: usize = 6;

/// How a line is cut in halves until they are straight.
struct LineSplitter<'s> {
    arms: &'s Arms<'s>,
    emit: Emit,
    aim_mm: f64,
}

impl LineSplitter<'_> {
    fn split<'a>(
        &self,
        begin: &InsertedTarget<'a>,
        end: &InsertedTarget<'a>,
        depth: usize,
        out: &mut SplitLine<'a>,
    ) {
        let (from, to, condition_index) = (&begin.at, &end.at, end.at.condition_index);
        let middle = offset_at(from, to, 0.5, condition_index, self.arms, self.emit);
        let deviation = deviation_without_play(from, to, condition_index, self.arms, self.emit, middle);
        let halves = if deviation <= self.aim_mm || depth == 0 {
            None
        } else {
            end_between(from, to, 0.5, condition_index, self.arms)
        };
        match halves {
            None => out.remaining_mm = out.remaining_mm.max(deviation),
            Some(at) => {
                let middle = InsertedTarget { share: 0.5 * (begin.share + end.share), at };
                self.split(begin, &middle, depth - 1, out);
                out.inserted.push(middle);
                self.split(&middle, end, depth - 1, out);
            }
        }
    }
}

/// How far the tool is, half way of a joint motion, from where the data-sheet arm goes with the program as it is (mm),
/// the largest over the way: a joint motion has no line to keep, so nothing is put in for it.
pub(crate) fn joint_motion_deviation(path: &Segment<'_>, arms: &Arms<'_>) -> f64 {
    let Segment { from, to, .. } = path;
    let motor = |s: f64| from.joints.lerp(&to.joints, s);
    let off = |s: f64, flange: &Pose| {
        let intended = arms.nominal.arm().forward(&from.before.lerp(&to.before, s));
        let intended = to.frames_index.commanded.target_of(&intended).translation.vector;
        distance(&to.frames_index.real.target_of(flange).translation.vector, &intended)
    };
    match path.play_operator(arms) {
        Some(play_operator) => play_operator.largest_deviation(STEPS, &|s| Some(motor(s)), &off),
        None => {
            let even = |s: f64| off(s, &arms.conditions.arm(to.condition_index).forward(&motor(s)));
            largest_from([even(0.0), even(1.0)], 2, &even)
        }
    }
}

/// A target that the told path needs at a share of the way.
pub(crate) fn extra_of(
    (commanded, joints): (&Pose, &Joints),
    share: f64,
    emit: Emit,
    path: &Segment<'_>,
    arms: &Arms<'_>,
) -> Extra {
    let q = commanded.rotation.quaternion();
    let external = path.external_at(share);
    match emit {
        Emit::Targets => Extra {
            kind: MotionKind::Linear,
            target: NewTarget::Cartesian {
                position_mm: commanded.translation.vector.into(),
                quaternion: [q.w, q.i, q.j, q.k],
                // cfx stays where only the quarters are used: where the end of the motion does not state its own.
                conf: path.to.conf.map(|[_, _, _, cfx]| {
                    let here = arms.nominal.configuration(joints);
                    let used = cfx == arms.nominal.configuration(&path.to.joints).cfx;
                    [here.cf1, here.cf4, here.cf6, if used { here.cfx } else { cfx }]
                }),
            },
            external,
        },
        Emit::Joints => Extra {
            kind: MotionKind::AbsoluteJoint,
            target: NewTarget::Joint { robot_deg: std::array::from_fn(|i| joints[i].to_degrees()) },
            external,
        },
    }
}

/// Distance between two positions (mm).
pub(crate) fn distance(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    (a - b).norm()
}
