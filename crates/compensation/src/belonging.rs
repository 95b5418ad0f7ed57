//! Whether cell, program and model are of one robot: a correction of another arm is none.

use super::cell::Cell;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_programs::draft::robot_of;

/// Whether a robot that a file names is the one of a model, under that name or as the same arm of the catalogue.
fn is_same(stated: &str, robot: &str, nominal: &Model) -> bool {
    stated.eq_ignore_ascii_case(robot)
        || robots::load(stated).is_ok_and(|known| robots::same(nominal, &known.model).is_ok())
}

/// What is wrong with a cell file that is another robot's.
pub fn cell_of_another(cell: &Cell, robot: &str, nominal: &Model) -> Option<String> {
    let stated = cell.robot.as_ref().filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "cell file: robot = \"{stated}\", but the model is one of {robot}: give the model of the robot that runs the programs, or \
         correct the cell file"
    ))
}

/// What is wrong with a program that says that it was made for another robot; `name` is what its file is called.
pub fn program_of_another(name: &str, source: &[u8], robot: &str, nominal: &Model) -> Option<String> {
    let stated = robot_of(source).filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "{name}: its heading says that it was made for {stated}, but the model is one of {robot}: give the model of the robot \
         that runs it, or take that line out where it is wrong"
    ))
}
