//! The modal state of motions: switches and data that other paths, other routines or the controller may change.

use truegrind_programs::motion::{Reason, TargetValue};
use truegrind_programs::rapid::Task;

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";
const GO: &str = "MoveL p,v100,fine,tool0;\n";
const SET: &str = "PDispSet [[0,0,10],[1,0,0,0]];\n";
const LEFT: Option<Reason> = Some(Reason::Displacement);

/// A module with a target `p`, some numbers, and these routines.
fn module(routines: &str) -> String {
    format!(
        "MODULE M\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nVAR num n;\nVAR num m:=1;\n\
         VAR intnum i;\n{routines}\nENDMODULE\n"
    )
}

/// Each motion of a module with these routines: its routine and why it is left.
fn left(routines: &str) -> Vec<(String, Option<Reason>)> {
    let source = module(routines);
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let routine = |index: Option<u32>| task.listing.routines[index.unwrap() as usize].name.clone();
    task.listing.motions.iter().map(|motion| (routine(motion.routine), motion.reason())).collect()
}

/// Why the motions of one routine are left.
fn of(name: &str, routines: &str) -> Vec<Option<Reason>> {
    left(routines).into_iter().filter(|(routine, _)| routine == name).map(|(_, reason)| reason).collect()
}

/// Whether each motion of main has a known motion before it.
fn follows(body: &str) -> Vec<bool> {
    let source = module(&format!("PROC main()\n{body}\nENDPROC"));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    task.listing.motions.iter().map(|motion| motion.previous.is_some()).collect()
}

/// The heights of the motions of main above 300 mm, or why they are unknown.
fn heights(body: &str, more: &str) -> Vec<Result<f64, Reason>> {
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
fn a_trap_routine_may_set_a_switch_before_any_statement() {
    let main = format!("PROC main()\n{GO}{GO}ENDPROC\n");
    assert_eq!(of("main", &format!("{main}TRAP t\n{SET}ENDTRAP")), [LEFT, LEFT]);
    assert_eq!(of("main", &format!("{main}TRAP t\nsets;\nENDTRAP\nPROC sets()\n{SET}ENDPROC")), [LEFT, LEFT]);
    // One that ends as it begins does not; one that ends a displacement does where there is one.
    let passes = format!("TRAP t\n{GO}ENDTRAP\n");
    assert_eq!(of("main", &format!("{main}{passes}")), [None, None]);
    let ends = "TRAP t\nPDispOff;\nENDTRAP\n";
    assert_eq!(of("main", &format!("{main}{ends}")), [None, None]);
    assert_eq!(of("main", &format!("PROC main()\n{SET}{GO}PDispOff;\n{GO}ENDPROC\n{ends}")), [LEFT, None]);
    // It begins in any state; as does a procedure that is called while the robot moves.
    let displaced = format!("PROC main()\n{SET}WaitTime 1;\nPDispOff;\nENDPROC\n");
    assert_eq!(of("t", &format!("{displaced}{passes}")), [LEFT]);
    let sync = "MoveLSync p,v100,z10,tool0,\"passes\";\n";
    let passes = format!("PROC passes()\n{GO}ENDPROC");
    assert_eq!(
        of("passes", &format!("PROC main()\npasses;\n{SET}{sync}PDispOff;\nENDPROC\n{passes}")),
        [LEFT]
    );
    let sets = format!("PROC main()\n{sync}{GO}ENDPROC\nPROC passes()\n{SET}ENDPROC");
    assert_eq!(of("main", &sets), [LEFT, LEFT]);
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
fn whatever_goes_back_from_an_error_handler_makes_data_and_switches_uncertain() {
    for back in ["RETRY;", "TRYNEXT;", "StartMoveRetry;", "IF n=1 StartMoveRetry;\nRAISE;"] {
        let body = format!(
            "m:=2;\nMoveL Offs(p,0,0,m),v100,fine,tool0;\nWaitTime 1;\nMoveL Offs(p,0,0,m),v100,fine,tool0;\n\
             ERROR\nm:=3;\n{back}"
        );
        assert_eq!(heights(&body, ""), [Err(Reason::RunTimeOffset); 2], "{back}");
    }
    let body = "m:=2;\nMoveL Offs(p,0,0,m),v100,fine,tool0;\nERROR\nm:=3;\nRAISE;";
    assert_eq!(heights(body, ""), [Ok(2.0)]);
    // What is called may have stopped where a displacement is on, and goes on after its call.
    let through = |clause: &str| {
        let main = format!("PROC main()\ncalled;\n{GO}PDispOff;\n{clause}\nENDPROC\n");
        of("main", &format!("{main}PROC called()\n{SET}{GO}PDispOff;\nENDPROC"))
    };
    assert_eq!(through("ERROR\nTRYNEXT;"), [LEFT]);
    assert_eq!(through("ERROR\nStartMoveRetry;"), [LEFT]);
    assert_eq!(through("ERROR\nRAISE;"), [None]);
    assert_eq!(through(""), [None]);
    // A handler that comes to its end ends the routine as it leaves the switches.
    let ends = format!("PROC main()\ncalled;\n{GO}ENDPROC\nPROC called()\n{GO}ERROR\n{SET}ENDPROC");
    assert_eq!(of("main", &ends), [LEFT]);
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
fn what_the_controller_writes_later_is_never_known() {
    let after = |statement: &str| {
        heights(&format!("m:=2;\n{statement}\nm:=3;\nMoveL Offs(p,0,0,m),v100,fine,tool0;"), "")
            .pop()
            .unwrap()
    };
    let left = Err(Reason::RunTimeOffset);
    assert_eq!(after("IVarValue \"s:\",8,m,i;"), left);
    assert_eq!(after("SiGetCyclic device,m,40;"), left);
    assert_eq!(after("IVarValue \"s:\",m,n,i;"), Ok(3.0));
    // At once, by arguments that are read at a glance.
    let at_once = |statement: &str| {
        heights(&format!("m:=2;\n{statement}\nMoveL Offs(p,0,0,m),v100,fine,tool0;"), "").pop().unwrap()
    };
    for statement in [
        "STCalib gun1\\ToolChg\\RetTipWear:=m;",
        "STClose gun1,1000,3\\RetThickness:=m;",
        "ok:=STIsClosed(gun1\\RetThickness:=m);",
        "name:=GetTaskName(\\TaskNo:=m);",
        "frame:=DefAccFrame(a,b,4,n,m);",
        "CONNECT m WITH t;",
        "UnpackRawBytes raw,1,m\\Float4;",
        "GetDataVal name,m;",
        "ReadCfgData \"/a\",\"b\",m;",
        "SocketReceive socket\\Data:=m;",
        "SetDataVal \"M\",n;",
    ] {
        assert_eq!(at_once(statement), left, "{statement}");
    }
    for statement in
        ["STClose gun1,m,3;", "WriteVar \"s:\",8,m;", "WaitTime m;", "SetBrush m;", "CallByVar \"q\",n;"]
    {
        let wanted = if statement.starts_with("CallByVar") { left } else { Ok(2.0) };
        assert_eq!(at_once(statement), wanted, "{statement}");
    }
    // Data of another routine or module that has the name.
    let there = "PROC there()\nVAR num k:=1;\nSetDataVal \"k\"\\Block:=b,n;\nENDPROC";
    let local = "VAR num k:=1;\nhere:\nMoveL Offs(p,0,0,k),v100,fine,tool0;";
    assert_eq!(heights(local, there), [left]);
}

#[test]
fn a_parameter_by_reference_may_be_other_data_by_another_name() {
    let twice = |body: &str| {
        let routine = format!("PROC twice(INOUT num a,INOUT num b,num c)\n{body}\nENDPROC");
        of("twice", &format!("{routine}\nPROC main()\ntwice m,m,m;\nENDPROC"))
    };
    let go = |name: &str| format!("MoveL Offs(p,0,0,{name}),v100,fine,tool0;\n");
    let left = Some(Reason::RunTimeOffset);
    assert_eq!(twice(&format!("a:=1;\n{}", go("a"))), [None]);
    assert_eq!(twice(&format!("a:=1;\nb:=2;\n{}{}", go("a"), go("b"))), [left, None]);
    assert_eq!(twice(&format!("a:=1;\nm:=2;\n{}{}", go("a"), go("m"))), [left, None]);
    assert_eq!(twice(&format!("m:=1;\na:=2;\n{}{}", go("a"), go("m"))), [None, left]);
    assert_eq!(twice(&format!("m:=1;\nIncr a;\n{}", go("m"))), [left]);
    // One by value is its own.
    assert_eq!(twice(&format!("c:=1;\nm:=2;\na:=3;\n{}", go("c"))), [None]);
}

#[test]
fn functions_that_only_return_an_expression_are_worth_it() {
    let functions = "FUNC robtarget above(num h\\num more)\nRETURN Offs(p,0,0,h);\nENDFUNC\n\
        FUNC num double(num x)\nRETURN 2*x;\nENDFUNC\nFUNC num deep(num x)\nRETURN deep(x);\nENDFUNC\n\
        FUNC num wide(num x)\nRETURN wide(x)+wide(x);\nENDFUNC\n\
        FUNC num counted(num x)\nn:=n+1;\nRETURN x;\nENDFUNC\nFUNC num given(INOUT num x)\nRETURN x;\nENDFUNC\n\
        FUNC num read()\nRETURN ReadNum(d);\nENDFUNC\nFUNC num opt(\\num x)\nRETURN x;\nENDFUNC\n\
        FUNC num held()\nRETURN m;\nENDFUNC\nCONST num table{3,4}:=stop;";
    let one = |body: &str, target: &str| {
        heights(&format!("{body}\nMoveL {target},v100,fine,tool0;"), functions).pop().unwrap()
    };
    assert_eq!(one("", "above(5)"), Ok(5.0));
    assert_eq!(one("", "above(h:=7)"), Ok(7.0));
    assert_eq!(one("", "Offs(p,0,0,double(double(3)))"), Ok(12.0));
    assert_eq!(one("n:=4;", "above(double(n))"), Ok(8.0));
    assert_eq!(one("m:=6;", "above(held())"), Ok(6.0));
    assert_eq!(one("m:=6;\nunknown;", "above(held())"), Err(Reason::RunTimeOffset));
    assert_eq!(one("n:=ReadNum(d);", "above(n)"), Err(Reason::RunTimeOffset));
    for number in ["deep(1)", "wide(1)", "counted(1)", "given(m)", "read()", "opt()"] {
        assert_eq!(one("", &format!("Offs(p,0,0,{number})")), Err(Reason::RunTimeOffset), "{number}");
    }
    assert_eq!(one("", "nowhere(5)"), Err(Reason::RunTimeFunction));
    // Dim, and what counts.
    assert_eq!(one("", "Offs(p,0,0,Dim(table,1))"), Ok(3.0));
    assert_eq!(one("", "Offs(p,0,0,Dim(table,2))"), Ok(4.0));
    assert_eq!(one("", "Offs(p,0,0,Dim(table,3))"), Err(Reason::RunTimeOffset));
    assert_eq!(one("n:=3;\nIncr n;\nAdd n,2;\nDecr n;", "Offs(p,0,0,n)"), Ok(5.0));
    assert_eq!(one("Clear n;", "Offs(p,0,0,n)"), Ok(0.0));
    assert_eq!(one("n:=ReadNum(d);\nIncr n;", "Offs(p,0,0,n)"), Err(Reason::RunTimeOffset));
    assert_eq!(one("n:=3;\nAdd n,ReadNum(d);", "Offs(p,0,0,n)"), Err(Reason::RunTimeOffset));
    assert_eq!(
        one("n:=3;\nFOR k FROM 1 TO 2 DO\nIncr n;\nENDFOR", "Offs(p,0,0,n)"),
        Err(Reason::RunTimeOffset)
    );
}

#[test]
fn chains_of_constants_end_soon_and_in_little_memory() {
    let chain = |length: usize, kind: &str, each: &dyn Fn(usize) -> String| {
        (0..length).map(|k| format!("CONST {kind} a{k}:={};\n", each(k + 1))).collect::<String>()
    };
    let sums = chain(20, "num", &|k| format!("a{k}+a{k}")) + "CONST num a20:=0.0001;";
    let found = heights("MoveL Offs(p,0,0,a0),v100,fine,tool0;", &sums)[0].unwrap();
    assert!((found - 104.8576).abs() < 1e-9, "{found}");
    let sums = chain(60, "num", &|k| format!("a{k}+a{k}"));
    assert!(heights("MoveL Offs(p,0,0,a0),v100,fine,tool0;", &sums)[0].is_err());
    let lists = chain(60, "robtarget", &|k| format!("[a{k},a{k}]"));
    assert!(heights("MoveL a0,v100,fine,tool0;", &lists)[0].is_err());
    let lists = chain(30, "robtarget", &|k| format!("[a{k},a{k}]")) + "CONST num a30:=1;";
    assert!(heights("MoveL a0,v100,fine,tool0;", &lists)[0].is_err());
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
fn the_variable_of_a_loop_is_not_data_of_the_same_name() {
    let loops = "FOR m FROM 1 TO 3 DO\nWaitTime m;\nENDFOR\n";
    let go = "MoveL Offs(p,0,0,m),v100,fine,tool0;\n";
    let left = Some(Reason::RunTimeOffset);
    let other = format!("PROC other()\n{go}ENDPROC\n");
    // Assigned in a routine that has a loop with this name.
    let main = format!("PROC main()\nm:=50;\n{loops}other;\nENDPROC\n");
    assert_eq!(of("other", &format!("{other}{main}")), [left]);
    // Within the loop never the data, even where that never changes.
    for data in ["", "VAR num m:=7;\n", "CONST num m:=7;\n"] {
        let main = format!("PROC main()\n{data}FOR m FROM 1 TO 3 DO\n{go}ENDFOR\nENDPROC");
        assert_eq!(of("main", &main), [left], "{data}");
    }
    let fixed = "CONST num k:=7;\nPROC main()\nFOR k FROM 1 TO 3 DO\nMoveL Offs(p,0,0,k),v100,fine,tool0;\nENDFOR\nENDPROC\n\
                 PROC other()\nMoveL Offs(p,0,0,k),v100,fine,tool0;\nENDPROC";
    assert_eq!(of("main", fixed), [left]);
    assert_eq!(of("other", fixed), [None]);
}

#[test]
fn data_that_tasks_share_is_not_followed_past_a_wait() {
    let after = |declared: &str, statement: &str| {
        let body = format!("k:=2;\n{statement}\nMoveL Offs(p,0,0,k),v100,fine,tool0;");
        heights(&body, &format!("{declared} num k:=1;")).pop().unwrap()
    };
    let left = Err(Reason::RunTimeOffset);
    for wait in
        ["WaitUntil flag;", "WaitTime 1;", "WaitDI di1,1;", "WaitSyncTask s,t;", "WaitTestAndSet flag;"]
    {
        assert_eq!(after("PERS", wait), left, "{wait}");
        for own in ["LOCAL PERS", "TASK PERS", "VAR"] {
            assert_eq!(after(own, wait), Ok(2.0), "{own} {wait}");
        }
    }
    assert_eq!(after("PERS", "Set do1;"), Ok(2.0));
    let waits = "PROC waits()\nWaitUntil flag;\nENDPROC\nPERS";
    assert_eq!(after(waits, "waits;"), left);
    let body = "k:=2;\nWHILE n<3 DO\nMoveL Offs(p,0,0,k),v100,fine,tool0;\nWaitTime 1;\nENDWHILE";
    assert_eq!(heights(body, "PERS num k:=1;"), [left]);
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
fn a_name_that_another_file_declares_is_said_to_be_so() {
    assert_eq!(heights("MoveL Offs(p,0,0,-depth),v100,fine,tool0;", ""), [Err(Reason::Undeclared)]);
    assert_eq!(heights("MoveL Offs(p,0,0,depth{2}),v100,fine,tool0;", ""), [Err(Reason::Undeclared)]);
    assert_eq!(
        heights("n:=ReadNum(d);\nMoveL Offs(p,0,0,n),v100,fine,tool0;", ""),
        [Err(Reason::RunTimeOffset)]
    );
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
fn data_that_is_written_all_at_once_is_of_the_type_that_is_stated() {
    let tool = "PERS tooldata t:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];\nVAR string s;\n\
                VAR tooldata other;\nALIAS tooldata wheel;\n";
    let run = |call: &str| {
        let of = of("main", &format!("{tool}PROC main()\n{call}\nMoveL p,v100,fine,t;\nENDPROC"));
        assert_eq!(of.len(), 1, "{call}");
        of[0]
    };
    assert_eq!(run("SetAllDataVal \"robtarget\"\\Object:=\"v.*\",p;"), None);
    let any = ["\"ToolData\"", "\"wheel\"", "s"].map(|name| format!("SetAllDataVal {name},other;"));
    for call in any.iter().map(String::as_str).chain(["SetDataVal s,other;"]) {
        assert_eq!(run(call), Some(Reason::ToolAssigned), "{call}");
    }
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

const OFFS: &str = "MoveL Offs(p,0,0,m),v100,fine,tool0;\n";
const RUN_TIME: Option<Reason> = Some(Reason::RunTimeOffset);

#[test]
fn conditions_are_asked_before_the_branches_behind_them() {
    let ask = "FUNC bool ask()\nTPReadNum m,\"x\";\nRETURN m>1;\nENDFUNC\nFUNC bool shift()\nPDispSet [[0,0,10],[1,0,0,0]];\nRETURN FALSE;\nENDFUNC\n\
               FUNC num three()\nm:=n;\nRETURN 3;\nENDFUNC\n";
    let main = |body: &str| of("main", &format!("{ask}PROC main()\nVAR string s;\nm:=5;\n{body}ENDPROC"));
    for asked in ["NOT StrToVal(s,m)", "ask()", "n=1 AND ask()"] {
        let found = main(&format!("IF n=2 THEN\n{OFFS}ELSEIF {asked} THEN\n{OFFS}ELSE\n{OFFS}ENDIF\n{OFFS}"));
        assert_eq!(found, [None, RUN_TIME, RUN_TIME, RUN_TIME], "{asked}");
    }
    // Also where every branch says the same.
    let found = main(&format!("IF n=2 THEN\nm:=5;\nELSEIF ask() THEN\nm:=5;\nENDIF\n{OFFS}"));
    assert_eq!(found, [RUN_TIME]);
    let found = main(&format!("IF n=2 THEN\nn:=1;\nELSEIF shift() THEN\nn:=2;\nELSE\n{GO}ENDIF\n{GO}"));
    assert_eq!(found, [LEFT, LEFT]);
    let found = main(&format!("TEST n\nCASE 1:\n{OFFS}CASE three():\n{OFFS}DEFAULT:\n{OFFS}ENDTEST\n"));
    assert_eq!(found, [None, RUN_TIME, RUN_TIME]);
}

#[test]
fn behind_a_raise_the_routine_goes_on_where_its_handler_says_so() {
    let main = |raised: &str, handler: &str| {
        of(
            "main",
            &format!(
                "PROC main()\nm:=1;\nIF n=1 THEN\n{raised}\nRAISE 5;\nENDIF\n{OFFS}ERROR\n{handler}\nENDPROC"
            ),
        )
    };
    assert_eq!(main("m:=40;", "TRYNEXT;"), [RUN_TIME]);
    assert_eq!(main("PDispSet [[0,0,10],[1,0,0,0]];", "IF ERRNO=5 TRYNEXT;"), [LEFT]);
    // A handler that leaves the routine does not.
    assert_eq!(main("m:=40;", "RETURN;"), [None]);
    assert_eq!(main("m:=40;", "RAISE;"), [None]);
}

#[test]
fn what_is_written_by_a_name_that_is_not_told_is_not_known_behind_it() {
    let body = |routines: &str, call: &str| {
        of("main", &format!("PROC main()\nm:=1;\n{call}\n{OFFS}ENDPROC\n{routines}"))
    };
    for call in [
        "SetDataVal name,40;",
        "SetDataVal \"m\"+\"\",40;",
        "SetAllDataVal \"num\"\\TypeMod:=30,40;",
        "SetDataVal \"m\",40;",
    ] {
        assert_eq!(body("", call), [RUN_TIME], "{call}");
        let sub = format!("PROC sub()\n{call}\nENDPROC");
        assert_eq!(body(&sub, "sub;"), [RUN_TIME], "{call} in a routine");
        let trap = format!("TRAP tr\n{call}\nENDTRAP");
        assert_eq!(body(&trap, "WaitTime 1;"), [RUN_TIME], "{call} in a trap routine");
    }
    assert_eq!(body("", "SetDataVal \"n\",40;"), [None]);
}

#[test]
fn a_parameter_by_reference_changes_with_what_is_given_for_it() {
    let go = "PROC go(INOUT num q)\nq:=1;\nWaitTime 1;\nMoveL Offs(p,0,0,q),v100,fine,tool0;\nENDPROC\n";
    let trap = "TRAP tr\nm:=40;\nENDTRAP\n";
    assert_eq!(of("go", &format!("{go}PROC main()\ngo m;\nENDPROC")), [None]);
    assert_eq!(
        of("go", &format!("{go}{trap}PROC main()\nCONNECT i WITH tr;\ngo m;\nENDPROC")),
        [Some(Reason::RunTimeOffset)]
    );
    // A truth value that a trap routine sets is no number.
    let other = "VAR bool b;\nTRAP tr\nb:=TRUE;\nENDTRAP\n";
    assert_eq!(of("go", &format!("{other}{go}PROC main()\nCONNECT i WITH tr;\ngo m;\nENDPROC")), [None]);
    // What the controller keeps and writes later is that which was given.
    let hook = "PROC hook(VAR num q)\nIVarValue \"s:\",1,q,i;\nENDPROC\n";
    assert_eq!(of("main", &format!("{hook}PROC main()\nhook m;\nm:=1;\n{OFFS}ENDPROC")), [RUN_TIME]);
}

#[test]
fn a_routine_that_is_named_like_an_instruction_is_followed() {
    for name in ["PDispOff", "ConfL", "SoftDeact", "IndReset"] {
        let own = format!("PROC {name}()\n{SET}ENDPROC\nPROC main()\n{name};\n{GO}ENDPROC");
        assert_eq!(of("main", &own), [LEFT], "{name}");
    }
}

#[test]
fn an_index_is_that_of_single_precision() {
    let data = "VAR num a{5};\nCONST num c{9}:=[0,0,0,0,0,0,0,30,0];\n";
    let found = heights(
        "s:=0.3;\na:=[0,10,20,30,40];\nMoveL Offs(p,0,0,a{s/0.1}),v100,fine,tool0;\na{s/0.1}:=35;\nMoveL Offs(p,0,0,a{3}),v100,fine,tool0;\n\
         MoveL Offs(p,0,0,c{(0.7+0.1)*10}),v100,fine,tool0;",
        &format!("{data}VAR num s;"),
    );
    assert_eq!(found, [Ok(20.0), Ok(35.0), Ok(30.0)]);
}

#[test]
fn where_a_handler_or_a_trap_routine_moves_no_start_is_known() {
    let far = "MoveL Offs(p,0,9,0),v100,fine,tool0;\n";
    let run = |handler: &str, more: &str| {
        let source = module(&format!("{more}PROC main()\n{GO}WaitDI d,1;\n{far}ERROR\n{handler}ENDPROC"));
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        let main = task
            .listing
            .motions
            .iter()
            .filter(|m| !m.conditional && m.routine == Some(task.listing.motions[0].routine.unwrap()));
        main.map(|motion| motion.previous.is_some()).collect::<Vec<_>>()
    };
    assert_eq!(run("TRYNEXT;\n", "")[..2], [false, true]);
    assert_eq!(run(&format!("{GO}TRYNEXT;\n"), "")[..2], [false, false]);
    assert_eq!(run(&format!("{GO}RETURN;\n"), "")[..2], [false, true]);
    let follows = |trap: &str| {
        let source = module(&format!("PROC main()\n{GO}{far}ENDPROC\nTRAP tr\n{trap}ENDTRAP"));
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        task.listing.motions[1].previous.is_some()
    };
    assert!(follows("n:=1;\n"));
    assert!(follows(&format!("StorePath;\n{GO}RestoPath;\n")));
    assert!(!follows(&format!("ClearPath;\n{GO}")));
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
fn a_target_that_is_read_by_its_name_is_used_elsewhere_too() {
    let uses = |call: &str| {
        let source = module(&format!("VAR robtarget pv;\nPROC main()\n{GO}{call}\nENDPROC"));
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        task.listing.declarations[0].other_uses.len()
    };
    assert_eq!(uses("TPWrite \"q\";"), 0);
    assert_eq!(uses("GetDataVal \"P\",pv;"), 1);
    assert_eq!(uses("GetDataVal name,pv;"), 1);
}

#[test]
fn a_record_that_two_modules_declare_is_not_taken_apart() {
    let rec = |local: &str, first: &str, second: &str| {
        format!("MODULE {first}{second}\n{local}RECORD rec\nnum {first};\nnum {second};\nENDRECORD\n")
    };
    let a = format!("{}CONST rec r:=[10,20];\nENDMODULE\n", rec("LOCAL ", "a", "b"));
    let b = format!("{}ENDMODULE\n", rec("", "b", "a"));
    let c = format!(
        "MODULE C\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nPROC main()\nMoveL Offs(p,0,0,r.a),v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    );
    let known = |files: &[&str]| {
        let files: Vec<(&str, &[u8])> = files.iter().map(|text| ("m.mod", text.as_bytes())).collect();
        Task::read(&files).listing.motions[0].reason().is_none()
    };
    assert!(known(&[&a, &c]));
    assert!(!known(&[&a, &b, &c]));
}

#[test]
fn what_another_task_may_write_is_not_known_behind_a_wait_of_any_kind() {
    let shared = "PERS num sh:=0;\nPERS bool ready:=FALSE;\n";
    let run = |wait: &str| {
        let text = format!(
            "{shared}PROC main()\nsh:=5;\nm:=5;\n{wait}MoveL Offs(p,0,0,sh),v100,fine,tool0;\n{OFFS}ENDPROC\n\
             PROC poll()\nWHILE NOT ready DO\nENDWHILE\nENDPROC\n"
        );
        of("main", &text)
    };
    assert_eq!(run("TPReadNum n,\"x\";\nSet do1;\nFOR k FROM 1 TO 2 DO\nn:=n+1;\nENDFOR\n"), [None, None]);
    for wait in [
        "WHILE NOT ready DO\nENDWHILE\n",
        "poll;\n",
        "UIMsgBox \"set it\";\n",
        "TPReadFK n,\"x\",\"a\",\"b\",\"\",\"\",\"\";\n",
        "SocketReceive sock\\Str:=st;\n",
        "Stop;\n",
    ] {
        assert_eq!(run(wait), [RUN_TIME, None], "{wait}");
    }
}

#[test]
fn the_variable_of_a_loop_outside_routines_hides_a_constant() {
    let loops = "FOR c FROM 1 TO 3 DO\nMoveL Offs(p,0,0,c),v100,fine,tool0;\nENDFOR\n\
                 FOR pi FROM 1 TO 3 DO\nMoveL Offs(p,0,0,pi),v100,fine,tool0;\nENDFOR\n";
    let head = format!("CONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nCONST num c:=1;\n");
    for text in [format!("{head}{loops}"), format!("MODULE M\n{head}{loops}ENDMODULE\n")] {
        let task = Task::read(&[("m.mod", text.as_bytes())]);
        let found: Vec<Option<Reason>> = task.listing.motions.iter().map(|motion| motion.reason()).collect();
        assert_eq!(found, [RUN_TIME, RUN_TIME], "{text}");
    }
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

#[test]
fn trynext_passes_the_branches_of_a_condition_that_fails() {
    let run = |handler: &str| {
        of(
            "main",
            &format!(
                "PROC main()\nm:=1;\nIF 1/n>0 THEN\nm:=2;\nELSE\nm:=2;\nENDIF\n{OFFS}ERROR\n{handler}\nENDPROC"
            ),
        )
    };
    assert_eq!(run("TRYNEXT;"), [RUN_TIME]);
    assert_eq!(run("RETURN;"), [None]);
}

#[test]
fn the_condition_of_a_compact_if_is_asked_on_the_way_past_it() {
    let find = "FUNC bool find(INOUT robtarget q)\nq.trans.x:=n;\nRETURN TRUE;\nENDFUNC\n\
                FUNC bool shift()\nPDispSet [[0,0,10],[1,0,0,0]];\nRETURN n=1;\nENDFUNC\n";
    let main = |body: &str| {
        of(
            "main",
            &format!("{find}PROC main()\nVAR string s;\nVAR robtarget q;\nm:=5;\nq:=p;\n{body}ENDPROC"),
        )
    };
    assert_eq!(main(&format!("IF n=1 RETURN;\n{OFFS}")), [None]);
    for leaves in ["RETURN", "EXIT", "m:=5"] {
        assert_eq!(main(&format!("IF NOT StrToVal(s,m) {leaves};\n{OFFS}")), [RUN_TIME], "{leaves}");
        assert_eq!(main(&format!("IF shift() {leaves};\n{GO}")), [LEFT], "{leaves}");
    }
    let found = main("IF NOT find(q) RETURN;\nMoveL q,v100,fine,tool0;\n");
    assert!(found[0].is_some(), "{found:?}");
}

#[test]
fn an_error_leaves_what_is_called_anywhere() {
    let inner = format!("PROC inner()\n{SET}WaitDI d,1\\MaxTime:=1;\nPDispOff;\nENDPROC\n");
    let run = |unit: &str, handler: &str| {
        let more =
            format!("{inner}PROC sub()\ninner;\nERROR\n{handler}ENDPROC\nPROC main()\nsub;\n{GO}ENDPROC");
        of(unit, &more)
    };
    assert_eq!(run("sub", &format!("{GO}RETURN;\n")), [LEFT]);
    assert_eq!(run("main", "RETURN;\n"), [LEFT]);
    assert_eq!(run("main", "PDispOff;\nRETURN;\n"), [None]);
    assert_eq!(run("main", "RAISE;\n"), [None]);
    // A function that is asked once more begins with what it had set.
    let again = |handler: &str| {
        of(
            "fx",
            &format!(
                "FUNC num fx()\n{GO}{SET}WaitDI d,1;\nPDispOff;\nRETURN 1;\nENDFUNC\nPROC main()\nn:=fx();\nERROR\n{handler}ENDPROC"
            ),
        )
    };
    assert_eq!(again("RETRY;\n"), [LEFT]);
    let late = |handler: &str| {
        let sub = format!("PROC sub()\n{GO}{SET}WaitDI d,1;\nPDispOff;\nENDPROC\n");
        let main = format!("PROC main()\nPDispOff;\nsub;\nPDispOff;\n%\"sub\"%;\nERROR\n{handler}ENDPROC");
        of("sub", &format!("{sub}{main}"))
    };
    assert_eq!((late("RETRY;\n"), late("RAISE;\n")), (vec![LEFT], vec![None]));
}

#[test]
fn an_assignment_that_fails_is_passed_by_trynext() {
    let run = |value: &str, handler: &str| {
        of(
            "main",
            &format!(
                "FUNC num g(num a)\nRETURN 5;\nENDFUNC\nPROC main()\nm:=1;\nm:={value};\n{OFFS}ERROR\n{handler}\nENDPROC"
            ),
        )
    };
    assert_eq!(run("g(1/n)", "TRYNEXT;"), [RUN_TIME]);
    assert_eq!(run("g(1/n)", "RETURN;"), [None]);
    assert_eq!(run("Abs(-5)", "TRYNEXT;"), [None]);
}

#[test]
fn parameters_that_were_assigned_and_numbers_of_routines_are_told() {
    let sub = |head: &str| {
        let body = "q:=Offs(p,0,0,10);\nMoveL q,v100,fine,tool0;\nMoveL Offs(q,0,0,1),v100,fine,tool0;\n";
        of("sub", &format!("PROC sub({head})\n{body}ENDPROC\nPROC main()\nsub p;\nENDPROC"))
    };
    assert_eq!(sub("robtarget q"), [None, None]);
    assert_eq!(sub("INOUT robtarget q"), [None, None]);
    let found = heights(
        "VAR num z;\nMoveL Offs(p,0,0,z),v100,fine,tool0;\na{2,1}:=30;\nMoveL Offs(p,0,0,a{2,1}),v100,fine,tool0;\n\
         MoveL Offs(p,0,0,a{1,2}),v100,fine,tool0;\nb{1,2,1}.trans.z:=7;\nMoveL Offs(p,0,0,b{1,2,1}.trans.z),v100,fine,tool0;",
        "VAR num a{2,2}:=[[1,2],[3,4]];\nVAR pose b{2,2,1};\n",
    );
    assert_eq!(found, [Ok(0.0), Ok(30.0), Err(Reason::RunTimeOffset), Ok(7.0)]);
}
