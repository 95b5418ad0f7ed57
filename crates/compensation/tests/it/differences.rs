//! A program that was corrected differs from its original in its targets alone; whatever else differs is listed by line.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::effect::Effect;
use truegrind_arm::effect::backlash::Backlash;
use truegrind_arm::model::{Joints, Model};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::{After, PathReport};
use truegrind_compensation::options::{Circles, Emit, Options};
use truegrind_compensation::plan::MotionOutcome;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::verify::{ActingArm, VerificationTask, verify};
use truegrind_programs::rapid::Task;

use super::{estimated, nominal, perturbed, rewritten};

const PLACE: &str = "[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]";

/// Lines of 40 mm and an arc, in a work object, between motions whose targets only the run time tells.
fn program() -> String {
    let at = |x: f64, y: f64, z: f64| format!("[[{x:.1},{y:.1},{z:.1}],{PLACE}");
    let mut text =
        "MODULE M\n  PERS tooldata tS:=[TRUE,[[0,0,50],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n  \
         PERS wobjdata wB:=[FALSE,TRUE,\"\",[[300,10,200],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n  PROC main()\n"
            .to_owned();
    text += &format!("    MoveJ {},v100,fine,tS\\WObj:=wB;\n", at(0.0, 0.0, 60.0));
    for k in 0..6 {
        text += &format!("    MoveL {},v100,z1,tS\\WObj:=wB;\n", at(20.0, 16.0 * f64::from(k), 20.0));
    }
    text +=
        &format!("    MoveC {},{},v100,fine,tS\\WObj:=wB;\n", at(40.0, 100.0, 20.0), at(60.0, 80.0, 20.0));
    text += &format!("    MoveL {},v100,z1,tS\\WObj:=wB;\n", at(60.0, 0.0, 20.0));
    text += "    unknownMotion;\n  ENDPROC\nENDMODULE\n";
    text
}

fn corrected(options: &Options) -> String {
    let known = estimated(perturbed(3, 1.0), &[Joints::zeros()]);
    let (_, text) = rewritten(program().as_bytes(), &known, &Cell::default(), options);
    String::from_utf8(text).unwrap()
}

/// A tolerance for which nothing is inserted.
fn plain() -> Options {
    Options { tolerance_mm: 0.5, ..Options::default() }
}

fn judged(original: &str, program: &str) -> PathReport {
    judged_on(original, program, &perturbed(3, 1.0))
}

fn judged_on(original: &str, program: &str, actual: &Model) -> PathReport {
    let [before, after] = [original, program].map(|text| Task::read(&[("p.mod", text.as_bytes())]).listing);
    let nominal = nominal();
    let task = VerificationTask {
        original: &before,
        rewritten: Some(&after),
        cell: &Cell::default(),
        surface: None,
        program: "p.mod",
        name: "test",
        after: After::PredictedRemainder,
        tolerance_mm: Options::default().tolerance_mm,
        loads: [None, None],
    };
    let acting =
        ActingArm { nominal: &nominal, model: actual, knowledge: None, condition: Condition::default() };
    verify(&task, &acting)
}

#[test]
fn whatever_a_correction_writes_is_no_difference() {
    let plain = plain();
    for (options, inserts) in [
        (plain.clone(), false),
        (Options { tolerance_mm: 0.001, ..plain.clone() }, true),
        (Options { circles: Circles::Segments, tolerance_mm: 0.02, ..plain.clone() }, true),
        (Options { emit: Emit::Joints, circles: Circles::Segments, tolerance_mm: 0.02, ..plain }, true),
    ] {
        let text = corrected(&options);
        assert_ne!(text, program());
        assert_eq!(text.matches("Move").count() > program().matches("Move").count(), inserts, "{text}");
        let report = judged(&program(), &text);
        assert!(report.differences.is_empty(), "{:?} {text}", report.differences);
        let worst = report.points.iter().map(|point| point.after.unwrap().norm_mm()).fold(0.0, f64::max);
        assert!(worst < 1e-3, "{worst}");
    }
}

/// One call has one place: a contour cut by two routines was left without inserted targets.
#[test]
fn a_contour_in_several_routines_is_corrected_as_in_one() {
    let line = |x: f64, y: f64| format!("    MoveL [[{x:.1},{y:.1},330.0],{PLACE},v100,fine,tool0;\n");
    let corners = [[300.0, 10.0], [420.0, 10.0], [420.0, 230.0], [300.0, 230.0], [300.0, 10.0]]
        .map(|[x, y]| line(x, y));
    let program = |calls: &str| {
        let [first, a, b, c, d] = &corners;
        format!(
            "MODULE M\n  PROC main()\n{first}{calls}  ENDPROC\n  PROC one()\n{a}{b}  ENDPROC\n  PROC two()\n{c}{d}  ENDPROC\nENDMODULE\n"
        )
    };
    let known = estimated(perturbed(5, 3.0), &[Joints::zeros()]);
    let options = Options { tolerance_mm: 0.005, ..Options::default() };
    let corrected = |source: &str| {
        let (planned, text) = rewritten(source.as_bytes(), &known, &Cell::default(), &options);
        let inserted: u32 = planned.outcomes.iter().map(|outcome| outcome.inserted).sum();
        (inserted, String::from_utf8(text).unwrap(), planned)
    };
    let whole = format!("MODULE M\n  PROC main()\n{}  ENDPROC\nENDMODULE\n", corners.concat());
    let (in_one, ..) = corrected(&whole);
    let split = program("    one;\n    two;\n");
    let (in_two, text, planned) = corrected(&split);
    assert!(in_one > 3 && in_two == in_one, "{in_one} {in_two}");
    let unchecked = |outcome: &MotionOutcome| {
        !matches!(outcome.reason(), None | Some(OutcomeReason::JointNotMeasured { .. }))
    };
    assert!(!planned.outcomes.iter().any(unchecked), "{:?}", planned.outcomes);
    let report = judged_on(&split, &text, &perturbed(5, 3.0));
    assert!(report.differences.is_empty(), "{:?}", report.differences);
    let between = report.between.unwrap();
    assert!(between.largest_mm.unwrap() < 0.01 && between.unchecked == 0, "{between:?} {text}");
    // From two places no line has one start.
    let (from_several, ..) = corrected(&program("    one;\n    two;\n    one;\n    two;\n"));
    assert!(from_several < in_one, "{from_several}");
}

/// Behind a reversal a target that takes up the backlash is inserted a tenth of a millimetre from the corner: it was taken for the corner, and
/// the corner for an added motion with another zone.
#[test]
fn targets_that_take_up_backlash_are_not_the_corners_beside_them() {
    let mut worn = perturbed(3, 1.0);
    worn.effects.extend([0, 2, 4].map(|joint| Effect::Backlash(Backlash { joint, play_rad: 4e-4 })));
    let known = estimated(worn.clone(), &[Joints::zeros()]);
    for (width, height) in [(100.0, 70.0), (60.0, 90.0), (40.0, 40.0)] {
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height], [0.0, 0.0]];
        let lines = corners
            .map(|[x, y]| format!("    MoveL [[{:.1},{y:.1},330.0],{PLACE},v100,fine,tool0;\n", 330.0 + x));
        let source = format!(
            "MODULE M\n  PROC main()\n    MoveJ [[330.0,0.0,380.0],{PLACE},v100,fine,tool0;\n{}  ENDPROC\nENDMODULE\n",
            lines.concat()
        );
        let (_, text) = rewritten(source.as_bytes(), &known, &Cell::default(), &Options::default());
        let text = String::from_utf8(text).unwrap();
        assert!(text.matches("Move").count() > source.matches("Move").count(), "{text}");
        let report = judged_on(&source, &text, &worn);
        assert!(report.differences.is_empty(), "{:?} {text}", report.differences);
    }
}

/// Each edit of a corrected program with the words that tell it and their line.
fn edits(text: &str) -> Vec<(String, &'static str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().position(|line| line.contains("MoveL")).unwrap();
    let last = lines.iter().rposition(|line| line.contains("MoveL")).unwrap();
    let insert = |at: usize, line: &str| [&lines[..at], &[line], &lines[at..]].concat().join("\n");
    let replace = |at: usize, from: &str, to: &str| {
        let line = lines[at].replacen(from, to, 1);
        [&lines[..at], &[line.as_str()], &lines[at + 1..]].concat().join("\n")
    };
    let off = format!("    MoveL [[21,30,28],{PLACE},v100,z1,tS\\WObj:=wB;");
    let beyond = format!("    MoveL [[60,10,20],{PLACE},v100,z1,tS\\WObj:=wB;");
    // The main routine is repeated, so a displacement may hold in its first motion too.
    vec![
        (insert(first + 2, &off), "an added motion that ends", first + 3),
        (insert(last + 1, &beyond), "an added motion that is on no path", last + 2),
        (insert(first, "    PDispSet [[0,0,5],[1,0,0,0]];"), "the program displacement differs", 5),
        (
            text.replace("[[0,0,50],[1,0,0,0]],[1,", "[[0,0,52],[1,0,0,0]],[1,"),
            "tool tS at [0.0, 0.0, 52.0] mm",
            5,
        ),
        (text.replace("[[300,10,200]", "[[300,10,205]"), "work object wB", 5),
        (replace(first + 2, "tS", "tool0"), "tool tool0", first + 3),
        (replace(first + 2, "MoveL", "MoveJ"), "MoveJ here, MoveL in the original", first + 3),
    ]
}

#[test]
fn what_else_differs_is_told_by_line() {
    for (tolerance_mm, inserts) in [(0.5, false), (0.001, true)] {
        let text = corrected(&Options { tolerance_mm, ..Options::default() });
        assert_eq!(text.matches("Move").count() > program().matches("Move").count(), inserts, "{text}");
        let edits = edits(&text);
        // Of an inserted target the tool and the kind are those of no motion of the original.
        let count = if inserts { 5 } else { edits.len() };
        for (edited, words, line) in &edits[..count] {
            assert_ne!(edited, &text, "{words}");
            let found = judged(&program(), edited).differences;
            let sentence = found.iter().find(|sentence| sentence.contains(words));
            let sentence = sentence.unwrap_or_else(|| panic!("{words}: {found:?}\n{edited}"));
            let lines = sentence.split(':').next().unwrap();
            let first = lines.split([' ', ',']).nth(1).unwrap();
            assert!(inserts || first == line.to_string(), "{line}: {sentence}\n{edited}");
        }
    }
    // A target that the program text no longer tells, and a motion that is lost.
    let text = corrected(&plain());
    let unknown = text.replacen("MoveL [[", "MoveL Offs(pNowhere,[[", 1);
    assert!(!judged(&program(), &unknown).differences.is_empty());
    let lost: Vec<&str> = text.lines().enumerate().filter(|(k, _)| *k != 7).map(|(_, line)| line).collect();
    let found = judged(&program(), &lost.join("\n")).differences;
    assert!(found.iter().any(|sentence| sentence.contains("motions were removed")), "{found:?}");
}

/// The circle point decides where the circle lies, and no motion ends there.
#[test]
fn a_circle_point_that_moves_otherwise_than_its_motion_is_told() {
    let text = corrected(&plain());
    let line = text.lines().find(|line| line.contains("MoveC")).unwrap();
    let number = line.split("[[").nth(1).unwrap().split(',').next().unwrap();
    for by_mm in [0.5, 1.5, 8.0] {
        let moved: f64 = number.parse::<f64>().unwrap() + by_mm;
        let edited = text.replace(line, &line.replacen(number, &moved.to_string(), 1));
        let found = judged(&program(), &edited).differences;
        assert!(found.len() == 1 && found[0].contains("the circle point is"), "{found:?}");
    }
}

/// The line with the tool turned about an axis, at the target with this number in it.
fn turned(line: &str, target: usize, axis: usize, deg: f64) -> String {
    let start = line.match_indices("[[").nth(target).unwrap().0;
    let quaternion = start + line[start..].find("],[").unwrap() + 3;
    let end = quaternion + line[quaternion..].find(']').unwrap();
    let q: Vec<f64> = line[quaternion..end].split(',').map(|word| word.parse().unwrap()).collect();
    let mut about = Vector3::zeros();
    about[axis] = deg.to_radians();
    let was = UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3]));
    let now = (was * UnitQuaternion::from_scaled_axis(about)).into_inner();
    let [w, i, j, k] = [now.w, now.i, now.j, now.k];
    format!("{}{w:.7},{i:.7},{j:.7},{k:.7}{}", &line[..quaternion], &line[end..])
}

/// A tool that is turned about its tip stays at its target, and cuts with another face.
#[test]
fn a_tool_that_is_turned_at_its_target_is_told() {
    let text = corrected(&plain());
    let first = text.lines().find(|line| line.contains("MoveL")).unwrap();
    let round = text.lines().find(|line| line.contains("MoveC")).unwrap();
    let dense = corrected(&Options { tolerance_mm: 0.001, ..plain() });
    let inserted = dense.lines().find(|line| line.contains("MoveL")).unwrap();
    for (text, line, target, words) in [
        (&text, first, 0, "MoveL ends turned by"),
        (&text, round, 0, "at its circle point"),
        (&text, round, 1, "MoveC ends turned by"),
        (&dense, inserted, 0, "an added motion that ends turned by"),
    ] {
        for (axis, deg) in [(0, 0.7), (1, 3.0), (2, 5.0)] {
            let edited = text.replace(line, &turned(line, target, axis, deg));
            let found = judged(&program(), &edited).differences;
            let found: Vec<&String> =
                found.iter().filter(|sentence| !sentence.contains("configuration")).collect();
            assert!(
                found.len() == 1 && found[0].contains(words),
                "{words} {axis} {deg}: {found:?}\n{edited}"
            );
        }
        // As little as another model turns it.
        let edited = text.replace(line, &turned(line, target, 0, 0.1));
        assert_eq!(judged(&program(), &edited).differences, Vec::<String>::new());
    }
}

/// Lines so long that a correction inserts targets, and an arc.
fn long() -> String {
    program().replace("16.0,20.0]", "160.0,20.0]").replace("[60.0,80.0", "[60.0,79.0")
}

/// Deleting all inserted targets leaves every target of the original where it belongs.
#[test]
fn the_path_between_targets_is_judged_as_the_correction_judges_it() {
    let known = estimated(perturbed(3, 1.0), &[Joints::zeros()]);
    let tolerance_mm = Options::default().tolerance_mm;
    for (emit, circles) in [
        (Emit::Targets, Circles::Keep),
        (Emit::Targets, Circles::Segments),
        (Emit::Joints, Circles::Segments),
    ] {
        let options = Options { emit, circles, ..Options::default() };
        let (plan, text) = rewritten(long().as_bytes(), &known, &Cell::default(), &options);
        let text = String::from_utf8(text).unwrap();
        assert!(plan.outcomes.iter().map(|outcome| outcome.inserted).sum::<u32>() > 0);
        let report = judged(&long(), &text);
        assert_eq!(report.differences, Vec::<String>::new());
        let between = report.between.unwrap();
        let flagged = plan
            .outcomes
            .iter()
            .filter(|outcome| matches!(outcome.reason(), Some(OutcomeReason::PathDeviation { .. })));
        assert_eq!(between.beyond, flagged.count(), "{between:?}");
        let planned =
            plan.outcomes.iter().filter_map(|outcome| outcome.path_deviation_mm.get()).fold(0.0, f64::max);
        let found = between.largest_mm.unwrap();
        assert!((found - planned).abs() < 0.005, "{found} {planned}");
        // The same without the inserted targets.
        let bare = Options { tolerance_mm: 1e3, circles: Circles::Keep, ..Options::default() };
        let (plan, text) = rewritten(long().as_bytes(), &known, &Cell::default(), &bare);
        let between = judged(&long(), &String::from_utf8(text).unwrap()).between.unwrap();
        let planned =
            plan.outcomes.iter().filter_map(|outcome| outcome.path_deviation_mm.get()).fold(0.0, f64::max);
        assert!(planned > tolerance_mm && between.beyond > 0, "{planned} {between:?}");
        assert!((between.largest_mm.unwrap() - planned).abs() < 0.005, "{planned} {between:?}");
    }
}

/// With another model than the correcting one all of a path is off alike; what is between its targets is none the worse for it.
#[test]
fn another_model_and_a_placement_that_is_kept_do_not_alarm() {
    for (seed, share) in [(3, 0.85), (3, 1.1), (3, 0.5)] {
        let known = estimated(perturbed(seed, share), &[Joints::zeros()]);
        let (_, text) = rewritten(long().as_bytes(), &known, &Cell::default(), &Options::default());
        let between = judged(&long(), &String::from_utf8(text).unwrap()).between.unwrap();
        assert_eq!(between.beyond, 0, "{share}: {between:?}");
    }
}

/// Each was "ok": a zone instead of a stop, another configuration, another setting, an external axis.
#[test]
fn what_decides_how_a_motion_leads_to_its_target_is_compared() {
    let text = corrected(&plain());
    let last = text.lines().rfind(|line| line.contains("MoveL")).unwrap();
    let edits = [
        (text.replace("v100,fine", "v100,z20"), "zone z20 here, fine in the original"),
        (text.replacen("v100,z1,", "v1000,z1,", 1), "speed v1000 here, v100 in the original"),
        (text.replace(last, &last.replace(",0],[9E9", ",1],[9E9")), "the configuration"),
        (text.replace(last, &last.replace(",0,0],[9E9", ",1,0],[9E9")), "the configuration"),
        (text.replace(last, &last.replace("],[9E9", "],[100")), "the external axes"),
        (text.replace("PROC main()", "PROC main()\nSingArea\\Wrist;"), "ConfL, ConfJ, SingArea"),
        (text.replace("PROC main()", "PROC main()\nConfL\\Off;"), "ConfL, ConfJ, SingArea"),
    ];
    for (edited, words) in edits {
        assert_ne!(edited, text, "{words}");
        let found = judged(&program(), &edited).differences;
        assert!(found.iter().any(|sentence| sentence.contains(words)), "{words}: {found:?}");
    }
}

/// Without one of them the joints between lead off the line.
#[test]
fn a_joint_target_that_kept_a_line_and_is_lost_is_told() {
    let options = Options { emit: Emit::Joints, tolerance_mm: 0.02, ..Options::default() };
    let long = program().replace("16.0,20.0]", "160.0,20.0]");
    let known = estimated(perturbed(3, 1.0), &[Joints::zeros()]);
    let (_, text) = rewritten(long.as_bytes(), &known, &Cell::default(), &options);
    let text = String::from_utf8(text).unwrap();
    assert!(judged(&long, &text).differences.is_empty(), "{:?}", judged(&long, &text).differences);
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.iter().rposition(|line| line.contains("MoveAbsJ")).unwrap();
    let kept: Vec<&str> = lines
        .iter()
        .enumerate()
        .filter(|(k, _)| *k < first - 8 || *k >= first)
        .map(|(_, line)| *line)
        .collect();
    let found = judged(&long, &kept.join("\n")).differences;
    assert!(found.iter().any(|sentence| sentence.contains("leave the line")), "{found:?}\n{text}");
}

/// What the figures of the cut do not show: where air moves lead, and how inserted targets are reached.
#[test]
fn targets_of_air_moves_and_the_kind_of_inserted_motions_are_compared() {
    let text = corrected(&plain());
    let approach = text.lines().find(|line| line.contains("MoveJ [[")).unwrap();
    let height = approach.split(&['[', ']'][..]).nth(2).unwrap().split(',').nth(2).unwrap();
    for by_mm in [0.5, 5.0, -20.0, -60.0] {
        let moved = height.parse::<f64>().unwrap() + by_mm;
        let edited = text.replace(approach, &approach.replacen(height, &moved.to_string(), 1));
        assert_ne!(edited, text);
        let found = judged(&program(), &edited).differences;
        assert!(
            found.len() == 1 && found[0].contains("from where the original intends"),
            "{by_mm}: {found:?}"
        );
    }
    // Joint targets stay, or move by a correction alone.
    let joints =
        "    MoveAbsJ [[0,10,10,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tS;\n    unknownMotion";
    let [original, with_joints] = [program(), text].map(|text| text.replace("    unknownMotion", joints));
    assert_eq!(judged(&original, &with_joints).differences, Vec::<String>::new());
    for (to, words) in [("[[30,10", "turns a joint"), ("[[0,10.5", "from where"), ("[[0,60", "turns a joint")]
    {
        let found = judged(&original, &with_joints.replace("[[0,10", to)).differences;
        assert!(found.iter().any(|sentence| sentence.contains(words)), "{to}: {found:?}");
    }
    // The first inserted motion as another one.
    let dense = corrected(&Options { tolerance_mm: 0.001, ..plain() });
    assert_eq!(judged(&program(), &dense).differences, Vec::<String>::new());
    let line = dense.lines().find(|line| line.contains("MoveL")).unwrap();
    for (from, to, words) in [
        ("MoveL", "MoveJ", "an added MoveJ"),
        ("v100", "v1000", "an added motion with speed v1000, before one with speed v100"),
        (",z1,", ",z100,", "an added motion with zone z100"),
    ] {
        let found = judged(&program(), &dense.replacen(line, &line.replace(from, to), 1)).differences;
        assert!(found.iter().any(|sentence| sentence.contains(words)), "{words}: {found:?}");
    }
}
