//! `truegrind gather FOLDER`: combines the results of the jobs of a shared run.
//!
//! Records are looked up by the current content of the inputs: a unit whose files changed since counts as missing, so that no
//! stale result gets into a table.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::Args;
use rayon::prelude::*;
use truegrind::units::done::Ended;
use truegrind::units::key::sha256;
use truegrind::units::run::Run;
use truegrind::units::share::Share;

use super::computation::on_threads;
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::outputs::{Outputs, Pages};
use super::programs::{Job, Programs};
use super::shares::{Store, UnitResult};
use super::{compensate, deviation, fleet};

/// Arguments of `gather`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Folder of the run: that of --work, or else of -o. Start gather in the same directory as the jobs.
    #[arg(value_name = "FOLDER")]
    work: PathBuf,
    /// Write the changes of all programs as a unified diff, if every job was run with --diff.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    diff: Option<PathBuf>,
    /// Number of threads; the result does not depend on it.
    #[arg(long)]
    threads: Option<usize>,
    #[command(flatten)]
    pages: Pages,
}

/// State of a unit.
enum UnitState<T> {
    Done(T),
    Missing,
    /// Outputs changed after they were written.
    Changed(Vec<PathBuf>),
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let outputs = Outputs::from(&arguments.pages);
    if arguments.work.is_file() {
        bail!(
            "{}: is a file; expected the folder of a run (compensate, deviation or diagnose with --shard or --resume)",
            arguments.work.display()
        );
    }
    let (store, run) = Store::open_existing(&arguments.work)?;
    if run.version != env!("CARGO_PKG_VERSION") {
        bail!(
            "{}: the run was made by version {}, this is {}: gather with that version, or repeat the run",
            arguments.work.display(),
            run.version,
            env!("CARGO_PKG_VERSION")
        );
    }
    if arguments.diff.is_some() && run.verb != "compensate" {
        bail!("--diff: `{}` rewrites nothing", run.verb);
    }
    let jobs: Vec<Job> = run.units.iter().map(Job::of_unit).collect();
    let inputs: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    let mut targets = outputs.files();
    targets.extend(arguments.diff.as_deref());
    Batch::check(&inputs, &targets)?;
    outputs.refuse_other_kinds()?;
    let context = GatherContext { arguments, store: &store, run: &run, jobs: &jobs };
    let batch = || Batch::sparing(inputs.iter());
    match run.verb.as_str() {
        "compensate" => {
            let records = context.records(outputs.pages.json.is_some(), programs)?;
            compensate::batch::gathered(records, &run.context, &outputs, arguments.diff.as_deref(), batch())
        }
        "deviation" => deviation::gathered(context.records(true, programs)?, &outputs, batch()),
        "diagnose" => fleet::gathered(context.records(true, tables)?, &outputs, batch()),
        verb => bail!("{}: a run of the unknown verb `{verb}`", arguments.work.display()),
    }
}

/// Name and SHA-256 of each file of a unit; `None` if one cannot be read.
type Content = Option<Vec<(String, String)>>;

fn programs(job: &Job) -> Content {
    Programs::read(&job.paths).ok().map(|programs| programs.content())
}

fn tables(job: &Job) -> Content {
    let read = |path: &PathBuf| Ok((path.display().to_string(), sha256(&files::read(path)?)));
    job.paths.iter().map(read).collect::<anyhow::Result<_>>().ok()
}

/// A run with its units.
struct GatherContext<'a> {
    arguments: &'a Arguments,
    store: &'a Store,
    run: &'a Run,
    jobs: &'a [Job],
}

impl GatherContext<'_> {
    /// The records of all units, in order. Each is deserialised directly into the type of its verb to save memory.
    fn records<T: UnitResult>(
        &self,
        whole: bool,
        content: impl Fn(&Job) -> Content + Sync,
    ) -> anyhow::Result<Vec<T>> {
        let state = |job: &Job| state(self.store, job, content(job).as_deref(), whole);
        let states = on_threads(self.arguments.threads, || {
            self.jobs.par_iter().map(state).collect::<anyhow::Result<Vec<_>>>()
        })??;
        check_complete(self.run, self.jobs, &states)?;
        let done = states.into_iter().filter_map(|state| match state {
            UnitState::Done(record) => Some(record),
            _ => None,
        });
        Ok(done.collect())
    }
}

fn state<T: UnitResult>(
    store: &Store,
    job: &Job,
    content: Option<&[(String, String)]>,
    whole: bool,
) -> anyhow::Result<UnitState<T>> {
    let Some(done) = store.record::<T>(&store.key(job, content), whole)? else {
        return Ok(UnitState::Missing);
    };
    let changed = if done.ended == Ended::Done { store.changed(&done) } else { Vec::new() };
    Ok(if changed.is_empty() { UnitState::Done(done.record) } else { UnitState::Changed(changed) })
}

/// Largest number of listed units.
const MAX_LISTED: usize = 50;

/// Refuses an incomplete run, and lists what is missing by share.
fn check_complete<T>(run: &Run, jobs: &[Job], states: &[UnitState<T>]) -> anyhow::Result<()> {
    let mut open: Vec<(Option<u32>, String)> = Vec::new();
    for (job, state) in jobs.iter().zip(states) {
        let what = match state {
            UnitState::Done(_) => continue,
            UnitState::Missing => job.name(),
            UnitState::Changed(paths) => {
                let paths: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
                format!("{} (outputs changed after they were written: {})", job.name(), paths.join(", "))
            }
        };
        open.push((run.shares.map(|of| Share::of_name(&job.name_below(), of)), what));
    }
    if open.is_empty() {
        return Ok(());
    }
    open.sort_by_key(|(share, _)| *share);
    let mut lines = Vec::new();
    for group in open.chunk_by(|a, b| a.0 == b.0) {
        let names: Vec<&str> = group.iter().map(|(_, what)| what.as_str()).collect();
        if let (Some(number), Some(of)) = (group.first().and_then(|(share, _)| *share), run.shares) {
            let in_it = |job: &&Job| Share { number, of }.has(&job.name_below());
            lines.push(format!(
                "share {number}/{of}, {} of {}:",
                names.len(),
                jobs.iter().filter(in_it).count()
            ));
        }
        lines.extend(names.iter().map(|name| format!("  {name}")));
    }
    let more = lines.len().saturating_sub(MAX_LISTED);
    lines.truncate(MAX_LISTED);
    if more > 0 {
        lines.push(format!("and {more} more"));
    }
    bail!(
        "{} of {} units are missing or were changed since; nothing was gathered. Run the same jobs again with --resume:\n{}",
        open.len(),
        jobs.len(),
        lines.join("\n")
    )
}
