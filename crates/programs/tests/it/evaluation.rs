//! What targets, tools and work objects are worth.

use nalgebra::{UnitQuaternion, Vector3};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_programs::motion::{Frame, Reason, RobTarget, TargetValue};
use truegrind_programs::rapid::Task;
use truegrind_programs::rapid::{lexer, number};

const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

/// The target of a MoveL of this expression, with these declarations before.
fn target(data: &str, body: &str, expression: &str) -> Result<RobTarget, Reason> {
    let source = format!(
        "MODULE M\n{data}\nPROC main()\n{body}\nMoveL {expression},v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let motion = task.listing.motions.last().unwrap();
    match motion.targets[0].value {
        Ok(TargetValue::Cartesian(target)) => Ok(target),
        Ok(TargetValue::Joint(_)) => panic!("{source}"),
        Err(reason) => Err(reason),
    }
}

fn base() -> String {
    format!("CONST robtarget p:=[[500,-20,300],[0.5,0.5,-0.5,0.5],[1,-1,2,0],{EXT}];")
}

fn close(found: RobTarget, wanted: &nalgebra::Isometry3<f64>) {
    let found = found.pose();
    assert!((found.translation.vector - wanted.translation.vector).norm() < 1e-9, "{found} {wanted}");
    assert!(found.rotation.angle_to(&wanted.rotation) < 1e-9, "{found} {wanted}");
}

#[test]
fn quaternions_are_scalar_first() {
    let data =
        format!("CONST robtarget p:=[[0,0,0],[0.7071067811865476,0,0,0.7071067811865476],[0,0,0,0],{EXT}];");
    let pose = target(&data, "", "p").unwrap().pose();
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    assert!(pose.rotation.angle_to(&quarter) < 1e-12);
    let frame = Frame::from_pose(&pose);
    assert!((frame.quaternion[0] - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
}

#[test]
fn offs_moves_in_the_object_frame_and_reltool_along_and_about_the_tool() {
    let p = target(&base(), "", "p").unwrap();
    let shifted = target(&base(), "", "Offs(p,1,2,3)").unwrap();
    assert_eq!(shifted.position_mm, [501.0, -18.0, 303.0]);
    assert_eq!((shifted.quaternion, shifted.conf), (p.quaternion, p.conf));

    let turn = |axis, degrees: f64| UnitQuaternion::from_axis_angle(&axis, degrees.to_radians());
    let x = turn(Vector3::x_axis(), 30.0);
    let y = turn(Vector3::y_axis(), -40.0);
    let z = turn(Vector3::z_axis(), 50.0);
    // About the tool's x, then the new y, then the new z, whatever the order of the arguments.
    let wanted = p.pose() * nalgebra::Isometry3::from_parts(Vector3::new(1.0, 2.0, 3.0).into(), x * y * z);
    close(target(&base(), "", "RelTool(p,1,2,3\\Rx:=30\\Ry:=-40\\Rz:=50)").unwrap(), &wanted);
    close(target(&base(), "", "RelTool(p,1,2,3\\Rz:=50,\\Rx:=30\\Ry:=-40)").unwrap(), &wanted);
    let wanted = p.pose() * nalgebra::Isometry3::from_parts(Vector3::new(0.0, 0.0, -10.0).into(), y);
    close(target(&base(), "", "RelTool(p,0,0,-10\\Ry:=-40)").unwrap(), &wanted);
}

#[test]
fn expressions_are_folded() {
    let cases = [
        ("2*3+4*5", 26.0),
        ("2+3*4-1", 13.0),
        ("-(2+3)*2", -10.0),
        ("- 5 + 1", -4.0),
        ("7 DIV 2 + 7 MOD 2", 4.0),
        ("10/4/2", 1.25),
        ("a*b-a", 2.0),
        ("Abs(-3)+Sqrt(16)", 7.0),
        ("Sin(30)*2+Cos(60)", 1.5),
        ("ATan2(1,1)", 45.0),
        ("table{2}+grid{2,1}", 24.0),
        ("p.trans.z/100", 3.0),
        ("frame.trans.y", 8.0),
        ("0x1F+0b101+0o17+0d12", 31.0 + 5.0 + 15.0 + 12.0),
        ("1.5E1+.5+5.", 20.5),
        ("tool0.tframe.rot.q1", 1.0),
        ("v100.v_tcp", 100.0),
    ];
    let data = format!(
        "{}\nCONST num a:=2*b-5;\nCONST num b:=3;\nCONST num table{{2}}:=[1,4];\nCONST num grid{{2,2}}:=[[10,11],[20,21]];\nCONST pose frame:=[[7,8,9],[1,0,0,0]];\nCONST num loop1:=loop2;\nCONST num loop2:=loop1;",
        base()
    );
    for (text, wanted) in cases {
        let found = target(&data, "", &format!("Offs(p,{text},0,0)")).unwrap();
        assert!((found.position_mm[0] - 500.0 - wanted).abs() < 1e-9, "{text}: {:?}", found.position_mm);
    }
    assert_eq!(target(&data, "", "Offs(p,loop1,0,0)"), Err(Reason::RunTimeOffset));
    assert_eq!(target(&data, "", "Offs(p,reg1,0,0)"), Err(Reason::RunTimeOffset));
    let aggregate = format!("[p.trans,OrientZYX(90,0,0),[a,b,0,0],{EXT}]");
    let found = target(&data, "", &aggregate).unwrap();
    assert_eq!((found.position_mm, found.conf), ([500.0, -20.0, 300.0], [1, 3, 0, 0]));
    assert!((found.quaternion[3] - std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12);
}

#[test]
fn assignments_are_followed_in_straight_lines_and_nowhere_else() {
    let data = format!("{}\nVAR robtarget q;\nPERS num h:=10;", base());
    let cases: &[(&str, Result<f64, Reason>)] = &[
        ("q:=p;", Ok(500.0)),
        ("q:=p; q.trans.x:=q.trans.x+1;", Ok(501.0)),
        ("q:=p; q.trans.x:=10*2;", Ok(20.0)),
        ("q:=p; q.trans:=[7,8,9];", Ok(7.0)),
        ("q:=p; q.trans.x:=reg1;", Err(Reason::Undeclared)),
        ("q.trans:=[7,8,9];", Err(Reason::Assigned)),
        ("q:=p; IF x q.trans.x:=1;", Err(Reason::Assigned)),
        ("IF x THEN q:=p; ELSE q:=p; ENDIF", Ok(500.0)),
        ("IF x THEN q:=p; ENDIF", Err(Reason::Assigned)),
        ("q:=p; FOR i FROM 1 TO 3 DO q.trans.x:=q.trans.x+1; ENDFOR", Err(Reason::Assigned)),
        ("q:=p; lab: q.trans.y:=1; GOTO lab;", Err(Reason::Assigned)),
        ("q:=p; other;", Err(Reason::Assigned)),
        ("q:=p; unknown q;", Err(Reason::Assigned)),
        ("q:=p; unknown;", Err(Reason::Assigned)),
        ("q:=p; WaitTime 1; Set do1;", Ok(500.0)),
        ("q:=p; SearchL di1,q,p,v100,tool0;", Err(Reason::Assigned)),
        ("q:=p; IF x THEN q:=CRobT(); RETURN; ENDIF", Ok(500.0)),
    ];
    for (body, wanted) in cases {
        let data = format!("{data}\nPROC other()\nq:=CRobT();\nENDPROC");
        let found = target(&data, body, "q").map(|target| target.position_mm[0]);
        assert_eq!(found, *wanted, "{body}");
    }
    // A variable of the routine has its value at every call until something changes it.
    let local = format!("VAR robtarget q:=[[1,2,3],[1,0,0,0],[0,0,0,0],{EXT}];");
    assert_eq!(target("", &local, "q").unwrap().position_mm[0], 1.0);
    let changed = format!("{local} q.trans.x:=4;");
    assert_eq!(target("", &changed, "q").unwrap().position_mm, [4.0, 2.0, 3.0]);
    let looped = format!("{local} WHILE y DO q.trans.x:=4; ENDWHILE");
    assert_eq!(target("", &looped, "q"), Err(Reason::Assigned));
}

#[test]
fn names_are_looked_up_from_routine_to_module_to_task() {
    let literal = |x: i32| format!("[[{x},0,0],[1,0,0,0],[0,0,0,0],{EXT}]");
    let first = format!(
        "MODULE A\nCONST robtarget p:={};\nLOCAL CONST robtarget l:={};\nCONST robtarget g:={};\nPROC main()\nMoveL p,v100,fine,tool0;\nMoveL l,v100,fine,tool0;\ninner;\nENDPROC\nPROC inner()\nVAR robtarget P:={};\nMoveL p,v100,fine,tool0;\nENDPROC\nENDMODULE",
        literal(1),
        literal(2),
        literal(3),
        literal(4)
    );
    let second = format!(
        "MODULE B\nLOCAL CONST robtarget p:={};\nPROC b()\nMoveL p,v100,fine,tool0;\nMoveL G,v100,fine,tool0;\nMoveL l,v100,fine,tool0;\nENDPROC\nENDMODULE",
        literal(5)
    );
    let task = Task::read(&[("a.mod", first.as_bytes()), ("b.mod", second.as_bytes())]);
    let x: Vec<Result<f64, Reason>> = task
        .listing
        .motions
        .iter()
        .map(|motion| motion.targets[0].value.map(|value| value.cartesian().unwrap().position_mm[0]))
        .collect();
    assert_eq!(x, [Ok(1.0), Ok(2.0), Ok(4.0), Ok(5.0), Ok(3.0), Err(Reason::Undeclared)]);
}

#[test]
fn tools_work_objects_speeds_and_zones_are_told() {
    let source = "MODULE M\nPERS tooldata t:=[FALSE,[[1,2,3],[0.8,0,0.6,0]],[4.5,[5,6,7],[1,0,0,0],0,0,0]];\nPERS wobjdata w:=[TRUE,TRUE,\"a\"\"b\",[[1,0,0],[1,0,0,0]],[[0,2,0],[1,0,0,0]]];\nPROC main()\nMoveL [[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v150,z20,t\\WObj:=w;\nENDPROC\nENDMODULE";
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    let listing = &task.listing;
    let motion = &listing.motions[0];
    let tool = listing.tool(motion).unwrap();
    assert_eq!(tool.place.unwrap().line, 2);
    let tool = tool.value.unwrap();
    assert!(!tool.robhold && tool.mass_kg == 4.5 && tool.centre_of_gravity_mm == [5.0, 6.0, 7.0]);
    assert_eq!(tool.frame.quaternion[2], 0.6);
    let work_object = listing.work_object(motion).unwrap().value.as_ref().unwrap();
    assert!(work_object.robhold && work_object.fixed);
    assert_eq!(work_object.mechanical_unit, "a\"b");
    assert_eq!(work_object.object_frame.position_mm, [0.0, 2.0, 0.0]);
    assert_eq!(listing.speed(motion).unwrap().value.unwrap().tcp_mm_s, 150.0);
    let zone = listing.zone(motion).unwrap().value.unwrap();
    assert!(!zone.fine && zone.tcp_mm == 20.0 && zone.orientation_deg == 3.0);
    assert_eq!(motion.reason(), None);
}

#[test]
fn a_number_read_in_one_pass_is_the_same_number() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let bytes = b"0123456789019.E+-9ex,]_ ";
    let mut told = 0;
    for index in 0..200_000 {
        let mut text: Vec<u8> =
            (0..random.random_range(1..12)).map(|_| *bytes.choose(&mut random).unwrap()).collect();
        if index % 4 == 0 {
            text.splice(0..0, *b"9E+09");
        }
        if let Some((value, length, decimals)) = number::plain(&text) {
            let (rest, number) = lexer::number(&text).unwrap();
            let whole = (number::value(number), number.len(), number::decimals(number));
            assert_eq!(whole, (Some(value), length, decimals), "{text:?} {rest:?}");
            told += 1;
        }
    }
    assert!(told > 50_000, "{told}");
}

#[test]
fn numbers_are_read_and_written_exactly() {
    for text in [
        "0",
        "12",
        "12.",
        ".5",
        "1.5E-3",
        "2E6",
        "9E+09",
        "123456789.123456789",
        "1e-300",
        "0.1",
        "3.14159265358979",
    ] {
        let wanted: f64 = text.parse().unwrap();
        assert_eq!(number::value(text.as_bytes()), Some(wanted), "{text}");
    }
    let cases = [
        (0.0, 4, "0.0000"),
        (-0.000_04, 4, "0.0000"),
        (-0.000_06, 4, "-0.0001"),
        (1_234.567_89, 3, "1234.568"),
        (-5.0, 0, "-5"),
        (0.05, 1, "0.1"),
        (99.999_99, 2, "100.00"),
    ];
    for (value, decimals, wanted) in cases {
        let mut out = Vec::new();
        number::write(&mut out, value, decimals);
        assert_eq!(String::from_utf8(out).unwrap(), wanted);
    }
    for (text, wanted) in [("5", 0), ("5.", 0), ("5.25", 2), ("1.5E-3", 4), ("1.5E3", 0), ("9E9", 0)] {
        assert_eq!(number::decimals(text.as_bytes()), wanted, "{text}");
    }
}

#[test]
fn mirpos_mirrors_position_and_two_axes() {
    // The mirror's xy plane is the world's zx plane.
    let data = format!(
        "CONST robtarget p:=[[500,-20,300],[1,0,0,0],[0,0,0,0],{EXT}];\n\
         PERS wobjdata mirror:=[FALSE,TRUE,\"\",[[0,5,0],[0.70710678118654752,0.70710678118654752,0,0]],[[0,0,0],[1,0,0,0]]];\n\
         PERS wobjdata w:=[FALSE,TRUE,\"\",[[0,100,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];"
    );
    let found = target(&data, "", "MirPos(p,mirror)").unwrap();
    close(found, &nalgebra::Isometry3::translation(500.0, 30.0, 300.0));
    let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
    let found = target(&data, "", "MirPos(p,mirror\\MirY)").unwrap();
    close(found, &nalgebra::Isometry3::from_parts(Vector3::new(500.0, 30.0, 300.0).into(), half));
    // In a work object: there and back.
    let found = target(&data, "", "MirPos(p,mirror\\WObj:=w)").unwrap();
    close(found, &nalgebra::Isometry3::translation(500.0, -170.0, 300.0));
    assert_eq!(target(&data, "", "MirPos(p,unknown)"), Err(Reason::Undeclared));
}

#[test]
fn functions_with_options_and_of_vectors_are_worth_what_the_reference_says() {
    let data = base();
    let x = |expression: &str| {
        target(&data, "", &format!("Offs(p,{expression},0,0)")).unwrap().position_mm[0] - 500.0
    };
    let near = |found: f64, wanted: f64| assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    near(x("Round(0.3852138\\Dec:=3)"), 0.385);
    near(x("Trunc(-1.987\\Dec:=1)"), -1.9);
    near(x("Round(2.5)"), 3.0);
    near(x("EulerZYX(\\X,OrientZYX(10,-20,30))"), 30.0);
    near(x("EulerZYX(\\Y,OrientZYX(10,-20,30))"), -20.0);
    near(x("EulerZYX(\\Z,OrientZYX(10,-20,30))"), 10.0);
    near(x("VectMagn([3,4,12])"), 13.0);
    near(x("Distance([1,2,3],[1,5,7])"), 5.0);
    near(x("DotProd([1,2,3],[4,-5,6])"), 12.0);
    near(x("Max(1,Min(7,3))"), 3.0);
    // DefFrame with its origin in the second point, or where the third lies on y.
    let point = |x: f64, y: f64| format!("[[{x},{y},0],[1,0,0,0],[0,0,0,0],{EXT}]");
    let frame = |origin: &str| {
        let frame =
            format!("DefFrame({},{},{}{origin})", point(10.0, 0.0), point(50.0, 0.0), point(30.0, 20.0));
        let found = target(&data, "", &format!("[PoseVect({frame},[0,0,0]),[1,0,0,0],[0,0,0,0],{EXT}]"));
        found.unwrap().position_mm
    };
    assert_eq!(frame(""), [10.0, 0.0, 0.0]);
    assert_eq!(frame("\\Origin:=2"), [50.0, 0.0, 0.0]);
    assert_eq!(frame("\\Origin:=3"), [30.0, 0.0, 0.0]);
    // An option that is not known leaves the value to run time.
    assert_eq!(target(&data, "", "Offs(p,Round(1\\Other:=2),0,0)"), Err(Reason::RunTimeOffset));
}

/// Positions of the motions of main in the base, or why they are left.
fn displaced(body: &str) -> Vec<Result<[f64; 3], Reason>> {
    let source = format!(
        "MODULE M\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\nPROC main()\n{body}\nENDPROC\n\
         PROC sets()\nPDispSet [[0,0,1],[1,0,0,0]];\nENDPROC\nPROC ends()\nPDispOff;\nENDPROC\n\
         PROC neither()\nTPWrite \"x\";\nENDPROC\nENDMODULE\n"
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let listing = &task.listing;
    listing
        .motions
        .iter()
        .map(|motion| match motion.reason() {
            Some(reason) => Err(reason),
            None => {
                let object = listing.work_object(motion).unwrap().value.clone().unwrap();
                let told = motion.to().unwrap().value.unwrap().cartesian().unwrap().pose();
                let pose = object.user_frame.pose() * object.object_frame.pose() * told;
                Ok(pose.translation.vector.map(|x| x.round()).into())
            }
        })
        .collect()
}

#[test]
fn a_displacement_that_the_text_tells_is_part_of_the_work_object() {
    let go = "MoveL p,v100,fine,tool0;\n";
    let set = "PDispSet [[10,20,30],[0.70710678118654752,0,0,0.70710678118654752]];\n";
    let (plain, moved) = (Ok([500.0, 0.0, 300.0]), Ok([10.0, 520.0, 330.0]));
    let left = Err(Reason::Displacement);
    assert_eq!(displaced(&format!("{go}{set}{go}PDispOff;\n{go}")), [plain, moved, plain]);
    // Where ways join, in loops, and after calls only what is certain holds.
    assert_eq!(displaced(&format!("IF x THEN\n{set}{go}ENDIF\n{go}")), [moved, left]);
    assert_eq!(displaced(&format!("IF x THEN\n{set}ELSE\n{set}ENDIF\n{go}")), [moved]);
    assert_eq!(displaced(&format!("WHILE x DO\n{go}{set}{go}ENDWHILE\n{go}")), [left, moved, left]);
    assert_eq!(displaced(&format!("{set}neither;\n{go}sets;\n{go}ends;\n{go}")), [moved, left, plain]);
    let before = Err(Reason::BeforeDisplacement);
    assert_eq!(displaced(&format!("PDispSet found;\n{go}PDispOn p,tool0;\n{go}")), [before, left]);
    // SmarTac adds what it found to what is set already.
    assert_eq!(displaced(&format!("{set}{go}PDispAdd found;\n{go}PDispOff;\n{go}")), [moved, left, plain]);
    assert_eq!(displaced(&format!("{set}EOffsSet [1,0,0,0,0,0];\n{go}")), [left]);
    assert_eq!(displaced(&format!("{set}here:\n{go}")), [left]);
}

/// Where the work objects of the motions of main stand, or why that is not known.
fn objects(body: &str, routines: &str) -> Vec<Result<[f64; 3], Reason>> {
    let source = format!(
        "MODULE M\nCONST robtarget p:=[[500,0,300],[1,0,0,0],[0,0,0,0],{EXT}];\n\
         PERS wobjdata w:=[FALSE,TRUE,\"\",[[1,2,3],[1,0,0,0]],[[10,20,30],[1,0,0,0]]];\n\
         VAR num n;\nPROC main()\n{body}\nENDPROC\n{routines}\nENDMODULE\n"
    );
    let task = Task::read(&[("m.mod", source.as_bytes())]);
    assert!(task.listing.opaque.is_empty(), "{source} {:?}", task.listing.opaque);
    let listing = &task.listing;
    let moving = listing.motions.iter().filter(|motion| &*motion.instruction == "MoveL");
    moving
        .map(|motion| match motion.reason() {
            Some(reason) => Err(reason),
            None => {
                let object = listing.work_object(motion).unwrap().value.clone().unwrap();
                let at = object.user_frame.pose() * object.object_frame.pose();
                Ok(at.translation.vector.into())
            }
        })
        .collect()
}

#[test]
fn components_that_nothing_assigns_keep_the_declared_value() {
    let go = "MoveL p,v100,fine,tool0\\WObj:=w;\n";
    let left = Err(Reason::WorkObjectAssigned);
    let set = "w.uframe.trans:=[100,0,0];\n";
    assert_eq!(objects(go, ""), [Ok([11.0, 22.0, 33.0])]);
    assert_eq!(objects(&format!("{go}{set}{go}"), ""), [left, Ok([110.0, 20.0, 30.0])]);
    assert_eq!(objects(&format!("w.oframe.trans.y:=7;\n{go}"), ""), [Ok([11.0, 9.0, 33.0])]);
    // What is assigned elsewhere is not known here.
    let other = "PROC other()\nw.oframe:=[[0,0,0],[1,0,0,0]];\nENDPROC";
    assert_eq!(objects(&format!("{set}{go}"), other), [left]);
    assert_eq!(
        objects(&format!("{set}w.oframe:=wobj0.oframe;\n{go}other;\n{go}"), other),
        [Ok([100.0, 0.0, 0.0]), left]
    );
    // An index, a whole from run time, a joint of ways, a loop, a label.
    let found = objects(&format!("w:=found();\n{go}{set}{go}"), "");
    assert_eq!(found, [Err(Reason::WorkObjectUnknown), Err(Reason::WorkObjectUnknown)]);
    let tables = "PERS wobjdata many{2}:=[[FALSE,TRUE,\"\",[[1,2,3],[1,0,0,0]],[[0,0,0],[1,0,0,0]]],\
                  [FALSE,TRUE,\"\",[[4,5,6],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]];\n\
                  PROC other()\nmany{n}.uframe.trans.x:=7;\nENDPROC";
    assert_eq!(objects("MoveL p,v100,fine,tool0\\WObj:=many{2};\n", tables), [left]);
    assert_eq!(objects(&format!("{set}IF n=1 w.uframe.trans.z:=5;\n{go}"), ""), [left]);
    assert_eq!(
        objects(&format!("{set}WHILE n<3 DO\n{go}{set}{go}ENDWHILE\n{go}"), ""),
        [left, Ok([110.0, 20.0, 30.0]), left]
    );
    assert_eq!(objects(&format!("{set}again:\n{go}"), ""), [left]);
}

#[test]
fn only_what_may_change_a_value_makes_it_unknown() {
    let go = "MoveL p,v100,fine,tool0\\WObj:=w;\n";
    let (known, left) = (Ok([110.0, 20.0, 30.0]), Err(Reason::WorkObjectAssigned));
    let set = "w.uframe.trans:=[100,0,0];\n";
    let after = |statement: &str, routines: &str| {
        objects(&format!("{set}{statement}\n{go}"), routines).pop().unwrap()
    };
    let passive = "PROC other()\nTPWrite \"x\";\nn:=n+1;\nENDPROC";
    assert_eq!(after("other;", passive), known);
    assert_eq!(after("WaitWObj w\\RelDist:=3; Set do1; TPReadNum n,\"x\";", ""), known);
    assert_eq!(after("unknown;", ""), left);
    assert_eq!(after("n:=unknown(3);", ""), left);
    assert_eq!(after("IF unknown(3)=2 n:=1;", ""), left);
    assert_eq!(after("%\"other\"%;", passive), left);
    // Given by reference: changed only where the routine changes it, or gives it on to what may.
    let parameter = |body: &str| format!("PROC other(PERS wobjdata o \\num k)\n{body}\nENDPROC");
    let plain = parameter("MoveJ p,v100,fine,tool0\\WObj:=o;");
    assert_eq!(after("other w;", &plain), known);
    assert_eq!(after("other w;", &parameter("o.oframe.trans.x:=3;")), left);
    let through = format!("{}\nPROC next(PERS wobjdata q)\nq:=wobj0;\nENDPROC", parameter("next o;"));
    assert_eq!(after("other w;", &through), left);
    // Functions that change data outside, and predefined ones that write an argument.
    let changing = "FUNC num other()\nw.uframe.trans.x:=n;\nRETURN 1;\nENDFUNC";
    assert_eq!(after("n:=other();", changing), left);
    assert_eq!(after("ok:=StrToVal(\"[1,2,3]\",w.uframe.trans);", ""), left);
    assert_eq!(after("SetDataVal \"w\",n;", ""), left);
    assert_eq!(after("SetDataVal name,n;", ""), left);
    assert_eq!(after("SetDataVal \"n\",n;", ""), known);
    // At any time: a trap routine, an error handler that goes back; not one that leaves.
    let trap = "TRAP other\nw.uframe.trans.x:=n;\nENDTRAP";
    assert_eq!(after("", trap), left);
    let handler = |end: &str| format!("ERROR\nw.uframe.trans.x:=n;\n{end};");
    assert_eq!(objects(&format!("{set}{go}{}", handler("RETRY")), ""), [left]);
    assert_eq!(objects(&format!("{set}{go}{}", handler("TRYNEXT")), ""), [left]);
    assert_eq!(objects(&format!("{set}{go}{}", handler("RAISE")), ""), [known]);
    // A handler that goes back with a switch set otherwise.
    let displaced = format!("{go}ERROR\nPDispOn p,tool0;\nRETRY;");
    assert_eq!(objects(&displaced, ""), [Err(Reason::Displacement)]);
}

#[test]
fn elements_of_an_array_are_followed_where_their_index_is_known() {
    let data = format!("{}\nVAR robtarget a{{3}};\nVAR robtarget long{{500}};\nVAR num n:=1;", base());
    let filled = "a{1}:=p; a{2}:=Offs(p,0,5,0);";
    let y =
        |body: &str, expression: &str| target(&data, body, expression).map(|target| target.position_mm[1]);
    assert_eq!(y(filled, "a{1}"), Ok(-20.0));
    assert_eq!(y(filled, "a{2}"), Ok(-15.0));
    assert_eq!(y(&format!("{filled} a{{2}}.trans.y:=7;"), "a{2}"), Ok(7.0));
    assert_eq!(y(filled, "a{3}"), Err(Reason::Assigned));
    assert_eq!(y(filled, "a{4}"), Err(Reason::IndexOutOfRange));
    assert_eq!(y(&format!("{filled} n:=ReadNum(d); a{{n}}:=p;"), "a{2}"), Err(Reason::Assigned));
    assert_eq!(y(&format!("{filled} FOR i FROM 1 TO 3 DO a{{i}}:=p; ENDFOR"), "a{2}"), Err(Reason::Assigned));
    assert_eq!(y(&format!("{filled} elsewhere;"), "a{2}"), Err(Reason::Assigned));
    assert_eq!(y("long{2}:=p;", "long{2}"), Err(Reason::Assigned));
}

#[test]
fn changes_are_carried_along_chains_of_calls_in_any_order() {
    const COUNT: usize = 2000;
    for backwards in [false, true] {
        let mut routines: Vec<String> = (0..COUNT)
            .map(|i| match i + 1 {
                COUNT => format!("PROC p{i}(INOUT num a,num b)\na:=1;\nw.oframe.trans.x:=1;\nENDPROC\n"),
                next => format!("PROC p{i}(INOUT num a,num b)\np{next} a,b;\nENDPROC\n"),
            })
            .collect();
        if backwards {
            routines.reverse();
        }
        let routines = format!("{}\nVAR num k:=5;\nVAR num l:=6;", routines.concat());
        let set = "w.oframe.trans.x:=2;\n";
        let go = "MoveL Offs(p,0,0,l),v100,fine,tool0\\WObj:=w;\n";
        let found = objects(&format!("{set}{go}p0 k,l;\n{go}"), &routines);
        assert_eq!(found, [Ok([3.0, 22.0, 33.0]), Err(Reason::WorkObjectAssigned)]);
        let found = objects("p0 k,l;\nMoveL Offs(p,0,0,k),v100,fine,tool0;\n", &routines);
        assert_eq!(found, [Err(Reason::RunTimeOffset)]);
    }
}

#[test]
fn predefined_names_stand_in_order() {
    use truegrind_programs::rapid::predefined::{Effect, all, effect};
    // Every line of the list is understood.
    let list = include_str!("../../src/rapid/predefined.txt");
    assert_eq!(list.lines().filter(|line| !line.starts_with('#')).count(), all().len());
    assert!(all().windows(2).all(|two| two[0].name < two[1].name));
    assert!(all().iter().all(|one| effect(one.name.to_uppercase().as_bytes()) == Some(&one.effect)));
    let Some(Effect::Writes(written)) = effect(b"WaitAI") else { panic!("WaitAI writes") };
    assert_eq!((&*written.optional, written.later), (&["valueattimeout", "timeflag"][..], false));
    let Some(Effect::Writes(written)) = effect(b"IVarValue") else { panic!("IVarValue writes") };
    assert_eq!((&*written.required, written.later), (&[2][..], true));
    assert!(matches!(effect(b"TPReadFK"), Some(Effect::Writes(_))));
    for name in ["MoveL", "myOwn", "", "a_name_that_is_longer_than_any_that_a_controller_takes"] {
        assert_eq!(effect(name.as_bytes()), None, "{name}");
    }
}

/// At the corrected end of a motion CRobT reads another place than the text states, and a program that compares it would take the other
/// branch: the end stays where it is. What cannot be laid to single motions is listed.
#[test]
fn a_motion_keeps_the_end_by_which_the_program_decides() {
    let p = "CONST robtarget p:=[[400,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nVAR robtarget c;\nVAR pos o;\nVAR num n;\n";
    let go = "MoveL p,v100,fine,tool0;\n";
    let inpos = "FUNC bool inpos(robtarget at)\nVAR robtarget now;\nnow:=CRobT(\\Tool:=tool0);\n\
                 RETURN Distance(now.trans,at.trans)<1;\nENDFUNC\n";
    let decided = |body: &str| {
        let inpos = if body.contains("inpos") { inpos } else { "" };
        let source = format!(
            "MODULE M\n{p}PROC main()\nconfl;\n{body}ENDPROC\nPROC confl()\nConfL\\On;\nENDPROC\n{inpos}ENDMODULE\n"
        );
        let listing = Task::read(&[("m.mod", source.as_bytes())]).listing;
        let reasons: Vec<_> = listing.motions.iter().map(|motion| motion.own_reason).collect();
        (reasons, listing.position_decisions.len())
    };
    let kept = Some(Reason::BeforeDisplacement);
    for condition in [
        "c:=CRobT(\\Tool:=tool0);\nIF Distance(c.trans,p.trans)<0.5 THEN\n",
        "o:=CPos();\nIF o.x>100 THEN\n",
        "IF inpos(p) THEN\n",
        "IF CRobT()=p THEN\n",
        "o:=CPos();\nn:=o.x;\nn:=n-100;\nIF n>0 THEN\n",
    ] {
        assert_eq!(decided(&format!("{go}{condition}{go}ENDIF\n")), (vec![kept, None], 0), "{condition}");
    }
    // Before the first motion the robot stands anywhere.
    assert_eq!(decided(&format!("IF inpos(p) RETURN;\n{go}")), (vec![None], 1));
    // A position that is only shown or moved from decides nothing.
    for harmless in [
        "c:=CRobT(\\Tool:=tool0);\nc.trans.x:=c.trans.x+5;\n",
        "c:=CRobT(\\Tool:=tool0);\nTPWrite \"z\" \\Num:=c.trans.z;\n",
        "TPWrite \"at\" \\Pos:=CPos();\n",
    ] {
        assert_eq!(decided(&format!("{go}{harmless}{go}")), (vec![None, None], 0), "{harmless}");
    }
}
