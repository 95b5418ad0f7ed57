//! `truegrind plan --robot R --sensor S --poses N -o POSES.mod`: chooses the poses to measure.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};
use truegrind::calibration::measurement::dataset::Sensor;
use truegrind::file_kind::FileKind;
use truegrind::planning::poses::candidate::{Bounds, MARGIN_DEG};
use truegrind::planning::poses::design::Index;
use truegrind::planning::poses::program::draft;
use truegrind::planning::poses::schedule::{APPROACH_DEG, Visits};
use truegrind::planning::poses::settings::Settings;
use truegrind::planning::poses::{MeasurementSetup, Options, READING_DEG, plan, questions};
use truegrind::programs::rapid::writer;
use truegrind::report::planning as view;

use super::computation::{Common, on_threads};
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::inputs::{self, UrdfLinks};
use super::measurement::Reads;
use super::output_extension;
use super::outputs::Outputs;
use super::progress::Spinner;
use super::robot_match;
use super::stated_frames::{StatedFrameArguments, numbers};
use super::terminal::print_message;

/// Design criterion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum IndexArgument {
    /// D-optimality, including the priors.
    D,
    /// Observability index O1.
    O1,
}

// More than twenty fields: one for each argument of the command line.
/// Arguments of `plan`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Robot: a name from `truegrind robots`, or a robot file.
    #[arg(long)]
    robot: String,
    #[command(flatten)]
    links: UrdfLinks,
    /// Sensor that will measure.
    #[arg(long, value_enum)]
    sensor: Reads,
    /// Number of different poses; repeats are added to these. Default: 60; for an unexplained error ten, each read three times from one side
    /// and once from the other if a joint scatters, or ten visits of one pose if it follows time.
    #[arg(long)]
    poses: Option<usize>,
    /// RAPID module to write.
    #[arg(short, long, value_name = "POSES.mod")]
    output: Option<PathBuf>,
    /// Diagnosis (from `diagnose --json`): prefer poses that distinguish the causes it left ambiguous or untested.
    #[arg(long = "for", value_name = "DIAGNOSIS.json")]
    diagnosis: Option<PathBuf>,
    /// Plan only for the finding with this number, as in the diagnosis; for an unexplained error: the poses that show most about
    /// it.
    #[arg(long, value_name = "N", requires = "diagnosis")]
    finding: Option<usize>,
    /// Design criterion for the set of poses.
    #[arg(long, value_enum, default_value_t = IndexArgument::D)]
    index: IndexArgument,
    /// Total standard deviation of a measured length or coordinate (mm). Default: 0.05 for a cable, 0.03 for a tracker.
    #[arg(long, value_name = "MM")]
    sigma: Option<f64>,
    /// Standard deviation of a measured orientation (°).
    #[arg(long, value_name = "DEG", default_value_t = READING_DEG)]
    sigma_angle: f64,
    /// Box that must contain the measured point, in the base frame: lower and upper corner x,y,z,x,y,z (mm).
    #[arg(long = "box", value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    box_mm: Option<String>,
    /// Allowed cable length or distance to the sensor: min,max (mm).
    #[arg(long, value_name = "MIN,MAX")]
    range: Option<String>,
    /// Smallest distance of the cable, or of the line of sight from --sensor-frame, from the links, taken as lines between the joints (mm);
    /// 0 disables the check. Default: a twelfth of the reach.
    #[arg(long, value_name = "MM")]
    clearance: Option<f64>,
    /// Box that links and target must not enter, at the poses and between them: two corners in the base frame, x,y,z,x,y,z (mm). May
    /// be repeated.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true)]
    keep_out: Vec<String>,
    /// Lowest allowed height in the base frame (mm): the mounting plane, or the floor for an arm on a pedestal.
    #[arg(long, value_name = "MM", default_value_t = 0.0, allow_negative_numbers = true)]
    floor: f64,
    /// Assumed radius of the links about the lines between the joints (mm), against obstacles and the arm itself; 0 disables the latter.
    /// Default: a twelfth of the reach.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    link_radius: Option<f64>,
    /// Distance from the joint limits (°), at least --approach.
    #[arg(long, value_name = "DEG", default_value_t = MARGIN_DEG)]
    margin: f64,
    /// Smallest distance to a singularity.
    #[arg(long, default_value_t = Bounds::default().min_singularity)]
    singularity: f64,
    /// Number of poses measured two more times, to determine the noise floor.
    #[arg(long, default_value_t = Visits::default().repeats)]
    repeats: usize,
    /// Number of poses measured again with the opposite approach direction, to detect backlash.
    #[arg(long, default_value_t = Visits::default().both_sides)]
    both_sides: usize,
    /// Number of visits of one pose spread over the run, to detect thermal drift.
    #[arg(long, default_value_t = Visits::default().warm_up)]
    warm_up: usize,
    /// Length of each approach move, in every joint (°).
    #[arg(long, value_name = "DEG", default_value_t = APPROACH_DEG)]
    approach: f64,
    /// Waiting time before a reading (s).
    #[arg(long, value_name = "S", default_value_t = 2.0)]
    settle: f64,
    /// Expected time per row (s), for effects that change with time.
    #[arg(long, value_name = "S", default_value_t = Visits::default().seconds_per_row)]
    seconds_per_row: f64,
    /// Speed between poses (mm/s).
    #[arg(long, value_name = "MM/S", default_value_t = 200.0)]
    speed: f64,
    /// Non-centrality above which an effect counts as detectable (a shift, whose rows are unknown: four times this).
    #[arg(long, default_value_t = Options::default().decisive)]
    decisive: f64,
    /// Number of random candidate poses.
    #[arg(long, default_value_t = Options::default().candidates)]
    candidates: usize,
    #[command(flatten)]
    stated: StatedFrameArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    outputs: Outputs,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut targets = arguments.outputs.files();
    targets.extend(arguments.output.as_deref());
    let inputs_of: Vec<&std::path::Path> = arguments.diagnosis.as_deref().into_iter().collect();
    Batch::check(&inputs_of, &targets)?;
    let robot = inputs::robot(arguments.links.of(&arguments.robot))?;
    Batch::check(&inputs_of, &targets)?;
    arguments.output.as_deref().map_or(Ok(()), output_extension::refuse_nc)?;
    let sensor = Sensor::from(arguments.sensor);
    let frames = arguments.stated.placement()?.planned(sensor)?;
    let setup = MeasurementSetup { nominal: &robot.model, sensor, frames: &frames };
    let settings = settings(arguments, &robot.sheet.name)?;
    arguments.outputs.refuse_other_kinds()?;
    let options = settings.options(&robot, &setup, arguments.stated.states_sensor_frame())?;
    let work = Spinner::start(format!("choosing among {} poses", arguments.candidates));
    let planned = on_threads(arguments.common.threads, || plan(&setup, &options))?
        .map_err(|e| anyhow!("{}: {e}", robot.sheet.name))?;
    drop(work);
    arguments.outputs.print(&view::summary(&planned, &setup, &robot.sheet.name))?;
    let mut batch = Batch::sparing(&inputs_of);
    let name = robot.sheet.name.as_str();
    arguments.outputs.add_made(
        &mut batch,
        || view::document(&planned, &setup, name),
        || view::table(&planned, &setup),
        || view::json(&planned, &setup, name),
    )?;
    #[cfg(feature = "visual")]
    if let Some(path) = &arguments.outputs.rrd {
        batch
            .add(path, super::recording::plan(&planned, &setup, name, arguments.links.of(&arguments.robot))?);
    }
    if let Some(path) = &arguments.output {
        let drive = settings.program(&robot, &options);
        batch.add(path, writer::write(&draft(&planned, &setup, &drive))?);
        robot_match::note_other_language(&robot);
    }
    batch.write()?;
    let rough = planned.rows.iter().any(|row| row.cable_unclear);
    Ok(if rough { ExitStatus::Flagged } else { ExitStatus::Done })
}

/// Refuses the diagnosis of another robot. That of another sensor may be decided by this one.
fn refuse_other_diagnosis(path: &Path, text: &str, robot: &str) -> anyhow::Result<()> {
    match questions::robot_of(text) {
        Some(found) if found != robot => {
            bail!(
                "{}: the diagnosis is of robot {found}, but the plan is for {robot}: state --robot {found}",
                path.display()
            )
        }
        _ => Ok(()),
    }
}

/// What a diagnosis left open.
fn left_open(arguments: &Arguments, robot: &str) -> anyhow::Result<questions::Open> {
    Ok(match &arguments.diagnosis {
        None => questions::Open::default(),
        Some(path) => {
            let text = files::read_text(path)?;
            let found = questions::open(&text, arguments.finding).map_err(|e| {
                let told = anyhow!("{}: {e}", path.display());
                let own = [FileKind::Diagnosis, FileKind::Report];
                inputs::other_kind_or(path, &own, "a diagnosis, as written by `diagnose --json`", told)
            })?;
            refuse_other_diagnosis(path, &text, robot)?;
            if found == questions::Open::default() {
                print_message(format_args!(
                    "note: {}: the diagnosis left nothing ambiguous or untested; the poses are chosen for the geometry",
                    path.display()
                ));
            }
            found
        }
    })
}

/// Two corners of a box.
fn corners(option: &str, text: &str) -> anyhow::Result<[[f64; 3]; 2]> {
    match numbers(option, text)?[..] {
        [a, b, c, d, e, f] => Ok([[a, b, c], [d, e, f]]),
        _ => bail!("{option} {text}: expected two corners of a box, x,y,z,x,y,z (mm)"),
    }
}

fn settings(arguments: &Arguments, robot: &str) -> anyhow::Result<Settings> {
    let distance_mm = |text: &str| match numbers("--range", text)?[..] {
        [low, high] => Ok([low, high]),
        _ => bail!("--range {text}: expected the shortest and the longest distance, min,max (mm)"),
    };
    Ok(Settings {
        poses: arguments.poses,
        index: match arguments.index {
            IndexArgument::D => Index::D,
            IndexArgument::O1 => Index::O1,
        },
        sigma_mm: arguments.sigma,
        sigma_angle_deg: arguments.sigma_angle,
        box_mm: arguments.box_mm.as_deref().map(|text| corners("--box", text)).transpose()?,
        distance_mm: arguments.range.as_deref().map(distance_mm).transpose()?,
        clearance_mm: arguments.clearance,
        keep_out_mm: arguments
            .keep_out
            .iter()
            .map(|text| corners("--keep-out", text))
            .collect::<anyhow::Result<_>>()?,
        floor_mm: arguments.floor,
        link_radius_mm: arguments.link_radius,
        margin_deg: arguments.margin,
        singularity: arguments.singularity,
        repeats: arguments.repeats,
        both_sides: arguments.both_sides,
        warm_up: arguments.warm_up,
        approach_deg: arguments.approach,
        settle_s: arguments.settle,
        seconds_per_row: arguments.seconds_per_row,
        speed_mm_s: arguments.speed,
        decisive: arguments.decisive,
        candidates: arguments.candidates,
        seed: arguments.common.seed,
        open: left_open(arguments, robot)?,
        one_finding: arguments.finding.is_some(),
    })
}
