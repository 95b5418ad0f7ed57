//! `truegrind plan --robot R --sensor S --poses N -o POSES.mod`: chooses the poses to measure.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::{Args, ValueEnum};
use serde_json::Value;
use truegrind::calibration::measurement::dataset::Sensor;
use truegrind::planning::poses::candidate::{Bounds, MARGIN_DEG};
use truegrind::planning::poses::design::Index;
use truegrind::planning::poses::keep_out::KeepOut;
use truegrind::planning::poses::program::{ProgramSettings, draft};
use truegrind::planning::poses::rows::Noise;
use truegrind::planning::poses::schedule::{APPROACH_DEG, Visits};
use truegrind::planning::poses::{
    FIELD_POSES, MeasurementSetup, Options, READING_DEG, plan, questions, reach_mm,
};
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
    let frames = arguments.stated.planned(sensor)?;
    let setup = MeasurementSetup { nominal: &robot.model, sensor, frames: &frames };
    let options =
        Options { rated_load_kg: robot.sheet.payload_kg, ..options(arguments, &robot.sheet.name, &setup)? };
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
        let drive = ProgramSettings {
            robot: name.to_owned(),
            travel_mm_s: arguments.speed,
            // Visits of one pose over a long time are waited for.
            settle_s: arguments.settle
                + (options.visits.seconds_per_row - arguments.seconds_per_row).max(0.0),
            ..ProgramSettings::default()
        };
        batch.add(path, writer::write(&draft(&planned, &setup, &drive))?);
        robot_match::note_other_language(&robot);
    }
    batch.write()?;
    let rough = planned.rows.iter().any(|row| row.cable_unclear);
    Ok(if rough { ExitStatus::Flagged } else { ExitStatus::Done })
}

/// Largest number of poses.
const MAX_POSES: usize = 2000;

/// Largest number of candidates; more do not improve the design.
const MAX_CANDIDATES: usize = 100_000;

/// Noisier sensors identify no arm; micrometres are meant (mm).
const MAX_SIGMA_MM: f64 = 10.0;

/// The space that the arm must keep out of.
fn space(arguments: &Arguments, usual: KeepOut, reach_mm: f64) -> anyhow::Result<KeepOut> {
    let mut boxes_mm = Vec::new();
    for text in &arguments.keep_out {
        match numbers("--keep-out", text)?[..] {
            [a, b, c, d, e, f] if a != d && b != e && c != f => {
                boxes_mm.push([[a.min(d), b.min(e), c.min(f)], [a.max(d), b.max(e), c.max(f)]]);
            }
            _ => bail!("--keep-out {text}: expected two corners of a box, x,y,z,x,y,z (mm)"),
        }
    }
    if !arguments.floor.is_finite() {
        bail!("--floor {}: expected a height in mm", arguments.floor);
    }
    let radius_mm = arguments.link_radius.unwrap_or(usual.radius_mm);
    if !(0.0..=reach_mm).contains(&radius_mm) {
        bail!("--link-radius {radius_mm}: expected 0 up to the reach of {reach_mm:.0} mm");
    }
    let approach_rad = arguments.approach.to_radians();
    Ok(KeepOut { floor_mm: Some(arguments.floor), boxes_mm, radius_mm, approach_rad })
}

/// Refuses numbers and counts out of range.
fn check_numbers(arguments: &Arguments, sigma: f64, usual_poses: usize) -> anyhow::Result<()> {
    for (name, value) in [
        ("--sigma", sigma),
        ("--sigma-angle", arguments.sigma_angle),
        ("--approach", arguments.approach),
        ("--seconds-per-row", arguments.seconds_per_row),
        ("--speed", arguments.speed),
        ("--decisive", arguments.decisive),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            bail!("{name} {value}: expected a number above 0");
        }
    }
    if sigma > MAX_SIGMA_MM {
        bail!("--sigma {sigma}: expected mm, up to {MAX_SIGMA_MM} (30 µm are 0.03)");
    }
    for (name, value) in [
        ("--settle", arguments.settle),
        ("--margin", arguments.margin),
        ("--singularity", arguments.singularity),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            bail!("{name} {value}: expected 0 or more");
        }
    }
    let poses = arguments.poses.unwrap_or(usual_poses);
    if poses < 4 {
        bail!("--poses {poses}: expected at least 4; about 50 to 100 are usual");
    }
    if poses > MAX_POSES {
        bail!("--poses {poses}: expected at most {MAX_POSES}; about 50 to 100 are usual");
    }
    for (name, count) in [
        ("--repeats", arguments.repeats),
        ("--both-sides", arguments.both_sides),
        ("--warm-up", arguments.warm_up),
    ] {
        if count > MAX_POSES {
            bail!("{name} {count}: expected at most {MAX_POSES}");
        }
    }
    if arguments.candidates > MAX_CANDIDATES {
        bail!("--candidates {}: expected at most {MAX_CANDIDATES}; 2000 are usual", arguments.candidates);
    }
    Ok(())
}

/// Refuses the diagnosis of another robot. That of another sensor may be decided by this one.
fn refuse_other_diagnosis(path: &Path, text: &str, robot: &str) -> anyhow::Result<()> {
    let diagnosis: Value = serde_json::from_str(text)?;
    match diagnosis["dataset"]["robot"].as_str() {
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
            let found =
                questions::open(&text, arguments.finding).map_err(|e| anyhow!("{}: {e}", path.display()))?;
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

fn options(arguments: &Arguments, robot: &str, setup: &MeasurementSetup<'_>) -> anyhow::Result<Options> {
    let sight_is_known = arguments.stated.states_sensor_frame();
    let usual = Options::usual(setup.nominal, setup.sensor, sight_is_known);
    let sigma = arguments.sigma.unwrap_or(usual.noise.reading_mm);
    check_numbers(arguments, sigma, usual.poses)?;
    let box_mm = match &arguments.box_mm {
        None => None,
        Some(text) => match numbers("--box", text)?[..] {
            [a, b, c, d, e, f] if a < d && b < e && c < f => Some([[a, b, c], [d, e, f]]),
            _ => bail!("--box {text}: expected x,y,z of the lower and x,y,z of the upper corner (mm)"),
        },
    };
    let distance_mm = match &arguments.range {
        None => None,
        Some(text) => match numbers("--range", text)?[..] {
            [low, high] if 0.0 <= low && low < high => Some([low, high]),
            _ => bail!("--range {text}: expected the shortest and the longest distance, min,max (mm)"),
        },
    };
    let clearance_mm = match arguments.clearance {
        None => usual.bounds.clearance_mm,
        Some(_) if usual.bounds.clearance_mm.is_none() => {
            bail!("--clearance: the line of sight is known with --sensor-frame alone: state it too")
        }
        Some(0.0) => None,
        Some(mm) if mm > 0.0 && mm.is_finite() => Some(mm),
        Some(mm) => bail!("--clearance {mm}: expected 0 or more (mm)"),
    };
    let space = space(arguments, usual.bounds.space, reach_mm(setup.nominal))?;
    let questions::Open { questions, something_else, joint_scatters } = left_open(arguments, robot)?;
    let approach_rad = arguments.approach.to_radians();
    let poses = arguments.poses.unwrap_or(if joint_scatters { FIELD_POSES } else { usual.poses });
    // Whether it differs by the side or from time to time is asked at every pose.
    let [repeats, both_sides, warm_up] = match joint_scatters {
        true => [poses, poses, 0],
        false => [arguments.repeats, arguments.both_sides, arguments.warm_up],
    };
    let options = Options {
        poses,
        index: match arguments.index {
            IndexArgument::D => Index::D,
            IndexArgument::O1 => Index::O1,
        },
        noise: Noise { reading_mm: sigma, reading_rad: arguments.sigma_angle.to_radians() },
        candidates: arguments.candidates.max(poses + FIELD_POSES),
        bounds: Bounds {
            margin_rad: arguments.margin.to_radians().max(approach_rad),
            min_singularity: arguments.singularity,
            box_mm,
            distance_mm,
            clearance_mm,
            space,
        },
        visits: Visits {
            repeats,
            both_sides,
            warm_up,
            approach_rad,
            seconds_per_row: arguments.seconds_per_row,
        },
        questions,
        something_else: something_else.clone(),
        decisive: arguments.decisive,
        seed: arguments.common.seed,
        ..Options::default()
    };
    Ok(match something_else.filter(|_| arguments.finding.is_some()) {
        Some(alone) => options.for_something_else(alone, arguments.poses.unwrap_or(FIELD_POSES)),
        None => options,
    })
}
