//! The path between targets: circles kept and replaced, rounded corners, joint speeds, the configuration of inserted targets.
//! The real arm is followed densely here by independent code.

use std::f64::consts::PI;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::{Joints, Model};
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::{Circles, Emit, Options};
use truegrind_compensation::plan::Plan;
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_compensation::segment::corner::Corner;
use truegrind_compensation::segment::curve::Curve;
use truegrind_math::option_f64::OptionF64;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::Listing;
use truegrind_programs::rapid::Task;
use truegrind_programs::rewrite::{NewTarget, RewriteOptions};

use super::{estimated, nominal, perturbed, run_on};

pub(super) const EXT: &str = "[9E9,9E9,9E9,9E9,9E9,9E9]";

pub(super) fn module(body: &str) -> String {
    module_with("", body)
}

/// A module with data of its own.
pub(super) fn module_with(data: &str, body: &str) -> String {
    format!("MODULE M\n{data} PROC main()\n{body} ENDPROC\nENDMODULE\n")
}

/// `[position, tool down, configuration]`.
pub(super) fn down(x: f64, y: f64, z: f64) -> String {
    format!(
        "[[{x:.4},{y:.4},{z:.4}],[0,0,1,0],[{},0,{},0],{EXT}]",
        i32::from(y >= 0.0) - 1,
        i32::from(y >= 0.0) - 1
    )
}

pub(super) fn known(actual: &Model) -> Estimated {
    let mut known = estimated(actual.clone(), &[Joints::zeros()]);
    // Everything is measured: these tests are about the path.
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    known
}

pub(super) fn rewrite(source: &str, known: &Estimated, options: &Options) -> (Plan, String) {
    let task = Task::read(&[("p.mod", source.as_bytes())]);
    let planned = plan(&task.listing, known, &Cell::default(), options);
    let rewritten = task.rewrite(&planned.changes, &RewriteOptions::default()).unwrap();
    let text = rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    (planned, String::from_utf8(text).unwrap())
}

/// Commanded tool poses at the ends of all motions; tool0 in wobj0, so they are flange poses.
pub(super) fn told(listing: &Listing) -> Vec<Pose> {
    let pose =
        |m: &truegrind_programs::motion::Motion| m.to().unwrap().value.unwrap().cartesian().unwrap().pose();
    listing.motions.iter().map(pose).collect()
}

/// Poses that the real arm reaches when the controller follows commanded poses.
pub(super) fn gone(path: impl Iterator<Item = Pose>, start: &Joints, actual: &Model) -> Vec<Pose> {
    let sheet = nominal();
    let inverse = Inverse::new(&sheet, &Condition::default(), &sheet);
    let posed = actual.at_condition(&Condition::default());
    let mut near = *start;
    path.map(|pose| {
        near = inverse.solve_near(&pose, &near).unwrap().joints;
        posed.forward(&near)
    })
    .collect()
}

pub(super) fn start_joints(pose: &Pose) -> Joints {
    let sheet = nominal();
    let inverse = Inverse::new(&sheet, &Condition::default(), &sheet);
    inverse.solve_near(pose, &Joints::new(-0.3, 0.4, 0.2, 0.0, 0.9, -0.3)).unwrap().joints
}

#[test]
fn targets_on_a_long_line_state_the_quarter_in_which_they_lie() {
    let source = module(&format!(
        "  MoveL {},v100,fine,tool0;\n  MoveL {},v100,fine,tool0;\n",
        down(380.0, -230.0, 300.0),
        down(380.0, 230.0, 300.0)
    ));
    let options = Options { tolerance_mm: 0.005, ..Options::default() };
    let (planned, text) = rewrite(&source, &known(&perturbed(5, 3.0)), &options);
    assert!(planned.outcomes[1].inserted > 2, "{:?}", planned.outcomes);
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    for motion in &task.listing.motions {
        let target = *motion.to().unwrap().value.unwrap().cartesian().unwrap();
        // Far from the border of the quarter, where the sign of y says it.
        if target.position_mm[1].abs() > 20.0 {
            let quarter = if target.position_mm[1] > 0.0 { 0 } else { -1 };
            assert_eq!(target.conf[0], quarter, "{target:?}");
        }
    }
}

// ---- courses and corners in closed form ----

#[test]
fn a_right_angle_is_rounded_by_a_parabola() {
    let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0);
    let way_in = Curve::line(at(-100.0, 0.0), at(0.0, 0.0));
    let way_out = Curve::line(at(0.0, 0.0), at(0.0, 30.0));
    let corner = Corner::of(&way_in, &way_out, 10.0);
    assert!((corner.cut_mm() - 10.0 * 2.0_f64.sqrt() / 4.0).abs() < 1e-12);
    assert!((corner.at(0.5).translation.vector - Vector3::new(-2.5, 2.5, 0.0)).norm() < 1e-12);
    // Cut to half of the shorter way.
    let cut = Corner::of(&way_in, &way_out, 40.0);
    assert!((cut.at(0.0).translation.vector.x + 15.0).abs() < 1e-12);
    // Where the path turns back, a point 0.05 mm beyond the tip was said to be 1.3 mm off.
    let back = Corner::of(&way_in, &Curve::line(way_in.to, way_in.from), 10.0);
    for t in [0.3, 0.45, 0.5, 0.7] {
        let off = back.distance(&at(-4.95, 1e-3), t);
        assert!(off < 0.06, "{t}: {off}");
    }
    // Beside the corner, before it and behind it.
    let off = |x: f64, y: f64, t: f64| corner.distance(&at(x, y), t);
    let half = 2.5 + 0.1 * std::f64::consts::FRAC_1_SQRT_2;
    assert!((off(-half, half, 0.4) - 0.1).abs() < 1e-9, "{}", off(-half, half, 0.4));
    assert!((off(-30.0, 0.2, 0.0) - 0.2).abs() < 1e-12 && (off(0.3, 20.0, 1.0) - 0.3).abs() < 1e-12);
}

// ---- zones ----

fn square_program(zone: &str) -> String {
    module(&format!(
        "  MoveL {},v100,fine,tool0;\n  MoveL {},v100,{zone},tool0;\n  MoveL {},v100,fine,tool0;\n",
        down(300.0, 20.0, 320.0),
        down(420.0, 20.0, 320.0),
        down(420.0, 170.0, 320.0)
    ))
}

#[test]
fn a_rounded_corner_is_checked_along_its_parabola() {
    let actual = perturbed(21, 3.0);
    let known = known(&actual);
    let source = square_program("z50");
    let (planned, text) = rewrite(&source, &known, &Options { tolerance_mm: 1.0, ..Options::default() });
    let stop =
        rewrite(&square_program("fine"), &known, &Options { tolerance_mm: 1.0, ..Options::default() }).0;
    let task = Task::read(&[("p.mod", text.as_bytes())]);
    let before = Task::read(&[("p.mod", source.as_bytes())]);
    let (told, meant) = (told(&task.listing), told(&before.listing));
    let bezier = |p: &[Pose], t: f64| {
        // Radius 50 on ways of 120 and 150 mm.
        let a = p[1].lerp_slerp(&p[0], 50.0 / (p[0].translation.vector - p[1].translation.vector).norm());
        let c = p[1].lerp_slerp(&p[2], 50.0 / (p[2].translation.vector - p[1].translation.vector).norm());
        a.lerp_slerp(&p[1], t).lerp_slerp(&p[1].lerp_slerp(&c, t), t)
    };
    let path = (0..=300).map(|k| bezier(&told, f64::from(k) / 300.0));
    let dense: Vec<Vector3<f64>> =
        (0..=20_000).map(|k| bezier(&meant, f64::from(k) / 20_000.0).translation.vector).collect();
    let mut most = 0.0_f64;
    for pose in gone(path, &start_joints(&told[0]), &actual) {
        let near = |point: &Vector3<f64>| (point - pose.translation.vector).norm();
        most = most.max(dense.iter().map(near).fold(f64::INFINITY, f64::min));
    }
    let stated = planned.outcomes[2].path_deviation_mm.get().unwrap();
    let line = stop.outcomes[2].path_deviation_mm.get().unwrap();
    // The dense corner has only points of the corner to be near to, spaced by 0.004 mm.
    assert!(
        most > 1e-3 && stated >= line && (most.max(line) - stated).abs() < 5e-3,
        "{most} {line} {stated}"
    );
}

/// Between targets lines and arcs alone were judged.
#[test]
fn verification_judges_rounded_corners_as_the_correction_does() {
    let actual = perturbed(21, 3.0);
    let source = square_program("z50");
    let (planned, text) =
        rewrite(&source, &known(&actual), &Options { tolerance_mm: 1.0, ..Options::default() });
    let largest_mm = |text: &str| {
        let report = run_on(&actual, source.as_bytes(), text.as_bytes(), &Cell::default());
        report.between.unwrap().largest_mm.unwrap()
    };
    let stated = planned.outcomes.iter().filter_map(|outcome| outcome.path_deviation_mm.get());
    let (stated, found) = (stated.fold(0.0, f64::max), largest_mm(&text));
    assert!((stated - found).abs() < 0.01, "{stated} {found}");
    // A target on the line to a corner, 40 mm before it: its zone of 50 mm ends half-way there.
    let listing = Task::read(&[("p.mod", text.as_bytes())]).listing;
    let ends = told(&listing);
    let length_mm = (ends[1].translation.vector - ends[0].translation.vector).norm();
    let pose = ends[1].lerp_slerp(&ends[0], 40.0 / length_mm);
    let motion = &listing.motions[1];
    let (start, end) = (motion.statement.start as usize, motion.statement.end as usize);
    let (at, q) = (pose.translation.vector, pose.rotation.quaternion());
    let inserted = format!(
        "MoveL [[{:.4},{:.4},{:.4}],[{:.8},{:.8},{:.8},{:.8}],[{}",
        at.x,
        at.y,
        at.z,
        q.w,
        q.i,
        q.j,
        q.k,
        text[start..end].splitn(4, '[').nth(3).unwrap().split_once("],[").unwrap().1.replace("z50", "z1")
    );
    let sharper = format!("{}{inserted}\n{}", &text[..start], &text[start..]);
    // The corner cuts off √2/4 of its radius: 50 mm before, 20 mm now.
    let found = largest_mm(&sharper);
    assert!((found - 30.0 * 2.0_f64.sqrt() / 4.0).abs() < 0.5, "{found}\n{sharper}");
}

/// Targets were inserted half-way to a rounded corner: they cut its zone short, and bent the path by more than they straightened the line.
#[test]
fn inserted_targets_keep_clear_of_rounded_corners() {
    let known = known(&perturbed(5, 3.0));
    let source = |zone: &str| {
        module(&format!(
            "  MoveL {},v100,fine,tool0;\n  MoveL {},v100,{zone},tool0;\n  MoveL {},v100,fine,tool0;\n",
            down(250.0, -230.0, 320.0),
            down(420.0, -230.0, 320.0),
            down(420.0, 230.0, 320.0)
        ))
    };
    let planned = |zone: &str, tolerance_mm: f64| {
        let options = Options { tolerance_mm, ..Options::default() };
        rewrite(&source(zone), &known, &options).0
    };
    assert_eq!(planned("z200", 5.0).outcomes[2].reason(), None);
    let rounded = planned("z200", 0.005);
    // The corner's zone reaches half-way into the first line: there is no place for a target.
    assert_eq!(rounded.outcomes[1].inserted, 0, "{:?}", rounded.outcomes[1]);
    let Some(OutcomeReason::PathDeviation { mm }) = rounded.outcomes[1].reason() else {
        panic!("{:?}", rounded.outcomes[1])
    };
    assert!(mm > 0.05 && mm < 0.5, "{mm}");
    // And 85 mm into the second one, so that targets begin at 170 mm of 460; the correction moves them by up to 7 mm.
    assert!(rounded.outcomes[2].inserted > 0, "{:?}", rounded.outcomes[2]);
    let inserted = &rounded.changes.iter().find(|change| change.motion == 2).unwrap().before;
    for extra in inserted {
        let NewTarget::Cartesian { position_mm, .. } = extra.target else { panic!("{extra:?}") };
        assert!(position_mm[1] > -230.0 + 155.0, "{position_mm:?}");
    }
    let corner_mm = rounded.outcomes[2].path_deviation_mm.get().unwrap();
    assert!(corner_mm < 0.5, "{corner_mm}");
    // A line between joint targets needs them, whatever the corner.
    let options = Options { tolerance_mm: 0.05, emit: Emit::Joints, ..Options::default() };
    let (joints, _) = rewrite(&source("z200").replacen("MoveL", "MoveJ", 1), &known, &options);
    assert!(joints.outcomes[1].inserted > 0, "{:?}", joints.outcomes[1]);
    // Without a zone they stand wherever they are needed.
    let sharp = planned("fine", 0.005);
    assert!(sharp.outcomes[1].inserted > 0 && sharp.outcomes[2].inserted > rounded.outcomes[2].inserted);
    assert!(
        sharp.outcomes.iter().all(|outcome| outcome.status == MotionStatus::Changed),
        "{:?}",
        sharp.outcomes
    );
}

// ---- speed ----

/// A start from which the configuration of what follows is known, though it is not checked.
const HOME: &str = "MoveAbsJ [[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tool0;\n";

#[test]
fn a_joint_that_cannot_follow_is_named_with_its_ratio() {
    // About axis 1, the tool turning with the path: axis 1 alone moves, at v / r.
    let limit = nominal().limits.speed_rad_s.unwrap()[0];
    let radius = 300.0;
    let at = |degrees: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
        let q = (turn * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI)).into_inner();
        let (sin, cos) = degrees.to_radians().sin_cos();
        let quarter = (degrees / 90.0).floor();
        format!(
            "[[{:.6},{:.6},400],[{:.9},{:.9},{:.9},{:.9}],[{quarter},0,0,0],{EXT}]",
            radius * cos,
            radius * sin,
            q.w,
            q.i,
            q.j,
            q.k
        )
    };
    for (speed, flagged) in [(0.9, false), (1.25, true)] {
        let mm_s = speed * limit * radius;
        let source = module(&format!(
            "  ConfL\\Off;\n  {HOME}  MoveL {},v100,fine,tool0;\n  MoveC {},{},[{mm_s},20000,1,1],fine,tool0;\n",
            at(-40.0),
            at(0.0),
            at(40.0)
        ));
        let (planned, _) = rewrite(&source, &known(&nominal()), &Options::default());
        let reason = planned.outcomes[2].reason();
        if flagged {
            let Some(OutcomeReason::TooFast { joint, ratio }) = reason else {
                panic!("{:?}", planned.outcomes)
            };
            assert_eq!(joint, 0);
            assert!((ratio - speed).abs() < 1e-6, "{ratio}");
        } else {
            assert_eq!(reason, None, "{:?}", planned.outcomes);
        }
    }
    // A line near axis 1 turns it far more quickly than one far away.
    let far = |x: f64| {
        module(&format!(
            "  ConfL\\Off;\n  {HOME}  MoveL {},v100,fine,tool0;\n  MoveL {},v1000,fine,tool0;\n",
            down(x, -100.0, 400.0),
            down(x, 100.0, 400.0)
        ))
    };
    let ratio = |x: f64| {
        let (planned, _) = rewrite(&far(x), &known(&nominal()), &Options::default());
        match planned.outcomes[2].reason() {
            Some(OutcomeReason::TooFast { joint: 0, ratio }) => Some(ratio),
            _ => None,
        }
    };
    // Half way of the line axis 1 turns at v / x.
    assert_eq!(ratio(400.0), None);
    let near = ratio(200.0).unwrap();
    let expected = 1000.0 / 200.0 / limit;
    assert!(near > 0.85 * expected && near <= expected, "{near} of {expected}");
}

#[test]
fn the_speed_that_an_option_states_counts() {
    let line = |speed: &str| {
        let source = module(&format!(
            "  ConfL\\Off;\n  {HOME}  MoveL {},v100,fine,tool0;\n  MoveL {},{speed},fine,tool0;\n",
            down(200.0, -100.0, 400.0),
            down(200.0, 100.0, 400.0)
        ));
        let source = source.replace("MODULE M\n", "MODULE M\n CONST num slow:=100;\n");
        let (planned, _) = rewrite(&source, &known(&nominal()), &Options::default());
        match planned.outcomes[2].reason() {
            Some(OutcomeReason::TooFast { joint: 0, ratio }) => Some(ratio),
            None => None,
            // A function of no file may move the arm.
            Some(OutcomeReason::UnknownStart) if speed.contains("GetSpeed") => None,
            other => panic!("{speed}: {other:?}"),
        }
    };
    let fast = line("[1000,500,1,1]").unwrap();
    // 200 mm at 1,000 mm/s; the option stands in place of v_tcp, or of both speeds.
    for speed in ["v100\\V:=1000", "v10\\V:=2*500", "v100\\T:=0.2"] {
        assert!((line(speed).unwrap() - fast).abs() < 1e-9, "{speed}");
    }
    for speed in ["v100", "v1000\\V:=100", "v1000\\V:=slow", "v1000\\T:=2"] {
        assert_eq!(line(speed), None, "{speed}");
    }
    // What is known only at run time is not judged.
    assert_eq!(line("v1000\\V:=GetSpeed()"), None);
    assert_eq!(line("v1000\\T:=GetSpeed()"), None);
}

#[test]
fn a_joint_motion_states_how_far_it_is_from_that_of_the_sheet() {
    let source = module(&format!(
        "  MoveJ {},v100,fine,tool0;\n  MoveJ {},v100,fine,tool0;\n",
        down(300.0, 60.0, 320.0),
        down(420.0, 200.0, 380.0)
    ));
    let actual = perturbed(3, 2.0);
    let (planned, text) = rewrite(&source, &known(&actual), &Options::default());
    let (before, after) = (Task::read(&[("p", source.as_bytes())]), Task::read(&[("p", text.as_bytes())]));
    let sheet = nominal();
    let joints = |listing: &Listing| told(listing).iter().map(start_joints).collect::<Vec<_>>();
    let (b, a) = (joints(&before.listing), joints(&after.listing));
    let posed = (sheet.at_condition(&Condition::default()), actual.at_condition(&Condition::default()));
    let most = (0..=50)
        .map(|k| {
            let s = f64::from(k) / 50.0;
            let meant = posed.0.forward(&b[0].lerp(&b[1], s)).translation.vector;
            (posed.1.forward(&a[0].lerp(&a[1], s)).translation.vector - meant).norm()
        })
        .fold(0.0, f64::max);
    let stated = planned.outcomes[1].path_deviation_mm.get().unwrap();
    assert!(most > 1e-3 && (most - stated).abs() < 4e-3, "{most} stated as {stated}");
    assert_eq!(planned.outcomes[1].reason(), None);
}

#[test]
fn external_axes_of_what_is_put_in_go_in_proportion_to_the_way() {
    let actual = perturbed(11, 1.0);
    let with = |target: String, a: &str, b: &str| target.replace(EXT, &format!("[{a},{b},9E9,9E9,9E9,9E9]"));
    let source = module(&format!(
        "  MoveL {},v100,fine,tool0;\n  MoveL {},v100,fine,tool0;\n  MoveC {},{},v100,fine,tool0;\n",
        with(down(320.0, 30.0, 300.0), "100", "7"),
        with(down(480.0, 30.0, 300.0), "200", "7"),
        with(down(420.0, 90.0, 300.0), "9E9", "9E9"),
        with(down(360.0, 30.0, 300.0), "20", "7"),
    ));
    // What is put in before the line and before the arc, and the places of all ends.
    let run = |tolerance_mm: f64, source: &str| {
        let options = Options { tolerance_mm, circles: Circles::Segments, ..Options::default() };
        let (planned, text) = rewrite(source, &known(&actual), &options);
        let task = Task::read(&[("p.mod", text.as_bytes())]);
        let targets = task.listing.motions.iter().map(|m| m.to().unwrap().value.unwrap());
        let places: Vec<(Vector3<f64>, [Option<f64>; 6])> = targets
            .map(|value| value.cartesian().copied().unwrap())
            .map(|target| (Vector3::from(target.position_mm), target.external.map(OptionF64::get)))
            .collect();
        (planned.outcomes[1].inserted as usize, planned.outcomes[2].inserted as usize, places, text)
    };
    let (line, _, places, _) = run(0.001, &source);
    assert!(line >= 1, "{line}");
    for (at, external) in &places[..=line + 1] {
        let share = (at.x - places[0].0.x) / (places[line + 1].0.x - places[0].0.x);
        assert!((external[0].unwrap() - 100.0 - 100.0 * share).abs() < 0.1, "{at} {external:?}");
        assert_eq!(external[1..3], [Some(7.0), None]);
    }
    let (line, arc, places, _) = run(0.01, &source);
    assert!(arc >= 8, "{arc}");
    // Half a turn from (480, 30) over (420, 90) to (360, 30).
    for (at, external) in &places[line + 1..] {
        let share = (at.y - 30.0).atan2(at.x - 420.0) / PI;
        assert!((external[0].unwrap() - 200.0 + 180.0 * share).abs() < 2.0, "{at} {external:?}");
    }
    // Where none moves, they stay as they are written.
    let still = source.replace("[200,7", "[100,7").replace("[20,7", "[100,7").replace("[100,7", "[1E2,07.0");
    let (_, arc, places, text) = run(0.01, &still);
    assert_eq!(text.matches("[1E2,07.0,9E9").count(), 3, "{text}");
    assert!(arc >= 8 && places.iter().all(|place| place.1[..3] == [Some(100.0), Some(7.0), None]), "{text}");
}

#[test]
fn nothing_is_put_in_where_the_wrist_is_interpolated_by_itself() {
    let actual = perturbed(11, 1.0);
    let options = Options { tolerance_mm: 0.001, ..Options::default() };
    let body = |area: &str| {
        module(&format!(
            "  SingArea {area};\n  MoveL {},v100,fine,tool0;\n  MoveL {},v100,fine,tool0;\n",
            down(320.0, 30.0, 300.0),
            down(480.0, 30.0, 300.0)
        ))
    };
    let (off, _) = rewrite(&body("\\Off"), &known(&actual), &options);
    assert!(off.outcomes[1].inserted > 0);
    assert!(!off.notes.iter().any(|note| note.contains("SingArea")), "{:?}", off.notes);
    let (wrist, text) = rewrite(&body("\\Wrist"), &known(&actual), &options);
    assert_eq!(wrist.outcomes[1].inserted, 0);
    assert_eq!(text.matches("MoveL").count(), 2);
    assert!(matches!(wrist.outcomes[1].reason(), Some(OutcomeReason::PathDeviation { mm }) if mm > 0.001));
    let note = wrist.notes.iter().find(|note| note.contains("SingArea")).unwrap();
    assert!(note.starts_with("on 2 lines or arcs") && note.ends_with("(lines 4, 5)"), "{note}");
}

#[test]
fn a_configuration_that_the_text_does_not_tell_is_said_to_be_taken() {
    let actual = perturbed(11, 0.5);
    let body = |conf: &str| {
        module(&format!(
            "  {conf};\n  MoveJ {},v100,fine,tool0;\n  MoveJ {},v100,fine,tool0;\n",
            down(320.0, 30.0, 300.0),
            down(330.0, 30.0, 300.0)
        ))
    };
    let (planned, _) = rewrite(&body("ConfJ\\Off"), &known(&actual), &Options::default());
    let note = planned.notes.iter().find(|note| note.contains("configuration not monitored")).unwrap();
    // Only the first: the second goes from there.
    assert!(note.starts_with("1 motion goes from an unknown start") && note.ends_with("(line 4)"), "{note}");
    let (planned, _) = rewrite(&body("ConfJ\\On"), &known(&actual), &Options::default());
    assert!(!planned.notes.iter().any(|note| note.contains("configuration not monitored")));
}

/// A line behind a call of a routine that no file declares was called corrected without a check of its path.
#[test]
fn a_line_of_which_the_start_is_not_known_is_flagged() {
    let line = |x: f64, y: f64, turns: &str| {
        format!("  MoveL [[{x},{y},350],[0,0,1,0],{turns},{EXT}],v100,fine,tool0;\n")
    };
    let [a, b] = [line(420.0, -250.0, "[-1,0,-1,0]"), line(420.0, 250.0, "[0,0,0,0]")];
    let lines = format!("{a}  SetSpindle 5000;\n{b}");
    let known = known(&perturbed(5, 3.0));
    let loose = Options { tolerance_mm: 5.0, ..Options::default() };
    let stated =
        rewrite(&module_with("", &format!("{a}{b}")), &known, &loose).0.outcomes[1].path_deviation_mm;
    let stated = stated.get().unwrap();
    // Where it leads as if the routine did not move.
    let (tight, _) = rewrite(
        &module_with("", &lines),
        &known,
        &Options { tolerance_mm: stated / 2.0, ..Options::default() },
    );
    let why = tight.outcomes[1].reason();
    assert!(
        matches!(why, Some(OutcomeReason::PathDeviation { mm }) if (mm - stated).abs() < 1e-9),
        "{why:?}"
    );
    assert_eq!((tight.outcomes[1].status, tight.outcomes[1].inserted), (MotionStatus::Flagged, 0));
    let (planned, _) = rewrite(&module_with("", &lines), &known, &loose);
    let statuses: Vec<MotionStatus> = planned.outcomes.iter().map(|outcome| outcome.status).collect();
    assert_eq!(statuses, [MotionStatus::Changed, MotionStatus::Flagged]);
    assert_eq!(planned.outcomes[1].reason(), Some(OutcomeReason::UncheckedPath));
}
