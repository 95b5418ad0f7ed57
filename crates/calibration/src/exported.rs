//! The links of an estimated arm as a file of another format, with what a reader of that file has to know and its error on measured rows.

use thiserror::Error;

use crate::diagnosis::transfer::{Models, transfer};
use crate::identification::register::starting_frames;
use crate::identification::start::StartError;
use crate::identification::tolerance::Tolerance;
use crate::measurement::dataset::Dataset;
use truegrind_arm::effect::Effect;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Model;
use truegrind_arm::robots::export::{Format, has_axes_of_ur, joint_matrix, lost_in_export, write};
use truegrind_arm::robots::foreign::{ImportOptions, import};
use truegrind_arm::robots::{Robot, RobotError};

/// Why an arm is not exported. Messages name the options of the command line.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExportError {
    /// Drivers for arms of Universal Robots drive no other arm.
    #[error(
        "--to ur-yaml: {robot} is {of}, and only the drivers for arms of Universal Robots read this file: choose urdf, dh-csv or mdh-csv"
    )]
    OtherMaker {
        /// The robot.
        robot: String,
        /// Whose arm it is.
        of: String,
    },
    /// The written links cannot be read back.
    #[error(transparent)]
    Links(#[from] RobotError),
    /// The rows do not place the sensor.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// An exported arm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The file.
    pub text: String,
    /// Its notes, which the file contains too: what it leaves out, its angles, its error.
    pub notes: Vec<String>,
    /// Whether the links alone are the identified arm; otherwise effects are left out.
    pub is_whole: bool,
}

/// Exports the links of an arm. `robot`: its data sheet, where known. `rows`: measurements on which the error of the links is evaluated,
/// with only the sensor's frame fitted.
///
/// # Errors
/// [`ExportError`].
pub fn exported(
    arm: &Estimated,
    format: Format,
    robot: Option<&Robot>,
    rows: Option<&Dataset>,
) -> Result<Exported, ExportError> {
    if format == Format::UrYaml {
        refuse_other_maker(arm, robot)?;
    }
    let bare = Model { effects: Vec::new(), ..arm.model.clone() };
    let mut notes = vec![format!("{} as estimated from {}", arm.robot, arm.provenance.file)];
    notes.extend(lost_in_export(&arm.model, format));
    notes.push(match rows {
        Some(rows) => measured_error(rows, arm, &read_back(&bare, &arm.robot, format)?)?,
        None => stated_error(arm),
    });
    let text = write(&bare, &arm.robot, format, &notes);
    Ok(Exported { text, notes, is_whole: has_links_only(&arm.model) })
}

/// Refuses the kinematics file of UR drivers for an arm that they do not drive: of another maker, or with axes that lie otherwise.
fn refuse_other_maker(arm: &Estimated, robot: Option<&Robot>) -> Result<(), ExportError> {
    let maker = robot.map_or("", |robot| robot.sheet.maker.trim());
    let is_other = !maker.is_empty() && !maker.to_lowercase().contains("universal");
    if !is_other && has_axes_of_ur(&arm.nominal) {
        return Ok(());
    }
    let of =
        if is_other { format!("made by {maker}") } else { "not an arm with the axes of a UR".to_owned() };
    Err(ExportError::OtherMaker { robot: arm.robot.clone(), of })
}

/// Whether the links alone describe the arm.
fn has_links_only(arm: &Model) -> bool {
    arm.effects.iter().all(Effect::is_zero)
}

/// The arm as a reader of the file sees it.
fn read_back(bare: &Model, robot: &str, format: Format) -> Result<Model, RobotError> {
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
fn measured_error(rows: &Dataset, arm: &Estimated, exported: &Model) -> Result<String, StartError> {
    let tolerance = Tolerance::default();
    let frames = starting_frames(rows, &arm.nominal, &tolerance, true)?;
    let models = Models {
        faults: &[],
        nominal: &arm.nominal,
        geometric: exported,
        extended: &arm.model,
        written: &arm.model,
        condition: &arm.condition,
    };
    let found = transfer(rows, &frames, &models, &tolerance, true);
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
