//! The class: an expression with side effects is replaced by its value, or evaluated twice. It must neither be
//! removed from a program nor repeated.

use truegrind_programs::motion::{Listing, MotionKind, Reason};
use truegrind_programs::rapid::Task;
use truegrind_programs::rapid::predefined;
use truegrind_programs::rewrite::{Change, Extra, NewTarget, RewriteOptions};

const DATA: &str = "CONST robtarget p:=[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
    CONST robtarget a{2}:=[[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],\
    [[400,9,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];\nVAR num n:=0;\nVAR iodev d;\n";

/// Pure functions that ignore their arguments, and functions with side effects.
const ROUTINES: &str = "FUNC robtarget at(robtarget t,num layer)\nRETURN t;\nENDFUNC\n\
    FUNC robtarget through(robtarget t,num k)\nRETURN at(t,k);\nENDFUNC\n\
    FUNC robtarget divided(robtarget t,num k)\nRETURN at(t,1/k);\nENDFUNC\n\
    FUNC robtarget maybe(robtarget t\\num k)\nRETURN t;\nENDFUNC\n\
    FUNC num one(num k)\nRETURN 1;\nENDFUNC\n\
    FUNC num sum(num k)\nRETURN k+2;\nENDFUNC\n\
    FUNC num sets(num k)\nn:=k;\nRETURN k;\nENDFUNC\n\
    FUNC num calls(num k)\nRETURN sets(k);\nENDFUNC\n\
    FUNC num writes(INOUT num k)\nk:=1;\nRETURN 1;\nENDFUNC\n\
    FUNC num outputs(num k)\nSetDO do1,1;\nRETURN k;\nENDFUNC\n\
    FUNC num says(num k)\nTPWrite \"x\";\nRETURN k;\nENDFUNC\n\
    FUNC num waits(num k)\nWaitTime 1;\nRETURN k;\nENDFUNC\n\
    FUNC num raises(num k)\nIF k>1 RAISE 1;\nRETURN k;\nENDFUNC\n\
    FUNC num moves(num k)\nMoveL p,v100,fine,tool0;\nRETURN k;\nENDFUNC\n\
    FUNC num late(num k)\n%\"other\"%;\nRETURN k;\nENDFUNC\n\
    FUNC num loops(num k)\nWHILE k>1 DO\nENDWHILE\nRETURN k;\nENDFUNC\n";

fn source(instruction: &str) -> String {
    format!("MODULE M\n{DATA}PROC main()\n{instruction}\nENDPROC\n{ROUTINES}ENDMODULE\n")
}

fn first(instruction: &str) -> (Option<Reason>, bool, Listing) {
    let source = source(instruction);
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let motion = &task.listing.motions[0];
    (motion.reason(), motion.insertable, task.listing.clone())
}

#[test]
fn a_target_with_side_effects_is_unmodified() {
    let acting = [
        "sets(20)",
        "calls(20)",
        "writes(n)",
        "outputs(1)",
        "says(1)",
        "waits(1)",
        "raises(1)",
        "moves(1)",
        "late(1)",
        "loops(1)",
        "one(sets(3))",
        "1+sum(sets(3))",
        "Abs(sets(2))",
        "ReadNum(d)",
        "GInput(gi1)",
        "ClkRead(c)",
        "1/n0",
        "unknown(3)",
    ];
    for argument in acting {
        for target in ["at(p,#)", "through(p,#)", "maybe(p\\k:=#)", "Offs(at(p,#),1,2,3)", "a{one(#)}"] {
            let target = target.replace('#', argument);
            let line = format!("MoveL {target},v100,fine,tool0;");
            let (reason, ..) = first(&line);
            assert!(reason.is_some(), "{line}");
        }
    }
    let (reason, ..) = first("MoveL at(p,sets(20)),v100,fine,tool0;");
    assert_eq!(reason, Some(Reason::SideEffect));
    let (reason, ..) = first("MoveL divided(p,0),v100,fine,tool0;");
    assert_eq!(reason, Some(Reason::SideEffect));
    // The circle point is removed where a circle becomes straight.
    let (reason, ..) = first("MoveC at(p,sets(1)),Offs(p,1,2,3),v100,fine,tool0;");
    assert_eq!(reason, Some(Reason::SideEffect));
    // The declaration is rewritten where it is computed.
    let (reason, ..) = first("VAR robtarget q:=at(p,sets(1));\nMoveL q,v100,fine,tool0;");
    assert!(reason.is_some());
}

/// A side effect reaches every routine of a cycle of calls and all that call into it.
#[test]
fn a_side_effect_is_found_around_a_cycle_of_calls() {
    let routines = "FUNC num ping(num k)\nIF k>0 RETURN pong(k-1);\nRETURN 1;\nENDFUNC\n\
        FUNC num pong(num k)\nIF k>9 EFFECT\nRETURN ping(k);\nENDFUNC\n\
        FUNC num above(num k)\nRETURN 1+ping(k);\nENDFUNC\n\
        FUNC num top(num k)\nRETURN above(k)*2;\nENDFUNC\n";
    for function in ["ping", "pong", "above", "top"] {
        for (effect, expected) in [("n:=k;", Some(Reason::RunTimeOffset)), ("RETURN 3;", None)] {
            let source = format!(
                "MODULE M\n{DATA}VAR num m;\nPROC main()\nn:=5;\nm:={function}(3);\nMoveL Offs(p,n,0,0),v100,fine,tool0;\nENDPROC\n\
                {}ENDMODULE\n",
                routines.replace("EFFECT", effect)
            );
            let task = Task::read(&[("m.mod", source.as_bytes())]);
            assert_eq!(task.listing.motions[0].reason(), expected, "{source}");
        }
    }
}

#[test]
fn a_target_without_side_effects_is_replaced() {
    for target in
        ["at(p,2)", "at(p,n)", "at(p,sum(2))", "through(p,one(3))", "a{one(7)}", "Offs(p,Abs(-1),sum(1),0)"]
    {
        let (reason, ..) = first(&format!("MoveL {target},v100,fine,tool0;"));
        assert_eq!(reason, None, "{target}");
    }
}

#[test]
fn an_argument_with_side_effects_is_evaluated_once() {
    let acting = [
        "v100\\V:=ReadNum(d)",
        "v100\\V:=sets(3)",
        "v100\\V:=GInput(gi1)",
        "v100\\V:=UINumEntry(\\Header:=\"x\")",
    ];
    for speed in acting {
        let line = format!("MoveL p,v100,fine,tool0;\nMoveL Offs(p,1,0,0),{speed},fine,tool0;");
        let source = source(&line);
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        assert!(!task.listing.motions[1].insertable, "{speed}");
        assert!(!task.listing.motions[1].can_straighten, "{speed}");
    }
    let source = source("MoveL p,v100,fine,tool0;\nMoveL Offs(p,9,0,0),v100\\V:=Abs(-50),fine,tool0;");
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.motions[1].insertable);
    let between = NewTarget::Cartesian {
        position_mm: [404.0, 0.0, 400.0],
        quaternion: [0.0, 0.0, 1.0, 0.0],
        conf: None,
    };
    let before = vec![Extra { kind: MotionKind::Linear, target: between, external: None }];
    let change = Change { motion: 1, targets: [NewTarget::Keep].into(), before };
    let rewritten = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
    let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
    assert_eq!(text.matches("Abs(-50)").count(), 2, "{text}");
}

#[test]
fn pure_routines_are_listed_in_order_and_write_nothing() {
    for name in predefined::all().iter().filter(|one| one.answers).map(|one| one.name) {
        assert!(predefined::is_pure(name.as_bytes()));
        assert_eq!(predefined::effect(name.as_bytes()), Some(&predefined::Effect::Reads), "{name}");
        assert!(
            !predefined::waits(name.as_bytes()) && predefined::displaces(name.as_bytes()).is_none(),
            "{name}"
        );
    }
}

/// A displacement relative to the robot position pins the motion that ends there.
#[test]
fn a_displacement_from_the_robot_position_pins_the_motion_before() {
    let reason = |line: &str| first(line).0;
    assert_eq!(reason("MoveL p,v100,fine,tool0;\nPDispOn p,tool0;"), Some(Reason::BeforeDisplacement));
    assert_eq!(reason("MoveL p,v100,fine,tool0;\nPDispOn\\ExeP:=p,p,tool0;\nPDispOff;"), None);
}

/// The class: on any path to such a displacement the robot may be at the end of another motion, and each of these
/// motions must keep its end point: at joins, around loops, after calls and handlers, and at the start of a cycle.
#[test]
fn a_displacement_from_the_robot_position_pins_the_motions_of_every_path() {
    let left = |main: &str, routines: &str| -> Vec<bool> {
        let source = format!(
            "MODULE m\nCONST robtarget p:=[[500,0,400],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nVAR num n;\n\
             PROC main()\n{main}\nENDPROC\n{routines}\nENDMODULE\n"
        );
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        // A loop that displaces already leaves the next cycle.
        let stays = [Some(Reason::BeforeDisplacement), Some(Reason::Displacement)];
        let before = |motion: &truegrind_programs::motion::Motion| stays.contains(&motion.own_reason);
        task.listing.motions.iter().map(before).collect()
    };
    const GO: &str = "MoveL p,v100,fine,tool0;\n";
    const HERE: &str = "PDispOn p,tool0;\nPDispOff;\n";
    let branches = format!("{GO}IF n>1 THEN\n{GO}ELSE\n{GO}ENDIF\n{HERE}{GO}");
    assert_eq!(left(&branches, ""), [false, true, true, false]);
    let one = format!("{GO}{GO}IF n>1 THEN\n{GO}ENDIF\n{HERE}{GO}");
    assert_eq!(left(&one, ""), [false, true, true, false]);
    assert_eq!(left(&format!("{GO}{GO}IF n>1 {GO}{HERE}{GO}"), ""), [false, true, true, false]);
    // Around a loop, and after it.
    let around = format!("{GO}FOR i FROM 1 TO 3 DO\n{HERE}{GO}{GO}ENDFOR\n");
    assert!(left(&around, "")[0] && left(&around, "")[2]);
    let behind = format!("{GO}{GO}WHILE n>1 DO\n{GO}{GO}ENDWHILE\n{HERE}{GO}");
    assert_eq!(left(&behind, ""), [false, true, false, true, false]);
    // After a call that moves, also with a computed name, and within a called routine.
    let goes = format!("PROC go()\n{GO}ENDPROC");
    assert!(left(&format!("{GO}go;\n{HERE}"), &goes)[1]);
    assert!(left(&format!("{GO}%\"go\"%;\n{HERE}"), &goes)[1]);
    let places = format!("PROC here()\n{HERE}ENDPROC");
    assert_eq!(left(&format!("{GO}IF n>1 {GO}here;\n{GO}"), &places), [true, true, false]);
    // A routine called from elsewhere, an interrupt, and the next cycle.
    assert_eq!(left(GO, &places), [true]);
    assert_eq!(left(&format!("{HERE}{GO}"), ""), [true]);
    let interrupt = format!("TRAP t\n{HERE}ENDTRAP");
    assert_eq!(left(&format!("CONNECT i WITH t;\n{GO}{GO}"), &interrupt), [true, true]);
    // A routine without motions changes nothing.
    let still = "PROC still()\nn:=n+1;\nENDPROC";
    assert_eq!(left(&format!("{GO}{GO}still;\nn:=2;\n{HERE}{GO}"), still), [false, true, false]);
}

/// Motions that may follow each other across a call or a return, as pairs of lines.
#[test]
fn motions_follow_each_other_across_calls() {
    const GO: &str = "MoveL p,v100,fine,tool0;\n";
    let pairs = |main: &str, routines: &str| {
        let text = format!("MODULE A\nPROC main()\n{main}ENDPROC\n{routines}ENDMODULE\n").replace("GO", GO);
        let task = truegrind_programs::rapid::Task::read(&[("a.mod", text.as_bytes())]);
        let line = |motion: u32| task.listing.motions[motion as usize].place.line;
        task.listing.across_calls.iter().map(|pair| pair.map(line)).collect::<Vec<_>>()
    };
    assert!(pairs("GOGO", "PROC a()\nGOENDPROC\n").is_empty());
    // Lines 3 and 5 of main, 8 and 9 of the routine.
    assert_eq!(pairs("GOa;\nGO", "PROC a()\nGOGOENDPROC\n"), [[3, 8], [9, 5]]);
    // A branch may pass, and what is behind it follows as well.
    let branch = "PROC a()\nIF n=1 THEN\nGOENDIF\nGOENDPROC\n";
    assert_eq!(pairs("GOa;\nGO", branch), [[3, 9], [3, 11], [11, 5]]);
    // Through a routine that only calls, and from one call to the next.
    let deep = "PROC a()\nb;\nENDPROC\nPROC b()\nGOENDPROC\n";
    assert_eq!(pairs("GOa;\na;\nGO", deep), [[3, 12], [12, 6], [12, 12]]);
    // A routine that moves ends what came before it; one that may pass does not.
    let two = "PROC a()\nGOGOENDPROC\nPROC b()\nGOENDPROC\n";
    assert_eq!(pairs("GOa;\nb;\nGO", two), [[3, 9], [10, 13], [13, 6]]);
    let passing = "PROC a()\nIF n=1 THEN\nGOENDIF\nENDPROC\nPROC b()\nGOENDPROC\n";
    assert_eq!(pairs("GOa;\nb;\nGO", passing), [[3, 10], [3, 14], [10, 14], [14, 6]]);
    // From one iteration to the next, and out of the loop.
    let repeated = "WHILE n<3 DO\na;\nb;\nENDWHILE\nGO";
    assert_eq!(pairs(repeated, two), [[11, 14], [14, 7], [14, 10]]);
    // What a label is reached from may be any call of the routine.
    let jump = "a;\nGoto n;\nb;\nn:\nGO";
    assert!(pairs(jump, two).contains(&[11, 7]));
    // A function may move, too, and so may what a name computed at run time calls.
    let function = "FUNC bool a()\nGOGORETURN TRUE;\nENDFUNC\n";
    assert_eq!(pairs("GOok:=a();\nGO", function), [[3, 8], [9, 5]]);
    assert!(pairs("GO%name%;\nGO", two).contains(&[9, 5]));
    // However many calls there are.
    let many: String = (0..300).map(|k| format!("r{k};\n")).collect();
    let routines: String = (0..300).map(|k| format!("PROC r{k}()\nGOENDPROC\n")).collect();
    let found = pairs(&many, &routines);
    assert_eq!(found.len(), 299);
    assert!(found.iter().all(|[before, behind]| before + 3 == *behind));
    // A routine without motions is no call that counts; one that calls itself ends.
    assert!(pairs("GOa;\nGO", "PROC a()\nn:=1;\nENDPROC\n").is_empty());
    assert_eq!(pairs("GOa;\nGO", "PROC a()\nGOIF n=1 a;\nENDPROC\n"), [[3, 8], [8, 5], [8, 8]]);
}

/// All motions from which one may begin that has none before it in the text alone, as lines.
#[test]
fn what_comes_before_is_known_where_all_of_it_is() {
    const GO: &str = "MoveL p,v100,fine,tool0;\n";
    let before = |main: &str, routines: &str| {
        let text = format!("MODULE A\nPROC main()\nConfL\\Off;\n{main}ENDPROC\n{routines}ENDMODULE\n")
            .replace("GO", GO);
        let task = truegrind_programs::rapid::Task::read(&[("a.mod", text.as_bytes())]);
        let line = |motion: &u32| task.listing.motions[*motion as usize].place.line;
        let found = task.listing.predecessors.iter();
        found
            .map(|(motion, before)| (line(motion), before.iter().map(line).collect()))
            .collect::<Vec<(u32, Vec<u32>)>>()
    };
    assert_eq!(before("GOa;\nGO", "PROC a()\nGOGOENDPROC\n"), [(6, vec![10]), (9, vec![4])]);
    assert_eq!(before("GOIF n=1 THEN\nGOENDIF\nGO", ""), [(8, vec![4, 6])]);
    assert_eq!(before("GOFOR i FROM 1 TO 2 DO\nGOENDFOR\nGO", ""), [(6, vec![4, 6]), (8, vec![4, 6])]);
    // Main begins anywhere, and so does what nobody calls; a routine of no file may move the arm, and an interrupt as well.
    assert!(before("IF n=1 THEN\nGOENDIF\nGO", "PROC a()\nIF n=1 THEN\nGOENDIF\nGOENDPROC\n").is_empty());
    assert!(before("GOElsewhere;\nGO", "").is_empty());
    assert!(before("GOa;\nGO", "PROC a()\nGOElsewhere;\nENDPROC\n").iter().all(|(line, _)| *line == 9));
    assert!(before("CONNECT i WITH t;\nGOa;\nGO", "PROC a()\nGOENDPROC\nTRAP t\nGOENDTRAP\n").is_empty());
    // A handler that resumes leads to every motion of its routine.
    let resumes = "PROC a()\nGOIF n=1 THEN\nGOENDIF\nGOERROR\nGOTRYNEXT;\nENDPROC\n";
    assert!(before("GOa;\n", resumes).iter().all(|(line, _)| *line == 8));
}

/// What no file declares and RobotWare does not have is listed with its lines; own routines, instructions and functions are not.
#[test]
fn calls_of_routines_that_no_file_declares_are_listed() {
    let text = b"MODULE A\n PROC main()\n  SetDO valve,1;\n  SetShift;\n  own;\n  WaitTime 1;\n  setshift;\n  TPWrite \"a\";\n  \
                 ConfL\\Off;\n  Elsewhere 4,2;\n  a:=Offs(b,1,2,3);\n ENDPROC\n PROC own()\n ENDPROC\nENDMODULE\n";
    let task = truegrind_programs::rapid::Task::read(&[("a.mod", text)]);
    let calls: Vec<_> =
        task.listing.outside_calls.iter().map(|call| (call.name.as_str(), call.place.line)).collect();
    assert_eq!(calls, [("SetShift", 4), ("setshift", 7), ("Elsewhere", 10)]);
    // By a computed name: where no procedure of the files has such a name.
    let text = b"MODULE A\n PROC main()\n  %\"own\"%;\n  %\"o\"+b%;\n  %\"A:own\"%;\n  CallByVar \"proc\",1;\n  %b%;\n  %\"Gone\"%;\n  \
                 %\"Cut\"+b%;\n  CallByVar \"Cut\",3;\n  %\"own\"% 3;\n ENDPROC\n PROC own()\n ENDPROC\n PROC proc1()\n ENDPROC\nENDMODULE\n";
    let task = truegrind_programs::rapid::Task::read(&[("a.mod", text)]);
    let calls: Vec<_> =
        task.listing.outside_calls.iter().map(|call| (call.name.as_str(), call.place.line)).collect();
    assert_eq!(calls, [("\"Gone\"", 8), ("\"Cut\"+b", 9), ("\"Cut\"", 10), ("\"own\"", 11)]);
}
