//! The modal state of motions: switches and data that other paths, other routines or the controller may change.

use truegrind_programs::motion::{Reason, TargetValue};
use truegrind_programs::rapid::Task;

pub(super) const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";
pub(super) const GO: &str = "MoveL p,v100,fine,tool0;\n";
pub(super) const SET: &str = "PDispSet [[0,0,10],[1,0,0,0]];\n";
pub(super) const LEFT: Option<Reason> = Some(Reason::Displacement);

/// A module with a target `p`, some numbers, and these routines.
pub(super) fn module(routines: &str) -> String {
    format!(
        "MODULE M\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nVAR num n;\nVAR num m:=1;\n\
         VAR intnum i;\n{routines}\nENDMODULE\n"
    )
}

/// Each motion of a module with these routines: its routine and why it is left.
pub(super) fn left(routines: &str) -> Vec<(String, Option<Reason>)> {
    let source = module(routines);
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let routine = |index: Option<u32>| task.listing.routines[index.unwrap() as usize].name.clone();
    task.listing.motions.iter().map(|motion| (routine(motion.routine), motion.reason())).collect()
}

/// Why the motions of one routine are left.
pub(super) fn of(name: &str, routines: &str) -> Vec<Option<Reason>> {
    left(routines).into_iter().filter(|(routine, _)| routine == name).map(|(_, reason)| reason).collect()
}

/// Whether each motion of main has a known motion before it.
pub(super) fn follows(body: &str) -> Vec<bool> {
    let source = module(&format!("PROC main()\n{body}\nENDPROC"));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    task.listing.motions.iter().map(|motion| motion.previous.is_some()).collect()
}

/// The heights of the motions of main above 300 mm, or why they are unknown.
pub(super) fn heights(body: &str, more: &str) -> Vec<Result<f64, Reason>> {
    let source = module(&format!("{more}\nPROC main()\n{body}\nENDPROC"));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let main = task.listing.routines.iter().position(|routine| routine.name == "main").unwrap() as u32;
    let motions = task.listing.motions.iter().filter(|motion| motion.routine == Some(main));
    motions
        .map(|motion| match motion.to().unwrap().value {
            Ok(TargetValue::Cartesian(target)) => Ok(target.position_mm[2] - 300.0),
            Ok(TargetValue::Joint(_)) => panic!("{source}"),
            Err(reason) => Err(reason),
        })
        .collect()
}

#[test]
fn what_a_computed_name_may_call_begins_with_the_switches_as_they_stand_there() {
    let one = |call: &str| {
        let main = format!("PROC main()\nproc1;\n{SET}{call}\nPDispOff;\nENDPROC\n");
        of("proc1", &format!("{main}PROC proc1()\n{GO}ENDPROC\nPROC other()\n{GO}ENDPROC"))
    };
    for call in [
        "%\"proc\"+ValToStr(1)%;",
        "%\"proc1\"%;",
        "%\"PROC1\"%;",
        "%\"M:proc1\"%;",
        "%name%;",
        "CallByVar \"proc\",1;",
        "CallByVar name,n;",
        "%name% 5;",
        "elsewhere;",
    ] {
        assert_eq!(one(call), [LEFT], "{call}");
    }
    // Not by a name that begins otherwise, where it means a routine that is known.
    for call in ["%\"oth\"+ValToStr(1)%;", "%\"other\"%;", "CallByVar \"oth\",1;", "TPWrite \"x\";"] {
        assert_eq!(one(call), [None], "{call}");
    }
    // Every switch, not the displacement alone.
    let switched = |on: &str, off: &str| {
        let main = format!("PROC main()\nproc1;\n{on}\n%\"proc\"+x%;\n{off}\nENDPROC\n");
        of("proc1", &format!("{main}PROC proc1()\n{GO}ENDPROC"))
    };
    assert_eq!(switched("EOffsSet [1,0,0,0,0,0];", "EOffsOff;"), [LEFT]);
    assert_eq!(switched("SyncMoveOn s,t;", "SyncMoveOff s;"), [Some(Reason::Synchronised)]);
    assert_eq!(switched("SoftAct 1,50;", "SoftDeact;"), [Some(Reason::SensorGuided)]);
    assert_eq!(switched("ConfL\\Off;", "ConfL\\On;"), [None]);
    // And what it may call may leave them set.
    let after = |call: &str| {
        of("main", &format!("PROC main()\n{GO}{call}\n{GO}PDispOff;\nENDPROC\nPROC proc1()\n{SET}ENDPROC"))
    };
    assert_eq!(after("%\"proc\"+x%;"), [None, LEFT]);
    assert_eq!(after("CallByVar \"proc\",n;"), [None, LEFT]);
    assert_eq!(after("%\"other\"+x%;"), [None, None]);
}

#[test]
fn the_next_cycle_begins_as_this_one_ends() {
    let main = |end: &str| of("main", &format!("PROC main()\n{GO}{SET}{GO}{end}\nENDPROC"));
    assert_eq!(main("PDispOff;"), [None, None]);
    assert_eq!(main(""), [LEFT, None]);
    assert_eq!(main("RETURN;\nPDispOff;"), [LEFT, None]);
    assert_eq!(main("IF di1=1 ExitCycle;\nPDispOff;"), [LEFT, None]);
    assert_eq!(main("PDispOff;\nIF di1=1 ExitCycle;"), [None, None]);
    // From a routine that is called, from a trap routine, and through what UNDO sets.
    let called =
        format!("PROC main()\n{GO}{SET}leave;\nPDispOff;\nENDPROC\nPROC leave()\nExitCycle;\nENDPROC");
    assert_eq!(of("main", &called), [LEFT]);
    let trap = format!("PROC main()\n{GO}{SET}WaitTime 1;\nPDispOff;\nENDPROC\nTRAP t\nExitCycle;\nENDTRAP");
    assert_eq!(of("main", &trap), [LEFT]);
    let undo = format!("PROC main()\n{GO}leave;\nENDPROC\nPROC leave()\nExitCycle;\nUNDO\n{SET}ENDPROC");
    assert_eq!(of("main", &undo), [LEFT]);
    // Nothing follows it.
    assert_eq!(main("IF n=1 THEN\nPDispOff;\nExitCycle;\nENDIF\nPDispOff;"), [None, None]);
    // A variable of main may be as it was; without ExitCycle it has its initial value.
    let local = |end: &str| {
        heights(&format!("VAR num k:=1;\nMoveL Offs(p,0,0,k),v100,fine,tool0;\nk:=2;\n{end}"), "")
    };
    assert_eq!(local(""), [Ok(1.0)]);
    assert_eq!(local("IF n=1 ExitCycle;"), [Err(Reason::RunTimeOffset)]);
}

#[test]
fn functions_set_switches_like_procedures() {
    let sets = format!("FUNC num sets()\n{SET}RETURN 1;\nENDFUNC");
    for statement in
        ["n:=sets();", "IF sets()=1 n:=1;", "TPWrite \"x\"\\Num:=sets();", "WHILE sets()=2 DO\nENDWHILE"]
    {
        let main = format!("PROC main()\n{GO}{statement}\n{GO}PDispOff;\nENDPROC\n");
        assert_eq!(of("main", &format!("{main}{sets}")), [None, LEFT], "{statement}");
    }
    let moves = format!("FUNC num moves()\n{GO}RETURN 1;\nENDFUNC");
    let main = format!("PROC main()\nn:=moves();\n{SET}n:=moves();\nPDispOff;\nENDPROC\n");
    assert_eq!(of("moves", &format!("{main}{moves}")), [LEFT]);
}

#[test]
fn a_routine_that_nothing_calls_begins_as_others_end() {
    let weld = format!("PROC weld()\n{GO}ENDPROC\n");
    let search = |end: &str| format!("PROC search()\n{GO}{SET}{GO}{end}\nENDPROC\n");
    assert_eq!(of("weld", &format!("{weld}{}", search("PDispOff;"))), [None]);
    assert_eq!(of("search", &format!("{weld}{}", search("PDispOff;"))), [None, None]);
    assert_eq!(of("weld", &format!("{weld}{}", search(""))), [LEFT]);
    // Called from outside too, where main is in none of the files.
    let calls = "PROC calls()\nweld;\nENDPROC\n";
    assert_eq!(of("weld", &format!("{weld}{calls}{}", search(""))), [LEFT]);
    assert_eq!(of("weld", &format!("LOCAL {weld}{calls}{}", search(""))), [LEFT]);
    let main = "PROC main()\nweld;\nsearch;\nPDispOff;\nENDPROC\n";
    assert_eq!(of("weld", &format!("{weld}{main}{}", search(""))), [None]);
}

#[test]
fn routines_that_call_themselves_change_no_more_than_they_say() {
    let main = format!("PROC main()\n{GO}a 3;\n{GO}ENDPROC\n");
    let own = format!("{main}PROC a(num k)\nIF k>0 a k-1;\n{GO}ENDPROC");
    assert_eq!(left(&own), ["main", "main", "a"].map(|name| (name.to_owned(), None)));
    let others = format!("{main}PROC a(num k)\nIF k>0 b k-1;\n{GO}ENDPROC\nPROC b(num k)\na k;\n{GO}ENDPROC");
    assert_eq!(left(&others), ["main", "main", "a", "b"].map(|name| (name.to_owned(), None)));
    let sets = format!("{main}PROC a(num k)\nIF k>0 a k-1;\n{SET}ENDPROC");
    assert_eq!(of("main", &sets), [LEFT, LEFT]);
    // Round about, and called by nothing.
    let alone = format!("PROC a()\nb;\n{GO}ENDPROC\nPROC b()\na;\n{GO}ENDPROC");
    assert_eq!(left(&alone), ["a", "b"].map(|name| (name.to_owned(), None)));
    // Longer chains than are followed.
    let chain: String = (0..40).map(|k| format!("PROC c{k}()\nc{};\n{GO}ENDPROC\n", k + 1)).collect();
    let found = left(&format!("PROC main()\nc0;\n{GO}ENDPROC\n{chain}PROC c40()\n{GO}ENDPROC"));
    assert!(found.len() == 42 && found.iter().all(|(_, reason)| reason.is_none()), "{found:?}");
}

#[test]
fn after_what_moves_the_robot_elsewhere_no_motion_is_known_to_end_where_the_next_begins() {
    let after = |statement: &str| *follows(&format!("{GO}{statement}\n{GO}")).last().unwrap();
    for statement in
        ["WaitTime 1;", "StopMove;\nStartMove;", "GripLoad load0;", "STClose gun1,1000,3;", "ConfL\\Off;"]
    {
        assert!(after(statement), "{statement}");
    }
    for statement in [
        "EGMRunPose id,EGM_STOP_HOLD\\x;",
        "EGMRunJoint id,EGM_STOP_HOLD\\J1;",
        "FCRefStart;\nFCRefStop;",
        "FCAct tool0;\nFCDeact;",
        "LoadId TOOL_LOAD_ID,MASS_WITH_AX3,tool0;",
        "SetLeadThrough\\On;",
        "StopMove;\nClearPath;\nStartMove;",
        "StorePath;\nRestoPath;",
        "StepBwdPath 30,1;",
        "PathRecMoveBwd;",
        "IndAMove Station_A,2\\ToAbsNum:=3,20;",
        "ArcRepL\\Start,layer,v100,seam1,weld1,weave1,z10,tool0;",
        "ContactL p,v100,tool0;",
        "SearchL di1,q,p,v100,tool0;",
        "CSSAct CSS_X;\nCSSDeact;",
        "unknown;",
    ] {
        assert!(!after(statement), "{statement}");
    }
    let listed = |statement: &str| of("main", &format!("PROC main()\n{statement}\nENDPROC"));
    assert_eq!(listed("EGMRunPose id,EGM_STOP_HOLD\\x;"), [Some(Reason::SensorGuided)]);
    assert_eq!(listed("StepBwdPath 30,1;"), [Some(Reason::NoTarget)]);
    assert_eq!(listed("IndCMove Station_A,2,20;"), [Some(Reason::NoTarget)]);
    assert_eq!(listed("ClearPath;"), []);
    // A motion of its own.
    assert_eq!(listed("CSSDeactMoveL p,v10,tool0;"), [None]);
    // Corrections reach the motions with \Corr alone.
    let corrected = listed("CorrCon c;\nMoveL p,v10,fine,tool0;\nMoveL p,v10,fine,tool0\\Corr;");
    assert_eq!(corrected, [None, Some(Reason::SensorGuided)]);
    let soft =
        listed("CSSAct CSS_X;\nMoveL p,v10,fine,tool0;\nCSSDeactMoveL p,v10,tool0;\nMoveL p,v10,fine,tool0;");
    assert_eq!(soft, [Some(Reason::SensorGuided), Some(Reason::SensorGuided), None]);
}

#[test]
fn targets_of_every_form_are_seen_where_an_instruction_is_not_known() {
    let data = "CONST robtarget table{2,2}:=[[p,p],[p,p]];\nRECORD part\nrobtarget at;\nnum k;\nENDRECORD\nVAR part a;\n\
         VAR part many{3};\nALIAS robtarget place;\nVAR place elsewhere;\nVAR jointtarget j;\nVAR pose frame;\n\
         FUNC robtarget own(num k)\nRETURN p;\nENDFUNC\nFUNC num size(robtarget t)\nRETURN 1;\nENDFUNC";
    let listed = |argument: &str| {
        of("main", &format!("{data}\nPROC main()\nGlide {argument},v100,tool0;\nENDPROC")).first().copied()
    };
    for argument in [
        "table{1,2}",
        "a.at",
        "many{n}.at",
        "elsewhere",
        "j",
        "own(1)",
        "(p)",
        "((p))",
        "CRobT()",
        "CJointT()",
        "ORobT(p)",
        "MirPos(p,w)",
        "CalcRobT(j,tool0)",
        "Offs(p,0,0,n)",
        "[p.trans,p.rot,p.robconf,p.extax]",
        "[[1,2,n],p.rot,[0,0,0,0],p.extax]",
        "[[0,0,0,0,n,0],j.extax]",
        "\\At:=a.at",
    ] {
        assert_eq!(listed(argument), Some(Some(Reason::UnknownInstruction)), "{argument}");
    }
    for argument in
        ["table", "a", "many", "a.k", "p.trans", "frame", "size(p)", "[1,2]", "[[0,0,0],[1,0,0,0]]", "n"]
    {
        assert_eq!(listed(argument), None, "{argument}");
    }
}

#[test]
fn a_displacement_between_two_programmed_points_is_told() {
    let source = module(&format!(
        "CONST robtarget there:=[[510,20,330],[0.70710678118654752,0,0,0.70710678118654752],[0,0,0,0],{EXT}];\n\
         PROC main()\nPDispOn\\ExeP:=there,p,tool0;\n{GO}PDispOn\\Rot\\ExeP:=there,p,tool0;\n{GO}\
         MoveL Offs(p,7,0,0),v100,fine,tool0;\nPDispOn\\Rot\\ExeP:=CRobT(),p,tool0;\n{GO}PDispOff;\nENDPROC"
    ));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let listing = &task.listing;
    let found: Vec<_> = listing
        .motions
        .iter()
        .map(|motion| {
            motion.reason().map_or_else(
                || {
                    let object = listing.work_object(motion).unwrap().value.clone().unwrap();
                    let told = motion.to().unwrap().value.unwrap().cartesian().unwrap().pose();
                    let pose = object.user_frame.pose() * object.object_frame.pose() * told;
                    let turn = pose.rotation.angle().to_degrees();
                    Ok((pose.translation.vector.map(|x| x.round()).into(), turn.round()))
                },
                Err,
            )
        })
        .collect();
    // Without Rot the points alone; with it what carries the one point into the other.
    let wanted = [
        Ok(([510.0, 20.0, 330.0], 0.0)),
        Ok(([510.0, 20.0, 330.0], 90.0)),
        Ok(([510.0, 27.0, 330.0], 90.0)),
        Err(Reason::Displacement),
    ];
    assert_eq!(found, wanted);
}

#[test]
fn nothing_is_put_before_what_hangs_on_its_own_path() {
    let insertable = |statement: &str| {
        let source = module(&format!("PROC main()\n{GO}{statement}\nENDPROC"));
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
        task.listing.motions.last().unwrap().insertable
    };
    for statement in [
        "TriggL p,v100,t1\\T2:=t2,fine,tool0;",
        "TriggJ p,v100,t1,fine,tool0;",
        "TriggLIOs p,v100\\TriggData1:=tio,fine,tool0;",
        "STriggL p,v100,t1,fine,tool0;",
        "CapL p,v100,cd1,weave1,fine,tool0;",
        "DispL\\On,p,v100,bead1,fine,tool0;",
        "DispL\\Off,p,v100,bead1,fine,tool0;",
        "ArcL\\On,p,v100,seam1,weld1,weave1,fine,tool0;",
        "MoveL\\Conc,p,v100,fine,tool0;",
        "MoveL p,v100\\T:=3,fine,tool0;",
        "IF n=1 MoveL p,v100,fine,tool0;",
    ] {
        assert!(!insertable(statement), "{statement}");
    }
    for statement in [
        "MoveL p,v100,fine,tool0;",
        "DispL p,v100,bead1,fine,tool0;",
        "ArcL p,v100,seam1,weld1,fine,tool0;",
        "FCPressL p,v20,20,z1,tool0;",
        "PaintL p,v100,z1,tool0;",
        "MoveLDO p,v100,fine,tool0,do1,1;",
    ] {
        assert!(insertable(statement), "{statement}");
    }
}

#[test]
fn alternatives_are_optional_so_what_stands_behind_them_comes_by_its_place() {
    let run = |parameters: &str, call: &str| {
        let source = module(&format!(
            "VAR robtarget v:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nPROC main()\n{call}\nMoveL v,v100,fine,tool0;\nENDPROC\n\
             PROC here({parameters})\nq:=CRobT();\nENDPROC"
        ));
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
        task.listing.motions.last().unwrap().reason()
    };
    for parameters in [
        "\\switch up|switch down,INOUT robtarget q",
        "\\switch up | switch down | num by, VAR robtarget q",
        "\\switch up|\\switch down\\num n,INOUT robtarget q",
        "\\num n|num m INOUT robtarget q",
        "INOUT robtarget q\\switch up|switch down",
    ] {
        for call in ["here v;", "here\\up,v;", "here q:=v;"] {
            if parameters.contains("m INOUT") && call != "here q:=v;" {
                // Without a comma this is one parameter of three names, which is not read.
                continue;
            }
            assert_eq!(run(parameters, call), Some(Reason::Assigned), "{parameters}: {call}");
        }
    }
    // And a target that such a routine takes is seen.
    let taken = |parameters: &str| {
        left(&format!("PROC main()\nmv p;\nmv\\a,p;\nENDPROC\nPROC mv({parameters})\nENDPROC"))
    };
    let both = vec![("main".to_owned(), Some(Reason::OwnRoutine)); 2];
    assert_eq!(taken("\\switch a|switch b,robtarget q"), both);
    assert_eq!(taken("\\switch a,robtarget q"), both);
}

#[test]
fn an_axis_that_does_not_follow_the_targets_leaves_them() {
    let apart = Some(Reason::IndependentAxis);
    let main = |body: &str| of("main", &format!("PROC main()\n{body}ENDPROC"));
    assert_eq!(main(&format!("SingArea\\LockAxis4;\n{GO}SingArea\\Wrist;\n{GO}")), [apart, None]);
    assert_eq!(main(&format!("SingArea\\LockAxis4;\n{GO}SingArea\\Off;\n{GO}")), [apart, None]);
    let moves = main(&format!("{GO}IndCMove ROB_1,6,-100;\n{GO}IndReset ROB_1,6\\RefNum:=0\\Short;\n{GO}"));
    assert_eq!(moves.first(), Some(&None));
    assert_eq!(moves[moves.len() - 2..], [apart, None]);
    // A positioner's axis is no axis of the robot.
    assert_eq!(main(&format!("IndCMove STN_1,1,-100;\n{GO}")).last(), Some(&None));
    // Where it may be so, too, and in routines that are called there.
    let maybe = main(&format!("IF n=1 SingArea\\LockAxis4;\n{GO}"));
    assert_eq!(maybe, [apart]);
    let called = format!(
        "PROC main()\nIndAMove ROB_1,6\\ToAbsNum:=90,20;\ngo;\nIndReset ROB_1,6;\nENDPROC\nPROC go()\n{GO}ENDPROC"
    );
    assert_eq!(of("go", &called), [apart]);
}

#[test]
fn a_circle_with_triggers_along_it_is_not_cut() {
    let source = module(
        "PROC main()\nMoveC p,p,v100,fine,tool0;\nTriggC p,p,v100,i,fine,tool0;\nMoveCDO p,p,v100,fine,tool0,d,1;\nENDPROC",
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let cut: Vec<bool> = task.listing.motions.iter().map(|motion| motion.can_straighten).collect();
    assert_eq!(cut, [true, false, true]);
}

pub(super) const OFFS: &str = "MoveL Offs(p,0,0,m),v100,fine,tool0;\n";
pub(super) const RUN_TIME: Option<Reason> = Some(Reason::RunTimeOffset);

#[test]
fn a_routine_that_is_named_like_an_instruction_is_followed() {
    for name in ["PDispOff", "ConfL", "SoftDeact", "IndReset"] {
        let own = format!("PROC {name}()\n{SET}ENDPROC\nPROC main()\n{name};\n{GO}ENDPROC");
        assert_eq!(of("main", &own), [LEFT], "{name}");
    }
}

#[test]
fn nothing_is_put_before_what_asks_a_function_of_the_program() {
    let speed = "FUNC speeddata sp()\nIncr n;\nRETURN v100;\nENDFUNC\n";
    let source = module(&format!(
        "{speed}PROC main()\n{GO}MoveL p,sp(),fine,tool0;\nMoveL p,v100\\V:=Abs(5),fine,tool0;\nMoveL p,v100\\V:=who(5),fine,tool0;\nENDPROC"
    ));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let may: Vec<bool> = task.listing.motions.iter().map(|motion| motion.insertable).collect();
    assert_eq!(may, [true, false, true, false]);
}

#[test]
fn of_procedures_with_one_name_any_may_be_the_one_that_is_called() {
    let a = format!(
        "MODULE A\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nVAR num m:=3;\nPROC main()\nm:=1;\ninit;\n{OFFS}{GO}ENDPROC\nENDMODULE\n"
    );
    let b = "MODULE B\nPROC init()\nENDPROC\nENDMODULE\n".to_owned();
    let c = format!(
        "MODULE C\nVAR num k;\nPROC init()\nm:=40;\n{SET}ENDPROC\nPROC other()\nk:=1;\ninit;\nENDPROC\nENDMODULE\n"
    );
    let of = |files: &[&str]| {
        let files: Vec<(&str, &[u8])> = files.iter().map(|text| ("m.mod", text.as_bytes())).collect();
        let task = Task::read(&files);
        task.listing.motions.iter().map(|motion| motion.reason()).collect::<Vec<_>>()
    };
    assert_eq!(of(&[&a, &b]), [None, None]);
    assert_eq!(of(&[&a, &b, &c]), [LEFT, LEFT]);
    assert_eq!(of(&[&a, &c, &b]), [LEFT, LEFT]);
    // A module calls its own first.
    let own = a.replace("ENDMODULE", "PROC init()\nENDPROC\nENDMODULE");
    assert_eq!(of(&[&own, &c]), [None, None]);
}
