//! `truegrind identify DATA --robot R -o MODEL.toml`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};

use truegrind::arm::estimated::{Estimated, Judgement, Reason, ReasonKind};
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
use truegrind::calibration::measurement::import::{self, TimeMatching};
use truegrind::calibration::measurement::matching::Mismatch;
use truegrind::calibration::measurement::rows_of_robot::rows_of_robot;
use truegrind::calibration::measurement::split::{self, Split};
use truegrind::file_kind::FileKind;
use truegrind::report::format;
use truegrind::report::{identification as view, study as study_view};
use truegrind::robots::Robot;

use super::cell_arguments::check_length;
use super::computation::{Common, on_threads, watching};
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs::{self, NamedRobot, UrdfLinks};
use super::output_extension;
use super::outputs::Outputs;
use super::progress::Spinner;
use super::stated_frames::{FramePriorArguments, StatedFrameArguments};
use super::terminal::{print_message, print_message_lines, print_result, width};

/// Convention of the logged angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Angles {
    /// Angles as the controller displays them.
    Logged,
    /// DH angles, which include the offsets of the link table.
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

/// Options for reading a measurement file.
#[derive(Debug, Clone, Args)]
pub(super) struct DataArguments {
    /// Measurements, CSV or XLSX.
    pub(super) data: PathBuf,
    /// Robot: a name from `truegrind robots`, or a robot file.
    #[arg(long)]
    pub(super) robot: String,
    #[command(flatten)]
    pub(super) links: UrdfLinks,
    #[command(flatten)]
    pub(super) points: PointsArguments,
    /// Sheet of a workbook. Default: the first with the needed columns.
    #[arg(long)]
    pub(super) sheet: Option<String>,
    /// Convention of the logged angles. Default: that of the robot file.
    #[arg(long, value_enum)]
    pub(super) angles: Option<Angles>,
    /// Accept implausible units.
    #[arg(long)]
    pub(super) allow_odd_units: bool,
}

/// Measured points in a separate file.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct PointsArguments {
    /// Points exported by the tracker software (SpatialAnalyzer, ASCII), matched to the joint log by the column `name`.
    #[arg(long, value_name = "POINTS.txt")]
    pub(super) points: Option<PathBuf>,
    /// Match points by time instead, using the column `time` of the log: each point to the nearest row within this many seconds.
    /// Unmatched points and rows are omitted with a note; an ambiguous match is an error.
    #[arg(long, value_name = "S", requires = "points", allow_negative_numbers = true)]
    points_within: Option<f64>,
    /// Clock of the points minus clock of the log (s).
    #[arg(long, value_name = "S", requires = "points_within", allow_negative_numbers = true)]
    points_ahead: Option<f64>,
}

impl PointsArguments {
    /// Settings for matching by time, if requested.
    fn clocks(&self) -> anyhow::Result<Option<TimeMatching>> {
        let Some(within_s) = self.points_within else { return Ok(None) };
        if !(0.0..=MAX_POINTS_WITHIN_S).contains(&within_s) || within_s == 0.0 {
            bail!("--points-within {within_s}: expected a time above 0 s, up to {MAX_POINTS_WITHIN_S} s");
        }
        let ahead_s = self.points_ahead.unwrap_or(0.0);
        if !ahead_s.is_finite() {
            bail!("--points-ahead {ahead_s}: expected a time in s");
        }
        Ok(Some(TimeMatching { within_s, ahead_s }))
    }
}

/// Largest `--sensor-scale-sigma` (%): a sensor that is off by more measures nothing.
const MAX_SCALE_PERCENT: f64 = 10.0;

/// Largest error that a limit can mean (mm).
const MAX_LIMIT_MM: f64 = 100.0;

/// Largest `--points-within` (s).
const MAX_POINTS_WITHIN_S: f64 = 3600.0;

impl DataArguments {
    /// A plain measurement file of a robot.
    pub(super) fn of(data: PathBuf, robot: NamedRobot<'_>) -> Self {
        Self {
            data,
            robot: robot.name.to_owned(),
            links: robot.links.clone(),
            points: PointsArguments::default(),
            sheet: None,
            angles: None,
            allow_odd_units: false,
        }
    }

    /// The measured robot.
    pub(super) fn named(&self) -> NamedRobot<'_> {
        self.links.of(&self.robot)
    }

    /// The files to be read.
    pub(super) fn files(&self) -> Vec<&Path> {
        std::iter::once(&self.data).chain(&self.points.points).map(PathBuf::as_path).collect()
    }
}

/// Options of a fit, of geometry alone or with causes.
#[derive(Debug, Clone, Args)]
pub(super) struct FitArguments {
    /// Do not use the Cartesian read-out of the controller to refine rounded joint angles.
    #[arg(long)]
    pub(super) raw_columns: bool,
    /// Largest held-out RMSE with which the fit passes (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    limit_rmse: Option<f64>,
    /// Largest held-out error with which the fit passes (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    limit_max: Option<f64>,
    /// Manufacturing tolerance of link lengths (mm), used as prior σ. Default: estimated from the data, starting from 1 mm and 0.3°.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    tolerance_length: Option<f64>,
    /// Manufacturing tolerance of link angles and joint offsets (°), used as prior σ.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance_angle: Option<f64>,
    /// Standard uncertainty of the sensor's scale (%), such as 0.001 for a tracker that agreed with a scale bar. Default: a scale error of
    /// 0.1 to 1 % (1σ) has a prior probability of one in five.
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    sensor_scale_sigma: Option<f64>,
}

impl FitArguments {
    /// The limits, checked.
    pub(super) fn limits(&self) -> anyhow::Result<Limits> {
        for (name, limit) in [("--limit-rmse", self.limit_rmse), ("--limit-max", self.limit_max)] {
            limit.map_or(Ok(()), |limit| check_length(name, limit, MAX_LIMIT_MM))?;
        }
        Ok(Limits { rmse_mm: self.limit_rmse, max_mm: self.limit_max })
    }

    /// The tolerances of the arm; where one is stated, none is estimated from the data.
    pub(super) fn tolerance(&self) -> anyhow::Result<Tolerance> {
        let mut tolerance = Tolerance::default();
        for (name, stated, target, scale) in [
            ("--tolerance-length", self.tolerance_length, &mut tolerance.length_mm, 1.0),
            ("--tolerance-angle", self.tolerance_angle, &mut tolerance.angle_rad, 1.0_f64.to_radians()),
        ] {
            if let Some(value) = stated {
                if !(value > 0.0 && value.is_finite()) {
                    bail!("{name} {value}: expected a number above 0");
                }
                *target = value * scale;
            }
        }
        if let Some(percent) = self.sensor_scale_sigma {
            if !(0.0..=MAX_SCALE_PERCENT).contains(&percent) {
                bail!("--sensor-scale-sigma {percent}: expected a percentage from 0 to {MAX_SCALE_PERCENT}");
            }
            tolerance.scale = Some(percent / 100.0);
        }
        tolerance.zero_rad = tolerance.angle_rad;
        tolerance.learn_widths = self.tolerance_length.is_none() && self.tolerance_angle.is_none();
        Ok(tolerance)
    }
}

/// Arguments of `identify`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    data: DataArguments,
    /// Model file to write. A failed fit is not written; a doubtful one only with --allow-doubtful.
    #[arg(short, long, value_name = "MODEL.toml")]
    output: Option<PathBuf>,
    /// Also write a doubtful model, whose data do not show that programs improve. The file contains the verdict.
    #[arg(long)]
    allow_doubtful: bool,
    /// Solver: lm, ltlm, ekf, ukf-vslm, rls, rbf, lm-as-printed or others; an unknown name prints the list.
    #[arg(long, default_value = "lm")]
    method: String,
    /// Share of rows held out to estimate the error.
    #[arg(long, default_value_t = 0.2, allow_negative_numbers = true)]
    held_out: f64,
    /// Also compare all solvers over this many random splits (seeds 0, 1, …).
    #[arg(long, value_name = "SPLITS")]
    compare_methods: Option<u64>,
    #[command(flatten)]
    fit: FitArguments,
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
    arguments.output.as_deref().map_or(Ok(()), output_extension::refuse_no_model)?;
    if !(0.0..=0.9).contains(&arguments.held_out) || arguments.held_out == 0.0 {
        bail!("--held-out {}: expected a share above 0, up to 0.9", arguments.held_out);
    }
    if arguments.compare_methods == Some(0) {
        bail!("--compare-methods 0: expected 1 split or more");
    }
    let limits = arguments.fit.limits()?;
    let (robot, dataset) = read(&arguments.data)?;
    arguments.outputs.refuse_other_kinds()?;
    let placement = arguments.stated.prior(&arguments.prior)?;
    let options = Options { stated_frames: placement.frames(&dataset)?, ..options(arguments, limits)? };
    let work = Spinner::start(format!("identifying {} from {} rows", robot.sheet.name, dataset.rows.len()));
    let name = robot.sheet.name.clone();
    let found = watching(arguments.common.threads, &work, || {
        let frames = starting_frames(&dataset, &robot.model, &options.tolerance, options.fuse_readout)?;
        let (tolerance, frames) =
            placement.prior([&options.tolerance; 2], frames, (&dataset, &robot.model))?;
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
        batch.add(path, super::recording::identification(&found, &dataset, arguments.data.named())?);
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

/// Why a model is not written, with what its verdict has against it; `None` if that allows it.
pub(super) fn reason_not_written(estimated: &Estimated, allow_doubtful: bool) -> Option<String> {
    let reason = match estimated.verdict.status {
        Judgement::Fail => "the fit failed",
        Judgement::Doubtful if !allow_doubtful => "the model is doubtful (--allow-doubtful writes it anyway)",
        _ => return None,
    };
    let is_against = |reason: &&Reason| !matches!(reason.kind, ReasonKind::Converged | ReasonKind::NoLimits);
    let against = estimated.verdict.reasons.iter().filter(is_against);
    let against: Vec<&str> = against.map(|reason| reason.text.as_str()).collect();
    Some(format!("was not written, because {reason}: {}", against.join("; ")))
}

/// Writes the reports, and the model if its verdict allows it.
pub(super) fn write_model(
    estimated: &Estimated,
    output: Option<&Path>,
    allow_doubtful: bool,
    mut batch: Batch,
) -> anyhow::Result<ExitStatus> {
    let status = estimated.verdict.status;
    if let Some(path) = output {
        if let Some(reason) = reason_not_written(estimated, allow_doubtful) {
            batch.write()?;
            bail!("{} {reason}", path.display());
        }
        batch.add(path, estimated.to_toml()?);
    }
    batch.write()?;
    let poor = matches!(status, Judgement::Fail | Judgement::Doubtful);
    Ok(if poor { ExitStatus::Flagged } else { ExitStatus::Done })
}

fn options(arguments: &Arguments, limits: Limits) -> anyhow::Result<Options> {
    Ok(Options {
        tolerance: arguments.fit.tolerance()?,
        solver: by_name(&arguments.method)?,
        held_out: arguments.held_out,
        seed: arguments.common.seed,
        fuse_readout: !arguments.fit.raw_columns,
        limit_rmse_mm: limits.rmse_mm,
        limit_max_mm: limits.max_mm,
        stated_frames: None,
    })
}

/// Reads robot and measurements, and checks that their units are plausible.
pub(super) fn read(arguments: &DataArguments) -> anyhow::Result<(Robot, Dataset)> {
    // An unknown robot is reported before missing measurements.
    let robot = inputs::robot(arguments.named())?;
    let bytes = files::read(&arguments.data)?;
    let dataset = imported(arguments, &bytes)?;
    // Free the text before the rows are processed.
    drop(bytes);
    let dataset = measured(arguments, &robot, dataset)?;
    Ok((robot, dataset))
}

/// [`read`] for measurements that are already in memory.
pub(super) fn read_bytes(arguments: &DataArguments, bytes: &[u8]) -> anyhow::Result<(Robot, Dataset)> {
    let robot = inputs::robot(arguments.named())?;
    let dataset = measured(arguments, &robot, imported(arguments, bytes)?)?;
    Ok((robot, dataset))
}

fn imported(arguments: &DataArguments, bytes: &[u8]) -> anyhow::Result<Dataset> {
    let options =
        import::Options { sheet: arguments.sheet.clone(), allow_odd_units: arguments.allow_odd_units };
    let name = files::name(&arguments.data);
    // A table may have any name, so only one that cannot be read is a file of another kind.
    let own = [FileKind::Measurements, FileKind::Empty];
    Ok(match (&arguments.points.points, arguments.points.clocks()?) {
        (None, _) => import::read(&name, bytes, &options)
            .map_err(|e| inputs::other_kind_or(&arguments.data, &own, "measurements (.csv or .xlsx)", e))?,
        (Some(points), clocks) => {
            let (export, exported) = (files::name(points), files::read(points)?);
            match clocks {
                None => import::read_joined((&name, bytes), (&export, &exported), &options)?,
                Some(clocks) => {
                    import::read_joined_by_time((&name, bytes), (&export, &exported), &clocks, &options)?
                }
            }
        }
    })
}

fn measured(arguments: &DataArguments, robot: &Robot, dataset: Dataset) -> anyhow::Result<Dataset> {
    let convention = arguments.angles.map(AngleConvention::from);
    rows_of_robot(dataset, robot, convention, arguments.allow_odd_units).map_err(of_file)
}

/// A mismatch of a measurement file, with the option that accepts it where there is one.
pub(super) fn of_file(mismatch: Mismatch) -> anyhow::Error {
    match mismatch {
        Mismatch::Units(_) | Mismatch::Condition(_) | Mismatch::Payload(_) => {
            anyhow!("{mismatch} (--allow-odd-units accepts the file anyway)")
        }
        _ => anyhow!("{mismatch}"),
    }
}

/// Rows to fit and rows to hold out; repeats of a pose stay together.
pub(super) fn split_of(dataset: &Dataset, share: f64, seed: u64) -> Split {
    split::random(dataset, share, seed)
}

/// Identification including the starting frames.
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
