//! The program as it is: the joints that each target leads to.
//!
//! A target whose configuration the controller checks says by itself where the arm goes; one whose configuration it does not check
//! is reached from the motion before. Runs of neighbours go together, so that the kinematics runs in lanes; they are cut by count
//! alone, so the result does not depend on the number of threads.

use rayon::prelude::*;

use crate::arms::Arms;
use crate::configuration::{configured, monitored};
use crate::frames::frame_table::Mountings;
use crate::plan::reason::Why;
use crate::risk::placement::Commanded;
use crate::search_budget;
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion, MotionTarget, RobTarget, Switch, TargetValue};

/// Targets along which the program as it is is followed in one go: the first one has no neighbour and costs as much as
/// hundreds of others.
const STRETCH: usize = 4096;

/// A target and the motion to which it belongs.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    pub(crate) index: u32,
    pub(crate) motion: &'a Motion,
    pub(crate) target: &'a MotionTarget,
}

/// What a target means, and the joints that the program as it is leads to.
#[derive(Clone, Copy)]
pub(crate) struct Start {
    pub(crate) mounted: usize,
    pub(crate) meant: Pose,
    pub(crate) joints: Joints,
    /// The branch of the arm.
    pub(crate) cfx: i32,
    /// [`Solved::margins`](crate::target::solved_target::Solved::margins) before.
    pub(crate) margins: [f64; 3],
    pub(crate) guess: Guess,
}

/// Whether joints rest on a guess: where no configuration is checked the controller takes the solution next to where the
/// arm stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Guess {
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
pub(crate) struct AsItIs<'a> {
    /// Where the targets of each motion begin, and the end of the last.
    pub(crate) first: Vec<usize>,
    pub(crate) asked: Vec<Asked<'a>>,
    pub(crate) starts: Starts,
}

impl<'a> AsItIs<'a> {
    pub(crate) fn of(listing: &'a Listing, arms: &Arms<'_>, mountings: &Mountings) -> Self {
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
    pub(crate) fn knows(&self, motion: usize) -> bool {
        self.end(motion).is_some()
    }

    /// The end of a motion under the condition at `place`.
    pub(crate) fn commanded(&self, motion: u32, place: usize) -> Option<Commanded> {
        let Start { mounted, meant, joints, .. } = *self.end(motion as usize)?;
        Some(Commanded { mounted, meant, joints, place })
    }

    fn end(&self, motion: usize) -> Option<&Start> {
        self.starts[self.first[motion]..self.first[motion + 1]].last()?.as_ref().ok()
    }
}

pub(crate) type Starts = Vec<Result<Start, Why>>;

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
        let mut budget = SearchBudget::of(search_budget::STARTS).share(stretch, stretches);
        for run in asked.chunk_by(|a, b| depends(a) == depends(b)) {
            let (here, rest) = out.split_at_mut(run.len());
            out = rest;
            if !depends(&run[0]) {
                along(run, &mut near, arms, mountings, &mut budget, here);
            }
        }
    });
    // Now those that depend on the motion before, in order: a run is what follows each other in the listing.
    let mut budget = SearchBudget::of(search_budget::STARTS);
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
        along(&asked[run.clone()], &mut near, arms, mountings, &mut budget, &mut out[run]);
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
/// at the joints of the last. `budget`: for those that have to be searched for.
fn along(
    asked: &[Asked<'_>],
    near: &mut Option<Near>,
    arms: &Arms<'_>,
    mountings: &Mountings,
    budget: &mut SearchBudget,
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
            let start = with_budget(budget, || start(&asked[at], near.as_ref(), arms, mountings));
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
    for (told, reached) in told.iter().zip(arms.nominal.solve_path_prefix(&flanges, &last.joints)) {
        if told.monitored != Switch::Off && !reached.matches_exactly(&wanted(told.target)) {
            break;
        }
        let (joints, cfx, margins) = (reached.joints, reached.configuration.cfx, reached.margins());
        let guess = last.guess(told.monitored);
        let start = Start { mounted: told.mounted, meant: told.meant, joints, cfx, margins, guess };
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
            let cfx = arms.nominal.configuration(&joints).cfx;
            let guess = match near {
                Some(near) => near.guess(monitored),
                None if monitored == Switch::Off && arms.nominal.all(&flange).len() > 1 => Guess::Here,
                None => Guess::No,
            };
            let margins = arms.nominal.branch_margins(&joints);
            Ok(Start { mounted, meant, joints, cfx, margins, guess })
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            let nominal = arms.nominal.arm();
            if let Some(joint) = nominal.model.limits.violated(&joints) {
                return Err(Why::OutsideLimits { joint });
            }
            let meant = told.target_of(&nominal.forward(&joints));
            let cfx = arms.nominal.configuration(&joints).cfx;
            let margins = arms.nominal.branch_margins(&joints);
            Ok(Start { mounted, meant, joints, cfx, margins, guess: Guess::No })
        }
    }
}
