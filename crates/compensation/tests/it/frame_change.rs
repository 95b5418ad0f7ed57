//! Lines and arcs that begin under another tool or in another work object. The real arm is followed densely here.

use nalgebra::Isometry3;
use truegrind_arm::condition::Condition;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::inverse::Inverse;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::Options;
use truegrind_compensation::plan::solved_program::plan;
use truegrind_math::se3::Pose;
use truegrind_programs::motion::{Listing, Motion};
use truegrind_programs::nc;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::rapid::Task;

use super::segment::{EXT, known, module_with, rewrite};
use super::{nominal, perturbed};

/// A line with `tool0` from where the flange stands at the first target, then one with a tool of its own in another object.
fn program(second: &str) -> String {
    let data = "  PERS tooldata long:=[TRUE,[[40,-20,110],[0.965925826,0,0.258819045,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n  \
                PERS wobjdata side:=[FALSE,TRUE,\"\",[[300,100,200],[0.923879533,0,0,0.382683432]],[[0,0,0],[1,0,0,0]]];\n";
    let lines = format!(
        "  MoveL [[420,-250,350],[0,0,1,0],[-1,0,-1,0],{EXT}],v100,fine,tool0;\n{second}  MoveL [[420,-200,350],[0,0,1,0],[-1,0,-1,0],{EXT}],v100,fine,tool0;\n"
    );
    module_with(data, &lines)
}

/// Tool and work object of a motion.
fn frames(listing: &Listing, motion: &Motion) -> [Pose; 2] {
    let tool = listing.tools[motion.tool.unwrap() as usize].value.as_ref().unwrap().frame.pose();
    let object = listing.work_objects[motion.work_object.unwrap() as usize].value.as_ref().unwrap();
    [tool, object.user_frame.pose() * object.object_frame.pose()]
}

fn told(motion: &Motion) -> Pose {
    motion.to().unwrap().value.unwrap().cartesian().unwrap().pose()
}

/// Largest distance of the real arm's tip from the intended straight line, over the motions of `text` that lead to the end of
/// the second motion of `source` (mm).
fn off_line(source: &str, text: &str, known: &Estimated, put_in: usize) -> f64 {
    let before = Task::read(&[("p.mod", source.as_bytes())]).listing;
    let after = Task::read(&[("p.mod", text.as_bytes())]).listing;
    let [tool, object] = frames(&before, &before.motions[1]);
    let sheet = nominal();
    let inverse = Inverse::new(&sheet, &Condition::default(), &sheet);
    let real = known.model.at_condition(&Condition::default());
    let mut near = inverse
        .solve_near(&told(&after.motions[0]), &Joints::new(-0.5, 0.4, 0.2, 0.0, 0.9, -0.5))
        .unwrap()
        .joints;
    // Intended: from the tip of the second tool when the flange is at the first target, to the second
    // target.
    let begin = (told(&before.motions[0]) * tool).translation.vector;
    let end = (object * told(&before.motions[1])).translation.vector;
    let along = (end - begin).normalize();
    let mut from = told(&after.motions[0]);
    let mut most = 0.0_f64;
    for motion in &after.motions[1..=1 + put_in] {
        assert_eq!(frames(&after, motion), [tool, object], "put in with the tool of the line");
        let start = object.inverse() * from * tool;
        let to = told(motion);
        for k in 0..=200 {
            let s = f64::from(k) / 200.0;
            let place = start.translation.vector.lerp(&to.translation.vector, s);
            let turn = start.rotation.slerp(&to.rotation, s);
            let flange = object * Isometry3::from_parts(place.into(), turn) * tool.inverse();
            near = inverse.solve_near(&flange, &near).unwrap().joints;
            let off = (real.forward(&near) * tool).translation.vector - begin;
            most = most.max((off - along * along.dot(&off)).norm());
        }
        from = object * to * tool.inverse();
    }
    most
}

#[test]
fn a_line_that_begins_under_another_tool_is_checked_and_straightened() {
    let line = format!(
        "  MoveL [[-50,250,60],[0,0.2588190451,0.9659258263,0],[0,-1,1,0],{EXT}],v100,fine,long\\WObj:=side;\n"
    );
    let source = program(&line);
    let known = known(&perturbed(5, 3.0));
    let loose = Options { tolerance_mm: 5.0, ..Options::default() };
    let (planned, text) = rewrite(&source, &known, &loose);
    let outcome = &planned.outcomes[1];
    let stated = outcome
        .path_deviation_mm
        .get()
        .unwrap_or_else(|| panic!("it is not checked: {outcome:?}\n{:?}", planned.notes));
    let found = off_line(&source, &text, &known, 0);
    assert!(found > 0.05 && (found - stated).abs() < 4e-3, "{found} mm, stated {stated}");
    // The start of the first line is unknown, and only that line is not checked.
    assert!(planned.notes.iter().any(|note| note.contains("is not checked (line 5)")), "{:?}", planned.notes);

    let tight = Options { tolerance_mm: found / 3.0, ..Options::default() };
    let (planned, text) = rewrite(&source, &known, &tight);
    let outcome = &planned.outcomes[1];
    assert!(outcome.inserted > 0, "{outcome:?}");
    let left = off_line(&source, &text, &known, outcome.inserted as usize);
    assert!(left <= tight.tolerance_mm + 2e-3, "{left} mm, {} asked", tight.tolerance_mm);
}

/// A shift of the frame moves no axis, but the line behind it counted as one from an unknown start.
#[test]
fn a_line_behind_a_shift_of_the_frame_is_checked() {
    let source = |dialect: usize, y: f64| {
        let shift = |y: f64| match (dialect, y != 0.0) {
            (_, false) => String::new(),
            (0, _) => format!("TRANS X0 Y{y:.1}\n"),
            (1, _) => format!("TRANS Y{y:.1}\nATRANS X0\nAROT X0\n"),
            _ => format!("G52 Y{y:.1}\n"),
        };
        let head = match dialect {
            2 => {
                "O1\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,300],[1,0,0,0]])\n\
                  G90 G21 G17 G54\nT1 M6\nG43.4 H1\n"
            }
            _ => {
                "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,300],[1,0,0,0]]\n\
                  G90 G71 G17 G54\nT1 D1 M6\nTRAORI\n"
            }
        };
        format!(
            "{head}G0 X0.0 Y-250.0 Z20.0 A180.0 B0.0 C0.0\nG1 X0.0 Y-250.0 Z0.0 A180.0 B0.0 C0.0 F600.\n{}\
             G1 X0.0 Y{:.1} Z0.0 A180.0 B0.0 C0.0\nM30\n",
            shift(y),
            250.0 - y
        )
    };
    let known = known(&perturbed(5, 3.0));
    for dialect in 0..3 {
        let bend = |y: f64| {
            let (text, name) = (source(dialect, y), if dialect == 2 { "p.nc" } else { "p.mpf" });
            let setup = nc::setup::Setup { angles: Some(Angles::Wpr), ..nc::setup::Setup::default() };
            let listing = nc::Task::read(&[(name, text.as_bytes())], &setup).listing;
            let loose = Options { tolerance_mm: 5.0, ..Options::default() };
            let planned = plan(&listing, &known, &Cell::default(), &loose);
            let outcome = &planned.outcomes[2];
            assert_eq!(outcome.status, MotionStatus::Changed, "{text}{outcome:?}");
            assert!(!planned.notes.iter().any(|note| note.contains("unknown or not corrected")), "{text}");
            outcome.path_deviation_mm.get().unwrap()
        };
        let (shifted, plain) = (bend(-10.0), bend(0.0));
        assert!(plain > 0.02 && (shifted - plain).abs() < 1e-6, "{shifted} {plain}");
    }
}
