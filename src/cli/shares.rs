//! Runs that are split over several jobs, on one machine or many, and that can be resumed: `--shard`, `--resume`.
//!
//! Jobs share nothing but a folder. There `run.json` lists all units, `done/KEY.json` is the record of a finished unit, `begun/`
//! marks unfinished units, and `tables/` has the table of each share. Two jobs that process the same unit at the same time write the
//! same bytes. New outputs and records are synced together at the end of a job: an output torn by a machine crash before that does
//! not match its record, and is made again.
//!
//! A unit may crash its whole process (memory, stack). The next job over the same units sees that an earlier one did not finish,
//! and from then on marks each unit that it begins. A unit that was begun but not finished is processed last and alone, and after
//! [`MAX_ATTEMPTS`] attempts it is listed as failed. Jobs that do not crash write no marks.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use rayon::prelude::*;
use serde_json::Value;
use truegrind::units::done::{Ended, Output, Recorded, SCHEMA};
use truegrind::units::key;
use truegrind::units::run::{self, Run, Unit};
use truegrind::units::share::Share;

use super::defect::catch_panic;
use super::files::sync::sync_folder;
use super::files::{self, run_files};
use super::outputs::Outputs;
use super::programs::Job;
use super::terminal::print_message;

/// Attempts before a unit that crashes its process is listed as failed.
const MAX_ATTEMPTS: u32 = 3;

/// Folder of the tables of the shares, and prefix of their names.
const TABLES: &str = "tables";
const TABLE: &str = "share-";

/// Options for splitting a run over several jobs; see README and deploy/.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Several jobs, on one machine or many")]
pub(super) struct Shares {
    /// Process only share I of N (counted from 1) of the programs or arms; the file names determine the shares. `truegrind gather`
    /// combines the results. The table of the share is written to tables/ in the folder of the run as Parquet, unless --parquet
    /// names another file.
    #[arg(long, value_name = "I/N", conflicts_with = "units")]
    shard: Option<Share>,
    /// Skip units already processed with the same inputs, model, cell, options and version whose outputs are unchanged.
    #[arg(long)]
    resume: bool,
    /// Folder in which the jobs of a run keep their records. Default: that of -o.
    #[arg(long, value_name = "FOLDER")]
    work: Option<PathBuf>,
    /// Process only the units in this file, a JSON list like `units` in run.json; `-` reads stdin. No folder is searched.
    #[arg(long, value_name = "FILE")]
    units: Option<PathBuf>,
    /// Only write run.json, the list of all units.
    #[arg(long, conflicts_with_all = ["shard", "units", "resume"])]
    list_units: bool,
}

impl Shares {
    /// Whether the run keeps records.
    pub(super) fn on(&self) -> bool {
        self.shard.is_some() || self.resume || self.work.is_some() || self.units.is_some() || self.list_units
    }

    /// The units listed by `--units`, if given.
    pub(super) fn listed(&self) -> anyhow::Result<Option<Vec<Job>>> {
        let Some(path) = &self.units else { return Ok(None) };
        let bytes = if path == Path::new("-") { files::read_stdin()? } else { files::read(path)? };
        let units: Vec<Unit> = serde_json::from_slice(&bytes).map_err(|error| {
            anyhow!(
                "{}: {}; expected a list such as [{{\"under\": \"folder\", \"paths\": [\"folder/a.mod\"]}}]",
                path.display(),
                misread(&error)
            )
        })?;
        let jobs: Vec<Job> = units.iter().map(Job::of_unit).collect();
        for path in jobs.iter().flat_map(|job| &job.paths) {
            files::expect(path)?;
        }
        Ok(Some(jobs))
    }
}

/// Where and why a list of units cannot be read, without the names of the program's own types.
fn misread(error: &serde_json::Error) -> String {
    let what = match error.classify() {
        serde_json::error::Category::Data => "this is no list of units",
        serde_json::error::Category::Eof => "the text ends too early",
        _ => "this is not JSON",
    };
    format!("line {}, column {}: {what}", error.line(), error.column())
}

/// The result of a unit, with its record.
pub(super) trait UnitResult: Sized + Send {
    /// The result of a unit that failed.
    fn failed(job: &Job, reason: &str) -> Self;
    /// Whether the unit failed.
    fn is_failed(&self) -> bool;
    /// The record as JSON, bit-exact.
    fn record(&self) -> anyhow::Result<String>;
    /// Reads the record with this key; `None` if it is incomplete or of another verb. `whole`: including what only --json shows, which
    /// is large in a run over a million units.
    fn read(bytes: &[u8], key: &str, whole: bool) -> Option<Recorded<Self>>;
    /// Drops what [`UnitResult::read`] reads only if `whole`.
    fn lighten(&mut self) {}
}

/// Written files with the SHA-256 of their bytes.
pub(super) type Written = Vec<(PathBuf, String)>;

/// How a verb reads and processes a unit.
pub(super) struct UnitSteps<R, C, W> {
    /// Reads its files.
    pub(super) read: R,
    /// Name and SHA-256 of each file; see [`key::of_unit`].
    pub(super) content: C,
    /// Processes it and writes its outputs.
    pub(super) work: W,
    /// Whether the reports of this job need whole results; see [`UnitResult::read`].
    pub(super) whole: bool,
}

/// Processes all units in parallel; an error or panic in one does not affect the others.
pub(super) fn process_units<I, T, R, C, W>(
    store: Option<&Store>,
    jobs: &[Job],
    steps: &UnitSteps<R, C, W>,
) -> anyhow::Result<Vec<T>>
where
    T: UnitResult,
    R: Fn(&Job) -> anyhow::Result<I> + Sync,
    C: Fn(&I) -> Vec<(String, String)> + Sync,
    W: Fn(&Job, I) -> anyhow::Result<(T, Written)> + Sync,
{
    let Some(store) = store else {
        let one = |job: &Job| catch_panic(|| (steps.work)(job, (steps.read)(job)?));
        let failed = |job: &Job, error: anyhow::Error| T::failed(job, &format!("{error:#}"));
        let each =
            jobs.par_iter().map(|job| one(job).map_or_else(|error| failed(job, error), |(done, _)| done));
        return Ok(each.collect());
    };
    let session = JobSession::enter(store, jobs)?;
    let first = jobs
        .par_iter()
        .map(|job| session.resume_or_process(job, steps, false))
        .collect::<anyhow::Result<Vec<_>>>()?;
    // Units that were begun before but not finished may crash the process: last and alone.
    let each = first.into_iter().zip(jobs).map(|(done, job)| match done {
        Some(done) => Ok(done),
        None => {
            session.resume_or_process(job, steps, true)?.ok_or_else(|| anyhow!("{}: skipped", job.name()))
        }
    });
    let done = each.collect::<anyhow::Result<Vec<_>>>()?;
    store.folders.iter().try_for_each(|folder| sync_folder(folder))?;
    run_files::remove(&session.note);
    Ok(done)
}

/// The records of a run.
#[derive(Debug)]
pub(super) struct Store {
    work: PathBuf,
    run: String,
    resume: bool,
    /// Folders in which a job writes.
    folders: Vec<PathBuf>,
}

/// Everything that defines a run.
pub(super) struct RunDescription<'a> {
    /// The verb.
    pub(super) verb: &'a str,
    /// All options that influence the outputs, as text.
    pub(super) options: String,
    /// SHA-256 of each file that all units use.
    pub(super) shared: Vec<String>,
    /// Further data for the reports.
    pub(super) context: Value,
    /// The folder of -o, if given.
    pub(super) output: Option<&'a Path>,
}

impl Store {
    /// Opens the folder, writes `run.json`, and reduces `jobs` to the share of this job. `None` for `--list-units`.
    pub(super) fn open(
        shares: &Shares,
        description: &RunDescription<'_>,
        jobs: &mut Vec<Job>,
    ) -> anyhow::Result<Option<Self>> {
        let Some(work) = shares.work.as_deref().or(description.output) else {
            bail!("--work FOLDER is missing: the folder in which the jobs of this run keep their records");
        };
        let run = key::of_run(
            description.verb,
            &description.options,
            description.shared.iter().map(String::as_str),
        );
        for folder in ["done", "begun"] {
            files::make_folder(&work.join(folder))?;
        }
        let mut folders = vec![work.to_path_buf()];
        folders.extend(description.output.filter(|output| *output != work).map(Path::to_path_buf));
        let store = Self { work: work.to_path_buf(), run, resume: shares.resume, folders };
        if shares.units.is_none() {
            store.list(shares, description, jobs)?;
        }
        if shares.list_units {
            return Ok(None);
        }
        if let Some(share) = shares.shard {
            let all = jobs.len();
            jobs.retain(|job| share.has(&job.name_below()));
            print_message(format_args!("share {} of {}: {} of {all}", share.number, share.of, jobs.len()));
        }
        Ok(Some(store))
    }

    /// The outputs of this job: by default the table of a share goes to the folder of the run.
    fn outputs(&self, shares: &Shares, requested: &Outputs) -> anyhow::Result<Outputs> {
        let mut outputs = requested.clone();
        if let (true, Some(share), None) = (cfg!(feature = "parquet"), shares.shard, &requested.pages.parquet)
        {
            let tables = self.work.join(TABLES);
            files::make_folder(&tables)?;
            // Zero-padded, so that sorting by name sorts by number.
            let wide = share.of.to_string().len();
            let name = format!("{TABLE}{:0wide$}-of-{}.parquet", share.number, share.of);
            outputs.pages.parquet = Some(tables.join(name));
        }
        Ok(outputs)
    }

    /// Opens the folder of an existing run.
    pub(super) fn open_existing(work: &Path) -> anyhow::Result<(Self, Run)> {
        let path = work.join("run.json");
        let bytes = run_files::read_if_exists(&path)?.ok_or_else(|| {
            anyhow!(
                "{}: not found; expected the folder of a run (compensate, deviation or diagnose with --shard or --resume)",
                path.display()
            )
        })?;
        let run = Run::from_bytes(&bytes).map_err(|error| anyhow!("{}: {error}", path.display()))?;
        let store =
            Self { work: work.to_path_buf(), run: run.run.clone(), resume: true, folders: Vec::new() };
        Ok((store, run))
    }

    fn list(&self, shares: &Shares, description: &RunDescription<'_>, jobs: &[Job]) -> anyhow::Result<()> {
        let run = Run {
            schema: run::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            verb: description.verb.to_owned(),
            run: self.run.clone(),
            shares: shares.shard.map(|share| share.of),
            context: description.context.clone(),
            units: jobs.iter().map(Job::unit).collect::<anyhow::Result<_>>()?,
        };
        let (path, text) = (self.work.join("run.json"), run.to_text()?);
        if run_files::read_if_exists(&path)?.as_deref() == Some(text.as_bytes()) {
            return Ok(());
        }
        // Tables of other units, another model or another number of shares do not belong to this run.
        run_files::remove_prefixed(&self.work.join(TABLES), TABLE);
        run_files::replace(&path, text.as_bytes())
    }

    /// The key of a unit, from its content or from the fact that it cannot be read.
    pub(super) fn key(&self, job: &Job, content: Option<&[(String, String)]>) -> String {
        let under = job.under.as_ref().map(|under| under.display().to_string()).unwrap_or_default();
        let unread =
            || job.paths.iter().map(|path| (path.display().to_string(), "not read".to_owned())).collect();
        let mut files: Vec<(String, String)> = content.map_or_else(unread, <[_]>::to_vec);
        files.insert(0, ("under".to_owned(), under));
        key::of_unit(&self.run, files.iter().map(|(name, content)| (name.as_str(), content.as_str())))
    }

    fn record_path(&self, key: &str) -> PathBuf {
        self.work.join("done").join(format!("{key}.json"))
    }

    /// The complete record of a unit, if any.
    pub(super) fn record<T: UnitResult>(
        &self,
        key: &str,
        whole: bool,
    ) -> anyhow::Result<Option<Recorded<T>>> {
        Ok(run_files::read_if_exists(&self.record_path(key))?.and_then(|bytes| T::read(&bytes, key, whole)))
    }

    /// The outputs of a unit that changed after they were written.
    pub(super) fn changed<R>(&self, done: &Recorded<R>) -> Vec<PathBuf> {
        let output_path = |output: &Output| match output.below {
            true => self.work.join(&output.file),
            false => PathBuf::from(&output.file),
        };
        let paths = done.outputs.iter().map(|output| (output_path(output), &output.sha256));
        let other = paths.filter(|(output_path, hash)| {
            let bytes = files::read_state(output_path);
            !bytes.is_ok_and(|bytes| key::sha256(&bytes) == **hash)
        });
        other.map(|(output_path, _)| output_path).collect()
    }

    fn keep<T: UnitResult>(
        &self,
        key: &str,
        job: &Job,
        kept: &T,
        ended: Ended,
        written: Written,
    ) -> anyhow::Result<()> {
        let output = |(path, sha256): (PathBuf, String)| {
            let below = path.strip_prefix(&self.work).ok();
            let file = below.unwrap_or(&path).display().to_string();
            Output { file, below: below.is_some(), sha256 }
        };
        let done = Recorded {
            schema: SCHEMA.to_owned(),
            key: key.to_owned(),
            unit: job.name(),
            ended,
            outputs: written.into_iter().map(output).collect(),
            record: (),
        };
        let text = done.to_text(&kept.record()?);
        let text = text.with_context(|| format!("{}: the record cannot be written", job.name()))?;
        run_files::replace(&self.record_path(key), text.as_bytes())
    }
}

/// The outputs of a job; see [`Store::outputs`].
pub(super) fn outputs_with(
    store: Option<&Store>,
    shares: &Shares,
    requested: &Outputs,
) -> anyhow::Result<Outputs> {
    store.map_or_else(|| Ok(requested.clone()), |store| store.outputs(shares, requested))
}

/// One job of a run.
struct JobSession<'s> {
    store: &'s Store,
    /// Marker file: a job over these units was begun and did not finish.
    note: PathBuf,
    /// Whether the marker existed before: then each unit is marked.
    careful: bool,
}

impl<'s> JobSession<'s> {
    fn enter(store: &'s Store, jobs: &[Job]) -> anyhow::Result<Self> {
        let start = key::Fields::new("truegrind.job/1").text(&store.run);
        let name = jobs.iter().fold(start, |fields, job| fields.text(&job.name())).hex();
        let note = store.work.join("begun").join(format!("job-{name}"));
        let careful = store.resume && run_files::read_if_exists(&note)?.is_some();
        run_files::write_note(&note, "")?;
        Ok(Self { store, note, careful })
    }

    /// The recorded result of a unit, or processes it. `None` if it was begun before but not finished, unless `alone`.
    fn resume_or_process<I, T, R, C, W>(
        &self,
        job: &Job,
        steps: &UnitSteps<R, C, W>,
        alone: bool,
    ) -> anyhow::Result<Option<T>>
    where
        T: UnitResult,
        R: Fn(&Job) -> anyhow::Result<I>,
        C: Fn(&I) -> Vec<(String, String)>,
        W: Fn(&Job, I) -> anyhow::Result<(T, Written)>,
    {
        let read = catch_panic(|| (steps.read)(job));
        let content = read.as_ref().ok().map(&steps.content);
        let key = self.store.key(job, content.as_deref());
        let begun = self.store.work.join("begun").join(&key);
        let mut times = 0;
        if self.store.resume
            && let Some(done) = self.store.record::<T>(&key, steps.whole)?
            && done.ended != Ended::Failed
            && self.store.changed(&done).is_empty()
        {
            return Ok(Some(done.record));
        }
        if self.careful {
            // An unreadable mark counts as one attempt.
            let noted = run_files::read_if_exists(&begun)?
                .map(|bytes| String::from_utf8_lossy(&bytes).trim().parse().unwrap_or(1));
            times = noted.unwrap_or(0);
            if times > 0 && !alone {
                return Ok(None);
            }
        }
        if times >= MAX_ATTEMPTS {
            let reason = format!(
                "processing it crashed {times} times, the last times with nothing else running: too little memory, or a defect of \
                 truegrind, which please report (--resume skips it; without --resume it is tried again)"
            );
            let kept = T::failed(job, &reason);
            self.store.keep(&key, job, &kept, Ended::Killed, Vec::new())?;
            run_files::remove(&begun);
            return Ok(Some(kept));
        }
        if self.careful {
            run_files::write_note(&begun, &(times + 1).to_string())?;
        }
        let done = catch_panic(|| (steps.work)(job, read?));
        let (mut kept, written) =
            done.unwrap_or_else(|error| (T::failed(job, &format!("{error:#}")), Vec::new()));
        let ended = if kept.is_failed() { Ended::Failed } else { Ended::Done };
        self.store.keep(&key, job, &kept, ended, written)?;
        if self.careful {
            run_files::remove(&begun);
        }
        if !steps.whole {
            kept.lighten();
        }
        Ok(Some(kept))
    }
}
