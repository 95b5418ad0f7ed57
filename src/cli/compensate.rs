//! `truegrind compensate PROGRAM… --model MODEL.toml -o OUT`.

mod arguments;
pub(super) mod batch;
mod context;
mod outputs;
mod program;

use std::path::{Path, PathBuf};

use anyhow::bail;
use serde_json::Value;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::deviation::{After, PathReport, files_of};
use truegrind::compensation::plan::Plan;
use truegrind::compensation::risk::prepared_estimate::PreparedEstimate;
use truegrind::programs::reading::{Language, Program};
use truegrind::report::batch::Ended;
use truegrind::report::compensation::{self as view, ProgramFile};
use truegrind::units::key::sha256;

use self::batch::{BatchReports, ProgramResult};
use self::context::{CompensateContext, Corrector};
use self::outputs::{
    MISSING_OUTPUT, add_programs, output_files, refuse_file_for_folder, refuse_report_over_program,
    refuse_shared_output,
};
use self::program::rewrite_program;
use super::cell_arguments::note_unused_entries;
use super::computation::{on_threads, on_threads_that_wait};
use super::exit_status::ExitStatus;
use super::files::{self, Batch, read_log};
use super::inputs::{self, NamedModel, NamedRobot};
use super::programs::{self, Job, Programs};
use super::progress::Spinner;
use super::robot_match;
use super::shares::{RunDescription, Store, UnitSteps, Written, outputs_with, process_units};
use super::terminal::{print_message, print_message_lines, print_result};

pub(super) use self::arguments::Arguments;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let dry = arguments.writes_nothing();
    if !dry && arguments.output.is_none() {
        bail!(MISSING_OUTPUT);
    }
    let mut jobs = match arguments.shares.listed()? {
        Some(jobs) => jobs,
        None => programs::jobs(&arguments.programs, arguments.grouping)?,
    };
    refuse_shared_output(&jobs)?;
    refuse_file_for_folder(&jobs, arguments)?;
    let reports = arguments.report_files();
    let inputs_of: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    Batch::check(&inputs_of, &reports)?;
    if !dry {
        refuse_report_over_program(&jobs, arguments.output.as_deref(), &reports)?;
    }
    arguments.check_shares()?;
    if arguments.shares.on() {
        read_log::begin();
    }
    arguments.check_numbers()?;
    let model = inputs::model(&arguments.model)?;
    inputs::refuse_doubtful(&model, arguments.allow_doubtful)?;
    let stated = arguments.robot.named();
    refuse_compensating_controller(stated)?;
    let (robot, nominal) = inputs::nominal(&model, stated)?;
    let prepared = match &model {
        NamedModel::Nominal => None,
        NamedModel::Estimated { arm, .. } => Some(PreparedEstimate::of(arm)),
    };
    let corrector = match (&model, &prepared) {
        (NamedModel::Estimated { hash, arm, name }, Some(prepared)) => {
            debug_assert_eq!(nominal, arm.nominal);
            Some(Corrector { hash, model: name, arm, prepared })
        }
        _ => None,
    };
    if corrector.is_none() && arguments.outputs.rrd.is_some() {
        bail!("--rrd: the nominal arm has no deviation to show: give an estimated arm");
    }
    let (cell, surface, condition) = arguments.cell.read(corrector.map(|c| c.arm))?;
    robot_match::refuse_other_cell(&cell, &robot, &nominal)?;
    let is_rapid = |path: &PathBuf| Language::by_name(&files::name(path)) == Some(Language::Rapid);
    if jobs.iter().flat_map(|job| &job.paths).any(is_rapid)
        && let Ok(sheet) = inputs::robot(stated.unwrap_or(robot.as_str().into()))
    {
        robot_match::note_other_language(&sheet);
    }
    arguments.outputs.refuse_other_kinds()?;
    let options = arguments.options(condition, jobs.len());
    let mut setup = cell_setup(&cell);
    let single = matches!(jobs.as_slice(), [job] if job.under.is_none() || job.paths.len() > 1);
    let exits_after = single && !arguments.shares.on();
    let shared = read_log::finish();
    setup.called = programs::called(&jobs);
    let context = CompensateContext { arguments, corrector, cell, surface, setup, options, exits_after };
    if corrector.is_none() {
        let text = "model nominal: nothing to correct, every byte stays\n";
        if arguments.outputs.takes_stdout() || arguments.prints_program() {
            print_message_lines(text);
        } else {
            print_result(text)?;
        }
    }
    if let [job] = jobs.as_slice()
        && exits_after
    {
        return compensate_one(&context, job);
    }
    let store = if arguments.shares.on() {
        let description = RunDescription {
            verb: "compensate",
            options: match context.setup.called.is_empty() {
                true => arguments.relevant_options(),
                false => format!("{} {:?}", arguments.relevant_options(), context.setup.called),
            },
            shared,
            context: context.exit_criteria().to_value(),
            output: arguments.output.as_deref().filter(|_| !dry),
        };
        let Some(store) = Store::open(&arguments.shares, &description, &mut jobs)? else {
            return Ok(ExitStatus::Done);
        };
        Some(store)
    } else {
        None
    };
    compensate_many(&context, &jobs, store.as_ref())
}

/// One program with its own report.
fn compensate_one(context: &CompensateContext<'_>, job: &Job) -> anyhow::Result<ExitStatus> {
    let arguments = context.arguments;
    let outputs = &arguments.outputs;
    let programs = Programs::read(&job.paths)?;
    let targets = output_files(arguments, job, &programs, false)?;
    let inputs_of: Vec<&Path> = programs.files.iter().map(|(p, _)| p.as_path()).collect();
    let mut checked = arguments.report_files();
    if programs.files.len() == 1 {
        checked.extend(targets.iter().flatten().map(PathBuf::as_path));
    }
    Batch::check(&inputs_of, &checked)?;
    let mut batch = Batch::sparing(&inputs_of);
    // Printed after everything is written, since it lists the written files.
    let mut summary = None;
    let mut report = |planned: &mut Plan, program: &Program<'_>, files: &[ProgramFile]| {
        let listing = program.listing();
        summary = Some(view::summary(planned, listing, files));
        let report = PathReport {
            program: programs.name(),
            files: files_of(listing),
            model: context.corrector.map_or("nominal", |c| c.model).to_owned(),
            after: After::PredictedRemainder,
            missing: planned.missing_motions(listing),
            points: std::mem::take(&mut planned.points),
            differences: Vec::new(),
            between: None,
            held_out_mm: context.corrector.map(|c| c.arm.calibrated.held_out.rmse),
            turn_sigma_rad: None,
            assumptions: Vec::new(),
        };
        let reports = if context.corrector.is_some() { std::slice::from_ref(&report) } else { &[] };
        outputs.add_made(
            &mut batch,
            || view::document(planned, listing, files, reports),
            || truegrind::report::deviation::table(&report),
            || view::json(planned, listing, files),
        )?;
        #[cfg(feature = "visual")]
        if let (Some(path), Some(corrector)) = (&outputs.rrd, context.corrector) {
            let bytes = super::recording::path(
                &report.program,
                super::recording::Arms {
                    real: &corrector.arm.model,
                    is: "estimated arm",
                    nominal: &corrector.arm.nominal,
                    robot: arguments.robot.named(),
                },
                context.options.condition,
                reports,
                context.surface.as_ref(),
            )?;
            batch.add(path, bytes);
        }
        Ok(())
    };
    let work = Spinner::start(format!("rewriting {}", programs.name()));
    let done = on_threads(arguments.common.threads, || {
        rewrite_program(context, &programs, &targets, || drop(work), &mut report)
    })??;
    for note in &done.notes {
        print_message(format_args!("note: {note}"));
    }
    note_unused_entries([&done.used], &context.cell, context.surface.as_ref());
    if done.row.ended == Ended::Already {
        print_result(format!(
            "{}: already compensated with this model; nothing written. Lines that were added or changed since belong into the original: compensate that \
             one again\n",
            done.row.file
        ))?;
        return Ok(context.exit_criteria().exit_status(done.clean, done.changed));
    }
    if let Some(path) = &arguments.diff {
        batch.add(path, done.diff);
    }
    add_programs(&mut batch, done.written, programs.files.len() > 1)?;
    batch.write()?;
    if let Some(summary) = &summary {
        outputs.print_beside(summary, arguments.prints_program())?;
    }
    Ok(context.exit_criteria().exit_status(done.clean, done.changed))
}

/// Many programs in parallel, each written on its own; one table for all. A program that fails does not stop the others.
fn compensate_many(
    context: &CompensateContext<'_>,
    jobs: &[Job],
    store: Option<&Store>,
) -> anyhow::Result<ExitStatus> {
    let arguments = context.arguments;
    #[cfg(feature = "visual")]
    if arguments.outputs.rrd.is_some() {
        bail!("--rrd shows one program: name one");
    }
    let work = Spinner::start(format!("rewriting {} programs", jobs.len()));
    let steps = UnitSteps {
        read: |job: &Job| Programs::read(&job.paths),
        content: Programs::content,
        work: |job: &Job, programs: Programs| compensate_and_write(context, job, &programs),
        whole: arguments.outputs.pages.json.is_some(),
    };
    let done: Vec<ProgramResult> =
        on_threads_that_wait(arguments.common.threads, || process_units(store, jobs, &steps))??;
    drop(work);
    for done in &done {
        for note in &done.notes {
            print_message(format_args!("note: {}: {note}", done.row.file));
        }
    }
    if store.is_none() {
        note_unused_entries(done.iter().map(|done| &done.used), &context.cell, context.surface.as_ref());
    }
    let undeclared: usize = done.iter().map(|done| done.undeclared).sum();
    let module = |path: &PathBuf| Language::by_name(&files::name(path)) == Some(Language::Rapid);
    let alone = |job: &Job| job.under.is_some() && job.paths.len() == 1 && job.paths.iter().any(module);
    if undeclared > 0 && jobs.iter().any(alone) {
        print_message(format_args!(
            "note: {} tools, work objects or targets that their own file does not declare: if the modules of a folder run together, \
             --together reads them as one task",
            if undeclared == 1 { "1 motion uses".to_owned() } else { format!("{undeclared} motions use") }
        ));
    }
    let inputs = jobs.iter().flat_map(|job| &job.paths);
    let outputs = outputs_with(store, &arguments.shares, &arguments.outputs)?;
    let reports = BatchReports {
        outputs: &outputs,
        diff: arguments.diff.as_deref(),
        criteria: context.exit_criteria(),
    };
    reports.write(done, Batch::sparing(inputs), store.is_some())
}

/// Rewrites and writes one program of many.
fn compensate_and_write(
    context: &CompensateContext<'_>,
    job: &Job,
    programs: &Programs,
) -> anyhow::Result<(ProgramResult, Written)> {
    let targets = output_files(context.arguments, job, programs, true)?;
    let with_json = context.arguments.needs_motions();
    let mut entries = with_json.then(Vec::new);
    let mut report = |planned: &mut Plan, program: &Program<'_>, files: &[ProgramFile]| {
        if with_json
            && let Value::Object(mut all) = view::json(planned, program.listing(), files)
            && let Some(Value::Array(list)) = all.remove("programs")
        {
            entries = Some(list);
        }
        Ok(())
    };
    let mut done = rewrite_program(context, programs, &targets, || (), &mut report)?;
    done.json = entries;
    if job.under.is_some() && job.paths.len() > 1 {
        done.row.file = job.name();
    }
    let shared = context.arguments.shares.on();
    let mut batch = Batch::sparing(programs.files.iter().map(|(path, _)| path)).synced_later(shared);
    let made = std::mem::take(&mut done.written);
    let hash = |(path, bytes): &(PathBuf, Vec<u8>)| (path.clone(), sha256(bytes));
    let written = if shared { made.iter().map(hash).collect() } else { Vec::new() };
    add_programs(&mut batch, made, true)?;
    batch.write()?;
    Ok((done, written))
}

/// Refuses a robot whose controller already compensates.
fn refuse_compensating_controller(stated: Option<NamedRobot<'_>>) -> anyhow::Result<()> {
    if let Some(named) = stated {
        let robot = inputs::robot(named)?;
        if robot.sheet.compensates {
            bail!(
                "{}: its controller already compensates (robot file, `compensates = true`); switch one of the two off",
                robot.sheet.name
            );
        }
    }
    Ok(())
}
