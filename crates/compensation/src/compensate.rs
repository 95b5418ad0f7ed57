//! The main job: corrects a parsed program for an estimated arm and a cell.
//!
//! The dialect's writer may refuse a planned change that its language cannot express. Such a motion remains unmodified, and
//! with it its cut: planning is repeated without it until plan and writer agree. The report therefore states exactly what was
//! written.

use std::collections::BTreeMap;

use thiserror::Error;

use crate::cell::Cell;
use crate::condition::other_load::other_loads;
use crate::condition::overload::{is_far_above_rating, stated_overload};
use crate::cut::{Cuts, may_cut};
use crate::deviation::MotionStatus;
use crate::frames::taught::contradictions;
use crate::frames::{tip_in_wrist, undeclared};
use crate::options::{Emit, Options};
use crate::plan::Plan;
use crate::plan::reason::OutcomeReason;
use crate::plan::single_precision::single_precision;
use crate::plan::solved_program::SolvedProgram;
use crate::plan::steps_to_left::StepsToLeft;
use crate::risk::prepared_estimate::PreparedEstimate;
use truegrind_arm::estimated::Estimated;
use truegrind_programs::edit::EditError;
use truegrind_programs::motion::{Listing, Mark, MotionKind, Reason};
use truegrind_programs::reading::{Language, Program};
use truegrind_programs::rewrite::{RewriteOptions, RewriteOutcome, Rewritten};

/// A corrected program.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// Outcome of each motion, including the writer's refusals.
    pub plan: Plan,
    /// The edits of each file; [`truegrind_programs::edit::Edits::apply`] makes the new bytes.
    pub rewritten: Rewritten,
}

impl Compensated {
    /// Whether a motion is rewritten.
    pub fn changed(&self) -> bool {
        self.plan.outcomes.iter().any(|outcome| outcome.status.is_written())
    }
}

/// Reason why nothing was corrected.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// Cell file and program contradict each other; the sentences name both.
    #[error("{0}")]
    Cell(String),
    /// Edits of one file overlap: a defect of the dialect; nothing may be written.
    #[error(transparent)]
    Edits(#[from] EditError),
}

/// Corrects a program so that the estimated arm follows it. `mark` is written into every changed file.
///
/// # Errors
/// [`CompensateError`].
pub fn compensate(
    program: &Program<'_>,
    arm: &Estimated,
    cell: &Cell,
    options: &Options,
    mark: Option<Mark>,
) -> Result<Compensated, CompensateError> {
    compensate_prepared(program, &PreparedEstimate::of(arm), cell, options, mark)
}

/// [`compensate`] for many programs of one arm.
///
/// # Errors
/// [`CompensateError`].
pub fn compensate_prepared(
    program: &Program<'_>,
    prepared: &PreparedEstimate<'_>,
    cell: &Cell,
    options: &Options,
    mark: Option<Mark>,
) -> Result<Compensated, CompensateError> {
    let (listing, arm) = (program.listing(), prepared.arm);
    let found = contradictions(listing, cell, &arm.nominal);
    if !found.is_empty() {
        return Err(CompensateError::Cell(found.join("; ")));
    }
    let partial = options.cuts == Cuts::Partial;
    let mark = mark.map(|mark| Mark { partial, ..mark });
    let rewrite =
        RewriteOptions { mark, position_decimals: options.position_decimals, ..RewriteOptions::default() };
    let mut targets = SolvedProgram::of(listing, prepared, cell, options);
    let mut refused: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
    let play = arm.model.effects.iter().any(|effect| effect.play_rad().is_some() && !effect.is_zero());
    let mut round = 0;
    loop {
        let planned = targets.plan(&refused);
        let alone =
            if options.cuts == Cuts::Single { Vec::new() } else { air_moves_alone(listing, &planned) };
        let found: BTreeMap<u32, OutcomeReason> = if !alone.is_empty() {
            alone.into_iter().collect()
        } else if program.accepts(&planned.changes) {
            // Frees the solved targets while the edits are made; no second plan is needed.
            let ((), rewritten) =
                rayon::join(|| drop(targets), || program.rewrite(&planned.changes, &rewrite));
            return Ok(agreed(planned, rewritten?, &BTreeMap::new(), (program, arm), options));
        } else {
            let rewritten = program.rewrite(&planned.changes, &rewrite)?;
            let found = refusals(&planned, &rewritten, listing);
            // Motions judged one by one need no second plan, unless an unmodified motion changes the backlash
            // sides of later ones, or the start of a line that is written as joints.
            let single = options.cuts == Cuts::Single && !play && options.emit == Emit::Targets;
            if found.is_empty() || single {
                return Ok(agreed(planned, rewritten, &found, (program, arm), options));
            }
            found
        };
        for (motion, reason) in found {
            refused.entry(motion).or_insert(reason);
        }
        round += 1;
        if round >= MAX_ROUNDS {
            // Every round removed more motions, so the whole program remains unmodified.
            for change in &planned.changes {
                refused.entry(change.motion).or_insert(OutcomeReason::NoConsistentPlan);
            }
        }
    }
}

/// Air moves of an NC program next to a cut that stays uncorrected: before it and after the last cut of the file, since correcting them would
/// move its start, and the values of the axes that its blocks omit; and the first one after it, which would draw the tool out of the part
/// sideways. For the same reason the one that draws the tool out of a corrected cut is corrected, if another leads to the next cut: the values
/// of the axes that this other omits are then written out in it.
fn air_moves_alone(listing: &Listing, planned: &Plan) -> Vec<(u32, OutcomeReason)> {
    if !listing.numbered {
        return Vec::new();
    }
    let motions = &listing.motions;
    let mut is_corrected = vec![false; motions.len()];
    planned.changes.iter().for_each(|change| is_corrected[change.motion as usize] = true);
    let is_cut = |at: usize| may_cut(&motions[at]) && !motions[at].rapid;
    let mut out = Vec::new();
    let mut first = 0;
    for of_file in motions.chunk_by(|a, b| a.place.file == b.place.file) {
        let here = first..first + of_file.len();
        first = here.end;
        let Some(last_cut) = here.clone().rev().find(|at| is_cut(*at)) else { continue };
        let mut cut = last_cut;
        for at in here.clone().rev() {
            if is_cut(at) {
                cut = at;
            } else if is_corrected[at] && !is_corrected[cut] {
                let departs = at > here.start && is_cut(at - 1) && is_corrected[at - 1] && at + 1 < cut;
                if !departs {
                    out.push((at as u32, OutcomeReason::AirMoveAlone));
                }
            } else if is_corrected[at]
                && at > here.start
                && is_cut(at - 1)
                && !is_corrected[at - 1]
                && !is_cut(at + 1)
            {
                let line = motions[at - 1].place.line;
                out.push((at as u32, OutcomeReason::DepartureFromUnchangedCut { line }));
            }
        }
    }
    out
}

/// Rounds of planning and writing before every remaining change is refused.
const MAX_ROUNDS: usize = 16;

/// The plan, reconciled with what was written.
fn agreed(
    mut planned: Plan,
    rewritten: Rewritten,
    refused: &BTreeMap<u32, OutcomeReason>,
    (program, arm): (&Program<'_>, &Estimated),
    options: &Options,
) -> Compensated {
    reconcile(&mut planned, &rewritten, refused);
    let outcome = |motion: usize| {
        let outcome = &planned.outcomes[motion];
        (outcome.status, outcome.reason(), outcome.before_mm.get())
    };
    planned.steps = StepsToLeft::of(program.listing(), &planned.changes, &outcome, options.tolerance_mm);
    planned.notes.extend(undeclared::notes(program.listing(), program.language()));
    let loads = options.loads.as_ref();
    let stated = loads.and_then(|loads| stated_overload(program.listing(), loads, &arm.robot));
    let most_kg =
        stated.as_ref().map(|stated| stated.most_kg).into_iter().chain(options.condition.payload_kg);
    planned.is_overloaded = most_kg.into_iter().any(|kg| is_far_above_rating(kg, &arm.robot));
    let corrected = planned.outcomes.iter().filter(|outcome| outcome.status.is_written());
    let corrected = corrected.map(|outcome| (outcome.motion as usize, outcome.sigma_mm.get()));
    planned.other_loads = other_loads(program.listing(), arm, (loads, &options.condition), corrected);
    planned.notes.extend(stated.map(|stated| stated.note));
    let corrected = planned.outcomes.iter().filter(|outcome| outcome.status.is_written());
    let corrected = corrected.map(|outcome| outcome.motion as usize);
    let tips = tip_in_wrist::notes(program.listing(), &arm.nominal, corrected);
    planned.has_tip_in_wrist = !tips.is_empty();
    planned.notes.extend(tips);
    if program.language() == Language::Rapid
        && let Some(off) = single_precision(&planned.changes)
    {
        planned.notes.push(off.text());
    }
    Compensated { plan: planned, rewritten }
}

/// The changes that the writer refused.
fn refusals(planned: &Plan, rewritten: &Rewritten, listing: &Listing) -> BTreeMap<u32, OutcomeReason> {
    let outcomes = planned.changes.iter().zip(&rewritten.outcomes);
    let refused = outcomes.filter_map(|(change, outcome)| match outcome {
        // Rounded to the written decimals, the points make no circle.
        RewriteOutcome::Refused(Reason::WrongShape)
            if listing.motions[change.motion as usize].kind == MotionKind::Circular =>
        {
            Some((change.motion, OutcomeReason::NoCircle))
        }
        RewriteOutcome::Refused(reason) => Some((change.motion, OutcomeReason::Program(*reason))),
        _ => None,
    });
    refused.collect()
}

/// Brings the plan in line with what was written.
fn reconcile(planned: &mut Plan, rewritten: &Rewritten, refused: &BTreeMap<u32, OutcomeReason>) {
    for (change, outcome) in planned.changes.iter().zip(&rewritten.outcomes) {
        let row = &mut planned.outcomes[change.motion as usize];
        let open = [OutcomeReason::UnknownStart, OutcomeReason::UncheckedPath];
        let is_sound =
            row.status == MotionStatus::Changed || row.reason().is_some_and(|reason| open.contains(&reason));
        if *outcome == RewriteOutcome::Unchanged && is_sound {
            row.status = MotionStatus::Left;
            row.reason = Some(Box::new(OutcomeReason::NoChange));
        }
        if let Some(reason) = refused.get(&change.motion) {
            row.status = MotionStatus::Refused;
            row.reason = Some(Box::new(*reason));
            row.after_mm = row.before_mm;
        }
    }
}
