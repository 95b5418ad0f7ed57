//! Lines along which the tool turns by half a turn: which way is the shorter one must not change.

use super::*;
use truegrind_compensation::cut::Cuts;
use truegrind_compensation::plan::reason::OutcomeReason;

/// A line along which the tool turns about its axis by so many degrees.
fn source(turn_deg: f64) -> Vec<u8> {
    let target = |x: f64, turn: f64| {
        let (sin, cos) = (0.5 * turn).to_radians().sin_cos();
        format!(
            "[[{x},-80,420],[0,{:.9},{:.9},0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n",
            -sin, cos
        )
    };
    let lines = [target(330.0, 0.0), target(350.0, turn_deg)].map(|line| format!("MoveL {line}"));
    let end = target(360.0, turn_deg);
    format!(
        "MODULE M\nPROC main()\nConfL\\Off;\nConfJ\\Off;\nMoveJ {}{}MoveL {end}ENDPROC\nENDMODULE\n",
        &lines[0][6..],
        lines[1]
    )
    .into_bytes()
}

fn reasons(turn_deg: f64) -> Vec<Option<OutcomeReason>> {
    let estimated = estimated(perturbed(3, 2.0), &[Joints::zeros()]);
    let bytes = source(turn_deg);
    let task = Task::read(&[("p.mod", bytes.as_slice())]);
    let options = Options { cuts: Cuts::Single, ..Options::default() };
    plan(&task.listing, &estimated, &Cell::default(), &options)
        .outcomes
        .iter()
        .map(|outcome| outcome.reason().filter(|reason| matches!(reason, OutcomeReason::HalfTurn { .. })))
        .collect()
}

#[test]
fn a_line_that_might_turn_the_tool_the_other_way_is_refused_with_both_ends() {
    let half = Some(OutcomeReason::HalfTurn { line: 6 });
    for turn_deg in [180.0, -180.0, 179.9999] {
        assert_eq!(reasons(turn_deg), [half, half, None], "{turn_deg}");
    }
    for turn_deg in [0.0, 90.0, -150.0, 170.0] {
        assert_eq!(reasons(turn_deg), [None; 3], "{turn_deg}");
    }
}

#[test]
fn the_reason_names_the_line_and_the_remedy() {
    let said = OutcomeReason::HalfTurn { line: 6 }.to_string();
    assert!(said.contains("line 6") && said.contains("target"), "{said}");
}
