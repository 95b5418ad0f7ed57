//! `truegrind diagnose DATA --robot R -o MODEL.toml`. Many arms in one run are in `fleet`.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use truegrind::ErrorSummary;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind::calibration::diagnosis::transfer::transfer;
use truegrind::calibration::identification::calibration::Frames;
use truegrind::calibration::identification::fit::summary_on;
use truegrind::calibration::identification::identify::prepare_observations;
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::math::work::report_step;
use truegrind::report::diagnosis as view;

use super::computation::{Common, watching};
use super::ending::Ending;
use super::files::Batch;
use super::identify::{DataArguments, FitArguments, PointsArguments, read, write_model};
use super::outputs::Outputs;
use super::progress::Work;
use super::shares::Shares;
use super::stated::{HeldArguments, StatedArguments};
use super::terminal::tell;

/// Arguments of `diagnose`.
#[derive(Debug, Clone, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) data: DataArguments,
    /// More measurements, each of an arm of its own. With these, or where DATA is a folder of measurements, one table over all arms
    /// is made, and -o names a folder for their models and pages.
    #[arg(value_name = "MORE")]
    pub(super) more: Vec<PathBuf>,
    /// The extended model to write; one that fails the verdicts of `identify`, or is worse than geometry on held-out rows, is
    /// not written, a doubtful one only with --allow-doubtful.
    #[arg(short, long, value_name = "MODEL.toml")]
    pub(super) output: Option<PathBuf>,
    /// Write a doubtful model too: one whose data do not promise that programs gain. The file carries the verdict.
    #[arg(long)]
    pub(super) allow_doubtful: bool,
    /// Chance of any false finding on data with nothing hidden.
    #[arg(long, default_value_t = 0.01)]
    pub(super) alpha: f64,
    /// Most causes that are accepted.
    #[arg(long, default_value_t = 20)]
    pub(super) most: usize,
    /// Contiguous blocks that are held out in turn, beside five random folds.
    #[arg(long, default_value_t = 10)]
    pub(super) blocks: usize,
    /// Let a smooth correction, without a physical name, follow what no cause explains; it is kept only where it lowers both
    /// held-out errors.
    #[arg(long)]
    pub(super) smooth: bool,
    /// Another series of the same arm, on which the models are judged with only the frames refitted.
    #[arg(long, value_name = "DATA")]
    pub(super) also: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) asked: FitArguments,
    #[command(flatten)]
    pub(super) stated: StatedArguments,
    #[command(flatten)]
    pub(super) held: HeldArguments,
    #[command(flatten)]
    pub(super) common: Common,
    #[command(flatten)]
    pub(super) outputs: Outputs,
    #[command(flatten)]
    pub(super) shares: Shares,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let mut targets = arguments.outputs.files();
    targets.extend(arguments.output.as_deref());
    let mut given: Vec<&std::path::Path> = arguments.data.files();
    given.extend(arguments.also.iter().map(PathBuf::as_path));
    Batch::check(&given, &targets)?;
    let options = options(arguments)?;
    let (robot, dataset) = read(&arguments.data)?;
    let name = robot.sheet.name.clone();
    let work = Work::start(format!("diagnosing {name} from {} rows", dataset.rows.len()));
    let others = arguments
        .also
        .iter()
        .map(|data| {
            Ok(read(&DataArguments {
                data: data.clone(),
                points: PointsArguments::default(),
                sheet: None,
                ..arguments.data.clone()
            })?
            .1)
        })
        .collect::<anyhow::Result<Vec<Dataset>>>()?;
    let found = watching(arguments.common.threads, &work, || {
        of_rows(arguments, &options, &name, &robot.model, &dataset, &others)
    })??;
    drop(work);
    for note in found.diagnosis.notes.iter().chain(&dataset.notes) {
        tell(format_args!("note: {note}"));
    }
    arguments.outputs.print(&view::summary(&found))?;
    let mut batch = Batch::sparing(given);
    let json = serde_json::to_value(found.diagnosis.clone().counted_from_0(&dataset))?;
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&found, &dataset),
        || view::finding_table(&found.diagnosis),
        || json,
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        batch.add(path, super::recording::diagnosis(&found, &dataset, &arguments.data.robot)?);
    }
    let unexplained = found.diagnosis.findings.iter().any(|f| f.effect == "unexplained");
    let ending = write_model(&found.estimated, arguments.output.as_deref(), arguments.allow_doubtful, batch)?;
    Ok(if unexplained { Ending::Flagged } else { ending })
}

/// What is asked of a diagnosis.
pub(super) fn options(arguments: &Arguments) -> anyhow::Result<Options> {
    if !(arguments.alpha > 0.0 && arguments.alpha <= 0.5) {
        bail!("--alpha {}: expected a probability above 0, up to 0.5", arguments.alpha);
    }
    if arguments.blocks < 2 {
        bail!("--blocks {}: expected at least 2", arguments.blocks);
    }
    let mut options = Options {
        blocks: arguments.blocks,
        smooth: arguments.smooth,
        fuse_readout: !arguments.asked.raw_columns,
        limits: arguments.asked.limits()?,
        ..Options::default()
    };
    options.selection.alpha = arguments.alpha;
    options.selection.most = arguments.most;
    options.selection.seed = arguments.common.seed;
    Ok(options)
}

/// The diagnosis of the rows of one arm, judged on its other series.
pub(super) fn of_rows(
    arguments: &Arguments,
    options: &Options,
    name: &str,
    nominal: &Model,
    dataset: &Dataset,
    others: &[Dataset],
) -> anyhow::Result<Diagnosed> {
    let frames = starting_frames(dataset, nominal, &options.tolerance, options.fuse_readout)?;
    let stated = arguments.stated.frames(dataset)?;
    let (tolerance, frames) = arguments.held.held(&options.tolerance, stated.as_ref(), frames)?;
    let held = Options { tolerance, ..options.clone() };
    let mut found = diagnose(dataset, name, nominal, &frames, &held, &|step| report_step(step))?;
    if let Some(stated) = &stated {
        let raw = raw_error(dataset, nominal, stated, options.fuse_readout);
        found.diagnosis.notes.push(format!(
            "with the frames as stated the data sheet's arm is {:.3} mm RMS off (raw error, nothing fitted)",
            raw.rmse
        ));
    }
    for other in others {
        report_step(&format!("judging on {}", other.file));
        let frames = starting_frames(other, nominal, &options.tolerance, options.fuse_readout)?;
        found.diagnosis.transfers.push(transfer(
            other,
            &frames,
            nominal,
            &found.geometric.model,
            &found.extended.model,
            &options.tolerance,
            options.fuse_readout,
        ));
    }
    Ok(found)
}

/// What the data sheet's arm is off by with frames that were measured by other means.
fn raw_error(dataset: &Dataset, nominal: &Model, stated: &Frames, fuse: bool) -> ErrorSummary {
    summary_on(&prepare_observations(dataset, nominal, fuse).0, nominal, stated)
}

/// The diagnosis, starting frames included.
pub(super) fn diagnosed(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    options: &Options,
    tell: &(dyn Fn(&str) + Sync),
) -> anyhow::Result<Diagnosed> {
    let frames = starting_frames(dataset, nominal, &options.tolerance, true)?;
    Ok(diagnose(dataset, robot, nominal, &frames, options, tell)?)
}
