//! `truegrind accept DATA --model MODEL.toml --tolerance MM`.

use std::path::{Path, PathBuf};

use anyhow::{anyhow, bail};
use clap::Args;
use sha2::{Digest, Sha256};
use truegrind::calibration::acceptance::{Options, accept};
use truegrind::report::acceptance::{self as view, Statement};

use super::computation::{Common, watching};
use super::ending::Ending;
use super::files::{self, Batch};
use super::identify::{DataArguments, PointsArguments, read};
use super::inputs::{self, NamedModel};
use super::outputs::{Outputs, Pages};
use super::progress::Work;
use super::stated::StatedArguments;
use super::terminal::tell;

/// Arguments of `accept`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Measurements that the model was not fitted to, CSV or XLSX: at least 100 poses.
    data: PathBuf,
    /// The estimated arm.
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The largest error that is accepted (mm).
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    tolerance: f64,
    /// Expanded uncertainty of the sensor, k = 2 (mm); else twice the scatter of repeated poses.
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    sensor_uncertainty: Option<f64>,
    /// The largest error of the orientation that is accepted (°), where the sensor measures it; without it the orientation is told and
    /// not judged.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance_angle: Option<f64>,
    /// Expanded uncertainty of the sensor's orientation, k = 2 (°); else twice the scatter of repeated poses.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    sensor_uncertainty_angle: Option<f64>,
    /// A serial number or the like for the page, such as --serial arm=120-503211; any number of times.
    #[arg(long, value_name = "WHAT=TEXT")]
    serial: Vec<String>,
    /// The robot, where the model is of one that is not in the catalogue: its file.
    #[arg(long)]
    robot: Option<String>,
    #[command(flatten)]
    points: PointsArguments,
    /// Sheet of a workbook; the first with the columns otherwise.
    #[arg(long)]
    sheet: Option<String>,
    /// Take the units as they are, however odd they look.
    #[arg(long)]
    allow_odd_units: bool,
    #[command(flatten)]
    stated: StatedArguments,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    pages: Pages,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Ending> {
    let outputs = Outputs::from(&arguments.pages);
    let mut given: Vec<&Path> = vec![&arguments.data, &arguments.model];
    given.extend(arguments.points.points.as_deref());
    Batch::check(&given, &outputs.files())?;
    let serials = arguments.serial.iter().map(|text| serial(text)).collect::<anyhow::Result<Vec<_>>>()?;
    let named = inputs::model(&arguments.model.to_string_lossy())?;
    let NamedModel::Estimated { name, arm, .. } = &named else {
        bail!("--model nominal: an acceptance judges an estimated arm, which `truegrind identify -o` writes");
    };
    let hash: String =
        Sha256::digest(files::read(&arguments.model)?).iter().map(|byte| format!("{byte:02x}")).collect();
    // Refuses another robot than the model's.
    inputs::nominal(&named, arguments.robot.as_deref())?;
    let robot = arguments.robot.clone().unwrap_or_else(|| arm.robot.clone());
    let data = DataArguments {
        points: arguments.points.clone(),
        sheet: arguments.sheet.clone(),
        allow_odd_units: arguments.allow_odd_units,
        ..DataArguments::of(arguments.data.clone(), robot)
    };
    let (_, dataset) = read(&data)?;
    let options = Options {
        tolerance_mm: arguments.tolerance,
        uncertainty_mm: arguments.sensor_uncertainty,
        tolerance_rad: arguments.tolerance_angle.map(f64::to_radians),
        uncertainty_rad: arguments.sensor_uncertainty_angle.map(f64::to_radians),
        frames: arguments.stated.frames(&dataset)?,
        seed: arguments.common.seed,
    };
    let work = Work::start(format!("judging {} by {} rows", arm.robot, dataset.rows.len()));
    let found = watching(arguments.common.threads, &work, || accept(&dataset, arm, &options))??;
    drop(work);
    for note in &dataset.notes {
        tell(format_args!("note: {note}"));
    }
    let said = Statement {
        serials,
        model: Some((name.clone(), hash)),
        frames_stated: options.frames.is_some(),
        seed: options.seed,
    };
    outputs.print(&view::summary(&found, &dataset, arm))?;
    let mut batch = Batch::sparing(given);
    outputs.add_made(
        &mut batch,
        || view::document(&found, &dataset, arm, &said),
        || view::row_table(&found),
        || view::json(&found, &dataset, arm, &said),
    )?;
    batch.write()?;
    Ok(if view::is_accepted(&found) { Ending::Done } else { Ending::Flagged })
}

fn serial(text: &str) -> anyhow::Result<(String, String)> {
    let (what, text) = text
        .split_once('=')
        .filter(|(what, text)| !what.trim().is_empty() && !text.trim().is_empty())
        .ok_or_else(|| anyhow!("--serial {text}: expected WHAT=TEXT, such as arm=120-503211"))?;
    Ok((what.trim().to_owned(), text.trim().to_owned()))
}
