//! Whether cell, program and model are of one robot: a correction of another arm is none.

use anyhow::bail;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::cell::robot_match::{cell_of_another, program_of_another};

use super::files;
use super::programs::Programs;

/// Refuses a cell file that is another robot's.
pub(super) fn cell_is_of(cell: &Cell, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    cell_of_another(cell, robot, nominal).map_or(Ok(()), |fault| bail!("{fault}"))
}

/// Refuses programs that say that they were made for another robot.
pub(super) fn made_for(programs: &Programs, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    for (path, source) in &programs.files {
        if let Some(fault) = program_of_another(&files::name(path), source, robot, nominal) {
            bail!("{fault}");
        }
    }
    Ok(())
}
