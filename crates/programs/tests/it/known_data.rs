//! Which values of data the text determines: aliases, shared data, loops, names and indices.

use super::modal_state::{EXT, GO, OFFS, RUN_TIME, heights, module, of};
use truegrind_programs::motion::Reason;
use truegrind_programs::rapid::Task;

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
fn a_name_that_another_file_declares_is_said_to_be_so() {
    assert_eq!(heights("MoveL Offs(p,0,0,-depth),v100,fine,tool0;", ""), [Err(Reason::Undeclared)]);
    assert_eq!(heights("MoveL Offs(p,0,0,depth{2}),v100,fine,tool0;", ""), [Err(Reason::Undeclared)]);
    assert_eq!(
        heights("n:=ReadNum(d);\nMoveL Offs(p,0,0,n),v100,fine,tool0;", ""),
        [Err(Reason::RunTimeOffset)]
    );
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

/// A routine whose tool and work object are parameters was left whole, even if every call handed over the same.
#[test]
fn a_frame_that_every_call_hands_over_is_known() {
    let frame = "[[1,2,3],[1,0,0,0]]";
    let data = format!(
        "PERS wobjdata wA:=[FALSE,TRUE,\"\",{frame},{frame}];\nPERS wobjdata wB:=[FALSE,TRUE,\"\",{frame},{frame}];\n\
         PERS tooldata t1:=[TRUE,{frame},[1,[0,0,1],[1,0,0,0],0,0,0]];\n"
    );
    let go = "MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,t\\WObj:=w;\n";
    let read = |calls: &str, rest: &str| {
        let part = format!("PROC part(PERS tooldata t,PERS wobjdata w)\n{go}ENDPROC\n");
        let source = format!("MODULE M\n{data}PROC main()\n{calls}ENDPROC\n{part}{rest}ENDMODULE\n");
        let listing = Task::read(&[("m.mod", source.as_bytes())]).listing;
        let motion = listing.motions.last().unwrap().clone();
        let named = listing.work_object(&motion).map(|object| object.name.clone());
        (motion.reason(), named.unwrap())
    };
    let next = "PROC next(PERS wobjdata v)\npart t1,v;\nENDPROC\n";
    for (calls, rest) in
        [("part t1,wA;\n", ""), ("part t1,wA;\npart T1,WA;\n", ""), ("next wA;\npart t1,wA;\n", next)]
    {
        assert_eq!(read(calls, rest), (None, "wA".to_owned()), "{calls}{rest}");
    }
    // Two values, an expression, a name computed at run time, a routine that writes it, data that are assigned.
    let write = "PROC other(PERS wobjdata o)\no.uframe.trans.x:=5;\nENDPROC\n";
    for (calls, rest) in [
        ("part t1,wA;\npart t1,wB;\n", ""),
        ("next wA;\npart t1,wB;\n", next),
        ("part t1,wA;\n%\"pa\"+name% t1,wB;\n", ""),
        ("part t1,wA;\nother wA;\n", write),
        ("part t1,wA;\nwA.oframe.trans.z:=4;\n", ""),
    ] {
        assert_ne!(read(calls, rest).0, None, "{calls}{rest}");
    }
    // Another part of the program, which is not given, may call it as well.
    let source = format!(
        "MODULE M\n{data}PROC part(PERS tooldata t,PERS wobjdata w)\n{go}ENDPROC\nPROC cut()\npart t1,wA;\nENDPROC\nENDMODULE\n"
    );
    assert_eq!(
        Task::read(&[("m.mod", source.as_bytes())]).listing.motions[0].reason(),
        Some(Reason::ToolParameter)
    );
}
