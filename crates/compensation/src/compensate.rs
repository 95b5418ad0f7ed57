//! The main job: a program that was read, an arm and a cell in; the planned and the written program out.
//!
//! The plan says what shall change; the dialect that writes it may still refuse a motion, since no text of the language
//! carries the new value. Such a motion stays, and with it the cut that it is part of: the plan is made again without it,
//! until both agree. So what the report says is what was written.

use std::collections::BTreeMap;

use thiserror::Error;

use crate::cell::Cell;
use crate::cut::Cuts;
use crate::deviation::Status;
use crate::frames::taught::contradictions;
use crate::frames::undeclared;
use crate::options::Options;
use crate::plan::Plan;
use crate::plan::planner::SolvedProgram;
use crate::plan::reason::OutcomeReason;
use crate::plan::single_precision::single_precision;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::Estimated;
use truegrind_programs::edit::EditError;
use truegrind_programs::motion::{Listing, Mark, MotionKind, Reason};
use truegrind_programs::reading::{Language, Program};
use truegrind_programs::rewrite::{Outcome, RewriteOptions, Rewritten};

/// A program, corrected.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// What became of each motion, with what the writer refused.
    pub plan: Plan,
    /// The edits of each file; [`truegrind_programs::edit::Edits::apply`] makes the new bytes.
    pub rewritten: Rewritten,
}

impl Compensated {
    /// Whether a motion is rewritten.
    pub fn changed(&self) -> bool {
        self.plan.outcomes.iter().any(|outcome| matches!(outcome.status, Status::Changed | Status::Flagged))
    }
}

/// Why nothing was corrected.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CompensateError {
    /// Cell file and program contradict each other: sentences that name both.
    #[error("{0}")]
    Cell(String),
    /// Edits of one file overlap: a defect of the dialect, of which nothing must be written.
    #[error(transparent)]
    Edits(#[from] EditError),
}

/// Corrects a program so that the estimated arm follows it. `mark` is written into every file in which something changes.
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
    let listing = program.listing();
    let found = contradictions(listing, cell, &arm.nominal);
    if !found.is_empty() {
        return Err(CompensateError::Cell(found.join("; ")));
    }
    let partial = options.cuts == Cuts::Partial;
    let mark = mark.map(|mark| Mark { partial, ..mark });
    let rewrite = RewriteOptions { mark, ..RewriteOptions::default() };
    let mut targets = SolvedProgram::of(listing, arm, cell, options);
    let mut refused: BTreeMap<u32, OutcomeReason> = BTreeMap::new();
    let mut round = 0;
    let play =
        arm.model.effects.iter().any(|effect| matches!(effect, Effect::Backlash(_)) && !effect.is_zero());
    loop {
        let planned = targets.plan(&refused);
        if program.takes(&planned.changes) {
            // No second plan: what was worked out of the targets makes room for the edits.
            drop(targets);
            let rewritten = program.rewrite(&planned.changes, &rewrite)?;
            return Ok(agreed(planned, rewritten, &BTreeMap::new(), program));
        }
        let rewritten = program.rewrite(&planned.changes, &rewrite)?;
        let found = refusals(&planned, &rewritten, listing);
        // What is judged motion by motion needs no second plan, unless what stays changes from which sides joints with play
        // come to what follows; nor does a program of which nothing else could change.
        if found.is_empty() || options.cuts == Cuts::Single && !play {
            return Ok(agreed(planned, rewritten, &found, program));
        }
        for (motion, why) in found {
            refused.entry(motion).or_insert(why);
        }
        round += 1;
        if round >= MOST_ROUNDS
            && let Some((first, why)) = refused.iter().next()
        {
            // A program of which every round takes away another piece is left as it is.
            let line = listing.motions[*first as usize].place.line;
            let rest = OutcomeReason::PartOfCut { line, because: why.kind() };
            for change in &planned.changes {
                refused.entry(change.motion).or_insert(rest);
            }
        }
    }
}

/// Rounds of plan and writing before all that is still open is refused.
const MOST_ROUNDS: usize = 16;

/// The plan as it was written.
fn agreed(
    mut planned: Plan,
    rewritten: Rewritten,
    refused: &BTreeMap<u32, OutcomeReason>,
    program: &Program<'_>,
) -> Compensated {
    reconcile(&mut planned, &rewritten, refused);
    planned.notes.extend(undeclared::notes(program.listing(), program.language()));
    if program.language() == Language::Rapid
        && let Some(off) = single_precision(&planned.changes)
    {
        planned.notes.push(off.text());
    }
    Compensated { plan: planned, rewritten }
}

/// What the writer refused.
fn refusals(planned: &Plan, rewritten: &Rewritten, listing: &Listing) -> BTreeMap<u32, OutcomeReason> {
    let outcomes = planned.changes.iter().zip(&rewritten.outcomes);
    let refused = outcomes.filter_map(|(change, outcome)| match outcome {
        // An arc that no circle fits once it is written.
        Outcome::Refused(Reason::WrongShape)
            if listing.motions[change.motion as usize].kind == MotionKind::Circular =>
        {
            Some((change.motion, OutcomeReason::NoCircle))
        }
        Outcome::Refused(reason) => Some((change.motion, OutcomeReason::Program(*reason))),
        _ => None,
    });
    refused.collect()
}

/// Brings the plan in line with what was written.
fn reconcile(planned: &mut Plan, rewritten: &Rewritten, refused: &BTreeMap<u32, OutcomeReason>) {
    for (change, outcome) in planned.changes.iter().zip(&rewritten.outcomes) {
        let row = &mut planned.outcomes[change.motion as usize];
        if *outcome == Outcome::Unchanged && row.status == Status::Changed {
            row.status = Status::Left;
            row.reason = Some(OutcomeReason::NoChange);
        }
        if let Some(why) = refused.get(&change.motion) {
            row.status = Status::Refused;
            row.reason = Some(*why);
            row.after_mm = row.before_mm;
        }
    }
}
