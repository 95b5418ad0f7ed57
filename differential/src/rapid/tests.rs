//! The interpreter against what the manuals say: each test is a small program and what it says.

use super::course::{Arc, Course};
use super::run::{Event, Motion, Run, Stop};
use crate::model;

const NONE: fn(usize, usize) -> bool = |_, _| false;

fn ran(text: &str) -> (Vec<Event>, Option<Stop>) {
    let mut run = Run::new(&[text.as_bytes()], 1, &NONE).expect("RAPID");
    run.main(1);
    (run.events, run.ended)
}

/// What main writes, with data and routines around it.
fn says(rest: &str, main: &str) -> Vec<String> {
    let (events, ended) = ran(&format!("MODULE m\n{rest}\nPROC main()\n{main}\nENDPROC\nENDMODULE\n"));
    assert_eq!(ended, None);
    let said = events.into_iter().filter_map(|event| match event {
        Event::Said(text) => text.strip_prefix("tpwrite ").map(|text| text.trim().replace(".000000", "")),
        Event::Motion(_) => None,
    });
    said.collect()
}

fn writes(value: &str) -> String {
    says("", &format!("TPWrite {value};")).remove(0)
}

fn motions(rest: &str, main: &str) -> Vec<Motion> {
    let target = "CONST robtarget p:=[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n";
    let (events, ended) =
        ran(&format!("MODULE m\n{target}{rest}\nPROC main()\n{main}\nENDPROC\nENDMODULE\n"));
    assert_eq!(ended, None);
    events
        .into_iter()
        .filter_map(|event| if let Event::Motion(m) = event { Some(*m) } else { None })
        .collect()
}

/// Where a motion ends in its object.
fn end(motion: &Motion) -> [f64; 3] {
    match motion.goals.last() {
        Some(super::run::Goal::Pose { in_object, displaced, .. }) => {
            (displaced * in_object).translation.vector.map(|v| (v * 1e6).round() / 1e6).into()
        }
        other => panic!("no pose: {other:?}"),
    }
}

#[test]
fn products_before_sums() {
    assert_eq!(writes("2+3*4"), "14");
    assert_eq!(writes("(2+3)*4"), "20");
    assert_eq!(writes("2-3-4"), "-5");
    assert_eq!(writes("24/4/2"), "3");
}

#[test]
fn a_sign_belongs_to_the_whole_product() {
    assert_eq!(writes("-2*3+1"), "-5");
    assert_eq!(writes("- 5"), "-5");
    assert_eq!(writes("4*-2"), "-8");
}

#[test]
fn div_and_mod_are_whole() {
    assert_eq!(writes("7 DIV 2"), "3");
    assert_eq!(writes("7 MOD 4"), "3");
    assert_eq!(writes("1+7 DIV 2*2"), "7");
}

#[test]
fn and_before_or_and_xor() {
    assert_eq!(writes("TRUE OR FALSE AND FALSE"), "true");
    assert_eq!(writes("NOT FALSE AND FALSE"), "false");
    assert_eq!(writes("TRUE XOR TRUE OR TRUE"), "true");
    assert_eq!(writes("1<2 AND 2<>3"), "true");
}

#[test]
fn numbers_in_every_spelling() {
    assert_eq!(writes(".5+1.5E1+2.e0"), "17.500000");
    assert_eq!(writes("9E9"), "9000000000");
}

#[test]
fn strings_with_quotes_and_backslashes() {
    assert_eq!(writes("\"a\"\"b\\\\!;\""), "\"a\\\"b\\\\!;\"");
    assert_eq!(writes("\"a\"+NumToStr(1.26,1)"), "\"a1.3\"");
}

#[test]
fn comments_end_with_the_line() {
    assert_eq!(says("! PROC main()\n", "TPWrite 1 ! ;\n ;!x\n"), ["1"]);
}

#[test]
fn names_count_the_same_in_either_case() {
    assert_eq!(says("VAR num Ab:=3;", "tpwrite aB;"), ["3"]);
}

#[test]
fn for_counts_up_down_and_not_at_all() {
    assert_eq!(says("", "FOR i FROM 1 TO 3 DO TPWrite i; ENDFOR"), ["1", "2", "3"]);
    assert_eq!(says("", "FOR i FROM 3 TO 1 DO TPWrite i; ENDFOR"), ["3", "2", "1"]);
    assert_eq!(says("", "FOR i FROM 0 TO 5 STEP 2 DO TPWrite i; ENDFOR"), ["0", "2", "4"]);
    assert!(says("", "FOR i FROM 3 TO 1 STEP 1 DO TPWrite i; ENDFOR").is_empty());
}

#[test]
fn the_counter_hides_data_and_gives_it_back() {
    assert_eq!(says("VAR num i:=9;", "FOR i FROM 1 TO 2 DO TPWrite i; ENDFOR TPWrite i;"), ["1", "2", "9"]);
}

#[test]
fn the_end_of_for_is_worked_out_once() {
    assert_eq!(says("VAR num n:=2;", "FOR i FROM 1 TO n DO n:=n+1; TPWrite i; ENDFOR"), ["1", "2"]);
}

#[test]
fn while_looks_before_it_runs() {
    assert_eq!(says("VAR num n;", "WHILE n<2 DO n:=n+1; TPWrite n; ENDWHILE"), ["1", "2"]);
}

#[test]
fn test_takes_the_first_case_that_holds() {
    let text = "TEST n\nCASE 1,2: TPWrite 1;\nCASE 2,3: TPWrite 2;\nDEFAULT: TPWrite 3;\nENDTEST";
    for (n, out) in [(1, "1"), (2, "1"), (3, "2"), (4, "3")] {
        assert_eq!(says(&format!("VAR num n:={n};"), text), [out]);
    }
}

#[test]
fn elseif_and_else() {
    let text = "IF n=1 THEN TPWrite 1; ELSEIF n=2 THEN TPWrite 2; ELSE TPWrite 3; ENDIF";
    for n in 1..4 {
        assert_eq!(says(&format!("VAR num n:={n};"), text), [n.to_string()]);
    }
}

#[test]
fn a_short_if_holds_one_statement() {
    assert_eq!(says("", "IF FALSE TPWrite 1; TPWrite 2;"), ["2"]);
}

#[test]
fn goto_leaves_blocks() {
    assert_eq!(says("", "WHILE TRUE DO IF TRUE THEN GOTO out; ENDIF ENDWHILE out: TPWrite 5;"), ["5"]);
    assert_eq!(says("VAR num n;", "again: n:=n+1; IF n<3 GOTO again; TPWrite n;"), ["3"]);
}

#[test]
fn parameters_are_copies() {
    assert_eq!(says("PROC a(num k) k:=5; ENDPROC VAR num n:=1;", "a n; TPWrite n;"), ["1"]);
}

#[test]
fn inout_var_and_pers_are_the_callers_own() {
    for mode in ["INOUT", "VAR", "PERS"] {
        assert_eq!(
            says(&format!("PROC a({mode} num k) k:=5; ENDPROC VAR num n:=1;"), "a n; TPWrite n;"),
            ["5"]
        );
    }
}

#[test]
fn a_component_or_element_goes_by_reference() {
    assert_eq!(says("PROC a(INOUT num k) k:=5; ENDPROC VAR pos q;", "a q.y; TPWrite q.y;"), ["5"]);
    assert_eq!(says("PROC a(INOUT num k) k:=5; ENDPROC VAR num q{3};", "a q{2}; TPWrite q{2}+q{1};"), ["5"]);
}

#[test]
fn references_go_through_calls() {
    let rest = "PROC a(INOUT num k) b k; ENDPROC PROC b(INOUT num k) k:=k+1; ENDPROC VAR num n:=1;";
    assert_eq!(says(rest, "a n; TPWrite n;"), ["2"]);
}

#[test]
fn optional_parameters_may_be_missing() {
    let rest = "PROC a(num k\\num more\\switch s) IF Present(more) TPWrite k+more; IF NOT Present(more) TPWrite k; IF Present(s) \
                TPWrite 0; ENDPROC";
    assert_eq!(says(rest, "a 1; a 1\\more:=2; a 1\\s; a 1,\\more:=3\\s;"), ["1", "3", "1", "0", "4", "0"]);
}

#[test]
fn an_option_is_handed_on_if_present() {
    let rest = "PROC a(\\num k) b \\k?k; ENDPROC PROC b(\\num k) IF Present(k) TPWrite k; IF NOT Present(k) TPWrite 0; ENDPROC";
    assert_eq!(says(rest, "a; a\\k:=4;"), ["0", "4"]);
}

#[test]
fn named_arguments() {
    assert_eq!(says("PROC a(num k,num l) TPWrite k-l; ENDPROC", "a k:=5,l:=3;"), ["2"]);
}

#[test]
fn functions_hand_back_values_and_have_effects() {
    let rest = "VAR num n; FUNC num f(num k) n:=n+1; IF k>2 RETURN 0; RETURN k; ENDFUNC";
    assert_eq!(says(rest, "TPWrite f(1)+f(2)+f(3); TPWrite n;"), ["3", "3"]);
}

#[test]
fn arguments_are_worked_out_in_order() {
    let rest = "VAR num n:=1; FUNC num f(INOUT num k) k:=k*2; RETURN k; ENDFUNC PROC a(num k,num l) TPWrite k; TPWrite l; ENDPROC";
    assert_eq!(says(rest, "a f(n),n;"), ["2", "2"]);
}

#[test]
fn arrays_count_from_one_and_know_their_size() {
    assert_eq!(
        says("CONST num a{2,3}:=[[1,2,3],[4,5,6]];", "TPWrite a{2,1}; TPWrite Dim(a,1)*10+Dim(a,2);"),
        ["4", "23"]
    );
}

#[test]
fn an_index_out_of_range_is_an_error() {
    assert_eq!(says("VAR num a{2};", "TPWrite a{3};\nERROR\nTPWrite 7;"), ["7"]);
}

#[test]
fn records_of_records() {
    let rest = "RECORD job robtarget at; num lift; ENDRECORD VAR job j;";
    assert_eq!(says(rest, "j.at.trans.z:=4; j.lift:=j.at.trans.z+1; TPWrite j.lift;"), ["5"]);
}

#[test]
fn assigned_records_are_copies() {
    assert_eq!(says("VAR pos a:=[1,2,3]; VAR pos b;", "b:=a; a.x:=9; TPWrite b.x;"), ["1"]);
}

#[test]
fn vectors_add_scale_and_cross() {
    assert_eq!(writes("[1,2,3]+[1,1,1]"), "[2,3,4]");
    assert_eq!(writes("2*[1,2,3]-[1,1,1]"), "[1,3,5]");
    assert_eq!(writes("[1,0,0]*[0,1,0]"), "[0,0,1]");
}

#[test]
fn constants_may_stand_in_any_order() {
    assert_eq!(says("CONST num a:=b+1; CONST num b:=2;", "TPWrite a;"), ["3"]);
}

#[test]
fn locals_hide_module_data_and_start_afresh() {
    let rest = "VAR num n:=1; PROC a() VAR num n:=5; n:=n+1; TPWrite n; ENDPROC";
    assert_eq!(says(rest, "a; a; TPWrite n;"), ["6", "6", "1"]);
}

#[test]
fn local_data_belong_to_their_module() {
    let text = "MODULE a LOCAL VAR num n:=1; PROC main() TPWrite n; other; ENDPROC ENDMODULE\nMODULE b VAR num n:=2; PROC other() \
                TPWrite n; ENDPROC ENDMODULE";
    let (events, ended) = ran(text);
    assert_eq!(ended, None);
    assert_eq!(events.len(), 2);
    assert!(events[0] != events[1]);
}

#[test]
fn late_binding_calls_by_name() {
    assert_eq!(says("PROC a1(num k) TPWrite k; ENDPROC", "%\"A\"+NumToStr(1,0)% 6;"), ["6"]);
}

#[test]
fn a_handler_ends_the_routine() {
    assert_eq!(
        says("PROC a() RAISE 3; ENDPROC PROC b() a; TPWrite 1; ERROR TPWrite 2; ENDPROC", "b; TPWrite 3;"),
        ["2", "3"]
    );
}

#[test]
fn trynext_goes_on_behind_the_call() {
    assert_eq!(says("PROC a() RAISE 3; ENDPROC PROC b() a; TPWrite 1; ERROR TRYNEXT; ENDPROC", "b;"), ["1"]);
}

#[test]
fn retry_calls_again() {
    let rest =
        "VAR num n:=3; PROC a() IF n>1 RAISE 1; TPWrite n; ENDPROC PROC b() a; ERROR n:=n-1; RETRY; ENDPROC";
    assert_eq!(says(rest, "b;"), ["1"]);
}

#[test]
fn raise_in_a_handler_goes_to_the_caller() {
    let rest = "PROC a() RAISE 1; ERROR TPWrite 1; RAISE; ENDPROC PROC b() a; ERROR TPWrite 2; ENDPROC";
    assert_eq!(says(rest, "b;"), ["1", "2"]);
}

#[test]
fn a_raise_in_the_body_goes_to_the_own_handler() {
    let rest = "PROC a() RAISE 1; TPWrite 0; ERROR TPWrite 1; ENDPROC PROC b() a; TPWrite 3; ERROR TPWrite 2; ENDPROC";
    assert_eq!(says(rest, "b;"), ["1", "3"]);
}

#[test]
fn errors_in_functions_reach_the_statement_that_calls() {
    let rest = "FUNC num f() RAISE 1; ENDFUNC PROC b() TPWrite f(); TPWrite 1; ERROR TRYNEXT; ENDPROC";
    assert_eq!(says(rest, "b;"), ["1"]);
}

#[test]
fn division_by_zero_is_an_error() {
    assert_eq!(says("VAR num n;", "TPWrite 1/n;\nERROR\nTPWrite 8;"), ["8"]);
}

#[test]
fn incr_add_clear() {
    assert_eq!(
        says("VAR num n:=1;", "Incr n; Add n,3; TPWrite n; Decr n; TPWrite n; Clear n; TPWrite n;"),
        ["5", "4", "0"]
    );
}

#[test]
fn offs_moves_in_the_object_and_reltool_in_the_tool() {
    let all = motions("", "MoveL Offs(p,1,2,3),v10,fine,tool0; MoveL RelTool(p,1,2,3),v10,fine,tool0;");
    assert_eq!(end(&all[0]), [401.0, 2.0, 403.0]);
    // Turned by half a turn about y.
    assert_eq!(end(&all[1]), [399.0, 2.0, 397.0]);
}

#[test]
fn displacements_stand_within_the_object() {
    let all = motions(
        "VAR pose d:=[[5,0,0],[1,0,0,0]];",
        "PDispSet d; MoveL p,v10,fine,tool0; PDispOff; MoveL p,v10,fine,tool0; PDispOn\\ExeP:=Offs(p,0,7,0),p,tool0; MoveL \
         p,v10,fine,tool0;",
    );
    assert_eq!(
        all.iter().map(end).collect::<Vec<_>>(),
        [[405.0, 0.0, 400.0], [400.0, 0.0, 400.0], [400.0, 7.0, 400.0]]
    );
}

#[test]
fn arcs_have_a_point_between() {
    let all = motions("", "MoveC Offs(p,1,0,0),Offs(p,2,2,0),v10,z1,tool0;");
    assert_eq!((all[0].goals.len(), end(&all[0])), (2, [402.0, 2.0, 400.0]));
}

#[test]
fn joint_targets_are_degrees() {
    let all = motions(
        "CONST jointtarget j:=[[90,0,0,0,0,180],[9E9,9E9,9E9,9E9,9E9,9E9]];",
        "MoveAbsJ j\\NoEOffs,v10,fine,tool0;",
    );
    let super::run::Goal::Joints(q) = all[0].goals[0] else { panic!("no joints") };
    assert!(
        (q[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-12 && (q[5] - std::f64::consts::PI).abs() < 1e-12
    );
}

#[test]
fn tools_and_objects_go_by_reference_and_by_component() {
    let rest = "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,0],[1,0,0,0],0,0,0]]; PROC a(PERS tooldata u) \
                u.tframe.trans.z:=50; MoveL p,v10,fine,u; ENDPROC";
    let all = motions(rest, "a t; MoveL p,v10,fine,t;");
    assert!(all.iter().all(|m| m.tool.0 == "t" && m.tool.2.translation.vector.z == 50.0 && m.load.0 == 1.0));
}

#[test]
fn grips_add_to_the_tool() {
    let rest = "PERS tooldata t:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,0],[1,0,0,0],0,0,0]]; PERS loaddata \
                l:=[3,[0,0,20],[1,0,0,0],0,0,0];";
    let all = motions(rest, "GripLoad l; MoveL p,v10,fine,t; GripLoad load0; MoveL p,v10,fine,t;");
    assert_eq!(all[0].load, (4.0, [0.0, 0.0, 90.0]));
    assert!((all[1].load.0 - 1.001).abs() < 1e-12);
}

#[test]
fn switches_are_told_apart() {
    let all = motions(
        "",
        "ConfL\\Off; MoveL p,v10,fine,tool0; MoveJ p,v10,fine,tool0; ConfL\\On; MoveL p,v10,fine,tool0;",
    );
    assert_eq!(all.iter().map(|m| m.monitored).collect::<Vec<_>>(), [false, true, true]);
}

#[test]
fn an_interrupt_runs_between_statements() {
    let text = "MODULE m VAR intnum i; VAR num n; TRAP t n:=n+1; ENDTRAP PROC main() CONNECT i WITH t; FOR k FROM 1 TO 300 DO ; \
                ENDFOR TPWrite n; ENDPROC ENDMODULE";
    let (events, ended) = ran(text);
    assert_eq!(ended, None);
    assert!(!matches!(&events[0], Event::Said(text) if text.starts_with("tpwrite 0.0")));
}

#[test]
fn a_program_without_end_is_cut_off() {
    assert_eq!(ran("MODULE m PROC main() WHILE TRUE DO ENDWHILE ENDPROC ENDMODULE").1, Some(Stop::Budget));
}

#[test]
fn a_joint_keeps_its_side_until_it_turns() {
    let mut case = model::with(1, true, false);
    case.arm.play = [1e-3, 0.0, 0.0, 0.0, 0.0, 0.0];
    let joint =
        |deg: f64| format!("MoveAbsJ [[{deg},0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v10,fine,tool0;\n");
    let all = motions("", &[0.0, 10.0, 10.0, 9.99, 5.0].map(joint).concat());
    let mut course = Course::new(&case.arm, [1.0; 6]);
    let flanks: Vec<String> = all.iter().map(|m| course.go(m)[0].flanks.clone()).collect();
    // On which flank the joint lies at first nobody knows.
    assert_eq!(flanks[1..], ["-.....", "-.....", "0.....", "+....."]);
}

#[test]
fn an_arc_goes_through_its_point() {
    let arc = Arc::through(&[1.0, 0.0, 0.0].into(), &[0.0, 1.0, 0.0].into(), &[0.0, -1.0, 0.0].into())
        .expect("an arc");
    assert!((arc.at(1.0 / 3.0) - nalgebra::Vector3::new(0.0, 1.0, 0.0)).norm() < 1e-12);
    assert!((arc.at(1.0) - nalgebra::Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-12);
}
