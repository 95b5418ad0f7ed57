//! The targets of a program, solved, and the plans made of them.
//!
//! A plan repeats until it agrees with itself. From outside to inside: `compensate` plans again without the motions that the writer refuses;
//! `SolvedProgram::plan` without the lines that joints do not follow; `unchanged_for` with the motions that a neighbour keeps where it is,
//! whose joints then arrive elsewhere from other sides; `target::solve` until these sides agree with the solved targets. Each of the first
//! three only ever adds motions that stay, so it ends.

use std::collections::BTreeMap;

use crate::arms::Arms;
use crate::cell::Cell;
use crate::cut::{self, Cuts, CutsOf, StartsOf};
use crate::deviation::MotionStatus;
use crate::feasibility::joint_lines::lines_off_as_joints;
use crate::feasibility::unchanged::{blocking_reason, unchanged_motions};
use crate::frames::frame_table::FrameTable;
use crate::options::Options;
use crate::plan::Plan;
use crate::plan::measured_sigma;
use crate::plan::notes::unseen_note;
use crate::plan::reason::OutcomeReason;
use crate::risk::assessment::{Assessment, AssessmentSample, EstimateContext, assess_program};
use crate::risk::fixtures;
use crate::risk::placement::PlacementChoice;
use crate::risk::prepared_estimate::PreparedEstimate;
use crate::target::original_joints::OriginalProgram;
use crate::target::solve::solve_targets;
use crate::target::solved_target::SolvedTargets;
use truegrind_arm::estimated::{Estimated, PosteriorComponent};
use truegrind_programs::motion::{Listing, MotionKind};

use crate::plan::planner::{Planner, planned};

/// Largest number of rounds in which lines are refused that joints do not follow.
const MAX_LINE_ROUNDS: usize = 16;

/// Largest number of rounds in which unmodified motions change the backlash sides of later ones.
const MAX_UNCHANGED_ROUNDS: usize = 64;

/// Plans the rewrite of a program.
///
/// Motions are independent, except those with unmonitored configuration (ConfL\Off), which continue from the previous motion;
/// the result does not depend on the number of threads.
pub fn plan(listing: &Listing, estimated: &Estimated, cell: &Cell, options: &Options) -> Plan {
    SolvedProgram::of(listing, &PreparedEstimate::of(estimated), cell, options).plan(&BTreeMap::new())
}

/// The solved targets of a program; they serve any number of plans.
pub(crate) struct SolvedProgram<'a> {
    listing: &'a Listing,
    options: &'a Options,
    arms: Arms<'a>,
    frame_table: FrameTable,
    /// The original program, if joints have backlash: only then are targets solved again.
    program: Option<OriginalProgram<'a>>,
    cuts: CutsOf,
    part_of: Vec<u32>,
    assessment: Assessment,
    solved: SolvedTargets<'a>,
    /// The unmodified motions that `solved` was computed with.
    solved_unchanged: BTreeMap<u32, OutcomeReason>,
}

impl<'a> SolvedProgram<'a> {
    pub(crate) fn of(
        listing: &'a Listing,
        estimate: &PreparedEstimate<'a>,
        cell: &Cell,
        options: &'a Options,
    ) -> Self {
        let mut arms = Arms::of(estimate.arm, &options.condition);
        let mut frame_table = FrameTable::of(listing, &arms, cell, options.loads.is_some());
        let program = OriginalProgram::of(listing, &arms, &frame_table);
        let part_of = fixtures::of(listing, &frame_table.taught(), options.joint_targets);
        let cuts = cut::of(listing, options.cuts, &part_of);
        let sample = AssessmentSample::of(listing, &cuts, part_of.clone(), |motion| program.knows(motion));
        let assessment =
            assess(listing, sample, &program, &mut arms, &mut frame_table, options, &estimate.posterior);
        let solved_unchanged = assessment.risky();
        let solved = solve_targets(
            listing,
            &program,
            &mut arms,
            &frame_table,
            &assessment,
            options,
            &solved_unchanged,
        );
        let program = arms.conditions.has_play().then_some(program);
        Self {
            listing,
            options,
            arms,
            frame_table,
            program,
            cuts,
            part_of,
            assessment,
            solved,
            solved_unchanged,
        }
    }

    /// The plan in which the motions that the writer refused (`refused`, by index) remain unmodified, and with them their
    /// cuts.
    pub(crate) fn plan(&mut self, refused: &BTreeMap<u32, OutcomeReason>) -> Plan {
        let mut refused = refused.clone();
        // A line that joints do not follow is known only with its inserted targets; refusing it may change what lies behind it.
        for _ in 0..MAX_LINE_ROUNDS {
            let plan = self.plan_without(&refused);
            let off = lines_off_as_joints(self.listing, &plan, self.options);
            if off.is_empty() {
                return plan;
            }
            refused.extend(off);
        }
        let lines =
            (0_u32..).zip(&self.listing.motions).filter(|(_, motion)| motion.kind == MotionKind::Linear);
        for (motion, _) in lines {
            refused.entry(motion).or_insert(OutcomeReason::NoConsistentPlan);
        }
        self.plan_without(&refused)
    }

    fn plan_without(&mut self, refused: &BTreeMap<u32, OutcomeReason>) -> Plan {
        let unchanged = self.unchanged_for(refused);
        let Self { listing, options, arms, frame_table, part_of, assessment, solved, .. } = self;
        let measured_sigma_mm = measured_sigma::of(frame_table, solved, arms);
        let mut plan = planned(&Planner {
            listing,
            solved,
            starts: &StartsOf::of(listing),
            part_of,
            measured_sigma_mm: &measured_sigma_mm,
            unchanged: &unchanged,
            frame_table,
            assessment,
            arms,
            options,
        });
        plan.placements.clone_from(&assessment.placements);
        plan.cuts.clone_from(&assessment.cuts);
        let rewritten = |motion: &u32| {
            let outcome = plan.outcomes.get(*motion as usize);
            outcome.is_some_and(|outcome| outcome.status.is_written())
        };
        for cut in &mut plan.cuts {
            cut.corrected = cut.motions.iter().any(rewritten);
        }
        let corrected = || plan.cuts.iter().filter(|cut| cut.corrected);
        plan.probability_of_harm = assessment.probability_of_harm_of(corrected());
        let unseen = arms.knowledge.zip(assessment.unseen.as_ref()).filter(|_| corrected().next().is_some());
        plan.notes.extend(unseen.and_then(|(knowledge, unseen)| unseen_note(knowledge, unseen)));
        plan
    }

    /// The motions that remain unmodified. With backlash, an unmodified motion changes the sides from which joints arrive at
    /// later targets: all targets are then solved again.
    fn unchanged_for(&mut self, refused: &BTreeMap<u32, OutcomeReason>) -> BTreeMap<u32, OutcomeReason> {
        let Self {
            listing,
            options,
            arms,
            frame_table,
            program,
            cuts,
            assessment,
            solved,
            solved_unchanged,
            ..
        } = self;
        let mut refused = refused.clone();
        for (motion, why) in assessment.risky() {
            refused.entry(motion).or_insert(why);
        }
        for _ in 0..MAX_UNCHANGED_ROUNDS {
            if let Some(program) = program
                && refused != *solved_unchanged
            {
                *solved = solve_targets(listing, program, arms, frame_table, assessment, options, &refused);
                solved_unchanged.clone_from(&refused);
            } else {
                solved.allow_again();
            }
            let unchanged = unchanged_motions(listing, solved, frame_table, arms, options, cuts, &refused);
            if !arms.conditions.has_play() {
                return unchanged;
            }
            let more: Vec<(u32, OutcomeReason)> = (0..listing.motions.len() as u32)
                .filter(|motion| !refused.contains_key(motion))
                .filter(|motion| !solved.of(*motion as usize).is_empty())
                .filter(|motion| solved.of(*motion as usize).iter().all(Result::is_ok))
                .filter_map(|motion| match blocking_reason(motion, listing, solved, options, &unchanged) {
                    Some((MotionStatus::Refused, why)) => Some((motion, why)),
                    _ => None,
                })
                .collect();
            if more.is_empty() {
                return unchanged;
            }
            refused.extend(more);
        }
        // Every round pinned more motions, so the whole program remains unmodified.
        for motion in 0..listing.motions.len() as u32 {
            refused.entry(motion).or_insert(OutcomeReason::NoConsistentPlan);
        }
        refused
    }
}

/// Assesses what the model knows of the program. Work objects whose shape alone is corrected are displaced to where the path
/// really lies.
fn assess(
    listing: &Listing,
    chosen: AssessmentSample,
    program: &OriginalProgram<'_>,
    arms: &mut Arms<'_>,
    frame_table: &mut FrameTable,
    options: &Options,
    posterior: &[PosteriorComponent],
) -> Assessment {
    let Some(knowledge) = arms.knowledge else { return Assessment::default() };
    let loads = arms.loads(listing, options.loads.as_ref());
    let condition_indices: Vec<usize> = if loads.is_empty() {
        vec![arms.conditions.condition_index([0; 6], None); listing.motions.len()]
    } else {
        loads.iter().map(|load| arms.conditions.condition_index([0; 6], load.as_ref())).collect()
    };
    let at = |motion: u32| program.commanded(motion, condition_indices[motion as usize]);
    let objects = frame_table.objects();
    let with = EstimateContext { conditions: &arms.conditions, knowledge, posterior };
    // Experiments correct every motion regardless of risk.
    let max_risk = if options.cuts == Cuts::Single { 1.0 } else { options.max_risk };
    let wanted = PlacementChoice { placement: options.placement, max_risk, remedies: options.remedies };
    assess_program(listing, chosen, &at, &mut frame_table.list, &objects, &with, wanted)
}
