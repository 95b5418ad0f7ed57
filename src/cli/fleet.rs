//! `truegrind diagnose FOLDER --robot R -o MODELS`, many arms in one run: each diagnosed by itself, its model and page written, and one table over all.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use truegrind::arm::estimated::Judgement;
use truegrind::calibration::diagnosis::diagnose::Options;
use truegrind::report::diagnosis as page;
use truegrind::report::fleet::{self as view, Row};
use truegrind::report::format;
use truegrind::units::done::Recorded;
use truegrind::units::key::sha256;

use super::computation::{Common, on_threads};
use super::diagnose::{Arguments, of_rows, options};
use super::ending::Ending;
use super::files::{self, Batch, witness};
use super::identify::{DataArguments, read_bytes, why_not_written};
use super::inputs;
use super::outputs::Outputs;
use super::programs::{Job, found_below};
use super::progress::Work;
use super::shares::{Asked, Doing, Kept, Shares, Store, Written, each, outputs_with};
use super::terminal::tell;

/// Whether many arms are asked for, and not one.
pub(super) fn is_asked(arguments: &Arguments) -> bool {
    !arguments.more.is_empty() || arguments.data.data.is_dir() || arguments.shares.on()
}

/// Every option that has a part in what is written, in words; as those of `compensate`.
fn that_count(arguments: &Arguments) -> String {
    let data = DataArguments { data: PathBuf::new(), ..arguments.data.clone() };
    let common = Common { threads: None, ..arguments.common.clone() };
    let (outputs, shares) = (Outputs::default(), Shares::default());
    format!("{:?}", Arguments { data, more: Vec::new(), common, outputs, shares, ..arguments.clone() })
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let mut jobs = match arguments.shares.listed()? {
        Some(jobs) => jobs,
        None => jobs(arguments)?,
    };
    refuse_one_place_for_two(&jobs)?;
    if arguments.data.points.points.is_some() {
        bail!("--points belong to one log of joints, and these are several arms: diagnose each by itself");
    }
    if !arguments.also.is_empty() {
        bail!("--also is another series of one arm, and these are several: diagnose that arm by itself");
    }
    if arguments.outputs.rrd.is_some() {
        bail!("--rrd shows one arm: name one");
    }
    if let Some(folder) = arguments.output.as_deref().filter(|output| output.is_file()) {
        bail!("{} is a file, but there are several arms: name a folder", folder.display());
    }
    let all: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    Batch::check(&all, &arguments.outputs.files())?;
    let options = options(arguments)?;
    if arguments.shares.on() {
        witness::begin();
    }
    inputs::robot(&arguments.data.robot)?;
    let shared = witness::end();
    let store = if arguments.shares.on() {
        let output = arguments.output.as_deref();
        let asked =
            Asked { verb: "diagnose", options: that_count(arguments), shared, context: Value::Null, output };
        let Some(store) = Store::open(&arguments.shares, &asked, &mut jobs)? else { return Ok(Ending::Done) };
        Some(store)
    } else {
        None
    };
    let work = Work::start(format!("diagnosing {} arms", jobs.len()));
    let doing = Doing {
        read: |job: &Job| job.paths.iter().map(|path| Ok((path.clone(), files::read(path)?))).collect(),
        content: |read: &Vec<(PathBuf, Vec<u8>)>| {
            read.iter().map(|(path, bytes)| (path.display().to_string(), sha256(bytes))).collect()
        },
        work: |job: &Job, read: Vec<(PathBuf, Vec<u8>)>| one(arguments, &options, job, &read),
        whole: true,
    };
    let found: Vec<Found> = on_threads(arguments.common.threads, || each(store.as_ref(), &jobs, &doing))??;
    drop(work);
    let inputs = jobs.iter().flat_map(|job| &job.paths);
    let outputs = outputs_with(store.as_ref(), &arguments.shares, &arguments.outputs)?;
    write(found, &outputs, Batch::sparing(inputs), store.is_some())
}

/// The measurements that the command line names, those below folders among them, in the order of names.
fn jobs(arguments: &Arguments) -> anyhow::Result<Vec<Job>> {
    let mut jobs = Vec::new();
    let is_table = |path: &Path| {
        let known =
            |ending: &std::ffi::OsStr| ["csv", "xlsx"].iter().any(|known| ending.eq_ignore_ascii_case(known));
        path.extension().is_some_and(known)
    };
    for path in std::iter::once(&arguments.data.data).chain(&arguments.more) {
        if path.is_dir() {
            let found = found_below(path, is_table)?;
            jobs.extend(found.into_iter().map(|file| Job { paths: vec![file], under: Some(path.clone()) }));
        } else {
            jobs.push(Job { paths: vec![path.clone()], under: None });
        }
    }
    for path in jobs.iter().flat_map(|job| &job.paths) {
        files::expect(path)?;
    }
    if jobs.is_empty() {
        bail!("no measurements found: a folder is searched for .csv and .xlsx");
    }
    Ok(jobs)
}

/// Where the model of an arm goes in the folder of outputs.
fn place(job: &Job) -> PathBuf {
    let file = job.paths.first().map(PathBuf::as_path).unwrap_or(Path::new(""));
    job.place(file).with_extension("toml")
}

/// No two arms may end in one file.
fn refuse_one_place_for_two(jobs: &[Job]) -> anyhow::Result<()> {
    let mut taken: BTreeMap<PathBuf, &Job> = BTreeMap::new();
    for job in jobs {
        if let Some(first) = taken.insert(place(job), job) {
            bail!(
                "{} and {} would both be written to {} in the output folder: call one of them otherwise, or run them one \
                 by one, each into a folder of its own",
                first.name(),
                job.name(),
                place(job).display()
            );
        }
    }
    Ok(())
}

/// What was found of one arm.
pub(super) struct Found {
    row: Row,
    notes: Vec<String>,
    /// Whether its model may be used, and nothing is unexplained.
    clean: bool,
}

impl Kept for Found {
    fn failed(job: &Job, why: &str) -> Self {
        Self { row: Row::failed(job.name(), why.to_owned()), notes: Vec::new(), clean: false }
    }

    fn is_failed(&self) -> bool {
        self.row.failed
    }

    fn record(&self) -> anyhow::Result<String> {
        Ok(json!({ "row": serde_json::to_value(&self.row)?, "notes": self.notes, "clean": self.clean })
            .to_string())
    }

    fn read(bytes: &[u8], key: &str, _: bool) -> Option<Recorded<Self>> {
        let found = |mut record: Value| {
            Some(Self {
                row: serde_json::from_value(record["row"].take()).ok()?,
                notes: serde_json::from_value(record["notes"].take()).ok()?,
                clean: record["clean"].as_bool()?,
            })
        };
        Recorded::from_bytes(bytes, key)?.and_then(found)
    }
}

/// One arm of many: diagnosed, its model, page and contract written.
fn one(
    arguments: &Arguments,
    options: &Options,
    job: &Job,
    read: &[(PathBuf, Vec<u8>)],
) -> anyhow::Result<(Found, Written)> {
    let (path, bytes) = read.first().ok_or_else(|| anyhow!("{}: names no file", job.name()))?;
    let data = DataArguments { data: path.clone(), ..arguments.data.clone() };
    let (robot, dataset) = read_bytes(&data, bytes)?;
    let found = of_rows(arguments, options, &robot.sheet.name, &robot.model, &dataset, &[])?;
    let diagnosis = &found.diagnosis;
    let notes: Vec<String> = diagnosis.notes.iter().chain(&dataset.notes).cloned().collect();
    let why = why_not_written(&found.estimated, arguments.allow_doubtful);
    let model = arguments.output.as_ref().map(|folder| folder.join(place(job)));
    let mut made = Vec::new();
    if let Some(model) = &model {
        let json = serde_json::to_value(diagnosis.clone().counted_from_0(&dataset))?;
        made.push((model.with_extension("json"), format::json::text(&json)?));
        made.push((model.with_extension("html"), format::html::document(&page::document(&found, &dataset))));
        if why.is_none() {
            made.push((model.clone(), found.estimated.to_toml()?));
        }
    }
    let mut batch = Batch::sparing([path]);
    let mut written = Written::new();
    for (path, text) in made {
        if let Some(folder) = path.parent() {
            files::make_folder(folder)?;
        }
        written.push((path.clone(), sha256(text.as_bytes())));
        batch.add(path, text);
    }
    batch.write()?;
    let output = model.filter(|_| why.is_none()).map(|model| model.display().to_string());
    let poor = matches!(found.estimated.verdict.status, Judgement::Fail | Judgement::Doubtful);
    let unexplained = diagnosis.findings.iter().any(|finding| finding.effect == "unexplained");
    let note = why.filter(|_| arguments.output.is_some()).map(|why| format!("the model {why}"));
    let row = Row::of(job.name(), output, note, diagnosis);
    Ok((Found { row, notes, clean: !poor && !unexplained }, written))
}

/// Prints and writes the table over all arms. `is_part`: of a run that goes on elsewhere, which no number of bad files ends.
fn write(found: Vec<Found>, outputs: &Outputs, mut batch: Batch, is_part: bool) -> anyhow::Result<Ending> {
    for found in &found {
        for note in &found.notes {
            tell(format_args!("note: {}: {note}", found.row.file));
        }
    }
    let clean = found.iter().all(|found| found.clean);
    let rows: Vec<Row> = found.into_iter().map(|found| found.row).collect();
    outputs.print(&view::summary(&rows))?;
    outputs.add_made(&mut batch, || view::document(&rows), || view::table(&rows), || view::json(&rows))?;
    batch.write()?;
    if !is_part && rows.iter().all(|row| row.failed) {
        bail!("none of {} arms could be diagnosed", rows.len());
    }
    Ok(if clean { Ending::Done } else { Ending::Flagged })
}

/// The table of a shared run, from what was kept of each arm.
pub(super) fn gathered(found: Vec<Found>, outputs: &Outputs, batch: Batch) -> anyhow::Result<Ending> {
    write(found, outputs, batch, false)
}
