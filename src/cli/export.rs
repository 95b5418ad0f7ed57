//! `truegrind export MODEL.toml --to urdf|dh-csv|mdh-csv|ur-yaml`: the links of an estimated arm in other formats.

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, ValueEnum};
use truegrind::arm::effect::Effect;
use truegrind::arm::estimated::Estimated;
use truegrind::arm::model::Model;
use truegrind::calibration::diagnosis::transfer::{Models, transfer};
use truegrind::calibration::identification::register::starting_frames;
use truegrind::calibration::identification::tolerance::Tolerance;
use truegrind::robots::Robot;
use truegrind::robots::export::{Format, has_axes_of_ur, joint_matrix, lost_in_export, write};
use truegrind::robots::foreign::{ImportOptions, import};

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
    if format == Format::UrYaml {
        refuse_other_maker(arm, inputs::robot(stated.unwrap_or(arm.robot.as_str().into())).ok().as_ref())?;
    }
    let bare = Model { effects: Vec::new(), ..arm.model.clone() };
    let mut notes = vec![format!("{} as estimated from {}", arm.robot, arm.provenance.file)];
    notes.extend(lost_in_export(&arm.model, format));
    notes.push(match &arguments.data {
        Some(data) => {
            let measured = DataArguments::of(data.clone(), inputs::measured_robot(arm, stated)?);
            measured_error(&measured, arm, &read_back(&bare, &arm.robot, format)?)?
        }
        None => stated_error(arm),
    });
    let text = write(&bare, &arm.robot, format, &notes);
    let mut batch = Batch::sparing(given);
    batch.add(&arguments.output, text);
    batch.write()?;
    inputs::warn_doubtful(&named);
    for note in &notes {
        print_message(format_args!("note: {note}"));
    }
    // Links without their effects are not the identified arm.
    Ok(if has_links_only(&arm.model) { ExitStatus::Done } else { ExitStatus::Flagged })
}

/// Refuses the kinematics file of UR drivers for an arm that they do not drive: of another maker, or with axes that lie otherwise.
fn refuse_other_maker(arm: &Estimated, robot: Option<&Robot>) -> anyhow::Result<()> {
    let maker = robot.map_or("", |robot| robot.sheet.maker.trim());
    let is_other = !maker.is_empty() && !maker.to_lowercase().contains("universal");
    if is_other || !has_axes_of_ur(&arm.nominal) {
        let of =
            if is_other { format!("made by {maker}") } else { "not an arm with the axes of a UR".to_owned() };
        bail!(
            "--to ur-yaml: {} is {of}, and only the drivers for arms of Universal Robots read this file: choose urdf, dh-csv or mdh-csv",
            arm.robot
        );
    }
    Ok(())
}

/// Whether the links alone describe the arm.
fn has_links_only(arm: &Model) -> bool {
    arm.effects.iter().all(Effect::is_zero)
}

/// The arm as a reader of the file sees it.
fn read_back(bare: &Model, robot: &str, format: Format) -> anyhow::Result<Model> {
    let name = match format {
        Format::Urdf => "exported.urdf",
        Format::Standard | Format::Modified => "exported.csv",
        Format::UrYaml => "exported.yaml",
    };
    let text = write(bare, robot, format, &[]);
    let mut back = import(&text, name, &ImportOptions::default())?.robot.model;
    // Users convert the controller angles to those of the file, as the notes state.
    back.joint_map *= joint_matrix(bare, format);
    Ok(back)
}

/// The error of the links according to the model file.
fn stated_error(arm: &Estimated) -> String {
    let error = arm.calibrated.held_out.rmse;
    if has_links_only(&arm.model) {
        format!("held-out error of these links: {error:.4} mm RMS; they contain the whole model")
    } else {
        format!(
            "held-out error of these links alone: not evaluated (`truegrind export` with measurements evaluates it); that of the whole model with its effects is \
             {error:.4} mm RMS"
        )
    }
}

/// The error of the exported links on measurements.
fn measured_error(data: &DataArguments, arm: &Estimated, exported: &Model) -> anyhow::Result<String> {
    let (_, rows) = read(data)?;
    let tolerance = Tolerance::default();
    let frames = starting_frames(&rows, &arm.nominal, &tolerance, true)?;
    let models = Models {
        faults: &[],
        nominal: &arm.nominal,
        geometric: exported,
        extended: &arm.model,
        written: &arm.model,
        condition: &arm.condition,
    };
    let found = transfer(&rows, &frames, &models, &tolerance, true);
    let relation = if rows.sha256 == arm.provenance.sha256 {
        "to which the model was fitted, so this is not a held-out error"
    } else {
        "to which the model was not fitted"
    };
    Ok(format!(
        "error of these links on {} ({} rows, {relation}), only the sensor frame fitted: {:.4} mm RMS; whole model {:.4} mm, data sheet \
         {:.4} mm",
        rows.file, found.rows, found.geometric_rmse_mm, found.extended_rmse_mm, found.nominal_rmse_mm
    ))
}
