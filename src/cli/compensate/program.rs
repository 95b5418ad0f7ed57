//! Rewriting of one program: marks of earlier runs, plan, edits, result.

use std::path::PathBuf;

use anyhow::bail;
use truegrind::compensation::cell::Used;
use truegrind::compensation::cell::robot_match::unreachable_motions;
use truegrind::compensation::compensate::{Compensated, compensate_prepared};
use truegrind::compensation::frames::surface_frames::surface_frame_contradictions;
use truegrind::compensation::options::Options;
use truegrind::compensation::plan::Plan;
use truegrind::compensation::plan::listing_only_plan::listing_only_plan;
use truegrind::compensation::plan::reason::OutcomeReason;
use truegrind::programs::diff::unified;
use truegrind::programs::motion::{Listing, Mark, Reason};
use truegrind::programs::reading::{Language, Program};
use truegrind::programs::rewrite::{FileEdits, RewriteOptions};
use truegrind::report::batch::{Ended, Row};
use truegrind::report::compensation::{self as view, ProgramFile};
use truegrind::report::status::Status as Judged;

use super::batch::ProgramResult;
use super::context::CompensateContext;
use crate::cli::files;
use crate::cli::programs::Programs;
use crate::cli::robot_match;

/// Makes reports from the plan before it is dropped.
pub(super) type Report<'r> = &'r mut dyn FnMut(&mut Plan, &Program<'_>, &[ProgramFile]) -> anyhow::Result<()>;

/// Plans and rewrites one program. `planned` is called once the plan is final, `report` with the plan.
pub(super) fn rewrite_program(
    context: &CompensateContext<'_>,
    programs: &Programs,
    targets: &[Option<PathBuf>],
    planned: impl FnOnce(),
    report: Report<'_>,
) -> anyhow::Result<ProgramResult> {
    let mut program = programs.task(&context.setup);
    let loads = context.arguments.cell.loads(&program);
    // The syntax trees are larger than the file and not needed once the motions are listed.
    program.drop_trees();
    let program = program;
    let listing = program.listing();
    let mut notes = Vec::new();
    check_motions(context, programs, listing, &mut notes)?;
    let names = programs.files.iter().map(|(path, _)| path.display().to_string()).collect::<Vec<_>>();
    // Where nothing was to be written, that nothing is to be corrected is what was hoped for.
    let nothing_to_do = |notes: Vec<String>| ProgramResult {
        clean: context.arguments.check,
        ..ProgramResult::empty(Row::without(names.join(", "), Ended::Already, None), notes)
    };
    let marked = already_corrected(context, &program, programs, &mut notes)?;
    if marked.iter().all(|marked| *marked) {
        return Ok(nothing_to_do(notes));
    }
    refuse_other_robot_or_surface(context, programs, listing)?;
    let used = Some(Used::by(listing, &context.cell));
    let Compensated { mut plan, rewritten } =
        compensated(context, &program, Options { loads, ..context.options.clone() })?;
    refuse_unreachable(context, programs, &plan, listing)?;
    if marked.contains(&true) {
        // Modules without a mark have nothing to correct, or were missing when the others were corrected.
        let mut files = rewritten.files.iter().zip(&marked);
        let open = files.position(|(file, marked)| !marked && !file.edits.is_empty());
        let Some(open) = open else { return Ok(nothing_to_do(notes)) };
        let done = marked.iter().position(|marked| *marked).unwrap_or(0);
        bail!(
            "{0} is already compensated with this model, {1} is not: give the original of {0}",
            names[done],
            names[open]
        );
    }
    planned();
    if let Some(surface) = &context.surface {
        plan.add_normals(surface);
    }
    let mut result = apply_edits(context, programs, &rewritten.files, targets, notes)?;
    let files: Vec<ProgramFile> = names
        .iter()
        .zip(targets)
        .zip(&rewritten.files)
        .map(|((name, target), rewritten)| ProgramFile {
            file: name.clone(),
            output: target.as_ref().map(|t| t.display().to_string()),
            unchanged: rewritten.edits.is_empty(),
        })
        .collect();
    let outputs: Vec<&str> = files.iter().filter_map(|file| file.output.as_deref()).collect();
    let output = Some(outputs.join(", ")).filter(|output| !output.is_empty());
    let ended = if result.changed { Ended::Changed } else { Ended::Unchanged };
    result.row = Row::of(names.join(", "), output, ended, &plan, listing);
    let undeclared =
        [Reason::Undeclared, Reason::ToolUnknown, Reason::LengthAllowance, Reason::WorkObjectUnknown]
            .map(OutcomeReason::Program);
    result.undeclared = plan
        .outcomes
        .iter()
        .filter(|o| o.reason().is_some_and(|reason| undeclared.contains(&reason)))
        .count();
    result.clean = is_clean(context, &plan, listing, result.changed);
    result.used = used;
    report(&mut plan, &program, &files)?;
    if context.exits_after {
        // Freeing a million small allocations just before exit would take a tenth of the total time.
        std::mem::forget((program, plan, rewritten));
    }
    Ok(result)
}

/// Refuses a program whose motions the robot of the model cannot reach.
fn refuse_unreachable(
    context: &CompensateContext<'_>,
    programs: &Programs,
    plan: &Plan,
    listing: &Listing,
) -> anyhow::Result<()> {
    let (Some(found), Some(corrector)) = (unreachable_motions(plan), context.corrector) else {
        return Ok(());
    };
    if let Some((motion, error)) = found.example.filter(|_| 2 * found.other_configuration > found.count) {
        bail!(
            "{}: {} of the motions are in reach of {} only in other configurations than the program states (line {}: {error}): \
             correct the configuration data, or use the model of the robot that runs it ({})",
            programs.name(),
            found.other_configuration,
            corrector.arm.robot,
            listing.motions[motion as usize].place.line,
            corrector.model
        );
    }
    let motions = found.count;
    bail!(
        "{}: hardly any of the {motions} motions is in reach of {} ({}): the program belongs to another robot, or its tool \
         and work object are somewhere else (--cell); use the model of the robot that runs it",
        programs.name(),
        corrector.arm.robot,
        corrector.model
    );
}

/// Refuses a program of another robot, and one whose frames contradict the surface.
fn refuse_other_robot_or_surface(
    context: &CompensateContext<'_>,
    programs: &Programs,
    listing: &Listing,
) -> anyhow::Result<()> {
    let Some(corrector) = context.corrector else { return Ok(()) };
    robot_match::refuse_other_program(programs, &corrector.arm.robot, &corrector.arm.nominal)?;
    let contradictions = |surface| surface_frame_contradictions(listing, surface);
    let found: Vec<String> = context.surface.iter().flat_map(contradictions).collect();
    if !found.is_empty() {
        bail!("{}: {}", programs.name(), found.join("; "));
    }
    Ok(())
}

/// Refuses a file that is no program, and notes a program without motions.
fn check_motions(
    context: &CompensateContext<'_>,
    programs: &Programs,
    listing: &Listing,
    notes: &mut Vec<String>,
) -> anyhow::Result<()> {
    if !listing.motions.is_empty() {
        return Ok(());
    }
    let known = programs.files.iter().any(|(path, _)| Language::by_name(&files::name(path)).is_some());
    if !known && context.corrector.is_some() {
        programs.refuse_other_kinds()?;
        bail!(
            "{}: no motion found, and the file extension is not known: expected RAPID (.mod, .prg, .sys, .pgf) or NC code (.nc, \
             .mpf, .h and others)",
            programs.name()
        );
    }
    notes.push(match listing.opaque.len() {
        0 => format!("{}: contains no motion, nothing to correct", programs.name()),
        1 => format!("{}: no motion found; 1 region could not be read", programs.name()),
        unread => format!("{}: no motion found; {unread} regions could not be read", programs.name()),
    });
    Ok(())
}

/// For each file, whether it carries the mark of this model. A mark of another model is an error without `--again`.
fn already_corrected(
    context: &CompensateContext<'_>,
    program: &Program<'_>,
    programs: &Programs,
    notes: &mut Vec<String>,
) -> anyhow::Result<Vec<bool>> {
    let mut marked = vec![false; programs.files.len()];
    let Some(corrector) = context.corrector else { return Ok(marked) };
    for (index, (mark, (path, _))) in program.listing().marks.iter().zip(&programs.files).enumerate() {
        let Some(mark) = mark else { continue };
        if mark.model == corrector.hash {
            marked[index] = true;
            continue;
        }
        if !context.arguments.again {
            bail!(
                "{}: already compensated with another model ({}): use the original program, or --again to add this correction \
                 to that one",
                path.display(),
                mark.model
            );
        }
        notes.push(format!(
            "{}: compensated before with model {}; corrections add up",
            path.display(),
            mark.model
        ));
    }
    Ok(marked)
}

/// Plan and edits; without a corrector everything is listed and nothing edited.
fn compensated(
    context: &CompensateContext<'_>,
    program: &Program<'_>,
    options: Options,
) -> anyhow::Result<Compensated> {
    let Some(corrector) = context.corrector else {
        return Ok(Compensated {
            plan: listing_only_plan(program.listing(), &options),
            rewritten: program.rewrite(&[], &RewriteOptions::default())?,
        });
    };
    let mark = Mark {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        model: corrector.hash.to_owned(),
        partial: false,
    };
    Ok(compensate_prepared(program, corrector.prepared, &context.cell, &options, Some(mark))?)
}

/// The bytes of the output files and the diff.
fn apply_edits(
    context: &CompensateContext<'_>,
    programs: &Programs,
    edits: &[FileEdits],
    targets: &[Option<PathBuf>],
    notes: Vec<String>,
) -> anyhow::Result<ProgramResult> {
    let mut result = ProgramResult::empty(Row::without(String::new(), Ended::Unchanged, None), notes);
    for (((path, source), edits), target) in programs.files.iter().zip(edits).zip(targets) {
        result.changed |= !edits.edits.is_empty();
        if edits.unmarked {
            result.notes.push("a fragment without MODULE was changed and carries no mark".to_owned());
        }
        if context.arguments.diff.is_some() {
            let old = path.display().to_string();
            let new = target.as_ref().map_or_else(|| old.clone(), |t| t.display().to_string());
            result.diff.extend(unified(source, &edits.edits, &old, &new)?);
        }
        if let Some(target) = target {
            result.written.push((target.clone(), edits.edits.apply(source)?));
        }
    }
    Ok(result)
}

/// Whether the program may run without a look at the report.
fn is_clean(context: &CompensateContext<'_>, plan: &Plan, listing: &Listing, changed: bool) -> bool {
    if context.corrector.is_none() {
        return true;
    }
    if listing.motions.is_empty() {
        return listing.opaque.is_empty();
    }
    if context.arguments.check && !changed {
        return plan.outcomes.iter().all(|o| o.reason() == Some(OutcomeReason::NoChange));
    }
    view::verdict(plan, listing, true).status == Judged::Good
}
