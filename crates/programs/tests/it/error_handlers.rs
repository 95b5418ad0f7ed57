//! Control flow beside the program text: error handlers, trap routines, and conditions with side effects.

use super::modal_state::{GO, LEFT, OFFS, RUN_TIME, SET, heights, module, of};
use truegrind_programs::motion::Reason;
use truegrind_programs::rapid::Task;

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
    // The path that is put aside and brought back is where the robot stands; one that is cleared is not.
    assert_eq!(run("StorePath;\nRestoPath;\nStartMoveRetry;\n", "")[..2], [false, true]);
    assert_eq!(run(&format!("StorePath;\n{GO}RestoPath;\nStartMoveRetry;\n"), "")[..2], [false, false]);
    assert_eq!(run("StopMove;\nClearPath;\nStartMove;\nRETRY;\n", "")[..2], [false, false]);
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
