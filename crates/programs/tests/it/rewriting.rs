//! Rewriting: new values are written and read back.

use truegrind_programs::motion::{Mark, MotionKind, Reason, TargetValue};
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Program;
use truegrind_programs::rewrite::{Change, Extra, NewTarget, RewriteOptions, RewriteOutcome, Rewritten};

use super::samples::{groups, read};

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

fn module(data: &str, body: &str) -> String {
    format!("MODULE M\n{data}PROC main()\n{body}ENDPROC\nENDMODULE\n")
}

fn at(x: f64, y: f64, z: f64) -> NewTarget {
    NewTarget::Cartesian { position_mm: [x, y, z], quaternion: [0.0, 0.0, 1.0, 0.0], conf: None }
}

fn change(motion: u32, target: NewTarget) -> Change {
    Change { motion, targets: [target].into(), before: vec![] }
}

fn rewrite(source: &str, changes: &[Change]) -> (String, Rewritten) {
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{:?}", task.listing.opaque);
    let rewritten = task.rewrite(changes, &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    (String::from_utf8(text).unwrap(), rewritten)
}

#[test]
fn only_numbers_that_change_are_replaced_with_enough_decimals() {
    let source = module(
        "",
        &format!("  MoveL [ [500 , -100.5,3E2],[0,0,1,0] ,[0,0,0,0],{EXT}] , v100,fine,tool0; ! keep\n"),
    );
    let (text, rewritten) = rewrite(&source, &[change(0, at(500.125, -100.5, 299.000_04))]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::InPlace]);
    assert_eq!(text, source.replace("500 ,", "500.1250 ,").replace("3E2", "299.0000"));

    // More decimals in the source than requested are kept; a sign goes with its number; no -0.
    let source =
        module("", &format!("  MoveL [[500.123456,- 0.5,3],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0;\n"));
    let (text, _) = rewrite(&source, &[change(0, at(500.123_457_4, -0.000_01, 3.0))]);
    assert_eq!(text, source.replace("500.123456", "500.123457").replace("- 0.5", "0.0000"));
}

#[test]
fn a_quaternion_stays_normalised_after_rounding_and_keeps_its_sign() {
    let source =
        module("", &format!("  MoveL [[1,2,3],[-0.5,-0.5,-0.5,-0.5],[0,0,0,0],{EXT}],v100,fine,tool0;\n"));
    let q = [0.501_234_56, 0.498_765_4, 0.500_123_4, 0.499_876_5];
    let new = NewTarget::Cartesian { position_mm: [1.0, 2.0, 3.0], quaternion: q, conf: Some([0, -1, 0, 1]) };
    let (text, _) = rewrite(&source, &[change(0, new)]);
    let task = Task::read(&[("m.mod", text.as_bytes())]);
    let Ok(TargetValue::Cartesian(found)) = task.listing.motions[0].targets[0].value else { panic!() };
    let length: f64 = found.quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    assert!((length - 1.0).abs() < 1e-7, "{length}");
    assert!(found.quaternion.iter().all(|&q| q < 0.0));
    let scale = q.iter().map(|q| q * q).sum::<f64>().sqrt();
    for (found, wanted) in found.quaternion.iter().zip(q) {
        assert!((found + wanted / scale).abs() < 2e-7);
    }
    assert_eq!(found.conf, [0, -1, 0, 1]);
    assert!(text.contains("],[0,-1,0,1],"), "{text}");
}

#[test]
fn a_shared_declaration_is_edited_once_where_all_agree() {
    let data = format!("  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}];\n");
    let source = module(&data, "  MoveJ p,v100,fine,tool0;\n  MoveL p,v50,fine,tool0;\n");
    let (text, rewritten) =
        rewrite(&source, &[change(0, at(501.0, 0.0, 300.0)), change(1, at(501.0, 0.0, 300.0))]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::InPlace, RewriteOutcome::InPlace]);
    assert_eq!(rewritten.files[0].edits.len(), 1);
    assert_eq!(text, source.replace("[500,", "[501.0000,"));
}

#[test]
fn a_shared_declaration_is_split_where_uses_differ() {
    let long = "pWithANameOfNearlyThirtyTwoChars";
    for (local, comment) in [("", ""), ("LOCAL ", " ! taught")] {
        let data =
            format!("  {local}CONST robtarget {long}:=[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}];{comment}\n");
        let body = format!(
            "  MoveL {long},v100,fine,tool0;\n  MoveL {long},v50,fine,tool0;\n  MoveL {long},v50,fine,tool0;\n"
        );
        let source = module(&data, &body);
        // Two agree, one is unmodified: the declaration is unchanged.
        let (text, rewritten) =
            rewrite(&source, &[change(1, at(501.0, 0.0, 300.0)), change(2, at(501.0, 0.0, 300.0))]);
        let name = "pWithANameOfNearlyThirtyTwoCha_2".to_owned();
        assert_eq!(name.len(), 32);
        assert_eq!(
            rewritten.outcomes,
            [RewriteOutcome::Split(name.clone()), RewriteOutcome::Split(name.clone())]
        );
        let clone = format!(
            "{comment}\n  {local}CONST robtarget {name}:=[[501.0000,0,300],[0,0,1,0],[0,0,0,0],{EXT}];\nPROC"
        );
        let expected = source
            .replace(&format!("{comment}\nPROC"), &clone)
            .replace(&format!("MoveL {long},v50"), &format!("MoveL {name},v50"));
        assert_eq!(text, expected);
        // All three differ: the first keeps the declaration.
        let changes = [
            change(0, at(501.0, 0.0, 300.0)),
            change(1, at(502.0, 0.0, 300.0)),
            change(2, at(503.0, 0.0, 300.0)),
        ];
        let (text, rewritten) = rewrite(&source, &changes);
        assert_eq!(rewritten.outcomes[0], RewriteOutcome::InPlace);
        let again = Task::read(&[("m.mod", text.as_bytes())]);
        let x: Vec<f64> = again
            .listing
            .motions
            .iter()
            .map(|motion| motion.targets[0].value.unwrap().cartesian().unwrap().position_mm[0])
            .collect();
        assert_eq!(x, [501.0, 502.0, 503.0]);
    }
}

#[test]
fn a_declaration_with_other_uses_is_unmodified_and_the_motion_gets_a_clone() {
    let data = format!("  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}];\n  VAR num i;\n");
    let source =
        module(&data, "  MoveL p,v100,fine,tool0;\n  MoveL Offs(p,i,0,0),v50,fine,tool0;\n  i:=2;\n");
    let (text, rewritten) = rewrite(&source, &[change(0, at(501.0, 0.0, 300.0))]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::Split("p_2".into())]);
    assert!(text.contains("CONST robtarget p:=[[500,0,300]") && text.contains("MoveL p_2,v100"), "{text}");
}

#[test]
fn a_computed_target_becomes_a_literal_even_where_only_its_base_moves() {
    let data = format!("  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,1,2,3],{EXT}];\n");
    let source = module(&data, "  MoveL p,v100,fine,tool0;\n  MoveL Offs(p,10,0,-5),v50,fine,tool0;\n");
    let (text, rewritten) =
        rewrite(&source, &[change(0, at(501.0, 0.0, 300.0)), change(1, at(510.0, 0.0, 295.0))]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::InPlace, RewriteOutcome::Inlined]);
    let literal = "[[510.0000,0.0000,295.0000],[0.0000000,0.0000000,1.0000000,0.0000000],[0,1,2,3],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]]";
    assert_eq!(text, source.replace("[500,", "[501.0000,").replace("Offs(p,10,0,-5)", literal));
}

#[test]
fn array_elements_change_in_place_or_in_the_instruction() {
    let target = |x: i32| format!("[[{x},0,300],[0,0,1,0],[0,0,0,0],{EXT}]");
    let data = format!("  CONST robtarget p{{2}}:=[{},{}];\n", target(500), target(600));
    let source = module(
        &data,
        "  MoveL p{1},v100,fine,tool0;\n  MoveL p{2},v50,fine,tool0;\n  MoveL p{2},v10,fine,tool0;\n",
    );
    let changes = [
        change(0, at(501.0, 0.0, 300.0)),
        change(1, at(601.0, 0.0, 300.0)),
        change(2, at(602.0, 0.0, 300.0)),
    ];
    let (text, rewritten) = rewrite(&source, &changes);
    assert_eq!(
        rewritten.outcomes,
        [RewriteOutcome::InPlace, RewriteOutcome::InPlace, RewriteOutcome::Inlined]
    );
    assert!(text.contains("[501.0000,0,300]") && text.contains("[601.0000,0,300]"));
    assert!(text.contains("MoveL [[602.0000,0.0000,300.0000]"), "{text}");
}

#[test]
fn a_linear_motion_can_be_rewritten_in_joints() {
    let source = module(
        "",
        "  movel [[500,0,300],[0,0,1,0],[0,0,0,0],[100,9E9,9E9,9E9,9E9,9E9]],v100,z5,tool0\\WObj:=wobj0;\n",
    );
    let joints = NewTarget::Joint { robot_deg: [1.0, -2.5, 3.123_456_78, 0.0, 90.0, -0.000_000_01] };
    let (text, rewritten) = rewrite(&source, &[change(0, joints)]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::Inlined]);
    let line = "  MoveAbsJ [[1.000000,-2.500000,3.123457,0.000000,90.000000,0.000000],[100,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,z5,tool0\\WObj:=wobj0;\n";
    assert_eq!(text, module("", line));
}

#[test]
fn a_named_argument_takes_its_name_in_the_joint_form() {
    let line = |name: &str, value: &str| format!("  {name} := {value},v100,z5,tool0;\n");
    let value = "[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let joints = NewTarget::Joint { robot_deg: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
    let (text, rewritten) = rewrite(&module("", &line("MoveJ ToPoint", value)), &[change(0, joints)]);
    assert_eq!(rewritten.outcomes, [RewriteOutcome::Inlined]);
    let told =
        "[[1.000000,2.000000,3.000000,4.000000,5.000000,6.000000],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]]";
    assert_eq!(text, module("", &line("MoveAbsJ ToJointPos", told)));
}

#[test]
fn instructions_that_set_a_signal_have_no_joint_form() {
    for name in ["MoveLDO", "MoveJDO", "MoveLAO", "MoveJAO", "MoveLGO", "MoveJGO"] {
        let signal = if name.ends_with("GO") { "go1\\Value:=1" } else { "do1,1" };
        let target = format!("[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}]");
        let source = module("", &format!("  {name} {target},v100,z5,tool0,{signal};\n"));
        let joints = NewTarget::Joint { robot_deg: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0] };
        let (text, rewritten) = rewrite(&source, &[change(0, joints)]);
        assert_eq!(
            (rewritten.outcomes, text),
            (vec![RewriteOutcome::Refused(Reason::NoJointForm)], source),
            "{name}"
        );
    }
}

#[test]
fn extra_motions_take_over_speed_tool_and_process() {
    let extra = Extra { kind: MotionKind::Linear, target: at(450.0, 0.0, 300.0), external: None };
    let cases = [
        (
            "MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],EXT],v100\\V:=90,fine\\Inpos:=inpos50,tGrind\\WObj:=w;",
            "MoveL TARGET,v100\\V:=90,z1,tGrind\\WObj:=w;",
        ),
        (
            "MoveLDO [[500,0,300],[0,0,1,0],[0,0,0,0],EXT],v100,fine,tGrind,do1,1;",
            "MoveL TARGET,v100,z1,tGrind;",
        ),
        (
            "FCPressL [[500,0,300],[0,0,1,0],[0,0,0,0],EXT],v100,20,fine,tGrind;",
            "FCPressL TARGET,v100,20,z1,tGrind;",
        ),
        (
            "ArcLEnd [[500,0,300],[0,0,1,0],[0,0,0,0],EXT],v100,sm,wd\\Weave:=wv,fine,tGrind;",
            "ArcL TARGET,v100,sm,wd\\Weave:=wv,z1,tGrind;",
        ),
    ];
    let data = "  PERS tooldata tGrind:=[TRUE,[[0,0,1],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n  PERS wobjdata w:=[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n";
    let target = "[[450.0000,0.0000,300.0000],[0.0000000,0.0000000,1.0000000,0.0000000],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]]";
    for (line, inserted) in cases {
        let line = line.replace("EXT", EXT);
        let source = module(data, &format!("    {line} ! end\n"));
        let change = Change { motion: 0, targets: Default::default(), before: vec![extra.clone()] };
        let (text, rewritten) = rewrite(&source, &[change]);
        assert_eq!(rewritten.outcomes, [RewriteOutcome::InPlace]);
        let inserted = inserted.replace("TARGET", target);
        assert_eq!(text, module(data, &format!("    {inserted}\n    {line} ! end\n")));
    }
}

#[test]
fn impossible_changes_are_refused_with_their_reason() {
    let extra = || vec![Extra { kind: MotionKind::Linear, target: at(450.0, 0.0, 300.0), external: None }];
    let p = format!("[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}]");
    let joints = NewTarget::Joint { robot_deg: [0.0; 6] };
    let cases = [
        (format!("IF x MoveL {p},v100,fine,tool0;"), vec![], extra(), Reason::NoInsertion),
        (format!("MoveL {p},v100\\T:=2,fine,tool0;"), vec![], extra(), Reason::NoInsertion),
        (format!("MoveC {p},{p},v100,fine,tool0;"), vec![], extra(), Reason::NoInsertion),
        (format!("FCPressL {p},v100,5,fine,tool0;"), vec![joints], vec![], Reason::NoJointForm),
        (
            format!("MoveAbsJ [[0,0,0,0,0,0],{EXT}],v100,fine,tool0;"),
            vec![at(1.0, 2.0, 3.0)],
            vec![],
            Reason::WrongKind,
        ),
        (format!("MoveL {p},v100,fine,tool9;"), vec![at(1.0, 2.0, 3.0)], vec![], Reason::ToolUnknown),
    ];
    for (line, targets, before, reason) in cases {
        let source = module("", &format!("  {line}\n"));
        let (text, rewritten) = rewrite(&source, &[Change { motion: 0, targets: targets.into(), before }]);
        assert_eq!(rewritten.outcomes, [RewriteOutcome::Refused(reason)], "{line}");
        assert_eq!(text, source);
    }
}

#[test]
fn two_changes_of_one_motion_are_an_error() {
    let source = module("", &format!("  MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0;\n"));
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let changes = [change(0, at(501.0, 0.0, 300.0)), change(0, at(502.0, 0.0, 300.0))];
    let error = task.rewrite(&changes, &RewriteOptions::default()).unwrap_err();
    assert!(error.to_string().contains("overlap"), "{error}");
}

#[test]
fn a_changed_file_is_marked_once_and_an_unchanged_one_not() {
    let mark = |model: &str| Mark { version: "0.1.0".into(), model: model.into(), partial: false };
    let options = |model: &str| RewriteOptions { mark: Some(mark(model)), ..RewriteOptions::default() };
    let source = module("", &format!("  MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0;\n"));
    let source = source.replace('\n', "\r\n");
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert_eq!(task.listing.marks, [None]);
    let same = task.rewrite(&[change(0, at(500.0, 0.0, 300.0))], &options("abc")).unwrap();
    assert!(same.files[0].edits.is_empty());

    let first = task.rewrite(&[change(0, at(501.0, 0.0, 300.0))], &options("abc")).unwrap();
    let text = first.files[0].edits.apply(source.as_bytes()).unwrap();
    assert!(text.starts_with(b"MODULE M\r\n! truegrind 0.1.0 model abc\r\nPROC main()"));
    let task = Task::read(&[("m.mod", &text)]);
    assert_eq!(task.listing.marks, [Some(mark("abc"))]);
    let again = task.rewrite(&[change(0, at(502.0, 0.0, 300.0))], &options("def")).unwrap();
    let text = again.files[0].edits.apply(&text).unwrap();
    assert!(text.starts_with(b"MODULE M\r\n! truegrind 0.1.0 model def\r\nPROC main()"));

    let fragment = format!("MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0;");
    let task = Task::read(&[("f.txt", fragment.as_bytes())]);
    let rewritten = task.rewrite(&[change(0, at(501.0, 0.0, 300.0))], &options("abc")).unwrap();
    assert!(rewritten.files[0].unmarked);
    assert_eq!(rewritten.files[0].edits.len(), 1);
}

/// New lines ended with line feeds, and a declaration before a comment went to the end of the file.
#[test]
fn a_file_whose_lines_end_with_carriage_returns_alone_keeps_them() {
    let source = module(
        &format!("  CONST robtarget p:=[[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}]; ! here\n  VAR num n;\n"),
        "  MoveL p,v100,z1,tool0;\n  MoveL p,v100,fine,tool0;\n",
    );
    let extra = Extra { kind: MotionKind::Linear, target: at(490.0, 1.0, 300.0), external: None };
    let changes = [
        change(0, at(501.0, 0.0, 300.0)),
        Change { before: vec![extra], ..change(1, at(502.0, 0.0, 300.0)) },
    ];
    let mark = Mark { version: "0.1.0".into(), model: "abc".into(), partial: false };
    let options = RewriteOptions { mark: Some(mark), ..RewriteOptions::default() };
    let corrected = |source: &str| {
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        let lines: Vec<u32> = task.listing.motions.iter().map(|motion| motion.place.line).collect();
        let edits = &task.rewrite(&changes, &options).unwrap().files[0].edits;
        (lines, String::from_utf8(edits.apply(source.as_bytes()).unwrap()).unwrap())
    };
    let (lines, text) = corrected(&source);
    assert_eq!(lines, [5, 6]);
    assert!(text.lines().count() == source.lines().count() + 3, "{text}");
    assert_eq!(corrected(&source.replace('\n', "\r")), (lines, text.replace('\n', "\r")));
}

#[test]
fn each_changed_module_is_marked_behind_its_head() {
    let mark = Mark { version: "0.1.0".into(), model: "abc".into(), partial: false };
    let options = RewriteOptions { mark: Some(mark.clone()), ..RewriteOptions::default() };
    let go = format!("PROC a() MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],{EXT}],v100,fine,tool0; ENDPROC");
    let written = |source: &str, motion: u32| {
        let task = Task::read(&[("m.mod", source.as_bytes())]);
        assert!(task.listing.opaque.is_empty(), "{:?}", task.listing.opaque);
        let rewritten = task.rewrite(&[change(motion, at(501.0, 0.0, 300.0))], &options).unwrap();
        assert!(!rewritten.files[0].unmarked);
        let text = String::from_utf8(rewritten.files[0].edits.apply(source.as_bytes()).unwrap()).unwrap();
        let again = Task::read(&[("m.mod", text.as_bytes())]);
        assert_eq!(again.listing.marks, [Some(mark.clone())], "{text}");
        assert!(again.listing.opaque.is_empty(), "{text}");
        text
    };
    let line = "! truegrind 0.1.0 model abc\n";
    // All on one line.
    let text = written(&format!("MODULE M {go} ENDMODULE"), 0);
    assert!(text.starts_with(&format!("MODULE M\n{line} PROC a()")), "{text}");
    // Attributes on lines of their own.
    let text = written(&format!("MODULE M(SYSMODULE,\n NOVIEW)\n{go}\nENDMODULE\n"), 0);
    assert!(text.starts_with(&format!("MODULE M(SYSMODULE,\n NOVIEW)\n{line}PROC a()")), "{text}");
    // The second of three.
    let three = ["A", "B", "C"].map(|name| format!("MODULE {name}\n{go}\nENDMODULE\n")).concat();
    let text = written(&three, 1);
    assert_eq!(text.matches("! truegrind").count(), 1);
    assert!(text.contains(&format!("MODULE B\n{line}PROC a()")), "{text}");
}

/// Every motion of every sample is displaced by its own amount and read back: values within rounding, unmodified
/// motions as before, and refused motions with the reason in the listing.
#[test]
fn every_sample_reads_back_what_was_written() {
    for (name, files) in &groups() {
        let task = read(files);
        let changes: Vec<Change> = (0_u32..)
            .zip(&task.listing.motions)
            .map(|(motion, listed)| {
                let shift = 0.1 + f64::from(motion) * 0.01;
                let targets = listed.targets.iter().map(|target| match target.value {
                    Ok(TargetValue::Cartesian(t)) => {
                        let turn = nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(
                            shift * 0.1,
                            0.0,
                            0.02,
                        ));
                        let q = turn * t.pose().rotation;
                        NewTarget::Cartesian {
                            position_mm: t.position_mm.map(|x| x + shift),
                            quaternion: [q.w, q.i, q.j, q.k],
                            conf: None,
                        }
                    }
                    Ok(TargetValue::Joint(t)) => {
                        NewTarget::Joint { robot_deg: t.robot_deg.map(|q| q + shift) }
                    }
                    Err(_) => NewTarget::Keep,
                });
                Change { motion, targets: targets.collect(), before: vec![] }
            })
            .collect();
        let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
        let new: Vec<(String, Vec<u8>)> = files
            .iter()
            .zip(&rewritten.files)
            .map(|((name, bytes), file)| (name.clone(), file.edits.apply(bytes).unwrap()))
            .collect();
        let again = read(&new);
        assert_eq!(again.listing.motions.len(), task.listing.motions.len(), "{name}");
        assert_eq!(again.listing.opaque.len(), task.listing.opaque.len(), "{name}");
        for (index, (before, after)) in task.listing.motions.iter().zip(&again.listing.motions).enumerate() {
            let refused = before.reason();
            match &rewritten.outcomes[index] {
                RewriteOutcome::Refused(reason) => assert_eq!(Some(*reason), refused, "{name}"),
                other => {
                    assert!(
                        refused.is_none() && *other != RewriteOutcome::Unchanged,
                        "{name} {index} {other:?}"
                    )
                }
            }
            for (target, (old, new)) in before.targets.iter().zip(&after.targets).enumerate() {
                let wanted = if refused.is_some() { NewTarget::Keep } else { changes[index].targets[target] };
                match (wanted, &new.value) {
                    (
                        NewTarget::Cartesian { position_mm, quaternion, .. },
                        Ok(TargetValue::Cartesian(found)),
                    ) => {
                        for (a, b) in position_mm.iter().zip(&found.position_mm) {
                            assert!((a - b).abs() <= 0.500_001e-4, "{name} {index}");
                        }
                        let [w, x, y, z] = quaternion;
                        let wanted =
                            nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
                        assert!(wanted.angle_to(&found.pose().rotation) < 5e-7, "{name} {index}");
                    }
                    (NewTarget::Joint { robot_deg }, Ok(TargetValue::Joint(found))) => {
                        for (a, b) in robot_deg.iter().zip(&found.robot_deg) {
                            assert!((a - b).abs() <= 0.500_001e-6, "{name} {index}");
                        }
                    }
                    (NewTarget::Keep, _) => assert_eq!(old.value, new.value, "{name} {index}"),
                    other => panic!("{name} {index} {other:?}"),
                }
            }
        }
    }
}

#[test]
fn twenty_thousand_targets_on_one_line_take_linear_time() {
    let target = |index: usize| format!("[[{index},0,300],[0,0,1,0],[0,0,0,0],{EXT}]");
    let list: Vec<String> = (0..10_000).map(target).collect();
    let mut body: String =
        (1..=10_000).map(|index| format!("MoveL path{{{index}}},v100,z1,tool0;")).collect();
    body.extend((0..10_000).map(|index| format!("MoveL {},v100,z1,tool0;", target(index))));
    let source = format!(
        "MODULE M CONST robtarget path{{10000}}:=[{}]; PROC main() {body} ENDPROC ENDMODULE",
        list.join(",")
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert_eq!(task.listing.motions.len(), 20_000);
    let changes: Vec<Change> = (0..20_000_u32)
        .map(|motion| change(motion, at(f64::from(motion % 10_000) + 0.5, 0.0, 300.0)))
        .collect();
    let rewritten = task.rewrite(&changes, &RewriteOptions::default()).unwrap();
    assert!(rewritten.outcomes.iter().all(|outcome| *outcome == RewriteOutcome::InPlace));
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    let again = Task::read(&[("m.mod", &text)]);
    for (index, motion) in again.listing.motions.iter().enumerate() {
        let x = motion.targets[0].value.unwrap().cartesian().unwrap().position_mm[0];
        assert_eq!(x, (index % 10_000) as f64 + 0.5);
    }
}

/// A corrected program differs from its original in its motions and targets alone; a condition turned round was "ok".
#[test]
fn what_differs_outside_the_motions_is_told() {
    let target = "[[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";
    let original = format!(
        "MODULE M\n  CONST robtarget p10:={target};\n  VAR num n;\n  PROC main()\n    n:=3;\n    IF di1=1 THEN\n    MoveL \
         p10,v100,fine,tool0;\n    ENDIF\n    MoveL Offs(p10,0,0,5),v100,fine,tool0;\n    MoveL CRobT(),v100,fine,tool0;\n  ENDPROC\nENDMODULE\n"
    );
    let read = |text: &str| Program::read(&[("m.mod", text.to_owned().leak().as_bytes())], &Setup::default());
    let found = |text: &str| read(&original).text_differences(&read(text));
    // What a correction does: numbers, a copy of a declaration, a literal, an inserted motion, a mark, other blanks.
    let moved = target.replace("500", "501");
    let corrected = original
        .replace("MODULE M\n", "MODULE M\n! truegrind 1.0.0 model abc\n")
        .replace(&format!("p10:={target};"), &format!("p10:={target};\n  CONST robtarget p10_2:={moved};"))
        .replace("MoveL p10", &format!("MoveL {moved},v100,z1,tool0;\n    MoveL p10_2"))
        .replace("Offs(p10,0,0,5)", &moved)
        .replace("n:=3", "N := 3");
    assert_eq!(found(&corrected), Vec::<String>::new());
    for (from, to, words) in [
        ("di1=1", "di1=0", "line 8: `IF di1=0 THEN` here, `IF di1=1 THEN` in the original"),
        ("N := 3", "N := 4", "line 7: `N := 4;` here, `n:=3;` in the original"),
        ("    ENDIF\n", "    SetDO do1,1;\n    ENDIF\n", "`SetDO do1,1;` here, `ENDIF` in the original"),
        ("CRobT()", "CRobT(\\Tool:=tool0)", "line 13"),
        ("  ENDPROC\nENDMODULE\n", "  ENDPROC\n", "line 15: nothing here, `ENDMODULE`"),
    ] {
        assert_ne!(corrected.replace(from, to), corrected, "{from}");
        let found = found(&corrected.replace(from, to));
        assert!(found.len() == 1 && found[0].contains(words), "{from}: {found:?}");
    }
}

/// Text that changed its place between motions, and arguments of a motion besides its target: both were "ok".
#[test]
fn the_place_of_text_and_the_other_arguments_of_motions_are_compared() {
    let at = |x: f64| format!("[[{x},0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    let lines = [
        "MoveAbsJ [[0,10,10,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v1000,fine,tool0;".to_owned(),
        format!("MoveJ {},v100,z10,tool0;", at(500.0)),
        format!("MoveJ {},v100,fine,tool0;", at(505.0)),
        "SetDO do1,1;".to_owned(),
        format!("MoveL {},v50,z1,tool0;", at(510.0)),
        format!("TriggL ToPoint:={},v50,trg1,z1,tool0;", at(515.0)),
        format!("MoveC {},{},v50,fine,tool0;", at(520.0), at(525.0)),
        format!("MoveLDO {},v50,fine,tool0,do1,0;", at(530.0)),
    ];
    let module = |lines: &[String]| {
        let body = lines.join("\n");
        format!("MODULE M\nVAR triggdata trg1;\nPROC main()\n{body}\nENDPROC\nENDMODULE\n")
    };
    let read = |text: &str| Program::read(&[("m.mod", text.to_owned().leak().as_bytes())], &Setup::default());
    let original = module(&lines);
    let found = |lines: &[String]| read(&original).text_differences(&read(&module(lines)));
    assert_eq!(read(&original).listing().motions.iter().filter(|m| m.reason().is_none()).count(), 7);
    // What a correction does: targets, inserted motions, a circle in pieces, joints.
    let mut corrected = lines.clone();
    corrected[4] = format!("MoveL {0},v50,z1,tool0;\nMoveL {0},v50,z1,tool0;", at(511.0));
    corrected[6] = format!("MoveL {0},v50,z1,tool0;\nMoveL {0},v50,fine,tool0;", at(526.0));
    assert_eq!(found(&corrected), Vec::<String>::new());
    corrected[4] = lines[4]
        .replace("MoveL", "MoveAbsJ")
        .replace(&at(510.0), "[[0,10,10,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]]");
    assert_eq!(found(&corrected), Vec::<String>::new());
    corrected[4] = lines[4].clone();
    let with = |edit: &dyn Fn(&mut [String])| {
        let mut lines = corrected.clone();
        edit(&mut lines);
        let found = found(&lines);
        assert_eq!(found.len(), 1, "{lines:?}");
        found[0].clone()
    };
    let earlier = with(&|lines| lines.swap(2, 3));
    assert!(earlier.starts_with("line 6: `SetDO do1,1;` here, `MoveJ [[505"), "{earlier}");
    let later = with(&|lines| lines.swap(3, 4));
    assert!(later.contains("`MoveL [[510"), "{later}");
    for (line, from, to) in [
        (0, "\\NoEOffs", ""),
        (5, "trg1", "trg2"),
        (6, "v50", "v51"),
        (7, "do1,0", "do2,0"),
        (7, "MoveLDO", "MoveL"),
    ] {
        let told = with(&|lines| lines[line] = lines[line].replace(from, to));
        assert!(told.contains("in more than its target"), "{from}: {told}");
    }
}
