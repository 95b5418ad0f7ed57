//! Verification: runs a program on an arm other than the nominal one and compares the reached with the intended poses.
//!
//! The controller computes joints with the nominal arm; the acting arm (estimated, or a simulated actual one) moves with
//! those joints, arriving from their backlash sides. Intended poses come from the original program.

mod alignment;
mod between_targets;
mod differences;
mod executed_end;
mod kept_placement;

use nalgebra::{Point3, Translation3, Vector3};

use self::alignment::align;
use self::between_targets::Followed;
use self::differences::Compared;
use self::executed_end::{ExecutedEnd, Run, by_motion};
use self::kept_placement::KeptPlacement;
use crate::arms::Arms;
use crate::backlash::sides::{MotionEnd, ReachedEnd, backlash_sides};
use crate::cell::Cell;
use crate::condition::other_load::other_loads;
use crate::deviation::{
    After, Deviation, MissingMotions, MotionStatus, ON_SURFACE_MM, PathPoint, PathReport, files_of,
};
use crate::feasibility::measured_turns::outside_along;
use crate::frames::frame_table::FrameTable;
use crate::plan::notes::unstated_turn_note;
use crate::plan::reason::OutcomeReason;
use crate::risk::fixtures::{self, part_of_motion};
use crate::segment::condition_schedule::ConditionSchedule;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::{Estimated, FlangePoint, RegisteredFrame};
use truegrind_arm::model::{Joints, Model};
use truegrind_arm::region::NearestSample;
use truegrind_math::se3::Pose;
use truegrind_math::work::checkpoint;
use truegrind_programs::motion::load::Loads;
use truegrind_programs::motion::{Listing, MotionKind, Reason, TargetValue};
use truegrind_surfaces::Surface;

/// Commanded end of a motion.
#[derive(Debug, Clone)]
struct CommandedEnd {
    motion: usize,
    frames_index: usize,
    /// Commanded pose in the work object.
    commanded: Pose,
    joints: Joints,
}

/// The arm that runs a program.
#[derive(Debug, Clone, Copy)]
pub struct ActingArm<'a> {
    /// What the controller computes with.
    pub nominal: &'a Model,
    /// The arm that moves.
    pub model: &'a Model,
    /// Its covariance and region, where it is an estimate.
    pub knowledge: Option<&'a Estimated>,
    /// Condition under which it runs.
    pub condition: Condition,
}

/// A program to verify.
#[derive(Debug, Clone, Copy)]
pub struct VerificationTask<'a> {
    /// Defines the intended poses, and gives the deviations before.
    pub original: &'a Listing,
    /// The rewritten program, which gives the deviations after; absent when only the original is verified.
    pub rewritten: Option<&'a Listing>,
    /// Origins of tools and work objects.
    pub cell: &'a Cell,
    /// The machined surface, in the frame of the work object.
    pub surface: Option<&'a Surface>,
    /// Name of the program.
    pub program: &'a str,
    /// Name of the model.
    pub name: &'a str,
    /// What "after" means.
    pub after: After,
    /// Largest deviation of the path between two targets from the intended one (mm), as in
    /// [`Options::tolerance_mm`](crate::options::Options::tolerance_mm).
    pub tolerance_mm: f64,
    /// Payloads that the two programs state; absent where the payload of the condition applies throughout.
    pub loads: [Option<&'a Loads>; 2],
}

/// The rewritten program and its ends, by motion.
struct RewrittenRun<'a> {
    listing: &'a Listing,
    run: &'a Run,
    ends: Vec<Option<&'a ExecutedEnd>>,
    /// The rewritten motion of each original one.
    partners: Vec<Option<usize>>,
}

/// Runs a program on an arm.
pub fn verify(task: &VerificationTask<'_>, acting_arm: &ActingArm<'_>) -> PathReport {
    let mut arms = Arms::simulated(acting_arm.nominal, acting_arm.model, &acting_arm.condition);
    arms.knowledge = acting_arm.knowledge;
    let Run { ends: before, without_end, frame_table, .. } =
        run(task.original, task.loads[0], None, &mut arms, task.cell);
    let part_of = fixtures::of(task.original, &frame_table.taught(), false);
    // Where no word states the configuration, the arm starts both in the same one.
    let start = before.first().map(|end| end.joints);
    let after =
        task.rewritten.map(|listing| (listing, run(listing, task.loads[1], start, &mut arms, task.cell)));
    let ends = by_motion(&before, task.original.motions.len());
    let after = after.as_ref().map(|(listing, after)| {
        let of_motions = by_motion(&after.ends, listing.motions.len());
        RewrittenRun {
            listing,
            run: after,
            partners: align([task.original, listing], &ends, &of_motions),
            ends: of_motions,
        }
    });
    let differences =
        after.as_ref().map_or_else(Vec::new, |RewrittenRun { listing, ends: after, partners, .. }| {
            let configuration = |joints: &Joints| {
                let found = arms.nominal.configuration(joints);
                [found.cf1, found.cf4, found.cf6]
            };
            let configuration = &configuration;
            let placements = &KeptPlacement::all(task.original, partners, &ends, after);
            Compared {
                original: task.original,
                rewritten: listing,
                partners,
                before: &ends,
                after,
                placements,
                configuration,
            }
            .differences()
        });
    let between = after.as_ref().map(|RewrittenRun { listing, run, ends: after, partners }| {
        let (original, before) = (task.original, &ends);
        Followed { original, rewritten: listing, partners, before, after, run, is_same: &is_same_target }
            .judged(&arms, task.tolerance_mm)
    });
    let mut turn_sigma_rad: Option<f64> = None;
    let points = before.iter().enumerate().map(|(index, first)| {
        checkpoint();
        let second = after.as_ref().and_then(|after| after.ends[after.partners[first.motion]?]);
        let real = &frame_table.list[first.frames_index].real;
        let part = part_of_motion(&task.original.motions[first.motion], &part_of);
        let sigma =
            acting_arm.knowledge.map(|knowledge| Sigma::of(second.unwrap_or(first), first, knowledge, &arms));
        turn_sigma_rad = sigma.map(|sigma| sigma.turn_rad).into_iter().chain(turn_sigma_rad).reduce(f64::max);
        path_point(index, (first, second), (part, real.object), task, acting_arm, sigma)
    });
    let points: Vec<PathPoint> = points.collect();
    let judged =
        before.iter().zip(&points).filter(|(_, point)| task.rewritten.is_none() || point.is_corrected());
    let loaded = acting_arm.knowledge.map_or(0, |knowledge| {
        let judged = judged.map(|(end, point)| (end.motion, point.sigma_mm));
        other_loads(task.original, knowledge, (task.loads[0], &acting_arm.condition), judged)
    });
    let other_load = (loaded > 0).then(|| {
        let motions = if loaded == 1 { "1 motion carries" } else { &format!("{loaded} motions carry") };
        format!(
            "{motions} another load than the measurement did, and the deflection of this arm is known for that one alone: the deviations there hold \
             without the difference"
        )
    });
    PathReport {
        program: task.program.to_owned(),
        files: files_of(task.original),
        model: task.name.to_owned(),
        after: task.after,
        points,
        missing: MissingMotions::of(task.original, |motion| {
            let (_, reason) =
                without_end.get(without_end.binary_search_by_key(&motion, |(of, _)| *of).ok()?)?;
            Some((MotionStatus::Left, Some(reason.to_string())))
        }),
        differences,
        between,
        held_out_mm: acting_arm.knowledge.map(|k| k.calibrated.held_out.rmse),
        turn_sigma_rad,
        assumptions: unstated_turn_note(task.original).into_iter().chain(other_load).collect(),
    }
}

/// Standard deviation of where the arm holds a tool.
#[derive(Debug, Clone, Copy)]
struct Sigma {
    position_mm: f64,
    turn_rad: f64,
}

/// A point so far from the tool's tip (mm) that it moves only by the tool's turn.
const FAR_MM: f64 = 1e6;

impl Sigma {
    /// At the joints of `at`, of the tool of `first`.
    fn of(at: &ExecutedEnd, first: &ExecutedEnd, knowledge: &Estimated, arms: &Arms<'_>) -> Self {
        let carried = first.carried.as_ref().map(RegisteredFrame::carried);
        let tools = [0, 1, 2, 3].map(|axis| {
            let away = if axis == 0 { Vector3::zeros() } else { Vector3::ith(axis - 1, FAR_MM) };
            first.flange_from_tool * Translation3::from(away)
        });
        let point = |tool: Pose| FlangePoint { joints: at.joints, flange_from_tool: tool, carried };
        let known = knowledge.position_sigmas_mm(arms.conditions.arm(at.condition_index), &tools.map(point));
        let sigma = |k: usize| {
            known[k].hypot(arms.conditions.play_uncertainty_mm(at.condition_index, &at.joints, &tools[k]))
        };
        // A turn by ω moves the three far points by ω × r, whose squares add up to 2 |ω|² r².
        let far = (1..4).map(|k| sigma(k).powi(2)).sum::<f64>();
        Self { position_mm: sigma(0), turn_rad: (far / 2.0).sqrt() / FAR_MM }
    }
}

/// The point of a motion that ends at `first` in the original program and at `second` in the rewritten one.
fn path_point(
    index: usize,
    (first, second): (&ExecutedEnd, Option<&ExecutedEnd>),
    (part, part_from_object): (u32, Pose),
    task: &VerificationTask<'_>,
    acting_arm: &ActingArm<'_>,
    sigma: Option<Sigma>,
) -> PathPoint {
    let motion = &task.original.motions[first.motion];
    let contact = task.surface.and_then(|s| s.foot(&Point3::from(first.commanded.translation.vector)));
    let on_surface = contact.as_ref().is_some_and(|f| f.normal_mm.abs() < ON_SURFACE_MM);
    let normal: Option<Vector3<f64>> = contact.map(|f| f.contact.normal.into_inner());
    let deviation =
        |reached: &Pose| Deviation::between(&first.commanded, reached, &Pose::identity(), normal.as_ref());
    let same = second.is_some_and(|second| is_same_target(first, second));
    let joints = second.unwrap_or(first).joints;
    let linear = matches!(motion.kind, MotionKind::Linear | MotionKind::Circular);
    PathPoint {
        index,
        file: motion.place.file,
        line: motion.place.line,
        instruction: motion.instruction.to_string(),
        kind: motion.kind,
        cutting: if task.surface.is_some() { linear && on_surface } else { linear },
        base_from_object: first.base_from_object,
        part,
        part_from_object,
        flange_from_tool: first.flange_from_tool,
        intended: first.base_from_object * first.commanded,
        normal,
        joints_before: Some(first.joints),
        joints_after: second.map(|s| s.joints),
        before: Some(deviation(&first.reached)),
        after: second.map(|s| deviation(&s.reached)),
        sigma_mm: sigma.map(|sigma| sigma.position_mm),
        shape_sigma_mm: None,
        outside: acting_arm.knowledge.and_then(|k| outside_along(k, &joints, &mut NearestSample::default())),
        status: if second.is_some() && !same { MotionStatus::Changed } else { MotionStatus::Left },
        reason: same.then(|| "same as in the original".to_owned()),
    }
}

/// Whether the rewritten program sends the arm where the original does.
fn is_same_target(first: &ExecutedEnd, second: &ExecutedEnd) -> bool {
    let moved = (first.commanded.translation.vector - second.commanded.translation.vector).norm();
    let turned = first.commanded.rotation.angle_to(&second.commanded.rotation);
    moved < 1e-9 && turned < 1e-9 && (first.joints - second.joints).amax() < 1e-9
}

/// Runs a program. `start` are the joints where it
/// begins, unless cell file or program state them.
fn run(
    listing: &Listing,
    loads: Option<&Loads>,
    start: Option<Joints>,
    arms: &mut Arms<'_>,
    cell: &Cell,
) -> Run {
    let frame_table = FrameTable::of(listing, arms, cell, loads.is_some()).starting_at(start);
    let mut sent: Vec<CommandedEnd> = Vec::new();
    let mut without_end = Vec::new();
    let mut near: Option<Joints> = None;
    for (index, motion) in listing.motions.iter().enumerate() {
        checkpoint();
        let end = match motion.own_reason {
            Some(reason) => Err(OutcomeReason::Program(reason)),
            None => commanded_end(index, listing, arms, &frame_table, near.as_ref()),
        };
        match end {
            Ok(there) => {
                near = Some(there.joints);
                sent.push(there);
            }
            Err(reason) => without_end.push((index as u32, reason)),
        }
    }
    let (condition_indices, schedules) = condition_indices(listing, loads, &sent, arms, &frame_table);
    let joints: Vec<Joints> = sent.iter().map(|s| s.joints).collect();
    let flanges = arms.conditions.forward(&condition_indices, &joints);
    let ways = on_the_way(listing, &sent, &condition_indices, arms, &frame_table);
    let ends = sent.into_iter().zip(flanges).zip(condition_indices).zip(ways).map(
        |(((sent, flange), condition_index), on_the_way)| {
            let frames = &frame_table.list[sent.frames_index];
            ExecutedEnd {
                motion: sent.motion,
                frames_index: sent.frames_index,
                commanded: sent.commanded,
                joints: sent.joints,
                reached: frames.real.target_of(&flange),
                base_from_object: frames.real.base_from_object(&flange),
                flange_from_tool: frames.real.flange_from_tool(&flange),
                carried: frames.carried.clone(),
                condition_index,
                on_the_way,
            }
        },
    );
    Run { ends: ends.collect(), without_end, frame_table, schedules }
}

/// See [`ExecutedEnd::on_the_way`]. The controller moves to joints in proportion from those of the motion before.
fn on_the_way(
    listing: &Listing,
    sent: &[CommandedEnd],
    condition_indices: &[usize],
    arms: &Arms<'_>,
    frame_table: &FrameTable,
) -> Vec<Vec<Pose>> {
    let of = |index: usize| {
        let end = &sent[index];
        let motion = &listing.motions[end.motion];
        let frames = &frame_table.list[end.frames_index];
        let reached = |joints: &Joints| {
            frames.real.target_of(&arms.conditions.arm(condition_indices[index]).forward(joints))
        };
        let before = index.checked_sub(1).map(|before| &sent[before]);
        match (motion.kind, before) {
            (MotionKind::Circular, _) => {
                let via = motion.via().and_then(|via| via.value.ok()?.cartesian().map(|via| via.pose()));
                let flange = via.map(|via| frames.commanded.flange_for(&via));
                let joints = flange.and_then(|flange| arms.nominal.solve_near(&flange, &end.joints).ok());
                joints.iter().map(|solution| reached(&solution.joints)).collect()
            }
            (MotionKind::AbsoluteJoint, Some(before)) => {
                [0.25, 0.5, 0.75].map(|share| reached(&before.joints.lerp(&end.joints, share))).to_vec()
            }
            _ => Vec::new(),
        }
    };
    (0..sent.len()).map(of).collect()
}

/// Condition under which the arm arrives at each end, and those on the way to each motion.
fn condition_indices(
    listing: &Listing,
    loads: Option<&Loads>,
    sent: &[CommandedEnd],
    arms: &mut Arms<'_>,
    frame_table: &FrameTable,
) -> (Vec<usize>, Vec<ConditionSchedule>) {
    let loads = arms.loads(listing, loads);
    let load = |motion: usize| loads.get(motion).and_then(Option::as_ref);
    if !arms.conditions.has_play() {
        let alike = sent.iter().map(|s| arms.conditions.condition_index([0; 6], load(s.motion)));
        return (alike.collect(), Vec::new());
    }
    let mut stops: Vec<MotionEnd<'_>> = listing
        .motions
        .iter()
        .map(|m| if m.kind == MotionKind::External { MotionEnd::Unmoved } else { MotionEnd::Unknown })
        .collect();
    for there in sent {
        let motion = &listing.motions[there.motion];
        stops[there.motion] = MotionEnd::At(ReachedEnd {
            motion,
            frames_index: there.frames_index,
            commanded: there.commanded,
            joints: there.joints,
            via: motion.via().and_then(|via| via.value.ok()?.cartesian().map(|t| t.pose())),
            links: None,
            as_joints: false,
            may_insert: false,
        });
    }
    let before: Vec<Option<u32>> = listing.motions.iter().map(|m| m.previous).collect();
    let commanded = |frames_index: usize| frame_table.list[frames_index].commanded;
    let backlash_sides =
        backlash_sides(&stops, &before, &arms.nominal, &arms.conditions.play_rad, &commanded, &[]);
    let schedules = backlash_sides.iter().enumerate().map(|(motion, sides)| {
        ConditionSchedule::of(sides, |sides| arms.conditions.condition_index(sides, load(motion)))
    });
    let schedules = schedules.collect();
    let arrives =
        |s: &CommandedEnd| arms.conditions.condition_index(backlash_sides[s.motion].end, load(s.motion));
    (sent.iter().map(arrives).collect(), schedules)
}

fn commanded_end(
    index: usize,
    listing: &Listing,
    arms: &Arms<'_>,
    frame_table: &FrameTable,
    near: Option<&Joints>,
) -> Result<CommandedEnd, OutcomeReason> {
    let motion = &listing.motions[index];
    let target = motion.to().ok_or(OutcomeReason::Program(Reason::ExternalOnly))?;
    let value = target.value.map_err(OutcomeReason::Program)?;
    let frames_index = frame_table.of_motion(motion)?;
    let mounting = &frame_table.list[frames_index].commanded;
    let (commanded, joints) = match value {
        TargetValue::Cartesian(t) => {
            if let Some(reason) = frame_table.moving_base(&t) {
                return Err(reason);
            }
            let commanded = t.pose();
            let flange = mounting.flange_for(&commanded);
            (commanded, frame_table.joints(motion, &t, &flange, &arms.nominal, near)?)
        }
        TargetValue::Joint(t) => {
            let joints = Joints::from_fn(|i, _| t.robot_deg[i].to_radians());
            (mounting.target_of(&arms.nominal.arm().forward(&joints)), joints)
        }
    };
    Ok(CommandedEnd { motion: index, frames_index, commanded, joints })
}
