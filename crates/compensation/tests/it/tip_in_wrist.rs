//! The class: a tool frame that is stated the other way round. Its correction is that of another place, and was "ok".

use nalgebra::Vector3;
use truegrind_arm::condition::Condition;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::compensate::compensate;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::Plan;
use truegrind_math::se3::Pose;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Program;

use super::{estimated, nominal, perturbed};

fn frame_text(frame: &Pose) -> String {
    let (t, q) = (frame.translation.vector, frame.rotation.quaternion());
    format!("[{:.5},{:.5},{:.5}],[{:.9},{:.9},{:.9},{:.9}]", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
}

/// A program whose tool has this frame at a pose well within reach.
fn plan_with(tool: &Pose) -> Plan {
    let joints = Joints::from([8.0, 18.0, 0.0, 12.0, 58.0, 18.0].map(f64::to_radians));
    let target = nominal().at_condition(&Condition::default()).forward(&joints) * tool;
    let source = format!(
        "MODULE M\n PERS tooldata t:=[TRUE,[{}],[1,[0,0,50],[1,0,0,0],0,0,0]];\n PROC main()\n  MoveJ \
         [{},[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t;\n ENDPROC\nENDMODULE\n",
        frame_text(tool),
        frame_text(&target),
    );
    let program = Program::Rapid(Task::read(&[("p.mod", source.as_bytes())]));
    let arm = estimated(perturbed(3, 1.0), &[Joints::zeros()]);
    let plan = compensate(&program, &arm, &Cell::default(), &Options::default(), None).unwrap().plan;
    assert!(plan.outcomes[0].status.is_written(), "{source}{:?}", plan.outcomes[0].reason());
    plan
}

#[test]
fn a_tool_frame_stated_the_other_way_round_is_a_warning() {
    let of = |tip: [f64; 3], turn: [f64; 3]| Pose::new(Vector3::from(tip), Vector3::from(turn));
    // Tools as they are: straight, bent so that the tip lies on their own z axis, beside the flange and a little behind it, none at all.
    let turned =
        Pose::new(Vector3::zeros(), Vector3::new(0.0, 0.8, 0.0)) * Pose::translation(0.0, 0.0, 120.0);
    for tool in [of([0.0, 0.0, 120.0], [0.0; 3]), turned, of([70.0, 0.0, -20.0], [0.0; 3]), Pose::identity()]
    {
        let plan = plan_with(&tool);
        assert!(!plan.has_tip_in_wrist, "{tool}: {:?}", plan.notes);
    }
    for tool in [of([0.0, 0.0, 120.0], [0.0; 3]), turned] {
        let plan = plan_with(&tool.inverse());
        assert!(plan.has_tip_in_wrist, "{tool}");
        let told = plan
            .notes
            .iter()
            .filter(|note| note.contains("tool t: its tip") && note.contains("120 mm behind the flange"));
        assert_eq!(told.count(), 1, "{:?}", plan.notes);
    }
}
