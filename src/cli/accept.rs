//! `truegrind accept DATA --model MODEL.toml --tolerance MM`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use truegrind::calibration::acceptance::{Options, accept};
use truegrind::math::digest::sha256;
use truegrind::report::acceptance::{self as view, Statement};

use super::computation::{Common, watching};
use super::exit_status::ExitStatus;
use super::files::{self, Batch};
use super::identify::{DataArguments, PointsArguments, read};
use super::inputs::{self, NamedModel, UrdfLinks};
use super::outputs::{Outputs, Pages};
use super::progress::Spinner;
use super::stated_frames::StatedFrameArguments;
use super::terminal::print_message;

/// Arguments of `accept`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Measurements, CSV or XLSX, of at least 100 poses to which the model was not fitted.
    data: PathBuf,
    /// Estimated arm to judge.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Tolerance: the largest accepted position error (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    tolerance: f64,
    /// Expanded uncertainty of the sensor, k = 2 (mm). Default: from the scatter of repeated poses, for 95.45 %.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    sensor_uncertainty: Option<f64>,
    /// Tolerance of the orientation (°), for sensors that measure it. Without it orientation errors are reported but not judged.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance_angle: Option<f64>,
    /// Expanded uncertainty of the measured orientation, k = 2 (°). Default: from the scatter of repeated poses, for 95.45 %.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    sensor_uncertainty_angle: Option<f64>,
    /// Serial number or other remark for the report, such as --serial arm=120-503211. May be repeated.
    #[arg(long, value_name = "WHAT=TEXT")]
    serial: Vec<String>,
    /// Robot file, if the robot of the model is not in the catalogue.
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    links: UrdfLinks,
    #[command(flatten)]
    points: PointsArguments,
    /// Sheet of a workbook. Default: the first with the needed columns.
    #[arg(long)]
    sheet: Option<String>,
    /// Accept implausible units.
    #[arg(long)]
    allow_odd_units: bool,
    #[command(flatten)]
    stated: StatedFrameArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    pages: Pages,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let outputs = Outputs::from(&arguments.pages);
    let mut given: Vec<&Path> = vec![&arguments.data, &arguments.model];
    given.extend(arguments.points.points.as_deref());
    Batch::check(&given, &outputs.files())?;
    let serials = arguments.serial.iter().map(|text| serial(text)).collect::<anyhow::Result<Vec<_>>>()?;
    let named = inputs::model(&arguments.model.to_string_lossy())?;
    let NamedModel::Estimated { name, arm, .. } = &named else {
        bail!(
            "--model nominal: an acceptance test needs an estimated arm, as written by `truegrind identify -o`"
        );
    };
    let hash = sha256(&files::read(&arguments.model)?);
    // Refuses a robot other than that of the model.
    let stated = arguments.robot.as_deref().map(|name| arguments.links.of(name));
    inputs::nominal(&named, stated)?;
    let robot = inputs::measured_robot(arm, stated)?;
    let data = DataArguments {
        points: arguments.points.clone(),
        sheet: arguments.sheet.clone(),
        allow_odd_units: arguments.allow_odd_units,
        ..DataArguments::of(arguments.data.clone(), robot)
    };
    let (_, dataset) = read(&data)?;
    outputs.refuse_other_kinds()?;
    let options = Options {
        tolerance_mm: arguments.tolerance,
        uncertainty_mm: arguments.sensor_uncertainty,
        tolerance_rad: arguments.tolerance_angle.map(f64::to_radians),
        uncertainty_rad: arguments.sensor_uncertainty_angle.map(f64::to_radians),
        frames: arguments.stated.placement()?.frames_of_both(&dataset)?,
        seed: arguments.common.seed,
    };
    let work = Spinner::start(format!("judging {} on {} rows", arm.robot, dataset.rows.len()));
    let found = watching(arguments.common.threads, &work, || accept(&dataset, arm, &options))??;
    drop(work);
    for note in &dataset.notes {
        print_message(format_args!("note: {note}"));
    }
    let statement = Statement {
        serials,
        model: Some((name.clone(), hash)),
        frames_stated: options.frames.is_some(),
        seed: options.seed,
    };
    outputs.print(&view::summary(&found, &dataset, arm))?;
    let mut batch = Batch::sparing(given);
    outputs.add_made(
        &mut batch,
        || view::document(&found, &dataset, arm, &statement),
        || view::row_table(&found),
        || view::json(&found, &dataset, arm, &statement),
    )?;
    batch.write()?;
    Ok(if view::is_accepted(&found) { ExitStatus::Done } else { ExitStatus::Flagged })
}

fn serial(text: &str) -> anyhow::Result<(String, String)> {
    let (what, text) = text
        .split_once('=')
        .filter(|(what, text)| !what.trim().is_empty() && !text.trim().is_empty())
        .ok_or_else(|| anyhow!("--serial {text}: expected WHAT=TEXT, such as arm=120-503211"))?;
    Ok((what.trim().to_owned(), text.trim().to_owned()))
}
