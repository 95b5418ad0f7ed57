//! Lines between two targets: deviation of the commanded line when the estimated arm follows it, and the targets inserted to
//! straighten it.

use nalgebra::Vector3;

use crate::arms::Arms;
use crate::backlash::play_operator::PlayOperator;
use crate::condition::arm_conditions::select;
use crate::feasibility::joint_jump::jumps_joint;
use crate::frames::frame_pair::ResolvedFrames;
use crate::options::{Emit, Options};
use crate::segment::condition_schedule::{CHORD_MM, ConditionSchedule};
use crate::segment::curve::{between, lateral_offset};
use crate::segment::rounded_end::RoundedEnd;
use crate::target::at_pole::joints_in_orientation;
use truegrind_arm::model::Joints;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::{Pose, angle_bound_rad};
use truegrind_programs::motion::MotionKind;
use truegrind_programs::rewrite::{Extra, NewTarget};

/// A corrected end of a motion.
#[derive(Clone, Copy)]
pub(crate) struct SegmentEnd<'a> {
    pub(crate) frames: &'a ResolvedFrames,
    pub(crate) index: usize,
    /// Intended pose in the work object.
    pub(crate) intended: Pose,
    /// Pose that the controller is commanded, in the work object.
    pub(crate) commanded: Pose,
    /// Corrected joints.
    pub(crate) joints: Joints,
    /// Condition under which the arm arrives.
    pub(crate) condition_index: usize,
    /// Joints of the original program.
    pub(crate) before: Joints,
    /// Stated configuration, where the controller checks it.
    pub(crate) conf: Option<[i32; 4]>,
    /// External axes of the target, where known.
    pub(crate) external: Option<&'a [OptionF64; 6]>,
    /// Whether the orientation of targets inserted before it must lie between those of the ends: near a pole of its words.
    pub(crate) between_ends: bool,
}

impl<'a> SegmentEnd<'a> {
    /// The same flange pose expressed in the frames of `other`, as commanded and as intended. The controller starts from
    /// there on a path of that tool in that work object.
    pub(crate) fn with_frames_of(self, other: &SegmentEnd<'a>) -> Self {
        let (old, new) = (self.frames, other.frames);
        SegmentEnd {
            frames: new,
            index: other.index,
            intended: new.real.target_of(&old.real.flange_for(&self.intended)),
            commanded: new.commanded.target_of(&old.commanded.flange_for(&self.commanded)),
            ..self
        }
    }
}

impl ConditionSchedule {
    /// Where along the segment from `start` backlash must be taken up or the payload changes, with the condition before and
    /// after.
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

/// A change of condition: a joint reverses and must take up its backlash, or the payload changes.
struct ConditionChange {
    share: f64,
    before: usize,
    after: usize,
}

/// A segment between two corrected ends.
pub(crate) struct Segment<'a> {
    pub(crate) from: SegmentEnd<'a>,
    pub(crate) to: SegmentEnd<'a>,
    pub(crate) schedule: ConditionSchedule,
}

impl Segment<'_> {
    /// The external axes at a share of the segment, interpolated as the controller does; `None` where none moves, so that
    /// those of the end apply.
    fn external_at(&self, share: f64) -> Option<[OptionF64; 6]> {
        let (from, to) = (self.from.external?, self.to.external?);
        (from != to).then(|| {
            std::array::from_fn(|axis| match (from[axis].get(), to[axis].get()) {
                (Some(from), Some(to)) => (from + (to - from) * share).into(),
                _ => to[axis],
            })
        })
    }

    /// The play operator at its start, where a joint reverses along the segment or the payload differs from before.
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

    /// Whether the links end on their planned backlash sides when the motors follow `pieces` pieces with inserted targets;
    /// these need not reverse where the whole segment does.
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

/// Offset of the tool from the intended line at share `s`; infinite where the nominal arm cannot follow.
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

/// Commanded joints at share `s` of the commanded line; `None` where the nominal arm cannot follow.
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
            let solution = arms.nominal.solve_near(&to.frames.commanded.flange_for(&commanded), &joints);
            solution.ok().map(|solution| solution.joints)
        }
    }
}

/// Offset of the tool from the intended line (mm) at share `s`, with the flange at the given pose.
///
/// The tool may lead or lag along the line: only the normal component counts, unless the line is too short.
fn line_offset(from: &SegmentEnd<'_>, to: &SegmentEnd<'_>, s: f64, flange: &Pose) -> f64 {
    let reached = to.frames.real.target_of(flange);
    let intended = from.intended.translation.vector.lerp(&to.intended.translation.vector, s);
    let off = reached.translation.vector - intended;
    lateral_offset(&off, &(to.intended.translation.vector - from.intended.translation.vector))
}

/// [`offset_at`] the midpoints of many lines, in lanes.
pub(crate) fn midpoint_deviations(lines: &[&Segment<'_>], arms: &Arms<'_>, emit: Emit) -> Vec<f64> {
    let halfway: Vec<Joints> = lines.iter().map(|line| line.from.joints.lerp(&line.to.joints, 0.5)).collect();
    let joints: Vec<Option<Joints>> = match emit {
        Emit::Joints => halfway.into_iter().map(Some).collect(),
        Emit::Targets => {
            let commanded = |line: &&Segment<'_>| {
                line.to.frames.commanded.flange_for(&between(&line.from.commanded, &line.to.commanded, 0.5))
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

/// Longest piece of a line that three samples can judge (mm).
pub(crate) const PIECE_MM: f64 = 100.0;

/// Largest deviation from the intended line along a segment (mm): the given `middle` where that clearly shows a straight
/// line, else from samples that are refined until they determine it to [`CHORD_MM`]. Where a joint reverses, its link rests
/// until the backlash is taken up.
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

/// Initial play operator steps per piece of a segment.
pub(crate) const STEPS: usize = 8;

/// As [`line_deviation`], where no joint reverses.
fn deviation_without_play(
    from: &SegmentEnd<'_>,
    to: &SegmentEnd<'_>,
    condition_index: usize,
    arms: &Arms<'_>,
    emit: Emit,
    middle: f64,
) -> f64 {
    let length = distance(&from.intended.translation.vector, &to.intended.translation.vector);
    let [a, b] = [&from.intended.rotation, &to.intended.rotation];
    let turns_little = || angle_bound_rad(a, b) < SMALL_TURN_RAD || a.angle_to(b) < SMALL_TURN_RAD;
    if length < PIECE_MM && middle < CLEARLY_STRAIGHT_MM && turns_little() {
        return middle;
    }
    largest(pieces_of(from, to), &|s| offset_at(from, to, s, condition_index, arms, emit)).max(middle)
}

fn pieces_of(from: &SegmentEnd<'_>, to: &SegmentEnd<'_>) -> usize {
    let length = distance(&from.intended.translation.vector, &to.intended.translation.vector);
    ((length / PIECE_MM).ceil() as usize).clamp(1, 25) * 2
}

/// Largest number of bisections of a piece.
const HALVINGS: u32 = 5;

/// Largest value of a function along a path whose ends have value 0: equal pieces, each bisected until its chord determines
/// its midpoint to [`CHORD_MM`].
pub(crate) fn largest(pieces: usize, off: &dyn Fn(f64) -> f64) -> f64 {
    largest_from([0.0; 2], pieces, off)
}

/// As [`largest`], with other values at the ends.
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
        most = most.max(after).max(largest_between_samples((begin, before), (end, after), off, HALVINGS));
        before = after;
    }
    most
}

fn largest_between_samples(a: (f64, f64), b: (f64, f64), off: &dyn Fn(f64) -> f64, halvings: u32) -> f64 {
    let s = 0.5 * (a.0 + b.0);
    let middle = off(s);
    // A path that the arm cannot follow shows at the first sample.
    if halvings == 0 || !middle.is_finite() || (middle - 0.5 * (a.1 + b.1)).abs() <= CHORD_MM {
        return middle;
    }
    let halves = [
        largest_between_samples(a, (s, middle), off, halvings - 1),
        largest_between_samples((s, middle), b, off, halvings - 1),
    ];
    halves[0].max(halves[1]).max(middle)
}

/// Largest rotation along a line that its midpoint can judge (rad).
const SMALL_TURN_RAD: f64 = 0.2;

/// Below this the midpoint of a short line suffices: the deviation is a parabola to leading order.
const CLEARLY_STRAIGHT_MM: f64 = 0.01;

/// Inserted targets that keep the path within tolerance, and the remaining deviation: one at each joint reversal, where the
/// arm takes up its backlash, and between those by bisection.
///
/// A commanded line between two of them slightly changes the joint motion. Close to a reversal the joint can then reverse
/// once more while the link rests: where this leaves more than the tolerance, the lines are split more finely.
///
/// `None` where an inserted target would turn a joint far more than the same correction elsewhere, near a singularity; where
/// the arm cannot follow even with inserted targets; and where a link with backlash would not end on its planned side.
///
/// Where that is possible, targets keep clear of the rounded corners at the ends. Otherwise what they make of the corners counts: they are
/// worth less than none where the corners move by more than the line is straightened.
pub(crate) fn insertions(
    path: &Segment<'_>,
    corners: &[RoundedEnd; 2],
    arms: &Arms<'_>,
    options: &Options,
) -> Option<Insertions> {
    let length_mm = distance(&path.from.intended.translation.vector, &path.to.intended.translation.vector);
    let free = corners.map(|corner| corner.free_mm() / length_mm);
    let clear_of_corners = [free[0], 1.0 - free[1]];
    let anywhere = [0.0, 1.0];
    let whole = insertions_within(anywhere, path, corners, arms, options);
    if free == [0.0; 2] || !(clear_of_corners[0] < clear_of_corners[1]) {
        return whole;
    }
    let clear = insertions_within(clear_of_corners, path, corners, arms, options);
    [clear, whole].into_iter().flatten().min_by(|a, b| a.worst_mm().total_cmp(&b.worst_mm()))
}

/// The targets to insert into a line.
pub(crate) struct Insertions {
    pub(crate) before: Vec<Extra>,
    /// Largest deviation from the intended line that remains (mm).
    pub(crate) remaining_mm: f64,
    /// By how much they move the path in the corners at its ends (mm).
    pub(crate) corners_moved_mm: f64,
}

impl Insertions {
    /// The larger of the two (mm).
    pub(crate) fn worst_mm(&self) -> f64 {
        self.remaining_mm.max(self.corners_moved_mm)
    }
}

/// The targets to insert between two shares of a line.
fn insertions_within(
    shares: [f64; 2],
    path: &Segment<'_>,
    corners: &[RoundedEnd; 2],
    arms: &Arms<'_>,
    options: &Options,
) -> Option<Insertions> {
    let mut best = split_line(path, shares, arms, options.emit, options.tolerance_mm);
    if let Some(play_operator) = path.play_operator(arms) {
        let mut aim_mm = options.tolerance_mm;
        best.remaining_mm = deviation_with_play(path, &best, &play_operator, arms, options.emit);
        for _ in 0..FINER {
            if best.remaining_mm <= options.tolerance_mm {
                break;
            }
            aim_mm *= 0.5;
            let mut finer = split_line(path, shares, arms, options.emit, aim_mm);
            finer.remaining_mm = deviation_with_play(path, &finer, &play_operator, arms, options.emit);
            if finer.remaining_mm < best.remaining_mm {
                best = finer;
            }
        }
    }
    let extra = |stop: &InsertedTarget<'_>| {
        extra_of((&stop.at.commanded, &stop.at.joints), stop.share, options.emit, path, arms)
    };
    let commanded = &path.to.frames.commanded;
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
    let length_mm = distance(&path.from.intended.translation.vector, &path.to.intended.translation.vector);
    let [first, last] = [best.inserted.first(), best.inserted.last()].map(|target| target.map(|at| at.share));
    let moved = |corner: &RoundedEnd, share: Option<f64>| {
        share.map_or(0.0, |share| corner.moved_mm(share * length_mm))
    };
    let corners_moved_mm = moved(&corners[0], first).max(moved(&corners[1], last.map(|share| 1.0 - share)));
    (goes && !best.inserted.iter().any(leap)).then(|| Insertions {
        before: best.inserted.iter().map(extra).collect(),
        remaining_mm: best.remaining_mm,
        corners_moved_mm,
    })
}

/// How often the lines between inserted targets are refined.
const FINER: usize = 4;

/// An inserted target.
#[derive(Clone, Copy)]
struct InsertedTarget<'a> {
    share: f64,
    at: SegmentEnd<'a>,
}

/// A line split by inserted targets.
struct SplitLine<'a> {
    inserted: Vec<InsertedTarget<'a>>,
    /// Largest distance from the intended line (mm).
    remaining_mm: f64,
}

/// Splits a line so that its pieces, with every link on its flank, deviate by at most `aim_mm`. Only what takes up backlash is inserted
/// outside of `shares`.
fn split_line<'a>(
    path: &Segment<'a>,
    shares: [f64; 2],
    arms: &Arms<'_>,
    emit: Emit,
    aim_mm: f64,
) -> SplitLine<'a> {
    let Segment { from, to, schedule } = path;
    let mut out = SplitLine { inserted: Vec::new(), remaining_mm: 0.0 };
    let mut begin = InsertedTarget { share: 0.0, at: *from };
    let splitting = LineSplitter { shares, arms, emit, aim_mm };
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

/// Largest deviation from the intended line after splitting, with the play operator (mm). While backlash is taken up at rest
/// nothing is judged: a change of payload can displace the arm there.
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

/// The piece that contains `u` when all pieces count as equally long: both ends with their share of the segment, and the
/// share within the piece.
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

/// Commanded joints there.
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
        .solve_near(&to.frames.real.flange_for(&intended), &near)
        .ok()?
        .joints;
    let joints = if to.between_ends {
        let turned = between(&from.commanded, &to.commanded, s).rotation;
        joints_in_orientation(turned, &intended, &joints, to.frames, condition_index, arms).ok()?
    } else {
        joints
    };
    let commanded = to.frames.commanded.target_of(&arms.nominal.arm().forward(&joints));
    Some(SegmentEnd { intended, commanded, joints, condition_index, before: near, ..*to })
}

/// At most 63 targets on one line: if more are needed, the line cannot be followed.
const MAX_DEPTH: usize = 6;

/// Smallest share of a piece that is split off: more is gained elsewhere.
const SMALLEST_PIECE: f64 = 0.05;

/// Bisection of a line until its pieces are straight.
struct LineSplitter<'s> {
    /// Between which shares of the line it is divided.
    shares: [f64; 2],
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
        let share = (0.5 * (begin.share + end.share)).clamp(self.shares[0], self.shares[1]);
        let of_piece = (share - begin.share) / (end.share - begin.share);
        let divides = of_piece > SMALLEST_PIECE && of_piece < 1.0 - SMALLEST_PIECE;
        let halves = if deviation <= self.aim_mm || depth == 0 || !divides {
            None
        } else {
            end_between(from, to, of_piece, condition_index, self.arms)
        };
        match halves {
            None => out.remaining_mm = out.remaining_mm.max(deviation),
            Some(at) => {
                let middle = InsertedTarget { share, at };
                self.split(begin, &middle, depth - 1, out);
                out.inserted.push(middle);
                self.split(&middle, end, depth - 1, out);
            }
        }
    }
}

/// Largest deviation of the tool over a joint motion (mm) from where the nominal arm goes in the original program: a joint
/// motion follows no line, so no targets are inserted.
pub(crate) fn joint_motion_deviation(path: &Segment<'_>, arms: &Arms<'_>) -> f64 {
    let Segment { from, to, .. } = path;
    let motor = |s: f64| from.joints.lerp(&to.joints, s);
    let off = |s: f64, flange: &Pose| {
        let intended = arms.nominal.arm().forward(&from.before.lerp(&to.before, s));
        let intended = to.frames.commanded.target_of(&intended).translation.vector;
        distance(&to.frames.real.target_of(flange).translation.vector, &intended)
    };
    match path.play_operator(arms) {
        Some(play_operator) => play_operator.largest_deviation(STEPS, &|s| Some(motor(s)), &off),
        None => {
            let even = |s: f64| off(s, &arms.conditions.arm(to.condition_index).forward(&motor(s)));
            largest_from([even(0.0), even(1.0)], 2, &even)
        }
    }
}

/// A target to insert at a share of the commanded path.
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
                // cfx remains unchanged where only the quarter turns are used, i.e. where the end of the
                // motion does not state its own.
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
