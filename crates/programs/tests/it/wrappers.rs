//! Routines whose only statement is a motion on their parameters: their calls are the motions.

use truegrind_programs::motion::{Listing, MotionKind, Origin, Reason, TargetValue};
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::{Change, NewTarget, RewriteOptions, RewriteOutcome};

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

/// A module with two targets, a tool, a work object, a routine `mv` and these statements of main.
fn module(mv: &str, calls: &str) -> String {
    let frame = "[[1,2,3],[1,0,0,0]]";
    format!(
        "MODULE M\nCONST robtarget p10:=[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}];\n\
         CONST robtarget p20:=[[510,0,300],[0,0,1,0],[0,0,0,0],{EXT}];\n\
         CONST jointtarget j10:=[[0,10,20,30,40,50],{EXT}];\nVAR num n;\n\
         PERS tooldata t1:=[TRUE,{frame},[1,[0,0,1],[1,0,0,0],0,0,0]];\n\
         PERS tooldata t2:=[TRUE,{frame},[2,[0,0,1],[1,0,0,0],0,0,0]];\n\
         PERS wobjdata w1:=[FALSE,TRUE,\"\",{frame},{frame}];\nPROC main()\n{calls}ENDPROC\n{mv}ENDMODULE\n"
    )
}

fn listing(source: &str) -> Listing {
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    task.listing
}

/// Each motion: its instruction, height of its end, tool and work object, or why it is left.
fn motions(mv: &str, calls: &str) -> Vec<Result<String, Reason>> {
    let listing = listing(&module(mv, calls));
    let told = |motion: &truegrind_programs::motion::Motion| {
        let end = match motion.to().unwrap().value.unwrap() {
            TargetValue::Cartesian(target) => target.position_mm[0],
            TargetValue::Joint(target) => target.robot_deg[1],
        };
        let tool = &listing.tool(motion).unwrap().name;
        let object = listing.work_object(motion).map_or("–", |object| &object.name);
        let speed = listing.speed(motion).unwrap().value.as_ref().unwrap().tcp_mm_s;
        let fine = listing.zone(motion).unwrap().value.as_ref().unwrap().fine;
        format!("{} {:?} {end} {tool} {object} {speed} {fine}", motion.instruction, motion.kind)
    };
    listing.motions.iter().map(|motion| motion.reason().map_or_else(|| Ok(told(motion)), Err)).collect()
}

const MV: &str = "PROC mv(robtarget p,speeddata v,zonedata z,PERS tooldata t,PERS wobjdata w)\n\
                  MoveL p,v,z,t\\WObj:=w;\nENDPROC\n";

#[test]
fn a_call_of_a_routine_that_only_moves_is_the_motion() {
    let first = || Ok("mv Linear 500 t1 w1 50 true".to_owned());
    assert_eq!(motions(MV, "mv p10,v50,fine,t1,w1;\n"), [first()]);
    let all = "mv p10,v50,fine,t1,w1;\nMV p20,v100,z1,t2,wobj0;\nmv Offs(p10,3,0,0),v100,z1,t2,wobj0;\n";
    assert_eq!(
        motions(MV, all),
        [
            first(),
            Ok("MV Linear 510 t2 wobj0 100 false".to_owned()),
            Ok("mv Linear 503 t2 wobj0 100 false".to_owned())
        ]
    );
    let listing = listing(&module(MV, all));
    assert_eq!(
        listing.motions.iter().map(|motion| motion.previous).collect::<Vec<_>>(),
        [None, Some(0), Some(1)]
    );
    assert!(matches!(listing.motions[0].targets[0].origin, Origin::Declared(_)));
    assert!(listing.motions.iter().all(|motion| !motion.insertable && motion.kind == MotionKind::Linear));
    // By name, in any order.
    assert_eq!(motions(MV, "mv z:=fine,p:=p10,t:=t1,w:=w1,v:=v50;\n"), [first()]);
}

#[test]
fn what_the_routine_states_itself_is_used_and_what_a_call_leaves_out_is_left_out() {
    let mv = "PROC mv(robtarget p\\PERS wobjdata w\\num up\\switch quick)\nMoveJ p,v50,fine,t1\\WObj?w;\nENDPROC\n";
    assert_eq!(
        motions(mv, "mv p10;\nmv p20\\w:=w1;\nmv p10\\quick;\n"),
        [
            Ok("mv Joint 500 t1 wobj0 50 true".to_owned()),
            Ok("mv Joint 510 t1 w1 50 true".to_owned()),
            Ok("mv Joint 500 t1 wobj0 50 true".to_owned())
        ]
    );
    let absolute = "PROC mv(jointtarget p,PERS tooldata t)\nMoveAbsJ p\\NoEOffs,v50,fine,t;\nENDPROC\n";
    assert_eq!(motions(absolute, "mv j10,t2;\n"), [Ok("mv AbsoluteJoint 10 t2 wobj0 50 true".to_owned())]);
    let circle = "PROC mv(robtarget a,robtarget b)\nMoveC a,b,v50,fine,t1;\nENDPROC\n";
    assert_eq!(
        motions(circle, "MoveL p10,v50,fine,t1;\nmv Offs(p10,5,5,0),p20;\n")[1..],
        [Ok("mv Circular 510 t1 wobj0 50 true".to_owned())]
    );
    // A routine that calls such a routine is one itself.
    let twice = format!("PROC go(robtarget q\\PERS wobjdata w)\nmv q,v50,fine,t2,w1;\nENDPROC\n{MV}");
    assert_eq!(motions(&twice, "go p20;\n"), [Ok("go Linear 510 t2 w1 50 true".to_owned())]);
}

#[test]
fn what_does_more_than_one_motion_on_its_parameters_is_no_such_routine() {
    let head = "PROC mv(robtarget p,speeddata v,zonedata z,PERS tooldata t,PERS wobjdata w)\n";
    let call = "mv p10,v50,fine,t1,w1;\n";
    for body in [
        "MoveL p,v,z,t\\WObj:=w;\nMoveL p,v,z,t\\WObj:=w;\nENDPROC\n",
        "MoveL Offs(p,0,0,9),v,z,t\\WObj:=w;\nENDPROC\n",
        "IF n=1 THEN\nMoveL p,v,z,t\\WObj:=w;\nENDIF\nENDPROC\n",
        "n:=1;\nMoveL p,v,z,t\\WObj:=w;\nENDPROC\n",
        "MoveL p,v,z,t\\WObj:=w;\nERROR\nRETRY;\nENDPROC\n",
        "MoveC p,p,v,z,t\\WObj:=w;\nENDPROC\n",
        "MoveLSync p,v,z,t,\"other\"\\WObj:=w;\nENDPROC\n",
        "SearchL di1,p,p,v,t\\WObj:=w;\nENDPROC\n",
    ] {
        let found = motions(&format!("{head}{body}"), call);
        assert_eq!(found[0], Err(Reason::OwnRoutine), "{body}");
        assert!(found.len() > 1 && found[1..].iter().all(Result::is_err), "{body}");
    }
    // A literal cannot be handed over by reference, nor an optional target for none.
    for head in ["INOUT robtarget p", "VAR robtarget p", "PERS robtarget p", "\\robtarget p"] {
        let mv = format!("PROC mv({head},num k)\nMoveL p,v50,fine,t1;\nENDPROC\n");
        assert!(motions(&mv, "mv p10,1;\n").iter().all(Result::is_err), "{head}");
    }
}

#[test]
fn the_motion_of_the_routine_is_listed_where_something_else_may_run_it() {
    let mv = "PROC mv(robtarget p,num k)\nMoveL p,v50,fine,t1\\WObj:=w1;\nENDPROC\n";
    let here = Ok("mv Linear 500 t1 w1 50 true".to_owned());
    assert_eq!(motions(mv, "mv p10,1;\n"), std::slice::from_ref(&here));
    // A name computed at run time, a call that does not fit.
    for other in ["%\"mv\"% p10,1;\n", "mv p10;\n"] {
        let found = motions(mv, &format!("mv p10,1;\n{other}"));
        assert_eq!(found.first(), Some(&here), "{other}");
        assert_eq!(found.last(), Some(&Err(Reason::Parameter)), "{other}");
    }
    let call = "mv p10,v50,fine,t1,w1;\n";
    // A part of a program: the rest may call it.
    let part = module(MV, call).replace("PROC main", "PROC part");
    let listed = listing(&part);
    assert_eq!(
        listed.motions.iter().map(|motion| motion.reason()).collect::<Vec<_>>(),
        [None, Some(Reason::ToolParameter)]
    );
    assert_eq!(listing(&part.replace("PROC mv", "LOCAL PROC mv")).motions.len(), 1);
}

#[test]
fn the_state_at_the_call_is_that_of_the_motion() {
    let found = motions(MV, "PDispSet [[0,0,10],[1,0,0,0]];\nmv p10,v50,fine,t1,w1;\nPDispOff;\n");
    assert_eq!(found, [Ok("mv Linear 500 t1 w1 50 true".to_owned())]);
    let unknown = motions(MV, "PDispAdd di1;\nmv p10,v50,fine,t1,w1;\n");
    assert!(unknown.iter().all(Result::is_err));
    // Data that the program assigns.
    let assigned = motions(MV, "t1.tframe.trans.z:=50;\nmv p10,v50,fine,t1,w1;\n");
    assert_eq!(assigned, [Ok("mv Linear 500 t1 w1 50 true".to_owned())]);
    let unread = motions(MV, "t1.tframe.trans.z:=AInput(ai1);\nmv p10,v50,fine,t1,w1;\n");
    assert_eq!(unread, [Err(Reason::ToolUnknown)]);
    // An argument that does something is evaluated as often as before.
    let effect = format!("{MV}FUNC robtarget f()\nn:=n+1;\nRETURN p10;\nENDFUNC\n");
    assert!(motions(&effect, "mv f(),v50,fine,t1,w1;\n").iter().all(Result::is_err));
}

#[test]
fn the_arguments_of_calls_are_rewritten() {
    let calls = format!(
        "mv p10,v50,fine,t1,w1;\nmv p20,v50,fine,t1,w1;\nMoveL p20,v50,fine,t1\\WObj:=w1;\n\
         mv [[520,0,300],[0,0,1,0],[0,0,0,0],{EXT}],v50,fine,t1,w1;\nmv Offs(p10,1,0,0),v50,fine,t1,w1;\n"
    );
    let source = module(MV, &calls);
    let at = |x: f64| NewTarget::Cartesian {
        position_mm: [x, 0.0, 300.0],
        quaternion: [0.0, 0.0, 1.0, 0.0],
        conf: None,
    };
    let change = |motion: u32, x: f64| Change { motion, targets: [at(x)].into(), before: vec![] };
    let changes = [change(0, 500.5), change(1, 510.5), change(3, 520.5), change(4, 501.5)];
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
    let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
    assert_eq!(rewritten.outcomes[0], RewriteOutcome::InPlace);
    assert_eq!(rewritten.outcomes[1], RewriteOutcome::Split("p20_2".to_owned()));
    let wanted = source
        .replace("p10:=[[500,", "p10:=[[500.5000,")
        .replace("[[520,", "[[520.5000,")
        .replace("mv p20,", "mv p20_2,");
    for line in wanted.lines().filter(|line| !line.contains("Offs")) {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert!(text.contains("CONST robtarget p20_2:=[[510.5000,"), "{text}");
    assert!(text.contains("mv [[501.5000,"), "{text}");
    // Only targets differ, and what is read back is what was wanted.
    let back = Task::read(&[("m.mod", text.as_bytes())]);
    assert!(back.text_differences(&task).unwrap().is_empty());
    let joints = NewTarget::Joint { robot_deg: [0.0; 6] };
    let refused = Change { motion: 0, targets: [joints].into(), before: vec![] };
    let refused = task.rewrite(&[refused], &RewriteOptions::default()).unwrap();
    assert_eq!(refused.outcomes, [RewriteOutcome::Refused(Reason::NoJointForm)]);
}
