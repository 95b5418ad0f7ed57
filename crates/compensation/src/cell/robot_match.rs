//! Whether cell, program and model are of one robot: a correction of another arm is none.

use crate::cell::Cell;
use crate::plan::Plan;
use crate::plan::reason::OutcomeReason;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_programs::draft::robot_of;

/// Whether a robot that a file names is the one of a model, under that name or as the same arm of the catalogue.
fn is_same(stated: &str, robot: &str, nominal: &Model) -> bool {
    stated.eq_ignore_ascii_case(robot)
        || robots::load(stated).is_ok_and(|known| robots::check_same_links(nominal, &known.model).is_ok())
}

/// What is wrong with a cell file that is another robot's.
pub fn cell_robot_mismatch(cell: &Cell, robot: &str, nominal: &Model) -> Option<String> {
    let stated = cell.robot.as_ref().filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "cell file: robot = \"{stated}\", but the model is one of {robot}: give the model of the robot that runs the programs, or \
         correct the cell file"
    ))
}

/// What is wrong with a program that says that it was made for another robot; `name` is what its file is called.
pub fn program_robot_mismatch(name: &str, source: &[u8], robot: &str, nominal: &Model) -> Option<String> {
    let stated = robot_of(source).filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "{name}: its heading says that it was made for {stated}, but the model is one of {robot}: give the model of the robot \
         that runs it, or take that line out where it is wrong"
    ))
}

/// Fewer motions than these say nothing of the arm: a single one may be a slip.
const FEWEST: usize = 5;

/// How many motions there are where hardly one has joints on the arm that was asked: the program is another arm's. A program
/// that a few targets of which are out of reach is its own.
pub fn unreachable_motions(plan: &Plan) -> Option<usize> {
    let untold = |why: &OutcomeReason| {
        matches!(
            why,
            OutcomeReason::Program(_)
                | OutcomeReason::MovingBase { .. }
                | OutcomeReason::CellContradiction
                | OutcomeReason::JointTarget
        ) || *why == OutcomeReason::Inverse(InverseError::Abandoned)
    };
    let unreached =
        |why: &OutcomeReason| matches!(why, OutcomeReason::Inverse(_) | OutcomeReason::OutsideLimits { .. });
    let judged = || plan.outcomes.iter().filter(|outcome| !outcome.reason.as_ref().is_some_and(untold));
    let all = judged().count();
    let without = judged().filter(|outcome| outcome.reason.as_ref().is_some_and(unreached)).count();
    // One target in fifty may be reached by chance.
    (all >= FEWEST && 50 * without >= 49 * all).then_some(without)
}
