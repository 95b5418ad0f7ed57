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

fn planned_as(source: &[u8], emit: Emit) -> Vec<(MotionStatus, Option<OutcomeReason>, usize)> {
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
    assert!(joints.iter().all(|(status, ..)| *status == MotionStatus::Refused), "{joints:?}");
    // From a joint motion all lines are split into joint motions.
    let joints = planned_as(&source("MoveJ"), Emit::Joints);
    assert!(joints.iter().all(|(status, ..)| status.is_written()), "{joints:?}");
    assert!(joints[1..].iter().all(|(.., inserted)| *inserted > 3), "{joints:?}");
}

/// With a time for the whole motion, or with the next statements running during it, no target can be inserted: one joint motion was written
/// instead of the line, several centimetres off, and only flagged.
#[test]
fn a_line_that_cannot_be_divided_is_not_written_as_one_joint_motion() {
    let at = |y: f64| format!("[[350,{y},400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let [left, right] = [-150.0, 150.0].map(at);
    let with =
        |body: String| format!("MODULE M\nPROC main()\nConfL\\Off;\nConfJ\\Off;\n{body}ENDPROC\nENDMODULE\n");
    let begin = format!("MoveJ {left},v100,fine,tool0;\n");
    for line in &[
        format!("MoveL {right},v100\\T:=3,fine,tool0;\n"),
        format!("MoveL\\Conc,{right},v100,fine,tool0;\n"),
        format!("SingArea\\Wrist;\nMoveL {right},v100,fine,tool0;\nSingArea\\Off;\n"),
        format!("SMoveL {right},v100\\T:=3,fine,tool0;\n"),
        format!("TriggL {right},v100,near,fine,tool0;\n"),
    ] {
        let back = format!("MoveJ {left},v100,fine,tool0;\n");
        let source = with([begin.clone(), line.clone(), back].concat()).into_bytes();
        let found = planned_as(&source, Emit::Joints);
        // Where it begins stays as well.
        assert_eq!((found[0].0, found[2].0.is_written()), (MotionStatus::Refused, true), "{found:?}");
        let Some(OutcomeReason::LineAsJoints { mm }) = found[1].1 else { panic!("{found:?}") };
        assert!(found[1].0 == MotionStatus::Refused && mm > 10.0, "{found:?}");
        assert!(found[1].1.unwrap().to_string().contains("drop --emit joints"), "{found:?}");
        assert!(planned_as(&source, Emit::Targets)[1].0.is_written(), "{line}");
    }
    // A short one stays within the tolerance without targets between.
    let short = format!("MoveL {},v100\\T:=3,fine,tool0;\n", at(-148.0));
    let found = planned_as(&with([begin, short].concat()).into_bytes(), Emit::Joints);
    assert!(found.iter().all(|(status, _, inserted)| status.is_written() && *inserted == 0), "{found:?}");
}
