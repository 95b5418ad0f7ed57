//! Runs the original and the corrected program and compares what the arm does.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::course::{Course, Point, flange, same};
use super::make::{self, Made};
use super::run::{Event, Goal, Motion, Run, Stop};
use crate::arm::{Circumstance, Pose, difference};
use crate::model::{self, Case};
use crate::outcome::{Dialect, Disagreement, Tally};
use crate::play::{meant_flanks, meant_links};
use crate::stated::Stated;
use crate::under_test::{CorrectedTask, Edit, Row, Status, corrected_task};

/// What random programs contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Features {
    /// Functions with effects as arguments.
    pub effects: bool,
    /// Frames that were taught.
    pub taught: bool,
    /// Targets near limits and singularities.
    pub borders: bool,
    /// Displacements that count from where the robot stands, whichever way it came.
    pub placed: bool,
    /// Controllers that count joints the other way round or from the horizontal.
    pub mapped: bool,
    /// Arms on a base that tilts and with an axis that wobbles.
    pub loose: bool,
    /// Motions by routines that do nothing else.
    pub wrapped: bool,
}

impl Features {
    /// Everything but what came later: a seed stands for the same program as ever.
    pub const ALL: Features = Features {
        effects: true,
        taught: true,
        borders: true,
        placed: false,
        mapped: false,
        loose: false,
        wrapped: false,
    };
    /// The same with displacements from where the robot stands.
    pub const MORE: Features = Features { placed: true, ..Features::ALL };

    /// The arm of a seed.
    pub fn arm(&self, seed: u64) -> Case {
        match self {
            Self { mapped: true, .. } => model::mapped(seed),
            Self { loose: true, .. } => model::loose(seed),
            _ => model::random(seed),
        }
    }
}

/// Both programs of a seed, as they are given to the interpreter, with what was seen.
#[derive(Debug)]
pub struct Shown {
    /// The original files.
    pub original: Vec<(String, Vec<u8>)>,
    /// The corrected files.
    pub corrected: Vec<(String, Vec<u8>)>,
    /// What became of each motion.
    pub rows: Vec<Row>,
    /// What was counted.
    pub tally: Tally,
}

/// From this seed on one program in two moves by routines of its own.
const WRAPPED: u64 = 246_600_000;

/// One random program: made, corrected, run, compared.
pub fn run(seed: u64, features: Features) -> Tally {
    shown(seed, features).tally
}

/// The same with both programs.
pub fn shown(seed: u64, features: Features) -> Shown {
    let (mut rng, case, taught) = drawn(seed, features);
    let wrapped = features.wrapped || seed >= WRAPPED && seed.is_multiple_of(2);
    let made = make::program(&mut rng, &case, Features { wrapped, ..features }, taught);
    compare(seed, &case, &made)
}

/// What draws the program of a seed, its arm, and whether its frames were taught.
fn drawn(seed: u64, features: Features) -> (ChaCha8Rng, Case, bool) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Frames that were taught are worked out for an arm that stands where it is told to, play and load apart.
    let taught = features.taught && rng.random_bool(0.12);
    let case = if taught { model::with(seed, false, false) } else { features.arm(seed) };
    (rng, case, taught)
}

/// Compares a program with its correction.
pub fn compare(seed: u64, case: &Case, made: &Made) -> Shown {
    let tally = Tally { programs: 1, ..Tally::default() };
    let mut out = Shown { original: made.files.clone(), corrected: Vec::new(), rows: Vec::new(), tally };
    let files: Vec<(&str, &[u8])> =
        made.files.iter().map(|(name, text)| (name.as_str(), text.as_slice())).collect();
    let wrong = |kind, text| Disagreement { dialect: Dialect::Rapid, seed, line: 0, kind, text };
    let task = match corrected_task(&files, case, &made.cell, &made.options) {
        Ok(task) => task,
        Err(error) => {
            out.tally.disagreements.push(wrong("error", error));
            return out;
        }
    };
    out.rows.clone_from(&task.rows);
    out.corrected = made
        .files
        .iter()
        .zip(&task.files)
        .map(|((name, _), file)| (name.clone(), file.bytes.clone()))
        .collect();
    let old: Vec<&[u8]> = files.iter().map(|file| file.1).collect();
    let new: Vec<&[u8]> = task.files.iter().map(|file| file.bytes.as_slice()).collect();
    let nothing = |_: usize, _: usize| false;
    let inserted = |file: usize, at: usize| original_byte(&task.files[file].edits, at).is_none();
    let (before, after) = match (Run::new(&old, seed, &nothing), Run::new(&new, seed, &inserted)) {
        (Ok(before), Ok(after)) => (before, after),
        (Err(error), _) => {
            out.tally.disagreements.push(wrong("interpreter", error));
            return out;
        }
        (_, Err(error)) => {
            out.tally.disagreements.push(wrong("syntax", error));
            return out;
        }
    };
    let mut both = [before, after];
    both.iter_mut().for_each(|run| run.main(made.cycles));
    let [before, after] = both;
    if let Some(Stop::Unknown(what)) = &before.ended {
        out.tally.disagreements.push(wrong("interpreter", what.clone()));
        return out;
    }
    let mounted = Default::default();
    let tally = out.tally;
    let comparison =
        Comparison { seed, case, made, task: &task, tally, mounted, stopped: false, parted: false };
    out.tally = comparison.run(&before, &after);
    out
}

/// The byte of the original that became a byte of the corrected file; none for what was put in.
fn original_byte(edits: &[Edit], at: usize) -> Option<usize> {
    let mut shift = 0isize;
    for edit in edits {
        if at < edit.new.start {
            break;
        }
        if at < edit.new.end {
            return (at == edit.new.start && !edit.old.is_empty()).then_some(edit.old.start);
        }
        shift = edit.old.end as isize - edit.new.end as isize;
    }
    Some((at as isize + shift) as usize)
}

struct Comparison<'a> {
    seed: u64,
    case: &'a Case,
    made: &'a Made,
    task: &'a CorrectedTask,
    tally: Tally,
    /// Tool and object of the motion before.
    mounted: (String, String),
    /// Whether the corrected program ends at an arc that lay at the very border of what makes one.
    stopped: bool,
    /// Whether the arms of the two runs have parted at a motion that is flagged as a guess: the corrected one stands in
    /// other joints, or the controller has stopped there.
    parted: bool,
}

/// One goal of one motion in both runs.
#[derive(Clone, Copy)]
struct Pair<'p> {
    line: usize,
    old: &'p Motion,
    new: &'p Motion,
    goal: &'p Goal,
    told: &'p Point,
    now: &'p Point,
    index: usize,
    row: Option<&'p Row>,
    /// Whether the motion before had another tool or object.
    remounted: bool,
}

/// What numbers as they are written leave (mm, rad).
const ROUNDING_MM: f64 = 0.004;
const ROUNDING_RAD: f64 = 1e-5;
/// Joints that differ by less (rad) are the same.
const SAME_JOINTS_RAD: f64 = 1e-6;
/// The largest change of a joint (rad) by a correction of millimetres.
const MAX_JUMP: f64 = 0.1;

impl Comparison<'_> {
    fn wrong(&mut self, line: usize, kind: &'static str, text: String) {
        let seed = self.seed;
        self.tally.disagreements.push(Disagreement { dialect: Dialect::Rapid, seed, line, kind, text });
    }

    fn line(&self, at: (usize, usize)) -> usize {
        1 + self.made.files[at.0].1[..at.1].iter().filter(|byte| **byte == b'\n').count()
    }

    /// The row of a motion: that of its statement, or of the call around it whose argument was corrected.
    fn row(&self, motion: &Motion) -> Option<&Row> {
        let of = |at: (usize, usize)| {
            self.task.rows.iter().find(|row| row.file == at.0 && row.statement.contains(&at.1))
        };
        let own = of(motion.at);
        if own.is_some_and(|row| row.status != Status::Left) {
            return own;
        }
        let mut calls = motion.calls.iter().rev().filter_map(|at| of(*at));
        calls.find(|row| own.is_none() || row.status != Status::Left).or(own)
    }

    fn run(mut self, before: &Run<'_>, after: &Run<'_>) -> Tally {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ 0x73696465);
        // Mostly on a flank, as an arm comes to rest.
        let rest = std::array::from_fn(|_| [-1.0, 1.0, rng.random_range(-1.0..1.0)][rng.random_range(0..3)]);
        let mut courses = [Course::new(&self.case.arm, rest), Course::new(&self.case.arm, rest)];
        let mut new = after.events.iter();
        for old in &before.events {
            let mut found = new.next();
            let mut nowhere = None;
            // Motions that were put in.
            while let Some(Event::Motion(motion)) = found {
                let edits = &self.task.files[motion.at.0].edits;
                if original_byte(edits, motion.at.1).is_some() {
                    break;
                }
                let reached = courses[1].go(motion);
                if motion.monitored && reached.iter().any(|point| point.joints.is_none() && !point.adrift) {
                    nowhere = Some(format!("no joints in the written configuration: {motion:?}"));
                }
                found = new.next();
            }
            match (old, found) {
                (Event::Said(a), Some(Event::Said(b))) if a == b => {}
                (Event::Motion(a), Some(Event::Motion(b))) => {
                    let edits = &self.task.files[b.at.0].edits;
                    if (b.at.0, original_byte(edits, b.at.1).unwrap_or(0)) != a.at {
                        let line = self.line(a.at);
                        self.wrong(line, "order", "another motion runs".to_owned());
                        return self.tally;
                    }
                    let goes = self.motion(a, b, &mut courses);
                    if self.stopped {
                        return self.tally;
                    }
                    // Where the original stops as well nothing is lost.
                    if let Some(text) = nowhere.filter(|_| goes) {
                        self.wrong(self.line(a.at), "inserted", text);
                    }
                }
                (old, found) => {
                    let at = if let Event::Motion(m) = old { self.line(m.at) } else { 0 };
                    let text =
                        format!("{old:?} became {found:?}; ended {:?}, {:?}", before.ended, after.ended);
                    self.wrong(at, "events", text.chars().take(900).collect());
                    return self.tally;
                }
            }
        }
        if new.any(|event| !matches!(event, Event::Motion(m) if original_byte(&self.task.files[m.at.0].edits, m.at.1).is_none())) {
            self.wrong(0, "events", "more happens than before".to_owned());
        }
        if before.ended != after.ended {
            self.wrong(0, "end", format!("{:?} became {:?}", before.ended, after.ended));
        }
        let (a, b) = (before.plain_data(), after.plain_data());
        // What a correction wrote out is no longer read.
        if let Some((name, a)) = a.iter().find(|(name, a)| b.get(*name).is_some_and(|b| b != *a)) {
            self.wrong(0, "data", format!("{} = {a} became {}", name.1, b[name]));
        }
        self.tally
    }

    /// Compares a motion; whether the controller can carry out the original.
    fn motion(&mut self, old: &Motion, new: &Motion, courses: &mut [Course<'_>; 2]) -> bool {
        let line = self.line(old.at);
        self.tally.executed += 1;
        let told = courses[0].go(old);
        let now = courses[1].go(new);
        let row = self.row(old).cloned();
        let unlike = |what: &str| format!("{what}: {old:?} became {new:?}");
        let mounted = (old.tool.0.clone(), old.object.0.clone());
        let remounted = std::mem::replace(&mut self.mounted, mounted) != self.mounted;
        let extra = !self.made.options.segments && old.goals.len() != new.goals.len();
        if extra || old.rest != new.rest || old.load != new.load {
            self.wrong(line, "state", unlike("what stands behind the target"));
            return true;
        }
        let tools = difference(&old.tool.2, &new.tool.2).0 + difference(&old.object.2, &new.object.2).0;
        if old.tool.0 != new.tool.0 || (old.object.0 != new.object.0) || tools > 1e-9 {
            self.wrong(line, "state", unlike("tool or object"));
            return true;
        }
        if old.monitored != new.monitored && matches!(new.goals[0], Goal::Pose { .. }) {
            self.wrong(line, "state", unlike("whether the configuration counts"));
            return true;
        }
        if told.iter().any(|point| point.joints.is_none()) {
            self.tally.unreachable += 1;
            return false;
        }
        let (mut changed, guessed) = (false, self.tally.guessed);
        let offset = told.len() - now.len().min(told.len());
        for (k, (goal, point)) in old.goals.iter().zip(&told).enumerate().skip(offset) {
            let now = &now[k - offset];
            let row = row.as_ref();
            changed |= self.goal(&Pair { line, old, new, goal, told: point, now, index: k, row, remounted });
        }
        self.part(told.last(), now.last(), row.as_ref());
        if self.tally.guessed > guessed {
            // Counted apart.
            self.tally.guessed = guessed + 1;
        } else if changed {
            self.tally.corrected += 1;
        } else if row.is_some_and(|row| row.status == Status::Refused) {
            self.tally.refused += 1;
        } else {
            self.tally.left += 1;
        }
        true
    }

    /// Whether the two arms stand apart behind a motion: they part where the corrected one comes elsewhere and the motion is
    /// flagged as a guess, and meet where both come to the same joints again. That the joints are near is not enough: a way beside a
    /// singularity may lead to one wrist from the one and to the other from the other (seed 238001240).
    fn part(&mut self, told: Option<&Point>, now: Option<&Point>, row: Option<&Row>) {
        let joints = |point: Option<&Point>| point.and_then(|point| point.joints);
        let apart = |(a, b): ([f64; 6], [f64; 6])| farthest(&a, &b) > SAME_JOINTS_RAD;
        if !joints(told).zip(joints(now)).is_none_or(apart) {
            self.parted = false;
        } else if row.is_some_and(|row| row.guessed) {
            self.parted = true;
        }
    }

    /// Compares one goal; whether it was changed.
    fn goal(&mut self, pair: &Pair<'_>) -> bool {
        let Pair { line, old, new, goal, told, now, index, row, .. } = *pair;
        let intended = match goal {
            Goal::Joints(q) => {
                if !self.made.options.joint_targets {
                    if new.goals[index] != *goal {
                        self.wrong(line, "joints", format!("{goal:?} became {:?}", new.goals[index]));
                    }
                    return false;
                }
                // The tool stands there as told, and shall really stand there.
                self.meant(old, &in_object(old, &self.case.arm.nominal_forward(q)), &Pose::identity())
            }
            Goal::Pose { in_object, displaced, .. } => self.meant(old, in_object, displaced),
        };
        let as_written = matches!(goal, Goal::Pose { .. })
            == matches!(&new.goals[index.min(new.goals.len() - 1)], Goal::Pose { .. });
        let kept = as_written && same(&told.flange, &now.flange);
        if kept && now.joints.is_some() {
            return false;
        }
        // Where the arm goes on from a guess that was flagged, along a way on which no configuration is checked, only that
        // guess decides whether it gets there: the motion itself stays as it was.
        if kept && self.parted && !old.monitored && now.joints.is_none() {
            // A motion counts once, not each of its points.
            self.tally.open += usize::from(index + 1 == old.goals.len());
            return false;
        }
        let guessed = row.is_some_and(|row| row.guessed);
        let Some(joints) = now.joints else {
            if guessed {
                self.tally.guessed += 1;
                return true;
            }
            // Where an arc starts that is the first motion of a routine, only its callers know.
            if now.no_arc && row.is_some_and(|row| !row.start_known) {
                self.tally.open += usize::from(!self.stopped);
                self.stopped = true;
                return true;
            }
            let text =
                format!("no joints in the written configuration: {:?}, told {:?}", new.goals, told.joints);
            self.wrong(line, "configuration", text);
            return true;
        };
        self.reaches(pair, &joints, &intended);
        if let Some(before) = told.joints {
            let jump = farthest(&joints, &before);
            if jump > MAX_JUMP && guessed {
                self.tally.guessed += 1;
            } else if jump > MAX_JUMP {
                let text = format!(
                    "a joint moves by {:.1}°: {:.3?} became {:.3?}, {:?}",
                    jump.to_degrees(),
                    before.map(f64::to_degrees),
                    joints.map(f64::to_degrees),
                    row.map(|r| (r.status, r.reason.clone()))
                );
                self.wrong(line, "jump", text);
            }
        }
        true
    }

    /// Whether the actual arm comes where it was meant to.
    fn reaches(&mut self, pair: &Pair<'_>, joints: &[f64; 6], intended: &Pose) {
        let Pair { line, old, told, now, index, row, .. } = *pair;
        let arm = &self.case.arm;
        let under = |load: (f64, [f64; 3]), behind| Circumstance {
            behind,
            payload_kg: load.0,
            payload_centre_mm: load.1,
        };
        let at = under(old.load, now.behind);
        let tip = tip(old, intended);
        let off = |q: &[f64; 6], at: &Circumstance| {
            let [there, meant] = [arm.actual_forward(q, at) * tip, intended * tip];
            let (mm, rad) = difference(&there, &meant);
            match now.along.filter(|_| index + 1 < old.goals.len()) {
                Some(along) => {
                    let passed = arm.actual_forward(now.passing.as_ref().unwrap_or(q), at) * tip;
                    let off = passed.translation.vector - meant.translation.vector;
                    ((off - along.into_inner() * along.dot(&off)).norm(), rad)
                }
                None => (mm, rad),
            }
        };
        let (mm, rad) = off(joints, &at);
        let mut stated = Stated::of(row, arm, index + 1 < old.goals.len());
        // Of the path under another tool or work object than before nothing is said.
        if now.turned || now.turned_on_way && pair.remounted {
            stated = stated.of_the_way(row);
        }
        let within = |(mm, rad): (f64, f64), stated: &Stated| {
            mm <= ROUNDING_MM + stated.mm && rad <= ROUNDING_RAD + stated.rad
        };
        if within((mm, rad), &Stated::default()) {
            return;
        }
        // What the report says of the motion is taken at its word, and counted.
        if within((mm, rad), &stated) {
            self.tally.stated += 1;
            return;
        }
        // What is gripped where ways meet is not known: then the tool alone counts, as the report says.
        if old.load != old.tool_load && within(off(joints, &under(old.tool_load, now.behind)), &stated) {
            self.tally.stated += 1;
            return;
        }
        // Behind a motion at which the controller stops the program runs no further until somebody moves the arm.
        let beside = |flange: &Pose| difference(&(flange * tip), &(intended * tip));
        let best = |load| meant_links(arm, joints, &under(load, now.behind), &beside);
        if told.adrift && (within(best(old.load), &stated) || within(best(old.tool_load), &stated)) {
            self.tally.open += 1;
            return;
        }
        // It is right in one of the configurations in which the arm can stand there, and flagged since it may be another.
        let any_way = || {
            let all = arm.nominal_inverse(&told.flange, None);
            let near = all.iter().filter_map(|q| arm.nominal_nearest(&now.flange, q)).collect::<Vec<_>>();
            near.iter().any(|q| within(meant_links(arm, q, &at, &beside), &stated))
        };
        if row.is_some_and(|row| row.guessed) && any_way() {
            self.tally.guessed += 1;
            return;
        }
        let was = told.joints.map_or(f64::NAN, |q| off(&q, &under(old.load, told.behind)).0);
        let play = arm.play.iter().any(|play| *play != 0.0);
        let text = format!(
            "goal {index} is off by {mm:.4} mm, {:.6}° (before {was:.4}, stated {:.4}); {} links {:?} for {:?} load {:?}{}; {:?}; joints \
             {:.3?}",
            rad.to_degrees(),
            stated.mm,
            self.case.robot,
            now.flanks,
            meant_flanks(arm, joints, &at, intended),
            arm.compliance.iter().any(|c| *c != 0.0).then_some(old.load),
            if pair.remounted { ", tool or object changed" } else { "" },
            row.map(|r| (r.status, r.reason.clone(), r.after_mm, r.sigma_mm, r.bend_mm)),
            joints.map(f64::to_degrees)
        );
        self.wrong(line, if play { "wrong-with-play" } else { "wrong" }, text);
    }

    /// The flange that the program means: tools and objects that were taught stand where they really are.
    fn meant(&self, motion: &Motion, in_object: &Pose, displaced: &Pose) -> Pose {
        let mut real = motion.clone();
        if let Some((_, tool)) = self.made.real_tools.iter().find(|t| t.0 == motion.tool.0) {
            real.tool.2 = *tool;
        }
        if let Some((_, user, object)) = self.made.real_objects.iter().find(|t| t.0 == motion.object.0) {
            (real.object.2, real.object.3) = (*user, *object);
        }
        flange(&real, in_object, displaced)
    }
}

/// How far apart the joints are that are farthest apart (rad).
fn farthest(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (0..6).map(|j| (a[j] - b[j]).abs()).fold(0.0, f64::max)
}

/// Where a flange holds the tool in the object, as told.
fn in_object(motion: &Motion, flange: &Pose) -> Pose {
    let (_, _, user, object) = &motion.object;
    let place = (user * object).inverse();
    match (motion.tool.1, motion.object.1) {
        (false, true) => place * flange.inverse() * motion.tool.2,
        _ => place * flange * motion.tool.2,
    }
}

/// The point that counts, on the flange: the tool's, or that of the part at a tool that stands.
fn tip(motion: &Motion, intended: &Pose) -> Pose {
    if motion.tool.1 { motion.tool.2 } else { intended.inverse() * motion.tool.2 }
}
