//! `truegrind deviation PROGRAM… --model MODEL.toml…`: the deviation report, without rewriting.

use std::collections::HashMap;
use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use serde_json::{Value, json};
use truegrind::arm::arm_file::ArmFile;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::nc_setup::cell_setup;
use truegrind::compensation::cell::{Cell, Used};
use truegrind::compensation::deviation::{After, PathReport};
use truegrind::compensation::options::Options;
use truegrind::compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind::file_kind::FileKind;
use truegrind::programs::motion::Listing;
use truegrind::programs::nc::setup::Setup;
use truegrind::programs::reading::{Language, Program};
use truegrind::report::deviation as view;
use truegrind::report::status::Status;
use truegrind::surfaces::SurfaceFile;
use truegrind::units::done::Recorded;

use super::cell_arguments::{CellArguments, check_length, note_unused_entries, refuse_contradictions};
use super::computation::{Common, on_threads};
use super::exit_status::ExitStatus;
use super::files::{self, Batch, read_log};
use super::inputs::{self, NamedModel, StatedRobot};
use super::outputs::Outputs;
use super::programs::{self, Grouping, Job, Programs};
use super::robot_match;
use super::shares::{RunDescription, Shares, Store, UnitResult, UnitSteps, outputs_with, process_units};
use super::terminal::print_message;

/// Arguments of `deviation`.
#[derive(Debug, Clone, Args)]
pub(super) struct Arguments {
    /// Programs: RAPID modules of one task, .pgf task lists, NC files, or folders of them.
    programs: Vec<PathBuf>,
    #[command(flatten)]
    grouping: Grouping,
    /// Estimated arms (model files), each with its own rows in the report. With --actual, the word `nominal` suffices.
    #[arg(long, required = true, num_args = 1..)]
    model: Vec<String>,
    #[command(flatten)]
    robot: StatedRobot,
    /// Original program, which defines the intended path, or with --together a folder that is one task; PROGRAM is then its corrected version.
    #[arg(long, value_name = "ORIGINAL")]
    intended: Vec<PathBuf>,
    /// Largest deviation of the corrected path from the intended one between two targets (mm); use the value that was given to `compensate`.
    #[arg(long, value_name = "MM", default_value_t = 0.05, allow_negative_numbers = true)]
    tolerance: f64,
    /// Simulated actual arm (from `simulate --arm`) that runs the programs.
    #[arg(long, value_name = "ARM.toml")]
    actual: Option<PathBuf>,
    #[command(flatten)]
    cell: CellArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
    #[command(flatten)]
    shares: Shares,
}

impl Arguments {
    /// All options that influence the outputs, as text; see [`super::compensate::Arguments`].
    fn relevant_options(&self) -> String {
        let common = Common { threads: None, ..self.common.clone() };
        let (outputs, shares) = (Outputs::default(), Shares::default());
        format!("{:?}", Self { programs: Vec::new(), common, outputs, shares, ..self.clone() })
    }
}

/// An arm on which programs are run.
struct Runner {
    name: String,
    /// Robot name from the model.
    robot: Option<String>,
    nominal: Model,
    model: Model,
    knowledge: Option<Box<Estimated>>,
    after: After,
}

/// Refuses numbers out of range, and options that only one program or one job can have.
fn check_combinations(arguments: &Arguments, jobs: usize, several: bool) -> anyhow::Result<()> {
    check_length("--tolerance", arguments.tolerance, Options::MAX_TOLERANCE_MM)?;
    if several && !arguments.intended.is_empty() {
        bail!(
            "--intended is the original of one program, and these are {jobs}: name one program or task and its original, or a folder that is one \
             task for both, with --together"
        );
    }
    if arguments.shares.on() && arguments.outputs.rrd.is_some() {
        bail!(
            "--rrd shows the programs of a single job: it cannot be combined with options for several jobs"
        );
    }
    Ok(())
}

impl Arguments {
    /// Programs that were named behind `--model`, which takes several files, are programs.
    pub(super) fn with_programs(mut self) -> anyhow::Result<Self> {
        if self.programs.is_empty() {
            let is_model = |name: &String| name == "nominal" || name.ends_with(".toml");
            let (models, programs): (Vec<_>, Vec<_>) =
                std::mem::take(&mut self.model).into_iter().partition(is_model);
            self.model = models;
            self.programs = programs.into_iter().map(PathBuf::from).collect();
        }
        if self.programs.is_empty() {
            bail!(
                "no program was named: expected RAPID modules, NC files, .pgf task lists, or folders of them"
            );
        }
        if self.model.is_empty() {
            bail!("--model names no model file (.toml)");
        }
        Ok(self)
    }
}

/// The program of `--intended`: files, or a folder that is one task.
fn original(arguments: &Arguments) -> anyhow::Result<Option<Programs>> {
    let named = &arguments.intended;
    if !named.iter().any(|path| path.is_dir()) {
        return if named.is_empty() { Ok(None) } else { Ok(Some(Programs::read(named)?)) };
    }
    let mut jobs = programs::jobs(named, arguments.grouping)?;
    programs::drop_without_motion(&mut jobs)?;
    let [job] = jobs.as_slice() else {
        bail!(
            "--intended: {} programs lie in that folder: name the original, or make the folder one task with --together",
            jobs.len()
        );
    };
    Ok(Some(Programs::read(&job.paths)?))
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut jobs = match arguments.shares.listed()? {
        Some(jobs) => jobs,
        None => programs::jobs(&arguments.programs, arguments.grouping)?,
    };
    if !arguments.intended.is_empty() {
        programs::drop_without_motion(&mut jobs)?;
    }
    let several = jobs.len() > 1 || arguments.shares.on();
    check_combinations(arguments, jobs.len(), several)?;
    let originals = original(arguments)?.map(|original| original.in_order_of(&jobs));
    let all: Vec<PathBuf> = jobs
        .iter()
        .flat_map(|job| &job.paths)
        .chain(originals.iter().flat_map(|o| o.files.iter().map(|(path, _)| path)))
        .cloned()
        .collect();
    let inputs: Vec<&std::path::Path> = all.iter().map(PathBuf::as_path).collect();
    Batch::check(&inputs, &arguments.outputs.files())?;
    if arguments.shares.on() {
        read_log::begin();
    }
    let runners = runners(arguments)?;
    let first = runners.first().ok_or_else(|| anyhow!("--model names no arm"))?;
    let (cell, surface, condition) = arguments.cell.read(first.knowledge.as_deref())?;
    arguments.outputs.refuse_other_kinds()?;
    let setup = cell_setup(&cell);
    let context = DeviationContext {
        runners: &runners,
        originals: originals.as_ref(),
        cell: &cell,
        setup: &setup,
        condition,
        tolerance_mm: arguments.tolerance,
        arguments: &arguments.cell,
    };
    let shared = read_log::finish();
    let store = if arguments.shares.on() {
        let options = arguments.relevant_options();
        let description =
            RunDescription { verb: "deviation", options, shared, context: Value::Null, output: None };
        let Some(store) = Store::open(&arguments.shares, &description, &mut jobs)? else {
            return Ok(ExitStatus::Done);
        };
        Some(store)
    } else {
        None
    };
    let steps = UnitSteps {
        read: |job: &Job| Programs::read(&job.paths),
        content: Programs::content,
        work: |job: &Job, programs: Programs| {
            Ok((context.judged(job, &programs, surface.as_ref())?, Vec::new()))
        },
        whole: true,
    };
    let mut found: Vec<ProgramReports> =
        on_threads(arguments.common.threads, || process_units(store.as_ref(), &jobs, &steps))??;
    if let ([one], false) = (found.as_mut_slice(), several)
        && let Some(error) = one.failed.take()
    {
        bail!("{error}");
    }
    if store.is_none() {
        note_unused_entries(found.iter().map(|found| &found.used), &cell, surface.as_ref());
    }
    let outputs = outputs_with(store.as_ref(), &arguments.shares, &arguments.outputs)?;
    let shown = Reports { outputs: &outputs, is_part: store.is_some() };
    shown.write(found, Batch::sparing(&all), |batch, name, reports| {
        #[cfg(feature = "visual")]
        if let Some(path) = &arguments.outputs.rrd {
            let arms = first.drawn(arguments.robot.named());
            batch.add(path, super::recording::path(name, arms, condition, reports, surface.as_ref())?);
        }
        #[cfg(not(feature = "visual"))]
        let _ = (batch, name, reports);
        Ok(())
    })
}

#[cfg(feature = "visual")]
impl Runner {
    /// The arms of a recording.
    fn drawn<'a>(&'a self, robot: Option<inputs::NamedRobot<'a>>) -> super::recording::Arms<'a> {
        let is = if self.after == After::Achieved { "simulated actual arm" } else { "estimated arm" };
        super::recording::Arms { real: &self.model, is, nominal: &self.nominal, robot }
    }
}

/// Title of a report.
fn name_of(programs: usize, reports: &[PathReport]) -> String {
    match reports {
        [first, ..] if programs == 1 => first.program.clone(),
        _ => format!("{programs} programs"),
    }
}

/// The result for one program.
pub(super) struct ProgramReports {
    /// Name of the program in messages.
    name: String,
    /// One report per arm.
    reports: Vec<PathReport>,
    /// The entries of the cell file that it uses; `None` if it was not examined.
    used: Option<Used>,
    /// The error, if it could not be processed.
    failed: Option<String>,
}

impl UnitResult for ProgramReports {
    fn failed(job: &Job, reason: &str) -> Self {
        Self { name: job.name(), reports: Vec::new(), used: None, failed: Some(reason.to_owned()) }
    }

    fn is_failed(&self) -> bool {
        self.failed.is_some()
    }

    fn record(&self) -> anyhow::Result<String> {
        let reports: Vec<Value> = self.reports.iter().map(view::kept).collect();
        Ok(json!({ "name": self.name, "reports": reports, "failed": self.failed }).to_string())
    }

    fn read(bytes: &[u8], key: &str, _: bool) -> Option<Recorded<Self>> {
        let found = |record: Value| {
            Some(Self {
                name: record["name"].as_str()?.to_owned(),
                reports: record["reports"].as_array()?.iter().map(view::from_kept).collect::<Option<_>>()?,
                used: None,
                failed: record["failed"].as_str().map(str::to_owned),
            })
        };
        Recorded::from_bytes(bytes, key)?.and_then(found)
    }
}

/// The outputs of a run.
struct Reports<'a> {
    outputs: &'a Outputs,
    /// One job of a shared run, which does not fail even if all its programs do.
    is_part: bool,
}

impl Reports<'_> {
    /// Prints and writes the reports; `further` adds more outputs.
    fn write(
        &self,
        found: Vec<ProgramReports>,
        mut batch: Batch,
        further: impl FnOnce(&mut Batch, &str, &[PathReport]) -> anyhow::Result<()>,
    ) -> anyhow::Result<ExitStatus> {
        let (programs, mut failed, mut reports) = (found.len(), 0, Vec::new());
        for found in found {
            if let Some(error) = found.failed {
                failed += 1;
                print_message(format_args!("failed: {}: {error}", found.name));
            }
            reports.extend(found.reports);
        }
        if reports.is_empty() && !self.is_part {
            bail!("none of {programs} programs has a motion whose deviation is known");
        }
        let name = name_of(programs, &reports);
        self.outputs.print(&view::summary(&name, &reports))?;
        self.outputs.add_made(
            &mut batch,
            || view::document(&reports),
            || view::whole_table(&reports),
            || view::json(&reports),
        )?;
        further(&mut batch, &name, &reports)?;
        batch.write()?;
        let is_doubtful = matches!(view::status(&reports), Status::Warning | Status::Bad);
        Ok(if failed > 0 || is_doubtful { ExitStatus::Flagged } else { ExitStatus::Done })
    }
}

/// The reports of a shared run, made from the records of its programs.
pub(super) fn gathered(
    found: Vec<ProgramReports>,
    outputs: &Outputs,
    batch: Batch,
) -> anyhow::Result<ExitStatus> {
    Reports { outputs, is_part: false }.write(found, batch, |_, _, _| Ok(()))
}

/// What all programs of a `deviation` run share.
struct DeviationContext<'a> {
    runners: &'a [Runner],
    originals: Option<&'a Programs>,
    cell: &'a Cell,
    setup: &'a Setup,
    condition: Condition,
    tolerance_mm: f64,
    arguments: &'a CellArguments,
}

impl DeviationContext<'_> {
    /// The reports of one program, one per arm.
    fn judged(
        &self,
        job: &Job,
        programs: &Programs,
        surface: Option<&SurfaceFile>,
    ) -> anyhow::Result<ProgramReports> {
        let task = programs.task(self.setup);
        if task.listing().motions.is_empty() {
            programs.refuse_other_kinds()?;
        }
        let original = self.originals.map(|original| original.task(self.setup));
        for runner in self.runners {
            for program in original.iter().chain([&task]) {
                refuse_contradictions(program.listing(), self.cell, surface, &runner.nominal)?;
            }
            if let Some(robot) = &runner.robot {
                robot_match::refuse_other_cell(self.cell, robot, &runner.nominal)?;
                robot_match::refuse_other_program(programs, robot, &runner.nominal)?;
            }
        }
        let name = match &job.under {
            // Below a folder the same file name may occur more than once.
            Some(under) if job.paths.len() == 1 => {
                job.paths[0].strip_prefix(under).unwrap_or(&job.paths[0]).display().to_string()
            }
            _ => programs.name(),
        };
        refuse_other_language(&name, &task, original.as_ref())?;
        refuse_other_original(&name, task.listing(), original.as_ref().map(|original| original.listing()))?;
        // The original defines the intended path.
        let cell = self.arguments;
        if let Some(Runner { robot: Some(robot), .. }) = self.runners.first() {
            cell.note_stated_overload(&task, robot);
        }
        let loads = [original.as_ref().unwrap_or(&task), &task].map(|program| cell.loads(program));
        let text_differences =
            original.as_ref().map_or_else(Vec::new, |original| original.text_differences(&task));
        let reports: Vec<PathReport> = self
            .runners
            .iter()
            .map(|runner| {
                let judged = VerificationTask {
                    original: original.as_ref().map_or(task.listing(), |o| o.listing()),
                    rewritten: original.as_ref().map(|_| task.listing()),
                    cell: self.cell,
                    surface: surface.map(|s| &s.surface),
                    program: &name,
                    name: &runner.name,
                    after: runner.after,
                    tolerance_mm: self.tolerance_mm,
                    loads: [loads[0].as_ref(), loads[1].as_ref()],
                };
                let acting = ActingArm {
                    nominal: &runner.nominal,
                    model: &runner.model,
                    knowledge: runner.knowledge.as_deref(),
                    condition: self.condition,
                };
                let mut report = verify(&judged, &acting);
                report.differences.extend(text_differences.iter().cloned());
                report
            })
            .collect();
        if reports.iter().all(|report| report.points.is_empty()) {
            bail!("{name}: {}", why_no_point(&reports));
        }
        if original.is_some() {
            refuse_unrelated(&name, &reports)?;
        }
        let mut used = Used::by(task.listing(), self.cell);
        if let Some(original) = &original {
            used.join(&Used::by(original.listing(), self.cell));
        }
        Ok(ProgramReports { name: job.name(), reports, used: Some(used), failed: None })
    }
}

/// Refuses an original in another language.
fn refuse_other_language(
    name: &str,
    task: &Program<'_>,
    original: Option<&Program<'_>>,
) -> anyhow::Result<()> {
    let words = |program: &Program<'_>| match program.language() {
        Language::Rapid => "RAPID",
        Language::Nc => "NC code",
    };
    match original.map(words) {
        Some(other) if other != words(task) => bail!(
            "{name}: this is {}, but the program of --intended is {other}: give the program from which it was rewritten",
            words(task)
        ),
        _ => Ok(()),
    }
}

/// Refuses an original with more motions than its correction, and a correction without its original.
fn refuse_other_original(name: &str, task: &Listing, original: Option<&Listing>) -> anyhow::Result<()> {
    let Some(original) = original else {
        if let Some(mark) = task.marks.iter().flatten().next() {
            bail!(
                "{name}: already corrected with model {}; give the original program as well (--intended)",
                mark.model
            );
        }
        return Ok(());
    };
    if let Some(mark) = original.marks.iter().flatten().next() {
        let is_swapped = task.marks.iter().all(Option::is_none);
        let swapped = if is_swapped {
            "the two programs are swapped"
        } else {
            "give the program before any correction"
        };
        bail!("{name}: the program of --intended is itself corrected (with model {}): {swapped}", mark.model);
    }
    // Rewriting inserts motions and removes none.
    let [moves, intended] = [task, original].map(|listing| listing.motions.len());
    if moves < intended {
        bail!(
            "{name}: {moves} motions, but the program of --intended has {intended}: give the program from which it was rewritten"
        );
    }
    Ok(())
}

/// Reasons that are reported of a program without a point.
const MAX_REASONS: usize = 4;

/// Why no motion of a program has a deviation: the most frequent reasons, each with its first line.
pub(super) fn why_no_point(reports: &[PathReport]) -> String {
    let missing = reports.iter().find_map(|report| report.missing.as_ref());
    let motions = missing.map_or(&[][..], |missing| &missing.motions);
    if motions.is_empty() {
        return "it has no motion of the tool".to_owned();
    }
    let mut reasons: Vec<(&str, usize, u32)> = Vec::new();
    // Sentences that name lines or sizes are many.
    let mut index_of: HashMap<&str, usize> = HashMap::new();
    for motion in motions {
        let reason = motion.reason.as_deref().unwrap_or("its target is not in the program text");
        let index = *index_of.entry(reason).or_insert_with(|| {
            reasons.push((reason, 0, motion.line));
            reasons.len() - 1
        });
        reasons[index].1 += 1;
    }
    reasons.sort_by_key(|(_, count, _)| std::cmp::Reverse(*count));
    let told: Vec<String> = reasons
        .iter()
        .take(MAX_REASONS)
        .map(|(reason, count, line)| {
            let motions = if *count == 1 { "motion" } else { "motions" };
            format!("{count} {motions} from line {line}: {reason}")
        })
        .collect();
    format!("the deviation of none of its {} motions is known: {}", motions.len(), told.join("; "))
}

/// No correction moves a target so far (mm).
const OTHER_TARGET_MM: f64 = 100.0;

/// Refuses a program that was not rewritten from that of `--intended`.
fn refuse_unrelated(name: &str, reports: &[PathReport]) -> anyhow::Result<()> {
    let ends = reports.iter().flat_map(|report| &report.points);
    let farthest = ends
        .filter_map(|point| Some((point.line, point.after?.norm_mm())))
        .max_by(|(_, a), (_, b)| a.total_cmp(b));
    if let Some((line, mm)) = farthest.filter(|(_, mm)| *mm > OTHER_TARGET_MM) {
        bail!(
            "{name}: it ends {mm:.0} mm from the target of line {line} of the program of --intended, further than any correction: give the program \
             from which it was rewritten"
        );
    }
    Ok(())
}

fn runners(arguments: &Arguments) -> anyhow::Result<Vec<Runner>> {
    let models = arguments.model.iter().map(|m| inputs::model(m)).collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(path) = &arguments.actual {
        let text = files::read_text(path)?;
        let file: ArmFile = toml::from_str(&text).map_err(|e| {
            let told = anyhow!(
                "{}: not an arm file of `simulate --arm`: {}",
                path.display(),
                e.to_string().trim_end()
            );
            inputs::other_kind_or(path, &[FileKind::Arm], "an arm file of `simulate --arm`", told)
        })?;
        let model = file.model().map_err(|e| anyhow!("{}: {e}", path.display()))?;
        let first = models.first().ok_or_else(|| anyhow!("--model is missing"))?;
        let (robot, nominal) = inputs::nominal(first, arguments.robot.named())?;
        let name = format!("actual arm {}", files::name(path));
        let robot = Some(robot);
        return Ok(vec![Runner { name, robot, nominal, model, knowledge: None, after: After::Achieved }]);
    }
    models.iter().for_each(inputs::warn_doubtful);
    models
        .into_iter()
        .map(|model| {
            let (robot, nominal) = inputs::nominal(&model, arguments.robot.named())?;
            match model {
                NamedModel::Nominal => bail!(
                    "--model nominal: the nominal arm has no deviation from itself; give an estimated arm, or --actual ARM.toml"
                ),
                NamedModel::Estimated { name, arm, .. } => Ok(Runner {
                    name,
                    robot: Some(robot),
                    nominal,
                    model: arm.model.clone(),
                    knowledge: Some(arm),
                    after: After::PredictedRemainder,
                }),
            }
        })
        .collect()
}
