//! Whether cell, program and model are of one robot: a correction of another arm is none.

use anyhow::bail;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::Cell;
use truegrind::programs::draft::robot_of;
use truegrind::robots;

use super::files;
use super::programs::Programs;

/// Whether a robot that a file names is the one of a model, under that name or as the same arm of the catalogue.
fn is_same(stated: &str, robot: &str, nominal: &Model) -> bool {
    stated.eq_ignore_ascii_case(robot)
        || robots::load(stated).is_ok_and(|known| robots::same(nominal, &known.model).is_ok())
}

/// Refuses a cell file that is another robot's.
pub(super) fn cell_is_of(cell: &Cell, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    match &cell.robot {
        Some(stated) if !is_same(stated, robot, nominal) => bail!(
            "cell file: robot = \"{stated}\", but the model is one of {robot}: give the model of the robot that runs the programs, or \
             correct the cell file"
        ),
        _ => Ok(()),
    }
}

/// Refuses programs that say that they were made for another robot.
pub(super) fn made_for(programs: &Programs, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    for (path, source) in &programs.files {
        if let Some(stated) = robot_of(source).filter(|stated| !is_same(stated, robot, nominal)) {
            bail!(
                "{}: its heading says that it was made for {stated}, but the model is one of {robot}: give the model of the robot \
                 that runs it, or take that line out where it is wrong",
                files::name(path)
            );
        }
    }
    Ok(())
}
