//! `truegrind diagnose DATA --robot R -o MODEL.toml` for one arm; see `fleet` for many.

use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::diagnose::{Diagnosed, Options, diagnose};
use truegrind::calibration::diagnosis::measured::diagnose_rows;
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::report::diagnosis as view;

use super::computation::{Common, watching};
use super::exit_status::ExitStatus;
use super::files::Batch;
use super::identify::{DataArguments, FitArguments, PointsArguments, read, write_model};
use super::output_extension;
use super::outputs::Outputs;
use super::progress::Spinner;
use super::shares::Shares;
use super::stated_frames::{FramePriorArguments, StatedFrameArguments};
use super::terminal::print_message;

/// Arguments of `diagnose`.
#[derive(Debug, Clone, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) data: DataArguments,
    /// Measurements of further arms. With these, or if DATA is a folder, each file is one arm: one table over all arms is made, and
    /// -o names a folder for models and pages.
    #[arg(value_name = "MORE")]
    pub(super) more: Vec<PathBuf>,
    /// Model file to write. A model that fails the criteria of `identify`, or is worse than geometry on held-out rows, is not
    /// written; a doubtful one only with --allow-doubtful.
    #[arg(short, long, value_name = "MODEL.toml")]
    pub(super) output: Option<PathBuf>,
    /// Also write a doubtful model, whose data do not show that programs improve. The file contains the verdict.
    #[arg(long)]
    pub(super) allow_doubtful: bool,
    /// Probability of any false finding on data without further causes.
    #[arg(long, default_value_t = 0.01)]
    pub(super) alpha: f64,
    /// Largest number of causes.
    #[arg(long, default_value_t = 20)]
    pub(super) most: usize,
    /// Number of contiguous blocks held out in turn, in addition to five random folds.
    #[arg(long, default_value_t = 10)]
    pub(super) blocks: usize,
    /// Add a smooth correction without physical meaning for the unexplained rest, if it lowers both held-out errors.
    #[arg(long)]
    pub(super) smooth: bool,
    /// Another measurement of the same arm, on which the models are tested with only the sensor frames refitted. May be repeated.
    #[arg(long, value_name = "DATA")]
    pub(super) also: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) fit: FitArguments,
    #[command(flatten)]
    pub(super) stated: StatedFrameArguments,
    #[command(flatten)]
    pub(super) prior: FramePriorArguments,
    #[command(flatten)]
    pub(super) common: Common,
    #[command(flatten)]
    pub(super) outputs: Outputs,
    #[command(flatten)]
    pub(super) shares: Shares,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut targets = arguments.outputs.files();
    targets.extend(arguments.output.as_deref());
    let mut given: Vec<&std::path::Path> = arguments.data.files();
    given.extend(arguments.also.iter().map(PathBuf::as_path));
    Batch::check(&given, &targets)?;
    arguments.output.as_deref().map_or(Ok(()), output_extension::refuse_no_model)?;
    let options = options(arguments)?;
    let (robot, dataset) = read(&arguments.data)?;
    let name = robot.sheet.name.clone();
    let work = Spinner::start(format!("diagnosing {name} from {} rows", dataset.rows.len()));
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
    arguments.outputs.refuse_other_kinds()?;
    let found = watching(arguments.common.threads, &work, || {
        let placement = arguments.stated.prior(&arguments.prior)?;
        let arm = (name.as_str(), &robot.model);
        anyhow::Ok(diagnose_rows((&dataset, &others), arm, &placement, &options)?)
    })??;
    drop(work);
    for note in found.diagnosis.notes.iter().chain(&dataset.notes) {
        print_message(format_args!("note: {note}"));
    }
    arguments.outputs.print(&view::summary(&found))?;
    let mut batch = Batch::sparing(given);
    let json = serde_json::to_value(found.diagnosis.clone().with_rows_from_0(&dataset))?;
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&found, &dataset),
        || view::finding_table(&found.diagnosis),
        || json,
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        batch.add(path, super::recording::diagnosis(&found, &dataset, arguments.data.named())?);
    }
    let unexplained = found.diagnosis.is_partly_unexplained();
    let ending = write_model(&found.estimated, arguments.output.as_deref(), arguments.allow_doubtful, batch)?;
    Ok(if unexplained { ExitStatus::Flagged } else { ending })
}

/// Causes that one arm never has.
const MAX_CAUSES: usize = 200;

/// Options of the library.
pub(super) fn options(arguments: &Arguments) -> anyhow::Result<Options> {
    if !(arguments.alpha > 0.0 && arguments.alpha <= 0.5) {
        bail!("--alpha {}: expected a probability above 0, up to 0.5", arguments.alpha);
    }
    if arguments.blocks < 2 {
        bail!("--blocks {}: expected at least 2", arguments.blocks);
    }
    if !(1..=MAX_CAUSES).contains(&arguments.most) {
        bail!(
            "--most {}: expected 1 to {MAX_CAUSES} causes; `truegrind identify` fits geometry without any",
            arguments.most
        );
    }
    let mut options = Options {
        blocks: arguments.blocks,
        smooth: arguments.smooth,
        fuse_readout: !arguments.fit.raw_columns,
        limits: arguments.fit.limits()?,
        arm_tolerance: arguments.fit.tolerance()?,
        ..Options::default()
    };
    options.selection.alpha = arguments.alpha;
    options.selection.most = arguments.most;
    options.selection.seed = arguments.common.seed;
    Ok(options)
}

/// Diagnosis including the starting frames.
pub(super) fn diagnosed(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
) -> anyhow::Result<Diagnosed> {
    let frames = starting_frames(dataset, nominal, &options.tolerance, true)?;
    Ok(diagnose(dataset, robot, nominal, &frames, options, progress)?)
}
