//! `truegrind export MODEL.toml --to urdf|dh-csv|mdh-csv|ur-yaml`: the links of an estimated arm in the formats of others.

use std::path::{Path, PathBuf};

use anyhow::bail;
use clap::{Args, ValueEnum};
use truegrind::arm::effect::Effect;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::transfer::transfer;
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::robots::export::{Format, joint_matrix, lost_in_export, write};
use truegrind::robots::foreign::{ImportOptions, import};

use super::exit_status::ExitStatus;
use super::files::Batch;
use super::identify::{DataArguments, read};
use super::inputs::{self, NamedModel};
use super::terminal::print_message;

/// A format of others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// Unified Robot Description Format: links without shapes.
    Urdf,
    /// Standard table of Denavit–Hartenberg parameters.
    DhCsv,
    /// The same after Craig.
    MdhCsv,
    /// The kinematics file of ROS drivers for Universal Robots.
    UrYaml,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// An estimated arm.
    model: PathBuf,
    /// The format to write.
    #[arg(long, value_enum)]
    to: To,
    /// The file to write; `-` prints it.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Measurements that the exported links are judged on, with only the sensor's frame fitted: the error of a model with effects
    /// is not that of its links alone.
    #[arg(long, value_name = "DATA")]
    data: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitStatus> {
    let mut given = vec![arguments.model.as_path()];
    given.extend(arguments.data.as_deref());
    Batch::check(&given, &[&arguments.output])?;
    let name = arguments.model.display().to_string();
    let named = inputs::model(&name)?;
    let NamedModel::Estimated { arm, .. } = &named else {
        bail!("{name}: expected a model file; `truegrind robots` has the nominal arms");
    };
    let format = match arguments.to {
        To::Urdf => Format::Urdf,
        To::DhCsv => Format::Standard,
        To::MdhCsv => Format::Modified,
        To::UrYaml => Format::UrYaml,
    };
    let bare = Model { effects: Vec::new(), ..arm.model.clone() };
    let mut notes = vec![format!("{} as estimated from {}", arm.robot, arm.provenance.file)];
    notes.extend(lost_in_export(&arm.model, format));
    notes.push(match &arguments.data {
        Some(data) => judged(data, arm, &read_back(&bare, &arm.robot, format)?)?,
        None => known(arm),
    });
    let text = write(&bare, &arm.robot, format, &notes);
    let mut batch = Batch::sparing(given);
    batch.add(&arguments.output, text);
    batch.write()?;
    inputs::warn_doubtful(&named);
    for note in &notes {
        print_message(format_args!("note: {note}"));
    }
    // What is not the arm that was identified is flagged.
    Ok(if is_of_links_alone(&arm.model) { ExitStatus::Done } else { ExitStatus::Flagged })
}

/// Whether all that moves the arm is in its links.
fn is_of_links_alone(arm: &Model) -> bool {
    arm.effects.iter().all(Effect::is_zero)
}

/// The arm as whoever reads the file has it.
fn read_back(bare: &Model, robot: &str, format: Format) -> anyhow::Result<Model> {
    let name = match format {
        Format::Urdf => "exported.urdf",
        Format::Standard | Format::Modified => "exported.csv",
        Format::UrYaml => "exported.yaml",
    };
    let text = write(bare, robot, format, &[]);
    let mut back = import(&text, name, &ImportOptions::default())?.robot.model;
    // Its user works out the file's angles from the controller's, as the notes say.
    back.joint_map *= joint_matrix(bare, format);
    Ok(back)
}

/// What the model file says of the error of its links.
fn known(arm: &Estimated) -> String {
    let error = arm.geometry.held_out.rmse;
    if is_of_links_alone(&arm.model) {
        format!(
            "held-out error of these links: {error:.4} mm RMS; all that the model holds of the arm is in them"
        )
    } else {
        format!(
            "held-out error of these links alone: not evaluated; that of the whole model is {error:.4} mm RMS and counts the effects; \
             measurements given with the option data state it"
        )
    }
}

/// The error of what was exported on measurements.
fn judged(data: &Path, arm: &Estimated, exported: &Model) -> anyhow::Result<String> {
    let reading = DataArguments::of(data.to_path_buf(), arm.robot.clone());
    let (_, rows) = read(&reading)?;
    let tolerance = Tolerance::default();
    let frames = starting_frames(&rows, &arm.nominal, &tolerance, true)?;
    let found = transfer(&rows, &frames, &arm.nominal, exported, &arm.model, &tolerance, true);
    let seen = if rows.sha256 == arm.provenance.sha256 {
        "which the model was fitted to, so that this is no held-out error"
    } else {
        "which the model was not fitted to"
    };
    Ok(format!(
        "error of these links on {} ({} rows, {seen}), only the sensor's frame fitted: {:.4} mm RMS; whole model {:.4} mm, data sheet \
         {:.4} mm",
        rows.file, found.rows, found.geometric_rmse_mm, found.extended_rmse_mm, found.nominal_rmse_mm
    ))
}
