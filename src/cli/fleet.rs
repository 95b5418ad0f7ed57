//! `truegrind diagnose FOLDER --robot R -o MODELS`: diagnoses many arms, writes a model and a page for each, and one table over
//! all.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use truegrind::arm::estimated::Judgement;
use truegrind::calibration::diagnosis::diagnose::Options;
use truegrind::calibration::diagnosis::measured::diagnose_rows;
use truegrind::report::diagnosis as page;
use truegrind::report::fleet::{self as view, Row};
use truegrind::report::format;
use truegrind::units::done::Recorded;
use truegrind::units::key::sha256;

use super::computation::{Common, on_threads};
use super::diagnose::{Arguments, options};
use super::exit_status::ExitStatus;
use super::files::{self, Batch, read_log};
use super::identify::{DataArguments, read_bytes, reason_not_written};
use super::inputs;
use super::outputs::Outputs;
use super::programs::{Job, found_below};
use super::progress::Spinner;
use super::shares::{
    RunDescription, Shares, Store, UnitResult, UnitSteps, Written, outputs_with, process_units,
};
use super::terminal::print_message;

/// Whether the arguments name many arms.
pub(super) fn is_requested(arguments: &Arguments) -> bool {
    !arguments.more.is_empty() || arguments.data.data.is_dir() || arguments.shares.on()
}

/// All options that influence the outputs, as text; see [`super::compensate::Arguments`].
fn relevant_options(arguments: &Arguments) -> String {
    let data = DataArguments { data: PathBuf::new(), ..arguments.data.clone() };
    let common = Common { threads: None, ..arguments.common.clone() };
    let (outputs, shares) = (Outputs::default(), Shares::default());
    format!("{:?}", Arguments { data, more: Vec::new(), common, outputs, shares, ..arguments.clone() })
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut jobs = match arguments.shares.listed()? {
        Some(jobs) => jobs,
        None => jobs(arguments)?,
    };
    refuse_shared_output(&jobs)?;
    if arguments.data.points.points.is_some() {
        bail!("--points belongs to one joint log, but there are several arms: diagnose them separately");
    }
    if !arguments.also.is_empty() {
        bail!(
            "--also is another measurement of one arm, but there are several arms: diagnose that arm separately"
        );
    }
    if arguments.outputs.rrd.is_some() {
        bail!("--rrd shows one arm: name one");
    }
    if let Some(folder) = arguments.output.as_deref().filter(|output| output.is_file()) {
        bail!("{} is a file, but there are several arms: name a folder", folder.display());
    }
    let all: Vec<&Path> = jobs.iter().flat_map(|job| &job.paths).map(PathBuf::as_path).collect();
    Batch::check(&all, &arguments.outputs.files())?;
    arguments.outputs.refuse_other_kinds()?;
    let options = options(arguments)?;
    if arguments.shares.on() {
        read_log::begin();
    }
    inputs::robot(arguments.data.named())?;
    let shared = read_log::finish();
    let store = if arguments.shares.on() {
        let output = arguments.output.as_deref();
        let description = RunDescription {
            verb: "diagnose",
            options: relevant_options(arguments),
            shared,
            context: Value::Null,
            output,
        };
        let Some(store) = Store::open(&arguments.shares, &description, &mut jobs)? else {
            return Ok(ExitStatus::Done);
        };
        Some(store)
    } else {
        None
    };
    let work = Spinner::start(format!("diagnosing {} arms", jobs.len()));
    let steps = UnitSteps {
        read: |job: &Job| job.paths.iter().map(|path| Ok((path.clone(), files::read(path)?))).collect(),
        content: |read: &Vec<(PathBuf, Vec<u8>)>| {
            read.iter().map(|(path, bytes)| (path.display().to_string(), sha256(bytes))).collect()
        },
        work: |job: &Job, read: Vec<(PathBuf, Vec<u8>)>| diagnose_arm(arguments, &options, job, &read),
        whole: true,
    };
    let found: Vec<ArmResult> =
        on_threads(arguments.common.threads, || process_units(store.as_ref(), &jobs, &steps))??;
    drop(work);
    let inputs = jobs.iter().flat_map(|job| &job.paths);
    let outputs = outputs_with(store.as_ref(), &arguments.shares, &arguments.outputs)?;
    write(found, &outputs, Batch::sparing(inputs), store.is_some())
}

/// The named measurements, including those below folders, sorted by path.
fn jobs(arguments: &Arguments) -> anyhow::Result<Vec<Job>> {
    let mut jobs = Vec::new();
    let is_table = |path: &Path| {
        path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("xlsx"))
    };
    for path in std::iter::once(&arguments.data.data).chain(&arguments.more) {
        if path.is_dir() {
            let found = found_below(path, |path| is_table(path) || is_other_workbook(path))?;
            let (passed, found): (Vec<_>, Vec<_>) =
                found.into_iter().partition(|path| is_lock(path) || is_other_workbook(path));
            passed.iter().for_each(|path| print_message(format_args!("note: {}", why_passed(path))));
            jobs.extend(found.into_iter().map(|file| Job { paths: vec![file], under: Some(path.clone()) }));
        } else {
            jobs.push(Job { paths: vec![path.clone()], under: None });
        }
    }
    for path in jobs.iter().flat_map(|job| &job.paths) {
        files::expect(path)?;
    }
    if jobs.is_empty() {
        bail!("no measurements found: folders are searched for .csv and .xlsx");
    }
    Ok(jobs)
}

/// Whether Excel made this file beside a workbook that is open in it.
fn is_lock(path: &Path) -> bool {
    files::name(path).starts_with("~$")
}

/// Whether it is a workbook of a kind that is not read.
fn is_other_workbook(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| ["xls", "xlsb", "xlsm", "ods"].iter().any(|other| e.eq_ignore_ascii_case(other)))
}

/// Why a file below a folder is no arm.
fn why_passed(path: &Path) -> String {
    match files::name(path).strip_prefix("~$") {
        Some(open) => {
            format!("{}: {open} is open in Excel, so only what was saved of it is read", path.display())
        }
        None => {
            format!("{}: passed over, since only .csv and .xlsx are read; save it as XLSX", path.display())
        }
    }
}

/// Path of the model of an arm in the output folder.
fn model_path(job: &Job) -> PathBuf {
    let file = job.paths.first().map(PathBuf::as_path).unwrap_or(Path::new(""));
    job.relative_output(file).with_extension("toml")
}

/// Refuses two arms with the same output file.
fn refuse_shared_output(jobs: &[Job]) -> anyhow::Result<()> {
    let mut taken: BTreeMap<PathBuf, &Job> = BTreeMap::new();
    for job in jobs {
        if let Some(first) = taken.insert(model_path(job), job) {
            bail!(
                "{} and {} would both be written to {} in the output folder: rename one of them, or run them \
                 separately, each into its own folder",
                first.name(),
                job.name(),
                model_path(job).display()
            );
        }
    }
    Ok(())
}

/// The result for one arm.
pub(super) struct ArmResult {
    row: Row,
    notes: Vec<String>,
    /// Whether its model may be used and no error is unexplained.
    clean: bool,
}

impl UnitResult for ArmResult {
    fn failed(job: &Job, reason: &str) -> Self {
        Self { row: Row::failed(job.name(), reason.to_owned()), notes: Vec::new(), clean: false }
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

/// Diagnoses one arm of many and writes its model, page and JSON.
fn diagnose_arm(
    arguments: &Arguments,
    options: &Options,
    job: &Job,
    read: &[(PathBuf, Vec<u8>)],
) -> anyhow::Result<(ArmResult, Written)> {
    let (path, bytes) = read.first().ok_or_else(|| anyhow!("{}: names no file", job.name()))?;
    let data = DataArguments { data: path.clone(), ..arguments.data.clone() };
    let (robot, dataset) = read_bytes(&data, bytes)?;
    let placement = arguments.stated.prior(&arguments.prior)?;
    let arm = (robot.sheet.name.as_str(), &robot.model);
    let found = diagnose_rows((&dataset, &[]), arm, &placement, options)?;
    let diagnosis = &found.diagnosis;
    let notes: Vec<String> = diagnosis.notes.iter().chain(&dataset.notes).cloned().collect();
    let reason = reason_not_written(&found.estimated, arguments.allow_doubtful);
    let model = arguments.output.as_ref().map(|folder| folder.join(model_path(job)));
    let mut made = Vec::new();
    if let Some(model) = &model {
        let json = serde_json::to_value(diagnosis.clone().with_rows_from_0(&dataset))?;
        made.push((model.with_extension("json"), format::json::text(&json)?));
        made.push((model.with_extension("html"), format::html::document(&page::document(&found, &dataset))));
        if reason.is_none() {
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
    let output = model.filter(|_| reason.is_none()).map(|model| model.display().to_string());
    let poor = matches!(found.estimated.verdict.status, Judgement::Fail | Judgement::Doubtful);
    let unexplained = diagnosis.is_partly_unexplained();
    let note = reason.filter(|_| arguments.output.is_some()).map(|reason| format!("the model {reason}"));
    let row = Row::of(job.name(), output, note, &found);
    Ok((ArmResult { row, notes, clean: !poor && !unexplained }, written))
}

/// Prints and writes the table over all arms. `is_part`: one job of a shared run, which does not fail even if all its arms do.
fn write(
    found: Vec<ArmResult>,
    outputs: &Outputs,
    mut batch: Batch,
    is_part: bool,
) -> anyhow::Result<ExitStatus> {
    for found in &found {
        for note in &found.notes {
            print_message(format_args!("note: {}: {note}", found.row.file));
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
    Ok(if clean { ExitStatus::Done } else { ExitStatus::Flagged })
}

/// The table of a shared run, made from the records of its arms.
pub(super) fn gathered(found: Vec<ArmResult>, outputs: &Outputs, batch: Batch) -> anyhow::Result<ExitStatus> {
    write(found, outputs, batch, false)
}
