//! Runs that several jobs share, on one machine or many, and that go on where they were stopped: `--shard`, `--resume`.
//!
//! Jobs know nothing of each other but a folder. In it `run.json` lists all units, `done/KEY.json` is the record of one that is
//! done, and `begun/` holds what was begun and did not end; `tables/` has the table of each share. Two jobs that do the same unit at the same time both come to
//! the same bytes, and whoever is last puts them over the same. New outputs and records get to the disk together when a job ends: one
//! that a crash of the machine tore before is not as its record says, and is made again.
//!
//! A unit may take its whole process with it (memory, stack). The next job of the same units finds that one before it did not end,
//! and from then on notes each unit that it begins. One that is begun and not ended is left to the end and done alone, so that it
//! takes nobody else along, and after [`MOST_BEGUN`] times it is listed as failed. Jobs that nobody kills note nothing.

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

/// How often a unit is begun before it is listed as one that kills whoever does it.
const MOST_BEGUN: u32 = 3;

/// Where the tables of the shares are, in the folder of the run, and how their names begin.
const TABLES: &str = "tables";
const TABLE: &str = "share-";

/// Many inputs over several jobs; docs in README, examples in deploy/.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Several jobs, on one machine or many")]
pub(super) struct Shares {
    /// Do one share of the programs or arms alone, I of N, from 1; names alone tell which. `truegrind gather` puts together what all
    /// shares made. The table of the share goes to tables/ in the folder of the run, as Parquet, where --parquet names no other
    /// file.
    #[arg(long, value_name = "I/N", conflicts_with = "units")]
    shard: Option<Share>,
    /// Leave out what is done already with the same inputs, model, cell, options and version, as long as its outputs are as they were
    /// written.
    #[arg(long)]
    resume: bool,
    /// Folder in which the jobs of a run keep what is done; without it the one of -o.
    #[arg(long, value_name = "FOLDER")]
    work: Option<PathBuf>,
    /// Do these alone: a list as `units` in run.json, `-` for the standard input. No folder is searched.
    #[arg(long, value_name = "FILE")]
    units: Option<PathBuf>,
    /// Write run.json, the list of all that is to be done, and do nothing.
    #[arg(long, conflicts_with_all = ["shard", "units", "resume"])]
    list_units: bool,
}

impl Shares {
    /// Whether a run is shared or goes on.
    pub(super) fn on(&self) -> bool {
        self.shard.is_some() || self.resume || self.work.is_some() || self.units.is_some() || self.list_units
    }

    /// The units that were listed, in place of those that are found; `None` where none were.
    pub(super) fn listed(&self) -> anyhow::Result<Option<Vec<Job>>> {
        let Some(path) = &self.units else { return Ok(None) };
        let bytes = if path == Path::new("-") { files::read_stdin()? } else { files::read(path)? };
        let units: Vec<Unit> = serde_json::from_slice(&bytes).map_err(|error| {
            anyhow!(
                "{}: {error}; expected a list such as [{{\"under\": \"folder\", \"paths\": [\"folder/a.mod\"]}}]",
                path.display()
            )
        })?;
        let jobs: Vec<Job> = units.iter().map(Job::of_unit).collect();
        for path in jobs.iter().flat_map(|job| &job.paths) {
            files::expect(path)?;
        }
        Ok(Some(jobs))
    }
}

/// What a verb keeps of a unit.
pub(super) trait Kept: Sized + Send {
    /// Of one that could not be done.
    fn failed(job: &Job, why: &str) -> Self;
    /// Whether it is one of those.
    fn is_failed(&self) -> bool;
    /// As JSON, every bit.
    fn record(&self) -> anyhow::Result<String>;
    /// From the bytes of the record with this key; `None` where it is not whole, or none of this verb. `whole`: with what no report but
    /// --json shows; a run may be of a million units.
    fn read(bytes: &[u8], key: &str, whole: bool) -> Option<Recorded<Self>>;
    /// Lets go of what is only read where it is asked for `whole`.
    fn lighten(&mut self) {}
}

/// Files that were written, each with the SHA-256 of its bytes.
pub(super) type Written = Vec<(PathBuf, String)>;

/// How a verb reads and does a unit.
pub(super) struct Doing<R, C, W> {
    /// Reads its files.
    pub(super) read: R,
    /// Their names and contents; see [`key::of_unit`].
    pub(super) content: C,
    /// Does it, and writes its outputs.
    pub(super) work: W,
    /// Whether the reports of this job need all of a unit; see [`Kept::read`].
    pub(super) whole: bool,
}

/// Does all units, each by itself: what one brings to light does not take the others with it.
pub(super) fn each<I, T, R, C, W>(
    store: Option<&Store>,
    jobs: &[Job],
    doing: &Doing<R, C, W>,
) -> anyhow::Result<Vec<T>>
where
    T: Kept,
    R: Fn(&Job) -> anyhow::Result<I> + Sync,
    C: Fn(&I) -> Vec<(String, String)> + Sync,
    W: Fn(&Job, I) -> anyhow::Result<(T, Written)> + Sync,
{
    let Some(store) = store else {
        let one = |job: &Job| catch_panic(|| (doing.work)(job, (doing.read)(job)?));
        let failed = |job: &Job, error: anyhow::Error| T::failed(job, &format!("{error:#}"));
        let each =
            jobs.par_iter().map(|job| one(job).map_or_else(|error| failed(job, error), |(done, _)| done));
        return Ok(each.collect());
    };
    let here = Here::enter(store, jobs)?;
    let first =
        jobs.par_iter().map(|job| here.done_or_do(job, doing, false)).collect::<anyhow::Result<Vec<_>>>()?;
    // What was begun before and not ended may have killed its process: alone, after all others.
    let each = first.into_iter().zip(jobs).map(|(done, job)| match done {
        Some(done) => Ok(done),
        None => here.done_or_do(job, doing, true)?.ok_or_else(|| anyhow!("{}: left out", job.name())),
    });
    let done = each.collect::<anyhow::Result<Vec<_>>>()?;
    store.folders.iter().try_for_each(|folder| sync_folder(folder))?;
    run_files::remove(&here.note);
    Ok(done)
}

/// What the jobs of one run keep.
#[derive(Debug)]
pub(super) struct Store {
    work: PathBuf,
    run: String,
    resume: bool,
    /// Where a job writes.
    folders: Vec<PathBuf>,
}

/// What makes a run.
pub(super) struct Asked<'a> {
    /// The verb.
    pub(super) verb: &'a str,
    /// Every option that has a part in the outputs.
    pub(super) options: String,
    /// The SHA-256 of every file that is read for all units.
    pub(super) shared: Vec<String>,
    /// What the reports need beside the units.
    pub(super) context: Value,
    /// The folder of -o, where there is one.
    pub(super) output: Option<&'a Path>,
}

impl Store {
    /// Opens the folder, notes the run, and keeps of the units those of this job. `None` where nothing is to be done but to list.
    pub(super) fn open(
        shares: &Shares,
        asked: &Asked<'_>,
        jobs: &mut Vec<Job>,
    ) -> anyhow::Result<Option<Self>> {
        let Some(work) = shares.work.as_deref().or(asked.output) else {
            bail!("--work FOLDER is missing: the folder in which the jobs of this run keep what is done");
        };
        let run = key::of_run(asked.verb, &asked.options, asked.shared.iter().map(String::as_str));
        for folder in ["done", "begun"] {
            files::make_folder(&work.join(folder))?;
        }
        let mut folders = vec![work.to_path_buf()];
        folders.extend(asked.output.filter(|output| *output != work).map(Path::to_path_buf));
        let store = Self { work: work.to_path_buf(), run, resume: shares.resume, folders };
        if shares.units.is_none() {
            store.list(shares, asked, jobs)?;
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

    /// Where the results of this job go: the table of a share to the folder of the run, where nobody names another file.
    fn outputs(&self, shares: &Shares, asked: &Outputs) -> anyhow::Result<Outputs> {
        let mut outputs = asked.clone();
        if let (true, Some(share), None) = (cfg!(feature = "parquet"), shares.shard, &asked.pages.parquet) {
            let tables = self.work.join(TABLES);
            files::make_folder(&tables)?;
            // As wide as the last one's, so that their order by name is that of their numbers.
            let wide = share.of.to_string().len();
            let name = format!("{TABLE}{:0wide$}-of-{}.parquet", share.number, share.of);
            outputs.pages.parquet = Some(tables.join(name));
        }
        Ok(outputs)
    }

    /// The store of a run that was begun: its folder, and the run.
    pub(super) fn of(work: &Path) -> anyhow::Result<(Self, Run)> {
        let path = work.join("run.json");
        let bytes = run_files::read_if_exists(&path)?.ok_or_else(|| {
            anyhow!(
                "{}: not there; expected the folder of a run (compensate, deviation or diagnose with --shard or --resume)",
                path.display()
            )
        })?;
        let run = Run::from_bytes(&bytes).map_err(|error| anyhow!("{}: {error}", path.display()))?;
        let store =
            Self { work: work.to_path_buf(), run: run.run.clone(), resume: true, folders: Vec::new() };
        Ok((store, run))
    }

    fn list(&self, shares: &Shares, asked: &Asked<'_>, jobs: &[Job]) -> anyhow::Result<()> {
        let run = Run {
            schema: run::SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            verb: asked.verb.to_owned(),
            run: self.run.clone(),
            shares: shares.shard.map(|share| share.of),
            context: asked.context.clone(),
            units: jobs.iter().map(Job::unit).collect::<anyhow::Result<_>>()?,
        };
        let (path, text) = (self.work.join("run.json"), run.to_text()?);
        if run_files::read_if_exists(&path)?.as_deref() == Some(text.as_bytes()) {
            return Ok(());
        }
        // Tables of other units, of another model or of another number of shares are none of this run.
        run_files::remove_prefixed(&self.work.join(TABLES), TABLE);
        run_files::replace(&path, text.as_bytes())
    }

    /// The key of a unit by its contents, or by the word that it cannot be read.
    pub(super) fn key(&self, job: &Job, content: Option<&[(String, String)]>) -> String {
        let under = job.under.as_ref().map(|under| under.display().to_string()).unwrap_or_default();
        let unread =
            || job.paths.iter().map(|path| (path.display().to_string(), "not read".to_owned())).collect();
        let mut files: Vec<(String, String)> = content.map_or_else(unread, <[_]>::to_vec);
        files.insert(0, ("under".to_owned(), under));
        key::of_unit(&self.run, files.iter().map(|(name, content)| (name.as_str(), content.as_str())))
    }

    fn record_place(&self, key: &str) -> PathBuf {
        self.work.join("done").join(format!("{key}.json"))
    }

    /// The record of a unit, where it is there whole.
    pub(super) fn record<T: Kept>(&self, key: &str, whole: bool) -> anyhow::Result<Option<Recorded<T>>> {
        Ok(run_files::read_if_exists(&self.record_place(key))?.and_then(|bytes| T::read(&bytes, key, whole)))
    }

    /// The outputs of a unit that are not as they were written.
    pub(super) fn changed<R>(&self, done: &Recorded<R>) -> Vec<PathBuf> {
        let place = |output: &Output| match output.below {
            true => self.work.join(&output.file),
            false => PathBuf::from(&output.file),
        };
        let places = done.outputs.iter().map(|output| (place(output), &output.sha256));
        let other = places.filter(|(place, hash)| {
            let bytes = files::read_state(place);
            !bytes.is_ok_and(|bytes| key::sha256(&bytes) == **hash)
        });
        other.map(|(place, _)| place).collect()
    }

    fn keep<T: Kept>(
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
        let text = text.with_context(|| format!("{}: the record cannot be made", job.name()))?;
        run_files::replace(&self.record_place(key), text.as_bytes())
    }
}

/// Where the results of a job go: what was asked for, and what a share keeps beside; see [`Store::outputs`].
pub(super) fn outputs_with(
    store: Option<&Store>,
    shares: &Shares,
    asked: &Outputs,
) -> anyhow::Result<Outputs> {
    store.map_or_else(|| Ok(asked.clone()), |store| store.outputs(shares, asked))
}

/// One job among those of a run.
struct Here<'s> {
    store: &'s Store,
    /// Says that a job of these units was begun and did not end.
    note: PathBuf,
    /// Whether one was, before this one: then each unit is noted.
    careful: bool,
}

impl<'s> Here<'s> {
    fn enter(store: &'s Store, jobs: &[Job]) -> anyhow::Result<Self> {
        let start = key::Fields::new("truegrind.job/1").text(&store.run);
        let name = jobs.iter().fold(start, |fields, job| fields.text(&job.name())).hex();
        let note = store.work.join("begun").join(format!("job-{name}"));
        let careful = store.resume && run_files::read_if_exists(&note)?.is_some();
        run_files::write_note(&note, "")?;
        Ok(Self { store, note, careful })
    }

    /// A unit that is done, or does it. `None` where it was begun before and not ended, unless it is done `alone` now.
    fn done_or_do<I, T, R, C, W>(
        &self,
        job: &Job,
        doing: &Doing<R, C, W>,
        alone: bool,
    ) -> anyhow::Result<Option<T>>
    where
        T: Kept,
        R: Fn(&Job) -> anyhow::Result<I>,
        C: Fn(&I) -> Vec<(String, String)>,
        W: Fn(&Job, I) -> anyhow::Result<(T, Written)>,
    {
        let read = catch_panic(|| (doing.read)(job));
        let content = read.as_ref().ok().map(&doing.content);
        let key = self.store.key(job, content.as_deref());
        let begun = self.store.work.join("begun").join(&key);
        let mut times = 0;
        if self.store.resume
            && let Some(done) = self.store.record::<T>(&key, doing.whole)?
            && done.ended != Ended::Failed
            && self.store.changed(&done).is_empty()
        {
            return Ok(Some(done.record));
        }
        if self.careful {
            // One that cannot be read was being noted.
            let noted = run_files::read_if_exists(&begun)?
                .map(|bytes| String::from_utf8_lossy(&bytes).trim().parse().unwrap_or(1));
            times = noted.unwrap_or(0);
            if times > 0 && !alone {
                return Ok(None);
            }
        }
        if times >= MOST_BEGUN {
            let why = format!(
                "whoever did it died, {times} times, the last times with nothing else running: too little memory, or a defect of \
                 truegrind, then please report it (--resume leaves it; without --resume it is tried again)"
            );
            let kept = T::failed(job, &why);
            self.store.keep(&key, job, &kept, Ended::Killed, Vec::new())?;
            run_files::remove(&begun);
            return Ok(Some(kept));
        }
        if self.careful {
            run_files::write_note(&begun, &(times + 1).to_string())?;
        }
        let done = catch_panic(|| (doing.work)(job, read?));
        let (mut kept, written) =
            done.unwrap_or_else(|error| (T::failed(job, &format!("{error:#}")), Vec::new()));
        let ended = if kept.is_failed() { Ended::Failed } else { Ended::Done };
        self.store.keep(&key, job, &kept, ended, written)?;
        if self.careful {
            run_files::remove(&begun);
        }
        if !doing.whole {
            kept.lighten();
        }
        Ok(Some(kept))
    }
}
