//! Checks that cell, program and model belong to the same robot.

use anyhow::bail;
use truegrind::arm::model::Model;
use truegrind::compensation::cell::Cell;
use truegrind::compensation::cell::robot_match::{cell_robot_mismatch, program_robot_mismatch};

use truegrind::report::robots::dialect;
use truegrind::robots::Robot;
use truegrind::robots::sheet::Dialect;

use super::files;
use super::programs::Programs;
use super::terminal::print_message;

/// Refuses the cell file of another robot.
pub(super) fn refuse_other_cell(cell: &Cell, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    cell_robot_mismatch(cell, robot, nominal).map_or(Ok(()), |fault| bail!("{fault}"))
}

/// Refuses programs that name another robot.
pub(super) fn refuse_other_program(programs: &Programs, robot: &str, nominal: &Model) -> anyhow::Result<()> {
    for (path, source) in &programs.files {
        if let Some(fault) = program_robot_mismatch(&files::name(path), source, robot, nominal) {
            bail!("{fault}");
        }
    }
    Ok(())
}

/// Notes a RAPID program for an arm whose controller reads another language: it is right for the arm, but nothing there runs it.
pub(super) fn note_other_language(robot: &Robot) {
    if let Some(other) = robot.sheet.dialect.filter(|dialect| *dialect != Dialect::Rapid) {
        print_message(format_args!(
            "note: the program is RAPID, and the controller of {} reads {}: it has to be translated before it can run there",
            robot.sheet.name,
            dialect(other)
        ));
    }
}
