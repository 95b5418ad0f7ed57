//! Every target worked out: which joints the program as it is leads to, which joints reach what was meant, and what the
//! controller must be told for them.
//!
//! Targets go in blocks, so that the kinematics runs in lanes. First the joints of the program as it is: along runs of
//! neighbours, each from the one before. Then everything else, target by target, each under the condition in which the
//! arm comes there ([`Circumstances`](super::circumstance::Circumstances)). Blocks are cut by count alone, so the result
//! does not depend on the number of threads.
//!
//! Where joints have play, the sides from which they come follow from the motion, and the corrected motion depends on the
//! sides: both are worked out in turn, from the sides of the program as it is, until the sides stay as they are. A side
//! that does not settle counts as not known, and what follows is worked out with that.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::assessment::Assessment;
use super::circumstance::picked;
use super::course::{Course, Reached, Sides, Stop, courses};
use super::deviation::Deviation;
use super::effort;
use super::mountings::Mountings;
use super::payload::Load;
use super::placement::Commanded;
use super::rewrite::{Arms, Circles, Emit, Options, configured, forbidden, may_change, monitored};
use super::segment::Way;
use super::singular::{Replay, at_target};
use super::why::Why;
use truegrind_arm::estimated::{Carried, RidingPoint};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::inverse::effort::{Allowance, within};
use truegrind_arm::model::Joints;
use truegrind_arm::region::{Nearest, Outside};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{
    Listing, Motion, MotionKind, MotionTarget, RobTarget, Role, Switch, TargetValue,
};

/// Motions that one thread takes at a time.
const PORTION: usize = 64;

/// About the memory that a portion keeps (bytes).
const KEPT: usize = 100 << 10;

/// Makes the allocator take the room for a portion from the system at once. Left alone it asks for each few thousand bytes
/// by themselves, and every thread waits while it does.
pub(super) fn take_room() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(KEPT)));
}

/// Targets along which the program as it is is followed in one go: the first one has no neighbour and costs as much as
/// hundreds of others.
const STRETCH: usize = 4096;

/// One target worked out.
#[derive(Debug, Clone)]
pub(super) struct Solved {
    pub(super) mounted: usize,
    pub(super) meant: Pose,
    pub(super) before: Joints,
    pub(super) after: Joints,
    pub(super) told: Pose,
    pub(super) conf_before: Configuration,
    pub(super) conf: Configuration,
    pub(super) deviation_before: Deviation,
    pub(super) deviation_after: Deviation,
    pub(super) sigma_mm: f64,
    /// The same of the shape of its cut, after the best rigid registration; absent outside cuts.
    pub(super) shape_sigma_mm: Option<f64>,
    /// What of either comes from joints whose side is not known (mm).
    pub(super) in_play_mm: f64,
    pub(super) outside: Option<Outside>,
    pub(super) singularity: f64,
    /// [`Inverse::branch_margins`](truegrind_arm::inverse::Inverse::branch_margins) of the nominal arm, before and after.
    pub(super) margins: [[f64; 3]; 2],
    /// Why it must not be written.
    pub(super) forbidden: Option<Why>,
    /// The condition under which the arm comes there.
    pub(super) place: usize,
    /// Whether `before` rests on a guess.
    pub(super) guess: Guess,
}

impl Solved {
    /// How far the commanded position lies from the intended one (mm): what the program's numbers move by.
    pub(super) fn shift_mm(&self) -> f64 {
        (self.told.translation.vector - self.meant.translation.vector).norm()
    }
}

/// The targets of all motions.
pub(super) struct SolvedTargets {
    /// What [`SolvedTargets::forbid`] did: portion and place in it, and what was forbidden there before.
    forbade: Vec<(usize, usize, Option<Why>)>,
    /// Where the targets of each motion begin, and the end of the last.
    first: Vec<usize>,
    /// The targets of so many motions each: one list of all would be copied together once more.
    portions: Vec<Vec<Result<Solved, Why>>>,
    /// The conditions on the way to the end of each motion; empty where no joint has play.
    ways: Vec<Way>,
    /// Motions of which the configuration is not checked and the start not known; not those that go on from there.
    pub(super) guessed: Vec<u32>,
}

impl SolvedTargets {
    /// Forbids that a motion is changed; of no effect where its last target was not worked out.
    pub(super) fn forbid(&mut self, motion: usize, why: Why) {
        let portion = motion / PORTION;
        let end = self.first[motion + 1] - self.first[portion * PORTION];
        if end > 0
            && let Some(Ok(solved)) = self.portions[portion].get_mut(end - 1)
        {
            self.forbade.push((portion, end - 1, solved.forbidden));
            solved.forbidden = Some(why);
        }
    }

    /// Takes back all that [`SolvedTargets::forbid`] did: what was worked out serves another round.
    pub(super) fn allow_again(&mut self) {
        for (portion, place, before) in self.forbade.drain(..).rev() {
            if let Ok(solved) = &mut self.portions[portion][place] {
                solved.forbidden = before;
            }
        }
    }

    /// The targets of one motion; none where the motion must be left.
    pub(super) fn of(&self, motion: usize) -> &[Result<Solved, Why>] {
        let portion = motion / PORTION;
        let begin = self.first[portion * PORTION];
        &self.portions[portion][self.first[motion] - begin..self.first[motion + 1] - begin]
    }

    /// The conditions on the way to the end of a motion, at which the arm comes under `place`.
    pub(super) fn way(&self, motion: usize, place: usize) -> Way {
        self.ways.get(motion).cloned().unwrap_or(Way { first: place, later: Vec::new() })
    }

    /// At how many targets a side is not known, and how far the tool may be off for it at most (mm).
    pub(super) fn in_play(&self) -> (usize, f64) {
        let open = self.portions.iter().flatten().flatten().map(|s| s.in_play_mm).filter(|mm| *mm > 0.0);
        open.fold((0, 0.0), |(count, most), mm| (count + 1, f64::max(most, mm)))
    }
}

/// A target and the motion to which it belongs.
#[derive(Clone, Copy)]
struct Asked<'a> {
    index: u32,
    motion: &'a Motion,
    target: &'a MotionTarget,
}

/// What a target means, and the joints that the program as it is leads to.
#[derive(Clone, Copy)]
struct Start {
    mounted: usize,
    meant: Pose,
    joints: Joints,
    conf: Configuration,
    /// [`Solved::margins`] before.
    margins: [f64; 3],
    guess: Guess,
}

/// Whether joints rest on a guess: where no configuration is checked the controller takes the solution next to where the
/// arm stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guess {
    /// They follow from the text.
    No,
    /// Where the arm stands is not known, and there are other solutions.
    Here,
    /// They go on, unchecked, from joints that were guessed.
    Before,
}

/// Joints that are gone on from.
#[derive(Clone, Copy)]
struct Near {
    joints: Joints,
    /// Whether they rest on a guess.
    guessed: bool,
}

impl Near {
    fn of(start: &Start) -> Self {
        Near { joints: start.joints, guessed: start.guess != Guess::No }
    }

    /// What the guess is for what goes on from here.
    fn guess(&self, monitored: Switch) -> Guess {
        if self.guessed && monitored == Switch::Off { Guess::Before } else { Guess::No }
    }
}

/// The program as it is: the joints that each target leads to.
pub(super) struct AsItIs<'a> {
    /// Where the targets of each motion begin, and the end of the last.
    first: Vec<usize>,
    asked: Vec<Asked<'a>>,
    starts: Starts,
}

impl<'a> AsItIs<'a> {
    pub(super) fn of(listing: &'a Listing, arms: &Arms<'_>, mountings: &Mountings) -> Self {
        let mut first = Vec::with_capacity(listing.motions.len() + 1);
        let mut asked: Vec<Asked<'_>> = Vec::with_capacity(listing.motions.len());
        for (index, motion) in (0..).zip(&listing.motions) {
            first.push(asked.len());
            if motion.left.is_none() {
                asked.extend(motion.targets.iter().map(|target| Asked { index, motion, target }));
            }
        }
        first.push(asked.len());
        let starts = starts(listing, &first, &asked, arms, mountings);
        Self { first, asked, starts }
    }

    /// Whether the end of a motion is known.
    pub(super) fn knows(&self, motion: usize) -> bool {
        self.end(motion).is_some()
    }

    /// The end of a motion under the condition at `place`.
    pub(super) fn commanded(&self, motion: u32, place: usize) -> Option<Commanded> {
        let Start { mounted, meant, joints, .. } = *self.end(motion as usize)?;
        Some(Commanded { mounted, meant, joints, place })
    }

    fn end(&self, motion: usize) -> Option<&Start> {
        self.starts[self.first[motion]..self.first[motion + 1]].last()?.as_ref().ok()
    }
}

/// Works out all targets. `stays`: motions that stay as they are though their targets could be corrected.
pub(super) fn solve_all(
    listing: &Listing,
    program: &AsItIs<'_>,
    arms: &mut Arms<'_>,
    mountings: &Mountings,
    assessment: &Assessment,
    options: &Options,
    stays: &BTreeMap<u32, Why>,
) -> SolvedTargets {
    let AsItIs { first, asked, starts } = program;
    Work { listing, first, asked, starts, mountings, assessment, options, stays }.solve(arms)
}

/// What all targets are worked out from.
struct Work<'a> {
    listing: &'a Listing,
    first: &'a [usize],
    asked: &'a [Asked<'a>],
    starts: &'a [Result<Start, Why>],
    mountings: &'a Mountings,
    assessment: &'a Assessment,
    options: &'a Options,
    stays: &'a BTreeMap<u32, Why>,
}

/// How often sides and motion are worked out in turn before a side that still changes is called unknown.
const ROUNDS: usize = 4;

/// How often they are worked out at most.
const MOST_ROUNDS: usize = 24;

impl Work<'_> {
    fn solve(self, arms: &mut Arms<'_>) -> SolvedTargets {
        let count = self.listing.motions.len();
        let loads = arms.loads(self.listing, self.options.loads.as_ref());
        let load = |motion: usize| loads.get(motion).and_then(Option::as_ref);
        if !arms.acting.has_play() {
            let places: Vec<usize> = if loads.iter().all(Option::is_none) {
                let only = arms.acting.place([0; 6], None);
                vec![only; self.asked.len()]
            } else {
                let motions = (0..count).flat_map(|m| (self.first[m]..self.first[m + 1]).map(move |_| m));
                motions.map(|m| arms.acting.place([0; 6], load(m))).collect()
            };
            let portions = self.portions(arms, &places, &places, None);
            let guessed = self.guessed();
            return SolvedTargets {
                forbade: Vec::new(),
                first: self.first.to_vec(),
                portions,
                ways: Vec::new(),
                guessed,
            };
        }
        let mut doubted: Vec<[bool; 6]> = vec![[false; 6]; count];
        let as_is = self.sides(arms, None, &doubted);
        let before = self.places(arms, &as_is, &load);
        let mut sides = as_is;
        let mut places = before.clone();
        let mut portions = self.portions(arms, &before, &places, None);
        for round in 1..=MOST_ROUNDS {
            let next = self.sides(arms, Some(&portions), &doubted);
            if round > ROUNDS {
                // What still goes to and fro is not known.
                for (doubted, (next, last)) in doubted.iter_mut().zip(next.iter().zip(&sides)) {
                    (0..6).for_each(|j| doubted[j] |= next.end[j] != last.end[j]);
                }
            }
            sides = if round > ROUNDS { self.sides(arms, Some(&portions), &doubted) } else { next };
            let new = self.places(arms, &sides, &load);
            if new == places {
                break;
            }
            let stale: Vec<bool> = (0..count)
                .step_by(PORTION)
                .map(|begin| {
                    let targets = self.targets(begin);
                    new[targets.clone()] != places[targets]
                })
                .collect();
            places = new;
            let fresh = self.portions(arms, &before, &places, Some(&stale));
            for ((portion, fresh), stale) in portions.iter_mut().zip(fresh).zip(stale) {
                if stale {
                    *portion = fresh;
                }
            }
        }
        let ways = sides.iter().enumerate().map(|(m, course)| {
            let mut later =
                course.turns.iter().map(|(share, sides)| (*share, arms.acting.place(*sides, load(m))));
            let first = later.next().map(|turn| turn.1);
            let later: Vec<(f64, usize)> = later.collect();
            Way { first: first.unwrap_or_else(|| arms.acting.place(course.end, load(m))), later }
        });
        let ways = ways.collect();
        let guessed = self.guessed();
        SolvedTargets { forbade: Vec::new(), first: self.first.to_vec(), portions, ways, guessed }
    }

    /// Motions of which a target was reached by guess.
    fn guessed(&self) -> Vec<u32> {
        let guessed = |m: &usize| {
            self.starts[self.first[*m]..self.first[m + 1]]
                .iter()
                .flatten()
                .any(|start| start.guess == Guess::Here)
        };
        (0..self.listing.motions.len()).filter(guessed).map(|m| m as u32).collect()
    }

    /// The targets of the portion that begins with a motion.
    fn targets(&self, begin: usize) -> std::ops::Range<usize> {
        self.first[begin]..self.first[(begin + PORTION).min(self.listing.motions.len())]
    }

    /// All targets, `before` under the conditions of the program as it is, or those portions that are `stale`.
    fn portions(
        &self,
        arms: &Arms<'_>,
        before: &[usize],
        places: &[usize],
        stale: Option<&[bool]>,
    ) -> Vec<Vec<Result<Solved, Why>>> {
        let whole = Allowance::of(effort::TARGETS);
        effort::shared_out(whole, self.listing.motions.len().div_ceil(PORTION), |portion, allowance| {
            if stale.is_some_and(|stale| !stale[portion]) {
                return Vec::new();
            }
            take_room();
            let targets = self.targets(portion * PORTION);
            let places = [&before[targets.clone()], &places[targets.clone()]];
            let (asked, starts) = (&self.asked[targets.clone()], &self.starts[targets]);
            within(allowance, || finish(asked, starts, places, arms, self))
        })
    }

    /// The sides along the program: as it is, or as rewritten.
    fn sides(
        &self,
        arms: &Arms<'_>,
        solved: Option<&[Vec<Result<Solved, Why>>]>,
        doubted: &[[bool; 6]],
    ) -> Vec<Course> {
        let motions = &self.listing.motions;
        let stop = |m: usize| {
            let motion = &motions[m];
            if motion.kind == MotionKind::External {
                return Stop::Stays;
            }
            let stays = self.stays.contains_key(&(m as u32));
            let rewritten = solved.filter(|_| may_change(motion, self.options) && !stays);
            let begin = self.first[m / PORTION * PORTION];
            let targets = self.first[m]..self.first[m + 1];
            let solved = |target: usize| match rewritten?[m / PORTION].get(target - begin)? {
                Ok(solved) if solved.forbidden.is_none() => Some(solved),
                _ => None,
            };
            // A motion of which a target is refused stays as it is.
            let changes = targets.clone().all(|target| solved(target).is_some());
            // What the controller is told, and the joints there.
            let at = |target: usize| match solved(target).filter(|_| changes) {
                Some(solved) => {
                    let links = arms.acting.links(solved.place, &solved.after);
                    Some((solved.mounted, solved.told, solved.after, Some(links)))
                }
                None => self.starts[target].as_ref().ok().map(|s| (s.mounted, s.meant, s.joints, None)),
            };
            let role = |target: &usize| self.asked[*target].target.role;
            let Some((mounted, told, joints, links)) =
                targets.clone().rev().find(|t| role(t) == Role::To).and_then(at)
            else {
                return Stop::Lost;
            };
            let via = targets.clone().find(|t| role(t) == Role::Via).and_then(at).map(|via| via.1);
            let straightens = motion.straightens && self.options.circles == Circles::Segments;
            let as_joints = changes && motion.to().is_some_and(|to| as_joints(motion, to, self.options.emit));
            let may_cut = motion.insertable || straightens;
            Stop::At(Reached { motion, mounted, told, joints, via, links, as_joints, may_cut })
        };
        let stops: Vec<Stop<'_>> = (0..motions.len()).map(stop).collect();
        let before: Vec<Option<u32>> = motions.iter().map(|m| m.previous).collect();
        let told = |mounted: usize| self.mountings.list[mounted].told;
        courses(&stops, &before, &arms.nominal, &arms.acting.play_rad, &told, doubted)
    }

    /// The condition of each target.
    fn places<'l>(
        &self,
        arms: &mut Arms<'_>,
        sides: &[Course],
        load: &dyn Fn(usize) -> Option<&'l Load>,
    ) -> Vec<usize> {
        let mut out = Vec::with_capacity(self.asked.len());
        for (m, course) in sides.iter().enumerate() {
            for target in self.first[m]..self.first[m + 1] {
                let sides: Sides = match self.asked[target].target.role {
                    Role::Via => course.via,
                    Role::To => course.end,
                };
                out.push(arms.acting.place(sides, load(m)));
            }
        }
        out
    }
}

// ---- the program as it is ----

type Starts = Vec<Result<Start, Why>>;

/// The joints of the program as it is. A target whose configuration the controller checks says by itself where the arm
/// goes; one whose configuration it does not check is reached from the motion before.
fn starts(
    listing: &Listing,
    first: &[usize],
    asked: &[Asked<'_>],
    arms: &Arms<'_>,
    mountings: &Mountings,
) -> Starts {
    let depends = |asked: &Asked<'_>| monitored(asked.motion) == Switch::Off;
    // A place holder for those that depend on the motion before.
    let mut out: Starts = asked.par_iter().map(|_| Err(Why::JointTarget)).collect();
    let stretches = asked.len().div_ceil(STRETCH);
    let each = out.par_chunks_mut(STRETCH).zip(asked.par_chunks(STRETCH)).enumerate();
    each.for_each(|(stretch, (mut out, asked))| {
        let mut near = None;
        let mut allowance = Allowance::of(effort::STARTS).part(stretch, stretches);
        for run in asked.chunk_by(|a, b| depends(a) == depends(b)) {
            let (here, rest) = out.split_at_mut(run.len());
            out = rest;
            if !depends(&run[0]) {
                along(run, &mut near, arms, mountings, &mut allowance, here);
            }
        }
    });
    // Now those that depend on the motion before, in order: a run is what follows each other in the listing.
    let mut allowance = Allowance::of(effort::STARTS);
    let mut motion = 0;
    while motion < listing.motions.len() {
        let chained =
            |m: usize| listing.motions[m].left.is_none() && monitored(&listing.motions[m]) == Switch::Off;
        if !chained(motion) {
            motion += 1;
            continue;
        }
        let mut end = motion + 1;
        while end < listing.motions.len()
            && chained(end)
            && listing.motions[end].previous == Some(end as u32 - 1)
            && end - motion < STRETCH
        {
            end += 1;
        }
        let previous = listing.motions[motion].previous.map(|p| p as usize);
        let mut near = previous.and_then(|p| {
            let reached = &out[first[p]..first[p + 1]];
            reached.last().and_then(|start| start.as_ref().ok().map(Near::of))
        });
        let run = first[motion]..first[end];
        along(&asked[run.clone()], &mut near, arms, mountings, &mut allowance, &mut out[run]);
        motion = end;
    }
    guess_unsure(listing, asked, first, arms, mountings, &mut out);
    out
}

/// Where a configuration may be checked or not, by the way on which the program comes there, it is guessed as where it is not: from a
/// start that the text does not tell, or that is guessed itself.
fn guess_unsure(
    listing: &Listing,
    asked: &[Asked<'_>],
    first: &[usize],
    arms: &Arms<'_>,
    mountings: &Mountings,
    out: &mut Starts,
) {
    for (index, motion) in listing.motions.iter().enumerate() {
        if motion.left.is_some() || monitored(motion) != Switch::Either {
            continue;
        }
        let before = match motion.previous.map(|previous| previous as usize) {
            None => Some(Guess::Here),
            Some(previous) => match out[first[previous]..first[previous + 1]].last() {
                Some(Ok(start)) => (start.guess != Guess::No).then_some(Guess::Before),
                _ => Some(Guess::Here),
            },
        };
        let Some(guess) = before else { continue };
        for at in first[index]..first[index + 1] {
            let several = || {
                Told::of(&asked[at], mountings).is_some_and(|told| arms.nominal.all(&told.flange).len() > 1)
            };
            if let Ok(start) = &mut out[at]
                && several()
            {
                start.guess = guess;
            }
        }
    }
}

/// Shortest and longest run of targets that are taken together.
const RUNS: [usize; 2] = [8, 64];

/// The starts of targets that follow each other. `near`: the joints from which the first one is reached, if known; left
/// at the joints of the last. `allowance`: for those that have to be searched for.
fn along(
    asked: &[Asked<'_>],
    near: &mut Option<Near>,
    arms: &Arms<'_>,
    mountings: &Mountings,
    allowance: &mut Allowance,
    out: &mut [Result<Start, Why>],
) {
    let mut at = 0;
    let mut run = RUNS[0];
    while at < asked.len() {
        let here = &asked[at..(at + run).min(asked.len())];
        let whole = match near {
            Some(last) => {
                let cartesian: Vec<Told<'_>> =
                    here.iter().map_while(|asked| Told::of(asked, mountings)).collect();
                let taken = together(&cartesian, last, arms, &mut out[at..]);
                at += taken;
                taken == here.len()
            }
            None => false,
        };
        if whole {
            run = (2 * run).min(RUNS[1]);
            continue;
        }
        run = RUNS[0];
        if at < asked.len() {
            let start = within(allowance, || start(&asked[at], near.as_ref(), arms, mountings));
            match &start {
                Ok(start) => *near = Some(Near::of(start)),
                // What goes on from there does not go on from the one before.
                Err(_) if monitored(asked[at].motion) == Switch::Off => *near = None,
                Err(_) => {}
            }
            out[at] = start;
            at += 1;
        }
    }
}

/// A Cartesian target with the pose of the flange that the controller computes.
struct Told<'a> {
    target: &'a RobTarget,
    monitored: Switch,
    mounted: usize,
    meant: Pose,
    flange: Pose,
}

impl<'a> Told<'a> {
    fn of(asked: &Asked<'a>, mountings: &Mountings) -> Option<Self> {
        let Ok(TargetValue::Cartesian(target)) = &asked.target.value else { return None };
        let mounted = mountings.of_motion(asked.motion).ok()?;
        if mountings.moving_base(target).is_some() {
            return None;
        }
        let meant = target.pose();
        let flange = mountings.list[mounted].told.flange_for(&meant);
        Some(Self { target, monitored: monitored(asked.motion), mounted, meant, flange })
    }
}

fn wanted(target: &RobTarget) -> Configuration {
    let [cf1, cf4, cf6, cfx] = target.conf;
    Configuration { cf1, cf4, cf6, cfx }
}

/// Goes from `last` along targets as far as they are reached in the configurations that they state; hands back how many
/// were, and leaves `last` at the joints of the last of them.
fn together(told: &[Told<'_>], last: &mut Near, arms: &Arms<'_>, out: &mut [Result<Start, Why>]) -> usize {
    if told.is_empty() {
        return 0;
    }
    let flanges: Vec<Pose> = told.iter().map(|t| t.flange).collect();
    let mut taken = 0;
    // One that has to be searched for is started by itself.
    for (told, reached) in told.iter().zip(arms.nominal.reach_path_easily(&flanges, &last.joints)) {
        if told.monitored != Switch::Off && !reached.is_of(&wanted(told.target)) {
            break;
        }
        let (joints, conf, margins) = (reached.joints, reached.configuration, reached.margins());
        let guess = last.guess(told.monitored);
        let start = Start { mounted: told.mounted, meant: told.meant, joints, conf, margins, guess };
        *last = Near::of(&start);
        out[taken] = Ok(start);
        taken += 1;
    }
    taken
}

/// One target by itself.
fn start(
    asked: &Asked<'_>,
    near: Option<&Near>,
    arms: &Arms<'_>,
    mountings: &Mountings,
) -> Result<Start, Why> {
    let value = asked.target.value.map_err(Why::Program)?;
    let mounted = mountings.of_motion(asked.motion)?;
    let told = &mountings.list[mounted].told;
    match value {
        TargetValue::Cartesian(t) => {
            if let Some(why) = mountings.moving_base(&t) {
                return Err(why);
            }
            let meant = t.pose();
            let flange = told.flange_for(&meant);
            let monitored = monitored(asked.motion);
            let joints = configured(&arms.nominal, &flange, &t, monitored, near.map(|near| &near.joints))?;
            let conf = arms.nominal.configuration(&joints);
            let guess = match near {
                Some(near) => near.guess(monitored),
                None if monitored == Switch::Off && arms.nominal.all(&flange).len() > 1 => Guess::Here,
                None => Guess::No,
            };
            let margins = arms.nominal.branch_margins(&joints);
            Ok(Start { mounted, meant, joints, conf, margins, guess })
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            let nominal = arms.nominal.arm();
            if let Some(joint) = nominal.model.limits.violated(&joints) {
                return Err(Why::OutsideLimits { joint });
            }
            let meant = told.target_of(&nominal.forward(&joints));
            let conf = arms.nominal.configuration(&joints);
            let margins = arms.nominal.branch_margins(&joints);
            Ok(Start { mounted, meant, joints, conf, margins, guess: Guess::No })
        }
    }
}

// ---- the corrected program ----

/// The rest of the work on one portion of targets.
fn finish(
    asked: &[Asked<'_>],
    starts: &[Result<Start, Why>],
    places: [&[usize]; 2],
    arms: &Arms<'_>,
    work: &Work<'_>,
) -> Vec<Result<Solved, Why>> {
    let Work { mountings, assessment, options, .. } = *work;
    let acting = &arms.acting;
    // A place holder for those on their way.
    let waiting = |start: &Result<Start, Why>| Err(start.as_ref().err().copied().unwrap_or(Why::JointTarget));
    let mut out: Vec<Result<Solved, Why>> = starts.iter().map(waiting).collect();
    let way = on_their_way(starts, places, arms, mountings, &mut out);
    let joint_form = |w: &OnItsWay| as_joints(asked[w.index].motion, asked[w.index].target, options.emit);
    let Replayed { told_flanges, told, heard, branches, last, failed } =
        replayed(&way, &joint_form, arms, mountings, options);
    let real = |start: &Start| &mountings.list[start.mounted].real;
    let places: Vec<usize> = way.iter().map(|w| w.place).collect();
    let reached_after = acting.forward(&places, &last);
    let tools: Vec<Pose> = way.iter().map(|w| real(&w.start).flange_from_tool(&w.flange)).collect();
    let cut_of = |w: &OnItsWay| asked[w.index].index;
    let frames = way.iter().map(|w| Some(mountings.list[w.start.mounted].carried.as_ref())).collect();
    let absolute = sigmas(&way, &tools, frames, arms);
    let registered = way.iter().map(|w| assessment.registered(cut_of(w)).map(Some)).collect();
    let of_shape = sigmas(&way, &tools, registered, arms);
    let mut near = Nearest::default();
    for (k, w) in way.iter().enumerate() {
        if let Some(why) = failed[k] {
            out[w.index] = Err(why);
            continue;
        }
        let real = real(&w.start);
        let meant = w.start.meant;
        let in_object = |reached: &Pose| Deviation::between(&meant, reached, &Pose::identity(), None);
        let in_play_mm = acting.in_play_mm(w.place, &w.after, &tools[k]);
        let (conf, margins) = branches[k];
        let mut solved = Solved {
            mounted: w.start.mounted,
            meant,
            before: w.start.joints,
            after: w.after,
            told: told[k],
            conf_before: w.start.conf,
            conf,
            margins: [w.start.margins, margins],
            deviation_before: in_object(&w.reached_before),
            deviation_after: in_object(&real.target_of(&reached_after[k])),
            sigma_mm: absolute[k].unwrap_or(0.0).hypot(in_play_mm),
            shape_sigma_mm: of_shape[k]
                .or_else(|| assessment.sigma_of_cut_mm(cut_of(w)))
                .map(|sigma| sigma.hypot(in_play_mm)),
            in_play_mm,
            place: w.place,
            guess: w.start.guess,
            outside: arms.knowledge.and_then(|k| k.region.outside_near(&w.after, &mut near)),
            singularity: w.singularity,
            forbidden: None,
        };
        solved.forbidden = forbidden(&solved, arms, options).or_else(|| {
            let told = &mountings.list[solved.mounted].told;
            let flanges = [told.flange_for(&meant), told_flanges[k]];
            let stated = if joint_form(w) { None } else { stated(&asked[w.index]) };
            let replay = Replay { flanges, heard: &heard[k], joints: &last[k], stated };
            at_target(&solved, &replay, arms, options)
        });
        out[w.index] = Ok(solved);
    }
    out
}

/// The targets for which joints were found that reach what was meant; the others say in `out` why not.
fn on_their_way(
    starts: &[Result<Start, Why>],
    places: [&[usize]; 2],
    arms: &Arms<'_>,
    mountings: &Mountings,
    out: &mut [Result<Solved, Why>],
) -> Vec<OnItsWay> {
    let acting = &arms.acting;
    let open: Vec<(usize, Start)> =
        starts.iter().enumerate().filter_map(|(index, start)| Some((index, *start.as_ref().ok()?))).collect();
    let before: Vec<Joints> = open.iter().map(|(_, s)| s.joints).collect();
    let real = |start: &Start| &mountings.list[start.mounted].real;
    let flanges: Vec<Pose> = open.iter().map(|(_, s)| real(s).flange_for(&s.meant)).collect();
    let [places_before, places] = places.map(|all| open.iter().map(|(k, _)| all[*k]).collect::<Vec<usize>>());
    let reached_before = acting.forward(&places_before, &before);
    let solutions = acting.each(&places, |place, items| match items {
        None => acting.inverse(place).solve_beside(&flanges, &before),
        Some(items) => acting.inverse(place).solve_beside(&picked(&flanges, items), &picked(&before, items)),
    });
    let mut way: Vec<OnItsWay> = Vec::with_capacity(open.len());
    for (k, ((index, start), solution)) in open.iter().zip(solutions).enumerate() {
        match solution {
            Ok(solution) => way.push(OnItsWay {
                index: *index,
                start: *start,
                place: places[k],
                flange: flanges[k],
                after: solution.joints,
                singularity: solution.singularity,
                reached_before: real(start).target_of(&reached_before[k]),
            }),
            Err(error) => out[*index] = Err(Why::of_inverse(error)),
        }
    }
    way
}

/// What the controller is told, and where it goes when the told numbers are rounded.
struct Replayed {
    told_flanges: Vec<Pose>,
    told: Vec<Pose>,
    /// The flanges of the rounded numbers.
    heard: Vec<Pose>,
    /// Configuration and margins of what it makes of them.
    branches: Vec<(Configuration, [f64; 3])>,
    /// Its joints.
    last: Vec<Joints>,
    failed: Vec<Option<Why>>,
}

fn replayed(
    way: &[OnItsWay],
    joint_form: &dyn Fn(&OnItsWay) -> bool,
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
) -> Replayed {
    let after: Vec<Joints> = way.iter().map(|w| w.after).collect();
    let told_flanges = arms.nominal.arm().forward_many(&after);
    let mounting = |w: &OnItsWay| &mountings.list[w.start.mounted].told;
    let told: Vec<Pose> =
        way.iter().zip(&told_flanges).map(|(w, flange)| mounting(w).target_of(flange)).collect();
    let hears =
        |(w, told): (&OnItsWay, &Pose)| mounting(w).flange_for(&rounded(told, options.position_decimals));
    let heard: Vec<Pose> = way.iter().zip(&told).map(hears).collect();
    let reached =
        if way.iter().all(joint_form) { Vec::new() } else { arms.nominal.reach_seeded(&heard, &after) };
    let mut last: Vec<Joints> = Vec::with_capacity(way.len());
    let mut branches = Vec::with_capacity(way.len());
    let mut failed: Vec<Option<Why>> = vec![None; way.len()];
    let of_joints =
        |joints: &Joints| (arms.nominal.configuration(joints), arms.nominal.branch_margins(joints));
    for (k, w) in way.iter().enumerate() {
        let (joints, branch) = match reached.get(k).filter(|_| !joint_form(w)) {
            Some(Ok(reached)) => (reached.joints, (reached.configuration, reached.margins())),
            Some(Err(error)) => {
                failed[k] = Some(Why::of_inverse(*error));
                (w.after, of_joints(&w.after))
            }
            None => (w.after, of_joints(&w.after)),
        };
        last.push(joints);
        branches.push(branch);
    }
    Replayed { told_flanges, told, heard, branches, last, failed }
}

/// How well each point is known (mm) against what it is measured from; `None` where that is not asked for.
fn sigmas(
    way: &[OnItsWay],
    tools: &[Pose],
    against: Vec<Option<Option<&Carried>>>,
    arms: &Arms<'_>,
) -> Vec<Option<f64>> {
    let Some(knowledge) = arms.knowledge else { return vec![None; way.len()] };
    let (mut places, mut points) = (Vec::with_capacity(way.len()), Vec::with_capacity(way.len()));
    let mut at = Vec::with_capacity(way.len());
    for ((k, w), carried) in way.iter().enumerate().zip(against) {
        let Some(carried) = carried else { continue };
        points.push(RidingPoint { joints: w.after, flange_from_tool: tools[k], carried });
        places.push(w.place);
        at.push(k);
    }
    let found = arms.acting.each(&places, |place, items| match items {
        None => knowledge.position_sigmas_mm(arms.acting.arm(place), &points),
        Some(items) => knowledge.position_sigmas_mm(arms.acting.arm(place), &picked(&points, items)),
    });
    let mut out = vec![None; way.len()];
    at.into_iter().zip(found).for_each(|(k, sigma)| out[k] = Some(sigma));
    out
}

/// Whether a target is written as joints.
pub(super) fn as_joints(motion: &Motion, target: &MotionTarget, emit: Emit) -> bool {
    let may = target.role == Role::To && motion.kind != MotionKind::Circular;
    matches!(target.value, Ok(TargetValue::Joint(_))) || (emit == Emit::Joints && may)
}

/// The target, where the controller may go by the configuration that it states.
fn stated<'a>(asked: &Asked<'a>) -> Option<&'a RobTarget> {
    let Ok(TargetValue::Cartesian(target)) = &asked.target.value else { return None };
    (monitored(asked.motion) != Switch::Off).then_some(target)
}

/// A target whose joints are found.
struct OnItsWay {
    index: usize,
    start: Start,
    place: usize,
    flange: Pose,
    after: Joints,
    singularity: f64,
    reached_before: Pose,
}

/// A pose as it will be read back: positions with so many decimals, quaternions with seven.
fn rounded(pose: &Pose, decimals: u8) -> Pose {
    let scale = 10f64.powi(i32::from(decimals));
    let position = pose.translation.vector.map(|v| (v * scale).round() / scale);
    let q = pose.rotation.quaternion().coords.map(|v| (v * 1e7).round() / 1e7);
    Pose::from_parts(
        position.into(),
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_vector(q)),
    )
}
