//! Every target worked out: which joints the program as it is leads to, which joints reach what was meant, and what the
//! controller must be told for them.
//!
//! Targets go in blocks, so that the kinematics runs in lanes. First the joints of the program as it is: along runs of
//! neighbours, each from the one before. Then everything else, target by target. Blocks are cut by count alone, so the
//! result does not depend on the number of threads.

use rayon::prelude::*;

use super::deviation::Deviation;
use super::mountings::Mountings;
use super::rewrite::{Arms, Emit, Options, configured, monitored};
use super::why::Why;
use crate::kinematics::estimated::RidingPoint;
use crate::kinematics::inverse::configuration::Configuration;
use crate::kinematics::model::Joints;
use crate::kinematics::region::Outside;
use crate::math::se3::Pose;
use crate::program::motion::{Listing, Motion, MotionTarget, Reason, RobTarget, Switch, TargetValue};

/// Motions that one thread takes at a time.
const PORTION: usize = 256;

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
    pub(super) outside: Option<Outside>,
    pub(super) singularity: f64,
}

/// The targets of all motions.
pub(super) struct SolvedTargets {
    /// Where the targets of each motion begin, and the end of the last.
    first: Vec<usize>,
    /// The targets of so many motions each: one list of all would be copied together once more.
    portions: Vec<Vec<Result<Solved, Why>>>,
}

impl SolvedTargets {
    /// The targets of one motion; none where the motion must be left.
    pub(super) fn of(&self, motion: usize) -> &[Result<Solved, Why>] {
        let portion = motion / PORTION;
        let begin = self.first[portion * PORTION];
        &self.portions[portion][self.first[motion] - begin..self.first[motion + 1] - begin]
    }
}

/// A target and the motion to which it belongs.
#[derive(Clone, Copy)]
struct Asked<'a> {
    motion: &'a Motion,
    target: &'a MotionTarget,
}

/// What a target means, and the joints that the program as it is leads to.
#[derive(Clone, Copy)]
struct Start {
    mounted: usize,
    meant: Pose,
    joints: Joints,
}

/// Works out all targets.
pub(super) fn solve_all(
    listing: &Listing,
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
) -> SolvedTargets {
    let mut first = Vec::with_capacity(listing.motions.len() + 1);
    let mut asked: Vec<Asked<'_>> = Vec::with_capacity(listing.motions.len());
    for motion in &listing.motions {
        first.push(asked.len());
        if motion.left.is_none() {
            asked.extend(motion.targets.iter().map(|target| Asked { motion, target }));
        }
    }
    first.push(asked.len());
    let starts = starts(listing, &first, &asked, arms, mountings);
    let count = listing.motions.len();
    let portions = (0..count)
        .into_par_iter()
        .step_by(PORTION)
        .map(|begin| {
            let targets = first[begin]..first[(begin + PORTION).min(count)];
            finish(&asked[targets.clone()], &starts[targets], arms, mountings, options)
        })
        .collect();
    SolvedTargets { first, portions }
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
    let mut out: Starts = asked
        .par_chunks(STRETCH)
        .flat_map_iter(|asked| {
            let mut starts = Vec::with_capacity(asked.len());
            let mut near = None;
            for run in asked.chunk_by(|a, b| depends(a) == depends(b)) {
                if depends(&run[0]) {
                    starts.resize(starts.len() + run.len(), Err(Why::JointTarget));
                } else {
                    along(run, &mut near, arms, mountings, &mut starts);
                }
            }
            starts
        })
        .collect();
    // Now those that depend on the motion before, in order: a run is what follows each other in the listing.
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
            reached.last().and_then(|start| start.as_ref().ok().map(|s| s.joints))
        });
        let run = first[motion]..first[end];
        let mut starts = Vec::with_capacity(run.len());
        along(&asked[run.clone()], &mut near, arms, mountings, &mut starts);
        out[run].iter_mut().zip(starts).for_each(|(place, start)| *place = start);
        motion = end;
    }
    out
}

/// Shortest and longest run of targets that are taken together.
const RUNS: [usize; 2] = [8, 64];

/// The starts of targets that follow each other. `near`: the joints from which the first one is reached, if known; left
/// at the joints of the last.
fn along(
    asked: &[Asked<'_>],
    near: &mut Option<Joints>,
    arms: &Arms<'_>,
    mountings: &Mountings,
    out: &mut Starts,
) {
    let mut at = 0;
    let mut run = RUNS[0];
    while at < asked.len() {
        let here = &asked[at..(at + run).min(asked.len())];
        let whole = match near {
            Some(last) => {
                let cartesian: Vec<Told<'_>> =
                    here.iter().map_while(|asked| Told::of(asked, mountings)).collect();
                let taken = together(&cartesian, last, arms, out);
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
            let start = start(&asked[at], near.as_ref(), arms, mountings);
            if let Ok(start) = &start {
                *near = Some(start.joints);
            }
            out.push(start);
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
        let mounted = mountings.of_motion(asked.motion)?;
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
fn together(told: &[Told<'_>], last: &mut Joints, arms: &Arms<'_>, out: &mut Starts) -> usize {
    if told.is_empty() {
        return 0;
    }
    let flanges: Vec<Pose> = told.iter().map(|t| t.flange).collect();
    let solved = arms.nominal.solve_path(&flanges, last);
    let joints: Vec<Joints> = solved.iter().map_while(|s| s.as_ref().ok().map(|s| s.joints)).collect();
    let configurations: Vec<Configuration> = told.iter().map(|t| wanted(t.target)).collect();
    let fitting = arms.nominal.fitting(&joints, &configurations[..joints.len()]);
    let mut taken = 0;
    for ((told, joints), fits) in told.iter().zip(joints).zip(fitting) {
        if !fits && told.monitored != Switch::Off {
            break;
        }
        out.push(Ok(Start { mounted: told.mounted, meant: told.meant, joints }));
        *last = joints;
        taken += 1;
    }
    taken
}

/// One target by itself.
fn start(
    asked: &Asked<'_>,
    near: Option<&Joints>,
    arms: &Arms<'_>,
    mountings: &Mountings,
) -> Result<Start, Why> {
    let value = asked.target.value.map_err(Why::Program)?;
    let mounted = mountings.of_motion(asked.motion).ok_or(Why::Program(Reason::ToolUnknown))?;
    let told = &mountings.list[mounted].told;
    match value {
        TargetValue::Cartesian(t) => {
            if let Some(why) = mountings.moving_base(&t) {
                return Err(why);
            }
            let meant = t.pose();
            let flange = told.flange_for(&meant);
            let joints = configured(&arms.nominal, &flange, &t, monitored(asked.motion), near)?;
            Ok(Start { mounted, meant, joints })
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            let nominal = arms.nominal.arm();
            if let Some(joint) = nominal.model.limits.violated(&joints) {
                return Err(Why::OutsideLimits { joint });
            }
            Ok(Start { mounted, meant: told.target_of(&nominal.forward(&joints)), joints })
        }
    }
}

// ---- the corrected program ----

/// The rest of the work on one portion of targets.
fn finish(
    asked: &[Asked<'_>],
    starts: &[Result<Start, Why>],
    arms: &Arms<'_>,
    mountings: &Mountings,
    options: &Options,
) -> Vec<Result<Solved, Why>> {
    let (nominal, acting) = (arms.nominal.arm(), arms.estimated.arm());
    let mut out: Vec<Result<Solved, Why>> = Vec::with_capacity(asked.len());
    // What is still on its way, and where in `out` it belongs.
    let mut open: Vec<(usize, Start)> = Vec::with_capacity(asked.len());
    for (index, start) in starts.iter().enumerate() {
        if let Ok(start) = start {
            open.push((index, *start));
        }
        // A place holder for those on their way.
        out.push(Err(start.as_ref().err().copied().unwrap_or(Why::JointTarget)));
    }
    let before: Vec<Joints> = open.iter().map(|(_, s)| s.joints).collect();
    let real = |start: &Start| &mountings.list[start.mounted].real;
    let flanges: Vec<Pose> = open.iter().map(|(_, s)| real(s).flange_for(&s.meant)).collect();
    let reached_before = acting.forward_many(&before);
    let conf_before = arms.nominal.configurations(&before);
    // Joints that reach what was meant.
    let solutions = arms.estimated.solve_seeded(&flanges, &before);
    let mut way: Vec<OnItsWay> = Vec::with_capacity(open.len());
    for (k, ((index, start), solution)) in open.iter().zip(solutions).enumerate() {
        match solution {
            Ok(solution) => way.push(OnItsWay {
                index: *index,
                start: *start,
                flange: flanges[k],
                after: solution.joints,
                singularity: solution.singularity,
                conf_before: conf_before[k],
                reached_before: real(start).target_of(&reached_before[k]),
            }),
            Err(error) => out[*index] = Err(Why::of_inverse(error)),
        }
    }
    // What the controller is told, and where it goes when the told numbers are rounded.
    let after: Vec<Joints> = way.iter().map(|w| w.after).collect();
    let told: Vec<Pose> = way
        .iter()
        .zip(nominal.forward_many(&after))
        .map(|(w, flange)| mountings.list[w.start.mounted].told.target_of(&flange))
        .collect();
    let joint_form = |w: &OnItsWay| {
        matches!(asked[w.index].target.value, Ok(TargetValue::Joint(_))) || options.emit == Emit::Joints
    };
    let heard: Vec<Pose> = way
        .iter()
        .zip(&told)
        .map(|(w, told)| {
            mountings.list[w.start.mounted].told.flange_for(&rounded(told, options.position_decimals))
        })
        .collect();
    let replayed = match options.emit {
        Emit::Targets => arms.nominal.solve_seeded(&heard, &after),
        Emit::Joints => Vec::new(),
    };
    let mut last: Vec<Joints> = Vec::with_capacity(way.len());
    let mut failed: Vec<Option<Why>> = vec![None; way.len()];
    for (k, w) in way.iter().enumerate() {
        last.push(match replayed.get(k) {
            Some(Ok(solution)) if !joint_form(w) => solution.joints,
            Some(Err(error)) if !joint_form(w) => {
                failed[k] = Some(Why::of_inverse(*error));
                w.after
            }
            _ => w.after,
        });
    }
    let reached_after = acting.forward_many(&last);
    let conf = arms.nominal.configurations(&after);
    let tools: Vec<Pose> = way.iter().map(|w| real(&w.start).flange_from_tool(&w.flange)).collect();
    let sigmas = match arms.knowledge {
        Some(knowledge) => {
            let points: Vec<RidingPoint<'_>> = way
                .iter()
                .zip(&tools)
                .map(|(w, tool)| RidingPoint {
                    joints: w.after,
                    flange_from_tool: *tool,
                    carried: mountings.list[w.start.mounted].carried.as_ref(),
                })
                .collect();
            knowledge.position_sigmas_mm(acting, &points)
        }
        None => vec![0.0; way.len()],
    };
    for (k, w) in way.iter().enumerate() {
        if let Some(why) = failed[k] {
            out[w.index] = Err(why);
            continue;
        }
        let real = real(&w.start);
        let meant = w.start.meant;
        let in_object = |reached: &Pose| Deviation::between(&meant, reached, &Pose::identity(), None);
        out[w.index] = Ok(Solved {
            mounted: w.start.mounted,
            meant,
            before: w.start.joints,
            after: w.after,
            told: told[k],
            conf_before: w.conf_before,
            conf: conf[k],
            deviation_before: in_object(&w.reached_before),
            deviation_after: in_object(&real.target_of(&reached_after[k])),
            sigma_mm: sigmas[k],
            outside: arms.knowledge.and_then(|knowledge| knowledge.region.outside(&w.after)),
            singularity: w.singularity,
        });
    }
    out
}

/// A target whose joints are found.
struct OnItsWay {
    index: usize,
    start: Start,
    flange: Pose,
    after: Joints,
    singularity: f64,
    conf_before: Configuration,
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
