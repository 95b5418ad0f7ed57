//! `truegrind export MODEL.toml --to urdf|dh-csv|mdh-csv|ur-yaml`: the links of an estimated arm in other formats.

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, ValueEnum};
use truegrind::calibration::exported::{Exported, exported};
use truegrind::robots::export::Format;

use super::exit_status::ExitStatus;
use super::files::Batch;
use super::identify::{DataArguments, read};
use super::inputs::{self, NamedModel, StatedRobot};
use super::terminal::print_message;

/// Output format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// Unified Robot Description Format: links without shapes.
    Urdf,
    /// Table of standard Denavit–Hartenberg parameters.
    DhCsv,
    /// Table of modified Denavit–Hartenberg parameters (Craig).
    MdhCsv,
    /// Kinematics file of the ROS drivers for Universal Robots.
    UrYaml,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Estimated arm (model file).
    model: PathBuf,
    /// Output format.
    #[arg(long, value_enum)]
    to: To,
    /// File to write; `-` prints it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Measurements on which the error of the exported links is evaluated, with only the sensor frame fitted. The links of a model
    /// with effects have a larger error than the model.
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
    #[command(flatten)]
    robot: StatedRobot,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut given = vec![arguments.model.as_path()];
    given.extend(arguments.data.as_deref());
    Batch::check(&given, &[&arguments.output])?;
    let name = arguments.model.display().to_string();
    let named = inputs::model(&name)?;
    let NamedModel::Estimated { arm, .. } = &named else {
        bail!("{name}: expected a model file; `truegrind robots` shows the nominal arms");
    };
    let stated = arguments.robot.named();
    inputs::nominal(&named, stated)?;
    let format = match arguments.to {
        To::Urdf => Format::Urdf,
        To::DhCsv => Format::Standard,
        To::MdhCsv => Format::Modified,
        To::UrYaml => Format::UrYaml,
    };
    let robot = inputs::robot(stated.unwrap_or(arm.robot.as_str().into())).ok();
    let rows = match &arguments.data {
        Some(data) => Some(read(&DataArguments::of(data.clone(), inputs::measured_robot(arm, stated)?))?.1),
        None => None,
    };
    let Exported { text, notes, is_whole } = exported(arm, format, robot.as_ref(), rows.as_ref())?;
    let mut batch = Batch::sparing(given);
    batch.add(&arguments.output, text);
    batch.write()?;
    inputs::warn_doubtful(&named);
    for note in &notes {
        print_message(format_args!("note: {note}"));
    }
    // Links without their effects are not the identified arm.
    Ok(if is_whole { ExitStatus::Done } else { ExitStatus::Flagged })
}
