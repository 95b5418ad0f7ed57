//! `truegrind deviation PROGRAM… --model MODEL.toml…`: the report alone.

use std::path::PathBuf;

use anyhow::{anyhow, bail};
use clap::Args;
use rayon::prelude::*;
use truegrind::arm::arm_file::ArmFile;
use truegrind::arm::condition::Condition;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::{Cell, Used};
use truegrind::compensation::deviation::{After, PathReport};
use truegrind::compensation::verify::{Acting, Judged, judge};
use truegrind::programs::nc::setup::Setup;
use truegrind::report::deviation as view;
use truegrind::surfaces::SurfaceFile;

use super::belonging;
use super::compensate::{CellArguments, agreed, say_unused};
use super::computation::{Common, on_threads};
use super::defect::isolated;
use super::ending::Ending;
use super::files::{self, Batch};
use super::inputs;
use super::inputs::NamedModel;
use super::outputs::Outputs;
use super::programs::{self, Grouping, Job, Programs};
use super::terminal::tell;

/// Arguments of `deviation`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// RAPID modules of one task, .pgf lists of such, NC files, or folders of them.
    #[arg(required = true)]
    programs: Vec<PathBuf>,
    #[command(flatten)]
    grouping: Grouping,
    /// Estimated arms; one row each. With --actual the word `nominal` is enough.
    #[arg(long, required = true, num_args = 1..)]
    model: Vec<String>,
    /// Robot; optional where a model says it, and checked against it.
    #[arg(long)]
    robot: Option<String>,
    /// The original program, which states what was meant; PROGRAM is then what came of it.
    #[arg(long, value_name = "ORIGINAL")]
    intended: Vec<PathBuf>,
    /// A simulated actual arm (`simulate --arm`), on which the programs are run.
    #[arg(long, value_name = "ARM.toml")]
    actual: Option<PathBuf>,
    #[command(flatten)]
    cell: CellArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

/// An arm on which programs are run.
struct Runner {
    name: String,
    /// The robot, by the name that its model gives.
    robot: Option<String>,
    nominal: Model,
    model: Model,
    knowledge: Option<Box<Estimated>>,
    after: After,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let jobs = programs::jobs(&arguments.programs, arguments.grouping)?;
    let several = jobs.len() > 1;
    if several && !arguments.intended.is_empty() {
        bail!("--intended states what one program meant: name one program, not {}", jobs.len());
    }
    let originals =
        if arguments.intended.is_empty() { None } else { Some(Programs::read(&arguments.intended)?) };
    let all: Vec<&std::path::Path> = jobs
        .iter()
        .flat_map(|job| &job.paths)
        .chain(originals.iter().flat_map(|o| o.files.iter().map(|(path, _)| path)))
        .map(PathBuf::as_path)
        .collect();
    Batch::check(&all, &arguments.outputs.files())?;
    let runners = runners(arguments)?;
    let first = runners.first().ok_or_else(|| anyhow!("--model names no arm"))?;
    let (cell, surface, condition) = arguments.cell.read(first.knowledge.as_deref())?;
    let robot = arguments.robot.as_deref().or(first.robot.as_deref());
    let setup = programs::setup(&cell, robot);
    let shop = Shop {
        runners: &runners,
        originals: originals.as_ref(),
        cell: &cell,
        setup: &setup,
        condition,
        arguments: &arguments.cell,
    };
    let found: Vec<anyhow::Result<(Vec<PathReport>, Used)>> = on_threads(arguments.common.threads, || {
        jobs.par_iter().map(|job| isolated(|| shop.reports(job, surface.as_ref()))).collect()
    })?;
    let (mut reports, mut used, mut failed) = (Vec::new(), Vec::new(), 0);
    for (found, job) in found.into_iter().zip(&jobs) {
        match found {
            Ok((found, uses)) => {
                reports.extend(found);
                used.push(Some(uses));
            }
            // A bad one among many is listed, and the others go on.
            Err(error) if several => {
                failed += 1;
                used.push(None);
                tell(format_args!("failed: {}: {error:#}", job.name()));
            }
            Err(error) => return Err(error),
        }
    }
    say_unused(&used, &cell, surface.as_ref());
    if reports.is_empty() {
        bail!("none of {} programs has a motion whose target is known from the text", jobs.len());
    }
    let name = if several { format!("{} programs", jobs.len()) } else { reports[0].program.clone() };
    arguments.outputs.print(&view::summary(&name, &reports))?;
    let mut batch = Batch::sparing(&all);
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&reports),
        || view::whole_table(&reports),
        || view::json(&reports),
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        let is = if first.after == After::Achieved { "simulated actual arm" } else { "estimated arm" };
        let arms = super::recording::Arms {
            real: &first.model,
            is,
            nominal: &first.nominal,
            robot: arguments.robot.as_deref(),
        };
        let bytes = super::recording::path(&name, arms, condition, &reports, surface.as_ref())?;
        batch.add(path, bytes);
    }
    batch.write()?;
    Ok(if failed > 0 { Ending::Flagged } else { Ending::Done })
}

/// What all programs of a run are judged by.
struct Shop<'a> {
    runners: &'a [Runner],
    originals: Option<&'a Programs>,
    cell: &'a Cell,
    setup: &'a Setup,
    condition: Condition,
    arguments: &'a CellArguments,
}

impl Shop<'_> {
    /// The reports of one program, one per arm.
    fn reports(&self, job: &Job, surface: Option<&SurfaceFile>) -> anyhow::Result<(Vec<PathReport>, Used)> {
        let programs = Programs::read(&job.paths)?;
        let task = programs.task(self.setup);
        let original = self.originals.map(|original| original.task(self.setup));
        for runner in self.runners {
            for program in original.iter().chain([&task]) {
                agreed(program.listing(), self.cell, surface, &runner.nominal)?;
            }
            if let Some(robot) = &runner.robot {
                belonging::cell_is_of(self.cell, robot, &runner.nominal)?;
                belonging::made_for(&programs, robot, &runner.nominal)?;
            }
        }
        let name = match &job.under {
            // Below a folder the same name may be there more than once.
            Some(under) if job.paths.len() == 1 => {
                job.paths[0].strip_prefix(under).unwrap_or(&job.paths[0]).display().to_string()
            }
            _ => programs.name(),
        };
        // The first program is the one that states what was meant.
        let cell = self.arguments;
        let loads = [original.as_ref().unwrap_or(&task), &task].map(|program| cell.loads(program));
        let reports: Vec<PathReport> = self
            .runners
            .iter()
            .map(|runner| {
                let judged = Judged {
                    original: original.as_ref().map_or(task.listing(), |o| o.listing()),
                    rewritten: original.as_ref().map(|_| task.listing()),
                    cell: self.cell,
                    surface: surface.map(|s| &s.surface),
                    program: &name,
                    name: &runner.name,
                    after: runner.after,
                    loads: [loads[0].as_ref(), loads[1].as_ref()],
                };
                let acting = Acting {
                    nominal: &runner.nominal,
                    model: &runner.model,
                    knowledge: runner.knowledge.as_deref(),
                    condition: self.condition,
                };
                judge(&judged, &acting)
            })
            .collect();
        if reports.iter().all(|report| report.points.is_empty()) {
            bail!("{name}: no motion has a target that is known from the text");
        }
        let mut used = Used::by(task.listing(), self.cell);
        if let Some(original) = &original {
            used.join(&Used::by(original.listing(), self.cell));
        }
        Ok((reports, used))
    }
}

fn runners(arguments: &Arguments) -> anyhow::Result<Vec<Runner>> {
    let models = arguments.model.iter().map(|m| inputs::model(m)).collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(path) = &arguments.actual {
        let text = files::read_text(path)?;
        let file: ArmFile = toml::from_str(&text).map_err(|e| {
            anyhow!("{}: not an arm of `simulate --arm`: {}", path.display(), e.to_string().trim_end())
        })?;
        let model = file.model().map_err(|e| anyhow!("{}: {e}", path.display()))?;
        let first = models.first().ok_or_else(|| anyhow!("--model is missing"))?;
        let (robot, nominal) = inputs::nominal(first, arguments.robot.as_deref())?;
        let name = format!("actual arm {}", files::name(path));
        let robot = Some(robot);
        return Ok(vec![Runner { name, robot, nominal, model, knowledge: None, after: After::Achieved }]);
    }
    models.iter().for_each(inputs::say_doubtful);
    models
        .into_iter()
        .map(|model| {
            let (robot, nominal) = inputs::nominal(&model, arguments.robot.as_deref())?;
            match model {
                NamedModel::Nominal => bail!(
                    "--model nominal has no deviation from itself: give an estimated arm, or --actual ARM.toml"
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
