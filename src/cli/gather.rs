//! `truegrind gather FOLDER`: what the jobs of a shared run made, put together as one run writes it.
//!
//! Which records count is told by the inputs as they are now: a unit whose files changed since it was done counts as missing, and
//! nothing stale gets into a table.

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
use super::shares::{Kept, Store};
use super::{compensate, deviation, fleet};

/// Arguments of `gather`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The folder in which the jobs kept what is done: that of --work, else of -o. It is called from where the jobs were.
    #[arg(value_name = "FOLDER")]
    work: PathBuf,
    /// What changes in all programs, as a unified diff, where every job made one.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    diff: Option<PathBuf>,
    /// Threads; the result is the same for any number.
    #[arg(long)]
    threads: Option<usize>,
    #[command(flatten)]
    pages: Pages,
}

/// What became of a unit.
enum State<T> {
    Done(T),
    Missing,
    /// Outputs are not as they were written.
    Changed(Vec<PathBuf>),
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let outputs = Outputs::from(&arguments.pages);
    let (store, run) = Store::of(&arguments.work)?;
    if run.version != env!("CARGO_PKG_VERSION") {
        bail!(
            "{}: the run is of version {}, this is {}: gather with the version that made it, or do it again",
            arguments.work.display(),
            run.version,
            env!("CARGO_PKG_VERSION")
        );
    }
    if arguments.diff.is_some() && run.verb != "compensate" {
        bail!("--diff: {} rewrites nothing", run.verb);
    }
    let jobs: Vec<Job> = run.units.iter().map(Job::of_unit).collect();
    let inputs: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    let mut targets = outputs.files();
    targets.extend(arguments.diff.as_deref());
    Batch::check(&inputs, &targets)?;
    let here = Here { arguments, store: &store, run: &run, jobs: &jobs };
    let batch = || Batch::sparing(inputs.iter());
    match run.verb.as_str() {
        "compensate" => {
            let records = here.records(outputs.pages.json.is_some(), programs)?;
            compensate::batch::gathered(records, &run.context, &outputs, arguments.diff.as_deref(), batch())
        }
        "deviation" => deviation::gathered(here.records(true, programs)?, &outputs, batch()),
        "diagnose" => fleet::gathered(here.records(true, tables)?, &outputs, batch()),
        verb => bail!("{}: a run of `{verb}`, which is not known", arguments.work.display()),
    }
}

/// The files of a unit by name and content; `None` where one cannot be read.
type Content = Option<Vec<(String, String)>>;

fn programs(job: &Job) -> Content {
    Programs::read(&job.paths).ok().map(|programs| programs.content())
}

fn tables(job: &Job) -> Content {
    let read = |path: &PathBuf| Ok((path.display().to_string(), sha256(&files::read(path)?)));
    job.paths.iter().map(read).collect::<anyhow::Result<_>>().ok()
}

/// A run whose units are looked at.
struct Here<'a> {
    arguments: &'a Arguments,
    store: &'a Store,
    run: &'a Run,
    jobs: &'a [Job],
}

impl Here<'_> {
    /// What was kept of all units, in their order. Each is read into what its verb makes of it and nothing else, since all of them
    /// are held at once.
    fn records<T: Kept>(
        &self,
        whole: bool,
        content: impl Fn(&Job) -> Content + Sync,
    ) -> anyhow::Result<Vec<T>> {
        let state = |job: &Job| state(self.store, job, content(job).as_deref(), whole);
        let states = on_threads(self.arguments.threads, || {
            self.jobs.par_iter().map(state).collect::<anyhow::Result<Vec<_>>>()
        })??;
        complete(self.run, self.jobs, &states)?;
        let done = states.into_iter().filter_map(|state| match state {
            State::Done(record) => Some(record),
            _ => None,
        });
        Ok(done.collect())
    }
}

fn state<T: Kept>(
    store: &Store,
    job: &Job,
    content: Option<&[(String, String)]>,
    whole: bool,
) -> anyhow::Result<State<T>> {
    let Some(done) = store.record::<T>(&store.key(job, content), whole)? else { return Ok(State::Missing) };
    let changed = if done.ended == Ended::Done { store.changed(&done) } else { Vec::new() };
    Ok(if changed.is_empty() { State::Done(done.record) } else { State::Changed(changed) })
}

/// Units that are named one by one.
const NAMED: usize = 50;

/// Refuses a run of which anything is missing, and says what, by shares where there were some.
fn complete<T>(run: &Run, jobs: &[Job], states: &[State<T>]) -> anyhow::Result<()> {
    let mut open: Vec<(Option<u32>, String)> = Vec::new();
    for (job, state) in jobs.iter().zip(states) {
        let what = match state {
            State::Done(_) => continue,
            State::Missing => job.name(),
            State::Changed(places) => {
                let places: Vec<String> = places.iter().map(|place| place.display().to_string()).collect();
                format!("{} (not as it was written: {})", job.name(), places.join(", "))
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
    let more = lines.len().saturating_sub(NAMED);
    lines.truncate(NAMED);
    if more > 0 {
        lines.push(format!("and {more} more"));
    }
    bail!(
        "{} of {} are not done, or were changed since; nothing was gathered. Run the same jobs again with --resume:\n{}",
        open.len(),
        jobs.len(),
        lines.join("\n")
    )
}
