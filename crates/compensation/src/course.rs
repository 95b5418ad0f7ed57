//! From which side each joint comes to rest, from the program's own motion.
//!
//! A link with play stays where it is until one of its flanks takes it along, so where it can be follows from the joints on
//! the way: a range, as wide as the play where nothing is known (the start of a program, a motion that the text does not
//! tell), a point from there on where its motor has moved by more than that. A target that is corrected says where the link
//! shall stand. The motor pushes it there from below if it is above all places where the link can be before, from above if
//! it is below all of them, and comes by the whole play farther where it turns; where it is between, no side is known, and
//! side 0 stands for the middle of the play. So a target whose link turns by less than its play is told from one whose
//! motor alone turns. What stays as it was told leaves a link that turns by less than its play between its flanks.
//!
//! Lines and arcs are sampled between their ends, and a parabola through neighbouring samples tells where between them
//! a joint turned. Where the text leaves open how the joints go (rapid motions of NC; lines and arcs of which the wrist goes
//! joint by joint; lines written as joints or cut by targets that are put in), each way is followed, and a side is known
//! where they agree.

use super::curve::Curve;
use super::effort;
use super::mounting::Mounting;
use super::wrist;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::inverse::effort::{Allowance, within};
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Motion, MotionKind, Switch};

/// The side from which each joint came: −1 from below, +1 from above, 0 not known.
pub(super) type Sides = [i8; 6];

/// A link that would have to turn by less stays where it is (rad): 0.003 mm on the largest arms.
const STILL_RAD: f64 = 1e-6;

/// A motor that comes back by less on a way has not turned (rad): what a drive at rest may stray by.
const DEAD_BAND_RAD: f64 = 1e-5;

/// Samples on a path are no farther apart than this (mm, rad).
const SAMPLE_MM: f64 = 25.0;
const SAMPLE_RAD: f64 = 0.1;
/// No path has more samples.
const MOST_SAMPLES: usize = 64;
/// A path that is shorter has one sample (mm, rad): its joints hardly depart from a parabola.
const SHORT_MM: f64 = 5.0;
const SHORT_RAD: f64 = 0.02;
/// How often a path is sampled four times as densely, where its samples do not agree on where a joint turns.
const REFINEMENTS: u32 = 3;
/// No path that is sampled so has more samples.
const MOST_REFINED: usize = 256;

/// A joint that goes farther between neighbouring samples comes past a singularity (rad).
const MOST_STEP_RAD: f64 = 0.6;

/// Where a motion ends.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::large_enum_variant, reason = "nearly all are `At`")]
pub(super) enum Stop<'a> {
    /// The arm does not move (external axes alone).
    Stays,
    /// The text does not tell where the arm is afterwards.
    Lost,
    /// At joints that are known.
    At(Reached<'a>),
}

/// The end of a motion with what is known of the way to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reached<'a> {
    /// The motion.
    pub(super) motion: &'a Motion,
    /// Index of the mounting.
    pub(super) mounted: usize,
    /// What the controller is told, in the work object.
    pub(super) told: Pose,
    /// Joints there.
    pub(super) joints: Joints,
    /// The point on the arc of a circular motion.
    pub(super) via: Option<Pose>,
    /// Where the links shall stand, if the end is corrected.
    pub(super) links: Option<Joints>,
    /// Whether it is written as joints.
    pub(super) as_joints: bool,
    /// Whether targets may be put in before it.
    pub(super) may_cut: bool,
}

impl Reached<'_> {
    /// Whether its joints may go along a path, and whether they may go in proportion.
    fn ways(&self) -> (bool, bool) {
        let wrist = self.motion.modal.wrist_interpolation != Switch::Off;
        match self.motion.kind {
            MotionKind::Linear | MotionKind::Circular => (true, wrist || self.as_joints),
            MotionKind::Joint => (self.motion.rapid, true),
            _ => (false, true),
        }
    }
}

/// The sides on the way to the end of a motion.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Course {
    /// At the share 0 of the way, and from each share on at which a joint turns.
    pub(super) turns: Vec<(f64, Sides)>,
    /// At the end.
    pub(super) end: Sides,
    /// At the circle point, where there is one.
    pub(super) via: Sides,
}

impl Course {
    /// The side of a joint is not known.
    fn forget(&mut self, joint: usize) {
        (self.end[joint], self.via[joint]) = (0, 0);
        self.turns.iter_mut().for_each(|(_, sides)| sides[joint] = 0);
    }
}

/// What one joint did last.
#[derive(Debug, Clone, Copy)]
struct Track {
    /// The flank on which the link lies, 0 where that is not known, or on neither.
    side: i8,
    /// The turning point of the motor (rad).
    farthest: f64,
    /// At which share of the present motion that was.
    since: f64,
    /// Where the link can be (rad).
    low: f64,
    high: f64,
    /// Half of its play (rad).
    half: f64,
}

impl Track {
    /// A link of which nothing is known but where its motor stands.
    fn unknown(motor: f64, half: f64) -> Self {
        Self { side: 0, farthest: motor, since: 0.0, low: motor - half, high: motor + half, half }
    }

    /// The link is taken along by its flanks.
    fn take(&mut self, motor: f64) {
        let (low, high) = (motor - self.half, motor + self.half);
        (self.low, self.high) = (self.low.clamp(low, high), self.high.clamp(low, high));
    }

    /// The flank on which the link certainly lies, its motor being there.
    fn flank(&self, motor: f64) -> i8 {
        let near = DEAD_BAND_RAD.min(0.1 * self.half);
        if self.high - (motor - self.half) <= near {
            -1
        } else if motor + self.half - self.low <= near {
            1
        } else {
            0
        }
    }

    /// The motor goes on; hands back where the side changed, if it did.
    fn go(&mut self, motor: f64, share: f64) -> Option<f64> {
        self.take(motor);
        if self.side == 0 {
            self.side = self.flank(motor);
            (self.farthest, self.since) = (motor, share);
            return (self.side != 0).then_some(share);
        }
        let gone = motor - self.farthest;
        // A joint that moves up came from below.
        let side = if gone > 0.0 { -1 } else { 1 };
        if self.side == side {
            (self.farthest, self.since) = (motor, share);
        } else if gone.abs() > DEAD_BAND_RAD {
            let turned = self.since;
            (self.side, self.farthest, self.since) = (side, motor, share);
            return Some(turned);
        }
        None
    }

    /// The motor comes to rest as told; hands back whether the side is another.
    fn rest(&mut self, motor: f64) -> bool {
        let before = self.side;
        (self.side, self.farthest) = (self.flank(motor), motor);
        self.side != before
    }

    /// The motor brings the link to where it shall stand; hands back whether the side is another than on the way.
    fn arrive(&mut self, motor: f64, link: f64) -> bool {
        let before = self.side;
        let (low, high) = (self.low - STILL_RAD, self.high + STILL_RAD);
        self.side = if link > high {
            -1
        } else if link < low {
            1
        } else if self.high - self.low <= STILL_RAD {
            self.side
        } else {
            0
        };
        self.take(link - f64::from(self.side) * self.half);
        self.farthest = motor;
        self.side != before
    }

    /// The side is not known after all.
    fn forget(&mut self, link: Option<f64>, motor: f64) {
        let middle = link.unwrap_or(motor);
        *self = Self { farthest: motor, ..Self::unknown(middle, self.half) };
    }
}

/// The sides along all motions. `before[m]`: the motion that ended where motion m starts. `doubted[m]`: the joints of which
/// no side is to be known at the end of motion m; all others where it is empty.
pub(super) fn courses(
    stops: &[Stop<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    play_rad: &[f64; 6],
    mounting: &dyn Fn(usize) -> Mounting,
    doubted: &[[bool; 6]],
) -> Vec<Course> {
    let half = play_rad.map(|play| 0.5 * play.abs());
    let (ways, passes) = sampled(stops, before, nominal, &half, mounting);
    let by_wrist = by_wrist(stops, before, nominal, &half, mounting);
    let mut tracks: Vec<Option<[Track; 6]>> = Vec::with_capacity(stops.len());
    let mut out = Vec::with_capacity(stops.len());
    for (m, stop) in stops.iter().enumerate() {
        let from = before[m].map(|b| b as usize).filter(|b| *b < m);
        let mut track = from.and_then(|b| tracks[b]);
        let mut course = Course { turns: Vec::new(), end: [0; 6], via: [0; 6] };
        match stop {
            Stop::Lost => track = None,
            Stop::Stays => course.end = track.map_or([0; 6], |track| track.map(|t| t.side)),
            Stop::At(reached) => {
                let start = from.and_then(|b| match &stops[b] {
                    Stop::At(start) => Some(start.joints),
                    _ => None,
                });
                let mut here = track.unwrap_or_else(|| {
                    let at = start.unwrap_or(reached.joints);
                    std::array::from_fn(|j| Track::unknown(at[j], half[j]))
                });
                here.iter_mut().for_each(|t| t.since = 0.0);
                let mut along: Vec<Sampled> = Vec::new();
                for samples in std::iter::once(&ways[m]).chain(&by_wrist[m]) {
                    let begin = start.map(|joints| (0.0, joints));
                    along.extend(
                        samples.as_ref().map(|inner| begin.into_iter().chain(inner.clone()).collect()),
                    );
                }
                if along.len() < 1 + by_wrist[m].iter().count() {
                    // The arm cannot go along the path: how it comes to the end is not known.
                    here = std::array::from_fn(|j| Track::unknown(reached.joints[j], half[j]));
                    along = vec![Vec::new()];
                }
                course.via = agreed(along.iter().map(|way| passing(here, reached, way, passes[m])));
                (course.turns, here) = arrive(here, reached, &along);
                course.end = here.map(|t| t.side);
                for joint in (0..6).filter(|&joint| doubted.get(m).is_some_and(|doubted| doubted[joint])) {
                    course.forget(joint);
                    here[joint].forget(reached.links.map(|links| links[joint]), reached.joints[joint]);
                }
                let open = course.end.map(|side| side == 0);
                (0..6).filter(|&joint| open[joint]).for_each(|joint| course.forget(joint));
                track = Some(here);
            }
        }
        tracks.push(track);
        out.push(course);
    }
    out
}

/// The joints at places between the ends of a motion, by its share.
type Sampled = Vec<(f64, Joints)>;

/// The samples of all motions, none where the arm cannot go along, and at which share each circle point is passed. Where
/// every other sample tells of other turns than all of them there are too few, and more are taken.
fn sampled(
    stops: &[Stop<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    half: &[f64; 6],
    mounting: &dyn Fn(usize) -> Mounting,
) -> (Vec<Option<Sampled>>, Vec<f64>) {
    let start = |m: usize| before[m].and_then(|from| stops.get(from as usize));
    let mut samples = Samples::default();
    for (m, stop) in stops.iter().enumerate() {
        samples.of(start(m), stop, 1, mounting);
    }
    let mut ways = samples.passed(nominal);
    let settled = |m: &usize, way: &Option<Sampled>| match (start(*m), &stops[*m], way) {
        (Some(Stop::At(from)), Stop::At(to), Some(way)) => agrees(&from.joints, way, &to.joints, half),
        _ => true,
    };
    let mut rough: Vec<usize> = (0..stops.len()).filter(|m| !settled(m, &ways[*m])).collect();
    for refinement in 1..=REFINEMENTS {
        let mut finer = Samples::default();
        for &m in &rough {
            finer.of(start(m), &stops[m], 4_usize.pow(refinement), mounting);
        }
        for (&m, way) in rough.iter().zip(finer.passed(nominal)) {
            ways[m] = way;
        }
        rough.retain(|m| !settled(m, &ways[*m]));
    }
    (ways, samples.passes)
}

/// The samples of motions on which the wrist may be interpolated by itself, nothing for all others; none where the arm cannot
/// go so.
fn by_wrist(
    stops: &[Stop<'_>],
    before: &[Option<u32>],
    nominal: &Inverse<'_>,
    half: &[f64; 6],
    mounting: &dyn Fn(usize) -> Mounting,
) -> Vec<Option<Option<Sampled>>> {
    let of = |(stop, before): (&Stop<'_>, &Option<u32>)| {
        let (Some(Stop::At(from)), Stop::At(to)) = (before.and_then(|from| stops.get(from as usize)), stop)
        else {
            return None;
        };
        let wrist = to.motion.modal.wrist_interpolation != Switch::Off;
        let (curve, within) = Some((from, to)).filter(|_| wrist).and_then(|_| path(from, to, mounting))?;
        let ends = [&from.joints, &to.joints];
        let mut count = pieces_of(&curve);
        loop {
            let way = wrist::along(nominal.arm(), &within, &curve, ends, count, MOST_STEP_RAD);
            let settled = |way: &Sampled| agrees(&from.joints, way, &to.joints, half);
            if count >= MOST_REFINED || way.as_ref().is_some_and(settled) {
                return Some(way);
            }
            count = (4 * count).min(MOST_REFINED);
        }
    };
    stops.iter().zip(before).map(of).collect()
}

/// The path of a motion that goes along one, in its object, with its tool and object.
fn path(
    from: &Reached<'_>,
    to: &Reached<'_>,
    mounting: &dyn Fn(usize) -> Mounting,
) -> Option<(Curve, Mounting)> {
    if !to.ways().0 {
        return None;
    }
    // The path is one of the tool and in the object of the motion, also where it begins under others.
    let within = mounting(to.mounted);
    let mut begin = from.told;
    if from.mounted != to.mounted {
        begin = within.target_of(&mounting(from.mounted).flange_for(&from.told));
    }
    let curve = match (to.motion.kind, to.via) {
        (MotionKind::Circular, Some(via)) => Curve::round(begin, &via, to.told, to.motion),
        (MotionKind::Circular, None) => None,
        _ => Some(Curve::line(begin, to.told)),
    };
    Some((curve?, within))
}

/// Whether every other sample of a way tells of the same turns as all of them, for joints with play, and of none near its
/// end.
fn agrees(start: &Joints, way: &[(f64, Joints)], end: &Joints, half: &[f64; 6]) -> bool {
    if way.len() < 3 {
        return true;
    }
    (0..6).filter(|&joint| half[joint] > 0.0).all(|joint| {
        let inner = way.iter().map(|(share, joints)| (*share, joints[joint]));
        let all: Vec<(f64, f64)> =
            [(0.0, start[joint])].into_iter().chain(inner).chain([(1.0, end[joint])]).collect();
        let other: Vec<(f64, f64)> = all.iter().copied().step_by(2).collect();
        let [fine, coarse] = [last_slope(&all), last_slope(&other)];
        // What a turn could come to that lies between the last two samples.
        let hidden = 0.5 * (fine - coarse).abs() * (1.0 - all[all.len() - 2].0);
        let certain = (fine - coarse).abs() < 0.5 * fine.abs() || hidden < 0.1 * DEAD_BAND_RAD;
        let [all, other] = [turns(&all), turns(&other)];
        let alike = |((one, at), (other, near)): (&(i8, f64), &(i8, f64))| {
            one == other && (at - near).abs() < 0.5 * DEAD_BAND_RAD
        };
        certain && all.len() == other.len() && all.iter().zip(&other).all(alike)
    })
}

/// How fast a joint goes at the end of a way (rad per share), by the parabola through its last three samples.
fn last_slope(way: &[(f64, f64)]) -> f64 {
    let [.., a, b, c] = way else { return 0.0 };
    let (first, last) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    last + (last - first) / (c.0 - a.0) * (c.0 - b.0)
}

/// In which directions a joint goes in turn, and how far each time.
fn turns(way: &[(f64, f64)]) -> Vec<(i8, f64)> {
    let mut out: Vec<(i8, f64)> = Vec::new();
    let mut farthest = way[0].1;
    for k in 1..way.len() {
        for (_, angle) in turning_point(way, k).into_iter().chain([way[k]]) {
            let gone = angle - farthest;
            let direction = if gone > 0.0 { 1 } else { -1 };
            match out.last_mut() {
                Some((last, at)) if *last == direction => (*at, farthest) = (angle, angle),
                _ if gone.abs() > DEAD_BAND_RAD => {
                    out.push((direction, angle));
                    farthest = angle;
                }
                _ => {}
            }
        }
    }
    out
}

/// From each share of the way on, from which side each joint comes.
type Turns = Vec<(f64, Sides)>;

/// The sides on which all ways agree.
fn agreed(mut sides: impl Iterator<Item = Sides>) -> Sides {
    let first = sides.next().unwrap_or([0; 6]);
    sides.fold(first, |all, one| std::array::from_fn(|j| if all[j] == one[j] { all[j] } else { 0 }))
}

/// Takes all joints to the end of a motion, by every way that it may go. `ways`: its start and the samples between, along
/// the path and, where it may go so, with a wrist that goes by itself.
fn arrive(start: [Track; 6], reached: &Reached<'_>, ways: &[Sampled]) -> (Turns, [Track; 6]) {
    let (path, straight) = reached.ways();
    let way = ways[0].as_slice();
    let path = path && way.len() > 1;
    let mut found: Option<(Turns, [Track; 6])> = None;
    let mut add = |turns: Turns, end: [Track; 6]| match &mut found {
        None => found = Some((turns, end)),
        Some((_, first)) => {
            for (j, (one, other)) in first.iter_mut().zip(&end).enumerate() {
                if one.side != other.side {
                    one.forget(reached.links.map(|links| links[j]), reached.joints[j]);
                }
                (one.low, one.high) = (one.low.min(other.low), one.high.max(other.high));
            }
        }
    };
    let mut once = |way: &[(f64, Joints)]| {
        let mut tracks = start;
        let turns = follow(&mut tracks, way, reached);
        add(turns, tracks);
    };
    if path {
        ways.iter().for_each(|way| once(way));
    }
    if straight || !path {
        once(&way[..way.len().min(1)]);
    }
    let (turns, mut end) = found.unwrap_or((Vec::new(), start));
    // Targets that are put in make the link go as was meant: it may turn near the end by less than its play.
    if path
        && reached.may_cut
        && let Some(links) = reached.links
    {
        for (joint, (track, begin)) in end.iter_mut().zip(&start).enumerate() {
            let side = side_of_link(begin, way, joint, reached.joints[joint], links[joint]);
            if side.is_some_and(|side| side != track.side) {
                track.forget(Some(links[joint]), reached.joints[joint]);
            }
        }
    }
    (turns, end)
}

/// On which flank each link lies where the circle point is passed: on none of them while a joint that has turned before it
/// takes up its play.
fn passing(mut tracks: [Track; 6], reached: &Reached<'_>, way: &[(f64, Joints)], passes: f64) -> Sides {
    if reached.via.is_none() {
        return [0; 6];
    }
    let mut sides = [0; 6];
    for (joint, track) in tracks.iter_mut().enumerate() {
        let inner = way.iter().map(|(share, joints)| (*share, joints[joint]));
        let angles: Vec<(f64, f64)> = inner.chain([(1.0, reached.joints[joint])]).collect();
        let after = angles.iter().position(|(share, _)| *share >= passes).unwrap_or(angles.len() - 1);
        for k in 0..after {
            for (share, angle) in turning_point(&angles, k).into_iter().chain([angles[k]]) {
                track.go(angle, share);
            }
        }
        let Some(before) = after.checked_sub(1).map(|k| angles[k]) else {
            sides[joint] = track.flank(angles[after].1);
            continue;
        };
        if let Some((share, angle)) = turning_point(&angles, after).filter(|(share, _)| *share <= passes) {
            track.go(angle, share);
        }
        let (from, to) = (before, angles[after]);
        let motor = from.1 + (to.1 - from.1) * (passes - from.0) / (to.0 - from.0).max(f64::EPSILON);
        track.take(motor);
        sides[joint] = track.flank(motor);
    }
    sides
}

/// From which side a link comes to its end that goes along a way as was meant; `None` where it does not turn on the way.
fn side_of_link(begin: &Track, way: &[(f64, Joints)], joint: usize, motor: f64, link: f64) -> Option<i8> {
    if begin.half == 0.0 || way.is_empty() {
        return None;
    }
    let behind = [0.5 * (begin.low + begin.high) - way[0].1[joint], link - motor];
    let links: Vec<(f64, f64)> = way
        .iter()
        .map(|(s, q)| (*s, q[joint] + behind[0] * (1.0 - s) + behind[1] * s))
        .chain([(1.0, link)])
        .collect();
    let mut track = Track { half: 0.0, low: links[0].1, high: links[0].1, farthest: links[0].1, ..*begin };
    track.side = 0;
    let mut turned = false;
    for k in 1..links.len() {
        for (share, angle) in turning_point(&links, k).into_iter().chain([links[k]]) {
            let gone = angle - track.farthest;
            let side = if gone > 0.0 { -1 } else { 1 };
            if track.side == side {
                track.farthest = angle;
            } else if gone.abs() > STILL_RAD {
                turned |= track.side != 0;
                (track.side, track.farthest, track.since) = (side, angle, share);
            }
        }
    }
    turned.then_some(track.side)
}

/// Takes all joints along a way and to its end; hands back where sides changed.
fn follow(tracks: &mut [Track; 6], way: &[(f64, Joints)], reached: &Reached<'_>) -> Turns {
    let mut sides = tracks.map(|t| t.side);
    let mut turned: Vec<(f64, usize, i8)> = Vec::new();
    for (joint, track) in tracks.iter_mut().enumerate() {
        let end = reached.joints[joint];
        let angles: Vec<(f64, f64)> =
            way.iter().map(|(share, joints)| (*share, joints[joint])).chain([(1.0, end)]).collect();
        let mut go = |track: &mut Track, share: f64, angle: f64| {
            if let Some(at) = track.go(angle, share) {
                turned.push((at, joint, track.side));
            }
        };
        for (k, &(share, angle)) in angles.iter().enumerate() {
            if k > 0
                && let Some((share, angle)) = turning_point(&angles, k)
            {
                go(track, share, angle);
            }
            if k + 1 < angles.len() {
                go(track, share, angle);
            }
        }
        let since = track.since;
        let other = match reached.links {
            Some(links) => track.arrive(end, links[joint]),
            None => {
                go(track, 1.0, end);
                track.rest(end)
            }
        };
        if other {
            turned.push((since, joint, track.side));
        }
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut turns = vec![(0.0, sides)];
    for (share, joint, side) in turned {
        sides[joint] = side;
        match turns.last_mut() {
            Some(last) if share - last.0 < 1e-6 => last.1 = sides,
            _ => turns.push((share, sides)),
        }
    }
    turns
}

/// Where between samples k − 1 and k a joint turns: the vertex of a parabola through these two and a neighbour.
fn turning_point(way: &[(f64, f64)], k: usize) -> Option<(f64, f64)> {
    let first = match k {
        _ if way.len() < 3 || k == 0 => return None,
        1 => 0,
        _ => k - 2,
    };
    let [a, b, c] = [way[first], way[first + 1], way[first + 2]];
    // Newton's form: f(s) = f(a) + d1 (s − a) + d2 (s − a)(s − b).
    let d1 = (b.1 - a.1) / (b.0 - a.0);
    let d2 = ((c.1 - b.1) / (c.0 - b.0) - d1) / (c.0 - a.0);
    let vertex = 0.5 * (a.0 + b.0) - 0.5 * d1 / d2;
    let within = vertex > way[k - 1].0 && vertex < way[k].0;
    within.then_some((vertex, a.1 + d1 * (vertex - a.0) + d2 * (vertex - a.0) * (vertex - b.0)))
}

/// Motions that one thread takes at a time.
const PORTION: usize = 64;

/// Points between the ends of all motions.
#[derive(Default)]
struct Samples {
    /// Where those of each motion end.
    ends: Vec<usize>,
    shares: Vec<f64>,
    flanges: Vec<Pose>,
    /// The joints at the start of each motion, and at its end.
    ends_rad: Vec<[Joints; 2]>,
    /// At which share of each motion its circle point is passed.
    passes: Vec<f64>,
}

impl Samples {
    fn range(&self, motion: usize) -> std::ops::Range<usize> {
        let begin = motion.checked_sub(1).map_or(0, |m| self.ends[m]);
        begin..self.ends[motion]
    }

    /// The samples of one motion, so many times as densely as motions are sampled at first.
    fn of(
        &mut self,
        from: Option<&Stop<'_>>,
        stop: &Stop<'_>,
        density: usize,
        mounting: &dyn Fn(usize) -> Mounting,
    ) {
        let mut passes = 0.5;
        if let (Some(Stop::At(from)), Stop::At(to)) = (from, stop)
            && let Some((curve, within)) = path(from, to, mounting)
        {
            passes = to.via.map_or(passes, |via| curve.passes(&via));
            let pieces = (density * pieces_of(&curve)).min(MOST_REFINED);
            for k in 1..pieces {
                let s = k as f64 / pieces as f64;
                self.shares.push(s);
                self.flanges.push(within.flange_for(&curve.at(s)));
            }
        }
        let joints = |stop: Option<&Stop<'_>>| match stop {
            Some(Stop::At(reached)) => reached.joints,
            _ => Joints::zeros(),
        };
        self.ends_rad.push([joints(from), joints(Some(stop))]);
        self.ends.push(self.shares.len());
        self.passes.push(passes);
    }

    /// The joints at the samples of each motion, each reached from the one before; `None` where the arm cannot go along: a joint would
    /// leap, or the way crosses a singularity, as between solutions of two branches it must, however near they lie.
    fn passed(&self, nominal: &Inverse<'_>) -> Vec<Option<Sampled>> {
        let of = |motion: usize| {
            let [start, end] = &self.ends_rad[motion];
            let flanges = &self.flanges[self.range(motion)];
            if flanges.is_empty() {
                return Some(Vec::new());
            }
            let mut out = Vec::with_capacity(flanges.len());
            let mut last = *start;
            if nominal.branch(start) != nominal.branch(end) {
                return None;
            }
            for (k, reached) in self.range(motion).zip(nominal.reach_path(flanges, start)) {
                let joints = reached.ok()?.joints;
                let steady = (joints - last).amax() < MOST_STEP_RAD;
                last = joints;
                steady.then(|| out.push((self.shares[k], joints)))?;
            }
            ((end - last).amax() < MOST_STEP_RAD).then_some(out)
        };
        let motions = self.ends.len();
        let portions = effort::shared_out(
            Allowance::of(effort::SIDES),
            motions.div_ceil(PORTION),
            |portion, allowance| {
                let first = portion * PORTION;
                let here = first..(first + PORTION).min(motions);
                within(allowance, || here.map(of).collect::<Vec<_>>())
            },
        );
        portions.into_iter().flatten().collect()
    }
}

fn pieces_of(curve: &Curve) -> usize {
    let turn = curve.turn_rad().max(curve.arc().map_or(0.0, |arc| arc.sweep));
    pieces(curve.length_mm(), turn)
}

/// Pieces of a path: at least two, so that one sample tells of a joint that turns half way; four and an even number where
/// every other sample must tell the same.
fn pieces(length_mm: f64, turn_rad: f64) -> usize {
    if length_mm < SHORT_MM && turn_rad < SHORT_RAD {
        return 2;
    }
    let wanted = (length_mm / SAMPLE_MM).max(turn_rad / SAMPLE_RAD).ceil();
    (wanted as usize).next_multiple_of(2).clamp(4, MOST_SAMPLES)
}
