//! Every target worked out: which joints reach what was meant, and what the controller must be told for them.
//!
//! The joints of the program as it is are there already ([`AsItIs`]). From them target by target, each under the
//! condition in which the arm comes there ([`Circumstances`](crate::condition::arm_conditions::Circumstances)), in blocks, so that
//! the kinematics runs in lanes. Blocks are cut by count alone, so the result does not depend on the number of threads.
//!
//! Where joints have play, the sides from which they come follow from the motion, and the corrected motion depends on the
//! sides: both are worked out in turn, from the sides of the program as it is, until the sides stay as they are. A side
//! that does not settle counts as not known, and what follows is worked out with that.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::arms::Arms;
use crate::backlash::sides::{Course, Reached, Sides, Stop, courses};
use crate::condition::arm_conditions::picked;
use crate::condition::payload::Load;
use crate::configuration::monitored;
use crate::deviation::Deviation;
use crate::feasibility::correction_bounds::forbidden;
use crate::feasibility::singularity::{Replay, at_target};
use crate::frames::frame_table::Mountings;
use crate::options::{Circles, Options, may_change};
use crate::plan::reason::Why;
use crate::risk::assessment::Assessment;
use crate::search_budget;
use crate::segment::condition_schedule::Way;
use crate::target::original_joints::{AsItIs, Asked, Guess, Start};
use crate::target::solved_target::{PORTION, Solved, SolvedTargets, as_joints};
use truegrind_arm::estimated::{FlangePoint, RegisteredFrame};
use truegrind_arm::inverse::budget::{SearchBudget, with_budget};
use truegrind_arm::inverse::configuration::Configuration;
use truegrind_arm::model::Joints;
use truegrind_arm::region::NearestSample;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, MotionKind, RobTarget, Role, Switch, TargetValue};

/// About the memory that a portion keeps (bytes).
const KEPT: usize = 100 << 10;

/// Makes the allocator take the room for a portion from the system at once. Left alone it asks for each few thousand bytes
/// by themselves, and every thread waits while it does.
pub(crate) fn take_room() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(KEPT)));
}

/// Works out all targets. `stays`: motions that stay as they are though their targets could be corrected.
pub(crate) fn solve_all(
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
            let mut targets = self.unsolved();
            self.fill(&mut targets, arms, &places, &places, None);
            return self.solved(targets, Vec::new());
        }
        let mut doubted: Vec<[bool; 6]> = vec![[false; 6]; count];
        let as_is = self.sides(arms, None, &doubted);
        let before = self.places(arms, &as_is, &load);
        let mut sides = as_is;
        let mut places = before.clone();
        let mut targets = self.unsolved();
        self.fill(&mut targets, arms, &before, &places, None);
        for round in 1..=MOST_ROUNDS {
            let next = self.sides(arms, Some(&targets), &doubted);
            if round > ROUNDS {
                // What still goes to and fro is not known.
                for (doubted, (next, last)) in doubted.iter_mut().zip(next.iter().zip(&sides)) {
                    (0..6).for_each(|j| doubted[j] |= next.end[j] != last.end[j]);
                }
            }
            sides = if round > ROUNDS { self.sides(arms, Some(&targets), &doubted) } else { next };
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
            self.fill(&mut targets, arms, &before, &places, Some(&stale));
        }
        let ways = sides.iter().enumerate().map(|(m, course)| {
            let mut later =
                course.turns.iter().map(|(share, sides)| (*share, arms.acting.place(*sides, load(m))));
            let first = later.next().map(|turn| turn.1);
            let later: Vec<(f64, usize)> = later.collect();
            Way { first: first.unwrap_or_else(|| arms.acting.place(course.end, load(m))), later }
        });
        let ways = ways.collect();
        self.solved(targets, ways)
    }

    fn solved(&self, targets: Vec<Result<Solved, Why>>, ways: Vec<Way>) -> SolvedTargets {
        let unreached = self.unreached(&targets);
        let guessed = self.guessed();
        SolvedTargets { forbade: Vec::new(), first: self.first.to_vec(), targets, ways, unreached, guessed }
    }

    /// The starts of motions of which a target failed though all are known as the program is.
    fn unreached(&self, solved: &[Result<Solved, Why>]) -> BTreeMap<u32, Vec<Start>> {
        let starts = |motion: usize| {
            let targets = self.first[motion]..self.first[motion + 1];
            let failed = solved[targets.clone()].iter().any(Result::is_err);
            let starts = || self.starts[targets].iter().cloned().collect::<Result<_, _>>().ok();
            Some((motion as u32, failed.then(starts)??))
        };
        (0..self.listing.motions.len()).filter_map(starts).collect()
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

    /// A place for each target.
    fn unsolved(&self) -> Vec<Result<Solved, Why>> {
        self.asked.par_iter().map(|_| Err(Why::JointTarget)).collect()
    }

    /// All targets, `before` under the conditions of the program as it is, or those portions that are `stale`.
    fn fill(
        &self,
        solved: &mut [Result<Solved, Why>],
        arms: &Arms<'_>,
        before: &[usize],
        places: &[usize],
        stale: Option<&[bool]>,
    ) {
        let mut rest = solved;
        let mut portions: Vec<&mut [Result<Solved, Why>]> = Vec::new();
        for begin in (0..self.listing.motions.len()).step_by(PORTION) {
            let (here, after) = rest.split_at_mut(self.targets(begin).len());
            portions.push(here);
            rest = after;
        }
        let whole = SearchBudget::of(search_budget::TARGETS);
        search_budget::shared_out_into(whole, &mut portions, |portion, solved, budget| {
            if stale.is_some_and(|stale| !stale[portion]) {
                return;
            }
            take_room();
            let targets = self.targets(portion * PORTION);
            let places = [&before[targets.clone()], &places[targets.clone()]];
            let (asked, starts) = (&self.asked[targets.clone()], &self.starts[targets]);
            with_budget(budget, || finish(asked, starts, places, arms, self, solved));
        });
    }

    /// The sides along the program: as it is, or as rewritten.
    fn sides(
        &self,
        arms: &Arms<'_>,
        solved: Option<&[Result<Solved, Why>]>,
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
            let targets = self.first[m]..self.first[m + 1];
            let solved = |target: usize| match &rewritten?[target] {
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
        // From guessed joints, which may be whole turns elsewhere, one does not know which way a joint comes to where it is told.
        let guessed = |m: usize| {
            let targets = self.first[m]..self.first[m + 1];
            targets.rev().find_map(|t| self.starts[t].as_ref().ok()).is_some_and(|s| s.guess != Guess::No)
        };
        let follows = |m: usize| motions[m].previous.filter(|from| guessed(m) || !guessed(*from as usize));
        let before: Vec<Option<u32>> = (0..motions.len()).map(follows).collect();
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

/// The rest of the work on one portion of targets, into `out`.
fn finish(
    asked: &[Asked<'_>],
    starts: &[Result<Start, Why>],
    places: [&[usize]; 2],
    arms: &Arms<'_>,
    work: &Work<'_>,
    out: &mut [Result<Solved, Why>],
) {
    let Work { mountings, assessment, options, .. } = *work;
    let acting = &arms.acting;
    // A place holder for those on their way.
    let waiting = |start: &Result<Start, Why>| Err(start.as_ref().err().copied().unwrap_or(Why::JointTarget));
    out.iter_mut().zip(starts).for_each(|(out, start)| *out = waiting(start));
    let way = on_their_way(starts, places, arms, mountings, out);
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
    let mut near = NearestSample::default();
    for (k, w) in way.iter().enumerate() {
        if let Some(why) = failed[k] {
            out[w.index] = Err(why);
            continue;
        }
        let real = real(&w.start);
        let meant = w.start.meant;
        let in_object = |reached: &Pose| Deviation::between(&meant, reached, &Pose::identity(), None);
        let deviations =
            [w.reached_before, real.target_of(&reached_after[k])].map(|reached| in_object(&reached));
        let in_play_mm = acting.in_play_mm(w.place, &w.after, &tools[k]);
        let (conf, margins) = branches[k];
        let mut solved = Solved {
            mounted: w.start.mounted,
            meant,
            before: w.start.joints,
            after: w.after,
            told: told[k],
            cfx_before: w.start.cfx,
            conf,
            margins: [w.start.margins, margins],
            off_mm: deviations.map(|deviation| deviation.norm_mm()),
            deviations: options.points.then(|| Box::new(deviations)),
            sigma_mm: absolute[k].unwrap_or(0.0).hypot(in_play_mm),
            shape_sigma_mm: of_shape[k]
                .or_else(|| assessment.sigma_of_cut_mm(cut_of(w)))
                .map(|sigma| sigma.hypot(in_play_mm)),
            in_play_mm,
            place: w.place,
            guess: w.start.guess,
            outside: arms.knowledge.and_then(|k| k.region.outside_along(&w.after, &mut near)),
            forbidden: None,
        };
        solved.forbidden = forbidden(&solved, w.singularity, arms, options).or_else(|| {
            let told = &mountings.list[solved.mounted].told;
            let flanges = [told.flange_for(&meant), told_flanges[k]];
            let stated = if joint_form(w) { None } else { stated(&asked[w.index]) };
            let replay = Replay { flanges, heard: &heard[k], joints: &last[k], stated };
            at_target(&solved, w.singularity, &replay, arms, options)
        });
        out[w.index] = Ok(solved);
    }
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
        None => acting.inverse(place).solve_offset_seeded(&flanges, &before),
        Some(items) => {
            acting.inverse(place).solve_offset_seeded(&picked(&flanges, items), &picked(&before, items))
        }
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
    let reached = if way.iter().all(joint_form) {
        Vec::new()
    } else {
        arms.nominal.solve_seeded_joints(&heard, &after)
    };
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
    against: Vec<Option<Option<&RegisteredFrame>>>,
    arms: &Arms<'_>,
) -> Vec<Option<f64>> {
    let Some(knowledge) = arms.knowledge else { return vec![None; way.len()] };
    let (mut places, mut points) = (Vec::with_capacity(way.len()), Vec::with_capacity(way.len()));
    let mut at = Vec::with_capacity(way.len());
    for ((k, w), carried) in way.iter().enumerate().zip(against) {
        let Some(carried) = carried else { continue };
        points.push(FlangePoint { joints: w.after, flange_from_tool: tools[k], carried });
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
