//! Whether cell, program and model belong to the same robot: a correction for another arm is wrong.

use super::file::Cell;
use crate::plan::Plan;
use crate::plan::reason::OutcomeReason;
use truegrind_arm::inverse::InverseError;
use truegrind_arm::model::Model;
use truegrind_arm::robots;
use truegrind_programs::draft::robot_of;

/// Whether a robot named in a file is that of a model, by name or as the same arm of the catalogue.
fn is_same(stated: &str, robot: &str, nominal: &Model) -> bool {
    stated.eq_ignore_ascii_case(robot)
        || robots::load(stated).is_ok_and(|known| robots::check_same_links(nominal, &known.model).is_ok())
}

/// The fault of a cell file for another robot.
pub fn cell_robot_mismatch(cell: &Cell, robot: &str, nominal: &Model) -> Option<String> {
    let stated = cell.robot.as_ref().filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "cell file: robot = \"{stated}\", but the model is of {robot}: give the model of the robot that runs \
         the programs, or correct the cell file"
    ))
}

/// The fault of a program whose heading names another robot; `name`: name of its file.
pub fn program_robot_mismatch(name: &str, source: &[u8], robot: &str, nominal: &Model) -> Option<String> {
    let stated = robot_of(source).filter(|stated| !is_same(stated, robot, nominal))?;
    Some(format!(
        "{name}: its heading states that it was made for {stated}, but the model is of {robot}: give the \
         model of the robot that runs it, or remove that line if it is wrong"
    ))
}

/// A smaller number of motions proves nothing: a single one can be a mistake.
const MIN_MOTIONS: usize = 5;

/// Motions that the arm does not reach, of a program of which it reaches hardly any.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnreachableMotions {
    /// How many.
    pub count: usize,
    /// How many of them it reaches in another configuration than they state.
    pub other_configuration: usize,
    /// One of these: index of the motion, and why.
    pub example: Option<(u32, InverseError)>,
}

/// Unreachable motions, where the arm reaches hardly any: the program belongs to another arm, or states other configurations. A program
/// with a few unreachable targets does not.
pub fn unreachable_motions(plan: &Plan) -> Option<UnreachableMotions> {
    let untold = |reason: &OutcomeReason| {
        matches!(
            reason,
            OutcomeReason::Program(_)
                | OutcomeReason::MovingBase { .. }
                | OutcomeReason::CellContradiction
                | OutcomeReason::JointTarget
        ) || *reason == OutcomeReason::Inverse(InverseError::Abandoned)
    };
    let unreached = |reason: &OutcomeReason| {
        matches!(reason, OutcomeReason::Inverse(_) | OutcomeReason::OutsideLimits { .. })
    };
    let judged = || plan.outcomes.iter().filter(|outcome| !outcome.reason.as_deref().is_some_and(untold));
    let all = judged().count();
    let count = judged().filter(|outcome| outcome.reason.as_deref().is_some_and(unreached)).count();
    let configured = judged().filter_map(|outcome| match outcome.reason() {
        Some(OutcomeReason::Inverse(error @ InverseError::OtherConfiguration { .. })) => {
            Some((outcome.motion, error))
        }
        _ => None,
    });
    let mut configured = configured.peekable();
    let example = configured.peek().copied();
    // One target in fifty can be reachable by chance.
    (all >= MIN_MOTIONS && 50 * count >= 49 * all).then(|| UnreachableMotions {
        count,
        other_configuration: configured.count(),
        example,
    })
}
