//! A cut is corrected as a whole or not at all: a step of the whole correction in the middle of the part is worse than no
//! correction. The class of fault: a motion that remains unmodified (out of bounds, not known from the text, refused by the
//! writer) beside corrected motions of the same cut.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use truegrind_arm::estimated::Estimated;
use truegrind_arm::model::Joints;
use truegrind_compensation::cell::Cell;
use truegrind_compensation::compensate::{Compensated, compensate};
use truegrind_compensation::cut::Cuts;
use truegrind_compensation::deviation::MotionStatus;
use truegrind_compensation::options::{Emit, Options};
use truegrind_compensation::plan::reason::OutcomeReason;
use truegrind_compensation::plan::steps_to_left::StepsToLeft;
use truegrind_programs::motion::{Mark, Reason};
use truegrind_programs::nc;
use truegrind_programs::nc::orientation::Angles;
use truegrind_programs::nc::setup::Setup;
use truegrind_programs::rapid::Task;
use truegrind_programs::reading::Program;
use truegrind_programs::rewrite::{Change, NewTarget};

use super::{estimated, perturbed};

fn known() -> Estimated {
    let mut known = estimated(perturbed(5, 1.0), &[Joints::zeros()]);
    (known.region.min_deg, known.region.max_deg) = ([-400.0; 6], [400.0; 6]);
    known.region.spacing_deg = 1e6;
    known
}

fn target(x: f64, y: f64) -> String {
    format!("[[{x},{y},400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]")
}

fn line(x: f64, zone: &str) -> String {
    format!("MoveL {},v20,{zone},tool0;\n", target(x, 0.0))
}

fn module(body: &str) -> String {
    format!("MODULE M\nVAR robtarget seen;\nPROC main()\n{body}ENDPROC\nENDMODULE\n")
}

fn done(source: &str, cuts: Cuts, tolerance_mm: f64) -> (Compensated, Vec<u8>) {
    let program = Program::Rapid(Task::read(&[("p.mod", source.as_bytes())]));
    assert!(program.listing().opaque.is_empty(), "{source}");
    let options = Options { cuts, tolerance_mm, ..Options::default() };
    let mark = Mark { version: "1.0.0".into(), model: "abc".into(), partial: false };
    let done = compensate(&program, &known(), &Cell::default(), &options, Some(mark)).unwrap();
    let bytes = done.rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    (done, bytes)
}

fn statuses(done: &Compensated) -> Vec<MotionStatus> {
    done.plan.outcomes.iter().map(|outcome| outcome.status).collect()
}

use MotionStatus::{Changed, Flagged, Left, Refused};

#[test]
fn a_target_that_cannot_be_reached_keeps_its_cut_and_no_other() {
    let body = [
        line(380.0, "z1"),
        line(390.0, "z1"),
        line(900.0, "z1"),
        line(400.0, "fine"),
        line(410.0, "z1"),
        format!("MoveJ {},v100,z10,tool0;\n", target(380.0, 50.0)),
        line(390.0, "z1"),
    ]
    .concat();
    let (done, bytes) = done(&module(&body), Cuts::Whole, 0.05);
    // The line from the end of the cut stays with it.
    assert_eq!(statuses(&done), [Refused, Refused, Refused, Refused, Refused, Changed, Changed]);
    let because = |index: usize| done.plan.outcomes[index].reason().unwrap().to_string();
    assert!(because(0).contains("line 6 is not corrected: target is out of reach"), "{}", because(0));
    assert!(because(2).contains("reach"), "{}", because(2));
    let text = String::from_utf8(bytes).unwrap();
    for x in ["380", "390", "900", "400", "410"] {
        assert!(text.contains(&target(x.parse().unwrap(), 0.0)), "{x}: {text}");
    }
    // An unmodified motion keeps its deviation, and the report says so.
    assert_eq!(done.plan.outcomes[1].after_mm, done.plan.outcomes[1].before_mm);
}

#[test]
fn a_target_known_only_at_run_time_keeps_its_cut() {
    let late = "seen:=CRobT(\\Tool:=tool0);\nMoveL seen,v20,z1,tool0;\n";
    let body = [line(380.0, "z1"), late.to_owned(), line(390.0, "z1")].concat();
    let (partly, _) = done(&module(&body), Cuts::Whole, 0.05);
    assert_eq!(statuses(&partly), [Refused, Left, Refused]);
    assert!(matches!(partly.plan.outcomes[0].reason(), Some(OutcomeReason::PartOfCut { line: 6, .. })));
    // A whole cut for one reason: nothing is refused that could have been corrected.
    let (all_left, _) = done(&module(&late.repeat(2)), Cuts::Whole, 0.05);
    assert_eq!(statuses(&all_left), [Left, Left]);
}

#[test]
fn a_loop_or_a_branch_is_part_of_the_cut_around_it() {
    let late = "MoveL Offs(seen,0,0,0),v20,z1,tool0;\n";
    for block in [
        format!("FOR i FROM 1 TO 3 DO\n{late}ENDFOR\n"),
        format!("IF DInput(di1)=1 THEN\n{late}ELSE\n{}ENDIF\n", line(385.0, "z1")),
    ] {
        let body = [line(380.0, "z1"), block, line(390.0, "z1")].concat();
        let (done, bytes) = done(&module(&body), Cuts::Whole, 0.05);
        assert!(!done.changed(), "{:?}", statuses(&done));
        assert_eq!(String::from_utf8(bytes).unwrap(), module(&body));
    }
}

/// A module whose main calls a routine between lines.
fn with_routine(before: &str, routine: &str, behind: &str) -> String {
    module(&format!("{before}part;\n{behind}"))
        .replace("ENDMODULE", &format!("PROC part()\n{routine}ENDPROC\nENDMODULE"))
}

#[test]
fn a_cut_extends_into_a_called_routine_and_out_of_it() {
    let late = "MoveL Offs(seen,0,0,0),v20,z1,tool0;\n".to_owned();
    let [a, b, c, d] = [380.0, 385.0, 390.0, 395.0].map(|x| line(x, "z1"));
    // In the order of the file: the lines of main, then those of the routine.
    let inside = with_routine(&a, &[b.clone(), late.clone()].concat(), &d);
    let (done, bytes) = done(&inside, Cuts::Whole, 0.05);
    assert_eq!(statuses(&done), [Refused, Refused, Refused, Left]);
    assert_eq!(bytes, inside.as_bytes());
    let outside = with_routine(&[late.clone(), a.clone()].concat(), &b, &line(395.0, "fine"));
    assert_eq!(statuses(&self::done(&outside, Cuts::Whole, 0.05).0), [Left, Refused, Refused, Refused]);
    // Every caller of a routine that stays as it is, however deep the calls are, and none that stops before it.
    let deep = with_routine(&a, "inner;\n", &[line(410.0, "fine"), "part;\n".to_owned(), c].concat())
        .replace("ENDMODULE", &format!("PROC inner()\n{late}ENDPROC\nENDMODULE"));
    assert_eq!(statuses(&self::done(&deep, Cuts::Whole, 0.05).0), [Refused, Refused, Refused, Left]);
    let [stop, last] = [line(385.0, "fine"), late.replace("z1", "fine")];
    let apart = with_routine(&stop, &last, &line(395.0, "fine"));
    let (apart, _) = self::done(&apart, Cuts::Whole, 0.05);
    // The start of what is left stays with it, and so does the line behind it.
    assert_eq!(statuses(&apart), [Refused, Refused, Left]);
    assert_eq!(apart.plan.steps, None);
    // Corrected on both sides: nothing is refused, and nothing steps.
    let (whole, _) = self::done(&with_routine(&a, &b, &d), Cuts::Whole, 0.05);
    assert_eq!((statuses(&whole), whole.plan.steps), (vec![Changed; 3], None));
}

/// With a stop at every target each line is a cut of its own: what leads to the one that is left stays with it, and what follows it too. A
/// line from an approach that is left is corrected, and stands beside it.
#[test]
fn steps_beside_what_is_left_are_counted() {
    let late = "MoveL Offs(seen,0,0,0),v20,fine,tool0;\n".to_owned();
    let rest = [line(390.0, "fine"), line(395.0, "fine")].concat();
    let body = [line(380.0, "fine"), line(385.0, "fine"), late.clone(), rest.clone()].concat();
    let (done, _) = done(&module(&body), Cuts::Whole, 0.05);
    assert_eq!(statuses(&done), [Refused, Refused, Left, Refused, Refused]);
    assert_eq!(done.plan.steps, None);
    let (done, _) = self::done(&module(&(late + &rest)), Cuts::Whole, 0.05);
    assert_eq!(statuses(&done), [Left, Changed, Changed]);
    let steps = done.plan.steps.unwrap();
    assert_eq!(steps.motions, [1]);
    assert!(steps.largest_mm.is_some_and(|mm| mm > 0.05 && mm < 10.0), "{steps:?}");
    // What an instruction of a module that is not given does there is unknown.
    let elsewhere = "grind [[387,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n".to_owned();
    let body = [line(380.0, "fine"), line(385.0, "fine"), elsewhere, line(390.0, "fine")].concat();
    let (done, _) = self::done(&module(&body), Cuts::Whole, 0.05);
    assert_eq!(done.plan.steps.unwrap().motions, [1, 3]);
    let even = [line(380.0, "fine"), line(385.0, "fine")].concat();
    assert_eq!(self::done(&module(&even), Cuts::Whole, 0.05).0.plan.steps, None);
}

/// A cut that is left began at a corrected place: its first line became a wedge.
#[test]
fn the_approach_to_a_cut_that_is_left_stays_too() {
    let air = line(365.0, "z10").replace("MoveL", "MoveJ");
    let [a, b, c] = [(370.0, "z1"), (375.0, "fine"), (380.0, "z1")].map(|(x, zone)| line(x, zone));
    // Out of reach.
    let cut = c + &line(900.0, "fine");
    let found = |body: &[&str]| done(&module(&body.concat()), Cuts::Whole, 0.05);
    let (direct, bytes) = found(&[&air, &cut]);
    assert_eq!(statuses(&direct), [Refused; 3]);
    assert_eq!(direct.plan.outcomes[0].reason(), Some(OutcomeReason::StartOfUnchangedCut { line: 5 }));
    assert_eq!(bytes, module(&[air.as_str(), &cut].concat()).as_bytes());
    // By a line to a stop, and in the order of the file in a loop.
    assert_eq!(statuses(&found(&[&air, &b, &cut]).0), [Refused; 4]);
    assert_eq!(statuses(&found(&["WHILE TRUE DO\n", &air, &b, &cut, "ENDWHILE\n"]).0), [Refused; 4]);
    // What ends a longer cut takes that with it, and what leads to another cut as well takes that.
    assert_eq!(statuses(&found(&[&air, &a, &b, &cut]).0), [Refused; 5]);
    let either = [&air, "IF bad THEN\n", &cut, "ELSE\n", &b, "ENDIF\n"].concat();
    let source = module(&either).replace("VAR robtarget", "VAR bool bad;\nVAR robtarget");
    assert_eq!(statuses(&done(&source, Cuts::Whole, 0.05).0), [Refused; 4]);
    // A correction below the tolerance makes no wedge.
    assert_eq!(
        statuses(&done(&module(&[air, cut].concat()), Cuts::Whole, 5.0).0),
        [Changed, Refused, Refused]
    );
}

/// A search that is left began at a corrected place: tilted, its line meets the part elsewhere.
#[test]
fn the_start_of_a_search_that_is_left_stays_too() {
    let air = line(365.0, "z10").replace("MoveL", "MoveJ");
    let start = line(370.0, "fine");
    let search = |x: f64| format!("SearchL\\Stop,di1,seen,{},v20,tool0;\n", target(x, 0.0));
    let found = |body: &[&str]| statuses(&done(&module(&body.concat()), Cuts::Whole, 0.05).0);
    assert_eq!(found(&[&air, &start, &search(380.0)]), [Changed; 3]);
    // Out of reach.
    assert_eq!(found(&[&air, &start, &search(900.0)]), [Refused; 3]);
    // Left with the line behind it, whose target only the run time tells.
    let late = line(385.0, "fine").replace("MoveL ", "MoveL Offs(").replace(",v20", ",0,0,AInput(ai1)),v20");
    assert_eq!(found(&[&air, &start, &search(380.0), &late])[..2], [Refused; 2]);
    let joints = Options { emit: Emit::Joints, ..Options::default() };
    let source = module(&[air.as_str(), &start, &search(380.0)].concat());
    let program = Program::Rapid(Task::read(&[("p.mod", source.as_bytes())]));
    let done = compensate(&program, &known(), &Cell::default(), &joints, None).unwrap();
    let found = statuses(&done);
    assert!(found[2].is_written() == found[1].is_written(), "{found:?}");
}

/// Lines lead from cut to cut, and one is left: its start was corrected with the cut of lines before it.
#[test]
fn the_start_of_a_cut_that_is_left_stays_whatever_leads_to_it() {
    let at = |x: f64, z: f64, zone: &str| {
        format!("MoveL [[{x},0,{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,{zone},tool0;\n")
    };
    let late = "MoveL Offs(seen,0,0,0),v20,fine,tool0;\n";
    let air = at(350.0, 450.0, "fine").replace("MoveL", "MoveJ");
    let first = [at(350.0, 400.0, "fine"), at(360.0, 400.0, "z1"), at(370.0, 400.0, "fine")].concat();
    let over = [at(370.0, 450.0, "z10"), at(375.0, 450.0, "z10"), at(375.0, 400.0, "fine")].concat();
    let left = at(380.0, 400.0, "z1") + late;
    let away = at(390.0, 450.0, "fine");
    let found = |body: &[&str]| statuses(&done(&module(&body.concat()), Cuts::Whole, 0.05).0);
    // The line that draws the tool back from the first cut may be tilted; what it leads to is kept, and so is what leads away.
    assert_eq!(
        found(&[&air, &first, &over, &left, &away]),
        [Changed, Changed, Changed, Changed, Refused, Refused, Refused, Refused, Left, Refused]
    );
    // Without such a line the tool may cut all the way: nothing is corrected.
    let along = at(375.0, 400.0, "fine");
    assert_eq!(found(&[&air, &first, &along, &left, &away])[..6], [Refused; 6]);
    // A single line from the end of a cut to an air move takes the tool away; where to is not known, so the air move stays too.
    assert_eq!(found(&[&air, &first, late, &air]), [Changed, Changed, Changed, Changed, Left, Refused]);
    // Behind a label, and in a routine with an error handler that repeats it.
    let again = ["n:=0;\nagain:\nn:=n+1;\n", &left, "IF n<3 GOTO again;\n"].concat();
    let looped =
        module(&[&air, &first[..], &again].concat()).replace("VAR robtarget", "VAR num n;\nVAR robtarget");
    let (looped, _) = done(&looped, Cuts::Whole, 0.05);
    assert!(!looped.changed(), "{:?}", statuses(&looped));
    // Refused, and what begins at its end.
    let out = at(900.0, 400.0, "fine");
    let behind = [at(372.0, 400.0, "z1"), at(380.0, 400.0, "fine")].concat();
    assert_eq!(found(&[&air, &first, &out, &behind, &air])[..7], [Refused; 7]);
}

/// A lift from wherever the robot stands keeps its shape behind a corrected motion: it kept cuts from being corrected.
#[test]
fn what_is_counted_from_the_robots_position_leaves_cuts_as_they_are() {
    let [a, b, c] = [(380.0, "z1"), (385.0, "fine"), (390.0, "z10")].map(|(x, zone)| line(x, zone));
    let air = line(370.0, "fine").replace("MoveL", "MoveJ");
    let lift = |of: &str| format!("MoveL Offs(CRobT({of}),0,0,ReadNum(dev)),v20,fine,tool0;\n");
    let own = "\\Tool:=tool0\\WObj:=wobj0";
    let with = |lift: &str, end: &str| {
        let routine = [&air, &a, &b, &c, end, "ERROR\n", lift, "RETRY;\n"].concat();
        with_routine("", &routine, &air)
    };
    let (retried, _) = done(&with(&lift(own), ""), Cuts::Whole, 0.05);
    assert_eq!(statuses(&retried), [Changed, Changed, Changed, Changed, Changed, Left]);
    assert_eq!(retried.plan.steps, None);
    assert_eq!(retried.plan.outcomes[5].reason(), Some(OutcomeReason::Program(Reason::CurrentPosition)));
    // In another tool or work object it leads elsewhere.
    for other in ["", "\\Tool:=tool0", "\\Tool:=other\\WObj:=wobj0", "\\Tool:=tool0\\WObj:=other"] {
        let (elsewhere, _) = done(&with(&lift(other), ""), Cuts::Whole, 0.05);
        assert_ne!(
            elsewhere.plan.outcomes[5].reason(),
            Some(OutcomeReason::Program(Reason::CurrentPosition))
        );
        assert_ne!(statuses(&elsewhere)[..2], [Changed; 2], "{other}");
    }
}

/// The start of a cut was refused and its lines were corrected: the first one became a wedge as high as the correction.
#[test]
fn a_cut_whose_start_is_refused_stays_too() {
    let air = |x: f64| line(x, "fine").replace("MoveL", "MoveJ");
    let [a, b] = [(380.0, "z1"), (385.0, "fine")].map(|(x, zone)| line(x, zone));
    let other = air(390.0) + &line(395.0, "fine");
    for cuts in [Cuts::Whole, Cuts::Partial] {
        let source = module(&[air(900.0), a.clone(), b.clone(), other.clone()].concat());
        let (found, _) = done(&source, cuts, 0.05);
        assert_eq!(statuses(&found), [Refused, Refused, Refused, Changed, Changed], "{cuts:?}");
        let why = found.plan.outcomes[1].reason();
        assert!(matches!(why, Some(OutcomeReason::PartOfCut { line: 4, .. })), "{why:?}");
        // By a line to a stop.
        let source = module(&[air(365.0), line(900.0, "fine"), a.clone(), b.clone(), other.clone()].concat());
        let (found, _) = done(&source, cuts, 0.05);
        assert_eq!(statuses(&found)[1..], [Refused, Refused, Refused, Changed, Changed], "{cuts:?}");
    }
}

/// A contour of stops had a line from an uncorrected corner to a corrected one: a wedge as high as the correction, and a gap where the contour
/// closes.
#[test]
fn a_line_from_an_uncorrected_corner_of_a_contour_stays_too() {
    let at = |x: f64, y: f64, z: f64| {
        format!("MoveL [[{x},{y},{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0;\n")
    };
    let air = at(360.0, 0.0, 450.0).replace("MoveL", "MoveJ");
    let [a, b, c] = [at(360.0, 0.0, 400.0), at(390.0, 0.0, 400.0), at(390.0, 20.0, 400.0)];
    let late = "MoveL Offs(seen,0,0,0),v20,fine,tool0;\n";
    let away = at(360.0, 0.0, 450.0);
    let found = |body: &[&str]| statuses(&done(&module(&body.concat()), Cuts::Whole, 0.05).0);
    // The line that draws the tool back would go sideways.
    let contour = found(&[&air, &a, &b, &c, late, &a, &away, &air]);
    assert_eq!(contour, [Refused, Refused, Refused, Refused, Left, Refused, Refused, Changed]);
    // A process may be switched at a stop, but whether off or on is not known.
    let switched = found(&[&air, &a, &b, &c, late, "SetDO do1,0;\n", &a, &away, &air]);
    assert_eq!(switched, contour);
    // An uncorrected approach through the air is none of a contour.
    let approached = found(&[&air, late, &a, &b, &c, &a, &away]);
    assert_eq!(approached[2..], [Changed; 5]);
}

/// The way out of a cut that is left was corrected: the tool was drawn out of the part sideways.
#[test]
fn the_way_out_of_a_cut_that_is_left_stays_too() {
    let at = |x: f64, z: f64, zone: &str| {
        format!("MoveL [[{x},0,{z}],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,{zone},tool0;\n")
    };
    let joint = |x: f64, z: f64| at(x, z, "z10").replace("MoveL", "MoveJ");
    let cut = |x: f64| [at(x, 400.0, "z1"), at(x + 10.0, 400.0, "fine")].concat();
    let late = "MoveL Offs(seen,0,0,0),v20,z1,tool0;\n";
    let left = [&at(350.0, 400.0, "z1"), late, &at(370.0, 400.0, "fine")].concat();
    let found = |body: &[&str]| done(&module(&body.concat()), Cuts::Whole, 0.05).0;
    for out in [at(370.0, 450.0, "z10"), joint(370.0, 450.0)] {
        let done = found(&[&joint(350.0, 450.0), &left, &out, &joint(380.0, 450.0), &cut(380.0)]);
        assert_eq!(
            statuses(&done),
            [Refused, Refused, Left, Refused, Refused, Changed, Changed, Changed],
            "{out}"
        );
        let why = done.plan.outcomes[4].reason();
        assert_eq!(why, Some(OutcomeReason::DepartureFromUnchangedCut { line: 7 }), "{out}");
        // Where it leads to the start of a corrected cut, that comes first.
        let plunge = cut(370.0);
        let done = found(&[&joint(350.0, 450.0), &left, &out, &plunge]);
        assert_eq!(statuses(&done)[3..], [Refused, Changed, Changed, Changed], "{out}");
    }
    // From a corrected cut all is corrected.
    let done = found(&[&joint(350.0, 450.0), &cut(350.0), &at(360.0, 450.0, "z10"), &joint(380.0, 450.0)]);
    assert_eq!(statuses(&done), [Changed; 5]);
}

/// After the last cut of an NC program, and between two.
#[test]
fn the_way_out_of_a_cut_of_an_nc_program_stays_too() {
    let head = "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n\
                N1 G90 G71 G17 G54\nN2 T1 D1 M6\nN3 TRAORI\n";
    let at = |code: &str, x: f64, z: f64| format!("{code} X{x:.1} Y0 Z{z} A180 B0 C0 F600\n");
    let left = [&at("G0", -10.0, 40.0), &at("G1", -10.0, 20.0), "X0 RND=2\n", &at("G1", 5.0, 20.0)].concat();
    let found = |body: &[&str]| {
        let source = [head, &body.concat(), "M30\n"].concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.mpf", source.as_bytes())], &setup));
        compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap()
    };
    let done = found(&[&left, "G0 Z40\n"]);
    assert!(!done.changed(), "{:?}", statuses(&done));
    let next = [at("G0", 20.0, 40.0), at("G1", 20.0, 20.0), at("G1", 30.0, 20.0)].concat();
    // What leads to the next cut is corrected, but not the way out.
    let done = found(&[&left, "G0 Z40\n", &next]);
    assert_eq!(statuses(&done), [Refused, Left, Left, Left, Refused, Changed, Changed, Changed]);
    assert_eq!(done.plan.outcomes[4].reason(), Some(OutcomeReason::DepartureFromUnchangedCut { line: 10 }));
}

/// A line that is written as joints, and of which no deviation is known, counted as one without a step.
#[test]
fn a_step_of_unknown_size_is_a_step() {
    let source = module(&[line(380.0, "fine"), line(385.0, "fine"), line(390.0, "fine")].concat());
    let listing = Task::read(&[("p.mod", source.as_bytes())]).listing;
    let joints = NewTarget::Joint { robot_deg: [0.0; 6] };
    let change = |motion: u32| Change { motion, targets: [joints].into(), before: Vec::new() };
    let of = |before_mm: [Option<f64>; 3]| {
        let outcome = |motion: usize| match motion {
            1 => (Left, Some(OutcomeReason::JointTarget), before_mm[1]),
            _ => (Changed, None, before_mm[motion]),
        };
        StepsToLeft::of(&listing, &[change(0), change(2)], &outcome, 0.05)
    };
    assert_eq!(of([Some(0.01); 3]), None);
    let some = of([Some(0.3), None, None]).unwrap();
    assert_eq!(
        (some.motions.as_slice(), some.of_unknown_size.as_slice()),
        ([0, 2].as_slice(), [2].as_slice())
    );
    let text = some.sentence(&listing);
    assert!(text.contains("up to 0.30 mm") && text.contains("by how much at line 6 is unknown"), "{text}");
    let none = of([None; 3]).unwrap();
    assert!(none.sentence(&listing).contains("by an unknown amount"), "{none:?}");
}

/// A line from a joint target that is left is a wedge as high as the correction. It was "ok", since the ends of the line are right.
#[test]
fn lines_from_joint_targets_that_are_left_are_counted() {
    let joint = |tool: &str| {
        format!("MoveAbsJ [[0,0,10,0,80,0],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,{tool};\n")
    };
    let steps = |body: &[String], joint_targets: bool| {
        let data = "PERS tooldata long:=[TRUE,[[0,0,60],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];";
        let source = module(&body.concat()).replace("PROC main", &format!("{data} PROC main"));
        let program = Program::Rapid(Task::read(&[("p.mod", source.as_bytes())]));
        let options = Options { joint_targets, ..Options::default() };
        let done = compensate(&program, &known(), &Cell::default(), &options, None).unwrap();
        let text = done.plan.steps.as_ref().map(|steps| steps.sentence(program.listing()));
        (done.plan.steps.map(|steps| [steps.motions, steps.from_joint_targets]), text.unwrap_or_default())
    };
    let [a, b, c] = [380.0, 385.0, 390.0].map(|x| line(x, "fine"));
    let begins = [joint("tool0"), a.clone(), b.clone()];
    let (found, text) = steps(&begins, false);
    assert_eq!(found, Some([vec![1], vec![1]]));
    assert!(
        text.contains("line 5 starts at an uncorrected joint target") && text.contains("--joint-targets"),
        "{text}"
    );
    assert_eq!(steps(&begins, true).0, None);
    // In the middle, with another tool.
    assert_eq!(steps(&[a.clone(), joint("long"), b.clone(), c.clone()], false).0, Some([vec![2], vec![2]]));
    // Behind the last line the arm moves away; a joint motion to a corrected target lies between.
    assert_eq!(steps(&[a.clone(), b.clone(), joint("tool0")], false).0, None);
    let air = a.replace("MoveL", "MoveJ");
    assert_eq!(steps(&[joint("tool0"), air, b, c], false).0, None);
}

#[test]
fn another_tool_or_work_object_begins_another_cut() {
    let other = "MoveL [[385,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,z1,long;\n";
    let air = line(380.0, "z10").replace("MoveL", "MoveJ");
    let body = [line(900.0, "z1"), air, other.to_owned()].concat();
    let source = module(&body).replace(
        "VAR robtarget",
        "PERS tooldata long:=[TRUE,[[0,0,60],[1,0,0,0]],[1,[0,0,10],[1,0,0,0],0,0,0]];\nVAR robtarget",
    );
    let (done, _) = done(&source, Cuts::Whole, 0.05);
    assert_eq!(statuses(&done), [Refused, Changed, Changed]);
}

#[test]
fn what_the_writer_refuses_keeps_its_cut_too() {
    // Force control has no form with joint targets, which only the writer detects.
    let pressed = format!("FCPressL {},v20,5,z1,tool0;\n", target(390.0, 0.0));
    let [begin, end] = [370.0, 405.0].map(|x| line(x, "fine").replace("MoveL", "MoveJ"));
    let body = [begin, line(380.0, "z1"), pressed, line(400.0, "fine"), end].concat();
    let source = module(&body);
    let program = Program::Rapid(Task::read(&[("p.mod", source.as_bytes())]));
    let plan = |cuts: Cuts| {
        let options = Options { cuts, emit: Emit::Joints, ..Options::default() };
        compensate(&program, &known(), &Cell::default(), &options, None).unwrap()
    };
    // The line behind it would start where the uncorrected one ends.
    assert_eq!(statuses(&plan(Cuts::Single)), [Changed, Changed, Refused, Refused, Changed]);
    let whole = plan(Cuts::Whole);
    // And the ways to its start and from its end stay with it.
    assert_eq!(statuses(&whole), [Refused; 5]);
    let reasons: Vec<_> = whole.plan.outcomes.iter().map(|outcome| outcome.reason()).collect();
    assert!(matches!(reasons[1], Some(OutcomeReason::PartOfCut { line: 6, .. })), "{reasons:?}");
    assert_eq!(reasons[3], Some(OutcomeReason::LineWithoutStart));
    let text = whole.rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
    assert!(String::from_utf8(text).unwrap().contains(&line(400.0, "fine")));
}

#[test]
fn a_block_that_may_be_skipped_keeps_the_cut_around_it() {
    let head = "O1\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,250],[1,0,0,0]])\n\
                G90 G21 G17 G54\nT1 M6\nG43.4 H1\n";
    let at = |code: &str, x: f64| format!("{code} X{x:.1} Y0. Z20. A180. B0. C0. F600.\n");
    let cut = |middle: String| {
        let source =
            [head, &at("G0", -20.0), &at("G1", -10.0), &middle, &at("G1", 20.0), &at("G0", 20.0), "M30\n"]
                .concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.nc", source.as_bytes())], &setup));
        statuses(&compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap())
    };
    assert_eq!(cut(at("G1", 0.0)), [Changed; 5]);
    let skipped = cut(format!("/{}", at("G1", 0.0)));
    assert_eq!(skipped[1..4], [Refused, Left, Refused], "{skipped:?}");
    // The air moves beside a cut that stays are not corrected; those to the next cut and behind it are.
    let two = [format!("/{}", at("G1", 0.0)), at("G1", 5.0), at("G0", 10.0), at("G1", 12.0), at("G1", 15.0)]
        .concat();
    let found = cut(two);
    assert_eq!(found, [Refused, Refused, Left, Refused, Changed, Changed, Changed, Changed, Changed]);
}

/// Under exact stop each line counted as a cut of its own.
#[test]
fn an_exact_stop_of_an_nc_program_ends_no_cut() {
    let head = "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n\
                N1 G90 G71 G17 G54\nN2 T1 D1 M6\nN3 TRAORI\n";
    let at = |code: &str, x: f64| format!("{code} X{x:.1} Y0 Z20 A180 B0 C0 F600\n");
    for stop in ["G64\n", "G60\n"] {
        let blocks = [
            at("G0", -20.0),
            at("G1", -10.0),
            format!("/{}", at("G1", 0.0)),
            at("G1", 5.0),
            at("G1", 10.0),
            at("G0", 20.0),
        ];
        let source = [head, stop, &blocks.concat(), "M30\n"].concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.mpf", source.as_bytes())], &setup));
        let done = compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap();
        assert!(!done.changed(), "{stop}{:?}", statuses(&done));
    }
}

/// A path whose words are not those of a line or an arc had no tool and no work offset, and so no cut: the motions before and behind it
/// were corrected, with a step of the whole correction at its ends.
#[test]
fn a_path_in_other_words_is_part_of_the_cut_around_it() {
    let own = [
        (
            "p.ngc",
            "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n\
                   G90 G21 G17 G54\nT1 M6\nG43 H1\nG0 X-20 Y0 Z40 A180 B0 C0\nG1 Z20 F600\nX-10\n",
            "X10 Y0 Z20 A180 B0 C0\nX20\nG0 Z60\nM2\n",
            ["@10 ^30\n"].as_slice(),
        ),
        (
            "p.mpf",
            "; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n\
                   N1 G90 G71 G17 G54\nN2 T1 D1 M6\nN3 TRAORI\nG0 X-20 Y0 Z40 A180 B0 C0\nG1 Z20 F600\nX-10\n",
            "G1 X10 Y0 Z20 A180 B0 C0\nX20\nG0 Z60\nM30\n",
            ["POLY PO[X]=(5,0.5) PO[Y]=(5,1) PL=10\n", "OSCILL[U]=(X,Y,Z)\n"].as_slice(),
        ),
        (
            "p.h",
            "0 BEGIN PGM P MM\n; truegrind angles wpr\n; truegrind tool T1 t [[0,0,50],[1,0,0,0]]\n\
                 ; truegrind frame G54 w [[400,0,250],[1,0,0,0]]\n1 TOOL CALL 1 Z\n2 M128\n3 L X-20 Y+0 Z+40 A+180 B+0 C+0 FMAX\n4 L Z+20 F600\n5 L X-10\n",
            "20 L X+10 Y+0 Z+20 A+180 B+0 C+0\n21 L X+20\n22 L Z+60 FMAX\n23 END PGM P MM\n",
            [
                "6 LP PR+10 PA+30\n",
                "6 CTP PR+10 PA+5\n",
                "6 FL AN+30 LEN10\n",
                "6 APPR LT X+5 Y+0 LEN5 RL\n",
                "6 SPL X+5 Y+5 Z+20 K3X+0 K2X+0 K1X-5 K3Y+0 K2Y+0 K1Y-5 K3Z+0 K2Z+0 K1Z+0\n",
            ]
            .as_slice(),
        ),
    ];
    for (name, head, tail, paths) in own {
        let of = |path: &str| {
            let source = [head, path, tail].concat();
            let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
            let program = Program::Nc(nc::Task::read(&[(name, source.as_bytes())], &setup));
            statuses(&compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap())
        };
        assert!(of("").iter().all(|status| *status == Changed), "{name}: {:?}", of(""));
        for path in paths {
            let found = of(path);
            assert!(!found.iter().any(|status| matches!(status, Changed | Flagged)), "{path}{found:?}");
        }
    }
    // An axis beside the arm moves nothing here: the line behind it begins where the one before it ends.
    let (_, head, tail, _) = own[1];
    for block in ["SPOS=90\n", "POS[U]=10\n", "U5\n"] {
        let source = [head, block, tail].concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.mpf", source.as_bytes())], &setup));
        let done = compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap();
        assert_eq!(statuses(&done), [Changed, Changed, Changed, Left, Changed, Changed, Changed], "{block}");
    }
}

/// Behind a jump, a label or a call a block without its own G0 or G1 may be a cut: the whole of it stays, and with it the air moves.
#[test]
fn a_cut_whose_rest_is_reached_by_jumps_or_calls_stays_whole() {
    let head = "O1\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,250],[1,0,0,0]])\n\
                G90 G21 G17 G54\nT1 M6\nG43.4 H1\nG0 X-20. Y0. Z40. A180. B0. C0.\nG1 Z20. F600.\nX-10.\n";
    let tail = "X10. Y0. Z20. A180. B0. C0.\nX20.\nG0 Z60.\nM30\n";
    let statuses = |middle: &str, behind: &str| {
        let source = [head, middle, tail, behind].concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.nc", source.as_bytes())], &setup));
        let done = compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap();
        let bytes = done.rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
        (statuses(&done), bytes == source.as_bytes(), done)
    };
    let (plain, ..) = statuses("X0.\n", "");
    assert!(plain.iter().all(|status| *status == Changed), "{plain:?}");
    for (middle, behind) in [
        ("IF [#500 EQ 1] GOTO 90\nX0.\nN90 ", ""),
        ("N90 X0.\nIF [#500 LT 3] GOTO 90\n", ""),
        ("M98 P1000\n", "O1000\nM8\nM99\n"),
        ("M98 P2000\n", ""),
        ("G65 P2000 A1.\n", ""),
    ] {
        let (found, is_same, done) = statuses(middle, behind);
        assert!(is_same && !done.changed(), "{middle}: {found:?}");
        let alone = |reason: Option<OutcomeReason>| reason == Some(OutcomeReason::AirMoveAlone);
        assert!(done.plan.outcomes.iter().any(|outcome| alone(outcome.reason())), "{middle}: {found:?}");
    }
}

/// The tool leaves a corrected cut along its own lift, even if the next cut stays: what leads there writes out the axes that it omits.
#[test]
fn a_corrected_cut_is_left_along_its_lift_whatever_comes_next() {
    let head = "O1\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,250],[1,0,0,0]])\n\
                G90 G21 G17 G54\nT1 M6\nG43.4 H1\nG0 X-20. Y0. Z40. A180. B0. C0.\nG1 Z20. F600.\nX-10.\nG0 Z60.\n";
    let tail = "G1 Z20.\nX#500\nG0 Z60.\nM30\n";
    let lifted = |approach: &str| {
        let source = [head, approach, tail].concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.nc", source.as_bytes())], &setup));
        let done = compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap();
        let bytes = done.rewritten.files[0].edits.apply(source.as_bytes()).unwrap();
        (statuses(&done), String::from_utf8(bytes).unwrap())
    };
    for approach in ["G0 X5. Y10. Z60. A180. B0. C0.\n", "G0 X5.\n", "G0 X5. Y10.\nG0 Z40.\n"] {
        let (found, text) = lifted(approach);
        assert_eq!(found[..4], [Changed; 4], "{approach}{text}");
        assert!(found[4..].iter().all(|status| *status != Changed), "{found:?}");
        let line = text.lines().find(|line| line.starts_with("G0 X5.")).unwrap();
        for word in ["X5.", "Z60.", "A180.", "B0.", "C0."] {
            assert!(line.contains(word), "{line}");
        }
    }
    // Nothing in between: the lift leads to the cut that stays.
    assert_ne!(lifted("").0[3], Changed);
}

/// Blocks with a G1 of their own before, in and behind a subprogram are one cut, from whichever side one of them cannot be corrected.
#[test]
fn a_cut_that_goes_on_in_a_subprogram_stays_whole() {
    let head = "O1\n(truegrind angles wpr)\n(truegrind tool T1 t [[0,0,50],[1,0,0,0]])\n(truegrind frame G54 w [[400,0,250],[1,0,0,0]])\n\
                G90 G21 G17 G54\nT1 M6\nG43.4 H1\n";
    let at = |x: f64| format!("G1 X{x:.1} Y0. Z20. A180. B0. C0. F600.\n");
    let cut = |[before, within, behind]: [f64; 3]| {
        let first = format!("G0 X{before:.1} Y0. Z40. A180. B0. C0.\n");
        let [before, within, behind] = [before, within, behind].map(at);
        let source =
            [head, &first, &before, "M98 P1000\n", &behind, "G0 Z60.\nM30\nO1000\n", &within, "M99\n"]
                .concat();
        let setup = Setup { angles: Some(Angles::Wpr), ..Setup::default() };
        let program = Program::Nc(nc::Task::read(&[("p.nc", source.as_bytes())], &setup));
        let found =
            statuses(&compensate(&program, &known(), &Cell::default(), &Options::default(), None).unwrap());
        // The first and last cutting block and that of the subprogram.
        [found[1], found[3], found[5]]
    };
    assert_eq!(cut([-10.0, 0.0, 10.0]), [Changed; 3]);
    // Out of reach.
    for far in [[-10.0, 900.0, 10.0], [-10.0, 0.0, 900.0], [900.0, 0.0, 10.0]] {
        assert_eq!(cut(far), [Refused; 3], "{far:?}");
    }
}

#[test]
fn a_routine_whose_frame_is_a_parameter_belongs_to_the_cuts_around_its_calls() {
    let [a, b] = [380.0, 395.0].map(|x| line(x, "z1"));
    let given =
        "MoveL [[385,0,400],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,z1,tool0\\WObj:=given;\n";
    let source = module(&[a.as_str(), "part wobj0;\n", b.as_str()].concat())
        .replace("ENDMODULE", &format!("PROC part(PERS wobjdata given)\n{given}ENDPROC\nENDMODULE"));
    let (done, bytes) = done(&source, Cuts::Whole, 0.05);
    assert_eq!(statuses(&done), [Refused, Refused, Left]);
    assert_eq!(bytes, source.as_bytes());
}

#[test]
fn in_part_a_step_between_neighbours_stays_below_the_tolerance() {
    let body: String =
        (0..9).map(|k| line(if k == 4 { 900.0 } else { 380.0 + f64::from(k) }, "z1")).collect();
    let source = module(&body);
    // The correction is some tenths of a millimetre: no part of the cut may be moved alone.
    let (tight, bytes) = done(&source, Cuts::Partial, 0.01);
    assert!(statuses(&tight).iter().all(|status| *status == Refused));
    assert!(
        matches!(tight.plan.outcomes[3].reason(), Some(OutcomeReason::Step { line: 8, mm }) if mm > 0.01)
    );
    assert_eq!(bytes, source.as_bytes());
    let (loose, bytes) = done(&source, Cuts::Partial, 5.0);
    // Where the line behind the target out of reach begins is not known: it is corrected, and flagged.
    let mut expected = [Changed; 9];
    (expected[4], expected[5]) = (Refused, Flagged);
    assert_eq!(statuses(&loose), expected);
    assert!(String::from_utf8(bytes).unwrap().contains("! truegrind 1.0.0 model abc partial\n"));
    let again = Task::read(&[("p.mod", b"MODULE M\n! truegrind 1.0.0 model abc partial\nENDMODULE\n")]);
    assert_eq!(
        again.listing.marks[0],
        Some(Mark { version: "1.0.0".into(), model: "abc".into(), partial: true })
    );
}

/// Random programs of cuts with interspersed targets that cannot be corrected: of two consecutive motions of a cut never only
/// one is moved.
#[test]
fn no_random_program_has_a_cut_half_corrected() {
    let (mut moved, mut kept) = (0, 0);
    for seed in 0..60 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut body = String::new();
        let (mut fine, mut air) = (Vec::new(), Vec::new());
        for k in 0..30 {
            let zone = if random.random_bool(0.2) { "fine" } else { "z1" };
            let x = if random.random_bool(0.08) { 900.0 } else { 360.0 + f64::from(k) };
            fine.push(zone == "fine");
            let late = random.random_bool(0.06);
            air.push(!late && zone == "fine" && random.random_bool(0.7));
            body += &match (late, air.last()) {
                (true, _) => format!("MoveL seen,v20,{zone},tool0;\n"),
                (false, Some(true)) => line(x, zone).replace("MoveL", "MoveJ"),
                _ => line(x, zone),
            };
        }
        let (done, _) = done(&module(&body), Cuts::Whole, 0.05);
        let changed: Vec<bool> =
            statuses(&done).iter().map(|s| matches!(s, Changed | MotionStatus::Flagged)).collect();
        for k in 1..changed.len() {
            let apart = fine[k - 1] || air[k];
            assert!(apart || changed[k] == changed[k - 1], "seed {seed}, motion {k}: {changed:?}");
            // What stays keeps its start, but for a single line from a stop to an air move.
            let goes_away = air.get(k + 1).is_none_or(|air| *air);
            let is_tilted = !air[k] && !changed[k] && changed[k - 1];
            assert!(!is_tilted || goes_away && !air[k - 1], "seed {seed}, motion {k}: {changed:?}");
        }
        moved += changed.iter().filter(|c| **c).count();
        kept += changed.iter().filter(|c| !**c).count();
    }
    assert!(moved > 300 && kept > 300, "{moved} {kept}");
}
