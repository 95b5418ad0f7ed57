//! `truegrind identify DATA --robot R -o MODEL.toml`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};

use truegrind::arm::estimated::{Estimated, Judgement};
use truegrind::arm::model::Model;
use truegrind::calibration::identification::calibration::Frames;
use truegrind::calibration::identification::identify::{Identification, Options, identify};
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::identification::solver::{SOLVERS, by_name};
use truegrind::calibration::identification::study::study;
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::calibration::identification::verdict::Limits;
use truegrind::calibration::measurement::convention::AngleConvention;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::calibration::measurement::import::{self, Clocks};
use truegrind::calibration::measurement::matching::{Mismatch, matched};
use truegrind::calibration::measurement::split::{self, Split};
use truegrind::report::format;
use truegrind::report::{identification as view, study as study_view};
use truegrind::robots::Robot;

use super::computation::{Common, on_threads, watching};
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs;
use super::outputs::Outputs;
use super::progress::Spinner;
use super::stated_frames::{FramePriorArguments, StatedFrameArguments};
use super::terminal::{print_message, print_message_lines, print_result, width};

/// Whether logged angles are the controller's or already hold the DH offsets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Angles {
    /// The controller's.
    Logged,
    /// DH angles: the offsets of the link table are in them.
    Dh,
}

impl From<Angles> for AngleConvention {
    fn from(angles: Angles) -> Self {
        match angles {
            Angles::Logged => AngleConvention::Logged,
            Angles::Dh => AngleConvention::Dh,
        }
    }
}

/// How a measurement file is read.
#[derive(Debug, Clone, Args)]
pub(super) struct DataArguments {
    /// Measurements, CSV or XLSX.
    pub(super) data: PathBuf,
    /// Robot: a name of `truegrind robots`, or a TOML file.
    #[arg(long)]
    pub(super) robot: String,
    #[command(flatten)]
    pub(super) points: PointsArguments,
    /// Sheet of a workbook; the first with the columns otherwise.
    #[arg(long)]
    pub(super) sheet: Option<String>,
    /// Whether the angles are the controller's or DH angles; the robot file says otherwise.
    #[arg(long, value_enum)]
    pub(super) angles: Option<Angles>,
    /// Take the units as they are, however odd they look.
    #[arg(long)]
    pub(super) allow_odd_units: bool,
}

/// Measured points in a file of their own.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct PointsArguments {
    /// Points that the tracker's software exported (SpatialAnalyzer, ASCII), joined with the joints by their column `name`.
    #[arg(long, value_name = "POINTS.txt")]
    pub(super) points: Option<PathBuf>,
    /// Join the points by time, with the log's column `time`: each with the row nearest to it, at most so far away (s). Points and rows
    /// without a partner are left out and told; where several rows or points could be meant, nothing is joined.
    #[arg(long, value_name = "S", requires = "points", allow_negative_numbers = true)]
    points_within: Option<f64>,
    /// By how much the clock of the points is ahead of that of the log (s).
    #[arg(long, value_name = "S", requires = "points_within", allow_negative_numbers = true)]
    points_ahead: Option<f64>,
}

impl PointsArguments {
    /// How the points are joined by time, where that is asked for.
    fn clocks(&self) -> anyhow::Result<Option<Clocks>> {
        let Some(within_s) = self.points_within else { return Ok(None) };
        if !(0.0..=LONGEST_S).contains(&within_s) || within_s == 0.0 {
            bail!("--points-within {within_s}: expected a time above 0 s, up to {LONGEST_S} s");
        }
        let ahead_s = self.points_ahead.unwrap_or(0.0);
        if !ahead_s.is_finite() {
            bail!("--points-ahead {ahead_s}: expected a time in s");
        }
        Ok(Some(Clocks { within_s, ahead_s }))
    }
}

/// No point belongs to a row that is further away in time.
const LONGEST_S: f64 = 3600.0;

impl DataArguments {
    /// A file as it is, of a robot.
    pub(super) fn of(data: PathBuf, robot: String) -> Self {
        Self {
            data,
            robot,
            points: PointsArguments::default(),
            sheet: None,
            angles: None,
            allow_odd_units: false,
        }
    }

    /// The files that are read.
    pub(super) fn files(&self) -> Vec<&Path> {
        std::iter::once(&self.data).chain(&self.points.points).map(PathBuf::as_path).collect()
    }
}

/// What is asked of a fit, of geometry alone or with causes.
#[derive(Debug, Clone, Args)]
pub(super) struct FitArguments {
    /// Do not sharpen rounded angles by the controller's read-out.
    #[arg(long)]
    pub(super) raw_columns: bool,
    /// The fit passes only with a held-out RMSE up to this (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    limit_rmse: Option<f64>,
    /// The fit passes only with a held-out maximum up to this (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    limit_max: Option<f64>,
}

impl FitArguments {
    /// The stated limits.
    pub(super) fn limits(&self) -> anyhow::Result<Limits> {
        for (name, limit) in [("--limit-rmse", self.limit_rmse), ("--limit-max", self.limit_max)] {
            if let Some(limit) = limit.filter(|limit| !(*limit > 0.0 && limit.is_finite())) {
                bail!("{name} {limit}: expected a length above 0 in mm");
            }
        }
        Ok(Limits { rmse_mm: self.limit_rmse, max_mm: self.limit_max })
    }
}

/// Arguments of `identify`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    data: DataArguments,
    /// The model file to write; a failed fit is not written, a doubtful one only with --allow-doubtful.
    #[arg(short, long, value_name = "MODEL.toml")]
    output: Option<PathBuf>,
    /// Write a doubtful model too: one whose data do not promise that programs gain. The file carries the verdict.
    #[arg(long)]
    allow_doubtful: bool,
    /// Method, such as lm, ltlm, ekf, ukf-vslm, rls, rbf or lm-as-printed; an unknown one gets the list.
    #[arg(long, default_value = "lm")]
    method: String,
    /// Share of rows held out to state the error.
    #[arg(long, default_value_t = 0.2, allow_negative_numbers = true)]
    held_out: f64,
    /// Compare all methods over this many splits (seeds 0, 1, …).
    #[arg(long, value_name = "SPLITS")]
    compare_methods: Option<u64>,
    /// Tolerance of link lengths (mm), as a prior. Without it and --tolerance-angle the rows tell the tolerances, weighed by 1 mm
    /// and 0.3°.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    tolerance_length: Option<f64>,
    /// Tolerance of link angles and joint offsets (°), as a prior.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance_angle: Option<f64>,
    #[command(flatten)]
    asked: FitArguments,
    #[command(flatten)]
    stated: StatedFrameArguments,
    #[command(flatten)]
    prior: FramePriorArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut targets = arguments.outputs.files();
    targets.extend(arguments.output.as_deref());
    Batch::check(&arguments.data.files(), &targets)?;
    if !(0.0..=0.9).contains(&arguments.held_out) || arguments.held_out == 0.0 {
        bail!("--held-out {}: expected a share above 0, up to 0.9", arguments.held_out);
    }
    let limits = arguments.asked.limits()?;
    let (robot, dataset) = read(&arguments.data)?;
    let options =
        Options { stated_frames: arguments.stated.frames(&dataset)?, ..options(arguments, limits)? };
    let work = Spinner::start(format!("identifying {} from {} rows", robot.sheet.name, dataset.rows.len()));
    let name = robot.sheet.name.clone();
    let found = watching(arguments.common.threads, &work, || {
        let frames = starting_frames(&dataset, &robot.model, &options.tolerance, options.fuse_readout)?;
        let stated = options.stated_frames.as_ref();
        let (tolerance, frames) = arguments.prior.prior(&options.tolerance, stated, frames)?;
        let options = Options { tolerance, ..options.clone() };
        from_frames(&dataset, &name, &robot.model, &frames, &options)
    })??;
    drop(work);
    for note in &dataset.notes {
        print_message(format_args!("note: {note}"));
    }
    arguments.outputs.print(&view::summary(&found))?;
    let mut batch = Batch::sparing(arguments.data.files());
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&found, &dataset),
        || view::parameter_table(&found),
        || view::json(&found, &dataset),
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        batch.add(path, super::recording::identification(&found, &dataset, &arguments.data.robot)?);
    }
    if let Some(splits) = arguments.compare_methods {
        let work = Spinner::start(format!("{} methods over {splits} splits", SOLVERS.len()));
        let rows = on_threads(arguments.common.threads, || {
            let frames = starting_frames(&dataset, &robot.model, &options.tolerance, options.fuse_readout)?;
            let share = arguments.held_out;
            let split = |d: &Dataset, seed: u64| split_of(d, share, seed);
            Ok::<_, anyhow::Error>(study(&dataset, &name, &robot.model, &frames, &split, &options, splits)?)
        })??;
        drop(work);
        let text = format::terminal::table(&study_view::table(&rows), width());
        if arguments.outputs.takes_stdout() { print_message_lines(&text) } else { print_result(text)? }
    }
    write_model(&found.estimated, arguments.output.as_deref(), arguments.allow_doubtful, batch)
}

/// Why a model is not written, where its verdict does not allow it.
pub(super) fn why_not_written(estimated: &Estimated, allow_doubtful: bool) -> Option<String> {
    let why = match estimated.verdict.status {
        Judgement::Fail => "the fit failed",
        Judgement::Doubtful if !allow_doubtful => {
            "the model is doubtful (--allow-doubtful writes it all the same)"
        }
        _ => return None,
    };
    Some(format!("was not written, because {why}: {}", estimated.verdict.reasons.join("; ")))
}

/// Writes what was made, and the model where its verdict allows it.
pub(super) fn write_model(
    estimated: &Estimated,
    output: Option<&Path>,
    allow_doubtful: bool,
    mut batch: Batch,
) -> anyhow::Result<ExitStatus> {
    let status = estimated.verdict.status;
    if let Some(path) = output {
        if let Some(why) = why_not_written(estimated, allow_doubtful) {
            batch.write()?;
            bail!("{} {why}", path.display());
        }
        batch.add(path, estimated.to_toml()?);
    }
    batch.write()?;
    let poor = matches!(status, Judgement::Fail | Judgement::Doubtful);
    Ok(if poor { ExitStatus::Flagged } else { ExitStatus::Done })
}

fn options(arguments: &Arguments, limits: Limits) -> anyhow::Result<Options> {
    let mut tolerance = Tolerance::default();
    for (stated, place, scale) in [
        (arguments.tolerance_length, &mut tolerance.length_mm, 1.0),
        (arguments.tolerance_angle, &mut tolerance.angle_rad, 1.0_f64.to_radians()),
    ] {
        if let Some(value) = stated {
            if !(value > 0.0 && value.is_finite()) {
                bail!("a tolerance of {value}: expected a number above 0");
            }
            *place = value * scale;
        }
    }
    // Tolerances that are stated are taken as they are.
    tolerance.zero_rad = tolerance.angle_rad;
    tolerance.learn_widths = arguments.tolerance_length.is_none() && arguments.tolerance_angle.is_none();
    Ok(Options {
        tolerance,
        solver: by_name(&arguments.method)?,
        held_out: arguments.held_out,
        seed: arguments.common.seed,
        fuse_readout: !arguments.asked.raw_columns,
        limit_rmse_mm: limits.rmse_mm,
        limit_max_mm: limits.max_mm,
        stated_frames: None,
    })
}

/// Reads robot and measurements, and checks that their units fit each other.
pub(super) fn read(arguments: &DataArguments) -> anyhow::Result<(Robot, Dataset)> {
    // A robot that there is not is told before measurements that there are not.
    let robot = inputs::robot(&arguments.robot)?;
    let bytes = files::read(&arguments.data)?;
    let dataset = imported(arguments, &bytes)?;
    // The text is not needed beside its rows.
    drop(bytes);
    let dataset = measured(arguments, &robot, dataset)?;
    Ok((robot, dataset))
}

/// The same of measurements whose bytes are there.
pub(super) fn read_bytes(arguments: &DataArguments, bytes: &[u8]) -> anyhow::Result<(Robot, Dataset)> {
    let robot = inputs::robot(&arguments.robot)?;
    let dataset = measured(arguments, &robot, imported(arguments, bytes)?)?;
    Ok((robot, dataset))
}

fn imported(arguments: &DataArguments, bytes: &[u8]) -> anyhow::Result<Dataset> {
    let options =
        import::Options { sheet: arguments.sheet.clone(), allow_odd_units: arguments.allow_odd_units };
    let name = files::name(&arguments.data);
    Ok(match (&arguments.points.points, arguments.points.clocks()?) {
        (None, _) => import::read(&name, bytes, &options)?,
        (Some(points), clocks) => {
            let (export, exported) = (files::name(points), files::read(points)?);
            match clocks {
                None => import::joined((&name, bytes), (&export, &exported), &options)?,
                Some(clocks) => {
                    import::joined_by_time((&name, bytes), (&export, &exported), &clocks, &options)?
                }
            }
        }
    })
}

fn measured(arguments: &DataArguments, robot: &Robot, dataset: Dataset) -> anyhow::Result<Dataset> {
    let convention = arguments.angles.map_or_else(|| robot.sheet.joints.angles.into(), AngleConvention::from);
    let (name, odd) = (&robot.sheet.name, arguments.allow_odd_units);
    let dataset =
        matched(dataset, name, &robot.model, convention, odd).map_err(|mismatch| match mismatch {
            Mismatch::Units(_) => anyhow!("{mismatch} (--allow-odd-units takes the file at its word)"),
            _ => anyhow!("{mismatch}"),
        })?;
    Ok(dataset)
}

/// The rows to fit and to hold out; repeated poses stay together.
pub(super) fn split_of(dataset: &Dataset, share: f64, seed: u64) -> Split {
    split::random(dataset, share, seed)
}

/// The whole identification, starting frames included.
pub(super) fn identified(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    options: &Options,
) -> anyhow::Result<Identification> {
    let frames = starting_frames(dataset, nominal, &options.tolerance, options.fuse_readout)?;
    from_frames(dataset, robot, nominal, &frames, options)
}

fn from_frames(
    dataset: &Dataset,
    robot: &str,
    nominal: &Model,
    frames: &Frames,
    options: &Options,
) -> anyhow::Result<Identification> {
    let share = options.held_out;
    let split = |d: &Dataset| split_of(d, share, options.seed);
    Ok(identify(dataset, robot, nominal, frames, &split, options)?)
}
