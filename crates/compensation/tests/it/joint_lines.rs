//! Lines written as joints: only where the start is known and corrected, so that targets between keep them lines.

use super::*;
use truegrind_compensation::options::Emit;
use truegrind_compensation::plan::reason::OutcomeReason;

/// Two straight passes behind a motion to their start.
fn source(first: &str) -> Vec<u8> {
    let target =
        |y: f64| format!("[[350,{y},400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n");
    let [left, right] = [-150.0, 150.0].map(target);
    format!("MODULE M\nPROC main()\nConfL\\Off;\nConfJ\\Off;\n{first} {left}MoveL {right}MoveL {left}ENDPROC\nENDMODULE\n")
        .into_bytes()
}

fn planned_as(source: &[u8], emit: Emit) -> Vec<(Status, Option<OutcomeReason>, usize)> {
    let estimated = estimated(perturbed(3, 1.0), &[Joints::zeros()]);
    let options = Options { emit, ..Options::default() };
    let task = Task::read(&[("p.mod", source)]);
    let plan = plan(&task.listing, &estimated, &Cell::default(), &options);
    plan.outcomes
        .iter()
        .map(|outcome| (outcome.status, outcome.reason(), outcome.inserted as usize))
        .collect()
}

#[test]
fn a_line_from_an_unknown_start_is_not_written_as_joints() {
    let from_nowhere = source("MoveL");
    for (status, ..) in planned_as(&from_nowhere, Emit::Targets) {
        assert!(status.is_written(), "{status:?}");
    }
    // One cut, left whole: the first line has no start, and the others follow it.
    let joints = planned_as(&from_nowhere, Emit::Joints);
    assert_eq!(joints[0].1, Some(OutcomeReason::LineWithoutStart));
    assert!(joints.iter().all(|(status, ..)| *status == Status::Refused), "{joints:?}");
    // From a joint motion all lines are split into joint motions.
    let joints = planned_as(&source("MoveJ"), Emit::Joints);
    assert!(joints.iter().all(|(status, ..)| status.is_written()), "{joints:?}");
    assert!(joints[1..].iter().all(|(.., inserted)| *inserted > 3), "{joints:?}");
}
