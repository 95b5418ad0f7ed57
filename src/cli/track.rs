//! `truegrind track DATA --model MODEL.toml`: keeps a model up to date over the life of the arm.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use truegrind::arm::estimated::Estimated;
use truegrind::calibration::measurement::convention::AngleConvention;
use truegrind::calibration::measurement::dataset::Dataset;
use truegrind::calibration::measurement::import;
use truegrind::calibration::measurement::matching::Mismatch;
use truegrind::calibration::measurement::plausibility::{ComparedReading, implausible_payload, plausibility};
use truegrind::calibration::tracking::state::ConsumedFile;
use truegrind::calibration::tracking::{Alarm, Options, State, TrackError, Tracker, first_poses};
use truegrind::file_kind::FileKind;
use truegrind::report::tracking as view;
use truegrind::robots::sheet;

use super::computation::{Common, on_threads};
use super::defect::catch_panic;
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::identify::{Angles, of_file};
use super::inputs::{self, NamedModel, StatedRobot};
use super::outputs::Outputs;
use super::terminal::print_message;

/// Arguments of `track`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Measurements: a growing file, or a folder of files.
    data: PathBuf,
    /// Model to keep up to date, as written by `truegrind identify -o`.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    #[command(flatten)]
    robot: StatedRobot,
    /// Folder for the dated models. Default: the folder of the model.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// State file, kept between runs. Default: beside the dated models.
    #[arg(long, value_name = "TRACK.toml")]
    state: Option<PathBuf>,
    /// Keep running and look for new measurements every so many seconds, until stopped.
    #[arg(long, value_name = "SECONDS")]
    follow: Option<f64>,
    /// Date in the names of the models, such as 2026-05-04T12:30:00Z. Default: the current time.
    #[arg(long, value_name = "DATE")]
    date: Option<String>,
    /// Number of poses that locate the sensor before tracking begins.
    #[arg(long, value_name = "N")]
    first_poses: Option<usize>,
    /// Standard deviation of a reading (mm), including unexplained errors. Default: the residual of the first poses, at least the
    /// held-out error of the model.
    #[arg(long, value_name = "MM")]
    sigma: Option<f64>,
    /// Drift of a parameter per pose, in mm or degrees (1σ), such as link2.theta=0.0001. May be repeated.
    #[arg(long, value_name = "NAME=VALUE")]
    drift: Vec<String>,
    /// Convention of the logged angles. Default: that of the robot file.
    #[arg(long, value_enum)]
    angles: Option<Angles>,
    /// Accept implausible units.
    #[arg(long)]
    allow_odd_units: bool,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

impl Arguments {
    fn states_settings(&self) -> bool {
        self.sigma.is_some() || self.first_poses.is_some() || !self.drift.is_empty()
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let name = arguments.model.display().to_string();
    let named = inputs::model(&name)?;
    inputs::warn_doubtful(&named);
    let NamedModel::Estimated { arm, hash, .. } = named else {
        bail!("--model {name}: expected a model file; the nominal arm cannot be tracked");
    };
    inputs::nominal(
        &NamedModel::Estimated { name: name.clone(), hash: hash.clone(), arm: arm.clone() },
        arguments.robot.named(),
    )?;
    let stem = arguments.model.file_stem().map_or("model".into(), |s| s.to_string_lossy().into_owned());
    let folder = match &arguments.output {
        // Created when the first model is written.
        Some(folder) => folder.clone(),
        None => arguments.model.parent().map(Path::to_path_buf).unwrap_or_default(),
    };
    let state_path = arguments.state.clone().unwrap_or_else(|| folder.join(format!("{stem}.track.toml")));
    let inputs_of_run = [arguments.data.as_path(), arguments.model.as_path()];
    let mut targets = arguments.outputs.files();
    if arguments.state.is_some() || folder.is_dir() {
        targets.push(&state_path);
    }
    measurement_files(arguments)?.iter().try_for_each(|path| files::expect(path))?;
    Batch::check(&inputs_of_run, &targets)?;
    arguments.outputs.refuse_other_kinds()?;
    let options = options(arguments, &arm)?;
    if let Some(seconds) = arguments.follow.filter(|s| !(*s > 0.0 && *s <= MAX_FOLLOW_S)) {
        bail!("--follow {seconds}: expected seconds above 0, up to {MAX_FOLLOW_S}");
    }
    if let Some(date) = &arguments.date {
        stamp(date)?;
    }
    if state_path.is_file() && arguments.states_settings() {
        print_message(format_args!(
            "note: {} keeps the settings with which it was started: --sigma, --drift and --first-poses apply to a new track",
            state_path.display()
        ));
    }
    let track = TrackContext {
        arguments,
        arm: &arm,
        hash: &hash,
        options,
        folder: &folder,
        stem: &stem,
        state_path: &state_path,
    };
    let mut flagged = false;
    let mut printed = BTreeSet::new();
    loop {
        files::new_round();
        flagged |= on_threads(arguments.common.threads, || track.update(&mut printed))??;
        let Some(seconds) = arguments.follow else { break };
        std::thread::sleep(Duration::from_secs_f64(seconds));
    }
    Ok(if flagged { ExitStatus::Flagged } else { ExitStatus::Done })
}

/// Longest time between two looks at the measurements: a day (s).
const MAX_FOLLOW_S: f64 = 86_400.0;

/// Noisier sensors follow no arm; micrometres are meant (mm).
const MAX_SIGMA_MM: f64 = 10.0;

/// What is constant over all updates.
struct TrackContext<'a> {
    arguments: &'a Arguments,
    arm: &'a Estimated,
    hash: &'a str,
    options: Options,
    folder: &'a Path,
    stem: &'a str,
    state_path: &'a Path,
}

/// What processing the new files gave.
#[derive(Default)]
struct Processed {
    alarms: Vec<Alarm>,
    taking: Duration,
    /// Whether a file failed.
    failed: bool,
}

impl TrackContext<'_> {
    /// Processes all new data and writes model and state together. Returns whether an alarm was raised or a file failed. Messages in
    /// `printed` are not repeated.
    fn update(&self, printed: &mut BTreeSet<String>) -> anyhow::Result<bool> {
        let (arguments, arm) = (self.arguments, self.arm);
        let mut tracker = self.state()?;
        let known = tracker.as_ref().map(|t| t.state().consumed.clone()).unwrap_or_default();
        let (datasets, mut failed) = self.datasets(&known, printed)?;
        let fitted = &arm.provenance.sha256;
        if let Some(of_the_fit) = datasets.iter().find(|d| !fitted.is_empty() && d.sha256 == *fitted) {
            print_message_once(
                printed,
                format!(
                    "note: {} contains the rows to which the model was fitted: they locate the sensor, but are used twice, and the standard \
                     deviations become too small by a quarter or more; track new measurements",
                    of_the_fit.file
                ),
            );
        }
        if tracker.is_none()
            && let Some(first) = first_poses(&datasets, self.options.first_poses)
        {
            match Tracker::begin(arm, self.hash, &first, &self.options) {
                Ok(begun) => tracker = Some(begun),
                // The files are still growing: wait.
                Err(error @ TrackError::TooFew { .. }) if arguments.follow.is_some() => {
                    print_message_once(printed, format!("note: {error}"));
                    return Ok(false);
                }
                Err(error) => return Err(error.into()),
            }
        }
        let before = tracker.as_ref().map_or(0, |t| t.state().poses);
        let Processed { alarms, taking, failed: one_failed } = match &mut tracker {
            Some(tracker) => self.process(tracker, &datasets, printed)?,
            None => Processed::default(),
        };
        failed |= one_failed;
        let Some(tracker) = tracker else {
            if arguments.follow.is_some() {
                return Ok(false);
            }
            bail!("{}: no measurements to start from", arguments.data.display());
        };
        let fresh = tracker.state().poses - before;
        if fresh == 0 {
            if arguments.follow.is_none() {
                print_message(format_args!(
                    "note: no new measurements after {before} poses; nothing written"
                ));
            }
            return Ok(failed);
        }
        print_message(format_args!(
            "note: {fresh} poses processed in {:.1} ms, {:.0} µs each",
            taking.as_secs_f64() * 1e3,
            taking.as_secs_f64() * 1e6 / fresh as f64
        ));
        self.write(&tracker, fresh, &alarms, &datasets)?;
        let departed = tracker.departure().is_some_and(|departure| departure.is_significant);
        let is_worse = tracker.worse_fit().is_some();
        let do_not_fit = tracker.mostly_set_aside() || tracker.latest_set_aside().is_some();
        Ok(failed || !alarms.is_empty() || departed || is_worse || do_not_fit)
    }

    /// Processes new files, one after the other.
    fn process(
        &self,
        tracker: &mut Tracker,
        datasets: &[Dataset],
        printed: &mut BTreeSet<String>,
    ) -> anyhow::Result<Processed> {
        let mut out = Processed::default();
        for dataset in datasets {
            if let Some(other) = tracker.copy_of(dataset) {
                let (file, other) = (&dataset.file, other.to_owned());
                let note = format!("note: {file} contains the same rows as {other}: they are used once");
                print_message_once(printed, note);
                continue;
            }
            let begun = Instant::now();
            // After a panic on one file, continue with the state before that file.
            let before = tracker.clone();
            match catch_panic(|| Ok(tracker.process_file(dataset))) {
                Ok(raised) => out.alarms.extend(raised?),
                Err(defect) if self.arguments.data.is_dir() || self.arguments.follow.is_some() => {
                    *tracker = before;
                    out.failed = true;
                    print_message_once(printed, format!("failed: {}: {defect:#}", dataset.file));
                }
                Err(defect) => return Err(defect),
            }
            out.taking += begun.elapsed();
            match tracker.waiting(dataset) {
                0 => {}
                rows => print_message_once(
                    printed,
                    format!(
                        "note: {}: its last {rows} rows wait for more: a sensor that was set up anew (column station) is placed by four",
                        dataset.file
                    ),
                ),
            }
        }
        Ok(out)
    }

    /// The state of the last run.
    fn state(&self) -> anyhow::Result<Option<Tracker>> {
        if !self.state_path.is_file() {
            return Ok(None);
        }
        let text = files::read_state_text(self.state_path)?;
        let name = self.state_path.display().to_string();
        let state = State::from_toml(&text).map_err(|e| anyhow!("{name}: {e}"))?;
        if state.model_hash != self.hash {
            bail!(
                "{name} belongs to another model than {}: give the model with which it was started, or another --state",
                self.arguments.model.display()
            );
        }
        Ok(Some(Tracker::resume(self.arm, state, &name)?))
    }

    fn write(
        &self,
        tracker: &Tracker,
        fresh: usize,
        alarms: &[Alarm],
        datasets: &[Dataset],
    ) -> anyhow::Result<()> {
        let arguments = self.arguments;
        let date = match &arguments.date {
            Some(date) => stamp(date)?,
            None => now()?,
        };
        let model_path = self.folder.join(format!("{}-{date}-{:06}.toml", self.stem, tracker.state().poses));
        let text = tracker.model().to_toml()?;
        let path = model_path.display().to_string();
        if arguments.output.is_some() {
            files::make_folder(self.folder)?;
        }
        let mut batch = Batch::sparing([&arguments.data, &arguments.model]);
        // The model first, the state last: if the process stops in between, the next run repeats the update bit for bit.
        if !model_path.exists() {
            batch.add(&model_path, text);
        } else if files::read_state(&model_path)? != text.as_bytes() {
            bail!("{path} exists and is not overwritten; give another --date or -o");
        }
        arguments.outputs.add_made(
            &mut batch,
            || view::document(tracker, fresh, alarms, &path),
            || view::table(tracker),
            || view::json(tracker, fresh, alarms),
        )?;
        #[cfg(feature = "visual")]
        if let Some(path) = &arguments.outputs.rrd {
            let robot = arguments.robot.named();
            match super::recording::track(tracker, self.arm, datasets, alarms, robot)? {
                Some(bytes) => batch.add(path, bytes),
                None => print_message("note: --rrd: there is no pose to draw; nothing written"),
            }
        }
        #[cfg(not(feature = "visual"))]
        let _ = datasets;
        batch.add(self.state_path, tracker.state().to_toml()?);
        batch.write()?;
        // Only now is the model written, as the summary says.
        arguments.outputs.print(&view::summary(tracker, fresh, alarms, &path))
    }

    /// The data sets, and whether a file of a folder failed; the others are still used. With `--follow`, files that cannot be read
    /// yet are retried at the next update.
    fn datasets(
        &self,
        known: &[ConsumedFile],
        printed: &mut BTreeSet<String>,
    ) -> anyhow::Result<(Vec<Dataset>, bool)> {
        let waits = self.arguments.follow.is_some();
        let several = self.arguments.data.is_dir();
        let (mut out, mut failed) = (Vec::new(), false);
        for path in measurement_files(self.arguments)? {
            let is_new = !known.iter().any(|k| k.file == files::name(&path));
            match catch_panic(|| read(self.arguments, self.arm, &path, is_new)) {
                Ok(dataset) => out.extend(dataset),
                Err(error) if waits => {
                    print_message_once(printed, format!("note: {error:#}; will be retried"))
                }
                Err(error) if several => {
                    failed = true;
                    print_message(format_args!("failed: {}: {error:#}", path.display()));
                }
                Err(error) => return Err(error),
            }
        }
        Ok((out, failed))
    }
}

/// Prints a message unless it was printed before.
fn print_message_once(printed: &mut BTreeSet<String>, what: String) {
    if !printed.contains(&what) {
        print_message(&what);
        printed.insert(what);
    }
}

/// The file, or the files of a folder sorted by name, without those that the track itself writes.
fn measurement_files(arguments: &Arguments) -> anyhow::Result<Vec<PathBuf>> {
    let path = &arguments.data;
    if !path.is_dir() {
        let waits = arguments.follow.is_some() && !path.exists();
        return Ok(if waits { Vec::new() } else { vec![path.clone()] });
    }
    // Tables of an earlier run are recognised by their content; any other file of that name is a measurement.
    let is_own = |path: &Path| files::read_state(path).is_ok_and(|bytes| view::is_table(&bytes));
    let outputs = arguments.outputs.files().into_iter().filter(|path| path.is_file() && is_own(path));
    let own: Vec<PathBuf> = outputs.filter_map(|o| std::fs::canonicalize(o).ok()).collect();
    let mut out: Vec<PathBuf> = std::fs::read_dir(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| {
            p.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv") || e.eq_ignore_ascii_case("xlsx"))
        })
        .filter(|p| !std::fs::canonicalize(p).is_ok_and(|p| own.contains(&p)))
        .collect();
    out.sort();
    if out.is_empty() && arguments.follow.is_none() {
        bail!("{}: the folder has no .csv or .xlsx files", path.display());
    }
    Ok(out)
}

/// The complete rows of a file; `None` if there is none yet. The units of a new file are checked once it has enough rows.
fn read(
    arguments: &Arguments,
    arm: &Estimated,
    path: &Path,
    is_new: bool,
) -> anyhow::Result<Option<Dataset>> {
    let mut bytes = files::read(path)?;
    let is_text = !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xlsx"));
    if is_text {
        // The last line may still be incomplete.
        let end = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1);
        if bytes[end..].iter().any(|b| !b.is_ascii_whitespace()) {
            bytes.truncate(end);
        }
        if bytes.iter().filter(|b| **b == b'\n').count() < 2 {
            return Ok(None);
        }
    }
    let allow_odd_units = arguments.allow_odd_units;
    let options = import::Options { allow_odd_units, ..import::Options::default() };
    let dataset = import::read(&files::name(path), &bytes, &options).map_err(|e| {
        inputs::other_kind_or(path, &[FileKind::Measurements], "measurements (.csv or .xlsx)", e)
    })?;
    let robot = inputs::robot(arguments.robot.named().unwrap_or(arm.robot.as_str().into()));
    let rated_kg = robot.as_ref().ok().and_then(|robot| robot.sheet.payload_kg);
    if let Some(rated_kg) = rated_kg.filter(|_| is_new && !allow_odd_units)
        && let Some(suspicion) = implausible_payload(&dataset, rated_kg)
    {
        return Err(of_file(Mismatch::Payload(suspicion)));
    }
    let dh = match arguments.angles {
        Some(angles) => angles == Angles::Dh,
        None => robot.is_ok_and(|r| r.sheet.joints.angles == sheet::Angles::Dh),
    };
    let convention = if dh { AngleConvention::Dh } else { AngleConvention::Logged };
    if is_new && !allow_odd_units && dataset.rows.len() >= ROWS_TO_TELL_UNITS {
        let suspicions = plausibility(&dataset, &arm.nominal, convention);
        if let Some(suspicion) = suspicions.iter().find(|s| s.compared == ComparedReading::Sensor) {
            bail!("{suspicion} (--allow-odd-units accepts the file anyway)");
        }
    }
    let applied = convention.apply(dataset, &arm.nominal);
    applied.map(Some).ok_or_else(|| anyhow!("{}: its joint map cannot be inverted", arm.robot))
}

fn options(arguments: &Arguments, arm: &Estimated) -> anyhow::Result<Options> {
    let mut options = Options { sigma_mm: arguments.sigma, ..Options::default() };
    if let Some(sigma) = arguments.sigma.filter(|s| !(*s > 0.0 && *s <= MAX_SIGMA_MM)) {
        bail!("--sigma {sigma}: expected a length above 0 in mm, up to {MAX_SIGMA_MM} (30 µm are 0.03)");
    }
    if let Some(poses) = arguments.first_poses {
        if poses < 4 {
            bail!("--first-poses {poses}: expected at least 4");
        }
        options.first_poses = poses;
    }
    for text in &arguments.drift {
        let (name, value) = text
            .split_once('=')
            .and_then(|(name, value)| Some((name.trim(), value.trim().parse::<f64>().ok()?)))
            .filter(|(_, value)| *value >= 0.0 && value.is_finite())
            .ok_or_else(|| anyhow!("--drift {text}: expected NAME=VALUE, such as link2.theta=0.0001"))?;
        let known: Vec<String> = arm.order.iter().map(ToString::to_string).collect();
        let Some(at) = known.iter().position(|k| k == name) else {
            bail!("--drift {text}: no parameter {name}; the model has {}", known.join(", "));
        };
        let scale = if arm.order[at].is_angle() { 1f64.to_radians() } else { 1.0 };
        options.drift.insert(name.to_owned(), value * scale);
    }
    Ok(options)
}

/// Fewest rows for the check of units.
const ROWS_TO_TELL_UNITS: usize = 15;

/// A date for file names, 20260504T123000Z.
fn stamp(date: &str) -> anyhow::Result<String> {
    let out: String = date.chars().filter(|c| !matches!(c, '-' | ':')).collect();
    let fits = out.len() >= 8
        && out.chars().take(8).all(|c| c.is_ascii_digit())
        && out.chars().all(|c| c.is_ascii_alphanumeric());
    if !fits {
        bail!("--date {date}: expected a date such as 2026-05-04 or 2026-05-04T12:30:00Z");
    }
    Ok(out)
}

/// The current time in UTC.
fn now() -> anyhow::Result<String> {
    let seconds =
        SystemTime::now().duration_since(UNIX_EPOCH).context("the system clock is before 1970")?.as_secs();
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Days to year, month and day in the proleptic Gregorian calendar (Hinnant, chrono-compatible algorithms).
    let z = days + 719_468;
    let (era, day_of_era) = (z / 146_097, z % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    Ok(format!("{year:04}{month:02}{day:02}T{:02}{:02}{:02}Z", rest / 3600, rest / 60 % 60, rest % 60))
}
