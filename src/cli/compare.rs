//! `truegrind compare DATA --robot R --experiment NAME`: compares methods in the experiment of a paper.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::arm::model::Model;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::file_kind::FileKind;
use truegrind::papers::experiment::{Experiment, Kind};
use truegrind::papers::grinding::Actual;
use truegrind::papers::protocol::Options;
use truegrind::papers::views::{self as view, Origin};
use truegrind::papers::{Results, degradation, grinding, protocol, signed_rank, simulated, uniformity};
use truegrind::report::format;

use super::computation::{Common, on_threads};
use super::exit_status::ExitStatus;
use super::files::Batch;
use super::identify::{Angles, DataArguments};
use super::inputs::{self, UrdfLinks};
use super::output_extension::csv_file;
use super::outputs::Outputs;
use super::progress::Spinner;
use super::terminal::{print_message, print_message_lines, print_result, width};
use super::{files, identify};

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Measurements, CSV or XLSX. Default: simulated from the recipe of the experiment.
    data: Option<PathBuf>,
    /// Measured robot: a name from `truegrind robots`, or a robot file. Required with DATA.
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    links: UrdfLinks,
    /// Experiment: a name from `--list`, or a TOML file.
    #[arg(long)]
    experiment: Option<String>,
    /// List the experiments.
    #[arg(long)]
    list: bool,
    /// Number of rows per case, for a reduced protocol with the same shares.
    #[arg(long, value_name = "N")]
    rows: Option<usize>,
    /// Sheet of a workbook. Default: the first with the needed columns.
    #[arg(long)]
    sheet: Option<String>,
    /// Convention of the logged angles. Default: that of the robot file.
    #[arg(long, value_enum)]
    angles: Option<Angles>,
    /// Accept implausible units.
    #[arg(long)]
    allow_odd_units: bool,
    /// Write computing times as CSV. Other files contain them only with --timings, since they differ from run to run.
    #[arg(long, value_name = "FILE", value_parser = csv_file)]
    times: Option<PathBuf>,
    /// Show computing times on stderr and in the reports, which then differ from run to run.
    #[arg(long)]
    timings: bool,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

/// The measurements and their robot.
struct Measured {
    dataset: Dataset,
    robot: String,
    nominal: Model,
    actual: Option<Model>,
    /// 0 unless the rows are simulated.
    sensor_sigma_mm: f64,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    if arguments.list {
        print_result(format::terminal::document(&view::list(&Experiment::shipped()?), width()))?;
        return Ok(ExitStatus::Done);
    }
    let Some(name) = arguments.experiment.as_deref() else {
        bail!("--experiment is missing: `truegrind compare --list` lists the experiments");
    };
    let mut inputs: Vec<&Path> = arguments.data.as_deref().into_iter().collect();
    // A file under any name but that of a shipped experiment; what it is, is told where it is read.
    let is_file = name.ends_with(".toml") || name.contains('/') || Path::new(name).is_file();
    if is_file {
        inputs.push(Path::new(name));
    }
    let mut targets = arguments.outputs.files();
    targets.extend(arguments.times.as_deref());
    Batch::check(&inputs, &targets)?;
    let experiment = if is_file {
        let text = files::read_text(Path::new(name))?;
        Experiment::parse(&text, name).map_err(|e| {
            inputs::other_kind_or(Path::new(name), &[FileKind::Experiment], "an experiment (.toml)", e)
        })?
    } else {
        Experiment::by_name(name)?
    };
    if arguments.outputs.rrd.is_some() && !experiment.takes_rows() {
        bail!(
            "--rrd: experiment {name} moves no arm, so there is nothing to draw; --html FILE writes its plots"
        );
    }
    let kind = experiment.kind().ok_or_else(|| anyhow!("{name}: the experiment defines nothing to run"))?;
    let seed = arguments.common.seed;
    let mut origin = Origin { seed, timings: arguments.timings, ..Origin::default() };
    let measured = if experiment.takes_rows() { Some(measured(arguments, &experiment)?) } else { None };
    arguments.outputs.refuse_other_kinds()?;
    if let Some(measured) = &measured {
        origin.file = Some(measured.dataset.file.clone());
        origin.sha256 = Some(measured.dataset.sha256.clone());
        origin.rows = Some(measured.dataset.rows.len());
        origin.robot = Some(measured.robot.clone());
        measured.dataset.notes.iter().for_each(|note| print_message(format_args!("note: {note}")));
    } else if let Some(data) = &arguments.data {
        bail!("{}: experiment {name} takes no measurements; omit DATA", data.display());
    }
    if arguments.rows.is_some() && !experiment.takes_rows() {
        bail!("--rows: experiment {name} uses no rows");
    }
    let work = Spinner::start(format!("experiment {}", experiment.name));
    let results =
        on_threads(arguments.common.threads, || results(arguments, &experiment, kind, measured.as_ref()))??;
    drop(work);
    let summary = view::summary(&experiment, &results);
    arguments.outputs.print(&summary)?;
    let times = view::times(&results);
    if let Some(times) = times.as_ref().filter(|_| arguments.timings) {
        print_message_lines(&format::terminal::table(times, width()));
    }
    let mut batch = Batch::sparing(inputs);
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&experiment, &results, &origin),
        || view::table(&results),
        || view::json(&experiment, &results, &origin),
    )?;
    #[cfg(feature = "visual")]
    if let (Some(path), Some(measured)) = (&arguments.outputs.rrd, &measured) {
        let (dataset, nominal) = (&measured.dataset, &measured.nominal);
        let compared = super::recording::Compared {
            dataset,
            nominal,
            actual: measured.actual.as_ref(),
            robot: arguments.links.of(arguments.robot.as_deref().unwrap_or(&measured.robot)),
        };
        batch.add(path, super::recording::comparison(&compared, &summary)?);
    }
    if let (Some(path), Some(times)) = (&arguments.times, &times) {
        batch.add(path, format::csv::table(times));
    }
    batch.write()?;
    Ok(ExitStatus::Done)
}

/// Runs an experiment, on measurements if it uses any.
fn results(
    arguments: &Arguments,
    experiment: &Experiment,
    kind: Kind<'_>,
    measured: Option<&Measured>,
) -> anyhow::Result<Results> {
    let seed = arguments.common.seed;
    let rows = || measured.ok_or_else(|| anyhow!("no measurements"));
    let options = |from: &Measured| Options {
        rows: arguments.rows,
        seed,
        simulated: arguments.data.is_none(),
        sensor_sigma_mm: from.sensor_sigma_mm,
    };
    Ok(match kind {
        Kind::Methods(methods) => {
            let from = rows()?;
            let (data, robot, nominal) = (&from.dataset, &from.robot, &from.nominal);
            let study = protocol::run(experiment, methods, data, robot, nominal, &options(from))?;
            Results::Methods(Box::new(study))
        }
        Kind::Grinding(settings) => {
            let from = rows()?;
            let actual = from.actual.as_ref().map_or(Actual::Estimated, Actual::Simulated);
            let (data, robot, nominal) = (&from.dataset, &from.robot, &from.nominal);
            let name = &experiment.name;
            let result = grinding::run(settings, name, data, robot, nominal, actual, &options(from))?;
            Results::Grinding(Box::new(result))
        }
        Kind::Uniformity(settings) => Results::Uniformity(uniformity::run(settings, seed)),
        Kind::SignedRank(tables) => Results::SignedRank(signed_rank::run(tables)),
        Kind::Degradation(settings) => {
            let recipe = experiment.recipe.as_deref().unwrap_or_default();
            let result = degradation::run(settings, &experiment.name, recipe, seed, nominal)?;
            Results::Degradation(Box::new(result))
        }
    })
}

fn nominal(name: &str) -> Result<Model, String> {
    inputs::robot(name).map(|r| r.model).map_err(|e| format!("{e:#}"))
}

fn measured(arguments: &Arguments, experiment: &Experiment) -> anyhow::Result<Measured> {
    let Some(data) = &arguments.data else {
        if arguments.robot.is_some() {
            bail!("--robot without DATA: the recipe of the experiment names its robot");
        }
        let (dataset, simulation, robot) = simulated::measure(experiment, nominal)?;
        let recipe = simulated::recipe(experiment.recipe.as_deref().unwrap_or_default(), &experiment.name)?;
        return Ok(Measured {
            dataset,
            robot,
            nominal: simulation.nominal,
            actual: Some(simulation.actual),
            sensor_sigma_mm: recipe.noise.sigma_mm,
        });
    };
    let robot = arguments.robot.as_deref().ok_or_else(|| {
        anyhow!(
            "{}: --robot is missing: name the measured robot; `truegrind robots` lists the known ones",
            data.display()
        )
    })?;
    let (robot, dataset) = identify::read(&DataArguments {
        sheet: arguments.sheet.clone(),
        angles: arguments.angles,
        allow_odd_units: arguments.allow_odd_units,
        ..DataArguments::of(data.clone(), arguments.links.of(robot))
    })?;
    Ok(Measured {
        dataset,
        robot: robot.sheet.name.clone(),
        nominal: robot.model,
        actual: None,
        sensor_sigma_mm: 0.0,
    })
}
