//! Persistent data: the controller keeps them when a program ends, and an operator or another task changes them there. An offset by them
//! remains in the program, a target among them is changed where it is declared or not at all, and what else they compute is left.

use truegrind_programs::motion::{MotionKind, Origin, Reason, RobTarget};
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::{Change, Extra, NewTarget, RewriteOptions, RewriteOutcome};

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

fn source(lines: &str) -> String {
    format!(
        "MODULE M\nPERS num stock:=5;\nPERS pos away:=[1,2,3];\nCONST robtarget p:=[[500,-20,300],[0.5,0.5,-0.5,0.5],[0,0,0,0],{EXT}];\n\
         VAR robtarget now;\nPROC main()\n{lines}\nENDPROC\nENDMODULE\n"
    )
}

fn moved(position_mm: [f64; 3]) -> NewTarget {
    NewTarget::Cartesian { position_mm, quaternion: [0.5, 0.5, -0.5, 0.5], conf: None }
}

fn rewritten(source: &str, motion: u32, target: NewTarget) -> (String, RewriteOutcome) {
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let change = Change { motion, targets: [target].into(), before: Vec::new() };
    let mut done = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
    let text = done.files[0].edits.apply(source.as_bytes()).unwrap();
    (String::from_utf8(text).unwrap(), done.outcomes.remove(0))
}

/// The target of the first motion.
fn first(task: &Task<'_>) -> RobTarget {
    *task.listing.motions[0].targets[0].value.as_ref().unwrap().cartesian().unwrap()
}

#[test]
fn an_offset_by_persistent_data_remains() {
    for (expression, kept) in [
        ("Offs(p,1,0,stock)", "],1,0,stock)"),
        ("Offs( p , 1, away.y-2, 2*stock-5 )", "] , 1, away.y-2, 2*stock-5 )"),
        ("Offs(Offs(p,1,0,0),0,0,stock)", "],0,0,stock)"),
    ] {
        let text = source(&format!("MoveL {expression},v100,fine,tool0;"));
        let task = Task::read(&[("m.mod", text.as_bytes())]);
        let target = task.listing.motions[0].targets[0];
        assert_eq!(first(&task).position_mm, [501.0, -20.0, 305.0], "{expression}");
        assert!(matches!(target.origin, Origin::Offset(_)), "{expression}");
        // Written for the value of the file, the target that the controller computes is the new one.
        let (out, outcome) = rewritten(&text, 0, moved([501.5, -20.25, 304.0]));
        assert_eq!(outcome, RewriteOutcome::Inlined);
        assert!(out.contains(kept), "{out}");
        let again = Task::read(&[("m.mod", out.as_bytes())]);
        let found = first(&again);
        assert_eq!(found.position_mm, [501.5, -20.25, 304.0], "{out}");
        // And another value still acts.
        let other = out.replace("stock:=5", "stock:=0");
        let again = Task::read(&[("m.mod", other.as_bytes())]);
        let found = first(&again);
        assert!(found.position_mm[2] < 300.0, "{other}");
    }
}

#[test]
fn an_offset_along_the_tool_remains() {
    let text = source("MoveL RelTool(p,0,0,-stock\\Rz:=stock),v100,fine,tool0;");
    let (out, _) = rewritten(&text, 0, moved([501.5, -20.25, 304.0]));
    assert!(out.contains("],0,0,-stock\\Rz:=stock)"), "{out}");
    let again = Task::read(&[("m.mod", out.as_bytes())]);
    let found = first(&again);
    let off = (0..3).map(|k| (found.position_mm[k] - [501.5, -20.25, 304.0][k]).abs()).fold(0.0, f64::max);
    assert!(off < 1e-3, "{out}");
    assert!((0..4).all(|k| (found.quaternion[k] - [0.5, 0.5, -0.5, 0.5][k]).abs() < 1e-6), "{out}");
}

#[test]
fn what_else_persistent_data_compute_is_left() {
    for (lines, expected) in [
        ("now:=p;\nnow.trans.z:=stock;\nMoveL now,v100,fine,tool0;", Err(Reason::Persistent)),
        ("now:=Offs(p,0,0,stock);\nMoveL now,v100,fine,tool0;", Err(Reason::Persistent)),
        ("MoveL Offs(Offs(p,0,0,stock),1,0,0),v100,fine,tool0;", Err(Reason::Persistent)),
        // What the program itself assigns is known.
        ("stock:=2;\nMoveL Offs(p,0,0,stock),v100,fine,tool0;", Ok(302.0)),
    ] {
        let text = source(lines);
        let task = Task::read(&[("m.mod", text.as_bytes())]);
        let found = task.listing.motions[0].targets[0].value;
        assert_eq!(found.map(|value| value.cartesian().unwrap().position_mm[2]), expected, "{lines}");
    }
    let text = "MODULE M\nVAR num n:=5;\nCONST robtarget p:=[[500,-20,300],[0.5,0.5,-0.5,0.5],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
         PROC main()\nMoveL Offs(p,0,0,n),v100,fine,tool0;\nENDPROC\nENDMODULE\n";
    let task = Task::read(&[("m.mod", text.as_bytes())]);
    assert_eq!(task.listing.motions[0].targets[0].origin, Origin::Computed);
}

/// Such targets and joints would stay where they are when the data change.
#[test]
fn nothing_is_inserted_beside_and_no_joints_are_written() {
    let text = source(
        "MoveL Offs(p,0,0,stock),v100,fine,tool0;\nMoveL p,v100,fine,tool0;\nMoveL p,v100,fine,tool0;",
    );
    let task = Task::read(&[("m.mod", text.as_bytes())]);
    let between = || Extra { kind: MotionKind::Linear, target: moved([500.0, 0.0, 300.0]), external: None };
    let refusal = |motion: u32| {
        let change = Change { motion, targets: [NewTarget::Keep].into(), before: vec![between()] };
        task.rewrite(&[change], &RewriteOptions::default()).unwrap().outcomes.remove(0)
    };
    assert_eq!(refusal(0), RewriteOutcome::Refused(Reason::NoInsertion));
    assert_eq!(refusal(1), RewriteOutcome::Refused(Reason::NoInsertion));
    assert_eq!(refusal(2), RewriteOutcome::InPlace);
    let joints = NewTarget::Joint { robot_deg: [0.0; 6] };
    assert_eq!(rewritten(&text, 0, joints).1, RewriteOutcome::Refused(Reason::Persistent));
}

/// Elements, components and records count as persistent, too, and so does the base of an offset.
#[test]
fn whatever_part_of_persistent_data_is_read_never_becomes_a_number() {
    let data = format!(
        "PERS num off{{2}}:=[1,2];\nPERS pose ps:=[[1,2,3],[1,0,0,0]];\nRECORD job\nrobtarget app;\nnum n;\nENDRECORD\n\
         PERS robtarget pp:=[[500,-20,300],[0.5,0.5,-0.5,0.5],[0,0,0,0],{EXT}];\n\
         PERS job jb:=[[[500,-20,300],[0.5,0.5,-0.5,0.5],[0,0,0,0],{EXT}],3];\nPROC main()"
    );
    let source = |lines: &str| source(lines).replace("PROC main()", &data);
    // Offsets remain in the program.
    for offset in [
        "Offs(p,0,0,off{1})",
        "Offs(p,0,0,ps.trans.z)",
        "Offs(p,0,0,jb.n)",
        "RelTool(p,0,0,-(off{1}+off{2}))",
    ] {
        let text = source(&format!("MoveL {offset},v100,fine,tool0;"));
        let (out, outcome) = rewritten(&text, 0, moved([501.5, -20.25, 304.0]));
        assert_eq!(outcome, RewriteOutcome::Inlined, "{offset}");
        assert!(out.contains(&offset[offset.find(',').unwrap()..]), "{out}");
    }
    for lines in [
        format!("MoveL [[500,-20,off{{1}}],[0.5,0.5,-0.5,0.5],[0,0,0,0],{EXT}],v100,fine,tool0;"),
        "now:=p;\nnow.trans.z:=off{1};\nMoveL now,v100,fine,tool0;".to_owned(),
        "MoveL jb.app,v100,fine,tool0;".to_owned(),
        "MoveL Offs(pp,0,0,5),v100,fine,tool0;".to_owned(),
        "MoveL Offs(p,pp.trans.x-500,0,0),v100,fine,tool0;\nMoveL Offs(pp,0,0,off{1}),v100,fine,tool0;"
            .to_owned(),
        "now:=pp;\nMoveL now,v100,fine,tool0;".to_owned(),
    ] {
        let text = source(&lines);
        let task = Task::read(&[("m.mod", text.as_bytes())]);
        let last = task.listing.motions.last().unwrap();
        assert_eq!(last.reason(), Some(Reason::Persistent), "{lines}");
    }
}

#[test]
fn a_persistent_target_is_changed_where_it_is_declared_or_not_at_all() {
    let declared =
        format!("PERS robtarget pp:=[[500,-20,300],[0.5,0.5,-0.5,0.5],[0,0,0,0],{EXT}];\nPROC main()");
    let source = |lines: &str| source(lines).replace("PROC main()", &declared);
    let alone = source("MoveL pp,v100,fine,tool0;");
    let (out, outcome) = rewritten(&alone, 0, moved([501.5, -20.25, 304.0]));
    assert_eq!(outcome, RewriteOutcome::InPlace);
    assert!(out.contains("PERS robtarget pp:=[[501.5") && out.contains("MoveL pp,"), "{out}");
    // Another reader needs the old value, and a copy would not follow the data.
    for other in ["now:=pp;", "MoveL Offs(pp,0,0,5),v100,fine,tool0;", "MoveL pp,v100,fine,tool0;"] {
        let text = source(&format!("MoveL pp,v100,fine,tool0;\n{other}"));
        let (out, outcome) = rewritten(&text, 0, moved([501.5, -20.25, 304.0]));
        assert_eq!(
            (outcome, out == text),
            (RewriteOutcome::Refused(Reason::Persistent), true),
            "{other}: {out}"
        );
    }
    // Two motions that need two values: the second would follow the first's.
    let twice = source("MoveL pp,v100,fine,tool0;\nMoveL pp,v100,fine,tool0;");
    let task = Task::read(&[("m.mod", twice.as_bytes())]);
    let change = |motion: u32, x: f64| Change {
        motion,
        targets: [moved([x, -20.25, 304.0])].into(),
        before: Vec::new(),
    };
    let both = |x: [f64; 2]| {
        let done = task.rewrite(&[change(0, x[0]), change(1, x[1])], &RewriteOptions::default()).unwrap();
        (done.outcomes, done.files[0].edits.apply(twice.as_bytes()).unwrap() == twice.as_bytes())
    };
    assert_eq!(both([501.5, 501.5]), (vec![RewriteOutcome::InPlace; 2], false));
    assert_eq!(both([501.5, 501.4]), (vec![RewriteOutcome::Refused(Reason::Persistent); 2], true));
    // Neither do joints in its place, nor a target inserted beside it.
    let joints = NewTarget::Joint { robot_deg: [0.0; 6] };
    assert_eq!(rewritten(&alone, 0, joints).1, RewriteOutcome::Refused(Reason::Persistent));
    let two = source("MoveL p,v100,fine,tool0;\nMoveL pp,v100,fine,tool0;");
    let task = Task::read(&[("m.mod", two.as_bytes())]);
    let extra = Extra { kind: MotionKind::Linear, target: moved([500.0, -20.0, 299.0]), external: None };
    let change = Change { motion: 1, targets: [moved([501.5, -20.25, 304.0])].into(), before: vec![extra] };
    let done = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
    assert_eq!(done.outcomes, [RewriteOutcome::Refused(Reason::NoInsertion)]);
}
